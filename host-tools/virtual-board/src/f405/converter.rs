//! ADC1: rigless' converter, started by TIM2's trigger output and tapped where words leave it.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32f427::generated::adc1::{Register, cr2, sqr1};
use rigless::soc::stm32f427::peripherals::adc::{Adc, Channel};
use rigless::time::EventId;

use crate::hardware::MAX_CODE;
use crate::outcome::RawSample;
use crate::timers::trigger;

/// Input of the force amplifier, PA0.
const FORCE: u8 = 0;
/// Input of the temperature divider, PA1.
const TEMPERATURE: u8 = 1;
const FORCE_INPUT: Channel = Channel::new(FORCE).unwrap();
const TEMPERATURE_INPUT: Channel = Channel::new(TEMPERATURE).unwrap();
/// `EXTSEL` of TIM2_TRGO, RM0090 13.13.3.
const EXTSEL_TIM2_TRGO: u64 = 0b0110;
/// The clock out of reset: the internal oscillator through `ADCPRE`'s smallest divider.
pub(super) const RESET_HZ: u64 = crate::timers::RESET_HZ / 2;

/// ADC1 with the two sensors on its pins.
#[derive(Debug)]
pub(crate) struct Converter {
    adc: Adc,
    /// The sample whose conversions are under way.
    current: Option<RawSample>,
    /// Conversions of it that memory has taken.
    taken: u64,
    /// Samples taken whole, oldest first.
    pub(crate) samples: Vec<RawSample>,
}

impl Converter {
    pub(crate) fn new() -> Self {
        let mut adc = Adc::with_clock(RESET_HZ);
        // With a full scale of 4095 mV one code is one millivolt, so codes pass exactly.
        adc.set_reference(u32::from(MAX_CODE));
        Self { adc, current: None, taken: 0, samples: Vec::new() }
    }

    pub(crate) fn set_force(&mut self, code: u16) {
        self.adc.set_input(FORCE_INPUT, u32::from(code));
    }

    pub(crate) fn set_temperature(&mut self, code: u16) {
        self.adc.set_input(TEMPERATURE_INPUT, u32::from(code));
    }

    /// A trigger pulse at `sample.at`: what follows belongs to `sample`.
    pub(crate) fn begin(&mut self, sample: RawSample) {
        self.current = Some(sample);
        self.taken = 0;
    }

    /// A word has left for memory: the tap.
    fn tap(&mut self, word: u64, registers: &RegisterFile) {
        let Some(sample) = &mut self.current else { return };
        let word = (word & u64::from(u16::MAX)) as u16;
        // SQ1 to SQ6, RM0090 13.13.11; a longer sequence has neither sensor past them.
        match (registers.get(Register::Sqr3) >> (5 * self.taken) & 0x1F) as u8 {
            FORCE => sample.force_code = word,
            TEMPERATURE => sample.temperature_code = word,
            _ => {}
        }
        self.taken += 1;
        if self.taken > sqr1::L.get(registers.get(Register::Sqr1)) {
            self.samples.extend(self.current.take());
        }
    }
}

impl Device for Converter {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        let value = Device::read(&mut self.adc, register, registers, context);
        if register == Register::Dr && cr2::DMA.is_set(registers.get(Register::Cr2)) {
            self.tap(value.unwrap_or_else(|| registers.get(Register::Dr)), registers);
        }
        value
    }
    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::write(&mut self.adc, register, value, registers, context);
    }
    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_event(&mut self.adc, event, registers, context);
    }
    /// The trigger input of RM0090 13.6, which the converter of rigless leaves out.
    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if (change.instance, change.request) != (trigger::INSTANCE, trigger::TRGO) {
            Device::on_request(&mut self.adc, change, registers, context);
            return;
        }
        let control = registers.get(Register::Cr2);
        // EXTEN: 01 rising, 10 falling, 11 both.
        let wanted = match change.level {
            Level::High => 0b01,
            Level::Low => 0b10,
        };
        let listening = cr2::EXTEN.get(control) & wanted != 0 && cr2::EXTSEL.get(control) == EXTSEL_TIM2_TRGO;
        if listening && cr2::ADON.is_set(control) {
            let started = cr2::SWSTART.set(control, 1);
            registers.set(Register::Cr2, started);
            Device::write(&mut self.adc, Register::Cr2, started, registers, context);
        }
    }
    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::on_clock(&mut self.adc, hz, registers, context);
    }
    fn reset(&mut self) {
        Device::reset(&mut self.adc);
        self.current = None;
    }
    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        Device::reset_line(&mut self.adc, registers, context);
        self.current = None;
    }
}
