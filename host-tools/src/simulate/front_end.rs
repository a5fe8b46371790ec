//! The block's own sensors, as a recording of its raw samples shows them.

use model_core::calibration::{CODE_MAX, Calibration};
use simulation::sensor::Sensors;

use crate::rig::front_end::ChannelNoise;

/// Temperature at which the thermistor's noise is converted from codes to kelvin, °C.
const AT_DEGC: f32 = 25.0;

/// Bridge, thermistor and encoder of the bench's block: noise and steps of its 12-bit converters, their rails, the
/// edges of its encoder. It has no filter in front of its converters and no sensor of speed.
pub fn block_sensors() -> Sensors {
    let Calibration { force, thermistor, metres_per_count } = Calibration::BENCH;
    let per_code = f64::from(force.newtons_per_code.abs());
    let at = |code: f64| (code - f64::from(force.zero_code)) * f64::from(force.newtons_per_code);
    let (first, last) = (at(0.0), at(f64::from(CODE_MAX)));
    let codes_per_kelvin = 0.5 * f64::from(thermistor.code(AT_DEGC - 1.0) - thermistor.code(AT_DEGC + 1.0)).abs();
    Sensors {
        noise_n: ChannelNoise::BENCH.force_codes * per_code,
        quantum_n: per_code,
        rails_n: Some((first.min(last), first.max(last))),
        position_quantum_m: f64::from(metres_per_count.abs()),
        temperature_noise_k: ChannelNoise::BENCH.temperature_codes / codes_per_kelvin,
        ..Sensors::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_block_s_sensors_are_those_of_its_bench() {
        let sensors = block_sensors();
        assert_eq!(sensors.check(), Ok(()));
        assert!((sensors.quantum_n - 100.0 / 2048.0).abs() < 1e-9);
        assert!((sensors.noise_n - 0.0732).abs() < 1e-4, "{}", sensors.noise_n);
        assert_eq!(sensors.rails_n.map(|(low, _)| low), Some(-100.0));
        // about 40 codes a kelvin
        assert!((0.01..0.05).contains(&sensors.temperature_noise_k), "{}", sensors.temperature_noise_k);
    }
}
