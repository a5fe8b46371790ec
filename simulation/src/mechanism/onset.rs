//! When the carriage begins to move, and when it stops, between two rows.
//!
//! Friction is there as soon as anything moves, and a channel that is late or filtered shows that step for rows to come. A
//! derived speed does not tell its time: its window sees the motion before it begins. The place does, for a carriage
//! leaves its rest as a power of time, the second where its acceleration jumps and the third where only its jerk does.
//!
//! ```text
//! d(t) = c (t - t0)^p    d1, d2, d3: distance from the place of rest in three rows, Δt apart
//! t1 - t0 = Δt/((d2/d1)^(1/p) - 1)    p: 2 or 3, whichever foretells d3
//! ```

use std::ops::Range;

use crate::motion::Motion;
use crate::run::Run;

/// Fewest rows of a rest.
const FEWEST: usize = 3;

/// Distance from the place of rest from which a row is used, as a multiple of the scatter there and of the scale's step.
const CLEAR: f64 = 4.0;

/// Most rows beside a rest, as the law sees it, among which the carriage must have left it.
const NEAR: usize = 12;

/// Rows at either end of a rest, as the law sees it, in which the carriage may move: less than the law's slowest motion.
const UNSEEN: usize = 2;

/// Starts and stops of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Onsets {
    /// Whether the carriage moves; one entry per row.
    pub(crate) moves: Vec<bool>,
    /// Share of the step to a row at which the carriage begins to move, or stops; NaN where it does neither. One entry per
    /// row.
    shares: Vec<f32>,
}

impl Onsets {
    /// `direction`: sign of the law's motion, 0 at rest.
    pub(crate) fn of(run: &Run, motion: &Motion, direction: &[f64]) -> Self {
        let moves: Vec<bool> = direction.iter().map(|sign| *sign != 0.0).collect();
        let mut onsets = Onsets { shares: vec![f32::NAN; moves.len()], moves };
        if run.position_m.is_none() {
            return onsets;
        }
        let step_m = step_m(&motion.position_m);
        for part in &run.parts {
            for rest in rests(direction, part.rows.clone()) {
                let is_near = |n: &usize| direction[*n] != 0.0;
                let behind: Vec<usize> = (rest.end..part.rows.end).take(NEAR).take_while(is_near).collect();
                if let Some(time) = leaves(run, motion, (&rest, step_m), &behind) {
                    let from = rest.end.saturating_sub(UNSEEN).max(rest.start);
                    onsets.set(run, time, from..rest.end + behind.len(), true);
                }
                let before: Vec<usize> = (part.rows.start..rest.start).rev().take(NEAR).take_while(is_near).collect();
                if let Some(time) = leaves(run, motion, (&rest, step_m), &before) {
                    let to = (rest.start + UNSEEN).min(rest.end);
                    onsets.set(run, time, rest.start - before.len()..to, false);
                }
            }
        }
        onsets
    }

    /// Share of the step to this row at which the carriage begins to move, or stops; `None` where it does neither.
    pub(crate) fn share(&self, row: usize) -> Option<f64> {
        Some(self.shares[row]).filter(|share| !share.is_nan()).map(f64::from)
    }

    /// The carriage begins to move, or stops, at this time, s, among these rows.
    fn set(&mut self, run: &Run, time_s: f64, rows: Range<usize>, starts: bool) {
        for n in rows.clone() {
            self.moves[n] = (run.time_s[n] > time_s) == starts;
        }
        let first = rows.clone().find(|n| run.time_s[*n] > time_s).unwrap_or(rows.end);
        let (Some(from), Some(to)) = (first.checked_sub(1).map(|n| run.time_s[n]), run.time_s.get(first)) else {
            return;
        };
        if *to > from {
            self.shares[first] = ((time_s - from) / (to - from)).clamp(0.0, 1.0) as f32;
        }
    }
}

/// Rests among these rows.
fn rests(direction: &[f64], rows: Range<usize>) -> Vec<Range<usize>> {
    let (mut rests, mut from) = (Vec::new(), None);
    for n in rows.clone().chain(std::iter::once(rows.end)) {
        let is_at_rest = n < rows.end && direction[n] == 0.0;
        match (is_at_rest, from) {
            (true, None) => from = Some(n),
            (false, Some(start)) => {
                if n - start >= FEWEST {
                    rests.push(start..n);
                }
                from = None;
            }
            _ => {}
        }
    }
    rests
}

