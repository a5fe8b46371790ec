//! Small sinusoids around one place, each amplitude at each frequency (P5).

use super::limits::{FREQUENCY, LENGTH, TIMES};
use super::path::Path;
use super::phase::Phase;
use super::{Conditions, Course, Unfit};

/// Rest between two sinusoids, s.
const PAUSE_S: f64 = 1.0;

/// Reversals.
#[derive(Clone, Debug, PartialEq)]
pub struct Reversal {
    /// Amplitudes, m, 1e-6 to 500; the carriage moves forth and back by twice as much.
    pub amplitudes_m: Vec<f64>,
    /// Frequencies, Hz, 1e-4 to 1e3.
    pub frequencies_hz: Vec<f64>,
    /// Periods of each, from 1 on.
    pub cycles: u32,
}

impl Default for Reversal {
    /// 1, 10, 100 µm and 2 mm at two frequencies a decade apart, five periods each.
    fn default() -> Self {
        Reversal { amplitudes_m: vec![1e-6, 1e-5, 1e-4, 2e-3], frequencies_hz: vec![0.05, 0.5], cycles: 5 }
    }
}

impl Reversal {
    /// Samples the profile at a rate; one segment per sinusoid, all frequencies of an amplitude in a row.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check_all("amplitudes", &self.amplitudes_m, LENGTH.0, LENGTH.1, "m")?;
        Unfit::check_all("frequencies", &self.frequencies_hz, FREQUENCY.0, FREQUENCY.1, "Hz")?;
        Unfit::check("cycles", f64::from(self.cycles), TIMES.0, TIMES.1, "")?;
        // a sinusoid has no ramps
        let mut path = Path::new(1.0)?;
        for amplitude_m in &self.amplitudes_m {
            for frequency_hz in &self.frequencies_hz {
                path.segment().rest(PAUSE_S).then(Phase::Sinusoid {
                    amplitude_m: *amplitude_m,
                    frequency_hz: *frequency_hz,
                    cycles: f64::from(self.cycles),
                });
            }
        }
        path.sample("reversal", rate_hz, conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sinusoid_turns_twice_a_period() {
        let reversal = Reversal { amplitudes_m: vec![1e-5, 2e-3], frequencies_hz: vec![0.5, 2.0], cycles: 3 };
        let Course { run, motion } = reversal.course(1000.0, &Conditions::default()).expect("sound");
        assert_eq!(run.parts.len(), 4);
        for (part, amplitude) in run.parts.iter().zip([1e-5, 1e-5, 2e-3, 2e-3]) {
            let v: Vec<f64> =
                motion.velocity_m_s[part.rows.clone()].iter().copied().filter(|v| v.abs() > 1e-9).collect();
            assert_eq!(v.windows(2).filter(|w| w[0] * w[1] < 0.0).count(), 5);
            let most = motion.position_m[part.rows.clone()].iter().fold(0.0f64, |a, x| a.max(*x));
            assert!((most / (2.0 * amplitude) - 1.0).abs() < 1e-6);
        }
    }
}
