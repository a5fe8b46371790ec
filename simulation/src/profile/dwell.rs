//! Ever longer rests, and a slow start after each (P7; with two equal rests the standing part of P0).

use super::limits::{DURATION, LENGTH, SPEED};
use super::path::Path;
use super::{Conditions, Course, Unfit};

/// Dwell and go.
#[derive(Clone, Debug, PartialEq)]
pub struct Dwell {
    /// Rests, s, 0 to 1e7, none shorter than the one before.
    pub dwells_s: Vec<f64>,
    /// Speed of the start after each, m/s, 1e-6 to 20.
    pub speed_m_s: f64,
    /// Distance moved after each rest, always forwards, m, 1e-6 to 500.
    pub length_m: f64,
    /// Acceleration of the ramps, m/s², 1e-3 to 500.
    pub acceleration_m_s2: f64,
}

impl Default for Dwell {
    /// 1, 10, 100 and 1000 s; 10 mm at 0.1 m/min after each.
    fn default() -> Self {
        Dwell {
            dwells_s: vec![1.0, 10.0, 100.0, 1000.0],
            speed_m_s: 0.1 / 60.0,
            length_m: 0.01,
            acceleration_m_s2: 0.5,
        }
    }
}

impl Dwell {
    /// Samples the profile at a rate; all rows are one segment, because the memory of a rest must not end with it.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, rests that get shorter, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check_all("dwells", &self.dwells_s, DURATION.0, DURATION.1, "s")?;
        Unfit::check("speeds", self.speed_m_s, SPEED.0, SPEED.1, "m/s")?;
        Unfit::check("length", self.length_m, LENGTH.0, LENGTH.1, "m")?;
        if let Some(pair) = self.dwells_s.windows(2).find(|pair| pair[1] < pair[0]) {
            return Err(Unfit::NotGrowing { before_s: pair[0], after_s: pair[1] });
        }
        let mut path = Path::new(self.acceleration_m_s2)?;
        path.segment();
        for dwell_s in &self.dwells_s {
            let end_m = path.end_m() + self.length_m;
            path.rest(*dwell_s).go_to(end_m, self.speed_m_s)?;
        }
        path.sample("dwell", rate_hz, conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rests_are_as_long_as_told() {
        let dwell = Dwell { dwells_s: vec![1.0, 10.0, 30.0], ..Dwell::default() };
        let Course { run, motion } = dwell.course(100.0, &Conditions::default()).expect("sound");
        let rests: Vec<usize> = motion
            .velocity_m_s
            .chunk_by(|a, b| (*a == 0.0) == (*b == 0.0))
            .filter(|c| c[0] == 0.0)
            .map(<[f64]>::len)
            .collect();
        for (rows, expected) in rests.iter().zip([100, 1000, 3000]) {
            assert!(rows.abs_diff(expected) <= 2, "{rests:?}");
        }
        assert_eq!(run.parts.len(), 1);
        assert!((motion.position_m[run.len() - 1] - 0.03).abs() < 1e-6);
        let falling = Dwell { dwells_s: vec![10.0, 1.0], ..dwell }.course(100.0, &Conditions::default());
        assert_eq!(falling, Err(Unfit::NotGrowing { before_s: 10.0, after_s: 1.0 }));
    }
}
