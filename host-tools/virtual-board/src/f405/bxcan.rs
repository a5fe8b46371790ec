//! CAN1: the bxCAN of RM0090 chapter 32, of which rigless has the registers but no model.
//!
//! Modes and their handshake, bit timing, three transmit mailboxes sent by identifier, abort, both
//! receive FIFOs behind all 28 filter banks, missing acknowledgements, bit errors, bus-off and both
//! ways out of it, and the four interrupt lines. Not here: time-triggered operation, loop back and
//! silent mode, sleep and wake-up by bus activity, `TXFP` order, and arbitration loss as a flag
//! (a frame that loses waits, and goes out next).

use std::collections::VecDeque;

use rigless::chip::can::{Frame, Id};
use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::Layout;
use rigless::soc::stm32f427::generated::can1::Register as R;
use rigless::time::{EventId, VirtualNanos};

use crate::timers::RESET_HZ;
use crate::wire::{Ended, Wire};

/// What `MCR` and `MSR` hold after a reset: asleep.
const MCR_RESET: u64 = 0x0001_0002;
const MSR_RESET: u64 = 0x0000_0C02;

const MCR_INRQ: u64 = 1;
const MCR_SLEEP: u64 = 1 << 1;
const MCR_NART: u64 = 1 << 4;
const MCR_ABOM: u64 = 1 << 6;
const MCR_RESET_REQUEST: u64 = 1 << 15;
const MSR_INAK: u64 = 1;
const MSR_SLAK: u64 = 1 << 1;
const MSR_ERRI: u64 = 1 << 2;
/// `ERRI`, `WKUI`, `SLAKI`, cleared by writing ones.
const MSR_FLAGS: u64 = 0b1_1100;
const ESR_BOFF: u64 = 1 << 2;
/// `LEC` of a missing acknowledgement and of a recessive bit that read dominant.
const LEC_ACKNOWLEDGE: u64 = 0b011 << 4;
const LEC_BIT_RECESSIVE: u64 = 0b100 << 4;
const TIR_TXRQ: u64 = 1;
/// `RQCP`, `TXOK`, `ALST` and `TERR` of the three mailboxes.
const TSR_RESULTS: u64 = 0x000F_0F0F;
const RFR_FULL: u64 = 1 << 3;
const RFR_OVERRUN: u64 = 1 << 4;
const RFR_RELEASE: u64 = 1 << 5;
const FIFO_DEPTH: usize = 3;
const BANKS: usize = 28;
/// Recessive bits before a controller takes part in the bus, and before it may after bus-off.
const SYNCHRONIZATION_BITS: u64 = 11;
const RECOVERY_BITS: u64 = 128 * 11;

/// The interrupt lines, in the order the instance lists them.
const TRANSMIT: usize = 0;
const RECEIVE: [usize; 2] = [1, 2];
const STATUS_CHANGE: usize = 3;

const TIR: [R; 3] = [R::Ti0r, R::Ti1r, R::Ti2r];
const TDTR: [R; 3] = [R::Tdt0r, R::Tdt1r, R::Tdt2r];
const TDLR: [R; 3] = [R::Tdl0r, R::Tdl1r, R::Tdl2r];
const TDHR: [R; 3] = [R::Tdh0r, R::Tdh1r, R::Tdh2r];
const RFR: [R; 2] = [R::Rf0r, R::Rf1r];
const RIR: [R; 2] = [R::Ri0r, R::Ri1r];
const RDTR: [R; 2] = [R::Rdt0r, R::Rdt1r];
const RDLR: [R; 2] = [R::Rdl0r, R::Rdl1r];
const RDHR: [R; 2] = [R::Rdh0r, R::Rdh1r];

/// The controller and the bus behind it.
#[derive(Debug)]
pub(crate) struct BxCan {
    pub(crate) wire: Wire,
    /// PCLK1. The bus wires no clock to this instance, so the part sets it.
    pub(super) clock_hz: u64,
    on_wire: Option<OnWire>,
    fifos: [VecDeque<Frame>; 2],
    synchronized: Option<EventId>,
    recovered: Option<EventId>,
    results: u64,
    /// `ABRQ` of a mailbox on the wire, kept until the attempt ends.
    aborting: [bool; 3],
    last_error: u64,
    lines: [Level; 4],
}

/// The frame that has the bus.
#[derive(Debug, Clone, Copy)]
struct OnWire {
    ends: EventId,
    /// Our mailbox, or `None` for a frame of another node.
    mailbox: Option<usize>,
    frame: Frame,
}

