//! Forward selection over the library of causes, with exchanges and removals.
//!
//! Every step takes up the cause with the most evidence beyond what its freedom costs, refined in its shape, if both
//! [locks](crate::noise::locks) open and its force is worth reporting. Before a new cause is taken up, those already
//! there may take a richer form: most spurious second names are the first one's missing shape. Afterwards each one may
//! be exchanged for a better one or dropped.
//!
//! ```text
//! passes       the search, repeated around where it has led; case: its data
//! (here)       one search; leavings: what the forms of its causes may leave
//! chain        whether what looks like a cable chain is a seal and an offset
//! together     exchanges of a cause while the shapes of the others are free
//! opening      do both locks open? holds: may a cause be named beside the others?
//! small        causes that carry next to nothing of what is explained
//! adequacy     does the cause that explains much really act? load_law: does it depend on the load as it must?
//! open_set     effects without a name in the library; clock: periodic in time
//! law_alone    only the law's own parameters are off
//! found        the result of all that; refit: with parameters that the simulation left out
//! equivalents  causes that this recording cannot tell apart; considered: causes not named, and why
//! ```

pub(crate) mod adequacy;
pub(crate) mod case;
mod chain;
pub(crate) mod clock;
pub(crate) mod considered;
pub(crate) mod equivalents;
pub(crate) mod found;
pub(crate) mod holds;
pub(crate) mod law_alone;
pub(crate) mod leavings;
pub(crate) mod load_law;
pub(crate) mod open_set;
pub(crate) mod opening;
pub(crate) mod passes;
pub(crate) mod refit;
pub(crate) mod small;
mod together;
#[cfg(test)]
mod workbench;

use simulation::mechanism::Id;

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Beside, Candidate, Gain, Member, without};
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::refine::{refine, refine_all};
use crate::fit::source::Source;
use crate::fit::spectrum::wavelength_m;
use crate::search::holds::{FURTHER, Floor, holds, is_small, locks_beside_leavings};
use crate::search::opening::{Asked, MORE, is_open, level};

/// Most causes that act together.
const MOST: usize = 8;

/// Highest order of a wave that counts as the wave itself.
const ORDERS: f64 = 4.0;

/// A cause is simpler than another if it has at least this many parameters less.
const MUCH: usize = 3;

/// Largest share of a cause's own evidence that is given up for a simpler one.
const MOST_LOST: f64 = 0.25;

/// Number of parameters saved per share ([`FURTHER`]) of all evidence given up.
const MUCH_FOR_SHARE: usize = 5;

/// Nats within which a simpler cause leads a better one.
const LEADS: f64 = 1.0;

/// Nats by which a replacement must do better than what it replaces.
const BETTER: f64 = 3.0;

/// Causes that are refined in every step.
const SHORT_LIST: usize = 4;

/// Forms of a cause that are refined before another cause joins it.
const FORMS: usize = 3;

/// What the search found.
pub(crate) struct Found {
    pub(crate) members: Vec<Member>,
    pub(crate) p_no_mismatch: f64,
}

/// Runs the search. The causes of a `former` search, made with the noise or the law as known then, are kept where they
/// explain more.
pub(crate) fn search(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    former: &[Source],
    floor: Floor,
) -> Found {
    let mut members: Vec<Member> = Vec::new();
    let p_no_mismatch = omnibus(bench, pool, tolerances);
    // an over-flexible cause may have given way to a simpler one: what else it followed is searched for again
    for _ in 0..2 {
        take_up(bench, pool, tolerances, &mut members, floor);
        polish(bench, &mut members);
        let is_other = together::exchange(bench, pool, tolerances, &mut members);
        let is_simpler = simplify(bench, pool, tolerances, &mut members);
        if !(chain::straighten(bench, &mut members) || is_simpler || is_other) {
            break;
        }
    }
    prune(bench, pool, &mut members, floor);
    let mut formerly = Vec::with_capacity(former.len());
    for candidate in bench.candidates(former.iter().cloned()) {
        formerly.push(bench.take(candidate));
    }
    polish(bench, &mut formerly);
    let _ = chain::straighten(bench, &mut formerly);
    let least = worth(bench, &members) + BETTER;
    if worth(bench, &formerly) > least {
        prune(bench, pool, &mut formerly, floor);
        if worth(bench, &formerly) > least {
            members = formerly;
        }
    }
    Found { members, p_no_mismatch }
}

