//! The four constants of Eq. 19 from drag forces at known load.
//!
//! ```text
//! F = 4 Z_b Q (μ_c + μ_v H + μ_s e^(-k_s H)) [+ F_s [+ f_s V]]       Zhou 2023, Eq. 6 and 19; F_s, f_s: seals
//! ```
//!
//! Strokes without load, or without seals, determine the seal drag; it is fitted jointly, so that its uncertainty is
//! included in that of the constants. All but k_s enter linearly: χ² is scanned over all k_s that the data's Hersey
//! numbers can show, then all constants are refined jointly (Levenberg and Marquardt).

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use model_core::exact::Exact;
use model_core::friction::Friction;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use crate::cell::Cell;
use crate::noise::Noise;
use crate::separable::{self, Separable};

/// Fewest cells that determine four constants and the scatter.
pub const LEAST_CELLS: usize = 12;

/// Grid points of ln k_s at which χ² is evaluated.
const PLACES: usize = 60;

/// Relative standard deviation below which a constant counts as determined: its 95 % interval is then well away from 0
/// and from twice the value.
pub const DETERMINED: f64 = 0.4;

/// Names of the constants, in the order of [`FrictionFit::values`].
pub const NAMES: [&str; 4] = ["mu_coulomb", "mu_viscous", "mu_stribeck", "stribeck_exponent"];

/// Seal drag that is fitted jointly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seals {
    /// None: the forces are free of it.
    TakenOff,
    /// A constant.
    Constant,
    /// A constant and a part that grows with speed.
    WithSpeed,
}

impl Seals {
    const fn columns(self) -> usize {
        match self {
            Seals::TakenOff => 0,
            Seals::Constant => 1,
            Seals::WithSpeed => 2,
        }
    }
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
    /// The constants. Those that the data do not determine may be negative.
    pub friction: Friction,
    /// Constant drag of the seals, N, where it was fitted.
    pub seal_drag_n: Option<f64>,
    /// Drag of the seals that grows with speed, N s/m, where it was fitted.
    pub seal_viscous_n_s_m: Option<f64>,
    /// Covariance of the constants in the order of [`NAMES`], then the seals'.
    pub covariance: DMatrix<f64>,
    /// Noise law of the cells.
    pub noise: Noise,
    /// Σ (residual/σ)².
    pub chi2: f64,
    /// -2 ln(likelihood) up to a constant: for comparing two laws on the same cells.
    pub deviance: f64,
    /// Measured less fitted, N, cell by cell.
    pub residuals_n: Vec<f64>,
    /// Standard deviations that were used, N.
    pub sigmas_n: Vec<f64>,
    pub(crate) problem: Grid,
}

impl FrictionFit {
    /// Fits the law with `model`'s geometry and convention to cells; `scale` converts cSt to the model's viscosity
    /// number.
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
        // noise law and constants alternately: two rounds suffice, the others cost little
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
            seal_viscous_n_s_m: parameters.get(5).copied(),
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

    /// Standard deviation of a constant, in the order of [`NAMES`], then the seals'.
    pub fn sigma(&self, n: usize) -> f64 {
        self.covariance[(n, n)].sqrt()
    }

    /// A constant in the order of [`NAMES`], then the seals'; NaN for one that was not fitted.
    pub fn constant(&self, n: usize) -> f64 {
        let seals = [self.seal_drag_n, self.seal_viscous_n_s_m];
        let seal = |n: usize| seals.get(n).copied().flatten().unwrap_or(f64::NAN);
        self.values().get(n).copied().unwrap_or_else(|| seal(n - 4))
    }

    /// Whether the data determine a constant, in the order of [`NAMES`], to better than [`DETERMINED`].
    pub fn is_determined(&self, n: usize) -> bool {
        self.sigma(n) < DETERMINED * self.constant(n).abs()
    }

    /// ∂(fitted/σ)/∂(constant): one row per cell, one column per constant in the order of the covariance.
    pub fn tangent(&self) -> DMatrix<f64> {
        let constants: Vec<f64> = (0..self.covariance.nrows()).map(|n| self.constant(n)).collect();
        self.problem.jacobian(&constants)
    }

    /// Relative standard deviation of the friction coefficient at a Hersey number, from the constants' covariance.
    pub fn friction_uncertainty(&self, hersey: f64) -> f64 {
        let f = &self.friction;
        let fallen = (-f.stribeck_exponent * hersey).exp();
        let slope = [1.0, hersey, fallen, -f.mu_stribeck * hersey * fallen];
        let mut variance = 0.0;
        for (a, x) in slope.iter().enumerate() {
            for (b, y) in slope.iter().enumerate() {
                variance += x * y * self.covariance[(a, b)];
            }
        }
        variance.max(0.0).sqrt() / f.coefficient(hersey).abs()
    }

