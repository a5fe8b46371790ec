//! Speed that swings about a mean without ever turning.

use std::f64::consts::TAU;

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Part of the mean speed by which it swings.
const DEPTH: f64 = 0.8;

/// Unidirectional modulation `V = V_0 (1 + 0.8 sin ωt)`, to and fro, a segment a frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Modulation {
    /// Mean speed, m/s.
    pub speed_m_s: f64,
    /// Frequencies, Hz.
    pub frequencies_hz: Vec<f64>,
    /// Periods of each in each direction.
    pub periods: usize,
}

impl Profile for Modulation {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("speed", &[self.speed_m_s])?;
        positive("frequency", &self.frequencies_hz)?;
        positive("number of repeats", &[self.periods as f64])?;
        let mut course = Course::new(drive)?;
        // whole rows, so that no velocity jumps where one piece follows another
        let ramp_s = (self.speed_m_s / drive.acceleration_m_s2 * drive.rate_hz).ceil() / drive.rate_hz;
        let mean = self.speed_m_s;
        for frequency in &self.frequencies_hz {
            course.segment();
            let duration_s = drive.whole(self.periods as f64 / frequency);
            let w = TAU * self.periods as f64 / duration_s;
            for d in [1.0, -1.0] {
                let a = mean / ramp_s;
                course.follow(ramp_s, |t| (d * 0.5 * a * t * t, d * a * t, d * a))?;
                course.follow(duration_s, |t| {
                    let (sin, cos) = (libm::sin(w * t), libm::cos(w * t));
                    (
                        d * mean * (t + DEPTH / w * (1.0 - cos)),
                        d * mean * (1.0 + DEPTH * sin),
                        d * mean * DEPTH * w * cos,
                    )
                })?;
                course.follow(ramp_s, |t| (d * (mean * t - 0.5 * a * t * t), d * (mean - a * t), -d * a))?;
            }
        }
        Ok(course.finish())
    }
}
