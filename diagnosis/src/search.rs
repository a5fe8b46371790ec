//! Which causes act: forward selection over the library, with second thoughts.
//!
//! Every step takes up the cause that explains most beyond what its freedom costs, refined in its shape, if both
//! [locks](crate::locks) open and its force is worth a mention. Before a new cause is taken up, those already there may
//! take a richer form: most spurious second names are the first one's missing shape. After it, each one may be
//! exchanged for a better one or dropped.

use simulation::mechanism::{Definition, Form, Id, library};

use crate::bench::{Bench, Candidate, Fit, Gain, Member, Source};
use crate::linear::{Cholesky, Symmetric, dot};
use crate::locks::Locks;
use crate::nominal::Nominal;
use crate::sanity::channel_end;
use crate::story::Curve;

/// Most causes that act together.
const MOST: usize = 6;

/// Probability of a false name that is accepted, over all causes together.
const ALPHA: f64 = 0.01;

/// Causes that are refined in every step.
const SHORT_LIST: usize = 4;

/// Most points of a grid over shape parameters.
const MOST_POINTS: usize = 150;

/// Prior values of the parameters: how far calibration has moved each already, and its tolerance.
pub(crate) struct Tolerances<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) moved: &'a [f64],
}

/// What the search found.
pub(crate) struct Found {
    pub(crate) members: Vec<Member>,
    pub(crate) p_no_mismatch: f64,
}

/// Everything that may be taken up, whitened.
pub(crate) struct Pool {
    pub(crate) causes: Vec<Candidate>,
    pub(crate) stories: Vec<Candidate>,
    /// Number of different causes.
    pub(crate) kinds: usize,
}

impl Pool {
    pub(crate) fn new(bench: &Bench<'_>, tolerances: &Tolerances<'_>) -> Self {
        let mut causes = Vec::new();
        let mut kinds = 0;
        let limits = limits(bench);
        for definition in library() {
            let before = causes.len();
            let shapes = match definition.id {
                // what the channel itself shows is no matter of a fit
                Id::ForceSaturation => limits.iter().map(|limit| vec![*limit]).collect(),
                _ => definition.forms.first().map(grid).unwrap_or_default(),
            };
            for shape in shapes {
                causes.extend(bench.candidate(Source::Mechanism { definition, form: 0, shape }));
            }
            kinds += usize::from(causes.len() > before);
        }
        for (parameter, what) in tolerances.nominal.parameters.iter().enumerate() {
            if what.sigma.is_some() {
                causes.extend(bench.candidate(Source::Shift { parameter }));
                kinds += 1;
            }
        }
        let stories: Vec<Candidate> = Curve::all(bench.contexts, &bench.compared)
            .into_iter()
            .filter_map(|curve| bench.candidate(Source::Story { curve }))
            .collect();
        Pool { causes, stories, kinds }
    }
}

/// Sizes at which the force of a run stays as it is: the ends of its channel.
fn limits(bench: &Bench<'_>) -> Vec<f64> {
    let mut limits: Vec<f64> = bench.contexts.iter().filter_map(|c| channel_end(&c.run.drag_force_n)).collect();
    limits.sort_unstable_by(f64::total_cmp);
    limits.dedup_by(|b, a| *b - *a < 1e-3 * *a);
    limits
}

/// Grid over the shape parameters of a form.
fn grid(form: &Form) -> Vec<Vec<f64>> {
    let mut points: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in form.shape {
        let others: usize = form.shape.iter().map(|p| p.grid.max(1)).product::<usize>() / parameter.grid.max(1);
        let count = parameter.grid.clamp(1, (MOST_POINTS / others.clamp(1, MOST_POINTS)).max(2));
        let values: Vec<f64> = (0..count)
            .map(|k| if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 })
            .map(|share| between(parameter.from, parameter.to, parameter.log, share))
            .collect();
        points = points
            .iter()
            .flat_map(|point| values.iter().map(move |value| point.iter().copied().chain([*value]).collect()))
            .collect();
    }
    points
}

fn between(from: f64, to: f64, log: bool, share: f64) -> f64 {
    if log { from * (to / from).powf(share) } else { from + (to - from) * share }
}

