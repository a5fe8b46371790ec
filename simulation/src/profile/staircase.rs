//! Every speed of a list, forth and back over the same place (P1; at another temperature P3, with a known weight P9).

use super::limits::{DURATION, LENGTH, SPEED, TIMES};
use super::paper_grid::SPEEDS_M_MIN;
use super::path::Path;
use super::{Conditions, Course, Unfit};

/// Order in which the speeds are driven.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// In the order of the list.
    Up,
    /// From the last to the first.
    Down,
    /// Both, one segment each: effects of time differ between the two, effects of speed do not.
    Both,
}

/// A speed staircase.
#[derive(Clone, Debug, PartialEq)]
pub struct Staircase {
    /// Speeds, m/s, 1e-6 to 20.
    pub speeds_m_s: Vec<f64>,
    /// Least travel at constant speed, m, 1e-6 to 500; all strokes start at the same place and so have this much in
    /// common.
    pub length_m: f64,
    /// Least time at constant speed, s, 0 to 1e7.
    pub hold_s: f64,
    /// Number of strokes forth and back per speed, from 1 on.
    pub strokes: u32,
    /// Their order.
    pub order: Order,
    /// Rest before every stroke, s, 0 to 1e7.
    pub pause_s: f64,
    /// Acceleration of the ramps, m/s², 1e-3 to 500.
    pub acceleration_m_s2: f64,
}

impl Default for Staircase {
    /// The paper's 20 speeds; five ball passes of 14.3 mm and 2 s at each.
    fn default() -> Self {
        Staircase {
            speeds_m_s: SPEEDS_M_MIN.map(|v| v / 60.0).to_vec(),
            length_m: 0.072,
            hold_s: 2.0,
            strokes: 1,
            order: Order::Both,
            pause_s: 0.2,
            acceleration_m_s2: 0.5,
        }
    }
}

impl Staircase {
    /// Samples the profile at a rate; segment 1, and 2 for the way down the list where both are driven.
    ///
    /// # Errors
    /// [`Unfit`]: a number that is not legal, too many rows.
    pub fn course(&self, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        let mut path = Path::new(self.acceleration_m_s2)?;
        self.drive(&mut path)?;
        path.sample("staircase", rate_hz, conditions)
    }

    /// Appends the strokes; each order is one segment.
    pub(super) fn drive(&self, path: &mut Path) -> Result<(), Unfit> {
        Unfit::check_all("speeds", &self.speeds_m_s, SPEED.0, SPEED.1, "m/s")?;
        Unfit::check("length", self.length_m, LENGTH.0, LENGTH.1, "m")?;
        Unfit::check("hold", self.hold_s, DURATION.0, DURATION.1, "s")?;
        Unfit::check("pause", self.pause_s, DURATION.0, DURATION.1, "s")?;
        Unfit::check("strokes", f64::from(self.strokes), TIMES.0, TIMES.1, "")?;
        if matches!(self.order, Order::Up | Order::Both) {
            self.drive_all(path.segment(), self.speeds_m_s.iter())?;
        }
        if matches!(self.order, Order::Down | Order::Both) {
            self.drive_all(path.segment(), self.speeds_m_s.iter().rev())?;
        }
        Ok(())
    }

    fn drive_all<'a>(&self, path: &mut Path, speeds: impl Iterator<Item = &'a f64>) -> Result<(), Unfit> {
        let start_m = path.end_m();
        for speed in speeds {
            let cruise_m = self.length_m.max(speed * self.hold_s);
            let end_m = start_m + cruise_m + 2.0 * path.ramp_m(*speed);
            for _ in 0..self.strokes {
                path.rest(self.pause_s).go_to(end_m, *speed)?.rest(self.pause_s).go_to(start_m, *speed)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_speed_is_held_both_ways_long_enough() {
        let staircase = Staircase::default();
        let rate = 250.0;
        let Course { run, motion } = staircase.course(rate, &Conditions::default()).expect("sound");
        for speed in &staircase.speeds_m_s {
            for sign in [-1.0, 1.0] {
                let rows = motion.velocity_m_s.iter().filter(|v| **v == sign * speed).count();
                // up and down; the row at either end may be missing
                let needed = 2.0 * (2.0f64.max(0.072 / speed) * rate - 2.0);
                assert!(rows as f64 >= needed, "{speed} m/s: {rows} rows");
            }
        }
        assert_eq!(run.parts.iter().map(|part| part.segment).collect::<Vec<_>>(), [Some(1), Some(2)]);
        let (up, down) = (&run.parts[0].rows, &run.parts[1].rows);
        assert!(up.len().abs_diff(down.len()) <= 1);
    }

    #[test]
    fn a_list_that_cannot_be_driven_is_refused() {
        let of = |speeds: &[f64]| {
            Staircase { speeds_m_s: speeds.to_vec(), ..Staircase::default() }.course(100.0, &Conditions::default())
        };
        assert_eq!(of(&[]), Err(Unfit::Nothing("speeds")));
        for speed in [0.0, -0.1, 30.0, f64::NAN] {
            assert!(matches!(of(&[0.1, speed]), Err(Unfit::OutOfRange { what: "speeds", .. })), "{speed}");
        }
        let none = Staircase { strokes: 0, ..Staircase::default() }.course(100.0, &Conditions::default());
        assert!(matches!(none, Err(Unfit::OutOfRange { what: "strokes", .. })));
    }
}
