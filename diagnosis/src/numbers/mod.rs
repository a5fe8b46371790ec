//! Numerical methods without physics.
//!
//! ```text
//! linear       algebra of small symmetric matrices
//! statistics   mean, median, scatter, lines
//! bridge       straight lines across missing rows
//! peaks        highest entries of a spectrum
//! rounding     effect of a channel's quantisation steps
//! ```

pub(crate) mod bridge;
pub(crate) mod linear;
pub(crate) mod peaks;
pub(crate) mod rounding;
pub(crate) mod statistics;
