//! The pool of all candidates: the library's causes over grids of their shapes, the law's parameters set free, and
//! unnamed curves.

use rayon::prelude::*;
use simulation::curve::Curve;
use simulation::mechanism::{Definition, Form, Id, Kind, Search, ShapeParameter, library};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Candidate, Gain};
use crate::fit::refine::refine_all;
use crate::fit::source::{LATE, Source};
use crate::fit::spectrum::{Left, Waves, is_wave, span, tried};
use crate::nominal::Nominal;

/// Number of leading causes of which every form is examined.
const LEADING: usize = 5;

/// Most grid points over shape parameters; fewer for the richer forms of a mechanism that is already in the pool.
const MOST_POINTS: usize = 150;
const MOST_POINTS_OF_RICHER: usize = 50;

/// Priors of the parameters: how far calibration has already moved each, and its tolerance.
pub(crate) struct Tolerances<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) moved: &'a [f64],
}

/// All candidates, whitened.
pub(crate) struct Pool {
    pub(crate) causes: Vec<Candidate>,
    pub(crate) stories: Vec<Candidate>,
    /// Number of different causes.
    pub(crate) kinds: usize,
    /// Causes that are waves along the rail: their wavelengths follow from the residual of a fit.
    waves: Vec<&'static Definition>,
    /// Stroke over which waves are seen, m.
    pub(crate) span_m: f64,
    /// The part of the wavelength search that depends on runs and noise only, by cause and form.
    spectra: Vec<(Id, usize, Waves)>,
    /// Causes whose forms are all in the pool.
    whole: Vec<Id>,
}

