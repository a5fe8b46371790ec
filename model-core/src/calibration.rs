//! Counts to SI units and back, both directions side by side.

use crate::Error;
use crate::num;
use crate::quantity::check_f32;

/// Largest code of the converters.
pub const CODE_MAX: u16 = 4095;

/// 0 °C in K.
const ZERO_CELSIUS_K: f32 = 273.15;

/// How one block's sensors turn physics into counts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Calibration {
    /// Drag-force bridge.
    pub force: ForceScale,
    /// Thermometer in the block.
    pub thermistor: Thermistor,
    /// Travel per encoder count (quadrature edge), m; negative when the scale counts the other way.
    pub metres_per_count: f32,
}

/// Linear scale of the force converter: `F = (code - zero)·newtons_per_code`.
///
/// F is the force the drive applies to the carriage, positive towards larger positions.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct ForceScale {
    /// Code without force.
    pub zero_code: f32,
    /// Force of one code, N.
    pub newtons_per_code: f32,
    /// Codes at or below this one are the lower rail.
    pub rail_low_code: u16,
    /// Codes at or above this one are the upper rail.
    pub rail_high_code: u16,
}

impl ForceScale {
    /// Force of a (mean) code, N.
    #[inline]
    pub fn newtons(&self, code: f32) -> f32 {
        (code - self.zero_code) * self.newtons_per_code
    }

    /// Code of a force, with its fraction and not clipped to the converter's range.
    pub fn code(&self, newtons: f32) -> f32 {
        newtons / self.newtons_per_code + self.zero_code
    }
}

/// NTC thermistor to ground under a series resistor to the converter's reference.
///
/// `R = R_s·code/(4095 - code)`, `1/T = 1/T_0 + ln(R/R_0)/β`. Open reads as the upper rail, a short as the lower.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Thermistor {
    /// Resistance R_0 at 25 °C, ohm.
    pub nominal_ohm: f32,
    /// β, K.
    pub beta_k: f32,
    /// Series resistor R_s, ohm.
    pub series_ohm: f32,
}

impl Thermistor {
    /// Codes closer than this to an end of the range are an open or shorted thermistor: with the values of
    /// [`Calibration::BENCH`] they stand for temperatures below -55 °C and above 250 °C.
    pub const RAIL_CODES: f32 = 16.0;

    /// Temperature of a (mean) code, °C; `None` when the thermistor is open or short.
    pub fn degc(&self, code: f32) -> Option<f32> {
        if !(code > Self::RAIL_CODES && code < CODE_MAX as f32 - Self::RAIL_CODES) {
            return None;
        }
        let ratio = self.series_ohm * code / ((CODE_MAX as f32 - code) * self.nominal_ohm);
        let inverse = 1.0 / (ZERO_CELSIUS_K + 25.0) + num::ln(ratio) / self.beta_k;
        Some(1.0 / inverse - ZERO_CELSIUS_K)
    }

    /// Code of a temperature, with its fraction.
    pub fn code(&self, degc: f32) -> f32 {
        let exponent = self.beta_k * (1.0 / (ZERO_CELSIUS_K + degc) - 1.0 / (ZERO_CELSIUS_K + 25.0));
        let r = self.nominal_ohm * num::exp(exponent);
        CODE_MAX as f32 * r / (r + self.series_ohm)
    }
}

impl Calibration {
    /// The bench the project is developed on: a bridge of ±100 N full scale, a 5 µm linear encoder
    /// (20 µm pitch, four edges), a 10 kΩ NTC with β = 3435 K under 10 kΩ.
    pub const BENCH: Calibration = Calibration {
        force: ForceScale {
            zero_code: 2048.0,
            newtons_per_code: 100.0 / 2048.0,
            rail_low_code: 8,
            rail_high_code: 4087,
        },
        thermistor: Thermistor { nominal_ohm: 10_000.0, beta_k: 3435.0, series_ohm: 10_000.0 },
        metres_per_count: 5e-6,
    };

    /// Checks every field against [`RANGES`](crate::quantity::RANGES).
    ///
    /// # Errors
    /// The first field that is not finite or out of range, by name; a scale of zero is out of range.
    pub fn check(&self) -> Result<(), Error> {
        check_f32("zero_code", self.force.zero_code)?;
        check_f32("newtons_per_code", self.force.newtons_per_code)?;
        check_f32("rail_low_code", f32::from(self.force.rail_low_code))?;
        check_f32("rail_high_code", f32::from(self.force.rail_high_code))?;
        check_f32("thermistor_ohm", self.thermistor.nominal_ohm)?;
        check_f32("thermistor_ohm", self.thermistor.series_ohm)?;
        check_f32("thermistor_beta_k", self.thermistor.beta_k)?;
        check_f32("metres_per_count", self.metres_per_count)?;
        if self.force.newtons_per_code == 0.0 {
            return Err(Error::OutOfRange("newtons_per_code"));
        }
        // below a nanometre a count, guard distances would not fit an i32
        if self.metres_per_count.abs() < 1e-9 {
            return Err(Error::OutOfRange("metres_per_count"));
        }
        if self.force.rail_low_code >= self.force.rail_high_code {
            return Err(Error::OutOfRange("rail_high_code"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_directions_agree() {
        let c = Calibration::BENCH;
        for n in -99..=99 {
            assert!((c.force.newtons(c.force.code(n as f32)) - n as f32).abs() < 1e-4);
        }
        for n in -40..=120 {
            let back = c.thermistor.degc(c.thermistor.code(n as f32)).expect("inside");
            assert!((back - n as f32).abs() < 2e-3, "{n}: {back}");
        }
        assert!((c.thermistor.code(25.0) - 2047.5).abs() < 1e-2);
    }

    #[test]
    fn open_and_short_are_no_temperature() {
        let t = Calibration::BENCH.thermistor;
        assert_eq!(t.degc(4095.0), None);
        assert_eq!(t.degc(4085.0), None);
        assert_eq!(t.degc(0.0), None);
        assert_eq!(t.degc(f32::NAN), None);
        // the stated meaning of the rails
        assert!(t.degc(4078.9).expect("inside") < -50.0);
        assert!(t.degc(16.1).expect("inside") > 200.0);
    }

    #[test]
    fn a_scale_of_zero_is_refused() {
        let mut c = Calibration::BENCH;
        assert_eq!(c.check(), Ok(()));
        c.metres_per_count = 0.0;
        assert_eq!(c.check(), Err(Error::OutOfRange("metres_per_count")));
        c = Calibration::BENCH;
        c.force.newtons_per_code = f32::NAN;
        assert_eq!(c.check(), Err(Error::NonFinite("newtons_per_code")));
        c = Calibration::BENCH;
        c.force.rail_high_code = 8;
        assert_eq!(c.check(), Err(Error::OutOfRange("rail_high_code")));
    }
}
