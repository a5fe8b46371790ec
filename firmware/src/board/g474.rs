//! STM32G474RE with the bridge on the chip's own amplifier. Register names are those of RM0440.

use core::num::{NonZeroU8, NonZeroU16};
use core::task::Poll;

use can_wire::burst::ASK_BASE;
use can_wire::service::REQUEST_BASE;
use can_wire::{BoardKind, NodeId, RawFrame, ResetCause};
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, RegularTrigger, RxDma, SampleTime};
use embassy_stm32::can::config::{GlobalFilter, NominalBitTiming};
use embassy_stm32::can::filter::{Action, FilterType, StandardFilter, StandardFilterSlot};
use embassy_stm32::can::{CanConfigurator, CanRx, CanTx, Frame, IT0InterruptHandler, IT1InterruptHandler, Properties};
use embassy_stm32::dma::{self, Request};
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::opamp::{OpAmp, OpAmpGain, OpAmpInternalOutput, OpAmpSpeed};
use embassy_stm32::pac;
use embassy_stm32::pac::adc::vals::{Adstp, Dmacfg, Dmaen};
use embassy_stm32::peripherals::{ADC1, DMA1_CH1, DMA1_CH2, FDCAN1, IWDG, OPAMP1};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{Config as QeiConfig, Qei};
use embassy_stm32::{Config, Peri, bind_interrupts, rcc, triggers};
use embassy_time::Timer;
use embedded_can::StandardId;
use firmware::ports::{CHANNELS, FrameSink, FrameSource, Offer};
use static_cell::StaticCell;

use super::Links;

/// The board, as heartbeats name it.
pub(crate) const KIND: BoardKind = BoardKind::Stm32g474;

/// Two channels of DMA1; the multiplexer routes their requests.
pub(super) type CodesDma = DMA1_CH1;
pub(super) type CountsDma = DMA1_CH2;

/// Input of ADC1 that the output of OPAMP1 is connected to on the chip.
const OPAMP1_OUTPUT: u8 = 13;

/// 2.3 µs at 40 MHz.
const SAMPLE_TIME: SampleTime = SampleTime::CYCLES92_5;

/// 500 kbit/s: 80 MHz / 10 = 16 quanta a bit, sampled after 14 of them (87.5 %).
///
/// Written out because embassy's own calculation brings 12 KiB of number formatting with it, for its panic.
#[allow(clippy::unwrap_used, reason = "evaluated while compiling")]
const BIT_TIMING: NominalBitTiming = NominalBitTiming {
    prescaler: NonZeroU16::new(10).unwrap(),
    seg1: NonZeroU8::new(13).unwrap(),
    seg2: NonZeroU8::new(2).unwrap(),
    sync_jump_width: NonZeroU8::new(1).unwrap(),
};

/// Two halves of the last 128 KiB for parameter images, 32 pages each, all in the second bank: while they are written,
/// the program runs on from the first.
pub(super) const IMAGE_REGIONS: [u32; 2] = [0x0806_0000, 0x0807_0000];

/// Bytes of each region.
pub(super) const IMAGE_REGION: u32 = 64 * 1024;

bind_interrupts!(pub(super) struct Irqs {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
});

pub(super) fn codes_request(channel: &CodesDma) -> Request {
    RxDma::<ADC1>::request(channel)
}

/// Sets up clocks and drivers; only amplifier and bus controller run yet.
pub(super) fn start() -> (Converter, Links, (Bus, Ears), Peri<'static, IWDG>, Flash<'static, Blocking>) {
    static AMPLIFIER: StaticCell<OpAmp<'static, OPAMP1>> = StaticCell::new();
    let mut config = Config::default();
    config.rcc = clocks();
    let p = embassy_stm32::init(config);
    let amplifier = AMPLIFIER.init(OpAmp::new(p.OPAMP1, OpAmpSpeed::Normal));
    let bridge = amplifier.pga_int(p.PA1, OpAmpGain::Mul16);
    let temperature = AdcChannel::<ADC1>::degrade_adc(p.PA0).get_hw_channel();
    let converter = Converter::new(p.ADC1, bridge, temperature);
    let links = Links {
        trigger: p.TIM2,
        encoder: Qei::new(p.TIM3, p.PC6, p.PC7, QeiConfig::default()),
        codes: p.DMA1_CH1,
        counts: p.DMA1_CH2,
    };
    let mut can = CanConfigurator::new(p.FDCAN1, p.PA11, p.PA12, Irqs);
    // until the node is known nothing is accepted: the block acknowledges the frames of others and keeps none
    can.set_config(can.config().set_global_filter(GlobalFilter::reject_all()).set_nominal_bit_timing(BIT_TIMING));
    let (tx, rx, properties) = can.into_normal_mode().split();
    let bus = Bus { tx, holds: [None; MAILBOXES] };
    (converter, links, (bus, Ears { rx, properties }), p.IWDG, Flash::new_blocking(p.FLASH))
}

