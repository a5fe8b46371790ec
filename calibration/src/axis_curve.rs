//! Friction of any axis over speed, without a load: Coulomb, viscous, and whether there is a Stribeck term.
//!
//! ```text
//! F = d (C + v |V| + S e^(-|V|/V_s)) + F_0 + v_0 |V|        d: sign of V; F_0, v_0: difference of the directions
//! ```
//!
//! The terms are chosen by cross-validation: one speed at a time is left out, in both directions, and its force
//! predicted from all others. A term that only follows the noise makes the prediction worse. A longer law is taken
//! where its squared errors are smaller by more than the standard error of the difference.

use nalgebra::{DMatrix, DVector};

use crate::levels::levels;
use crate::separable::{self, Separable};

/// Grid points of ln V_s.
const PLACES: usize = 60;

/// Fewest speeds that can distinguish a Stribeck term from two other terms.
pub const LEAST_SPEEDS: usize = 6;

/// A mean force at constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Velocity, signed, not 0; m/s, or rad/s where forces are torques.
    pub velocity: f64,
    /// Force of the drive, with the sign that it was measured with; N, or N m.
    pub force: f64,
}

/// Optional terms of a law, beside Coulomb and viscous friction and the constant difference of the directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Viscous friction differs between the directions.
    pub viscous_asymmetry: bool,
    /// Stribeck term.
    pub stribeck: bool,
}

impl Terms {
    /// All laws that compete, the simplest first.
    pub const ALL: [Terms; 4] = [
        Terms { viscous_asymmetry: false, stribeck: false },
        Terms { viscous_asymmetry: true, stribeck: false },
        Terms { viscous_asymmetry: false, stribeck: true },
        Terms { viscous_asymmetry: true, stribeck: true },
    ];

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match (self.viscous_asymmetry, self.stribeck) {
            (false, false) => "Coulomb and viscous",
            (true, false) => "Coulomb and viscous by direction",
            (false, true) => "with a Stribeck term",
            (true, true) => "viscous by direction, with a Stribeck term",
        }
    }
}

/// A number with its standard deviation.
pub type Measured = (f64, f64);

/// A fitted law. In the units of the points.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisCurve {
    /// Which terms it has.
    pub terms: Terms,
    /// C.
    pub coulomb: Measured,
    /// v.
    pub viscous: Measured,
    /// F_0; `None` where only one direction was measured.
    pub offset: Option<Measured>,
    /// v_0.
    pub viscous_asymmetry: Option<Measured>,
    /// S.
    pub stribeck: Option<Measured>,
    /// V_s.
    pub stribeck_speed: Option<Measured>,
    /// RMS residual.
    pub rms: f64,
}

impl AxisCurve {
    /// Force at a velocity.
    pub fn force(&self, velocity: f64) -> f64 {
        let (d, a) = (velocity.signum(), velocity.abs());
        let value = |m: Option<Measured>| m.map_or(0.0, |m| m.0);
        let fallen = self.stribeck_speed.map_or(0.0, |v| (-a / v.0).exp());
        d * (self.coulomb.0 + self.viscous.0 * a + value(self.stribeck) * fallen)
            + value(self.offset)
            + value(self.viscous_asymmetry) * a
    }
}

/// Prediction error of a law at speeds left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The law.
    pub terms: Terms,
    /// RMS error at the speeds left out; NaN where the others do not determine the law.
    pub error: f64,
    squares: Vec<f64>,
}

/// Result of the selection.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// The law that the speeds support.
    pub curve: AxisCurve,
    /// All that competed, in the order of [`Terms::ALL`].
    pub trials: Vec<Trial>,
    /// Whether a Stribeck term is supported.
    pub supports_stribeck: bool,
    /// Number of speeds, both directions counted once.
    pub speeds: usize,
}

/// Why no law could be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoCurve {
    /// Too few speeds.
    #[error("{0} speeds; at least {LEAST_SPEEDS} are needed to tell a Stribeck term from viscous friction")]
    TooFew(usize),
    /// The speeds do not determine even the simplest law.
    #[error("the speeds do not determine Coulomb and viscous friction; measure over a wider range")]
    Degenerate,
}

