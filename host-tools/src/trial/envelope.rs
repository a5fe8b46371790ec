//! The envelope: records in the open, answers sealed, the root printed before anybody looks.
//!
//! ```text
//! DIR/records/ID/...     recordings, simulation.toml: what the diagnosis gets
//! DIR/answers/ID.*       truth.json (sorted keys), noise-free forces, ID.salt: hidden until the opening
//! DIR/answers/trial.json seed, block of every record
//! DIR/envelope.json      commitments and hashes; DIR/root.txt their Merkle root
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::commitment::{self, Salt};
use super::score::truth_of;
use super::{TrialError, at, expected, json, malformed, names, read, write};

/// What is drawn and how it is sealed.
#[derive(Clone, Debug)]
pub struct Order {
    /// Number of the trial; decides everything but the salts.
    pub seed: u64,
    /// How many records; 960 is the whole composition, fewer shrink every block.
    pub records: u32,
    /// 12 runs of 30 s a record instead of 6 of 20 s.
    pub is_full: bool,
    /// Processes of the generator.
    pub jobs: u32,
    /// Salts from a number instead of the random source: for tests, it makes the sealing worthless.
    pub salt_seed: Option<u64>,
    /// Time of making, seconds since 1970.
    pub made_s: u64,
    /// Folder that holds the Python package `plant`.
    pub plant: PathBuf,
    /// Interpreter with numpy and scipy.
    pub python: PathBuf,
}

/// What is published before any diagnosis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Envelope {
    /// `guideblock.envelope/1`.
    pub schema: String,
    /// Time of making, seconds since 1970.
    pub made_s: u64,
    /// Hash of the generator's sources.
    pub generator: String,
    /// Commitment of the list of blocks and the seed.
    pub trial: String,
    /// Every record.
    pub records: BTreeMap<String, Sealed>,
}

/// One record of the envelope: hexadecimal BLAKE3 everywhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sealed {
    /// Commitments of the answer's files.
    pub answers: BTreeMap<String, String>,
    /// Hashes of the record's files.
    pub files: BTreeMap<String, String>,
}

const SCHEMA: &str = "guideblock.envelope/1";
/// What to do where a part of a trial is not found.
const NO_ENVELOPE: &str = "a trial's folder holds envelope.json and root.txt beside records/: name the folder that \
    `guideblock trial make --out` made, or seal one that was filled by hand with `guideblock trial seal`";
const NO_ROOT: &str = "the root that was printed when the trial was sealed; write that line into the file, without it the \
    envelope proves nothing";
const NO_RECORDS: &str = "expected one folder a record, records/ID/, with recording.csv and simulation.toml";
const NO_ANSWER: &str = "answers and their salts are needed to open a trial; bring the folder `answers` back to where it \
    was sealed";
const NO_LIST: &str = "expected {\"seed\": N, \"blocks\": {\"ID\": \"BLOCK\", ...}}, the list of all records, beside one \
    ID.truth.json a record";

/// Salt and answer of what concerns the whole trial.
const TRIAL: &str = "trial";

impl Envelope {
    /// Merkle root: the head first, then the records in the order of their names.
    pub fn root(&self) -> String {
        let mut leaves = vec![format!("{} {} {} {}", self.schema, self.made_s, self.generator, self.trial)];
        leaves.extend(self.records.iter().map(|(id, record)| {
            let part = |map: &BTreeMap<String, String>| -> String {
                map.iter().map(|(name, hash)| format!(" {name}={hash}")).collect()
            };
            format!("{id} answers{} files{}", part(&record.answers), part(&record.files))
        }));
        commitment::root(&leaves)
    }

    /// Reads the envelope and holds it against the root that was printed.
    ///
    /// # Errors
    /// [`TrialError::Missing`], [`TrialError::File`], [`TrialError::Malformed`], and [`TrialError::Broken`] where the root
    /// differs.
    pub fn open(folder: &Path) -> Result<Self, TrialError> {
        let path = folder.join("envelope.json");
        let envelope: Envelope = serde_json::from_slice(&read(&path).map_err(expected(NO_ENVELOPE))?)
            .map_err(|why| malformed(&path, why))?;
        let printed = read(&folder.join("root.txt")).map_err(expected(NO_ROOT))?;
        let printed = String::from_utf8_lossy(&printed).trim().to_owned();
        if envelope.root() != printed {
            return Err(TrialError::Broken(format!(
                "{}: altered after the root was printed: it gives {}, root.txt says {printed}",
                path.display(),
                envelope.root()
            )));
        }
        Ok(envelope)
    }

