//! Fits: what may explain a mismatch, and how much of it.
//!
//! ```text
//! source         where a column comes from; story: unnamed curves, tone: steady tones, loud: a wave louder than noise
//! ends           starts and stops as the rows show them; edges: delay of the force there; skew: clocks that drift
//! apart
//! bend           whether a profile fitted as a bent rail really bends
//! bench          the mismatch and all that may explain it, whitened; every fit is algebra on inner products
//! member         candidates and members; told: lengths and loads that the runs can show
//! least_squares  a fit, and the amplitudes of a further cause beside it; rest: power of residuals
//! pool           all candidates; refine: their shapes; made: those made before; spectrum: wavelengths
//! ```

pub(crate) mod bench;
mod bend;
pub(crate) mod edges;
pub(crate) mod ends;
pub(crate) mod least_squares;
pub(crate) mod loud;
mod made;
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