/// Makes the shape finer by halving steps around where it is.
pub(crate) fn refine(bench: &Bench<'_>, candidate: &Candidate, fit: &Fit) -> (Candidate, Gain) {
    let mut best = candidate.clone();
    bench.prepare(&mut best, &fit.active);
    let mut gain = bench.gain(&best, fit);
    let Source::Mechanism { definition, form, .. } = best.source else { return (best, gain) };
    if definition.id == Id::ForceSaturation {
        return (best, gain);
    }
    let parameters = definition.forms[form].shape;
    let mut steps: Vec<f64> = parameters.iter().map(|p| 0.5 / (p.grid.max(2) - 1) as f64).collect();
    let rounds = if parameters.is_empty() { 0 } else { 5 };
    for _ in 0..rounds {
        for (k, parameter) in parameters.iter().enumerate() {
            for side in [-1.0, 1.0] {
                let Source::Mechanism { shape, .. } = &best.source else { break };
                let mut shape = shape.clone();
                let (from, to) = (parameter.from, parameter.to);
                let share = if parameter.log {
                    (shape[k] / from).ln() / (to / from).ln()
                } else {
                    (shape[k] - from) / (to - from)
                };
                let moved = (share + side * steps[k]).clamp(0.0, 1.0);
                if moved == share {
                    continue;
                }
                shape[k] = between(from, to, parameter.log, moved);
                let Some(mut other) = bench.candidate(Source::Mechanism { definition, form, shape }) else { continue };
                bench.prepare(&mut other, &fit.active);
                let other_gain = bench.gain(&other, fit);
                if other_gain.score > gain.score {
                    (best, gain) = (other, other_gain);
                    break;
                }
            }
            steps[k] *= 0.5;
        }
    }
    (best, gain)
}

/// The best of each cause beyond a fit, best first.
pub(crate) fn ranked(
    bench: &Bench<'_>,
    pool: &mut [Candidate],
    fit: &Fit,
    tolerances: &Tolerances<'_>,
) -> Vec<(usize, Gain)> {
    let mut best: Vec<(usize, Gain)> = Vec::new();
    for index in 0..pool.len() {
        bench.prepare(&mut pool[index], &fit.active);
        let gain = bench.gain(&pool[index], fit);
        if !(gain.nats > 0.0) || !is_beyond_tolerance(&pool[index].source, &gain, tolerances) {
            continue;
        }
        match best.iter_mut().find(|(other, _)| pool[*other].source.is_kin(&pool[index].source)) {
            Some(entry) if gain.score > entry.1.score => *entry = (index, gain),
            Some(_) => {}
            None => best.push((index, gain)),
        }
    }
    best.sort_by(|a, b| b.1.score.total_cmp(&a.1.score));
    best
}

/// A shift within three standard deviations is no finding.
fn is_beyond_tolerance(source: &Source, gain: &Gain, tolerances: &Tolerances<'_>) -> bool {
    match source {
        Source::Shift { parameter } => {
            let sigma = tolerances.nominal.parameters[*parameter].sigma.unwrap_or(f64::INFINITY);
            (tolerances.moved[*parameter] + gain.amplitudes[0]).abs() > 3.0 * sigma
        }
        _ => true,
    }
}

/// Whether both locks open.
pub(crate) fn is_open(locks: &Locks, kinds: usize, points: usize) -> bool {
    let level = (kinds.max(1) as f64 / ALPHA).ln();
    locks.ln_e - (points.max(1) as f64).ln() > level && locks.p < ALPHA / kinds.max(1) as f64
}

/// Runs the search. `floor_n`: RMS force below which a cause is not worth a mention.
pub(crate) fn search(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, floor_n: f64) -> Found {
    let mut members: Vec<Member> = Vec::new();
    let p_no_mismatch = omnibus(bench, pool, tolerances);
    // taking up and dropping may go round in circles
    for _ in 0..2 * MOST {
        if members.len() >= MOST {
            break;
        }
        let fit = bench.fit(&bench.active(&members));
        let short = short_list(bench, pool, &fit, tolerances, &members);
        let Some(chosen) = short
            .into_iter()
            .find(|(candidate, gain)| gain.score > 0.0 && holds(bench, pool, candidate, gain, &members, floor_n))
        else {
            break;
        };
        if let Some((at, richer)) = best_upgrade(bench, &members, chosen.1.score) {
            members[at] = bench.take(richer);
        } else {
            members.push(bench.take(chosen.0));
        }
        exchange(bench, pool, tolerances, &mut members);
        drop_idle(bench, &mut members);
    }
    polish(bench, &mut members);
    prune(bench, pool, &mut members, floor_n);
    Found { members, p_no_mismatch }
}

