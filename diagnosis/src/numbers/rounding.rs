//! What a channel that counts in steps does to a force.
//!
//! Noise of a step and more carries the force over its steps, and rounding is noise of `step²/12` beside it. Where the noise
//! is smaller, rounding follows the force: of its square, `exp(-4π²·(σ/step)²)` does (Widrow's quantisation theorem, first
//! harmonic), and keeps its sign for as long as the force stays within a step.

/// Rounding, of the noise (in which it is), from which it is a fault of the channel; a channel that noise carries over
/// its steps has none.
const COARSE: f64 = 0.35;

/// Step of a quantised channel: its smallest difference but for one in a hundred, if nearly all differences are whole multiples of it.
pub(crate) fn quantum(x: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = x.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|d| *d > 0.0).collect();
    if steps.len() < 50 {
        return None;
    }
    steps.sort_unstable_by(f64::total_cmp);
    let step = steps[steps.len() / 100];
    let whole = steps.iter().filter(|d| (*d / step - (*d / step).round()).abs() < 0.02 * (*d / step).max(1.0)).count();
    // single values repeat in a quantised signal; a continuous one has no smallest step
    let repeated = steps.windows(2).filter(|pair| pair[1] - pair[0] < 1e-6 * step).count();
    (whole * 100 > 95 * steps.len() && repeated * 2 > steps.len()).then_some(step)
}

/// Standard deviation of what rounding to a step adds.
pub(crate) fn rounding(step: f64) -> f64 {
    step / 12.0f64.sqrt()
}

/// Whether a step is a fault of the channel, beside noise of a standard deviation with the rounding in it.
pub(crate) fn is_coarse(step: f64, noise: f64) -> bool {
    rounding(step) > COARSE * noise
}

/// Variance of the rounding that follows the force, beside noise of a standard deviation with the rounding in it.
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
        // 1 of all of it without noise, 1/11 at a quarter of a step, nothing at a step
        let share = |noise: f64| following(1.0, (noise * noise + 1.0 / 12.0).sqrt()) * 12.0;
        assert!((share(0.0) - 1.0).abs() < 1e-12 && (share(0.25) - 0.0848).abs() < 1e-3 && share(1.0) < 1e-15);
        assert_eq!(following(0.0, 1.0), 0.0);
    }
}
