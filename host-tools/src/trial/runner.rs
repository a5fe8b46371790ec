//! The run: one process per record, each in its own folder, where the answers cannot be read.
//!
//! The process lives in a mount namespace in which an empty file system covers the answers and the other records
//! (`unshare`, no privileges needed); before the first record a probe tries to read an answer from inside and the run
//! is refused where it succeeds. Every outcome counts: a crash and a time-out are wrong answers.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::envelope::Envelope;
use super::{TrialError, at, commitment, expected, malformed, read, write};

/// How a trial is run.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Program and its first arguments; a single word gets `diagnose` appended.
    pub program: Vec<String>,
    /// Where results are written; the trial's folder and `run` unless told.
    pub into: PathBuf,
    /// Processes at a time, at least 1.
    pub jobs: usize,
    /// Wall-clock limit of a record.
    pub limit: Duration,
    /// Run although answers can be read: for a rehearsal, it is written into the result.
    pub allows_open_answers: bool,
    /// Time of the start, seconds since 1970.
    pub started_s: u64,
}

/// What was run, and how every record ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// `guideblock.run/1`.
    pub schema: String,
    /// Root of the envelope that was diagnosed.
    pub root: String,
    /// Program and arguments as given.
    pub program: Vec<String>,
    /// Files of the command line, without their folders, and their hashes.
    pub hashes: BTreeMap<String, String>,
    /// What `PROGRAM --version` says; empty where it says nothing.
    pub version: String,
    /// `namespace`, `answers elsewhere` or `none`.
    pub isolation: String,
    /// Seconds since 1970.
    pub started_s: u64,
    /// Limit of a record, s.
    pub limit_s: f64,
    /// How every record ended.
    pub records: BTreeMap<String, Ending>,
}

/// How the diagnosis of one record ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ending {
    /// `exit N`, `crash` or `time-out`.
    pub status: String,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// Hash of the diagnosis; empty where none was written.
    pub diagnosis: String,
    /// Hash of the simulation with what was found; empty where none was asked for or written.
    #[serde(default)]
    pub augmented: String,
}

/// What to do where no run is found.
const NO_RUN: &str =
    "the trial was not run, or elsewhere: `guideblock trial run DIR` first, or name its results with --run";

impl Run {
    /// Reads what a run left and checks it: of this envelope, not older than it, no diagnosis altered since.
    /// The sentences say what is wrong.
    ///
    /// # Errors
    /// [`TrialError::Missing`] without a run, [`TrialError::File`], [`TrialError::Malformed`].
    pub fn open(folder: &Path, envelope: &Envelope) -> Result<(Self, Vec<String>), TrialError> {
        let path = folder.join("run.json");
        let run: Run =
            serde_json::from_slice(&read(&path).map_err(expected(NO_RUN))?).map_err(|why| malformed(&path, why))?;
        let mut complaints = Vec::new();
        if run.started_s < envelope.made_s {
            complaints.push(format!(
                "{}: diagnosis older than the envelope: run at {} s, sealed at {} s",
                path.display(),
                run.started_s,
                envelope.made_s
            ));
        }
        if run.root != envelope.root() {
            complaints.push(format!("{}: of another envelope: its root is {}", path.display(), run.root));
        }
        for id in envelope.records.keys().filter(|id| !run.records.contains_key(*id)) {
            complaints.push(format!("{}: record {id} was not run", path.display()));
        }
        for (id, ending) in &run.records {
            for (name, hash, what) in [
                (format!("{id}.json"), &ending.diagnosis, "diagnosis"),
                (format!("{id}.toml"), &ending.augmented, "augmented simulation"),
            ] {
                let file = folder.join(name);
                if hash.is_empty() {
                    continue;
                } else if !file.is_file() {
                    complaints.push(format!("{}: missing", file.display()));
                } else if commitment::hash_file(&file)? != *hash {
                    complaints.push(format!("{}: {what} altered after the run", file.display()));
                }
            }
        }
        Ok((run, complaints))
    }
}

