//! The two boards of the firmware, emulated, so that the unmodified release image runs on a desk.
//!
//! A [`VirtualBoard`] takes the ELF file as it would be flashed, a [`Bench`] plays the world around
//! it (force and temperature codes, encoder movement, the other nodes on the bus), and the
//! [`Outcome`] holds what left the board and what happened inside: CAN frames with their times, the
//! log, restarts, every raw sample as the hardware took it, and what the image cost in
//! instructions and stack. Same inputs give same outputs, byte for byte.
//!
//! The core and most of the STM32F405 are those of the emulator `rigless`; the STM32G474's
//! peripherals and both CAN controllers are this crate's.
//!
//! # What is modelled
//!
//! | | STM32F405RG (RM0090) | STM32G474RE (RM0440) |
//! |---|---|---|
//! | Core | Cortex-M4F, NVIC, SysTick, lazy stacking (rigless) | same |
//! | Clocks, reset flags | rigless (STM32F427) | ours: ready at once, enables only stored |
//! | TIM2 trigger, TIM3 encoder, TIM5 time base | rigless, edge by edge | the same models |
//! | Converter | rigless; trigger input ours | ours: regular group, DMA, overrun |
//! | OPAMP1 | - | ours: connects the force channel or not |
//! | DMA | rigless, streams and channels | ours: peripheral to memory, one item a request |
//! | CAN | ours: bxCAN | ours: FDCAN, classic frames |
//! | Watchdog | rigless | ours, without the window |
//! | Flash programming | **not**: a store into flash is dropped | ours: unlock, program, erase pages |
//! | Pins | rigless, not looked at | stored only |
//!
//! # What differs from silicon
//!
//! - **Time.** The core retires one instruction a clock cycle: no wait states, no pipeline, no bus
//!   contention. Instruction counts are exact, durations of code are lower bounds.
//! - **Analogue.** The bench sets 12-bit codes and the converter returns them exactly. Noise,
//!   gain, offset, settling and source impedance are for the bench to add. The F405's force channel
//!   is PA0 and its temperature channel PA1; the G474's are PA1 through OPAMP1, and PA0.
//! - **Encoder.** Edges reach the timer when something reads it, all due edges in order, so the
//!   count is right at every read and each sample; the input filter delays nothing.
//! - **Bus.** Frames have their real length on the wire with stuff bits. Errors exist as missing
//!   acknowledgements and as bit errors on every frame sent, nothing finer. No frame of the board
//!   loses a bit or arrives damaged at another node.
//! - **RAM** starts as zeros, which silicon's does not; it survives resets, as silicon's does.
//! - **Oscillators** are exact. The watchdog's LSI is 32 kHz on both chips, where silicon spreads.
//! - **Start-up of the log.** embassy's time driver sees a compare match at the start of its timer
//!   and reads about 65 ms once, before its first full period. Which of the two silicon does was
//!   not established.
//! - The F405 is rigless' STM32F427: 2 MiB of flash and 192 KiB of SRAM answer where silicon has
//!   1 MiB and 128 KiB. An image that does not fit the F405's flash is refused.
//!
//! Accesses of an image to anything else are listed in [`Outcome::gaps`].
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod bare;
mod bench;
mod core;
mod counting;
mod error;
mod f405;
mod g474;
mod hardware;
mod image;
mod motion;
mod outcome;
mod rtt;
mod run;
mod timers;
mod wire;

use std::ops::Range;

pub use bare::{Bare, run_bare};
pub use bench::{Bench, Pins};
pub use error::Error;
pub use image::{Sizes, Symbol, Symbols, symbols};
pub use outcome::{Cost, Gap, Outcome, RawSample, Reset, ResetCause, SentFrame};
pub use run::VirtualBoard;

/// Nanoseconds of virtual time since the run began.
pub type Nanos = u64;

/// The microcontroller on the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Chip {
    /// STM32F405RG: 168 MHz, bxCAN, 1 MiB of flash.
    Stm32f405,
    /// STM32G474RE: 160 MHz as the firmware clocks it, FDCAN, 512 KiB of flash.
    Stm32g474,
}

impl Chip {
    /// The addresses of its flash.
    #[must_use]
    pub const fn flash(self) -> Range<u32> {
        const BASE: u32 = 0x0800_0000;
        match self {
            Self::Stm32f405 => BASE..BASE + (1 << 20),
            Self::Stm32g474 => BASE..BASE + (512 << 10),
        }
    }
}
