//! Rest, start slowly, rest longer.

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Dwell-and-go. A segment a dwell.
#[derive(Clone, Debug, PartialEq)]
pub struct Dwell {
    /// Times of rest, s.
    pub dwells_s: Vec<f64>,
    /// Speed after each, m/s.
    pub speed_m_s: f64,
    /// Way after each, m.
    pub stroke_m: f64,
    /// How often all of it is done.
    pub repeats: usize,
}

impl Profile for Dwell {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("dwell", &self.dwells_s)?;
        positive("speed", &[self.speed_m_s])?;
        positive("stroke", &[self.stroke_m])?;
        positive("number of repeats", &[self.repeats as f64])?;
        let mut course = Course::new(drive)?;
        for _ in 0..self.repeats {
            for dwell in &self.dwells_s {
                course.segment();
                // both directions, each after the same rest
                for d in [1.0, -1.0] {
                    course.rest(*dwell)?;
                    course.stroke(d * self.stroke_m, self.speed_m_s)?;
                }
            }
        }
        Ok(course.finish())
    }
}
