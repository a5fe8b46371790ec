//! Runs of an axis as columns, and the simulation that they are compared with.
//!
//! ```text
//! run        a recording, column by column, with its interruptions
//! session    recordings with a continuing clock, joined
//! motion     position, speed and acceleration of every row, from what was measured
//! published  parameter sets of the literature, every value with its provenance
//! guide      a guide and its oil: a published set and what a file overrides
//! file       the simulation file: law, operation, axis, tolerance
//! law        the law's drag force, row by row
//! mechanism  physics and sensor faults that a simulation may leave out
//! curve      unnamed forces that it leaves out
//! profile    test profiles: how an axis is driven to be informative
//! sensor     effects of sensors on a run
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
