//! A recorded speed that is noisier than another that the recording tells.
//!
//! The law is only as good as the speed it is evaluated at. The residual of all curves is compared with the one
//! obtained with the speed derived from the position or, where none was recorded, with the mean of the speed over as
//! many rows as agree: if that is clearly smaller, the recorded speed is discarded.

use simulation::Simulation;
use simulation::mechanism::Id;
use simulation::motion::{Motion, calm};
use simulation::run::Run;

use crate::beside::moved::{is_shown, slopes, wave_m};
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
    /// Wavelength of the encoder that errs in it, m; `None` where it is noise.
    pub(crate) wave_m: Option<f64>,
    /// Whether the other is that of a recorded position.
    has_position: bool,
}

impl SetAside {
    /// As a line of the data's quality.
    pub(crate) fn said(&self) -> String {
        let scatter = self.variance_m2_s2.sqrt();
        let other = if self.has_position { "that of the position" } else { "its mean over the rows around" };
        format!("the recorded speed is {scatter:.1e} m/s RMS off {other} and set aside")
    }
}

fn has_both(run: &Run) -> bool {
    run.velocity_m_s.is_some() && run.position_m.is_some()
}

/// The runs with another speed than the one recorded: that of the position, else the mean over as many rows as agree.
pub(crate) fn without(runs: &[Run]) -> Vec<Run> {
    let other = |run: &Run| {
        let recorded = run.velocity_m_s.as_ref().filter(|_| run.position_m.is_none());
        Run { velocity_m_s: recorded.map(|velocity| steadied(run, velocity)), ..run.clone() }
    };
    runs.iter().map(other).collect()
}

/// Standard deviations of a speed's noise by which a row stands out from those around it.
const STANDS_OUT: f64 = 4.0;

/// A speed without its noise, and without rows that stand out alone; 0 where it cannot be told from rest.
fn steadied(run: &Run, velocity: &[f64]) -> Vec<f64> {
    let noise = noise(run, velocity);
    let mut even = velocity.to_vec();
    for rows in run.parts.iter().map(|part| part.rows.clone()) {
        for (row, around) in rows.clone().skip(2).zip(velocity[rows].windows(5)) {
            let mut around: [f64; 5] = around.try_into().unwrap_or_default();
            around.sort_unstable_by(f64::total_cmp);
            if (velocity[row] - around[2]).abs() > STANDS_OUT * noise {
                even[row] = around[2];
            }
        }
    }
    calm(run, &even).into_iter().map(|v| if v.abs() < noise { 0.0 } else { v }).collect()
}

/// Standard deviation of a speed's noise, m/s, whatever its tails.
fn noise(run: &Run, velocity: &[f64]) -> f64 {
    robust_sigma(&fast(run, velocity))
}

/// Third differences of a column within the parts of its run: a speed jumps between parts without being noisy.
fn fast(run: &Run, column: &[f64]) -> Vec<f64> {
    run.parts.iter().flat_map(|part| third_differences(&column[part.rows.clone()])).collect()
}

/// Noise of a recorded speed, relative to its RMS, that a speed derived from a position may have as well.
const NOISY: f64 = 2e-3;

/// Whether a recorded speed is noisier than one derived from the position would be, by what the position does not show;
/// the noise of its derived acceleration is then a cause of its own.
pub(crate) fn is_noisy(runs: &[Run]) -> bool {
    let noisy = |run: &Run| {
        let Some(velocity) = run.velocity_m_s.as_ref().filter(|_| has_both(run)) else { return false };
        let noise = fast(run, velocity);
        rms(&noise) > NOISY * rms(velocity) && !is_shown(&noise, &fast(run, &slopes(run)))
    };
    runs.iter().any(noisy)
}

/// The discarded speed and what is gained without it, where it only adds noise. All rows decide which of the two
/// channels is better, including those held out for the score.
pub(crate) fn set_aside(simulation: &Simulation, nominal: &Nominal, recorded: &Moving<'_>) -> Option<SetAside> {
    let runs = &*recorded.runs;
    if runs.iter().all(|run| run.velocity_m_s.is_none())
        || simulation.mechanisms.iter().any(|added| added.id == Id::SpeedNoise)
    {
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
    let compared = both.iter().filter(|both| **both).count();
    if compared < FEWEST_ROWS {
        return None;
    }
    let phantom = phantoms(&as_recorded, &as_derived);
    let forces = [&as_recorded, &as_derived].map(|side| side.force(nominal, &nominal.start()));
    let [Ok(with), Ok(without)] = forces else { return None };
    let of_phantoms = |column: &mut dyn Iterator<Item = f64>| {
        common(&phantom, column).iter().map(|x| x * x).sum::<f64>() / compared as f64
    };
    let apart = rms(&common(&both, with.iter().zip(&without).map(|(a, b)| a - b)));
    let effect = (apart * apart + of_phantoms(&mut with.iter().copied())).sqrt();
    let phantoms_n2 = of_phantoms(&mut as_recorded.drag_n.iter().zip(&with).map(|(drag, force)| drag - force));
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
    let whole_n2 = power(&with) + phantoms_n2;
    let power_n2 = whole_n2 - power(&without);
    if !(power_n2 > BETTER * whole_n2) {
        return None;
    }
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
    let wave = |(run, derived): (&Run, &Motion)| wave_m(run, run.velocity_m_s.as_ref()?, &derived.velocity_m_s);
    let wave_m = runs.iter().zip(&derived.motions).find_map(wave);
    let variance_m2_s2 = rms(&common(&both, apart.into_iter())).powi(2);
    let has_position = runs.iter().any(has_both);
    Some(SetAside { variance_m2_s2, power_n2, wave_m, has_position })
}

/// Rows of a rest in which the recorded speed says motion, and no more than its noise may say: within micrometres of a
/// turn a carriage creeps.
fn phantoms(as_recorded: &Side<'_>, as_derived: &Side<'_>) -> Vec<bool> {
    let is_small = as_recorded.runs.iter().flat_map(|run| {
        let velocity = run.velocity_m_s.as_deref();
        let most = STANDS_OUT * velocity.map_or(0.0, |velocity| noise(run, velocity));
        (0..run.len()).map(move |row| velocity.is_some_and(|velocity| velocity[row].abs() < most))
    });
    let rests = as_derived.contexts.iter().flat_map(|context| &context.at_rest);
    let rows = rests.zip(&as_recorded.compared).zip(is_small);
    rows.map(|((rests, moves), is_small)| *rests && *moves && is_small).collect()
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
