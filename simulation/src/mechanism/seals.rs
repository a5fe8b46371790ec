//! Drag that does not ask for the load: seals, churning.

use super::column::{odd, shown};
use super::definition::{Amplitude, Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id};

/// Speed at which amplitudes of speed-dependent drag are stated, m/s.
const REFERENCE_M_S: f64 = 0.1;

const SEAL: Amplitude = amplitude("seal_n", "N", Sign::Positive, 2.0);

/// `F = F_s sign(V)`; richer: it grows weakly with speed, `F_s (V/V_0)^n`.
pub(super) const SEAL_DRAG: Definition = Definition {
    id: Id::SealDrag,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "constant",
            shape: &[],
            amplitudes: &[SEAL],
            columns: |c, _| shown([odd(c, |_| 1.0)]),
            phase_bound: false,
        },
        Form {
            name: "grows-weakly",
            shape: &[scale("exponent", "", 0.03, 0.25, 4)],
            amplitudes: &[SEAL],
            columns: |c, s| shown([powered(c, s[0], |_| 1.0)]),
            phase_bound: false,
        },
    ],
    axis: "direction",
    statement: "Seals, wipers or the ball cage add a constant drag that the simulation does not have.",
    falsifier: "With the seals off, or on the unloaded block, the same drag must disappear or remain alone.",
    next_experiment: "seals-off",
    simplicity: 1,
};

/// `F = c (V/V_0)^n sign(V)`; richer: in proportion to the viscosity, as churning is.
pub(super) const VISCOUS_DRAG: Definition = Definition {
    id: Id::ViscousDrag,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "power",
            shape: &[scale("exponent", "", 0.3, 2.0, 6)],
            amplitudes: &[amplitude("at_reference_speed_n", "N", Sign::Positive, 1.0)],
            columns: |c, s| shown([powered(c, s[0], |_| 1.0)]),
            phase_bound: false,
        },
        Form {
            name: "churning",
            shape: &[scale("exponent", "", 0.3, 2.0, 6)],
            amplitudes: &[amplitude("at_reference_speed_and_100_cst_n", "N", Sign::Positive, 1.0)],
            columns: |c, s| {
                let nu = &c.steady.viscosity_cst;
                // of an oil at one temperature this is the form above
                let (low, high) = super::column::span(nu);
                (!nu.is_empty() && high > 1.02 * low).then_some(())?;
                shown([powered(c, s[0], |n| nu[n] / 100.0)])
            },
            phase_bound: false,
        },
    ],
    axis: "velocity",
    statement: "A drag that grows with speed and does not depend on the load: seals with oil under them, or churning.",
    falsifier: "It must be the same at another preload; churning must shrink as the oil warms.",
    next_experiment: "second-preload",
    simplicity: 2,
};

fn powered(c: &Context<'_>, exponent: f64, of: impl Fn(usize) -> f64) -> Vec<f64> {
    let v = &c.motion.velocity_m_s;
    odd(c, |n| of(n) * (v[n].abs() / REFERENCE_M_S).powf(exponent))
}
