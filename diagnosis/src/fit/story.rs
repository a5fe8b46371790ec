//! Unnamed curves: what the mismatch looks like along each axis, whatever its cause.
//!
//! A curve is piecewise linear in the axis' value and multiplies one of three carriers: 1 (the same in both
//! directions), the direction of motion, the law's drag. Curves locate a mismatch, compete with the library (what only
//! a curve explains has no name here) and stand in for the unknown in the augmented simulation. This module states
//! which curves are tried, and what of them is free in a fit: one column per height.

use simulation::curve::{AddedCurve, Axis, Carrier, Curve};
use simulation::mechanism::Context;

/// Axes along which curves are tried: those of the contract along which a curve can lie.
const ALONG: [Axis; 12] = [
    Axis::Direction,
    Axis::Velocity,
    Axis::Load,
    Axis::Preload,
    Axis::Position,
    Axis::Time,
    Axis::Travel,
    Axis::Temperature,
    Axis::TemperatureDifference,
    Axis::Acceleration,
    Axis::ReversalDistance,
    Axis::Dwell,
];

/// Knots of the curve over the time since a turn, in rows.
const SINCE_TURN: [f64; 10] = [0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0, 34.0, 55.0];

/// Knots of a periodic curve.
pub(crate) const CLOCK_KNOTS: usize = 12;

