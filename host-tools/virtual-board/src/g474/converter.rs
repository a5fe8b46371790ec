//! ADC1: the regular group, started by TIM2 or by software, with DMA and overrun.
//!
//! Source: RM0440 chapter 21. Conversion times are silicon's; calibration and start-up take none.
//! Not here: ADC2, injected groups, oversampling, watchdogs, differential inputs, discontinuous mode.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::time::{EventId, Run};

use super::amplifier;
use super::word::Word;
use crate::outcome::RawSample;
use crate::timers::{RESET_HZ, trigger};

/// The instance, as requests name it.
pub(crate) const INSTANCE: &str = "ADC12";
/// The request output of a converted word.
pub(crate) const DMA_REQUEST: usize = 0;
/// The clocks it hears, in the order the part wires them.
pub(crate) const KERNEL_CLOCK: usize = 0;

/// OPAMP1's internal output, RM0440 table 164.
const FORCE_CHANNEL: u64 = 13;
/// PA0.
const TEMPERATURE_CHANNEL: u64 = 1;
/// `EXTSEL` of TIM2_TRGO, RM0440 table 166.
const EXTSEL_TIM2_TRGO: u64 = 11;

const ISR: Word = Word(0x00);
const IER: Word = Word(0x04);
const CR: Word = Word(0x08);
const CFGR: Word = Word(0x0C);
const SMPR1: Word = Word(0x14);
const SMPR2: Word = Word(0x18);
const SQR1: Word = Word(0x30);
const DR: Word = Word(0x40);
const COMMON_CCR: Word = Word(0x308);

const ADRDY: u64 = 1;
const EOC: u64 = 1 << 2;
const EOS: u64 = 1 << 3;
const OVR: u64 = 1 << 4;

const ADEN: u64 = 1;
const ADDIS: u64 = 1 << 1;
const ADSTART: u64 = 1 << 2;
const ADSTP: u64 = 1 << 4;
const ADCAL: u64 = 1 << 31;
/// `ADVREGEN`, `DEEPPWD`, `ADCALDIF`, which hold what is written.
const HELD: u64 = 0x7000_0000;

const DMAEN: u64 = 1;
const OVRMOD: u64 = 1 << 12;
const CONT: u64 = 1 << 13;

/// Sampling and the 12.5 cycles of a 12-bit conversion together, by `SMPx`, RM0440 21.4.16.
const CONVERSION_CYCLES: [u64; 8] = [15, 19, 25, 37, 60, 105, 260, 653];
/// `PRESC`, RM0440 21.7.2.
const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];

/// ADC1 with the two sensors behind it.
#[derive(Debug, Default)]
pub(crate) struct Converter {
    force: u16,
    temperature: u16,
    /// Whether OPAMP1's output reaches its channel.
    amplified: bool,
    kernel_hz: u64,
    hclk_hz: u64,
    flags: u64,
    control: u64,
    converting: Option<EventId>,
    /// The rank being converted.
    rank: usize,
    /// The rank of the word in `DR`.
    converted: usize,
    /// The sample whose conversions are under way.
    current: Option<RawSample>,
    run: Option<Run>,
    request: Level,
    line: Level,
    /// Samples taken whole, oldest first.
    pub(crate) samples: Vec<RawSample>,
}

impl Converter {
    pub(crate) fn new() -> Self {
        Self { hclk_hz: RESET_HZ, ..Self::default() }
    }

    pub(crate) fn set_force(&mut self, code: u16) {
        self.force = code;
    }

    pub(crate) fn set_temperature(&mut self, code: u16) {
        self.temperature = code;
    }

    /// A trigger pulse at `sample.at`: what follows belongs to `sample`.
    pub(crate) fn begin(&mut self, sample: RawSample) {
        if self.converting.is_none() {
            self.current = Some(sample);
        }
    }

    /// The converter's clock, by `CKMODE` and `PRESC`.
    fn clock_hz(&self, registers: &RegisterFile) -> u64 {
        let common = registers.get(COMMON_CCR);
        match common >> 16 & 3 {
            0 => self.kernel_hz / PRESCALERS.get((common >> 18 & 0xF) as usize).copied().unwrap_or(1),
            mode => self.hclk_hz >> (mode - 1),
        }
    }

    /// The channel of a rank, from 0: `SQ1` to `SQ4` in `SQR1`, then five to a register.
    fn channel(rank: usize, registers: &RegisterFile) -> u64 {
        let place = rank + 1;
        registers.get(SQR1.plus(4 * (place / 5))) >> (6 * (place % 5)) & 0x1F
    }

    fn last_rank(registers: &RegisterFile) -> usize {
        (registers.get(SQR1) & 0xF) as usize
    }

    fn convert(&mut self, chained: bool, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let hz = self.clock_hz(registers);
        if hz == 0 {
            return;
        }
        let channel = Self::channel(self.rank, registers);
        let (register, place) = if channel < 10 { (SMPR1, channel) } else { (SMPR2, channel - 10) };
        let sampling = registers.get(register) >> (3 * place) & 7;
        let mut run = self.run.filter(|_| chained).unwrap_or(Run::at(context.now()));
        run.extend(u128::from(CONVERSION_CYCLES[sampling as usize]), hz);
        self.run = Some(run);
        self.converting = Some(context.schedule(run.ends));
    }

