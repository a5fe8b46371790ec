//! From measured drag at known load to the friction law of that guide, and from one speed staircase to its preload.
#![forbid(unsafe_code)]

pub mod axis_curve;
pub mod cell;
pub mod convention;
pub mod direction;
pub mod doubts;
pub mod fit;
pub mod interval;
pub mod lack_of_fit;
pub mod levels;
pub mod noise;
mod separable;
pub mod staircase;
