//! Subcommands, one file each: parse arguments, call the library, print. Here is what they share.

pub(crate) mod block;
mod calculate;
pub(crate) mod calibrate;
pub(crate) mod convert;
pub(crate) mod dbc;
pub(crate) mod decode;
#[cfg(feature = "emulator")]
pub(crate) mod demo;
pub(crate) mod diagnose;
pub(crate) mod drag;
pub(crate) mod eds;
pub(crate) mod estimate;
pub(crate) mod image;
pub(crate) mod outputs;
pub(crate) mod paper;
pub(crate) mod parameters;
pub(crate) mod preload;
pub(crate) mod progress;
pub(crate) mod record;
pub(crate) mod recordings;
pub(crate) mod replay;
pub(crate) mod simulate;
pub(crate) mod simulation_file;
pub(crate) mod trial;

use std::fmt::Display;
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;

use can_wire::NodeId;
use clap::ValueEnum;
use host_tools::recording::Unusable;
use host_tools::{files, report};

/// Why a command did not do what it was asked for. The text is for the person at the terminal.
#[derive(Debug)]
pub(crate) enum Failure {
    /// A check that the command makes did not hold; what it was has been printed.
    Check,
    /// Wrong arguments, a file that is not there.
    Usage(String),
    /// Data of which nothing can be used.
    Data(String),
    /// The output cannot be written.
    Output(io::Error),
}

impl Failure {
    /// Unusable data.
    fn data(why: impl Display) -> Self {
        Failure::Data(why.to_string())
    }

    /// A file that the caller named cannot be read.
    fn io(path: &Path, error: io::Error) -> Self {
        Failure::file(path, files::why(&error))
    }

    /// Something about a file that the caller named.
    fn file(path: &Path, why: impl Display) -> Self {
        Failure::Usage(format!("{}: {why}", path.display()))
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        Failure::Output(error)
    }
}

impl From<Unusable> for Failure {
    fn from(why: Unusable) -> Self {
        match why {
            Unusable::Io { .. } => Failure::Usage(why.to_string()),
            _ if why.is_usage() => Failure::Usage(why.to_string()),
            _ => Failure::Data(why.to_string()),
        }
    }
}

/// Prints the error, if there is one, and returns the exit status.
pub(crate) fn exit_code(outcome: Result<(), Failure>) -> ExitCode {
    let (code, text) = match outcome {
        Ok(()) => (0, None),
        // the reader has closed the pipe: no error
        Err(Failure::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => (0, None),
        Err(Failure::Check) => (1, None),
        Err(Failure::Output(error)) => (2, Some(format!("cannot write the output: {error}"))),
        Err(Failure::Usage(text)) => (2, Some(text)),
        Err(Failure::Data(text)) => (3, Some(text)),
    };
    if let Some(text) = text {
        say(format_args!("guideblock: {text}"));
    }
    ExitCode::from(code)
}

/// Writes a line to standard error; a closed one is ignored.
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// How decoded messages are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// aligned text, one line a reading; heartbeats and faults when they change
    Table,
    /// one row a message
    Csv,
    /// one JSON object a line and message
    Json,
}

impl From<Format> for report::Format {
    fn from(format: Format) -> Self {
        match format {
            Format::Table => report::Format::Table,
            Format::Csv => report::Format::Csv,
            Format::Json => report::Format::Json,
        }
    }
}

/// An input that a person named: `-` is standard input.
pub(crate) struct Input {
    /// Its name in messages.
    pub(crate) name: String,
    /// Whether more may come later, so that output must not wait.
    pub(crate) is_live: bool,
    /// Bytes in it, where that is known.
    pub(crate) length: Option<u64>,
    /// The text.
    pub(crate) reader: Box<dyn BufRead>,
}

/// Opens an input.
pub(crate) fn open(path: &Path) -> Result<Input, Failure> {
    if path == Path::new("-") {
        return Ok(Input {
            name: "standard input".to_owned(),
            is_live: true,
            length: None,
            reader: Box::new(io::stdin().lock()),
        });
    }
    let file = File::open(path).map_err(|error| Failure::io(path, error))?;
    let length = file.metadata().ok().filter(|meta| meta.is_file()).map(|meta| meta.len());
    Ok(Input { name: path.display().to_string(), is_live: false, length, reader: Box::new(BufReader::new(file)) })
}

/// Standard output, buffered.
pub(crate) fn output() -> BufWriter<io::StdoutLock<'static>> {
    BufWriter::new(io::stdout().lock())
}

/// A node number of the command line.
pub(crate) fn node(text: &str) -> Result<NodeId, String> {
    text.parse().ok().and_then(NodeId::new).ok_or_else(|| "a node is a whole number from 1 to 127".to_owned())
}

/// A seed of the command line.
pub(crate) fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| "a seed is a whole number from 0 to 2^64 - 1".to_owned())
}