    fn start(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        if self.converting.is_none() {
            self.rank = 0;
            self.convert(false, registers, context);
        }
    }

    fn finish(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.converting = None;
        let configuration = registers.get(CFGR);
        let overrun = self.flags & EOC != 0;
        if overrun {
            self.flags |= OVR;
        }
        if !overrun || configuration & OVRMOD != 0 {
            let code = match Self::channel(self.rank, registers) {
                FORCE_CHANNEL if self.amplified => self.force,
                TEMPERATURE_CHANNEL => self.temperature,
                _ => 0,
            };
            let dropped_bits = 2 * (configuration >> 3 & 3);
            registers.set(DR, u64::from(code) >> dropped_bits);
            self.converted = self.rank;
        }
        self.flags |= EOC;
        if self.rank < Self::last_rank(registers) {
            self.rank += 1;
            self.convert(true, registers, context);
        } else {
            self.flags |= EOS;
            if configuration & CONT != 0 {
                self.rank = 0;
                self.convert(true, registers, context);
            } else if configuration >> 10 & 3 == 0 {
                self.control &= !ADSTART;
            }
        }
    }

    /// A word has left for memory: the tap.
    fn tap(&mut self, word: u64, registers: &RegisterFile) {
        let Some(sample) = &mut self.current else { return };
        let code = (word & 0xFFFF) as u16;
        match Self::channel(self.converted, registers) {
            FORCE_CHANNEL => sample.force_code = code,
            TEMPERATURE_CHANNEL => sample.temperature_code = code,
            _ => {}
        }
        if self.converted == Self::last_rank(registers) {
            self.samples.extend(self.current.take());
        }
    }

    fn write_control(&mut self, value: u64, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        self.control = self.control & !HELD | value & HELD;
        if value & ADCAL != 0 {
            // Done at once.
            self.control &= !ADCAL;
        }
        // A read-modify-write writes set bits back, so a stop outranks the start beside it.
        if value & ADDIS != 0 {
            if self.control & ADSTART == 0 {
                self.control &= !ADEN;
            }
        } else if value & ADEN != 0 {
            self.control |= ADEN;
            self.flags |= ADRDY;
        }
        if value & ADSTP != 0 {
            self.control &= !ADSTART;
            self.converting = None;
            self.current = None;
        } else if value & ADSTART != 0 && self.control & (ADEN | ADSTART) == ADEN {
            self.control |= ADSTART;
            if registers.get(CFGR) >> 10 & 3 == 0 {
                self.start(registers, context);
            }
        }
    }

    fn refresh(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        // An overrun blocks requests until the firmware has cleared it, RM0440 21.4.27.
        let asks = registers.get(CFGR) & DMAEN != 0 && self.flags & (EOC | OVR) == EOC;
        let request = Level::from(asks);
        if request != self.request {
            self.request = request;
            context.request(DMA_REQUEST, request);
        }
        let line = Level::from(self.flags & registers.get(IER) & 0x7FF != 0);
        if line != self.line {
            self.line = line;
            context.interrupt(0, line);
        }
    }
}

impl Device for Converter {
    type Register = Word;

    fn read(&mut self, register: Word, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        match register {
            ISR => Some(self.flags),
            CR => Some(self.control),
            DR => {
                let word = registers.get(DR);
                if registers.get(CFGR) & DMAEN != 0 {
                    self.tap(word, registers);
                }
                self.flags &= !EOC;
                self.refresh(registers, context);
                Some(word)
            }
            _ => None,
        }
    }

    fn write(&mut self, register: Word, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match register {
            ISR => self.flags &= !value,
            CR => self.write_control(value, registers, context),
            _ => {}
        }
        self.refresh(registers, context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.converting == Some(event) {
            self.finish(registers, context);
            self.refresh(registers, context);
        }
    }

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match (change.instance, change.request) {
            (amplifier::INSTANCE, amplifier::CONNECTED) => self.amplified = change.level == Level::High,
            (trigger::INSTANCE, trigger::TRGO) => {
                let configuration = registers.get(CFGR);
                // EXTEN: 01 rising, 10 falling, 11 both.
                let edge = if change.level == Level::High { 0b01 } else { 0b10 };
                let listening = configuration >> 10 & edge != 0 && configuration >> 5 & 0x1F == EXTSEL_TIM2_TRGO;
                if listening && self.control & ADSTART != 0 {
                    self.start(registers, context);
                }
            }
            _ => {}
        }
    }

    fn on_clock_input(&mut self, input: usize, hz: u64, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {
        if input == KERNEL_CLOCK {
            self.kernel_hz = hz;
        } else {
            self.hclk_hz = hz;
        }
    }

    fn reset(&mut self) {
        *self = Self {
            force: self.force,
            temperature: self.temperature,
            samples: std::mem::take(&mut self.samples),
            ..Self::new()
        };
    }
}
