//! The STM32G474RE board: models of our own on rigless' core, bus and timers.
//!
//! rigless has no STM32G4, so what the firmware touches is described here, one file a peripheral:
//! clocks and reset flags ([`clocks`]), flash ([`flash`]), DMA behind its multiplexer ([`dma`]),
//! converter and amplifier ([`converter`], [`amplifier`]), CAN ([`fdcan`]) and watchdog
//! ([`watchdog`]), against RM0440. TIM2, TIM3, TIM4 and TIM5 are rigless' ([`crate::timers`]). Pins, power,
//! EXTI and the like only store what is written: a wrong pin function goes unseen here.

mod amplifier;
mod clocks;
mod converter;
mod dma;
mod fdcan;
mod flash;
mod watchdog;
mod word;

use std::num::NonZeroU64;

use rigless::device::{ErasedDevice, ResetCause};
use rigless::machine::{Board, Target};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::Store;
use rigless::soc::stm32f427::generated::{tim2, tim3};
use rigless::soc::stm32f427::peripherals::tim::{Counter, General, Tim};
use rigless::soc::{Bus, Clock, Cpu, Endian, Error, Peripheral, Region, RegisterSpec, WriteModify};
use rigless::time::VirtualNanos;

use crate::Nanos;
use crate::hardware::Hardware;
use crate::outcome::RawSample;
use crate::timers::RESET_HZ;
use crate::timers::encoder::Encoder;
use crate::timers::trigger::{self, Trigger};
use crate::wire::Wire;
use amplifier::Amplifier;
use clocks::Clocks;
use converter::Converter;
use dma::{Dma, Multiplexer};
use fdcan::{Fdcan, View};
use flash::Flash;
use watchdog::Watchdog;
use word::{BLOCK, Stored};

/// The core clock the firmware sets up, which is also the pace of the emulated core.
const CORE_HZ: NonZeroU64 = NonZeroU64::new(160_000_000).unwrap();
/// Interrupts of the part, RM0440 table 97.
const INTERRUPTS: u16 = 102;

/// SRAM1, SRAM2 and the CCM's alias behind them are one stretch of 128 KiB.
static MEMORY: [Region; 3] = [
    Region::flash("flash", 0x0800_0000, 512 << 10).erased_to(0xFF).programmed_by("FLASH"),
    Region::ram("sram", 0x2000_0000, 128 << 10),
    Region::system("system", 0x1FFF_0000, 32 << 10),
];

/// Which of the part's models answers for a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    Trigger,
    Encoder,
    Timer(usize),
    Clocks,
    Flash,
    Multiplexer,
    Dma,
    Converter,
    Amplifier,
    Fdcan(View),
    Watchdog,
    Stored,
}

/// The part's memory map, RM0440 table 3, as far as the firmware goes.
static MAP: [(Model, Peripheral); 26] = {
    const fn at(name: &'static str, base: u64, interrupts: &'static [u16]) -> Peripheral {
        timer(name, base, interrupts, &BLOCK)
    }
    const fn timer(
        name: &'static str,
        base: u64,
        interrupts: &'static [u16],
        registers: &'static [RegisterSpec],
    ) -> Peripheral {
        Peripheral { name, base, size: 0x400, interrupts, registers }
    }
    [
        (Model::Trigger, timer(trigger::INSTANCE, 0x4000_0000, &[28], &tim2::REGISTERS)),
        (Model::Encoder, timer("TIM3", 0x4000_0400, &[29], &tim3::REGISTERS)),
        (Model::Timer(0), timer("TIM4", 0x4000_0800, &[30], &tim3::REGISTERS)),
        (Model::Timer(1), timer("TIM5", 0x4000_0C00, &[50], &tim2::REGISTERS)),
        (Model::Stored, at("RTC", 0x4000_2800, &[])),
        (Model::Watchdog, at("IWDG", 0x4000_3000, &[])),
        (Model::Fdcan(View::Registers), at("FDCAN1", 0x4000_6400, &[21, 22])),
        (Model::Stored, at("PWR", 0x4000_7000, &[])),
        (Model::Stored, at("UCPD1", 0x4000_A000, &[])),
        (Model::Fdcan(View::MessageRam), at("SRAMCAN", 0x4000_A400, &[])),
        (Model::Amplifier, at(amplifier::INSTANCE, 0x4001_0000, &[])),
        (Model::Stored, at("EXTI", 0x4001_0400, &[])),
        (Model::Dma, at("DMA1", 0x4002_0000, &[11, 12, 13, 14, 15, 16, 17, 96])),
        (Model::Stored, at("DMA2", 0x4002_0400, &[])),
        (Model::Multiplexer, at(dma::MULTIPLEXER, 0x4002_0800, &[])),
        (Model::Clocks, at(clocks::INSTANCE, 0x4002_1000, &[])),
        (Model::Flash, at("FLASH", 0x4002_2000, &[4])),
        (Model::Stored, at("GPIOA", 0x4800_0000, &[])),
        (Model::Stored, at("GPIOB", 0x4800_0400, &[])),
        (Model::Stored, at("GPIOC", 0x4800_0800, &[])),
        (Model::Stored, at("GPIOD", 0x4800_0C00, &[])),
        (Model::Stored, at("GPIOE", 0x4800_1000, &[])),
        (Model::Stored, at("GPIOF", 0x4800_1400, &[])),
        (Model::Stored, at("GPIOG", 0x4800_1800, &[])),
        (Model::Converter, at(converter::INSTANCE, 0x5000_0000, &[18])),
        (Model::Stored, at("DBGMCU", 0xE004_2000, &[])),
    ]
};

