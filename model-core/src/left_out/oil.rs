//! Oil that thins with temperature while the law was given a single viscosity.
//!
//! `F = part·(D(p, ν₁·V) - D(p, ν₀·V))`, ν₁ the block's oil at its temperature, ν₀ the law's.
//! Source: `docs/mechanisms.md`, `viscosity-temperature`. Part 1 is the law with the right oil.

use crate::Error;
use crate::quantity::check_f32;

/// Viscosity of the law's own oil, where it is not the block's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Oil {
    /// Share of the difference that acts; 0: the law has the block's oil.
    pub part: f32,
    /// Viscosity that the law was given, cSt; read only where `part` is not 0.
    pub law_cst: f32,
}

impl Oil {
    /// The law has the block's oil.
    pub const NONE: Oil = Oil { part: 0.0, law_cst: 0.0 };

    pub(super) fn acts(&self) -> bool {
        self.part != 0.0
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("oil_part", self.part)?;
        if self.acts() { check_f32("viscosity_cst", self.law_cst) } else { Ok(()) }
    }

    /// The law's viscosity, cSt, where that of the block's oil is `oil_cst`.
    pub fn of_law_cst(&self, oil_cst: f32) -> f32 {
        if self.acts() { self.law_cst } else { oil_cst }
    }
}