    /// Every file of every record against its hash; the sentences say what differs, none where all is well.
    ///
    /// # Errors
    /// [`TrialError::Missing`] without records, [`TrialError::File`] where a folder cannot be read.
    pub fn altered_records(&self, folder: &Path) -> Result<Vec<String>, TrialError> {
        let mut complaints = Vec::new();
        let there = names(&folder.join("records")).map_err(expected(NO_RECORDS))?;
        complaints.extend(
            there
                .iter()
                .filter(|id| !self.records.contains_key(*id))
                .map(|id| format!("records/{id}: not in the envelope: added after the root was printed")),
        );
        for (id, sealed) in &self.records {
            let record = folder.join("records").join(id);
            let files = if record.is_dir() { names(&record)? } else { Vec::new() };
            for name in files.iter().filter(|name| !sealed.files.contains_key(*name)) {
                complaints.push(format!("records/{id}/{name}: added after the root was printed"));
            }
            for (name, hash) in &sealed.files {
                if !files.contains(name) {
                    complaints.push(format!("records/{id}/{name}: missing"));
                } else if commitment::hash_file(&record.join(name))? != *hash {
                    complaints.push(format!("records/{id}/{name}: recording altered after the root was printed"));
                }
            }
        }
        Ok(complaints)
    }

    /// Every answer against its commitment.
    ///
    /// # Errors
    /// [`TrialError::Missing`] where an answer or its salt is, [`TrialError::File`].
    pub fn altered_answers(&self, folder: &Path) -> Result<Vec<String>, TrialError> {
        let answers = folder.join("answers");
        let mut complaints = Vec::new();
        let mut check = |salt: &Salt, name: &str, sealed: &str| -> Result<(), TrialError> {
            if commitment::commit(salt, &read(&answers.join(name)).map_err(expected(NO_ANSWER))?) != sealed {
                complaints.push(format!("answers/{name}: altered after it was sealed"));
            }
            Ok(())
        };
        check(&salt_in(&answers, TRIAL)?, "trial.json", &self.trial)?;
        for (id, sealed) in &self.records {
            let salt = salt_in(&answers, id)?;
            for (name, commitment) in &sealed.answers {
                check(&salt, name, commitment)?;
            }
        }
        Ok(complaints)
    }
}

fn salt_in(answers: &Path, id: &str) -> Result<Salt, TrialError> {
    let path = answers.join(format!("{id}.salt"));
    let text = String::from_utf8_lossy(&read(&path).map_err(expected(NO_ANSWER))?).trim().to_owned();
    commitment::salt_of(&text).ok_or_else(|| malformed(&path, "64 hexadecimal digits were expected"))
}

/// Draws, writes, seals. Returns the envelope; its root stands in `root.txt`.
///
/// # Errors
/// [`TrialError::Tool`] where the generator fails or `folder` holds a trial already, [`TrialError::File`].
pub fn make(order: &Order, folder: &Path) -> Result<Envelope, TrialError> {
    if folder.join("root.txt").exists() || folder.join("records").exists() {
        return Err(TrialError::Tool(format!(
            "{} holds a trial already; a trial is made once, name another folder",
            folder.display()
        )));
    }
    fs::create_dir_all(folder).map_err(at(folder))?;
    let folder = &folder.canonicalize().map_err(at(folder))?;
    let answers = folder.join("answers");
    fs::create_dir_all(&answers).map_err(at(&answers))?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        fs::set_permissions(&answers, fs::Permissions::from_mode(0o700)).map_err(at(&answers))?;
    }
    let blocks = generate(order, folder, &answers)?;
    let trial = serde_json::json!({"seed": order.seed, "blocks": blocks, "is_full": order.is_full});
    write(&answers.join("trial.json"), format!("{trial}\n"))?;
    sealed(folder, order.made_s, order.salt_seed, hash_of_sources(&order.plant.join("plant"))?)
}

