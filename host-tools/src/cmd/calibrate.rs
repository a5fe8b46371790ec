//! `guideblock calibrate`

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use calibration::axis_curve::{self, Point};
use calibration::cell::Cell;
use can_wire::parameters::ParameterRecord;
use clap::ValueEnum;
use host_tools::calibrate::{self, Calibration, Reference, Settings, strokes};
use host_tools::recording::{Mapping, Unusable, table};
use host_tools::{parameters, replay};
use model_core::contact::HerseySpeed;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::GuideSet;
use strokes::{Stroke, Strokes};

use super::outputs::{Files, put};
use super::recordings::{RecordingArguments, with_progress};
use super::simulation_file::SimulationFile;
use super::{Failure, output, say};

/// Friction law of a guide from drag at known load; of an axis from drag over speed
///
/// A guide: recordings of strokes at several speeds and loads with the reference load in preload_n. Gives
/// the friction coefficient of every cell, the four constants of Eq. 19 with their intervals, which speed
/// the Hersey number counts, what the strokes leave open, and the guide file for `estimate`, `simulate`
/// and `preload`. Strokes without load (preload_n = 0) or --seals-off measure the drag of the seals.
///
/// An axis without a reference load: Coulomb and viscous friction by direction and, where leaving out one
/// speed at a time supports it, a Stribeck term.
///
/// A file without time_s is a table of means: velocity_m_s, drag_force_n and, for a guide, preload_n,
/// temperature_block_degc, drag_force_sigma_n.
///
///     guideblock calibrate ladder.csv --viscosity 100 --out guide.toml --html report.html
///     guideblock calibrate screw.csv --column velocity_m_s=omega:0.0016 --column drag_force_n=torque:628
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Recordings or tables, CSV or Parquet
    #[arg(value_name = "RECORDING", required = true)]
    inputs: Vec<PathBuf>,
    /// Simulation file with the guide's geometry and lubricant; without it, the set zhou-2023
    #[arg(long, visible_alias = "simulation", value_name = "FILE.toml")]
    guide: Option<PathBuf>,
    /// Kinematic viscosity of the oil, cSt; goes before that of the file
    #[arg(long, value_name = "CST")]
    viscosity: Option<f64>,
    /// What preload_n holds
    #[arg(long, value_enum, default_value = "preload")]
    reference: ReferenceArgument,
    /// Speed in the Hersey number
    #[arg(long, value_enum, default_value = "auto")]
    hersey: HerseyArgument,
    /// Segments that were measured without seals
    #[arg(long, value_name = "SEGMENT", value_delimiter = ',')]
    seals_off: Vec<i64>,
    /// Fit a constant drag of the seals although no stroke shows it alone
    #[arg(long)]
    fit_seals: bool,
    /// Length of the windows that strokes are looked for with, s; at low rates longer, for 20 rows in each
    #[arg(long, value_name = "S", default_value_t = 0.2, value_parser = positive)]
    every: f64,
    /// Guide file with the fitted constants; simulation file of an axis
    #[arg(long, value_name = "GUIDE.toml")]
    out: Option<PathBuf>,
    /// Parameter record of a block, for its flash
    #[arg(long, value_name = "RECORD")]
    record: Option<PathBuf>,
    /// Bench file with the block's sensors, which the record takes over; without it, the project's own bench
    #[arg(long, value_name = "BENCH.toml", requires = "record")]
    bench: Option<PathBuf>,
    /// Print one JSON object to standard output
    #[arg(long)]
    json: bool,
    /// Page with charts
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

#[derive(Clone, Copy, ValueEnum)]
enum ReferenceArgument {
    /// the preload (Eq. 1)
    Preload,
    /// the lateral force on a split block (Eq. 2)
    Lateral,
}