/// Takes up causes one by one as long as one holds beside the others.
fn take_up(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut Vec<Member>,
    floor: Floor,
) {
    // a step that explains less than the one before ends it, since taking up, exchanging and dropping may cycle; bounded,
    // since what starts and stops speak for is taken up nevertheless
    for _ in 0..2 * MOST {
        if members.len() >= MOST {
            return;
        }
        let (before, least) = (members.clone(), likelihood(bench, members));
        let fit = bench.fit_members(members);
        let short = short_list(bench, pool, &fit, tolerances, members, None);
        let chosen = short
            .into_iter()
            .find(|(candidate, gain)| gain.score > 0.0 && holds(bench, pool, candidate, gain, members, floor))
            .or_else(|| spoken_for(bench, pool, &fit, tolerances, members));
        let Some(chosen) = chosen else { return };
        let is_spoken_for = bench.is_spoken_for(&chosen.0.source);
        if let Some((at, richer)) = best_upgrade(bench, pool, members, chosen.1.score) {
            members[at] = bench.take(richer);
        } else {
            members.push(bench.take(chosen.0));
        }
        exchange(bench, pool, tolerances, members);
        drop_idle(bench, members);
        if likelihood(bench, members) <= least && !is_spoken_for {
            *members = before;
            return;
        }
    }
}

/// Evidence of the members together, less what their freedom costs, nats.
fn worth(bench: &Bench<'_>, members: &[Member]) -> f64 {
    let (nats, freedom) = explained(bench, members);
    nats - freedom * bench.price(nats)
}

/// The same, less only what chance gives to their freedom: a cause may be small beside the others.
fn likelihood(bench: &Bench<'_>, members: &[Member]) -> f64 {
    let (nats, freedom) = explained(bench, members);
    nats - freedom * bench.price(0.0)
}

/// Evidence of the members together, nats, and their number of parameters.
fn explained(bench: &Bench<'_>, members: &[Member]) -> (f64, f64) {
    let nats = 0.5 * (bench.fit(&bench.law()).rss - bench.fit_members(members).rss);
    let freedom: usize = members.iter().map(|member| member.candidate.freedom()).sum();
    (nats, freedom as f64)
}

/// The best cause that starts and stops speak for, unless one is already among the members.
fn spoken_for(
    bench: &Bench<'_>,
    pool: &mut Pool,
    fit: &Fit,
    tolerances: &Tolerances<'_>,
    members: &[Member],
) -> Option<(Candidate, Gain)> {
    let edges = bench.edges?;
    if members.iter().any(|member| bench.is_spoken_for(&member.candidate.source)) {
        return None;
    }
    let order = pool.ranked_causes(bench, fit, tolerances);
    let (index, _) = order.into_iter().find(|(index, _)| bench.is_spoken_for(&pool.causes[*index].source))?;
    let (candidate, gain) = refine(bench, &pool.causes[index], fit);
    (gain.score + edges.nats() > 0.0).then_some((candidate, gain))
}

/// Drops members that do not hold beside the others, the weakest first. Where none is left, the best that holds alone
/// stays: two causes that imitate one another may each hold only without the other.
fn prune(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor: Floor) {
    let before = members.clone();
    drop_failing(bench, pool, members, floor);
    if !members.is_empty() || before.len() < 2 {
        return;
    }
    let alone = before.into_iter().filter_map(|member| {
        let Beside { own, gain, .. } = bench.beside(std::slice::from_ref(&member), 0);
        (gain.score > 0.0 && holds(bench, pool, &own, &gain, &[], floor)).then_some((gain.score, member))
    });
    members.extend(alone.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, member)| member));
}

fn drop_failing(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor: Floor) {
    loop {
        let failing = (0..members.len())
            .filter_map(|at| {
                let Beside { others, own, gain, .. } = bench.beside(members, at);
                // a cause of uneven amplitude must be surer by the score over blocks in return
                let is_sure = || {
                    locks_beside_leavings(bench, &own, &gain, &others).is_some_and(|locks| {
                        is_open(Asked::of(&own.source), &locks, pool.kinds, pool.points_of(&own.source))
                            && -locks.p.ln() > MORE * level(pool.kinds)
                    })
                };
                let fails = !holds(bench, pool, &own, &gain, &others, floor)
                    || (is_small(bench, &own, &gain, &others)
                        && !bench.is_spoken_for(&own.source)
                        && !adequacy::is_even(bench, members, at)
                        && !is_sure());
                fails.then_some((at, gain.nats))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, _)) = failing else { return };
        members.remove(at);
    }
}

