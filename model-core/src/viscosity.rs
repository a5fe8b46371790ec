//! Kinematic viscosity of an oil over temperature.
//!
//! The desk uses Walther's equation; the block a cubic in temperature for ln ν, fitted to it by code.

use crate::Error;
use crate::num;
use crate::quantity::check;

/// 0 °C in K.
const ZERO_CELSIUS_K: f64 = 273.15;

/// Walther's equation (ASTM D341): `log10 log10(ν + 0.7) = A - B log10 T`, ν in cSt, T in K.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walther {
    /// A.
    pub a: f64,
    /// B.
    pub b: f64,
}

impl Walther {
    /// From the two viscosities of a data sheet, cSt at 40 °C and at 100 °C.
    ///
    /// # Errors
    /// Viscosities outside [`RANGES`](crate::quantity::RANGES), or the hot one not below the cold one.
    pub fn from_40_and_100(nu_40_cst: f64, nu_100_cst: f64) -> Result<Self, Error> {
        check("viscosity_cst", nu_40_cst)?;
        check("viscosity_cst", nu_100_cst)?;
        // the double logarithm needs ν + 0.7 > 1
        if nu_100_cst >= nu_40_cst || nu_100_cst <= 0.3 {
            return Err(Error::OutOfRange("viscosity_cst"));
        }
        let w = |nu: f64| libm::log10(libm::log10(nu + 0.7));
        let t = |c: f64| libm::log10(ZERO_CELSIUS_K + c);
        let b = (w(nu_40_cst) - w(nu_100_cst)) / (t(100.0) - t(40.0));
        Ok(Walther { a: w(nu_40_cst) + b * t(40.0), b })
    }

    /// Viscosity, cSt, at a temperature in °C above -200.
    pub fn viscosity_cst(&self, temperature_degc: f64) -> f64 {
        let exponent = self.a - self.b * libm::log10(ZERO_CELSIUS_K + temperature_degc);
        libm::pow(10.0, libm::pow(10.0, exponent)) - 0.7
    }

    /// The cubic for the block, matched at the four Chebyshev nodes of `from` to `to` °C.
    ///
    /// # Errors
    /// Temperatures outside their range, or `from` not below `to`.
    pub fn cubic(&self, from_degc: f64, to_degc: f64) -> Result<ViscosityCubic, Error> {
        check("temperature_degc", from_degc)?;
        check("temperature_degc", to_degc)?;
        if from_degc >= to_degc {
            return Err(Error::OutOfRange("temperature_degc"));
        }
        let centre = 0.5 * (from_degc + to_degc);
        let half = 0.5 * (to_degc - from_degc);
        let nodes = core::array::from_fn::<f64, 4, _>(|n| {
            half * libm::cos(core::f64::consts::PI * (2.0 * n as f64 + 1.0) / 8.0)
        });
        // Newton's divided differences, then expanded to powers of t
        let mut d = nodes.map(|t| libm::log(self.viscosity_cst(centre + t)));
        for order in 1..4 {
            for n in (order..4).rev() {
                d[n] = (d[n] - d[n - 1]) / (nodes[n] - nodes[n - order]);
            }
        }
        let mut power = [d[3], 0.0, 0.0, 0.0];
        for n in (0..3).rev() {
            for k in (1..4).rev() {
                power[k] = power[k - 1] - nodes[n] * power[k];
            }
            power[0] = d[n] - nodes[n] * power[0];
        }
        Ok(ViscosityCubic {
            centre_degc: centre as f32,
            from_degc: from_degc as f32,
            to_degc: to_degc as f32,
            ln: power.map(|p| p as f32),
        })
    }
}

/// `ln ν = c0 + c1 t + c2 t² + c3 t³`, t = T - centre; ν in cSt, T in °C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct ViscosityCubic {
    /// Temperature at which t is zero, °C.
    pub centre_degc: f32,
    /// Lower end of the fitted range, °C.
    pub from_degc: f32,
    /// Upper end of the fitted range, °C.
    pub to_degc: f32,
    /// c0 to c3.
    pub ln: [f32; 4],
}

/// A viscosity and how steeply it falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscosity {
    /// ν, cSt.
    pub cst: f32,
    /// dln ν/dT, 1/K (negative).
    pub per_kelvin: f32,
}

impl ViscosityCubic {
    /// Viscosity grade 100 (100 cSt at 40 °C, 11 cSt at 100 °C), 5 to 65 °C, within 0.3 % of Walther's
    /// equation (physics.md E3).
    pub const VG100: ViscosityCubic = ViscosityCubic {
        centre_degc: 35.0,
        from_degc: 5.0,
        to_degc: 65.0,
        ln: [4.879_913, -0.057_158_1, 4.278_12e-4, -2.674_90e-6],
    };

    /// One viscosity at every temperature (a range is kept, so that the thermometer still matters).
    pub fn constant(viscosity_cst: f64, from_degc: f32, to_degc: f32) -> Self {
        ViscosityCubic {
            centre_degc: 0.5 * (from_degc + to_degc),
            from_degc,
            to_degc,
            ln: [libm::log(viscosity_cst) as f32, 0.0, 0.0, 0.0],
        }
    }

    /// Viscosity at a temperature, `None` outside the fitted range.
    pub fn at(&self, temperature_degc: f32) -> Option<Viscosity> {
        if !(temperature_degc >= self.from_degc && temperature_degc <= self.to_degc) {
            return None;
        }
        let t = temperature_degc - self.centre_degc;
        let [c0, c1, c2, c3] = self.ln;
        Some(Viscosity {
            cst: num::exp(c0 + t * (c1 + t * (c2 + t * c3))),
            per_kelvin: c1 + t * (2.0 * c2 + t * (3.0 * c3)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::zhou_2023::OIL;

    #[test]
    fn walther_reproduces_the_checked_table() {
        // physics.md E3
        for (t, nu) in [(10.0, 748.0), (20.0, 344.0), (30.0, 177.0), (40.0, 100.0), (50.0, 61.0), (60.0, 39.5)] {
            assert!((OIL.viscosity_cst(t) / nu - 1.0).abs() < 0.01, "{t}: {}", OIL.viscosity_cst(t));
        }
        let again = Walther::from_40_and_100(100.0, 11.0).expect("legal");
        assert!((again.a - OIL.a).abs() < 1e-5 && (again.b - OIL.b).abs() < 1e-5, "{again:?}");
    }

    #[test]
    fn cubic_follows_walther_within_three_per_mille() {
        for cubic in [ViscosityCubic::VG100, OIL.cubic(5.0, 65.0).expect("legal")] {
            for n in 0..=600 {
                let t = 5.0 + f64::from(n) / 10.0;
                let got = cubic.at(t as f32).expect("inside");
                assert!((f64::from(got.cst) / OIL.viscosity_cst(t) - 1.0).abs() < 3e-3, "{t}");
                let d = 1e-2;
                let slope = libm::log(OIL.viscosity_cst(t + d) / OIL.viscosity_cst(t - d)) / (2.0 * d);
                assert!((f64::from(got.per_kelvin) - slope).abs() < 2e-3, "{t}");
            }
            assert_eq!(cubic.at(4.99), None);
            assert_eq!(cubic.at(65.01), None);
            assert_eq!(cubic.at(f32::NAN), None);
        }
    }

    #[test]
    fn refuses_oils_that_thicken_when_hot() {
        assert!(Walther::from_40_and_100(10.0, 100.0).is_err());
        assert!(Walther::from_40_and_100(f64::NAN, 10.0).is_err());
        assert!(OIL.cubic(40.0, 40.0).is_err());
    }
}
