//! Zero, gain, steps and range of the force channel.

use super::context::{Context, filled};
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Free, Positive, amplitude, ratio, shown, whole};

/// S1: error of the zero.
pub(super) const FORCE_OFFSET: Definition = Definition {
    id: Id::ForceOffset,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "minimal",
        shape: &[],
        amplitudes: &[amplitude("offset_n", "N", Free, 0.5)],
        columns: |context, _| Some(vec![vec![1.0; context.len()]]),
        phase_bound: false,
        equation: "F = offset",
    }],
    axis: "direction",
    statement: "the force sensor does not read zero without force",
    falsifier: "with the carriage free the sensor reads zero",
    confused_with: "a tilt of the rail, exactly so: read the sensor with the carriage free, or change the mass; seal drag \
                    where all motion has one direction",
    next_experiment: "zero-force",
    simplicity: 1,
};

/// S1: drift of the zero.
pub(super) const FORCE_DRIFT: Definition = Definition {
    id: Id::ForceDrift,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("drift_n_per_s", "N/s", Free, 5e-4)],
            columns: |context, _| shown(vec![elapsed(context)]),
            phase_bound: false,
            equation: "F = drift·t, t from the first row",
        },
        Form {
            name: "curved",
            shape: &[],
            amplitudes: &[
                amplitude("slope_n", "N", Free, 0.5),
                amplitude("square_n", "N", Free, 0.5),
                amplitude("cube_n", "N", Free, 0.5),
            ],
            columns: |context, _| {
                let time = elapsed(context);
                let power = |e: i32| context.rows(|n| (time[n] / 1000.0).powi(e));
                shown(vec![power(1), power(2), power(3)])
            },
            phase_bound: false,
            equation: "F = slope·τ + square·τ² + cube·τ³, τ = t/(1000 s)",
        },
        Form {
            name: "settling",
            shape: &[ratio("time_s", "s", 10.0, 3000.0, 6)],
            amplitudes: &[amplitude("change_n", "N", Free, 0.5)],
            columns: |context, shape| {
                let (time, constant) = (elapsed(context), *shape.first()?);
                shown(vec![context.rows(|n| -libm::expm1(-time[n] / constant))])
            },
            phase_bound: false,
            equation: "F = change·(1 - exp(-t/time))",
        },
        Form {
            name: "temperature",
            shape: &[],
            amplitudes: &[amplitude("offset_n", "N", Free, 0.5), amplitude("offset_per_k_n", "N/K", Free, 0.05)],
            columns: |context, _| {
                let ambient = context.run.temperature_ambient_degc.as_ref();
                let temperature = filled(ambient.or(context.run.temperature_block_degc.as_ref()))?;
                shown(vec![vec![1.0; context.len()], context.rows(|n| temperature[n] - 20.0)])
            },
            phase_bound: false,
            equation: "F = offset + offset_per_k·(T - 20 degC), T ambient, or of the block where that is all there is",
        },
    ],
    axis: "time",
    statement: "the zero of the force sensor moves while it records",
    falsifier: "with the carriage free before and after the recording the sensor reads the same",
    confused_with: "warm-up and run-in, which change sign with the direction",
    next_experiment: "zero-force",
    simplicity: 2,
};

/// Time since the first row, s; constant where a clock jumps back.
fn elapsed(context: &Context<'_>) -> Vec<f64> {
    let mut sum = 0.0;
    (0..context.len())
        .map(|n| {
            sum += context.step_s(n);
            sum
        })
        .collect()
}

/// S2: error of the gain.
pub(super) const FORCE_GAIN: Definition = Definition {
    id: Id::ForceGain,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "minimal",
        shape: &[],
        amplitudes: &[amplitude("gain_error", "", Free, 0.01)],
        columns: |context, _| shown(vec![context.steady.force_n.clone()]),
        phase_bound: false,
        equation: "F = gain_error·F_law, inertia included",
    }],
    axis: "velocity",
    statement: "the force sensor's scale is off by a constant factor",
    falsifier: "a dead weight over a pulley reads its own weight",
    confused_with: "all friction terms together and the preload, exactly so in steady motion: a dead weight",
    next_experiment: "P0",
    simplicity: 2,
};

/// S3: a load across the direction of travel is read along it.
pub(super) const LOAD_CROSSTALK: Definition = Definition {
    id: Id::LoadCrosstalk,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("force_per_load", "", Free, 1e-3)],
            columns: |context, _| shown(vec![outer_load(context).or_else(|| preload(context))?]),
            phase_bound: false,
            equation: "F = force_per_load·W, W the external load, or the preload where there is none",
        },
        Form {
            name: "preload",
            shape: &[],
            amplitudes: &[amplitude("force_per_preload", "", Free, 1e-3)],
            columns: |context, _| shown(vec![preload(context)?]),
            phase_bound: false,
            equation: "F = force_per_preload·F_p",
        },
        Form {
            name: "both",
            shape: &[],
            amplitudes: &[amplitude("force_per_load", "", Free, 1e-3), amplitude("force_per_preload", "", Free, 1e-3)],
            columns: |context, _| {
                let preload = preload(context)?;
                shown(vec![outer_load(context).unwrap_or_else(|| vec![0.0; preload.len()]), preload])
            },
            phase_bound: false,
            equation: "F = force_per_load·W + force_per_preload·F_p",
        },
    ],
    axis: "load",
    statement: "the force sensor sees a part of the load on the block",
    falsifier: "loading the block at rest does not move the sensor's reading",
    confused_with: "Coulomb friction where all motion has one direction: it changes sign, crosstalk does not; an offset, where \
                    the load is constant",
    next_experiment: "second-preload",
    simplicity: 3,
};

