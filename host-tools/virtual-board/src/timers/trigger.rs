//! TIM2, which paces sampling: rigless' timer with its trigger output and its update request wired.
//!
//! rigless counts both and connects neither, so this module does: `TRGO` reaches the converter as a
//! request line of its own number, and an update request is a pulse, acknowledged as soon as it is
//! driven, because the DMA transfer it starts touches TIM3 and never this timer.

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32f427::generated::tim2::Register;
use rigless::soc::stm32f427::peripherals::tim::{Counter, General, Tim, UPDATE_REQUEST};
use rigless::time::EventId;

use super::RESET_HZ;
use crate::Nanos;

/// The instance, as requests name it.
pub(crate) const INSTANCE: &str = "TIM2";
/// The request output that stands for `TRGO`, past every number the timer's own requests have.
pub(crate) const TRGO: usize = 64;

/// TIM2 as the source of the sampling trigger.
#[derive(Debug)]
pub(crate) struct Trigger {
    timer: Tim<General>,
    pulses: u64,
    /// When the last trigger pulse left, until it is taken.
    fired: Option<Nanos>,
}

impl Trigger {
    pub(crate) fn new() -> Self {
        Self { timer: Tim::with_clock(RESET_HZ, Counter::Wide), pulses: 0, fired: None }
    }

    /// The instant of a trigger pulse not taken yet.
    pub(crate) fn take_fired(&mut self) -> Option<Nanos> {
        self.fired.take()
    }

    /// Drives the outputs that the last call into the timer changed.
    fn forward(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.acknowledge(UPDATE_REQUEST, registers, context);
        let (_, pulses) = self.timer.trigger_output();
        if pulses != self.pulses {
            self.pulses = pulses;
            self.fired = Some(context.now().0);
            context.request(TRGO, Level::High);
            context.request(TRGO, Level::Low);
        }
    }
}

impl Device for Trigger {
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
        Device::read(&mut self.timer, register, registers, context)
    }
    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.timer, register, value, registers, context);
        self.forward(registers, context);
    }
    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_event(&mut self.timer, event, registers, context);
        self.forward(registers, context);
    }
    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_clock(&mut self.timer, hz, registers, context);
    }
    fn reset(&mut self) {
        Device::reset(&mut self.timer);
        (_, self.pulses) = self.timer.trigger_output();
        self.fired = None;
    }
    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.timer, registers, context);
        (_, self.pulses) = self.timer.trigger_output();
    }
}
