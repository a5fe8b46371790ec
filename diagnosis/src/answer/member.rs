//! The finding of a fitted cause: its name, its parameters with intervals, and a sentence.

use simulation::curve::Curve;
use simulation::mechanism::{Definition, Id, Search, ShapeParameter};

use crate::answer::finding;
use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Beside, Candidate, Member};
use crate::fit::source::Source;
use crate::nominal::Nominal;
use crate::report::{Estimate, Finding};
use crate::search::adequacy::Doubt;
use crate::search::equivalents::Set;
use crate::search::found::Found;
use crate::search::open_set;

/// Relative standard deviation between a form's parameter and the cause's true one: a form is an idealisation, and on
/// an opened trial the parameters of right names were off by this much beyond the uncertainty from noise.
const OF_FORM: f64 = 0.03;

/// Interval of a filter's time constant, s, from that of a filter which also acts between the rows.
///
/// ```text
/// lag of a continuous filter = τ    lag of one that acts on rows = Δt/(e^(Δt/τ) - 1)
/// ```
///
/// A slowly varying force determines only the product of lag and filtered part of the force, and not how fast the
/// filter's own rows are, which may be anything from Δt down to 0.
fn time_of_filter([low, high]: [f64; 2], part: f64, step_s: f64) -> [f64; 2] {
    let lag_s = high * part.max(1.0);
    [low * part.min(1.0), step_s / (step_s / lag_s).ln_1p()]
}

/// An unnamed effect, modelled by the cause that comes nearest.
fn stands_in(source: &Source, doubt: Doubt, share: f64) -> Finding {
    let id = source.id();
    let why = match doubt {
        Doubt::Uneven => "its size is not the same throughout the recording".to_owned(),
        Doubt::WithLoad => "it does not grow with the load as that would".to_owned(),
        Doubt::HardlyAlongTheStroke => "it acts after a turn more than along the stroke".to_owned(),
        Doubt::BesideNameless => "something beside it that changes as slowly has no name".to_owned(),
        Doubt::LessThanNameless => "something beside it that has no name explains more".to_owned(),
        Doubt::BeyondAnyMachine(name) => format!("its {name} would have to be more than any machine has"),
        Doubt::OneOfMany(causes) => format!("{causes} causes of the library follow it alike"),
        Doubt::AtTheEnd(number) => format!("its {number} lies at the end of what it can be"),
    };
    Finding {
        id: "unknown".to_owned(),
        kind: "unknown",
        confidence: TRUST_IN_DOUBT,
        equivalents: Vec::new(),
        carried_over: None,
        on_holdout: None,
        parameters: Vec::new(),
        share_of_mismatch: share,
        statement: format!(
            "Something that the library has no name for: {id} comes nearest and stands in for it in the augmented \
             simulation, but {why}."
        ),
    }
}

/// Confidence in a name: the share of such names that were right in the opened trials 23 and 24, on recordings with
/// something hidden, by the number of causes named together and by this one's share of the mismatch. (The evidence
/// alone knows only the library's causes.) Right were 0.98 of names alone or read off a channel (743) and of two with
/// most of the mismatch (141), 0.96 of others with more than a tenth (222), 0.92 of the smaller of two (48; less over
/// trials 20 to 24), 0.77 of the smaller of more (48).
fn trust(named: usize, share: f64) -> f64 {
    match named {
        1 => 0.95,
        _ if share > 0.1 => 0.95,
        2 => 0.85,
        _ => 0.75,
    }
}

/// The same for unnamed effects: where a curve does better than every name (113 of 119), and where a name is doubted
/// (23 of 36).
const TRUST_IN_CURVE: f64 = 0.9;
pub(super) const TRUST_IN_DOUBT: f64 = 0.6;

/// A member whose finding is to be written.
pub(crate) struct Named<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) found: &'a Found<'a>,
    /// Variances of the fit, in the order of its columns.
    pub(crate) variances: &'a [f64],
    /// Index of the member.
    pub(crate) at: usize,
    pub(crate) amplitudes: &'a [f64],
}

/// What is told of a cause.
struct Told {
    kind: &'static str,
    parameters: Vec<Estimate>,
    statement: String,
}

