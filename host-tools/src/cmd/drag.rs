//! `guideblock drag`

use super::Failure;
use super::calculate::{self, Direction, Shared};

/// Drag force of a preload, with everything in between
///
/// The whole model of the paper, Eq. 1 to 21, at one working point; or row by row over a table:
///
///     guideblock drag --preload 3000 --speed-m-min 3 --temperature 25
///     guideblock drag --csv --viscosity 100 < working_points.csv
///
/// A table has the columns preload_n and speed_m_s, velocity_m_s or speed_m_min, and may have
/// viscosity_cst, temperature_degc and seal_drag_n; options stand in for columns and cells that are
/// missing. All columns are kept; calculated_force_n and reason are added.
/// A reason says why a row has no result, or what of it is outside of what was measured.
#[derive(clap::Args)]
#[command(verbatim_doc_comment, allow_negative_numbers = true)]
pub(crate) struct Arguments {
    /// Preload of the block, N
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    preload: Option<f64>,
    #[command(flatten)]
    shared: Shared,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    calculate::run(Direction::Drag, arguments.preload, &arguments.shared)
}
