//! `guideblock preload`

use super::Failure;
use super::calculate::{self, Direction, Shared};

/// Preload of a drag force, with everything in between
///
/// The whole model of the paper, Eq. 1 to 21, inverted at one working point; or row by row over a table:
///
///     guideblock preload --force 30 --speed-m-min 3 --viscosity 100
///     guideblock preload --csv < runs.csv > with_preload.csv
///
/// A table has the columns force_n (or drag_force_n, signed like velocity_m_s), speed_m_s, velocity_m_s or
/// speed_m_min, and may have viscosity_cst, temperature_degc and seal_drag_n; options stand in for
/// columns and cells that are missing. All columns are kept; calculated_preload_n and reason are added.
/// A reason says why a row has no result, or what of it is outside of what was measured.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Drag force against the motion, seals included, N
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    force: Option<f64>,
    #[command(flatten)]
    shared: Shared,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    calculate::run(Direction::Preload, arguments.force, &arguments.shared)
}
