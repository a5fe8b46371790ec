//! What may explain a mismatch, and how much it does.
//!
//! ```text
//! source         where a column comes from; story: curves without a name, tone: those that hum
//! ends           starts and stops as the rows show them; edges: how late the force follows them; skew: clocks that drift apart
//! bend           whether what is to be a bent rail is bent
//! bench          the mismatch and all that may explain it, whitened; every fit is algebra on inner products
//! member         what is on it; told: lengths and loads that the runs tell of
//! least_squares  such a fit, and the size of one more cause beside it; rest: what is left
//! pool           all that may act; refine: its shapes; spectrum: wavelengths
//! ```

pub(crate) mod bench;
mod bend;
pub(crate) mod edges;
pub(crate) mod ends;
pub(crate) mod least_squares;
pub(crate) mod member;
pub(crate) mod pool;
pub(crate) mod refine;
pub(crate) mod rest;
pub(crate) mod skew;
pub(crate) mod source;
pub(crate) mod spectrum;
pub(crate) mod story;
#[cfg(test)]
mod strokes;
mod told;
pub(crate) mod tone;
