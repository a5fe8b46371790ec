//! What any single curve μ(H) allows, whatever the units of H: the paper's Fig. 5b asks for more.
//!
//! Over 0.1 to 6 m/min H grows sixtyfold at one load. Where the friction is smallest at 500 N fixes H there; how flat
//! it may be at 8500 N bounds H there; so the two together demand a power of the load in `H ~ V Q^p`.

use model_core::friction::Friction;

/// Fastest over slowest measured speed.
pub const SPEED_RATIO: f64 = 60.0;

/// Largest over smallest friction while `k_s H` runs from `fastest/60` to `fastest`.
///
/// The curve falls, then rises: its extremes stand at the two ends and, if it lies between them, at the minimum.
pub fn spread(friction: &Friction, fastest: f64) -> f64 {
    let k_s = friction.stribeck_exponent;
    let at = |exponent: f64| friction.coefficient(exponent / k_s);
    let (slow, fast) = (at(fastest / SPEED_RATIO), at(fastest));
    let lowest = k_s * friction.hersey_of_minimum();
    let inside = (fastest / SPEED_RATIO..fastest).contains(&lowest);
    let smallest = if inside { at(lowest) } else { slow.min(fast) };
    slow.max(fast) / smallest
}

/// Largest `k_s H` at the fastest speed with which the friction stays within `ratio`, above 1.
///
/// `ratio` is largest over smallest. Looked for up to 100, beyond which the curve is a straight line through a ratio
/// of speeds and never flat.
pub fn flattest(friction: &Friction, ratio: f64) -> f64 {
    // from the top down in steps of 0.1 %, then the step halved
    let (mut low, mut high): (f64, f64) = (100.0, 100.0);
    while spread(friction, low) > ratio && low > 1e-9 {
        high = low;
        low *= 0.999;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if spread(friction, middle) > ratio { high = middle } else { low = middle }
    }
    low
}

/// The largest power p in `H ~ V Q^p` with which one curve can have its minimum at `speed_m_min` under 500 N and stay
/// within `ratio` (largest over smallest) under 8500 N, both over 0.1 to 6 m/min.
///
/// `p <= ln(x_8500/x_500)/ln 17`, x the largest `k_s H` at that load; the load per ball is taken as proportional to
/// the lateral force.
pub fn power_of_load(friction: &Friction, speed_m_min: f64, ratio: f64) -> f64 {
    let lowest = friction.stribeck_exponent * friction.hersey_of_minimum();
    let fastest_500 = lowest * 6.0 / speed_m_min;
    (flattest(friction, ratio) / fastest_500).ln() / (8500.0_f64 / 500.0).ln()
}

/// Where the friction is smallest at `lateral_n` and how far it rises from there to 6 m/min (a ratio less one), if the
/// minimum stands at `speed_m_min` under 500 N and `H ~ V Q^power`.
pub fn minimum_and_rise(friction: &Friction, speed_m_min: f64, power: f64, lateral_n: f64) -> (f64, f64) {
    let speed = speed_m_min * (lateral_n / 500.0).powf(-power);
    let lowest = friction.hersey_of_minimum();
    (speed, friction.coefficient(lowest * 6.0 / speed) / friction.coefficient(lowest) - 1.0)
}
