//! What asks for acceleration, or remembers for milliseconds.

use super::column::{drag, follow, force, odd, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id};

/// Fewest rows of a period that a resonance is followed with.
const ROWS_PER_PERIOD: f64 = 4.0;

/// `F = M a`
pub(super) const INERTIA: Definition = Definition {
    id: Id::Inertia,
    kind: Kind::Physics,
    forms: &[Form {
        name: "mass",
        shape: &[],
        amplitudes: &[amplitude("mass_kg", "kg", Sign::Free, 5.0)],
        columns: |c, _| {
            shown([c.motion.acceleration_m_s2.iter().map(|a| if a.is_finite() { *a } else { 0.0 }).collect()])
        },
        phase_bound: false,
    }],
    axis: "acceleration",
    statement: "The force sensor also accelerates a mass that the simulation does not have.",
    falsifier: "At twice the acceleration it must be twice as large; a known mass added must add to it.",
    next_experiment: "known-mass",
    simplicity: 1,
};

/// `τ y' = D(V) - y`: friction follows the speed with a lag; its sign does not.
pub(super) const FRICTIONAL_LAG: Definition = Definition {
    id: Id::FrictionalLag,
    kind: Kind::Physics,
    forms: &[Form {
        name: "first-order",
        shape: &[scale("time_s", "s", 1e-3, 0.1, 6)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| {
            let friction: Vec<f64> = (0..c.len()).map(|n| drag(c, n)).collect();
            let lagging = follow(c, &friction, s[0]);
            shown([odd(c, |n| lagging[n] - friction[n])])
        },
        phase_bound: false,
    }],
    axis: "acceleration",
    statement: "Friction needs some milliseconds to follow a change of speed.",
    falsifier: "In a reversal the sign must change without delay; a filter in the force channel would delay it, too.",
    next_experiment: "P6",
    simplicity: 5,
};

/// `y'' + 2ζω y' + ω² y = ω² F`: the force reaches the sensor through a spring.
pub(super) const STRUCTURAL_RESONANCE: Definition = Definition {
    id: Id::StructuralResonance,
    kind: Kind::Physics,
    forms: &[Form {
        name: "second-order",
        shape: &[scale("frequency_hz", "Hz", 5.0, 200.0, 10), scale("damping", "", 0.02, 0.3, 3)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| {
            (c.run.step_s() * s[0] * ROWS_PER_PERIOD < 1.0).then_some(())?;
            let force = force(c);
            let ringing = ring(c, &force, s[0], s[1]);
            shown([ringing.iter().zip(&force).map(|(y, f)| y - f).collect()])
        },
        phase_bound: false,
    }],
    axis: "frequency",
    statement: "The structure between drive and carriage is elastic and rings after every change of force.",
    falsifier: "The frequency must stay the same at every speed and fall when mass is added.",
    next_experiment: "two-frequencies",
    simplicity: 6,
};

/// The second-order answer, exact for a force that is constant from row to row; starts settled in every part.
fn ring(c: &Context<'_>, force: &[f64], frequency_hz: f64, damping: f64) -> Vec<f64> {
    let w = std::f64::consts::TAU * frequency_hz;
    let wd = w * (1.0 - damping * damping).sqrt();
    let mut y = force.to_vec();
    for part in &c.run.parts {
        let rows = part.rows.clone();
        let (mut x, mut v) = (force.get(rows.start).copied().unwrap_or(0.0), 0.0);
        for n in rows.start + 1..rows.end {
            let t = c.run.time_s[n] - c.run.time_s[n - 1];
            let (sin, cos, fallen) = ((wd * t).sin(), (wd * t).cos(), (-damping * w * t).exp());
            // from the force of this row: the deviation swings freely about it
            let d = x - force[n];
            x = force[n] + fallen * (d * cos + (v + damping * w * d) / wd * sin);
            v = fallen * (v * cos - (w * w * d + damping * w * v) / wd * sin);
            y[n] = x;
        }
    }
    y
}

/// The same column as the lag's, of the whole force: a filter in the force channel.
pub(super) fn filtered(c: &Context<'_>, tau_s: f64) -> Option<Vec<Vec<f64>>> {
    let force = force(c);
    let slow = follow(c, &force, tau_s);
    shown([slow.iter().zip(&force).map(|(y, f)| y - f).collect()])
}