/// p-value of "nothing is missing": both tests must agree, over every cause and every curve.
fn omnibus(bench: &Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>) -> f64 {
    let fit = bench.fit(&bench.law());
    let number = (pool.kinds + pool.stories.len()) as f64;
    let mut tested = Vec::new();
    let causes = pool.ranked_causes(bench, &fit, tolerances);
    for (index, gain) in causes.iter().take(SHORT_LIST) {
        if pool.causes[*index].source.is_shift() {
            // twice the gain is the square of a standard normal variable
            tested.push((libm::erfc(gain.nats.sqrt()), gain.score));
            continue;
        }
        let locks = bench.locks(&pool.causes[*index], gain, &[]);
        tested.push((locks.p, locks.ln_e - (pool.points_of(&pool.causes[*index].source) as f64).ln()));
    }
    let stories = ranked(bench, &mut pool.stories, &fit, tolerances);
    for (index, gain) in stories.iter().take(SHORT_LIST) {
        let locks = bench.locks(&pool.stories[*index], gain, &[]);
        tested.push((locks.p, locks.ln_e));
    }
    let p = tested.iter().map(|(p, _)| p * number).fold(1.0, f64::min);
    let ln_e = tested.iter().map(|(_, ln_e)| ln_e - number.ln()).fold(f64::NEG_INFINITY, f64::max);
    p.max((-ln_e).exp()).min(1.0)
}

/// The causes that explain most beside the members, refined, the best first; none of the kind of `other_than`.
fn short_list(
    bench: &Bench<'_>,
    pool: &mut Pool,
    fit: &Fit,
    tolerances: &Tolerances<'_>,
    members: &[Member],
    other_than: Option<&Source>,
) -> Vec<(Candidate, Gain)> {
    let mut order = pool.ranked_causes(bench, fit, tolerances);
    order.retain(|(index, _)| !is_of_one(members, &pool.causes[*index].source, tolerances, pool.span_m));
    let leading = order.first().map_or(0.0, |(_, gain)| gain.score);
    let short = order
        .into_iter()
        .filter(|(_, gain)| gain.score > 0.5 * leading)
        .scan(0, |physics, (index, gain)| {
            *physics += usize::from(!pool.causes[index].source.is_shift());
            Some((*physics, index, gain))
        })
        // the law's own parameters do not count: they are few, and everything that grows with the drag imitates them
        .filter(|(physics, index, _)| *physics <= SHORT_LIST || pool.causes[*index].source.is_shift())
        .map(|(_, index, _)| &pool.causes[index])
        .filter(|cause| other_than.is_none_or(|other| !cause.source.is_kin(other)));
    let mut list = refine_all(bench, short, fit);
    list.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
    // among ties the simplest leads
    let best = list.first().map_or(0.0, |(_, gain)| gain.score);
    let tied = list.iter().take_while(|(_, gain)| best - gain.score < LEADS).count();
    if let Some(at) = (0..tied).min_by_key(|at| list[*at].0.source.simplicity()) {
        list[..=at].rotate_right(1);
    }
    list
}

/// Whether a cause is one of the members, or a remainder of one of them.
fn is_of_one(members: &[Member], source: &Source, tolerances: &Tolerances<'_>, span_m: f64) -> bool {
    members
        .iter()
        .map(|member| &member.candidate.source)
        .any(|member| is_twin(member, source, tolerances) || is_order(member, source, span_m))
}

/// Whether two causes are one: of the same kind, or the law's own mass and an added one.
fn is_twin(a: &Source, b: &Source, tolerances: &Tolerances<'_>) -> bool {
    let is_mass = |source: &Source| match source {
        Source::Mechanism { definition, .. } => definition.id == Id::Inertia,
        Source::Shift { parameter } => tolerances.nominal.parameters[*parameter].name == "mass",
        Source::Story { .. } => false,
    };
    a.is_kin(b) || (is_mass(a) && is_mass(b))
}

/// Whether a cause is a wave that is a higher order of a wave already there.
fn is_order(there: &Source, new: &Source, span_m: f64) -> bool {
    let (Some(there), Some(new)) = (wavelength_m(there), wavelength_m(new)) else { return false };
    let order = (there / new).round();
    (1.0..=ORDERS).contains(&order) && (1.0 / new - order / there).abs() * span_m < 0.5
}

