//! FDCAN1 and its message RAM, RM0440 chapter 44, for classic frames.
//!
//! Configuration and start-up, bit timing, three transmit buffers as FIFO or queue, cancelling, both
//! receive FIFOs behind the standard filters, missing acknowledgements, bit errors, bus-off and the
//! way out of it, and both interrupt lines. Not here: FD frames and bit-rate switching, extended
//! filters, timestamps, the transmit event FIFO, receive FIFO overwriting, and the test modes.

use std::collections::VecDeque;

use rigless::chip::can::{Frame, Id};
use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::time::{EventId, VirtualNanos};

use super::clocks::HSE_HZ;
use super::word::Word;
use crate::wire::{Ended, Wire};

const CREL: Word = Word(0x00);
const ENDN: Word = Word(0x04);
const CCCR: Word = Word(0x18);
const NBTP: Word = Word(0x1C);
const ECR: Word = Word(0x40);
const PSR: Word = Word(0x44);
const IR: Word = Word(0x50);
const IE: Word = Word(0x54);
const ILS: Word = Word(0x58);
const ILE: Word = Word(0x5C);
const RXGFC: Word = Word(0x80);
const RXF0S: Word = Word(0x90);
const RXF0A: Word = Word(0x94);
const RXF1S: Word = Word(0x98);
const RXF1A: Word = Word(0x9C);
const TXBC: Word = Word(0xC0);
const TXFQS: Word = Word(0xC4);
const TXBRP: Word = Word(0xC8);
const TXBAR: Word = Word(0xCC);
const TXBCR: Word = Word(0xD0);
const TXBTO: Word = Word(0xD4);
const TXBCF: Word = Word(0xD8);
const TXBTIE: Word = Word(0xDC);
const TXBCIE: Word = Word(0xE0);
const CKDIV: Word = Word(0x100);

const INIT: u64 = 1;
const CCE: u64 = 1 << 1;
const CSA: u64 = 1 << 3;
const CSR: u64 = 1 << 4;
const DAR: u64 = 1 << 6;
const TFQM: u64 = 1 << 24;

/// `RF0N`, `RF0F`, `RF0L`; FIFO 1's are three bits up.
const NEW: u64 = 1;
const FULL: u64 = 1 << 1;
const LOST: u64 = 1 << 2;
const TC: u64 = 1 << 7;
const TCF: u64 = 1 << 8;
const EP: u64 = 1 << 17;
const EW: u64 = 1 << 18;
const BO: u64 = 1 << 19;
const PEA: u64 = 1 << 21;

/// `LEC`: no change since it was read, missing acknowledgement, recessive bit read dominant.
const LEC_UNCHANGED: u64 = 7;
const LEC_ACKNOWLEDGE: u64 = 3;
const LEC_BIT_RECESSIVE: u64 = 4;

/// Flags of each group of `ILS`, RM0440 44.4.17.
const LINE_GROUPS: [u64; 7] = [0x7, 0x7 << 3, 0x7 << 6, 0xF << 9, 0x7 << 13, 0x3 << 16, 0x3F << 18];

/// The message RAM's layout for one instance, RM0440 figure 669, in bytes.
const FILTERS: usize = 0x000;
const RECEIVE: [usize; 2] = [0x0B0, 0x188];
const TRANSMIT: usize = 0x278;
/// Bytes of one FIFO or buffer element.
const ELEMENT: usize = 72;
const DEPTH: usize = 3;

/// Recessive bits before a node takes part, and before it may after bus-off.
const SYNCHRONIZATION_BITS: u64 = 11;
const RECOVERY_BITS: u64 = 129 * 11;

/// Which of the instance's two blocks an access goes to.
///
/// Registers and message RAM lie apart in the address space and are one peripheral, so one model
/// answers for two slots, and the part says which before it hands the model over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum View {
    #[default]
    Registers,
    MessageRam,
}

/// The controller, its message RAM and the bus behind it.
#[derive(Debug)]
pub(crate) struct Fdcan {
    pub(crate) wire: Wire,
    pub(crate) view: View,
    ram: Box<[u32; 256]>,
    clock_hz: u64,
    control: u64,
    flags: u64,
    last_error: u64,
    /// Requested transmit buffers, in the order of their requests.
    pending: VecDeque<usize>,
    next_buffer: usize,
    transmitted: u64,
    cancelled: u64,
    /// `TXBCR` of a buffer on the wire, kept until the attempt ends.
    cancelling: u64,
    on_wire: Option<OnWire>,
    synchronized: Option<EventId>,
    fifos: [Fifo; 2],
    lines: [Level; 2],
}

#[derive(Debug, Clone, Copy, Default)]
struct Fifo {
    get: usize,
    level: usize,
    lost: bool,
}

