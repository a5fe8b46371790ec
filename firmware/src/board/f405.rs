//! STM32F405RG, the reference board. Register names and sections are those of RM0090.

use core::num::{NonZeroU8, NonZeroU16};

use can_wire::burst::ASK_BASE;
use can_wire::service::REQUEST_BASE;
use can_wire::{BoardKind, NodeId, RawFrame, ResetCause};
use embassy_stm32::adc::{Adc, AdcChannel, Exten, RegularTrigger, RxDma, SampleTime};
use embassy_stm32::can::filter::ListEntry16;
use embassy_stm32::can::util::NominalBitTiming;
use embassy_stm32::can::{
    Can, CanRx, Fifo, Frame, Rx0InterruptHandler, Rx1InterruptHandler, SceInterruptHandler, TxInterruptHandler,
};
use embassy_stm32::dma::{self, Request};
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::Dds;
use embassy_stm32::peripherals::{ADC1, CAN1, DMA1_CH1, DMA2_CH0, IWDG};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{Config as QeiConfig, Qei};
use embassy_stm32::{Config, Peri, bind_interrupts, rcc, triggers};
use embassy_time::Timer;
use embedded_can::StandardId;
use firmware::ports::{CHANNELS, FrameSink, FrameSource, Offer};

use super::Links;

/// The board, as heartbeats name it.
pub(crate) const KIND: BoardKind = BoardKind::Stm32f405;

/// ADC1 is served by stream 0 of DMA2, TIM2's overflow by stream 1 of DMA1 (RM0090, tables 42 and 43).
pub(super) type CodesDma = DMA2_CH0;
pub(super) type CountsDma = DMA1_CH1;

/// 5.3 µs at 21 MHz: a source of 10 kΩ settles to a quarter of a code.
const SAMPLE_TIME: SampleTime = SampleTime::CYCLES112;

/// 500 kbit/s: 42 MHz / 6 = 14 quanta a bit, sampled after 12 of them (85.7 %).
///
/// Written out because embassy's own calculation brings 12 KiB of number formatting with it, for its panic.
#[allow(clippy::unwrap_used, reason = "evaluated while compiling")]
const BIT_TIMING: NominalBitTiming = NominalBitTiming {
    prescaler: NonZeroU16::new(6).unwrap(),
    seg1: NonZeroU8::new(11).unwrap(),
    seg2: NonZeroU8::new(2).unwrap(),
    sync_jump_width: NonZeroU8::new(1).unwrap(),
};

/// Two erase sectors for parameter images: sector 7, which also holds a programmer's record, and sector 8.
pub(super) const IMAGE_REGIONS: [u32; 2] = [0x0806_0000, 0x0808_0000];

/// Bytes of each region.
pub(super) const IMAGE_REGION: u32 = 128 * 1024;

bind_interrupts!(pub(super) struct Irqs {
    CAN1_RX0 => Rx0InterruptHandler<CAN1>;
    CAN1_RX1 => Rx1InterruptHandler<CAN1>;
    CAN1_SCE => SceInterruptHandler<CAN1>;
    CAN1_TX => TxInterruptHandler<CAN1>;
    DMA2_STREAM0 => dma::InterruptHandler<DMA2_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
});

pub(super) fn codes_request(channel: &CodesDma) -> Request {
    RxDma::<ADC1>::request(channel)
}

/// Sets up clocks and drivers; only the bus controller runs yet.
pub(super) fn start() -> (Converter, Links, (Bus, Ears), Peri<'static, IWDG>, Flash<'static, Blocking>) {
    let mut config = Config::default();
    config.rcc = clocks();
    let p = embassy_stm32::init(config);
    let force = AdcChannel::<ADC1>::degrade_adc(p.PA0).get_hw_channel();
    let temperature = AdcChannel::<ADC1>::degrade_adc(p.PA1).get_hw_channel();
    let converter = Converter::new(p.ADC1, [force, temperature]);
    let links = Links {
        trigger: p.TIM2,
        encoder: Qei::new(p.TIM3, p.PC6, p.PC7, QeiConfig::default()),
        codes: p.DMA2_CH0,
        counts: p.DMA1_CH1,
    };
    let mut can = Can::new(p.CAN1, p.PB8, p.PB9, Irqs);
    // until the node is known no filter accepts anything: the block acknowledges the frames of others and keeps none
    can.modify_filters().clear();
    can.modify_config().set_bit_timing(BIT_TIMING);
    let (_, rx) = can.split();
    (converter, links, (Bus::new(can), Ears { rx }), p.IWDG, Flash::new_blocking(p.FLASH))
}

/// 8 MHz / 4 * 168 / 2 = 168 MHz; peripheral buses at 42 and 84 MHz, their timers at twice that.
fn clocks() -> rcc::Config {
    use rcc::*;
    let mut clocks = Config::default();
    clocks.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Oscillator });
    clocks.pll_src = PllSource::HSE;
    clocks.pll = Some(Pll {
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    clocks.ahb_pre = AHBPrescaler::DIV1;
    clocks.apb1_pre = APBPrescaler::DIV4;
    clocks.apb2_pre = APBPrescaler::DIV2;
    clocks.sys = Sysclk::PLL1_P;
    clocks
}

/// Reads the reset flags (7.3.21) and clears them for the next start.
pub(super) fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // every reset pulls the pin, and power-on is a brown-out too: the most specific flag counts
    if flags.porrstf() {
        ResetCause::PowerOn
    } else if flags.wdgrstf() {
        ResetCause::Watchdog
    } else if flags.wwdgrstf() {
        ResetCause::WindowWatchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.lpwrrstf() {
        ResetCause::LowPower
    } else if flags.borrstf() {
        ResetCause::BrownOut
    } else if flags.padrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Unknown
    }
}