impl BxCan {
    pub(crate) fn new() -> Self {
        Self {
            wire: Wire::default(),
            clock_hz: RESET_HZ,
            on_wire: None,
            fifos: Default::default(),
            synchronized: None,
            recovered: None,
            results: 0,
            aborting: [false; 3],
            last_error: 0,
            lines: [Level::Low; 4],
        }
    }

    /// The bench changed something on the bus.
    pub(crate) fn look(&mut self, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        self.start_next(r, c);
    }

    /// The instant `bits` bit times from now, by `BTR`.
    fn after_bits(&self, bits: u64, r: &RegisterFile, c: &DeviceContext<'_>) -> VirtualNanos {
        let timing = r.get(R::Btr);
        let prescaler = (timing & 0x3FF) + 1;
        let quanta = 3 + (timing >> 16 & 0xF) + (timing >> 20 & 0x7);
        VirtualNanos(c.now().0 + bits * prescaler * quanta * 1_000_000_000 / self.clock_hz.max(1))
    }

    fn takes_part(r: &RegisterFile) -> bool {
        r.get(R::Msr) & (MSR_INAK | MSR_SLAK) == 0 && r.get(R::Esr) & ESR_BOFF == 0
    }

    fn mailbox(n: usize, r: &RegisterFile) -> Frame {
        let word = r.get(TIR[n]);
        let id = if word & 4 != 0 { Id::Extended((word >> 3) as u32) } else { Id::Standard((word >> 21) as u16) };
        let mut data = [0; 8];
        data[..4].copy_from_slice(&(r.get(TDLR[n]) as u32).to_le_bytes());
        data[4..].copy_from_slice(&(r.get(TDHR[n]) as u32).to_le_bytes());
        Frame { id, remote: word & 2 != 0, dlc: (r.get(TDTR[n]) & 0xF) as u8, data }
    }

    /// Gives an idle bus to the frame that wins arbitration.
    fn start_next(&mut self, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        if self.on_wire.is_some() || !Self::takes_part(r) {
            return;
        }
        let own = (0..3).filter(|&n| r.get(TIR[n]) & TIR_TXRQ != 0).map(|n| (Some(n), Self::mailbox(n, r)));
        let other = self.wire.offered().map(|frame| (None, *frame));
        // `min_by` keeps the first of equals, which is the lowest mailbox, as the controller does.
        let Some((mailbox, frame)) = own.chain(other).min_by(|(_, a), (_, b)| a.arbitrates(b)) else {
            return;
        };
        let bits = match mailbox {
            Some(_) => self.wire.bits_for_own(&frame),
            None => Wire::bits_for_other(&frame),
        };
        let ends = c.schedule(self.after_bits(bits, r, c));
        self.on_wire = Some(OnWire { ends, mailbox, frame });
    }

    /// The frame on the wire has ended.
    fn finish(&mut self, ended: OnWire, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        let Some(n) = ended.mailbox else {
            if let Some(frame) = self.wire.take_offered() {
                self.receive(frame, r);
            }
            return;
        };
        let done = |results: u64, r: &mut RegisterFile| {
            r.set(TIR[n], r.get(TIR[n]) & !TIR_TXRQ);
            results << (8 * n)
        };
        let aborted = std::mem::take(&mut self.aborting[n]);
        match self.wire.end_own(c.now().0, &ended.frame) {
            // RQCP and TXOK.
            Ended::Acknowledged => self.results |= done(0b0011, r),
            outcome => {
                self.last_error = if outcome == Ended::Disturbed { LEC_BIT_RECESSIVE } else { LEC_ACKNOWLEDGE };
                if r.get(R::Mcr) & MCR_NART != 0 || aborted {
                    // RQCP and TERR.
                    self.results |= done(0b1001, r);
                }
                self.report_error(r, c);
            }
        }
    }

    /// `ESR` and the error interrupt after a failed transmission, RM0090 32.7.6 and 32.9.
    fn report_error(&mut self, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        self.mirror_errors(r);
        let (enabled, errors) = (r.get(R::Ier), r.get(R::Esr));
        // EWGIE, EPVIE, BOFIE against EWGF, EPVF, BOFF, and LECIE.
        if enabled >> 8 & errors & 0b111 != 0 || enabled >> 11 & 1 != 0 {
            r.set(R::Msr, r.get(R::Msr) | MSR_ERRI);
        }
        if self.wire.bus_off() && self.recovered.is_none() && r.get(R::Mcr) & MCR_ABOM != 0 {
            self.recovered = Some(c.schedule(self.after_bits(RECOVERY_BITS, r, c)));
        }
    }

