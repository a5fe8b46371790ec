//! Zhou 2023, Eq. 1 to 21, over the rows of a run.
//!
//! In the exact model only two quantities depend on the preload alone: the load per ball Q, which takes a Newton
//! iteration, and `u/(V P)`, which takes roots and a cube root. Where the preload is constant they are computed once;
//! where it was measured they are tabulated over the run's range of preloads, as the viscosity is over its range of
//! temperatures ([`Table`], 1e-11). One exponential per row remains.

use model_core::exact::Exact;
use model_core::friction::Friction;
use rayon::prelude::*;

use super::table::Table;
use super::{Factors, Missing, Steady};
use crate::guide::{GuideSet, Lubricant};

/// Source of a quantity.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source<'a> {
    /// The same in every row.
    Constant(f64),
    /// Measured.
    Column(&'a [f64]),
}

/// Number of rows from which a table pays.
const ROWS_FOR_A_TABLE: usize = 2000;

/// Fewest rows per thread that pay.
const ROWS_OF_A_THREAD: usize = 4096;

/// Share of the largest preload below which rows are computed one by one: roots have no polynomial at 0.
const TABLE_RATIO: f64 = 1e-2;

/// Everything but force and direction.
pub(super) fn rows(
    set: &GuideSet,
    factors: &Factors,
    preload: Source<'_>,
    temperature: Option<&[f64]>,
    velocity: &[f64],
) -> Result<Steady, Missing> {
    let viscosity_cst = match (set.lubricant(), temperature) {
        (Lubricant::Constant(nu), _) => vec![nu * factors.viscosity; velocity.len()],
        (Lubricant::Walther(_), None) => return Err(Missing::Temperature),
        (Lubricant::Walther(walther), Some(column)) => {
            over(column, f64::NEG_INFINITY, |t| walther.viscosity_cst(t) * factors.viscosity)
        }
    };
    let exact = set.exact();
    let preload_n = match preload {
        Source::Constant(p) => vec![p * factors.preload; velocity.len()],
        Source::Column(column) => column.iter().map(|p| p * factors.preload).collect(),
    };
    let (load_per_ball_n, film) = match preload {
        Source::Constant(p) => {
            let q = load(exact, p * factors.preload);
            (vec![q; velocity.len()], vec![film(exact, q); velocity.len()])
        }
        Source::Column(_) => {
            let largest = preload_n.iter().fold(0.0, |a: f64, p| a.max(*p));
            // beyond the geometry there is no load, so the table must end before
            let limit = 0.999 * exact.preload_n(exact.load_limit_n());
            let range = (TABLE_RATIO * largest, limit);
            (within(&preload_n, range, |p| load(exact, p)), within(&preload_n, range, |p| film(exact, load(exact, p))))
        }
    };
    let given = exact.friction();
    let friction = Friction {
        mu_coulomb: given.mu_coulomb * factors.friction * factors.mu_coulomb,
        mu_viscous: given.mu_viscous * factors.friction * factors.mu_viscous,
        mu_stribeck: given.mu_stribeck * factors.friction * factors.mu_stribeck,
        stribeck_exponent: given.stribeck_exponent,
    };
    let scale = set.hersey_scale();
    let hersey: Vec<f64> =
        velocity.iter().zip(&viscosity_cst).zip(&film).map(|((v, nu), film)| scale * nu * v.abs() * film).collect();
    let balls = exact.guide().loaded_balls();
    let drag_n = load_per_ball_n
        .par_iter()
        .zip(&hersey)
        .with_min_len(ROWS_OF_A_THREAD)
        .map(|(q, h)| balls * q * friction.coefficient(*h))
        .collect();
    Ok(Steady { drag_n, preload_n, load_per_ball_n, viscosity_cst, hersey, ..Steady::default() })
}

/// Load per ball for a preload, N; 0 at 0, NaN beyond the geometry.
fn load(exact: &Exact, preload_n: f64) -> f64 {
    if preload_n == 0.0 { 0.0 } else { exact.load_of_preload(preload_n).unwrap_or(f64::NAN) }
}

/// `H/(ν V) = (u/V)/P` for a load per ball, 1/Pa.
fn film(exact: &Exact, q: f64) -> f64 {
    if q == 0.0 { 0.0 } else { exact.slip_ratio(q) / exact.pressure_pa(q) }
}

/// A function of a column, by table from `least` upwards.
fn over(column: &[f64], least: f64, f: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
    within(column, (least, f64::INFINITY), f)
}

/// A function of a column, by table inside a range and row by row outside it.
fn within(column: &[f64], (least, most): (f64, f64), f: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
    let table = (column.len() >= ROWS_FOR_A_TABLE)
        .then(|| {
            let inside = column.iter().filter(|x| **x >= least && **x <= most);
            let (from, to) = inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
            Table::of(from, to, &f)
        })
        .flatten();
    match table {
        Some(table) => {
            let at = |x: &f64| if table.covers(*x) { table.at(*x) } else { f(*x) };
            column.par_iter().with_min_len(ROWS_OF_A_THREAD).map(at).collect()
        }
        None => {
            // few rows, one value, or not smooth: equal neighbours are still computed only once
            let mut last = (f64::NAN, f64::NAN);
            let each = |x: &f64| {
                if last.0 != *x {
                    last = (*x, f(*x));
                }
                last.1
            };
            column.iter().map(each).collect()
        }
    }
}
