//! What differs between the directions, or does not ask for them.

use super::Id;
use super::column::{drag, even, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude};

/// `F = D (1 + a d)`: the friction's own even part; richer: with one that grows with speed.
pub(super) const DIRECTION_ASYMMETRY: Definition = Definition {
    id: Id::DirectionAsymmetry,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "of-friction",
            shape: &[],
            amplitudes: &[amplitude("share", "", Sign::Free, 0.05)],
            columns: |c, _| shown([even(c, |n| drag(c, n))]),
            phase_bound: false,
        },
        Form {
            name: "of-speed",
            shape: &[],
            amplitudes: &[amplitude("viscous_n_s_m", "N s/m", Sign::Free, 10.0)],
            columns: |c, _| shown([even(c, |n| c.motion.velocity_m_s[n].abs())]),
            phase_bound: false,
        },
        Form {
            name: "of-friction-and-speed",
            shape: &[],
            amplitudes: &[
                amplitude("share", "", Sign::Free, 0.05),
                amplitude("viscous_n_s_m", "N s/m", Sign::Free, 10.0),
            ],
            columns: |c, _| shown([even(c, |n| drag(c, n)), even(c, |n| c.motion.velocity_m_s[n].abs())]),
            phase_bound: false,
        },
    ],
    axis: "direction",
    statement: "Friction differs between the two directions: seal lips, recirculation, a worn flank.",
    falsifier: "Turned round on its rail, the block must show the difference the other way round.",
    next_experiment: "turn-block",
    simplicity: 3,
};

/// `F = M g sin θ`: the same in both directions, at every speed.
pub(super) const GRAVITY_TILT: Definition = Definition {
    id: Id::GravityTilt,
    kind: Kind::Physics,
    forms: &[Form {
        name: "constant",
        shape: &[],
        amplitudes: &[amplitude("force_n", "N", Sign::Free, 1.0)],
        columns: |c, _| Some(vec![vec![1.0; c.len()]]),
        phase_bound: false,
    }],
    axis: "direction",
    statement: "The axis is not level: the weight of the carriage pulls one way.",
    falsifier: "Another mass on the carriage must change it in proportion.",
    next_experiment: "known-mass",
    simplicity: 2,
};
