//! Filters as signal toolboxes define them: Butterworth and Chebyshev low passes, zero phase, and decimation.
//!
//! The poles of the analogue low pass of order n lie at
//!
//! ```text
//! p_k = (-a sin θ_k + i b cos θ_k) tan(π w / 2),   θ_k = π (2k - 1) / 2n,
//! Butterworth a = b = 1;   Chebyshev a = sinh μ, b = cosh μ, μ = asinh(1/ε) / n, ε² = 10^(ripple/10) - 1
//! ```
//!
//! with the corner w as a share of half the rate; the bilinear transform z = (1 + p)/(1 - p) takes them to samples.

use std::f64::consts::PI;

/// A low pass as a chain of second orders, each of gain 1 at rest.
pub(crate) struct LowPass {
    /// Gain and the two feedback coefficients.
    sections: Vec<[f64; 3]>,
}

impl LowPass {
    /// Butterworth of even order.
    pub(crate) fn butterworth(order: usize, corner: f64) -> Self {
        Self::new(order, corner, 1.0, 1.0)
    }

    /// Chebyshev of the first kind of even order; its gain at rest, a common factor, is taken as 1.
    fn chebyshev(order: usize, ripple_db: f64, corner: f64) -> Self {
        let mu = (1.0 / (10f64.powf(ripple_db / 10.0) - 1.0).sqrt()).asinh() / order as f64;
        Self::new(order, corner, mu.sinh(), mu.cosh())
    }

    fn new(order: usize, corner: f64, across: f64, along: f64) -> Self {
        let warped = (PI * corner / 2.0).tan();
        let section = |k: usize| {
            let angle = PI * (2 * k + 1) as f64 / (2 * order) as f64;
            let (re, im) = (-across * angle.sin() * warped, along * angle.cos() * warped);
            // z = (1 + p) / (1 - p)
            let below = (1.0 - re).powi(2) + im * im;
            let (z_re, z_im) = ((1.0 - re * re - im * im) / below, 2.0 * im / below);
            let [a1, a2] = [-2.0 * z_re, z_re * z_re + z_im * z_im];
            [(1.0 + a1 + a2) / 4.0, a1, a2]
        };
        Self { sections: (0..order / 2).map(section).collect() }
    }

    /// One pass, begun as if the first value had lasted for ever.
    fn pass(&self, values: &mut [f64]) {
        for [gain, a1, a2] in &self.sections {
            let Some(&first) = values.first() else { return };
            let mut late = (gain - a2) * first;
            let mut soon = (2.0 * gain - a1) * first + late;
            for value in values.iter_mut() {
                let out = gain * *value + soon;
                soon = 2.0 * gain * *value - a1 * out + late;
                late = gain * *value - a2 * out;
                *value = out;
            }
        }
    }

    /// Forth and back, over ends that are continued point-symmetrically by three orders.
    pub(crate) fn zero_phase(&self, values: &[f64]) -> Vec<f64> {
        let pad = 6 * self.sections.len();
        let (first, last) = (values[0], values[values.len() - 1]);
        let mut all: Vec<f64> = values[1..=pad].iter().rev().map(|v| 2.0 * first - v).collect();
        all.extend(values);
        all.extend(values[values.len() - 1 - pad..values.len() - 1].iter().rev().map(|v| 2.0 * last - v));
        for _ in 0..2 {
            self.pass(&mut all);
            all.reverse();
        }
        all[pad..pad + values.len()].to_vec()
    }
}

/// Every `factor`-th value, the last one among them, behind a Chebyshev low pass of order 8 with 0.05 dB at 0.8 of the
/// new half rate, forth and back.
pub(crate) fn decimate(values: &[f64], factor: usize) -> Vec<f64> {
    let smooth = LowPass::chebyshev(8, 0.05, 0.8 / factor as f64).zero_phase(values);
    smooth.into_iter().skip((values.len() - 1) % factor).step_by(factor).collect()
}

#[test]
fn a_low_pass_lets_slow_pass_and_keeps_its_phase() {
    let wave = |hz: f64| -> Vec<f64> { (0..4000).map(|n| (2.0 * PI * hz * f64::from(n) * 1e-3).sin()).collect() };
    let rms = |v: &[f64]| (v.iter().map(|x| x * x).sum::<f64>() / v.len() as f64).sqrt();
    let filter = LowPass::butterworth(4, 0.2);
    let slow = wave(10.0);
    let error: Vec<f64> = filter.zero_phase(&slow).iter().zip(&slow).map(|(a, b)| a - b).collect();
    assert!(rms(&error) < 1e-3, "{}", rms(&error));
    // both passes lose 3 dB each at the corner
    let corner = filter.zero_phase(&wave(100.0));
    assert!((rms(&corner) / rms(&wave(100.0)) - 0.5).abs() < 1e-3);
    let few = decimate(&wave(80.0), 10);
    // away from the ends, which begin and end abruptly
    assert!(few.len() == 400 && rms(&few[20..380]) < 1e-4, "{}", rms(&few[20..380]));
}
