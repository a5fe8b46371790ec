//! `guideblock record`

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use can_wire::NodeId;
use can_wire::burst::Record;
use clap::ValueEnum;
use host_tools::block::Listening;
use host_tools::bus::{self, BusError, Event, Source};
use host_tools::candump::Frame;
use host_tools::parameters;
use host_tools::recorder::{Kind, Recorder, RecorderError};
use model_core::calibration::Calibration;

use super::outputs::Files;
use super::progress::Bar;
use super::{Failure, node, say};

/// Records the bursts of a block as they come
///
/// A burst is every sample as the converters delivered it. Rows are only ever appended, and reach the disk
/// within a second; a recording that was cut is readable and is carried on by the next `record`.
///
///     guideblock record --from slcan:/dev/ttyACM0 --parameters block.bin --out run.csv
///     candump -L can0 | guideblock record --from - --out run.csv
///
/// On a bus that one can speak on, frames that got lost are asked for again. From a log only what stands in it
/// can be had: what is missing is counted. Order a burst with `guideblock block burst`, which records it as well.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// candump text in a FILE or -, slcan:PORT, socketcan:INTERFACE, or desk: a block in memory
    #[arg(long, value_name = "BUS")]
    from: Source,
    /// The block's node, 1 to 127
    #[arg(long, value_name = "N", value_parser = node, default_value = "1")]
    node: NodeId,
    /// Frames of the bus as candump text, appended as well
    #[arg(long, value_name = "LOG")]
    frames: Option<PathBuf>,
    /// End after so many seconds; otherwise with the log, or never
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<f64>,
    #[command(flatten)]
    target: Target,
}

/// Where rows go, and what makes newtons of codes.
#[derive(clap::Args)]
pub(crate) struct Target {
    /// The recording; appended to when it is there
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// What is written
    #[arg(long = "as", value_enum, default_value_t = Form::Run)]
    form: Form,
    /// The block's parameter record, for its calibration; without it the development bench's
    #[arg(long, value_name = "RECORD")]
    parameters: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// SI units: a recording that `diagnose` takes
    Run,
    /// codes and counts: a recording that `replay` takes
    Raw,
}

impl Target {
    /// The file's name.
    pub(crate) fn path(&self) -> &Path {
        &self.out
    }

    /// What is read and written.
    pub(crate) fn files(&self) -> Files<'_> {
        Files::default().reads("--parameters", &self.parameters).writes("--out", [&self.out])
    }

    /// Opens the recording.
    pub(crate) fn open(&self) -> Result<Recorder, Failure> {
        let calibration = match &self.parameters {
            Some(path) => {
                let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
                let record = parameters::from_bytes(&bytes);
                record.map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?.params.calibration
            }
            None => {
                if self.form == Form::Run {
                    say(
                        "no --parameters: forces, positions and temperatures are those of the development bench's sensors, not of this block's",
                    );
                }
                Calibration::BENCH
            }
        };
        let kind = match self.form {
            Form::Run => Kind::Run,
            Form::Raw => Kind::Raw,
        };
        Recorder::open(&self.out, kind, calibration).map_err(|why| match why {
            RecorderError::Io(error) => Failure::io(&self.out, error),
            other => Failure::Data(format!("{}: {other}", self.out.display())),
        })
    }
}

/// A failure of the bus counts as wrong usage: a bus that cannot be opened was named wrongly.
pub(crate) fn of_bus(error: BusError) -> Failure {
    Failure::Usage(error.to_string())
}

/// What has been heard so far.
#[derive(Default)]
struct Tally {
    bursts: u32,
    blocks: u64,
    whole: u32,
    dropped: u64,
}

/// Longest wait for a frame.
const WAIT: Duration = Duration::from_millis(20);

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let log = match &arguments.from {
        Source::Candump(file) => Some(Path::new(file)),
        Source::Slcan(_) | Source::SocketCan(_) | Source::Desk => None,
    };
    arguments.target.files().reads("--from", log).writes("--frames", &arguments.frames).check()?;
    let mut bus = bus::open(&arguments.from).map_err(of_bus)?;
    let mut recorder = arguments.target.open()?;
    let mut frames = match &arguments.frames {
        Some(path) => {
            let file = OpenOptions::new().append(true).create(true).open(path);
            Some(file.map_err(|error| Failure::io(path, error))?)
        }
        None => None,
    };
    let end = bus.now() + arguments.seconds.map_or(Duration::MAX / 2, Duration::from_secs_f64);
    let (mut listening, mut tally) = (Listening::new(arguments.node), Tally::default());
    let bar = Bar::busy("recording");
    while bus.now() < end {
        match bus.receive(WAIT).map_err(of_bus)? {
            Event::End => break,
            Event::Silence => {}
            Event::Frame(heard) => {
                if let Some(file) = &mut frames {
                    let text = Frame::new(heard.time, "can0", heard.frame.id, &heard.frame.data);
                    file.write_all(format!("{text}\n").as_bytes())?;
                }
                hear(&mut listening, &mut recorder, &mut tally, |l, each| l.hear(&heard, each))?;
            }
        }
        listening.ask(&mut *bus).map_err(of_bus)?;
    }
    hear(&mut listening, &mut recorder, &mut tally, |l, each| l.end(each))?;
    recorder.sync()?;
    drop(bar);
    if listening.is_under_way() {
        say("the last burst has not ended");
    }
    say(format_args!(
        "{}: {} rows of {} bursts, {} of them not whole: {} segments lost, {} blocks left out by the block itself",
        arguments.target.path().display(),
        recorder.rows(),
        tally.bursts,
        tally.bursts - tally.whole,
        listening.lost(),
        tally.dropped
    ));
    if tally.blocks == 0 {
        return Err(Failure::Data(format!(
            "no burst of node {}; order one with `guideblock block burst`",
            arguments.node.get()
        )));
    }
    if tally.bursts > tally.whole { Err(Failure::Check) } else { Ok(()) }
}

/// Calls `of` with the listener, writes the records that it gives and counts them.
fn hear(
    listening: &mut Listening,
    recorder: &mut Recorder,
    tally: &mut Tally,
    of: impl FnOnce(&mut Listening, &mut dyn FnMut(&Record)),
) -> Result<(), Failure> {
    let (mut failed, mut ended) = (Ok(()), false);
    of(listening, &mut |record| {
        match record {
            Record::Header(_) => tally.bursts += 1,
            Record::Block(_) => tally.blocks += 1,
            Record::Trailer(trailer) => {
                tally.dropped += u64::from(trailer.dropped);
                ended = true;
            }
        }
        if failed.is_ok() {
            failed = recorder.append(record);
        }
    });
    if ended {
        tally.whole += u32::from(listening.is_intact());
    }
    Ok(failed?)
}