impl Pool {
    pub(crate) fn new<'c>(
        bench: &Bench<'_>,
        tolerances: &Tolerances<'_>,
        curves: impl Iterator<Item = &'c Curve>,
        ringing: Option<&[Source]>,
    ) -> Self {
        let mut sources = Vec::new();
        let ends = span(bench);
        let (mut waves, span_m) = (Vec::new(), (ends.1 - ends.0).max(0.0));
        // the channel itself shows saturation: no fit is needed
        for definition in library().iter().filter(|definition| definition.id != Id::ForceSaturation) {
            let is_wave_first = definition.forms.first().is_some_and(is_wave);
            // the pitch of bolts says nothing of slow waves, nor they of it
            if is_wave_first || definition.id == Id::RailStraightness {
                waves.push(definition);
            }
            if is_wave_first {
                continue;
            }
            let shapes = definition.forms.first().map(|form| grid(form, MOST_POINTS, ends)).unwrap_or_default();
            if definition.id == Id::StructuralResonance {
                let Some(ringing) = ringing else { continue };
                sources.extend(ringing.iter().cloned());
            }
            let minimal = shapes.into_iter().map(|shape| Source::Mechanism { definition, form: 0, shape });
            let shapeless = (1..definition.forms.len()).filter(|form| definition.forms[*form].shape.is_empty());
            let richer = shapeless.map(|form| Source::Mechanism { definition, form, shape: Vec::new() });
            sources.extend(minimal.chain(richer));
        }
        let mut causes = bench.candidates(sources);
        let shiftable = tolerances.nominal.parameters.iter().filter(|parameter| parameter.can_shift()).count();
        let of_waves = waves.iter().filter(|wave| wave.forms.first().is_some_and(is_wave)).count();
        let kinds = of_waves + causes.chunk_by(|a, b| a.source.is_kin(&b.source)).count() + shiftable;
        causes.extend(shifts(bench, tolerances));
        let stories = bench.candidates(curves.map(|curve| Source::Story { curve: curve.clone() }));
        let mut pool = Pool { causes, stories, kinds, waves, span_m, spectra: Vec::new(), whole: LATE.to_vec() };
        // their minimal form may show nothing where another shows everything: a force late by several rows is not slope
        // times delay, and the effect of a filter on a start depends on what the drive did at rest
        for definition in library().iter().filter(|definition| LATE.contains(&definition.id)) {
            pool.add_richer(bench, definition, &|_| None);
        }
        pool
    }

    /// The same for another bench of the same runs and the same noise: columns are kept, those of the law are renewed.
    pub(crate) fn again(mut self, bench: &Bench<'_>, tolerances: &Tolerances<'_>) -> Self {
        self.causes.retain(|candidate| !candidate.source.is_shift());
        self.causes.iter_mut().chain(&mut self.stories).for_each(Candidate::forget);
        self.causes.extend(shifts(bench, tolerances));
        self
    }

    /// The best candidate of each cause beyond a fit, best first; for the leading causes over all their forms.
    pub(crate) fn ranked_causes(
        &mut self,
        bench: &Bench<'_>,
        fit: &Fit,
        tolerances: &Tolerances<'_>,
    ) -> Vec<(usize, Gain)> {
        let left = Left::of(bench, fit);
        self.tune(bench, &left, &self.waves.clone());
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
            self.complete(bench, fit, &left, &source);
        }
        if self.whole.len() == before {
            return order;
        }
        ranked(bench, &mut self.causes, fit, tolerances)
    }

    /// The best candidates of a cause in its `most` leading forms at the grid's points, refined.
    pub(crate) fn best_of(
        &mut self,
        bench: &Bench<'_>,
        source: &Source,
        fit: &Fit,
        most: usize,
    ) -> Vec<(Candidate, Gain)> {
        let Source::Mechanism { definition, .. } = source else { return Vec::new() };
        if !self.whole.contains(&definition.id) {
            self.complete(bench, fit, &Left::of(bench, fit), source);
        }
        let mut best: Vec<Option<(&Candidate, f64)>> = vec![None; definition.forms.len()];
        for candidate in &mut self.causes {
            let form = match &candidate.source {
                Source::Mechanism { definition: d, form, .. } if d.id == definition.id => *form,
                _ => continue,
            };
            bench.prepare(candidate, &fit.active);
            let score = bench.gain(candidate, fit).score;
            if best[form].is_none_or(|(_, other)| score > other) {
                best[form] = Some((candidate, score));
            }
        }
        let mut best: Vec<(&Candidate, f64)> = best.into_iter().flatten().collect();
        best.sort_by(|a, b| b.1.total_cmp(&a.1));
        refine_all(bench, best.into_iter().take(most).map(|(candidate, _)| candidate), fit)
    }

    /// The best candidate of every other form of a cause, among those ranked beyond a fit.
    pub(crate) fn other_forms(&self, bench: &Bench<'_>, source: &Source, fit: &Fit) -> Vec<usize> {
        let Source::Mechanism { definition, form: known, .. } = source else { return Vec::new() };
        let of_form = |form: usize| {
            let is_of_form = |index: &usize| match &self.causes[*index].source {
                Source::Mechanism { definition: d, form: f, .. } => d.id == definition.id && *f == form,
                _ => false,
            };
            let score = |index: &usize| bench.gain(&self.causes[*index], fit).score;
            (0..self.causes.len()).filter(is_of_form).max_by(|a, b| score(a).total_cmp(&score(b)))
        };
        (0..definition.forms.len()).filter(|form| form != known).filter_map(of_form).collect()
    }

    /// The best candidate of a cause in its minimal form beyond a fit.
    pub(crate) fn minimal(&mut self, bench: &Bench<'_>, source: &Source, fit: &Fit) -> Option<(&Candidate, Gain)> {
        let own = self.causes.iter_mut().filter(|c| c.source.is_minimal() && c.source.is_kin(source));
        own.map(|candidate| {
            bench.prepare(candidate, &fit.active);
            let gain = bench.gain(candidate, fit);
            (&*candidate, gain)
        })
        .max_by(|a, b| a.1.score.total_cmp(&b.1.score))
    }

    /// Adds the forms of a cause that a first look omits, at the shape parameters that they share with `source`. But
    /// where a bump fits best there need be no step: forms whose only parameter is a place are tried everywhere, and
    /// the others then share the place of the best of those.
    fn complete(&mut self, bench: &Bench<'_>, fit: &Fit, left: &Left, source: &Source) {
        let Source::Mechanism { definition, form: known, shape: known_shape } = source else { return };
        if self.whole.contains(&definition.id) {
            return;
        }
        self.whole.push(definition.id);
        let somewhere = self.somewhere(bench, definition);
        let (known, known_shape) = somewhere
            .into_iter()
            .map(|mut candidate| {
                bench.prepare(&mut candidate, &fit.active);
                let score = bench.gain(&candidate, fit).score;
                self.causes.push(candidate);
                (self.causes.len() - 1, score)
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .and_then(|(best, _)| match &self.causes[best].source {
                Source::Mechanism { form, shape, .. } => Some((*form, shape.clone())),
                _ => None,
            })
            .unwrap_or_else(|| (*known, known_shape.clone()));
        let shared = |name: &str| {
            let at = definition.forms[known].shape.iter().position(|parameter| parameter.name == name)?;
            known_shape.get(at).copied()
        };
        if definition.forms.iter().any(is_wave) && !self.waves.iter().any(|wave| wave.id == definition.id) {
            self.tune(bench, left, &[definition]);
        }
        self.add_richer(bench, definition, &shared);
    }

    /// The richer forms of a cause whose only parameter is a place, all over the stroke.
    fn somewhere(&self, bench: &Bench<'_>, definition: &'static Definition) -> Vec<Candidate> {
        let ends = span(bench);
        let forms = (1..definition.forms.len()).filter(|form| has_only_a_place(&definition.forms[*form]));
        let source = |form, shape| Source::Mechanism { definition, form, shape };
        let everywhere =
            |form: usize| grid(&definition.forms[form], MOST_POINTS, ends).into_iter().map(move |at| source(form, at));
        bench.candidates(forms.flat_map(everywhere))
    }

    /// Adds the richer forms of a cause over grids of their shapes, except waves and those of [`Self::somewhere`].
    fn add_richer(&mut self, bench: &Bench<'_>, definition: &'static Definition, known: &dyn Fn(&str) -> Option<f64>) {
        for (form, what) in definition.forms.iter().enumerate().skip(1) {
            let is_of_stroke = what.shape.iter().any(|parameter| parameter.search == Search::StrokeStart);
            if what.shape.is_empty() || has_only_a_place(what) || is_wave(what) || (bench.is_relative && is_of_stroke) {
                continue;
            }
            let shapes = grid_around(what, MOST_POINTS_OF_RICHER, span(bench), known);
            let source = |shape| Source::Mechanism { definition, form, shape };
            self.causes.extend(bench.candidates(shapes.into_iter().map(source)));
        }
    }

    /// Adds the wavelengths that the residual points to, in every wave form of these causes. A sensor may imitate the
    /// wavelengths of the causes before it.
    fn tune(&mut self, bench: &Bench<'_>, left: &Left, definitions: &[&'static Definition]) {
        let lengths = self.lengths(bench, left, definitions);
        let mut seen = Vec::new();
        let mut sources: Vec<Source> = Vec::new();
        for definition in definitions {
            let own = lengths.iter().filter(|(id, _)| *id == definition.id).flat_map(|(_, peaks)| peaks);
            let own: Vec<f64> = own.copied().collect();
            seen.extend(&own);
            let peaks = if definition.kind == Kind::Sensor { seen.clone() } else { own };
            for form in wave_forms(definition) {
                for peak in &peaks {
                    // a repeating residual may be the second order of a wave twice as long
                    let lengths = if form > 0 { vec![*peak, 2.0 * peak] } else { vec![*peak] };
                    let is_possible = |length: &f64| is_within(&definition.forms[form].shape[0], *length);
                    for length in lengths.into_iter().filter(is_possible) {
                        let is_close = |source: &Source| match source {
                            Source::Mechanism { definition: d, form: f, shape }
                                if d.id == definition.id && *f == form =>
                            {
                                (1.0 / shape[0] - 1.0 / length).abs() * self.span_m < 0.1
                            }
                            _ => false,
                        };
                        if !self.causes.iter().map(|candidate| &candidate.source).chain(&sources).any(is_close) {
                            sources.push(Source::Mechanism { definition, form, shape: vec![length] });
                        }
                    }
                }
            }
        }
        self.causes.extend(bench.candidates(sources));
    }

    /// Wavelengths that the residual points to, form by form of these causes.
    fn lengths(&mut self, bench: &Bench<'_>, left: &Left, definitions: &[&'static Definition]) -> Vec<(Id, Vec<f64>)> {
        let forms =
            definitions.iter().flat_map(|definition| wave_forms(definition).map(move |form| (*definition, form)));
        let is_new = |(definition, form): &(&Definition, usize)| {
            !self.spectra.iter().any(|(id, of, _)| *id == definition.id && of == form)
        };
        let new: Vec<_> = forms.filter(is_new).collect();
        self.spectra.par_extend(
            new.into_par_iter()
                .map(|(definition, form)| (definition.id, form, Waves::of(bench, left, definition, form))),
        );
        let asked = |(id, ..): &&(Id, usize, Waves)| definitions.iter().any(|definition| definition.id == *id);
        self.spectra.par_iter().filter(asked).map(|(id, _, waves)| (*id, left.peaks(bench, waves))).collect()
    }

    /// Number of grid points tried for a cause.
    pub(crate) fn points_of(&self, source: &Source) -> usize {
        match source {
            Source::Mechanism { definition, form, .. } if is_wave(&definition.forms[*form]) => {
                tried(&definition.forms[*form], self.span_m)
            }
            _ => self.causes.iter().filter(|other| other.source.is_kin(source)).count(),
        }
    }
}

