//! Values and slopes of a curve that bends slowly, from values of which some are hardly known.
//!
//! Value `y` and slope `g` follow a random walk of the slope, with the intensity `q` (Wahba 1978: a cubic smoothing
//! spline):
//!
//! ```text
//! (y, g) → (y + g dx, g),   covariance of the step: q (dx³/3, dx²/2; dx²/2, dx)
//! ```
//!
//! A Kalman filter runs there and a smoother (Rauch, Tung and Striebel 1965) back. How much the curve bends and how far
//! its values scatter beyond what is known of each is what makes the values likeliest.

/// A value of a curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Variance of `y`.
    pub(super) variance: f64,
}

/// Bends that are tried: intensity of the slope's random walk, relative to the mean square of the values.
const BENDS: [f64; 5] = [1e-3, 3e-3, 1e-2, 3e-2, 1e-1];

/// Scatters that are tried: variance of a value beyond its own, relative to the mean square of the values.
const SCATTERS: [f64; 6] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4];

/// Value and slope of the curve at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Smooth {
    pub(super) y: f64,
    pub(super) slope: f64,
}

/// The curve at every point, in order of x. In front of the first one it is taken as flat as it is a unit of x before
/// it.
pub(super) fn smooth(points: &[Point]) -> Vec<Smooth> {
    let square = points.iter().map(|point| point.y * point.y).sum::<f64>() / points.len().max(1) as f64;
    if square == 0.0 || !square.is_finite() {
        return vec![Smooth::default(); points.len()];
    }
    let tried = SCATTERS
        .iter()
        .flat_map(|scatter| BENDS.iter().map(move |bend| Walk { bend: bend * square, scatter: scatter * square }));
    let likeliest = tried.map(|walk| (walk.filtered(points), walk)).max_by(|a, b| a.0.nats.total_cmp(&b.0.nats));
    likeliest.map_or_else(Vec::new, |(filtered, walk)| walk.smoothed(points, &filtered.states))
}

/// Expected value and slope, and their covariance.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    y: f64,
    g: f64,
    yy: f64,
    yg: f64,
    gg: f64,
}

impl State {
    /// After a step of x.
    fn predicted(self, dx: f64, q: f64) -> Self {
        let State { y, g, yy, yg, gg } = self;
        State {
            y: y + g * dx,
            g,
            yy: yy + dx * (2.0 * yg + dx * gg) + q * dx * dx * dx / 3.0,
            yg: yg + dx * gg + q * dx * dx / 2.0,
            gg: gg + q * dx,
        }
    }
}

struct Filtered {
    states: Vec<State>,
    /// Logarithm of the likelihood of the values.
    nats: f64,
}

#[derive(Clone, Copy)]
struct Walk {
    bend: f64,
    scatter: f64,
}

impl Walk {
    fn filtered(self, points: &[Point]) -> Filtered {
        let mut states: Vec<State> = Vec::with_capacity(points.len());
        let mut nats = 0.0;
        for (n, point) in points.iter().enumerate() {
            let own = point.variance + self.scatter;
            let state = match states.last() {
                None => State { y: point.y, g: 0.0, yy: own, yg: 0.0, gg: self.bend },
                Some(before) => {
                    let state = before.predicted(point.x - points[n - 1].x, self.bend);
                    let (miss, variance) = (point.y - state.y, state.yy + own);
                    nats -= 0.5 * (variance.ln() + miss * miss / variance);
                    let (of_y, of_g) = (state.yy / variance, state.yg / variance);
                    State {
                        y: state.y + of_y * miss,
                        g: state.g + of_g * miss,
                        yy: state.yy - of_y * state.yy,
                        yg: state.yg - of_y * state.yg,
                        gg: state.gg - of_g * state.yg,
                    }
                }
            };
            states.push(state);
        }
        Filtered { states, nats }
    }

    /// What all values tell, given what those in front of each tell.
    fn smoothed(self, points: &[Point], states: &[State]) -> Vec<Smooth> {
        let Some(mut after) = states.last().copied() else { return Vec::new() };
        let of = |state: State| Smooth { y: state.y, slope: state.g };
        let mut found = vec![of(after); states.len()];
        for n in (0..states.len() - 1).rev() {
            let (here, dx) = (states[n], points[n + 1].x - points[n].x);
            let next = here.predicted(dx, self.bend);
            let determinant = next.yy * next.gg - next.yg * next.yg;
            // row of the gain: covariance of a component here with the next state, times the inverse of the latter's
            let gain = |with_y: f64, with_g: f64| {
                (
                    (with_y * next.gg - with_g * next.yg) / determinant,
                    (with_g * next.yy - with_y * next.yg) / determinant,
                )
            };
            let (of_y, of_g) = (gain(here.yy + dx * here.yg, here.yg), gain(here.yg + dx * here.gg, here.gg));
            let (y, g) = (after.y - next.y, after.g - next.g);
            after = State { y: here.y + of_y.0 * y + of_y.1 * g, g: here.g + of_g.0 * y + of_g.1 * g, ..here };
            found[n] = of(after);
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Stribeck curve over ln V.
    fn points(scatter: f64, doubtful: impl Fn(usize) -> bool) -> (Vec<Point>, Vec<f64>) {
        let of = |n: usize| {
            let x = 0.05 * n as f64;
            let (bump, noise) =
                ((-(x - 2.0) * (x - 2.0)).exp(), (43_758.545_3 * (12.9898 * n as f64).sin()).rem_euclid(1.0) - 0.5);
            let off = if doubtful(n) { 3.0 } else { 0.0 };
            let point = Point { x, y: 10.0 - 2.0 * bump + scatter * noise + off, variance: off * off };
            (point, 4.0 * (x - 2.0) * bump)
        };
        (0..80).map(of).unzip()
    }

    fn worst(points: &[Point], exact: &[f64]) -> f64 {
        smooth(points).iter().zip(exact).map(|(found, exact)| (found.slope - exact).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn slopes_of_a_curve_known_exactly() {
        let (points, exact) = points(0.0, |_| false);
        assert!(worst(&points, &exact) < 0.02, "{}", worst(&points, &exact));
    }

    #[test]
    fn values_that_are_hardly_known_hardly_count() {
        let (points, exact) = points(0.01, |n| n % 3 == 0);
        assert!(worst(&points, &exact) < 0.25, "{}", worst(&points, &exact));
        let values = smooth(&points);
        let off = |n: usize| (values[n].y - points[n - n % 3 + 1].y).abs();
        assert!((0..78).map(off).fold(0.0, f64::max) < 0.15, "a value that is off by 3 is not followed");
    }

    #[test]
    fn nothing_and_zeros_have_no_slope() {
        assert!(smooth(&[]).is_empty());
        let zero = Point { x: 1.0, y: 0.0, variance: 0.0 };
        assert_eq!(smooth(&[zero]), [Smooth::default()]);
        assert_eq!(smooth(&[zero, Point { x: 2.0, ..zero }]), [Smooth::default(); 2]);
        assert_eq!(smooth(&[Point { y: 5.0, ..zero }]), [Smooth { y: 5.0, slope: 0.0 }]);
    }
}
