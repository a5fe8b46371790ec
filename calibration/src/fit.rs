//! The four constants of Eq. 19 from drag forces at known load.
//!
//! ```text
//! F = 4 Z_b Q (μ_c + μ_v H + μ_s e^(-k_s H)) [+ F_s]       Zhou 2023, Eq. 6 and 19; F_s: seals, where they are fitted too
//! ```
//!
//! μ_c, μ_v, μ_s and F_s enter linearly, k_s does not: χ² is looked through over all k_s that the Hersey numbers of the
//! data can show, then all constants are brought to the minimum together (Levenberg and Marquardt).

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use model_core::exact::Exact;
use model_core::friction::Friction;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use crate::cell::Cell;
use crate::noise::Noise;
use crate::separable::{self, Separable};

/// Fewer cells than this tell nothing about four constants and the scatter.
pub const LEAST_CELLS: usize = 12;

/// Places of ln k_s at which χ² is looked at.
const PLACES: usize = 60;

/// A constant counts as determined when its standard deviation is below this part of its value: its 95 % interval then
/// keeps well away from 0 and from twice the value.
pub const DETERMINED: f64 = 0.4;

/// Names of the constants, in the order of [`FrictionFit::values`].
pub const NAMES: [&str; 4] = ["mu_coulomb", "mu_viscous", "mu_stribeck", "stribeck_exponent"];

/// Whether a constant drag of the seals is fitted as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seals {
    /// The forces are free of it: measured, or there are none.
    TakenOff,
    /// It is a fifth constant.
    Fitted,
}

/// Why no law could be fitted. The text says what is missing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoFit {
    /// Too few cells.
    #[error("{0} strokes at known load and steady speed; four constants need at least {LEAST_CELLS}")]
    TooFew(usize),
    /// The columns of the law look alike on these cells.
    #[error(
        "the strokes do not determine the law: speeds and loads vary too little; measure over a wider range of speeds"
    )]
    Degenerate,
}

/// A fitted law.
#[derive(Clone, Debug)]
pub struct FrictionFit {
    /// The constants. Those that the data leave open may be negative.
    pub friction: Friction,
    /// Constant drag of the seals, N, where it was fitted.
    pub seal_drag_n: Option<f64>,
    /// Covariance of the constants in the order of [`NAMES`], then F_s.
    pub covariance: DMatrix<f64>,
    /// Scatter of the cells.
    pub noise: Noise,
    /// Σ (residual/σ)².
    pub chi2: f64,
    /// -2 ln(likelihood) but for a constant: what compares two laws on the same cells.
    pub deviance: f64,
    /// Measured less fitted, N, cell by cell.
    pub residuals_n: Vec<f64>,
    /// Standard deviations that were used, N.
    pub sigmas_n: Vec<f64>,
    pub(crate) problem: Grid,
}

