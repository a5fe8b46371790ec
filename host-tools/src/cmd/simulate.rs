//! `guideblock simulate`

mod profile;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use host_tools::recording::{Column, Kind, Mapping, write};
use host_tools::simulate::{self, Sensors};
use serde_json::json;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::GuideSet;
use simulation::profile::Drive;

use super::recordings::RecordingArguments;
use super::{Failure, output, say};
use profile::ProfileArguments;

/// What a simulation says: the force for a recording's motion, or the recording of a test profile
///
/// With a recording, its motion, load and temperature drive the simulation; OUT has time_s and
/// simulated_force_n, a row for every row of the recording, free of noise.
///
/// With --profile, OUT is a whole recording. The profiles, with their codes in a diagnosis:
///
///     staircase    strokes to and fro at rising speeds                  P1   --speeds --stroke --repeats --down
///     ladder       the staircase at several preloads                    P2   --loads, and those of staircase
///     map          the full stroke at 0.6 and 6 m/min                   P4   --speeds --length --repeats
///     reversal     sinusoids, every amplitude at every frequency        P5   --amplitudes --frequencies --repeats
///     modulation   speed swinging by 80 % about a mean                  P6   --speeds --frequencies --repeats
///     dwell        rest 1, 10, 100 s, each time start at 0.1 m/min      P7   --dwells --speeds --stroke --repeats
///     warm-up      to and fro, a pause, and on; three temperatures      P8   --duration --speeds --stroke
///
/// Sensors are perfect unless asked otherwise; the same --seed gives the same bytes.
///
///     guideblock simulate run.csv --simulation sim.toml --out simulated.csv
///     guideblock simulate --profile ladder --noise-relative 0.01 --noise 0.1 --out ladder.csv
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// Recording whose motion drives the simulation, CSV or Parquet; - is standard input
    #[arg(value_name = "RECORDING", required_unless_present = "profile", conflicts_with = "profile")]
    input: Option<PathBuf>,
    /// Simulation file; without it, the set zhou-2023 at 3000 N
    #[arg(long, value_name = "SIM.toml")]
    simulation: Option<PathBuf>,
    /// Where it is written, .csv or .parquet; without it, as CSV to standard output
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
    #[command(flatten)]
    profile: ProfileArguments,
    /// Sensors of a profile's recording; single options below go before theirs
    #[arg(long, value_enum, requires = "profile")]
    sensors: Option<Kit>,
    /// Noise of the force, 1 sigma, as part of the force
    #[arg(long, value_name = "PART", requires = "profile", value_parser = not_negative)]
    noise_relative: Option<f64>,
    /// Noise of the force, 1 sigma, N
    #[arg(long, value_name = "N", requires = "profile", value_parser = not_negative)]
    noise: Option<f64>,
    /// Step of the force, N
    #[arg(long, value_name = "N", requires = "profile", value_parser = not_negative)]
    quantum: Option<f64>,
    /// Corner of the force's low-pass, Hz
    #[arg(long, value_name = "HZ", requires = "profile", value_parser = not_negative)]
    lowpass: Option<f64>,
    /// Noise of the velocity, 1 sigma, m/s
    #[arg(long, value_name = "M/S", requires = "profile", value_parser = not_negative)]
    speed_noise: Option<f64>,
    /// Step of the position, m; the recording then has no velocity of its own
    #[arg(long, value_name = "M", requires = "profile", value_parser = not_negative)]
    position_quantum: Option<f64>,
    /// Seed of all noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print a summary as one JSON object to standard output; needs --out
    #[arg(long, requires = "out")]
    json: bool,
    /// Page with charts
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
}

/// Sensors that are known by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kit {
    /// no noise, no steps, no filter
    Perfect,
    /// those of the block on the project's bench: 12 bits over ±100 N, 100 Hz, 5 µm
    Block,
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|x: &f64| x.is_finite() && *x >= 0.0)
        .ok_or_else(|| "expected a number from 0 on".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from("-"));
    if Kind::of(&out).is_none() {
        return Err(Failure::file(&out, "name it .csv or .parquet, so that it is clear what to write"));
    }
    let (simulation, mappings) = simulation(arguments)?;
    match &arguments.input {
        Some(input) => follow(arguments, input, &simulation, &mappings, &out),
        None => make(arguments, &simulation, &out),
    }
}

