//! Simulated force of a recording, sample by sample.
//!
//! ```text
//! recording -> run -> motion -> law, mechanisms, curves -> force of every row -> rows that were left out put back, empty
//! profile ----------^                               -> why a row has none
//! ```

mod front_end;
mod page;
mod silent;

pub use front_end::block_sensors;
pub use page::{Series, page};
pub use silent::{Silence, silences};

use simulation::Simulation;
use simulation::curve::AddedCurve;
use simulation::law::Missing;
use simulation::mechanism::Context;
use simulation::motion::Motion;
use simulation::run::Run;

/// The simulated force of every row of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// Force of the drive on the carriage, N, positive towards +position; NaN where the law has no value. At rest it is
    /// the law's force without friction: inertia and offset.
    pub force_n: Vec<f64>,
    /// Sign of the velocity; 0 at rest, where friction is not determined.
    pub direction: Vec<f64>,
}

impl Simulated {
    /// Evaluates the law with mechanisms and curves. This is the only place that does.
    ///
    /// # Errors
    /// [`Missing`]: something that the law needs is neither in the run nor in the simulation.
    pub fn of(simulation: &Simulation, run: &Run, motion: &Motion) -> Result<Self, Missing> {
        Ok(Simulated { force_n: simulation.force(run, motion)?, direction: simulation.direction(motion) })
    }
}

/// Curves of the simulation whose axis the run does not have, a line each for people: their force is left out.
///
/// # Errors
/// [`Missing`] as [`Simulated::of`].
pub fn not_shown(simulation: &Simulation, run: &Run, motion: &Motion) -> Result<Vec<String>, Missing> {
    if simulation.curves.is_empty() {
        return Ok(Vec::new());
    }
    let context = Context::of(simulation, run, motion)?;
    let hidden = simulation.curves.iter().filter(|added| added.force_n(&context).is_none());
    let line = |added: &AddedCurve| {
        let axis = added.curve.axis.name();
        format!("the curve over {axis} is left out of the force: nothing in the run tells its {axis}")
    };
    Ok(hidden.map(line).collect())
}

/// Spreads the forces of the used rows over all rows of a file, whose times are `all_s`; rows that were left out get
/// NaN.
///
/// The used rows stand in the file in the same order, so each one is the next row with its time.
pub fn among_all(all_s: &[f64], used_s: &[f64], force_n: &[f64]) -> Vec<f64> {
    let mut used = used_s.iter().zip(force_n).peekable();
    all_s.iter().map(|time| used.next_if(|(at, _)| *at == time).map_or(f64::NAN, |(_, force)| *force)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_were_left_out_stand_empty_in_their_places() {
        let all = [0.0, 1.0, 1.0, 2.0, 9.0, 3.0, 4.0];
        let got = among_all(&all, &[0.0, 1.0, 2.0, 4.0], &[5.0, 6.0, 7.0, 8.0]);
        let expected = [5.0, 6.0, f64::NAN, 7.0, f64::NAN, f64::NAN, 8.0];
        assert_eq!(format!("{got:?}"), format!("{expected:?}"));
    }
}
