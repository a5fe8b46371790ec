//! Unnamed effects: curves fitted where no named cause explains the rest.
//!
//! An unnamed curve that explains what no named cause explains is an unknown cause. It is taken up beside the names
//! that still earn their place next to it, so that the error falls although the name is missing.

use simulation::curve::Axis;

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Beside, Candidate, Member};
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::rest::beyond;
use crate::fit::source::Source;
use crate::fit::spectrum::wavelength_m;
use crate::numbers::linear::remove;
use crate::numbers::statistics::{line, rms};
use crate::search::clock::Clocks;
use crate::search::holds::{Floor, is_relevant};
use crate::search::opening::{Asked, is_open, p_of};

/// An unnamed curve must lead by this many nats ..
const LEAD: f64 = 10.0;

/// .. and by this share of the evidence ..
const SHARE: f64 = 0.15;

/// .. or by this share where it replaces several names.
const SHARE_OF_MANY: f64 = 0.06;

/// Least logarithm of a clock's e-value: at periods of seconds whitening is least reliable. The noise of a real lead
/// screw reached 27, where clamps of half a percent of the drag had 55 and more.
const SURE_OF_CLOCK: f64 = 40.0;

/// The same while the noise estimate still contains all that repeats, so that the noise filter removes most of a clock.
const LIKELY_CLOCK: f64 = 20.0;

/// What the noise was estimated from.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum NoiseOf {
    /// Residual of curves along the axes, which still contains every clock.
    Curves,
    /// Residual of a search.
    Search,
}

/// Takes up curves as long as one explains clearly more than the names do. Returns the p-value of the surest, 1 without
/// any.
pub(crate) fn extend(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut Vec<Member>,
    floor: Floor,
    noise: NoiseOf,
) -> f64 {
    let clocks = Clocks::new(bench);
    let mut surest = 1.0f64;
    for _ in 0..2 {
        let Some((better, p)) = best(bench, pool, (clocks.as_ref(), noise), tolerances, members, floor) else {
            return surest;
        };
        *members = better;
        surest = surest.min(p);
    }
    surest
}

fn best(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    (clocks, noise): (Option<&Clocks>, NoiseOf),
    tolerances: &Tolerances<'_>,
    members: &[Member],
    floor: Floor,
) -> Option<(Vec<Member>, f64)> {
    let law = bench.fit(&bench.law());
    let now = bench.fit_members(members);
    let evidence = 0.5 * (law.rss - now.rss);
    let named = evidence - cost(bench, members);
    let mut found: Option<(f64, usize, Vec<Member>)> = None;
    // curves that lead beside the names, and curves that lead alone: a wrong name hides the curve it imitates
    let mut leading: Vec<usize> = Vec::new();
    for fit in [&now, &law] {
        let all = ranked(bench, &mut pool.stories, fit, tolerances);
        let nameless = all.iter().map(|(index, _)| *index).filter(|index| !has_names(&pool.stories[*index].source));
        leading.extend(nameless.take(4));
    }
    leading.sort_unstable();
    leading.dedup();
    let mut curves: Vec<(Candidate, usize)> =
        leading.into_iter().map(|index| (pool.stories[index].clone(), 1)).collect();
    if let Some(clocks) = clocks {
        let fits = &[&now, &law][..1 + usize::from(!members.is_empty())];
        let least = Clocks::cost(bench) - cost(bench, members) + LEAD.max(SHARE_OF_MANY * named);
        curves.extend(clocks.pointed_out(bench, fits, least).into_iter().map(|clock| (clock, clocks.tried())));
    }
    for (curve, tried) in curves {
        if members.iter().any(|member| member.candidate.source.is_kin(&curve.source)) {
            continue;
        }
        let mut with = members.to_vec();
        with.push(bench.take(curve));
        drop_superfluous(bench, &mut with);
        if !with.last().is_some_and(|last| last.candidate.source.is_story()) {
            continue;
        }
        let all = 0.5 * (law.rss - bench.fit_members(&with).rss);
        let score = all - cost(bench, &with);
        let replaced = (members.len() + 1).saturating_sub(with.len());
        let share = if replaced >= 2 { SHARE_OF_MANY } else { SHARE };
        if score > named + LEAD.max(share * all) && found.as_ref().is_none_or(|(best, ..)| score > *best) {
            found = Some((score, tried, with));
        }
    }
    let (_, tried, with) = found?;
    // the same two locks as for a name
    let Beside { others, own: candidate, gain, .. } = bench.beside(&with, with.len().checked_sub(1)?);
    let locks = bench.locks(&candidate, &gain, &others);
    let kinds = pool.kinds + pool.stories.len();
    let sure = if noise == NoiseOf::Search { SURE_OF_CLOCK } else { LIKELY_CLOCK };
    // what has no name is as large as what the law cannot take of it
    let own = bench.force(&candidate.source, &gain.amplitudes);
    let opens = is_relevant(bench, &candidate, &gain, floor)
        && rms(&beyond(&bench.rows, &bench.tangent, &own)) > floor.of(&candidate.source)
        && is_open(Asked::AllBlocks, &locks, kinds, tried)
        && (!is_clock(&candidate.source) || locks.ln_e > sure);
    opens.then(|| (with, p_of(Asked::AllBlocks, &locks, kinds, tried)))
}