/// The chip.
#[derive(Debug)]
struct Part {
    bus: Bus,
    /// Which model answers for each slot of the bus.
    models: Vec<Model>,
    trigger: Trigger,
    encoder: Encoder,
    timers: [Tim<General>; 2],
    clocks: Clocks,
    flash: Flash,
    multiplexer: Multiplexer,
    dma: Dma,
    converter: Converter,
    amplifier: Amplifier,
    can: Fdcan,
    watchdog: Watchdog,
    stored: Stored,
    encoder_slot: usize,
    can_slot: usize,
}

fn describe() -> Result<Bus, Error> {
    let cpu = Cpu::new("cortex-m4f", true, INTERRUPTS, Endian::Little);
    let clock = |output| Clock::output(clocks::INSTANCE, output);
    let mut builder = Bus::builder(cpu, &MEMORY, MAP.iter().map(|(_, peripheral)| *peripheral))
        .reads_requests(dma::MULTIPLEXER)
        .reads_requests("DMA1")
        .reads_requests(converter::INSTANCE)
        .clocked_by("FDCAN1", clock(clocks::CAN_CLOCK))
        .clocked_by_each(converter::INSTANCE, &[clock(clocks::CONVERTER_CLOCK), clock(clocks::HCLK)]);
    let timers = [
        (trigger::INSTANCE, Counter::Wide),
        ("TIM3", Counter::Narrow),
        ("TIM4", Counter::Narrow),
        ("TIM5", Counter::Wide),
    ];
    for (timer, counter) in timers {
        // The corrections that rigless makes to the vendor's table for its own part: writing zero
        // clears a status flag, and the reload value is all ones after reset.
        builder = builder
            .clocked_by(timer, clock(clocks::TIMER_CLOCK))
            .write_modify(timer, "SR", WriteModify::ZeroToClear)
            .reset(timer, "ARR", counter.mask());
    }
    builder.build()
}

impl Part {
    fn new() -> Result<Self, Error> {
        let bus = describe()?;
        let model_of = |name: &str| {
            MAP.iter().find(|(_, peripheral)| peripheral.name == name).map_or(Model::Stored, |(model, _)| *model)
        };
        let models = bus.slots().iter().map(|slot| model_of(slot.peripheral().name)).collect();
        let encoder_slot = bus.slot("TIM3")?;
        let can_slot = bus.slot("FDCAN1")?;
        let mut part = Self {
            bus,
            models,
            trigger: Trigger::new(),
            encoder: Encoder::new(),
            timers: [Tim::with_clock(RESET_HZ, Counter::Narrow), Tim::with_clock(RESET_HZ, Counter::Wide)],
            clocks: Clocks::new(),
            flash: Flash::default(),
            multiplexer: Multiplexer::default(),
            dma: Dma::default(),
            converter: Converter::new(),
            amplifier: Amplifier::default(),
            can: Fdcan::new(),
            watchdog: Watchdog::default(),
            stored: Stored,
            encoder_slot,
            can_slot,
        };
        part.set_reset_values();
        Ok(part)
    }

