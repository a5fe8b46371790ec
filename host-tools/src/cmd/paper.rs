//! `guideblock paper`

use std::io::Write;
use std::path::PathBuf;

use host_tools::paper::{claims, report};

use super::outputs::put;
use super::{Failure, output, say};

/// Holds what the paper states against its own equations, under every reading of its units
///
/// One line a statement: what the paper says, what its equations give, the difference, a verdict. Then the
/// eight readings of the Hersey number, and what each makes of the measured grid.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// Write a self-contained page with the Stribeck picture
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let findings =
        claims::findings().ok_or_else(|| Failure::data("a measured load is beyond the contact's geometry"))?;
    if let Some(path) = &arguments.html {
        put(path, report::page(&findings))?;
        say(format_args!("{}: page written", path.display()));
    }
    let mut out = output();
    if arguments.json {
        writeln!(out, "{}", report::json(&findings))?;
    } else {
        out.write_all(report::text(&findings).as_bytes())?;
    }
    out.flush()?;
    Ok(())
}
