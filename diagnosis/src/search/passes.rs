//! Passes: the search, repeated around where it has led, with the noise as estimated from what it left.

use crate::calibration::{TOLERATED, moved, shifted, way};
use crate::fit::bench::Bench;
use crate::fit::member::{Beside, Member, causes};
use crate::fit::pool::{Pool, Tolerances};
use crate::fit::rest::{noise_rms, whiteness};
use crate::fit::source::Source;
use crate::noise::locks::least_of;
use crate::noise::rows::Rows;
use crate::numbers::rounding::rounding;
use crate::numbers::statistics::rms;
use crate::search::adequacy::{self, Doubt, doubts};
use crate::search::case::{Case, Given};
use crate::search::equivalents;
use crate::search::found::{Causes, FAR, Found, again, amplitudes};
use crate::search::holds::Floor;
use crate::search::open_set::{self, NoiseOf, is_clock};
use crate::search::small::{drop_beside_noisy_speed, drop_beside_ringing, drop_small, drop_what_cancels};
use crate::search::{drop_idle, search};

/// RMS force, as a share of the noise, below which a cause is not worth reporting.
const FLOOR_OF_NOISE: f64 = 0.05;

/// Deviation of the whitened residual's variance from 1 from which the noise is estimated anew.
const COLOURED: f64 = 0.1;

/// Number of outlying rows that is too small to say anything of the noise.
const FEW_TAILS: usize = 10;

/// Most searches.
const MOST_PASSES: usize = 3;

/// A pool of causes and the noise that it was whitened for, kept for the next search where that needs the same.
pub(crate) type Kept = Option<(Rows, Pool)>;

/// The pool of all causes, taken from a former search where the noise looks the same.
pub(crate) fn prepared(
    case: &Case<'_>,
    rows: &Rows,
    bench: &Bench<'_>,
    tolerances: &Tolerances<'_>,
    kept: &mut Kept,
) -> Pool {
    match kept.take().filter(|(of, _)| of.whiten_alike(rows)) {
        Some((_, pool)) => pool.again(bench, tolerances),
        None => Pool::new(bench, tolerances, case.saturation.stories(), case.given.ringing),
    }
}

/// Searches as often as needed, from `start` on; `tolerated`: the law settled within its tolerance.
pub(crate) fn run<'s>(
    case: &Case<'s>,
    mut rows: Rows,
    start: &[f64],
    tolerated: &[f64],
    kept: &mut Kept,
) -> Result<Found<'s>, String> {
    let mut values = start.to_vec();
    let mut former: Vec<Source> = Vec::new();
    let mut number = 0;
    loop {
        number += 1;
        let noise_of = if number == 1 { NoiseOf::Curves } else { NoiseOf::Search };
        let pass = Pass::around(case, &rows, values, &former, noise_of, kept)?;
        let led = led(case, &pass.bench, &pass.members, &pass.values)?;
        let learnt = if number == 1 { pass.learnt(case, &rows) } else { None };
        if number == MOST_PASSES || (led.is_none() && learnt.is_none()) {
            return pass.found(case, rows, tolerated, kept);
        }
        former = pass.names();
        values = led.unwrap_or(pass.values);
        let next = learnt.unwrap_or_else(|| rows.clone());
        *kept = Some((std::mem::replace(&mut rows, next), pass.pool));
    }
}

/// One search, around the law at one set of its parameter values.
struct Pass<'s> {
    values: Vec<f64>,
    bench: Bench<'s>,
    pool: Pool,
    members: Vec<Member>,
    floor: Floor,
    p_no_mismatch: f64,
    /// RMS force below which a mismatch does not matter, N.
    irrelevant_n: f64,
    /// Quantisation step of the force channel, N, where it is a considerable part of the noise.
    coarse_step_n: Option<f64>,
    /// What neither the members nor any curve follows; one entry per row of all runs.
    left: Vec<f64>,
}

impl<'s> Pass<'s> {
    /// Searches. `former`: causes of the pass before.
    fn around(
        case: &Case<'s>,
        rows: &Rows,
        values: Vec<f64>,
        former: &[Source],
        noise_of: NoiseOf,
        kept: &mut Kept,
    ) -> Result<Self, String> {
        let Case { given: Given { nominal, .. }, side, saturation, .. } = *case;
        let mismatch = side.residual(nominal, &values)?;
        let tangent = side.tangent(nominal, &values)?;
        let rest = |extra: &[Vec<f64>]| saturation.rest(rows, &side.contexts, &mismatch, &tangent, extra);
        let tolerances = Tolerances { nominal, moved: &values };
        let mut bench = case.around(rows, &values)?;
        let mut pool = prepared(case, rows, &bench, &tolerances, kept);
        let noise_n = noise_rms(rows, &rest(&[]), &mismatch);
        let matters = Matters::of(case, rows, &mismatch)?;
        let floor = matters.floor(case, rows, noise_n);
        let searched = search(&mut bench, &mut pool, &tolerances, former, floor);
        let mut members = searched.members;
        let p_of_curve = open_set::extend(&mut bench, &mut pool, &tolerances, &mut members, floor, noise_of);
        let raw = |member: &Member| bench.raw(&member.candidate.source).unwrap_or_default();
        let left = rest(&members.iter().flat_map(raw).collect::<Vec<_>>());
        Ok(Pass {
            bench,
            pool,
            members,
            floor,
            p_no_mismatch: least_of([searched.p_no_mismatch, p_of_curve]),
            irrelevant_n: matters.irrelevant_n(),
            coarse_step_n: case.coarse_step_n(rows, noise_n),
            left,
            values,
        })
    }

