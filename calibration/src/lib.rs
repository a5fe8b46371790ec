//! From measured drag at known load to the friction law of that guide, and from one speed staircase to its preload.
#![forbid(unsafe_code)]

pub mod cell;
pub mod fit;
pub mod interval;
pub mod noise;
mod separable;
pub mod staircase;