/// ADC1, scanning force and temperature at each trigger.
///
/// Set up register by register: embassy's own ring starts with a conversion by software, which would put the
/// codes one scan ahead of the counts, and it ignores the overrun flag.
pub(super) struct Converter;

impl Converter {
    fn new(adc: Peri<'static, ADC1>, sequence: [u8; CHANNELS]) -> Self {
        // dropping it would switch the clock off again
        core::mem::forget(Adc::new(adc));
        let adc = pac::ADC1;
        adc.sqr1().modify(|w| w.set_l(CHANNELS as u8 - 1));
        for (place, channel) in sequence.into_iter().enumerate() {
            adc.sqr3().modify(|w| w.set_sq(place, channel));
            adc.smpr2().modify(|w| w.set_smp(channel.into(), SAMPLE_TIME));
        }
        adc.cr1().modify(|w| w.set_scan(true));
        adc.cr2().modify(|w| {
            w.set_dds(Dds::CONTINUOUS);
            w.set_extsel(RegularTrigger::<ADC1>::signal(&triggers::TIM2_TRGO));
            w.set_exten(Exten::RISING_EDGE);
        });
        Converter
    }

    /// Arms the converter for the timer and clears overruns (13.8.1). Nothing resets the converter: all three share one
    /// reset line, and embassy gives it to none of them.
    pub(super) fn listen(&mut self) {
        // all flags are cleared by writing zeros
        pac::ADC1.sr().write(|_| ());
        pac::ADC1.cr2().modify(|w| {
            w.set_adon(true);
            w.set_dma(true);
        });
    }

    /// Whether a conversion was lost; the converter has then stopped.
    pub(super) fn overran() -> bool {
        pac::ADC1.sr().read().ovr()
    }

    /// Stops it at once.
    pub(super) fn halt() {
        pac::ADC1.cr2().modify(|w| {
            w.set_dma(false);
            w.set_adon(false);
        });
    }
}

/// CAN1 with its three mailboxes, sent in the order of their identifiers.
///
/// Keeps the whole `Can`: embassy puts the controller to sleep when it is dropped, even while halves of it live on.
/// Retransmission stays on, as after reset; `set_automatic_retransmit(true)` of embassy 0.6.0 would switch it off.
pub(crate) struct Bus {
    can: Can<'static>,
}

impl Bus {
    fn new(mut can: Can<'static>) -> Self {
        // One poll leaves sleep mode and switches recovery from bus-off on. The controller then joins the bus by
        // itself, once the bus was idle; until then frames wait in the mailboxes and no code waits.
        let _ = embassy_futures::poll_once(can.enable());
        Bus { can }
    }
}

impl FrameSink for Bus {
    fn offer(&mut self, frame: &RawFrame) -> Offer {
        let mailboxes = pac::CAN1.tsr().read();
        for n in 0..3 {
            let holds_older = !mailboxes.tme(n) && pac::CAN1.tx(n).tir().read().stid() == frame.id;
            if !holds_older {
                continue;
            }
            if mailboxes.abrq(n) {
                return Offer::Busy;
            }
            // embassy's abort spins until an attempt under way has ended; here the next offer checks again
            pac::CAN1.tsr().write(|w| w.set_abrq(n, true));
            return Offer::Withdrawing;
        }
        if (0..3).all(|n| !mailboxes.tme(n)) {
            // embassy would abort the least urgent frame, and spin
            return Offer::Busy;
        }
        let frame = StandardId::new(frame.id).and_then(|id| Frame::new_data(id, &frame.data).ok());
        // an identifier of more than 11 bits cannot be sent; no publisher makes one
        let Some(frame) = frame else { return Offer::Taken };
        match self.can.try_write(&frame) {
            Ok(_) => Offer::Taken,
            Err(_) => Offer::Busy,
        }
    }

    fn holds(&self, id: u16) -> bool {
        let mailboxes = pac::CAN1.tsr().read();
        (0..3).any(|n| !mailboxes.tme(n) && pac::CAN1.tx(n).tir().read().stid() == id)
    }

    fn is_idle(&self) -> bool {
        let mailboxes = pac::CAN1.tsr().read();
        (0..3).all(|n| mailboxes.tme(n))
    }

    fn is_off(&self) -> bool {
        pac::CAN1.esr().read().boff()
    }
}

/// The receiving side of CAN1.
pub(crate) struct Ears {
    rx: CanRx<'static>,
}

impl Ears {
    /// Accepts the frames for this node: service requests, and asking frames of bursts.
    pub(crate) fn listen(&mut self, node: NodeId) {
        let entry = |base: u16| {
            let id = StandardId::new(base + u16::from(node.get())).unwrap_or(StandardId::ZERO);
            ListEntry16::data_frames_with_id(id)
        };
        let (requests, askings) = (entry(REQUEST_BASE), entry(ASK_BASE));
        self.rx.modify_filters().enable_bank(0, Fifo::Fifo0, [requests, askings, requests, askings]);
    }
}

impl FrameSource for Ears {
    async fn frame(&mut self) -> RawFrame {
        loop {
            match self.rx.read().await {
                Ok(envelope) => {
                    if let Some(frame) = super::whole(&envelope.frame) {
                        return frame;
                    }
                }
                // while the bus is in error, every read returns an error at once
                Err(_) => Timer::after_micros(super::IN_ERROR_US).await,
            }
        }
    }
}