/// The frame that has the bus.
#[derive(Debug, Clone, Copy)]
struct OnWire {
    ends: EventId,
    /// Our buffer, or `None` for a frame of another node.
    buffer: Option<usize>,
    frame: Frame,
}

impl Fdcan {
    pub(crate) fn new() -> Self {
        Self {
            wire: Wire::default(),
            view: View::Registers,
            ram: Box::new([0; 256]),
            clock_hz: HSE_HZ,
            control: INIT,
            flags: 0,
            last_error: LEC_UNCHANGED,
            pending: VecDeque::new(),
            next_buffer: 0,
            transmitted: 0,
            cancelled: 0,
            cancelling: 0,
            on_wire: None,
            synchronized: None,
            fifos: [Fifo::default(); 2],
            lines: [Level::Low; 2],
        }
    }

    /// The bench changed something on the bus.
    pub(crate) fn look(&mut self, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        self.start_next(r, c);
    }

    fn word(&self, byte: usize) -> u64 {
        u64::from(self.ram[byte / 4])
    }

    /// The instant `bits` bit times from now, by `NBTP` and `CKDIV`.
    fn after_bits(&self, bits: u64, r: &RegisterFile, c: &DeviceContext<'_>) -> VirtualNanos {
        let timing = r.get(NBTP);
        let divider = (2 * (r.get(CKDIV) & 0xF)).max(1);
        let quanta = ((timing >> 16 & 0x1FF) + 1) * (3 + (timing >> 8 & 0xFF) + (timing & 0x7F)) * divider;
        VirtualNanos(c.now().0 + bits * quanta * 1_000_000_000 / self.clock_hz.max(1))
    }

    fn takes_part(&self) -> bool {
        self.control & (INIT | CSR) == 0 && self.synchronized.is_none()
    }

    fn buffer(&self, n: usize) -> Frame {
        let base = TRANSMIT + n * ELEMENT;
        let (head, control) = (self.word(base), self.word(base + 4));
        let id = if head & 1 << 30 != 0 {
            Id::Extended((head & 0x1FFF_FFFF) as u32)
        } else {
            Id::Standard((head >> 18 & 0x7FF) as u16)
        };
        let data = self.word(base + 8) | self.word(base + 12) << 32;
        Frame { id, remote: head & 1 << 29 != 0, dlc: (control >> 16 & 0xF) as u8, data: data.to_le_bytes() }
    }

    /// The transmit buffer that is next: the oldest request, or in queue mode the lowest identifier.
    fn next_own(&self, r: &RegisterFile) -> Option<(usize, Frame)> {
        let mut waiting = self.pending.iter().map(|&n| (n, self.buffer(n)));
        if r.get(TXBC) & TFQM == 0 {
            waiting.next()
        } else {
            waiting.min_by(|(n, a), (m, b)| a.arbitrates(b).then(n.cmp(m)))
        }
    }

    /// Gives an idle bus to the frame that wins arbitration.
    fn start_next(&mut self, r: &RegisterFile, c: &mut DeviceContext<'_>) {
        if self.on_wire.is_some() || !self.takes_part() {
            return;
        }
        let own = self.next_own(r).map(|(n, frame)| (Some(n), frame));
        let other = self.wire.offered().map(|frame| (None, *frame));
        let Some((buffer, frame)) = own.into_iter().chain(other).min_by(|(_, a), (_, b)| a.arbitrates(b)) else {
            return;
        };
        let bits = match buffer {
            Some(_) => self.wire.bits_for_own(&frame),
            None => Wire::bits_for_other(&frame),
        };
        self.on_wire = Some(OnWire { ends: c.schedule(self.after_bits(bits, r, c)), buffer, frame });
    }

    fn finish(&mut self, ended: OnWire, r: &RegisterFile, c: &mut DeviceContext<'_>) {
        let Some(n) = ended.buffer else {
            if let Some(frame) = self.wire.take_offered() {
                self.receive(&frame, r);
            }
            return;
        };
        let cancelling = self.cancelling >> n & 1 != 0;
        self.cancelling &= !(1 << n);
        let (warned, passive) = (self.wire.warns(), self.wire.passive());
        let outcome = self.wire.end_own(c.now().0, &ended.frame);
        if self.wire.warns() != warned {
            self.flags |= EW;
        }
        if self.wire.passive() != passive {
            self.flags |= EP;
        }
        if outcome == Ended::Acknowledged {
            self.last_error = 0;
            self.pending.retain(|&waiting| waiting != n);
            self.transmitted |= 1 << n;
            if r.get(TXBTIE) >> n & 1 != 0 {
                self.flags |= TC;
            }
            return;
        }
        self.last_error = if outcome == Ended::Disturbed { LEC_BIT_RECESSIVE } else { LEC_ACKNOWLEDGE };
        self.flags |= PEA;
        if self.control & DAR != 0 || cancelling {
            self.cancel(n, r);
        }
        if self.wire.bus_off() {
            // RM0440 44.3.12: bus-off stops the node until software clears INIT.
            self.control |= INIT;
            self.flags |= BO;
        }
    }

