//! Calibration of the law's own parameters: how far it may move them, and where it has moved them.
//!
//! ```text
//! saturation   the residual of all curves
//! settle       the law beside the causes found
//! ```

pub(crate) mod saturation;
pub(crate) mod settle;

use simulation::Simulation;

use crate::calibration::saturation::Saturation;
use crate::calibration::settle::Valley;
use crate::fit::bench::Bench;
use crate::fit::loud;
use crate::fit::member::Member;
use crate::fit::source::Source;
use crate::fit::tone;
use crate::noise::rows::Rows;
use crate::nominal::{Nominal, Parameter};
use crate::recording::side::Side;

/// Most Gauss-Newton steps.
const MOST_STEPS: usize = 6;

/// Number of first steps at which the noise is estimated anew.
const LEARNT: usize = 2;

/// Relative step below which calibration ends.
const ENOUGH: f64 = 2e-3;

/// How far calibration may move a parameter, in standard deviations of its tolerance.
pub(crate) const TOLERATED: f64 = 3.0;

/// The law with its parameters moved.
pub(crate) struct Calibrated<'a> {
    pub(crate) values: Vec<f64>,
    pub(crate) side: Side<'a>,
    pub(crate) saturation: Saturation,
    /// Residual of all curves; one entry per row of all runs.
    pub(crate) left: Vec<f64>,
}

/// Moves the law alone as far as its tolerance allows (everything else is linearised around that point) and estimates
/// the noise on the way. Columns of mechanisms depend on the law, so whatever is derived from the runs is computed anew
/// where the simulation left parameters out.
pub(crate) fn calibrate<'a>(
    simulation: &Simulation,
    nominal: &Nominal,
    mut side: Side<'a>,
    rows: &mut Rows,
    training: &[bool],
) -> Result<Calibrated<'a>, String> {
    let mut values = nominal.start();
    let mut left = Vec::new();
    let mut tones = Vec::new();
    let mut wave: Vec<Vec<f64>> = Vec::new();
    let mut saturation = Saturation::new(rows, &side.contexts, training, &tones);
    for step in 0..MOST_STEPS {
        let mismatch = side.residual(nominal, &values)?;
        let tangent = side.tangent(nominal, &values)?;
        if step < LEARNT {
            let rest = |saturation: &Saturation, wave: &[Vec<f64>]| {
                saturation.rest(rows, &side.contexts, &mismatch, &tangent, wave)
            };
            left = rest(&saturation, &[]);
            if step == 0 {
                tones = tone::all(rows, &side.contexts, &left);
                if !tones.is_empty() {
                    saturation = Saturation::new(rows, &side.contexts, training, &tones);
                    left = rest(&saturation, &[]);
                }
                wave = loud::wave(rows, &side.contexts, &left, |wave| rest(&saturation, wave));
                if !wave.is_empty() {
                    saturation = saturation.beside(wave.clone());
                    left = rest(&saturation, &[]);
                }
            }
            rows.learn(&left, saturation.kept());
        }
        let flat = rows.flat(&mismatch);
        let bench = Bench::new(flat, &[], training.to_vec(), &mismatch, tangent, prior(nominal, &values));
        let next = tolerated(nominal, &bench, &values);
        let way = way(&values, &next);
        values = next;
        if step == 0 && nominal.is_incomplete() {
            side = side.again(simulation, nominal, &values)?;
            saturation = Saturation::new(rows, &side.contexts, training, &tones).beside(wave.clone());
        }
        if step + 1 >= LEARNT && way < ENOUGH {
            break;
        }
    }
    if nominal.is_incomplete() {
        side = side.again(simulation, nominal, &values)?;
        saturation = Saturation::new(rows, &side.contexts, training, &tones).beside(wave);
    } else if is_at_limit(nominal, &values) {
        // two parameters that compensate one another lead far along a linearisation: there may be a lower place on the
        // way
        let valley = Valley { nominal, side: &side, rows, training, causes: Vec::new() };
        let there = valley.bottom(&nominal.start())?;
        if !is_at_limit(nominal, &there.values) && there.left < valley.left(&values)? {
            values = there.values;
        }
    }
    Ok(Calibrated { values, side, saturation, left })
}

