//! The law's drag force, row by row, and its response to the law's own parameters.
//!
//! ```text
//! guide             F = sign(V)·4 Z_b Q μ(H) + m a        Zhou 2023, Eq. 1 to 21; Q from the preload, H from ν and V
//! coulomb-viscous   F = sign(V)·(F_c + F_v abs(V)) + F_0 + m a
//! column            F = the run's own simulated_force_n, which determines its own response to viscosity and preload
//! ```
//!
//! Steady motion only: nothing here has a memory. What the laws leave out is left to mechanisms.

mod ball_guide;
mod column;
mod table;

use crate::file::{Law, Simulation};
use crate::motion::Motion;
use crate::run::Run;

pub use column::ERROR_OF_COLUMN;

/// Multipliers of a law's assumptions; 1 leaves them unchanged. All dimensionless, above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Preload, measured or given.
    pub preload: f64,
    /// All terms of the friction law together; for a column, its gain.
    pub friction: f64,
    /// Viscosity.
    pub viscosity: f64,
    /// μ_c, or F_c.
    pub mu_coulomb: f64,
    /// μ_v, or F_v.
    pub mu_viscous: f64,
    /// μ_s; without effect for coulomb-viscous.
    pub mu_stribeck: f64,
    /// Moved mass.
    pub mass: f64,
}

impl Default for Factors {
    fn default() -> Self {
        Factors {
            preload: 1.0,
            friction: 1.0,
            viscosity: 1.0,
            mu_coulomb: 1.0,
            mu_viscous: 1.0,
            mu_stribeck: 1.0,
            mass: 1.0,
        }
    }
}

/// Why a law has no value for a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Missing {
    /// Neither the run nor the simulation states the preload.
    #[error("the recording has no column preload_n and the simulation no operation.preload_n; give one of them")]
    Preload,
    /// The oil's viscosity falls with temperature, and the run does not measure that.
    #[error(
        "the recording has no column temperature_block_degc, which the oil's viscosity needs; give lubricant.viscosity_cst for \
         an oil at one temperature"
    )]
    Temperature,
    /// The law is the run's own column, and the run has none.
    #[error(
        "the recording has no column simulated_force_n and the simulation no [guide]; add [guide] with \
         parameters = \"zhou-2023\" or law = \"coulomb-viscous\""
    )]
    SimulatedForce,
    /// A parameter of coulomb-viscous that is to be fitted has not been fitted yet.
    #[error("{0} is not in the simulation; it has to be fitted to a recording first")]
    NotFitted(&'static str),
}

/// Load per ball of an unknown guide as a share of its preload: 150 N at 3 kN, as for the paper's guide.
const BALLS_SHARE: f64 = 0.05;

/// The law's values for every row. The last four vectors are empty for laws that do not know those quantities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steady {
    /// Force of the drive on the carriage, N, positive towards +position, including the law's inertia. NaN where the
    /// law has no value (preload or temperature not measured in that row, load beyond the contact's geometry). At rest
    /// (direction 0) friction is not determined: then it contains inertia and offset only.
    pub force_n: Vec<f64>,
    /// Sign of the velocity, -1 or 1; 0 below the simulation's `zero_speed_m_s`.
    pub direction: Vec<f64>,
    /// Friction alone, N, positive against the motion; at rest, what it would be at that speed. A column of force does
    /// not contain that: there it is what it was when the carriage moved last, and `force_n` is the column.
    pub drag_n: Vec<f64>,
    /// Preload, N. For a column of force it is known where the run has one.
    pub preload_n: Vec<f64>,
    /// Normal load per ball, N; for a guide known only by a column of force, proportional to its preload.
    pub load_per_ball_n: Vec<f64>,
    /// Viscosity of the oil, cSt.
    pub viscosity_cst: Vec<f64>,
    /// Hersey number in the paper's unit.
    pub hersey: Vec<f64>,
}