/// Whether a candidate may be named beside the members: real and worth it.
///
/// The evidence for a shift is what its tolerance would have to be stretched by. The data alone, which the locks ask,
/// cannot tell a parameter that is free from one that is not.
fn holds(bench: &Bench<'_>, pool: &Pool, candidate: &Candidate, gain: &Gain, members: &[Member], floor_n: f64) -> bool {
    if matches!(candidate.source, Source::Shift { .. }) {
        return gain.score > (pool.kinds as f64).ln();
    }
    is_relevant(bench, candidate, gain, floor_n)
        && is_open(&bench.locks(candidate, gain, members), pool.kinds, points_of(pool, &candidate.source))
}

/// Drops, the weakest first, members that do not hold beside the others.
fn prune(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor_n: f64) {
    loop {
        let failing = (0..members.len())
            .filter_map(|at| {
                let others: Vec<Member> = without(members, at);
                let fit = bench.fit(&bench.active(&others));
                let mut candidate = members[at].candidate.clone();
                bench.prepare(&mut candidate, &fit.active);
                let gain = bench.gain(&candidate, &fit);
                (!holds(bench, pool, &candidate, &gain, &others, floor_n)).then_some((at, gain.nats))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, _)) = failing else { return };
        members.remove(at);
    }
}

fn points_of(pool: &Pool, source: &Source) -> usize {
    pool.causes.iter().filter(|other| other.source.is_kin(source)).count()
}

/// p-value of "nothing is missing": both tests, over every cause and every curve.
fn omnibus(bench: &Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>) -> f64 {
    let fit = bench.fit(&bench.law());
    let number = (pool.kinds + pool.stories.len()) as f64;
    let mut tested = Vec::new();
    let causes = ranked(bench, &mut pool.causes, &fit, tolerances);
    for (index, gain) in causes.iter().take(SHORT_LIST) {
        if matches!(pool.causes[*index].source, Source::Shift { .. }) {
            // twice the gain is the square of a standard normal number
            tested.push((libm::erfc(gain.nats.sqrt()), gain.score));
            continue;
        }
        let locks = bench.locks(&pool.causes[*index], gain, &[]);
        tested.push((locks.p, locks.ln_e - (points_of(pool, &pool.causes[*index].source) as f64).ln()));
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
    let order = ranked(bench, &mut pool.causes, fit, tolerances);
    let leading = order.first().map_or(0.0, |(_, gain)| gain.score);
    let mut list: Vec<(Candidate, Gain)> = order
        .into_iter()
        .filter(|(index, gain)| {
            gain.score > 0.5 * leading
                && !members.iter().any(|m| m.candidate.source.is_kin(&pool.causes[*index].source))
        })
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
    // where two tie, the simpler one leads
    list.sort_by(|a, b| {
        let simpler = |c: &Candidate| simplicity(&c.source);
        if (a.1.score - b.1.score).abs() < 1.0 {
            simpler(&a.0).cmp(&simpler(&b.0))
        } else {
            b.1.score.total_cmp(&a.1.score)
        }
    });
    list
}

/// Order among causes that a recording cannot tell apart: the lowest leads.
pub(crate) fn simplicity(source: &Source) -> u8 {
    match source {
        Source::Mechanism { definition, .. } => definition.simplicity,
        Source::Shift { .. } => 0,
        Source::Story { .. } => u8::MAX,
    }
}

fn without(members: &[Member], at: usize) -> Vec<Member> {
    members.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, member)| member.clone()).collect()
}

