//! `guideblock replay`

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use can_wire::parameters::ParameterRecord;
use clap::ValueEnum;
use host_tools::candump::Frame;
use host_tools::decode::Decoder;
use host_tools::parameters;
use host_tools::recording::raw;
use host_tools::replay::{Replay, UNPROGRAMMED};
use host_tools::report::{self, Emitter};

use super::{Failure, Input, open, output, say};

/// Sends a raw recording through the block's pipeline again
///
/// The recording holds the samples as the converters delivered them (schema guideblock.raw/1). The frames
/// are those the block sent, bit for bit: estimates and motion, which follow from the samples alone.
/// Time counts from the block's start.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// Raw recording; - is standard input
    #[arg(value_name = "RAW.csv")]
    file: PathBuf,
    /// The block's parameter record; without it the block is unprogrammed and gives no preload
    #[arg(long, value_name = "RECORD")]
    parameters: Option<PathBuf>,
    /// How the frames are printed
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// aligned text, one line a reading
    Table,
    /// one row a message
    Csv,
    /// one JSON object a line and message
    Json,
    /// the frames themselves, as candump -L prints them
    Candump,
}

/// The interface that replayed frames come from.
const INTERFACE: &str = "replay";

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let record = match &arguments.parameters {
        Some(path) => {
            let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
            parameters::from_bytes(&bytes).map_err(|why| Failure::Data(format!("{}: {why}", path.display())))?
        }
        None => UNPROGRAMMED,
    };
    let Input { name, reader, .. } = open(&arguments.file)?;
    let recording = raw::read(&name, reader).map_err(Failure::data)?;
    for line in recording.losses.describe(&name) {
        say(line);
    }
    match arguments.format {
        Format::Table => decoded(&recording, &record, report::Format::Table),
        Format::Csv => decoded(&recording, &record, report::Format::Csv),
        Format::Json => decoded(&recording, &record, report::Format::Json),
        Format::Candump => candump(&recording, &record),
    }
}

fn decoded(recording: &raw::RawRecording, record: &ParameterRecord, format: report::Format) -> Result<(), Failure> {
    let mut replay = Replay::new(record).map_err(Failure::data)?;
    let mut decoder = Decoder::new(None);
    let mut emitter = Emitter::new(output(), format)?;
    for sent in recording.blocks.iter().filter_map(|block| replay.block(block)) {
        for frame in sent.frames {
            if let Some(decoded) = decoder.frame(&Frame::new(Some(sent.time), INTERFACE, frame.id, &frame.data)) {
                emitter.message(&decoded)?;
            }
        }
    }
    Ok(emitter.finish()?)
}

fn candump(recording: &raw::RawRecording, record: &ParameterRecord) -> Result<(), Failure> {
    let mut replay = Replay::new(record).map_err(Failure::data)?;
    let mut out = output();
    for sent in recording.blocks.iter().filter_map(|block| replay.block(block)) {
        for frame in sent.frames {
            writeln!(out, "{}", Frame::new(Some(sent.time), INTERFACE, frame.id, &frame.data))?;
        }
    }
    Ok(out.flush()?)
}
