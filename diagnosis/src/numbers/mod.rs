//! Numbers and nothing else.
//!
//! ```text
//! linear       algebra of small symmetric matrices
//! statistics   numbers that stand for many
//! bridge       a line where rows are missing
//! peaks        the highest of them
//! rounding     what a channel that counts in steps does
//! ```

pub(crate) mod bridge;
pub(crate) mod linear;
pub(crate) mod peaks;
pub(crate) mod rounding;
pub(crate) mod statistics;
