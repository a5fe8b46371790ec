//! `guideblock demo`

mod files;
mod live;

use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use can_wire::parameters::{ADDRESS, ParameterRecord};
use can_wire::{BoardKind, RawFrame};
use clap::ValueEnum;
use host_tools::emulated::{self, RigBench};
use host_tools::judgement::{Accuracy, Agreement, accuracy, compare, silence};
use host_tools::parameters;
use host_tools::recording::axis;
use host_tools::replay::Replay;
use host_tools::rig::Rig;
use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use host_tools::rig::track::Track;
use simulation::run::Run;
use virtual_board::{Chip, VirtualBoard};

use super::outputs::Files;
use super::recordings::RecordingArguments;
use super::{Failure, say, seed};
use files::{NAMES, Remains};
use live::Live;

/// The run that is played when none is given.
const RUN: &str = include_str!("../../runs/shs35_preload_loss.csv");
/// Its bench.
const BENCH: &str = include_str!("../../runs/bench.toml");

/// Share of readings that a band of two standard deviations has to cover.
const COVERAGE: f64 = 0.95;

/// Runs the unmodified firmware without hardware
///
/// A run of an axis is turned into converter codes and encoder edges, with the noise and the limits of real
/// sensors, and played to the firmware image in an emulated board. What the block says on its bus is
/// printed as it comes, held against the truth and against a replay of the samples its converters
/// delivered, and written to files.
///
/// Without RECORDING.csv the bundled run is played: two minutes of a SHS35 block whose preload falls from
/// 3000 N to 2400 N.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Run of an axis: time_s, position_m, drag_force_n, preload_n, temperature_block_degc
    #[arg(value_name = "RECORDING.csv")]
    recording: Option<PathBuf>,
    /// Board to emulate
    #[arg(long, value_enum, default_value_t = Board::F405)]
    board: Board,
    /// Firmware image for that board; without it target/images/BOARD.elf, which `./demo` builds
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
    /// Bench file: what the block's parameter record says; without it the bundled one
    #[arg(long, value_name = "BENCH.toml")]
    bench: Option<PathBuf>,
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    out: PathBuf,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1, value_parser = seed)]
    seed: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Board {
    /// STM32F405RG
    F405,
    /// STM32G474RE
    G474,
}

impl Board {
    fn chip(self) -> Chip {
        match self {
            Board::F405 => Chip::Stm32f405,
            Board::G474 => Chip::Stm32g474,
        }
    }

    fn kind(self) -> BoardKind {
        match self {
            Board::F405 => BoardKind::Stm32f405,
            Board::G474 => BoardKind::Stm32g474,
        }
    }

    /// Where `./demo` puts its image.
    fn image(self) -> PathBuf {
        PathBuf::from(match self {
            Board::F405 => "target/images/f405.elf",
            Board::G474 => "target/images/g474.elf",
        })
    }

    /// The command that builds its image.
    fn build(self) -> &'static str {
        match self {
            Board::F405 => "cargo fw-f405",
            Board::G474 => "cargo fw-g474",
        }
    }
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let board = arguments.board;
    let path = arguments.image.unwrap_or_else(|| board.image());
    let remains = NAMES.map(|name| arguments.out.join(name));
    let files = Files::default().reads("RECORDING", &arguments.recording).reads("--bench", &arguments.bench);
    files.writes("--out", &remains).check()?;
    let image = fs::read(&path).map_err(|error| {
        let build = board.build();
        Failure::file(
            &path,
            format_args!("{error}; ./demo builds it, or build one with `{build}` and name it with --image"),
        )
    })?;
    let record = record(arguments.bench.as_ref())?;
    let run = recording(arguments.recording.as_ref())?;
    let (name, part) = (&run.name, run.longest_part());
    if part.len() < run.len() {
        say(format_args!("{name}: playing the longest part without gaps, {} of {} rows", part.len(), run.len()));
    }
    let Some(track) = Track::new(&run, part) else { return Err(Failure::Data(format!("{name}: no rows"))) };
    let front_end = FrontEnd::new(record.params.calibration, ChannelNoise::BENCH, arguments.seed);
    let flash = parameters::to_bytes(&record).map_err(Failure::data)?;

    println_quietly(&format!(
        "{name}: {:.0} s, played to {} ({})\n",
        track.duration_s(),
        board.kind().name(),
        path.display()
    ))?;
    let started = Instant::now();
    let bench = RigBench::new(Rig::new(track.clone(), front_end), Live::new(track));
    let (outcome, bench) = VirtualBoard::new(board.chip(), &image)
        .with_flash(ADDRESS, &flash)
        .run(bench)
        .map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?;
    let wall_s = started.elapsed().as_secs_f64();
    let live = bench.into_listener().finish()?;
    if live.points.is_empty() {
        return Err(Failure::Data(format!(
            "{}: no estimate on the bus; is the image built for this board (`{}`)?",
            path.display(),
            board.build()
        )));
    }

    let blocks = emulated::blocks(&outcome.samples);
    let mut replay = Replay::new(&record).map_err(Failure::data)?;
    let replayed: Vec<_> = blocks.iter().filter_map(|block| replay.block(block)).flat_map(|sent| sent.frames).collect();
    let bus =
        outcome.frames.iter().filter_map(|frame| Some(RawFrame { id: frame.id, data: frame.data().try_into().ok()? }));
    let verdict = Verdict {
        agreement: compare(bus, replayed.into_iter()),
        accuracy: accuracy(&live.points),
        right_board: live.board == Some(board.kind()),
        restarts: outcome.resets.len(),
    };
    let title = format!("{name} on {}", board.kind().name());
    let facts = verdict.facts(&live, &record);
    let speed = format!(
        "{:.0} s of the block's life took {wall_s:.1} s: {} instructions, {} samples, {} frames",
        emulated::seconds(outcome.ended),
        outcome.instructions,
        outcome.samples.len(),
        outcome.frames.len()
    );
    println_quietly(&format!("\n{speed}\n\n{}\n", facts.join("\n")))?;
    let remains = Remains {
        title: &title,
        facts: &facts,
        points: &live.points,
        frames: &outcome.frames,
        blocks: &blocks,
        record: &flash,
    };
    let written = files::write(&arguments.out, &remains)?;
    println_quietly(&written)?;
    if verdict.holds() { Ok(()) } else { Err(Failure::Check) }
}

