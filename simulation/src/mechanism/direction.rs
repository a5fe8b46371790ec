//! Differences between the directions of motion.

use super::definition::{Definition, Form, Kind};
use super::id::Id;
use super::{Free, amplitude, shown};

/// E19: friction differs between the directions.
pub(super) const DIRECTION_ASYMMETRY: Definition = Definition {
    id: Id::DirectionAsymmetry,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("part", "", Free, 0.05)],
            columns: |context, _| {
                let sign = &context.steady.direction;
                shown(vec![context.rows(|n| if sign[n] == 0.0 { 0.0 } else { context.steady.drag_n[n] })])
            },
            phase_bound: false,
            equation: "F = part·|F_law|: sign(V)·F_law in both directions",
        },
        Form {
            name: "by-speed",
            shape: &[],
            amplitudes: &[amplitude("part", "", Free, 0.05), amplitude("viscous_n_s_m", "N s/m", Free, 5.0)],
            columns: |context, _| {
                let sign = &context.steady.direction;
                let moving = |n: usize| sign[n] != 0.0;
                shown(vec![
                    context.rows(|n| if moving(n) { context.steady.drag_n[n] } else { 0.0 }),
                    context.rows(|n| if moving(n) { context.speed_m_s(n) } else { 0.0 }),
                ])
            },
            phase_bound: false,
            equation: "F = part·|F_law| + viscous·|V|",
        },
    ],
    axis: "direction",
    statement: "the friction is not the same in both directions",
    falsifier: "the difference stays with the rail, and not with the block, when the block is turned round",
    confused_with: "a tilt of the rail or an offset of the sensor, which do not scale with the friction: turn the block, or \
                    change speed and load",
    next_experiment: "turn-block",
    simplicity: 3,
};

/// E20: `F = M g sin(θ)`.
pub(super) const GRAVITY_TILT: Definition = Definition {
    id: Id::GravityTilt,
    kind: Kind::Physics,
    forms: &[Form {
        name: "minimal",
        shape: &[],
        amplitudes: &[amplitude("force_n", "N", Free, 1.0)],
        columns: |context, _| Some(vec![vec![1.0; context.len()]]),
        phase_bound: false,
        equation: "F = force: mass·g·sin(tilt)",
    }],
    axis: "direction",
    statement: "the rail is not level: the weight pulls the carriage to one side",
    falsifier: "a heavier carriage does not raise the force in proportion",
    confused_with: "an offset of the force sensor, exactly so: change the mass, or read the sensor without the carriage",
    next_experiment: "known-mass",
    simplicity: 2,
};
