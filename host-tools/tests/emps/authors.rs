//! The two models that the authors publish, and the error as they compute it.
//!
//! The position passes a Butterworth low pass of order 4 at 100 Hz forth and back and is differentiated by central
//! differences; the first 49 rows are left out; regressors and force are decimated to 100 Hz; least squares gives
//!
//! ```text
//! nominal:    F = M a + Fv v + Fc sign(v) + offset
//! asymmetric: F = M a + Fv+ v + Fc+ sign(v)  where v > 0,   M a + Fv- v + Fc- sign(v)  where v < 0
//! error = 100 % |F - F_model| / |F|
//! ```
//!
//! A. Janot, M. Gautier, M. Brunot, *Data Set and Reference Models of EMPS*, 2019.

use super::filter::{LowPass, decimate};

/// Rows that are left out for the ends of the differences.
pub(crate) const BORDER: usize = 49;
/// From 1 kHz to 100 Hz.
const FACTOR: usize = 10;

/// A recording at 1 kHz.
pub(crate) struct Recording {
    pub(crate) position_m: Vec<f64>,
    pub(crate) force_n: Vec<f64>,
}

/// Error of a force, %, both decimated.
pub(crate) fn error_pct(force_n: &[f64], model_n: &[f64]) -> f64 {
    let [force, model] = [force_n, model_n].map(|f| decimate(&f[BORDER..], FACTOR));
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
    100.0 * norm(&mut force.iter().zip(&model).map(|(f, m)| f - m)) / norm(&mut force.iter().copied())
}

fn central_difference(values: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let at = |n: usize| {
        let (from, to) = (n.saturating_sub(1), (n + 1).min(last));
        (values[to] - values[from]) / ((to - from) as f64 * 1e-3)
    };
    (0..=last).map(at).collect()
}

/// Position, velocity and acceleration, filtered and differentiated.
pub(crate) fn motion(recording: &Recording) -> [Vec<f64>; 3] {
    let position = LowPass::butterworth(4, 100.0 / 500.0).zero_phase(&recording.position_m);
    let velocity = central_difference(&position);
    let acceleration = central_difference(&velocity);
    [position, velocity, acceleration]
}

/// The columns of the regression at 1 kHz.
fn regressors(recording: &Recording, is_asymmetric: bool) -> Vec<Vec<f64>> {
    let [_, velocity, acceleration] = motion(recording);
    let of = |column: &dyn Fn(f64) -> f64| velocity.iter().map(|&v| column(v)).collect::<Vec<_>>();
    let mut columns = vec![acceleration];
    if is_asymmetric {
        columns.extend([of(&|v| v.max(0.0)), of(&|v| f64::from(v > 0.0))]);
        columns.extend([of(&|v| v.min(0.0)), of(&|v| -f64::from(v < 0.0))]);
    } else {
        columns.extend([of(&|v| v), of(&|v| v.signum()), of(&|_| 1.0)]);
    }
    columns
}

/// Constants by least squares on the decimated rows of one recording.
pub(crate) fn fit(recording: &Recording, is_asymmetric: bool) -> Vec<f64> {
    let short = |column: &[f64]| decimate(&column[BORDER..], FACTOR);
    let columns: Vec<_> = regressors(recording, is_asymmetric).iter().map(|column| short(column)).collect();
    least_squares(&columns, &short(&recording.force_n))
}

/// Sizes of the columns that come nearest to `of`.
pub(crate) fn least_squares(columns: &[Vec<f64>], of: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let count = columns.len();
    let row = |a: &Vec<f64>| columns.iter().map(|b| dot(a, b)).chain([dot(a, of)]).collect();
    let mut rows: Vec<Vec<f64>> = columns.iter().map(row).collect();
    // normal equations, positive definite: no pivot is needed
    for pivot in 0..count {
        for below in pivot + 1..count {
            let factor = rows[below][pivot] / rows[pivot][pivot];
            let above = rows[pivot].clone();
            rows[below].iter_mut().zip(above).for_each(|(b, a)| *b -= factor * a);
        }
    }
    let mut constants = vec![0.0; count];
    for n in (0..count).rev() {
        let known = dot(&rows[n][n + 1..count], &constants[n + 1..]);
        constants[n] = (rows[n][count] - known) / rows[n][n];
    }
    constants
}

/// The force of the model with these constants, N.
pub(crate) fn force(recording: &Recording, constants: &[f64]) -> Vec<f64> {
    let columns = regressors(recording, constants.len() == 5);
    (0..recording.force_n.len()).map(|n| columns.iter().zip(constants).map(|(c, k)| c[n] * k).sum()).collect()
}
