//! Summary statistics.

/// Mean; 0 of an empty slice.
pub(crate) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

/// Root mean square; 0 of an empty slice.
pub(crate) fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Standard deviation; 0 of fewer than two values.
pub(crate) fn scatter(x: &[f64]) -> f64 {
    let mean = mean(x);
    let squares: f64 = x.iter().map(|x| (x - mean) * (x - mean)).sum();
    (squares / (x.len() as f64 - 1.0).max(1.0)).sqrt()
}

/// Median, the upper of two middle values; `None` if empty.
pub(crate) fn median(mut x: Vec<f64>) -> Option<f64> {
    let middle = x.len() / 2;
    (!x.is_empty()).then(|| *x.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Robust standard deviation around 0, from the median magnitude: insensitive to tails. 0 of an empty slice.
pub(crate) fn robust_sigma(x: &[f64]) -> f64 {
    1.4826 * median(x.iter().map(|x| x.abs()).collect()).unwrap_or(0.0)
}

/// Least-squares line through points: intercept, slope, and the residual scatter relative to that of the values.
pub(crate) fn line(points: &[(f64, f64)]) -> (f64, f64, f64) {
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len().max(1) as f64;
    let (mx, my) = (mean(&|p| p.0), mean(&|p| p.1));
    let sxx = mean(&|p| (p.0 - mx) * (p.0 - mx));
    let sxy = mean(&|p| (p.0 - mx) * (p.1 - my));
    let syy = mean(&|p| (p.1 - my) * (p.1 - my));
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    let left = mean(&|p| (p.1 - my - slope * (p.0 - mx)) * (p.1 - my - slope * (p.0 - mx)));
    (my - slope * mx, slope, if syy > 0.0 { (left / syy).sqrt() } else { 1.0 })
}

/// Probability of at least so many heads beside so few tails, where each is a head with this `chance`, between 0 and 1.
pub(crate) fn at_least(heads: usize, tails: usize, chance: f64) -> f64 {
    let all = (heads + tails) as f64;
    let choices = |k: f64| libm::lgamma(all + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(all - k + 1.0);
    let of = |k: f64| (choices(k) + k * chance.ln() + (all - k) * (-chance).ln_1p()).exp();
    (heads..=heads + tails).map(|k| of(k as f64)).sum::<f64>().min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_numbers_are_told_apart_and_none_does_no_harm() {
        assert_eq!(
            (mean(&[]), rms(&[]), scatter(&[3.0]), median(Vec::new()), robust_sigma(&[])),
            (0.0, 0.0, 0.0, None, 0.0)
        );
        assert_eq!((mean(&[1.0, 5.0]), rms(&[1.0, -7.0]), scatter(&[1.0, 3.0, 5.0])), (3.0, 5.0, 2.0));
        assert_eq!(median(vec![9.0, 1.0, 2.0]), Some(2.0));
        let (height, slope, left) = line(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]);
        // three or four of four at a tenth: 4 · 0.1³ · 0.9 + 0.1⁴
        assert!((at_least(3, 1, 0.1) - 0.0037).abs() < 1e-12 && (at_least(0, 7, 0.3) - 1.0).abs() < 1e-12);
        assert!((height - 1.0).abs() < 1e-12 && (slope - 2.0).abs() < 1e-12 && left < 1e-7, "{height} {slope} {left}");
    }
}
