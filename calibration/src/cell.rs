//! Drag forces at known load: what a friction law is fitted to.

use model_core::exact::Exact;

/// One stroke, or the mean of some, at constant speed and load. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Normal load per ball Q, N, above 0.
    pub load_per_ball_n: f64,
    /// Preload or lateral force that the rig set, N: what rows are grouped and named by.
    pub reference_n: f64,
    /// Viscosity of the oil, cSt.
    pub viscosity_cst: f64,
    /// Speed, m/s, above 0.
    pub speed_m_s: f64,
    /// Direction of travel, -1 or 1; 0 for a mean of both.
    pub direction: f64,
    /// Drag force against the motion, seals taken off, N.
    pub force_n: f64,
    /// Standard deviation of that force, N; NaN where only the scatter of all cells tells it.
    pub sigma_n: f64,
}

impl Cell {
    /// Friction coefficient.       `μ = F_f sin β/(2 F_H) = F_f/(4 Z_b Q)`      Zhou 2023, Eq. 7 with Eq. 2
    pub fn friction_coefficient(&self, model: &Exact) -> f64 {
        self.force_n / (model.guide().loaded_balls() * self.load_per_ball_n)
    }

    /// Hersey number in the model's convention; `scale` turns cSt into the number that it counts.
    pub fn hersey(&self, model: &Exact, scale: f64) -> f64 {
        model.hersey(self.load_per_ball_n, self.viscosity_cst * scale, self.speed_m_s)
    }
}