impl FrictionFit {
    /// Fits the law of `model`'s geometry and convention to cells; `scale` turns cSt into the model's viscosity number.
    ///
    /// # Errors
    /// [`NoFit`].
    pub fn of(cells: &[Cell], model: &Exact, scale: f64, seals: Seals) -> Result<Self, NoFit> {
        if cells.len() < LEAST_CELLS {
            return Err(NoFit::TooFew(cells.len()));
        }
        let forces: Vec<f64> = cells.iter().map(|c| c.force_n).collect();
        let is_known = cells.iter().all(|c| c.sigma_n.is_finite() && c.sigma_n > 0.0);
        let mut noise = Noise { relative: 0.01, absolute_n: 0.0 };
        let mut problem = Grid::of(cells, model, scale, seals);
        let mut parameters = Vec::new();
        // the noise law and the constants in turn: two rounds settle it, the others cost little
        for _ in 0..6 {
            problem.sigmas =
                cells.iter().map(|c| if is_known { c.sigma_n } else { noise.sigma_n(c.force_n).max(1e-9) }).collect();
            parameters = problem.minimum()?;
            let residuals = problem.residuals_n(&parameters);
            noise = Noise::of(&residuals, &forces, parameters.len());
            if is_known {
                break;
            }
        }
        let residuals_n = problem.residuals_n(&parameters);
        let chi2 = residuals_n.iter().zip(&problem.sigmas).map(|(e, s)| (e / s) * (e / s)).sum();
        let deviance = chi2 + 2.0 * problem.sigmas.iter().map(|s| s.ln()).sum::<f64>();
        let jacobian = problem.jacobian(&parameters);
        let covariance = (jacobian.transpose() * &jacobian).try_inverse().ok_or(NoFit::Degenerate)?;
        Ok(FrictionFit {
            friction: Friction {
                mu_coulomb: parameters[0],
                mu_viscous: parameters[1],
                mu_stribeck: parameters[2],
                stribeck_exponent: parameters[3],
            },
            seal_drag_n: parameters.get(4).copied(),
            covariance,
            noise,
            chi2,
            deviance,
            residuals_n,
            sigmas_n: problem.sigmas.clone(),
            problem,
        })
    }

    /// The constants in the order of [`NAMES`].
    pub fn values(&self) -> [f64; 4] {
        let f = &self.friction;
        [f.mu_coulomb, f.mu_viscous, f.mu_stribeck, f.stribeck_exponent]
    }

    /// Standard deviation of a constant, in the order of [`NAMES`], then F_s.
    pub fn sigma(&self, n: usize) -> f64 {
        self.covariance[(n, n)].sqrt()
    }

    /// Whether the data determine a constant, in the order of [`NAMES`], to better than [`DETERMINED`].
    pub fn is_determined(&self, n: usize) -> bool {
        self.sigma(n) < DETERMINED * self.values()[n].abs()
    }

    /// Degrees of freedom that are left.
    pub fn freedom(&self) -> usize {
        self.residuals_n.len() - self.covariance.nrows()
    }
}

/// The problem: normal loads, Hersey numbers, forces.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    normal: Vec<f64>,
    hersey: Vec<f64>,
    forces: Vec<f64>,
    sigmas: Vec<f64>,
    /// Hersey numbers are counted in this unit, so that all columns are of one size.
    unit: f64,
    seals: Seals,
}

impl Grid {
    fn of(cells: &[Cell], model: &Exact, scale: f64, seals: Seals) -> Self {
        let hersey: Vec<f64> = cells.iter().map(|c| c.hersey(model, scale)).collect();
        let unit = hersey.iter().fold(0.0, |a: f64, h| a.max(*h)).max(1e-300);
        Grid {
            normal: cells.iter().map(|c| model.guide().loaded_balls() * c.load_per_ball_n).collect(),
            hersey: hersey.iter().map(|h| h / unit).collect(),
            forces: cells.iter().map(|c| c.force_n).collect(),
            sigmas: vec![1.0; cells.len()],
            unit,
            seals,
        }
    }

    /// ln k_s (in units of 1/`unit`) that these Hersey numbers can show: from a curve that has fallen by a fiftieth at
    /// the largest, to one that has fallen to nothing at the smallest.
    pub(crate) fn range(&self) -> (f64, f64) {
        let least = self.hersey.iter().copied().filter(|h| *h > 0.0).fold(1.0, f64::min);
        ((0.02f64).ln(), (5.0 / least).ln())
    }

    /// Unit in which Hersey numbers are counted here.
    pub(crate) fn unit(&self) -> f64 {
        self.unit
    }

