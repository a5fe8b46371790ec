//! Sinusoids about one place.

use std::f64::consts::TAU;

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Rest before each sinusoid, s.
const PAUSE_S: f64 = 0.5;

/// Reversal sinusoids: every amplitude at every frequency, a segment each.
#[derive(Clone, Debug, PartialEq)]
pub struct Reversal {
    /// Amplitudes, m.
    pub amplitudes_m: Vec<f64>,
    /// Frequencies, Hz.
    pub frequencies_hz: Vec<f64>,
    /// Periods of each.
    pub periods: usize,
}

impl Profile for Reversal {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("amplitude", &self.amplitudes_m)?;
        positive("frequency", &self.frequencies_hz)?;
        positive("number of repeats", &[self.periods as f64])?;
        let mut course = Course::new(drive)?;
        for amplitude in &self.amplitudes_m {
            for frequency in &self.frequencies_hz {
                course.segment();
                course.rest(PAUSE_S)?;
                let duration_s = drive.whole(self.periods as f64 / frequency);
                let w = TAU * self.periods as f64 / duration_s;
                // starts at rest, at one end of the sinusoid
                course.follow(duration_s, |t| {
                    let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
                    (amplitude * (1.0 - cos), amplitude * w * sin, amplitude * w * w * cos)
                })?;
            }
        }
        Ok(course.finish())
    }
}
