//! `guideblock simulate`

mod driven;
mod profile;
mod recorded;
mod sensors;

use std::io::Write;
use std::path::{Path, PathBuf};

use host_tools::recording::{Column, Kind, write};

use super::outputs::{self, Files};
use super::progress::Bar;
use super::recordings::RecordingArguments;
use super::simulation_file::SimulationFile;
use super::{Failure, output, say};
use profile::ProfileArguments;
use sensors::SensorArguments;

/// Preload of the published set where no file states one, N.
const PUBLISHED_PRELOAD_N: f64 = 3000.0;

/// Force that a simulation says for the motion of a recording, or a whole recording of a test profile
///
///     guideblock simulate run.csv --simulation sim.toml --out simulated.csv
///     guideblock simulate --profile staircase --simulation sim.toml --noise-n 0.1 --out stairs.csv
///
/// RECORDING: one row per sample, time_s and simulated_force_n, without noise, positive towards
/// +position as drag_force_n. Preload and temperature are those of the recording where it has
/// them. A cell is empty where the law has no value: at rest, where friction is not determined,
/// and where preload or temperature were not measured; how many and why is said on standard error.
///
/// --profile: a recording with time, position, velocity, force, preload, segment, and load and
/// temperatures where they are set. Speeds change in smooth ramps. The carriage at rest is not
/// pushed: the force there is the law's offset. Sensors disturb it where they are asked for.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Recording, CSV or Parquet; - is standard input
    #[arg(value_name = "RECORDING")]
    input: Option<PathBuf>,
    /// Simulation file; without it, the set zhou-2023 at 3000 N
    #[arg(long, value_name = "SIM.toml")]
    simulation: Option<PathBuf>,
    /// File to write, .csv or .parquet; without it, CSV to standard output
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
    /// Print what was done as one JSON object to standard output
    #[arg(long, requires = "out")]
    json: bool,
    /// Page with the force over time and over velocity
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
    #[command(flatten)]
    profile: ProfileArguments,
    #[command(flatten)]
    sensors: SensorArguments,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = arguments.out.as_deref().unwrap_or(Path::new("-"));
    if Kind::of(out).is_none() {
        return Err(Failure::file(out, "name it .csv or .parquet, so that it is clear what to write"));
    }
    if arguments.input.is_none() && !arguments.recording.is_empty() {
        return Err(Failure::Usage("--where and --column are for a recording, not for --profile".to_owned()));
    }
    let files = Files::default().reads("RECORDING", &arguments.input).reads("--simulation", &arguments.simulation);
    files.writes("--out", [out]).writes("--html", &arguments.html).check()?;
    let SimulationFile { mut simulation, mappings } = SimulationFile::or_published(arguments.simulation.as_deref())?;
    if arguments.simulation.is_none() {
        simulation.preload_n = Some(PUBLISHED_PRELOAD_N);
    }
    let told = match (&arguments.input, arguments.profile.profile) {
        (Some(input), None) => recorded::run(arguments, input, &simulation, &mappings, out)?,
        (None, Some(name)) => driven::run(arguments, name, &simulation, out)?,
        // checked here: a conflict declared to clap would silence the requirements of other options
        (None, None) => {
            let what =
                "give a recording, `simulate RUN.csv`, or a test profile, `simulate --profile NAME`; --help names them";
            return Err(Failure::Usage(what.to_owned()));
        }
        (Some(_), Some(_)) => return Err(Failure::Usage("give a recording or --profile, one of the two".to_owned())),
    };
    if let Some(path) = &arguments.html {
        outputs::put(path, &told.page)?;
    }
    // after the page, so that closing standard output early does not cost it
    told.written?;
    if arguments.json {
        let mut out = output();
        writeln!(out, "{:#}", told.object)?;
        out.flush()?;
    }
    for line in &told.lines {
        say(line);
    }
    Ok(())
}

impl Arguments {
    /// Name of the simulation in messages.
    fn simulation_name(&self) -> String {
        self.simulation.as_ref().map_or_else(|| "zhou-2023".to_owned(), |path| path.display().to_string())
    }
}

/// What is reported about a run beside its rows.
struct Told {
    /// How writing the rows ended.
    written: Result<(), Failure>,
    lines: Vec<String>,
    object: serde_json::Value,
    /// Empty unless asked for.
    page: String,
}

/// Writes columns.
fn put(path: &Path, columns: &[Column<'_>]) -> Result<(), Failure> {
    let _bar = Bar::busy(&format!("writing {}", path.display()));
    write(path, columns).map_err(|error| outputs::of(path, error))
}

/// RMS of the finite values; NaN without any.
fn rms(column: &[f64]) -> f64 {
    let (sum, count) = column.iter().filter(|x| x.is_finite()).fold((0.0, 0usize), |(s, n), x| (s + x * x, n + 1));
    (sum / count as f64).sqrt()
}
