//! Brewe and Hamrock's closed forms of the contact ellipse, to show what the exact integrals gain.

use std::f64::consts::PI;

use model_core::contact::Ellipse;

/// The ellipse of a ball in a groove of conformity `f` (0.505 and up), by curve fits instead of integrals.
///
/// ```text
/// r = R_y/R_x = 2f/(2f - 1),  κ = 1.0339 r^0.636,  E = 1.0003 + 0.5968/r,  K = 1.5277 + 0.6023 ln r
/// ```
///
/// Source: Brewe, Hamrock: J. Lubr. Technol. 99 (1977) 485. Axes and approach then follow Eq. 10.
pub fn brewe_hamrock(f: f64) -> Ellipse {
    let r = 2.0 * f / (2.0 * f - 1.0);
    let kappa = 1.0339 * r.powf(0.636);
    let e = 1.0003 + 0.5968 / r;
    let k = 1.5277 + 0.6023 * r.ln();
    let a = (2.0 * kappa * kappa * e / PI).cbrt();
    Ellipse { kappa, a, b: (2.0 * e / (PI * kappa)).cbrt(), approach: 2.0 * k / (PI * a) }
}

/// Errors of the fits as ratios less one: major axis, minor axis, approach, area.
pub fn error_of_fits(f: f64) -> [f64; 4] {
    let (fit, exact) = (brewe_hamrock(f), Ellipse::of_groove(f));
    [
        fit.a / exact.a - 1.0,
        fit.b / exact.b - 1.0,
        fit.approach / exact.approach - 1.0,
        fit.a * fit.b / (exact.a * exact.b) - 1.0,
    ]
}
