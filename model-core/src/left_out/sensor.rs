//! Errors of the force channel.
//!
//! `F = force + offset + gain_error·D - lag·dF/dt`, the last term for windows over which the force changes evenly.
//! Source: `docs/mechanisms.md`, `force-offset`, `force-gain`, `force-lowpass`, `time-misalignment`.

use crate::Error;
use crate::quantity::check_f32;

/// Errors of the force channel that were found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Sensor {
    /// Reading without force, N.
    pub offset_n: f32,
    /// Relative error of the scale, on the law's force.
    pub gain_error: f32,
    /// Time constant of a first-order lag, s; negative where the force leads.
    pub lag_s: f32,
}

impl Sensor {
    /// None.
    pub const NONE: Sensor = Sensor { offset_n: 0.0, gain_error: 0.0, lag_s: 0.0 };

    pub(super) fn acts(&self) -> bool {
        *self != Self::NONE
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("left_out_force_n", self.offset_n)?;
        check_f32("left_out_part", self.gain_error)?;
        check_f32("lag_s", self.lag_s)
    }

    /// Shift of the force by offset and lag, N; `rate_n_s` is the change of the measured force, N/s.
    pub fn shift_n(&self, rate_n_s: f32) -> f32 {
        self.offset_n - self.lag_s * rate_n_s
    }
}