    /// The constants in SI, F_s last.
    fn minimum(&self) -> Result<Vec<f64>, NoFit> {
        let (x, fit) = separable::least(self, self.range(), PLACES, None).ok_or(NoFit::Degenerate)?;
        let mut start = DVector::zeros(self.linear() + 1);
        start.rows_mut(0, 3).copy_from_slice(&fit.parameters[..3]);
        start[3] = x;
        if self.seals == Seals::Fitted {
            start[4] = fit.parameters[3];
        }
        // parameters scaled to one: the library judges steps against their size
        let scales = start.map(|p: f64| if p == 0.0 { 1.0 } else { p.abs() });
        let descent = Descent { grid: self, scales: scales.clone(), at: start.component_div(&scales) };
        let (end, _) = LevenbergMarquardt::new().with_ftol(1e-15).with_xtol(1e-14).with_gtol(1e-14).minimize(descent);
        let p = end.at.component_mul(&scales);
        let mut out = vec![p[0], p[1] / self.unit, p[2], p[3].exp() / self.unit];
        out.extend(p.iter().skip(4));
        if out.iter().all(|x| x.is_finite()) { Ok(out) } else { Err(NoFit::Degenerate) }
    }

    /// Measured less fitted, N.
    fn residuals_n(&self, p: &[f64]) -> Vec<f64> {
        let seal = p.get(4).copied().unwrap_or(0.0);
        let law = |h: f64| p[0] + p[1] * self.unit * h + p[2] * (-p[3] * self.unit * h).exp();
        (0..self.rows()).map(|n| self.forces[n] - self.normal[n] * law(self.hersey[n]) - seal).collect()
    }

    /// ∂(fitted/σ)/∂(constant in SI).
    fn jacobian(&self, p: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows(), p.len(), |n, j| {
            let (h, w) = (self.unit * self.hersey[n], self.normal[n] / self.sigmas[n]);
            let fallen = (-p[3] * h).exp();
            match j {
                0 => w,
                1 => w * h,
                2 => w * fallen,
                3 => -w * p[2] * h * fallen,
                _ => 1.0 / self.sigmas[n],
            }
        })
    }
}

impl Separable for Grid {
    fn linear(&self) -> usize {
        3 + usize::from(self.seals == Seals::Fitted)
    }

    fn rows(&self) -> usize {
        self.forces.len()
    }

    fn columns(&self, row: usize, ln_kappa: f64, out: &mut [f64]) {
        let (h, w) = (self.hersey[row], self.normal[row] / self.sigmas[row]);
        let all = [w, w * h, w * (-ln_kappa.exp() * h).exp(), 1.0 / self.sigmas[row]];
        out.copy_from_slice(&all[..out.len()]);
    }

    fn measured(&self, row: usize) -> f64 {
        self.forces[row] / self.sigmas[row]
    }
}

/// The last steps to the minimum, all constants together: μ_c, μ_v, μ_s, ln k_s, F_s in units of their start.
struct Descent<'a> {
    grid: &'a Grid,
    scales: DVector<f64>,
    at: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Descent<'_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.at.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let p = self.at.component_mul(&self.scales);
        let mut columns = vec![0.0; self.grid.linear()];
        Some(DVector::from_fn(self.grid.rows(), |n, _| {
            self.grid.columns(n, p[3], &mut columns);
            let seal = columns.get(3).map_or(0.0, |c| c * p[4]);
            columns[0] * p[0] + columns[1] * p[1] + columns[2] * p[2] + seal - self.grid.measured(n)
        }))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let p = self.at.component_mul(&self.scales);
        let kappa = p[3].exp();
        let mut columns = vec![0.0; self.grid.linear()];
        let mut out = DMatrix::zeros(self.grid.rows(), p.len());
        for n in 0..self.grid.rows() {
            self.grid.columns(n, p[3], &mut columns);
            out[(n, 0)] = columns[0];
            out[(n, 1)] = columns[1];
            out[(n, 2)] = columns[2];
            out[(n, 3)] = -p[2] * kappa * self.grid.hersey[n] * columns[2];
            if let Some(seal) = columns.get(3) {
                out[(n, 4)] = *seal;
            }
        }
        for (mut column, scale) in out.column_iter_mut().zip(self.scales.iter()) {
            column *= *scale;
        }
        Some(out)
    }
}
