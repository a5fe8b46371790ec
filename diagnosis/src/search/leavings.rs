//! Leavings: what the forms of causes may leave of their own force.
//!
//! A form is an idealisation: the force of a true cause is a little larger here and smaller there than its form says,
//! and beside a large cause that is more than many a small cause has. So a small cause must explain something beside
//! columns that follow the forces of the large ones, each with the size by which a form may be wrong:
//!
//! ```text
//! f_m P_k(u_a)      f_m: force of cause m, P_k: Legendre polynomials, u_a: speed, place, time .. scaled to -1..1
//! prior of each: 0 ± WRONG
//! ```
//!
//! A cause tied to places has a profile, and a profile is wrong from place to place, not by a factor; the law's force
//! scales the error:
//!
//! ```text
//! F cos(k π (u_x + 1)/2) rms(f_m)/rms(F)      F: force of the law, k: 0 to 16
//! ```
//!
//! The force of a mass is as wrong as its acceleration, which is derived: at the corners of ramps by its fast
//! components.

use simulation::curve::Axis;
use simulation::mechanism::Id;

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::Member;
use crate::fit::rest::power;
use crate::nominal::fast_accelerations;

/// Standard deviation of the error of a form along each polynomial, as a share of its force: twice it is the seventh
/// behind [`FURTHER`](crate::search).
pub(super) const WRONG: f64 = 0.07;

/// Axes along which forms are wrong, and the highest polynomial degree along each.
const ALONG: [(Axis, usize); 6] = [
    (Axis::Direction, 1),
    (Axis::Velocity, 2),
    (Axis::Position, 3),
    (Axis::Time, 2),
    (Axis::Load, 1),
    (Axis::Temperature, 2),
];

/// Most half waves over the whole rail by which a profile may be wrong.
const ALONG_RAIL: usize = 16;

/// Whitened columns, scaled so that amplitudes are of the order of 1, beside a fit of the members.
pub(crate) fn columns<'m>(bench: &Bench<'_>, fit: &Fit, members: impl Iterator<Item = &'m Member>) -> Vec<Vec<f32>> {
    let mut raw: Vec<Vec<f64>> = Vec::new();
    let along = polynomials(bench);
    let mut at_places_n2 = 0.0;
    for member in members {
        let amplitudes: Vec<f64> = member.base.iter().map(|column| WRONG * fit.value_of(*column)).collect();
        let force = bench.force(&member.candidate.source, &amplitudes);
        if force.is_empty() {
            continue;
        }
        if let (true, [mass_kg, ..]) = (member.candidate.source.is(Id::Inertia), amplitudes.as_slice()) {
            raw.extend(of_corners(bench, mass_kg / WRONG));
        }
        if member.candidate.source.is_phase_bound() {
            at_places_n2 += power(&bench.rows, &force);
        }
        raw.extend(along.iter().map(|factor| force.iter().zip(factor).map(|(force, factor)| force * factor).collect()));
    }
    if at_places_n2 > 0.0 {
        raw.extend(of_places(bench, at_places_n2.sqrt()));
    }
    bench.rows.white_all(&raw.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

/// Possible error of a mass's force where its acceleration changes fast.
fn of_corners(bench: &Bench<'_>, mass_kg: f64) -> Vec<Vec<f64>> {
    let mut columns: [Vec<f64>; 3] = Default::default();
    for context in bench.contexts {
        for (column, fast) in columns.iter_mut().zip(fast_accelerations(context.run, context.motion)) {
            column.extend(fast.into_iter().map(|a| mass_kg * a));
        }
    }
    columns.into()
}

/// Possible error of a profile along the rail; columns of at most about this RMS, N.
fn of_places(bench: &Bench<'_>, rms_n: f64) -> Vec<Vec<f64>> {
    let Some(u) = along(bench, Axis::Position) else { return Vec::new() };
    let law = bench.contexts.iter().flat_map(|context| &context.steady.force_n);
    let law: Vec<f64> = law.map(|force| if force.is_finite() { *force } else { 0.0 }).collect();
    let law_n = power(&bench.rows, &law).sqrt();
    if !(law_n > 0.0) {
        return Vec::new();
    }
    let wave = |k: usize, u: f64| (0.5 * std::f64::consts::PI * k as f64 * (u + 1.0)).cos();
    (0..=ALONG_RAIL)
        .map(|k| law.iter().zip(&u).map(|(force, u)| rms_n / law_n * force * wave(k, *u)).collect())
        .collect()
}

/// Every polynomial along every axis that the runs show; one entry per row of all runs.
fn polynomials(bench: &Bench<'_>) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    for (axis, most) in ALONG {
        let Some(u) = along(bench, axis) else { continue };
        for order in 1..=most {
            all.push(u.iter().map(|u| legendre(order, *u)).collect());
        }
    }
    all
}

/// Position of every row of all runs on an axis, from -1 to 1; `None` where the runs do not show the axis.
fn along(bench: &Bench<'_>, axis: Axis) -> Option<Vec<f64>> {
    let mut values = Vec::new();
    for context in bench.contexts {
        match axis.values(context) {
            Some(own) if axis == Axis::Velocity => values.extend(own.iter().map(|v| v.max(1e-6).ln())),
            Some(own) => values.extend(own),
            None => values.resize(values.len() + context.run.len(), f64::NAN),
        }
    }
    let seen = values.iter().zip(&bench.compared).filter(|(x, c)| **c && x.is_finite()).map(|(x, _)| *x);
    let (least, largest) =
        seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, largest), x| (x.min(least), x.max(largest)));
    let of = |x: &f64| if x.is_finite() { (2.0 * (x - least) / (largest - least) - 1.0).clamp(-1.0, 1.0) } else { 0.0 };
    (largest > least).then(|| values.iter().map(of).collect())
}

fn legendre(order: usize, u: f64) -> f64 {
    match order {
        1 => u,
        2 => 0.5 * (3.0 * u * u - 1.0),
        _ => 0.5 * u * (5.0 * u * u - 3.0),
    }
}
