//! Ports: interfaces of the runners to the outside world. Boards and tests implement them.
//!
//! There is one port each for samples, frames, stored bytes, time and the watchdog, and no more.
#![allow(async_fn_in_trait, reason = "one executor, one thread: no future has to be Send")]

use can_wire::RawFrame;
use model_core::sample::SAMPLES_PER_BLOCK;

/// Channels of one scan: force, temperature.
pub const CHANNELS: usize = 2;

/// Raw samples of one block from converters and encoder, as the DMA stored them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    /// Converter codes in the order of conversion: force, temperature, force, temperature, ...
    pub codes: [u16; CHANNELS * SAMPLES_PER_BLOCK],
    /// Encoder counts, one for each scan, taken at the edge that started it.
    pub counts: [u16; SAMPLES_PER_BLOCK],
}

impl Samples {
    /// Nothing yet.
    pub const EMPTY: Samples = Samples { codes: [0; CHANNELS * SAMPLES_PER_BLOCK], counts: [0; SAMPLES_PER_BLOCK] };
}

/// Why a run of the sampler ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interruption {
    /// The converter lost a conversion.
    ConverterOverrun,
    /// Memory was overwritten before it was read.
    RingOverrun,
}

impl Interruption {
    /// The name used in log lines.
    pub const fn name(self) -> &'static str {
        match self {
            Interruption::ConverterOverrun => "converter overrun",
            Interruption::RingOverrun => "ring overrun",
        }
    }
}

/// Force, temperature and position, sampled by one clock.
pub trait SampleSource {
    /// One gapless run. Dropping it stops the sampler.
    type Run<'a>: SampleRun
    where
        Self: 'a;

    /// Starts a run from scratch: its first scan and its first encoder count belong together.
    fn start(&mut self) -> Self::Run<'_>;
}

/// A run of the sampler. It is never resumed: after an interruption it is dropped and the next one started, so that
/// codes and counts cannot get out of step.
pub trait SampleRun {
    /// The next block, complete. Not cancel safe: after dropping the future, drop the run, too.
    ///
    /// # Errors
    /// Samples were lost. The run cannot be used any more.
    async fn block(&mut self, into: &mut Samples) -> Result<(), Interruption>;
}

/// What became of a frame offered to the bus controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// The controller has it and sends it as soon as the bus allows.
    Taken,
    /// No room; offer it again.
    Busy,
    /// An older frame with this identifier still waits in the controller and is being withdrawn; offer
    /// again. Returned once for each frame withdrawn.
    Withdrawing,
}

/// Sink of frames: the bus controller.
pub trait FrameSink {
    /// Hands over one frame. Never waits, whatever the state of the bus.
    ///
    /// A controller never holds two frames with the same identifier.
    fn offer(&mut self, frame: &RawFrame) -> Offer;

    /// Whether a frame with this identifier still waits in the controller; if it must not be displaced, no newer one
    /// may be offered.
    fn holds(&self, id: u16) -> bool;

    /// Whether nothing waits in the controller.
    fn is_idle(&self) -> bool;

    /// Whether the controller has left the bus because of errors.
    fn is_off(&self) -> bool;
}

/// Source of frames from others: those for this block, with eight bytes.
pub trait FrameSource {
    /// The next frame; cancel safe.
    async fn frame(&mut self) -> RawFrame;
}

/// What a block keeps over a reset when told to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// The parameter image, 1 to 1024 bytes, opaque here.
    Image,
    /// The [`Settings`](can_wire::service::Settings), as bytes.
    Settings,
}

/// Why something was not kept. What was kept before stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeepError {
    /// This block has no store.
    NoStore,
    /// The bytes are no image that this block can run, or settings without an image to keep them with.
    Refused,
    /// There is no room until the next start, which makes room.
    Full,
    /// The memory did not take them.
    Memory,
}

impl KeepError {
    /// The name used in log lines.
    pub const fn name(self) -> &'static str {
        match self {
            KeepError::NoStore => "no store",
            KeepError::Refused => "refused",
            KeepError::Full => "no room until the next start",
            KeepError::Memory => "memory failed",
        }
    }
}

/// Store that survives a reset. It holds the old content or the new, never a mix.
pub trait Keep {
    /// Keeps these bytes from the next start on. May take any time, provided that it awaits.
    ///
    /// # Errors
    /// [`KeepError`]; what was kept before then stays.
    async fn save(&mut self, what: Kept, bytes: &[u8]) -> Result<(), KeepError>;
}

/// Restarts the chip.
pub trait Restart {
    /// Never returns on a chip.
    fn restart(&mut self);
}

/// Memory of the parameter images.
pub trait Storage {
    /// The memory of the two regions, see [`store`](crate::store).
    fn regions(&self) -> [&[u8]; 2];
}

/// Time since start-up.
pub trait Clock {
    /// Microseconds since start-up; never goes back.
    fn now_us(&self) -> u64;

    /// Waits until the clock shows at least this much.
    async fn sleep_until(&self, us: u64);
}

/// Watchdog that resets the chip unless it is fed.
pub trait Watchdog {
    /// Postpones the reset.
    fn feed(&mut self);
}
