//! Hold-out: rows that no step of the search sees, and the score on them.

use simulation::run::Run;

use crate::noise::rows::Rows;
use crate::numbers::statistics::rms;
use crate::report::Holdout;

/// Which rows are held out, and the description of that choice.
pub(crate) struct Split {
    /// One entry per row of all runs.
    pub(crate) held: Vec<bool>,
    pub(crate) description: String,
    /// Whether the scored runs are others than the training runs.
    pub(crate) crosses_runs: bool,
    /// Intervals of held rows.
    pub(crate) intervals: Vec<Interval>,
}

/// Consecutive rows of a run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Interval {
    run: usize,
    /// Start and end, s from the first row of the run.
    span_s: [f64; 2],
}

/// One in so many runs, parts or blocks is held out.
const ONE_IN: usize = 4;

/// Length of a held-out block of time, s.
const BLOCK_S: f64 = 5.0;

impl Split {
    /// Nothing is held out: other files are scored.
    pub(crate) fn none(rows: usize) -> Self {
        Split { held: vec![false; rows], description: String::new(), crosses_runs: true, intervals: Vec::new() }
    }

    /// By whole runs, else by parts of a test profile, else by blocks of time. The choice depends on clock and profile
    /// alone, not on any force.
    pub(crate) fn of(runs: &[Run]) -> Self {
        let mut held = Vec::new();
        if runs.len() >= 3 {
            let count = (runs.len() / ONE_IN).max(1);
            let chosen: Vec<usize> = (0..count).map(|k| (2 * k + 1) * runs.len() / (2 * count)).collect();
            for (n, run) in runs.iter().enumerate() {
                held.resize(held.len() + run.len(), chosen.contains(&n));
            }
            let names: Vec<String> = chosen.iter().map(|n| name(runs, *n)).collect();
            let description = format!("{} of {} runs set aside: {}", count, runs.len(), names.join(", "));
            return Split::with(runs, held, description, true);
        }
        let parts: usize = runs.iter().map(|run| run.profile_parts().len()).sum();
        if parts >= 2 * ONE_IN {
            let mut index = 0;
            for run in runs {
                let start = held.len();
                held.resize(start + run.len(), false);
                for rows in run.profile_parts() {
                    if index % ONE_IN == ONE_IN / 2 {
                        held[start + rows.start..start + rows.end].fill(true);
                    }
                    index += 1;
                }
            }
            let description = format!("every {ONE_IN}th segment set aside, {} of {parts}", (parts + 1) / ONE_IN);
            return Split::with(runs, held, description, false);
        }
        let total: f64 = runs.iter().map(|run| run.step_s() * run.len() as f64).sum();
        let block = BLOCK_S.min(total / 16.0);
        for run in runs {
            let first = run.time_s.first().copied().unwrap_or(0.0);
            held.extend(run.time_s.iter().map(|t| ((t - first) / block) as usize % ONE_IN == ONE_IN / 2));
        }
        Split::with(runs, held, format!("every {ONE_IN}th block of {block:.3} s set aside"), false)
    }

    fn with(runs: &[Run], held: Vec<bool>, description: String, crosses_runs: bool) -> Self {
        let intervals = intervals(runs, &held);
        Split { held, description, crosses_runs, intervals }
    }
}

fn name(runs: &[Run], n: usize) -> String {
    match runs[n].name.as_str() {
        "" => format!("run {}", n + 1),
        name => name.to_owned(),
    }
}

/// Intervals of held rows.
pub(crate) fn intervals(runs: &[Run], held: &[bool]) -> Vec<Interval> {
    let (mut intervals, mut start) = (Vec::new(), 0);
    for (of, run) in runs.iter().enumerate() {
        let first = run.time_s.first().copied().unwrap_or(0.0);
        let mut open = None;
        for n in 0..run.len() {
            let is_held = held.get(start + n).copied().unwrap_or(false);
            match (is_held, open) {
                (true, None) => open = Some(n),
                (false, Some(from)) => {
                    intervals.push(Interval { run: of, span_s: [run.time_s[from] - first, run.time_s[n - 1] - first] });
                    open = None;
                }
                _ => {}
            }
        }
        if let (Some(from), Some(last)) = (open, run.time_s.last()) {
            intervals.push(Interval { run: of, span_s: [run.time_s[from] - first, last - first] });
        }
        start += run.len();
    }
    intervals
}

