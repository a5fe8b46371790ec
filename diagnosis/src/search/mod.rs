//! Which causes act: forward selection over the library, with second thoughts.
//!
//! Every step takes up the cause that explains most beyond what its freedom costs, refined in its shape, if both
//! [locks](crate::noise::locks) open and its force is worth a mention. Before a new cause is taken up, those already there
//! may take a richer form: most spurious second names are the first one's missing shape. After it, each one may be exchanged
//! for a better one or dropped.
//!
//! ```text
//! passes       the search, and again around where it has led; case: what it is about
//! (here)       one search; leavings: what the forms of its causes may leave
//! opening      do both locks open?
//! adequacy     is what explains much what acts? load_law: does it feel the load as it must?
//! open_set     what has no name here; clock: what repeats in time
//! law_alone    the law's own numbers off, and nothing beside them
//! found        what all that has led to; refit: with numbers that the simulation left out
//! equivalents  what this recording cannot tell apart; considered: what else was thought of
//! ```

pub(crate) mod adequacy;
pub(crate) mod case;
pub(crate) mod clock;
pub(crate) mod considered;
pub(crate) mod equivalents;
pub(crate) mod found;
pub(crate) mod law_alone;
pub(crate) mod leavings;
pub(crate) mod load_law;
pub(crate) mod open_set;
pub(crate) mod opening;
pub(crate) mod passes;
pub(crate) mod refit;

use simulation::mechanism::{Id, Kind, definition};

use crate::fit::bench::{Bench, Beside, Candidate, Gain, Member, without};
use crate::fit::least_squares::Fit;
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::refine::refine;
use crate::fit::rest::power;
use crate::fit::source::Source;
use crate::fit::spectrum::is_wave;
use crate::noise::locks::Locks;
use crate::search::opening::{Asked, MORE, is_open, level};

/// Most causes that act together.
const MOST: usize = 8;

/// Share of all evidence below which a further cause is one only if its size is the same throughout: a form is an
/// idealisation, and what it leaves of its own cause's force, up to a seventh of it, is a fiftieth in square.
const FURTHER: f64 = 0.02;

/// Share of all evidence below which that is not enough, and a cause must show beside what the [forms](crate::search::leavings) of
/// others may leave as well: two standard deviations of what a form is wrong by, in square. A shift so small, which those
/// imitate, is none.
const FURTHER_IF_EVEN: f64 = 4.0 * leavings::WRONG * leavings::WRONG;

/// The same of a wave along the rail, which no form leaves.
const FURTHER_WAVE: f64 = 0.005;

/// Share of a drift's force below which a constant beside it is what its curve misses.
const MISSED_BY_A_CURVE: f64 = 0.2;

/// Share of the evidence for a bent rail below which a joint is part of how it is bent, or the other way round: no wave or
/// table is as sharp as a rail may be, and a joint is the sharpest profile that there is. One of a third of the bend's force
/// has more.
const ONE_PROFILE: f64 = 0.1;

/// Mass of a structure that rings, of all that the drive accelerates, from which it is none: forms are wrong by some of it.
const MORE_MASS: f64 = 1.3;

/// Highest order at which a wave repeats that is taken for the wave itself.
const ORDERS: f64 = 4.0;

/// Detail along the rail, in lengths of a wave, from which it follows nothing of that wave.
const COARSE: f64 = 2.0;

/// Numbers less that make a cause the simpler one.
const MUCH: usize = 3;

/// Most of a cause's own evidence that is given up for a simpler one.
const MOST_LOST: f64 = 0.25;

/// Numbers less for each of which such a share is given up.
const MUCH_FOR_SHARE: usize = 5;

/// Nats by which a cause leads a simpler one.
const LEADS: f64 = 1.0;

/// Nats by which what takes the place of what is there must do better.
const BETTER: f64 = 3.0;

/// Causes that are refined in every step.
const SHORT_LIST: usize = 4;

