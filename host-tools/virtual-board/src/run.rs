//! Power up, run against a bench, collect.

use std::path::Path;

use rigless::device::ResetCause as EmulatorCause;
use rigless::emulator::{self, Driver, Host, Settled, Start, Stop, Watch};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use crate::bench::{Bench, Pins};
use crate::counting::Counters;
use crate::f405::F405;
use crate::g474::G474;
use crate::hardware::Hardware;
use crate::image::{Symbols, symbols};
use crate::outcome::{Gap, Outcome, Reset, ResetCause};
use crate::rtt::Terminal;
use crate::{Chip, Error, Nanos};

/// How often the RTT terminal is drained: often enough for a buffer of 1 KiB.
const DRAIN_PERIOD: Nanos = 5_000_000;
/// `b .`, the Thumb instruction that branches to itself.
const BRANCH_TO_SELF: u64 = 0xE7FE;

/// A board about to be powered up.
///
/// ```no_run
/// # use virtual_board::{Bench, Chip, Nanos, Pins, VirtualBoard};
/// /// Ten seconds of rest under a constant load.
/// struct Rest;
/// impl Bench for Rest {
///     fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
///         pins.force_code(700);
///         pins.temperature_code(1_850);
///         (now == 0).then_some(10_000_000_000)
///     }
/// }
/// let elf = std::fs::read("firmware.elf")?;
/// let (outcome, _) = VirtualBoard::new(Chip::Stm32f405, &elf).run(Rest)?;
/// println!("{} frames", outcome.frames.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct VirtualBoard<'a> {
    chip: Chip,
    elf: &'a [u8],
    flash: Vec<(u32, &'a [u8])>,
    counted: Vec<String>,
}

impl<'a> VirtualBoard<'a> {
    /// A board with `elf` in its flash and nothing else.
    #[must_use]
    pub fn new(chip: Chip, elf: &'a [u8]) -> Self {
        Self { chip, elf, flash: Vec::new(), counted: Vec::new() }
    }

    /// Puts `bytes` into the flash at `address` as well, before the core starts.
    #[must_use]
    pub fn with_flash(mut self, address: u32, bytes: &'a [u8]) -> Self {
        self.flash.push((address, bytes));
        self
    }

    /// Counts the instructions of every call of `function`, see [`crate::Cost`].
    #[must_use]
    pub fn counting(mut self, function: &str) -> Self {
        self.counted.push(function.to_owned());
        self
    }

    /// Powers the board up and runs it until the bench ends the run. Returns the outcome and the bench.
    ///
    /// # Errors
    ///
    /// [`Error::Image`] and [`Error::OutsideFlash`] for an image or contents that do not fit,
    /// [`Error::NoSymbol`] and [`Error::NeverCalled`] for a function that cannot be counted,
    /// [`Error::Emulator`] for anything the emulator refuses.
    pub fn run<B: Bench + 'static>(self, bench: B) -> Result<(Outcome, B), Error> {
        match self.chip {
            Chip::Stm32f405 => self.run_on(F405::new().map_err(refused)?, bench),
            Chip::Stm32g474 => self.run_on(G474::new().map_err(refused)?, bench),
        }
    }

    fn run_on<H: Hardware, B: Bench + 'static>(self, board: H, bench: B) -> Result<(Outcome, B), Error> {
        let symbols = symbols(self.elf)?;
        let images = self.images()?;
        let vectors = vectors(&images[0], self.chip);
        let counters = Counters::new(&self.counted, &symbols, &vectors)?;
        let mut session = Session::new(Box::new(board), 0, VirtualNanos(0)).map_err(refused)?;
        for address in counters.watched() {
            session.watch(Watch::Instruction(address));
        }
        let driver = Rig {
            bench,
            terminal: Terminal::find(&symbols),
            stack: stack_region(&symbols),
            symbols,
            counters,
            next_step: Some(0),
            frames_seen: 0,
            samples_seen: 0,
            hangs: Vec::new(),
            hung: Vec::new(),
            resets_seen: 0,
            instructions: 0,
            ended: 0,
            stack_bytes: 0,
        };
        let mut finished = emulator::run(session, &Start::new(&images), driver).map_err(refused)?;
        let gaps = gaps(&finished.session);
        let resets = finished.session.resets().iter().map(|reset| Reset { at: reset.at.0, cause: named(reset.cause) });
        let resets = resets.collect();
        let rig = finished.driver;
        let hardware = finished.session.board_mut();
        let outcome = Outcome {
            ended: rig.ended,
            instructions: rig.instructions,
            frames: std::mem::take(&mut hardware.wire().sent),
            unacknowledged: hardware.wire().unacknowledged,
            samples: std::mem::take(hardware.samples()),
            rtt: rig.terminal.into_bytes(),
            resets,
            stack_bytes: rig.stack_bytes,
            costs: rig.counters.into_costs(),
            gaps,
        };
        Ok((outcome, rig.bench))
    }

    /// The ELF file and what else goes into flash, each checked against the chip.
    fn images(&self) -> Result<Vec<Image>, Error> {
        let flash = self.chip.flash();
        let fits = |address: u64, length: usize| {
            let end = address + length as u64;
            if address < u64::from(flash.start) || end > u64::from(flash.end) {
                return Err(Error::OutsideFlash { address: address as u32, length });
            }
            Ok(())
        };
        let elf = Image::new(Path::new("image"), self.elf.to_vec(), None).map_err(|e| Error::Image(e.to_string()))?;
        for (address, bytes) in elf.segments() {
            fits(address, bytes.len())?;
        }
        let mut images = vec![elf];
        for &(address, bytes) in &self.flash {
            fits(u64::from(address), bytes.len())?;
            let contents = Image::new(Path::new("flash contents"), bytes.to_vec(), Some(u64::from(address)));
            images.push(contents.map_err(|e| Error::Image(e.to_string()))?);
        }
        Ok(images)
    }
}

