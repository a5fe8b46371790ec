//! What sensors make of a simulated run: filter, noise, steps.
//!
//! ```text
//! force:    law -> first-order low-pass -> + noise (part of the force, and N) -> steps of the converter
//! position: motion -> steps of the encoder;   velocity: motion -> + noise
//! ```

use std::f64::consts::TAU;

use model_core::calibration::Calibration;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use simulation::run::Run;

/// Sensors. 0 everywhere is a perfect one. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Noise of the force, 1 σ, of the force.
    pub noise_relative: f64,
    /// Noise of the force, 1 σ, N.
    pub noise_n: f64,
    /// Step of the force, N.
    pub quantum_n: f64,
    /// Corner of the force's first-order low-pass, Hz.
    pub lowpass_hz: f64,
    /// Noise of the velocity, 1 σ, m/s.
    pub speed_noise_m_s: f64,
    /// Step of the position, m.
    pub position_quantum_m: f64,
}

impl Sensors {
    /// Those of the project's bench: 12-bit converter over ±100 N with half a step of noise, filter of 100 Hz, 5 µm
    /// encoder.
    pub fn block() -> Self {
        let bench = Calibration::BENCH;
        let step = f64::from(bench.force.newtons_per_code);
        Sensors {
            noise_relative: 0.0,
            noise_n: 0.5 * step,
            quantum_n: step,
            lowpass_hz: 100.0,
            speed_noise_m_s: 0.0,
            position_quantum_m: f64::from(bench.metres_per_count),
        }
    }

    /// Makes a run what these sensors would have recorded of it. The same seed gives the same numbers, on every machine.
    pub fn record(&self, run: &mut Run, seed: u64) {
        // one generator a sensor: that one is switched off changes nothing of the others
        let generator = |sensor: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(sensor);
            random
        };
        if self.lowpass_hz > 0.0 {
            lowpass(run, self.lowpass_hz);
        }
        if self.noise_relative > 0.0 || self.noise_n > 0.0 {
            let mut random = generator(0);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            for force in &mut run.drag_force_n {
                *force = *force * (1.0 + self.noise_relative * normal()) + self.noise_n * normal();
            }
        }
        round(&mut run.drag_force_n, self.quantum_n);
        if let Some(position) = &mut run.position_m {
            round(position, self.position_quantum_m);
        }
        if let Some(velocity) = run.velocity_m_s.as_mut().filter(|_| self.speed_noise_m_s > 0.0) {
            let mut random = generator(1);
            for v in velocity {
                let noise: f64 = StandardNormal.sample(&mut random);
                *v += self.speed_noise_m_s * noise;
            }
        }
        // what is measured by steps tells its speed by itself
        if self.position_quantum_m > 0.0 {
            run.velocity_m_s = None;
        }
    }
}

/// `y' = (F - y)/τ`, exact for a force that is constant from row to row; starts settled in every part.
fn lowpass(run: &mut Run, corner_hz: f64) {
    let keep = (-TAU * corner_hz * run.step_s()).exp();
    for part in &run.parts {
        let mut state = f64::NAN;
        for force in &mut run.drag_force_n[part.rows.clone()] {
            state = if state.is_finite() { *force + (state - *force) * keep } else { *force };
            *force = state;
        }
    }
}

fn round(column: &mut [f64], step: f64) {
    if step > 0.0 {
        for x in column {
            *x = (*x / step).round() * step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::run::{Break, Part};

    fn flat(rows: usize, force: f64) -> Run {
        Run {
            time_s: (0..rows).map(|n| n as f64 * 1e-3).collect(),
            drag_force_n: vec![force; rows],
            position_m: Some((0..rows).map(|n| n as f64 * 1e-6).collect()),
            velocity_m_s: Some(vec![1e-3; rows]),
            parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
            ..Run::default()
        }
    }

    #[test]
    fn noise_has_its_size_and_its_seed() {
        let sensors = Sensors { noise_relative: 0.01, noise_n: 0.1, ..Sensors::default() };
        let record = |seed: u64| {
            let mut run = flat(100_000, 20.0);
            sensors.record(&mut run, seed);
            run
        };
        let (one, again, other) = (record(1), record(1), record(2));
        assert_eq!(one, again);
        assert_ne!(one, other);
        let square: f64 = one.drag_force_n.iter().map(|f| (f - 20.0) * (f - 20.0)).sum();
        assert!(((square / 1e5).sqrt() / (0.2f64 * 0.2 + 0.1 * 0.1).sqrt() - 1.0).abs() < 0.01);
        assert_eq!(one.velocity_m_s, flat(100_000, 20.0).velocity_m_s);
    }

    #[test]
    fn filter_and_steps_do_what_they_say() {
        let mut run = flat(2000, 0.0);
        run.drag_force_n[1000..].fill(10.0);
        Sensors { lowpass_hz: 10.0, ..Sensors::default() }.record(&mut run, 1);
        // after one time constant of 15.9 ms a step has reached 63 %
        assert!((run.drag_force_n[1015] - 10.0 * (1.0 - (-1.005f64).exp())).abs() < 0.05, "{}", run.drag_force_n[1015]);
        let mut run = flat(100, 3.217);
        Sensors::block().record(&mut run, 1);
        let step = 100.0 / 2048.0;
        assert!(run.drag_force_n.iter().all(|f| ((f / step).round() * step - f).abs() < 1e-12));
        assert!(run.velocity_m_s.is_none());
    }
}
