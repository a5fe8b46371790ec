//! Friction with a memory of reversals and rests.
//!
//! The state z is the share of the full friction that a contact carries, from -1 to 1. It follows displacement, not
//! time, and keeps what an unfinished stroke has left in it.

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::filter::lag;
use super::id::Id;
use super::{Positive, amplitude, part, ratio, shown, since_turn, whole};

/// Lengths of the slip elements relative to the longest, which yields last.
const ELEMENTS: [f64; 4] = [0.1, 0.3, 0.6, 1.0];

/// E34: Dahl's `dz/dx = (1 - z·sign(dx))/length`; the richer form has four Maxwell elements that yield one by one.
pub(super) const PRESLIDING: Definition = Definition {
    id: Id::Presliding,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[since_turn("length_m", 1e-5, 1e-3, 7)],
            amplitudes: &[part("part", 1.0)],
            columns: |context, shape| {
                let length = *shape.first()?;
                let pull = |z: f64, step: f64| 1.0 - (1.0 - z) * libm::exp(-step / length);
                held_back(context, &[&pull])
            },
            phase_bound: false,
            equation: "F = part·F_law·(z - sign(V)), dz/dx = (1 - z·sign(V))/length: after a full stroke \
                       -2·part·F_law·exp(-s/length)",
        },
        Form {
            name: "maxwell-slip",
            shape: &[since_turn("length_m", 5e-5, 2e-3, 7)],
            amplitudes: &[
                part("part_at_tenth", 0.25),
                part("part_at_three_tenths", 0.25),
                part("part_at_six_tenths", 0.25),
                part("part_at_end", 0.25),
            ],
            columns: |context, shape| {
                let length = *shape.first()?;
                let elements =
                    ELEMENTS.map(|share| move |z: f64, step: f64| (z + 2.0 * step / (share * length)).min(1.0));
                let [a, b, c, d] = &elements;
                held_back(context, &[a, b, c, d])
            },
            phase_bound: false,
            equation: "F = F_law·Σ part_i·(z_i - sign(V)), dz_i = 2dx/length_i within -1..1, length_i = 0.1, 0.3, 0.6, 1 of \
                       length: the travel from a reversal to slip",
        },
    ],
    axis: "reversal-distance",
    statement: "after a reversal the friction needs some travel to build up again: the balls first deform before they roll on",
    falsifier: "at another frequency of the reversals the friction builds up over another distance",
    confused_with: "a low-pass or a delay of the force, which take time and not distance: reversals at two frequencies a decade \
                    apart; play, in which the force is zero",
    next_experiment: "P5",
    simplicity: 3,
};

/// `drag·(z - sign(V))` for states updated by `of(z, step)` along the motion; both signs relative to the motion.
fn held_back(context: &Context<'_>, of: &[&dyn Fn(f64, f64) -> f64]) -> Option<Columns> {
    let path = &context.path;
    let turns = (0..context.len()).any(|n| !path.starts[n] && path.direction[n] != path.direction[n.saturating_sub(1)]);
    let starts_from_rest = (0..context.len()).any(|n| path.starts[n] && path.at_rest[n]);
    if !turns && !starts_from_rest {
        return None;
    }
    let column = |follow: &&dyn Fn(f64, f64) -> f64| {
        let (steady, state) = (&context.steady, held_state(context, follow));
        context.rows(|n| steady.drag_n[n] * (state[n] - steady.direction[n]))
    };
    shown(of.iter().map(column).collect())
}

/// State updated by `of(z, step)` along the motion, row by row, with the sign of the motion that caused it.
pub(super) fn held_state(context: &Context<'_>, of: &dyn Fn(f64, f64) -> f64) -> Vec<f64> {
    let path = &context.path;
    // relative to the present direction
    let mut z = 1.0;
    let mut before = 1.0;
    let next = |n: usize| {
        let sign = path.direction[n];
        if path.starts[n] {
            z = if path.at_rest[n] { 0.0 } else { 1.0 };
        } else {
            z = if sign == before { z } else { -z };
            z = of(z, path.step_m[n]).clamp(-1.0, 1.0);
        }
        before = sign;
        sign * z
    };
    (0..context.len()).map(next).collect()
}

