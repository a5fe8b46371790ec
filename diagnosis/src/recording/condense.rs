//! Condensing: long recordings as averages of neighbouring rows, so that a day of samples costs no more than minutes of
//! them.
//!
//! Averages of `k` rows keep everything slower than `k` samples; noise falls by `sqrt(k)`. Rows of two parts are never
//! averaged together: what is left over at the end of a part is dropped. A force that mostly stays on one quantisation
//! step in some part is not averaged but decimated to every `k`th row: a mean of steps is no step.

use std::ops::Range;

use simulation::run::{Part, Run};

use crate::numbers::rounding::quantum;

/// Number of rows of all runs together above which they are averaged. Up to it, law and causes are computed row by row,
/// and what is too much for the search is averaged afterwards, by [`crate::noise::rows`]: averages of a motion blur
/// reversals, and the play within them.
const MOST_ROWS: usize = 240_000;

/// Longest averaging time here, s: where the speed changes within it, the law of the averages is no longer the average
/// of the law. What is still too much is averaged after evaluation of law and causes, by [`crate::noise::rows`].
const LONGEST_S: f64 = 0.04;

/// Number of rows averaged to one.
pub(crate) fn factor(runs: &[Run]) -> usize {
    let step_s = runs.iter().map(Run::step_s).filter(|step| *step > 0.0).fold(0.0, f64::max);
    let longest = if step_s > 0.0 { (LONGEST_S / step_s).max(1.0) as usize } else { 1 };
    runs.iter().map(Run::len).sum::<usize>().div_ceil(MOST_ROWS).clamp(1, longest)
}

/// The run with every `factor` rows averaged to one.
pub(crate) fn condensed(run: &Run, factor: usize) -> Run {
    let mut chunks: Vec<Range<usize>> = Vec::with_capacity(run.len() / factor);
    let mut parts = Vec::with_capacity(run.parts.len());
    for part in &run.parts {
        let first = chunks.len();
        let whole = part.rows.len() / factor;
        chunks.extend((0..whole).map(|k| part.rows.start + k * factor).map(|start| start..start + factor));
        if chunks.len() > first {
            parts.push(Part { rows: first..chunks.len(), ..part.clone() });
        }
    }
    let one: fn(&[f64]) -> f64 = if stays_on_steps(run) { middle_row } else { mean_of_told };
    let averaged = |column: &Vec<f64>| -> Vec<f64> { chunks.iter().map(|rows| one(&column[rows.clone()])).collect() };
    let optional = |column: &Option<Vec<f64>>| column.as_ref().map(averaged);
    Run {
        name: run.name.clone(),
        time_s: averaged(&run.time_s),
        drag_force_n: averaged(&run.drag_force_n),
        position_m: optional(&run.position_m),
        velocity_m_s: optional(&run.velocity_m_s),
        acceleration_m_s2: optional(&run.acceleration_m_s2),
        preload_n: optional(&run.preload_n),
        external_load_n: optional(&run.external_load_n),
        temperature_block_degc: optional(&run.temperature_block_degc),
        temperature_rail_degc: optional(&run.temperature_rail_degc),
        temperature_ambient_degc: optional(&run.temperature_ambient_degc),
        simulated_force_n: optional(&run.simulated_force_n),
        parts,
    }
}

/// Whether the force stays on its quantisation steps in most rows of some part.
fn stays_on_steps(run: &Run) -> bool {
    let is_still = |part: &Part| {
        let still = run.drag_force_n[part.rows.clone()].windows(2).filter(|pair| pair[0] == pair[1]).count();
        2 * still > part.rows.len()
    };
    run.parts.iter().any(is_still) && quantum(&run.drag_force_n).is_some()
}

fn middle_row(values: &[f64]) -> f64 {
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Mean of the finite values, relative to the first, so that no digits are lost to a large offset.
fn mean_of_told(values: &[f64]) -> f64 {
    let Some(first) = values.iter().find(|x| x.is_finite()) else { return f64::NAN };
    let (mut sum, mut count) = (0.0, 0usize);
    for x in values.iter().filter(|x| x.is_finite()) {
        sum += x - first;
        count += 1;
    }
    first + sum / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::run::Break;

    #[test]
    fn steps_of_a_channel_stay_steps() {
        let force: Vec<f64> = (0..4000).map(|n| ((f64::from(n) * 0.01).sin() * 4.0).round() * 1.5).collect();
        let part = Part { rows: 0..4000, segment: None, starts: Break::Start };
        let run = Run {
            time_s: (0..4000).map(f64::from).collect(),
            drag_force_n: force.clone(),
            parts: vec![part],
            ..Run::default()
        };
        let short = condensed(&run, 4);
        assert_eq!(short.drag_force_n[7], force[30]);
        assert_eq!(short.time_s[7], 30.0);
        assert!((quantum(&short.drag_force_n).expect("still steps") - 1.5).abs() < 1e-12);
    }

    #[test]
    fn a_part_that_stays_on_steps_speaks_for_its_channel() {
        let force: Vec<f64> =
            (0..6000).map(|n| if n < 2000 { f64::from(n / 40) } else { f64::from(n * 7919 % 5) }).collect();
        let part = |rows| Part { rows, segment: None, starts: Break::Start };
        let run = Run {
            time_s: (0..6000).map(f64::from).collect(),
            drag_force_n: force,
            parts: vec![part(0..2000), part(2000..6000)],
            ..Run::default()
        };
        assert_eq!(condensed(&run, 3).drag_force_n.iter().filter(|x| x.fract() != 0.0).count(), 0);
    }

    #[test]
    fn parts_are_averaged_apart() {
        let part = |rows, starts| Part { rows, segment: None, starts };
        let run = Run {
            time_s: (0..10).map(f64::from).collect(),
            drag_force_n: (0..10).map(|n| 1e6 + f64::from(n)).collect(),
            preload_n: Some(vec![f64::NAN, 1.0, f64::NAN, f64::NAN, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]),
            parts: vec![part(0..5, Break::Start), part(5..6, Break::Segment), part(6..10, Break::Gap)],
            ..Run::default()
        };
        let short = condensed(&run, 2);
        assert_eq!(short.time_s, [0.5, 2.5, 6.5, 8.5]);
        assert_eq!(short.drag_force_n[3], 1e6 + 8.5);
        let preload = short.preload_n.expect("kept");
        assert!(preload[0] == 1.0 && preload[1].is_nan() && preload[2] == 7.5);
        assert_eq!(short.parts.iter().map(|p| p.rows.clone()).collect::<Vec<_>>(), [0..2, 2..4]);
        assert_eq!(short.parts[1].starts, Break::Gap);
    }
}
