//! Periodic effects along the stroke: balls and drives.

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Free, amplitude, shown, wave};

/// E30 to E33: balls enter the loaded zone once per two pitches of carriage travel, because they move at half its
/// speed.
pub(super) const BALL_PASS: Definition = Definition {
    id: Id::BallPass,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            // two pitches of the SHS35 are 14.3 mm
            shape: &[wave("wavelength_m", 0.0137, 0.0149)],
            amplitudes: &[amplitude("sine", "", Free, 0.01), amplitude("cosine", "", Free, 0.01)],
            columns: |context, shape| along_the_balls(context, *shape.first()?, 1),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/dlnF_p, k = 2π/wavelength",
        },
        Form {
            name: "two-orders",
            shape: &[wave("wavelength_m", 0.0137, 0.0149)],
            amplitudes: &[
                amplitude("sine_1", "", Free, 0.01),
                amplitude("cosine_1", "", Free, 0.01),
                amplitude("sine_2", "", Free, 0.005),
                amplitude("cosine_2", "", Free, 0.005),
            ],
            columns: |context, shape| along_the_balls(context, *shape.first()?, 2),
            phase_bound: true,
            equation: "as minimal, with the second order: more than one row of balls, out of step",
        },
        Form {
            name: "three-orders",
            shape: &[wave("wavelength_m", 0.0137, 0.0149)],
            amplitudes: &[
                amplitude("sine_1", "", Free, 0.01),
                amplitude("cosine_1", "", Free, 0.01),
                amplitude("sine_2", "", Free, 0.005),
                amplitude("cosine_2", "", Free, 0.005),
                amplitude("sine_3", "", Free, 0.005),
                amplitude("cosine_3", "", Free, 0.005),
            ],
            columns: |context, shape| along_the_balls(context, *shape.first()?, 3),
            phase_bound: true,
            equation: "as minimal, with the second and third order",
        },
    ],
    axis: "wavelength",
    statement: "balls that enter and leave the loaded zone modulate the preload, once per two ball pitches of travel",
    falsifier: "at another speed the ripple keeps its frequency instead of its length, or its length is not two ball pitches",
    confused_with: "screw pitch, motor poles and the encoder, by their wavelength; bolts of the rail are 80 mm apart",
    next_experiment: "P4",
    simplicity: 3,
};

fn along_the_balls(context: &Context<'_>, wavelength: f64, orders: u32) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    shown(context.waves(&context.by_load_n(), wavelength, orders))
}

/// E23: `F = A sin(2πx/p + φ)` whatever the load.
pub(super) const DRIVE_RIPPLE: Definition = Definition {
    id: Id::DriveRipple,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[wave("wavelength_m", 1e-3, 0.06)],
            amplitudes: &[amplitude("sine_n", "N", Free, 1.0), amplitude("cosine_n", "N", Free, 1.0)],
            columns: |context, shape| along_the_drive(context, *shape.first()?, 1),
            phase_bound: true,
            equation: "F = sine·sin(kx) + cosine·cos(kx), k = 2π/wavelength",
        },
        Form {
            name: "two-orders",
            shape: &[wave("wavelength_m", 1e-3, 0.06)],
            amplitudes: &[
                amplitude("sine_1_n", "N", Free, 1.0),
                amplitude("cosine_1_n", "N", Free, 1.0),
                amplitude("sine_2_n", "N", Free, 0.5),
                amplitude("cosine_2_n", "N", Free, 0.5),
            ],
            columns: |context, shape| along_the_drive(context, *shape.first()?, 2),
            phase_bound: true,
            equation: "as minimal, with the second order",
        },
        Form {
            name: "coupling",
            shape: &[wave("wavelength_m", 1e-3, 0.06)],
            amplitudes: &[
                amplitude("sine_n", "N", Free, 1.0),
                amplitude("cosine_n", "N", Free, 1.0),
                amplitude("drag_sine_n", "N", Free, 1.0),
                amplitude("drag_cosine_n", "N", Free, 1.0),
            ],
            columns: |context, shape| {
                let mut columns = along_the_drive(context, *shape.first()?, 1)?;
                let drag = context.against_motion(|_| 1.0);
                columns.extend(context.waves(&drag, *shape.first()?, 1));
                Some(columns)
            },
            phase_bound: true,
            equation: "as minimal, and the same times sign(V): a bent screw drags in both directions",
        },
    ],
    axis: "wavelength",
    statement: "the drive adds a force that repeats with the angle of its screw or motor",
    falsifier: "at another speed the ripple keeps its frequency instead of its length, or it stays with another drive",
    confused_with: "balls that pass, by their wavelength of two pitches and by load: their ripple scales with the drag",
    next_experiment: "P4",
    simplicity: 4,
};

fn along_the_drive(context: &Context<'_>, wavelength: f64, orders: u32) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    shown(context.waves(&vec![1.0; context.len()], wavelength, orders))
}
