//! Every mechanism.

use super::definition::Definition;
use super::{
    Id, direction, dynamics, load, oil, presliding, rail, ripple, seals, sensor_dynamics, sensor_level, temperature,
    travel,
};

/// In the order of [`Id::ALL`].
static LIBRARY: [Definition; Id::ALL.len()] = [
    seals::SEAL_DRAG,
    seals::VISCOUS_DRAG,
    temperature::VISCOSITY_TEMPERATURE,
    temperature::SELF_HEATING,
    oil::HYSTERESIS_AND_SLIP,
    oil::HYDRODYNAMIC_ROLLING,
    oil::TRACTION_SATURATION,
    oil::STRIBECK,
    oil::STARVATION,
    travel::RUN_IN,
    load::EXTERNAL_LOAD,
    load::MOMENT_LOAD,
    rail::RAIL_STRAIGHTNESS,
    rail::RAIL_JOINT,
    travel::PRELOAD_LOSS,
    temperature::THERMAL_PRELOAD,
    direction::DIRECTION_ASYMMETRY,
    direction::GRAVITY_TILT,
    dynamics::INERTIA,
    rail::CABLE_CHAIN,
    ripple::DRIVE_RIPPLE,
    rail::CONTAMINATION,
    ripple::BALL_PASS,
    presliding::PRESLIDING,
    dynamics::FRICTIONAL_LAG,
    presliding::BREAKAWAY_DWELL,
    dynamics::STRUCTURAL_RESONANCE,
    sensor_level::FORCE_OFFSET,
    sensor_level::FORCE_DRIFT,
    sensor_level::FORCE_GAIN,
    sensor_level::LOAD_CROSSTALK,
    sensor_dynamics::FORCE_LOWPASS,
    sensor_dynamics::TIME_MISALIGNMENT,
    sensor_level::FORCE_QUANTISATION,
    sensor_level::FORCE_SATURATION,
    presliding::COUPLING_BACKLASH,
    sensor_level::SPEED_NOISE,
    ripple::ENCODER_CYCLIC_ERROR,
];

/// Every mechanism, in the order of [`Id::ALL`].
pub fn library() -> &'static [Definition] {
    &LIBRARY
}

/// The description of a mechanism.
pub fn definition(id: Id) -> &'static Definition {
    // held to the order of the names by a test
    &LIBRARY[id as usize]
}