/// The richer form of a member that explains at least half of what the new cause would.
fn best_upgrade(bench: &Bench<'_>, pool: &mut Pool, members: &[Member], rival: f64) -> Option<(usize, Candidate)> {
    let mut best: Option<(f64, usize, Candidate)> = None;
    for (at, member) in members.iter().enumerate() {
        let Source::Mechanism { definition, form, .. } = &member.candidate.source else { continue };
        if definition.forms.len() < 2 && definition.forms[*form].shape.is_empty() {
            continue;
        }
        let Beside { fit, own, gain, .. } = bench.beside(members, at);
        // the form that is best at the grid's points need not be best between them
        let forms = pool.best_of(bench, &member.candidate.source, &fit, FORMS);
        for candidate in forms.into_iter().chain([refine(bench, &own, &fit)]) {
            let more = candidate.1.score - gain.score;
            if more > 0.5 * rival.max(4.0) && best.as_ref().is_none_or(|(score, ..)| more > *score) {
                best = Some((more, at, candidate.0));
            }
        }
    }
    best.map(|(_, at, candidate)| (at, candidate))
}

/// Replaces members by causes that do better in their place.
fn exchange(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, members: &mut [Member]) {
    if members.len() < 2 {
        return;
    }
    for at in 0..members.len() {
        let Beside { others, fit, own, .. } = bench.beside(members, at);
        let (own, now) = refine(bench, &own, &fit);
        let better = short_list(bench, pool, &fit, tolerances, &others, Some(&own.source))
            .into_iter()
            .find(|(_, gain)| gain.score > now.score + BETTER);
        members[at] = bench.take(better.map_or(own, |(candidate, _)| candidate));
    }
}

/// Replaces members by causes with fewer parameters that explain as much, up to a share too small to be named. Returns
/// whether it did.
fn simplify(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, members: &mut [Member]) -> bool {
    let mut has_replaced = false;
    let law = bench.fit(&bench.law());
    let all = 0.5 * (law.rss - bench.fit_members(members).rss);
    for at in 0..members.len() {
        let Beside { others, fit, own, gain } = bench.beside(members, at);
        let own_nats = gain.nats;
        // a table of 48 entries follows anything: what it follows better than a cause with a shape is no evidence
        let least = |freedom: usize| {
            let worthless = FURTHER * all * (own.freedom().saturating_sub(freedom) / MUCH_FOR_SHARE).max(1) as f64;
            own_nats - worthless.min(MOST_LOST * own_nats)
        };
        let ranked = pool.ranked_causes(bench, &fit, tolerances);
        let simpler = ranked
            .into_iter()
            .filter(|(index, gain)| {
                let candidate = &pool.causes[*index];
                candidate.freedom() + MUCH <= own.freedom()
                    && gain.nats > 0.8 * least(candidate.freedom())
                    && !others.iter().any(|other| other.candidate.source.is_kin(&candidate.source))
            })
            .take(2 * SHORT_LIST)
            .map(|(index, _)| &pool.causes[index]);
        let best = refine_all(bench, simpler, &fit)
            .into_iter()
            .filter(|(candidate, gain)| gain.nats > least(candidate.freedom()))
            .min_by(|a, b| a.0.freedom().cmp(&b.0.freedom()).then(b.1.nats.total_cmp(&a.1.nats)));
        if let Some((candidate, _)) = best {
            members[at] = bench.take(candidate);
            has_replaced = true;
        }
    }
    has_replaced
}

/// Drops members that the others make superfluous.
fn drop_idle(bench: &Bench<'_>, members: &mut Vec<Member>) {
    loop {
        let scores: Vec<f64> = (0..members.len()).map(|at| bench.beside(members, at).gain.score).collect();
        let is_idle = |at: &usize| scores[*at] < 0.0 && !bench.is_spoken_for(&members[*at].candidate.source);
        let Some(at) = (0..scores.len()).filter(is_idle).min_by(|a, b| scores[*a].total_cmp(&scores[*b])) else {
            return;
        };
        members.remove(at);
    }
}

/// Final refinement of every shape beside the others.
pub(crate) fn polish(bench: &mut Bench<'_>, members: &mut [Member]) {
    for at in 0..members.len() {
        if members[at].candidate.source.shapes() == 0 {
            continue;
        }
        let fit = bench.fit_members(&without(members, at));
        let (own, _) = refine(bench, &members[at].candidate, &fit);
        members[at] = bench.take(own);
    }
}
