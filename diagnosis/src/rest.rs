//! What is left: residuals of fits that explain all there is to explain, and their power.

use simulation::mechanism::Context;

use crate::bench::{Bench, Fit, Source, raw_columns};
use crate::linear::{Cholesky, Symmetric, dot, products};
use crate::rows::Rows;
use crate::story::Curve;

/// Rows from which on a saturated fit is made of averages, and the rows of each.
const MANY: usize = 20_000;
const AVERAGED: usize = 4;

/// What nothing explains: the residual of the law's tangent, every curve and `extra` together.
pub(crate) fn saturated(
    rows: &Rows,
    contexts: &[Context<'_>],
    mismatch: &[f64],
    tangent: &[Vec<f64>],
    curves: &[Curve],
    extra: &[Vec<f64>],
) -> Vec<f64> {
    let mut columns: Vec<Vec<f64>> = tangent.to_vec();
    columns.extend(extra.iter().cloned());
    for curve in curves {
        columns.extend(raw_columns(&Source::Story { curve: curve.clone() }, contexts).unwrap_or_default());
    }
    // what is the same linear relation in averages is cheaper there
    let averaged = if rows.len() > MANY { AVERAGED } else { 1 };
    let single = |column: &[f64]| -> Vec<f32> {
        let plain = rows.plain(column);
        plain.chunks(averaged).map(|chunk| (chunk.iter().sum::<f64>() / chunk.len() as f64) as f32).collect()
    };
    let plain: Vec<Vec<f32>> = columns.iter().map(|column| single(column)).collect();
    let y = single(mismatch);
    let mut a = Symmetric::zeros(columns.len());
    let all: Vec<&[f32]> = plain.iter().map(Vec::as_slice).collect();
    for (n, product) in products(&all, &all).into_iter().enumerate() {
        a.set(n / all.len(), n % all.len(), product);
    }
    for i in 0..columns.len() {
        // curves that overlap: a trace of ridge keeps what single precision leaves of their difference out
        let ridge = 1e-6 * a.get(i, i);
        a.add(i, i, ridge);
    }
    let b = products(&all, &[&y]);
    let x = Cholesky::of(&a).solve(&b);
    let mut residual = mismatch.to_vec();
    for (column, x) in columns.iter().zip(x) {
        for (residual, z) in residual.iter_mut().zip(column) {
            *residual -= x * z;
        }
    }
    residual
}

pub(crate) fn rms(x: &[f64]) -> f64 {
    (dot(x, x) / x.len().max(1) as f64).sqrt()
}

pub(crate) fn power(rows: &Rows, column: &[f64]) -> f64 {
    let plain = rows.plain(column);
    dot(&plain, &plain) / plain.len().max(1) as f64
}

pub(crate) fn noise_rms(rows: &Rows, residual: &[f64]) -> f64 {
    power(rows, residual).sqrt()
}

/// Variance of the whitened residual: 1 where the noise was known.
pub(crate) fn whiteness(bench: &Bench<'_>, fit: &Fit) -> f64 {
    fit.rss / bench.rows.len().max(1) as f64
}

/// Shares of the causes: what each adds to the force that all explain together beyond the law's parameters.
pub(crate) fn shares(rows: &Rows, tangent: &[Vec<f64>], forces: &[Vec<f64>], explained: f64) -> Vec<f64> {
    let plain: Vec<Vec<f64>> = forces.iter().map(|force| beyond(rows, tangent, force)).collect();
    let sum: Vec<f64> = (0..rows.len()).map(|n| plain.iter().map(|force| force[n]).sum()).collect();
    let parts: Vec<f64> = plain.iter().map(|force| dot(force, &sum).max(1e-3 * dot(force, force))).collect();
    let total: f64 = parts.iter().sum();
    parts.iter().map(|part| if total > 0.0 { explained * part / total } else { 0.0 }).collect()
}

/// Compared rows of a force, without what the law's parameters imitate.
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