    /// The noise as learned from what is left; `None` where the pass may stand on the noise it began with.
    fn learnt(&self, case: &Case<'_>, rows: &Rows) -> Option<Rows> {
        if self.members.is_empty() {
            return None;
        }
        let mut anew = rows.clone();
        anew.learn(&self.left, case.saturation.kept());
        let fit = self.bench.fit_members(&self.members);
        let is_coloured = (whiteness(&self.bench, &fit) - 1.0).abs() > COLOURED;
        // outlying rows are explained now, and may count in full
        let is_tamed = rows.tails() > FEW_TAILS && 2 * anew.tails() < rows.tails();
        // a clock found with the first noise estimate was only likely
        let has_clock = self.members.iter().any(|member| is_clock(&member.candidate.source));
        (is_coloured || is_tamed || has_clock).then_some(anew)
    }

    /// The causes for the next pass to begin with; none where one is an unnamed curve, since names beside it may be
    /// parts of it.
    fn names(&self) -> Vec<Source> {
        match self.members.iter().any(|member| member.candidate.source.is_story()) {
            true => Vec::new(),
            false => causes(&self.members).map(|cause| cause.source.clone()).collect(),
        }
    }

    /// The result, after a last look at each member beside the others.
    fn found(self, case: &Case<'s>, rows: Rows, tolerated: &[f64], kept: &mut Kept) -> Result<Found<'s>, String> {
        let Pass { mut values, mut bench, mut pool, mut members, .. } = self;
        let nominal = case.given.nominal;
        let tolerances = Tolerances { nominal, moved: &values };
        tell_shifts(&mut bench, &tolerances, &mut members);
        drop_small(&bench, &pool, &mut members);
        drop_beside_ringing(&bench, case.given.heard_n2, &mut members);
        drop_beside_noisy_speed(&bench, case.given.discarded_n2, &mut members);
        drop_what_cancels(&bench, self.floor, &mut members);
        shorten(&mut bench, &mut pool, &mut members);
        equivalents::exchange_refused(&mut bench, &mut pool, &tolerances, &mut members);
        let doubts = doubted(&mut bench, &mut pool, &tolerances, &mut members, self.floor);
        // no further search, but the causes are to hold where they move the law
        if let Some(led) = led(case, &bench, &members, &values)? {
            values = led;
            bench = case.around(&rows, &values)?;
            pool = pool.again(&bench, &Tolerances { nominal, moved: &values });
            members = again(&mut bench, members);
        }
        let mismatch = case.side.residual(nominal, &values)?;
        let causes = Causes {
            bench,
            members,
            doubts,
            values,
            has_landed: false,
            p_no_mismatch: self.p_no_mismatch,
            noise_n: noise_rms(&rows, &self.left, &mismatch),
            irrelevant_n: self.irrelevant_n,
            left: self.left,
            coarse_step_n: self.coarse_step_n,
            sets: None,
        };
        let found = causes.found(case, &mut pool, tolerated)?;
        *kept = Some((rows, pool));
        Ok(found)
    }
}

/// Where the law settles beside the members; `None` where that is close enough for linearisation.
fn led(case: &Case<'_>, bench: &Bench<'_>, members: &[Member], values: &[f64]) -> Result<Option<Vec<f64>>, String> {
    let nominal = case.given.nominal;
    let is_far = |there: &[f64]| !nominal.is_incomplete() && way(values, there) > FAR;
    let fit = bench.fit_members(members);
    let straight =
        shifted(nominal, &moved(nominal, values, &fit.values[..values.len()]), members, &amplitudes(members, &fit));
    if !is_far(&straight) {
        return Ok(None);
    }
    Ok(Some(case.valley(&bench.rows, causes(members)).settled(values)?).filter(|there| is_far(there)))
}

/// Share of all evidence that must depend on a law parameter exceeding its tolerance for that to be reported: many rows
/// outweigh any tolerance, and a small excess is due to slightly wrong forms of causes.
const HANGS: f64 = 0.04;

/// Takes up as shifts the law parameters that must exceed their tolerance for the others to explain what they do, and
/// drops members that become superfluous.
fn tell_shifts(bench: &mut Bench<'_>, tolerances: &Tolerances<'_>, members: &mut Vec<Member>) {
    let fit = bench.fit_members(members);
    let evidence = 0.5 * (bench.fit(&bench.law()).rss - fit.rss);
    let mut told = Vec::new();
    for (at, parameter) in tolerances.nominal.parameters.iter().enumerate() {
        let is_told = |member: &Member| member.candidate.source.is_shift_of(at);
        let Some(sigma) = parameter.sigma.filter(|_| parameter.can_shift() && !members.iter().any(is_told)) else {
            continue;
        };
        let led = parameter.moved(tolerances.moved[at], fit.values[at]);
        let limit = (TOLERATED * sigma).copysign(led);
        if led.abs() <= limit.abs() {
            continue;
        }
        let within = bench.fit_holding_one(members, at, limit - tolerances.moved[at]);
        if 0.5 * (within.rss - fit.rss) > HANGS * evidence {
            told.push(at);
        }
    }
    if members.is_empty() || told.is_empty() {
        return;
    }
    for parameter in told {
        if let Some(candidate) = bench.candidate(Source::Shift { parameter }) {
            members.push(bench.take(candidate));
        }
    }
    drop_idle(bench, members);
}

/// RMS forces from which a mismatch matters.
pub(crate) struct Matters {
    /// As the simulation states, N.
    relevant_n: f64,
    /// What calibration leaves because of inexact derivatives, which cannot be told from a cause, N.
    inexact_n: f64,
}

impl Matters {
    pub(crate) fn of(case: &Case<'_>, rows: &Rows, mismatch: &[f64]) -> Result<Self, String> {
        let Case { given: Given { simulation, nominal, .. }, side, .. } = *case;
        let before = side.residual(nominal, &nominal.start())?;
        let calibrated: Vec<f64> = before.iter().zip(mismatch).map(|(before, after)| before - after).collect();
        Ok(Matters {
            relevant_n: simulation.tolerance.relevance * rms(&rows.plain(&side.drag_n)),
            inexact_n: nominal.error_of_derivatives() * rms(&rows.plain(&calibrated)),
        })
    }

