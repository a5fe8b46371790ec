//! Rail table: an effect tied to places on the rail, piecewise linear between knots.
//!
//! `w(x)` interpolates the table at x and keeps its end values beyond the ends; a window takes the exact mean of w over
//! its travel.
//! Source: `docs/mechanisms.md`, `rail-joint`, `contamination`.

use super::Passage;
use super::wave::Acts;
use crate::Error;
use crate::quantity::check_f32;

/// Largest number of knots of a table.
pub const KNOTS: usize = 64;

/// A table along the rail.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct RailTable {
    /// Quantity that the table gives.
    pub acts: Acts,
    /// Place of the first knot, m.
    pub from_m: f32,
    /// Distance of two knots, m.
    pub step_m: f32,
    /// Knots in use, 2 to 64; 0: no table.
    pub knots: u8,
    /// Relative preload, or N, per 1 of `values`.
    pub scale: f32,
    /// The knots, in rows of sixteen.
    pub values: [[i16; 16]; KNOTS / 16],
}

impl RailTable {
    /// None.
    pub const NONE: RailTable = RailTable {
        acts: Acts::Preload,
        from_m: 0.0,
        step_m: 0.0,
        knots: 0,
        scale: 0.0,
        values: [[0; 16]; KNOTS / 16],
    };

    pub(super) fn acts(&self) -> bool {
        self.knots != 0
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("place_m", self.from_m)?;
        if !self.acts() {
            return Ok(());
        }
        check_f32("rail_knots", f32::from(self.knots))?;
        check_f32("rail_step_m", self.step_m)?;
        let largest = self.values.as_flattened().iter().fold(0, |a: u16, v| a.max(v.unsigned_abs()));
        let amplitude = self.acts.quantity();
        check_f32(amplitude, self.scale)?;
        check_f32(amplitude, f32::from(largest) * self.scale)
    }

    /// Mean over a window.
    pub fn mean(&self, passage: &Passage) -> f32 {
        let half = 0.5 * passage.travel_m.abs();
        // places in knots: where the window begins and ends
        let middle = passage.place_m - self.from_m;
        let (from, to) = ((middle - half) / self.step_m, (middle + half) / self.step_m);
        let last = f32::from(self.knots.max(1) - 1);
        let width = to - from;
        // over less than a hundredth of a knot distance the sum would be lost in rounding: take the middle
        if width < 0.01 {
            return self.scale * self.at(0.5 * (from + to), last);
        }
        // before the first knot, behind the last one
        let before = (to.min(0.0) - from.min(0.0)) * self.knot(0);
        let behind = (to.max(last) - from.max(last)) * self.knot(usize::from(self.knots.max(1) - 1));
        let (from, to) = (from.max(0.0).min(last), to.max(0.0).min(last));
        let mut sum = before + behind;
        let mut at = from;
        // every iteration passes a knot: never more than the table has
        for _ in 0..KNOTS {
            if at >= to {
                break;
            }
            let end = ((at as u32 + 1) as f32).min(to);
            sum += (end - at) * self.at(0.5 * (at + end), last);
            at = end;
        }
        self.scale * sum / width
    }

    fn at(&self, place: f32, last: f32) -> f32 {
        let place = place.max(0.0).min(last);
        let below = place as usize;
        let low = self.knot(below);
        low + (place - below as f32) * (self.knot(below + 1) - low)
    }

    fn knot(&self, n: usize) -> f32 {
        let n = n.min(usize::from(self.knots.max(1) - 1));
        self.values.as_flattened().get(n).copied().map_or(0.0, f32::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> RailTable {
        let mut table = RailTable { from_m: -0.1, step_m: 0.016, knots: 40, scale: 1e-5, ..RailTable::NONE };
        for (n, value) in table.values.as_flattened_mut().iter_mut().enumerate() {
            *value = ((n * 7919) % 4001) as i16 - 2000;
        }
        table
    }

    fn passage(place_m: f32, travel_m: f32) -> Passage {
        Passage {
            speed_m_s: 0.01,
            acceleration_m_s2: 0.0,
            force_rate_n_s: 0.0,
            viscosity_cst: 100.0,
            place_m,
            travel_m,
        }
    }

    fn line(table: &RailTable, x: f64) -> f64 {
        let knots = &table.values.as_flattened()[..usize::from(table.knots)];
        let u = ((x - f64::from(table.from_m)) / f64::from(table.step_m)).clamp(0.0, (knots.len() - 1) as f64);
        let n = (u as usize).min(knots.len() - 2);
        let (a, b) = (f64::from(knots[n]), f64::from(knots[n + 1]));
        f64::from(table.scale) * (a + (u - n as f64) * (b - a))
    }

    #[test]
    fn the_mean_is_that_of_many_places_inside_and_outside() {
        let table = table();
        assert_eq!(table.check(), Ok(()));
        for (place, travel) in [
            (0.0, 1e-6),
            (0.0313, -0.0005),
            (0.2, 0.032),
            (-0.1, 0.05),
            (0.53, 0.04),
            (-3.0, 0.1),
            (9.0, -0.3),
            (0.2, 2.0),
        ] {
            let steps = 100_000;
            let sum: f64 = (0..steps)
                .map(|n| f64::from(travel) * ((f64::from(n) + 0.5) / f64::from(steps) - 0.5))
                .map(|dx| line(&table, f64::from(place) + dx))
                .sum();
            let got = f64::from(table.mean(&passage(place, travel)));
            let want = sum / f64::from(steps);
            assert!((got - want).abs() < 1e-6, "{place} {travel}: {got} {want}");
        }
    }

    #[test]
    fn a_table_never_asks_beyond_itself() {
        for knots in [0, 1, 2, 64, 255] {
            let table = RailTable { knots, ..table() };
            for place in [-1e9, 0.0, 0.3, 1e9] {
                assert!(table.mean(&passage(place, 0.02)).is_finite());
            }
        }
    }
}
