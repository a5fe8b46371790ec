//! Effects of heat on oil and preload.

use model_core::reference::zhou_2023::OIL;

use super::context::{Context, filled};
use super::definition::{Columns, Definition, Form, Kind};
use super::filter::lag;
use super::id::Id;
use super::{Free, Negative, Positive, amplitude, ratio, shown, steps};
use crate::run::Break;

/// E3: the law is evaluated at the viscosity that the measured temperature gives.
pub(super) const VISCOSITY_TEMPERATURE: Definition = Definition {
    id: Id::ViscosityTemperature,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[steps("reference_degc", "degC", 10.0, 60.0, 6)],
            amplitudes: &[amplitude("part", "", Positive, 1.0)],
            columns: vg100,
            phase_bound: false,
            equation: "F = part·(F_law(ν·r) - F_law(ν)), r = ν100(T)/ν100(reference) of an oil of grade ISO VG 100 and \
                       viscosity index 95",
        },
        Form {
            name: "rate",
            shape: &[steps("reference_degc", "degC", 10.0, 60.0, 5), ratio("rate_per_k", "1/K", 0.015, 0.1, 4)],
            amplitudes: &[amplitude("part", "", Positive, 1.0)],
            columns: |context, shape| {
                let (reference, rate) = (*shape.first()?, *shape.get(1)?);
                thinned(context, |t| rate * (reference - t))
            },
            phase_bound: false,
            equation: "F = part·(F_law(ν·r) - F_law(ν)), r = exp(-rate·(T - reference))",
        },
    ],
    axis: "temperature",
    statement: "the oil thins with temperature, which the simulation's constant viscosity does not say",
    falsifier: "the same speeds at two temperatures 10 K apart give the same friction",
    confused_with: "preload that follows a temperature difference: it moves friction alike at all speeds, the oil moves it \
                    along the Stribeck curve; run-in and starvation: they do not follow the sensor",
    next_experiment: "second-temperature",
    simplicity: 2,
};

fn vg100(context: &Context<'_>, shape: &[f64]) -> Option<Columns> {
    let reference = libm::log(OIL.viscosity_cst(*shape.first()?));
    thinned(context, |t| libm::log(OIL.viscosity_cst(t)) - reference)
}

/// Change of the law's force when the viscosity is `exp(log_ratio(T))` times its own.
fn thinned(context: &Context<'_>, log_ratio: impl Fn(f64) -> f64) -> Option<Columns> {
    if context.viscosity_follows_temperature {
        return None;
    }
    let temperature = filled(context.run.temperature_block_degc.as_ref())?;
    let mut last = (f64::NAN, f64::NAN);
    let logs: Vec<f64> = temperature
        .iter()
        .map(|t| {
            if last.0 != *t {
                last = (*t, log_ratio(*t));
            }
            last.1
        })
        .collect();
    shown(vec![context.thinned_n(&logs)])
}

/// E4: `τ dθ/dt = P - θ` with the friction power P; the oil thins with θ. The block warms within minutes to an hour;
/// the races sooner, from the time after which heat is 10 mm deep, some 8 s (steel, 1.2e-5 m²/s).
pub(super) const SELF_HEATING: Definition = Definition {
    id: Id::SelfHeating,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("time_s", "s", 10.0, 3600.0, 8)],
            amplitudes: &[amplitude("log_viscosity_per_w", "1/W", Negative, -0.03)],
            columns: |context, shape| heated(context, &[*shape.first()?]),
            phase_bound: false,
            equation: "F = log_viscosity_per_w·θ·dF_law/dlnν; time·dθ/dt = F_law·|V| - θ, θ = 0 at the start",
        },
        Form {
            name: "two-node",
            shape: &[ratio("fast_s", "s", 3.0, 300.0, 4), ratio("slow_s", "s", 30.0, 7200.0, 5)],
            amplitudes: &[
                amplitude("fast_log_viscosity_per_w", "1/W", Negative, -0.02),
                amplitude("slow_log_viscosity_per_w", "1/W", Negative, -0.02),
            ],
            columns: |context, shape| heated(context, &[*shape.first()?, *shape.get(1)?]),
            phase_bound: false,
            equation: "as minimal, θ the sum of a fast node (contacts) and a slow one (block and table)",
        },
    ],
    axis: "time",
    statement: "friction warms the oil while the block runs, more at high power, and the oil thins",
    falsifier: "after a pause to cool down the same motion starts with the friction it ended with",
    confused_with: "run-in, which does not come back after a pause; starvation, whose friction rises with wear of the film; \
                    the measured temperature, which it follows",
    next_experiment: "P8",
    simplicity: 5,
};