/// Chooses and fits a law.
///
/// # Errors
/// [`NoCurve`].
pub fn select(points: &[Point]) -> Result<Selection, NoCurve> {
    let speeds: Vec<f64> = points.iter().map(|p| p.velocity.abs()).collect();
    let (level, means) = levels(&speeds);
    if means.len() < LEAST_SPEEDS {
        return Err(NoCurve::TooFew(means.len()));
    }
    let trials: Vec<Trial> = Terms::ALL.iter().map(|terms| trial(points, &level, means.len(), *terms)).collect();
    let simpler = |stribeck: bool| -> &Trial {
        let (plain, longer) = if stribeck { (&trials[2], &trials[3]) } else { (&trials[0], &trials[1]) };
        if is_better(longer, plain) { longer } else { plain }
    };
    let supports_stribeck = is_better(simpler(true), simpler(false));
    let terms = simpler(supports_stribeck).terms;
    let curve = fit(points, terms).ok_or(NoCurve::Degenerate)?;
    Ok(Selection { curve, trials, supports_stribeck, speeds: means.len() })
}

/// Whether a law's squared errors are smaller by more than the standard error of the difference.
fn is_better(longer: &Trial, shorter: &Trial) -> bool {
    let gains: Vec<f64> = shorter.squares.iter().zip(&longer.squares).map(|(s, l)| s - l).collect();
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let variance = gains.iter().map(|g| (g - mean) * (g - mean)).sum::<f64>() / (n - 1.0);
    mean > (variance / n).sqrt()
}

/// Cross-validation: leaves out one speed at a time.
fn trial(points: &[Point], level: &[usize], levels: usize, terms: Terms) -> Trial {
    let (mut squares, mut sum) = (Vec::with_capacity(levels), 0.0);
    for left_out in 0..levels {
        let rest: Vec<Point> = points.iter().zip(level).filter(|(_, l)| **l != left_out).map(|(p, _)| *p).collect();
        let curve = fit(&rest, terms);
        let mut square = 0.0;
        for (point, _) in points.iter().zip(level).filter(|(_, l)| **l == left_out) {
            let error = curve.as_ref().map_or(f64::NAN, |c| c.force(point.velocity) - point.force);
            square += error * error;
        }
        sum += square;
        squares.push(square);
    }
    Trial { terms, error: (sum / points.len() as f64).sqrt(), squares }
}

/// Fits one law. `None` where the points do not determine it.
pub fn fit(points: &[Point], terms: Terms) -> Option<AxisCurve> {
    let both = points.iter().any(|p| p.velocity > 0.0) && points.iter().any(|p| p.velocity < 0.0);
    let top = points.iter().fold(0.0, |m: f64, p| m.max(p.velocity.abs()));
    let size = points.iter().fold(0.0, |m: f64, p| m.max(p.force.abs()));
    if !(top > 0.0 && size > 0.0) {
        return None;
    }
    let problem = Problem { points, terms, both, top, size };
    let least = points.iter().fold(1.0, |m: f64, p| m.min(p.velocity.abs() / top));
    let (ln_kappa, found) = if terms.stribeck {
        // from a V_s of half the highest speed, which viscous friction cannot imitate, to one that only the lowest
        // shows
        separable::least(&problem, ((2.0f64).ln(), (2.0 / least).ln()), PLACES, None)?
    } else {
        (0.0, separable::linear(&problem, 0.0, None)?)
    };
    let (sigmas, rms) = uncertainty(&problem, ln_kappa, &found.parameters)?;
    let mut next = found.parameters.iter().copied().zip(sigmas.iter().copied());
    let mut take = |scale: f64| next.next().map(|(x, s)| (x * scale, s * scale));
    let (coulomb, viscous) = (take(size)?, take(size / top)?);
    let offset = if both { take(size) } else { None };
    let viscous_asymmetry = if both && terms.viscous_asymmetry { take(size / top) } else { None };
    let stribeck = if terms.stribeck { take(size) } else { None };
    let stribeck_speed = terms.stribeck.then(|| {
        let speed = top / ln_kappa.exp();
        (speed, speed * sigmas.last().copied().unwrap_or(f64::NAN))
    });
    Some(AxisCurve { terms, coulomb, viscous, offset, viscous_asymmetry, stribeck, stribeck_speed, rms: rms * size })
}

