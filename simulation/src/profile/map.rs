//! The full stroke, to and fro, at a slow and a fast speed.

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Full-stroke map. A segment a speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Speeds, m/s.
    pub speeds_m_s: Vec<f64>,
    /// Length of the rail that is covered, m.
    pub length_m: f64,
    /// How often it is covered to and fro at each speed.
    pub repeats: usize,
}

impl Profile for Map {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("speed", &self.speeds_m_s)?;
        positive("length", &[self.length_m])?;
        positive("number of repeats", &[self.repeats as f64])?;
        let mut course = Course::new(drive)?;
        for speed in &self.speeds_m_s {
            course.segment();
            for _ in 0..self.repeats {
                course.stroke(self.length_m, *speed)?;
                course.stroke(-self.length_m, *speed)?;
            }
        }
        Ok(course.finish())
    }
}
