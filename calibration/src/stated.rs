//! A friction law from statements about friction coefficients: "0.00166 at 500 N and 0.6 m/min", "as large at 2 as at 6
//! m/min". Statements in a text about measurements that it does not print can be tested against such a law.
//!
//! ```text
//! μ(Q, V) = μ_c + μ_v H + μ_s e^(-k_s H) + F_x(Q, V)/(4 Z_b Q)         all constants above 0, F_x: an additional drag
//! ```
//!
//! Residuals are differences of ln μ, divided by the tolerance of the statement.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use model_core::exact::Exact;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// A working point: load per ball, N, and speed, m/s.
pub type Point = (f64, f64);

/// A statement about friction coefficients. The tolerance is that of ln μ, 1 σ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Statement {
    /// The friction coefficient at a point.
    Value(Point, f64, f64),
    /// It is the same at two points.
    Equal(Point, Point, f64),
    /// It is larger at the first point than at the second, by at least this ratio.
    Above(Point, Point, f64, f64),
}

/// A drag in addition to Eq. 19, N, for an amplitude of 1.
pub type Beyond<'a> = &'a dyn Fn(Point) -> f64;

/// The law that fits best.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Σ (residual/tolerance)².
    pub chi2: f64,
    /// Statements less constants.
    pub freedom: usize,
    /// p-value of χ² if the law holds.
    pub p_value: f64,
    /// Amplitude of the drag beside Eq. 19; 0 without one.
    pub amplitude: f64,
    /// Residuals over the tolerance, in the order of the statements.
    pub residuals: Vec<f64>,
}

/// Starts of ln(k_s H) at the middle of the points, and of the share of the additional drag.
const STARTS: [f64; 9] = [-3.0, -2.0, -1.0, 0.0, 0.7, 1.4, 2.1, 3.0, 4.0];
const SHARES: [f64; 3] = [0.02, 0.2, 0.7];

/// Fits Eq. 19 with `model`'s geometry and convention, at viscosity number `viscosity`, with an optional additional
/// drag.
///
/// `None` unless there are more statements than constants.
pub fn fit(statements: &[Statement], model: &Exact, viscosity: f64, beyond: Option<Beyond<'_>>) -> Option<Fitted> {
    let constants = 4 + usize::from(beyond.is_some());
    let freedom = statements.len().checked_sub(constants).filter(|f| *f > 0)?;
    let points: Vec<Point> = statements
        .iter()
        .flat_map(|s| match *s {
            Statement::Value(a, ..) => vec![a],
            Statement::Equal(a, b, _) | Statement::Above(a, b, ..) => vec![a, b],
        })
        .collect();
    let hersey = |p: Point| model.hersey(p.0, viscosity, p.1);
    let middle = (points.iter().map(|p| hersey(*p).ln()).sum::<f64>() / points.len() as f64).exp();
    let level = statements
        .iter()
        .find_map(|s| if let Statement::Value(_, mu, _) = s { Some(*mu) } else { None })
        .unwrap_or(2e-3);
    let drag = points.iter().map(|p| model.guide().loaded_balls() * p.0 * level).sum::<f64>() / points.len() as f64;
    let size = beyond.map_or(1.0, |f| points.iter().map(|p| f(*p)).sum::<f64>() / points.len() as f64);
    let shares: &[f64] = if beyond.is_some() { &SHARES } else { &[0.0] };
    let mut best: Option<Statements<'_>> = None;
    for start in STARTS {
        for share in shares {
            let mut at = vec![0.6 * level, 0.1 * level / middle, 0.3 * level, start.exp() / middle];
            if beyond.is_some() {
                at.push(share * drag / size);
            }
            // logarithms: every constant stays above 0
            let at = DVector::from_iterator(at.len(), at.iter().map(|x| x.ln()));
            let problem = Statements { all: statements, model, viscosity, beyond, at };
            let (end, _) = LevenbergMarquardt::new().with_patience(60).minimize(problem);
            let is_better = |best: &Statements<'_>| end.chi2() < best.chi2();
            if end.chi2().is_finite() && best.as_ref().is_none_or(is_better) {
                best = Some(end);
            }
        }
    }
    let best = best?;
    let chi2 = best.chi2();
    Some(Fitted {
        chi2,
        freedom,
        p_value: ChiSquared::new(freedom as f64).ok()?.sf(chi2),
        amplitude: best.at.get(4).map_or(0.0, |x| x.exp()),
        residuals: best.misses().as_slice().to_vec(),
    })
}

