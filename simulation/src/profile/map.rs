//! The whole stroke at constant speed, forth and back (P4).

use super::limits::{DURATION, LENGTH, SPEED, TIMES};
use super::path::Path;
use super::{Conditions, Course, Unfit};

/// A map of the rail.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Speeds, m/s, 1e-6 to 20; one segment each.
    pub speeds_m_s: Vec<f64>,
    /// Stroke, ramps included, m, 1e-6 to 500.
    pub length_m: f64,
    /// Number of passes forth and back, from 1 on.
    pub strokes: u32,
    /// Rest at either end, s, 0 to 1e7.
    pub pause_s: f64,
    /// Acceleration of the ramps, m/s², 1e-3 to 500.
    pub acceleration_m_s2: f64,
}

impl Default for Map {
    /// 0.6 and 6 m/min, five times forth and back over half a metre.
    fn default() -> Self {
        Map { speeds_m_s: vec![0.01, 0.1], length_m: 0.5, strokes: 5, pause_s: 0.2, acceleration_m_s2: 0.5 }
    }
}

impl Map {
    /// Samples the profile at a rate; segments count from 1 in the order of the speeds.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, a stroke too short for a speed, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check_all("speeds", &self.speeds_m_s, SPEED.0, SPEED.1, "m/s")?;
        Unfit::check("length", self.length_m, LENGTH.0, LENGTH.1, "m")?;
        Unfit::check("strokes", f64::from(self.strokes), TIMES.0, TIMES.1, "")?;
        Unfit::check("pause", self.pause_s, DURATION.0, DURATION.1, "s")?;
        let mut path = Path::new(self.acceleration_m_s2)?;
        for speed in &self.speeds_m_s {
            path.segment();
            for _ in 0..self.strokes {
                path.rest(self.pause_s).go_to(self.length_m, *speed)?.rest(self.pause_s).go_to(0.0, *speed)?;
            }
        }
        path.sample("map", rate_hz, conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_stroke_is_covered_in_every_segment() {
        let map = Map { strokes: 2, ..Map::default() };
        let Course { run, motion } = map.course(250.0, &Conditions::default()).expect("sound");
        assert_eq!(run.parts.len(), 2);
        for part in &run.parts {
            let x = &motion.position_m[part.rows.clone()];
            let (low, high) = x.iter().fold((1.0f64, -1.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
            assert!(low.abs() < 1e-6 && (high - 0.5).abs() < 1e-6, "{low} {high}");
        }
        let short = Map { length_m: 0.01, ..map }.course(250.0, &Conditions::default());
        assert!(matches!(short, Err(Unfit::TooShort { speed_m_s: 0.1, .. })));
    }
}
