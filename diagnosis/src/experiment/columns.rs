//! Columns of the law and of every explanation, over the recording and over a hypothetical run, in one order: the law's
//! tangent, other causes found, then each rival with its changes of shape.

use simulation::Simulation;
use simulation::mechanism::{Context, Id, Search};
use simulation::profile::Course;

use crate::fit::member::{Candidate, Member};
use crate::fit::source::{Source, raw_columns};
use crate::fit::story;
use crate::nominal::Nominal;
use crate::recording::sanity::Comparable;
use crate::report::DataQuality;
use crate::search::found::Found;

use super::menu::{Entry, KNOWN_MASS_KG, added_mass_kg, dead_weight_n, is_free, left_of};
use super::scene::Scene;
use super::separation::Explanation;

/// Relative step of a wavelength; small, because its phase error accumulates.
const OF_WAVE: f64 = 1e-3;

/// Sources and indices of the columns.
pub(super) struct Parts {
    /// Number of columns that all explanations have in common.
    pub(super) common: usize,
    law: usize,
    others: Vec<Source>,
    sources: Vec<Rival>,
    pub(super) rivals: Vec<Explanation>,
}

/// A rival, and itself with one shape parameter moved.
struct Rival {
    source: Source,
    amplitudes: Vec<f64>,
    moved: Vec<Source>,
}

impl Rival {
    /// Its own columns, and the slopes of its force as each shape parameter moves; 0 where `columns` has none.
    fn with_slopes(&self, own: Vec<Vec<f32>>, columns: impl Fn(&Source) -> Option<Vec<Vec<f32>>>) -> Vec<Vec<f32>> {
        let slope_to = |there: &Source| match columns(there) {
            Some(there) => slope(&own, &there, &self.amplitudes),
            None => slope(&own, &own, &self.amplitudes),
        };
        let slopes: Vec<Vec<f32>> = self.moved.iter().map(slope_to).collect();
        own.into_iter().chain(slopes).collect()
    }
}

impl Parts {
    /// Rivals without a force are omitted.
    pub(super) fn of(found: &Found<'_>, others: &[Member], rivals: &[&Candidate]) -> Self {
        let bench = &found.bench;
        let fit = bench.fit_members(others);
        let law = bench.law().len();
        let common = law + others.iter().map(|member| member.candidate.columns.len()).sum::<usize>();
        let others = others.iter().map(|member| member.candidate.source.clone()).collect();
        let mut parts = Parts { common, law, others, sources: Vec::new(), rivals: Vec::new() };
        let mut next = common;
        for candidate in rivals {
            let mut candidate = (*candidate).clone();
            candidate.forget();
            bench.prepare(&mut candidate, &fit.active);
            let amplitudes = bench.gain(&candidate, &fit).amplitudes;
            if amplitudes.iter().all(|x| *x == 0.0) {
                continue;
            }
            let moved = moved(&candidate.source);
            let columns = next..next + amplitudes.len();
            let slopes = columns.end..columns.end + moved.len();
            next = slopes.end;
            parts.rivals.push(Explanation { columns, slopes, amplitudes: amplitudes.clone() });
            parts.sources.push(Rival { source: candidate.source, amplitudes, moved });
        }
        parts
    }

    /// Sources of the rivals.
    pub(super) fn sources(&self) -> impl Iterator<Item = &Source> {
        self.sources.iter().map(|rival| &rival.source)
    }
}

/// The source with one of its searched shape parameters moved, for each of them: one grid step either way, which also
/// covers richer forms of the same cause, such as two time constants instead of one.
fn moved(source: &Source) -> Vec<Source> {
    let Source::Mechanism { definition, form, shape } = source else { return Vec::new() };
    let mut sources = Vec::new();
    for (k, parameter) in definition.forms[*form].shape.iter().enumerate() {
        let steps = (parameter.grid.max(2) - 1) as f64;
        let values = match parameter.search {
            Search::Wave => [shape[k], shape[k] * (1.0 + OF_WAVE)],
            Search::StrokeStart | Search::StrokeEnd => continue,
            _ => {
                let share = parameter.share_of(shape[k]);
                [-1.0, 1.0].map(|way| parameter.at((share + way / steps).clamp(0.0, 1.0)))
            }
        };
        for value in values {
            if (value - shape[k]).abs() > 1e-6 * shape[k].abs() {
                let mut moved = shape.clone();
                moved[k] = value;
                sources.push(Source::Mechanism { definition, form: *form, shape: moved });
            }
        }
    }
    sources
}

