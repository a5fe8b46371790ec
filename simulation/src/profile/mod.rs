//! Test profiles: how an axis is driven to make a recording informative.
//!
//! ```text
//! staircase   every speed of a list, forth and back, up and down the list
//! ladder      a staircase at every preload of a list
//! map         the whole stroke at constant speed, forth and back, again and again
//! reversal    small sinusoids around one place
//! modulation  a speed that swells and falls without turning back
//! dwell       ever longer rests, and a slow start after each
//! warm_up     running, a stop, running again; block and rail warm up and cool down
//! ```
//!
//! A profile turns numbers into a [`Course`]: rows of time, motion and rig conditions. Speeds change in smooth ramps of
//! limited acceleration. The force is added by a law.

mod dwell;
mod ladder;
mod map;
mod modulation;
pub mod paper_grid;
mod path;
mod phase;
mod reversal;
mod staircase;
mod warm_up;

pub use dwell::Dwell;
pub use ladder::Ladder;
pub use map::Map;
pub use modulation::Modulation;
pub use path::MOST_ROWS;
pub use reversal::Reversal;
pub use staircase::{Order, Staircase};
pub use warm_up::{WarmUp, Warming};

use model_core::quantity;

use crate::motion::Motion;
use crate::run::Run;

/// Conditions that the rig sets and keeps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Preload of the block, N; ignored by a profile with preloads of its own.
    pub preload_n: Option<f64>,
    /// Vertical load on the block, N.
    pub external_load_n: Option<f64>,
    /// Temperature of block and rail, °C; ignored by a profile with temperatures of its own.
    pub temperature_degc: Option<f64>,
}

impl Conditions {
    fn check(&self) -> Result<(), Unfit> {
        for (what, value, row) in [
            ("preload", self.preload_n, quantity::range("preload_n")),
            ("temperature", self.temperature_degc, quantity::range("temperature_degc")),
        ] {
            if let (Some(value), Some(row)) = (value, row) {
                Unfit::check(what, value, row.min, row.max, row.unit)?;
            }
        }
        self.external_load_n.map_or(Ok(()), |load| Unfit::check("external-load", load, -1e6, 1e6, "N"))
    }
}

/// A driven profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Time, motion, segments and rig conditions. The force is 0 in every row until a law sets it.
    pub run: Run,
    /// The same motion with its exact acceleration, not derived from rows.
    pub motion: Motion,
}

/// Why a profile cannot be driven. Quantities have the names of the command's options.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// A number that is not legal.
    #[error("{what} must lie between {min} and {max} {unit}, not {value}")]
    OutOfRange {
        /// Which one.
        what: &'static str,
        /// What was given.
        value: f64,
        /// Smallest legal value.
        min: f64,
        /// Largest legal value.
        max: f64,
        /// Unit of all three.
        unit: &'static str,
    },
    /// A list without entries.
    #[error("{0} needs at least one value")]
    Nothing(&'static str),
    /// A list where one value is meant.
    #[error("{0} takes one value here")]
    NotOne(&'static str),
    /// No room for the ramps.
    #[error(
        "a stroke of {length_m} m is too short for {speed_m_s} m/s: getting there and stopping takes {needed_m:.4} m; \
         give a longer length, a lower speed or a higher acceleration"
    )]
    TooShort {
        /// The stroke.
        length_m: f64,
        /// The speed.
        speed_m_s: f64,
        /// Distance that the ramps take.
        needed_m: f64,
    },
    /// The dwells of a profile of growing dwells do not grow.
    #[error(
        "dwells must grow, {after_s} s does not come after {before_s} s: what the longer one adds could not be told"
    )]
    NotGrowing {
        /// A dwell.
        before_s: f64,
        /// The one after it.
        after_s: f64,
    },
    /// More rows than can be meant.
    #[error(
        "{duration_s:.0} s at {rate_hz} Hz are {:.0} million rows, more than {:.0} million; give a lower rate or a shorter profile",
        1e-6 * duration_s * rate_hz,
        1e-6 * MOST_ROWS
    )]
    TooLong {
        /// Length of the profile.
        duration_s: f64,
        /// Rows a second.
        rate_hz: f64,
    },
    /// No load per ball carries that lateral force.
    #[error("the guide's geometry carries no lateral force of {lateral_n} N; give preloads")]
    NoLoad {
        /// The lateral force.
        lateral_n: f64,
    },
}

impl Unfit {
    /// Checks a number; NaN is out of range.
    fn check(what: &'static str, value: f64, min: f64, max: f64, unit: &'static str) -> Result<(), Unfit> {
        if value >= min && value <= max { Ok(()) } else { Err(Unfit::OutOfRange { what, value, min, max, unit }) }
    }

    /// Checks a list of numbers.
    fn check_all(what: &'static str, values: &[f64], min: f64, max: f64, unit: &'static str) -> Result<(), Unfit> {
        if values.is_empty() {
            return Err(Unfit::Nothing(what));
        }
        values.iter().try_for_each(|value| Unfit::check(what, *value, min, max, unit))
    }
}

/// Limits that profiles share.
mod limits {
    /// Speeds, m/s.
    pub(super) const SPEED: (f64, f64) = (1e-6, 20.0);
    /// Lengths of travel, m.
    pub(super) const LENGTH: (f64, f64) = (1e-6, 500.0);
    /// Durations, s.
    pub(super) const DURATION: (f64, f64) = (0.0, 1e7);
    /// Numbers of repetitions.
    pub(super) const TIMES: (f64, f64) = (1.0, 1e5);
    /// Frequencies, Hz.
    pub(super) const FREQUENCY: (f64, f64) = (1e-4, 1e3);
}
