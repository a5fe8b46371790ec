//! Spots that add friction where they are rolled over, at places that do not repeat: dirt in the contacts.
//!
//! No curve follows them, but each is short, all brake, and all have one length along the rail whatever the speed. An
//! electrical spike has one duration instead, and either sign.

use std::ops::Range;

use crate::noise::robust_sigma;
use crate::rest::rms;
use crate::sanity::quantum;
use crate::side::Side;

/// Standard deviations by which a row stands out.
const OUTSTANDING: f64 = 4.0;

/// Fewest spots that show a habit.
const FEWEST: usize = 12;

/// Spots that brake, over those that push, and how far beyond chance they are more, standard deviations.
const ONE_SIDED: f64 = 2.25;
const BEYOND_CHANCE: f64 = 2.9;

/// Rows of a spot from which its length is told.
const RESOLVED: usize = 3;

/// Spread of the logarithm of speed over the spots without which distance and time are one.
const SPREAD: f64 = 0.3;

/// Slope of the logarithm of duration over that of speed: -1 for one length, 0 for one duration. Rows as long as a spot
/// make it smaller.
const LIKE_LENGTH: f64 = -0.3;

/// Rows beside a spot that it still reaches into.
const MARGIN: usize = 2;

/// Travel to either side of a row over which the baseline of a spot is taken, m: several times its length.
const BASELINE_M: f64 = 4e-3;

/// Travel between two parts of one spot, m.
const JOINED_M: f64 = 5e-4;

/// Rows that a baseline is the median of, about.
const BASELINE_ROWS: usize = 30;

/// A positive number and the standard deviation of its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) relative: f64,
}

/// What the spots have in common.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spots {
    /// How many the block rolls over in a metre.
    pub(crate) per_m: Number,
    /// Length along the rail, m.
    pub(crate) length_m: Number,
    /// Height, N.
    pub(crate) force_n: Number,
    /// Squared force, summed over their rows, N².
    pub(crate) squares_n2: f64,
    /// p-value of as many spots that push as brake.
    pub(crate) p: f64,
    /// Rows that they reach, of all runs laid end to end.
    pub(crate) rows: Vec<bool>,
}

/// A row that stands out, and its neighbours that do.
struct Spot {
    rows: Range<usize>,
    speed_m_s: f64,
    time_s: f64,
    peak_n: f64,
}

