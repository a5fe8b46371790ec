//! Sensors between a run and its recording.
//!
//! ```text
//! force     -> first-order low-pass -> + noise √((r F)² + σ²) -> steps -> rails
//! velocity  -> + noise
//! position  -> steps
//! ```
//!
//! Noise is added after everything but the steps: it has the stated size in the recording, whatever the filter. It is
//! white; every sensor has its own sequence of the seed, so that adding a sensor leaves the others unchanged.

mod low_pass;
mod noise;

use low_pass::LowPass;
pub use noise::Noise;

use crate::run::{Break, Run};

/// Effects of the sensors on a run; 0 is none. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensors {
    /// Noise of the force relative to the force, standard deviation, 0 to 1.
    pub noise_relative: f64,
    /// Noise of the force, standard deviation, N, 0 to 1e4.
    pub noise_n: f64,
    /// Steps of the force, N, 0 to 1e4.
    pub quantum_n: f64,
    /// Smallest and largest force that the sensor shows, N.
    pub rails_n: Option<(f64, f64)>,
    /// Frequency at which the force falls to `1/√2`, Hz; `None` without a filter.
    pub lowpass_hz: Option<f64>,
    /// Noise of the velocity, standard deviation, m/s, 0 to 20.
    pub speed_noise_m_s: f64,
    /// Steps of the position, m, 0 to 1. An encoder shows the last step passed.
    pub position_quantum_m: f64,
    /// Noise of every temperature, standard deviation, K, 0 to 50.
    pub temperature_noise_k: f64,
}

/// Index of a sensor's noise sequence.
#[derive(Clone, Copy)]
enum Stream {
    Force,
    Velocity,
    Block,
    Rail,
    Ambient,
}

impl Sensors {
    /// Checks all numbers; an illegal one is returned with its name, value, limits and unit.
    ///
    /// # Errors
    /// The first illegal number.
    pub fn check(&self) -> Result<(), BadSensor> {
        for (what, value, most, unit) in [
            ("noise-relative", self.noise_relative, 1.0, ""),
            ("noise-n", self.noise_n, 1e4, "N"),
            ("quantum-n", self.quantum_n, 1e4, "N"),
            ("speed-noise", self.speed_noise_m_s, 20.0, "m/s"),
            ("position-quantum-m", self.position_quantum_m, 1.0, "m"),
            ("temperature-noise", self.temperature_noise_k, 50.0, "K"),
        ] {
            if !(0.0..=most).contains(&value) {
                return Err(BadSensor { what, value, min: 0.0, max: most, unit });
            }
        }
        match self.lowpass_hz {
            Some(hz) if !(1e-4..=1e6).contains(&hz) => {
                Err(BadSensor { what: "lowpass-hz", value: hz, min: 1e-4, max: 1e6, unit: "Hz" })
            }
            _ => Ok(()),
        }
    }

    /// Turns a true run into what a recorder would have written. The same seed gives the same run on every machine.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn apply(&self, run: &mut Run, seed: u64) -> Result<(), BadSensor> {
        self.check()?;
        if let Some(hz) = self.lowpass_hz {
            let mut filter = LowPass::new(hz);
            for part in &run.parts {
                // a sensor does not know of segments; it restarts only where time breaks
                if part.starts != Break::Segment {
                    filter.restart();
                }
                for n in part.rows.clone() {
                    run.drag_force_n[n] = filter.step(run.time_s[n], run.drag_force_n[n]);
                }
            }
        }
        let noise = |stream: Stream| Noise::new(seed, stream as u64);
        if self.noise_relative > 0.0 || self.noise_n > 0.0 {
            let mut force = noise(Stream::Force);
            for f in &mut run.drag_force_n {
                *f += libm::hypot(self.noise_relative * *f, self.noise_n) * force.gaussian();
            }
        }
        if self.quantum_n > 0.0 {
            run.drag_force_n.iter_mut().for_each(|f| *f = libm::round(*f / self.quantum_n) * self.quantum_n);
        }
        if let Some((low, high)) = self.rails_n {
            run.drag_force_n.iter_mut().for_each(|f| *f = f.max(low).min(high));
        }
        add(&mut run.velocity_m_s, self.speed_noise_m_s, noise(Stream::Velocity));
        if let Some(position) = run.position_m.as_mut().filter(|_| self.position_quantum_m > 0.0) {
            let step = self.position_quantum_m;
            position.iter_mut().for_each(|x| *x = libm::floor(*x / step) * step);
        }
        add(&mut run.temperature_block_degc, self.temperature_noise_k, noise(Stream::Block));
        add(&mut run.temperature_rail_degc, self.temperature_noise_k, noise(Stream::Rail));
        add(&mut run.temperature_ambient_degc, self.temperature_noise_k, noise(Stream::Ambient));
        Ok(())
    }
}

