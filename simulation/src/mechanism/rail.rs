//! What is tied to a place along the rail.

use super::column::{bump, even, shown, span, waves};
use super::definition::{Amplitude, Definition, Form, Kind, ShapeParameter, Sign, amplitude, place, scale};
use super::{Context, Id};

/// Places along a rail at which something local is looked for, m.
const PLACE: ShapeParameter = place("place_m", "m", -0.5, 2.0, 126);

const SINE: Amplitude = amplitude("sine", "", Sign::Free, 0.03);
const COSINE: Amplitude = amplitude("cosine", "", Sign::Free, 0.03);

/// `ΔF_p/F_p = a sin(2πx/λ) + b cos(2πx/λ)`; richer: with its second and third harmonic.
pub(super) const RAIL_STRAIGHTNESS: Definition = Definition {
    id: Id::RailStraightness,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "wave",
            shape: &[scale("wavelength_m", "m", 0.06, 1.2, 24)],
            amplitudes: &[SINE, COSINE],
            columns: |c, s| waves(c, s[0], 1, |n| c.by_preload_n[n]),
            phase_bound: true,
        },
        Form {
            name: "profile",
            shape: &[scale("wavelength_m", "m", 0.15, 1.6, 16)],
            amplitudes: &[
                SINE,
                COSINE,
                amplitude("sine_2", "", Sign::Free, 0.02),
                amplitude("cosine_2", "", Sign::Free, 0.02),
                amplitude("sine_3", "", Sign::Free, 0.01),
                amplitude("cosine_3", "", Sign::Free, 0.01),
            ],
            columns: |c, s| waves(c, s[0], 3, |n| c.by_preload_n[n]),
            phase_bound: true,
        },
    ],
    axis: "position",
    statement: "The rail is not straight, or its bolts bend it: the preload follows the place along the rail.",
    falsifier: "The same profile must come back on every pass, at every speed and in both directions.",
    next_experiment: "P4",
    simplicity: 3,
};

/// A bump of the preload as long as the loaded zone.
pub(super) const RAIL_JOINT: Definition = Definition {
    id: Id::RailJoint,
    kind: Kind::Physics,
    forms: &[Form {
        name: "bump",
        shape: &[place("place_m", "m", -0.5, 2.0, 84)],
        amplitudes: &[amplitude("preload_share", "", Sign::Free, 0.1)],
        columns: |c, s| {
            // twice the loaded length at its foot, that length at half its height
            local(c, s[0], 2.0 * c.geometry.loaded_length_m, |n| c.by_preload_n[n])
        },
        phase_bound: true,
    }],
    axis: "position",
    statement: "A joint between two rails, or a damaged place, changes the preload over the length of the block.",
    falsifier: "It must come back at the same place on every pass, as wide as the loaded zone is long.",
    next_experiment: "P4",
    simplicity: 4,
};

/// A short additional drag at one place.
pub(super) const CONTAMINATION: Definition = Definition {
    id: Id::Contamination,
    kind: Kind::Physics,
    forms: &[Form {
        name: "bump",
        shape: &[PLACE],
        amplitudes: &[amplitude("drag_n", "N", Sign::Positive, 5.0)],
        columns: |c, s| local(c, s[0], 0.025, |n| c.direction[n]),
        phase_bound: true,
    }],
    axis: "position",
    statement: "A particle on the raceway adds drag at one short place.",
    falsifier: "Cleaning must remove it; its width must stay the same in millimetres at every speed.",
    next_experiment: "P4",
    simplicity: 5,
};

/// `F = F_0 sign(V) + w x`: drag of a chain and the part of its weight that the carriage carries.
pub(super) const CABLE_CHAIN: Definition = Definition {
    id: Id::CableChain,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "linear",
            shape: &[],
            amplitudes: &[amplitude("per_metre_n_m", "N/m", Sign::Free, 5.0)],
            columns: |c, _| {
                c.motion.has_position.then_some(())?;
                shown([even(c, |n| c.motion.position_m[n])])
            },
            phase_bound: true,
        },
        Form {
            name: "linear-and-drag",
            shape: &[],
            amplitudes: &[
                amplitude("drag_n", "N", Sign::Positive, 5.0),
                amplitude("per_metre_n_m", "N/m", Sign::Free, 5.0),
            ],
            columns: |c, _| {
                c.motion.has_position.then_some(())?;
                shown([c.direction.clone(), even(c, |n| c.motion.position_m[n])])
            },
            phase_bound: true,
        },
    ],
    axis: "position",
    statement: "A cable chain, hose or bellows pulls with a force that depends on where the carriage is.",
    falsifier: "With the chain disconnected it must be gone; it must not change with the direction.",
    next_experiment: "disconnect-chain",
    simplicity: 3,
};

/// A raised cosine at a place, where the carriage comes by.
fn local(c: &Context<'_>, place_m: f64, width_m: f64, of: impl Fn(usize) -> f64) -> Option<Vec<Vec<f64>>> {
    let x = &c.motion.position_m;
    let (low, high) = span(x);
    // half of it at least has to be seen
    let is_there = c.motion.has_position && place_m > low && place_m < high && high - low > width_m;
    is_there.then_some(())?;
    shown([even(c, |n| of(n) * bump(x[n] - place_m, width_m))])
}