/// Whether a source is a periodic curve over time.
pub(crate) fn is_clock(source: &Source) -> bool {
    matches!(source, Source::Story { curve } if curve.axis == Axis::Clock)
}

/// Whether the library has a cause for each column of a curve: a curve over direction is a constant and an asymmetry.
fn has_names(source: &Source) -> bool {
    matches!(source, Source::Story { curve } if curve.axis == Axis::Direction)
}

/// Cost of the members' freedom, nats.
fn cost(bench: &Bench<'_>, members: &[Member]) -> f64 {
    let freedom: usize = members.iter().map(|member| member.base.len() + member.candidate.source.shapes()).sum();
    0.5 * freedom as f64 * bench.ln_rows()
}

/// Drops names whose part the curve, which is last, has taken over.
fn drop_superfluous(bench: &Bench<'_>, members: &mut Vec<Member>) {
    let mut at = 0;
    while at + 1 < members.len() {
        if bench.beside(members, at).gain.score < 0.0 {
            members.remove(at);
        } else {
            at += 1;
        }
    }
}

/// A mismatch that comes and goes: no curve follows it, but the residual is not the same noise throughout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unsteady {
    /// p-value of "the same noise throughout".
    pub(crate) p: f64,
    /// Share of the residual's power that is coherent.
    pub(crate) share: f64,
}

/// Highest order of a wave that is removed from a residual before its coherence is examined.
const ORDERS: u32 = 8;

/// Whitened residual of a fit, less higher orders of the waves among the members: those stand out of the noise at some
/// speeds only, and would come and go with the speed.
pub(crate) fn rest_without_orders(bench: &Bench<'_>, fit: &Fit, members: &[Member]) -> Vec<f32> {
    let mut rest = bench.rest(fit);
    let waves = members.iter().filter_map(|member| match &member.candidate.source {
        source @ Source::Mechanism { definition, .. } => Some((*definition, wavelength_m(source)?)),
        _ => None,
    });
    let orders = waves.flat_map(|(definition, length_m)| {
        (2..=ORDERS).map(move |order| Source::Mechanism {
            definition,
            form: 0,
            shape: vec![length_m / f64::from(order)],
        })
    });
    let candidates = bench.candidates(orders);
    let columns: Vec<&[f32]> = candidates.iter().flat_map(|of| of.columns.iter()).map(Vec::as_slice).collect();
    if !columns.is_empty() {
        remove(&mut rest, &columns);
    }
    rest
}

/// Rows per window.
const WINDOW: usize = 64;

/// Lags at which coherence is examined, rows.
const LAGS: [usize; 4] = [1, 3, 8, 20];

/// Compares the coherence of a whitened residual between windows, within each part of the profile (`groups` of rows).
///
/// White noise of any level and tail has no correlation from row to row, and what whitening leaves of it is the same in
/// every window of a part. Clipping bounds the weight of single spikes. For every lag the correlations of the windows
/// have the variance 1/rows; more than that is a mismatch that comes and goes.
pub(crate) fn unsteady(rest: &[f32], groups: &[std::ops::Range<usize>]) -> Unsteady {
    let mut worst = Unsteady { p: 1.0, share: 0.0 };
    for lag in LAGS {
        let (mut scatter, mut freedom) = (0.0, 0.0f64);
        for group in groups {
            let correlations: Vec<f64> = rest[group.clone()]
                .as_chunks::<WINDOW>()
                .0
                .iter()
                .filter_map(|window| correlation(window, lag))
                .collect();
            let count = correlations.len() as f64;
            if count < 2.0 {
                continue;
            }
            let mean = correlations.iter().sum::<f64>() / count;
            scatter += correlations.iter().map(|c| (c - mean) * (c - mean)).sum::<f64>();
            freedom += count - 1.0;
        }
        if freedom < 30.0 {
            continue;
        }
        // Wilson and Hilferty: the cube root of a scaled chi squared is nearly normal
        let scatter = scatter / freedom;
        let spread = 2.0 / (9.0 * freedom);
        let z = (scatter.cbrt() - (1.0 - spread)) / spread.sqrt();
        let p = (0.5 * libm::erfc(z / std::f64::consts::SQRT_2) * LAGS.len() as f64).min(1.0);
        if p < worst.p {
            worst = Unsteady { p, share: ((scatter - 1.0).max(0.0) / WINDOW as f64).sqrt().min(1.0) };
        }
    }
    worst
}

