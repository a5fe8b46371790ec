//! Faults of the force sensor that need no time: zero, gain, cross-talk, steps, clipping.

use super::Id;
use super::column::{even, force, odd, shown, span};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};

/// `F' = F + F_0`
pub(super) const FORCE_OFFSET: Definition = Definition {
    id: Id::ForceOffset,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "constant",
        shape: &[],
        amplitudes: &[amplitude("force_n", "N", Sign::Free, 0.5)],
        columns: |c, _| Some(vec![vec![1.0; c.len()]]),
        phase_bound: false,
    }],
    axis: "direction",
    statement: "The zero of the force sensor is off.",
    falsifier: "With the carriage free and at rest the sensor must show the same force.",
    next_experiment: "zero-force",
    simplicity: 1,
};

/// `F' = F + k t`; richer: towards an end, `A (1 - e^(-t/τ))`.
pub(super) const FORCE_DRIFT: Definition = Definition {
    id: Id::ForceDrift,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "linear",
            shape: &[],
            amplitudes: &[amplitude("per_second_n_s", "N/s", Sign::Free, 1e-3)],
            columns: |c, _| shown([even(c, |n| c.run.time_s[n] - c.run.time_s[0])]),
            phase_bound: false,
        },
        Form {
            name: "settles",
            shape: &[scale("time_s", "s", 10.0, 3000.0, 6)],
            amplitudes: &[amplitude("force_n", "N", Sign::Free, 0.5)],
            columns: |c, s| {
                let last = c.run.time_s.last()? - c.run.time_s[0];
                (last > s[0]).then_some(())?;
                shown([even(c, |n| 1.0 - (-(c.run.time_s[n] - c.run.time_s[0]) / s[0]).exp())])
            },
            phase_bound: false,
        },
    ],
    axis: "time",
    statement: "The zero of the force sensor drifts with time, the same in both directions.",
    falsifier: "With the carriage free and at rest the sensor must drift as well.",
    next_experiment: "zero-force",
    simplicity: 2,
};

/// `F' = g F`, inertia included.
pub(super) const FORCE_GAIN: Definition = Definition {
    id: Id::ForceGain,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "gain",
        shape: &[],
        amplitudes: &[amplitude("excess", "", Sign::Free, 0.01)],
        columns: |c, _| shown([force(c)]),
        phase_bound: false,
    }],
    axis: "load",
    statement: "The force sensor multiplies: its gain is off, inertia and friction alike.",
    falsifier: "A dead weight over a pulley must read wrong by the same factor.",
    next_experiment: "known-mass",
    simplicity: 3,
};

/// `F' = F + k F_p`: the same in both directions.
pub(super) const LOAD_CROSSTALK: Definition = Definition {
    id: Id::LoadCrosstalk,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "of-preload",
            shape: &[],
            amplitudes: &[amplitude("share", "", Sign::Free, 1e-3)],
            columns: |c, _| {
                let preload = &c.steady.preload_n;
                // a constant preload makes a constant: the zero of the sensor
                let (low, high) = span(preload);
                (!preload.is_empty() && high > 1.02 * low).then_some(())?;
                shown([even(c, |n| if preload[n].is_finite() { preload[n] } else { 0.0 })])
            },
            phase_bound: false,
        },
        Form {
            name: "of-load",
            shape: &[],
            amplitudes: &[amplitude("share", "", Sign::Free, 1e-3)],
            columns: |c, _| {
                let load = c.run.external_load_n.as_ref()?;
                shown([even(c, |n| if load[n].is_finite() { load[n] } else { 0.0 })])
            },
            phase_bound: false,
        },
    ],
    axis: "preload",
    statement: "The load on the block reads as drag: cross-talk of the force sensor, the same in both directions.",
    falsifier: "At rest the reading must change with the load as much as in motion.",
    next_experiment: "zero-force",
    simplicity: 3,
};

/// `F' = q round(F/q)`; the steps of the law's force: where noise is below the step they repeat.
pub(super) const FORCE_QUANTISATION: Definition = Definition {
    id: Id::ForceQuantisation,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "steps",
        shape: &[scale("step_n", "N", 0.05, 5.0, 8)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| {
            let force = force(c);
            shown([force.iter().map(|f| (f / s[0]).round() * s[0] - f).collect()])
        },
        phase_bound: false,
    }],
    axis: "load",
    statement: "The force is read in coarse steps.",
    falsifier: "The raw codes must show a few values only, evenly apart.",
    next_experiment: "zero-force",
    simplicity: 6,
};

/// `F' = clip(F, ±L)`, L as a share of the largest force that the law says.
pub(super) const FORCE_SATURATION: Definition = Definition {
    id: Id::ForceSaturation,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "clip",
        shape: &[scale("limit_share", "", 0.4, 0.98, 8)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| {
            let force = force(c);
            let (low, high) = span(&force);
            let limit = s[0] * high.max(-low);
            shown([force.iter().map(|f| f.clamp(-limit, limit) - f).collect()])
        },
        phase_bound: false,
    }],
    axis: "load",
    statement: "The force channel clips at its limit.",
    falsifier: "The raw codes must stand at the end of their range whenever the force is high.",
    next_experiment: "zero-force",
    simplicity: 4,
};

/// `E[F(V + δ)] - F(V) = σ²/2 ∂²F/∂V²`: noise of the speed bends the law where it is curved.
pub(super) const SPEED_NOISE: Definition = Definition {
    id: Id::SpeedNoise,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "bias",
        shape: &[],
        amplitudes: &[amplitude("variance_m2_s2", "m²/s²", Sign::Positive, 1e-8)],
        columns: |c, _| {
            (!c.steady.hersey.is_empty()).then_some(())?;
            let v = &c.motion.velocity_m_s;
            shown([odd(c, |n| {
                // ∂²F/∂V² = (∂²F/∂ln²V - ∂F/∂lnV)/V², unsigned
                let bend = c.direction[n] * (c.by_viscosity_2_n[n] - c.by_viscosity_n[n]) / (v[n] * v[n]).max(1e-8);
                if c.at_rest[n] { 0.0 } else { 0.5 * bend }
            })])
        },
        phase_bound: false,
    }],
    axis: "velocity",
    statement: "The speed that the law is fed with is noisy, which biases the force where the law bends.",
    falsifier: "A longer window for the speed must make it smaller.",
    next_experiment: "P1",
    simplicity: 6,
};