#[derive(Clone, Copy, ValueEnum)]
enum HerseyArgument {
    /// the one that the strokes ask for; that of the guide file where they cannot tell
    Auto,
    /// sliding speed of Eq. 12
    Slip,
    /// carriage speed
    Carriage,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0).ok_or_else(|| "expected a number above 0".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let files = Files::default().reads("RECORDING", &arguments.inputs).reads("--guide", &arguments.guide);
    let files = files.reads("--bench", &arguments.bench).writes("--out", &arguments.out);
    files.writes("--record", &arguments.record).writes("--html", &arguments.html).check()?;
    let SimulationFile { simulation, mappings } =
        SimulationFile::or_published(arguments.guide.as_deref())?.with_viscosity(arguments.viscosity)?;
    let settings = settings(arguments, &simulation);
    let guide = match &simulation.law {
        Law::Guide(set) => Some(set),
        _ => None,
    };
    let mut all: Vec<Stroke> = Vec::new();
    let mut window_s: Option<f64> = None;
    for input in &arguments.inputs {
        let found = read(arguments, input, &mappings, guide, &settings)?;
        for (reason, count) in &found.left_out {
            say(format_args!("{}: {count} windows skipped: {reason}", input.display()));
        }
        all.extend(found.all);
        window_s = window_s.into_iter().chain(found.window_s).reduce(f64::max);
    }
    let name = arguments.inputs.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
    if all.is_empty() {
        return Err(Failure::Data(format!("{name}: no stroke at steady speed; {}", advice(window_s))));
    }
    let cells: Vec<Cell> = all.iter().filter_map(|stroke| stroke.cell).collect();
    match guide {
        Some(set) if !cells.is_empty() => {
            if cells.len() < all.len() {
                say(format_args!("{name}: {} strokes without a reference load are left out", all.len() - cells.len()));
            }
            let found =
                calibrate::calibrate(&cells, set, &settings).map_err(|why| Failure::Data(format!("{name}: {why}")))?;
            write_guide(arguments, &name, &found, &simulation)
        }
        Some(_) if arguments.guide.is_some() || arguments.record.is_some() => {
            let why = "no reference load; a guide is calibrated from a column preload_n, or [operation] preload_n";
            Err(Failure::Data(format!("{name}: {why}")))
        }
        _ => write_axis(arguments, &name, &all),
    }
}

/// What to record where there is no stroke.
fn advice(window_s: Option<f64>) -> String {
    match window_s {
        // windows are not aligned with strokes: only twice their length is certain to hold a whole one
        Some(s) => format!("hold every speed within 5 % for at least {:.2} s after the ramp and the reversal", 2.0 * s),
        None => "velocity_m_s is 0 in every row of the table".to_owned(),
    }
}

fn settings(arguments: &Arguments, simulation: &Simulation) -> Settings {
    Settings {
        every_s: arguments.every,
        zero_speed_m_s: simulation.axis.zero_speed_m_s,
        reference: match arguments.reference {
            ReferenceArgument::Preload => Reference::Preload,
            ReferenceArgument::Lateral => Reference::Lateral,
        },
        preload_n: simulation.preload_n,
        seals_off: arguments.seals_off.clone(),
        fits_seals: arguments.fit_seals,
        convention: match arguments.hersey {
            HerseyArgument::Auto => None,
            HerseyArgument::Slip => Some(HerseySpeed::Slip),
            HerseyArgument::Carriage => Some(HerseySpeed::Carriage),
        },
    }
}