/// The force for a recording's motion.
fn follow(
    arguments: &Arguments,
    input: &Path,
    simulation: &Simulation,
    mappings: &[Mapping],
    out: &Path,
) -> Result<(), Failure> {
    let (mut run, _) = arguments.recording.open(input, mappings)?;
    let force = simulate::force(simulation, &run).map_err(|why| Failure::Data(format!("{}: {why}", run.name)))?;
    let without = force.iter().filter(|f| !f.is_finite()).count();
    if without > 0 {
        say(format_args!(
            "{}: {without} of {} rows have no simulated force: preload or temperature was not measured there, or the \
             load is beyond the contact's geometry",
            run.name,
            run.len()
        ));
    }
    let columns = [Column::numbers("time_s", &run.time_s), Column::numbers("simulated_force_n", &force)];
    write(out, &columns)?;
    let mut facts = vec![format!("{}: {} rows with the simulated force.", run.name, run.len() - without)];
    let square: f64 =
        force.iter().zip(&run.drag_force_n).map(|(s, m)| (m - s) * (m - s)).filter(|x| x.is_finite()).sum();
    let rms = (square / (run.len() - without).max(1) as f64).sqrt();
    facts.push(format!("Measured less simulated, root of the mean square: {rms:.4} N."));
    report(arguments, &facts, json!({"rows": run.len(), "without_force": without, "rms_difference_n": rms}))?;
    if let Some(path) = &arguments.html {
        let title = format!("Simulated force for {}", run.name);
        run.drag_force_n = force;
        fs::write(path, simulate::page(&title, &run, &facts)).map_err(|error| Failure::file(path, error))?;
    }
    Ok(())
}

/// The recording of a profile.
fn make(arguments: &Arguments, simulation: &Simulation, out: &Path) -> Result<(), Failure> {
    let drive = Drive {
        rate_hz: arguments.profile.rate,
        acceleration_m_s2: arguments.profile.acceleration,
        ..Drive::default()
    };
    let profile = arguments.profile.profile().map_err(Failure::Usage)?;
    let mut run = profile.run(&drive).map_err(|why| Failure::Usage(why.to_string()))?;
    if needs_temperature(simulation) && run.temperature_block_degc.is_none() {
        run.temperature_block_degc = Some(vec![arguments.profile.temperature; run.len()]);
    }
    simulate::drive(simulation, &mut run).map_err(|why| Failure::Usage(why.to_string()))?;
    if let Some(row) = run.drag_force_n.iter().position(|f| !f.is_finite()) {
        let preload = run.preload_n.as_ref().map_or(f64::NAN, |p| p[row]);
        return Err(Failure::Usage(format!("the law has no force for a preload of {preload} N; give another one")));
    }
    sensors(arguments).record(&mut run, arguments.seed);
    let segments = simulate::segments(&run);
    write(out, &simulate::columns(&run, &segments))?;
    let name = arguments.profile.name();
    let duration = run.len() as f64 / drive.rate_hz;
    let facts = vec![format!(
        "{name}: {} rows, {duration:.1} s, {} segments, seed {}.",
        run.len(),
        run.parts.len(),
        arguments.seed
    )];
    let summary = json!({"profile": name, "rows": run.len(), "duration_s": duration, "segments": run.parts.len(), "seed": arguments.seed});
    report(arguments, &facts, summary)?;
    if let Some(path) = &arguments.html {
        let title = format!("Simulated recording: {name}");
        fs::write(path, simulate::page(&title, &run, &facts)).map_err(|error| Failure::file(path, error))?;
    }
    Ok(())
}

/// Says what was done: data when asked for, else talk.
fn report(arguments: &Arguments, facts: &[String], summary: serde_json::Value) -> Result<(), Failure> {
    if arguments.json {
        let mut out = output();
        writeln!(out, "{summary:#}")?;
        out.flush()?;
    } else {
        facts.iter().for_each(say);
    }
    Ok(())
}

fn sensors(arguments: &Arguments) -> Sensors {
    let kit = match arguments.sensors {
        Some(Kit::Block) => Sensors::block(),
        Some(Kit::Perfect) | None => Sensors::default(),
    };
    Sensors {
        noise_relative: arguments.noise_relative.unwrap_or(kit.noise_relative),
        noise_n: arguments.noise.unwrap_or(kit.noise_n),
        quantum_n: arguments.quantum.unwrap_or(kit.quantum_n),
        lowpass_hz: arguments.lowpass.unwrap_or(kit.lowpass_hz),
        speed_noise_m_s: arguments.speed_noise.unwrap_or(kit.speed_noise_m_s),
        position_quantum_m: arguments.position_quantum.unwrap_or(kit.position_quantum_m),
    }
}

/// The simulation of the command line, and its mappings.
fn simulation(arguments: &Arguments) -> Result<(Simulation, Vec<Mapping>), Failure> {
    let Some(path) = &arguments.simulation else {
        let law = Law::Guide(GuideSet::zhou_2023());
        let preload_n = arguments.profile.preload.or(Some(3000.0));
        return Ok((Simulation { preload_n, ..Simulation::of(law) }, Vec::new()));
    };
    let text = fs::read_to_string(path).map_err(|error| Failure::file(path, error))?;
    let mut simulation =
        Simulation::from_toml(&text).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?;
    simulation.preload_n = arguments.profile.preload.or(simulation.preload_n);
    let mut mappings = Vec::new();
    for (name, mapping) in &simulation.columns {
        mappings.push(Mapping::new(name, mapping).map_err(|why| Failure::file(path, why))?);
    }
    Ok((simulation, mappings))
}

/// Whether the oil's viscosity follows the temperature.
fn needs_temperature(simulation: &Simulation) -> bool {
    let Law::Guide(set) = &simulation.law else { return false };
    matches!(set.lubricant(), simulation::guide::Lubricant::Walther(_))
}
