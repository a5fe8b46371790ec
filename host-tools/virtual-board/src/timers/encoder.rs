//! The quadrature encoder on TIM3: rigless' timer behind two pins that follow a [`Motion`].
//!
//! The timer sees every edge, in quadrature order, so its encoder mode, polarity and direction are
//! what the firmware configured. The edges due are put on the pins when the core or the DMA
//! controller reads the timer, and not each at its own instant: the counter has no other
//! observer, and a stop of the emulator for each of 20 000 edges a second would dominate the run.
//!
//! Two things follow. The input filter is bypassed (`ICxF` reads back, edges pass at once): its
//! delay is far below the distance of two edges. And a capture or a trigger of TIM3 by an edge
//! would come late; the firmware uses neither.

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32f427::generated::tim2::Register;
use rigless::soc::stm32f427::peripherals::tim::{Channel, Counter, General, Tim};
use rigless::time::EventId;

use super::RESET_HZ;
use crate::Nanos;
use crate::motion::Motion;

/// TIM3 and the encoder on its two inputs.
#[derive(Debug)]
pub(crate) struct Encoder {
    timer: Tim<General>,
    pub(crate) motion: Motion,
    /// The count whose levels are on the pins.
    shown: i64,
}

impl Encoder {
    pub(crate) fn new() -> Self {
        Self { timer: Tim::with_clock(RESET_HZ, Counter::Narrow), motion: Motion::default(), shown: 0 }
    }

    /// The counter at `now`, with every edge due by then counted.
    pub(crate) fn count(&mut self, now: Nanos, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) -> u16 {
        self.catch_up(now, registers, context);
        let count = Device::read(&mut self.timer, Register::Cnt, registers, context)
            .unwrap_or_else(|| registers.get(Register::Cnt));
        (count & 0xFFFF) as u16
    }

    /// Puts every edge due by `now` on the pins.
    fn catch_up(&mut self, now: Nanos, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let due = self.motion.at(now);
        if due == self.shown {
            return;
        }
        let filters = registers.get(Register::Ccmr1Output);
        registers.set(Register::Ccmr1Output, filters & !FILTERS);
        while self.shown != due {
            let next = self.shown + (due - self.shown).signum();
            let (channel, level) = edge(self.shown, next);
            self.timer.drive_input(channel, level, registers, context);
            self.shown = next;
        }
        registers.set(Register::Ccmr1Output, filters);
    }
}

/// The timer's inputs the encoder's phases are on.
const A: Channel = Channel::new(1).unwrap();
const B: Channel = Channel::new(2).unwrap();

/// `IC1F` and `IC2F` of `CCMR1`, RM0090 18.4.7.
const FILTERS: u64 = 0xF0F0;

/// The one pin that changes between two neighbouring counts, and its new level.
///
/// Counts 0 1 2 3 show A B = 00 10 11 01: A leads B while the count goes up.
fn edge(from: i64, to: i64) -> (Channel, Level) {
    let levels = |count: i64| (matches!(count.rem_euclid(4), 1 | 2), matches!(count.rem_euclid(4), 2 | 3));
    let ((a, _), (next_a, next_b)) = (levels(from), levels(to));
    if a == next_a { (B, Level::from(next_b)) } else { (A, Level::from(next_a)) }
}

impl Device for Encoder {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        Device::layout(&self.timer)
    }
    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.catch_up(context.now().0, registers, context);
        Device::read(&mut self.timer, register, registers, context)
    }
    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.timer, register, value, registers, context);
    }
    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_event(&mut self.timer, event, registers, context);
    }
    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_clock(&mut self.timer, hz, registers, context);
    }
    fn reset(&mut self) {
        Device::reset(&mut self.timer);
    }
    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.timer, registers, context);
    }
}

#[cfg(test)]
mod tests {
    use super::{A, B, edge};
    use rigless::device::Level::{High, Low};

    #[test]
    fn one_phase_changes_at_a_time_and_a_leads_upwards() {
        let up: Vec<_> = (-4..0).map(|count| edge(count, count + 1)).collect();
        assert_eq!(up, [(A, High), (B, High), (A, Low), (B, Low)]);
        let down: Vec<_> = (1..=4).rev().map(|count| edge(count, count - 1)).collect();
        assert_eq!(down, [(B, High), (A, High), (B, Low), (A, Low)]);
    }
}
