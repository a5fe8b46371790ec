//! Profile-likelihood intervals, which hold for badly determined constants as well.
//!
//! A constant is held at a value and all others are refitted; the values at which χ² has risen by t² are the ends of
//! the interval, with the probability of |Student's t| below t. Where the law is nearly linear this is the usual ±t σ;
//! where it is not, the two ends are at different distances, and where the data do not determine a constant there is no
//! end.

use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::fit::FrictionFit;
#[cfg(doc)]
use crate::fit::NAMES;
use crate::separable;

/// Distance up to which an end is searched, as a multiple of the expected distance.
const FARTHEST: f64 = 40.0;

/// Interval of a constant with a stated probability. An end that the data do not determine is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
}

impl Interval {
    /// Whether a value lies inside.
    pub fn holds(&self, value: f64) -> bool {
        value >= self.from && value <= self.to
    }
}

impl FrictionFit {
    /// The interval of a constant, in the order of [`NAMES`], then the seals', that contains the truth with
    /// `probability` (0 to 1).
    pub fn interval(&self, constant: usize, probability: f64) -> Interval {
        // always exists with 1 or more degrees of freedom
        let Ok(student) = StudentsT::new(0.0, 1.0, self.freedom().max(1) as f64) else {
            return Interval { from: f64::NEG_INFINITY, to: f64::INFINITY };
        };
        let t = student.inverse_cdf(0.5 + 0.5 * probability);
        Interval { from: self.end(constant, -1.0, t), to: self.end(constant, 1.0, t) }
    }

    /// The value on one side at which χ² has risen by t².
    fn end(&self, constant: usize, side: f64, t: f64) -> f64 {
        let (value, sigma) = (self.constant(constant), self.sigma(constant));
        // k_s is stepped in its logarithm, which keeps it positive and the law closer to linear
        let place = |u: f64| match constant {
            3 => value * (side * u * sigma / value).exp(),
            _ => value + side * u * sigma,
        };
        let rise = |u: f64| self.chi2_at(constant, place(u)).map(|chi2| (chi2 - self.chi2).max(0.0).sqrt());
        let (mut inside, mut outside) = (0.0, t);
        loop {
            match rise(outside) {
                Some(r) if r >= t => break,
                _ if outside > FARTHEST * t => return side * f64::INFINITY,
                _ => (inside, outside) = (outside, 1.6 * outside),
            }
        }
        // to a hundredth of a standard deviation
        while outside - inside > 1e-2 {
            let middle = 0.5 * (inside + outside);
            match rise(middle) {
                Some(r) if r < t => inside = middle,
                _ => outside = middle,
            }
        }
        place(0.5 * (inside + outside))
    }

    /// Least χ² with one constant held; `None` where the others are not determined then.
    fn chi2_at(&self, constant: usize, value: f64) -> Option<f64> {
        let (grid, unit) = (&self.problem, self.problem.unit());
        if constant == 3 {
            return separable::linear(grid, (value * unit).ln(), None).map(|fit| fit.chi2);
        }
        // k_s is not among the linear parameters
        let held = match constant {
            1 => Some((1, value * unit)),
            0 | 2 => Some((constant, value)),
            seal => Some((seal - 1, value)),
        };
        // while another constant moves by several standard deviations, k_s moves by a few of its own at most
        let (centre, reach) =
            ((self.values()[3] * unit).ln(), (8.0 * self.sigma(3) / self.values()[3]).clamp(0.2, 3.0));
        let (from, to) = ((centre - reach).max(grid.range().0), (centre + reach).min(grid.range().1));
        let chi2 = |x: f64| separable::linear(grid, x, held).map_or(f64::INFINITY, |fit| fit.chi2);
        Some(chi2(separable::golden(from, to, 1e-3 * reach, chi2))).filter(|chi2| chi2.is_finite())
    }
}
