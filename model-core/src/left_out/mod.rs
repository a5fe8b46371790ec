//! Left-out mechanisms: what the law of steady drag leaves out and this block was found to have.
//!
//! The desk's diagnosis writes every mechanism as a force beside the law's (`docs/mechanisms.md`). The chip inverts the
//! same equations. With s the sign of motion, D(p, b) the law's drag at preload p and b = ν·V, b₀ with the viscosity
//! that the law was given and b₁ with that of the block's oil at its temperature:
//!
//! ```text
//! s·F = D(p, b₀)·M(p) + part·(D(p, b₁) - D(p, b₀)) + A
//! M   = 1 + gain + s·asymmetry + load(p) + k(p)·ρ      k = dlnD/dlnp at b₀, ρ relative preload at this place
//! A   = seals + viscous + s·(offset + pull + inertia + waves of force)     does not depend on preload
//! ```
//!
//! A is taken off the measured force; the rest, C = D(p, b₁)·N(p), is inverted by the law, see [`solve`]. What the
//! place adds to the preload (rail, balls) is no part of the answer: the block reports its own preload.
//!
//! Windows of steady motion only. The travel after a reversal is excluded by the presliding guard, not modelled.

pub mod friction;
pub mod load;
pub mod oil;
pub mod pull;
pub mod rail;
pub mod sensor;
pub mod solve;
pub mod wave;

use crate::Error;
use friction::{Asymmetry, SealDrag, ViscousDrag};
use load::ExternalLoad;
use oil::Oil;
use pull::Pull;
use rail::RailTable;
use sensor::Sensor;
use wave::Wave;

/// Number of waves along the rail that a block can have.
pub const WAVES: usize = 3;

/// Everything that acts beside the law. SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct LeftOut {
    /// Friction of seals, wipers and cage.
    pub seal: SealDrag,
    /// Friction that grows with speed and not with load.
    pub viscous: ViscousDrag,
    /// Difference between the law's oil and the block's.
    pub oil: Oil,
    /// Friction that differs between the directions.
    pub asymmetry: Asymmetry,
    /// Load on the block.
    pub load: ExternalLoad,
    /// Force that does not come from the guide.
    pub pull: Pull,
    /// Errors of the force channel.
    pub sensor: Sensor,
    /// Place on the rail at which the block is switched on, m; every place below counts from the rail's zero.
    pub start_m: f32,
    /// Waves along the rail: balls that pass, a rail that is not straight, the drive.
    pub waves: [Wave; WAVES],
    /// Other effects tied to places on the rail.
    pub rail: RailTable,
}

/// Which mechanisms act, as a set of bits: what the acting frame carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Acting(u16);

impl Acting {
    /// Nothing acts beside the law.
    pub const NONE: Acting = Acting(0);

    /// Names in the order of the bits, lowest first.
    pub const NAMES: [&str; 9] = ["seal", "viscous", "oil", "asymmetry", "load", "pull", "sensor", "waves", "rail"];

    /// Bit n set: mechanism n of [`NAMES`](Self::NAMES) acts.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The set with these bits; bits beyond [`NAMES`](Self::NAMES) are dropped.
    pub const fn from_bits(bits: u16) -> Self {
        Acting(bits & ((1 << Self::NAMES.len()) - 1))
    }

    /// Whether nothing acts.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Names of what acts.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES.into_iter().enumerate().filter(move |(n, _)| self.0 >> n & 1 == 1).map(|(_, name)| name)
    }
}

impl LeftOut {
    /// Nothing was left out.
    pub const NOTHING: LeftOut = LeftOut {
        seal: SealDrag::NONE,
        viscous: ViscousDrag::NONE,
        oil: Oil::NONE,
        asymmetry: Asymmetry::NONE,
        load: ExternalLoad::NONE,
        pull: Pull::NONE,
        sensor: Sensor::NONE,
        start_m: 0.0,
        waves: [Wave::NONE; WAVES],
        rail: RailTable::NONE,
    };

    /// Which mechanisms have an effect.
    #[cold]
    #[inline(never)]
    pub fn acting(&self) -> Acting {
        let acts = [
            self.seal.acts(),
            self.viscous.acts(),
            self.oil.acts(),
            self.asymmetry.acts(),
            self.load.acts(),
            self.pull.acts(),
            self.sensor.acts(),
            self.waves.iter().any(Wave::acts),
            self.rail.acts(),
        ];
        Acting(acts.iter().enumerate().fold(0, |set, (n, acts)| set | u16::from(*acts) << n))
    }

