//! The best two-term series of the sliding speed: the yardstick for the series that the block carries.
//!
//! `u/V = k_u x (1 + χ1 x + χ2 x²)`, `x = Q^(2/3)`; χ1 and χ2 here make the largest relative error as small as it can be
//! (Chebyshev), those of `model_core::reduced` are exact at two loads and so larger in error by a factor three.

use model_core::exact::Exact;

/// A fitted series.
#[derive(Clone, Copy, Debug)]
pub struct SlipSeries {
    /// χ1, N^(-2/3).
    pub chi_1: f64,
    /// χ2, N^(-4/3).
    pub chi_2: f64,
    /// Largest relative error over the range.
    pub error: f64,
}

/// Fits the series for `0 < x <= x_end`, x in N^(2/3), within the geometry of a model that uses the sliding speed.
///
/// Remez: three loads with errors equal and of alternating sign, exchanged for the extremes of the error until they
/// stay.
pub fn fit(model: &Exact, x_end: f64) -> SlipSeries {
    const STEPS: u32 = 20_000;
    let leading = |x: f64| model.contact().k_u * x / model.slip_ratio(x.powf(1.5));
    // x close to where a quadratic through the origin has its extremes; the error is zero at x = 0
    let mut at = [0.21 * x_end, 0.76 * x_end, x_end];
    let (mut chi, mut largest) = ([0.0; 2], 0.0);
    for _ in 0..20 {
        // g (1 + χ1 x + χ2 x²) - 1 = ±E at the three, so χ1 x + χ2 x² -+ E/g = 1/g - 1
        let rows = [0, 1, 2].map(|n| {
            let (x, g) = (at[n], leading(at[n]));
            let sign = if n == 1 { 1.0 } else { -1.0 };
            [x, x * x, sign / g, 1.0 / g - 1.0]
        });
        chi = solve(rows);
        let error = |x: f64| leading(x) * (1.0 + chi[0] * x + chi[1] * x * x) - 1.0;
        let grid = |n: u32| x_end * f64::from(n) / f64::from(STEPS);
        // one extreme between zero crossings: left and right of the inner one's sign change, and the end
        let inner = (1..STEPS).map(grid).filter(|&x| x < at[1]).fold(at[0], |best, x| {
            if error(x).abs() > error(best).abs() && error(x).signum() == error(at[0]).signum() { x } else { best }
        });
        let middle = (1..STEPS).map(grid).fold(at[1], |best, x| {
            if error(x).abs() > error(best).abs() && error(x).signum() == error(at[1]).signum() { x } else { best }
        });
        at = [inner, middle, x_end];
        largest = (1..=STEPS).map(|n| error(grid(n)).abs()).fold(0.0, f64::max);
    }
    SlipSeries { chi_1: chi[0], chi_2: chi[1], error: largest }
}

/// The first two unknowns of three equations, `[a, b, c, right-hand side]` each, by Cramer's rule.
fn solve(rows: [[f64; 4]; 3]) -> [f64; 2] {
    let determinant = |i: usize, j: usize, k: usize| {
        let [p, q, r] = rows;
        p[i] * (q[j] * r[k] - q[k] * r[j]) - p[j] * (q[i] * r[k] - q[k] * r[i]) + p[k] * (q[i] * r[j] - q[j] * r[i])
    };
    let whole = determinant(0, 1, 2);
    [determinant(3, 1, 2) / whole, determinant(0, 3, 2) / whole]
}
