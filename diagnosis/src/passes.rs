//! The search, and again around where it has led, with the noise as it looks behind what was found.

use simulation::Simulation;
use simulation::file::PositionReference;
use simulation::mechanism::Id;

use crate::adequacy::{Doubt, doubts};
use crate::bench::{Bench, Beside, Fit, Member};
use crate::calibration::{moved, prior, shifted, way};
use crate::considered;
use crate::edges::Edges;
use crate::equivalents::{self, Set};
use crate::finding::id_of;
use crate::nominal::Nominal;
use crate::open_set;
use crate::pool::{Pool, Tolerances};
use crate::report::Considered;
use crate::rest::{noise_rms, rms, shares, whiteness};
use crate::rows::Rows;
use crate::sanity::quantum;
use crate::saturation::Saturation;
use crate::search::{self, Floor, search};
use crate::settle::Valley;
use crate::side::Side;
use crate::source::Source;

/// A cause whose force is smaller than this share of the noise is not worth a mention.
const FLOOR_OF_NOISE: f64 = 0.05;

/// Way of the parameters, relative, from which the law is made linear anew.
const FAR: f64 = 0.03;

/// Difference of the variance of the whitened rest from 1 from which the noise is learnt anew.
const COLOURED: f64 = 0.1;

/// Rows that stand out which say nothing of the noise behind what was found.
const FEW_TAILS: usize = 10;

/// Share of what all causes explain together, in square, below which one is not named: four of five such names were
/// false on the development sets.
pub(crate) const LEAST_SHARE: f64 = 0.002;

/// Rounding, of the noise (in which it is), from which it is a fault of the channel; a channel that noise carries over
/// its steps has none.
const COARSE: f64 = 0.35;

/// The same for one with little evidence of its own beside the others.
const LEAST_SHARE_OF_SMALL: f64 = 0.035;

/// Most searches.
const MOST_PASSES: usize = 3;

/// A pool of causes and the noise that it was whitened for: the next search may find both as it needs them.
pub(crate) type Kept = Option<(Rows, Pool)>;

/// What the search has led to.
pub(crate) struct Found<'s> {
    pub(crate) bench: Bench<'s>,
    pub(crate) members: Vec<Member>,
    /// Why a member only stands in for what has no name.
    pub(crate) doubts: Vec<Option<Doubt>>,
    /// What the recording cannot tell from each member.
    pub(crate) sets: Vec<Set>,
    /// What else was considered.
    pub(crate) considered: Vec<Considered>,
    pub(crate) fit: Fit,
    /// Values of the law's numbers beside the members, and with the shifts among them.
    pub(crate) calibrated: Vec<f64>,
    pub(crate) with_shifts: Vec<f64>,
    pub(crate) p_no_mismatch: f64,
    pub(crate) noise_n: f64,
    /// What neither the members nor any curve follows, row by row of all runs.
    pub(crate) left: Vec<f64>,
    /// Step in which the force channel counts, N, where that is a good part of the noise.
    pub(crate) coarse_step_n: Option<f64>,
}

impl Found<'_> {
    /// Whether the law's own numbers are off, and nothing else.
    pub(crate) fn is_shift_only(&self) -> bool {
        !self.members.is_empty() && self.members.iter().all(|m| matches!(m.candidate.source, Source::Shift { .. }))
    }

    /// Amplitudes of every member.
    pub(crate) fn amplitudes(&self) -> Vec<Vec<f64>> {
        amplitudes(&self.members, &self.fit)
    }
}

fn amplitudes(members: &[Member], fit: &Fit) -> Vec<Vec<f64>> {
    members.iter().map(|member| member.base.iter().map(|column| fit.value_of(*column)).collect()).collect()
}

/// What a search is about, beside the rows.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'s> {
    pub(crate) side: &'s Side<'s>,
    pub(crate) saturation: &'s Saturation,
    /// Shapes of a resonance that the spectrum points to; `None` where the speed is too noisy for one: what it makes of the
    /// acceleration rings at any frequency.
    pub(crate) ringing: Option<&'s [Vec<f64>]>,
    /// Travel since the force has turned from which on rows are compared, m: what play of the coupling leaves to be seen.
    pub(crate) seen_from_m: f64,
    /// What starts and stops tell of the time between motion and force.
    pub(crate) edges: Option<Edges>,
}