impl Named<'_> {
    /// The finding, with this share of the mismatch.
    pub(crate) fn finding(&self, share: f64) -> Finding {
        let (found, member) = (self.found, self.member());
        let source = &member.candidate.source;
        if let Some(doubt) = found.doubts[self.at] {
            return stands_in(source, doubt, share);
        }
        let Told { kind, parameters, statement } = match source {
            Source::Mechanism { definition, form, shape } => self.told_of_mechanism(definition, *form, shape),
            Source::Shift { parameter } => self.told_of_shift(*parameter),
            Source::Story { curve } => told_of_curve(source, curve, self.amplitudes),
        };
        let trust = if source.is_story() { TRUST_IN_CURVE } else { trust(found.members.len(), share) };
        let set = &found.sets[self.at];
        Finding {
            id: source.id().to_owned(),
            kind,
            confidence: set.confidence.min(trust),
            equivalents: equivalents(set, source),
            carried_over: None,
            on_holdout: None,
            parameters,
            share_of_mismatch: share,
            statement,
        }
    }

    fn member(&self) -> &Member {
        &self.found.members[self.at]
    }

    fn told_of_mechanism(&self, definition: &Definition, form: usize, shape: &[f64]) -> Told {
        let mut parameters = Vec::new();
        if definition.id == Id::ForceQuantisation {
            parameters.extend(self.found.coarse_step_n.map(finding::step));
        }
        let form = &definition.forms[form];
        for ((amplitude, value), column) in form.amplitudes.iter().zip(self.amplitudes).zip(&self.member().base) {
            let deviation = self.deviation(*column);
            // at the end of its range, or collinear with other columns: the data say nothing of it
            if (*value == 0.0 && !self.found.fit.active.contains(column)) || deviation.is_infinite() {
                continue;
            }
            let sigma = deviation.hypot(OF_FORM * value);
            parameters.push(estimate(amplitude.name, *value, sigma, amplitude.unit));
        }
        let shapes = form.shape.iter().zip(shape).enumerate();
        parameters.extend(shapes.map(|(k, (parameter, value))| self.shape(definition.id, k, parameter, *value)));
        Told { kind: definition.kind.name(), parameters, statement: definition.statement.to_owned() }
    }

    /// Standard deviation of the amplitude of a column; not a number where the column takes no part in the fit.
    fn deviation(&self, column: usize) -> f64 {
        let at = self.found.fit.active.iter().position(|active| *active == column);
        at.map_or(f64::NAN, |at| self.variances[at].sqrt())
    }

    /// Shape parameter number `k` of the form of this mechanism.
    fn shape(&self, id: Id, k: usize, parameter: &ShapeParameter, value: f64) -> Estimate {
        let Found { bench, fit, .. } = self.found;
        // a wavelength is no idealisation
        let of_form = if parameter.search == Search::Wave { 0.0 } else { OF_FORM };
        let sigma = shape_deviation(bench, fit, self.member(), k).hypot(of_form * value);
        let mut shape = estimate(parameter.name, value, sigma, parameter.unit);
        shape.ci95 = [shape.ci95[0].max(parameter.from), shape.ci95[1].min(parameter.to)];
        if id == Id::ForceLowpass {
            let part = self.amplitudes.first().copied().unwrap_or(1.0);
            shape.ci95 = time_of_filter(shape.ci95, part, bench.step_s);
        }
        shape
    }

    fn told_of_shift(&self, parameter: usize) -> Told {
        let Found { bench, members, calibrated, .. } = self.found;
        let what = &self.nominal.parameters[parameter];
        let (least, most) = what.ends();
        let value = (calibrated[parameter] + self.amplitudes[0]).clamp(least, most);
        let Beside { fit, own, .. } = bench.beside(members, self.at);
        let sigma = 1.0 / bench.precision(&own, &fit).sqrt();
        let mut number = estimate(what.name, value, sigma, what.unit);
        number.ci95 = [number.ci95[0].max(least), number.ci95[1].min(most)];
        let tolerance = 100.0 * what.sigma.unwrap_or(0.0);
        let statement = format!(
            "The {} is {:+.1} % off what the simulation assumes, beyond its tolerance of {tolerance:.1} %.",
            what.name,
            100.0 * value
        );
        Told { kind: "parameter", parameters: vec![number], statement }
    }
}

fn told_of_curve(source: &Source, curve: &Curve, amplitudes: &[f64]) -> Told {
    let along = match curve.period_s() {
        Some(period) if period < 1.0 => format!("repeats every {period:.4} s ({:.3} Hz)", 1.0 / period),
        Some(period) => format!("repeats every {period:.4} s"),
        None => format!("acts along {}", curve.axis.name()),
    };
    let mut statement = format!("Something that the library has no name for {along}, {}", curve.carrier.words());
    if let Some(formula) = open_set::formula(source, amplitudes) {
        statement.push_str(&format!("; about {formula}, x in {}", curve.axis.unit()));
    }
    statement.push('.');
    Told { kind: "unknown", parameters: Vec::new(), statement }
}

/// Names of the other causes that the recording cannot tell from a source.
fn equivalents(set: &Set, source: &Source) -> Vec<String> {
    let mut equivalents: Vec<String> = Vec::new();
    for candidate in &set.candidates {
        let id = candidate.source.id().to_owned();
        // a shift of another law parameter has no other name
        if !candidate.source.is_kin(source) && id != source.id() && !equivalents.contains(&id) {
            equivalents.push(id);
        }
    }
    equivalents
}

/// A value with the 95 % interval of this standard deviation.
fn estimate(name: &str, value: f64, sigma: f64, unit: &str) -> Estimate {
    Estimate { name: name.to_owned(), value, ci95: [value - 1.96 * sigma, value + 1.96 * sigma], unit: unit.to_owned() }
}