/// Change of a force by a step of the shape.
fn slope(here: &[Vec<f32>], there: &[Vec<f32>], amplitudes: &[f64]) -> Vec<f32> {
    let rows = here.first().map_or(0, Vec::len);
    let mut slope = vec![0.0; rows];
    for ((here, there), x) in here.iter().zip(there).zip(amplitudes) {
        for ((slope, here), there) in slope.iter_mut().zip(here).zip(there) {
            *slope += *x as f32 * (there - here);
        }
    }
    slope
}

/// Whitened columns over the recording.
pub(super) fn of_recording(found: &Found<'_>, others: &[Member], parts: &Parts) -> Vec<Vec<f32>> {
    let bench = &found.bench;
    let mut columns: Vec<Vec<f32>> = bench.law().iter().map(|column| bench.base[*column].clone()).collect();
    columns.extend(others.iter().flat_map(|member| member.candidate.columns.iter().cloned()));
    let white = |source: &Source| bench.candidate(source.clone()).map(|candidate| candidate.columns.to_vec());
    for rival in &parts.sources {
        let own = white(&rival.source).unwrap_or_else(|| vec![vec![0.0; bench.rows.len()]; rival.amplitudes.len()]);
        columns.extend(rival.with_slopes(own, white));
    }
    columns
}

/// The same over a run of the menu, in units of the noise; `None` where the axis cannot be driven so.
pub(super) fn of_run(
    entry: &Entry,
    scene: &Scene,
    nominal: &Nominal,
    complete: &Simulation,
    found: &Found<'_>,
    parts: &Parts,
) -> Option<Vec<Vec<f32>>> {
    let courses = courses(entry, scene)?;
    let machine = loaded(complete, entry);
    let mut driven = Driven::new(entry, complete, parts.law);
    for course in &courses {
        driven.drive(course, &machine, nominal, found)?;
    }
    let law = |parameter| driven.white(&Source::Shift { parameter }, 1);
    let mut columns: Vec<Vec<f32>> = (0..parts.law).flat_map(law).collect();
    columns.extend(parts.others.iter().flat_map(|source| driven.white(source, count(source))));
    for rival in &parts.sources {
        let white = |source: &Source| driven.white(source, rival.amplitudes.len());
        columns.extend(rival.with_slopes(white(&rival.source), |source| Some(white(source))));
    }
    (columns.len() == parts.rivals.last().map_or(0, |last| last.slopes.end)).then_some(columns)
}

/// Courses of a run of the menu, at the place of the recorded stroke.
fn courses(entry: &Entry, scene: &Scene) -> Option<Vec<Course>> {
    let mut courses = (entry.drive)(scene).ok().filter(|courses| !courses.is_empty())?;
    for Course { run, motion } in &mut courses {
        for x in run.position_m.iter_mut().flatten().chain(&mut motion.position_m) {
            *x += scene.start_m;
        }
    }
    Some(courses)
}

/// Mass that the simulation states of the carriage, kg.
fn carriage_kg(complete: &Simulation) -> Option<f64> {
    complete.axis.moved_mass_kg.filter(|mass| *mass > 0.0)
}

/// The simulation with the mass that a run of the menu adds.
fn loaded(complete: &Simulation, entry: &Entry) -> Simulation {
    let mut heavier = complete.clone();
    if added_mass_kg(entry.code) > 0.0 {
        heavier.axis.moved_mass_kg = Some(carriage_kg(complete).unwrap_or(0.0) + added_mass_kg(entry.code));
    }
    heavier
}

/// Number of columns of a source.
fn count(source: &Source) -> usize {
    match source {
        Source::Mechanism { definition, form, .. } => definition.forms[*form].amplitudes.len(),
        Source::Shift { .. } => 1,
        Source::Story { curve } => story::count(curve),
    }
}

