//! What nothing explains: the residual of a fit of all that could be explained.
//!
//! Every curve along every axis takes part, beside the law's tangent. One over the time since a turn does where it follows
//! most of what the others leave: a force that is late or filtered is wrong there for a few rows, by far more than noise, and
//! is no noise. The curves hang on the runs alone, so that their columns and inner products are made once.

use rayon::prelude::*;
use simulation::curve::{Axis, Curve};
use simulation::mechanism::Context;
use simulation::sensor::Noise;

use crate::fit::story;
use crate::noise::rows::Rows;
use crate::numbers::linear::{Cholesky, Symmetric, products};

/// Rows from which on the fit is made of averages, and the rows of each: what is the same linear relation in averages
/// is cheaper there.
const MANY: usize = 20_000;
const AVERAGED: usize = 4;

/// Share of a column's square that keeps what single precision leaves of the difference of overlapping curves out.
const RIDGE: f64 = 1e-6;

/// Part of what the other curves leave, in square, that the one over the time since a turn must follow to take part.
const MOST: f64 = 0.5;

/// Drawings of noise of which the part that curves leave is told.
const DRAWN: u64 = 3;

/// See the module.
pub(crate) struct Saturation {
    /// The one over the time since a turn comes last.
    curves: Vec<Curve>,
    columns: Vec<Vec<f32>>,
    products: Symmetric,
    kept: Vec<f64>,
    /// Rows of an average.
    together: usize,
}

