//! Play of a few micrometres, passed within the rows around a reversal that are not compared because the speed is not
//! resolved there. The force is resolved: it is 0 up to a certain travel after the reversal and the law's full force
//! beyond it.
//!
//! ```text
//! r = F/F_law      empty: |r| < 1/4      full: |r - 1| < 0.3
//! ```
//!
//! Presliding passes through every share in between, and starts from the previous force. A delayed force is delayed by
//! a time: the travel at which it becomes full differs between slow and fast reversals.

use std::collections::BTreeSet;

use simulation::mechanism::Context;

use crate::numbers::statistics::median;
use crate::recording::side::Side;

/// Travel after a reversal within which play is searched for, m.
const FARTHEST_M: f64 = 2e-4;

/// Travel below which no encoder shows that the carriage has moved, m.
const LEAST_M: f64 = 3e-7;

/// Least force of the law, as a multiple of the noise from row to row, for a row to be judged empty or full.
const STANDS_OUT: f64 = 12.0;

/// Limits for an empty and for a full row, as shares of the law's force.
const EMPTY: f64 = 0.25;
const FULL: f64 = 0.3;

/// Least share of rows before the edge that are empty, and of rows in the range beyond it that are full; and that
/// range, in multiples of the gap: the gap closes over some of its length, and a spring, which is empty at first as
/// well, would not be full there.
const SHARP: f64 = 0.85;
const BEYOND: [f64; 2] = [1.7, 5.0];

/// Fewest reversals with an empty row.
const FEWEST: usize = 5;

/// Rows on the wrong side of the best edge in time, in excess of those of the best edge in travel, that are needed to
/// tell the two apart.
const TOLD: usize = 5;

/// Rows on the wrong side that an edge may have in excess of the best edge and still lie in the interval.
const WORSE: usize = 2;

/// Play that the force shows.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Gap {
    /// Travel without force, m, and its interval.
    pub(crate) gap_m: f64,
    pub(crate) ci95_m: [f64; 2],
    /// p-value of so many empty rows by chance.
    pub(crate) p: f64,
}

/// One row after a reversal.
#[derive(Clone, Copy, Debug)]
struct Row {
    turn: usize,
    travel_m: f64,
    since_s: f64,
    share: f64,
}

impl Row {
    fn is_empty(&self) -> bool {
        self.share.abs() < EMPTY
    }

    fn is_full(&self) -> bool {
        (self.share - 1.0).abs() < FULL
    }
}

/// Searches for play, except in rows that are `held` back. `simulated_n`: force of the simulation; both have one entry
/// per row of all runs.
pub(crate) fn gap(side: &Side<'_>, simulated_n: &[f64], held: &[bool]) -> Option<Gap> {
    of_rows(&rows(side, simulated_n, held))
}

/// Rows after reversals, by increasing travel.
fn rows(side: &Side<'_>, simulated_n: &[f64], held: &[bool]) -> Vec<Row> {
    let (mut rows, mut turn, mut start) = (Vec::new(), 0, 0);
    for context in &side.contexts {
        let own = start..start + context.len();
        start = own.end;
        let (drag_n, simulated_n, held) = (&side.drag_n[own.clone()], &simulated_n[own.clone()], &held[own]);
        let pairs = drag_n.windows(2).zip(held).filter(|(_, held)| !**held);
        let steps = pairs.map(|(pair, _)| (pair[1] - pair[0]).abs()).filter(|step| step.is_finite());
        let noise_n = median(steps.collect()).unwrap_or(0.0);
        let since_m = context.since_push_m();
        let mut turned_s = f64::NAN;
        for n in 0..context.len() {
            if n == 0 || since_m[n] < since_m[n - 1] {
                turn += 1;
                turned_s = context.run.time_s[n.saturating_sub(1)];
            }
            let is_known = !held[n] && is_under_way(context, n) && drag_n[n].is_finite();
            let is_told = is_known && simulated_n[n].abs() > STANDS_OUT * noise_n;
            if is_told && (LEAST_M..FARTHEST_M).contains(&since_m[n]) {
                let since_s = context.run.time_s[n] - turned_s;
                rows.push(Row { turn, travel_m: since_m[n], since_s, share: drag_n[n] / simulated_n[n] });
            }
        }
    }
    rows.sort_by(|a, b| a.travel_m.total_cmp(&b.travel_m));
    rows
}

/// Whether the carriage moves into a row and out of it: at rest there is no friction force, whatever a simulation's
/// column says.
fn is_under_way(context: &Context<'_>, row: usize) -> bool {
    let moves = |row: usize| (context.travel_m[row] - context.travel_m[row - 1]).abs() > LEAST_M;
    !context.at_rest[row] && row > 0 && row + 1 < context.len() && moves(row) && moves(row + 1)
}