/// The external load, where there is one.
fn outer_load(context: &Context<'_>) -> Option<Vec<f64>> {
    filled(context.run.external_load_n.as_ref()).filter(|load| load.iter().any(|w| *w != 0.0))
}

/// The preload, recorded or from the law.
fn preload(context: &Context<'_>) -> Option<Vec<f64>> {
    filled(context.run.preload_n.as_ref()).or_else(|| filled(Some(&context.steady.preload_n)))
}

/// S6: the channel has quantisation steps.
pub(super) const FORCE_QUANTISATION: Definition = Definition {
    id: Id::ForceQuantisation,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("noise_over_step", "", 0.02, 0.5, 4)],
            amplitudes: &[whole("part", 0.5)],
            columns: |context, shape| {
                let noise = *shape.first()?;
                let (step, origin) = lattice(&context.run.drag_force_n)?;
                counted(context, (step, origin), noise)
            },
            phase_bound: false,
            equation: "F = part·(mean of q·round((F_law + noise - F_0)/q) + F_0 - F_law), q and F_0 step and origin of the \
                       recorded values; noise beyond half a step leaves nothing to see",
        },
        Form {
            name: "step",
            shape: &[ratio("step_n", "N", 0.02, 20.0, 8)],
            amplitudes: &[whole("part", 0.5)],
            columns: |context, shape| counted(context, (*shape.first()?, 0.0), 1e-6),
            phase_bound: false,
            equation: "F = part·(step·round(F_law/step) - F_law), for recordings that were filtered after they were counted",
        },
    ],
    axis: "velocity",
    statement: "the force channel counts in coarse steps",
    falsifier: "the values of the recording are not multiples of one step",
    confused_with: "a dead zone or stick-slip: look at the histogram of the recorded values",
    next_experiment: "P0",
    simplicity: 6,
};

fn counted(context: &Context<'_>, (step, origin): (f64, f64), noise: f64) -> Option<Columns> {
    let error = |force: f64| step * rounding((force - origin) / step, noise);
    shown(vec![context.rows(|n| error(context.steady.force_n[n]))])
}

/// Mean of `round(x + noise) - x` for normal noise: every threshold is passed with its probability.
fn rounding(x: f64, noise: f64) -> f64 {
    let nearest = libm::round(x);
    // sum over the thresholds above that are passed, less those below that are not
    let above = |k: f64| 0.5 * libm::erfc((nearest + k + 0.5 - x) / (noise * std::f64::consts::SQRT_2));
    let below = |k: f64| 0.5 * libm::erfc((x - (nearest - k - 0.5)) / (noise * std::f64::consts::SQRT_2));
    let passed: f64 = [0.0, 1.0, 2.0].iter().map(|k| above(*k) - below(*k)).sum();
    nearest + passed - x
}

/// Fewest distinct values that determine a lattice.
const FEWEST_VALUES: usize = 4;

/// Step and origin of values that are all multiples of one step, within the decimals of a file.
fn lattice(values: &[f64]) -> Option<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    // values of a fine channel hardly repeat
    if sorted.len() < FEWEST_VALUES || 4 * sorted.len() > values.len() {
        return None;
    }
    let (first, last) = (*sorted.first()?, *sorted.last()?);
    let least = sorted.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    // rounding to decimals spoils the smallest gap; the whole range determines the step better
    let steps: f64 = sorted.windows(2).map(|pair| libm::round((pair[1] - pair[0]) / least)).sum();
    let step = (last - first) / steps;
    let off = |x: &f64| {
        let k = (x - first) / step;
        (k - libm::round(k)).abs()
    };
    sorted.iter().all(|x| off(x) < 0.1).then_some((step, first))
}

/// S7: the channel saturates.
pub(super) const FORCE_SATURATION: Definition = Definition {
    id: Id::ForceSaturation,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("limit_n", "N", 2.0, 2000.0, 14)],
            amplitudes: &[amplitude("part", "", Positive, 1.0)],
            columns: |context, shape| {
                let limit = *shape.first()?;
                plateau(context, limit)?;
                shown(vec![context.rows(|n| beyond(context.steady.force_n[n], limit))])
            },
            phase_bound: false,
            equation: "F = part·sign(F_law)·(min(|F_law|, limit) - |F_law|)",
        },
        Form {
            name: "two-sided",
            shape: &[ratio("upper_n", "N", 2.0, 2000.0, 10), ratio("lower_n", "N", 2.0, 2000.0, 10)],
            amplitudes: &[amplitude("upper_part", "", Positive, 1.0), amplitude("lower_part", "", Positive, 1.0)],
            columns: |context, shape| {
                let (upper, lower) = (*shape.first()?, *shape.get(1)?);
                let force = &context.steady.force_n;
                plateau(context, upper.min(lower))?;
                shown(vec![
                    context.rows(|n| if force[n] > 0.0 { beyond(force[n], upper) } else { 0.0 }),
                    context.rows(|n| if force[n] < 0.0 { beyond(force[n], lower) } else { 0.0 }),
                ])
            },
            phase_bound: false,
            equation: "as minimal, with a limit for each sign",
        },
    ],
    axis: "velocity",
    statement: "the force channel ends at a limit that the force exceeds",
    falsifier: "the recorded force rises above the limit",
    confused_with: "viscous friction that bends over: it has no plateau at one number of newtons",
    next_experiment: "P0",
    simplicity: 5,
};

/// Force that a limit cuts off, with negative sign.
fn beyond(force: f64, limit: f64) -> f64 {
    force.clamp(-limit, limit) - force
}

/// A limit that most of a run exceeds is another law, not the end of a range.
fn plateau(context: &Context<'_>, limit: f64) -> Option<()> {
    let beyond = context.steady.force_n.iter().filter(|force| force.abs() > limit).count();
    (2 * beyond < context.len()).then_some(())
}