impl Saturation {
    /// `compared`: rows of all runs that knots are laid over, one entry each. `tones`: curves that repeat fast, where there are any.
    pub(crate) fn new(rows: &Rows, contexts: &[Context<'_>], compared: &[bool], tones: &[Curve]) -> Self {
        // averages are blind to what repeats within a few of their rows
        let together = if tones.is_empty() && rows.len() > MANY { AVERAGED } else { 1 };
        let mut curves = story::all(contexts, compared);
        curves.extend_from_slice(tones);
        curves.extend(story::since_turn(contexts));
        let of_curve = |curve: &Curve| -> Vec<Vec<f32>> {
            let mut of_runs = vec![Vec::new(); story::count(curve)];
            for context in contexts {
                for (all, own) in of_runs.iter_mut().zip(story::columns(curve, context)) {
                    all.extend(own.into_iter().map(|x| if x.is_finite() { x } else { 0.0 }));
                }
            }
            of_runs.iter().map(|column| averaged(rows, column, together)).collect()
        };
        let columns: Vec<Vec<f32>> = curves.par_iter().flat_map_iter(of_curve).collect();
        let mut all = Symmetric::zeros(columns.len());
        fill(&mut all, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>(), 0);
        let mut saturation = Saturation { curves, columns, products: all, kept: Vec::new(), together };
        saturation.kept = saturation.kept_of_noise(rows, contexts);
        saturation
    }

    /// Part of the noise that is left when every curve has followed what it can, by [slowness](crate::noise::slowness): in
    /// a recording of a minute there are more curves than what is slow has freedom.
    pub(crate) fn kept(&self) -> &[f64] {
        &self.kept
    }

    /// The same, by what curves leave of noise of all memories.
    fn kept_of_noise(&self, rows: &Rows, contexts: &[Context<'_>]) -> Vec<f64> {
        let of_drawing = |drawn: u64| {
            let noise: Vec<f64> = contexts.iter().enumerate().flat_map(|(run, c)| wandering(c, drawn, run)).collect();
            (rows.slowness(&noise), rows.slowness(&self.rest(rows, contexts, &noise, &[], &[])))
        };
        let drawings: Vec<(Vec<f64>, Vec<f64>)> = (0..DRAWN).into_par_iter().map(of_drawing).collect();
        let (mut whole, mut left) = (Vec::new(), Vec::new());
        for (of_noise, of_rest) in &drawings {
            add(&mut whole, of_noise);
            add(&mut left, of_rest);
        }
        left.iter().zip(&whole).map(|(left, whole)| if *whole > 0.0 { (left / whole).min(1.0) } else { 1.0 }).collect()
    }

    /// Curves along the axes of the contract.
    pub(crate) fn stories(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| curve.axis != Axis::SinceTurn)
    }

    /// What the law's tangent, every curve and `extra` leave of a mismatch, row by row of all runs.
    pub(crate) fn rest(
        &self,
        rows: &Rows,
        contexts: &[Context<'_>],
        mismatch: &[f64],
        tangent: &[Vec<f64>],
        extra: &[Vec<f64>],
    ) -> Vec<f64> {
        let own: Vec<&Vec<f64>> = tangent.iter().chain(extra).collect();
        let averaged_own: Vec<Vec<f32>> = own.iter().map(|column| self.averaged(rows, column)).collect();
        let columns: Vec<&[f32]> = self.columns.iter().chain(&averaged_own).map(Vec::as_slice).collect();
        let mut a = Symmetric::zeros(columns.len());
        for i in 0..self.columns.len() {
            for j in 0..=i {
                a.set(i, j, self.products.get(i, j));
            }
        }
        fill(&mut a, &columns, self.columns.len());
        for i in 0..columns.len() {
            let ridge = RIDGE * a.get(i, i);
            a.add(i, i, ridge);
        }
        let plain = self.averaged(rows, mismatch);
        let b = products(&columns, &[&plain]);
        let x = self.heights(&a, &b, products(&[&plain], &[&plain])[0]);
        let mut residual = mismatch.to_vec();
        let mut heights = x.as_slice();
        for curve in &self.curves {
            let (own, others) = heights.split_at(story::count(curve));
            heights = others;
            let mut rest = residual.as_mut_slice();
            for context in contexts {
                let (run, runs) = rest.split_at_mut(context.run.len());
                story::take_from(curve, context, own, run);
                rest = runs;
            }
        }
        for (column, x) in own.iter().zip(heights) {
            for (residual, z) in residual.iter_mut().zip(column.iter()) {
                *residual -= x * z;
            }
        }
        residual
    }
}

impl Saturation {
    fn averaged(&self, rows: &Rows, column: &[f64]) -> Vec<f32> {
        averaged(rows, column, self.together)
    }

    /// Heights of the columns whose inner products are `a`, fitted to what has the products `b` with them and `square` with
    /// itself; 0 of the curve over the time since a turn where it does not follow most of what the others leave.
    fn heights(&self, a: &Symmetric, b: &[f64], square: f64) -> Vec<f64> {
        let x = Cholesky::of(a).solve(b);
        let Some(turn) = self.curves.last().filter(|curve| curve.axis == Axis::SinceTurn) else { return x };
        let of_turn = self.columns.len() - story::count(turn)..self.columns.len();
        let others: Vec<usize> = (0..b.len()).filter(|at| !of_turn.contains(at)).collect();
        let mut a_of_others = Symmetric::zeros(others.len());
        for (i, at) in others.iter().enumerate() {
            for (j, other) in others[..=i].iter().enumerate() {
                a_of_others.set(i, j, a.get(*at, *other));
            }
        }
        let b_of_others: Vec<f64> = others.iter().map(|at| b[*at]).collect();
        let without = Cholesky::of(&a_of_others).solve(&b_of_others);
        let left = |x: &[f64], b: &[f64]| square - x.iter().zip(b).map(|(x, b)| x * b).sum::<f64>();
        if left(&x, b) < (1.0 - MOST) * left(&without, &b_of_others) {
            return x;
        }
        let mut heights = vec![0.0; b.len()];
        for (at, height) in others.into_iter().zip(without) {
            heights[at] = height;
        }
        heights
    }
}

/// Noise of one run whose power is the same in every octave: it begins anew in every part.
fn wandering(context: &Context<'_>, drawn: u64, run: usize) -> Vec<f64> {
    let mut noise = Noise::new(drawn, run as u64);
    let mut out = vec![0.0; context.run.len()];
    for part in &context.run.parts {
        let octaves = (0..).take_while(|octave| 1 << octave <= 2 * part.rows.len());
        let mut states: Vec<(f64, f64)> =
            octaves.map(|octave: i32| ((-1.0 / f64::from(1u32 << octave)).exp(), noise.gaussian())).collect();
        for n in part.rows.clone() {
            for (memory, state) in &mut states {
                *state = *memory * *state + (1.0 - *memory * *memory).sqrt() * noise.gaussian();
                out[n] += *state;
            }
        }
    }
    out
}

fn add(sum: &mut Vec<f64>, more: &[f64]) {
    sum.resize(more.len().max(sum.len()), 0.0);
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// Inner products of the columns from `first` on with all.
fn fill(a: &mut Symmetric, columns: &[&[f32]], first: usize) {
    for (n, product) in products(&columns[first..], columns).into_iter().enumerate() {
        a.set(first + n / columns.len(), n % columns.len(), product);
    }
}

fn averaged(rows: &Rows, column: &[f64], together: usize) -> Vec<f32> {
    let plain = rows.plain(column);
    plain.chunks(together).map(|chunk| (chunk.iter().sum::<f64>() / chunk.len() as f64) as f32).collect()
}