fn heated(context: &Context<'_>, times: &[f64]) -> Option<Columns> {
    let power = context.rows(|n| context.steady.drag_n[n] * context.speed_m_s(n));
    let force = context.by_oil_n();
    let column = |time: &f64| {
        let theta = warmth(context, &power, *time);
        context.rows(|n| force[n] * theta[n])
    };
    shown(times.iter().map(column).collect())
}

/// First-order lag of the power, from 0 at the first row. Between parts of a profile there is no heating; in a gap the
/// power continues as before.
fn warmth(context: &Context<'_>, power: &[f64], time_s: f64) -> Vec<f64> {
    let mut theta = 0.0;
    let mut before = 0.0;
    let mut rests = vec![false; context.len()];
    for part in &context.run.parts {
        if let Some(rests) = rests.get_mut(part.rows.start) {
            *rests = matches!(part.starts, Break::Segment);
        }
    }
    let mut last = (f64::NAN, 0.0);
    let step = |n: usize| {
        let dt = context.step_s(n);
        if (dt - last.0).abs() > 1e-6 * dt || last.0.is_nan() {
            last = (dt, libm::exp(-dt / time_s));
        }
        let now = if power[n].is_finite() { power[n] } else { before };
        let source = if rests[n] { 0.0 } else { 0.5 * (now + before) };
        theta = source + (theta - source) * last.1;
        before = now;
        theta
    };
    (0..context.len()).map(step).collect()
}

/// E18: `dF_p/F_p = k (T_block - T_rail)`.
pub(super) const THERMAL_PRELOAD: Definition = Definition {
    id: Id::ThermalPreload,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("preload_per_k", "1/K", Free, -0.03)],
            columns: |context, _| difference(context, None).map(|column| vec![column]).and_then(shown),
            phase_bound: false,
            equation: "F = preload_per_k·(T_block - T_rail)·dF_law/de",
        },
        Form {
            name: "lagged",
            shape: &[ratio("time_s", "s", 20.0, 1200.0, 5)],
            amplitudes: &[
                amplitude("preload_per_k", "1/K", Free, -0.03),
                amplitude("lagged_preload_per_k", "1/K", Free, -0.03),
            ],
            columns: |context, shape| {
                shown(vec![difference(context, None)?, difference(context, Some(*shape.first()?))?])
            },
            phase_bound: false,
            equation: "as minimal, and the same with the difference lagged by time: sensors are not in the raceway",
        },
    ],
    axis: "temperature-difference",
    statement: "the preload follows the temperature difference of block and rail",
    falsifier: "with block and rail at one temperature, cold or warm, the friction still differs",
    confused_with: "thinning oil: at speeds on both sides of the friction minimum the oil acts in opposite ways, the preload \
                    in the same",
    next_experiment: "P3",
    simplicity: 3,
};

fn difference(context: &Context<'_>, time_s: Option<f64>) -> Option<Vec<f64>> {
    let block = filled(context.run.temperature_block_degc.as_ref())?;
    let rail = filled(context.run.temperature_rail_degc.as_ref())?;
    let mut kelvin = context.rows(|n| block[n] - rail[n]);
    if let Some(time_s) = time_s {
        kelvin = lag(context, &kelvin, time_s);
    }
    let force = context.by_interference_n();
    Some(context.rows(|n| force[n] * kelvin[n]))
}
