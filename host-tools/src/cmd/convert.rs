//! `guideblock convert`

use std::path::PathBuf;

use host_tools::recording::{Kind, whole, write};

use super::outputs::{self, Files};
use super::recordings::{RecordingArguments, with_progress};
use super::{Failure, say};

/// Turns a recording from CSV into Parquet or back
///
/// Every column is kept, whatever it is called; --column makes new ones in the place of those they come from.
/// Rows with too few or too many cells are left out and named. Time and units are not judged: what reads the
/// result says the same about them as it would have said before.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// Recording, CSV or Parquet; - is standard input
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write, .csv or .parquet; - is CSV on standard output
    #[arg(value_name = "OUT")]
    out: PathBuf,
    #[command(flatten)]
    recording: RecordingArguments,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let Arguments { input, out, recording } = arguments;
    if Kind::of(&out).is_none() {
        return Err(Failure::file(&out, "name it .csv or .parquet, so that it is clear what to write"));
    }
    Files::default().reads("IN", [&input]).writes("OUT", [&out]).check()?;
    let read = |progress: host_tools::recording::Progress| {
        whole::open(&input, &recording.mappings, &recording.selections, progress)
    };
    let (whole, losses) = with_progress(&input, read)?;
    for line in losses.describe(&input.display().to_string()) {
        say(line);
    }
    write(&out, &whole.columns()).map_err(|error| outputs::of(&out, error))
}
