//! Separation: how far one explanation can imitate another over the recording and a hypothetical run.
//!
//! ```text
//! A's force            y = C_A a                        a as fitted to the recording
//! residual of B        min over b, m, p of |y - C_B b - C_M m - T p|²/σ² + pᵀ P p
//! separation           half of that, nats
//! ```
//!
//! over both recordings: `C_B` are the columns of B and their changes with its shape, `C_M` those of the other causes
//! found, `T` is the tangent of the law and `P` the prior precision of its parameters. Signs of amplitudes are not
//! enforced, so a rival may do more here than it really could. Noise of the hypothetical run is white, with the level
//! per row of the recording.

use std::ops::Range;

use crate::numbers::linear::{Cholesky, Symmetric, dot};

/// Share of a force that rounding leaves of it.
const ROUNDING: f64 = 1e-6;

/// Columns of an explanation, by index.
#[derive(Clone, Debug)]
pub(super) struct Explanation {
    pub(super) columns: Range<usize>,
    /// Columns of the change of its force with its shape.
    pub(super) slopes: Range<usize>,
    pub(super) amplitudes: Vec<f64>,
}

/// Expected evidence, nats, against `other` where `truth` acts. `common`: prior precisions of the first columns, which
/// both have.
pub(super) fn nats(gram: &Symmetric, common: &[f64], truth: &Explanation, other: &Explanation) -> f64 {
    let active: Vec<usize> = (0..common.len()).chain(other.columns.clone()).chain(other.slopes.clone()).collect();
    let mut a = gram.part(&active);
    for (k, precision) in common.iter().enumerate() {
        a.add(k, k, *precision);
    }
    let force = |column: usize| -> f64 {
        truth.columns.clone().zip(&truth.amplitudes).map(|(k, x)| x * gram.get(k, column)).sum()
    };
    let own: f64 = truth.columns.clone().zip(&truth.amplitudes).map(|(k, x)| x * force(k)).sum();
    let b: Vec<f64> = active.iter().map(|column| force(*column)).collect();
    let followed = Cholesky::of(&a).forward(&b);
    let left = own - dot(&followed, &followed);
    if left > ROUNDING * own { 0.5 * left } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns over eight rows; the first four are the recording.
    fn gram(columns: &[[f64; 8]]) -> Symmetric {
        let mut gram = Symmetric::zeros(columns.len());
        for i in 0..columns.len() {
            for j in 0..=i {
                gram.set(i, j, dot(&columns[i], &columns[j]));
            }
        }
        gram
    }

    fn explanation(column: usize) -> Explanation {
        Explanation { columns: column..column + 1, slopes: column + 1..column + 1, amplitudes: vec![3.0] }
    }

    #[test]
    fn a_force_that_goes_and_one_that_stays_are_told_apart_by_half_of_it() {
        let law = [0.1, -0.2, 0.3, 0.1, 0.0, 0.1, -0.3, 0.2];
        let (stays, goes) = ([1.0; 8], [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let gram = gram(&[law, stays, goes]);
        // beside a law that cannot move: 3 on four rows, 1.5 either way on all eight
        let rigid = nats(&gram, &[1e12], &explanation(2), &explanation(1));
        assert!((rigid - 0.5 * 8.0 * 1.5 * 1.5).abs() < 1e-6, "{rigid}");
        assert!(nats(&gram, &[0.0], &explanation(2), &explanation(1)) < rigid);
        assert_eq!(nats(&gram, &[1e12], &explanation(1), &explanation(1)), 0.0);
    }
}