    /// RMS force below which a mismatch does not matter, N.
    pub(crate) fn irrelevant_n(&self) -> f64 {
        self.relevant_n.max(self.inexact_n)
    }

    /// RMS forces from which a cause is worth reporting beside noise of this RMS, N.
    fn floor(&self, case: &Case<'_>, rows: &Rows, noise_n: f64) -> Floor {
        // a force that stays within one quantisation step is off by up to half a step, always to the same side
        let coarse_step_n = case.coarse_step_n(rows, noise_n);
        let rounding_n = coarse_step_n.map_or(case.given.step_n.map_or(0.0, rounding), |step| 0.5 * step);
        Floor {
            any_n: self.relevant_n.max(FLOOR_OF_NOISE * noise_n),
            inexact_n: self.inexact_n,
            rounding_n,
            is_coarse: coarse_step_n.is_some(),
        }
    }
}

/// Replaces a form with a shape parameter at its end by the minimal form, where that lacks the parameter and the longer
/// form adds no more than the error of a form: then the end says nothing of the cause.
fn shorten(bench: &mut Bench<'_>, pool: &mut Pool, members: &mut [Member]) {
    for at in 0..members.len() {
        let Beside { fit, own, gain, .. } = bench.beside(members, at);
        if !adequacy::is_long_and_at_its_end(&own.source) {
            continue;
        }
        let minimal = pool.minimal(bench, &own.source, &fit).map(|(minimal, gain)| (minimal.clone(), gain.nats));
        if let Some((minimal, _)) = minimal.filter(|(_, nats)| *nats > (1.0 - adequacy::LEAST_SHARE) * gain.nats) {
            members[at] = bench.take(minimal);
        }
    }
}

/// Doubts about the members. Doubted members may be replaced by an unnamed curve that does better than they do.
fn doubted(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut Vec<Member>,
    floor: Floor,
) -> Vec<Option<Doubt>> {
    let mut found = doubts(bench, &bench.fit_members(members), members);
    adequacy::doubt_what_leaves_a_curve(bench, pool, tolerances, members, &mut found);
    if found.iter().all(Option::is_none) {
        return found;
    }
    let mut with: Vec<Member> =
        members.iter().zip(&found).filter(|(_, doubt)| doubt.is_none()).map(|(member, _)| member.clone()).collect();
    let sure = with.len();
    let _ = open_set::extend(bench, pool, tolerances, &mut with, floor, NoiseOf::Search);
    if with.len() > sure && bench.fit_members(&with).rss < bench.fit_members(members).rss {
        *members = with;
        return doubts(bench, &bench.fit_members(members), members);
    }
    found
}
