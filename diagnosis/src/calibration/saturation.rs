//! Saturation: the residual of a fit of everything that could be explained.
//!
//! Every curve along every axis takes part, beside the law's tangent. Parts of the profile count by how quiet they are:
//! otherwise the curves would carry the noise of loud parts, slow in them as in all that curves follow, into quiet ones,
//! where it would count as slow noise. A curve over the time since a turn takes part
//! only where it follows most of what the others leave: a late or filtered force is wrong there for a few rows by far
//! more than noise, which must not count as noise. The curves depend on the runs alone, so their columns and inner
//! products are computed once.

use rayon::prelude::*;
use simulation::curve::{Axis, Curve};
use simulation::mechanism::Context;
use simulation::sensor::Noise;

use crate::fit::story;
use crate::noise::rows::Rows;
use crate::numbers::linear::{Cholesky, Symmetric, dot, products};

/// Number of rows above which the fit uses averages, and rows per average: the linear relation is the same in averages,
/// and cheaper.
const MANY: usize = 20_000;
const AVERAGED: usize = 4;

/// Ridge, as a share of a column's square: it suppresses the single-precision error in the difference of overlapping
/// curves. Where hundreds of them imitate one another it may not suffice, and grows.
const RIDGE: f64 = 1e-6;
const MOST_RIDGE: f64 = 1e-3;

/// Share of the other curves' squared residual that the curve over the time since a turn must explain to take part.
const MOST: f64 = 0.5;

/// Noise realisations from which the share of noise that the curves leave is estimated.
const DRAWN: u64 = 3;

/// See the module.
pub(crate) struct Saturation {
    /// The curve over the time since a turn comes last.
    curves: Vec<Curve>,
    columns: Vec<Vec<f32>>,
    products: Symmetric,
    kept: Vec<f64>,
    /// Columns of a wave along the rail that is louder than the noise, one entry per row of all runs.
    wave: Vec<Vec<f64>>,
    /// How much quieter a row's part is than the loudest; one entry per row of all runs.
    quietness: Vec<f64>,
    /// Rows per average.
    together: usize,
}

impl Saturation {
    /// `compared`: rows over which knots are placed, one entry per row of all runs. `tones`: fast periodic curves,
    /// where there are any.
    pub(crate) fn new(rows: &Rows, contexts: &[Context<'_>], compared: &[bool], tones: &[Curve]) -> Self {
        // averages are blind to periods of a few of their rows
        let together = if tones.is_empty() && rows.len() > MANY { AVERAGED } else { 1 };
        let force_n: Vec<f64> = contexts.iter().flat_map(|context| &context.run.drag_force_n).copied().collect();
        let quietness = rows.quietness(&force_n);
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
            of_runs.iter().map(|column| averaged(rows, column, &quietness, together)).collect()
        };
        let columns: Vec<Vec<f32>> = curves.par_iter().flat_map_iter(of_curve).collect();
        let mut all = Symmetric::zeros(columns.len());
        fill(&mut all, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>(), 0);
        let (kept, wave) = (Vec::new(), Vec::new());
        let mut saturation = Saturation { curves, columns, products: all, kept, wave, quietness, together };
        saturation.kept = saturation.kept_of_noise(rows, contexts);
        saturation
    }

    /// Share of the noise that is left when all curves are fitted, by [slowness](crate::noise::slowness): in a
    /// recording of a minute there are more curves than the slow noise has degrees of freedom.
    pub(crate) fn kept(&self) -> &[f64] {
        &self.kept
    }

    /// Estimates that share with simulated noise of all correlation times.
    fn kept_of_noise(&self, rows: &Rows, contexts: &[Context<'_>]) -> Vec<f64> {
        let of_drawing = |drawn: u64| {
            let noise: Vec<f64> = contexts.iter().enumerate().flat_map(|(run, c)| wandering(c, drawn, run)).collect();
            let loud: Vec<f64> =
                noise.iter().zip(&self.quietness).map(|(noise, quietness)| noise / quietness).collect();
            let rest = self.rest(rows, contexts, &loud, &[], &[]);
            (rows.slowness(&noise), rows.slowness(&times(&rest, &self.quietness)))
        };
        let drawings: Vec<(Vec<f64>, Vec<f64>)> = (0..DRAWN).into_par_iter().map(of_drawing).collect();
        let (mut whole, mut left) = (Vec::new(), Vec::new());
        for (of_noise, of_rest) in &drawings {
            add(&mut whole, of_noise);
            add(&mut left, of_rest);
        }
        left.iter().zip(&whole).map(|(left, whole)| if *whole > 0.0 { (left / whole).min(1.0) } else { 1.0 }).collect()
    }

    /// The same with a wave beside the curves.
    pub(crate) fn beside(self, wave: Vec<Vec<f64>>) -> Self {
        Saturation { wave, ..self }
    }

    /// Curves along the axes of the contract.
    pub(crate) fn stories(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| curve.axis != Axis::SinceTurn)
    }

