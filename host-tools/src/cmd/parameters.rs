//! `guideblock parameters`

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use can_wire::parameters::ADDRESS;
use host_tools::parameters;

use super::outputs::{Files, put};
use super::{Failure, output, say};

/// Makes or shows the parameter record of a block
///
/// A bench file is TOML: the schema line below, then what differs from the published set of Zhou et al.
/// 2023. All keys there are, with their values, are what --show prints of any record.
///
///     schema = "guideblock.bench/1"
///     node = 1
///     calibrated = true
///     [calibration.force]
///     zero_code = 2051.5
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// Bench file to make a record from
    #[arg(long, value_name = "BENCH.toml", requires = "out")]
    bench: Option<PathBuf>,
    /// Where the record is written
    #[arg(long, value_name = "RECORD", requires = "bench")]
    out: Option<PathBuf>,
    /// Record to print as a bench file
    #[arg(long, value_name = "RECORD", conflicts_with_all = ["bench", "out"])]
    show: Option<PathBuf>,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    if arguments.show.is_none() && arguments.bench.is_none() {
        let what = "give --bench BENCH.toml --out RECORD to make a record, or --show RECORD to print one";
        return Err(Failure::Usage(what.to_owned()));
    }
    if let Some(path) = &arguments.show {
        let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
        let record =
            parameters::from_bytes(&bytes).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?;
        let mut out = output();
        out.write_all(parameters::to_bench(&record).as_bytes())?;
        out.flush()?;
    }
    if let (Some(path), Some(out)) = (&arguments.bench, &arguments.out) {
        Files::default().reads("--bench", [path]).writes("--out", [out]).check()?;
        let text = fs::read_to_string(path).map_err(|error| Failure::io(path, error))?;
        let record =
            parameters::from_bench(&text).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?;
        let bytes = parameters::to_bytes(&record).map_err(Failure::data)?;
        put(out, &bytes)?;
        let calibrated = if record.params.calibrated { "calibrated" } else { "NOT calibrated: it gives no preload" };
        say(format_args!(
            "{}: {} bytes for {ADDRESS:#010x}, node {}, {calibrated}",
            out.display(),
            bytes.len(),
            record.node
        ));
    }
    Ok(())
}
