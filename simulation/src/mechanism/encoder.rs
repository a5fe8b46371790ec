//! Effects of coupling and encoder on position and speed.

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Free, Positive, amplitude, ratio, shown, wave, whole};

/// S8: inside the gap nothing is transmitted.
pub(super) const COUPLING_BACKLASH: Definition = Definition {
    id: Id::CouplingBacklash,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("gap_m", "m", 1e-6, 1e-3, 16)],
            amplitudes: &[whole("part", 0.4)],
            columns: |context, shape| play(context, *shape.first()?, 0.0),
            phase_bound: false,
            equation: "F = -part·F_law while the travel since F_law has changed its sign is below gap",
        },
        Form {
            name: "closing",
            shape: &[ratio("gap_m", "m", 1e-6, 1e-3, 6), ratio("closing_m", "m", 1e-6, 1e-3, 4)],
            amplitudes: &[whole("part", 0.4)],
            columns: |context, shape| play(context, *shape.first()?, *shape.get(1)?),
            phase_bound: false,
            equation: "as minimal, falling to nothing over closing beyond the gap",
        },
    ],
    axis: "reversal-distance",
    statement: "a coupling or load cell has play: after a reversal no force is transmitted over the gap",
    falsifier: "right after a reversal the force already rises with displacement",
    confused_with: "presliding, which is never without stiffness: look for a gap of zero force, constant in micrometres",
    next_experiment: "P5",
    simplicity: 4,
};

fn play(context: &Context<'_>, gap: f64, closing: f64) -> Option<Columns> {
    let since = context.since_push_m();
    let open = |s: f64| {
        if s < gap {
            1.0
        } else if closing > 0.0 {
            (1.0 - (s - gap) / closing).max(0.0)
        } else {
            0.0
        }
    };
    shown(vec![
        context.rows(|n| if since[n] < gap + closing { -open(since[n]) * context.steady.force_n[n] } else { 0.0 }),
    ])
}

/// S9: the law is evaluated at a speed that differs from the carriage's.
pub(super) const SPEED_NOISE: Definition = Definition {
    id: Id::SpeedNoise,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[
                amplitude("variance_m2_s2", "m2/s2", Positive, 1e-7),
                amplitude("wrong_direction", "", Positive, 1.0),
            ],
            columns: |context, _| shown(vec![curvature(context), wrong_direction(context)]),
            phase_bound: false,
            equation: "F = -variance/2·d²F_law/dV² + wrong_direction·|F_law|·(sign of the travel - sign(V))",
        },
        Form {
            name: "path",
            shape: &[],
            amplitudes: &[whole("part", 0.6), amplitude("mass_kg", "kg", Positive, 10.0)],
            columns: |context, _| {
                let (at_path, force) = (context.at_path_speed_n.as_ref()?, &context.steady.force_n);
                let (path, own) = (context.path_acceleration_m_s2.as_ref()?, &context.motion.acceleration_m_s2);
                let moves = context.moved_mass_kg > 0.0;
                let apart = |n: usize| {
                    if at_path[n].is_finite() || !force[n].is_finite() { at_path[n] - force[n] } else { 0.0 }
                };
                let jolts = |n: usize| if moves && path[n].is_finite() { path[n] - own[n] } else { 0.0 };
                shown(vec![context.rows(apart), context.rows(jolts)])
            },
            phase_bound: false,
            equation: "F = part·(F_law(v) - F_law(V)) + mass·(dv/dt - dV/dt), v the slope of the position recorded beside V, \
                       else the mean of V over as many rows as agree; mass where the law moves one",
        },
    ],
    axis: "velocity",
    statement: "the speed that the simulation was fed is noisy: at low speed the law is evaluated at the wrong place",
    falsifier: "with speed fitted to the position over a longer window the mismatch at low speed stays",
    confused_with: "mixed friction at low speed: derive the speed anew",
    next_experiment: "P1",
    simplicity: 5,
};

/// `-d²F/dV²/2`, from derivatives with respect to the logarithm of the viscosity, which enters the law only through its
/// product with speed.
fn curvature(context: &Context<'_>) -> Vec<f64> {
    if context.viscosity_curvature_n.is_empty() {
        return vec![0.0; context.len()];
    }
    let of = |n: usize| {
        let v = context.motion.velocity_m_s[n];
        // F itself is rounded at 1e-11: below this speed the difference is nothing but rounding
        if context.steady.direction[n] == 0.0 || v.abs() < 1e-4 {
            return 0.0;
        }
        -0.5 * (context.viscosity_curvature_n[n] - context.by_viscosity_n[n]) / (v * v)
    };
    context.rows(of)
}

/// Time around a turn in which speed and path may disagree about the direction, s.
const AROUND_A_TURN_S: f64 = 0.05;

fn wrong_direction(context: &Context<'_>) -> Vec<f64> {
    let seen = &context.steady.direction;
    let time = &context.run.time_s;
    let turns: Vec<f64> =
        (1..context.len()).filter(|n| context.direction[*n] != context.direction[n - 1]).map(|n| time[n]).collect();
    let mut next = 0;
    let of = |n: usize| {
        while next < turns.len() && turns[next] < time[n] - AROUND_A_TURN_S {
            next += 1;
        }
        let turning = turns.get(next).is_some_and(|turn| (turn - time[n]).abs() <= AROUND_A_TURN_S);
        if turning || context.at_rest[n] || seen[n] == 0.0 {
            return 0.0;
        }
        context.steady.drag_n[n] * (context.direction[n] - seen[n])
    };
    (0..context.len()).map(of).collect()
}