/// Correlation of a window with itself `lag` rows later, scaled to variance 1 for white noise.
fn correlation(window: &[f32], lag: usize) -> Option<f64> {
    let clipped: Vec<f64> = window.iter().map(|x| f64::from(x.clamp(-3.0, 3.0))).collect();
    let power: f64 = clipped.iter().map(|x| x * x).sum();
    let product: f64 = clipped[lag..].iter().zip(&clipped).map(|(a, b)| a * b).sum();
    (power > 0.0).then(|| product / power * window.len() as f64 / ((window.len() - lag) as f64).sqrt())
}

/// A short formula for a curve, where one of four shapes with at most two free parameters follows its knots.
pub(crate) fn formula(source: &Source, amplitudes: &[f64]) -> Option<String> {
    let Source::Story { curve } = source else { return None };
    if curve.axis == Axis::Clock {
        return None;
    }
    let points: Vec<(f64, f64)> =
        curve.knots.iter().zip(amplitudes).filter(|(x, y)| **x > 0.0 && **y != 0.0).map(|(x, y)| (*x, *y)).collect();
    if points.len() < 4 {
        return None;
    }
    let sign = points[0].1.signum();
    let same_sign = points.iter().all(|(_, y)| y.signum() == sign);
    let ln = |x: f64| x.ln();
    let mut best: Option<(f64, String)> = None;
    let mut offer = |error: f64, text: String| {
        if error < 0.15 && best.as_ref().is_none_or(|(other, _)| error < *other) {
            best = Some((error, text));
        }
    };
    let (a, b, error) = line(&points);
    offer(error, format!("{a:.3e} + {b:.3e} x"));
    let (a, b, error) = line(&points.iter().map(|(x, y)| (ln(*x), *y)).collect::<Vec<_>>());
    offer(error, format!("{a:.3e} + {b:.3e} ln x"));
    if same_sign {
        let (a, b, error) = line(&points.iter().map(|(x, y)| (ln(*x), ln(y.abs()))).collect::<Vec<_>>());
        offer(error, format!("{:.3e} x^{b:.2}", sign * a.exp()));
        let (a, b, error) = line(&points.iter().map(|(x, y)| (*x, ln(y.abs()))).collect::<Vec<_>>());
        offer(error, format!("{:.3e} exp({b:.3e} x)", sign * a.exp()));
    }
    best.map(|(_, text)| text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::curve::{Carrier, Curve};

    #[test]
    fn bursts_are_unsteady_and_noise_of_changing_level_is_not() {
        let mut state = 11u64;
        let mut noise = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 33) as f64 / f64::from(1u32 << 31);
            }
            sum
        };
        let level: Vec<f32> = (0..20_000).map(|n| (noise() * (1.0 + f64::from(n) / 1e4)) as f32).collect();
        let steady = unsteady(&level, &[0..10_000, 10_000..20_000]);
        assert!(steady.p > 1e-4, "{steady:?}");
        // whitened: the level is 1 where it is noise
        let bursts: Vec<f32> = (0..20_000).map(|n| noise() as f32 + if n % 700 < 60 { 1.5 } else { 0.0 }).collect();
        let found = unsteady(&bursts, &[0..10_000, 10_000..20_000]);
        assert!(found.p < 1e-12 && found.share > 0.05, "{found:?}");
    }

    #[test]
    fn a_power_is_recognised() {
        let knots: Vec<f64> = (1..9).map(|n| f64::from(n) * 0.05).collect();
        let amplitudes: Vec<f64> = knots.iter().map(|v| 7.0 * v.powf(1.5)).collect();
        let source = Source::Story { curve: Curve { axis: Axis::Velocity, carrier: Carrier::Odd, knots } };
        assert_eq!(formula(&source, &amplitudes).as_deref(), Some("7.000e0 x^1.50"));
    }
}