/// RMS force below which a cause is not worth a mention, N.
#[derive(Clone, Copy)]
pub(crate) struct Floor {
    /// Of any cause.
    pub(crate) any_n: f64,
    /// Of all but the rounding itself: what is smaller cannot be told from it.
    pub(crate) rounding_n: f64,
}

impl Floor {
    fn of(&self, source: &Source) -> f64 {
        if source.is(Id::ForceQuantisation) { self.any_n } else { self.any_n.max(self.rounding_n) }
    }
}

/// What the search found.
pub(crate) struct Found {
    pub(crate) members: Vec<Member>,
    pub(crate) p_no_mismatch: f64,
}

/// Runs the search. What a `former` one found, with the noise or the law as they looked then, comes back where it explains
/// more.
pub(crate) fn search(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    former: &[Source],
    floor: Floor,
) -> Found {
    let mut members: Vec<Member> = Vec::new();
    let p_no_mismatch = omnibus(bench, pool, tolerances);
    // what follows whatever there is has made room for a simpler cause: what else it followed is searched for anew
    for _ in 0..2 {
        take_up(bench, pool, tolerances, &mut members, floor);
        polish(bench, &mut members);
        if !simplify(bench, pool, tolerances, &mut members) {
            break;
        }
    }
    straighten(bench, &mut members);
    prune(bench, pool, &mut members, floor);
    let mut formerly = Vec::with_capacity(former.len());
    for candidate in bench.candidates(former.iter().cloned()) {
        formerly.push(bench.take(candidate));
    }
    polish(bench, &mut formerly);
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
    // taking up and dropping may go round in circles
    for _ in 0..2 * MOST {
        if members.len() >= MOST {
            return;
        }
        let fit = bench.fit_members(members);
        let short = short_list(bench, pool, &fit, tolerances, members);
        let chosen = short
            .into_iter()
            .find(|(candidate, gain)| gain.score > 0.0 && holds(bench, pool, candidate, gain, members, floor))
            .or_else(|| spoken_for(bench, pool, &fit, tolerances, members));
        let Some(chosen) = chosen else { return };
        if let Some((at, richer)) = best_upgrade(bench, pool, members, chosen.1.score) {
            members[at] = bench.take(richer);
        } else {
            members.push(bench.take(chosen.0));
        }
        exchange(bench, pool, tolerances, members);
        drop_idle(bench, members);
    }
}

/// What members explain together, less what their freedom costs, nats.
fn worth(bench: &Bench<'_>, members: &[Member]) -> f64 {
    let nats = 0.5 * (bench.fit(&bench.law()).rss - bench.fit_members(members).rss);
    let freedom: usize = members.iter().map(|member| member.candidate.freedom()).sum();
    nats - freedom as f64 * bench.price(nats)
}

/// The best cause that starts and stops speak for, where there is none yet.
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

/// Whether a candidate may be named beside the members: real and worth it.
///
/// The evidence for a shift is what its tolerance would have to be stretched by. The data alone, which the locks ask,
/// cannot tell a parameter that is free from one that is not.
fn holds(bench: &Bench<'_>, pool: &Pool, candidate: &Candidate, gain: &Gain, members: &[Member], floor: Floor) -> bool {
    if bench.is_spoken_for(&candidate.source) {
        // where they speak the whole force is there or not, in rows that are not compared
        return true;
    }
    let tiny = if is_periodic(&candidate.source) { FURTHER_WAVE } else { FURTHER_IF_EVEN };
    let is_tiny = gain.nats < tiny * (imitable(bench, candidate, members) + gain.nats);
    if matches!(candidate.source, Source::Shift { .. }) {
        return !is_tiny && gain.score > (pool.kinds as f64).ln();
    }
    is_relevant(bench, candidate, gain, floor)
        && !is_of_one_profile(bench, candidate, gain, members)
        && !is_missed_by_a_curve(bench, candidate, gain, members)
        && !rings_with_more_than_moves(bench, candidate, gain, members)
        && shows(bench, pool, candidate, gain, members, is_tiny)
}

