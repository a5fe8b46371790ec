//! A force that nobody has a name for: a curve, piecewise linear along an axis of the run.
//!
//! ```text
//! axis     what it lies along
//! carrier  what it multiplies
//! added    a curve with heights: an entry of a simulation file
//! ```
//!
//! `F = height(axis)·carrier`: linear in the heights at the knots. Beyond the first and the last knot the height stays what
//! it is there.

mod added;
mod axis;
mod carrier;

pub use added::AddedCurve;
pub use axis::Axis;
pub use carrier::Carrier;

use crate::mechanism::Context;

/// A curve along an axis, whatever its heights.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it lies along.
    pub axis: Axis,
    /// What it multiplies.
    pub carrier: Carrier,
    /// Where it may bend, in the unit of the axis, strictly rising, two or more. Those of a clock start at 0, and the last
    /// is its period.
    pub knots: Vec<f64>,
}

impl Curve {
    /// Period of a clock, s.
    pub fn period_s(&self) -> Option<f64> {
        self.knots.last().copied().filter(|_| self.axis == Axis::Clock)
    }

    /// Calls `of(row, below, shares)` for every row that shows the axis: the index of the knot below, and how much of the
    /// carrier, in its unit, that knot and the one above have there. No row of a run that does not show it.
    pub fn each(&self, context: &Context<'_>, mut of: impl FnMut(usize, usize, [f64; 2])) {
        let Some(last) = self.knots.len().checked_sub(2) else { return };
        let Some(values) = self.axis.values(context) else { return };
        for (n, value) in values.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let value = &self.period_s().map_or(*value, |period| value.rem_euclid(period));
            let carrier = self.carrier.of(context, n);
            let low = self.knots.partition_point(|knot| knot <= value).saturating_sub(1).min(last);
            let share = ((value - self.knots[low]) / (self.knots[low + 1] - self.knots[low])).clamp(0.0, 1.0);
            of(n, low, [(1.0 - share) * carrier, share * carrier]);
        }
    }
}

#[cfg(test)]
mod tests;