/// Values of the law with its tolerance loosened to a mere guess: the start of the search if calibration reached a
/// limit.
pub(crate) fn unbound(
    nominal: &Nominal,
    side: &Side<'_>,
    rows: &Rows,
    training: &[bool],
    values: &[f64],
) -> Result<Vec<f64>, String> {
    let mut values = values.to_vec();
    if !is_at_limit(nominal, &values) {
        return Ok(values);
    }
    for _ in 0..MOST_STEPS {
        let mismatch = side.residual(nominal, &values)?;
        let tangent = side.tangent(nominal, &values)?;
        let guess = prior(nominal, &values).into_iter().map(|(a, b)| (a / GUESS, b / GUESS)).collect();
        let bench = Bench::new(rows.flat(&mismatch), &[], training.to_vec(), &mismatch, tangent, guess);
        let next = moved(nominal, &values, &bench.fit(&bench.law()).values);
        let way = way(&values, &next);
        values = next;
        if way < ENOUGH {
            break;
        }
    }
    Ok(values)
}

/// Whether a parameter lies at the end of its tolerance, or beyond.
fn is_at_limit(nominal: &Nominal, values: &[f64]) -> bool {
    let is_at_its_own = |(value, parameter): (&f64, &Parameter)| {
        parameter.sigma.is_some_and(|sigma| value.abs() >= 0.9997 * TOLERATED * sigma)
    };
    values.iter().zip(&nominal.parameters).any(is_at_its_own)
}

/// Prior variance of a guess, as a multiple of the tolerance's variance.
const GUESS: f64 = 1e4;

/// Precision, and precision times mean ("pull"), of the prior of every parameter, relative to the values it was already
/// moved to.
pub(crate) fn prior(nominal: &Nominal, values: &[f64]) -> Vec<(f64, f64)> {
    nominal
        .parameters
        .iter()
        .zip(values)
        .map(|(parameter, value)| match parameter.sigma {
            Some(sigma) => {
                let precision = 1.0 / (sigma * sigma);
                (precision, -value * precision)
            }
            None => (0.0, 0.0),
        })
        .collect()
}

/// Steps to the two ends of the range of every parameter that the simulation leaves out; unlimited for the others.
pub(crate) fn room(nominal: &Nominal, values: &[f64]) -> Vec<(f64, f64)> {
    let of = |(parameter, value): (&Parameter, &f64)| match parameter.sigma {
        Some(_) => (f64::NEG_INFINITY, f64::INFINITY),
        None => (parameter.range.0 - value, parameter.range.1 - value),
    };
    nominal.parameters.iter().zip(values).map(of).collect()
}

/// Values after a Gauss-Newton step, every parameter within three standard deviations: what calibration alone may do. A
/// parameter that would go beyond is held at its limit, and the others are refitted beside it: clipping each on its own
/// would make the law worse than it was given where parameters compensate one another.
fn tolerated(nominal: &Nominal, bench: &Bench<'_>, values: &[f64]) -> Vec<f64> {
    let mut held = vec![None; values.len()];
    loop {
        let mut next = moved(nominal, values, &bench.step_beside(&held));
        let mut farthest: Option<(usize, f64)> = None;
        for (at, (value, parameter)) in next.iter_mut().zip(&nominal.parameters).enumerate() {
            let Some(limit) = parameter.sigma.map(|sigma| TOLERATED * sigma) else { continue };
            let beyond = value.abs() / limit;
            if held[at].is_none() && beyond > farthest.map_or(1.0, |(_, most)| most) {
                farthest = Some((at, beyond));
            }
            *value = value.clamp(-limit, limit);
        }
        match farthest {
            Some((at, _)) => held[at] = Some(next[at] - values[at]),
            None => return next,
        }
    }
}

/// Largest change of a parameter between two sets of values.
pub(crate) fn way(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max)
}

/// Values after a step.
pub(crate) fn moved(nominal: &Nominal, values: &[f64], step: &[f64]) -> Vec<f64> {
    nominal
        .parameters
        .iter()
        .zip(values.iter().zip(step))
        .map(|(parameter, (value, step))| parameter.moved(*value, *step))
        .collect()
}

/// Values including the shifts among the members.
pub(crate) fn shifted(nominal: &Nominal, values: &[f64], members: &[Member], amplitudes: &[Vec<f64>]) -> Vec<f64> {
    let mut values = values.to_vec();
    for (member, amplitudes) in members.iter().zip(amplitudes) {
        if let Source::Shift { parameter } = member.candidate.source {
            values[parameter] += amplitudes[0];
        }
    }
    debug_assert_eq!(values.len(), nominal.parameters.len());
    values
}