    /// Residual degrees of freedom.
    pub fn freedom(&self) -> usize {
        self.residuals_n.len() - self.covariance.nrows()
    }
}

/// The problem: normal loads, Hersey numbers, seals, forces.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    normal: Vec<f64>,
    hersey: Vec<f64>,
    /// 1 and the speed where the block had its seals on, 0 where not.
    seals: Vec<[f64; 2]>,
    forces: Vec<f64>,
    sigmas: Vec<f64>,
    /// Unit of the Hersey numbers, chosen so that all columns are of similar size.
    unit: f64,
    fitted: Seals,
}

impl Grid {
    fn of(cells: &[Cell], model: &Exact, scale: f64, fitted: Seals) -> Self {
        let hersey: Vec<f64> = cells.iter().map(|c| c.hersey(model, scale)).collect();
        let unit = hersey.iter().fold(0.0, |a: f64, h| a.max(*h)).max(1e-300);
        Grid {
            normal: cells.iter().map(|c| model.guide().loaded_balls() * c.load_per_ball_n).collect(),
            hersey: hersey.iter().map(|h| h / unit).collect(),
            seals: cells.iter().map(|c| if c.has_seals { [1.0, c.speed_m_s.abs()] } else { [0.0; 2] }).collect(),
            forces: cells.iter().map(|c| c.force_n).collect(),
            sigmas: vec![1.0; cells.len()],
            unit,
            fitted,
        }
    }

    /// Range of ln k_s (in units of 1/`unit`) that these Hersey numbers can show: from a curve that has fallen by a
    /// fiftieth at the largest, to one that has fallen to nothing at the smallest.
    pub(crate) fn range(&self) -> (f64, f64) {
        let least = self.hersey.iter().copied().filter(|h| *h > 0.0).fold(1.0, f64::min);
        ((0.02f64).ln(), (5.0 / least).ln())
    }

    /// Unit of the Hersey numbers here.
    pub(crate) fn unit(&self) -> f64 {
        self.unit
    }

    /// The constants in SI, the seals' last.
    fn minimum(&self) -> Result<Vec<f64>, NoFit> {
        let (x, fit) = separable::least(self, self.range(), PLACES, None).ok_or(NoFit::Degenerate)?;
        // k_s comes before the seals
        let mut start = fit.parameters;
        start.insert(3, x);
        let start = DVector::from_vec(start);
        // parameters are scaled to 1, because the library judges steps relative to their size
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
        let law = |h: f64| p[0] + p[1] * self.unit * h + p[2] * (-p[3] * self.unit * h).exp();
        let seals = |n: usize| self.seals[n].iter().zip(&p[4..]).map(|(c, x)| c * x).sum::<f64>();
        (0..self.rows()).map(|n| self.forces[n] - self.normal[n] * law(self.hersey[n]) - seals(n)).collect()
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
                seal => self.seals[n][seal - 4] / self.sigmas[n],
            }
        })
    }
}

impl Separable for Grid {
    fn linear(&self) -> usize {
        3 + self.fitted.columns()
    }

    fn rows(&self) -> usize {
        self.forces.len()
    }

    fn columns(&self, row: usize, ln_kappa: f64, out: &mut [f64]) {
        let (h, sigma) = (self.hersey[row], self.sigmas[row]);
        let (w, [seal, speed]) = (self.normal[row] / sigma, self.seals[row]);
        let all = [w, w * h, w * (-ln_kappa.exp() * h).exp(), seal / sigma, speed / sigma];
        out.copy_from_slice(&all[..out.len()]);
    }

    fn measured(&self, row: usize) -> f64 {
        self.forces[row] / self.sigmas[row]
    }
}

/// Final joint descent to the minimum: μ_c, μ_v, μ_s, ln k_s and the seals' constants in units of their start values.
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
            let linear = |(j, c): (usize, &f64)| c * p[if j < 3 { j } else { j + 1 }];
            columns.iter().enumerate().map(linear).sum::<f64>() - self.grid.measured(n)
        }))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let p = self.at.component_mul(&self.scales);
        let kappa = p[3].exp();
        let mut columns = vec![0.0; self.grid.linear()];
        let mut out = DMatrix::zeros(self.grid.rows(), p.len());
        for n in 0..self.grid.rows() {
            self.grid.columns(n, p[3], &mut columns);
            for (j, c) in columns.iter().enumerate() {
                out[(n, if j < 3 { j } else { j + 1 })] = *c;
            }
            out[(n, 3)] = -p[2] * kappa * self.grid.hersey[n] * columns[2];
        }
        for (mut column, scale) in out.column_iter_mut().zip(self.scales.iter()) {
            column *= *scale;
        }
        Some(out)
    }
}