/// 24 MHz / 6 * 80 / 2 = 160 MHz for the core and its buses, 80 MHz for FDCAN1, 40 MHz for the converter.
fn clocks() -> rcc::Config {
    use rcc::*;
    let mut clocks = Config::default();
    clocks.hse = Some(Hse { freq: Hertz(24_000_000), mode: HseMode::Oscillator });
    clocks.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL80,
        divp: None,
        divq: Some(PllQDiv::DIV4),
        divr: Some(PllRDiv::DIV2),
    });
    clocks.mux.adc12sel = mux::Adcsel::SYS;
    clocks.mux.fdcansel = mux::Fdcansel::PLL1_Q;
    clocks.sys = Sysclk::PLL1_R;
    clocks.boost = true;
    clocks
}

/// Handler for a double word of flash that its ECC cannot correct.
///
/// A save that is cut by power loss leaves such double words. Their content is arbitrary, so the CRC of the record or
/// its commit does not match and the previous image counts: reading goes on. Without this, the block would hang at
/// every start. In the program's own bank nothing can be trusted any more, and any other cause (clock, parity of the
/// RAM) is as bad.
///
/// # Safety
/// Called by the processor only.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let found = pac::FLASH.eccr().read();
    if found.eccd() && found.bk_ecc() && !found.sysf_ecc() {
        // writing 1 clears a flag; the register holds the first error until then
        pac::FLASH.eccr().write(|w| {
            w.set_eccd(true);
            w.set_eccie(found.eccie());
        });
    } else {
        cortex_m::peripheral::SCB::sys_reset();
    }
}

/// Reads the reset flags and clears them for the next start.
pub(super) fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // every reset pulls the pin: the most specific flag counts; power-on and brown-out are one flag here
    if flags.borrstf() {
        ResetCause::PowerOn
    } else if flags.iwdgrstf() {
        ResetCause::Watchdog
    } else if flags.wwdgrstf() {
        ResetCause::WindowWatchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.lpwrrstf() {
        ResetCause::LowPower
    } else if flags.pinrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Unknown
    }
}

/// ADC1, scanning the amplified bridge and the temperature at each trigger.
///
/// Set up register by register, like that of the other board, so that both run the same sampler.
pub(super) struct Converter {
    /// Kept alive: embassy switches the amplifier off when its output is dropped, also by turning it into a channel.
    _bridge: OpAmpInternalOutput<'static, OPAMP1>,
}

impl Converter {
    fn new(adc: Peri<'static, ADC1>, bridge: OpAmpInternalOutput<'static, OPAMP1>, temperature: u8) -> Self {
        // clocks, calibrates and enables it; on this chip dropping it does nothing
        let _ = Adc::new(adc, AdcConfig::default());
        let adc = pac::ADC1;
        adc.sqr1().modify(|w| w.set_l(CHANNELS as u8 - 1));
        for (place, channel) in [OPAMP1_OUTPUT, temperature].into_iter().enumerate() {
            adc.sqr1().modify(|w| w.set_sq(place, channel));
            match channel {
                0..=9 => adc.smpr().modify(|w| w.set_smp(channel.into(), SAMPLE_TIME)),
                _ => adc.smpr2().modify(|w| w.set_smp(usize::from(channel) - 10, SAMPLE_TIME)),
            }
        }
        adc.cfgr().modify(|w| {
            w.set_dmacfg(Dmacfg::CIRCULAR);
            w.set_extsel(RegularTrigger::<ADC1>::signal(&triggers::TIM2_TRGO));
            w.set_exten(Exten::RISING_EDGE);
        });
        Converter { _bridge: bridge }
    }