/// The problem; `at` are the logarithms of the constants.
struct Statements<'a> {
    all: &'a [Statement],
    model: &'a Exact,
    viscosity: f64,
    beyond: Option<Beyond<'a>>,
    at: DVector<f64>,
}

impl Statements<'_> {
    fn ln_mu(&self, p: Point, at: &DVector<f64>) -> f64 {
        let c = at.map(f64::exp);
        let h = self.model.hersey(p.0, self.viscosity, p.1);
        let more = self.beyond.map_or(0.0, |f| c[4] * f(p) / (self.model.guide().loaded_balls() * p.0));
        (c[0] + c[1] * h + c[2] * (-c[3] * h).exp() + more).ln()
    }

    fn misses_at(&self, at: &DVector<f64>) -> DVector<f64> {
        let miss = |s: &Statement| match *s {
            Statement::Value(p, mu, tolerance) => (self.ln_mu(p, at) - mu.ln()) / tolerance,
            Statement::Equal(a, b, tolerance) => (self.ln_mu(a, at) - self.ln_mu(b, at)) / tolerance,
            Statement::Above(a, b, ratio, tolerance) => {
                ((self.ln_mu(a, at) - self.ln_mu(b, at) - ratio.ln()) / tolerance).min(0.0)
            }
        };
        DVector::from_iterator(self.all.len(), self.all.iter().map(miss))
    }

    fn misses(&self) -> DVector<f64> {
        self.misses_at(&self.at)
    }

    fn chi2(&self) -> f64 {
        self.misses().norm_squared()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Statements<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        // beyond e^±60 a constant has no effect, or dominates
        self.at = x.map(|x| x.clamp(-60.0, 60.0));
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.misses()).filter(|r| r.iter().all(|x| x.is_finite()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        const STEP: f64 = 1e-5;
        let mut out = DMatrix::zeros(self.all.len(), self.at.len());
        for j in 0..self.at.len() {
            let (mut above, mut below) = (self.at.clone(), self.at.clone());
            above[j] += STEP;
            below[j] -= STEP;
            let slope = (self.misses_at(&above) - self.misses_at(&below)) / (2.0 * STEP);
            out.set_column(j, &slope);
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use model_core::reference::zhou_2023::{FRICTION, GUIDE};

    use super::*;

    fn points() -> Vec<Point> {
        let loads = [30.0, 100.0, 250.0, 480.0];
        loads.iter().flat_map(|q| [0.002, 0.01, 0.03, 0.1].map(|v| (*q, v))).collect()
    }

    #[test]
    fn a_law_s_own_values_fit_it() {
        let model = Exact::new(GUIDE, FRICTION);
        let mu = |p: Point| FRICTION.coefficient(model.hersey(p.0, 100.0, p.1));
        let statements: Vec<Statement> = points().iter().map(|p| Statement::Value(*p, mu(*p), 0.02)).collect();
        let found = fit(&statements, &model, 100.0, None).unwrap();
        assert!(found.chi2 < 1e-6 && found.p_value > 0.99, "{found:?}");
        assert_eq!(found.freedom, 12);
        assert_eq!(fit(&statements[..4], &model, 100.0, None), None);
    }

    #[test]
    fn a_seal_in_the_values_is_asked_for_and_found() {
        let model = Exact::new(GUIDE, FRICTION);
        let normal = |p: Point| model.guide().loaded_balls() * p.0;
        let mu = |p: Point| FRICTION.coefficient(model.hersey(p.0, 100.0, p.1)) + 1.5 / normal(p);
        let statements: Vec<Statement> = points().iter().map(|p| Statement::Value(*p, mu(*p), 0.02)).collect();
        let without = fit(&statements, &model, 100.0, None).unwrap();
        let with = fit(&statements, &model, 100.0, Some(&|_| 1.0)).unwrap();
        assert!(without.p_value < 1e-6, "{without:?}");
        assert!(with.p_value > 0.99 && (with.amplitude - 1.5).abs() < 0.01, "{with:?}");
    }
}
