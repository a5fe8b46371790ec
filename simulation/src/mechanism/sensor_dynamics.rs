//! Dynamics of the force channel.

use super::context::{Context, held};
use super::definition::{Columns, Definition, Form, Kind};
use super::filter::{lag, lag_of_force};
use super::id::Id;
use super::{Free, amplitude, either_side, ratio, shown, whole};

/// S4: `τ dy/dt = F - y`.
pub(super) const FORCE_LOWPASS: Definition = Definition {
    id: Id::ForceLowpass,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("time_s", "s", 1e-4, 0.2, 10)],
            amplitudes: &[whole("part", 0.1)],
            columns: |context, shape| filtered(context, &context.struck_n(), *shape.first()?, 1),
            phase_bound: false,
            equation: "F = part·(y - F_law), time·dy/dt = F_law - y",
        },
        Form {
            name: "second-order",
            shape: &[ratio("time_s", "s", 1e-4, 0.2, 10)],
            amplitudes: &[whole("part", 0.1)],
            columns: |context, shape| filtered(context, &context.struck_n(), *shape.first()?, 2),
            phase_bound: false,
            equation: "as minimal, two such filters in a row",
        },
        Form {
            name: "held",
            shape: &[ratio("time_s", "s", 1e-4, 0.2, 10)],
            amplitudes: &[whole("part", 0.1)],
            columns: |context, shape| filtered(context, &held_at_rest(context), *shape.first()?, 1),
            phase_bound: false,
            equation: "as minimal, of a carriage that is held at rest by the force it stopped with",
        },
    ],
    axis: "acceleration",
    statement: "the force channel is low-pass filtered: it shows changes late and rounded",
    falsifier: "a known mass dropped on the sensor shows a step sharper than the filter",
    confused_with: "frictional lag while the motion keeps its direction: a reversal; presliding, which takes distance and not \
                    time: two frequencies a decade apart",
    next_experiment: "two-frequencies",
    simplicity: 3,
};

/// Output of a chain of filters for a force, less the force.
fn filtered(context: &Context<'_>, force: &[f64], time: f64, order: usize) -> Option<Columns> {
    let mut out = lag_of_force(context, force, time);
    for _ in 1..order {
        out = lag(context, &out, time);
    }
    shown(vec![context.rows(|n| out[n] - force[n])])
}

/// S5: `F(t - δ)`.
pub(super) const TIME_MISALIGNMENT: Definition = Definition {
    id: Id::TimeMisalignment,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("delay_s", "s", Free, 2e-3)],
            columns: |context, _| {
                let reach = context.run.step_s();
                let force = context.struck_n();
                let of = |delay| shifted(context, &force, delay);
                let (late, early) = (of(reach), of(-reach));
                shown(vec![context.rows(|n| (late[n] - early[n]) / (2.0 * reach))])
            },
            phase_bound: false,
            equation: "F = -delay·dF_law/dt: the force is recorded late by delay",
        },
        Form {
            name: "shift",
            shape: &[either_side("delay_s", "s", 0.05, 24)],
            amplitudes: &[whole("part", 0.1)],
            columns: |context, shape| {
                let late = shifted(context, &context.struck_n(), *shape.first()?);
                shown(vec![context.rows(|n| late[n] - context.steady.force_n[n])])
            },
            phase_bound: false,
            equation: "F = part·(F_law(t - delay) - F_law(t))",
        },
        Form {
            name: "held-shift",
            shape: &[either_side("delay_s", "s", 0.05, 24)],
            amplitudes: &[whole("part", 0.1)],
            columns: |context, shape| {
                let late = shifted(context, &held_at_rest(context), *shape.first()?);
                shown(vec![context.rows(|n| late[n] - context.steady.force_n[n])])
            },
            phase_bound: false,
            equation: "as shift, of a carriage that is held at rest by the force it stopped with",
        },
    ],
    axis: "acceleration",
    statement: "force and position are not recorded at the same instant",
    falsifier: "a mass step is seen by force and encoder at the same instant",
    confused_with: "inertia, low-pass and frictional lag: the shift is constant in milliseconds at all speeds",
    next_experiment: "two-frequencies",
    simplicity: 2,
};

/// The law's force, where at rest the carriage is held by the force it stopped with. The law itself has none there:
/// what a drive does until it starts again is not determined by friction.
fn held_at_rest(context: &Context<'_>) -> Vec<f64> {
    let moving = |(force, moves): (&f64, &bool)| if *moves { *force } else { f64::NAN };
    held(&context.steady.force_n.iter().zip(&context.onsets.moves).map(moving).collect::<Vec<_>>())
}

/// The force at a time earlier by `delay`, within the part; linear between rows except where the motion reverses.
fn shifted(context: &Context<'_>, force: &[f64], delay: f64) -> Vec<f64> {
    let (force, time) = (held(force), &context.run.time_s);
    let mut out = vec![0.0; context.len()];
    for part in &context.run.parts {
        let Some(last) = part.rows.end.checked_sub(1) else { continue };
        let mut k = part.rows.start;
        for n in part.rows.clone() {
            let wanted = time[n] - delay;
            while k + 1 < last && time[k + 1] < wanted {
                k += 1;
            }
            let next = (k + 1).min(last);
            let width = time[next] - time[k];
            let share = if width > 0.0 { ((wanted - time[k]) / width).clamp(0.0, 1.0) } else { 0.0 };
            out[n] = match context.jump(next) {
                Some(turn) => force[if share < turn { k } else { next }],
                None => force[k] + share * (force[next] - force[k]),
            };
        }
    }
    out
}
