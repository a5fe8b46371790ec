//! Least squares in which all but one parameter enter linearly.
//!
//! ```text
//! y_i = Σ_j β_j c_ij(κ) + ε_i,   ε_i of standard deviation σ_i
//! ```
//!
//! For every κ the β follow from a linear fit, so that χ²(κ) is a curve: it is scanned as a whole, and no start value
//! decides which of its minima is found (variable projection, Golub and Pereyra 1973).

/// A problem of that kind. All rows are already divided by their standard deviation.
pub(crate) trait Separable {
    /// Number of linear parameters.
    fn linear(&self) -> usize;
    /// Number of rows.
    fn rows(&self) -> usize;
    /// Writes the columns of a row.
    fn columns(&self, row: usize, ln_kappa: f64, out: &mut [f64]);
    /// The measured value of a row.
    fn measured(&self, row: usize) -> f64;
}

/// The best linear parameters at one κ.
#[derive(Clone, Debug)]
pub(crate) struct LinearFit {
    pub(crate) parameters: Vec<f64>,
    pub(crate) chi2: f64,
}

/// Most linear parameters.
const MOST: usize = 5;

/// Pivot, for columns scaled to unit length, below which they count as collinear.
const SAME: f64 = 1e-13;

/// Solves the linear part, with one linear parameter optionally held. `None` where the columns do not determine it.
///
/// By the normal equations of columns of unit length: accurate to 1e-9, enough for the search over κ; the joint descent
/// of all parameters gives the last digits.
pub(crate) fn linear(problem: &impl Separable, ln_kappa: f64, held: Option<(usize, f64)>) -> Option<LinearFit> {
    let all = problem.linear().min(MOST);
    let mut gram = [[0.0; MOST]; MOST];
    let mut right = [0.0; MOST];
    let mut square = 0.0;
    let mut row = [0.0; MOST];
    for n in 0..problem.rows() {
        let columns = &mut row[..all];
        problem.columns(n, ln_kappa, columns);
        let mut target = problem.measured(n);
        if let Some((j, value)) = held {
            target -= value * columns[j];
            columns[j] = 0.0;
        }
        square += target * target;
        for a in 0..all {
            right[a] += columns[a] * target;
            for b in 0..=a {
                gram[a][b] += columns[a] * columns[b];
            }
        }
    }
    let mut length = [1.0; MOST];
    for a in 0..all {
        let is_held = held.is_some_and(|(j, _)| j == a);
        match gram[a][a] {
            _ if is_held => gram[a][a] = 1.0,
            g if g > 0.0 && g.is_finite() => length[a] = g.sqrt(),
            _ => return None,
        }
    }
    // Cholesky's factor in place, then forward and back
    let mut x = [0.0; MOST];
    for a in 0..all {
        for b in 0..=a {
            let known: f64 = gram[a].iter().zip(&gram[b]).take(b).map(|(l, m)| l * m).sum();
            let sum = gram[a][b] / (length[a] * length[b]) - known;
            if a == b {
                if sum < SAME {
                    return None;
                }
                gram[a][a] = sum.sqrt();
            } else {
                gram[a][b] = sum / gram[b][b];
            }
        }
        let known: f64 = (0..a).map(|k| gram[a][k] * x[k]).sum();
        x[a] = (right[a] / length[a] - known) / gram[a][a];
    }
    let explained: f64 = x[..all].iter().map(|v| v * v).sum();
    for a in (0..all).rev() {
        let known: f64 = (a + 1..all).map(|k| gram[k][a] * x[k]).sum();
        x[a] = (x[a] - known) / gram[a][a];
    }
    let mut parameters: Vec<f64> = x[..all].iter().zip(length).map(|(v, l)| v / l).collect();
    if let Some((j, value)) = held {
        parameters[j] = value;
    }
    Some(LinearFit { parameters, chi2: (square - explained).max(0.0) })
}

/// The ln κ of least χ² between two limits, and the fit there.
///
/// Evaluates `places` evenly spaced points, then refines around the best one by golden section.
pub(crate) fn least(
    problem: &impl Separable,
    range: (f64, f64),
    places: usize,
    held: Option<(usize, f64)>,
) -> Option<(f64, LinearFit)> {
    let step = (range.1 - range.0) / (places - 1) as f64;
    let chi2 = |x: f64| linear(problem, x, held).map_or(f64::INFINITY, |fit| fit.chi2);
    let best = (0..places)
        .map(|n| range.0 + n as f64 * step)
        .map(|x| (x, chi2(x)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|best| best.1.is_finite())?;
    let x = golden((best.0 - step).max(range.0), (best.0 + step).min(range.1), 1e-7, chi2);
    let x = if chi2(x) <= best.1 { x } else { best.0 };
    linear(problem, x, held).map(|fit| (x, fit))
}

/// Golden section: the minimum of a function with a single minimum, to within `width`.
pub(crate) fn golden(mut from: f64, mut to: f64, width: f64, f: impl Fn(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (to - SHARE * (to - from), from + SHARE * (to - from));
    let (mut fa, mut fb) = (f(a), f(b));
    while to - from > width {
        if fa <= fb {
            (to, b, fb) = (b, a, fa);
            a = to - SHARE * (to - from);
            fa = f(a);
        } else {
            (from, a, fa) = (a, b, fb);
            b = from + SHARE * (to - from);
            fb = f(b);
        }
    }
    if fa <= fb { a } else { b }
}
