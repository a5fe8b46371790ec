//! A run of an axis as columns, and the simulation that is held against it.
//!
//! ```text
//! run        what was recorded, column by column, and where it was interrupted
//! session    recordings whose clocks go on, as one
//! motion     position, speed and acceleration of every row, from whatever was measured
//! published  parameter sets of the literature, every value with where it comes from
//! guide      a guide and its oil: a published set and what a file overrides
//! file       the simulation file: law, operation, axis, tolerance
//! law        the drag force that the law says, row by row
//! mechanism  the physics and the faults of sensors that a simulation may leave out
//! curve      what it leaves out and nobody has a name for
//! profile    how an axis is driven so that a recording tells something
//! sensor     what sensors make of a run
//! ```
//!
//! No file is opened and nothing is printed here: text comes in, numbers and reasons go out.
#![forbid(unsafe_code)]

pub mod curve;
mod document;
pub mod file;
pub mod guide;
pub mod law;
pub mod mechanism;
pub mod motion;
pub mod profile;
pub mod published;
pub mod run;
pub mod sensor;
pub mod session;

pub use document::BadFile;
pub use file::Simulation;
