//! Irreversible changes with the distance travelled.

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Negative, Positive, along_travel, amplitude, ratio, shown};

/// E12: `F = A exp(-s/s_g)`.
pub(super) const RUN_IN: Definition = Definition {
    id: Id::RunIn,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[along_travel("length_m", 0.5, 500.0, 7)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0)],
            columns: |context, shape| {
                let decay = decay(context, *shape.first()?);
                shown(vec![context.against_motion(|n| decay[n])])
            },
            phase_bound: false,
            equation: "F = drag·sign(V)·exp(-travel/length)",
        },
        Form {
            name: "two-stage",
            shape: &[along_travel("length_m", 0.5, 500.0, 7), along_travel("slow_length_m", 2.0, 500.0, 6)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0), amplitude("slow_drag_n", "N", Positive, 1.0)],
            columns: |context, shape| {
                let (first, then) = (decay(context, *shape.first()?), decay(context, *shape.get(1)?));
                shown(vec![context.against_motion(|n| first[n]), context.against_motion(|n| then[n])])
            },
            phase_bound: false,
            equation: "F = sign(V)·(drag·exp(-travel/length) + slow_drag·exp(-travel/slow_length))",
        },
        Form {
            name: "with-load",
            shape: &[along_travel("length_m", 0.5, 500.0, 7)],
            amplitudes: &[
                amplitude("drag_n", "N", Positive, 5.0),
                amplitude("part_of_drag", "", Positive, 0.1),
                amplitude("rest_n", "N", Positive, 1.0),
            ],
            columns: |context, shape| {
                let decay = decay(context, *shape.first()?);
                let churned = context.against_motion(|n| decay[n]);
                let load = context.against_motion(|n| context.steady.drag_n[n] * decay[n]);
                shown(vec![churned, load, context.against_motion(|_| 1.0)])
            },
            phase_bound: false,
            equation: "F = sign(V)·((drag + part_of_drag·F_law)·exp(-travel/length) + rest)",
        },
        Form {
            name: "hyperbolic",
            shape: &[along_travel("half_m", 0.5, 500.0, 7)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0)],
            columns: |context, shape| {
                let half = *shape.first()?;
                shown(vec![context.against_motion(|n| 1.0 / (1.0 + context.travel_m[n] / half))])
            },
            phase_bound: false,
            equation: "F = drag·sign(V)/(1 + travel/half)",
        },
    ],
    axis: "travel",
    statement: "fresh grease or new seals add a friction that wears off with the distance run",
    falsifier: "after a pause the friction is back, or it falls by time and not by distance",
    confused_with: "self-heating, which comes back after a pause; a seal's constant friction, where the run is short",
    next_experiment: "P8",
    simplicity: 4,
};

/// `exp(-travel/length)`, row by row.
fn decay(context: &Context<'_>, length: f64) -> Vec<f64> {
    context.rows(|n| libm::exp(-context.travel_m[n] / length))
}

/// E17: `dF_p/F_p` falls with travel.
pub(super) const PRELOAD_LOSS: Definition = Definition {
    id: Id::PreloadLoss,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("preload_per_m", "1/m", Negative, -1e-3)],
            columns: |context, _| worn(context, |s| s),
            phase_bound: false,
            equation: "F = preload_per_m·travel·dF_law/de",
        },
        Form {
            name: "settling",
            shape: &[ratio("length_m", "m", 0.5, 500.0, 7)],
            amplitudes: &[amplitude("preload", "", Negative, -0.1)],
            columns: |context, shape| {
                let length = *shape.first()?;
                worn(context, |s| -libm::expm1(-s / length))
            },
            phase_bound: false,
            equation: "F = preload·(1 - exp(-travel/length))·dF_law/de",
        },
        Form {
            name: "two-stage",
            shape: &[ratio("length_m", "m", 0.5, 500.0, 7)],
            amplitudes: &[amplitude("preload", "", Negative, -0.1), amplitude("preload_per_m", "1/m", Negative, -1e-3)],
            columns: |context, shape| {
                let length = *shape.first()?;
                let mut columns = worn(context, |s| -libm::expm1(-s / length))?;
                columns.extend(worn(context, |s| s)?);
                Some(columns)
            },
            phase_bound: false,
            equation: "F = (preload·(1 - exp(-travel/length)) + preload_per_m·travel)·dF_law/de",
        },
        Form {
            name: "share",
            shape: &[ratio("length_m", "m", 0.5, 500.0, 7)],
            amplitudes: &[amplitude("preload", "", Negative, -0.1)],
            columns: |context, shape| {
                let length = *shape.first()?;
                let force = context.by_load_n();
                shown(vec![context.rows(|n| -force[n] * libm::expm1(-context.travel_m[n] / length))])
            },
            phase_bound: false,
            equation: "as settling, the same share of every preload: preload·(1 - exp(-travel/length))·dF_law/dlnF_p",
        },
    ],
    axis: "travel",
    statement: "the preload falls with the distance run",
    falsifier: "stiffness or natural frequency of the block have not fallen with the friction",
    confused_with: "wear of the seals, which shifts the whole curve, and an oil change, which moves it along the speeds; \
                    preload loss scales it: a staircase of speeds now and later",
    next_experiment: "P10",
    simplicity: 3,
};

fn worn(context: &Context<'_>, of: impl Fn(f64) -> f64) -> Option<Columns> {
    let force = context.by_interference_n();
    shown(vec![context.rows(|n| force[n] * of(context.travel_m[n]))])
}
