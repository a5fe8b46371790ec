//! A run of an axis as columns, and the simulation that is held against it.
//!
//! ```text
//! run      what was recorded, column by column, and where it was interrupted
//! motion   position, speed and acceleration of every row, from whatever was measured
//! guide    a guide and its oil: a published set and what a file overrides
//! ```
//!
//! No file is opened and nothing is printed here: text comes in, numbers and reasons go out.
#![forbid(unsafe_code)]

pub mod guide;
pub mod motion;
pub mod run;
