//! The boards. Every pin, clock and driver is named here and nowhere else, and so is all unsafe code.
//!
//! | | `board-f405` | `board-g474` |
//! |---|---|---|
//! | chip | STM32F405RG, 168 MHz from an 8 MHz crystal | STM32G474RE, 160 MHz from a 24 MHz crystal |
//! | force | PA0, bridge amplifier outside | PA1, bridge through OPAMP1 with gain 16 |
//! | temperature | PA1 | PA0 |
//! | encoder A, B | PC6, PC7 | PC6, PC7 |
//! | bus RX, TX, 500 kbit/s | PB8, PB9 (CAN1) | PA11, PA12 (FDCAN1, classical frames) |
//!
//! Both sample alike: TIM2 overflows 1600 times a second. The overflow starts a scan of two conversions, whose
//! results go to one ring in memory, and at the same instant makes the DMA copy TIM3's count to a second ring. The
//! processor takes no part in it, so force and position have one clock and no jitter.
#![allow(unsafe_code, reason = "registers and fixed addresses; each block says why it is sound")]

use can_wire::{RawFrame, ResetCause};
use cortex_m::peripheral::SCB;
use embassy_stm32::Peri;
use embassy_stm32::can::Frame;
use embassy_stm32::dma::{Channel, ReadableRingBuffer, TransferOptions};
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::pac;
use embassy_stm32::peripherals::{IWDG, TIM2, TIM3};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::UpDma;
use embassy_stm32::timer::low_level::{CountingMode, MasterMode, RoundTo, Timer as Tim};
use embassy_stm32::timer::qei::Qei;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Instant, Timer};
use embedded_can::Id;
use firmware::ports::{CHANNELS, Clock, Interruption, Restart, SampleRun, SampleSource, Samples, Storage, Watchdog};
use firmware::runners::supervise::WATCHDOG_US;
use firmware::store::{self, Store};
use model_core::sample::{SAMPLE_HZ, SAMPLES_PER_BLOCK};
use static_cell::ConstStaticCell;

mod boots;
#[cfg(feature = "board-f405")]
#[path = "f405.rs"]
mod chip;
#[cfg(feature = "board-g474")]
#[path = "g474.rs"]
mod chip;

#[cfg(all(feature = "board-f405", feature = "board-g474"))]
compile_error!("choose one board: for the G474 add --no-default-features");
#[cfg(not(any(feature = "board-f405", feature = "board-g474")))]
compile_error!("choose a board: --features board-f405 or --features board-g474");

pub(crate) use chip::{Bus, Ears, KIND};

/// Everything that the runners use of the board.
pub(crate) struct Board {
    pub(crate) sampler: Sampler,
    pub(crate) bus: Bus,
    pub(crate) ears: Ears,
    pub(crate) watchdog: Dog,
    pub(crate) parameters: ParameterFlash,
    pub(crate) store: ImageStore,
    pub(crate) reset_cause: ResetCause,
    pub(crate) boot_count: u16,
    pub(crate) unique: [u32; 3],
}

/// Starts the board; the watchdog runs from here on. To be called once.
pub(crate) fn start() -> Board {
    // before anything else may clear the flags
    let reset_cause = chip::take_reset_cause();
    let boot_count = boots::count(reset_cause);
    let (converter, links, (bus, ears), iwdg, flash) = chip::start();
    // may take two seconds if it has to erase, so it runs before the watchdog does
    let mut images = image_store(flash);
    if images.prepare().is_err() {
        defmt::error!("no room for the next parameter image: the flash does not erase");
    }
    let mut watchdog = IndependentWatchdog::new(iwdg, WATCHDOG_US);
    watchdog.unleash();
    Board {
        sampler: Sampler::new(converter, links),
        bus,
        ears,
        watchdog: Dog(watchdog),
        parameters: ParameterFlash,
        store: images,
        reset_cause,
        boot_count,
        unique: unique(),
    }
}

