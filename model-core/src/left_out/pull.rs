//! Forces that do not come from the guide: weight along the rail, a chain, the mass of the table.
//!
//! `F = force + per_m·x + mass·dV/dt`, whatever the direction of motion.
//! Source: `docs/mechanisms.md`, `gravity-tilt`, `cable-chain`, `inertia`.

use super::Passage;
use crate::Error;
use crate::quantity::check_f32;

/// Forces on the carriage that do not come from the guide.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Pull {
    /// Constant part, N, positive where the drive has to push towards larger positions.
    pub force_n: f32,
    /// Increase per metre of rail, N/m.
    pub per_m_n_m: f32,
    /// Mass that the drive accelerates, kg. Where it is known, the acceleration that silences the block is ten times as
    /// high.
    pub inertia_kg: f32,
}

impl Pull {
    /// None.
    pub const NONE: Pull = Pull { force_n: 0.0, per_m_n_m: 0.0, inertia_kg: 0.0 };

    pub(super) fn acts(&self) -> bool {
        *self != Self::NONE
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("left_out_force_n", self.force_n)?;
        check_f32("left_out_viscous_n_s_m", self.per_m_n_m)?;
        check_f32("moved_mass_kg", self.inertia_kg)
    }

    /// Mean force over a window, N.
    pub fn force_n(&self, passage: &Passage) -> f32 {
        self.force_n + self.per_m_n_m * passage.place_m + self.inertia_kg * passage.acceleration_m_s2
    }
}
