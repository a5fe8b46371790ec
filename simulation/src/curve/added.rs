//! Added curves: unnamed forces in a simulation file, each a curve with its heights.

use super::{Axis, Carrier, Curve};
use crate::mechanism::Context;

/// A curve with heights.
///
/// A curve along time, travel or a clock holds for the recording that it was found in, and one along position for those
/// that share its zero.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedCurve {
    /// Axis, carrier and knots.
    pub curve: Curve,
    /// Height at every knot, in the carrier's unit, -1e12 to 1e12; of a clock the last is the first.
    pub heights: Vec<f64>,
}

impl AddedCurve {
    /// Largest size of a height: with larger ones forces leave the range of numbers.
    pub const MOST: f64 = 1e12;

    /// Whether a file can hold it: two knots or more, strictly rising, within the limits of the axis, each with a
    /// height; a clock must start at 0 and close.
    pub fn is_sound(&self) -> bool {
        let (knots, heights) = (&self.curve.knots, &self.heights);
        let [least, most] = self.curve.axis.ends();
        let closes = || knots.first() == Some(&0.0) && heights.first() == heights.last();
        knots.len() >= 2
            && knots.len() == heights.len()
            && knots.iter().all(|knot| (least..=most).contains(knot))
            && knots.is_sorted_by(|a, b| a < b)
            && heights.iter().all(|height| height.abs() <= Self::MOST)
            && (self.curve.axis != Axis::Clock || (closes() && knots.len() >= 3))
    }

    /// The force that it adds to the law's, N per row; 0 in rows where the axis is unknown and, unless it is the same
    /// in both directions, at rest, where friction is not determined. `None` where the axis is unknown in all rows, or
    /// where the curve [is not sound](AddedCurve::is_sound).
    pub fn force_n(&self, context: &Context<'_>) -> Option<Vec<f64>> {
        if !self.is_sound() {
            return None;
        }
        let (mut force, mut shown) = (vec![0.0; context.len()], false);
        self.curve.each(context, |row, low, [below, above]| {
            shown = true;
            if self.curve.carrier == Carrier::Even || context.steady.direction[row] != 0.0 {
                force[row] = below * self.heights[low] + above * self.heights[low + 1];
            }
        });
        shown.then_some(force)
    }
}
