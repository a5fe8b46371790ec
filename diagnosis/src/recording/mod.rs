//! Runs, made ready to be held against a simulation.
//!
//! ```text
//! sanity       what is wrong with the recording; rows that cannot be compared
//! side         runs with what follows from their motion
//! moving       their motion, and channels with less of their noise
//! resolution   the time over which they are compared
//! condense     averages of a fast one
//! ```

pub(crate) mod condense;
pub(crate) mod moving;
pub(crate) mod resolution;
pub(crate) mod sanity;
pub(crate) mod side;