/// Evidence that is lost on the way from a shape parameter to where its curvature is measured, nats: the least that is
/// beyond the last digits of a fit, and the most along which a parabola follows it.
const LOST: [f64; 2] = [0.2, 4.0];

/// Most distances that are tried for it.
const TRIES: usize = 12;

/// Standard deviation of a shape parameter, from the evidence on both sides of it.
fn shape_deviation(bench: &Bench<'_>, fit: &Fit, member: &Member, k: usize) -> f64 {
    let Source::Mechanism { definition, form, shape } = &member.candidate.source else { return f64::NAN };
    let parameter = &definition.forms[*form].shape[k];
    let others: Vec<usize> = fit.active.iter().copied().filter(|column| !member.base.contains(column)).collect();
    let beside = bench.fit(&others);
    let nats = |mut candidate: Candidate| {
        bench.prepare(&mut candidate, &fit.active);
        bench.gain(&candidate, &beside).nats
    };
    let top = nats(member.candidate.clone());
    let lost = |value: f64| {
        let mut moved = shape.clone();
        moved[k] = value;
        let source = Source::Mechanism { definition, form: *form, shape: moved };
        Some((value - shape[k], top - nats(bench.candidate(source)?)))
    };
    let range = parameter.to - parameter.from;
    let mut step = match parameter.search {
        _ if parameter.log => shape[k].abs() * 0.05,
        Search::EitherSide => shape[k].abs() * 0.1,
        _ => range * 0.02,
    };
    let mut sides = Vec::new();
    for _ in 0..TRIES {
        let ends = [shape[k] - step, shape[k] + step].map(|value| value.clamp(parameter.from, parameter.to));
        // at the end of the range there is one side
        let told = ends.into_iter().filter(|value| (value - shape[k]).abs() > 1e-3 * step).filter_map(&lost);
        sides = told.collect();
        let most = sides.iter().map(|(_, lost)| *lost).fold(0.0, f64::max);
        let is_whole = step >= range;
        match most {
            // nobody was there to see it: a place beyond the stroke
            _ if sides.is_empty() => step *= 0.1,
            _ if most > LOST[1] => step *= (0.5 * LOST[1] / most).sqrt().max(0.1),
            _ if most < LOST[0] && !is_whole => step = (4.0 * step).min(range),
            _ => break,
        }
    }
    deviation(&sides).map_or(range, |sigma| sigma.min(range))
}

/// Standard deviation of a number from the evidence lost at distances from it, nats; `None` where none is.
///
/// ```text
/// lost(x) = a x² + b x    σ² = 1/(2a) + (b/(2a))²
/// ```
///
/// The second term is the way to the top of the parabola, where the search ended beside it.
fn deviation(lost: &[(f64, f64)]) -> Option<f64> {
    let (a, b) = match lost {
        [(x1, lost1), (x2, lost2)] => {
            let a = (lost2 / x2 - lost1 / x1) / (x2 - x1);
            (a, lost2 / x2 - a * x2)
        }
        [(x, lost)] => (lost / (x * x), 0.0),
        _ => return None,
    };
    (a > 0.0).then(|| (1.0 / (2.0 * a)).sqrt().hypot(b / (2.0 * a)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_a_filter_reaches_from_a_continuous_one_to_one_on_rows() {
        let step_s = 0.005;
        for of_rows_s in [1e-3, 3e-3, 2e-2, 0.5] {
            let lag_s = step_s / f64::exp_m1(step_s / of_rows_s);
            let [low, high] = time_of_filter([lag_s; 2], 1.0, step_s);
            assert!(low == lag_s && (high - of_rows_s).abs() < 1e-12 * of_rows_s, "{low} {high}");
            assert_eq!(time_of_filter([0.9 * lag_s, lag_s / 1.25], 1.25, step_s), [0.9 * lag_s, high]);
        }
    }

    #[test]
    fn a_number_is_as_sure_as_the_evidence_falls_beside_it() {
        let lost = |x: f64, off: f64| 0.5 * ((x - off) * (x - off) - off * off) / (0.1 * 0.1);
        let near = |found: Option<f64>, expected: f64| found.is_some_and(|sigma| (sigma - expected).abs() < 1e-12);
        assert!(near(deviation(&[(-0.2, lost(-0.2, 0.0)), (0.2, lost(0.2, 0.0))]), 0.1));
        assert!(near(deviation(&[(0.3, lost(0.3, 0.0))]), 0.1), "at the end of the range");
        // where the search ended beside the top, the way there counts
        assert!(near(deviation(&[(-0.2, lost(-0.2, 0.05)), (0.3, lost(0.3, 0.05))]), 0.1f64.hypot(0.05)));
        assert_eq!(deviation(&[(-0.2, 0.0), (0.2, 0.0)]), None, "it tells nothing");
        assert_eq!(deviation(&[]), None);
    }
}