/// An illegal number of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} must lie between {min} and {max} {unit}, not {value}")]
pub struct BadSensor {
    /// Which one, by the name of the command's option.
    pub what: &'static str,
    /// What was given.
    pub value: f64,
    /// Smallest legal value.
    pub min: f64,
    /// Largest legal value.
    pub max: f64,
    /// Unit of all three.
    pub unit: &'static str,
}

fn add(column: &mut Option<Vec<f64>>, sigma: f64, mut noise: Noise) {
    if let Some(column) = column.as_mut().filter(|_| sigma > 0.0) {
        column.iter_mut().for_each(|x| *x += sigma * noise.gaussian());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Part;

    fn run(force: impl Fn(f64) -> f64) -> Run {
        let time_s: Vec<f64> = (0..50_000).map(|n| f64::from(n) * 1e-3).collect();
        Run {
            drag_force_n: time_s.iter().map(|t| force(*t)).collect(),
            position_m: Some(time_s.iter().map(|t| 0.01 * t).collect()),
            velocity_m_s: Some(vec![0.01; 50_000]),
            parts: vec![Part { rows: 0..50_000, segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        }
    }

    fn applied(sensors: Sensors, seed: u64) -> Run {
        let mut run = run(|_| 50.0);
        sensors.apply(&mut run, seed).expect("legal");
        run
    }

    fn sigma(column: &[f64], around: f64) -> f64 {
        (column.iter().map(|x| (x - around) * (x - around)).sum::<f64>() / column.len() as f64).sqrt()
    }

    #[test]
    fn noise_has_the_stated_size_whatever_the_filter() {
        let sensors = Sensors { noise_relative: 0.01, noise_n: 0.1, lowpass_hz: Some(5.0), ..Sensors::default() };
        let run = applied(sensors, 1);
        // 1 % of 50 N and 0.1 N; 50 000 rows give its size to 0.3 %
        let expected = 0.5f64.hypot(0.1);
        assert!((sigma(&run.drag_force_n, 50.0) / expected - 1.0).abs() < 0.012);
        let fast = applied(Sensors { speed_noise_m_s: 1e-4, ..Sensors::default() }, 1);
        assert!((sigma(fast.velocity_m_s.as_ref().expect("set"), 0.01) / 1e-4 - 1.0).abs() < 0.012);
    }

    #[test]
    fn one_more_sensor_leaves_the_others_as_they_were() {
        let noisy = Sensors { noise_n: 0.1, ..Sensors::default() };
        let more = Sensors { speed_noise_m_s: 1e-4, temperature_noise_k: 0.1, ..noisy };
        assert_eq!(applied(noisy, 7).drag_force_n, applied(more, 7).drag_force_n);
        assert_ne!(applied(noisy, 7).drag_force_n, applied(noisy, 8).drag_force_n);
        assert_eq!(applied(Sensors::default(), 7), run(|_| 50.0));
    }

    #[test]
    fn beyond_its_rails_the_sensor_shows_nothing_more() {
        let mut run = run(|t| 10.0 * (t - 25.0));
        Sensors { rails_n: Some((-100.0, 99.0)), ..Sensors::default() }.apply(&mut run, 1).expect("legal");
        assert_eq!((run.drag_force_n[0], run.drag_force_n[49_999], run.drag_force_n[25_000]), (-100.0, 99.0, 0.0));
    }

    #[test]
    fn steps_are_where_they_should_be() {
        let sensors = Sensors { noise_n: 1.0, quantum_n: 0.25, position_quantum_m: 5e-6, ..Sensors::default() };
        let run = applied(sensors, 1);
        assert!(run.drag_force_n.iter().all(|f| (f / 0.25).fract() == 0.0));
        for (t, x) in run.time_s.iter().zip(run.position_m.as_ref().expect("set")) {
            let behind = 0.01 * t - x;
            assert!((-1e-12..5e-6 + 1e-12).contains(&behind), "{behind}");
        }
    }

    #[test]
    fn a_number_out_of_range_is_named() {
        for (what, sensors) in [
            ("noise-n", Sensors { noise_n: -1.0, ..Sensors::default() }),
            ("noise-relative", Sensors { noise_relative: f64::NAN, ..Sensors::default() }),
            ("lowpass-hz", Sensors { lowpass_hz: Some(0.0), ..Sensors::default() }),
        ] {
            assert_eq!(sensors.apply(&mut run(|_| 1.0), 1).expect_err("refused").what, what);
        }
    }
}
