//! Which causes act: forward selection over the library, with second thoughts.
//!
//! Every step takes up the cause that explains most beyond what its freedom costs, refined in its shape, if both
//! [locks](crate::locks) open and its force is worth a mention. Before a new cause is taken up, those already there may
//! take a richer form: most spurious second names are the first one's missing shape. After it, each one may be
//! exchanged for a better one or dropped.

use simulation::mechanism::{Definition, Form, Id, Kind, Search, ShapeParameter, library};

use crate::adequacy;
use crate::bench::{Bench, Candidate, Fit, Gain, Member, Source};
use crate::linear::dot;
use crate::locks::Locks;
use crate::nominal::Nominal;
use crate::spectrum::{Left, Waves, is_wave, span, tried};
use crate::story::Curve;

/// Most causes that act together.
const MOST: usize = 6;

/// Probability of a false name that is accepted, over all causes together.
const ALPHA: f64 = 0.01;

/// Share of all evidence below which a further cause is none: a form is an idealisation, and what it leaves of its own
/// cause's force, up to a seventh of it, is a fiftieth in square.
const FURTHER: f64 = 0.02;

/// The same for a cause whose size is the same throughout, which what a form leaves of another one is not.
const FURTHER_IF_EVEN: f64 = 0.005;

/// Highest order at which a wave repeats that is taken for the wave itself.
const ORDERS: f64 = 4.0;

/// Numbers less that make a cause the simpler one.
const MUCH: usize = 3;

/// Most of a cause's own evidence that is given up for a simpler one.
const MOST_LOST: f64 = 0.25;

/// Numbers less for each of which such a share is given up.
const MUCH_FOR_SHARE: usize = 5;

/// Logarithm of an e-value that no noise brings forth, whatever whitening gets wrong: under coloured noise that was
/// taken for white, 37 has been seen.
const BEYOND_NOISE: f64 = 120.0;

/// Causes that are refined in every step.
const SHORT_LIST: usize = 4;

/// Causes whose every form is looked at.
const LEADING: usize = 5;

/// Most points of a grid over shape parameters; of a form whose mechanism is already there, fewer.
const MOST_POINTS: usize = 150;
const MOST_POINTS_OF_RICHER: usize = 50;

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
    /// Those that are waves along the rail: their wavelengths follow from what a fit leaves.
    waves: Vec<&'static Definition>,
    /// Stroke over which waves are seen, m.
    span_m: f64,
    /// What the search for their lengths takes from runs and noise alone, by cause and form.
    spectra: Vec<(Id, usize, Waves)>,
    /// Causes all of whose forms are here.
    whole: Vec<Id>,
}

impl Pool {
    pub(crate) fn new(bench: &Bench<'_>, tolerances: &Tolerances<'_>, curves: &[Curve]) -> Self {
        let mut causes = Vec::new();
        let mut kinds = 0;
        let ends = span(bench);
        let (mut waves, span_m) = (Vec::new(), (ends.1 - ends.0).max(0.0));
        // what the channel itself shows is no matter of a fit
        for definition in library().iter().filter(|definition| definition.id != Id::ForceSaturation) {
            let before = causes.len();
            if definition.forms.first().is_some_and(is_wave) {
                waves.push(definition);
                kinds += 1;
                continue;
            }
            let shapes = definition.forms.first().map(|form| grid(form, MOST_POINTS, ends)).unwrap_or_default();
            let minimal = shapes.into_iter().map(|shape| Source::Mechanism { definition, form: 0, shape });
            let shapeless = (1..definition.forms.len()).filter(|form| definition.forms[*form].shape.is_empty());
            let richer = shapeless.map(|form| Source::Mechanism { definition, form, shape: Vec::new() });
            causes.extend(bench.candidates(minimal.chain(richer)));
            kinds += usize::from(causes.len() > before);
        }
        causes.extend(shifts(bench, tolerances));
        kinds += tolerances.nominal.parameters.iter().filter(|parameter| parameter.sigma.is_some()).count();
        let stories = bench.candidates(curves.iter().map(|curve| Source::Story { curve: curve.clone() }));
        Pool { causes, stories, kinds, waves, span_m, spectra: Vec::new(), whole: Vec::new() }
    }

