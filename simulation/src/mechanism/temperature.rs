//! What warms.

use super::column::{even, force, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id};

/// Temperature at which a change of viscosity is 0, °C: that of a laboratory, where data sheets of drag are made.
const REFERENCE_DEGC: f64 = 25.0;

/// `ln ν = ln ν_0 + β (T - T_0)`; richer: to the second order of the drag in ln ν, and of ln ν in T.
pub(super) const VISCOSITY_TEMPERATURE: Definition = Definition {
    id: Id::ViscosityTemperature,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "linear",
            shape: &[],
            amplitudes: &[amplitude("per_kelvin", "1/K", Sign::Negative, -0.05)],
            columns: |c, _| {
                let t = warm(c)?;
                shown([even(c, |n| c.by_viscosity_n[n] * t[n])])
            },
            phase_bound: false,
        },
        Form {
            name: "exponential",
            shape: &[scale("rate_per_kelvin", "1/K", 0.015, 0.1, 6)],
            amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
            // the drag at ν e^(-βΔT), to the second order in βΔT
            columns: |c, s| {
                let t = warm(c)?;
                let change = |n: usize| -s[0] * t[n];
                shown([even(c, |n| change(n) * (c.by_viscosity_n[n] + 0.5 * change(n) * c.by_viscosity_2_n[n]))])
            },
            phase_bound: false,
        },
    ],
    axis: "temperature",
    statement: "The oil thins as the block warms, and the drag moves along the Stribeck curve; the simulation keeps its viscosity.",
    falsifier: "At one temperature the difference must vanish; on the two sides of the friction minimum it must have opposite signs.",
    next_experiment: "second-temperature",
    simplicity: 2,
};

/// `C dT/dt = F V - (T - T_a)/R`, acting through the viscosity. The column is the filtered power, W.
pub(super) const SELF_HEATING: Definition = Definition {
    id: Id::SelfHeating,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "one-node",
            shape: &[scale("time_s", "s", 60.0, 4000.0, 5)],
            amplitudes: &[amplitude("per_watt", "1/W", Sign::Negative, -0.05)],
            columns: |c, s| {
                let power = heated(c, s[0]);
                shown([even(c, |n| c.by_viscosity_n[n] * power[n])])
            },
            phase_bound: false,
        },
        Form {
            name: "two-nodes",
            shape: &[scale("time_s", "s", 60.0, 1500.0, 4)],
            amplitudes: &[
                amplitude("per_watt", "1/W", Sign::Negative, -0.05),
                amplitude("slow_per_watt", "1/W", Sign::Negative, -0.05),
            ],
            columns: |c, s| {
                let (fast, slow) = (heated(c, s[0]), heated(c, 5.0 * s[0]));
                shown([even(c, |n| c.by_viscosity_n[n] * fast[n]), even(c, |n| c.by_viscosity_n[n] * slow[n])])
            },
            phase_bound: false,
        },
    ],
    axis: "time",
    statement: "Friction warms the oil, which thins: the drag drifts with the power of the last minutes.",
    falsifier: "After a pause at ambient temperature the drag must start anew where it started first.",
    next_experiment: "P8",
    simplicity: 4,
};

/// `ΔF_p/F_p = κ (T_block - T_rail)`
pub(super) const THERMAL_PRELOAD: Definition = Definition {
    id: Id::ThermalPreload,
    kind: Kind::Physics,
    forms: &[Form {
        name: "linear",
        shape: &[],
        amplitudes: &[amplitude("preload_per_kelvin", "1/K", Sign::Free, 0.028)],
        columns: |c, _| {
            let (block, rail) = (c.run.temperature_block_degc.as_ref()?, c.run.temperature_rail_degc.as_ref()?);
            let difference = |n: usize| known(block[n] - rail[n]);
            shown([even(c, |n| c.by_preload_n[n] * difference(n))])
        },
        phase_bound: false,
    }],
    axis: "temperature-difference",
    statement: "Block and rail differ in temperature, and the fit between them changes the preload.",
    falsifier: "It must follow the difference of the two temperatures, not either of them, and scale the drag alike at all speeds.",
    next_experiment: "P8",
    simplicity: 3,
};

/// Block temperature above the reference, K.
fn warm(c: &Context<'_>) -> Option<Vec<f64>> {
    let t = c.run.temperature_block_degc.as_ref()?;
    Some(t.iter().map(|t| known(t - REFERENCE_DEGC)).collect())
}

/// Friction power, W, followed with a time constant; from a block at ambient temperature.
fn heated(c: &Context<'_>, tau_s: f64) -> Vec<f64> {
    let force = force(c);
    let mut power: Vec<f64> = force.iter().zip(&c.motion.velocity_m_s).map(|(f, v)| (f * v).abs()).collect();
    // heat goes on over the parts: each starts where the last one ended, cooled by what lies between
    let (mut state, mut before_s) = (0.0, c.run.time_s.first().copied().unwrap_or(0.0));
    for (power, time_s) in power.iter_mut().zip(&c.run.time_s) {
        let keep = (-(time_s - before_s).max(0.0) / tau_s).exp();
        state = *power + (state - *power) * keep;
        (*power, before_s) = (state, *time_s);
    }
    power
}

fn known(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}

/// How far the contacts have run dry, 0 to 1: a first-order state that is driven by motion and refilled at rest; a part
/// starts with a full film.
pub(super) fn depleted(c: &Context<'_>, tau_s: f64) -> Vec<f64> {
    let mut all = vec![0.0; c.len()];
    for part in &c.run.parts {
        let (mut state, mut before_s) = (0.0, c.run.time_s[part.rows.start]);
        for n in part.rows.clone() {
            let target = if c.at_rest[n] { 0.0 } else { 1.0 };
            state = target + (state - target) * (-(c.run.time_s[n] - before_s) / tau_s).exp();
            (all[n], before_s) = (state, c.run.time_s[n]);
        }
    }
    all
}
