//! First-order low-pass.     `τ dy/dt = x - y`, `τ = 1/(2π f)`
//!
//! Exact for a signal that is linear between its samples, whatever their spacing:
//! `y = x - sτ + (y₀ - x₀ + sτ) e^(-h/τ)` with the slope `s`.

use core::f64::consts::TAU;

/// The filter and its memory.
#[derive(Clone, Debug)]
pub(super) struct LowPass {
    time_constant_s: f64,
    /// Time, input and output of the last sample.
    last: Option<(f64, f64, f64)>,
}

impl LowPass {
    /// A filter that falls to `1/√2` at this frequency, above 0.
    pub(super) fn new(corner_hz: f64) -> Self {
        LowPass { time_constant_s: 1.0 / (TAU * corner_hz), last: None }
    }

    /// Clears the memory: the next sample counts as having been constant before.
    pub(super) fn restart(&mut self) {
        self.last = None;
    }

    /// Filters the next sample. An unmeasured sample leaves no trace.
    pub(super) fn step(&mut self, time_s: f64, x: f64) -> f64 {
        if x.is_nan() {
            return x;
        }
        let y = match self.last {
            Some((before_s, x0, y0)) if time_s > before_s => {
                let (h, tau) = (time_s - before_s, self.time_constant_s);
                let lag = (x - x0) / h * tau;
                x - lag + (y0 - x0 + lag) * libm::exp(-h / tau)
            }
            _ => x,
        };
        self.last = Some((time_s, x, y));
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_corner_it_halves_the_power_and_lags_an_eighth_turn() {
        let mut filter = LowPass::new(10.0);
        let (mut sin, mut cos) = (0.0, 0.0);
        for n in 0..20_000 {
            let t = f64::from(n) * 1e-4;
            let y = filter.step(t, (TAU * 10.0 * t).sin());
            if n >= 10_000 {
                sin += y * (TAU * 10.0 * t).sin() / 5000.0;
                cos += y * (TAU * 10.0 * t).cos() / 5000.0;
            }
        }
        // 1/(1 + i) = 1/2 - i/2
        assert!((sin - 0.5).abs() < 1e-4 && (cos + 0.5).abs() < 1e-4, "{sin} {cos}");
    }

    #[test]
    fn a_ramp_lags_by_the_time_constant_and_a_gap_in_the_values_is_kept() {
        let mut filter = LowPass::new(1.0 / TAU);
        let y: Vec<f64> = (0..2000).map(|n| filter.step(f64::from(n) * 0.01, f64::from(n) * 0.01)).collect();
        assert!((y[1999] - (19.99 - 1.0)).abs() < 1e-6, "{}", y[1999]);
        assert!(filter.step(20.0, f64::NAN).is_nan());
        assert!(filter.step(20.01, 20.01).is_finite());
        filter.restart();
        assert_eq!(filter.step(30.0, 5.0), 5.0);
    }
}