    fn mirror_errors(&self, r: &mut RegisterFile) {
        let flags =
            u64::from(self.wire.warns()) | u64::from(self.wire.passive()) << 1 | u64::from(self.wire.bus_off()) << 2;
        r.set(R::Esr, flags | self.last_error | u64::from(self.wire.transmit_error_count()) << 16);
    }

    /// The FIFO the filter banks put a frame into, RM0090 32.7.4.
    fn accepting_fifo(frame: &Frame, r: &RegisterFile) -> Option<usize> {
        let word = match frame.id {
            Id::Standard(id) => u64::from(id) << 21,
            Id::Extended(id) => u64::from(id) << 3 | 4,
        } | u64::from(frame.remote) << 1;
        // The 16-bit form: STID, RTR, IDE and the top three bits of EXID.
        let half = word >> 16 & 0xFFE0
            | u64::from(frame.remote) << 4
            | u64::from(frame.id.is_extended()) << 3
            | word >> 18 & 7;
        let bit = |register: R, n: usize| r.get(register) >> n & 1 == 1;
        (0..BANKS).filter(|&n| bit(R::Fa1r, n)).find_map(|n| {
            let row = R::F0r1.index() + 2 * n;
            let (first, second) = (r.get(R::from_index(row)?), r.get(R::from_index(row + 1)?));
            let hit = match (bit(R::Fs1r, n), bit(R::Fm1r, n)) {
                (true, false) => (word ^ first) & second & !1 == 0,
                (true, true) => word == first & !1 || word == second & !1,
                (false, false) => [first, second].iter().any(|v| (half ^ v & 0xFFFF) & v >> 16 == 0),
                (false, true) => [first, second].iter().any(|v| half == v & 0xFFFF || half == v >> 16),
            };
            hit.then(|| usize::from(bit(R::Ffa1r, n)))
        })
    }

    fn receive(&mut self, frame: Frame, r: &mut RegisterFile) {
        let Some(n) = Self::accepting_fifo(&frame, r) else { return };
        if self.fifos[n].len() == FIFO_DEPTH {
            r.set(RFR[n], r.get(RFR[n]) | RFR_OVERRUN);
            return;
        }
        self.fifos[n].push_back(frame);
        self.mirror_fifo(n, r);
    }

    /// Shows the oldest frame of FIFO `n` and how many wait.
    fn mirror_fifo(&self, n: usize, r: &mut RegisterFile) {
        let waiting = self.fifos[n].len();
        let full = if waiting == FIFO_DEPTH { RFR_FULL } else { 0 };
        r.set(RFR[n], r.get(RFR[n]) & RFR_OVERRUN | full | waiting as u64);
        let Some(frame) = self.fifos[n].front() else { return };
        let id = match frame.id {
            Id::Standard(id) => u64::from(id) << 21,
            Id::Extended(id) => u64::from(id) << 3 | 4,
        };
        let word = u64::from_le_bytes(frame.data);
        r.set(RIR[n], id | u64::from(frame.remote) << 1);
        r.set(RDTR[n], u64::from(frame.dlc));
        r.set(RDLR[n], word & 0xFFFF_FFFF);
        r.set(RDHR[n], word >> 32);
    }

    /// `TSR` and the interrupt lines follow from everything else.
    fn refresh(&mut self, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        let empty = (0..3).filter(|&n| r.get(TIR[n]) & TIR_TXRQ == 0).fold(0, |bits, n| bits | 1u64 << n);
        let next = if empty == 0 { 0 } else { u64::from(empty.trailing_zeros()) };
        let aborting = (0..3).filter(|&n| self.aborting[n]).fold(0, |bits, n| bits | 1u64 << (8 * n + 7));
        r.set(R::Tsr, self.results & TSR_RESULTS | aborting | empty << 26 | next << 24);

        let enabled = r.get(R::Ier);
        let mut wanted = [Level::Low; 4];
        wanted[TRANSMIT] = Level::from(enabled & 1 != 0 && self.results & 0x0001_0101 != 0);
        for n in 0..2 {
            let state = r.get(RFR[n]);
            // FMPIE, FFIE, FOVIE against FMP, FULL, FOVR.
            let pending = u64::from(state & 3 != 0)
                | u64::from(state & RFR_FULL != 0) << 1
                | u64::from(state & RFR_OVERRUN != 0) << 2;
            wanted[RECEIVE[n]] = Level::from(enabled >> (1 + 3 * n) & pending & 0b111 != 0);
        }
        wanted[STATUS_CHANGE] = Level::from(enabled & 1 << 15 != 0 && r.get(R::Msr) & MSR_ERRI != 0);
        for (n, (line, want)) in self.lines.iter_mut().zip(wanted).enumerate() {
            if *line != want {
                *line = want;
                c.interrupt(n, want);
            }
        }
    }