    /// The same for another bench of the same runs and the same noise: columns stay, the law is another.
    pub(crate) fn again(mut self, bench: &Bench<'_>, tolerances: &Tolerances<'_>) -> Self {
        self.causes.retain(|candidate| !matches!(candidate.source, Source::Shift { .. }));
        self.causes.iter_mut().chain(&mut self.stories).for_each(Candidate::forget);
        self.causes.extend(shifts(bench, tolerances));
        self
    }

    /// The best of each cause beyond a fit, best first; of the leading ones in whichever form does best.
    pub(crate) fn ranked_causes(
        &mut self,
        bench: &Bench<'_>,
        fit: &Fit,
        tolerances: &Tolerances<'_>,
    ) -> Vec<(usize, Gain)> {
        let left = Left::of(bench, fit);
        let mut seen = Vec::new();
        for definition in self.waves.clone() {
            self.tune(bench, &left, definition, &mut seen);
        }
        let order = ranked(bench, &mut self.causes, fit, tolerances);
        let leading: Vec<Source> = order
            .iter()
            .map(|(index, _)| &self.causes[*index].source)
            .filter(|source| matches!(source, Source::Mechanism { .. }))
            .take(LEADING)
            .cloned()
            .collect();
        let before = self.whole.len();
        for source in leading {
            self.complete(bench, &left, &source);
        }
        if self.whole.len() == before {
            return order;
        }
        ranked(bench, &mut self.causes, fit, tolerances)
    }

    /// The best of a cause in any of its forms.
    fn best_of(&mut self, bench: &Bench<'_>, source: &Source, fit: &Fit) -> Option<(Candidate, Gain)> {
        let Source::Mechanism { definition, .. } = source else { return None };
        if !self.whole.contains(&definition.id) {
            self.complete(bench, &Left::of(bench, fit), source);
        }
        let of_kind =
            |c: &&mut Candidate| matches!(&c.source, Source::Mechanism { definition: d, .. } if d.id == definition.id);
        let mut best: Option<(&Candidate, Gain)> = None;
        for candidate in self.causes.iter_mut().filter(of_kind) {
            bench.prepare(candidate, &fit.active);
            let gain = bench.gain(candidate, fit);
            if best.as_ref().is_none_or(|(_, other)| gain.score > other.score) {
                best = Some((candidate, gain));
            }
        }
        best.map(|(candidate, _)| refine(bench, candidate, fit))
    }

    /// Adds the forms of a cause that a first look leaves out. What a form shares with the one of `source` (the place of
    /// a joint) is where it is there.
    fn complete(&mut self, bench: &Bench<'_>, left: &Left, source: &Source) {
        let Source::Mechanism { definition, form: known, shape: known_shape } = source else { return };
        if self.whole.contains(&definition.id) {
            return;
        }
        let shared = |name: &str| {
            let at = definition.forms[*known].shape.iter().position(|parameter| parameter.name == name)?;
            known_shape.get(at).copied()
        };
        self.whole.push(definition.id);
        for (form, what) in definition.forms.iter().enumerate() {
            if bench.is_relative && what.shape.iter().any(|parameter| parameter.search == Search::StrokeStart) {
                continue;
            }
            if is_wave(what) && !self.waves.iter().any(|wave| wave.id == definition.id) {
                self.tune(bench, left, definition, &mut Vec::new());
            } else if form > 0 && !what.shape.is_empty() && !is_wave(what) {
                let shapes = grid_around(what, MOST_POINTS_OF_RICHER, span(bench), &shared);
                let source = |shape| Source::Mechanism { definition, form, shape };
                self.causes.extend(bench.candidates(shapes.into_iter().map(source)));
            }
        }
    }

