//! Options that select columns and rows of a recording, and reading with a progress bar.

use std::path::Path;

use host_tools::recording::{self, Losses, Mapping, Progress, Selection, Unusable};
use simulation::run::Run;

use super::progress::Bar;
use super::{Failure, say};

/// Which columns and rows of a recording are read.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct RecordingArguments {
    /// Make a column from another one: value = cell * SCALE + OFFSET, as drag_force_n=gtau:35.15; may be repeated
    #[arg(long = "column", value_name = "NAME=COLUMN[:SCALE[:OFFSET]]")]
    pub(crate) mappings: Vec<Mapping>,
    /// Read only the rows whose cell in a column has this value, as drive=1; may be repeated
    #[arg(long = "where", value_name = "COLUMN=VALUE")]
    pub(crate) selections: Vec<Selection>,
}

impl RecordingArguments {
    /// Whether all columns and rows are read as they are.
    pub(crate) fn is_empty(&self) -> bool {
        self.mappings.is_empty() && self.selections.is_empty()
    }

    /// Reads a run and prints what was lost. `more` are mappings of a simulation file; the command line overrides them.
    pub(crate) fn open(&self, path: &Path, more: &[Mapping]) -> Result<(Run, Losses), Failure> {
        let mappings = self.with(more);
        let (run, losses) =
            with_progress(path, |progress| recording::open(path, &mappings, &self.selections, progress))?;
        for line in losses.describe(&run.name) {
            say(line);
        }
        Ok((run, losses))
    }

    /// The mappings of the command line, and those of a file for columns that it does not map.
    pub(crate) fn with(&self, more: &[Mapping]) -> Vec<Mapping> {
        let is_new = |mapping: &&Mapping| self.mappings.iter().all(|own| own.name != mapping.name);
        self.mappings.iter().chain(more.iter().filter(is_new)).cloned().collect()
    }
}

/// Reads something under a bar.
pub(crate) fn with_progress<T>(path: &Path, read: impl FnOnce(Progress) -> Result<T, Unusable>) -> Result<T, Failure> {
    let bar = Bar::of_bytes(&path.display().to_string());
    Ok(read(&|done, of| bar.at(done, of))?)
}
