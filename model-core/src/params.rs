//! Parameters of a block: guide, sensors and axis, with their uncertainties, set by a person or by a calibration.

use crate::Error;
use crate::calibration::Calibration;
use crate::left_out::LeftOut;
use crate::quantity::check_f32;
use crate::reduced::Reduced;
use crate::reference::zhou_2023;
use crate::viscosity::ViscosityCubic;

/// All parameters of a block. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Params {
    /// Whether the numbers below were measured for this block. When not, no preload is ever given.
    pub calibrated: bool,
    /// Sensors.
    pub calibration: Calibration,
    /// Drag law of the guide.
    pub law: Reduced<f32>,
    /// Oil.
    pub viscosity: ViscosityCubic,
    /// The law's viscosity number per cSt: 1 with slip; 60·ρ·1e-6 (ρ density in kg/m³) with carriage speed.
    pub viscosity_number_per_cst: f32,
    /// Drag of the seals.
    pub seals: Seals,
    /// Range in which the calibration holds.
    pub range: CalibratedRange,
    /// Standard deviations of the assumptions.
    pub uncertainty: Uncertainty,
    /// Mass between force bridge and guide, kg; decides how much acceleration is too much.
    pub moved_mass_kg: f32,
    /// Hardest braking the axis can do, m/s².
    pub braking_limit_m_s2: f32,
    /// Travel after a reversal before the drag force is fully developed, m.
    pub presliding_guard_m: f32,
    /// Carriage travel per ball entering the loaded zone, m.
    pub ball_pass_wavelength_m: f32,
    /// Blocks (10 ms) between two estimates: 10 is 10 Hz, 1 is 100 Hz.
    pub publish_every_blocks: u16,
    /// Left-out mechanisms: what acts beside the law and the seals.
    pub left_out: LeftOut,
}

/// Seal drag: `F_seal = coulomb + viscous·abs(V)`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Seals {
    /// Constant part, N.
    pub coulomb_n: f32,
    /// Part that grows with speed, N s/m.
    pub viscous_n_s_m: f32,
}

/// Limits of what was calibrated; outside them the block says so and gives no number.
///
/// The temperature limits are those of the viscosity cubic.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct CalibratedRange {
    /// Lowest speed, m/s.
    pub speed_from_m_s: f32,
    /// Highest speed, m/s.
    pub speed_to_m_s: f32,
    /// Lowest preload, N.
    pub preload_from_n: f32,
    /// Highest preload, N.
    pub preload_to_n: f32,
}

/// Standard deviations (1 σ) of what the estimate rests on. All are taken as independent.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Uncertainty {
    /// Zero of the force bridge, N.
    pub force_offset_n: f32,
    /// Gain of the force bridge, relative.
    pub force_gain: f32,
    /// Seal drag, N.
    pub seals_n: f32,
    /// Friction coefficient at a given Hersey number, relative.
    pub friction: f32,
    /// Viscosity at a given temperature, relative.
    pub viscosity: f32,
    /// Difference between oil and thermometer temperature, K.
    pub temperature_k: f32,
    /// Amplitude of the ball-pass ripple, relative to the drag force; counts in full where a window is shorter than a
    /// ball pass.
    pub ball_pass_ripple: f32,
}

