//! `guideblock eds`

use std::io::Write;

use can_wire::NodeId;

use super::{Failure, node, output};

/// Prints the EDS of a block: the objects that service messages ask and set
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The block's node, 1 to 127
    #[arg(long, value_name = "N", value_parser = node, default_value = "1")]
    node: NodeId,
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    let mut text = String::new();
    can_wire::service::eds(arguments.node, &mut text).map_err(Failure::data)?;
    let mut out = output();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