/// Whether both locks open for a candidate: as it is or, what is stricter but for the scatter that they bring, beside what the
/// forms of others may leave; a tiny one must show both ways.
fn shows(
    bench: &Bench<'_>,
    pool: &Pool,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
    is_tiny: bool,
) -> bool {
    let opens = is_open(
        Asked::of(&candidate.source),
        &bench.locks(candidate, gain, members),
        pool.kinds,
        pool.points_of(&candidate.source),
    );
    if opens != is_tiny {
        return opens;
    }
    !members.is_empty() && shows_beside_leavings(bench, pool, candidate, gain, members)
}

/// Whether a candidate is a joint that only sharpens the profile of a rail that is bent anyway, or a bend that only rounds a
/// joint.
fn is_of_one_profile(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    let profile = [Id::RailJoint, Id::RailStraightness];
    let Some(own) = profile.iter().position(|id| candidate.source.is(*id)) else { return false };
    let other = profile[1 - own];
    let Some(at) = members.iter().position(|member| member.candidate.source.is(other)) else { return false };
    gain.nats < ONE_PROFILE * bench.beside(members, at).gain.nats
}

/// Whether a candidate is a constant that is small beside a drift: a curve of a few numbers does not start as steeply as a
/// zero that settles.
fn is_missed_by_a_curve(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    if ![Id::ForceOffset, Id::GravityTilt].iter().any(|id| candidate.source.is(*id)) {
        return false;
    }
    let Some(drift) = members.iter().find(|member| member.candidate.source.is(Id::ForceDrift)) else { return false };
    let fit = bench.fit_members(members);
    let amplitudes: Vec<f64> = drift.base.iter().map(|column| fit.value_of(*column)).collect();
    size_n(bench, &candidate.source, &gain.amplitudes)
        < MISSED_BY_A_CURVE * size_n(bench, &drift.candidate.source, &amplitudes)
}

/// Whether a candidate is a structure that rings with more mass than the drive accelerates: what is fitted beside a mass at the
/// corners of its ramps, where the acceleration is derived.
fn rings_with_more_than_moves(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    let Some(ringing_kg) = mass_kg(&candidate.source, Id::StructuralResonance, &gain.amplitudes) else { return false };
    let fit = bench.fit_members(members);
    let moved_kg = members.iter().find_map(|member| {
        let amplitudes: Vec<f64> = member.base.iter().map(|column| fit.value_of(*column)).collect();
        mass_kg(&member.candidate.source, Id::Inertia, &amplitudes)
    });
    let known_kg = bench.contexts.first().map_or(0.0, |context| context.moved_mass_kg);
    moved_kg.is_some_and(|moved_kg| ringing_kg > MORE_MASS * (moved_kg + known_kg))
}

/// Mass in the amplitudes of a cause, kg; `None` of another cause.
fn mass_kg(source: &Source, id: Id, amplitudes: &[f64]) -> Option<f64> {
    let Source::Mechanism { definition, form, .. } = source else { return None };
    let masses = definition.forms[*form].amplitudes.iter().zip(amplitudes).filter(|(what, _)| what.unit == "kg");
    (definition.id == id).then(|| masses.map(|(_, kg)| kg).sum())
}

/// Whether a cause is real beside what the forms of others may leave, too.
pub(crate) fn shows_beside_leavings(
    bench: &Bench<'_>,
    pool: &Pool,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
) -> bool {
    locks_beside_leavings(bench, candidate, gain, members).is_some_and(|locks| {
        is_open(Asked::of(&candidate.source), &locks, pool.kinds, pool.points_of(&candidate.source))
    })
}

