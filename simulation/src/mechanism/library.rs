//! All mechanisms, in the order of [`Id::ALL`](super::Id::ALL).

use super::definition::Definition;
use super::id::Id;
use super::{
    contacts, direction, encoder, inertia_and_chain, load, periodic, presliding, rail, resonance, seals_and_oil,
    sensor_dynamics, sensor_level, temperature, travel,
};

/// The library.
pub fn library() -> &'static [Definition] {
    LIBRARY
}

/// Definition of a mechanism.
pub fn definition(id: Id) -> &'static Definition {
    // every id has its definition at its own index, see below
    &LIBRARY[id as usize]
}

const LIBRARY: &[Definition] = &[
    seals_and_oil::SEAL_DRAG,
    seals_and_oil::VISCOUS_DRAG,
    temperature::VISCOSITY_TEMPERATURE,
    temperature::SELF_HEATING,
    contacts::HYSTERESIS_AND_SLIP,
    contacts::HYDRODYNAMIC_ROLLING,
    contacts::TRACTION_SATURATION,
    contacts::STRIBECK,
    contacts::STARVATION,
    travel::RUN_IN,
    load::EXTERNAL_LOAD,
    load::MOMENT_LOAD,
    rail::RAIL_STRAIGHTNESS,
    rail::RAIL_JOINT,
    travel::PRELOAD_LOSS,
    temperature::THERMAL_PRELOAD,
    direction::DIRECTION_ASYMMETRY,
    direction::GRAVITY_TILT,
    inertia_and_chain::INERTIA,
    inertia_and_chain::CABLE_CHAIN,
    periodic::DRIVE_RIPPLE,
    rail::CONTAMINATION,
    periodic::BALL_PASS,
    presliding::PRESLIDING,
    presliding::FRICTIONAL_LAG,
    presliding::BREAKAWAY_DWELL,
    resonance::STRUCTURAL_RESONANCE,
    sensor_level::FORCE_OFFSET,
    sensor_level::FORCE_DRIFT,
    sensor_level::FORCE_GAIN,
    sensor_level::LOAD_CROSSTALK,
    sensor_dynamics::FORCE_LOWPASS,
    sensor_dynamics::TIME_MISALIGNMENT,
    sensor_level::FORCE_QUANTISATION,
    sensor_level::FORCE_SATURATION,
    encoder::COUPLING_BACKLASH,
    encoder::SPEED_NOISE,
    encoder::ENCODER_CYCLIC_ERROR,
];

/// A library without an id, or in another order, does not compile.
const _: () = {
    assert!(LIBRARY.len() == Id::ALL.len(), "one definition for each id");
    let mut n = 0;
    while n < LIBRARY.len() {
        assert!(LIBRARY[n].id as usize == n, "definitions stand in the order of the ids");
        n += 1;
    }
};
