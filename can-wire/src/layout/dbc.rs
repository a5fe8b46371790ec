//! DBC file from the layout table.

use super::{EXCHANGES, MESSAGES, Signal};
use crate::frame::NodeId;
use core::fmt::{self, Display, Write};

/// Writes the DBC of one block.
///
/// Messages are named `GuideBlock<n>_<name>`, so that the DBCs of several blocks can be merged.
///
/// # Errors
/// Those of `out`.
pub fn dbc(node: NodeId, out: &mut impl Write) -> fmt::Result {
    out.write_str("VERSION \"\"\n\nNS_ :\n\tCM_\n\tBA_DEF_\n\tBA_\n\tVAL_\n\tBA_DEF_DEF_\n\nBS_:\n\n")?;
    writeln!(out, "BU_: {}", Block(node))?;
    for message in &MESSAGES {
        write_message(node, message.kind.identifier(node), message.name, true, message.signals, out)?;
    }
    for exchange in &EXCHANGES {
        let id = exchange.base + u16::from(node.get());
        write_message(node, id, exchange.name, exchange.from_block, exchange.signals, out)?;
    }
    writeln!(
        out,
        "\nCM_ \"Preload of a linear guide block, node {}. 11-bit identifiers, classical CAN. Made by can-wire; do not edit.\";",
        node.get()
    )?;
    for message in &MESSAGES {
        comments(message.kind.identifier(node), message.comment, message.signals, out)?;
    }
    for exchange in &EXCHANGES {
        comments(exchange.base + u16::from(node.get()), exchange.comment, exchange.signals, out)?;
    }
    out.write_str("\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n")?;
    for message in &MESSAGES {
        writeln!(out, "BA_ \"GenMsgCycleTime\" BO_ {} {};", message.kind.identifier(node), message.cycle_ms)?;
    }
    writeln!(out)?;
    for message in &MESSAGES {
        for signal in message.signals.iter().filter(|s| !s.values.is_empty()) {
            write!(out, "VAL_ {} {}", message.kind.identifier(node), signal.name)?;
            for (code, meaning) in signal.values {
                write!(out, " {code} \"{meaning}\"")?;
            }
            writeln!(out, " ;")?;
        }
    }
    Ok(())
}

fn comments(id: u16, comment: &str, signals: &[Signal], out: &mut impl Write) -> fmt::Result {
    writeln!(out, "CM_ BO_ {id} \"{comment}\";")?;
    for signal in signals {
        writeln!(out, "CM_ SG_ {id} {} \"{}\";", signal.name, signal.comment)?;
    }
    Ok(())
}

fn write_message(
    node: NodeId,
    id: u16,
    name: &str,
    from_block: bool,
    signals: &[Signal],
    out: &mut impl Write,
) -> fmt::Result {
    let block = Block(node);
    write!(out, "\nBO_ {id} {block}_{name}: 8 ")?;
    if from_block {
        writeln!(out, "{block}")?
    } else {
        writeln!(out, "Vector__XXX")?
    }
    for signal in signals {
        let Signal { name, start_bit, length, scale, unit, .. } = signal;
        let sign = if signal.signed { '-' } else { '+' };
        let (factor, min, max) = (scale.physical(1), scale.physical(signal.raw_min), scale.physical(signal.raw_max));
        // @1: little-endian; Vector__XXX: no receiver in particular
        writeln!(out, " SG_ {name} : {start_bit}|{length}@1{sign} ({factor},0) [{min}|{max}] \"{unit}\" Vector__XXX")?;
    }
    Ok(())
}

/// Name of a block in the DBC.
struct Block(NodeId);

impl Display for Block {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GuideBlock{}", self.0.get())
    }
}