    /// Adds the wavelengths that what is left points to, in every form that is a wave. `seen`: those of other causes,
    /// which a sensor may imitate; those of this one are added.
    fn tune(&mut self, bench: &Bench<'_>, left: &Left, definition: &'static Definition, seen: &mut Vec<f64>) {
        let waves: Vec<usize> = (0..definition.forms.len()).filter(|form| is_wave(&definition.forms[*form])).collect();
        let mut own = Vec::new();
        for form in &waves {
            let known = |(id, of, _): &(Id, usize, Waves)| *id == definition.id && of == form;
            if !self.spectra.iter().any(known) {
                self.spectra.push((definition.id, *form, Waves::of(bench, left, definition, *form)));
            }
            own.extend(self.spectra.iter().filter(|of| known(of)).flat_map(|(.., waves)| left.peaks(bench, waves)));
        }
        seen.extend(&own);
        let peaks = if definition.kind == Kind::Sensor { seen.clone() } else { own };
        let mut sources: Vec<Source> = Vec::new();
        for form in waves {
            for peak in &peaks {
                // what repeats after a wave may be the second order of one twice as long
                let lengths = if form > 0 { vec![*peak, 2.0 * peak] } else { vec![*peak] };
                for length in lengths.into_iter().filter(|length| is_within(&definition.forms[form].shape[0], *length))
                {
                    let close = |source: &Source| match source {
                        Source::Mechanism { definition: d, form: f, shape } if d.id == definition.id && *f == form => {
                            (1.0 / shape[0] - 1.0 / length).abs() * self.span_m < 0.1
                        }
                        _ => false,
                    };
                    if !self.causes.iter().map(|candidate| &candidate.source).chain(&sources).any(close) {
                        sources.push(Source::Mechanism { definition, form, shape: vec![length] });
                    }
                }
            }
        }
        self.causes.extend(bench.candidates(sources));
    }

    /// Numbers that were tried for a cause.
    fn points_of(&self, source: &Source) -> usize {
        match source {
            Source::Mechanism { definition, form, .. } if is_wave(&definition.forms[*form]) => {
                tried(&definition.forms[*form], self.span_m)
            }
            _ => self.causes.iter().filter(|other| other.source.is_kin(source)).count(),
        }
    }
}

/// The law's own parameters as causes.
fn shifts(bench: &Bench<'_>, tolerances: &Tolerances<'_>) -> Vec<Candidate> {
    let parameters = tolerances.nominal.parameters.iter().enumerate();
    parameters
        .filter(|(_, what)| what.sigma.is_some())
        .filter_map(|(parameter, _)| bench.candidate(Source::Shift { parameter }))
        .collect()
}

/// Grid over the shape parameters of a form.
pub(crate) fn grid(form: &Form, most: usize, stroke: (f64, f64)) -> Vec<Vec<f64>> {
    grid_around(form, most, stroke, &|_| None)
}

