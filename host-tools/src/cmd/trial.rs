//! `guideblock trial`

use std::collections::BTreeMap;
use std::env;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use host_tools::trial::TrialError;
use host_tools::trial::envelope::{self, Envelope, Order};
use host_tools::trial::page::{self, Exam};
use host_tools::trial::runner::{self, Plan, Run};
use host_tools::trial::score::goals::{self, Goal};
use host_tools::trial::score::tally::{self, Bin, Step as Strength, Summary};
use host_tools::trial::score::{self, Scored};
use host_tools::trial::{commitment, picture, real};
use indicatif::ProgressBar;
use serde::Serialize;

use super::{Failure, output, say};

/// Makes, runs and opens a trial with concealed effects
///
///     guideblock trial make --seed 2026 --out trial
///     guideblock trial run trial --binary guideblock
///     guideblock trial open trial
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(clap::Subcommand)]
enum Step {
    /// Draws what is hidden, writes recordings, seals the answers, prints the root
    ///
    /// Works inside a checkout of the repository alone: the generator is the Python package in its folder tests/concealed,
    /// which --plant names elsewhere.
    Make(Make),
    /// Seals a folder of records and answers that was filled by hand, prints the root
    Seal(SealArguments),
    /// Diagnoses every record in a process that cannot read the answers; records the program's hash
    Run(Once),
    /// Checks every commitment, scores, writes score.json and trial.html
    Open(Open),
    /// Diagnoses published recordings of real machines, writes real.json and real.html
    Real(Real),
}

#[derive(clap::Args)]
struct Make {
    /// Number of the trial
    #[arg(long)]
    seed: u64,
    /// New folder of the trial
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How many records
    #[arg(long, default_value_t = 960, conflicts_with = "scale")]
    records: u32,
    /// Share of the 960 records
    #[arg(long)]
    scale: Option<f64>,
    /// 12 runs of 30 s a record instead of 6 of 20 s
    #[arg(long)]
    full: bool,
    /// Processes of the generator
    #[arg(long, default_value_t = 2)]
    jobs: u32,
    /// Folder with the generator `plant`; searched upwards from here as tests/concealed
    #[arg(long, value_name = "DIR")]
    plant: Option<PathBuf>,
    /// Interpreter with numpy and scipy
    #[arg(long, value_name = "PYTHON")]
    python: Option<PathBuf>,
    /// Salts from a number: for tests only, anyone can then open the envelope
    #[arg(long, value_name = "N")]
    salt_seed: Option<u64>,
    /// Time of making, seconds since 1970; now unless told
    #[arg(long, value_name = "S", requires = "salt_seed")]
    made_at: Option<u64>,
}

#[derive(clap::Args)]
struct SealArguments {
    /// Folder with records/ID/ and answers/: ID.truth.json, trial.json
    dir: PathBuf,
}

#[derive(clap::Args)]
struct Once {
    /// Folder of the trial
    dir: PathBuf,
    /// Program; a single word gets `diagnose` appended, several are taken as they are
    #[arg(long, default_value = "guideblock", value_name = "COMMAND")]
    binary: String,
    /// Where results go; DIR/run unless told
    #[arg(long, value_name = "DIR")]
    into: Option<PathBuf>,
    /// Processes at a time
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Wall-clock limit of a record, s; beyond it the answer is wrong
    #[arg(long, default_value_t = 60.0, value_name = "S")]
    limit: f64,
    /// Run although the answers can be read; the result says so
    #[arg(long)]
    answers_open: bool,
}

#[derive(clap::Args)]
struct Open {
    /// Folder of the trial
    dir: PathBuf,
    /// Results; DIR/run unless told
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Results of other programs
    #[arg(long, value_name = "DIR", num_args = 1..)]
    rivals: Vec<PathBuf>,
    /// Where score.json and trial.html go; DIR unless told
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(clap::Args)]
struct Real {
    /// Program
    #[arg(long, default_value = "guideblock", value_name = "PROGRAM")]
    binary: String,
    /// Folder of the recordings; the one that GUIDEBLOCK_DATA names unless told
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Where real.json and real.html go
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl From<TrialError> for Failure {
    fn from(error: TrialError) -> Self {
        match error {
            TrialError::Broken(why) => {
                say(format_args!("guideblock: {why}"));
                Failure::Check
            }
            TrialError::Malformed { .. } => Failure::Data(error.to_string()),
            TrialError::File { .. } | TrialError::Missing { .. } | TrialError::Tool(_) => {
                Failure::Usage(error.to_string())
            }
        }
    }
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.step {
        Step::Make(make) => self::make(make),
        Step::Seal(seal) => {
            let sealed = envelope::seal(&seal.dir, now())?;
            writeln!(output(), "{}", sealed.root())?;
            say(format_args!("{} records sealed; publish the root before the run", sealed.records.len()));
            Ok(())
        }
        Step::Run(once) => diagnose(&once),
        Step::Open(open) => self::open(&open),
        Step::Real(real) => self::real(&real),
    }
}

fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |passed| passed.as_secs())
}

