//! A recorded speed that is noisier than one derived from the recorded position.
//!
//! The law is only as good as the speed it is evaluated at. Where position and speed were both recorded, the residual
//! of all curves is compared with the one obtained with the speed derived from the position: if that is clearly
//! smaller, the recorded speed is discarded.

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

/// Least reduction of the squared residual with the derived speed, as a share.
const BETTER: f64 = 0.3;

/// Least effect of the recorded speed on the law's force, as a share of the force's own noise, for a comparison to be
/// made.
const WORTH_A_LOOK: f64 = 0.3;

/// A recorded speed that was discarded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SetAside {
    /// Its variance around the derived speed, m²/s².
    pub(crate) variance_m2_s2: f64,
    /// Mean square of its effect on the force, N².
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

/// The runs without a speed that was recorded beside a position.
pub(crate) fn without(runs: &[Run]) -> Vec<Run> {
    let bare = |run: &Run| if has_both(run) { Run { velocity_m_s: None, ..run.clone() } } else { run.clone() };
    runs.iter().map(bare).collect()
}

/// Noise of a recorded speed, relative to its RMS, that a speed derived from a position may have as well.
const NOISY: f64 = 2e-3;

/// Whether a recorded speed is noisier than one derived from the position would be; the noise of its derived
/// acceleration is then a cause of its own.
pub(crate) fn is_noisy(runs: &[Run]) -> bool {
    let noisy = |run: &Run| {
        let Some(velocity) = run.velocity_m_s.as_ref().filter(|_| has_both(run)) else { return false };
        // a speed jumps between parts without being noisy
        let noise = run.parts.iter().flat_map(|part| third_differences(&velocity[part.rows.clone()]));
        rms(&noise.collect::<Vec<f64>>()) > NOISY * rms(velocity)
    };
    runs.iter().any(noisy)
}

/// The discarded speed and what is gained without it, where it only adds noise. All rows decide which of the two
/// channels is better, including those held out for the score.
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
    // third differences, robustly: a reversal is no noise of the force
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
