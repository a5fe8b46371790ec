//! Waves along the rail: passing balls, a rail that is not straight, screw and motor.
//!
//! ```text
//! w(x)   = Σ sine_o·sin(o·kx) + cosine_o·cos(o·kx)        k = 2π/wavelength, o = 1, 2, 3
//! mean over a window of travel L around x: every order times sin(o·kL/2)/(o·kL/2)
//! ```
//!
//! Source: `docs/mechanisms.md`, `ball-pass`, `rail-straightness`, `drive-ripple`, `contamination` (particle).

use super::Passage;
use crate::Error;
use crate::num;
use crate::quantity::check_f32;

/// Number of orders of a wave.
pub const ORDERS: usize = 3;

/// Quantity that a wave or a table along the rail gives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Acts {
    /// Relative preload.
    #[default]
    Preload,
    /// Friction, N, against the motion.
    Drag,
    /// Force, N, the same in both directions.
    Force,
    /// Interference of balls and raceways, stated as the relative preload that it causes at 150 N per ball:
    /// `ρ ∝ Q^(-2/3)`, because `Q ∝ D^1.5`.
    Interference,
}

impl Acts {
    /// Name of the quantity whose range its amplitudes must be in.
    pub(super) const fn quantity(self) -> &'static str {
        match self {
            Acts::Preload | Acts::Interference => "left_out_part",
            Acts::Drag | Acts::Force => "left_out_force_n",
        }
    }
}

/// A wave along the rail.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Wave {
    /// Quantity that the wave gives.
    pub acts: Acts,
    /// Wavelength of the first order, m; read only where an amplitude is not 0.
    pub wavelength_m: f32,
    /// Amplitudes of the sine, first order first; relative preload or N.
    pub sine: [f32; ORDERS],
    /// Amplitudes of the cosine.
    pub cosine: [f32; ORDERS],
}

impl Wave {
    /// None.
    pub const NONE: Wave = Wave { acts: Acts::Preload, wavelength_m: 0.0, sine: [0.0; ORDERS], cosine: [0.0; ORDERS] };

    /// Whether it has an amplitude.
    pub fn acts(&self) -> bool {
        self.sine != [0.0; ORDERS] || self.cosine != [0.0; ORDERS]
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let amplitude = self.acts.quantity();
        for x in self.sine.iter().chain(&self.cosine) {
            check_f32(amplitude, *x)?;
        }
        if self.acts() { check_f32("wavelength_m", self.wavelength_m) } else { Ok(()) }
    }

    /// Mean over a window.
    pub fn mean(&self, passage: &Passage) -> f32 {
        let (s1, c1) = num::sin_cos_turns(passage.place_m / self.wavelength_m);
        let half = 0.5 * passage.travel_m / self.wavelength_m;
        let (ws1, wc1) = num::sin_cos_turns(half);
        let angle = core::f32::consts::TAU * half;
        // angles of the higher orders by addition
        let (mut s, mut c, mut ws, mut wc) = (s1, c1, ws1, wc1);
        let (mut sum, mut order) = (0.0, 1.0);
        // orders beyond the last one in use are skipped
        let orders = if self.sine[2] != 0.0 || self.cosine[2] != 0.0 {
            3
        } else if self.sine[1] != 0.0 || self.cosine[1] != 0.0 {
            2
        } else {
            1
        };
        for (sine, cosine) in self.sine.iter().zip(&self.cosine).take(orders) {
            let arc = order * angle;
            // below 0.01 rad sin(arc)/arc = 1 - arc²/6 is exact in f32
            let kept = if arc.abs() < 0.01 { 1.0 - arc * arc * (1.0 / 6.0) } else { ws / arc };
            sum += kept * (sine * s + cosine * c);
            (s, c) = (s * c1 + c * s1, c * c1 - s * s1);
            (ws, wc) = (ws * wc1 + wc * ws1, wc * wc1 - ws * ws1);
            order += 1.0;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_that_of_many_places() {
        let wave = Wave {
            acts: Acts::Preload,
            wavelength_m: 0.0143,
            sine: [0.02, -0.01, 0.004],
            cosine: [0.01, 0.007, -0.003],
        };
        for (place, travel) in [(0.0, 1e-5), (0.1034, 0.004), (-1.7, -0.02), (0.777, 0.0143), (3.21, 0.16)] {
            let (mut sum, steps) = (0.0f64, 20_000);
            for n in 0..steps {
                let x = f64::from(place) + f64::from(travel) * ((f64::from(n) + 0.5) / f64::from(steps) - 0.5);
                for o in 1..=ORDERS {
                    let angle = core::f64::consts::TAU * x / f64::from(wave.wavelength_m) * o as f64;
                    sum += f64::from(wave.sine[o - 1]) * libm::sin(angle)
                        + f64::from(wave.cosine[o - 1]) * libm::cos(angle);
                }
            }
            let passage = Passage {
                speed_m_s: 0.01,
                acceleration_m_s2: 0.0,
                force_rate_n_s: 0.0,
                viscosity_cst: 100.0,
                place_m: place,
                travel_m: travel,
            };
            let got = f64::from(wave.mean(&passage));
            // f32 resolves a place of 3 m to 2e-7 m, which is 1e-4 rad of a wave of 14.3 mm
            assert!((got - sum / f64::from(steps)).abs() < 4e-6, "{place} {travel}: {got} {}", sum / f64::from(steps));
        }
    }
}