/// Residuals of the three stages over the rows of all scored runs.
pub(crate) struct Stages {
    pub(crate) before: Vec<f64>,
    pub(crate) calibrated: Vec<f64>,
    pub(crate) after: Vec<f64>,
}

/// Scores the stages on these rows, `step_s` apart, which are those of `intervals`. Without rows nothing is scored.
pub(crate) fn score(stages: &Stages, rows: &Rows, intervals: &[Interval], step_s: f64, seed: u64) -> Holdout {
    if rows.len() == 0 {
        return Holdout::default();
    }
    let (calibrated, after) = (rows.plain(&stages.calibrated), rows.plain(&stages.after));
    Holdout {
        rmse_before_n: rms(&rows.plain(&stages.before)),
        rmse_calibrated_n: rms(&calibrated),
        rmse_after_n: rms(&after),
        improvement_ci95: interval(&calibrated, &after, step_s, seed),
        intervals_s: intervals.iter().map(|interval| interval.span_s).collect(),
        intervals_of: intervals.iter().map(|interval| interval.run).collect(),
        ..Holdout::default()
    }
}

/// Draws of the bootstrap.
const DRAWS: usize = 1000;

/// Block bootstrap of the improvement, 95 % interval: whole blocks are drawn, because errors of neighbouring rows are
/// correlated.
fn interval(calibrated: &[f64], after: &[f64], step_s: f64, seed: u64) -> [f64; 2] {
    let length = ((BLOCK_S / step_s) as usize).min(calibrated.len() / 20).max(1);
    let sum = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let blocks: Vec<[f64; 2]> =
        calibrated.chunks(length).zip(after.chunks(length)).map(|(c, a)| [sum(c), sum(a)]).collect();
    if blocks.is_empty() {
        return [0.0, 0.0];
    }
    let mut random = SplitMix(seed ^ 0x9e37_79b9_7f4a_7c15);
    let mut draws: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (mut calibrated, mut after) = (0.0, 0.0);
            for _ in 0..blocks.len() {
                let [c, a] = blocks[(random.next() % blocks.len() as u64) as usize];
                calibrated += c;
                after += a;
            }
            if calibrated > 0.0 { 1.0 - (after / calibrated).sqrt() } else { 0.0 }
        })
        .collect();
    draws.sort_unstable_by(f64::total_cmp);
    [draws[DRAWS * 25 / 1000], draws[DRAWS * 975 / 1000 - 1]]
}

/// Steele, Lea and Flood 2014.
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::run::{Break, Part};

    fn run(parts: i64) -> Run {
        Run {
            time_s: (0..1000).map(|n| f64::from(n) * 0.1).collect(),
            drag_force_n: vec![0.0; 1000],
            parts: (0..parts)
                .map(|n| {
                    let length = 1000 / parts as usize;
                    Part {
                        rows: n as usize * length..(n as usize + 1) * length,
                        segment: Some(n),
                        starts: Break::Segment,
                    }
                })
                .collect(),
            ..Run::default()
        }
    }

    #[test]
    fn runs_go_before_segments_and_segments_before_blocks() {
        let by_run = Split::of(&vec![run(1); 12]);
        assert_eq!(by_run.held.iter().filter(|h| **h).count(), 3000);
        assert!(by_run.crosses_runs && by_run.description.contains("3 of 12 runs"));
        let by_part = Split::of(&[run(10)]);
        assert!(by_part.held[200] && !by_part.held[0] && by_part.held[600], "{}", by_part.description);
        let by_block = Split::of(&[run(1)]);
        let intervals = intervals(&[run(1)], &by_block.held);
        assert!(intervals.len() >= 4 && intervals[0].span_s[0] >= 9.9, "{intervals:?}");
    }

    #[test]
    fn the_interval_covers_the_improvement() {
        let rows = 4000;
        let wave = |k: f64| (0..rows).map(|n| (n as f64 * k).sin()).collect::<Vec<f64>>();
        let (calibrated, after) = (wave(0.3), wave(0.7).iter().map(|x| 0.5 * x).collect::<Vec<_>>());
        let [low, high] = interval(&calibrated, &after, 0.01, 1);
        assert!(low < 0.5 && 0.5 < high && high - low < 0.05, "{low} {high}");
    }
}
