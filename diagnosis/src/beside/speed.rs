//! A recorded speed that is noisier than what the recorded position tells.
//!
//! The law is only as good as the speed it is evaluated at. Where position and speed were both recorded, the rest that no
//! curve follows is held against the one that is left with the speed taken from the position: if that is clearly less,
//! the recorded speed is set aside.

use simulation::Simulation;
use simulation::mechanism::Id;
use simulation::run::Run;

use crate::calibration::calibrate;
use crate::noise::rows::Rows;
use crate::noise::third_differences;
use crate::nominal::Nominal;
use crate::numbers::statistics::{rms, robust_sigma};
use crate::recording::moving::Moving;
use crate::recording::resolution::coarsest;
use crate::recording::sanity::FEWEST_ROWS;
use crate::recording::side::Side;
use crate::report::DataQuality;

/// Share of the squared rest that must be gone with the speed of the position.
const BETTER: f64 = 0.3;

/// Share of the force's own noise that the recorded speed must make of the law's force before anything is compared.
const WORTH_A_LOOK: f64 = 0.3;

/// A recorded speed that was set aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SetAside {
    /// Its variance around the speed of the position, m²/s².
    pub(crate) variance_m2_s2: f64,
    /// Mean square of what it makes of the force, N².
    pub(crate) power_n2: f64,
}

impl SetAside {
    /// As a line of the data's quality.
    pub(crate) fn said(&self) -> String {
        let scatter = self.variance_m2_s2.sqrt();
        format!("the recorded speed is {scatter:.1e} m/s RMS off that of the position and set aside")
    }
}

fn has_both(run: &Run) -> bool {
    run.velocity_m_s.is_some() && run.position_m.is_some()
}

/// Runs without the speed that was recorded beside a position.
pub(crate) fn without(runs: &[Run]) -> Vec<Run> {
    let bare = |run: &Run| if has_both(run) { Run { velocity_m_s: None, ..run.clone() } } else { run.clone() };
    runs.iter().map(bare).collect()
}

/// Noise of a recorded speed, of its RMS, that is as much as one derived from a position may have.
const NOISY: f64 = 2e-3;

/// Whether a recorded speed is noisier than one derived from the position would be: what it makes of the acceleration has
/// a name then.
pub(crate) fn is_noisy(runs: &[Run]) -> bool {
    let noisy = |run: &Run| {
        let Some(velocity) = run.velocity_m_s.as_ref().filter(|_| has_both(run)) else { return false };
        // where one part ends and the next begins, a speed jumps without noise
        let noise = run.parts.iter().flat_map(|part| third_differences(&velocity[part.rows.clone()]));
        rms(&noise.collect::<Vec<f64>>()) > NOISY * rms(velocity)
    };
    runs.iter().any(noisy)
}

/// What is gained without the recorded speed, where that only adds noise.
/// Which of two channels is the better one is told by all rows, those that are set aside for the score among them.
pub(crate) fn set_aside(simulation: &Simulation, nominal: &Nominal, recorded: &Moving<'_>) -> Option<SetAside> {
    let runs = &*recorded.runs;
    if !runs.iter().any(has_both) || simulation.mechanisms.iter().any(|added| added.id == Id::SpeedNoise) {
        return None;
    }
    // noise of the speed must not pass for a fast acceleration here
    let nominal = &nominal.of_law();
    let bare = without(runs);
    let derived = Moving::as_recorded(&bare);
    let side =
        |moving| Side::new(simulation, nominal, &nominal.start(), moving, false, &mut DataQuality::default()).ok();
    let (as_recorded, as_derived) = (side(recorded)?, side(&derived)?);
    let both: Vec<bool> = as_recorded.compared.iter().zip(&as_derived.compared).map(|(a, b)| *a && *b).collect();
    if both.iter().filter(|both| **both).count() < FEWEST_ROWS {
        return None;
    }
    let forces = [&as_recorded, &as_derived].map(|side| side.force(nominal, &nominal.start()));
    let [Ok(with), Ok(without)] = forces else { return None };
    let effect = rms(&common(&both, with.iter().zip(&without).map(|(a, b)| a - b)));
    // a reversal is no noise of the force
    let noise =
        runs.iter().map(|run| robust_sigma(&third_differences(&run.drag_force_n))).fold(f64::INFINITY, f64::min);
    if !nominal.is_incomplete() && !(effect > WORTH_A_LOOK * noise) {
        return None;
    }
    let left = |moving: &Moving<'_>, side| {
        let mut rows = Rows::new(&moving.runs, &both, coarsest(nominal, &moving.runs, &moving.motions));
        calibrate(simulation, nominal, side, &mut rows, &both).ok().map(|calibrated| calibrated.left)
    };
    let (with, without) = (left(recorded, as_recorded)?, left(&derived, as_derived)?);
    let power = |left: &[f64]| rms(&common(&both, left.iter().copied())).powi(2);
    let power_n2 = power(&with) - power(&without);
    let speeds = recorded.motions.iter().zip(&derived.motions);
    let apart = speeds.flat_map(|(a, b)| a.velocity_m_s.iter().zip(&b.velocity_m_s).map(|(a, b)| a - b));
    let variance_m2_s2 = rms(&common(&both, apart)).powi(2);
    (power_n2 > BETTER * power(&with)).then_some(SetAside { variance_m2_s2, power_n2 })
}

/// Entries of the rows that are compared both ways.
fn common(both: &[bool], column: impl Iterator<Item = f64>) -> Vec<f64> {
    column.zip(both).filter(|(x, both)| **both && x.is_finite()).map(|(x, _)| x).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::run::{Break, Part};

    #[test]
    fn parts_that_end_in_motion_are_no_noise() {
        let part = |rows, starts| Part { rows, segment: None, starts };
        let speed = |n: usize| if n < 500 { 0.2 } else { -0.3 };
        let run = |noise: f64| Run {
            time_s: (0..1000).map(|n| 0.01 * n as f64).collect(),
            position_m: Some(vec![0.0; 1000]),
            velocity_m_s: Some((0..1000).map(|n| speed(n) + noise * (2.7 * (n * n) as f64).sin()).collect()),
            parts: vec![part(0..500, Break::Start), part(500..1000, Break::Segment)],
            ..Run::default()
        };
        assert!(!is_noisy(&[run(1e-5)]));
        assert!(is_noisy(&[run(5e-3)]));
    }
}
