//! Load law: whether a force grows with the load as its form states.
//!
//! ```text
//! F = form·(Q/Q_mean)^a, a = 0 by the form;  to first order  form·(1 + a·ln(Q/Q_mean))
//! a = (r·g)/(g·g),  g = form·ln(Q/Q_mean) less what law and causes imitate,  r = their residual
//! ```
//!
//! What the forms of other causes may leave ([`leavings`]) takes part in the fit: beside a large cause the exponent of
//! a small one is known no better than that. Excluded are causes with a load law of their own: one such cause with the
//! wrong exponent is how a second one arises.
//!
//! Seals and churned grease do not depend on the load at all, and oil in the inlet on its 0.47th power: a force that
//! grows with speed and falls with load is neither.

use simulation::mechanism::Id;

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Candidate, Gain, Member};
use crate::fit::source::Source;
use crate::numbers::linear::{Cholesky, Symmetric, dot, products, remove};
use crate::search::leavings;

/// Deviation of the load exponent from which a force follows another law than its form's. Published exponents of oil in
/// the inlet lie between 0.3 and 0.5, and beside a law that imitates nearly all of its force, the exponent of a
/// load-independent cause is off by a tenth. Read off opened trials (docs/trials/20 to 22): 0.11 at most for right
/// names alone that determine it, 0.30 and more for drag that falls with the load.
const MOST: f64 = 0.2;

/// Standard deviations from which a deviation counts; many, because what other causes' forms leave is no noise.
const SURE: f64 = 4.0;

/// Share of a column's square that must remain, after removal of what others imitate, to tell anything.
const IMITATED: f64 = 1e-4;

/// Whether the force of a member follows another law of the load than its form's. `rest`: residual of `fit`, which
/// holds all members.
pub(crate) fn is_another(bench: &Bench<'_>, fit: &Fit, members: &[Member], at: usize, rest: &[f32]) -> bool {
    let source = &members[at].candidate.source;
    let active: Vec<&[f32]> = fit.active.iter().map(|column| bench.base[*column].as_slice()).collect();
    has_law(source) && {
        let force = bench.force(source, &members[at].amplitudes(fit));
        power(bench, force, &active, rest, of_others(bench, fit, members)).is_some_and(|power| power.is_another())
    }
}

/// The same for a cause that is not among the members; `gain`: what it adds to their `fit`.
pub(crate) fn refuses(
    bench: &Bench<'_>,
    fit: &Fit,
    members: &[Member],
    (candidate, gain): (&Candidate, &Gain),
) -> bool {
    let base = fit.active.iter().map(|column| &bench.base[*column]);
    let active: Vec<&[f32]> = base.chain(candidate.columns.iter()).map(Vec::as_slice).collect();
    has_law(&candidate.source) && {
        let mut rest = bench.rest(fit);
        remove(&mut rest, &active);
        let force = bench.force(&candidate.source, &gain.amplitudes);
        power(bench, force, &active, &rest, of_others(bench, fit, members)).is_some_and(|power| power.is_another())
    }
}

/// Whether a form states how its force grows with the load.
pub(crate) fn has_law(source: &Source) -> bool {
    source.is_any(&[Id::SealDrag, Id::ViscousDrag, Id::HydrodynamicRolling])
}

/// Load exponent that a form lacks, `a` in the module's equation.
struct Power {
    power: f64,
    /// Its standard deviation.
    scatter: f64,
}

impl Power {
    fn is_another(&self) -> bool {
        self.power.abs() > MOST.max(SURE * self.scatter)
    }
}

/// Whitened columns of what the forms of causes without a load law may leave.
fn of_others(bench: &Bench<'_>, fit: &Fit, members: &[Member]) -> Vec<Vec<f32>> {
    leavings::columns(bench, fit, members.iter().filter(|other| !has_law(&other.candidate.source)))
}

/// The load exponent that a force lacks; `None` where the load tells nothing. `active`: columns of law and causes, its
/// own among them; `rest`: their residual; `leavings`: what their forms may leave.
fn power(
    bench: &Bench<'_>,
    mut force: Vec<f64>,
    active: &[&[f32]],
    rest: &[f32],
    mut leavings: Vec<Vec<f32>>,
) -> Option<Power> {
    let load: Vec<f64> = bench.contexts.iter().flat_map(|context| &context.steady.load_per_ball_n).copied().collect();
    if load.len() != force.len() {
        return None;
    }
    let acting: Vec<f64> = load
        .iter()
        .zip(&force)
        .filter(|(load, force)| **load > 0.0 && **force != 0.0)
        .map(|(load, _)| load.ln())
        .collect();
    let mean = acting.iter().sum::<f64>() / acting.len() as f64;
    for (force, load) in force.iter_mut().zip(&load) {
        *force *= if *load > 0.0 { load.ln() - mean } else { 0.0 };
    }
    let mut white = bench.rows.white(&force);
    let all = products(&[&white], &[&white])[0];
    remove(&mut white, active);
    let own = products(&[&white], &[&white])[0];
    if !(own > IMITATED * all) {
        return None;
    }
    leavings.iter_mut().for_each(|column| remove(column, active));
    let leavings: Vec<&[f32]> = leavings.iter().map(Vec::as_slice).collect();
    let mut prior = Symmetric::gram(&leavings);
    (0..leavings.len()).for_each(|at| prior.add(at, at, 1.0));
    let prior = Cholesky::of(&prior);
    let of = |column: &[f32]| prior.forward(&products(&leavings, &[column]));
    let (of_power, of_rest) = (of(&white), of(rest));
    let own = own - dot(&of_power, &of_power);
    let along = products(&[&white], &[rest])[0] - dot(&of_power, &of_rest);
    (own > IMITATED * all).then(|| Power { power: along / own, scatter: 1.0 / own.sqrt() })
}