/// The strokes of a file: a recording, or a table of means where it has no time.
fn read(
    arguments: &Arguments,
    input: &Path,
    mappings: &[Mapping],
    guide: Option<&GuideSet>,
    settings: &Settings,
) -> Result<Strokes, Failure> {
    let unusable = |why: strokes::Missing| Failure::Data(format!("{}: {why}", input.display()));
    let mappings = arguments.recording.with(mappings);
    let selections = &arguments.recording.selections;
    let opened =
        with_progress(input, |progress| match host_tools::recording::open(input, &mappings, selections, progress) {
            Err(Unusable::MissingColumn { column, .. }) if column == "time_s" && input != Path::new("-") => Ok(None),
            other => other.map(Some),
        })?;
    match opened {
        Some((run, losses)) => {
            losses.describe(&run.name).iter().for_each(say);
            strokes::of_run(&run, guide, settings).map_err(unusable)
        }
        None => {
            let optional = ["preload_n", "temperature_block_degc", "drag_force_sigma_n", "segment"];
            let required = ["velocity_m_s", "drag_force_n"];
            let (table, losses) = with_progress(input, |progress| {
                table::open(input, &required, &optional, &mappings, selections, progress)
            })
            .map_err(|failure| match failure {
                Failure::Data(why) => {
                    Failure::Data(format!("{why}; it has no column time_s and was taken for a table of means"))
                }
                other => other,
            })?;
            let name = input.display().to_string();
            losses.describe(&name).iter().for_each(say);
            say(format_args!("{name}: no column time_s: its {} rows are means at constant speed", table.len()));
            strokes::of_table(&table, guide, settings).map_err(unusable)
        }
    }
}

fn write_guide(arguments: &Arguments, name: &str, found: &Calibration, base: &Simulation) -> Result<(), Failure> {
    // no law is shown that no file could hold
    let unfit = |why: calibrate::Unfit| {
        calibrate::guide_doubts(found).iter().for_each(say);
        Failure::Data(format!("{name}: {why}"))
    };
    let simulation = calibrate::guide_file(found, base).map_err(unfit)?;
    let record = match &arguments.record {
        Some(path) => {
            let made = calibrate::record(found, &bench(arguments)?).map_err(unfit)?;
            Some((path, parameters::to_bytes(&made).map_err(Failure::data)?))
        }
        None => None,
    };
    if let Some(path) = &arguments.html {
        put(path, calibrate::guide_page(name, found))?;
    }
    if let Some(path) = &arguments.out {
        put(path, format!("# {} strokes of {name}\n{}", found.cells.len(), simulation.to_toml()))?;
    }
    if let Some((path, bytes)) = record {
        put(path, bytes)?;
    }
    // last, so that closing standard output early does not cost the files
    let mut out = output();
    if arguments.json {
        writeln!(out, "{:#}", calibrate::guide_object(name, found))?;
    } else {
        for line in calibrate::describe_guide(found) {
            writeln!(out, "{line}")?;
        }
    }
    Ok(out.flush()?)
}

/// The record whose sensors a calibrated one takes over.
fn bench(arguments: &Arguments) -> Result<ParameterRecord, Failure> {
    let Some(file) = &arguments.bench else { return Ok(replay::UNPROGRAMMED) };
    let text = fs::read_to_string(file).map_err(|error| Failure::io(file, error))?;
    parameters::from_bench(&text).map_err(|why| Failure::Data(format!("{}: {why}", file.display())))
}

fn write_axis(arguments: &Arguments, name: &str, all: &[Stroke]) -> Result<(), Failure> {
    if arguments.record.is_some() {
        let why = "without a reference load there is no guide for a block; --record needs preload_n";
        return Err(Failure::Data(format!("{name}: {why}")));
    }
    say(format_args!("{name}: no reference load: friction over speed alone, {} strokes", all.len()));
    let points: Vec<Point> =
        all.iter().map(|stroke| Point { velocity: stroke.velocity_m_s, force: stroke.force_n }).collect();
    let found = axis_curve::select(&points).map_err(|why| Failure::Data(format!("{name}: {why}")))?;
    if let Some(path) = &arguments.html {
        put(path, calibrate::axis_page(name, &points, &found))?;
    }
    if let Some(path) = &arguments.out {
        let text = format!("# {} strokes of {name}\n{}", all.len(), calibrate::axis_file(&found).to_toml());
        put(path, text)?;
    }
    let mut out = output();
    if arguments.json {
        writeln!(out, "{:#}", calibrate::axis_object(name, &found))?;
    } else {
        for line in calibrate::describe_axis(&found) {
            writeln!(out, "{line}")?;
        }
    }
    out.flush()?;
    Ok(())
}
