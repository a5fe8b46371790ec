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

/// Least part of the variance of a recorded speed around the derived one that the position shows from row to row, as a
/// share, from which it is no noise of the speed: carriage or encoder did move so, and a longer window smooths it.
const SHOWN: f64 = 0.5;

/// Least correlation of that with the row before: a speed that is nothing but the difference of noisy positions has none.
const SMOOTH: f64 = 0.5;

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

/// Whether a recorded speed is noisier than one derived from the position would be, by what the position does not show;
/// the noise of its derived acceleration is then a cause of its own.
pub(crate) fn is_noisy(runs: &[Run]) -> bool {
    let noisy = |run: &Run| {
        let Some(velocity) = run.velocity_m_s.as_ref().filter(|_| has_both(run)) else { return false };
        // a speed jumps between parts without being noisy
        let fast = |column: &[f64]| -> Vec<f64> {
            run.parts.iter().flat_map(|part| third_differences(&column[part.rows.clone()])).collect()
        };
        let noise = fast(velocity);
        rms(&noise) > NOISY * rms(velocity) && !is_shown(&noise, &fast(&slopes(run)))
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
    // NaN where the two are not compared
    let around_derived = |speeds: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
        let derived = derived.motions.iter().flat_map(|motion| &motion.velocity_m_s);
        let apart = speeds.zip(derived).zip(&both);
        apart.map(|((speed, derived), both)| if *both { speed - derived } else { f64::NAN }).collect()
    };
    let apart = around_derived(&mut recorded.motions.iter().flat_map(|motion| motion.velocity_m_s.iter().copied()));
    if is_shown(&apart, &around_derived(&mut runs.iter().flat_map(slopes))) {
        return None;
    }
    let variance_m2_s2 = rms(&common(&both, apart.into_iter())).powi(2);
    (power_n2 > BETTER * power(&with)).then_some(SetAside { variance_m2_s2, power_n2 })
}

/// Slope of the position over the rows before and after each row, m/s; NaN at the ends of parts.
fn slopes(run: &Run) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; run.len()];
    let Some(position) = &run.position_m else { return slopes };
    for rows in run.parts.iter().map(|part| part.rows.clone()) {
        for n in rows.start + 1..rows.end.max(1) - 1 {
            slopes[n] = (position[n + 1] - position[n - 1]) / (run.time_s[n + 1] - run.time_s[n - 1]);
        }
    }
    slopes
}

/// Whether a deviation of the speed is smooth, and the position shows it as well.
fn is_shown(deviation: &[f64], by_position: &[f64]) -> bool {
    let next = deviation.get(1..).unwrap_or_default();
    correlation(deviation, by_position).powi(2) > SHOWN && correlation(deviation, next) > SMOOTH
}

/// Correlation of two columns around 0, where both have a value.
fn correlation(one: &[f64], other: &[f64]) -> f64 {
    let (mut of_one, mut of_other, mut of_both) = (0.0, 0.0, 0.0);
    for (a, b) in one.iter().zip(other).filter(|(a, b)| a.is_finite() && b.is_finite()) {
        of_one += a * a;
        of_other += b * b;
        of_both += a * b;
    }
    if of_one > 0.0 && of_other > 0.0 { of_both / (of_one * of_other).sqrt() } else { 0.0 }
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

    #[test]
    fn a_speed_that_the_position_shows_row_by_row_is_no_noise() {
        let time_s: Vec<f64> = (0..1000).map(|n| 1e-3 * f64::from(n)).collect();
        let ripple = |t: f64| 2e-3 * (600.0 * t).cos();
        let noise: Vec<f64> = (0..1000).map(|n| 2e-3 * (2.7 * (n * n) as f64).sin()).collect();
        let run = Run {
            position_m: Some(time_s.iter().map(|t| 0.1 * t + 2e-3 / 600.0 * (600.0 * t).sin()).collect()),
            parts: vec![Part { rows: 0..1000, segment: None, starts: Break::Start }],
            drag_force_n: vec![0.0; 1000],
            time_s: time_s.clone(),
            ..Run::default()
        };
        let shown: Vec<f64> = slopes(&run).iter().map(|slope| slope - 0.1).collect();
        let rippled: Vec<f64> = time_s.iter().map(|t| ripple(*t)).collect();
        assert!(is_shown(&rippled, &shown) && !is_shown(&noise, &shown));
        // differences of noisy positions
        assert!(!is_shown(&noise, &noise));
        let recorded =
            |error: &[f64]| Run { velocity_m_s: Some(error.iter().map(|error| 0.1 + error).collect()), ..run.clone() };
        assert!(!is_noisy(&[recorded(&rippled)]) && is_noisy(&[recorded(&noise)]));
    }
}