/// Diagnoses every record of the trial in `folder`; `progress` gets the number done.
///
/// # Errors
/// [`TrialError::Broken`] where a record was altered; [`TrialError::Tool`] where the program cannot be started, the
/// answers can be read, or there are results already: a trial is run once.
pub fn run(folder: &Path, plan: &Plan, progress: &(dyn Fn(usize) + Sync)) -> Result<Run, TrialError> {
    let folder = &folder.canonicalize().map_err(at(folder))?;
    let envelope = Envelope::open(folder)?;
    let altered = envelope.altered_records(folder)?;
    if !altered.is_empty() {
        return Err(TrialError::Broken(altered.join("\n")));
    }
    if plan.into.join("run.json").exists() {
        return Err(TrialError::Tool(format!(
            "{} holds a run already; nothing is run again after looking: make a trial with another seed",
            plan.into.display()
        )));
    }
    fs::create_dir_all(&plan.into).map_err(at(&plan.into))?;
    let into = &plan.into.canonicalize().map_err(at(&plan.into))?;
    let program = resolve(&plan.program)?;
    // a single word is a program of this kind and can write what it found as a simulation
    let is_own = plan.program.len() == 1;
    let isolation = isolation(folder, plan.allows_open_answers)?;
    let mut hashes = BTreeMap::new();
    for file in program.iter().filter(|word| Path::new(word).is_file()) {
        // the folders of this machine are not published
        let name = file.rsplit('/').next().unwrap_or(file).to_owned();
        hashes.insert(name, commitment::hash_file(Path::new(file))?);
    }
    let version = Command::new(&program[0]).arg("--version").stdin(Stdio::null()).output();
    let version = version.map(|said| String::from_utf8_lossy(&said.stdout).trim().to_owned()).unwrap_or_default();

    let ids: Vec<&String> = envelope.records.keys().collect();
    let (next, done, endings) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let failure = Mutex::new(None);
    thread::scope(|scope| {
        for _ in 0..plan.jobs.max(1) {
            scope.spawn(|| {
                while let Some(id) = ids.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut files: Vec<&String> = envelope.records[*id].files.keys().collect();
                    // recording.csv before recording-2.csv: the order of time
                    files.sort_by_key(|name| (name.len(), *name));
                    match one(folder, into, id, &files, &program, (isolation, plan.limit, is_own)) {
                        Ok(ending) => {
                            if let Ok(mut endings) = endings.lock() {
                                endings.insert((*id).clone(), ending);
                            }
                            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                        }
                        Err(why) => {
                            if let Ok(mut failure) = failure.lock() {
                                failure.get_or_insert(why);
                            }
                            return;
                        }
                    }
                }
            });
        }
    });
    if let Ok(Some(why)) = failure.into_inner() {
        return Err(why);
    }
    let run = Run {
        schema: "guideblock.run/1".to_owned(),
        root: envelope.root(),
        program: plan.program.clone(),
        hashes,
        version,
        isolation: isolation.name().to_owned(),
        started_s: plan.started_s,
        limit_s: plan.limit.as_secs_f64(),
        records: endings.into_inner().unwrap_or_default(),
    };
    let text = serde_json::to_string_pretty(&run).map_err(|why| malformed(into, why))?;
    write(&into.join("run.json"), text + "\n")?;
    Ok(run)
}

/// A program, by its path or from the search path, as an absolute name.
///
/// # Errors
/// [`TrialError::Tool`] where there is none.
pub fn find(program: &str) -> Result<String, TrialError> {
    if let Some(found) = absolute(Path::new(program))? {
        return Ok(found);
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let searched = std::env::split_paths(&path).map(|folder| folder.join(program)).find(|file| file.is_file());
    match searched.filter(|_| !program.contains('/')) {
        Some(file) => Ok(file.display().to_string()),
        None => Err(TrialError::Tool(format!("{program}: no such program"))),
    }
}

/// The absolute name of a file; `None` where it is none. Not canonical: an interpreter of a virtual environment is
/// known by the name of its link.
fn absolute(file: &Path) -> Result<Option<String>, TrialError> {
    if !file.is_file() {
        return Ok(None);
    }
    Ok(Some(std::path::absolute(file).map_err(at(file))?.display().to_string()))
}

/// Program of the search path and files of the command as absolute names: every process has its own folder.
fn resolve(command: &[String]) -> Result<Vec<String>, TrialError> {
    let mut words = Vec::new();
    for (n, word) in command.iter().enumerate() {
        words.push(if n == 0 { find(word)? } else { absolute(Path::new(word))?.unwrap_or_else(|| word.clone()) });
    }
    match words.len() {
        0 => Err(TrialError::Tool("no program given".to_owned())),
        1 => Ok(vec![words.remove(0), "diagnose".to_owned()]),
        _ => Ok(words),
    }
}

/// How answers are kept from the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Isolation {
    Namespace,
    Elsewhere,
    None,
}

