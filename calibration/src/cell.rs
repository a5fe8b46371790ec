//! Cells: drag forces at known load, to which a friction law is fitted.

use model_core::exact::Exact;

/// One stroke, or the mean of some, at constant speed and load. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Normal load per ball Q, N; 0 for a block without preload or load, whose drag is that of its seals.
    pub load_per_ball_n: f64,
    /// Preload or lateral force set by the rig, N; rows are grouped and named by it.
    pub reference_n: f64,
    /// Viscosity of the oil, cSt.
    pub viscosity_cst: f64,
    /// Speed, m/s, above 0.
    pub speed_m_s: f64,
    /// Direction of travel, -1 or 1; 0 for a mean of both.
    pub direction: f64,
    /// Whether the block had its seals on.
    pub has_seals: bool,
    /// Drag force against the motion, N.
    pub force_n: f64,
    /// Standard deviation of that force, N; NaN where it is to be estimated from the scatter of all cells.
    pub sigma_n: f64,
}

impl Cell {
    /// Friction coefficient; infinite without a load.       `μ = F_f sin β/(2 F_H) = F_f/(4 Z_b Q)`      Zhou 2023, Eq. 7
    /// with Eq. 2
    pub fn friction_coefficient(&self, model: &Exact) -> f64 {
        self.force_n / (model.guide().loaded_balls() * self.load_per_ball_n)
    }

    /// Hersey number in the model's convention, 0 without a load; `scale` converts cSt to the model's viscosity number.
    pub fn hersey(&self, model: &Exact, scale: f64) -> f64 {
        if self.load_per_ball_n <= 0.0 {
            return 0.0;
        }
        model.hersey(self.load_per_ball_n, self.viscosity_cst * scale, self.speed_m_s)
    }
}
