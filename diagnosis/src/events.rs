//! Spots that add friction where they are rolled over, at places that do not repeat: dirt in the contacts.
//!
//! No curve follows them, but each is short, all brake, and all have one length along the rail whatever the speed. An
//! electrical spike has one duration instead, and either sign.

use std::ops::Range;

use crate::noise::robust_sigma;
use crate::rest::rms;
use crate::side::Side;

/// Standard deviations by which a row stands out.
const OUTSTANDING: f64 = 4.0;

/// Fewest spots that show a habit.
const FEWEST: usize = 20;

/// Spots that brake, over those that push.
const ONE_SIDED: usize = 6;

/// Rows of a spot from which its length is told.
const RESOLVED: usize = 3;

/// Spread of the logarithm of speed over the spots without which distance and time are one.
const SPREAD: f64 = 0.3;

/// Rows beside a spot that it still reaches into.
const MARGIN: usize = 2;

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
    /// Share of the squared mismatch.
    pub(crate) share: f64,
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

/// Looks for spots in what no curve follows. `compared`, `mismatch` and `left` have an entry a row of all runs.
pub(crate) fn spots(side: &Side<'_>, compared: &[bool], mismatch: &[f64], left: &[f64]) -> Option<Spots> {
    let (mut found, mut pushing, mut power, mut travel_m) = (Vec::new(), 0usize, 0.0, 0.0);
    let mut start = 0;
    for context in &side.contexts {
        let step_s = context.run.step_s();
        for part in &context.run.parts {
            let rows: Vec<usize> = part.rows.clone().filter(|n| compared[start + n]).collect();
            let braking: Vec<f64> = rows.iter().map(|n| left[start + n] * context.steady.direction[*n]).collect();
            let limit = OUTSTANDING * robust_sigma(&braking);
            travel_m += rows.iter().map(|n| context.speed_m_s(*n) * step_s).sum::<f64>();
            let side_of = |x: f64| if x > limit { 1 } else { -i32::from(x < -limit) };
            for spot in
                (0..rows.len()).collect::<Vec<_>>().chunk_by(|a, b| side_of(braking[*a]) == side_of(braking[*b]))
            {
                let (Some(first), Some(last)) = (spot.first(), spot.last()) else { continue };
                match side_of(braking[*first]) {
                    1 => {
                        power += spot.iter().map(|n| braking[*n] * braking[*n]).sum::<f64>();
                        found.push(Spot {
                            rows: start + rows[*first]..start + rows[*last] + 1,
                            speed_m_s: spot.iter().map(|n| context.speed_m_s(rows[*n])).sum::<f64>()
                                / spot.len() as f64,
                            time_s: spot.len() as f64 * step_s,
                            peak_n: spot.iter().map(|n| braking[*n]).fold(0.0, f64::max),
                        });
                    }
                    0 => {}
                    _ => pushing += 1,
                }
            }
        }
        start += context.run.len();
    }
    if found.len() < FEWEST || found.len() < ONE_SIDED * pushing {
        return None;
    }
    let resolved: Vec<&Spot> = found.iter().filter(|spot| spot.rows.len() >= RESOLVED).collect();
    let ln = |of: &dyn Fn(&Spot) -> f64| -> Vec<f64> { resolved.iter().map(|s| of(s).max(1e-12).ln()).collect() };
    let (lengths, durations) = (ln(&|s| s.speed_m_s * s.time_s), ln(&|s| s.time_s));
    let is_one_length = spread(&ln(&|s| s.speed_m_s)) > SPREAD && spread(&lengths) < spread(&durations);
    if resolved.len() < FEWEST / 2 || !is_one_length {
        return None;
    }
    let mut rows = vec![false; compared.len()];
    for spot in &found {
        let reach = spot.rows.len().max(MARGIN);
        rows[spot.rows.start.saturating_sub(reach)..(spot.rows.end + reach).min(compared.len())].fill(true);
    }
    let squares: f64 = mismatch.iter().zip(compared).filter(|(_, c)| **c).map(|(x, _)| x * x).sum();
    Some(Spots {
        // as many as chance, and places without number, make of them
        per_m: Number { value: found.len() as f64 / travel_m.max(1e-9), relative: 1.0 / (found.len() as f64).sqrt() },
        length_m: typical(&lengths),
        force_n: typical(&found.iter().map(|spot| spot.peak_n.max(1e-12).ln()).collect::<Vec<_>>()),
        share: (power / squares.max(1e-30)).min(1.0),
        rows,
    })
}

/// Median of numbers told by their logarithms; the median of normal numbers scatters by 1.25 times their mean's.
fn typical(logarithms: &[f64]) -> Number {
    let mut sorted = logarithms.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    Number { value: middle.exp(), relative: 1.25 * spread(logarithms) / (logarithms.len().max(1) as f64).sqrt() }
}

/// Standard deviation.
fn spread(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    rms(&x.iter().map(|x| x - mean).collect::<Vec<_>>())
}
