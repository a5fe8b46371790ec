//! Running a bare-metal program that talks by semihosting.

use std::collections::BTreeMap;
use std::path::Path;

use rigless::emulator::{self, Driver, Host, Settled, Start, Stop, Watch};
use rigless::image::Image;
use rigless::session::Session;
use rigless::time::VirtualNanos;

use crate::counting::Counters;
use crate::f405::F405;
use crate::image::symbols;
use crate::outcome::Cost;
use crate::{Error, Nanos};

/// How far a program without output is run before its instructions are counted again.
const PROGRESS_PERIOD: Nanos = 1_000_000;

/// What a bare-metal program left behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bare {
    /// What it wrote to the semihosting console.
    pub output: Vec<u8>,
    /// The status it ended with, or `None` if it was still running at the deadline.
    pub exit_status: Option<u32>,
    /// Instructions executed up to its last output, or to the last whole millisecond of virtual
    /// time if that is later. An exit call itself leaves no count.
    pub instructions: u64,
    /// Instruction counts of the functions asked for, by name.
    pub costs: BTreeMap<String, Cost>,
}

/// Runs a bare-metal ELF for a Cortex-M4F on the STM32F405's core, until it exits or until `until`.
///
/// The program must be linked for flash at `0x0800_0000` and RAM at `0x2000_0000`. Its semihosting
/// calls are served: console output, clock, exit. Peripherals are the STM32F405's. Every call of a function
/// in `counted` (names as they stand in the file) is counted, see [`Cost`].
///
/// # Errors
///
/// [`Error::Image`] for bytes that are no ELF file, [`Error::NoSymbol`] and [`Error::NeverCalled`] for a
/// function that cannot be counted, [`Error::Emulator`] for anything the emulator refuses.
pub fn run_bare(elf: &[u8], until: Nanos, counted: &[String]) -> Result<Bare, Error> {
    let image = Image::new(Path::new("program"), elf.to_vec(), None).map_err(|e| Error::Image(e.to_string()))?;
    let refused = |error: &dyn std::fmt::Display| Error::Emulator(error.to_string());
    let board = F405::new().map_err(|error| refused(&error))?;
    // no interrupt is enabled in a bare program, so no handler can disturb a count
    let counters = Counters::new(counted, &symbols(elf)?, &[])?;
    let mut session = Session::new(Box::new(board), 0, VirtualNanos(0)).map_err(|error| refused(&error))?;
    for address in counters.watched() {
        session.watch(Watch::Instruction(address));
    }
    let images = [image];
    let mut start = Start::new(&images);
    start.semihosting = true;
    let console = Console { until, output: Vec::new(), instructions: 0, counters };
    let finished = emulator::run(session, &start, console).map_err(|error| refused(&error))?;
    Ok(Bare {
        output: finished.driver.output,
        exit_status: finished.exit_status,
        instructions: finished.driver.instructions,
        costs: finished.driver.counters.into_costs(),
    })
}

struct Console {
    until: Nanos,
    output: Vec<u8>,
    instructions: u64,
    counters: Counters,
}

impl Driver<F405> for Console {
    fn on_settled(&mut self, _: &mut Session<F405>, _: &mut dyn Host, settled: Settled) {
        if let Settled::Hit(hit) = settled {
            self.counters.hit(hit);
        }
    }

    fn on_stop(&mut self, _: &mut Session<F405>, stop: Stop, _: &mut dyn Host) -> Option<VirtualNanos> {
        self.instructions = stop.instruction_count;
        (stop.at.0 < self.until).then(|| VirtualNanos(self.until.min(stop.at.0 + PROGRESS_PERIOD)))
    }

    fn on_console(&mut self, _: VirtualNanos, instruction_count: u64, bytes: &[u8]) {
        self.instructions = instruction_count;
        self.output.extend_from_slice(bytes);
    }
}