    fn cancel(&mut self, n: usize, r: &RegisterFile) {
        self.pending.retain(|&waiting| waiting != n);
        self.cancelled |= 1 << n;
        if r.get(TXBCIE) >> n & 1 != 0 {
            self.flags |= TCF;
        }
    }

    /// The FIFO the standard filters put a frame into, RM0440 44.3.9; extended frames match none.
    fn accepting_fifo(&self, frame: &Frame, r: &RegisterFile) -> Option<usize> {
        let global = r.get(RXGFC);
        let Id::Standard(id) = frame.id else { return None };
        let id = u64::from(id);
        let filters = (global >> 16 & 0x1F) as usize;
        for element in (0..filters).map(|n| self.word(FILTERS + 4 * n)) {
            let (first, second) = (element >> 16 & 0x7FF, element & 0x7FF);
            let matches = match element >> 30 {
                0 => (first..=second).contains(&id),
                1 => id == first || id == second,
                2 => (id ^ first) & second == 0,
                _ => false,
            };
            match element >> 27 & 7 {
                1 | 5 if matches => return Some(0),
                2 | 6 if matches => return Some(1),
                3 if matches => return None,
                _ => {}
            }
        }
        // ANFS: what no filter names.
        match global >> 4 & 3 {
            0 => Some(0),
            1 => Some(1),
            _ => None,
        }
    }

    fn receive(&mut self, frame: &Frame, r: &RegisterFile) {
        let Some(n) = self.accepting_fifo(frame, r) else { return };
        let fifo = &mut self.fifos[n];
        if fifo.level == DEPTH {
            fifo.lost = true;
            self.flags |= LOST << (3 * n);
            return;
        }
        let base = (RECEIVE[n] + (fifo.get + fifo.level) % DEPTH * ELEMENT) / 4;
        fifo.level += 1;
        let data = u64::from_le_bytes(frame.data);
        self.ram[base] = frame.id.value() << 18;
        self.ram[base + 1] = u32::from(frame.dlc) << 16;
        self.ram[base + 2] = (data & 0xFFFF_FFFF) as u32;
        self.ram[base + 3] = (data >> 32) as u32;
        self.flags |= (NEW | if fifo.level == DEPTH { FULL } else { 0 }) << (3 * n);
    }

    fn write_control(&mut self, value: u64, r: &RegisterFile, c: &mut DeviceContext<'_>) {
        let was = self.control;
        self.control = value & !CSA;
        if value & INIT == 0 {
            self.control &= !CCE;
            if was & INIT != 0 {
                let bits = if self.wire.bus_off() { RECOVERY_BITS } else { SYNCHRONIZATION_BITS };
                self.synchronized = Some(c.schedule(self.after_bits(bits, r, c)));
            }
        } else {
            self.synchronized = None;
        }
        if value & (INIT | CCE) == INIT | CCE && was & CCE == 0 {
            // RM0440 44.4.7: setting CCE resets what is pending.
            self.pending.clear();
            self.transmitted = 0;
            self.cancelled = 0;
            self.fifos = [Fifo::default(); 2];
            self.next_buffer = 0;
        }
    }

    fn request(&mut self, buffers: u64) {
        for n in (0..DEPTH).filter(|n| buffers >> n & 1 != 0) {
            if self.control & INIT == 0 && !self.pending.contains(&n) {
                self.pending.push_back(n);
                self.transmitted &= !(1 << n);
                self.cancelled &= !(1 << n);
                self.next_buffer = (n + 1) % DEPTH;
            }
        }
    }

    fn free_and_put(&self, r: &RegisterFile) -> u64 {
        let free = (DEPTH - self.pending.len()) as u64;
        let queue = r.get(TXBC) & TFQM != 0;
        let put = if queue { (0..DEPTH).find(|n| !self.pending.contains(n)).unwrap_or(0) } else { self.next_buffer };
        let get = self.pending.front().copied().unwrap_or(self.next_buffer);
        let full = u64::from(free == 0) << 21;
        let (level, get) = if queue { (0, 0) } else { (free, get as u64) };
        full | (put as u64) << 16 | get << 8 | level
    }

    fn fifo_status(&self, n: usize) -> u64 {
        let fifo = self.fifos[n];
        let put = (fifo.get + fifo.level) % DEPTH;
        u64::from(fifo.lost) << 25
            | u64::from(fifo.level == DEPTH) << 24
            | (put as u64) << 16
            | (fifo.get as u64) << 8
            | fifo.level as u64
    }

