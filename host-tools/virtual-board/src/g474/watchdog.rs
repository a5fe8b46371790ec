//! IWDG: the independent watchdog, RM0440 chapter 42, without its window.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::time::{EventId, VirtualNanos};

use super::word::Word;

const KR: Word = Word(0x00);
const PR: Word = Word(0x04);
const RLR: Word = Word(0x08);
const SR: Word = Word(0x0C);

const KEY_RELOAD: u64 = 0xAAAA;
const KEY_START: u64 = 0xCCCC;
/// The LSI's nominal rate; silicon's spreads from 31.04 to 32.96 kHz.
const LSI_HZ: u64 = 32_000;

/// The watchdog, which nothing but a reset stops.
#[derive(Debug, Default)]
pub(crate) struct Watchdog {
    /// The event that bites, once started.
    bites: Option<EventId>,
}

impl Device for Watchdog {
    type Register = Word;

    fn read(&mut self, register: Word, _: &mut RegisterFile, _: &mut DeviceContext<'_>) -> Option<u64> {
        match register {
            // A key reads as zero, and updates are done at once.
            KR | SR => Some(0),
            _ => None,
        }
    }

    fn write(&mut self, register: Word, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let reloads = match value & 0xFFFF {
            KEY_START => true,
            KEY_RELOAD => self.bites.is_some(),
            _ => false,
        };
        if register == KR && reloads {
            let divider = 4 << (registers.get(PR) & 7).min(6);
            let cycles = divider * ((registers.get(RLR) & 0xFFF) + 1);
            let at = context.now().0 + cycles * 1_000_000_000 / LSI_HZ;
            self.bites = Some(context.schedule(VirtualNanos(at)));
        }
    }

    fn on_event(&mut self, event: EventId, _: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.bites == Some(event) {
            context.request_reset();
        }
    }

    fn reset(&mut self) {
        self.bites = None;
    }
}

/// `RLR` after a reset, RM0440 42.4.3.
pub(crate) fn set_reset_values(registers: &mut RegisterFile) {
    registers.set(RLR, 0xFFF);
}
