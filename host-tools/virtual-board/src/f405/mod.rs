//! The STM32F405RG board: rigless' STM32F427 with the parts it lacks.
//!
//! The F427 is the F405's larger sister, one reference manual (RM0090) for both. Ours are the bxCAN
//! ([`bxcan`]), the wiring between TIM2, the converter and the DMA controllers ([`crate::timers`],
//! [`converter`], [`converter_dma`]) and the encoder on TIM3's pins. Everything else,
//! clocks, reset flags, DMA streams, timers, conversion times, the watchdog, is rigless' own.

mod bxcan;
mod converter;
mod converter_dma;

use std::num::NonZeroU64;

use rigless::device::{Device, ErasedDevice, ResetCause};
use rigless::machine::{Board, Target};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::peripherals::dma::{Dma, Wire as RequestWire};
use rigless::soc::stm32f427::peripherals::tim::UPDATE_REQUEST;
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use crate::Nanos;
use crate::hardware::Hardware;
use crate::outcome::RawSample;
use crate::timers::RESET_HZ;
use crate::timers::encoder::Encoder;
use crate::timers::trigger::{self, Trigger};
use crate::wire::Wire;
use bxcan::BxCan;
use converter::Converter;
use converter_dma::ConverterDma;

/// The crystal on the board.
const HSE_HZ: u64 = 8_000_000;
/// The core clock the firmware sets up, which is also the pace of the emulated core.
pub(crate) const CORE_HZ: NonZeroU64 = NonZeroU64::new(168_000_000).unwrap();
/// 3.3 V, in millivolts.
const SUPPLY_MILLIVOLTS: u32 = 3_300;

/// RM0090 table 43, the one row the firmware uses: TIM2_UP on channel 3 of streams 1 and 7.
static TIMER_REQUESTS: [RequestWire; 1] =
    [RequestWire { instance: trigger::INSTANCE, request: UPDATE_REQUEST, channel: 3, streams: &[1, 7] }];

/// The chip.
#[derive(Debug)]
struct Part {
    mcu: Stm32f427,
    can: BxCan,
    trigger: Trigger,
    encoder: Encoder,
    converter: Converter,
    converter_dma: ConverterDma,
    slots: Slots,
}

/// The slots of the bus our models answer for.
#[derive(Debug, Clone, Copy)]
struct Slots {
    clocks: usize,
    can: usize,
    trigger: usize,
    encoder: usize,
    converter: usize,
    converter_dma: usize,
}

impl Part {
    fn new() -> Result<Self, Error> {
        let mut mcu = Stm32f427::new()?;
        let bus = mcu.bus();
        let slots = Slots {
            clocks: bus.slot("RCC")?,
            can: bus.slot("CAN1")?,
            trigger: bus.slot(trigger::INSTANCE)?,
            encoder: bus.slot("TIM3")?,
            converter: bus.slot("ADC1")?,
            converter_dma: bus.slot("DMA2")?,
        };
        mcu.dma[0] = timer_dma();
        Ok(Self {
            mcu,
            can: BxCan::new(),
            trigger: Trigger::new(),
            encoder: Encoder::new(),
            converter: Converter::new(),
            converter_dma: ConverterDma::new(),
            slots,
        })
    }

    /// The clocks out of reset, which the new clock tree takes as known and so does not drive.
    fn slow_down(&mut self, at: VirtualNanos) {
        let Self { mcu, trigger, encoder, converter, slots, .. } = self;
        let (registers, mut context) = mcu.bus_mut().drive(at, slots.trigger);
        Device::on_clock(trigger, RESET_HZ, registers, &mut context);
        let (registers, mut context) = mcu.bus_mut().drive(at, slots.encoder);
        Device::on_clock(encoder, RESET_HZ, registers, &mut context);
        let (registers, mut context) = mcu.bus_mut().drive(at, slots.converter);
        Device::on_clock(converter, converter::RESET_HZ, registers, &mut context);
    }

    /// Opens a sample at the trigger that has just fired, before its conversions and its transfer.
    fn note_trigger(&mut self) {
        let Some(at) = self.trigger.take_fired() else { return };
        let (registers, mut context) = self.mcu.bus_mut().drive(VirtualNanos(at), self.slots.encoder);
        let encoder_count = self.encoder.count(at, registers, &mut context);
        self.converter.begin(RawSample { at, force_code: 0, temperature_code: 0, encoder_count });
    }
}

/// DMA1, hearing TIM2's update.
fn timer_dma() -> Dma {
    Dma::new(&TIMER_REQUESTS, &[], false)
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        self.mcu.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.mcu.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.mcu.reset(at, cause);
        self.mcu.dma[0] = timer_dma();
        Device::reset(&mut self.can);
        Device::reset(&mut self.trigger);
        Device::reset(&mut self.encoder);
        Device::reset(&mut self.converter);
        Device::reset(&mut self.converter_dma);
        self.slow_down(at);
    }

    /// This part needs a poll only to note a trigger, which must happen before the settle after the
    /// poll passes the trigger on.
    fn poll(&mut self, _: VirtualNanos) {
        self.note_trigger();
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let Self { mcu, can, trigger, encoder, converter, converter_dma, slots } = self;
        let model: &mut dyn ErasedDevice = match slot {
            slot if slot == slots.can => {
                can.clock_hz = mcu.rcc.pclk1(mcu.bus().slots()[slots.clocks].registers());
                can
            }
            slot if slot == slots.trigger => trigger,
            slot if slot == slots.encoder => encoder,
            slot if slot == slots.converter => converter,
            slot if slot == slots.converter_dma => converter_dma,
            _ => return mcu.split(slot),
        };
        (mcu.bus_mut(), Some(model))
    }
}

/// The board: the chip, its crystal and its sensors.
#[derive(Debug)]
pub(crate) struct F405 {
    part: Part,
}

/// Empty: runs of this board are not kept in snapshots.
impl Store for F405 {}

impl F405 {
    /// # Errors
    ///
    /// A description rigless refuses, which is a fault of this crate.
    pub(crate) fn new() -> Result<Self, Error> {
        let mut part = Part::new()?;
        part.mcu.rcc.attach_crystals(HSE_HZ, 0);
        part.mcu.set_supply(SUPPLY_MILLIVOLTS);
        part.check()?;
        Ok(Self { part })
    }
}

impl Board for F405 {
    fn name(&self) -> &'static str {
        "guide block, STM32F405RG"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32f405rg"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.part)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let core = crate::core::cortex_m4f(self.part.bus(), CORE_HZ);
        vec![Target::new("stm32f405rg", &mut self.part, core)]
    }
}

impl Hardware for F405 {
    fn set_force(&mut self, code: u16) {
        self.part.converter.set_force(code);
    }

    fn set_temperature(&mut self, code: u16) {
        self.part.converter.set_temperature(code);
    }

    fn move_encoder(&mut self, now: Nanos, counts: i64, by: Nanos) {
        self.part.encoder.motion.move_to(now, counts, by);
    }

    fn lose_conversion(&mut self) {
        self.part.converter_dma.late = true;
    }

    fn find_flash_error(&mut self) {}

    fn wire(&mut self) -> &mut Wire {
        &mut self.part.can.wire
    }

    fn look_at_bus(&mut self, now: Nanos) {
        let Part { mcu, can, slots, .. } = &mut self.part;
        let (registers, mut context) = mcu.bus_mut().drive(VirtualNanos(now), slots.can);
        can.look(registers, &mut context);
    }

    fn samples(&mut self) -> &mut Vec<RawSample> {
        &mut self.part.converter.samples
    }
}
