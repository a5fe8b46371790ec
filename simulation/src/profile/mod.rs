//! Test profiles: motions of an axis that show what a guide does, as runs without a force yet.
//!
//! ```text
//! staircase   strokes at rising speeds, then falling          one preload: the Stribeck curve        (P1)
//! ladder      the staircase at several loads                  the constants of the law               (P2)
//! map         the full stroke, slow and fast, several times   what is tied to a place                (P4)
//! reversal    sinusoids of several widths and frequencies     presliding, lag                        (P5)
//! modulation  speed swinging about a mean                     frictional lag, inertia                (P6)
//! dwell       rest, start slowly, rest longer                 breakaway                              (P7)
//! warm-up     hours to and fro, a pause, and on               temperature, run-in                    (P8)
//! ```
//!
//! The codes are those by which a diagnosis asks for the next run.

mod course;
mod dwell;
mod ladder;
mod map;
mod modulation;
mod reversal;
mod warm_up;

pub use dwell::Dwell;
pub use ladder::Ladder;
pub use map::Map;
pub use modulation::Modulation;
pub use reversal::Reversal;
pub use warm_up::WarmUp;

use crate::run::Run;

/// The paper's 20 speeds, m/min.
pub const SPEEDS_M_MIN: [f64; 20] =
    [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0];

/// Rows of a run at most: 24 h at 1 kHz.
pub const MOST_ROWS: usize = 86_400_000;

/// What every profile needs of the axis. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Rows a second, 1 to 1e5.
    pub rate_hz: f64,
    /// Acceleration of ramps, m/s², above 0.
    pub acceleration_m_s2: f64,
    /// Position where the profile starts, m.
    pub origin_m: f64,
}

impl Default for Drive {
    fn default() -> Self {
        Drive { rate_hz: 200.0, acceleration_m_s2: 1.0, origin_m: 0.0 }
    }
}

impl Drive {
    /// The duration that whole rows make of another one, s.
    fn whole(&self, duration_s: f64) -> f64 {
        (duration_s * self.rate_hz).round().max(1.0) / self.rate_hz
    }
}

/// Why a profile cannot be driven.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Undrivable {
    /// A stroke is too short to reach its speed.
    #[error(
        "a stroke of {stroke_m} m does not reach {speed_m_s:.4} m/s with {acceleration_m_s2} m/s²: it needs more than {needed_m:.4} m"
    )]
    TooShort {
        /// Length of the stroke, m.
        stroke_m: f64,
        /// Speed that it was to have, m/s.
        speed_m_s: f64,
        /// Acceleration, m/s².
        acceleration_m_s2: f64,
        /// Length of its two ramps, m.
        needed_m: f64,
    },
    /// More rows than anybody wants.
    #[error("the profile would have {0} rows, more than {MOST_ROWS}; lower the rate or shorten it")]
    TooLong(u64),
    /// A number that makes no motion.
    #[error("{0} must be above 0")]
    NotPositive(&'static str),
    /// Nothing in a list.
    #[error("no {0} at all")]
    Empty(&'static str),
}

/// A profile makes a run without force: time, position, velocity, acceleration, segments, and the columns of load and
/// temperature where it sets them. The force is 0 everywhere.
pub trait Profile {
    /// The run.
    ///
    /// # Errors
    /// [`Undrivable`].
    fn run(&self, drive: &Drive) -> Result<Run, Undrivable>;
}

fn positive(name: &'static str, values: &[f64]) -> Result<(), Undrivable> {
    if values.is_empty() {
        return Err(Undrivable::Empty(name));
    }
    if values.iter().all(|x| *x > 0.0 && x.is_finite()) { Ok(()) } else { Err(Undrivable::NotPositive(name)) }
}

#[cfg(test)]
mod tests;
