//! What is tied to a place of the rail.

use std::f64::consts::TAU;

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind, ShapeParameter};
use super::id::Id;
use super::{Free, Positive, amplitude, ratio, shown, steps};

/// Half the loaded length of an SHS35 between two places that are tried.
const PLACE: ShapeParameter = steps("place_m", "m", -1.5, 3.0, 91);

/// E15: `dF_p/F_p = 1.5 e(x)/D` with a slow wave e(x).
pub(super) const RAIL_STRAIGHTNESS: Definition = Definition {
    id: Id::RailStraightness,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("wavelength_m", "m", 0.15, 4.0, 12)],
            amplitudes: &[amplitude("sine", "", Free, 0.05), amplitude("cosine", "", Free, 0.05)],
            columns: |context, shape| waves(context, *shape.first()?, 1),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/dlnF_p, k = 2π/wavelength",
        },
        Form {
            name: "three-orders",
            // orders of a wave much longer than the stroke cancel within it and run away beyond
            shape: &[ratio("wavelength_m", "m", 0.2, 1.5, 10)],
            amplitudes: &[
                amplitude("sine_1", "", Free, 0.05),
                amplitude("cosine_1", "", Free, 0.05),
                amplitude("sine_2", "", Free, 0.03),
                amplitude("cosine_2", "", Free, 0.03),
                amplitude("sine_3", "", Free, 0.02),
                amplitude("cosine_3", "", Free, 0.02),
            ],
            columns: |context, shape| waves(context, *shape.first()?, 3),
            phase_bound: true,
            equation: "as minimal, with the second and third order of the wave",
        },
    ],
    axis: "position",
    statement: "the rail is not straight or not parallel: the preload changes along it",
    falsifier: "a map over the stroke at another speed does not repeat the wave, or both directions do not share it",
    confused_with: "the weight of a cable chain or a tilt that changes along the rail, which do not change sign with \
                    direction; bolts, by their pitch",
    next_experiment: "P4",
    simplicity: 3,
};

fn waves(context: &Context<'_>, wavelength: f64, orders: u32) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    let force = context.by_load_n();
    shown(context.waves(&force, wavelength, orders))
}

impl Context<'_> {
    /// A force times sine and cosine of the place, order by order.
    pub(super) fn waves(&self, force: &[f64], wavelength: f64, orders: u32) -> Columns {
        let mut columns = vec![vec![0.0; self.len()]; 2 * orders as usize];
        for (n, (force, x)) in force.iter().zip(&self.motion.position_m).enumerate() {
            // the wave number may be that of a micrometre over metres: whole periods are taken off first
            let (sin, cos) = libm::sincos(TAU * (x / wavelength).fract());
            let (mut s, mut c) = (0.0, 1.0);
            for [sine, cosine] in columns.as_chunks_mut::<2>().0 {
                (s, c) = (s * cos + c * sin, c * cos - s * sin);
                (sine[n], cosine[n]) = (force * s, force * c);
            }
        }
        columns
    }

    /// How far the loaded length has passed a place, row by row: 0 before, 1 beyond. `None` where no row lies near.
    fn passed(&self, place: f64) -> Option<Vec<f64>> {
        if !self.motion.has_position {
            return None;
        }
        let length = self.geometry.loaded_length_m;
        let share = |x: f64| (0.5 + (x - place) / length).clamp(0.0, 1.0);
        let inside = self.motion.position_m.iter().any(|x| (0.0..1.0).contains(&share(*x)) && share(*x) > 0.0);
        inside.then(|| self.motion.position_m.iter().map(|x| share(*x)).collect())
    }
}

/// E16: while the block stands on both rails, its balls disagree about the height.
pub(super) const RAIL_JOINT: Definition = Definition {
    id: Id::RailJoint,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[PLACE],
            amplitudes: &[amplitude("preload", "", Free, 0.1)],
            columns: |context, shape| {
                let share = context.passed(*shape.first()?)?;
                let force = context.by_load_n();
                shown(vec![context.rows(|n| force[n] * 4.0 * share[n] * (1.0 - share[n]))])
            },
            phase_bound: true,
            equation: "F = preload·4q(1 - q)·dF_law/dlnF_p, q the share of the loaded length beyond place",
        },
        Form {
            name: "step",
            shape: &[PLACE],
            amplitudes: &[amplitude("preload", "", Free, 0.1), amplitude("preload_beyond", "", Free, 0.1)],
            columns: |context, shape| {
                let share = context.passed(*shape.first()?)?;
                let force = context.by_load_n();
                let on = context.rows(|n| force[n] * 4.0 * share[n] * (1.0 - share[n]));
                shown(vec![on, context.rows(|n| force[n] * share[n])])
            },
            phase_bound: true,
            equation: "as minimal, and preload_beyond·q: the second rail lies at another height",
        },
    ],
    axis: "position",
    statement: "a step between two rails changes the preload while the block crosses it",
    falsifier: "the bump moves, or comes and goes, when the map over the stroke is repeated",
    confused_with: "dirt at that place: clean the rail and repeat",
    next_experiment: "P4",
    simplicity: 4,
};

/// E24: dirt on the rail costs every ball that crosses it; a particle stuck to a ball comes back with its turns.
pub(super) const CONTAMINATION: Definition = Definition {
    id: Id::Contamination,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[PLACE],
            amplitudes: &[amplitude("drag_n", "N", Positive, 10.0)],
            columns: |context, shape| {
                let on = patch(context, *shape.first()?)?;
                shown(vec![context.against_motion(|n| on[n])])
            },
            phase_bound: true,
            equation: "F = drag·sign(V) while the loaded length covers place, rising and falling over one ball pitch",
        },
        Form {
            name: "later",
            shape: &[steps("place_m", "m", -1.5, 3.0, 46), ratio("after_travel_m", "m", 0.5, 50.0, 3)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 10.0)],
            columns: |context, shape| {
                let on = patch(context, *shape.first()?)?;
                let after = *shape.get(1)?;
                let there = |n: usize| if context.travel_m[n] >= after { on[n] } else { 0.0 };
                shown(vec![context.against_motion(there)])
            },
            phase_bound: true,
            equation: "as minimal, from after_travel on",
        },
        Form {
            name: "particle",
            // half a turn of a ball between its two contacts: 2π times its radius of travel
            shape: &[ratio("wavelength_m", "m", 0.0190, 0.0210, 60)],
            amplitudes: &[amplitude("sine", "", Free, 0.02), amplitude("cosine", "", Free, 0.02)],
            columns: |context, shape| waves(context, *shape.first()?, 1),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/dlnF_p at half a turn of a ball, about 19.9 mm",
        },
    ],
    axis: "position",
    statement: "dirt on the rail or on a ball adds friction where it is rolled over",
    falsifier: "the friction is still there after the rail was cleaned and the block relubricated",
    confused_with: "a rail joint, which stays where it is; electrical spikes, which are short in time and not in distance",
    next_experiment: "relubricate",
    simplicity: 5,
};

/// Part of the loaded length that a place lies under, smooth over one ball pitch.
fn patch(context: &Context<'_>, place: f64) -> Option<Vec<f64>> {
    context.passed(place)?;
    let geometry = &context.geometry;
    let half = 0.5 * geometry.loaded_length_m;
    let of = |x: &f64| (0.5 + (half - (x - place).abs()) / geometry.ball_pitch_m).clamp(0.0, 1.0);
    Some(context.motion.position_m.iter().map(of).collect())
}
