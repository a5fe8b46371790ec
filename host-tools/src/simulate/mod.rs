//! Recordings that a simulation says: the force for a motion that was recorded, or a whole recording of a profile.

mod page;
mod sensors;

use simulation::Simulation;
use simulation::law::{Factors, Missing};
use simulation::motion::Motion;
use simulation::run::Run;

pub use page::page;
pub use sensors::Sensors;

use crate::recording::Column;

/// The force that the simulation says for every row of a run, N; NaN where it has none.
///
/// # Errors
/// [`Missing`].
pub fn force(simulation: &Simulation, run: &Run) -> Result<Vec<f64>, Missing> {
    Ok(simulation.steady(&Factors::default(), run, &Motion::of(run))?.force_n)
}

/// Puts the simulation's force and preload into the run of a profile. An axis at rest is taken to be free: no force but
/// what the law has without motion.
///
/// # Errors
/// [`Missing`].
pub fn drive(simulation: &Simulation, run: &mut Run) -> Result<(), Missing> {
    run.drag_force_n = force(simulation, run)?;
    if let (None, Some(preload)) = (&run.preload_n, simulation.preload_n) {
        run.preload_n = Some(vec![preload; run.len()]);
    }
    Ok(())
}

/// Number of the segment of every row, as a column.
pub fn segments(run: &Run) -> Vec<f64> {
    let numbers = run.parts.iter().flat_map(|part| {
        // segments of a profile are few
        let number = part.segment.unwrap_or(0) as f64;
        part.rows.clone().map(move |_| number)
    });
    numbers.collect()
}

/// The columns of a run in the order of the contract, without those it lacks; `segments` are those of [`segments`].
pub fn columns<'a>(run: &'a Run, segments: &'a [f64]) -> Vec<Column<'a>> {
    let all = [
        ("time_s", Some(&run.time_s)),
        ("position_m", run.position_m.as_ref()),
        ("velocity_m_s", run.velocity_m_s.as_ref()),
        ("drag_force_n", Some(&run.drag_force_n)),
        ("preload_n", run.preload_n.as_ref()),
        ("temperature_block_degc", run.temperature_block_degc.as_ref()),
        ("temperature_rail_degc", run.temperature_rail_degc.as_ref()),
        ("temperature_ambient_degc", run.temperature_ambient_degc.as_ref()),
    ];
    let there = all.into_iter().filter_map(|(name, column)| column.map(|cells| Column::numbers(name, cells)));
    there.chain([Column::numbers("segment", segments)]).collect()
}