/// Seals a folder that was filled by hand, as on a rig: `records/ID/`, `answers/ID.truth.json`, `answers/trial.json`.
///
/// # Errors
/// [`TrialError::Missing`] without records, list or an answer, [`TrialError::Malformed`] where the opening could not read
/// one of them, [`TrialError::Tool`] where it is sealed already, [`TrialError::File`].
pub fn seal(folder: &Path, made_s: u64) -> Result<Envelope, TrialError> {
    if folder.join("root.txt").exists() {
        return Err(TrialError::Tool(format!("{} is sealed already", folder.display())));
    }
    // all of it before the first salt is written: what is refused stays as it was
    let (records, answers) = (folder.join("records"), folder.join("answers"));
    let missing = |path: &Path, expected| TrialError::Missing { path: path.to_owned(), expected };
    let ids = names(&records).map_err(expected(NO_RECORDS))?;
    if ids.is_empty() {
        return Err(missing(&records.join("ID"), NO_RECORDS));
    }
    for id in &ids {
        let answer = answers.join(format!("{id}.truth.json"));
        if !answer.is_file() {
            return Err(missing(&answer, "every record needs its answer"));
        }
        // a slip that only the opening finds can no longer be mended
        truth_of(folder, id)?;
    }
    let list = answers.join("trial.json");
    if !list.is_file() {
        return Err(missing(&list, NO_LIST));
    }
    let blocks = json(&list)?;
    if let Some(id) = ids.iter().find(|id| !blocks["blocks"][id.as_str()].is_string()) {
        return Err(malformed(&list, format!("no block of record {id}; {NO_LIST}")));
    }
    sealed(folder, made_s, None, "by hand".to_owned())
}

fn sealed(folder: &Path, made_s: u64, salt_seed: Option<u64>, generator: String) -> Result<Envelope, TrialError> {
    let answers = folder.join("answers");
    let mut envelope =
        Envelope { schema: SCHEMA.to_owned(), made_s, generator, trial: String::new(), records: BTreeMap::new() };
    let seal = |id: &str| -> Result<Salt, TrialError> {
        let salt = commitment::salt(salt_seed, id)?;
        write(&answers.join(format!("{id}.salt")), format!("{}\n", commitment::hex(&salt)))?;
        Ok(salt)
    };
    envelope.trial = commitment::commit(&seal(TRIAL)?, &read(&answers.join("trial.json"))?);
    let sealed_names = names(&answers)?;
    for id in names(&folder.join("records"))? {
        let salt = seal(&id)?;
        let mut sealed = Sealed { answers: BTreeMap::new(), files: BTreeMap::new() };
        for name in sealed_names.iter().filter(|name| name.starts_with(&format!("{id}."))) {
            sealed.answers.insert(name.clone(), commitment::commit(&salt, &read(&answers.join(name))?));
        }
        let record = folder.join("records").join(&id);
        for name in names(&record)? {
            let hash = commitment::hash_file(&record.join(&name))?;
            sealed.files.insert(name, hash);
        }
        envelope.records.insert(id, sealed);
    }
    let text = serde_json::to_string_pretty(&envelope).map_err(|why| malformed(folder, why))?;
    write(&folder.join("envelope.json"), text + "\n")?;
    write(&folder.join("root.txt"), envelope.root() + "\n")?;
    Ok(envelope)
}

fn generate(order: &Order, folder: &Path, answers: &Path) -> Result<BTreeMap<String, String>, TrialError> {
    let mut command = Command::new(&order.python);
    command.current_dir(&order.plant).args(["-m", "plant", "trial"]);
    command.args(["--seed", &order.seed.to_string(), "--records", &order.records.to_string()]);
    command.args(["--jobs", &order.jobs.to_string()]).arg("--out").arg(folder.join("records"));
    command.arg("--answers").arg(answers);
    if order.is_full {
        command.arg("--full");
    }
    // two processes already share the cores; more threads inside would change nothing but the time
    command.env("OPENBLAS_NUM_THREADS", "1").env("PYTHONDONTWRITEBYTECODE", "1");
    let name = order.python.display();
    let output = command
        .output()
        .map_err(|why| TrialError::Tool(format!("{name}: {why}; an interpreter with numpy and scipy is needed")))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or_default();
        return Err(TrialError::Tool(format!(
            "the generator in {} failed under {name}: {last}",
            order.plant.display()
        )));
    }
    serde_json::from_slice(&output.stdout).map_err(|why| TrialError::Tool(format!("the generator's list: {why}")))
}

fn hash_of_sources(plant: &Path) -> Result<String, TrialError> {
    let mut text = String::new();
    for name in names(plant)?.iter().filter(|name| name.ends_with(".py")) {
        text += &format!("{name} {}\n", commitment::hash_file(&plant.join(name))?);
    }
    Ok(commitment::hash(text.as_bytes()))
}