    fn set_reset_values(&mut self) {
        for (slot, model) in self.models.iter().enumerate() {
            let registers = self.bus.slot_mut(slot).registers_mut();
            match model {
                Model::Clocks => Clocks::set_reset_values(registers),
                Model::Flash => flash::set_reset_values(registers),
                Model::Watchdog => watchdog::set_reset_values(registers),
                Model::Fdcan(View::Registers) => fdcan::set_reset_values(registers),
                _ => {}
            }
        }
    }

    /// The timers' clock out of reset, which the clock tree takes as known and so does not drive.
    fn slow_down(&mut self, at: VirtualNanos) {
        for slot in 0..self.models.len() {
            if !matches!(self.models[slot], Model::Trigger | Model::Encoder | Model::Timer(_)) {
                continue;
            }
            if let (bus, Some(timer)) = self.split(slot) {
                let (registers, mut context) = bus.drive(at, slot);
                timer.on_clock(RESET_HZ, registers, &mut context);
            }
        }
    }

    /// Opens a sample at the trigger that has just fired, before its conversions and its transfer.
    fn note_trigger(&mut self) {
        let Some(at) = self.trigger.take_fired() else { return };
        let (registers, mut context) = self.bus.drive(VirtualNanos(at), self.encoder_slot);
        let encoder_count = self.encoder.count(at, registers, &mut context);
        self.converter.begin(RawSample { at, force_code: 0, temperature_code: 0, encoder_count });
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        &self.bus
    }

    fn bus_mut(&mut self) -> &mut Bus {
        &mut self.bus
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.reset_every_model();
        self.clocks.note(cause);
        self.set_reset_values();
        self.slow_down(at);
    }

    /// This part needs a poll only to note a trigger, which must happen before the settle after the
    /// poll passes the trigger on.
    fn poll(&mut self, _: VirtualNanos) {
        self.note_trigger();
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let Some(&model) = self.models.get(slot) else { return (&mut self.bus, None) };
        let device: &mut dyn ErasedDevice = match model {
            Model::Trigger => &mut self.trigger,
            Model::Encoder => &mut self.encoder,
            Model::Timer(n) => &mut self.timers[n],
            Model::Clocks => &mut self.clocks,
            Model::Flash => &mut self.flash,
            Model::Multiplexer => &mut self.multiplexer,
            Model::Dma => &mut self.dma,
            Model::Converter => &mut self.converter,
            Model::Amplifier => &mut self.amplifier,
            Model::Fdcan(view) => {
                self.can.view = view;
                &mut self.can
            }
            Model::Watchdog => &mut self.watchdog,
            Model::Stored => &mut self.stored,
        };
        (&mut self.bus, Some(device))
    }
}

/// The board: the chip, its crystal and its sensors.
#[derive(Debug)]
pub(crate) struct G474 {
    part: Part,
}

/// Empty: runs of this board are not kept in snapshots.
impl Store for G474 {}

impl G474 {
    /// # Errors
    ///
    /// A description rigless refuses, which is a fault of this crate.
    pub(crate) fn new() -> Result<Self, Error> {
        let mut part = Part::new()?;
        part.check()?;
        Ok(Self { part })
    }
}

impl Board for G474 {
    fn name(&self) -> &'static str {
        "guide block, STM32G474RE"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32g474re"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.part)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let core = crate::core::cortex_m4f(&self.part.bus, CORE_HZ);
        vec![Target::new("stm32g474re", &mut self.part, core)]
    }
}

impl Hardware for G474 {
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
        self.part.multiplexer.late = true;
    }

    fn find_flash_error(&mut self) {
        self.part.flash.find_error();
    }

    fn wire(&mut self) -> &mut Wire {
        &mut self.part.can.wire
    }

    fn look_at_bus(&mut self, now: Nanos) {
        let Part { bus, can, can_slot, .. } = &mut self.part;
        let (registers, mut context) = bus.drive(VirtualNanos(now), *can_slot);
        can.look(registers, &mut context);
    }

    fn samples(&mut self) -> &mut Vec<RawSample> {
        &mut self.part.converter.samples
    }
}
