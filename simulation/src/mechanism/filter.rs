//! Linear filters over the rows of a run, exact for an input that is linear between two rows, or jumps once between
//! them.

use super::context::{Context, held};

/// First-order lag, `τ dy/dt = u - y`; starts settled in every part.
pub(super) fn lag(context: &Context<'_>, input: &[f64], time_s: f64) -> Vec<f64> {
    lag_across(context, input, time_s, |_| None)
}

/// The same for a force that jumps where the motion reverses, begins or stops, and is constant on either side of the jump
/// between two rows.
pub(super) fn lag_of_force(context: &Context<'_>, input: &[f64], time_s: f64) -> Vec<f64> {
    lag_across(context, input, time_s, |n| context.jump(n))
}

/// The same; `jump`: share of the step to a row at which the input jumps.
fn lag_across(context: &Context<'_>, input: &[f64], time_s: f64, jump: impl Fn(usize) -> Option<f64>) -> Vec<f64> {
    let input = held(input);
    let (mut y, mut before) = (0.0, 0.0);
    let (mut width, mut decay) = (f64::NAN, 0.0);
    let step = |(n, u): (usize, &f64)| {
        let dt = context.step_s(n);
        if context.path.starts[n] || dt == 0.0 {
            y = if context.path.starts[n] { *u } else { y };
        } else {
            if !same(dt, width) {
                (width, decay) = (dt, libm::exp(-dt / time_s));
            }
            if let Some(share) = jump(n) {
                let at_jump = before + (y - before) * libm::exp(-share * dt / time_s);
                y = u + (at_jump - u) * libm::exp(-(1.0 - share) * dt / time_s);
            } else {
                // the output follows a ramp with a lag of τ·slope
                let behind = (u - before) / dt * time_s;
                y = u - behind + (y - before + behind) * decay;
            }
        }
        before = *u;
        y
    };
    input.iter().enumerate().map(step).collect()
}

/// Two masses on a spring, `d²y/dt² + 2ζω dy/dt + ω² y = ω² u` with `ω = 2π·frequency` and ζ below 1; starts settled in
/// every part. Position and speed of every row.
pub(super) fn oscillator(context: &Context<'_>, input: &[f64], frequency_hz: f64, damping: f64) -> Vec<[f64; 2]> {
    let input = held(input);
    let omega = std::f64::consts::TAU * frequency_hz;
    let sigma = damping * omega;
    let damped = omega * (1.0 - damping * damping).max(1e-9).sqrt();
    let (mut y, mut speed, mut before) = (0.0, 0.0, 0.0);
    let (mut width, mut decay, mut sin, mut cos) = (f64::NAN, 0.0, 0.0, 1.0);
    let step = |(n, u): (usize, &f64)| {
        let dt = context.step_s(n);
        if context.path.starts[n] {
            (y, speed) = (*u, 0.0);
        } else if dt > 0.0 {
            if !same(dt, width) {
                (width, decay) = (dt, libm::exp(-sigma * dt));
                (sin, cos) = libm::sincos(damped * dt);
            }
            let slope = (u - before) / dt;
            // the output follows a ramp with a lag of 2ζ·slope/ω; the remainder oscillates freely
            let behind = 2.0 * damping * slope / omega;
            let (e, v) = (y - before + behind, speed - slope);
            y = u - behind + decay * (e * cos + (v + sigma * e) / damped * sin);
            speed = slope + decay * (v * cos - (sigma * v + omega * omega * e) / damped * sin);
        }
        before = *u;
        [y, speed]
    };
    input.iter().enumerate().map(step).collect()
}

/// Whether two time steps are equal within the rounding of time stamps.
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * a
}