/// Every curve that these runs can show. `compared`: rows of all runs, concatenated.
pub(crate) fn all(contexts: &[Context<'_>], compared: &[bool]) -> Vec<Curve> {
    let mut curves = Vec::new();
    for axis in ALONG {
        let mut values = Vec::new();
        let mut start = 0;
        for context in contexts {
            if let Some(column) = axis.values(context) {
                values.extend(column.iter().zip(&compared[start..]).filter(|(_, c)| **c).map(|(x, _)| *x));
            }
            start += context.run.len();
        }
        if axis == Axis::Direction {
            if values.contains(&1.0) && values.contains(&-1.0) {
                curves.push(Curve { axis, carrier: Carrier::Even, knots: Vec::new() });
            }
            continue;
        }
        if values.len() < 200 {
            continue;
        }
        let knots = knots(axis, &values);
        if knots.len() < 2 {
            continue;
        }
        let carriers: &[Carrier] = match axis {
            Axis::Position | Axis::Time | Axis::Load => &[Carrier::Even, Carrier::Odd, Carrier::Drag],
            Axis::Acceleration => &[Carrier::Even],
            Axis::Temperature | Axis::TemperatureDifference => &[Carrier::Odd, Carrier::Drag, Carrier::Even],
            Axis::Travel => &[Carrier::Odd, Carrier::Drag],
            _ => &[Carrier::Odd],
        };
        curves.extend(carriers.iter().map(|carrier| Curve { axis, carrier: *carrier, knots: knots.clone() }));
    }
    curves
}

/// Curve over the first rows after every turn: it keeps a channel's response to turns out of the noise. `None` where
/// the runs have no sampling period.
pub(crate) fn since_turn(contexts: &[Context<'_>]) -> Option<Curve> {
    let step_s = contexts.iter().map(|context| context.run.step_s()).fold(0.0, f64::max);
    let knots = SINCE_TURN.iter().map(|rows| rows * step_s).collect();
    (step_s > 0.0).then_some(Curve { axis: Axis::SinceTurn, carrier: Carrier::Drag, knots })
}

/// The curve of a period, s. Periods are found by spectrum, hence it is not among [`all`].
pub(crate) fn clock(period_s: f64, carrier: Carrier) -> Curve {
    repeating(period_s, CLOCK_KNOTS, carrier)
}

/// A periodic curve of the force itself for a period of `rows` rows, which limits its knots.
pub(crate) fn tone(period_s: f64, rows: usize) -> Curve {
    repeating(period_s, rows.clamp(6, CLOCK_KNOTS), Carrier::Even)
}

fn repeating(period_s: f64, count: usize, carrier: Carrier) -> Curve {
    let knots = (0..=count).map(|k| period_s * k as f64 / count as f64).collect();
    Curve { axis: Axis::Clock, carrier, knots }
}

/// Knots along an axis, from the distribution of these values.
fn knots(axis: Axis, values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (Some(first), Some(last)) = (sorted.first().copied(), sorted.last().copied()) else { return Vec::new() };
    let span = last - first;
    let uniform = |count: usize| (0..=count).map(|k| first + span * k as f64 / count as f64).collect();
    let quantiles = |count: usize| {
        let mut knots: Vec<f64> = (0..=count).map(|k| sorted[(sorted.len() - 1) * k / count]).collect();
        knots.dedup_by(|b, a| *b - *a <= 0.02 * span);
        knots
    };
    match axis {
        Axis::Direction | Axis::Clock | Axis::SinceTurn => Vec::new(),
        Axis::ReversalDistance => vec![0.0, 2e-5, 5e-5, 1e-4, 2e-4, 4e-4, 1e-3],
        Axis::Dwell => vec![0.0, 0.3, 1.0, 3.0, 10.0, 100.0, 1000.0],
        Axis::Position => uniform(24),
        Axis::Time => uniform(12),
        Axis::Travel => uniform(8),
        Axis::Velocity | Axis::Load | Axis::Preload => {
            // geometric: friction changes with the logarithm of these
            let low = sorted[sorted.len() / 50].max(1e-3 * last.abs());
            if !(low > 0.0) || last / low < 1.05 {
                return Vec::new();
            }
            let count = ((last / low).ln() / 0.45).ceil().clamp(2.0, 9.0) as usize;
            (0..=count).map(|k| low * (last / low).powf(k as f64 / count as f64)).collect()
        }
        Axis::Temperature | Axis::TemperatureDifference if span < 0.3 => Vec::new(),
        Axis::Temperature | Axis::TemperatureDifference => quantiles(5),
        Axis::Acceleration => quantiles(6),
    }
}

/// One column per free height, over the rows of one run; zeros where the run does not show the axis. For the axis of
/// direction the columns are 1 and the drag.
pub(crate) fn columns(curve: &Curve, context: &Context<'_>) -> Vec<Vec<f64>> {
    let rows = context.run.len();
    if curve.axis == Axis::Direction {
        return vec![vec![1.0; rows], context.steady.drag_n.clone()];
    }
    let mut columns = vec![vec![0.0; rows]; curve.knots.len()];
    curve.each(context, |row, low, [below, above]| {
        columns[low][row] = below;
        columns[low + 1][row] = above;
    });
    if let Some(idle) = idle_knot(curve) {
        columns.remove(idle);
    }
    if curve.axis == Axis::Clock
        && let (Some(end), [start, ..]) = (columns.pop(), columns.as_mut_slice())
    {
        start.iter_mut().zip(end).for_each(|(start, end)| *start += end);
    }
    columns
}

/// Number of columns.
pub(crate) fn count(curve: &Curve) -> usize {
    match curve.axis {
        Axis::Direction => 2,
        Axis::Clock => curve.knots.len() - 1,
        _ => curve.knots.len() - usize::from(idle_knot(curve).is_some()),
    }
}

/// Subtracts the curve with these amplitudes, one per column, from a force over the rows of one run.
pub(crate) fn take_from(curve: &Curve, context: &Context<'_>, amplitudes: &[f64], force: &mut [f64]) {
    if let (Axis::Direction, [even, drag]) = (curve.axis, amplitudes) {
        for (force, own) in force.iter_mut().zip(&context.steady.drag_n) {
            *force -= even + drag * own;
        }
        return;
    }
    let heights = heights(curve, amplitudes);
    curve.each(context, |row, low, [below, above]| force[row] -= below * heights[low] + above * heights[low + 1]);
}

/// The curve with these amplitudes, one per column, as entries of a simulation file.
///
/// Along the direction the even column has the same height at both ends; the drag, which is unsigned, has heights of
/// opposite sign.
pub(crate) fn added(curve: &Curve, amplitudes: &[f64]) -> Vec<AddedCurve> {
    if let (Axis::Direction, [even, drag]) = (curve.axis, amplitudes) {
        let of = |carrier, heights: [f64; 2]| AddedCurve {
            curve: Curve { axis: Axis::Direction, carrier, knots: vec![-1.0, 1.0] },
            heights: heights.to_vec(),
        };
        return vec![of(Carrier::Even, [*even; 2]), of(Carrier::Drag, [-drag, *drag])];
    }
    vec![AddedCurve { curve: curve.clone(), heights: heights(curve, amplitudes) }]
}

/// Height at every knot.
fn heights(curve: &Curve, amplitudes: &[f64]) -> Vec<f64> {
    let mut heights = amplitudes.to_vec();
    if let Some(idle) = idle_knot(curve) {
        heights.insert(idle, 0.0);
    }
    if curve.axis == Axis::Clock {
        heights.extend(heights.first().copied());
    }
    heights
}

/// Index of the knot fixed at 0: far from a reversal, or without a preceding rest, no effect of either is left.
fn idle_knot(curve: &Curve) -> Option<usize> {
    match curve.axis {
        Axis::ReversalDistance | Axis::SinceTurn => Some(curve.knots.len() - 1),
        Axis::Dwell => Some(0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::source::{Source, raw_columns, weighted};
    use simulation::Simulation;
    use simulation::motion::Motion;
    use simulation::run::{Break, Part, Run};

    const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\n[lubricant]\nviscosity_cst = 100.0\n";

    /// To and fro with rests, at varying speeds, with everything measured.
    fn run() -> Run {
        let time_s: Vec<f64> = (0..12_000).map(|n| 3.0 + 0.01 * f64::from(n)).collect();
        let column = |of: fn(f64) -> f64| Some(time_s.iter().map(|t| of(*t)).collect::<Vec<f64>>());
        let speed = |t: f64| if t % 10.0 < 2.5 { 0.0 } else { 0.003 * t * (1.3 * t).sin() };
        let mut x = 0.0;
        let mut moved = |t: &f64| {
            x += 0.01 * speed(*t);
            x
        };
        Run {
            drag_force_n: vec![0.0; time_s.len()],
            position_m: Some(time_s.iter().map(&mut moved).collect()),
            velocity_m_s: column(speed),
            preload_n: column(|t| 2000.0 + 20.0 * t),
            external_load_n: column(|t| 100.0 + t),
            temperature_block_degc: column(|t| 20.0 + 0.1 * t),
            temperature_rail_degc: column(|t| if t < 40.0 { f64::NAN } else { 20.0 + 0.03 * t }),
            parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        }
    }

    #[test]
    fn the_file_has_the_force_of_every_curve_that_the_search_may_take_up() {
        let (simulation, run) = (Simulation::from_toml(GUIDE).expect("legal"), run());
        let motion = Motion::of(&run);
        let contexts = [Context::of(&simulation, &run, &motion).expect("complete")];
        let tried = all(&contexts, &vec![true; run.len()]);
        let along = |axis: Axis| tried.iter().find(|curve| curve.axis == axis).unwrap_or_else(|| panic!("{axis:?}"));
        assert!(along(Axis::Direction).knots.is_empty());
        let mut curves = vec![along(Axis::Direction).clone()];
        for carrier in Carrier::ALL {
            curves.extend(ALONG[1..].iter().map(|axis| Curve { carrier, ..along(*axis).clone() }));
            curves.push(clock(7.3, carrier));
            curves.push(Curve { carrier, ..since_turn(&contexts).expect("rows of a time") });
        }
        assert_eq!(curves.len(), 1 + 3 * (Axis::ALL.len() - 1));
        for curve in curves {
            let amplitudes: Vec<f64> = (0..count(&curve)).map(|k| (1.0 + 2.3 * k as f64).sin()).collect();
            let written = Simulation { curves: added(&curve, &amplitudes), ..simulation.clone() };
            let file = Simulation::from_toml(&written.to_toml()).expect("legal");
            assert_eq!(file, written, "{curve:?}");
            let mut force = vec![0.0; run.len()];
            for own in file.beside_law_n(&contexts[0]) {
                force.iter_mut().zip(own).for_each(|(sum, x)| *sum += x);
            }
            let mut rest = force.clone();
            take_from(&curve, &contexts[0], &amplitudes, &mut rest);
            let fitted =
                weighted(&raw_columns(&Source::Story { curve: curve.clone() }, &contexts).unwrap(), &amplitudes);
            let size = fitted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            assert!(size > 0.1, "{curve:?}");
            // at rest nothing is compared
            for n in (0..run.len()).filter(|n| contexts[0].steady.direction[*n] != 0.0) {
                assert!((force[n] - fitted[n]).abs() < 1e-9 * size && rest[n].abs() < 1e-9 * size, "{n} {curve:?}");
            }
        }
    }
}
