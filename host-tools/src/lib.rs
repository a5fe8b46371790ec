//! Library of the desk's tools for the smart guide block.
//!
//! ```text
//! live bus or log  -> candump -> decode -------------+
//! raw recording    -> recording::raw -> replay ------+-> report: table, CSV, JSON, picture
//! run of an axis   -> recording -> rig --------+     |
//! firmware image   -> emulator ----------------+-----+
//! ```
//!
//! There is one decoder, `can-wire`, and one pipeline, `model-core`: the same code that runs in the block. So a
//! raw recording replayed here gives the very frames the block sent.
//!
//! The module `emulated` needs the cargo feature `emulator`; everything else is always there.
#![forbid(unsafe_code)]

pub mod batch;
pub mod block;
pub mod bus;
pub mod calculator;
pub mod calibrate;
pub mod candump;
pub mod decode;
pub mod diagnosed;
#[cfg(feature = "emulator")]
pub mod emulated;
pub mod estimate;
pub mod files;
pub mod image;
pub mod judgement;
pub mod paper;
pub mod parameters;
pub mod recorder;
pub mod recording;
pub mod replay;
pub mod report;
pub mod rig;
pub mod simulate;
pub mod toml_place;
pub mod trial;
