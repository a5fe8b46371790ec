//! `guideblock decode`

use std::io::BufRead;
use std::path::PathBuf;

use can_wire::NodeId;
use host_tools::decode::Decoder;
use host_tools::report::Emitter;

use super::progress::Bar;
use super::{Failure, Format, Input, node, open, output, say};

/// Prints what guide blocks said on the bus
///
/// Reads what candump prints, in either of its formats, from a file or a live bus:
///
///     candump -L can0 | guideblock decode
///
/// Frames of other devices are ignored. What cannot be decoded is counted by reason and reported at the
/// end on standard error, with the first lines of each.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Arguments {
    /// candump text; - is standard input
    #[arg(default_value = "-")]
    file: PathBuf,
    /// How messages are printed
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Only messages of this block, 1 to 127
    #[arg(long, value_name = "N", value_parser = node)]
    node: Option<NodeId>,
}

/// Logs of other programs, how their first line starts, and what they are.
const FOREIGN: [(&str, &str); 4] = [
    ("date ", "a Vector log (.asc)"),
    ("base hex", "a Vector log (.asc)"),
    (";$FILEVERSION", "a PCAN trace (.trc)"),
    (";   Start time", "a PCAN trace (.trc)"),
];

/// Lines after which the progress bar is looked at.
const LINES_A_LOOK: u32 = 1 << 14;

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let Input { name, is_live, length: total, mut reader } = open(&arguments.file)?;
    let mut decoder = Decoder::new(arguments.node);
    let mut emitter = Emitter::new(output(), arguments.format.into())?;
    if is_live {
        emitter.flush()?;
    }
    // bytes, not text: line noise on a serial logger must not end the run
    let mut line = Vec::new();
    let (bar, mut lines, mut done) = (Bar::of_bytes(&name), 0u32, 0);
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(|e| Failure::Data(format!("{name}: {e}")))?;
        if length == 0 {
            break;
        }
        if done == 0
            && let Some((_, kind)) = FOREIGN.iter().find(|(start, _)| line.starts_with(start.as_bytes()))
        {
            let what = "make it candump text with python-can: `python3 -m can.logconvert IN OUT.log`";
            return Err(Failure::Data(format!("{name}: this is {kind}; {what}")));
        }
        done += length as u64;
        lines = lines.wrapping_add(1);
        if let Some(total) = total
            && lines.is_multiple_of(LINES_A_LOOK)
        {
            bar.at(done, total);
        }
        if let Some(decoded) = decoder.line(&line) {
            emitter.message(&decoded)?;
            if is_live {
                emitter.flush()?;
            }
        }
    }
    drop(bar);
    emitter.finish()?;
    let tally = decoder.tally();
    say(tally);
    if tally.decoded == 0 {
        let what = match (arguments.node, tally.other_nodes()) {
            (Some(node), others) if !others.is_empty() => {
                format!("no frame of a guide block is of node {}; seen: {others}", node.get())
            }
            _ => "no frame of a guide block".to_owned(),
        };
        return Err(Failure::Data(format!("{name}: {what}")));
    }
    Ok(())
}