    /// Arms the converter for the timer and clears overruns. Starts no conversion by itself.
    pub(super) fn listen(&mut self) {
        let adc = pac::ADC1;
        adc.isr().write(|w| {
            w.set_ovr(true);
            w.set_eoc(true);
            w.set_eos(true);
        });
        adc.cfgr().modify(|w| w.set_dmaen(Dmaen::ENABLE));
        adc.cr().modify(|w| w.set_adstart(true));
    }

    /// Whether a conversion was lost; the converter then requests no more transfers.
    pub(super) fn overran() -> bool {
        pac::ADC1.isr().read().ovr()
    }

    /// Stops it; takes some cycles of the converter's clock.
    pub(super) fn halt() {
        let adc = pac::ADC1;
        if adc.cr().read().adstart() {
            adc.cr().modify(|w| w.set_adstp(Adstp::STOP));
            while adc.cr().read().adstart() {}
        }
        adc.cfgr().modify(|w| w.set_dmaen(Dmaen::DISABLE));
    }
}

const MAILBOXES: usize = 3;

/// FDCAN1 with classical frames and its three transmit buffers as a queue ordered by identifier. Retransmission
/// and recovery from bus-off are embassy's defaults, on.
pub(crate) struct Bus {
    tx: CanTx<'static>,
    /// identifier last written to each buffer; the controller knows whether it still waits
    holds: [Option<u16>; MAILBOXES],
}

impl FrameSink for Bus {
    fn offer(&mut self, frame: &RawFrame) -> Offer {
        let can = pac::FDCAN1;
        let pending = can.txbrp().read();
        for n in 0..MAILBOXES {
            if !pending.trp(n) || self.holds[n] != Some(frame.id) {
                continue;
            }
            if can.txbcr().read().cr(n) {
                return Offer::Busy;
            }
            can.txbcr().write(|w| w.set_cr(n, true));
            return Offer::Withdrawing;
        }
        let queue = can.txfqs().read();
        if queue.tfqf() {
            // embassy would cancel a less urgent frame, and spin until an attempt under way has ended
            return Offer::Busy;
        }
        let classic = StandardId::new(frame.id).and_then(|id| Frame::new_data(id, &frame.data).ok());
        // an identifier of more than 11 bits cannot be sent; no publisher makes one
        let Some(classic) = classic else { return Offer::Taken };
        // there is room, so the first poll writes
        match embassy_futures::poll_once(self.tx.write(&classic)) {
            Poll::Ready(_) => {
                if let Some(place) = self.holds.get_mut(usize::from(queue.tfqpi())) {
                    *place = Some(frame.id);
                }
                Offer::Taken
            }
            Poll::Pending => Offer::Busy,
        }
    }

    fn holds(&self, id: u16) -> bool {
        let pending = pac::FDCAN1.txbrp().read();
        self.holds.iter().enumerate().any(|(n, held)| pending.trp(n) && *held == Some(id))
    }

    fn is_idle(&self) -> bool {
        let pending = pac::FDCAN1.txbrp().read();
        (0..MAILBOXES).all(|n| !pending.trp(n))
    }

    fn is_off(&self) -> bool {
        pac::FDCAN1.psr().read().bo()
    }
}

/// The receiving side of FDCAN1.
pub(crate) struct Ears {
    rx: CanRx<'static>,
    properties: Properties,
}

impl Ears {
    /// Accepts the frames for this node: service requests, and asking frames of bursts.
    pub(crate) fn listen(&mut self, node: NodeId) {
        let id = |base: u16| StandardId::new(base + u16::from(node.get())).unwrap_or(StandardId::ZERO);
        let both = StandardFilter {
            filter: FilterType::DedicatedDual(id(REQUEST_BASE), id(ASK_BASE)),
            action: Action::StoreInFifo0,
        };
        self.properties.set_standard_filter(StandardFilterSlot::_0, both);
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