    /// Checks every field; `least_preload_n` is the lowest preload that the block is to tell.
    ///
    /// # Errors
    /// The first field that is not finite or outside [`RANGES`](crate::quantity::RANGES), by name.
    #[cold]
    #[inline(never)]
    pub fn check(&self, least_preload_n: f32) -> Result<(), Error> {
        self.seal.check()?;
        self.viscous.check()?;
        self.oil.check()?;
        self.asymmetry.check()?;
        self.load.check(least_preload_n)?;
        self.pull.check()?;
        self.sensor.check()?;
        crate::quantity::check_f32("place_m", self.start_m)?;
        for wave in &self.waves {
            wave.check()?;
        }
        self.rail.check()
    }
}

/// Motion of the carriage, and what goes with it, during a window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Speed, m/s, signed.
    pub speed_m_s: f32,
    /// Change of speed, m/s².
    pub acceleration_m_s2: f32,
    /// Change of the measured force, N/s.
    pub force_rate_n_s: f32,
    /// Viscosity that the block's oil has, cSt.
    pub viscosity_cst: f32,
    /// Mean place of the window's samples, m.
    pub place_m: f32,
    /// Travel over the window, m, signed.
    pub travel_m: f32,
}

impl Passage {
    /// Sign of motion, -1 or 1.
    pub fn sign(&self) -> f32 {
        if self.speed_m_s < 0.0 { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_acts_by_default_and_each_acts_alone() {
        assert_eq!(LeftOut::default(), LeftOut::NOTHING);
        assert!(LeftOut::NOTHING.acting().is_empty());
        assert_eq!(LeftOut::NOTHING.check(500.0), Ok(()));
        let alone: [fn(&mut LeftOut); 9] = [
            |l| l.seal.coulomb_n = [0.0, 1.0],
            |l| l.viscous = ViscousDrag { at_100_mm_s_n: [1.0; 2], at_100_cst_n: 0.0, exponent: 1.0 },
            |l| l.oil = Oil { part: 1.0, law_cst: 100.0 },
            |l| l.asymmetry.part = 0.01,
            |l| l.load = ExternalLoad { load_n: [100.0; 2], part: 1.0, preload_per_load: 0.0 },
            |l| l.pull.inertia_kg = 3.0,
            |l| l.sensor.lag_s = 0.01,
            |l| l.waves[2] = Wave { wavelength_m: 0.1, sine: [0.0, 0.0, 0.1], ..Wave::NONE },
            |l| l.rail = RailTable { knots: 2, step_m: 0.1, scale: 1e-4, ..RailTable::NONE },
        ];
        for (n, set) in alone.into_iter().enumerate() {
            let mut left_out = LeftOut::NOTHING;
            set(&mut left_out);
            assert_eq!(left_out.check(500.0), Ok(()), "{n}");
            assert_eq!(left_out.acting().bits(), 1 << n);
            assert!(left_out.acting().names().eq([Acting::NAMES[n]]));
            assert_eq!(Acting::from_bits(left_out.acting().bits()), left_out.acting());
        }
        assert_eq!(Acting::from_bits(0xFFFF).bits(), 0x1FF);
    }

    #[test]
    fn what_means_nothing_is_refused() {
        let refused = |set: fn(&mut LeftOut)| {
            let mut left_out = LeftOut::NOTHING;
            set(&mut left_out);
            left_out.check(500.0)
        };
        assert_eq!(refused(|l| l.seal.coulomb_n[1] = f32::NAN), Err(Error::NonFinite("seal_drag_n")));
        assert_eq!(refused(|l| l.viscous.exponent = 9.0), Err(Error::OutOfRange("speed_exponent")));
        assert_eq!(refused(|l| l.asymmetry.part = 0.6), Err(Error::OutOfRange("left_out_part")));
        assert_eq!(refused(|l| l.oil.part = 1.0), Err(Error::OutOfRange("viscosity_cst")));
        assert_eq!(
            refused(|l| l.load = ExternalLoad { load_n: [701.0; 2], part: 1.0, preload_per_load: 0.0 }),
            Err(Error::OutOfRange("external_load_n"))
        );
        assert_eq!(refused(|l| l.sensor.lag_s = 3.0), Err(Error::OutOfRange("lag_s")));
        assert_eq!(refused(|l| l.waves[0].sine[0] = 0.1), Err(Error::OutOfRange("wavelength_m")));
        assert_eq!(refused(|l| l.rail.knots = 65), Err(Error::OutOfRange("rail_knots")));
        assert_eq!(refused(|l| l.rail.knots = 2), Err(Error::OutOfRange("rail_step_m")));
        assert_eq!(refused(|l| l.start_m = f32::INFINITY), Err(Error::NonFinite("place_m")));
    }
}