/// Searches as often as it takes.
pub(crate) fn run<'s>(
    simulation: &Simulation,
    nominal: &Nominal,
    scene: Scene<'s>,
    mut rows: Rows,
    training: &[bool],
    start: &[f64],
    kept: &mut Kept,
) -> Result<Found<'s>, String> {
    let Scene { side, saturation, ringing, .. } = scene;
    let drag_rms = rms(&rows.plain(&side.drag_n));
    // in which the force channel counts
    let step_n = side.runs.iter().filter_map(|run| quantum(&run.drag_force_n)).max_by(f64::total_cmp);
    let mut values = start.to_vec();
    for pass in 1.. {
        let mismatch = side.residual(nominal, &values)?;
        let tangent = side.tangent(nominal, &values)?;
        let tolerances = Tolerances { nominal, moved: &values };
        let mut bench = around(simulation, nominal, scene, &rows, training, &values)?;
        let mut pool = match kept.take().filter(|(of, _)| of.whiten_alike(&rows)) {
            Some((_, pool)) => pool.again(&bench, &tolerances),
            None => Pool::new(&bench, &tolerances, &saturation.curves, ringing),
        };
        let noise = noise_rms(&rows, &saturation.rest(&rows, &side.contexts, &mismatch, &tangent, &[]));
        let rounding_n = step_n.map_or(0.0, |step| step / 12.0f64.sqrt());
        // what derivatives leave of calibration cannot be told from a cause
        let inexact_n = nominal.error_of_derivatives() * calibrated_n(nominal, side, &rows, &mismatch)?;
        let any_n = (simulation.tolerance.relevance * drag_rms).max(FLOOR_OF_NOISE * noise).max(inexact_n);
        let is_coarse = rounding_n > COARSE * noise;
        // a force that stays within one step is off by up to half of it, always to the same side
        let floor = Floor { any_n, rounding_n: if is_coarse { 3.0f64.sqrt() * rounding_n } else { rounding_n } };
        let first = search(&mut bench, &mut pool, &tolerances, floor);
        let mut members = first.members;
        let p_of_curve = open_set::extend(&mut bench, &mut pool, &tolerances, &mut members, floor);
        let fit = bench.fit_members(&members);
        let mut extra = Vec::new();
        for member in &members {
            extra.extend(bench.raw(&member.candidate.source).unwrap_or_default());
        }
        let left = saturation.rest(&rows, &side.contexts, &mismatch, &tangent, &extra);
        let led = led(nominal, side, &rows, training, &bench, &members, &values)?;
        let mut learnt = None;
        if pass < 2 && !members.is_empty() {
            let mut anew = rows.clone();
            anew.learn(&left);
            let is_coloured = (whiteness(&bench, &fit) - 1.0).abs() > COLOURED;
            // what stood out is explained, and may count in full
            let is_tamed = rows.tails() > FEW_TAILS && 2 * anew.tails() < rows.tails();
            learnt = (is_coloured || is_tamed).then_some(anew);
        }
        if pass < MOST_PASSES && (led.is_some() || learnt.is_some()) {
            *kept = Some((rows.clone(), pool));
            if let Some(learnt) = learnt {
                rows = learnt;
            }
            values = led.unwrap_or(values);
            continue;
        }
        let noise_n = noise_rms(&rows, &left);
        drop_small(&bench, &mut members);
        let mut doubts = doubted(&mut bench, &mut pool, &tolerances, &mut members, floor);
        // no further search, but what was found is to be true where it leads the law to
        if let Some(led) = self::led(nominal, side, &rows, training, &bench, &members, &values)? {
            values = led;
            bench = around(simulation, nominal, scene, &rows, training, &values)?;
            pool = pool.again(&bench, &Tolerances { nominal, moved: &values });
            members = again(&mut bench, members);
        }
        let tolerances = Tolerances { nominal, moved: &values };
        let mut sets = tell_apart(&mut bench, &mut pool, &tolerances, &mut members, &doubts, is_coarse);
        let equivalents: Vec<String> =
            sets.iter().flat_map(|set| &set.candidates).map(|candidate| id_of(&candidate.source)).collect();
        let considered = considered::of(&bench, &mut pool, &tolerances, &members, &equivalents);
        let mut fit = bench.fit_members(&members);
        let mut calibrated = moved(nominal, &values, &fit.values[..values.len()]);
        let is_shift_only = members.iter().all(|member| matches!(member.candidate.source, Source::Shift { .. }));
        if !nominal.is_incomplete()
            && !is_shift_only
            && is_worse(nominal, side, &bench, &members, &fit, (&calibrated, start))?
        {
            // where law and causes make up for one another, straight lines lead nowhere: the law stays where it was
            bench = around(simulation, nominal, scene, &rows, training, start)?;
            members = again(&mut bench, members);
            fit = bench.fit_beside_law(&members);
            // what would pull the wrong way there is not there
            let acts: Vec<bool> =
                members.iter().map(|member| member.base.iter().any(|column| fit.active.contains(column))).collect();
            keep(&mut members, &acts);
            keep(&mut doubts, &acts);
            keep(&mut sets, &acts);
            calibrated = start.to_vec();
        }
        let with_shifts = shifted(nominal, &calibrated, &members, &amplitudes(&members, &fit));
        let p_no_mismatch = first.p_no_mismatch.min(p_of_curve).min(p_of_surest(&bench, &pool, &members));
        *kept = Some((rows, pool));
        return Ok(Found {
            bench,
            members,
            doubts,
            sets,
            considered,
            fit,
            calibrated,
            with_shifts,
            p_no_mismatch,
            noise_n,
            left,
            coarse_step_n: step_n.filter(|_| is_coarse),
        });
    }
    Err("the search did not end".to_owned())
}

