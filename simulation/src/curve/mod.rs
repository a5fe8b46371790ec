//! Unnamed forces: curves, piecewise linear along an axis of the run.
//!
//! ```text
//! axis     the axis along which a curve lies
//! carrier  the factor that it multiplies
//! added    a curve with heights: an entry of a simulation file
//! ```
//!
//! `F = height(axis)·carrier`: linear in the heights at the knots. Beyond the first and the last knot the height stays
//! constant.

mod added;
mod axis;
mod carrier;

pub use added::AddedCurve;
pub use axis::Axis;
pub use carrier::Carrier;

use crate::mechanism::Context;

/// A curve along an axis, without heights.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Axis along which it lies.
    pub axis: Axis,
    /// Factor that its height multiplies.
    pub carrier: Carrier,
    /// Positions where it may bend, in the unit of the axis, strictly rising, two or more. A clock's knots start at 0,
    /// and the last is its period.
    pub knots: Vec<f64>,
}

impl Curve {
    /// Period of a clock, s.
    pub fn period_s(&self) -> Option<f64> {
        self.knots.last().copied().filter(|_| self.axis == Axis::Clock)
    }

    /// Calls `of(row, below, shares)` for every row where the axis is known: index of the knot below, and shares of
    /// that knot and of the one above, times the carrier. Skips runs that do not measure the axis.
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
