//! FLASH: unlocking, programming by double words and erasing pages of the two banks.
//!
//! Source: RM0440 chapter 5, with the array as two banks of 2 KiB pages. Times are the datasheet's
//! typical ones; the core is not stalled meanwhile, so code must wait for `BSY` as it should anyway.
//! ECC: its register only, with an error when the bench says so; reads return the stored content.
//! Not here: option bytes, write and read protection, mass erase, fast programming.

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::Width;
use rigless::time::{EventId, VirtualNanos};

use super::word::Word;

const KEYR: Word = Word(0x08);
const SR: Word = Word(0x10);
const CR: Word = Word(0x14);
const ECCR: Word = Word(0x18);
const OPTR: Word = Word(0x20);

const KEY1: u64 = 0x4567_0123;
const KEY2: u64 = 0xCDEF_89AB;

const EOP: u64 = 1;
const OPERR: u64 = 1 << 1;
const PROGERR: u64 = 1 << 3;
const PGAERR: u64 = 1 << 5;
const SIZERR: u64 = 1 << 6;
const PGSERR: u64 = 1 << 7;
const BSY: u64 = 1 << 16;

const PG: u64 = 1;
const PER: u64 = 1 << 1;
const BKER: u64 = 1 << 11;
const STRT: u64 = 1 << 16;
const EOPIE: u64 = 1 << 24;
const ERRIE: u64 = 1 << 25;
const LOCK: u64 = 1 << 31;

/// Flags of an uncorrectable error, and of its bank being the second.
const ECCD: u64 = 1 << 31;
const BK_ECC: u64 = 1 << 21;
/// Flags that writing 1 clears.
const ECC_FLAGS: u64 = 0b1111 << 28;

const BASE: u64 = 0x0800_0000;
const BANK_BYTES: u64 = 256 << 10;
const PAGE_BYTES: u64 = 2 << 10;
/// Typical times of DS12288 table 50.
const PROGRAM_NANOS: u64 = 81_700;
const ERASE_NANOS: u64 = 22_020_000;
const ERASED: u64 = 0xFFFF_FFFF;

/// The flash interface.
#[derive(Debug, Default)]
pub(crate) struct Flash {
    /// Keys written so far, or locked until the next reset by a wrong one.
    unlocking: Unlocking,
    status: u64,
    /// The first word of a double word, until its second arrives.
    first: Option<(u64, u64)>,
    /// The double word whose old content is being checked.
    checked: Option<Checked>,
    busy: Option<EventId>,
    line: Level,
    /// ECC flags not cleared yet.
    ecc: u64,
}

#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Unlocking {
    #[default]
    Locked,
    FirstKey,
    Open,
    Refused,
}

#[derive(Debug, Clone, Copy)]
struct Checked {
    address: u64,
    words: [u64; 2],
    erased: bool,
}

/// Tokens of the reads that check a double word before it is programmed.
const LOOK: [u64; 2] = [1, 2];

impl Flash {
    /// A double word of the second bank was read that the ECC cannot correct.
    pub(crate) fn find_error(&mut self) {
        self.ecc = ECCD | BK_ECC;
    }

    fn fail(&mut self, error: u64) {
        self.status |= error | OPERR;
        self.first = None;
    }

    fn begin(&mut self, nanos: u64, context: &mut DeviceContext<'_>) {
        self.status |= BSY;
        self.busy = Some(context.schedule(VirtualNanos(context.now().0 + nanos)));
    }

    fn erase_page(control: u64, context: &mut DeviceContext<'_>) {
        let bank = if control & BKER != 0 { BANK_BYTES } else { 0 };
        let page = BASE + bank + (control >> 3 & 0x7F) * PAGE_BYTES;
        for address in (page..page + PAGE_BYTES).step_by(4) {
            context.program(address, Width::W32, ERASED, 0);
        }
    }

    fn refresh(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        registers.set(SR, self.status);
        let control = registers.get(CR);
        let raised = control & EOPIE != 0 && self.status & EOP != 0 || control & ERRIE != 0 && self.status & OPERR != 0;
        let line = Level::from(raised);
        if line != self.line {
            self.line = line;
            context.interrupt(0, line);
        }
    }
}

impl Device for Flash {
    type Register = Word;

    fn read(&mut self, register: Word, registers: &mut RegisterFile, _: &mut DeviceContext<'_>) -> Option<u64> {
        let lock = if self.unlocking == Unlocking::Open { 0 } else { LOCK };
        match register {
            CR => Some(registers.get(CR) & !LOCK | lock),
            ECCR => Some(self.ecc),
            _ => None,
        }
    }

    fn write(&mut self, register: Word, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match register {
            KEYR => {
                self.unlocking = match (self.unlocking, value) {
                    (Unlocking::Locked, KEY1) => Unlocking::FirstKey,
                    (Unlocking::FirstKey, KEY2) => Unlocking::Open,
                    (Unlocking::Open, _) => Unlocking::Open,
                    _ => Unlocking::Refused,
                };
            }
            ECCR if self.ecc & value & ECC_FLAGS != 0 => self.ecc = 0,
            // Writing 1 clears every flag but BSY.
            SR => self.status &= !value | BSY,
            CR if self.unlocking != Unlocking::Open => registers.set(CR, 0),
            CR => {
                if value & LOCK != 0 {
                    self.unlocking = Unlocking::Locked;
                }
                if value & STRT != 0 {
                    registers.set(CR, value & !STRT);
                    if value & PER != 0 {
                        Self::erase_page(value, context);
                        self.begin(ERASE_NANOS, context);
                    } else {
                        self.fail(PGSERR);
                    }
                }
            }
            _ => {}
        }
        self.refresh(registers, context);
    }

    fn write_region(
        &mut self,
        address: u64,
        width: Width,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> bool {
        let allowed = self.unlocking == Unlocking::Open && registers.get(CR) & PG != 0 && self.status & BSY == 0;
        match (allowed, width, self.first) {
            (false, ..) => self.fail(PGSERR),
            (true, Width::W32, None) if address.is_multiple_of(8) => self.first = Some((address, value)),
            (true, Width::W32, Some((at, low))) if address == at + 4 => {
                self.first = None;
                self.checked = Some(Checked { address: at, words: [low, value], erased: true });
                context.read_from(at, Width::W32, LOOK[0]);
                context.read_from(at + 4, Width::W32, LOOK[1]);
            }
            (true, Width::W32, _) => self.fail(PGAERR),
            (true, ..) => self.fail(SIZERR),
        }
        self.refresh(registers, context);
        true
    }

    fn on_access(&mut self, token: u64, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let Some(checked) = self.checked.as_mut().filter(|_| LOOK.contains(&token)) else { return };
        checked.erased &= value == ERASED;
        if token == LOOK[1] {
            let Checked { address, words, erased } = *checked;
            self.checked = None;
            // RM0440 5.3.7: only an erased double word takes a value, and any takes all zeros.
            if erased || words == [0, 0] {
                context.program(address, Width::W32, words[0], 0);
                context.program(address + 4, Width::W32, words[1], 0);
                self.begin(PROGRAM_NANOS, context);
            } else {
                self.fail(PROGERR);
            }
            self.refresh(registers, context);
        }
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.busy == Some(event) {
            self.busy = None;
            self.status &= !BSY;
            if registers.get(CR) & EOPIE != 0 {
                self.status |= EOP;
            }
            self.refresh(registers, context);
        }
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

/// Registers that are not zero after a reset: `OPTR` as delivered, with two banks.
pub(crate) fn set_reset_values(registers: &mut RegisterFile) {
    registers.set(OPTR, 0xFFEF_F8AA);
}
