//! The two timers of the sampling chain, the same on both chips.
//!
//! Both are rigless' general-purpose timer of RM0090 chapter 18. The STM32G474's TIM2 and TIM3 have
//! every register of it at the same place with the same meaning (RM0440 chapter 30), and more that
//! the firmware leaves alone.

pub(crate) mod encoder;
pub(crate) mod trigger;

/// The 16 MHz internal oscillator, which clocks every bus of either chip out of reset.
pub(crate) const RESET_HZ: u64 = 16_000_000;