/// Looks for spots in what no curve follows. `compared` and `left` have an entry a row of all runs.
pub(crate) fn spots(side: &Side<'_>, compared: &[bool], left: &[f64]) -> Option<Spots> {
    let (mut found, mut pushing, mut power, mut travel_m) = (Vec::new(), 0usize, 0.0, 0.0);
    let mut start = 0;
    for context in &side.contexts {
        let step_s = context.run.step_s();
        // one step of a channel that counts is nothing outstanding
        let step_n = 1.5 * quantum(&context.run.drag_force_n).unwrap_or(0.0);
        for part in &context.run.parts {
            let rows: Vec<usize> = part.rows.clone().filter(|n| compared[start + n]).collect();
            let braking: Vec<f64> = rows.iter().map(|n| left[start + n] * context.steady.direction[*n]).collect();
            let travel: Vec<f64> = rows.iter().map(|n| context.travel_m[*n]).collect();
            let braking = above_baseline(&braking, &travel);
            let limit = (OUTSTANDING * robust_sigma(&braking)).max(step_n);
            travel_m += rows.iter().map(|n| context.speed_m_s(*n) * step_s).sum::<f64>();
            pushing += outstanding(&braking, &travel, -1.0, limit).len();
            for spot in outstanding(&braking, &travel, 1.0, limit) {
                let speed = |n: &usize| context.speed_m_s(*n);
                power += braking[spot.clone()].iter().map(|x| x * x).sum::<f64>();
                found.push(Spot {
                    rows: start + rows[spot.start]..start + rows[spot.end - 1] + 1,
                    speed_m_s: rows[spot.clone()].iter().map(speed).sum::<f64>() / spot.len() as f64,
                    time_s: spot.len() as f64 * step_s,
                    peak_n: braking[spot].iter().copied().fold(0.0, f64::max),
                });
            }
        }
        start += context.run.len();
    }
    let (braking, pushing) = (found.len() as f64, pushing as f64);
    let is_one_sided = braking > ONE_SIDED * pushing && braking - pushing > BEYOND_CHANCE * (braking + pushing).sqrt();
    if found.len() < FEWEST || !is_one_sided {
        return None;
    }
    let ln = |of: &dyn Fn(&Spot) -> f64| -> Vec<f64> { found.iter().map(|s| of(s).max(1e-12).ln()).collect() };
    let (speeds, durations) = (ln(&|s| s.speed_m_s), ln(&|s| s.time_s));
    if spread(&speeds) < SPREAD || slope(&speeds, &durations) > LIKE_LENGTH {
        return None;
    }
    let is_any_resolved = found.iter().any(|spot| spot.rows.len() >= RESOLVED);
    let resolved = found.iter().filter(|spot| !is_any_resolved || spot.rows.len() >= RESOLVED);
    let lengths: Vec<f64> = resolved.map(|spot| (spot.speed_m_s * spot.time_s).max(1e-12).ln()).collect();
    let mut rows = vec![false; compared.len()];
    for spot in &found {
        let reach = spot.rows.len().max(MARGIN);
        rows[spot.rows.start.saturating_sub(reach)..(spot.rows.end + reach).min(compared.len())].fill(true);
    }
    Some(Spots {
        // as many as chance, and places without number, make of them
        per_m: Number { value: found.len() as f64 / travel_m.max(1e-9), relative: 1.0 / (found.len() as f64).sqrt() },
        length_m: typical(&lengths),
        force_n: typical(&found.iter().map(|spot| spot.peak_n.max(1e-12).ln()).collect::<Vec<_>>()),
        squares_n2: power,
        p: 0.5 * libm::erfc((braking - pushing) / (2.0 * (braking + pushing)).sqrt()),
        rows,
    })
}

/// Rows that stand out to one side; those that are next to each other, in rows or along the rail, are one spot.
fn outstanding(x: &[f64], travel_m: &[f64], side: f64, limit: f64) -> Vec<Range<usize>> {
    let mut spots: Vec<Range<usize>> = Vec::new();
    for n in (0..x.len()).filter(|n| side * x[*n] > limit) {
        match spots.last_mut() {
            Some(last) if n == last.end || travel_m[n] - travel_m[last.end - 1] < JOINED_M => last.end = n + 1,
            _ => spots.push(n..n + 1),
        }
    }
    spots
}

/// A signal less its running median over the travel around each row: what is longer than a spot, slow noise among it, is
/// no spot.
fn above_baseline(x: &[f64], travel_m: &[f64]) -> Vec<f64> {
    let (mut from, mut to) = (0, 0);
    let mut around = Vec::with_capacity(BASELINE_ROWS + 2);
    let mut above = Vec::with_capacity(x.len());
    for (n, here) in travel_m.iter().enumerate() {
        while from < n && here - travel_m[from] > BASELINE_M && n - from > BASELINE_ROWS / 2 {
            from += 1;
        }
        to = to.max(n);
        while to + 1 < x.len() && (travel_m[to + 1] - here <= BASELINE_M || to - n < BASELINE_ROWS / 2) {
            to += 1;
        }
        around.clear();
        around.extend(x[from..=to].iter().step_by((to - from) / BASELINE_ROWS + 1));
        around.sort_unstable_by(f64::total_cmp);
        above.push(x[n] - around[around.len() / 2]);
    }
    above
}

/// Median of numbers told by their logarithms; the median of normal numbers scatters by 1.25 times their mean's.
fn typical(logarithms: &[f64]) -> Number {
    let mut sorted = logarithms.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    Number { value: middle.exp(), relative: 1.25 * spread(logarithms) / (logarithms.len().max(1) as f64).sqrt() }
}

/// Slope of the straight line through points.
fn slope(x: &[f64], y: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len().max(1) as f64;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let along: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    along / x.iter().map(|x| (x - mean_x) * (x - mean_x)).sum::<f64>().max(1e-30)
}

/// Standard deviation.
fn spread(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    rms(&x.iter().map(|x| x - mean).collect::<Vec<_>>())
}
