//! DMAMUX1 and DMA1: from a peripheral's request to a word in memory, RM0440 chapters 12 and 13.
//!
//! One item a request, from a peripheral to memory, once or in a circle: what both rings of the
//! firmware do. A channel told to go the other way, or from memory to memory, stands still.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::Width;

use super::converter;
use super::word::Word;
use crate::timers::trigger;

/// Channels of DMA1.
const CHANNELS: usize = 8;
/// The multiplexer, as requests name it.
pub(crate) const MULTIPLEXER: &str = "DMAMUX1";

/// RM0440 table 91, the two rows the firmware uses: instance, its output, request number.
const SOURCES: [(&str, usize, u64); 2] = [
    (converter::INSTANCE, converter::DMA_REQUEST, 5),
    (trigger::INSTANCE, rigless::soc::stm32f427::peripherals::tim::UPDATE_REQUEST, 60),
];

/// DMAMUX1: gives a request to the channels that chose its number.
#[derive(Debug, Default)]
pub(crate) struct Multiplexer {
    /// The next request of the converter goes unheard, so the conversion after it overruns.
    pub(crate) late: bool,
}

impl Device for Multiplexer {
    type Register = Word;

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let source =
            SOURCES.iter().find(|(instance, output, _)| (change.instance, change.request) == (*instance, *output));
        let Some(&(instance, _, number)) = source else { return };
        if self.late && instance == converter::INSTANCE && change.level == Level::High {
            self.late = false;
            return;
        }
        for channel in 0..CHANNELS {
            if registers.get(Word(0).plus(4 * channel)) & 0x7F == number {
                context.request(channel, change.level);
            }
        }
    }

    fn reset(&mut self) {
        self.late = false;
    }
}

const ISR: Word = Word(0x00);
const IFCR: Word = Word(0x04);
/// Flags of a channel in `ISR`, four bits each.
const GLOBAL: u64 = 1;
const COMPLETE: u64 = 1 << 1;
const HALF: u64 = 1 << 2;
const FAILED: u64 = 1 << 3;
const EN: u64 = 1;
const DIR: u64 = 1 << 4;
const CIRC: u64 = 1 << 5;
const MINC: u64 = 1 << 7;
const MEM2MEM: u64 = 1 << 14;

/// `CCRx`, `CNDTRx`, `CPARx`, `CMARx`.
const fn ccr(channel: usize) -> Word {
    Word(0x08).plus(20 * channel)
}
const fn cndtr(channel: usize) -> Word {
    ccr(channel).plus(4)
}
const fn cpar(channel: usize) -> Word {
    ccr(channel).plus(8)
}
const fn cmar(channel: usize) -> Word {
    ccr(channel).plus(12)
}

/// DMA1.
#[derive(Debug, Default)]
pub(crate) struct Dma {
    channels: [Channel; CHANNELS],
    flags: u64,
}

/// What a channel keeps beside its registers.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    /// The count last programmed, which a circle reloads.
    block: u64,
    /// Items since it was enabled or its circle closed: enabling starts again at `CMARx`, whatever
    /// count is left, so a ring restarted without its count written is out of step.
    moved: u64,
    enabled: bool,
    requested: bool,
    line: Level,
}

/// A token tells the store of an item from the load before it.
const STORED: u64 = 1 << 8;

impl Dma {
    /// Starts moving an item if `channel` runs, is asked and has something left.
    fn serve(channel: usize, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        let control = registers.get(ccr(channel));
        let runs = control & EN != 0 && control & (DIR | MEM2MEM) == 0;
        if runs && registers.get(cndtr(channel)) & 0xFFFF != 0 {
            let width = width(control >> 8);
            context.read_from(registers.get(cpar(channel)), width, channel as u64);
        }
    }

    /// An item is in memory: the count goes down, at half and end of the block with a flag.
    fn count(&mut self, channel: usize, registers: &mut RegisterFile) {
        let control = registers.get(ccr(channel));
        let block = self.channels[channel].block;
        self.channels[channel].moved += 1;
        let left = (registers.get(cndtr(channel)) & 0xFFFF).saturating_sub(1);
        let mut raised = 0;
        if left == block - block / 2 {
            raised |= HALF | GLOBAL;
        }
        if left == 0 {
            raised |= COMPLETE | GLOBAL;
        }
        let restarted = left == 0 && control & CIRC != 0;
        if restarted {
            self.channels[channel].moved = 0;
        }
        registers.set(cndtr(channel), if restarted { block } else { left });
        self.flags |= raised << (4 * channel);
    }

    fn refresh(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        registers.set(ISR, self.flags);
        for (n, channel) in self.channels.iter_mut().enumerate() {
            // TCIE, HTIE, TEIE sit at their flags' places.
            let raised = self.flags >> (4 * n) & registers.get(ccr(n)) & (COMPLETE | HALF | FAILED);
            let line = Level::from(raised != 0);
            if line != channel.line {
                channel.line = line;
                context.interrupt(n, line);
            }
        }
    }
}

/// `PSIZE` and `MSIZE`.
fn width(code: u64) -> Width {
    match code & 3 {
        0 => Width::W8,
        1 => Width::W16,
        _ => Width::W32,
    }
}

impl Device for Dma {
    type Register = Word;

    fn write(&mut self, register: Word, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if register == IFCR {
            for n in 0..CHANNELS {
                let cleared = value >> (4 * n) & 0xF;
                // CGIF clears the channel's other flags as well.
                let mask = if cleared & GLOBAL != 0 { 0xF } else { cleared };
                self.flags &= !(mask << (4 * n));
                if self.flags >> (4 * n) & 0xE == 0 {
                    self.flags &= !(GLOBAL << (4 * n));
                }
            }
        }
        for n in 0..CHANNELS {
            if register == cndtr(n) {
                self.channels[n].block = value & 0xFFFF;
            }
            if register == ccr(n) {
                let channel = &mut self.channels[n];
                let enabled = value & EN != 0;
                let starts = enabled && !channel.enabled;
                channel.enabled = enabled;
                if starts {
                    channel.moved = 0;
                }
                if starts && channel.requested {
                    Self::serve(n, registers, context);
                }
            }
        }
        self.refresh(registers, context);
    }

    fn on_request(&mut self, change: RequestChange, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if change.instance != MULTIPLEXER {
            return;
        }
        let Some(channel) = self.channels.get_mut(change.request) else { return };
        channel.requested = change.level == Level::High;
        if channel.requested {
            Self::serve(change.request, registers, context);
        }
    }

    fn on_access(&mut self, token: u64, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let channel = (token & !STORED) as usize;
        if token & STORED != 0 {
            self.count(channel, registers);
            self.refresh(registers, context);
            return;
        }
        let control = registers.get(ccr(channel));
        let width = width(control >> 10);
        let moved = self.channels[channel].moved;
        let step = if control & MINC != 0 { u64::from(width.bytes()) } else { 0 };
        context.write_to(registers.get(cmar(channel)) + moved * step, width, value, token | STORED);
    }

    fn on_refused(&mut self, token: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let channel = (token & !STORED) as usize;
        registers.set(ccr(channel), registers.get(ccr(channel)) & !EN);
        self.flags |= (FAILED | GLOBAL) << (4 * channel);
        self.refresh(registers, context);
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}
