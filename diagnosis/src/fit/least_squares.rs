//! A fit of columns on the bench, what it leaves of a further cause, and that cause's amplitudes within bounds.

use crate::numbers::linear::{Cholesky, Symmetric};

/// A fit of the base.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) active: Vec<usize>,
    pub(crate) values: Vec<f64>,
    /// Squared residual, plus the prior's penalty for moved parameters.
    pub(crate) rss: f64,
    pub(super) factor: Cholesky,
    pub(super) forward: Vec<f64>,
    /// Law parameters that are held at a step.
    pub(super) held: Vec<(usize, f64)>,
}

impl Fit {
    pub(crate) fn variances(&self) -> Vec<f64> {
        self.factor.variances()
    }

    pub(crate) fn value_of(&self, column: usize) -> f64 {
        self.active.iter().position(|a| *a == column).map_or(0.0, |at| self.values[at])
    }

    /// The values of another fit, in which some columns take no part, with the variances of this one, in which they do.
    pub(crate) fn standing(mut self, other: &Fit) -> Self {
        self.values = self.active.iter().map(|column| other.value_of(*column)).collect();
        self.rss = other.rss;
        self
    }
}

/// What a fit leaves of a candidate.
pub(super) struct Left {
    pub(super) products: Symmetric,
    pub(super) with_mismatch: Vec<f64>,
    /// The part of every column that the fit imitates, in the factor's coordinates.
    pub(super) imitated: Vec<Vec<f64>>,
}

impl Left {
    /// Columns of the fit with their values beside a candidate of these amplitudes.
    pub(super) fn beside<'a>(&self, fit: &'a Fit, amplitudes: &[f64]) -> impl Iterator<Item = (usize, f64)> + use<'a> {
        let mut taken = vec![0.0; fit.values.len()];
        for (imitated, amplitude) in self.imitated.iter().zip(amplitudes) {
            taken.iter_mut().zip(imitated).for_each(|(taken, x)| *taken += amplitude * x);
        }
        let taken = fit.factor.backward(taken);
        fit.active.iter().copied().zip(fit.values.iter().zip(taken).map(|(value, taken)| value - taken))
    }
}

/// Least squares within bounds: amplitudes of the wrong sign are left out and those beyond their bound held there, the
/// worst first.
pub(super) fn bounded(left: &Symmetric, right: &[f64], bounds: &[(f64, f64)]) -> (f64, Vec<f64>) {
    let count = right.len();
    let mut free: Vec<usize> = (0..count).filter(|k| left.get(*k, *k) > 0.0).collect();
    let mut amplitudes = vec![0.0; count];
    loop {
        let held =
            |k: usize| (0..count).filter(|j| !free.contains(j)).map(|j| left.get(k, j) * amplitudes[j]).sum::<f64>();
        let b: Vec<f64> = free.iter().map(|k| right[*k] - held(*k)).collect();
        let x = Cholesky::of(&left.part(&free)).solve(&b);
        // distance beyond the bound, in units of the resolution of the data
        let beyond = |at: usize| {
            let (least, most) = bounds.get(free[at]).copied().unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            let end = x[at].clamp(least, most);
            ((x[at] - end).abs() * left.get(free[at], free[at]).sqrt(), end)
        };
        let worst =
            (0..free.len()).filter(|at| beyond(*at).0 > 0.0).max_by(|a, b| beyond(*a).0.total_cmp(&beyond(*b).0));
        match worst {
            Some(at) => {
                amplitudes[free[at]] = beyond(at).1;
                free.remove(at);
            }
            None => {
                for (k, x) in free.iter().zip(&x) {
                    amplitudes[*k] = *x;
                }
                let half = |i: usize| (0..count).map(|j| left.get(i, j) * amplitudes[j]).sum::<f64>();
                let nats: f64 = (0..count).map(|i| amplitudes[i] * (right[i] - 0.5 * half(i))).sum();
                return (nats.max(0.0), amplitudes);
            }
        }
    }
}
