//! Preload of a preloaded ball guide from its drag force.
//!
//! The drag force of a running guide block depends on its preload through the friction coefficient,
//! and that coefficient is a function of the Hersey number (Zhou et al. 2023, Eq. 20). Inverting the
//! function gives the preload while the machine runs. This crate holds that physics and the whole
//! on-board pipeline, free of heap, clock and I/O, so that the block, the desk (a computer beside the machine) and
//! the emulator run the very same code:
//!
//! ```text
//! RawBlock (counts) -> calibration -> window (steady motion?) -> drag, speed -> reduced law -> Estimate
//! ```
//!
//! * [`contact`], [`friction`], [`exact`]: the model of the paper, whole, in f64, for the desk
//! * [`reduced`]: the closed form that the block runs, its constants derived from the exact model by code
//! * [`fixed`]: the same closed form in integers
//! * [`left_out`]: what acts beside the law, as the desk found it
//! * [`params`]: what a person or a calibration sets
//! * [`monitor`]: counts in, [`Estimate`](sample::Estimate) out, one pure step a block
//!
//! Numbers of the on-board path are plain f32 arithmetic (see [`num`]): x86-64, the emulators and the
//! chip give the same bits.
#![no_std]
#![forbid(unsafe_code)]

mod batch;
pub mod calibration;
pub mod consistency;
pub mod contact;
pub mod encoder;
pub mod exact;
pub mod fixed;
pub mod friction;
pub mod left_out;
pub mod monitor;
pub mod num;
pub mod params;
pub mod quantity;
pub mod reduced;
pub mod reference;
pub mod ripple;
pub mod sample;
pub mod viscosity;
pub mod window;

/// Why a parameter set or a question to the model is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The named quantity is not a finite number.
    NonFinite(&'static str),
    /// The named quantity lies outside its legal range, see [`quantity::RANGES`].
    OutOfRange(&'static str),
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Error::NonFinite(what) => write!(f, "{what} is not a finite number"),
            Error::OutOfRange(what) => match quantity::range(what) {
                Some(r) => write!(f, "{what} must lie between {} and {} {}", r.min, r.max, r.unit),
                None => write!(f, "{what} is outside its legal range"),
            },
        }
    }
}

impl core::error::Error for Error {}