fn has_only_a_place(form: &Form) -> bool {
    matches!(form.shape, [place] if place.search == Search::Place)
}

/// Forms of a cause that are waves.
fn wave_forms(definition: &Definition) -> impl Iterator<Item = usize> {
    (0..definition.forms.len()).filter(|form| is_wave(&definition.forms[*form]))
}

/// The law's own parameters as causes.
fn shifts(bench: &Bench<'_>, tolerances: &Tolerances<'_>) -> Vec<Candidate> {
    let parameters = tolerances.nominal.parameters.iter().enumerate();
    parameters
        .filter(|(_, what)| what.can_shift())
        .filter_map(|(parameter, _)| bench.candidate(Source::Shift { parameter }))
        .collect()
}

/// Grid over the shape parameters of a form.
pub(crate) fn grid(form: &Form, most: usize, stroke: (f64, f64)) -> Vec<Vec<f64>> {
    grid_around(form, most, stroke, &|_| None)
}

/// The same, with the `known` values fixed.
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
            Search::Place => places(parameter, stroke, count),
            Search::Grid
            | Search::EitherSide
            | Search::AlongStroke
            | Search::AlongTravel
            | Search::SinceTurn
            | Search::Wave => (0..count)
                .map(|k| if count == 1 { 0.5 } else { k as f64 / (count - 1) as f64 })
                .map(|share| parameter.at(share))
                .collect(),
        };
        points = points
            .iter()
            .flat_map(|point| values.iter().map(move |value| point.iter().copied().chain([*value]).collect()))
            .collect();
    }
    points
}