/// Step of the scale, m: the least by which two places in a row differ.
fn step_m(places_m: &[f64]) -> f64 {
    let steps = places_m.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let least = steps.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

/// When the carriage leaves its rest, s, on a scale of such steps, m: `beside` are the rows that follow it, the nearest
/// first. Of the rows before it, backwards, when it came to it.
fn leaves(run: &Run, motion: &Motion, (rest, step_m): (&Range<usize>, f64), beside: &[usize]) -> Option<f64> {
    let x = &motion.position_m;
    let count = rest.len() as f64;
    let place = rest.clone().map(|n| x[n]).sum::<f64>() / count;
    let scatter = (rest.clone().map(|n| (x[n] - place).powi(2)).sum::<f64>() / count).sqrt();
    let away: Vec<f64> = beside.iter().map(|n| (x[*n] - place).abs()).collect();
    let first = away.iter().position(|d| *d > CLEAR * scatter.max(step_m))?;
    let ([n1, n2, _], [d1, d2, d3]) = (beside.get(first..first + 3)?, away.get(first..first + 3)?) else { return None };
    let step_s = run.time_s[*n2] - run.time_s[*n1];
    if !(*d1 > 0.0 && d2 > d1 && d3 > d2) || step_s == 0.0 {
        return None;
    }
    let of = |power: i32, root: fn(f64) -> f64| {
        let since_s = step_s / (root(d2 / d1) - 1.0);
        let foretold = d1 * ((since_s + 2.0 * step_s) / since_s).powi(power);
        (since_s, (foretold / d3 - 1.0).abs())
    };
    let (two, three) = (of(2, f64::sqrt), of(3, libm::cbrt));
    Some(run.time_s[*n1] - if two.1 < three.1 { two.0 } else { three.0 })
}

#[cfg(test)]
mod tests {
    use crate::Simulation;
    use crate::run::{Break, Part};

    use super::*;

    const STEP_S: f64 = 5e-3;

    /// A carriage that leaves its rest at `start_s` and comes to the next at `stop_s`, as a power of time, its place
    /// known to `quantum_m`: the times at which it is seen to start and to stop, in rows.
    fn seen(power: f64, [start_s, stop_s]: [f64; 2], quantum_m: f64) -> [f64; 2] {
        let rows = 400;
        let middle_s = 0.5 * (start_s + stop_s);
        let half_m = 2.0 * (middle_s - start_s).powf(power);
        let place = |t: f64| {
            if t < middle_s {
                2.0 * (t - start_s).max(0.0).powf(power)
            } else {
                2.0 * half_m - 2.0 * (stop_s - t).max(0.0).powf(power)
            }
        };
        let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * STEP_S).collect();
        let run = Run {
            position_m: Some(time_s.iter().map(|t| (place(*t) / quantum_m).round() * quantum_m).collect()),
            drag_force_n: vec![0.0; rows],
            parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        };
        let motion = Motion::of(&run);
        let law = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[operation]\npreload_n = 3000\n";
        let direction = Simulation::from_toml(law).expect("a legal file").direction(&motion);
        let onsets = Onsets::of(&run, &motion, &direction);
        let jumps = (0..rows).filter_map(|n| onsets.share(n).map(|share| n as f64 - 1.0 + share)).collect::<Vec<f64>>();
        let moving = onsets.moves.iter().filter(|moves| **moves).count() as f64;
        assert!((moving - (jumps[1] - jumps[0])).abs() <= 1.0, "{moving} rows between {jumps:?}");
        jumps.try_into().expect("one start and one stop")
    }

    #[test]
    fn a_start_and_a_stop_are_seen_between_rows_whether_the_acceleration_jumps_or_the_jerk_does() {
        for power in [2.0, 3.0] {
            for share in [0.1, 0.5, 0.9] {
                let rows = [100.0 + share, 300.0 - share];
                for (quantum_m, within) in [(1e-9, 0.02), (1e-7, 0.15)] {
                    let seen = seen(power, rows.map(|row| row * STEP_S), quantum_m);
                    let off = (seen[0] - rows[0]).abs().max((seen[1] - rows[1]).abs());
                    assert!(off < within, "power {power}, {quantum_m} m: {seen:?} for {rows:?}");
                }
            }
        }
    }
}
