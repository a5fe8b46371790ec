//! To and fro until all is warm, a pause, and on again.

use super::course::Course;
use super::{Drive, Profile, Undrivable, positive};
use crate::run::Run;

/// Rise of the block over the surroundings when all is warm, K, and the time that it takes, s.
const BLOCK: (f64, f64) = (12.0, 1500.0);
/// The same of the rail, which is heavier and touches the machine.
const RAIL: (f64, f64) = (7.0, 3600.0);

/// Warm-up. Three segments: running, pause, running.
///
/// Block and rail approach their rise as `1 - e^(-t/τ)` while the axis runs and lose it with the same τ while it
/// stands. The rise is that of a busy axis, not a result of the friction simulated here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmUp {
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// Length of a stroke, m.
    pub stroke_m: f64,
    /// Duration of the first running, s; the pause takes half and the second running a tenth of it.
    pub duration_s: f64,
    /// Temperature of the surroundings, °C.
    pub ambient_degc: f64,
}

impl Profile for WarmUp {
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable> {
        positive("speed", &[self.speed_m_s])?;
        positive("stroke", &[self.stroke_m])?;
        positive("duration", &[self.duration_s])?;
        let mut course = Course::new(drive)?;
        let mut runs = Vec::new();
        for (share, is_running) in [(1.0, true), (0.5, false), (0.1, true)] {
            course.segment();
            let end = course.len() + (share * self.duration_s * drive.rate_hz) as usize;
            if is_running {
                // whole strokes to and fro, at least one
                loop {
                    course.stroke(self.stroke_m, self.speed_m_s)?;
                    course.stroke(-self.stroke_m, self.speed_m_s)?;
                    if course.len() >= end {
                        break;
                    }
                }
            } else {
                course.rest(share * self.duration_s)?;
            }
            runs.resize(course.len(), is_running);
        }
        let column = |(rise, time): (f64, f64)| -> Vec<f64> {
            let keep = libm::exp(-1.0 / (drive.rate_hz * time));
            let mut above = 0.0;
            let next = |is_running: &bool| {
                let now = above;
                above = above * keep + if *is_running { rise * (1.0 - keep) } else { 0.0 };
                self.ambient_degc + now
            };
            runs.iter().map(next).collect()
        };
        let (block, rail) = (column(BLOCK), column(RAIL));
        let ambient = vec![self.ambient_degc; runs.len()];
        Ok(Run {
            temperature_block_degc: Some(block),
            temperature_rail_degc: Some(rail),
            temperature_ambient_degc: Some(ambient),
            ..course.finish()
        })
    }
}