    fn write_mode(&mut self, value: u64, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        if value & MCR_RESET_REQUEST != 0 {
            self.forget();
            r.set(R::Mcr, MCR_RESET);
            r.set(R::Msr, MSR_RESET);
            r.set(R::Ier, 0);
            r.set(R::Esr, 0);
            for tir in TIR {
                r.set(tir, 0);
            }
            return;
        }
        let state = r.get(R::Msr) & !(MSR_INAK | MSR_SLAK);
        if value & MCR_INRQ != 0 {
            r.set(R::Msr, state | MSR_INAK);
        } else if value & MCR_SLEEP != 0 {
            r.set(R::Msr, state | MSR_SLAK);
        } else if r.get(R::Msr) & (MSR_INAK | MSR_SLAK) != 0 && self.synchronized.is_none() {
            // Out of bus-off the hardware waits for the recovery sequence instead, 32.7.6.
            let bits = if self.wire.bus_off() { RECOVERY_BITS } else { SYNCHRONIZATION_BITS };
            self.synchronized = Some(c.schedule(self.after_bits(bits, r, c)));
        }
    }

    /// `RQCPx` clears a mailbox's results, `ABRQx` withdraws a frame at once, or, where it is on the wire,
    /// after the attempt under way; the bit stands until then.
    fn write_transmit_status(&mut self, value: u64, r: &mut RegisterFile) {
        for (n, tir) in TIR.into_iter().enumerate() {
            if value >> (8 * n) & 1 != 0 {
                self.results &= !(0xF << (8 * n));
            }
            if value >> (8 * n + 7) & 1 == 0 || r.get(tir) & TIR_TXRQ == 0 {
                continue;
            }
            if self.on_wire.is_some_and(|on_wire| on_wire.mailbox == Some(n)) {
                self.aborting[n] = true;
            } else {
                r.set(tir, r.get(tir) & !TIR_TXRQ);
                self.results |= 1 << (8 * n);
            }
        }
    }

    /// Resets the state beside the registers. The bus and its record stay.
    fn forget(&mut self) {
        let wire = std::mem::take(&mut self.wire);
        *self = Self { wire, clock_hz: self.clock_hz, lines: self.lines, ..Self::new() };
        self.wire.recover();
    }
}

impl Device for BxCan {
    type Register = R;

    fn write(&mut self, register: R, value: u64, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        match register {
            R::Mcr => self.write_mode(value, r, c),
            R::Msr => {
                let kept = r.get(R::Msr);
                r.set(R::Msr, kept & !(value & MSR_FLAGS));
            }
            R::Tsr => self.write_transmit_status(value, r),
            R::Esr => {
                self.last_error = value & 0x70;
                self.mirror_errors(r);
            }
            R::Ti0r | R::Ti1r | R::Ti2r => self.start_next(r, c),
            R::Rf0r | R::Rf1r => {
                let n = usize::from(register == R::Rf1r);
                if value & RFR_RELEASE != 0 {
                    self.fifos[n].pop_front();
                }
                if value & RFR_OVERRUN != 0 {
                    r.set(RFR[n], 0);
                }
                self.mirror_fifo(n, r);
            }
            _ => {}
        }
        self.refresh(r, c);
    }

    fn on_event(&mut self, event: EventId, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        if self.synchronized == Some(event) {
            self.synchronized = None;
            if r.get(R::Mcr) & (MCR_INRQ | MCR_SLEEP) == 0 {
                self.wire.recover();
                self.mirror_errors(r);
                r.set(R::Msr, r.get(R::Msr) & !(MSR_INAK | MSR_SLAK));
            }
        }
        if self.recovered == Some(event) {
            self.recovered = None;
            self.wire.recover();
            self.mirror_errors(r);
        }
        if let Some(on_wire) = self.on_wire.filter(|on_wire| on_wire.ends == event) {
            self.on_wire = None;
            self.finish(on_wire, r, c);
        }
        self.start_next(r, c);
        self.refresh(r, c);
    }

    fn reset(&mut self) {
        self.forget();
        self.lines = [Level::Low; 4];
    }
}
