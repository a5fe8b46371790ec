//! What the columns of several families are made with.

use super::Context;

/// A column of something that opposes the motion: the direction times `of(row)`.
pub(super) fn odd(c: &Context<'_>, of: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..c.len()).map(|n| c.direction[n] * of(n)).collect()
}

/// A column of something that does not ask for the direction.
pub(super) fn even(c: &Context<'_>, of: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..c.len()).map(of).collect()
}

/// The columns, where each of them is anything but 0.
pub(super) fn shown<const N: usize>(columns: [Vec<f64>; N]) -> Option<Vec<Vec<f64>>> {
    let is_there = |column: &Vec<f64>| column.iter().any(|x| x.abs() > 1e-12);
    columns.iter().all(is_there).then(|| columns.into())
}

/// The law's force with rows that have none at 0: for filters, which go on over them.
pub(super) fn force(c: &Context<'_>) -> Vec<f64> {
    c.steady.force_n.iter().map(|f| if f.is_finite() { *f } else { 0.0 }).collect()
}

/// The law's friction, N, at least 0 where it is known, with rows that have none at 0.
pub(super) fn drag(c: &Context<'_>, row: usize) -> f64 {
    let drag = c.steady.drag_n[row];
    if drag.is_finite() { drag } else { 0.0 }
}

/// `τ y' = x - y`, exact for an input that is constant from row to row; starts settled in every part.
pub(super) fn follow(c: &Context<'_>, x: &[f64], tau_s: f64) -> Vec<f64> {
    let mut y = x.to_vec();
    for part in &c.run.parts {
        let rows = part.rows.clone();
        for n in rows.start + 1..rows.end {
            let keep = (-(c.run.time_s[n] - c.run.time_s[n - 1]) / tau_s).exp();
            y[n] = x[n] + (y[n - 1] - x[n]) * keep;
        }
    }
    y
}

/// Sine and cosine of a wavelength along the rail, and of its `harmonics - 1` multiples, times `of(row)`.
///
/// `None` where the position was not measured or spans less than half a wave.
pub(super) fn waves(
    c: &Context<'_>,
    wavelength_m: f64,
    harmonics: usize,
    of: impl Fn(usize) -> f64,
) -> Option<Vec<Vec<f64>>> {
    let x = &c.motion.position_m;
    let (low, high) = span(x);
    if !c.motion.has_position || high - low < 0.5 * wavelength_m {
        return None;
    }
    let mut columns = Vec::with_capacity(2 * harmonics);
    for harmonic in 1..=harmonics {
        let k = std::f64::consts::TAU * harmonic as f64 / wavelength_m;
        columns.push(even(c, |n| of(n) * (k * x[n]).sin()));
        columns.push(even(c, |n| of(n) * (k * x[n]).cos()));
    }
    columns.iter().all(|column| column.iter().any(|x| x.abs() > 1e-12)).then_some(columns)
}

/// Least and largest.
pub(super) fn span(x: &[f64]) -> (f64, f64) {
    x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Raised cosine of full width `width` around 0.
pub(super) fn bump(x: f64, width: f64) -> f64 {
    let u = x / width;
    if u.abs() < 0.5 { 0.5 * (1.0 + (std::f64::consts::TAU * u).cos()) } else { 0.0 }
}