fn make(make: Make) -> Result<(), Failure> {
    let records = match make.scale {
        Some(scale) if scale > 0.0 && scale <= 10.0 => (960.0 * scale).round() as u32,
        Some(scale) => return Err(Failure::Usage(format!("--scale {scale}: a share above 0 and at most 10"))),
        None => make.records,
    };
    let plant = make.plant.map_or_else(find_plant, Ok)?;
    let order = Order {
        seed: make.seed,
        records,
        is_full: make.full,
        jobs: make.jobs.max(1),
        salt_seed: make.salt_seed,
        made_s: make.made_at.unwrap_or_else(now),
        python: make.python.map_or_else(|| find_python(&plant), Ok)?,
        plant,
    };
    let spinner = ProgressBar::new_spinner().with_message(format!("{records} records"));
    spinner.enable_steady_tick(Duration::from_millis(200));
    let made = envelope::make(&order, &make.out);
    spinner.finish_and_clear();
    let made = made?;
    writeln!(output(), "{}", made.root())?;
    say(format_args!(
        "{} records sealed in {}; publish the root before the run",
        made.records.len(),
        make.out.display()
    ));
    Ok(())
}

fn find_plant() -> Result<PathBuf, Failure> {
    let here = env::current_dir()?;
    here.ancestors()
        .map(|folder| folder.join("tests/concealed"))
        .find(|folder| folder.join("plant").is_dir())
        .ok_or_else(|| {
            Failure::Usage(
                "tests/concealed/plant: not found from here upwards; name its folder with --plant".to_owned(),
            )
        })
}

/// The interpreter of the repository's virtual environment if that has the packages needed, otherwise that of the path.
fn find_python(plant: &Path) -> Result<PathBuf, Failure> {
    let local = plant.ancestors().map(|folder| folder.join(".venv/bin/python")).find(|python| python.is_file());
    let works = |python: &PathBuf| {
        let asked = Command::new(python).args(["-c", "import numpy, scipy"]).output();
        asked.is_ok_and(|answer| answer.status.success())
    };
    local.into_iter().chain([PathBuf::from("python3")]).find(works).ok_or_else(|| {
        Failure::Usage(
            "no interpreter with numpy and scipy: pip install numpy scipy, or name one with --python".to_owned(),
        )
    })
}

fn diagnose(once: &Once) -> Result<(), Failure> {
    if !(once.limit > 0.0 && once.limit < 1e6) {
        return Err(Failure::Usage(format!("--limit {}: seconds above 0", once.limit)));
    }
    let plan = Plan {
        program: once.binary.split_whitespace().map(str::to_owned).collect(),
        into: once.into.clone().unwrap_or_else(|| once.dir.join("run")),
        jobs: once.jobs,
        limit: Duration::from_secs_f64(once.limit),
        allows_open_answers: once.answers_open,
        started_s: now(),
    };
    let total = Envelope::open(&once.dir)?.records.len();
    let bar = ProgressBar::new(total as u64);
    let ran = runner::run(&once.dir, &plan, &|done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let ran = ran?;
    let failed = ran.records.values().filter(|ending| !ending.status.starts_with("exit")).count();
    say(format_args!(
        "{total} records, {failed} crashed or ran out of time; answers hidden by: {}; {}",
        ran.isolation,
        plan.into.join("run.json").display()
    ));
    Ok(())
}

#[derive(Serialize)]
struct Report<'a> {
    schema: &'static str,
    root: String,
    run: &'a Run,
    summary: Summary,
    goals: Vec<Goal>,
    detection: Vec<Strength>,
    reliability: Vec<Bin>,
    records: &'a [Scored],
}

fn results_of(open: &Open) -> PathBuf {
    open.run.clone().unwrap_or_else(|| open.dir.join("run"))
}

