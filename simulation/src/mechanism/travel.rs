//! What changes with the way travelled.

use super::column::{even, odd, shown};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id};

/// `F = A e^(-s/s_g)`: decays with travel, not with time.
pub(super) const RUN_IN: Definition = Definition {
    id: Id::RunIn,
    kind: Kind::Physics,
    forms: &[Form {
        name: "exponential",
        shape: &[scale("length_m", "m", 0.5, 500.0, 8)],
        amplitudes: &[amplitude("at_start_n", "N", Sign::Positive, 2.0)],
        columns: |c, s| {
            // a length beside which the way travelled is nothing makes a constant
            (way(c) > 0.3 * s[0]).then_some(())?;
            shown([odd(c, |n| (-c.travel_m[n] / s[0]).exp())])
        },
        phase_bound: false,
    }],
    axis: "travel",
    statement: "Fresh grease or new seals add a drag that wears off with the way travelled.",
    falsifier: "After a pause it must go on where it stopped; relubrication must bring it back.",
    next_experiment: "repeat-later",
    simplicity: 4,
};

/// `ΔF_p/F_p = -k s`; richer: with a part that ends, `-w (1 - e^(-s/s_1))`.
pub(super) const PRELOAD_LOSS: Definition = Definition {
    id: Id::PreloadLoss,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "linear",
            shape: &[],
            amplitudes: &[amplitude("preload_per_metre", "1/m", Sign::Negative, -1e-3)],
            columns: |c, _| shown([even(c, |n| c.by_preload_n[n] * c.travel_m[n])]),
            phase_bound: false,
        },
        Form {
            name: "ends",
            shape: &[scale("length_m", "m", 2.0, 500.0, 6)],
            amplitudes: &[amplitude("preload_share", "", Sign::Negative, -0.05)],
            columns: |c, s| {
                (way(c) > 0.3 * s[0]).then_some(())?;
                shown([even(c, |n| c.by_preload_n[n] * (1.0 - (-c.travel_m[n] / s[0]).exp()))])
            },
            phase_bound: false,
        },
    ],
    axis: "travel",
    statement: "The guide loses preload as it travels: wear, or a fit that settles.",
    falsifier: "A later recording must start with the lower preload; all load-dependent drag must shrink alike, the seals' not.",
    next_experiment: "P10",
    simplicity: 3,
};

/// Whole way of the run, m.
fn way(c: &Context<'_>) -> f64 {
    c.travel_m.last().copied().unwrap_or(0.0)
}
