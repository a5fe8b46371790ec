//! What may explain a mismatch, and how much it does.
//!
//! ```text
//! source       where a column comes from; story: curves without a name
//! edges        how late the force follows starts and stops
//! bench        the mismatch and all that may explain it, whitened; every fit is algebra on inner products
//! rest         what is left of a fit
//! pool         all that may act; refine: its shapes; spectrum: wavelengths
//! ```

pub(crate) mod bench;
pub(crate) mod edges;
pub(crate) mod pool;
pub(crate) mod refine;
pub(crate) mod rest;
pub(crate) mod source;
pub(crate) mod spectrum;
pub(crate) mod story;