/// Pictures of the answers that were not right.
fn pictures_of_wrong(dir: &Path, results: &Path, exam: &Exam) -> Result<BTreeMap<String, Vec<String>>, Failure> {
    let wrong: Vec<&Scored> = exam.records.iter().filter(|record| !record.outcome.is_right()).collect();
    let bar = ProgressBar::new(wrong.len() as u64).with_message("pictures");
    let mut pictures = BTreeMap::new();
    for record in wrong {
        let truth = score::truth_of(dir, &record.id)?;
        let axis = record.location.as_ref().map(|place| place.axis.as_str());
        pictures.insert(record.id.clone(), picture::pictures(dir, results, &record.id, &truth, axis));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(pictures)
}

fn open(open: &Open) -> Result<(), Failure> {
    let envelope = Envelope::open(&open.dir)?;
    let mut complaints = envelope.altered_records(&open.dir)?;
    complaints.extend(envelope.altered_answers(&open.dir)?);
    let mut exams = Vec::new();
    for results in std::iter::once(results_of(open)).chain(open.rivals.clone()) {
        let (run, wrong) = Run::open(&results, &envelope)?;
        complaints.extend(wrong);
        exams.push((results, run));
    }
    if !complaints.is_empty() {
        complaints.iter().for_each(say);
        say("the trial is void: nothing was scored");
        return Err(Failure::Check);
    }
    let mut scored = Vec::new();
    for (results, run) in exams {
        // reads every recording for the oracle of the hold-out
        let records = score::score(&open.dir, &results, &run)?;
        scored.push(Exam { run, records });
    }
    let pictures = pictures_of_wrong(&open.dir, &results_of(open), &scored[0])?;
    let reports: Vec<Report<'_>> = scored
        .iter()
        .map(|exam| Report {
            schema: "guideblock.score/1",
            root: envelope.root(),
            run: &exam.run,
            summary: tally::summary(&exam.records),
            goals: goals::goals(&exam.records),
            detection: tally::detection(&exam.records),
            reliability: tally::reliability(&exam.records),
            records: &exam.records,
        })
        .collect();
    let out = open.out.as_ref().unwrap_or(&open.dir);
    std::fs::create_dir_all(out).map_err(|why| Failure::file(out, why))?;
    let text = serde_json::to_string_pretty(&reports).map_err(Failure::data)?;
    let save = |name: &str, text: String| {
        let path = out.join(name);
        std::fs::write(&path, text).map_err(|why| Failure::file(&path, why))
    };
    save("score.json", text + "\n")?;
    save("trial.html", page::page(&envelope, &scored, &pictures))?;
    let mut out = output();
    for report in &reports {
        let sums = &report.summary;
        writeln!(
            out,
            "{}: {} right, {} false alarms, {} wrong names, {} misses, {} padded sets",
            report.run.program.join(" "),
            sums.right,
            sums.false_alarms,
            sums.wrong_names,
            sums.misses,
            sums.padded
        )?;
    }
    Ok(())
}

fn real(real: &Real) -> Result<(), Failure> {
    let data = real.data.clone().or_else(real::data_folder).ok_or_else(|| {
        Failure::Usage("name the folder of the recordings with --data, or in GUIDEBLOCK_DATA".to_owned())
    })?;
    let program = runner::find(&real.binary)?;
    let spinner = ProgressBar::new_spinner().with_message("real recordings");
    spinner.enable_steady_tick(Duration::from_millis(200));
    let answers = real::run(&program, &data, &real.out);
    spinner.finish_and_clear();
    let answers = answers?;
    if answers.is_empty() {
        say(format_args!(
            "skipped: none of the recordings is in {}; name their folder with --data, or in GUIDEBLOCK_DATA",
            data.display()
        ));
        return Ok(());
    }
    let hash = commitment::hash_file(Path::new(&program))?;
    let text = serde_json::to_string_pretty(&answers).map_err(Failure::data)?;
    for (name, text) in [("real.json", text + "\n"), ("real.html", real::page(&program, &hash, &answers))] {
        let path = real.out.join(name);
        std::fs::write(&path, text).map_err(|why| Failure::file(&path, why))?;
    }
    let mut out = output();
    for answer in &answers {
        let names = if answer.named.is_empty() { "nothing".to_owned() } else { answer.named.join(", ") };
        let is_right = if answer.is_right { "as stated" } else { "NOT as stated" };
        writeln!(out, "{}: {is_right}: {}, {names}", answer.name, answer.verdict)?;
    }
    Ok(())
}
