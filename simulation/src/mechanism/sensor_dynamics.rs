//! Faults of the force channel that need time: a filter, a delay.

use super::column::{force, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id, dynamics};

/// Rows to either side from which the slope of the force is taken.
const REACH: usize = 3;

/// `τ y' = F - y`: inertia, friction and its sign alike.
pub(super) const FORCE_LOWPASS: Definition = Definition {
    id: Id::ForceLowpass,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "first-order",
        shape: &[scale("time_s", "s", 1e-3, 0.1, 6)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| dynamics::filtered(c, s[0]),
        phase_bound: false,
    }],
    axis: "acceleration",
    statement: "The force channel is filtered: it follows every change some milliseconds late.",
    falsifier: "A step of known mass must arrive late by the same time; at two frequencies the delay must be equal in milliseconds.",
    next_experiment: "two-frequencies",
    simplicity: 3,
};

/// `F(t - δ) = F - δ F'`
pub(super) const TIME_MISALIGNMENT: Definition = Definition {
    id: Id::TimeMisalignment,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "delay",
        shape: &[],
        amplitudes: &[amplitude("advance_s", "s", Sign::Free, 2e-3)],
        columns: |c, _| shown([slope(c)]),
        phase_bound: false,
    }],
    axis: "acceleration",
    statement: "Force and position are not of the same instant: one channel is late.",
    falsifier: "The shift must be the same in milliseconds at every speed and acceleration.",
    next_experiment: "two-frequencies",
    simplicity: 2,
};

/// Change of the law's force per second, N/s, over a few rows.
fn slope(c: &Context<'_>) -> Vec<f64> {
    let force = force(c);
    let mut out = vec![0.0; force.len()];
    for part in &c.run.parts {
        let rows = part.rows.clone();
        for n in rows.clone() {
            let (from, to) = (n.saturating_sub(REACH).max(rows.start), (n + REACH).min(rows.end - 1));
            let time = c.run.time_s[to] - c.run.time_s[from];
            if time > 0.0 {
                out[n] = (force[to] - force[from]) / time;
            }
        }
    }
    out
}
