//! How a command is told which columns and rows of a recording it reads, and reading with a progress bar.

use std::io::{IsTerminal, stderr};
use std::path::Path;
use std::time::Duration;

use host_tools::recording::{self, Losses, Mapping, Progress, Selection, Unusable};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use simulation::run::Run;

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

#[cfg_attr(not(feature = "emulator"), allow(dead_code, reason = "so far only the demo reads a run of an axis"))]
impl RecordingArguments {
    /// Reads a run and says what was lost. `more` are mappings of a simulation file; the command line goes first.
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

/// Reads something under a bar that appears when it takes long and standard error is a terminal.
pub(crate) fn with_progress<T>(path: &Path, read: impl FnOnce(Progress) -> Result<T, Unusable>) -> Result<T, Failure> {
    if !stderr().is_terminal() {
        return Ok(read(&recording::silent)?);
    }
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {bytes} of {total_bytes}") {
        bar.set_style(style);
    }
    bar.set_message(path.display().to_string());
    let told = |done, of| {
        // what is over at once needs no bar
        if bar.elapsed() > Duration::from_secs(1) {
            bar.set_length(of);
            bar.set_position(done);
        }
    };
    let result = read(&told);
    bar.finish_and_clear();
    Ok(result?)
}
