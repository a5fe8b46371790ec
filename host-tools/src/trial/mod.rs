//! The concealed trial: proof that anyone can repeat and nobody can rig.
//!
//! ```text
//! make   an independent generator draws what is hidden; answers are sealed, the root is written  -> envelope
//! run    a program of known hash diagnoses every record where it cannot read the answers         -> runner
//! open   every commitment is checked, then every answer is scored       -> score -> page, picture
//! ```

pub mod commitment;
pub mod envelope;
pub mod matrix;
pub mod page;
pub mod picture;
pub mod real;
pub mod runner;
pub mod score;

use std::path::{Path, PathBuf};
use std::{fs, io};

use thiserror::Error;

/// Why a trial stops. The text names the file and what to do.
#[derive(Debug, Error)]
pub enum TrialError {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A part of a trial is not there.
    #[error("{}: not found; {expected}", path.display())]
    Missing {
        /// Which.
        path: PathBuf,
        /// What was expected, where it comes from and what to do.
        expected: &'static str,
    },
    /// A file is there but is not what it should be.
    #[error("{}: {why}", path.display())]
    Malformed {
        /// Which.
        path: PathBuf,
        /// What was expected.
        why: String,
    },
    /// A commitment does not hold. The trial is void.
    #[error("{0}")]
    Broken(String),
    /// The generator, or what keeps the answers out of sight, does not work here.
    #[error("{0}")]
    Tool(String),
}

fn at(path: &Path) -> impl Fn(io::Error) -> TrialError + '_ {
    |source| TrialError::File { path: path.to_owned(), source }
}

/// Adds what was expected to the error of a missing file or folder; any other error stays as it is.
fn expected(expected: &'static str) -> impl Fn(TrialError) -> TrialError {
    move |error| match error {
        TrialError::File { path, source } if source.kind() == io::ErrorKind::NotFound => {
            TrialError::Missing { path, expected }
        }
        other => other,
    }
}

fn malformed(path: &Path, why: impl ToString) -> TrialError {
    TrialError::Malformed { path: path.to_owned(), why: why.to_string() }
}

fn read(path: &Path) -> Result<Vec<u8>, TrialError> {
    fs::read(path).map_err(at(path))
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), TrialError> {
    fs::write(path, bytes).map_err(at(path))
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Result<Vec<String>, TrialError> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(at(folder))? {
        names.push(entry.map_err(at(folder))?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

fn json(path: &Path) -> Result<serde_json::Value, TrialError> {
    serde_json::from_slice(&read(path)?).map_err(|why| malformed(path, why))
}
