//! Whether a force grows with the load as the form that models it says.
//!
//! ```text
//! F = form·(Q/Q_mean)^a, a = 0 by the form;  to first order  form·(1 + a·ln(Q/Q_mean))
//! a = (r·g)/(g·g),  g = form·ln(Q/Q_mean) without what law and causes imitate,  r = what they leave
//! ```
//!
//! What the forms of other causes may leave takes part, as [`leavings`] have it: beside a large cause a power of a small one is
//! told no better than that. Not of those that have such a law themselves: one with the wrong power is how two arise.
//!
//! Seals and churned grease do not feel the load at all, and oil in the inlet feels its 0.47th power: what grows with
//! speed and falls with load is neither.

use simulation::mechanism::Id;

use crate::fit::bench::{Bench, Member};
use crate::fit::least_squares::Fit;
use crate::fit::source::Source;
use crate::numbers::linear::{Cholesky, Symmetric, dot, products, remove};
use crate::search::leavings;

/// Power of the load by which a force that does not feel it may seem to.
const MOST: f64 = 0.1;

/// The same for oil in the inlet: published powers lie between 0.3 and 0.5.
const MOST_OF_OIL: f64 = 0.2;

/// Standard deviations from which a power counts: what a form leaves of other causes is no noise.
const SURE: f64 = 6.0;

/// Share of a column, in square, that must be left of it to tell anything.
const IMITATED: f64 = 1e-4;

/// Whether the force of a member follows another law of the load than its form's. `rest`: what `fit`, of all members, leaves.
pub(crate) fn is_another(bench: &Bench<'_>, fit: &Fit, members: &[Member], at: usize, rest: &[f32]) -> bool {
    let Some(most) = most_of(&members[at].candidate.source) else { return false };
    power(bench, fit, members, at, rest).is_some_and(|(power, scatter)| power.abs() > most.max(SURE * scatter))
}

/// Power of the load by which a cause may seem to follow another law than its form's; `None` of one whose law is not known.
fn most_of(source: &Source) -> Option<f64> {
    let Source::Mechanism { definition, .. } = source else { return None };
    match definition.id {
        Id::SealDrag | Id::ViscousDrag => Some(MOST),
        Id::HydrodynamicRolling => Some(MOST_OF_OIL),
        _ => None,
    }
}

/// The power of the load that a member's form lacks, and its standard deviation; `None` where the load tells nothing.
fn power(bench: &Bench<'_>, fit: &Fit, members: &[Member], at: usize, rest: &[f32]) -> Option<(f64, f64)> {
    let member = &members[at];
    let mut force = bench.force(&member.candidate.source, &member.amplitudes(fit));
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
    let active: Vec<&[f32]> = fit.active.iter().map(|column| bench.base[*column].as_slice()).collect();
    remove(&mut white, &active);
    let own = products(&[&white], &[&white])[0];
    if !(own > IMITATED * all) {
        return None;
    }
    let others = members.iter().filter(|other| most_of(&other.candidate.source).is_none());
    let mut leavings = leavings::columns(bench, fit, others);
    leavings.iter_mut().for_each(|column| remove(column, &active));
    let leavings: Vec<&[f32]> = leavings.iter().map(Vec::as_slice).collect();
    let mut prior = Symmetric::gram(&leavings);
    (0..leavings.len()).for_each(|at| prior.add(at, at, 1.0));
    let prior = Cholesky::of(&prior);
    let of = |column: &[f32]| prior.forward(&products(&leavings, &[column]));
    let (of_power, of_rest) = (of(&white), of(rest));
    let own = own - dot(&of_power, &of_power);
    let along = products(&[&white], &[rest])[0] - dot(&of_power, &of_rest);
    (own > IMITATED * all).then(|| (along / own, 1.0 / own.sqrt()))
}
