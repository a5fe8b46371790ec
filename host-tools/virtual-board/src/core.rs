//! The processor core of both chips: a Cortex-M4F that retires one instruction per clock cycle.

use std::num::{NonZeroU32, NonZeroU64};

use rigless::cpu;
use rigless::emulator::CoreSpec;
use rigless::machine::armv7m;
use rigless::soc::Bus;

/// Priority bits of the STM32's interrupt controller.
const PRIORITY_BITS: u8 = 4;
/// SysTick's reference is the core clock over eight, RM0090 6.2 and RM0440 7.2.
const REFERENCE_DIVIDER: NonZeroU32 = NonZeroU32::new(8).unwrap();

/// A core at `hz` on the part `bus` describes, booting from its region `flash`.
///
/// The emulator has no cycle model, so its pace is one instruction per cycle: instruction counts
/// are exact, and times shorter than silicon's by what flash wait states and the pipeline cost.
pub(crate) fn cortex_m4f(bus: &Bus, hz: NonZeroU64) -> CoreSpec {
    let lines = u32::from(bus.cpu().interrupt_lines);
    armv7m::Core {
        variant: armv7m::Variant::M4,
        clock_hz: hz,
        interrupt_lines: NonZeroU32::new(lines).unwrap_or(NonZeroU32::MIN),
        priority_bits: PRIORITY_BITS,
        refclk_divider: REFERENCE_DIVIDER,
        instructions_per_second: hz,
        boot: "flash",
    }
    .spec_with_parts(&cpu::armv7m::windows(bus), armv7m::Fpu::FpV4Sp, armv7m::MpuRegions::Eight)
}
