//! Parts of a run, found by its clock and its segments; a row with a senseless time belongs to no part.

use simulation::run::{Break, Part};

use super::columns::Places;
use super::{Cost, Fault, Losses};

/// Steps longer than this many median steps are gaps.
const GAP_STEPS: f64 = 1.5;

/// Parts of the rows with a sensible time, s, and for every row whether it is one of those; empty where all are. Losses
/// count and name the other rows, gaps and jumps.
///
/// `segment`: one number a row, NaN where there is none. No part without a row.
pub(super) fn split(
    time: &[f64],
    segment: Option<&[f64]>,
    places: &Places,
    losses: &mut Losses,
) -> (Vec<Part>, Vec<bool>) {
    let number = |row: usize| segment.map(|s| s[row]).filter(|s| !s.is_nan()).map(|s| s as i64);
    let Some(steps) = Steps::of(time, segment) else { return (Vec::new(), Vec::new()) };
    let mut is_kept: Vec<bool> = Vec::new();
    let mut parts = vec![Part { rows: 0..0, segment: number(0), starts: Break::Start }];
    let (mut kept, mut before, mut jumped) = (1, 0, false);
    let mut row = 1;
    while row < time.len() {
        if segment.is_none() && is_kept.is_empty() && steps.are_even {
            // the rest has no gap or jump
            kept += time.len() - row;
            break;
        }
        let (from_s, to_s, step_s) = (time[before], time[row], steps.median_s(row));
        let place = || places.place(row);
        let mut drop = |fault, losses: &mut Losses| {
            if is_kept.is_empty() {
                is_kept = vec![true; time.len()];
            }
            is_kept[row] = false;
            losses.reject(place(), Some("time_s"), fault);
        };
        // the row after, where it may say which of the two before it is wrong
        let after_s = (row + 1 < time.len() && number(row + 1) == number(row)).then(|| time[row + 1]);
        let starts = if number(row) != number(before) {
            Some(Break::Segment)
        } else if to_s == from_s {
            drop(Fault::TimeRepeated { time_s: to_s }, losses);
            row += 1;
            continue;
        } else if let Some(after_s) = after_s
            && after_s > from_s
            && (to_s < from_s || to_s > after_s)
            && after_s - from_s <= (GAP_STEPS + 1.0) * step_s
        {
            drop(Fault::TimeOutOfOrder { from_s, time_s: to_s, to_s: after_s }, losses);
            row += 1;
            continue;
        } else if to_s < from_s && jumped {
            drop(Fault::TimeBackward { from_s, to_s }, losses);
            row += 1;
            continue;
        } else if to_s < from_s {
            jumped = true;
            losses.note(place(), Some("time_s"), Fault::ClockJump { from_s, to_s }, Cost::AsSaid);
            Some(Break::ClockJump)
        } else if to_s - from_s > GAP_STEPS * step_s {
            losses.gaps += 1;
            let fault = Fault::Gap { missing_s: to_s - from_s - step_s, step_s };
            losses.note(place(), Some("time_s"), fault, Cost::AsSaid);
            Some(Break::Gap)
        } else {
            None
        };
        if let Some(starts) = starts {
            if let Some(last) = parts.last_mut() {
                last.rows.end = kept;
            }
            parts.push(Part { rows: kept..kept, segment: number(row), starts });
        }
        (kept, before) = (kept + 1, row);
        row += 1;
    }
    if let Some(last) = parts.last_mut() {
        last.rows.end = kept;
    }
    (parts, is_kept)
}

/// The steps of time within segments.
struct Steps {
    /// Where a segment ends and the median of those of its steps that rise. Each has its own: a profile may be recorded
    /// faster where more happens.
    medians: Vec<(usize, f64)>,
    /// Whether none is a gap and all rise.
    are_even: bool,
}

impl Steps {
    /// `None` without a row.
    fn of(time: &[f64], segment: Option<&[f64]>) -> Option<Self> {
        time.first()?;
        let mut steps = Steps { medians: Vec::new(), are_even: true };
        let mut from = 0;
        while from < time.len() {
            let end = match segment {
                Some(segment) => {
                    let other = |number: &f64| *number != segment[from] && !(number.is_nan() && segment[from].is_nan());
                    segment[from..].iter().position(other).map_or(time.len(), |rows| from + rows)
                }
                None => time.len(),
            };
            let step_s = steps.median(&time[from..end]);
            steps.medians.push((end, step_s));
            from = end;
        }
        Some(steps)
    }

    /// The median of one segment; anything between its shortest and its longest where that decides nothing.
    fn median(&mut self, time: &[f64]) -> f64 {
        let steps = || time.windows(2).map(|w| w[1] - w[0]);
        let (least, most) =
            steps().fold((f64::INFINITY, 0.0f64), |(least, most), step| (least.min(step), most.max(step)));
        // the median lies between: no need to look for it
        if least > 0.0 && most <= GAP_STEPS * least {
            return least;
        }
        self.are_even = false;
        let mut rising: Vec<f64> = steps().filter(|step| *step > 0.0).collect();
        let middle = rising.len() / 2;
        if rising.is_empty() { f64::INFINITY } else { *rising.select_nth_unstable_by(middle, f64::total_cmp).1 }
    }

    /// Usual step of the segment of a row.
    fn median_s(&self, row: usize) -> f64 {
        let segment = self.medians.partition_point(|(end, _)| *end <= row);
        self.medians.get(segment).map_or(f64::INFINITY, |(_, step_s)| *step_s)
    }
}