/// Standard deviations of the linear parameters, then of ln V_s, in the problem's units; and the RMS residual.
fn uncertainty(problem: &Problem<'_>, ln_kappa: f64, parameters: &[f64]) -> Option<(Vec<f64>, f64)> {
    let (rows, linear) = (problem.rows(), problem.linear());
    let all = linear + usize::from(problem.terms.stribeck);
    let mut columns = vec![0.0; linear];
    let mut jacobian = DMatrix::zeros(rows, all);
    let mut rest = DVector::zeros(rows);
    for n in 0..rows {
        problem.columns(n, ln_kappa, &mut columns);
        let fitted: f64 = columns.iter().zip(parameters).map(|(c, p)| c * p).sum();
        rest[n] = problem.measured(n) - fitted;
        for (j, c) in columns.iter().enumerate() {
            jacobian[(n, j)] = *c;
        }
        if problem.terms.stribeck {
            // ∂/∂ln V_s of S e^(-κ a) is S κ a e^(-κ a)
            let a = problem.points[n].velocity.abs() / problem.top;
            jacobian[(n, linear)] = parameters[linear - 1] * ln_kappa.exp() * a * columns[linear - 1];
        }
    }
    let freedom = rows.checked_sub(all).filter(|f| *f > 0)? as f64;
    let square = rest.norm_squared();
    let inverse = (jacobian.transpose() * &jacobian).try_inverse()?;
    let sigmas = (0..all).map(|n| (inverse[(n, n)] * square / freedom).sqrt()).collect();
    Some((sigmas, (square / rows as f64).sqrt()))
}

/// Speeds in units of the highest, forces in units of the largest.
struct Problem<'a> {
    points: &'a [Point],
    terms: Terms,
    both: bool,
    top: f64,
    size: f64,
}

impl Separable for Problem<'_> {
    fn linear(&self) -> usize {
        2 + usize::from(self.both) * (1 + usize::from(self.terms.viscous_asymmetry)) + usize::from(self.terms.stribeck)
    }

    fn rows(&self) -> usize {
        self.points.len()
    }

    fn columns(&self, row: usize, ln_kappa: f64, out: &mut [f64]) {
        let v = self.points[row].velocity / self.top;
        let (d, a) = (v.signum(), v.abs());
        let mut next = out.iter_mut();
        let mut put = |x: f64| next.next().map_or((), |place| *place = x);
        put(d);
        put(v);
        if self.both {
            put(1.0);
            if self.terms.viscous_asymmetry {
                put(a);
            }
        }
        if self.terms.stribeck {
            put(d * (-ln_kappa.exp() * a).exp());
        }
    }

    fn measured(&self, row: usize) -> f64 {
        self.points[row].force / self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(law: impl Fn(f64) -> f64, noise: f64) -> Vec<Point> {
        let speeds = (1..=16).map(|n| 0.5 * 1.26f64.powi(n));
        let noise = |n: usize| noise * (((n as f64 + 1.0) * 0.618_034).fract() - 0.5) * 3.46;
        speeds
            .flat_map(|a| [a, -a])
            .enumerate()
            .map(|(n, velocity)| Point { velocity, force: law(velocity) + noise(n) })
            .collect()
    }

    #[test]
    fn a_stribeck_term_comes_back() {
        let law = |v: f64| v.signum() * (3.0 + 0.05 * v.abs() + 1.2 * (-v.abs() / 2.5).exp()) - 0.4;
        let found = select(&points(law, 0.01)).unwrap();
        assert!(found.supports_stribeck);
        let curve = found.curve;
        for (got, truth) in [
            (curve.coulomb, 3.0),
            (curve.viscous, 0.05),
            (curve.offset.unwrap(), -0.4),
            (curve.stribeck.unwrap(), 1.2),
            (curve.stribeck_speed.unwrap(), 2.5),
        ] {
            assert!((got.0 - truth).abs() < 4.0 * got.1 && got.1 < 0.1 * truth.abs(), "{got:?} {truth}");
        }
    }

    #[test]
    fn noise_is_no_stribeck_term() {
        let found = select(&points(|v| v.signum() * 3.0 + 0.05 * v, 0.05)).unwrap();
        assert!(!found.supports_stribeck);
        assert_eq!(found.curve.stribeck, None);
    }

    #[test]
    fn one_direction_has_no_difference_of_directions() {
        let one: Vec<Point> =
            points(|v| v.signum() * 3.0 + 0.05 * v, 0.01).into_iter().filter(|p| p.velocity > 0.0).collect();
        let found = select(&one).unwrap();
        assert_eq!(found.curve.offset, None);
        assert!((found.curve.coulomb.0 - 3.0).abs() < 0.05);
        assert_eq!(select(&one[..3]), Err(NoCurve::TooFew(3)));
    }
}
