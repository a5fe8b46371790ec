//! `guideblock diagnose`

use std::io::Write;
use std::path::{Path, PathBuf};

use diagnosis::report::{Diagnosis, Verdict};
use diagnosis::{Options, Refused, diagnose};
use host_tools::diagnosed;
use host_tools::recording::{Losses, Mapping};
use host_tools::report::number::{short, significant, with_space};
use simulation::Simulation;
use simulation::file::Law;
use simulation::law::Missing;
use simulation::run::Run;

use super::outputs::{Files, put};
use super::recordings::RecordingArguments;
use super::simulation_file::SimulationFile;
use super::{Failure, output, seed};

/// Finds what a simulation leaves out
///
/// Holds recordings of one block against a simulation of it: moves what the simulation only assumes
/// within its tolerance, locates what is left, names the physics or the sensor fault behind it, and
/// scores the result on rows that the search has not seen.
///
/// Exit status 0: nothing is missing, or the motion of a sound recording allows no judgement (verdict
/// insufficient-data); 1: something is missing; 2: wrong usage, a file that is not there; 3: a
/// recording or simulation file of which nothing can be used.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Recordings, runs of one block; those of one session, whose clocks go on, are joined in the order of time
    #[arg(value_name = "RECORDING.csv", required = true)]
    files: Vec<PathBuf>,
    /// The simulation they are held against
    #[arg(long, value_name = "SIM.toml")]
    simulation: PathBuf,
    /// Recordings that are only scored, after the search
    #[arg(long, value_name = "OTHER.csv")]
    holdout: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArguments,
    /// Writes the diagnosis as JSON; - is standard output
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
    /// Writes a page with pictures of the mismatch before and after
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// Writes the simulation with what was found
    #[arg(long, value_name = "AUGMENTED.toml")]
    export: Option<PathBuf>,
    /// Seed of the bootstrap of the intervals
    #[arg(long, default_value_t = 0, value_parser = seed)]
    seed: u64,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let files = Files::default().reads("RECORDING", &arguments.files).reads("--simulation", [&arguments.simulation]);
    let files = files.reads("--holdout", &arguments.holdout).writes("--json", &arguments.json);
    files.writes("--html", &arguments.html).writes("--export", &arguments.export).check()?;
    let SimulationFile { simulation, mappings } = SimulationFile::open(&arguments.simulation)?;
    let options = Options { seed: arguments.seed };
    let open = |files: &[PathBuf]| read(files, &arguments.recording, &mappings);
    let opened = open(&arguments.files).and_then(|r| Ok((r, open(&arguments.holdout)?)));
    let (runs, losses, holdout) = match opened.and_then(|opened| has_force(opened, &simulation)) {
        Ok(((runs, losses), (holdout, _))) => (runs, losses, holdout),
        Err(Failure::Data(why)) => {
            // the report states the reason, too
            let mut nothing = diagnose(&[], &[], &simulation, &options).diagnosis;
            nothing.data_quality.warnings = vec![why.clone()];
            write_json(arguments.json.as_deref(), &nothing)?;
            return Err(Failure::Data(why));
        }
        Err(other) => return Err(other),
    };
    if let Some((seen, kept)) = host_tools::recording::twins(&runs, &holdout) {
        let what = "those rows teach the search and cannot score it; give a recording of its own, or leave --holdout out \
                    and a quarter of the rows is set aside";
        return Err(Failure::Usage(format!("--holdout {}: holds the rows of {}: {what}", kept.name, seen.name)));
    }
    if let Some((one, other)) = host_tools::recording::twins_within(&runs) {
        let what = "rows that count twice make everything look surer than it is; leave one of the two out";
        return Err(Failure::Usage(format!("{}: holds the rows of {}: {what}", other.name, one.name)));
    }
    let mut outcome = diagnose(&runs, &holdout, &simulation, &options);
    // what reading them cost has been said
    let unsaid = outcome.diagnosis.data_quality.warnings.clone();
    for losses in losses {
        count(&mut outcome.diagnosis, losses);
    }
    let diagnosis = &outcome.diagnosis;
    // files first, so that closing standard output early does not cost them
    let (is_stdout, json) = (arguments.json.as_deref() == Some(Path::new("-")), arguments.json.as_deref());
    write_json(json.filter(|_| !is_stdout), diagnosis)?;
    if let Some(path) = &arguments.html {
        let found = outcome.augmented.as_ref().map(|augmented| diagnosed::views(&runs, &simulation, augmented));
        let views = found.transpose().map_err(Failure::data)?.unwrap_or_default();
        let name = arguments.files.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy());
        let name = name.collect::<Vec<_>>().join(", ");
        put(path, diagnosed::page(&name, diagnosis, &views))?;
    }
    if let (Some(path), Some(augmented)) = (&arguments.export, &outcome.augmented) {
        put(path, augmented.to_toml())?;
    }
    let told = if is_stdout { write_json(json, diagnosis) } else { summary(diagnosis, &unsaid) };
    match told {
        // the exit status must still give the verdict
        Err(Failure::Output(error)) if error.kind() == std::io::ErrorKind::BrokenPipe => {}
        told => told?,
    }
    match (diagnosis.verdict, outcome.refused) {
        (_, Some(Refused::File(why))) => Err(Failure::Data(why)),
        (Verdict::Match | Verdict::InsufficientData, _) => Ok(()),
        (Verdict::Explained | Verdict::Unexplained | Verdict::Ambiguous, _) => Err(Failure::Check),
    }
}

