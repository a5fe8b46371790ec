//! Sensors and converters: SI in, counts out, with the noise and the limits that the real ones have.

use model_core::calibration::{CODE_MAX, Calibration};

use super::noise::Noise;

/// Noise of the two analogue channels, standard deviations in codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelNoise {
    /// Force channel.
    pub force_codes: f64,
    /// Temperature channel.
    pub temperature_codes: f64,
}

impl ChannelNoise {
    /// A strain-gauge bridge behind its amplifier and a plain divider, as 12-bit converters of
    /// microcontrollers see them. With noise below about half a code, averaging would no longer help.
    pub const BENCH: ChannelNoise = ChannelNoise { force_codes: 1.5, temperature_codes: 0.8 };
}

/// The analogue and digital inputs of one block.
#[derive(Clone, Debug)]
pub struct FrontEnd {
    calibration: Calibration,
    noise: ChannelNoise,
    source: Noise,
}

impl FrontEnd {
    /// Sensors with this calibration; the seed decides the noise.
    pub fn new(calibration: Calibration, noise: ChannelNoise, seed: u64) -> Self {
        FrontEnd { calibration, noise, source: Noise::new(seed) }
    }

    /// Code of a drag force, N: noise, rounding, clipping at the rails.
    pub fn force_code(&mut self, newtons: f64) -> u16 {
        let code = f64::from(self.calibration.force.code(newtons as f32));
        clip(code + self.noise.force_codes * self.source.gaussian())
    }

    /// Code of a temperature, °C; `None` (not measured) reads as an open thermistor: the upper rail.
    pub fn temperature_code(&mut self, degc: Option<f64>) -> u16 {
        match degc {
            Some(degc) => {
                let code = f64::from(self.calibration.thermistor.code(degc as f32));
                clip(code + self.noise.temperature_codes * self.source.gaussian())
            }
            None => CODE_MAX,
        }
    }

    /// Encoder counts (edges) passed at a position, m, from the scale's zero; negative below it.
    pub fn encoder_count(&self, position_m: f64) -> i64 {
        // a cast saturates: beyond 4e13 m the scale ends
        (position_m / f64::from(self.calibration.metres_per_count)).floor() as i64
    }
}

fn clip(code: f64) -> u16 {
    // a cast takes not-a-number to zero, a rail, which the block then reports
    code.round().clamp(0.0, f64::from(CODE_MAX)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: ChannelNoise = ChannelNoise { force_codes: 0.0, temperature_codes: 0.0 };

    #[test]
    fn inverts_the_calibration_to_half_a_code() {
        let c = Calibration::BENCH;
        let mut front = FrontEnd::new(c, QUIET, 0);
        for n in -99..=99 {
            let code = front.force_code(f64::from(n));
            assert!((c.force.newtons(f32::from(code)) - n as f32).abs() <= 0.501 * c.force.newtons_per_code);
        }
        for degc in [5.0, 24.0, 33.0, 65.0] {
            let code = f32::from(front.temperature_code(Some(degc)));
            let degc_at = |code: f32| f64::from(c.thermistor.degc(code).expect("inside"));
            // the NTC's code falls with temperature
            assert!((degc_at(code + 0.51)..=degc_at(code - 0.51)).contains(&degc), "{degc}");
        }
        for (position, count) in [(0.0, 0), (4.9e-6, 0), (5.1e-6, 1), (-0.1e-6, -1), (0.15, 30_000)] {
            assert_eq!(front.encoder_count(position), count, "{position}");
        }
    }

    #[test]
    fn clips_at_the_rails() {
        let mut front = FrontEnd::new(Calibration::BENCH, QUIET, 0);
        assert_eq!(front.force_code(1000.0), 4095);
        assert_eq!(front.force_code(-1000.0), 0);
        assert_eq!(front.force_code(f64::NAN), 0);
        assert_eq!(front.temperature_code(None), 4095);
    }

    #[test]
    fn noise_has_the_stated_size() {
        let mut front = FrontEnd::new(Calibration::BENCH, ChannelNoise::BENCH, 3);
        let codes: Vec<_> = (0..20_000).map(|_| f64::from(front.force_code(0.0))).collect();
        let mean = codes.iter().sum::<f64>() / codes.len() as f64;
        let variance = codes.iter().map(|c| (c - mean) * (c - mean)).sum::<f64>() / codes.len() as f64;
        // rounding adds a twelfth
        assert!((variance - (1.5 * 1.5 + 1.0 / 12.0)).abs() < 0.1, "{variance}");
        assert!((mean - 2048.0).abs() < 0.05);
    }
}