/// Places of a stroke, multiples of their grid's step: about `most` of them, and one beyond either end.
fn places(parameter: &ShapeParameter, stroke: (f64, f64), most: usize) -> Vec<f64> {
    let step = (parameter.to - parameter.from) / (parameter.grid - 1) as f64;
    let every = ((stroke.1 - stroke.0) / step / most as f64).ceil().max(1.0) * step;
    let (first, last) = ((stroke.0 / every).floor(), (stroke.1 / every).ceil());
    (0..=(last - first).max(0.0) as usize).map(|k| (first + k as f64) * every).collect()
}

fn is_within(parameter: &ShapeParameter, value: f64) -> bool {
    (parameter.from..=parameter.to).contains(&value)
}

/// The best candidate of each cause beyond a fit, best first.
pub(crate) fn ranked(
    bench: &Bench<'_>,
    pool: &mut [Candidate],
    fit: &Fit,
    tolerances: &Tolerances<'_>,
) -> Vec<(usize, Gain)> {
    let mut best: Vec<(usize, Gain)> = Vec::new();
    bench.prepare_all(pool, &fit.active);
    let gains: Vec<Gain> = pool.par_iter().map(|candidate| bench.gain(candidate, fit)).collect();
    for (index, gain) in gains.into_iter().enumerate() {
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

/// Whether a shift exceeds three standard deviations of its tolerance; within them it is no finding.
fn is_beyond_tolerance(source: &Source, gain: &Gain, tolerances: &Tolerances<'_>) -> bool {
    match source {
        Source::Shift { parameter } => {
            let sigma = tolerances.nominal.parameters[*parameter].sigma.unwrap_or(f64::INFINITY);
            (tolerances.moved[*parameter] + gain.amplitudes[0]).abs() > 3.0 * sigma
        }
        _ => true,
    }
}