/// The locks of a cause beside what the forms of others may leave. What a table along the rail follows has none: those few
/// polynomials do not.
fn locks_beside_leavings(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> Option<Locks> {
    if candidate.source.is_phase_bound() {
        return None;
    }
    let larger = members.iter().filter(|member| may_leave(member, candidate));
    let leavings = leavings::columns(bench, &bench.fit_members(members), larger);
    Some(bench.locks_beside(candidate, gain, members, &leavings))
}

/// Drops, the weakest first, members that do not hold beside the others. Where none is left, the best that holds alone stays:
/// two that follow one another may each hold only without the other.
fn prune(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor: Floor) {
    let before = members.clone();
    drop_failing(bench, pool, members, floor);
    if !members.is_empty() || before.len() < 2 {
        return;
    }
    let fit = bench.fit(&bench.law());
    let alone = before.into_iter().filter_map(|member| {
        let mut own = member.candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let gain = bench.gain(&own, &fit);
        (gain.score > 0.0 && holds(bench, pool, &own, &gain, &[], floor)).then_some((gain.score, member))
    });
    members.extend(alone.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, member)| member));
}

fn drop_failing(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor: Floor) {
    loop {
        let failing = (0..members.len())
            .filter_map(|at| {
                let Beside { others, own, gain, .. } = bench.beside(members, at);
                // what is not the same throughout must be so much surer block for block
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

/// Whether what a cause adds to a fit is no more than what the forms of others may leave of them.
pub(crate) fn is_small(bench: &Bench<'_>, own: &Candidate, gain: &Gain, others: &[Member]) -> bool {
    gain.nats < FURTHER * (imitable(bench, own, others) + gain.nats)
}

/// Evidence of members whose remains a candidate could follow, nats: what a wave leaves of itself is tied to the rail, and
/// follows nothing else.
fn imitable(bench: &Bench<'_>, candidate: &Candidate, members: &[Member]) -> f64 {
    let others: Vec<Member> = members.iter().filter(|member| !may_leave(member, candidate)).cloned().collect();
    0.5 * (bench.fit_members(&others).rss - bench.fit_members(members).rss)
}

/// Whether a candidate could follow what the form of a member leaves. Of a wave that is harmonics and sidebands, which only
/// what is tied to places follows, and nothing that is much coarser than the wave is long.
pub(crate) fn may_leave(member: &Member, candidate: &Candidate) -> bool {
    let is_fine = || match (wavelength_m(&member.candidate.source), detail_m(&candidate.source)) {
        (Some(wave_m), Some(detail_m)) => detail_m < COARSE * wave_m,
        _ => true,
    };
    !is_periodic(&member.candidate.source) || (candidate.source.is_phase_bound() && is_fine())
}

/// Length of a wave, m.
fn wavelength_m(source: &Source) -> Option<f64> {
    match source {
        Source::Mechanism { definition, form, shape } if is_wave(&definition.forms[*form]) => shape.first().copied(),
        _ => None,
    }
}

/// Finest detail along the rail that how a rail is bent has, m: the shortest order of its wave, or the distance of the entries of its table.
fn detail_m(source: &Source) -> Option<f64> {
    let Source::Mechanism { definition, shape, .. } = source else { return None };
    let amplitudes = source.amplitudes() as f64;
    match (definition.id, shape.as_slice()) {
        (Id::RailStraightness, [wave_m]) => Some(wave_m / (0.5 * amplitudes)),
        (Id::RailStraightness, [from_m, to_m]) => Some((to_m - from_m) / (amplitudes - 1.0)),
        _ => None,
    }
}

fn is_periodic(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, form, .. }
        if definition.kind == Kind::Physics && is_wave(&definition.forms[*form]))
}

/// p-value of "nothing is missing": both tests, over every cause and every curve.
fn omnibus(bench: &Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>) -> f64 {
    let fit = bench.fit(&bench.law());
    let number = (pool.kinds + pool.stories.len()) as f64;
    let mut tested = Vec::new();
    let causes = pool.ranked_causes(bench, &fit, tolerances);
    for (index, gain) in causes.iter().take(SHORT_LIST) {
        if matches!(pool.causes[*index].source, Source::Shift { .. }) {
            // twice the gain is the square of a standard normal number
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

fn short_list(
    bench: &Bench<'_>,
    pool: &mut Pool,
    fit: &Fit,
    tolerances: &Tolerances<'_>,
    members: &[Member],
) -> Vec<(Candidate, Gain)> {
    let mut order = pool.ranked_causes(bench, fit, tolerances);
    // what a member leaves of its own kind does not take part
    order.retain(|(index, _)| {
        !members.iter().any(|m| {
            is_twin(&m.candidate.source, &pool.causes[*index].source, tolerances)
                || is_order(&m.candidate.source, &pool.causes[*index].source, pool.span_m)
        })
    });
    let leading = order.first().map_or(0.0, |(_, gain)| gain.score);
    let mut list: Vec<(Candidate, Gain)> = order
        .into_iter()
        .filter(|(_, gain)| gain.score > 0.5 * leading)
        .scan(0, |physics, (index, gain)| {
            *physics += usize::from(!matches!(pool.causes[index].source, Source::Shift { .. }));
            Some((*physics, index, gain))
        })
        // a law's own parameters are few, and imitated by everything that grows with the drag
        .filter(|(physics, index, _)| {
            *physics <= SHORT_LIST || matches!(pool.causes[*index].source, Source::Shift { .. })
        })
        .map(|(_, index, _)| refine(bench, &pool.causes[index], fit))
        .collect();
    list.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
    // where some tie, the simplest one leads
    let best = list.first().map_or(0.0, |(_, gain)| gain.score);
    let tied = list.iter().take_while(|(_, gain)| best - gain.score < LEADS).count();
    if let Some(at) = (0..tied).min_by_key(|at| list[*at].0.source.simplicity()) {
        list[..=at].rotate_right(1);
    }
    list
}

/// Whether two causes are one: of a kind, or the mass that the law has and one that it has not.
fn is_twin(a: &Source, b: &Source, tolerances: &Tolerances<'_>) -> bool {
    let is_mass = |source: &Source| match source {
        Source::Mechanism { definition, .. } => definition.id == Id::Inertia,
        Source::Shift { parameter } => tolerances.nominal.parameters[*parameter].name == "mass",
        Source::Story { .. } => false,
    };
    a.is_kin(b) || (is_mass(a) && is_mass(b))
}

/// Whether a cause is a wave that is an order of another wave that is already there.
fn is_order(there: &Source, new: &Source, span_m: f64) -> bool {
    let (Some(there), Some(new)) = (wavelength_m(there), wavelength_m(new)) else { return false };
    let order = (there / new).round();
    (1.0..=ORDERS).contains(&order) && (1.0 / new - order / there).abs() * span_m < 0.5
}

/// The upgrade of a member's form that explains at least half of what a new cause would.
fn best_upgrade(bench: &Bench<'_>, pool: &mut Pool, members: &[Member], rival: f64) -> Option<(usize, Candidate)> {
    let mut best: Option<(f64, usize, Candidate)> = None;
    for (at, member) in members.iter().enumerate() {
        let Source::Mechanism { definition, form, .. } = &member.candidate.source else { continue };
        if definition.forms.len() < 2 && definition.forms[*form].shape.is_empty() {
            continue;
        }
        let Beside { fit, own, gain, .. } = bench.beside(members, at);
        for candidate in
            pool.best_of(bench, &member.candidate.source, &fit).into_iter().chain([refine(bench, &own, &fit)])
        {
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
        let better = short_list(bench, pool, &fit, tolerances, &others)
            .into_iter()
            .find(|(candidate, gain)| gain.score > now.score + BETTER && !candidate.source.is_kin(&own.source));
        members[at] = bench.take(better.map_or(own, |(candidate, _)| candidate));
    }
}

/// Replaces members by causes with fewer numbers that explain as much but for a share that is worth no name. Answers whether
/// it did.
fn simplify(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, members: &mut [Member]) -> bool {
    let mut has_replaced = false;
    let law = bench.fit(&bench.law());
    let all = 0.5 * (law.rss - bench.fit_members(members).rss);
    for at in 0..members.len() {
        let Beside { others, fit, own, gain } = bench.beside(members, at);
        let own_nats = gain.nats;
        // a table of 48 entries follows whatever there is: what it follows better than a cause with a shape is no evidence
        let least = |freedom: usize| {
            let worthless = FURTHER * all * (own.freedom().saturating_sub(freedom) / MUCH_FOR_SHARE).max(1) as f64;
            own_nats - worthless.min(MOST_LOST * own_nats)
        };
        let simpler: Vec<(Candidate, Gain)> = pool
            .ranked_causes(bench, &fit, tolerances)
            .into_iter()
            .filter(|(index, gain)| {
                let candidate = &pool.causes[*index];
                candidate.freedom() + MUCH <= own.freedom()
                    && gain.nats > 0.8 * least(candidate.freedom())
                    && !others.iter().any(|other| other.candidate.source.is_kin(&candidate.source))
            })
            .take(2 * SHORT_LIST)
            .map(|(index, _)| refine(bench, &pool.causes[index], &fit))
            .filter(|(candidate, gain)| gain.nats > least(candidate.freedom()))
            .collect();
        let best =
            simpler.into_iter().min_by(|a, b| a.0.freedom().cmp(&b.0.freedom()).then(b.1.nats.total_cmp(&a.1.nats)));
        if let Some((candidate, _)) = best {
            members[at] = bench.take(candidate);
            has_replaced = true;
        }
    }
    has_replaced
}

/// Replaces a cable chain that hardly changes along the rail by what is left of it then: a friction and a constant force.
fn straighten(bench: &mut Bench<'_>, members: &mut Vec<Member>) {
    let of = |id: Id| Source::Mechanism { definition: definition(id), form: 0, shape: Vec::new() };
    let Some(at) = members.iter().position(|member| member.candidate.source.is(Id::CableChain)) else { return };
    let Beside { others, fit, gain, .. } = bench.beside(members, at);
    let parts = [of(Id::SealDrag), of(Id::ForceOffset)];
    if parts.iter().any(|part| others.iter().any(|other| other.candidate.source.is_kin(part))) {
        return;
    }
    let mut without = others;
    for candidate in bench.candidates(parts) {
        without.push(bench.take(candidate));
    }
    let nats = 0.5 * (fit.rss - bench.fit_members(&without).rss);
    if nats > (1.0 - FURTHER) * gain.nats {
        *members = without;
        drop_idle(bench, members);
    }
}

/// Drops members that the others have made superfluous.
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

/// Last refinement of every shape beside the others.
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

/// Whether the force of a cause exceeds its floor.
pub(crate) fn is_relevant(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, floor: Floor) -> bool {
    size_n(bench, &candidate.source, &gain.amplitudes) > floor.of(&candidate.source)
}

/// RMS of a cause's force, N.
pub(crate) fn size_n(bench: &Bench<'_>, source: &Source, amplitudes: &[f64]) -> f64 {
    let force = bench.force(source, amplitudes);
    if force.is_empty() { 0.0 } else { power(&bench.rows, &force).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_coarser_than_a_wave_follows_nothing_of_it() {
        let of = |id: Id, form: usize, shape: &[f64]| Source::Mechanism {
            definition: definition(id),
            form,
            shape: shape.to_vec(),
        };
        let ripple = wavelength_m(&of(Id::DriveRipple, 1, &[0.005])).expect("a wave");
        let profile = detail_m(&of(Id::RailStraightness, 2, &[0.1, 1.04])).expect("a profile");
        assert!((profile - 0.02).abs() < 1e-12 && profile > COARSE * ripple);
        let orders = detail_m(&of(Id::RailStraightness, 1, &[0.3])).expect("a wave of three orders");
        assert!((orders - 0.1).abs() < 1e-12);
        assert_eq!(detail_m(&of(Id::RailJoint, 0, &[0.3])), None);
    }
}