/// A run of the menu, as far as it was driven.
struct Driven<'c> {
    code: &'static str,
    is_free: bool,
    carriage_kg: f64,
    contexts: Vec<Context<'c>>,
    /// Columns of the law's parameters.
    tangent: Vec<Vec<f64>>,
    /// Per row: 1 divided by the noise, N, and 0 where the row cannot be compared.
    weights: Vec<f64>,
}

impl<'c> Driven<'c> {
    /// `law`: number of the law's parameters.
    fn new(entry: &Entry, complete: &Simulation, law: usize) -> Self {
        Driven {
            code: entry.code,
            is_free: is_free(entry.code),
            carriage_kg: carriage_kg(complete).unwrap_or(KNOWN_MASS_KG),
            contexts: Vec::new(),
            tangent: vec![Vec::new(); law],
            weights: Vec::new(),
        }
    }

    /// Drives a further course; `None` where the law lacks an input for it.
    fn drive(&mut self, course: &'c Course, machine: &Simulation, nominal: &Nominal, found: &Found<'_>) -> Option<()> {
        let Course { run, motion } = course;
        let context = Context::of(machine, run, motion).ok()?;
        let keep = Comparable::as_driven(run, motion, &context.steady).rows(&mut DataQuality::default());
        self.weights.extend(keep.iter().map(|keep| if self.is_free || *keep { 1.0 / found.noise_n } else { 0.0 }));
        let force = nominal.force(&found.calibrated, run, motion).ok()?;
        let direction = &context.steady.direction;
        let own = nominal.tangent(&found.calibrated, run, (motion, motion), &force, direction).ok()?;
        for (column, own) in self.tangent.iter_mut().zip(own) {
            column.extend(own);
        }
        self.contexts.push(context);
        Some(())
    }

    /// Force per amplitude, N, and what this run leaves of it as a factor; `columns`: their number.
    fn raw(&self, source: &Source, columns: usize) -> (f64, Vec<Vec<f64>>) {
        let rows = self.weights.len();
        let shown = || raw_columns(source, &self.contexts).unwrap_or_else(|| vec![vec![0.0; rows]; columns]);
        match source {
            Source::Mechanism { definition, .. } => {
                let factor = left_of(self.code, definition.id, self.carriage_kg);
                if !(self.is_free && definition.id == Id::ForceGain) {
                    return (factor, shown());
                }
                // before the dead weight hangs on the sensor, it is free
                let hung = dead_weight_n(self.code);
                (factor, vec![(0..rows).map(|n| if n < rows / 2 { 0.0 } else { hung }).collect()])
            }
            Source::Shift { parameter } => (f64::from(!self.is_free), vec![self.tangent[*parameter].clone()]),
            Source::Story { .. } => (f64::from(!self.is_free), shown()),
        }
    }

    /// Columns of a source in units of the noise; `columns`: their number.
    fn white(&self, source: &Source, columns: usize) -> Vec<Vec<f32>> {
        let (factor, raw) = self.raw(source, columns);
        let of = |(x, weight): (&f64, &f64)| {
            let force = factor * x;
            if force.is_finite() { (force * weight) as f32 } else { 0.0 }
        };
        raw.iter().map(|column| column.iter().zip(&self.weights).map(of).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::definition;

    use super::*;

    #[test]
    fn a_delay_moves_by_steps_of_its_grid_which_is_the_finer_the_closer_to_none() {
        let definition = definition(Id::TimeMisalignment);
        let form = definition.forms.iter().position(|form| form.shape.len() == 1).expect("a form with a delay");
        let of = |delay_s: f64| Source::Mechanism { definition, form, shape: vec![delay_s] };
        let way_s = |delay_s: f64| {
            let shapes = moved(&of(delay_s)).into_iter().filter_map(|source| match source {
                Source::Mechanism { shape, .. } => shape.first().copied(),
                _ => None,
            });
            shapes.map(|moved_s| (moved_s - delay_s).abs()).fold(0.0, f64::max)
        };
        assert!(way_s(4e-4) < 1e-3 && way_s(4e-4) > 1e-5, "{}", way_s(4e-4));
        assert!(way_s(0.03) > 5.0 * way_s(4e-4), "{}", way_s(0.03));
    }
}