/// The upgrade of a member's form that explains at least half of what a new cause would.
fn best_upgrade(bench: &Bench<'_>, members: &[Member], rival: f64) -> Option<(usize, Candidate)> {
    let mut best: Option<(f64, usize, Candidate)> = None;
    for (at, member) in members.iter().enumerate() {
        let Source::Mechanism { definition, form, .. } = &member.candidate.source else { continue };
        if definition.forms.len() < 2 && definition.forms[*form].shape.is_empty() {
            continue;
        }
        let fit = bench.fit(&bench.active(&without(members, at)));
        let mut own = member.candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let now = bench.gain(&own, &fit).score;
        for candidate in richer(bench, definition, *form, &fit).into_iter().chain([refine(bench, &own, &fit)]) {
            let more = candidate.1.score - now;
            if more > 0.5 * rival.max(4.0) && best.as_ref().is_none_or(|(score, ..)| more > *score) {
                best = Some((more, at, candidate.0));
            }
        }
    }
    best.map(|(_, at, candidate)| (at, candidate))
}

/// The other forms of a mechanism, each at its best shape.
pub(crate) fn richer(
    bench: &Bench<'_>,
    definition: &'static Definition,
    form: usize,
    fit: &Fit,
) -> Vec<(Candidate, Gain)> {
    (0..definition.forms.len())
        .filter(|other| *other != form)
        .filter_map(|other| {
            let best = grid(&definition.forms[other])
                .into_iter()
                .filter_map(|shape| bench.candidate(Source::Mechanism { definition, form: other, shape }))
                .map(|mut candidate| {
                    bench.prepare(&mut candidate, &fit.active);
                    let gain = bench.gain(&candidate, fit);
                    (candidate, gain)
                })
                .max_by(|a, b| a.1.score.total_cmp(&b.1.score))?;
            Some(refine(bench, &best.0, fit))
        })
        .collect()
}

/// Replaces members by causes that do better in their place.
fn exchange(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, members: &mut [Member]) {
    if members.len() < 2 {
        return;
    }
    for at in 0..members.len() {
        let others = without(members, at);
        let fit = bench.fit(&bench.active(&others));
        let mut own = members[at].candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let (own, now) = refine(bench, &own, &fit);
        let better = short_list(bench, pool, &fit, tolerances, &others)
            .into_iter()
            .find(|(candidate, gain)| gain.score > now.score + 3.0 && !candidate.source.is_kin(&own.source));
        members[at] = bench.take(better.map_or(own, |(candidate, _)| candidate));
    }
}

/// Drops members that the others have made superfluous.
fn drop_idle(bench: &Bench<'_>, members: &mut Vec<Member>) {
    loop {
        let scores: Vec<f64> = (0..members.len())
            .map(|at| {
                let fit = bench.fit(&bench.active(&without(members, at)));
                let mut own = members[at].candidate.clone();
                bench.prepare(&mut own, &fit.active);
                bench.gain(&own, &fit).score
            })
            .collect();
        let Some(at) =
            (0..scores.len()).filter(|at| scores[*at] < 0.0).min_by(|a, b| scores[*a].total_cmp(&scores[*b]))
        else {
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
        let fit = bench.fit(&bench.active(&without(members, at)));
        let (own, _) = refine(bench, &members[at].candidate, &fit);
        members[at] = bench.take(own);
    }
}

/// Whether what the law's parameters cannot imitate of a cause exceeds the floor.
fn is_relevant(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, floor_n: f64) -> bool {
    let Some(raw) = bench.raw(&candidate.source) else { return false };
    let rows = raw.first().map_or(0, Vec::len);
    let force: Vec<f64> =
        (0..rows).map(|n| raw.iter().zip(&gain.amplitudes).map(|(column, x)| column[n] * x).sum()).collect();
    beyond_law_n(bench, &force) > floor_n
}

/// RMS of what of a force the law's parameters cannot imitate, N.
pub(crate) fn beyond_law_n(bench: &Bench<'_>, force: &[f64]) -> f64 {
    let plain = bench.rows.plain(force);
    let tangent: Vec<Vec<f64>> = bench.tangent.iter().map(|column| bench.rows.plain(column)).collect();
    let mut a = Symmetric::zeros(tangent.len());
    for i in 0..tangent.len() {
        for j in 0..=i {
            a.set(i, j, dot(&tangent[i], &tangent[j]));
        }
    }
    let b: Vec<f64> = tangent.iter().map(|column| dot(column, &plain)).collect();
    let x = Cholesky::of(&a).solve(&b);
    ((dot(&plain, &plain) - dot(&b, &x)).max(0.0) / plain.len().max(1) as f64).sqrt()
}