/// Recordings with what reading them cost, and those that are only scored.
type Opened = ((Vec<Run>, Vec<Losses>), (Vec<Run>, Vec<Losses>));

/// Whether there is a force to hold the recordings against: a law, or the column of another program in each of them.
fn has_force(opened: Opened, simulation: &Simulation) -> Result<Opened, Failure> {
    let mut runs = opened.0.0.iter().chain(&opened.1.0);
    let without = match simulation.law {
        Law::Column { .. } => runs.find(|run| run.simulated_force_n.is_none()),
        Law::Guide(_) | Law::CoulombViscous { .. } => None,
    };
    without
        .map_or(Ok(()), |run| Err(Failure::Data(format!("{}: {}", run.name, Missing::SimulatedForce))))
        .map(|()| opened)
}

fn write_json(path: Option<&Path>, diagnosis: &Diagnosis) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    let json = serde_json::to_string_pretty(diagnosis).map_err(Failure::data)? + "\n";
    if path == Path::new("-") {
        return Ok(output().write_all(json.as_bytes())?);
    }
    put(path, json)
}

fn read(
    files: &[PathBuf],
    recording: &RecordingArguments,
    mappings: &[Mapping],
) -> Result<(Vec<Run>, Vec<Losses>), Failure> {
    let mut all: Vec<(Run, Losses)> = Vec::new();
    for path in files {
        all.push(recording.open(path, mappings)?);
    }
    // a shell sorts by name, so sort by time; where all clocks start anew, the order stays
    let first_s = |(run, _): &(Run, Losses)| run.time_s.first().copied().unwrap_or(0.0);
    all.sort_by(|a, b| first_s(a).total_cmp(&first_s(b)));
    Ok(all.into_iter().unzip())
}

/// Adds the losses from reading a file to the report.
fn count(diagnosis: &mut Diagnosis, losses: Losses) {
    let quality = &mut diagnosis.data_quality;
    for (reason, rows) in losses.rejected {
        *quality.rejected.entry(reason).or_insert(0) += rows as usize;
    }
    quality.samples += losses.lost as usize;
    let problems = losses.problems.iter().take(Losses::SPELT_OUT);
    quality.warnings.extend(problems.map(ToString::to_string));
}

fn summary(diagnosis: &Diagnosis, warnings: &[String]) -> Result<(), Failure> {
    let mut out = output();
    writeln!(out, "verdict          {}", diagnosis.verdict.name())?;
    let quality = &diagnosis.data_quality;
    writeln!(out, "rows             {} of {} compared", quality.used, quality.samples)?;
    for warning in warnings {
        writeln!(out, "                 {warning}")?;
    }
    if diagnosis.verdict == Verdict::InsufficientData {
        return Ok(out.flush()?);
    }
    let small = diagnosed::of_no_interest(diagnosis).map_or_else(String::new, |why| format!(" ({why})"));
    writeln!(out, "nothing missing  {}{small}", diagnosed::probability(diagnosis.p_no_mismatch))?;
    for mechanism in &diagnosis.mechanisms {
        writeln!(
            out,
            "{:5.1} %          {} ({}), confidence {:.2}",
            100.0 * mechanism.share_of_mismatch,
            mechanism.id,
            mechanism.kind,
            mechanism.confidence
        )?;
        writeln!(out, "                 {}", mechanism.statement)?;
        for p in &mechanism.parameters {
            let [low, high] = p.ci95;
            let [low, high] = [significant(low, 4), significant(high, 4)];
            let (value, unit) = (significant(p.value, 5), with_space(&p.unit));
            writeln!(out, "                 {} = {value}{unit} ({low} to {high})", p.name)?;
        }
        writeln!(out, "                 on held-back rows: {}", diagnosed::carried_over(mechanism))?;
        if !mechanism.equivalents.is_empty() {
            writeln!(
                out,
                "                 this recording cannot distinguish it from {}",
                mechanism.equivalents.join(", ")
            )?;
        }
    }
    let left = &diagnosis.unexplained;
    if !diagnosis.mechanisms.is_empty() && left.share_of_mismatch > 0.0 {
        writeln!(out, "{:5.1} %          left over: {}", 100.0 * left.share_of_mismatch, left.signature)?;
    }
    for region in &diagnosis.regions {
        let [from, to, unit] = [short(region.from, 4), short(region.to, 4), with_space(region.unit)];
        writeln!(out, "where            {} {from} to {to}{unit}: {}", region.axis, region.id)?;
    }
    let holdout = &diagnosis.holdout;
    writeln!(out, "set aside        {}", holdout.description)?;
    if holdout.is_scored() {
        writeln!(
            out,
            "error there      {} N as given, {} N calibrated, {} N with what was found; noise {} N",
            significant(holdout.rmse_before_n, 4),
            significant(holdout.rmse_calibrated_n, 4),
            significant(holdout.rmse_after_n, 4),
            significant(diagnosis.noise_floor_n, 4)
        )?;
    }
    if let Some(next) = &diagnosis.next_experiment {
        writeln!(out, "next             {}: {}", next.code, next.text)?;
        if let Some(promise) = next.promise() {
            writeln!(out, "                 {promise}")?;
        }
        for other in &next.alternatives {
            writeln!(out, "or               {}: {}", other.code, other.text)?;
            writeln!(out, "                 {}", other.promise())?;
        }
    }
    Ok(out.flush()?)
}