/// Where the law comes to rest beside the members; `None` where that is near enough for straight lines.
fn led(
    nominal: &Nominal,
    side: &Side<'_>,
    rows: &Rows,
    training: &[bool],
    bench: &Bench<'_>,
    members: &[Member],
    values: &[f64],
) -> Result<Option<Vec<f64>>, String> {
    let is_far = |there: &[f64]| !nominal.is_incomplete() && way(values, there) > FAR;
    let fit = bench.fit_members(members);
    let straight =
        shifted(nominal, &moved(nominal, values, &fit.values[..values.len()]), members, &amplitudes(members, &fit));
    if !is_far(&straight) {
        return Ok(None);
    }
    let valley = Valley { nominal, side, rows, training, members };
    Ok(Some(valley.settled(values)?).filter(|there| is_far(there)))
}

/// Whether the law moved to where it was led, with the members, is farther from the force than the law alone at `start`.
fn is_worse(
    nominal: &Nominal,
    side: &Side<'_>,
    bench: &Bench<'_>,
    members: &[Member],
    fit: &Fit,
    (led, start): (&[f64], &[f64]),
) -> Result<bool, String> {
    let amplitudes = amplitudes(members, fit);
    let mut left = side.residual(nominal, &shifted(nominal, led, members, &amplitudes))?;
    let causes = members.iter().zip(&amplitudes).filter(|(m, _)| !matches!(m.candidate.source, Source::Shift { .. }));
    for (member, amplitudes) in causes {
        let force = bench.force(&member.candidate.source, amplitudes);
        left.iter_mut().zip(force).for_each(|(left, force)| *left -= force);
    }
    Ok(rms(&bench.rows.plain(&left)) > rms(&bench.rows.plain(&side.residual(nominal, start)?)))
}

/// Those that are said to be kept.
fn keep<T>(all: &mut Vec<T>, is_kept: &[bool]) {
    let mut is_kept = is_kept.iter();
    all.retain(|_| is_kept.next().copied().unwrap_or(true));
}

/// The same members on another bench of the same rows: a shift is a column of the law there, all else stays as it is.
fn again(bench: &mut Bench<'_>, members: Vec<Member>) -> Vec<Member> {
    let one = |Member { mut candidate, .. }: Member| {
        if let Source::Shift { .. } = candidate.source {
            candidate = bench.candidate(candidate.source.clone()).unwrap_or(candidate);
        }
        candidate.forget();
        bench.take(candidate)
    };
    members.into_iter().map(one).collect()
}

/// The mismatch around the law at some values.
fn around<'s>(
    simulation: &Simulation,
    nominal: &Nominal,
    Scene { side, seen_from_m, edges, .. }: Scene<'s>,
    rows: &Rows,
    training: &[bool],
    values: &[f64],
) -> Result<Bench<'s>, String> {
    let mismatch = side.residual(nominal, values)?;
    let tangent = side.tangent(nominal, values)?;
    let mut bench =
        Bench::new(rows.clone(), &side.contexts, training.to_vec(), &mismatch, tangent, prior(nominal, values));
    bench.is_relative = simulation.axis.position_reference == PositionReference::Relative;
    bench.seen_from_m = seen_from_m;
    bench.edges = edges;
    bench.largest = rows.white(&side.drag_n).iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
    Ok(bench)
}