/// S11: `V (1 + A cos(2πx/p))`.
pub(super) const ENCODER_CYCLIC_ERROR: Definition = Definition {
    id: Id::EncoderCyclicError,
    kind: Kind::Sensor,
    forms: &[
        Form {
            name: "minimal",
            shape: &[wave("period_m", 4e-6, 12e-3)],
            amplitudes: &[amplitude("sine", "", Free, 0.02), amplitude("cosine", "", Free, 0.02)],
            columns: |context, shape| cyclic(context, *shape.first()?),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/dlnV, k = 2π/period",
        },
        Form {
            name: "path",
            shape: &[wave("period_m", 4e-6, 12e-3)],
            amplitudes: &[amplitude("sine_um", "um", Free, 1.0), amplitude("cosine_um", "um", Free, 1.0)],
            columns: |context, shape| misread(context, *shape.first()?, 1),
            phase_bound: true,
            equation: "F = F_law(x) - F_law(x + sine·sin(kx) + cosine·cos(kx)), k = 2π/period, speed and acceleration derived as \
                       the simulation derives them; a recorded speed has the slope of the wave",
        },
        Form {
            name: "path-two-orders",
            shape: &[wave("period_m", 4e-6, 12e-3)],
            amplitudes: &[
                amplitude("sine_1_um", "um", Free, 1.0),
                amplitude("cosine_1_um", "um", Free, 1.0),
                amplitude("sine_2_um", "um", Free, 1.0),
                amplitude("cosine_2_um", "um", Free, 1.0),
            ],
            columns: |context, shape| misread(context, *shape.first()?, 2),
            phase_bound: true,
            equation: "as path, with the second order of the wave",
        },
    ],
    axis: "wavelength",
    statement: "the encoder errs once per signal period, so that the speed that the simulation was fed ripples",
    falsifier: "a second encoder, or another reading head, shows the same ripple of speed",
    confused_with: "balls that pass and drive ripple, by their wavelength: an encoder's period is 4 to 40 µm, that of an \
                    interpolated or magnetic one up to ten millimetres",
    next_experiment: "P4",
    simplicity: 5,
};

fn cyclic(context: &Context<'_>, period: f64) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    shown(context.waves(&context.by_speed_n()?, period, 1))
}

/// Longest period that an encoder errs with, m.
const LONGEST_M: f64 = 1.0;

/// Period of an endless wave, m: asked for is the size of its force alone, row by row.
const ENDLESS_M: f64 = 1e12;

/// Size of the inertial force that a wave along the path is mistaken for: it grows with the square of the speed.
fn jolted(context: &Context<'_>) -> Option<Columns> {
    if context.run.acceleration_m_s2.is_some() || context.moved_mass_kg <= 0.0 {
        return None;
    }
    let size = context.rows(|n| context.moved_mass_kg * context.motion.velocity_m_s[n].powi(2));
    shown(vec![size.clone(), size])
}

/// Change of the law's force by a micrometre of position error. A recorded speed is taken to be that of the same encoder.
///
/// ```text
/// F = -(dF_law/dV·δV + M·δa)
/// ```
fn misread(context: &Context<'_>, period: f64, orders: u32) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    if period >= ENDLESS_M {
        return jolted(context).filter(|_| orders == 1);
    }
    if period > LONGEST_M {
        return None;
    }
    let by_oil = context.by_oil_n();
    let force = |(speed, acceleration): (Vec<f64>, Vec<f64>)| {
        context.rows(|n| {
            let v = context.motion.velocity_m_s[n];
            let by_speed = if v.abs() > 1e-4 { by_oil[n] / v } else { 0.0 };
            let inertia =
                if context.run.acceleration_m_s2.is_none() { context.moved_mass_kg * acceleration[n] } else { 0.0 };
            -(by_speed * speed[n] + inertia)
        })
    };
    let errors = match &context.run.velocity_m_s {
        None => derived(context, period, orders),
        Some(velocity) => recorded(context, velocity, period, orders),
    };
    shown(errors.into_iter().map(force).collect())
}

/// Errors of a speed and an acceleration derived from the position, for a micrometre of each wave.
fn derived(context: &Context<'_>, period: f64, orders: u32) -> Vec<(Vec<f64>, Vec<f64>)> {
    let micrometre = vec![1e-6; context.len()];
    let waves = context.waves(&micrometre, period, orders);
    waves.iter().map(|error| context.motion.derived(context.run, error)).collect()
}

/// The same of a recorded speed, which has the slope of the wave, and of the acceleration derived from that.
///
/// ```text
/// δV = k·V·cos(kx)   of sin(kx),   δV = -k·V·sin(kx)   of cos(kx)
/// ```
fn recorded(context: &Context<'_>, velocity: &[f64], period: f64, orders: u32) -> Vec<(Vec<f64>, Vec<f64>)> {
    let per_micrometre: Vec<f64> = velocity.iter().map(|v| 1e-6 * v).collect();
    let mut errors = Vec::new();
    let waves = context.waves(&per_micrometre, period, orders);
    for (at, [sine, cosine]) in waves.as_chunks().0.iter().enumerate() {
        let per_m = std::f64::consts::TAU * (at + 1) as f64 / period;
        for (wave, per_m) in [(cosine, per_m), (sine, -per_m)] {
            let speed: Vec<f64> = wave.iter().map(|wave| per_m * wave).collect();
            let acceleration = context.motion.derived_acceleration(context.run, &speed);
            errors.push((speed, acceleration));
        }
    }
    errors
}
