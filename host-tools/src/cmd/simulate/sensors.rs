//! Sensors between the simulation and the recording.

use clap::ValueEnum;
use host_tools::simulate::block_sensors;
use simulation::sensor::Sensors;

use super::super::{Failure, seed};

/// Sets of sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Preset {
    /// bridge, thermistor, encoder and converters of the guide block: noise, steps, rails; no velocity column
    Block,
}

/// Sensors of a driven profile.
#[derive(clap::Args, Clone, Debug, Default)]
pub(super) struct SensorArguments {
    /// Sensors to start from; the options below go before what they say. Without any, nothing is disturbed
    #[arg(long, requires = "profile", help_heading = "Sensors (with --profile)")]
    pub(super) sensors: Option<Preset>,
    /// White noise of the force over the force, standard deviation, as 0.01
    #[arg(long, value_name = "SHARE", requires = "profile", help_heading = "Sensors (with --profile)")]
    noise_relative: Option<f64>,
    /// White noise of the force, standard deviation, N
    #[arg(long, value_name = "N", requires = "profile", help_heading = "Sensors (with --profile)")]
    noise_n: Option<f64>,
    /// Steps of the force, N
    #[arg(long, value_name = "N", requires = "profile", help_heading = "Sensors (with --profile)")]
    quantum_n: Option<f64>,
    /// First-order low-pass of the force, before the noise, Hz
    #[arg(long, value_name = "HZ", requires = "profile", help_heading = "Sensors (with --profile)")]
    lowpass_hz: Option<f64>,
    /// White noise of the velocity, standard deviation, m/s
    #[arg(long, value_name = "M/S", requires = "profile", help_heading = "Sensors (with --profile)")]
    pub(super) speed_noise: Option<f64>,
    /// Steps of the position, m
    #[arg(long, value_name = "M", requires = "profile", help_heading = "Sensors (with --profile)")]
    position_quantum_m: Option<f64>,
    /// White noise of the temperatures, standard deviation, K
    #[arg(long, value_name = "K", requires = "profile", help_heading = "Sensors (with --profile)")]
    temperature_noise: Option<f64>,
    /// Decides the noise: the same seed gives the same bytes
    #[arg(long, default_value_t = 1, value_parser = seed, requires = "profile", help_heading = "Sensors (with --profile)")]
    pub(super) seed: u64,
}

impl SensorArguments {
    /// The sensors that were asked for.
    pub(super) fn sensors(&self) -> Result<Sensors, Failure> {
        let from = self.sensors.map_or_else(Sensors::default, |Preset::Block| block_sensors());
        let sensors = Sensors {
            noise_relative: self.noise_relative.unwrap_or(from.noise_relative),
            noise_n: self.noise_n.unwrap_or(from.noise_n),
            quantum_n: self.quantum_n.unwrap_or(from.quantum_n),
            lowpass_hz: self.lowpass_hz.or(from.lowpass_hz),
            speed_noise_m_s: self.speed_noise.unwrap_or(from.speed_noise_m_s),
            position_quantum_m: self.position_quantum_m.unwrap_or(from.position_quantum_m),
            temperature_noise_k: self.temperature_noise.unwrap_or(from.temperature_noise_k),
            ..from
        };
        sensors.check().map_err(|why| Failure::Usage(format!("--{why}")))?;
        Ok(sensors)
    }

    /// Whether the velocity is measured at all.
    pub(super) fn has_velocity(&self) -> bool {
        self.sensors.is_none() || self.speed_noise.is_some()
    }
}