impl Isolation {
    fn name(self) -> &'static str {
        match self {
            Isolation::Namespace => "namespace",
            Isolation::Elsewhere => "answers elsewhere",
            Isolation::None => "none",
        }
    }

    /// A command that runs in `work` and sees neither answers nor records.
    fn command(self, folder: &Path, work: &Path) -> Command {
        if self != Isolation::Namespace {
            let mut command = Command::new("env");
            command.current_dir(work);
            return command;
        }
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "--", "sh", "-c"]);
        command.arg("mount -t tmpfs none \"$1\" && mount -t tmpfs none \"$2\" && shift 2 && exec unshare --user --map-root-user --mount -- \"$@\"").arg("sh");
        command.arg(folder.join("answers")).arg(folder.join("records")).current_dir(work);
        command
    }
}

/// The best way that works here, proven by trying to read an answer.
fn isolation(folder: &Path, allows_open: bool) -> Result<Isolation, TrialError> {
    if !folder.join("answers").exists() {
        return Ok(Isolation::Elsewhere);
    }
    let read_from = |isolation: Isolation, file: &Path| {
        let mut probe = isolation.command(folder, folder);
        probe.arg("cat").arg(file).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        probe.status().is_ok_and(|status| status.success())
    };
    let (secret, public) = (folder.join("answers/trial.json"), folder.join("root.txt"));
    // inside, the public file must be readable: otherwise nothing is proven
    if read_from(Isolation::Namespace, &public) && !read_from(Isolation::Namespace, &secret) {
        return Ok(Isolation::Namespace);
    }
    if allows_open {
        return Ok(Isolation::None);
    }
    Err(TrialError::Tool(
        "the answers can be read by the program and this system allows no namespace to hide them; move the folder \
         `answers` to where this user cannot read it until the opening, or rehearse with --answers-open"
            .to_owned(),
    ))
}

fn one(
    folder: &Path,
    into: &Path,
    id: &str,
    files: &[&String],
    program: &[String],
    (isolation, limit, is_own): (Isolation, Duration, bool),
) -> Result<Ending, TrialError> {
    let work = into.join("work").join(id);
    fs::create_dir_all(&work).map_err(at(&work))?;
    for name in files {
        let from = folder.join("records").join(id).join(name);
        fs::copy(&from, work.join(name)).map_err(at(&from))?;
    }
    let mut command = isolation.command(folder, &work);
    command.args(program);
    command.args(files.iter().filter(|name| name.starts_with("recording") && name.ends_with(".csv")));
    command.args(["--simulation", "simulation.toml", "--json", "diagnosis.json"]);
    if files.iter().any(|name| *name == "holdout.csv") {
        command.args(["--holdout", "holdout.csv"]);
    }
    if is_own {
        command.args(["--export", "augmented.toml"]);
    }
    let said = work.join("stderr.txt");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(File::create(&said).map_err(at(&said))?);
    let started = Instant::now();
    let mut child = command.spawn().map_err(|why| TrialError::Tool(format!("{}: {why}", program[0])))?;
    let status = loop {
        match child.try_wait().map_err(at(&work))? {
            Some(status) => break status.code().map_or_else(|| "crash".to_owned(), |code| format!("exit {code}")),
            None if started.elapsed() > limit => {
                // it may have ended just now; then there is nothing to kill
                let _ = child.kill();
                child.wait().map_err(at(&work))?;
                break "time-out".to_owned();
            }
            None => thread::sleep(Duration::from_millis(5)),
        }
    };
    let status = if matches!(status.as_str(), "exit 0" | "exit 1" | "exit 2" | "exit 3" | "time-out") {
        status
    } else {
        "crash".to_owned()
    };
    let seconds = started.elapsed().as_secs_f64();
    let keep = |written: &str, name: String| -> Result<String, TrialError> {
        let file = work.join(written);
        if !file.is_file() {
            return Ok(String::new());
        }
        let bytes = read(&file)?;
        let hash = commitment::hash(&bytes);
        write(&into.join(name), bytes)?;
        Ok(hash)
    };
    let diagnosis = keep("diagnosis.json", format!("{id}.json"))?;
    let augmented = keep("augmented.toml", format!("{id}.toml"))?;
    fs::rename(&said, into.join(format!("{id}.stderr.txt"))).map_err(at(&said))?;
    fs::remove_dir_all(&work).map_err(at(&work))?;
    Ok(Ending { status, seconds, diagnosis, augmented })
}