    fn acknowledge(&mut self, n: usize, index: u64) {
        let fifo = &mut self.fifos[n];
        let index = index as usize % DEPTH;
        let released = ((index + DEPTH - fifo.get) % DEPTH + 1).min(fifo.level);
        fifo.level -= released;
        fifo.get = (index + 1) % DEPTH;
        fifo.lost = false;
    }

    fn status(&mut self) -> u64 {
        let last_error = std::mem::replace(&mut self.last_error, LEC_UNCHANGED);
        // ACT: synchronizing until it takes part, then idle.
        let activity = if self.takes_part() { 1 } else { 0 };
        last_error
            | activity << 3
            | u64::from(self.wire.passive()) << 5
            | u64::from(self.wire.warns()) << 6
            | u64::from(self.wire.bus_off()) << 7
    }

    fn refresh(&mut self, r: &RegisterFile, c: &mut DeviceContext<'_>) {
        let raised = self.flags & r.get(IE);
        let (select, enable) = (r.get(ILS), r.get(ILE));
        let on_second =
            LINE_GROUPS.iter().enumerate().filter(|(n, _)| select >> n & 1 != 0).fold(0, |all, (_, group)| all | group);
        let wanted = [raised & !on_second, raised & on_second];
        for (n, flags) in wanted.into_iter().enumerate() {
            let line = Level::from(flags != 0 && enable >> n & 1 != 0);
            if line != self.lines[n] {
                self.lines[n] = line;
                c.interrupt(n, line);
            }
        }
    }
}

impl Device for Fdcan {
    type Register = Word;

    fn read(&mut self, register: Word, r: &mut RegisterFile, _: &mut DeviceContext<'_>) -> Option<u64> {
        if self.view == View::MessageRam {
            return Some(self.word(usize::from(register.0)));
        }
        Some(match register {
            CREL => 0x3214_1218,
            ENDN => 0x8765_4321,
            // CSA follows CSR.
            CCCR => self.control | (self.control & CSR) >> 1,
            ECR => self.wire.transmit_error_count().into(),
            PSR => self.status(),
            IR => self.flags,
            RXF0S => self.fifo_status(0),
            RXF1S => self.fifo_status(1),
            TXFQS => self.free_and_put(r),
            TXBRP => self.pending.iter().fold(0, |bits, n| bits | 1 << n),
            TXBTO => self.transmitted,
            TXBCF => self.cancelled,
            TXBCR => self.cancelling,
            TXBAR => 0,
            _ => return None,
        })
    }

    fn write(&mut self, register: Word, value: u64, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        if self.view == View::MessageRam {
            self.ram[usize::from(register.0) / 4] = (value & 0xFFFF_FFFF) as u32;
            return;
        }
        match register {
            CCCR => self.write_control(value, r, c),
            IR => self.flags &= !value,
            RXF0A => self.acknowledge(0, value & 7),
            RXF1A => self.acknowledge(1, value & 7),
            TXBAR => self.request(value),
            TXBCR => {
                let sending = self.on_wire.and_then(|on_wire| on_wire.buffer);
                for n in (0..DEPTH).filter(|n| value >> n & 1 != 0) {
                    if sending == Some(n) {
                        self.cancelling |= 1 << n;
                    } else if self.pending.contains(&n) {
                        self.cancel(n, r);
                    }
                }
            }
            _ => {}
        }
        self.start_next(r, c);
        self.refresh(r, c);
    }

    fn on_event(&mut self, event: EventId, r: &mut RegisterFile, c: &mut DeviceContext<'_>) {
        if self.synchronized == Some(event) {
            self.synchronized = None;
            if self.wire.bus_off() {
                self.flags |= BO;
            }
            self.wire.recover();
        }
        if let Some(on_wire) = self.on_wire.filter(|on_wire| on_wire.ends == event) {
            self.on_wire = None;
            self.finish(on_wire, r, c);
        }
        self.start_next(r, c);
        self.refresh(r, c);
    }

    fn on_clock(&mut self, hz: u64, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {
        self.clock_hz = hz;
    }

    /// The bus and what it has seen stay, and so does the message RAM.
    fn reset(&mut self) {
        let wire = std::mem::take(&mut self.wire);
        let ram = std::mem::replace(&mut self.ram, Box::new([0; 256]));
        *self = Self { wire, ram, ..Self::new() };
        self.wire.recover();
    }
}

/// Registers that are not zero after a reset: 0x0600_0A03 in `NBTP`, RM0440 44.4.6.
pub(crate) fn set_reset_values(registers: &mut RegisterFile) {
    registers.set(NBTP, 0x0600_0A03);
}
