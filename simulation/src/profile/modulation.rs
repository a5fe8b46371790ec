//! A speed that swells and falls without turning back (P6).

use super::limits::{DURATION, FREQUENCY, SPEED, TIMES};
use super::path::Path;
use super::phase::Phase;
use super::{Conditions, Course, Unfit};

/// A modulated speed, `V = V_0 (1 + d sin 2πft)`, forth and then back.
#[derive(Clone, Debug, PartialEq)]
pub struct Modulation {
    /// Mean speed V_0, m/s, 1e-6 to 20.
    pub speed_m_s: f64,
    /// Depth d, 0 to 0.99: the carriage never stands.
    pub depth: f64,
    /// Frequencies, Hz, 1e-4 to 1e3; one segment each.
    pub frequencies_hz: Vec<f64>,
    /// Least number of periods, from 1 on.
    pub cycles: u32,
    /// Least time at each frequency and in each direction, s, 0 to 1e7; rounded up to whole periods.
    pub hold_s: f64,
    /// Acceleration of the ramps, m/s², 1e-3 to 500.
    pub acceleration_m_s2: f64,
}

impl Default for Modulation {
    /// 0.6 m/min (1 + 0.8 sin) at 0.1, 1 and 5 Hz, 10 s of each and at least three periods.
    fn default() -> Self {
        Modulation {
            speed_m_s: 0.01,
            depth: 0.8,
            frequencies_hz: vec![0.1, 1.0, 5.0],
            cycles: 3,
            hold_s: 10.0,
            acceleration_m_s2: 0.5,
        }
    }
}

impl Modulation {
    /// Samples the profile at a rate; segments count from 1 in the order of the frequencies.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check("speeds", self.speed_m_s, SPEED.0, SPEED.1, "m/s")?;
        Unfit::check("depth", self.depth, 0.0, 0.99, "")?;
        Unfit::check_all("frequencies", &self.frequencies_hz, FREQUENCY.0, FREQUENCY.1, "Hz")?;
        Unfit::check("cycles", f64::from(self.cycles), TIMES.0, TIMES.1, "")?;
        Unfit::check("hold", self.hold_s, DURATION.0, DURATION.1, "s")?;
        let mut path = Path::new(self.acceleration_m_s2)?;
        for frequency_hz in self.frequencies_hz.iter().copied() {
            path.segment();
            let cycles = (self.hold_s * frequency_hz).ceil().max(f64::from(self.cycles));
            for mean in [self.speed_m_s, -self.speed_m_s] {
                let duration_s = path.ramp_s(mean);
                path.rest(0.5)
                    .then(Phase::Ramp { from: 0.0, to: mean, duration_s })
                    .then(Phase::Modulated { mean, depth: self.depth, frequency_hz, cycles })
                    .then(Phase::Ramp { from: mean, to: 0.0, duration_s });
            }
        }
        path.sample("modulation", rate_hz, conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_swings_and_never_turns() {
        let Course { run, motion } = Modulation::default().course(1000.0, &Conditions::default()).expect("sound");
        assert_eq!(run.parts.len(), 3);
        for part in &run.parts {
            let v = &motion.velocity_m_s[part.rows.clone()];
            let turns =
                v.iter().filter(|v| **v != 0.0).collect::<Vec<_>>().windows(2).filter(|w| *w[0] * *w[1] < 0.0).count();
            assert_eq!(turns, 1, "once, between forth and back");
            let (low, high) = v.iter().fold((1.0f64, -1.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
            assert!((high - 0.018).abs() < 1e-5 && (low + 0.018).abs() < 1e-5, "{low} {high}");
            let end = motion.position_m[part.rows.end - 1];
            assert!(end.abs() < 1e-5, "{end}");
        }
        let still = Modulation { depth: 1.0, ..Modulation::default() }.course(100.0, &Conditions::default());
        assert!(matches!(still, Err(Unfit::OutOfRange { what: "depth", .. })));
    }
}