impl Simulation {
    /// The law's values for a run, within 1e-9 of the exact model.
    ///
    /// `motion` must be that of `run`. A run's column `preload_n` takes precedence over the simulation's preload.
    ///
    /// # Errors
    /// [`Missing`]: something that the law needs is neither in the run nor in the simulation.
    pub fn steady(&self, factors: &Factors, run: &Run, motion: &Motion) -> Result<Steady, Missing> {
        let direction = self.direction(motion);
        match &self.law {
            Law::Guide(set) => {
                let preload = measured(run.preload_n.as_deref()).map_or_else(
                    || self.preload_n.map(ball_guide::Source::Constant).ok_or(Missing::Preload),
                    |column| Ok(ball_guide::Source::Column(column)),
                )?;
                let temperature = measured(run.temperature_block_degc.as_deref());
                let mass = self.axis.moved_mass_kg.unwrap_or(0.0) * factors.mass;
                let mut steady = ball_guide::rows(set, factors, preload, temperature, &motion.velocity_m_s)?;
                steady.force_n = signed(&direction, &steady.drag_n, mass, &motion.acceleration_m_s2, 0.0);
                steady.direction = direction;
                Ok(steady)
            }
            Law::CoulombViscous { coulomb_n, viscous_n_s_m, offset_n } => {
                let coulomb = coulomb_n.ok_or(Missing::NotFitted("guide.coulomb_n"))?;
                let viscous = viscous_n_s_m.ok_or(Missing::NotFitted("guide.viscous_n_s_m"))?;
                let offset = offset_n.ok_or(Missing::NotFitted("guide.offset_n"))?;
                let mass = self.axis.moved_mass_kg.ok_or(Missing::NotFitted("axis.moved_mass_kg"))? * factors.mass;
                let coulomb = coulomb * factors.friction * factors.mu_coulomb;
                let viscous = viscous * factors.friction * factors.mu_viscous;
                let drag_n: Vec<f64> = motion.velocity_m_s.iter().map(|v| coulomb + viscous * v.abs()).collect();
                let force_n = signed(&direction, &drag_n, mass, &motion.acceleration_m_s2, offset);
                Ok(Steady { force_n, direction, drag_n, ..Steady::default() })
            }
            Law::Column { friction, inertia, preload, viscosity } => {
                let factors = &Factors {
                    friction: factors.friction * friction,
                    mass: factors.mass * inertia,
                    preload: factors.preload * preload,
                    viscosity: factors.viscosity * viscosity,
                    ..*factors
                };
                let column = run.simulated_force_n.as_deref().ok_or(Missing::SimulatedForce)?;
                let (force_n, inertia) = column::changed(run, column, motion, &direction, factors);
                let friction_n = force_n.iter().zip(&inertia).map(|(force, inertia)| force - inertia);
                let drag_n = column::drag(run, friction_n, &direction);
                let of_preload = |ratio: f64| -> Vec<f64> {
                    let of = |p: &f64| p * factors.preload * ratio;
                    measured(run.preload_n.as_deref()).unwrap_or_default().iter().map(of).collect()
                };
                let (preload_n, load_per_ball_n) = (of_preload(1.0), of_preload(BALLS_SHARE));
                Ok(Steady { force_n, direction, drag_n, preload_n, load_per_ball_n, ..Steady::default() })
            }
        }
    }

    /// Sign of the velocity of every row, 0 below `zero_speed_m_s`.
    pub fn direction(&self, motion: &Motion) -> Vec<f64> {
        let zero = self.axis.zero_speed_m_s;
        let sign = |v: &f64| if v.abs() < zero || *v == 0.0 { 0.0 } else { v.signum() };
        motion.velocity_m_s.iter().map(sign).collect()
    }
}

/// A column with at least one finite value.
fn measured(column: Option<&[f64]>) -> Option<&[f64]> {
    column.filter(|rows| rows.iter().any(|x| x.is_finite()))
}

/// `F = sign·drag + m a + offset`
fn signed(direction: &[f64], drag: &[f64], mass: f64, acceleration: &[f64], offset: f64) -> Vec<f64> {
    let friction = direction.iter().zip(drag).map(|(sign, drag)| sign * drag);
    if mass == 0.0 {
        // an unknown acceleration does no harm to a law without inertia
        return friction.map(|force| force + offset).collect();
    }
    friction.zip(acceleration).map(|(force, a)| force + mass * a + offset).collect()
}

#[cfg(test)]
mod tests;
