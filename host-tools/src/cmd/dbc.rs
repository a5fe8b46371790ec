//! `guideblock dbc`

use std::io::Write;

use can_wire::NodeId;

use super::{Failure, node, output};

/// Prints the DBC of a block
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The block's node, 1 to 127
    #[arg(long, value_name = "N", value_parser = node, default_value = "1")]
    node: NodeId,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let mut text = String::new();
    can_wire::layout::dbc(arguments.node, &mut text).map_err(Failure::data)?;
    let mut out = output();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
