//! What repeats with a short wavelength.

use super::column::{drag, waves};
use super::definition::{Amplitude, Definition, Form, Kind, Sign, amplitude, place, scale};
use super::{Context, Id};

const SINE: Amplitude = amplitude("sine", "", Sign::Free, 0.01);
const COSINE: Amplitude = amplitude("cosine", "", Sign::Free, 0.01);
const SINE_N: Amplitude = amplitude("sine_n", "N", Sign::Free, 0.5);
const COSINE_N: Amplitude = amplitude("cosine_n", "N", Sign::Free, 0.5);

/// `F (1 + A sin(2πx/λ + φ))`, λ twice the pitch of the balls; richer: with the second harmonic.
pub(super) const BALL_PASS: Definition = Definition {
    id: Id::BallPass,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "fundamental",
            shape: &[place("over_nominal", "", 0.96, 1.04, 61)],
            amplitudes: &[SINE, COSINE],
            columns: |c, s| waves(c, s[0] * c.geometry.ball_pass_m, 1, |n| loaded(c, n)),
            phase_bound: true,
        },
        Form {
            name: "two-harmonics",
            shape: &[place("over_nominal", "", 0.96, 1.04, 61)],
            amplitudes: &[
                SINE,
                COSINE,
                amplitude("sine_2", "", Sign::Free, 0.005),
                amplitude("cosine_2", "", Sign::Free, 0.005),
            ],
            columns: |c, s| waves(c, s[0] * c.geometry.ball_pass_m, 2, |n| loaded(c, n)),
            phase_bound: true,
        },
    ],
    axis: "wavelength",
    statement: "Balls enter and leave the loaded zone: the drag pulsates with twice the pitch of the balls.",
    falsifier: "The wavelength must be that of the balls at every speed, not that of screw, motor or encoder.",
    next_experiment: "P4",
    simplicity: 3,
};

/// `A sin(2πx/p + φ)` in newtons, whatever the friction; richer: with the second harmonic.
pub(super) const DRIVE_RIPPLE: Definition = Definition {
    id: Id::DriveRipple,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "fundamental",
            shape: &[scale("wavelength_m", "m", 1e-3, 0.05, 240)],
            amplitudes: &[SINE_N, COSINE_N],
            columns: |c, s| waves(c, s[0], 1, |_| 1.0),
            phase_bound: true,
        },
        Form {
            name: "two-harmonics",
            shape: &[scale("wavelength_m", "m", 1e-3, 0.05, 240)],
            amplitudes: &[
                SINE_N,
                COSINE_N,
                amplitude("sine_2_n", "N", Sign::Free, 0.3),
                amplitude("cosine_2_n", "N", Sign::Free, 0.3),
            ],
            columns: |c, s| waves(c, s[0], 2, |_| 1.0),
            phase_bound: true,
        },
    ],
    axis: "wavelength",
    statement: "The drive adds a force that repeats with its own pitch: screw lead, motor cogging, a bent coupling.",
    falsifier: "Its wavelength must be one of the drive's, and it must not change with the preload.",
    next_experiment: "P4",
    simplicity: 4,
};

/// `x' = x + A sin(2πx/p)`: the speed is read wrong by `2πA/p cos`, and the friction with it.
pub(super) const ENCODER_CYCLIC_ERROR: Definition = Definition {
    id: Id::EncoderCyclicError,
    kind: Kind::Sensor,
    forms: &[Form {
        name: "fundamental",
        shape: &[scale("period_m", "m", 1e-5, 1e-3, 80)],
        amplitudes: &[
            amplitude("relative_speed_sine", "", Sign::Free, 0.02),
            amplitude("relative_speed_cosine", "", Sign::Free, 0.02),
        ],
        columns: |c, s| {
            // a period that passes within less than four rows is not resolved
            let step = c.run.step_s();
            let of = |n: usize| {
                let rows = s[0] / (c.motion.velocity_m_s[n].abs() * step);
                if rows > 4.0 { answer(c, n) } else { 0.0 }
            };
            waves(c, s[0], 1, of)
        },
        phase_bound: true,
    }],
    axis: "wavelength",
    statement: "The encoder's error repeats with its period, and the speed that the law is fed with it.",
    falsifier: "The wavelength must be the encoder's; a second encoder must not show it.",
    next_experiment: "P1",
    simplicity: 6,
};

/// What balls modulate: all drag that grows with the preload; the whole friction of a law that knows none.
fn loaded(c: &Context<'_>, row: usize) -> f64 {
    if c.steady.preload_n.is_empty() { c.direction[row] * drag(c, row) } else { c.by_preload_n[row] }
}

/// ∂F/∂ln V of the law's friction.
fn answer(c: &Context<'_>, row: usize) -> f64 {
    // friction knows viscosity and speed only as their product
    c.by_viscosity_n[row]
}