    /// Residual of a mismatch after a fit of the law's tangent, every curve, a loud wave and `extra`; one entry per row
    /// of all runs.
    pub(crate) fn rest(
        &self,
        rows: &Rows,
        contexts: &[Context<'_>],
        mismatch: &[f64],
        tangent: &[Vec<f64>],
        extra: &[Vec<f64>],
    ) -> Vec<f64> {
        let own: Vec<&Vec<f64>> = tangent.iter().chain(extra).chain(&self.wave).collect();
        let averaged_own: Vec<Vec<f32>> = own.iter().map(|column| self.averaged(rows, column)).collect();
        let columns: Vec<&[f32]> = self.columns.iter().chain(&averaged_own).map(Vec::as_slice).collect();
        let mut a = Symmetric::zeros(columns.len());
        for i in 0..self.columns.len() {
            for j in 0..=i {
                a.set(i, j, self.products.get(i, j));
            }
        }
        fill(&mut a, &columns, self.columns.len());
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
        averaged(rows, column, &self.quietness, self.together)
    }

    /// Heights of the columns with Gram matrix `a`, fitted to a mismatch with the products `b` with them and `square`
    /// with itself; 0 for the curve over the time since a turn where it does not explain most of what the others leave.
    fn heights(&self, a: &Symmetric, b: &[f64], square: f64) -> Vec<f64> {
        let x = solved(a, b, square);
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
        let without = solved(&a_of_others, &b_of_others, square);
        if square - dot(&x, b) < (1.0 - MOST) * (square - dot(&without, &b_of_others)) {
            return x;
        }
        let mut heights = vec![0.0; b.len()];
        for (at, height) in others.into_iter().zip(without) {
            heights[at] = height;
        }
        heights
    }
}

/// Heights of columns with Gram matrix `a`, fitted to a mismatch with the products `b` with them and `square` with
/// itself, with as much ridge as it takes: single precision may leave a sum of columns next to nothing of its square, or
/// less, and the fit then seems to explain more than there is.
fn solved(a: &Symmetric, b: &[f64], square: f64) -> Vec<f64> {
    let mut ridge = RIDGE;
    loop {
        let mut ridged = a.clone();
        (0..b.len()).for_each(|i| ridged.add(i, i, ridge * a.get(i, i)));
        let x = Cholesky::of(&ridged).solve(b);
        if dot(&x, b) <= square || ridge >= MOST_RIDGE {
            return x;
        }
        ridge *= 10.0;
    }
}

/// Noise of one run with equal power in every octave, starting afresh in every part.
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

fn times(column: &[f64], by: &[f64]) -> Vec<f64> {
    column.iter().zip(by).map(|(x, by)| x * by).collect()
}

fn add(sum: &mut Vec<f64>, more: &[f64]) {
    sum.resize(more.len().max(sum.len()), 0.0);
    sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// Fills in the inner products of the columns from `first` on with all columns.
fn fill(a: &mut Symmetric, columns: &[&[f32]], first: usize) {
    for (n, product) in products(&columns[first..], columns).into_iter().enumerate() {
        a.set(first + n / columns.len(), n % columns.len(), product);
    }
}

fn averaged(rows: &Rows, column: &[f64], quietness: &[f64], together: usize) -> Vec<f32> {
    let plain = rows.plain(&times(column, quietness));
    plain.chunks(together).map(|chunk| (chunk.iter().sum::<f64>() / chunk.len() as f64) as f32).collect()
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::motion::Motion;
    use simulation::run::{Break, Part, Run};

    use super::*;
    use crate::numbers::statistics::rms;

    /// One run of a minute, back and forth over the same stroke with its own time of a stroke, in white noise.
    fn run(of: u64, period_s: f64, noise_n: f64) -> Run {
        let time_s: Vec<f64> = (0..6000).map(|n| 0.01 * f64::from(n)).collect();
        let phase = |t: &f64| std::f64::consts::TAU * t / period_s;
        let mut noise = Noise::new(7, of);
        Run {
            drag_force_n: time_s.iter().map(|_| noise_n * noise.gaussian()).collect(),
            position_m: Some(time_s.iter().map(|t| -0.2 * libm::cos(phase(t))).collect()),
            velocity_m_s: Some(
                time_s.iter().map(|t| 0.2 * std::f64::consts::TAU / period_s * libm::sin(phase(t))).collect(),
            ),
            parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        }
    }

    #[test]
    fn no_fit_explains_more_than_there_is() {
        // two columns that are one, whose product came out too large by a millionth
        let mut a = Symmetric::zeros(2);
        (0..2).for_each(|i| a.set(i, i, 1.0));
        a.set(1, 0, 1.0 + 0.999e-6);
        let b = [0.5, 0.499];
        let x = solved(&a, &b, 1.0);
        assert!(dot(&x, &b) < 0.5 && x.iter().all(|x| x.abs() < 1e3), "{x:?}");
    }

    #[test]
    fn curves_carry_no_noise_of_a_loud_run_into_a_quiet_one() {
        let file = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 5\n\
                    viscous_n_s_m = 20\noffset_n = 0\n[axis]\nmoved_mass_kg = 10";
        let simulation = Simulation::from_toml(file).expect("legal");
        let runs = [run(0, 7.0, 1.0), run(1, 11.0, 0.03)];
        let motions: Vec<Motion> = runs.iter().map(Motion::of).collect();
        let contexts: Vec<Context> = runs
            .iter()
            .zip(&motions)
            .map(|(run, motion)| Context::of(&simulation, run, motion).expect("complete"))
            .collect();
        let compared = vec![true; 12_000];
        let rows = Rows::new(&runs, &compared, 1);
        let noise: Vec<f64> = runs.iter().flat_map(|run| &run.drag_force_n).copied().collect();
        let left = Saturation::new(&rows, &contexts, &compared, &[]).rest(&rows, &contexts, &noise, &[], &[]);
        let slow = |left: &[f64]| rms(&left.chunks(100).map(|x| x.iter().sum::<f64>() / 10.0).collect::<Vec<_>>());
        assert!((0.5..1.1).contains(&slow(&left[..6000])), "{}", slow(&left[..6000]));
        assert!(slow(&left[6000..]) < 1.1 * 0.03, "{} of 0.03 N", slow(&left[6000..]));
    }
}