/// E36: friction that has grown during a rest and vanishes after some travel.
pub(super) const BREAKAWAY_DWELL: Definition = Definition {
    id: Id::BreakawayDwell,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("length_m", "m", 3e-5, 3e-3, 5)],
            amplitudes: &[amplitude("part_per_decade", "", Positive, 0.1)],
            columns: |context, shape| {
                rested(context, |n| context.steady.drag_n[n], *shape.first()?, |dwell| libm::log10(1.0 + dwell))
            },
            phase_bound: false,
            equation: "F = part_per_decade·sign(V)·F_law·log10(1 + dwell/(1 s))·exp(-s/length), s from the start on",
        },
        Form {
            name: "saturating",
            shape: &[ratio("length_m", "m", 3e-5, 3e-3, 5), ratio("dwell_s", "s", 0.5, 500.0, 5)],
            amplitudes: &[part("part", 0.2)],
            columns: |context, shape| {
                let time = *shape.get(1)?;
                rested(context, |n| context.steady.drag_n[n], *shape.first()?, |dwell| -libm::expm1(-dwell / time))
            },
            phase_bound: false,
            equation: "F = part·sign(V)·F_law·(1 - exp(-rest/dwell))·exp(-s/length)",
        },
        Form {
            name: "seals",
            shape: &[ratio("length_m", "m", 3e-5, 3e-3, 5), ratio("dwell_s", "s", 0.5, 500.0, 5)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0)],
            columns: |context, shape| {
                let time = *shape.get(1)?;
                rested(context, |_| 1.0, *shape.first()?, |dwell| -libm::expm1(-dwell / time))
            },
            phase_bound: false,
            equation: "F = drag_n·sign(V)·(1 - exp(-rest/dwell))·exp(-s/length): of seals, which do not feel the load",
        },
    ],
    axis: "dwell",
    statement: "the friction grows while the carriage rests and falls off again over the first travel",
    falsifier: "after rests of 1 s and 1000 s the carriage breaks away at the same force",
    confused_with: "presliding, which does not depend on the rest; cooled oil after a long rest, which lasts longer than a \
                    millimetre",
    next_experiment: "P7",
    simplicity: 5,
};

fn rested(
    context: &Context<'_>,
    drag: impl Fn(usize) -> f64,
    length: f64,
    growth: impl Fn(f64) -> f64,
) -> Option<Columns> {
    let mut last = (f64::NAN, 0.0);
    let mut column = vec![0.0; context.len()];
    for (n, force) in column.iter_mut().enumerate() {
        let dwell = context.dwell_s[n];
        let sign = context.steady.direction[n];
        let gone = context.since_reversal_m[n] / length;
        if dwell > 0.0 && sign != 0.0 && gone < 40.0 {
            if last.0 != dwell {
                last = (dwell, growth(dwell));
            }
            *force = sign * drag(n) * last.1 * libm::exp(-gone);
        }
    }
    shown(vec![column])
}

/// E35: the magnitude of the friction lags behind a change of speed; its sign does not.
pub(super) const FRICTIONAL_LAG: Definition = Definition {
    id: Id::FrictionalLag,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("time_s", "s", 1e-3, 0.2, 7)],
            amplitudes: &[whole("part", 0.4)],
            columns: |context, shape| {
                let late = lag(context, &context.steady.drag_n, *shape.first()?);
                shown(vec![context.against_motion(|n| late[n] - context.steady.drag_n[n])])
            },
            phase_bound: false,
            equation: "F = part·sign(V)·(y - F_law), time·dy/dt = F_law - y, F_law without sign",
        },
        Form {
            name: "time-and-travel",
            shape: &[ratio("time_s", "s", 1e-3, 0.2, 5), ratio("length_m", "m", 1e-5, 1e-2, 4)],
            amplitudes: &[part("part", 0.5), amplitude("part_by_travel", "", Positive, 0.5)],
            columns: |context, shape| {
                let late = lag(context, &context.steady.drag_n, *shape.first()?);
                let behind = behind(context, *shape.get(1)?);
                shown(vec![
                    context.against_motion(|n| late[n] - context.steady.drag_n[n]),
                    context.against_motion(|n| behind[n] - context.steady.drag_n[n]),
                ])
            },
            phase_bound: false,
            equation: "as minimal, and a lag in travel, length·dy/ds = F_law - y",
        },
    ],
    axis: "acceleration",
    statement: "the oil film needs time to follow a change of speed, and the friction with it",
    falsifier: "at a reversal, or when a known mass is added, the force is late as a whole and not its friction alone",
    confused_with: "a low-pass of the force, exactly so while the motion keeps its direction: a reversal or a known mass",
    next_experiment: "P6",
    simplicity: 5,
};

/// First-order lag of the drag in travel.
fn behind(context: &Context<'_>, length: f64) -> Vec<f64> {
    let drag = super::context::held(&context.steady.drag_n);
    let mut y = 0.0;
    let step = |n: usize| {
        if context.path.starts[n] {
            y = drag[n];
        }
        y = drag[n] + (y - drag[n]) * libm::exp(-context.path.step_m[n].max(0.0) / length);
        y
    };
    (0..context.len()).map(step).collect()
}
