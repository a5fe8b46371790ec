//! Noise law: scatter of measured drag forces, from the residuals of a fit.
//!
//! ```text
//! σ² = (r F)² + s²      r: part of the force, s: N
//! ```

use crate::separable::golden;

/// A noise law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Part of the force, dimensionless.
    pub relative: f64,
    /// Part that does not depend on the force, N.
    pub absolute_n: f64,
}

impl Noise {
    /// Standard deviation at a force, N.
    pub fn sigma_n(&self, force_n: f64) -> f64 {
        (self.relative * self.relative * force_n * force_n + self.absolute_n * self.absolute_n).sqrt()
    }

    /// The most likely law of `residuals_n` at `forces_n`, for a fit that took `parameters` degrees of freedom.
    ///
    /// For a fixed ratio t = r/s the likelihood is greatest at `s² = mean(ε²/(1 + t² F²))·n/(n - p)`, which leaves a
    /// search over one number.
    pub fn of(residuals_n: &[f64], forces_n: &[f64], parameters: usize) -> Self {
        let n = residuals_n.len() as f64;
        let freedom = (n - parameters as f64).max(1.0);
        let typical = (forces_n.iter().map(|f| f * f).sum::<f64>() / n).sqrt().max(1e-12);
        // t·F from 1e-3 to 1e3 at the typical force: beyond that one of the two parts has no effect
        let square = |t: f64| {
            let sum: f64 = residuals_n.iter().zip(forces_n).map(|(e, f)| e * e / (1.0 + t * t * f * f)).sum();
            sum / freedom
        };
        let cost = |ln_t: f64| {
            let t = ln_t.exp() / typical;
            let spread: f64 = forces_n.iter().map(|f| (1.0 + t * t * f * f).ln()).sum();
            // restricted likelihood: the fit has absorbed its share of the residuals
            freedom * square(t).ln() + spread * freedom / n
        };
        let places: Vec<f64> = (0..25).map(|k| -6.9 + 13.8 * f64::from(k) / 24.0).collect();
        let best = places.iter().copied().min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap_or(0.0);
        let t = golden(best - 0.6, best + 0.6, 1e-4, cost).exp() / typical;
        let s = square(t).sqrt();
        Noise { relative: t * s, absolute_n: s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_parts_come_back_from_many_residuals() {
        // a fixed sequence of unit variance: the quantiles of the normal law, scattered
        let normal = statrs::distribution::Normal::standard();
        let unit = |n: usize| {
            use statrs::distribution::ContinuousCDF;
            normal.inverse_cdf(((n as f64 + 0.5) * 0.618_033_988_75).fract().clamp(1e-9, 1.0 - 1e-9))
        };
        let forces: Vec<f64> = (0..20_000).map(|n| 2.0 + 80.0 * (n as f64 * 0.754_877_666).fract()).collect();
        let truth = Noise { relative: 0.01, absolute_n: 0.1 };
        let residuals: Vec<f64> = forces.iter().enumerate().map(|(n, f)| truth.sigma_n(*f) * unit(n)).collect();
        let got = Noise::of(&residuals, &forces, 4);
        assert!((got.relative / 0.01 - 1.0).abs() < 0.05, "{got:?}");
        assert!((got.absolute_n / 0.1 - 1.0).abs() < 0.1, "{got:?}");
    }
}
