//! The shell around the pipeline: sampling, estimating, publishing, and their timing.
//!
//! ```text
//!            RawBlock, 100 Hz             Report, newest wins           RawFrame
//! [Acquire] ------------------> [Estimate] ---------------> [Publish] -----------> bus
//!     |                             |                           |
//!     +-----------------------------+-----------+---------------+
//!                                               v
//!                                          [Liveness] <-- [Supervise] --> watchdog
//! ```
//!
//! Everything here is generic over [`ports`] and runs on the desk as well; the program `firmware` of the
//! same package gives it pins, memory and tasks. The mathematics is in `model-core`, the byte layouts are
//! in `can-wire`.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking"))]

use can_wire::{Publisher, RawFrame};
use model_core::monitor::{Monitor, State};
use model_core::sample::{Estimate, RawBlock};

mod log;

pub mod boot;
pub mod facts;
pub mod liveness;
pub mod outbox;
pub mod ports;
pub mod runners;
pub mod schedule;
pub mod standing;
pub mod store;
pub mod timeline;

/// The two cyclic frames of an estimate, finished, and the estimate they were made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// Preload, drag force and quality.
    pub estimate: RawFrame,
    /// Speed, temperature and state of motion.
    pub motion: RawFrame,
    /// Content of both, in SI units.
    pub known: Estimate,
}

impl Frames {
    /// Puts an estimate into its frames; advances both alive counters.
    pub fn of(known: Estimate, publisher: &mut Publisher) -> Frames {
        Frames { estimate: publisher.estimate(&known), motion: publisher.motion(&known), known }
    }
}

/// From sixteen raw samples to finished frames: all computation that falls to a block of 10 ms.
///
/// `None` when no estimate is due with this block. A function of its own, so that its cost can be measured in the
/// firmware.
#[inline(never)]
pub fn process_block(
    monitor: &Monitor,
    state: &mut State,
    publisher: &mut Publisher,
    block: &RawBlock,
) -> Option<Frames> {
    monitor.step(state, block).map(|known| Frames::of(known, publisher))
}
