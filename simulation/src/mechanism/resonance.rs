//! Elasticity between the drive and the carriage.

use super::context::Context;
use super::definition::{Definition, Form, Kind};
use super::filter::oscillator;
use super::id::Id;
use super::{Free, Positive, amplitude, ratio, shown};

/// Rows per period below which an oscillation is not resolved.
const ROWS_PER_PERIOD: f64 = 2.5;

/// E37: the force is that of a mass on a spring. Structures of axes ring at 30 to 300 Hz; at lower frequency or
/// stronger damping nothing rings, and the column would imitate inertia, filters and delays.
pub(super) const STRUCTURAL_RESONANCE: Definition = Definition {
    id: Id::StructuralResonance,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("frequency_hz", "Hz", 20.0, 300.0, 10), ratio("damping", "", 0.01, 0.1, 3)],
            amplitudes: &[amplitude("part", "", Positive, 1.0), amplitude("mass_kg", "kg", Positive, 10.0)],
            columns: |context, shape| {
                let (frequency, damping) = (*shape.first()?, *shape.get(1)?);
                shown(vec![
                    ringing(context, &context.steady.force_n, frequency, damping)?,
                    ringing(context, &context.motion.acceleration_m_s2, frequency, damping)?,
                ])
            },
            phase_bound: false,
            equation: "F = part·(y - F_law) + mass·(z - a); y'' + 2dωy' + ω²y = ω²·F_law, z the same of the acceleration a, \
                       ω = 2π·frequency",
        },
        Form {
            name: "two-modes",
            shape: &[ratio("frequency_hz", "Hz", 20.0, 150.0, 6), ratio("ratio", "", 1.5, 4.0, 4)],
            amplitudes: &[
                amplitude("part", "", Positive, 1.0),
                amplitude("mass_kg", "kg", Positive, 10.0),
                amplitude("upper_part", "", Positive, 0.5),
                amplitude("upper_mass_kg", "kg", Positive, 5.0),
            ],
            columns: |context, shape| {
                let (frequency, ratio) = (*shape.first()?, *shape.get(1)?);
                let (force, a) = (&context.steady.force_n, &context.motion.acceleration_m_s2);
                shown(vec![
                    ringing(context, force, frequency, 0.05)?,
                    ringing(context, a, frequency, 0.05)?,
                    ringing(context, force, ratio * frequency, 0.05)?,
                    ringing(context, a, ratio * frequency, 0.05)?,
                ])
            },
            phase_bound: false,
            equation: "as minimal with damping 0.05, and a second mode at ratio times the frequency",
        },
        Form {
            name: "turned",
            shape: &[ratio("frequency_hz", "Hz", 20.0, 300.0, 10), ratio("damping", "", 0.01, 0.1, 3)],
            amplitudes: &[amplitude("mass_kg", "kg", Positive, 10.0), amplitude("turned_kg", "kg", Free, 10.0)],
            columns: |context, shape| {
                let (frequency, damping, a) = (*shape.first()?, *shape.get(1)?, &context.motion.acceleration_m_s2);
                shown(vec![ringing(context, a, frequency, damping)?, turned(context, a, frequency, damping)?])
            },
            phase_bound: false,
            equation: "F = mass·(z - a) + turned·z'/ω, z and ω as minimal: elsewhere along the structure it rings with another \
                       phase",
        },
    ],
    axis: "frequency",
    statement: "the structure between drive and carriage is elastic: the force rings at its own frequency after every jerk",
    falsifier: "at another speed the ringing keeps its length along the rail instead of its frequency",
    confused_with: "balls that pass and drive ripple, which keep their length; a delay or low-pass of the force: it does not ring",
    next_experiment: "two-frequencies",
    simplicity: 6,
};

/// Whether rows are close enough to one another for an oscillation.
fn is_resolved(context: &Context<'_>, frequency: f64) -> bool {
    frequency * context.run.step_s() * ROWS_PER_PERIOD < 1.0
}

/// Response of an oscillator to a column, less the column.
fn ringing(context: &Context<'_>, input: &[f64], frequency: f64, damping: f64) -> Option<Vec<f64>> {
    let out = is_resolved(context, frequency).then(|| oscillator(context, input, frequency, damping))?;
    Some(context.rows(|n| if input[n].is_finite() { out[n][0] - input[n] } else { 0.0 }))
}

/// Speed of an oscillator that follows a column, over its angular frequency: a quarter of a period ahead of its position.
fn turned(context: &Context<'_>, input: &[f64], frequency: f64, damping: f64) -> Option<Vec<f64>> {
    let out = is_resolved(context, frequency).then(|| oscillator(context, input, frequency, damping))?;
    let omega = std::f64::consts::TAU * frequency;
    Some(context.rows(|n| if input[n].is_finite() { out[n][1] / omega } else { 0.0 }))
}