/// The same with the values that are `known`.
fn grid_around(form: &Form, most: usize, stroke: (f64, f64), known: &dyn Fn(&str) -> Option<f64>) -> Vec<Vec<f64>> {
    let mut points: Vec<Vec<f64>> = vec![Vec::new()];
    for parameter in form.shape {
        let free = |p: &&ShapeParameter| p.name != parameter.name && known(p.name).is_none();
        let others: usize = form.shape.iter().filter(free).map(|p| p.grid.max(1)).product();
        let count = parameter.grid.clamp(1, (most / others.clamp(1, most)).max(2));
        let values: Vec<f64> = match parameter.search {
            _ if known(parameter.name).is_some() => known(parameter.name).into_iter().collect(),
            Search::StrokeStart => vec![stroke.0],
            Search::StrokeEnd => vec![stroke.1],
            Search::Grid | Search::Wave => (0..count)
                .map(|k| if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 })
                .map(|share| between(parameter.from, parameter.to, parameter.log, share))
                .collect(),
        };
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
    let parameters = definition.forms[form].shape;
    let mut steps: Vec<f64> = match &best.source {
        Source::Mechanism { shape, .. } => {
            parameters.iter().zip(shape).map(|(p, x)| first_step(p, *x, bench)).collect()
        }
        _ => Vec::new(),
    };
    let rounds = if parameters.is_empty() { 0 } else { 5 };
    for _ in 0..rounds {
        for (k, parameter) in parameters.iter().enumerate().filter(|(_, parameter)| is_searched(parameter)) {
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

fn is_within(parameter: &ShapeParameter, value: f64) -> bool {
    (parameter.from..=parameter.to).contains(&value)
}

fn is_searched(parameter: &ShapeParameter) -> bool {
    matches!(parameter.search, Search::Grid | Search::Wave)
}

/// First step of a refinement, as a share of the range: half a step of the grid; for a wave what turns its phase by an
/// eighth over the stroke.
fn first_step(parameter: &ShapeParameter, value: f64, bench: &Bench<'_>) -> f64 {
    if parameter.search == Search::Wave {
        let (start, end) = span(bench);
        0.125 * value / (end - start).max(value) / (parameter.to / parameter.from).ln()
    } else {
        0.5 / (parameter.grid.max(2) - 1) as f64
    }
}

/// The best of each candidate's kind beyond a fit, best first.
pub(crate) fn ranked(
    bench: &Bench<'_>,
    pool: &mut [Candidate],
    fit: &Fit,
    tolerances: &Tolerances<'_>,
) -> Vec<(usize, Gain)> {
    let mut best: Vec<(usize, Gain)> = Vec::new();
    bench.prepare_all(pool, &fit.active);
    for index in 0..pool.len() {
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

/// Whether both locks open. What shows in a few blocks only (the fast run, the one warm-up) scatters between blocks and
/// never opens the second; there the first one must leave no doubt.
pub(crate) fn is_open(locks: &Locks, kinds: usize, points: usize) -> bool {
    let level = (kinds.max(1) as f64 / ALPHA).ln();
    let ln_e = locks.ln_e - (points.max(1) as f64).ln();
    ln_e > level && (locks.p < ALPHA / kinds.max(1) as f64 || (ln_e > BEYOND_NOISE && locks.p < 0.25))
}

/// p-value of what opened both locks, the best of `kinds` causes at `points` values.
pub(crate) fn p_of(locks: &Locks, kinds: usize, points: usize) -> f64 {
    let (kinds, points) = (kinds.max(1) as f64, points.max(1) as f64);
    let by_e = (kinds.ln() + points.ln() - locks.ln_e).exp().min(1.0);
    if locks.ln_e - points.ln() > BEYOND_NOISE { by_e } else { by_e.max((locks.p * kinds).min(1.0)) }
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
        let fit = bench.fit_members(&members);
        let short = short_list(bench, pool, &fit, tolerances, &members);
        let Some(chosen) = short
            .into_iter()
            .find(|(candidate, gain)| gain.score > 0.0 && holds(bench, pool, candidate, gain, &members, floor_n))
        else {
            break;
        };
        if let Some((at, richer)) = best_upgrade(bench, pool, &members, chosen.1.score) {
            members[at] = bench.take(richer);
        } else {
            members.push(bench.take(chosen.0));
        }
        exchange(bench, pool, tolerances, &mut members);
        drop_idle(bench, &mut members);
    }
    polish(bench, &mut members);
    simplify(bench, pool, tolerances, &mut members);
    prune(bench, pool, &mut members, floor_n);
    Found { members, p_no_mismatch }
}

/// Whether a candidate may be named beside the members: real and worth it.
///
/// The evidence for a shift is what its tolerance would have to be stretched by. The data alone, which the locks ask,
/// cannot tell a parameter that is free from one that is not.
fn holds(bench: &Bench<'_>, pool: &Pool, candidate: &Candidate, gain: &Gain, members: &[Member], floor_n: f64) -> bool {
    let law = bench.fit(&bench.law());
    let named = 0.5 * (law.rss - bench.fit_members(members).rss);
    if gain.nats < FURTHER_IF_EVEN * (named + gain.nats) {
        return false;
    }
    if matches!(candidate.source, Source::Shift { .. }) {
        return gain.score > (pool.kinds as f64).ln();
    }
    is_relevant(bench, candidate, gain, floor_n)
        && is_open(&bench.locks(candidate, gain, members), pool.kinds, pool.points_of(&candidate.source))
}

/// Drops, the weakest first, members that do not hold beside the others.
fn prune(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>, floor_n: f64) {
    loop {
        let failing = (0..members.len())
            .filter_map(|at| {
                let others: Vec<Member> = without(members, at);
                let fit = bench.fit_members(&others);
                let mut candidate = members[at].candidate.clone();
                bench.prepare(&mut candidate, &fit.active);
                let gain = bench.gain(&candidate, &fit);
                let fails = !holds(bench, pool, &candidate, &gain, &others, floor_n)
                    || (is_small(bench, &gain, &fit) && !adequacy::is_even(bench, members, at));
                fails.then_some((at, gain.nats))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, _)) = failing else { return };
        members.remove(at);
    }
}

/// Whether what a cause adds to a fit is no more than what a form may leave of the others.
pub(crate) fn is_small(bench: &Bench<'_>, gain: &Gain, beside: &Fit) -> bool {
    let law = bench.fit(&bench.law());
    gain.nats < FURTHER * (0.5 * (law.rss - beside.rss) + gain.nats)
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
    let order = pool.ranked_causes(bench, fit, tolerances);
    let leading = order.first().map_or(0.0, |(_, gain)| gain.score);
    let mut list: Vec<(Candidate, Gain)> = order
        .into_iter()
        .filter(|(index, gain)| {
            gain.score > 0.5 * leading
                && !members.iter().any(|m| {
                    is_twin(&m.candidate.source, &pool.causes[*index].source, tolerances)
                        || is_order(&m.candidate.source, &pool.causes[*index].source, pool.span_m)
                })
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
    let length = |source: &Source| match source {
        Source::Mechanism { definition, form, shape } if is_wave(&definition.forms[*form]) => shape.first().copied(),
        _ => None,
    };
    let (Some(there), Some(new)) = (length(there), length(new)) else { return false };
    let order = (there / new).round();
    (1.0..=ORDERS).contains(&order) && (1.0 / new - order / there).abs() * span_m < 0.5
}

/// Order among causes that a recording cannot tell apart: the lowest leads.
pub(crate) fn simplicity(source: &Source) -> u8 {
    match source {
        Source::Mechanism { definition, .. } => definition.simplicity,
        Source::Shift { .. } => 0,
        Source::Story { .. } => u8::MAX,
    }
}

pub(crate) fn without(members: &[Member], at: usize) -> Vec<Member> {
    members.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, member)| member.clone()).collect()
}

/// The upgrade of a member's form that explains at least half of what a new cause would.
fn best_upgrade(bench: &Bench<'_>, pool: &mut Pool, members: &[Member], rival: f64) -> Option<(usize, Candidate)> {
    let mut best: Option<(f64, usize, Candidate)> = None;
    for (at, member) in members.iter().enumerate() {
        let Source::Mechanism { definition, form, .. } = &member.candidate.source else { continue };
        if definition.forms.len() < 2 && definition.forms[*form].shape.is_empty() {
            continue;
        }
        let fit = bench.fit_members(&without(members, at));
        let mut own = member.candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let now = bench.gain(&own, &fit).score;
        for candidate in
            pool.best_of(bench, &member.candidate.source, &fit).into_iter().chain([refine(bench, &own, &fit)])
        {
            let more = candidate.1.score - now;
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
        let others = without(members, at);
        let fit = bench.fit_members(&others);
        let mut own = members[at].candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let (own, now) = refine(bench, &own, &fit);
        let better = short_list(bench, pool, &fit, tolerances, &others)
            .into_iter()
            .find(|(candidate, gain)| gain.score > now.score + 3.0 && !candidate.source.is_kin(&own.source));
        members[at] = bench.take(better.map_or(own, |(candidate, _)| candidate));
    }
}

/// Replaces members by causes with fewer numbers that explain as much but for a share that is worth no name.
fn simplify(bench: &mut Bench<'_>, pool: &mut Pool, tolerances: &Tolerances<'_>, members: &mut [Member]) {
    let law = bench.fit(&bench.law());
    let all = 0.5 * (law.rss - bench.fit_members(members).rss);
    for at in 0..members.len() {
        let others = without(members, at);
        let fit = bench.fit_members(&others);
        let mut own = members[at].candidate.clone();
        bench.prepare(&mut own, &fit.active);
        let own_nats = bench.gain(&own, &fit).nats;
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
        }
    }
}

/// Drops members that the others have made superfluous.
fn drop_idle(bench: &Bench<'_>, members: &mut Vec<Member>) {
    loop {
        let scores: Vec<f64> = (0..members.len())
            .map(|at| {
                let fit = bench.fit_members(&without(members, at));
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
        let fit = bench.fit_members(&without(members, at));
        let (own, _) = refine(bench, &members[at].candidate, &fit);
        members[at] = bench.take(own);
    }
}

/// Whether the force of a cause exceeds the floor.
pub(crate) fn is_relevant(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, floor_n: f64) -> bool {
    size_n(bench, &candidate.source, &gain.amplitudes) > floor_n
}

/// RMS of a cause's force, N.
fn size_n(bench: &Bench<'_>, source: &Source, amplitudes: &[f64]) -> f64 {
    let Some(raw) = bench.raw(source) else { return 0.0 };
    let rows = raw.first().map_or(0, Vec::len);
    let force: Vec<f64> =
        (0..rows).map(|n| raw.iter().zip(amplitudes).map(|(column, x)| column[n] * x).sum()).collect();
    let plain = bench.rows.plain(&force);
    (dot(&plain, &plain) / plain.len().max(1) as f64).sqrt()
}