/// RMS force that calibration has changed, N.
fn calibrated_n(nominal: &Nominal, side: &Side<'_>, rows: &Rows, mismatch: &[f64]) -> Result<f64, String> {
    let before = side.residual(nominal, &nominal.start())?;
    Ok(rms(&rows.plain(&before.iter().zip(mismatch).map(|(before, after)| before - after).collect::<Vec<_>>())))
}

/// p-value of the surest member beside the others, as the locks have it.
fn p_of_surest(bench: &Bench<'_>, pool: &Pool, members: &[Member]) -> f64 {
    let of = |at: usize| {
        let Beside { others, own, gain, .. } = bench.beside(members, at);
        let p = search::p_of(&bench.locks(&own, &gain, &others), pool.kinds, 1);
        let spoken = bench.edges.filter(|edges| edges.speak_for(&own.source));
        spoken.map_or(p, |edges| p.min(edges.p()))
    };
    let named = |at: &usize| !matches!(members[*at].candidate.source, Source::Shift { .. });
    (0..members.len()).filter(named).map(of).fold(1.0, f64::min)
}

/// Drops, the smallest first, members that carry next to nothing of what all explain together.
fn drop_small(bench: &Bench<'_>, members: &mut Vec<Member>) {
    while members.len() > 1 {
        let fit = bench.fit_members(members);
        let amplitudes = amplitudes(members, &fit);
        let forces: Vec<Vec<f64>> =
            members.iter().zip(&amplitudes).map(|(member, x)| bench.force(&member.candidate.source, x)).collect();
        let shares = shares(&bench.rows, &bench.tangent, &forces, 1.0);
        let least = |at: usize| {
            if bench.is_spoken_for(&members[at].candidate.source) {
                return 0.0;
            }
            let Beside { others, own, gain, .. } = bench.beside(members, at);
            if search::is_small(bench, &own, &gain, &others) { LEAST_SHARE_OF_SMALL } else { LEAST_SHARE }
        };
        let smallest = (0..members.len()).min_by(|a, b| shares[*a].total_cmp(&shares[*b]));
        match smallest.filter(|at| shares[*at] < least(*at)) {
            Some(at) => members.remove(at),
            None => return,
        };
    }
}

/// Doubts about the members, which may make room for a curve: one without a name that does better than doubted names do.
fn doubted(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut Vec<Member>,
    floor: Floor,
) -> Vec<Option<Doubt>> {
    let found = doubts(bench, &bench.fit_members(members), members);
    if found.iter().all(Option::is_none) {
        return found;
    }
    let mut with: Vec<Member> =
        members.iter().zip(&found).filter(|(_, doubt)| doubt.is_none()).map(|(member, _)| member.clone()).collect();
    let sure = with.len();
    let _ = open_set::extend(bench, pool, tolerances, &mut with, floor);
    if with.len() > sure && bench.fit_members(&with).rss < bench.fit_members(members).rss {
        *members = with;
        return doubts(bench, &bench.fit_members(members), members);
    }
    found
}

/// The rivals of every member; the simplest of a set leads. What may be the steps of a channel whose steps are seen is
/// the steps.
fn tell_apart(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut [Member],
    doubts: &[Option<Doubt>],
    is_coarse: bool,
) -> Vec<Set> {
    let mut sets = Vec::new();
    for at in 0..members.len() {
        if doubts[at].is_some() {
            sets.push(Set::alone(members[at].candidate.clone()));
            continue;
        }
        let mut set = equivalents::of(bench, pool, tolerances, members, at);
        if is_coarse && set.candidates.iter().any(|candidate| candidate.source.is(Id::ForceQuantisation)) {
            set.candidates.retain(|candidate| candidate.source.is(Id::ForceQuantisation));
        }
        if let Some(lead) = set.candidates.first()
            && !lead.source.is_kin(&members[at].candidate.source)
        {
            let lead = lead.clone();
            members[at] = bench.take(lead);
        }
        sets.push(set);
    }
    sets
}
