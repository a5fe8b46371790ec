//! Strokes to and fro at a staircase of speeds, at one load or at several.

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Rest between two loads, s.
const PAUSE_S: f64 = 1.0;

/// The staircase at every load: up through the speeds, and down again where asked. A segment a load and order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    /// Preloads, N; empty for one staircase at whatever preload there is.
    pub preloads_n: Vec<f64>,
    /// Speeds, m/s.
    pub speeds_m_s: Vec<f64>,
    /// Length of a stroke, m.
    pub stroke_m: f64,
    /// Strokes to and fro at each speed.
    pub repeats: usize,
    /// Whether the speeds are gone down again, which shows warming and starvation.
    pub and_down: bool,
}

impl Profile for Ladder {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("speed", &self.speeds_m_s)?;
        positive("stroke", &[self.stroke_m])?;
        positive("number of repeats", &[self.repeats as f64])?;
        let mut course = Course::new(drive)?;
        let mut preload = Vec::new();
        let loads = if self.preloads_n.is_empty() { &[f64::NAN] } else { self.preloads_n.as_slice() };
        for load in loads {
            for is_down in [false, true].into_iter().take(1 + usize::from(self.and_down)) {
                course.segment();
                course.rest(PAUSE_S)?;
                let mut speeds = self.speeds_m_s.clone();
                if is_down {
                    speeds.reverse();
                }
                for speed in speeds {
                    for _ in 0..self.repeats {
                        course.stroke(self.stroke_m, speed)?;
                        course.stroke(-self.stroke_m, speed)?;
                    }
                }
                course.rest(PAUSE_S)?;
            }
            preload.resize(course.len(), *load);
        }
        let run = course.finish();
        Ok(if self.preloads_n.is_empty() { run } else { Run { preload_n: Some(preload), ..run } })
    }
}
