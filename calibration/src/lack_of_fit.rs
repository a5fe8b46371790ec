//! Lack of fit: whether a fitted law leaves a pattern, by the scatter of repeated strokes against that between groups.
//!
//! ```text
//! F = (Σ n_g m_g²/(groups - p)) / (Σ (e - m_g)²/(n - groups))        m_g: mean residual of a group of equal strokes
//! ```

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// p-value of the F statistic. `None` where no stroke was repeated, or too few.
///
/// `residuals`: divided by σ; `groups`: index of repeated strokes; `parameters`: number of fitted parameters.
pub fn p_value(residuals: &[f64], groups: &[usize], parameters: usize) -> Option<f64> {
    let mut sums: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for (e, g) in residuals.iter().zip(groups) {
        let (sum, count) = sums.entry(*g).or_default();
        *sum += e;
        *count += 1.0;
    }
    let pattern: f64 = sums.values().map(|(sum, count)| sum * sum / count).sum();
    let pure: f64 = residuals.iter().map(|e| e * e).sum::<f64>() - pattern;
    let (above, below) = (sums.len().checked_sub(parameters)?, residuals.len() - sums.len());
    if above == 0 || below == 0 || pure <= 0.0 {
        return None;
    }
    let ratio = (pattern / above as f64) / (pure / below as f64);
    Some(FisherSnedecor::new(above as f64, below as f64).ok()?.sf(ratio))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_is_seen_and_none_is_made_up() {
        let groups: Vec<usize> = (0..60).map(|n| n / 3).collect();
        let scatter = |n: usize| ((n as f64 * 0.618_034).fract() - 0.5) * 3.4;
        let even: Vec<f64> = (0..60).map(scatter).collect();
        let bent: Vec<f64> = (0..60).map(|n| scatter(n) + 2.0 * (n as f64 / 10.0).sin()).collect();
        assert!(p_value(&even, &groups, 4).unwrap() > 0.01);
        assert!(p_value(&bent, &groups, 4).unwrap() < 1e-4);
        let alone: Vec<usize> = (0..60).collect();
        assert_eq!(p_value(&even, &alone, 4), None);
    }
}