/// The chip's own identifier, lowest word first.
fn unique() -> [u32; 3] {
    let mut words = [0; 3];
    for (word, bytes) in words.iter_mut().zip(embassy_stm32::uid::uid().as_chunks::<4>().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    words
}

/// Pause before the receiver is asked again while the bus is in error, µs.
const IN_ERROR_US: u64 = 5_000;

/// A frame as the runners take it: 11-bit identifier, eight bytes.
fn whole(frame: &Frame) -> Option<RawFrame> {
    let Id::Standard(id) = frame.id() else { return None };
    let data = frame.data().try_into().ok().filter(|_| frame.header().len() == 8)?;
    Some(RawFrame { id: id.as_raw(), data })
}

/// Peripherals that connect the sampler.
struct Links {
    trigger: Peri<'static, TIM2>,
    encoder: Qei<'static, TIM3>,
    codes: Peri<'static, chip::CodesDma>,
    counts: Peri<'static, chip::CountsDma>,
}

/// Two halves of one block each: the DMA fills one while the other is read.
const CODES: usize = 2 * CHANNELS * SAMPLES_PER_BLOCK;
const COUNTS: usize = 2 * SAMPLES_PER_BLOCK;

/// Converter, encoder and the timer that paces both.
pub(crate) struct Sampler {
    converter: chip::Converter,
    trigger: Tim<'static, TIM2>,
    codes: (Peri<'static, chip::CodesDma>, &'static mut [u16; CODES]),
    counts: (Peri<'static, chip::CountsDma>, &'static mut [u16; COUNTS]),
    _encoder: Qei<'static, TIM3>,
}

impl Sampler {
    fn new(converter: chip::Converter, links: Links) -> Self {
        static CODE_RING: ConstStaticCell<[u16; CODES]> = ConstStaticCell::new([0; CODES]);
        static COUNT_RING: ConstStaticCell<[u16; COUNTS]> = ConstStaticCell::new([0; COUNTS]);
        let trigger = Tim::new(links.trigger);
        trigger.set_counting_mode(CountingMode::EdgeAlignedUp);
        // 84 MHz / 52500 and 160 MHz / 100000: both without remainder
        trigger.set_frequency(Hertz(SAMPLE_HZ), RoundTo::Faster);
        trigger.set_master_mode(MasterMode::UPDATE);
        Sampler {
            converter,
            trigger,
            codes: (links.codes, CODE_RING.take()),
            counts: (links.counts, COUNT_RING.take()),
            _encoder: links.encoder,
        }
    }
}

impl SampleSource for Sampler {
    type Run<'a> = Run<'a>;

    /// Both rings begin at their first place and are armed before the timer starts, and only the timer triggers
    /// transfers. So item n of one belongs to item n of the other as long as neither is disturbed.
    fn start(&mut self) -> Run<'_> {
        let (channel, ring) = &mut self.codes;
        let request = chip::codes_request(channel);
        let channel = Channel::new(channel.reborrow(), chip::Irqs);
        let from = pac::ADC1.dr().as_ptr().cast::<u16>();
        // SAFETY: the transfer reads the data register of the converter, 16 bits wide in its lower half, and
        // writes to `ring`, which it borrows and which outlives it; `Run` ends it in all cases, by its drop.
        let mut codes =
            unsafe { ReadableRingBuffer::new(channel, request, from, ring.as_mut_slice(), TransferOptions::default()) };
        codes.set_alignment(CHANNELS);

        let (channel, ring) = &mut self.counts;
        let request = UpDma::<TIM2>::request(&**channel);
        let channel = Channel::new(channel.reborrow(), chip::Irqs);
        let from = pac::TIM3.cnt().as_ptr().cast::<u16>();
        // SAFETY: as above, with the count of the encoder's timer, which reading does not change.
        let mut counts =
            unsafe { ReadableRingBuffer::new(channel, request, from, ring.as_mut_slice(), TransferOptions::default()) };

        counts.start();
        codes.start();
        self.converter.listen();
        self.trigger.reset();
        self.trigger.enable_update_dma(true);
        self.trigger.start();
        Run { trigger: &self.trigger, codes, counts }
    }
}

/// The two transfers under way.
pub(crate) struct Run<'a> {
    trigger: &'a Tim<'static, TIM2>,
    codes: ReadableRingBuffer<'a, u16>,
    counts: ReadableRingBuffer<'a, u16>,
}

impl SampleRun for Run<'_> {
    async fn block(&mut self, into: &mut Samples) -> Result<(), Interruption> {
        // the last count of a block arrives before its last code, so the second read never waits
        self.codes.read_exact(&mut into.codes).await.map_err(|_| Interruption::RingOverrun)?;
        self.counts.read_exact(&mut into.counts).await.map_err(|_| Interruption::RingOverrun)?;
        if chip::Converter::overran() { Err(Interruption::ConverterOverrun) } else { Ok(()) }
    }
}

impl Drop for Run<'_> {
    fn drop(&mut self) {
        self.trigger.stop();
        // withdraws a request that was not served; it would become the next run's first count
        self.trigger.enable_update_dma(false);
        chip::Converter::halt();
    }
}

/// Store that saves the parameter images through the flash driver.
pub(crate) type ImageStore = Store<'static, Flash<'static, Blocking>>;

/// Address at which flash begins.
const FLASH_BASE: u32 = 0x0800_0000;

fn image_store(flash: Flash<'static, Blocking>) -> ImageStore {
    static PLACE: ConstStaticCell<[u8; store::PLACE]> = ConstStaticCell::new([0; store::PLACE]);
    let offsets = chip::IMAGE_REGIONS.map(|address| address - FLASH_BASE);
    Store::new(flash, offsets, chip::IMAGE_REGION, PLACE.take())
}

/// The parameter images as mapped into memory. Read at start-up only, before anything could be saved.
pub(crate) struct ParameterFlash;

impl Storage for ParameterFlash {
    fn regions(&self) -> [&[u8]; 2] {
        chip::IMAGE_REGIONS.map(|address| {
            let start = core::ptr::with_exposed_provenance::<u8>(address as usize);
            // SAFETY: whole sectors of the chip's flash behind the image, readable byte by byte from reset to reset;
            // what is read at start-up is dropped before a store may write there.
            unsafe { core::slice::from_raw_parts(start, chip::IMAGE_REGION as usize) }
        })
    }
}

/// Reset by software.
pub(crate) struct Reset;

impl Restart for Reset {
    fn restart(&mut self) {
        SCB::sys_reset();
    }
}

/// The independent watchdog.
pub(crate) struct Dog(IndependentWatchdog<'static, IWDG>);

impl Watchdog for Dog {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// TIM5, which is embassy's time driver on both boards.
#[derive(Clone, Copy)]
pub(crate) struct Uptime;

impl Clock for Uptime {
    fn now_us(&self) -> u64 {
        Instant::now().as_micros()
    }

    async fn sleep_until(&self, us: u64) {
        Timer::at(Instant::from_micros(us)).await;
    }
}