fn record(bench: Option<&PathBuf>) -> Result<ParameterRecord, Failure> {
    let (name, text) = match bench {
        Some(path) => (path.display().to_string(), fs::read_to_string(path).map_err(|error| Failure::io(path, error))?),
        None => ("bundled bench".to_owned(), BENCH.to_owned()),
    };
    parameters::from_bench(&text).map_err(|why| Failure::Data(format!("{name}: {why}")))
}

fn recording(path: Option<&PathBuf>) -> Result<Run, Failure> {
    let (run, _) = match path {
        Some(path) => RecordingArguments::default().open(path, &[])?,
        None => axis::read("bundled run shs35_preload_loss.csv", RUN.as_bytes())?,
    };
    Ok(run)
}

/// Prints a line without panicking when standard output is a pipe that has closed.
fn println_quietly(text: &str) -> Result<(), Failure> {
    use std::io::Write;
    Ok(writeln!(std::io::stdout(), "{text}")?)
}

/// What the demo checks.
struct Verdict {
    agreement: Agreement,
    accuracy: Accuracy,
    right_board: bool,
    restarts: usize,
}

impl Verdict {
    fn covers(&self) -> bool {
        self.accuracy.covered as f64 >= COVERAGE * self.accuracy.judged as f64
    }

    fn holds(&self) -> bool {
        matches!(self.agreement, Agreement::Identical { .. }) && self.covers() && self.right_board && self.restarts == 0
    }

    /// One line a fact, for the terminal and the page.
    fn facts(&self, live: &live::Seen, record: &ParameterRecord) -> Vec<String> {
        let mark = |holds: bool| if holds { "ok  " } else { "FAIL" };
        let mut facts = Vec::new();
        facts.push(match self.agreement {
            Agreement::Identical { frames } => format!(
                "ok    bus = replay: the {frames} estimate and motion frames are, bit for bit, those that a replay of the converters' samples gives"
            ),
            Agreement::Different { at, bus, replay } => {
                format!("FAIL  bus = replay: frame {at} differs: {bus:02x?} on the bus, {replay:02x?} replayed")
            }
        });
        let a = &self.accuracy;
        if a.judged == 0 {
            facts.push("--    no reading with a preload and a truth to hold it against".to_owned());
        } else {
            facts.push(format!(
                "{}  truth within ± 2σ in {} of {} readings ({:.1} %, at least {:.0} % wanted)",
                mark(self.covers()),
                a.covered,
                a.judged,
                100.0 * a.covered as f64 / a.judged as f64,
                100.0 * COVERAGE
            ));
            let u = &record.params.uncertainty;
            facts.push(format!(
                "      largest error {:+.2} % of the truth, rms {:.2} %; the band is ± {:.1} %, most of it for what the block \
                 cannot know of its specimen: friction ± {:.0} %, viscosity ± {:.0} %, force gain ± {:.1} % (1 σ each)",
                100.0 * a.largest_error,
                100.0 * a.rms_error,
                100.0 * a.mean_band,
                100.0 * u.friction,
                100.0 * u.viscosity,
                100.0 * u.force_gain
            ));
        }
        let silent: Vec<_> = silence(&live.points)
            .iter()
            .map(|(reason, count)| {
                format!("{} {:.1} %", reason.name(), 100.0 * *count as f64 / live.points.len() as f64)
            })
            .collect();
        if !silent.is_empty() {
            facts.push(format!("      no preload, and said why: {}", silent.join(", ")));
        }
        let tally = live.tally.to_string().replace('\n', "; ");
        facts.push(format!("      {tally}"));
        if !self.right_board {
            facts.push("FAIL  the image does not say that it runs on this board".to_owned());
        }
        if self.restarts > 0 {
            facts.push(format!("FAIL  the board restarted {} times", self.restarts));
        }
        facts
    }
}
