//! Rounding: the effect of a channel's quantisation steps on a force.
//!
//! Noise of one step or more dithers the force, and rounding adds noise of variance `step²/12`. Where the noise is
//! smaller, a part `exp(-4π²·(σ/step)²)` of that variance follows the force (Widrow's quantisation theorem, first
//! harmonic), and keeps its sign for as long as the force stays within a step.

/// Rounding error, relative to the noise (which includes it), from which it is a fault of the channel; a channel that
/// noise dithers has none.
const COARSE: f64 = 0.35;

/// Step of a quantised channel: the first percentile of its nonzero differences, if nearly all differences are whole
/// multiples of it.
pub(crate) fn quantum(x: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = x.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|d| *d > 0.0).collect();
    if steps.len() < 50 {
        return None;
    }
    steps.sort_unstable_by(f64::total_cmp);
    let step = steps[steps.len() / 100];
    let whole = steps.iter().filter(|d| (*d / step - (*d / step).round()).abs() < 0.02 * (*d / step).max(1.0)).count();
    // a quantised signal repeats differences; a continuous one has no smallest step
    let repeated = steps.windows(2).filter(|pair| pair[1] - pair[0] < 1e-6 * step).count();
    (whole * 100 > 95 * steps.len() && repeated * 2 > steps.len()).then_some(step)
}

/// Standard deviation of the error from rounding to a step.
pub(crate) fn rounding(step: f64) -> f64 {
    step / 12.0f64.sqrt()
}

/// Whether a step is a fault of the channel, given the standard deviation of the noise, rounding included, of averages
/// of `averaged` rows: rounding that noise dithers differs from row to row, and falls with their root.
pub(crate) fn is_coarse(step: f64, averaged: usize, noise: f64) -> bool {
    rounding(step) > COARSE * noise * (averaged.max(1) as f64).sqrt()
}

/// Variance of the rounding error that follows the force, given the standard deviation of the noise, rounding included.
pub(crate) fn following(step: f64, noise: f64) -> f64 {
    if !(step > 0.0) {
        return 0.0;
    }
    let own = (noise * noise - rounding(step).powi(2)).max(0.0);
    let tau = std::f64::consts::TAU;
    rounding(step).powi(2) * (-tau * tau * own / (step * step)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_seen() {
        let smooth: Vec<f64> = (0..2000).map(|n| (f64::from(n) * 0.0171).sin() * 3.0).collect();
        assert_eq!(quantum(&smooth), None);
        let coarse: Vec<f64> = smooth.iter().map(|x| (x / 0.05).round() * 0.05).collect();
        assert!((quantum(&coarse).expect("steps") - 0.05).abs() < 1e-9);
    }

    #[test]
    fn noise_carries_the_force_over_its_steps() {
        // all of the variance without noise, 1/11 of it at a quarter of a step, nothing at a whole step
        let share = |noise: f64| following(1.0, (noise * noise + 1.0 / 12.0).sqrt()) * 12.0;
        assert!((share(0.0) - 1.0).abs() < 1e-12 && (share(0.25) - 0.0848).abs() < 1e-3 && share(1.0) < 1e-15);
        assert_eq!(following(0.0, 1.0), 0.0);
    }

    #[test]
    fn noise_of_single_rows_dithers_steps_that_averages_no_longer_show() {
        // a step of the size of the noise, rounding included; averages of 16 rows have a quarter of both
        assert!(!is_coarse(1.0, 1, 1.04) && is_coarse(1.0, 1, 0.5));
        assert!(!is_coarse(1.0, 16, 1.04 / 4.0) && is_coarse(1.0, 16, 0.5 / 4.0));
    }
}