fn refused(error: impl std::fmt::Display) -> Error {
    Error::Emulator(error.to_string())
}

/// The words of the vector table, which both chips find at the start of their flash.
fn vectors(image: &Image, chip: Chip) -> Vec<u32> {
    /// At least as many exceptions as either chip has. Words after the table are seldom code addresses, and a
    /// needless watch costs nothing.
    const LONGEST_TABLE: usize = 16 + 102;
    let table = image.segments().find(|(address, _)| *address == u64::from(chip.flash().start));
    let words = table.map(|(_, bytes)| bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)));
    // The first two words are the initial stack pointer and the reset vector.
    words.into_iter().flatten().take(LONGEST_TABLE).skip(2).filter(|word| chip.flash().contains(word)).collect()
}

/// RAM of the main stack: first and one past the last address.
fn stack_region(symbols: &Symbols) -> (u64, u64) {
    let address = |name| symbols.find(name).map_or(0, |symbol| u64::from(symbol.address));
    (address("_stack_end"), address("_stack_start"))
}

fn named(cause: EmulatorCause) -> ResetCause {
    match cause {
        EmulatorCause::Core => ResetCause::Software,
        EmulatorCause::Model("IWDG") => ResetCause::Watchdog,
        EmulatorCause::Model(other) => ResetCause::Other(other),
        _ => ResetCause::Other("unnamed"),
    }
}

fn gaps<H: Hardware>(session: &Session<H>) -> Vec<Gap> {
    let unmapped = session
        .unmapped()
        .into_iter()
        .map(|gap| Gap::Unmapped { address: gap.address, program_counter: gap.program_counter });
    let stored = session.unimplemented().iter().map(|(&address, gap)| Gap::StoredOnly {
        peripheral: gap.instance,
        address,
        program_counter: gap.program_counter,
    });
    unmapped.chain(stored).collect()
}

/// The driver of a run: calls the bench, drains the log, records the outcome.
struct Rig<B> {
    bench: B,
    terminal: Terminal,
    symbols: Symbols,
    counters: Counters,
    /// The stack's region: first address and one past its last.
    stack: (u64, u64),
    /// When the bench wants to be called, `None` once it has ended the run.
    next_step: Option<Nanos>,
    frames_seen: usize,
    samples_seen: usize,
    /// Functions the bench asked to hang at.
    hangs: Vec<u32>,
    /// Functions hung until the next reset, with the halfword that was there if it was replaced.
    hung: Vec<(u32, Option<u64>)>,
    resets_seen: usize,
    instructions: u64,
    ended: Nanos,
    stack_bytes: u32,
}

impl<B: Bench> Rig<B> {
    fn step<H: Hardware>(&mut self, now: Nanos, session: &mut Session<H>, host: &mut dyn Host) {
        let mut pins = Pins {
            now,
            hardware: session.board_mut(),
            symbols: &self.symbols,
            frames_seen: &mut self.frames_seen,
            samples_seen: &mut self.samples_seen,
            hangs: &mut self.hangs,
        };
        self.next_step = self.bench.step(now, &mut pins).map(|next| next.max(now + 1));
        for address in std::mem::take(&mut self.hangs) {
            self.hang(address, session, host);
        }
    }

    fn hang<H: Hardware>(&mut self, address: u32, session: &mut Session<H>, host: &mut dyn Host) {
        let at = u64::from(address);
        let replaced = host.read(at, Width::W16).ok().filter(|_| host.program(at, Width::W16, BRANCH_TO_SELF).is_ok());
        if replaced.is_none() {
            session.watch(Watch::Instruction(at));
        }
        self.hung.push((address, replaced));
    }

    /// Undoes what does not survive a restart, once for each restart.
    fn note_restart<H: Hardware>(&mut self, session: &mut Session<H>, host: &mut dyn Host) {
        if session.resets().len() == self.resets_seen {
            return;
        }
        self.resets_seen = session.resets().len();
        self.terminal.drain(host);
        self.counters.restart();
        for (address, replaced) in std::mem::take(&mut self.hung) {
            let at = u64::from(address);
            match replaced {
                // The region accepted the branch, so it accepts the instruction again.
                Some(instruction) => drop(host.program(at, Width::W16, instruction)),
                None => {
                    session.unwatch(Watch::Instruction(at));
                    host.hold(false);
                }
            }
        }
    }

    /// RAM starts as zeros, so the lowest word that is not zero is as deep as the stack ever was.
    fn measure_stack(&mut self, host: &mut dyn Host) {
        let (mut at, top) = self.stack;
        while at < top && host.read(at, Width::W32).unwrap_or(0) == 0 {
            at += 4;
        }
        self.stack_bytes = u32::try_from(top.saturating_sub(at)).unwrap_or(u32::MAX);
    }
}

impl<H: Hardware, B: Bench> Driver<H> for Rig<B> {
    fn on_settled(&mut self, session: &mut Session<H>, host: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Hit(hit) => {
                self.counters.hit(hit);
                if self.hung.iter().any(|&(address, replaced)| u64::from(address) == hit.address && replaced.is_none())
                {
                    host.hold(true);
                }
            }
            Settled::Stop(_) => self.note_restart(session, host),
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<H>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.instructions = stop.instruction_count;
        self.ended = now;
        self.terminal.drain(host);
        if self.next_step.is_some_and(|at| at <= now) {
            self.step(now, session, host);
        }
        let Some(next) = self.next_step else {
            self.measure_stack(host);
            return None;
        };
        Some(VirtualNanos(next.min(now + DRAIN_PERIOD)))
    }
}
