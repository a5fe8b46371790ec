//! `guideblock image`

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use host_tools::image::{self, Circumstances, NoImage};
use host_tools::parameters;
use host_tools::replay::UNPROGRAMMED;
use simulation::Simulation;

use super::outputs::{Files, put};
use super::{Failure, output, say};

/// Makes the parameter image that a block runs from a simulation, or shows what an image holds
///
///     guideblock diagnose run.csv --simulation sim.toml --export augmented.toml
///     guideblock image augmented.toml --record block.bin --out repaired.bin
///     guideblock image --describe repaired.bin
///
/// The simulation's law, oil and mechanisms go into the image. Sensors, ranges, node and the mark
/// that the block is calibrated come from --record; without it they are those of an unprogrammed
/// block, and an image that is not calibrated gives no preload. What diagnose exports has preload
/// and friction moved within their tolerances; a calibrated block keeps its own with --keep-law.
/// A mechanism that the block cannot run, and every curve, is refused with its name and the reason:
/// exit status 3, no image.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Simulation file, as diagnose --export writes it
    #[arg(value_name = "SIMULATION.toml", required_unless_present = "describe", requires = "out")]
    simulation: Option<PathBuf>,
    /// Record of the block that the image is for
    #[arg(long, value_name = "EXISTING.bin")]
    record: Option<PathBuf>,
    /// Where the image is written
    #[arg(long, value_name = "BLOCK.bin")]
    out: Option<PathBuf>,
    /// Image to show
    #[arg(long, value_name = "BLOCK.bin", conflicts_with_all = ["simulation", "record", "out"])]
    describe: Option<PathBuf>,
    /// Load that the block carries, N; needed by external-load
    #[arg(long, value_name = "N")]
    external_load_n: Option<f64>,
    /// Load on the way back, where it differs
    #[arg(long, value_name = "N", requires = "external_load_n")]
    external_load_back_n: Option<f64>,
    /// Place on the rail at which the block is switched on, m
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    start_m: f64,
    /// Lowest temperature the image is to hold for; the narrower, the closer the oil is followed
    #[arg(long, value_name = "DEGC", requires = "to_degc")]
    from_degc: Option<f64>,
    /// Highest temperature
    #[arg(long, value_name = "DEGC", requires = "from_degc")]
    to_degc: Option<f64>,
    /// Keep the friction law and the oil of --record and take the mechanisms alone
    #[arg(long, requires = "record")]
    keep_law: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let page = match (&arguments.describe, &arguments.simulation, &arguments.out) {
        (Some(path), ..) => {
            let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
            let page = if arguments.json { image::described_json(&bytes) } else { image::describe(&bytes) };
            page.map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?
        }
        (None, Some(simulation), Some(out)) => make(arguments, simulation, out)?,
        _ => return Err(Failure::Usage("give a simulation and --out, or --describe".to_owned())),
    };
    let mut out = output();
    out.write_all(page.trim_end().as_bytes())?;
    out.write_all(b"\n")?;
    out.flush()?;
    Ok(())
}

fn make(arguments: &Arguments, path: &PathBuf, out: &PathBuf) -> Result<String, Failure> {
    Files::default().reads("SIMULATION", [path]).reads("--record", &arguments.record).writes("--out", [out]).check()?;
    let text = fs::read_to_string(path).map_err(|error| Failure::io(path, error))?;
    let simulation = Simulation::from_toml(&text).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?;
    let base = match &arguments.record {
        Some(path) => {
            let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
            parameters::from_bytes(&bytes).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?
        }
        None => UNPROGRAMMED,
    };
    let there = arguments.external_load_n;
    let told = Circumstances {
        external_load_n: there.map(|there| [there, arguments.external_load_back_n.unwrap_or(there)]),
        start_m: arguments.start_m,
        temperature_degc: arguments.from_degc.zip(arguments.to_degc).map(|(from, to)| [from, to]),
        keep_law: arguments.keep_law,
    };
    let made = image::build(&simulation, &base, &told).map_err(|why| {
        if let (NoImage::Refused(refused), true) = (&why, arguments.json) {
            // the requested JSON, before the message why there is no image
            let _ = writeln!(output(), "{}", image::refusal_json(refused));
        }
        Failure::Data(format!("{}: {why}", path.display()))
    })?;
    put(out, &made.bytes)?;
    made.notes.iter().for_each(say);
    if !made.record.params.calibrated {
        say("the image is NOT calibrated and gives no preload: make it from the block's own record with --record");
    }
    Ok(if arguments.json { image::to_json(&made) } else { image::text(&made) })
}
