//! Power of residuals, and of what causes add.

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::noise::rows::Rows;
use crate::numbers::linear::{Cholesky, Symmetric, dot};

pub(crate) fn power(rows: &Rows, column: &[f64]) -> f64 {
    let plain = rows.plain(column);
    dot(&plain, &plain) / plain.len().max(1) as f64
}

/// RMS of the noise, in the unit of the columns: what all curves leave of a mismatch. Curves that cancel in whitened rows
/// may leave more than there is.
pub(crate) fn noise_rms(rows: &Rows, left: &[f64], mismatch: &[f64]) -> f64 {
    power(rows, left).min(power(rows, mismatch)).sqrt()
}

/// Variance of the whitened residual: 1 where the noise was known.
pub(crate) fn whiteness(bench: &Bench<'_>, fit: &Fit) -> f64 {
    fit.rss / bench.rows.len().max(1) as f64
}

/// Shares of the causes: how much each adds to the force that all explain together beyond the law's parameters.
pub(crate) fn shares(rows: &Rows, tangent: &[Vec<f64>], forces: &[Vec<f64>], explained: f64) -> Vec<f64> {
    let plain: Vec<Vec<f64>> = forces.iter().map(|force| beyond(rows, tangent, force)).collect();
    among(&plain.iter().map(Vec::as_slice).collect::<Vec<_>>()).iter().map(|share| explained * share).collect()
}

/// Shares of forces in their sum, adding up to 1; none is negative.
pub(crate) fn among(forces: &[&[f64]]) -> Vec<f64> {
    let rows = forces.first().map_or(0, |force| force.len());
    let sum: Vec<f64> = (0..rows).map(|n| forces.iter().map(|force| force[n]).sum()).collect();
    let parts: Vec<f64> = forces.iter().map(|force| dot(force, &sum).max(1e-3 * dot(force, force))).collect();
    let total: f64 = parts.iter().sum();
    parts.iter().map(|part| if total > 0.0 { part / total } else { 0.0 }).collect()
}

/// Compared rows of a force, less what the law's parameters imitate.
pub(crate) fn beyond(rows: &Rows, tangent: &[Vec<f64>], force: &[f64]) -> Vec<f64> {
    let mut plain = rows.plain(force);
    let columns: Vec<Vec<f64>> = tangent.iter().map(|column| rows.plain(column)).collect();
    let mut a = Symmetric::zeros(columns.len());
    for i in 0..columns.len() {
        for j in 0..=i {
            a.set(i, j, dot(&columns[i], &columns[j]));
        }
    }
    let b: Vec<f64> = columns.iter().map(|column| dot(column, &plain)).collect();
    for (column, x) in columns.iter().zip(Cholesky::of(&a).solve(&b)) {
        for (force, z) in plain.iter_mut().zip(column) {
            *force -= x * z;
        }
    }
    plain
}
