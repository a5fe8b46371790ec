//! Recordings, prepared for comparison with a simulation.
//!
//! ```text
//! sanity       defects of the recording; rows that cannot be compared
//! ends         the values at which a force channel ends
//! side         runs with everything derived from their motion
//! moving       their motion, and channels with less noise
//! resolution   the averaging time of the comparison
//! condense     averages of a fast recording
//! ```

pub(crate) mod condense;
pub(crate) mod ends;
pub(crate) mod moving;
pub(crate) mod resolution;
pub(crate) mod sanity;
pub(crate) mod side;
