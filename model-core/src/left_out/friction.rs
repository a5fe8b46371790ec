//! Friction that does not come from the loaded contacts, and friction that depends on the direction.
//!
//! ```text
//! seal        F = s·v̂·(coulomb(s) + per_decade·log10(1 + V/(1 mm/s)))     v̂ = V/√(V² + V₀²), 1 for V₀ = 0
//! viscous     F = s·(V/(0.1 m/s))^n·(at_100_mm_s(s) + at_100_cst·ν/100 cSt)
//! asymmetry   F = part·D + viscous·V                                       the same sign in both directions
//! ```
//!
//! Source: `docs/mechanisms.md`, `seal-drag`, `viscous-drag`, `direction-asymmetry`. V without sign.

use crate::Error;
use crate::num;
use crate::quantity::check_f32;

/// Speed at which the seal lips begin to lift, m/s, as in `docs/mechanisms.md`.
const LIFT_M_S: f32 = 1e-3;

/// Reference speed of the viscous drag, m/s.
const STATED_M_S: f32 = 0.1;

/// 1/ln 10.
const PER_LN_10: f32 = core::f32::consts::LOG10_E;

/// Constant friction of seals, wipers and cage, beside that of [`Seals`](crate::params::Seals).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct SealDrag {
    /// Constant part, N: towards larger positions, towards smaller ones.
    pub coulomb_n: [f32; 2],
    /// Increase per decade of speed as the lips lift, N.
    pub per_decade_n: f32,
    /// Speed V₀ below which the sign of motion is smoothed, m/s; 0: not smoothed.
    pub smooth_m_s: f32,
}

impl SealDrag {
    /// None.
    pub const NONE: SealDrag = SealDrag { coulomb_n: [0.0; 2], per_decade_n: 0.0, smooth_m_s: 0.0 };

    pub(super) fn acts(&self) -> bool {
        self.coulomb_n != [0.0; 2] || self.per_decade_n != 0.0
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("seal_drag_n", self.coulomb_n[0])?;
        check_f32("seal_drag_n", self.coulomb_n[1])?;
        check_f32("left_out_force_n", self.per_decade_n)?;
        check_f32("speed_m_s", self.smooth_m_s)
    }

    /// Drag, N, at a speed of either sign, m/s.
    pub fn drag_n(&self, speed_m_s: f32) -> f32 {
        let v = speed_m_s.abs();
        let [forward, backward] = self.coulomb_n;
        let mut drag = if speed_m_s < 0.0 { backward } else { forward };
        if self.per_decade_n != 0.0 {
            drag += self.per_decade_n * PER_LN_10 * num::ln(1.0 + v / LIFT_M_S);
        }
        if self.smooth_m_s > 0.0 {
            drag *= v / num::sqrt(v * v + self.smooth_m_s * self.smooth_m_s);
        }
        drag
    }
}

/// Friction that grows with speed and not with load.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct ViscousDrag {
    /// Drag at 0.1 m/s, N: towards larger positions, towards smaller ones.
    pub at_100_mm_s_n: [f32; 2],
    /// Part that follows the viscosity of the law's oil: drag at 0.1 m/s and 100 cSt, N.
    pub at_100_cst_n: f32,
    /// Exponent n of speed.
    pub exponent: f32,
}

impl ViscousDrag {
    /// None.
    pub const NONE: ViscousDrag = ViscousDrag { at_100_mm_s_n: [0.0; 2], at_100_cst_n: 0.0, exponent: 0.0 };

    pub(super) fn acts(&self) -> bool {
        self.at_100_mm_s_n != [0.0; 2] || self.at_100_cst_n != 0.0
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("seal_drag_n", self.at_100_mm_s_n[0])?;
        check_f32("seal_drag_n", self.at_100_mm_s_n[1])?;
        check_f32("seal_drag_n", self.at_100_cst_n)?;
        check_f32("speed_exponent", self.exponent)
    }

    /// Drag, N, at a speed of either sign, m/s, and the viscosity of the law's oil, cSt.
    pub fn drag_n(&self, speed_m_s: f32, law_cst: f32) -> f32 {
        let [forward, backward] = self.at_100_mm_s_n;
        let stated = if speed_m_s < 0.0 { backward } else { forward };
        // (V/0.1)^n = e^(n ln(V/0.1)); a speed of zero has no logarithm and no drag
        let ratio = speed_m_s.abs() / STATED_M_S;
        if ratio < f32::MIN_POSITIVE {
            return 0.0;
        }
        num::exp(self.exponent * num::ln(ratio)) * (stated + self.at_100_cst_n * 0.01 * law_cst)
    }
}

/// Friction that differs between the directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Asymmetry {
    /// Share of the law's drag that is added towards larger positions and taken off towards smaller ones.
    pub part: f32,
    /// Asymmetry in proportion to speed, N s/m.
    pub viscous_n_s_m: f32,
}

impl Asymmetry {
    /// None.
    pub const NONE: Asymmetry = Asymmetry { part: 0.0, viscous_n_s_m: 0.0 };

    pub(super) fn acts(&self) -> bool {
        *self != Self::NONE
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        check_f32("left_out_part", self.part)?;
        check_f32("left_out_viscous_n_s_m", self.viscous_n_s_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seals_lift_and_know_directions() {
        let seal = SealDrag { coulomb_n: [4.0, 3.0], per_decade_n: 0.5, smooth_m_s: 0.0 };
        for v in [1e-4, 3e-3, 0.1f32] {
            let lift = 0.5 * libm::log10(1.0 + f64::from(v) / 1e-3);
            assert!((f64::from(seal.drag_n(v)) / (4.0 + lift) - 1.0).abs() < 3e-7);
            assert!((f64::from(seal.drag_n(-v)) / (3.0 + lift) - 1.0).abs() < 3e-7);
        }
        // at V₀ the smoothed sign is 1/√2
        let smooth = SealDrag { coulomb_n: [4.0; 2], per_decade_n: 0.0, smooth_m_s: 0.01 };
        assert!((smooth.drag_n(0.01) - 2.828_427).abs() < 1e-6);
        assert_eq!(smooth.drag_n(0.0), 0.0);
        assert!((smooth.drag_n(10.0) - 4.0).abs() < 1e-5);
    }

    #[test]
    fn viscous_drag_is_a_power_of_speed() {
        for exponent in [0.3, 1.0, 2.0f32] {
            let viscous = ViscousDrag { at_100_mm_s_n: [3.0, 2.0], at_100_cst_n: 1.0, exponent };
            for v in [1e-3, 0.02, 0.5f32] {
                let power = libm::pow(f64::from(v) / 0.1, f64::from(exponent));
                let want = power * (3.0 + 0.68);
                assert!((f64::from(viscous.drag_n(v, 68.0)) / want - 1.0).abs() < 2e-6, "{exponent} {v}");
                let want = power * (2.0 + 0.68);
                assert!((f64::from(viscous.drag_n(-v, 68.0)) / want - 1.0).abs() < 2e-6, "{exponent} {v}");
            }
            assert_eq!(viscous.drag_n(0.0, 68.0), 0.0);
        }
    }
}
