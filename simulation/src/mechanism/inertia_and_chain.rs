//! Forces that do not come from the guide: mass, chains.

use super::definition::{Definition, Form, Kind};
use super::id::Id;
use super::presliding::held_state;
use super::table::{COARSE, entries, over_stroke};
use super::{Free, Positive, STROKE, amplitude, ratio, shown};

/// E21: `F = M a`; below 0 where less moves than the simulation has.
pub(super) const INERTIA: Definition = Definition {
    id: Id::Inertia,
    kind: Kind::Physics,
    forms: &[Form {
        name: "minimal",
        shape: &[],
        amplitudes: &[amplitude("mass_kg", "kg", Free, 10.0)],
        columns: |context, _| {
            let a = &context.motion.acceleration_m_s2;
            a.iter()
                .any(|a| a.is_finite() && *a != 0.0)
                .then(|| vec![context.rows(|n| if a[n].is_finite() { a[n] } else { 0.0 })])
        },
        phase_bound: false,
        equation: "F = mass·dV/dt",
    }],
    axis: "acceleration",
    statement: "the drive accelerates another mass than the simulation has",
    falsifier: "a known mass put on the carriage does not add its own kilograms to the number",
    confused_with: "a delay or a low-pass of the force, which also act where speed changes: they do not grow in proportion \
                    to the acceleration",
    next_experiment: "known-mass",
    simplicity: 1,
};

/// E22: constant drag of the links, and their weight, of which the carriage lifts more as it moves.
pub(super) const CABLE_CHAIN: Definition = Definition {
    id: Id::CableChain,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[
                amplitude("drag_n", "N", Positive, 5.0),
                amplitude("force_per_m_n_m", "N/m", Free, 10.0),
                amplitude("force_n", "N", Free, 5.0),
            ],
            columns: |context, _| {
                if !context.motion.has_position {
                    return None;
                }
                let ones = vec![1.0; context.len()];
                shown(vec![context.against_motion(|_| 1.0), context.motion.position_m.clone(), ones])
            },
            phase_bound: true,
            equation: "F = drag·sign(V) + force + force_per_m·x",
        },
        Form {
            name: "bending",
            shape: &[],
            amplitudes: &[
                amplitude("drag_n", "N", Positive, 5.0),
                amplitude("force_per_m_n_m", "N/m", Free, 10.0),
                amplitude("force_per_m2_n_m2", "N/m2", Free, 10.0),
                amplitude("drag_per_m_n_m", "N/m", Free, 5.0),
                amplitude("force_n", "N", Free, 5.0),
            ],
            columns: |context, _| {
                if !context.motion.has_position {
                    return None;
                }
                let x = &context.motion.position_m;
                shown(vec![
                    context.against_motion(|_| 1.0),
                    x.clone(),
                    context.rows(|n| x[n] * x[n]),
                    context.against_motion(|n| x[n]),
                    vec![1.0; context.len()],
                ])
            },
            phase_bound: true,
            equation: "F = sign(V)·(drag + drag_per_m·x) + force + force_per_m·x + force_per_m2·x²",
        },
        Form {
            name: "rolling",
            shape: &[ratio("length_m", "m", 5e-3, 0.06, 5)],
            amplitudes: &[
                amplitude("drag_n", "N", Positive, 5.0),
                amplitude("bending_n", "N", Positive, 1.0),
                amplitude("force_per_m_n_m", "N/m", Free, 10.0),
                amplitude("force_per_m2_n_m2", "N/m2", Free, 10.0),
                amplitude("force_n", "N", Free, 5.0),
            ],
            columns: |context, shape| {
                let length = *shape.first()?;
                if !context.motion.has_position {
                    return None;
                }
                let x = &context.motion.position_m;
                shown(vec![
                    context.against_motion(|_| 1.0),
                    held_state(context, &|z, step| 1.0 - (1.0 - z) * libm::exp(-step / length)),
                    x.clone(),
                    context.rows(|n| x[n] * x[n]),
                    vec![1.0; context.len()],
                ])
            },
            phase_bound: true,
            equation: "F = drag·sign(V) + bending·z + force + force_per_m·x + force_per_m2·x², dz/dx = (1 - z·sign(V))/length: \
                       a link that bends the other way takes some travel",
        },
        Form {
            name: "profile",
            shape: &STROKE,
            amplitudes: &entries::<COARSE>("N", 5.0),
            columns: |context, shape| over_stroke(context, &vec![1.0; context.len()], COARSE, shape),
            phase_bound: true,
            equation: "F = w(x), piecewise linear between 16 entries from one end of the stroke to the other",
        },
    ],
    axis: "position",
    statement: "a cable chain, hose or bellows drags on the carriage and pulls it to one end of the stroke",
    falsifier: "with the chain disconnected the force is still there",
    confused_with: "seal drag for its constant part and a rail that is not straight for the other: disconnect it; the rail's \
                    part changes sign with direction",
    next_experiment: "disconnect-chain",
    simplicity: 4,
};