/// `rows`: by increasing travel.
fn of_rows(rows: &[Row]) -> Option<Gap> {
    let wrong = wrong(rows);
    let least = wrong.iter().copied().min()?;
    let edge_m = |at: usize| {
        let before = if at == 0 { LEAST_M } else { rows[at - 1].travel_m };
        0.5 * (before + rows.get(at).map_or(FARTHEST_M, |row| row.travel_m))
    };
    let best = wrong.iter().position(|wrong| *wrong == least)?;
    let gap_m = edge_m(best);
    let (before, behind) = rows.split_at(best);
    let [near_m, far_m] = BEYOND.map(|of| of * gap_m);
    let beyond: Vec<&Row> = behind.iter().filter(|row| (near_m..far_m).contains(&row.travel_m)).collect();
    let empty: Vec<&Row> = before.iter().filter(|row| row.is_empty()).collect();
    let full = beyond.iter().filter(|row| row.is_full()).count();
    let is_sharp = empty.len() as f64 >= SHARP * before.len() as f64 && full as f64 >= SHARP * beyond.len() as f64;
    let turns = empty.iter().map(|row| row.turn).collect::<BTreeSet<usize>>().len();
    let mut in_time = rows.to_vec();
    in_time.sort_by(|a, b| a.since_s.total_cmp(&b.since_s));
    let is_travel = self::wrong(&in_time).into_iter().min()? >= least + TOLD;
    if !is_sharp || !is_travel || turns < FEWEST || beyond.len() < FEWEST {
        return None;
    }
    let may_be = |at: &usize| wrong[*at] <= least + WORSE;
    let from = (0..wrong.len()).find(may_be).map_or(gap_m, edge_m);
    let to = (0..wrong.len()).rev().find(may_be).map_or(gap_m, edge_m);
    // rate of empty rows beyond the edge: the chance level
    let rate = (1 + beyond.iter().filter(|row| row.is_empty()).count()) as f64 / (2 + beyond.len()) as f64;
    Some(Gap { gap_m, ci95_m: [from, to], p: rate.powi(turns as i32) })
}

/// Rows on the wrong side of an edge before each row, and after the last.
fn wrong(rows: &[Row]) -> Vec<usize> {
    let mut wrong = vec![rows.iter().filter(|row| row.is_empty()).count()];
    for row in rows {
        let before = wrong[wrong.len() - 1];
        wrong.push(if row.is_empty() { before - 1 } else { before + 1 });
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reversals, each with another acceleration, at 200 rows per second; given: the share of the force by travel and
    /// time.
    fn reversals(share: impl Fn(f64, f64) -> f64) -> Vec<Row> {
        let mut rows = Vec::new();
        for turn in 0..40 {
            let acceleration = 0.02 * 1.12f64.powi(turn as i32);
            for row in 1..40 {
                let since_s = (f64::from(row) - 0.025 * turn as f64) / 200.0;
                let travel_m = 0.5 * acceleration * since_s * since_s;
                if (LEAST_M..FARTHEST_M).contains(&travel_m) {
                    rows.push(Row { turn, travel_m, since_s, share: share(travel_m, since_s) });
                }
            }
        }
        rows.sort_by(|a, b| a.travel_m.total_cmp(&b.travel_m));
        rows
    }

    #[test]
    fn a_travel_without_force_is_play_and_what_is_late_or_rises_is_none() {
        for gap_m in [2e-6, 5e-6, 2e-5] {
            let found = of_rows(&reversals(|x, _| f64::from(x > gap_m))).expect("it is sharp");
            assert!(found.ci95_m[0] < gap_m && gap_m < found.ci95_m[1] && found.p < 1e-6, "{gap_m}: {found:?}");
            assert!((found.gap_m / gap_m - 1.0).abs() < 0.1, "{gap_m}: {found:?}");
        }
        for late_s in [0.005, 0.01, 0.02] {
            assert_eq!(of_rows(&reversals(|_, t| f64::from(t > late_s))), None, "late by {late_s}");
        }
        for length_m in [1e-6, 3e-6, 1e-5, 1e-4] {
            assert_eq!(of_rows(&reversals(|x, _| 1.0 - 2.0 * (-x / length_m).exp())), None, "presliding {length_m}");
            assert_eq!(of_rows(&reversals(|x, _| 1.0 - (-x / length_m).exp())), None, "spring {length_m}");
        }
        assert_eq!(of_rows(&reversals(|_, _| 1.0)), None);
        // where all reversals are alike, travel and time cannot be told apart
        let alike = |turn| (1..30).map(move |n| (turn, 1e-6 * f64::from(n * n), 0.005 * f64::from(n)));
        let rows: Vec<Row> = (0..40)
            .flat_map(alike)
            .filter(|row| row.1 < FARTHEST_M)
            .map(|(turn, travel_m, since_s)| Row { turn, travel_m, since_s, share: f64::from(travel_m > 5e-6) })
            .collect();
        assert_eq!(of_rows(&rows), None);
    }
}