impl Params {
    /// THK SHS35V after Zhou 2023 with a fixed contact angle and VG 100 oil, on the project's bench. Not
    /// calibrated: the paper's curve is stated to fit another specimen within 19 %, and its seals were off.
    pub const ZHOU_2023: Params = Params {
        calibrated: false,
        calibration: Calibration::BENCH,
        law: Reduced::of(&zhou_2023::GUIDE_PRODUCTION, &zhou_2023::FRICTION, 600.0).to_f32(),
        viscosity: ViscosityCubic::VG100,
        viscosity_number_per_cst: 1.0,
        seals: Seals { coulomb_n: 0.0, viscous_n_s_m: 0.0 },
        range: CalibratedRange {
            speed_from_m_s: zhou_2023::SPEED_RANGE_M_S.0 as f32,
            speed_to_m_s: zhou_2023::SPEED_RANGE_M_S.1 as f32,
            preload_from_n: zhou_2023::PRELOAD_RANGE_N.0 as f32,
            preload_to_n: zhou_2023::PRELOAD_RANGE_N.1 as f32,
        },
        uncertainty: Uncertainty {
            force_offset_n: 0.05,
            force_gain: 0.005,
            seals_n: 0.1,
            friction: 0.03,
            viscosity: 0.05,
            temperature_k: 0.5,
            ball_pass_ripple: 0.01,
        },
        moved_mass_kg: 2.0,
        braking_limit_m_s2: 5.0,
        presliding_guard_m: 0.5e-3,
        // pitch 93 mm/13 balls (physics.md B.5), twice: the ball centre moves at half the carriage speed
        ball_pass_wavelength_m: 14.3e-3,
        publish_every_blocks: 10,
        left_out: LeftOut::NOTHING,
    };

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or outside [`RANGES`](crate::quantity::RANGES), by name.
    #[cold]
    #[inline(never)]
    pub fn check(&self) -> Result<(), Error> {
        self.calibration.check()?;
        let law = &self.law;
        for x in [
            law.loads_per_force,
            law.preload_per_load,
            law.angle_per_load,
            law.film_per_viscous_speed,
            law.slip_1,
            law.slip_2,
            law.viscous,
            law.stribeck,
            law.mu_coulomb,
            law.load_limit_n,
        ] {
            if !x.is_finite() {
                return Err(Error::NonFinite("law"));
            }
        }
        if !(law.loads_per_force > 0.0 && law.preload_per_load > 0.0 && law.film_per_viscous_speed >= 0.0) {
            return Err(Error::OutOfRange("law"));
        }
        for c in self.viscosity.ln {
            if !c.is_finite() {
                return Err(Error::NonFinite("viscosity"));
            }
        }
        check_f32("temperature_degc", self.viscosity.from_degc)?;
        check_f32("temperature_degc", self.viscosity.to_degc)?;
        if !(self.viscosity_number_per_cst > 0.0 && self.viscosity_number_per_cst.is_finite()) {
            return Err(Error::OutOfRange("viscosity_number_per_cst"));
        }
        check_f32("seal_drag_n", self.seals.coulomb_n)?;
        check_f32("seal_viscous_n_s_m", self.seals.viscous_n_s_m)?;
        check_f32("speed_m_s", self.range.speed_from_m_s)?;
        check_f32("speed_m_s", self.range.speed_to_m_s)?;
        check_f32("preload_n", self.range.preload_from_n)?;
        check_f32("preload_n", self.range.preload_to_n)?;
        // an empty range would silence the block for ever
        for (name, from, to) in [
            ("temperature_degc", self.viscosity.from_degc, self.viscosity.to_degc),
            ("speed_m_s", self.range.speed_from_m_s, self.range.speed_to_m_s),
            ("preload_n", self.range.preload_from_n, self.range.preload_to_n),
        ] {
            if from >= to {
                return Err(Error::OutOfRange(name));
            }
        }
        let u = &self.uncertainty;
        check_f32("force_sigma_n", u.force_offset_n)?;
        check_f32("relative_sigma", u.force_gain)?;
        check_f32("force_sigma_n", u.seals_n)?;
        check_f32("relative_sigma", u.friction)?;
        check_f32("relative_sigma", u.viscosity)?;
        check_f32("temperature_sigma_k", u.temperature_k)?;
        check_f32("relative_sigma", u.ball_pass_ripple)?;
        check_f32("moved_mass_kg", self.moved_mass_kg)?;
        check_f32("braking_limit_m_s2", self.braking_limit_m_s2)?;
        check_f32("presliding_guard_m", self.presliding_guard_m)?;
        check_f32("ball_pass_wavelength_m", self.ball_pass_wavelength_m)?;
        check_f32("publish_every_blocks", f32::from(self.publish_every_blocks))?;
        self.left_out.check(self.range.preload_from_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_parameters_that_mean_nothing() {
        let mut p = Params::ZHOU_2023;
        assert_eq!(p.check(), Ok(()));
        p.publish_every_blocks = 0;
        assert_eq!(p.check(), Err(Error::OutOfRange("publish_every_blocks")));
        p = Params::ZHOU_2023;
        p.law.loads_per_force = f32::NAN;
        assert_eq!(p.check(), Err(Error::NonFinite("law")));
        p = Params::ZHOU_2023;
        p.range.speed_to_m_s = p.range.speed_from_m_s;
        assert_eq!(p.check(), Err(Error::OutOfRange("speed_m_s")));
        p = Params::ZHOU_2023;
        p.calibration.metres_per_count = 1e-12;
        assert_eq!(p.check(), Err(Error::OutOfRange("metres_per_count")));
        p = Params::ZHOU_2023;
        p.calibration.metres_per_count = 0.0;
        assert_eq!(p.check(), Err(Error::OutOfRange("metres_per_count")));
    }
}
