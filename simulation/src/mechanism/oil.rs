//! Friction of the contact that Eq. 19 does not have, or does not have like this.

use super::column::{drag, odd, shown, span};
use super::definition::{Definition, Form, Kind, Sign, amplitude, scale};
use super::{Context, Id, temperature};

/// Load per ball at which amplitudes are stated, N.
const REFERENCE_N: f64 = 100.0;

/// `F ~ Q^p`, p from 4/3 (hysteresis) to 5/3 (Heathcote slip); the two are not separable in practice.
pub(super) const HYSTERESIS_AND_SLIP: Definition = Definition {
    id: Id::HysteresisAndSlip,
    kind: Kind::Physics,
    forms: &[Form {
        name: "power-of-load",
        shape: &[scale("exponent", "", 1.3, 1.7, 3)],
        amplitudes: &[amplitude("at_100_n_per_ball_n", "N", Sign::Positive, 1.0)],
        columns: |c, s| {
            let q = loads(c)?;
            shown([odd(c, |n| (q[n] / REFERENCE_N).powf(s[0]))])
        },
        phase_bound: false,
    }],
    axis: "preload",
    statement: "Elastic hysteresis and slip within the contact add a drag that grows faster than the load.",
    falsifier: "Over a load range of 1 to 10 it must grow with a power of the load between 4/3 and 5/3, at every speed alike.",
    next_experiment: "P2",
    simplicity: 4,
};

/// `F ~ (ν V)^0.66 Q^0.47`      EHL inlet, Houpert's form
pub(super) const HYDRODYNAMIC_ROLLING: Definition = Definition {
    id: Id::HydrodynamicRolling,
    kind: Kind::Physics,
    forms: &[Form {
        name: "inlet",
        shape: &[],
        amplitudes: &[amplitude("at_reference_n", "N", Sign::Positive, 0.4)],
        columns: |c, _| {
            let (q, nu, v) = (loads(c)?, &c.steady.viscosity_cst, &c.motion.velocity_m_s);
            shown([odd(c, |n| (nu[n] / 100.0 * v[n].abs() / 0.1).powf(0.66) * (q[n] / REFERENCE_N).powf(0.47))])
        },
        phase_bound: false,
    }],
    axis: "velocity",
    statement: "The oil in the inlet of the contacts resists rolling; its share is largest at small loads and high speed.",
    falsifier: "At small load the drag must rise with speed, at large load hardly; warm oil must lower it.",
    next_experiment: "P2",
    simplicity: 5,
};

/// `μ_v H -> μ_v H_0 asinh(H/H_0)`: the viscous branch bends over.
pub(super) const TRACTION_SATURATION: Definition = Definition {
    id: Id::TractionSaturation,
    kind: Kind::Physics,
    forms: &[Form {
        name: "eyring",
        shape: &[scale("onset", "", 0.1, 1.5, 5)],
        amplitudes: &[amplitude("share", "", Sign::Positive, 1.0)],
        columns: |c, s| {
            let h = argument(c)?;
            let top = span(&h).1;
            let onset = s[0] * top;
            // the law's own viscous branch, from its answer to the viscosity at the top: friction follows ln ν there
            let at_top = h.iter().position(|x| *x == top)?;
            let viscous = (c.by_viscosity_n[at_top].abs()).max(0.05 * drag(c, at_top)) / top;
            shown([odd(c, |n| viscous * (onset * (h[n] / onset).asinh() - h[n]))])
        },
        phase_bound: false,
    }],
    axis: "velocity",
    statement: "The shear stress in the oil film saturates: the viscous branch bends over instead of rising on.",
    falsifier: "At still higher speed the drag must grow with the logarithm of the speed.",
    next_experiment: "P1",
    simplicity: 5,
};

/// `F ~ e^(-V/V_s)`, for laws without such a term.
pub(super) const STRIBECK: Definition = Definition {
    id: Id::Stribeck,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "exponential",
            shape: &[scale("speed_m_s", "m/s", 5e-4, 0.1, 8)],
            amplitudes: &[amplitude("at_rest_n", "N", Sign::Positive, 2.0)],
            columns: |c, s| fallen(c, s[0], 1.0),
            phase_bound: false,
        },
        Form {
            name: "gaussian",
            shape: &[scale("speed_m_s", "m/s", 5e-4, 0.1, 8)],
            amplitudes: &[amplitude("at_rest_n", "N", Sign::Positive, 2.0)],
            columns: |c, s| fallen(c, s[0], 2.0),
            phase_bound: false,
        },
    ],
    axis: "velocity",
    statement: "Friction falls with speed where balls and raceway still touch (mixed friction); the simulation's law does not.",
    falsifier: "A speed staircase must show the fall at low speed in both directions; thicker oil must move it to lower speed.",
    next_experiment: "P1",
    simplicity: 3,
};

/// The film runs dry in motion and is refilled at rest: `x' = (1 - x)/τ` or `-x/τ`, `F = a D x`.
pub(super) const STARVATION: Definition = Definition {
    id: Id::Starvation,
    kind: Kind::Physics,
    forms: &[Form {
        name: "refilled-at-rest",
        shape: &[scale("time_s", "s", 3.0, 300.0, 5)],
        amplitudes: &[amplitude("share_of_drag", "", Sign::Positive, 0.1)],
        columns: |c, s| {
            // without a rest it is a start that never comes again: run-in
            c.at_rest.iter().any(|rest| *rest).then_some(())?;
            let dry = temperature::depleted(c, s[0]);
            shown([odd(c, |n| drag(c, n) * dry[n])])
        },
        phase_bound: false,
    }],
    axis: "time",
    statement: "The contacts run short of oil while the carriage moves and recover when it rests.",
    falsifier: "After a rest, or a long stroke, the drag must be back; relubrication must end it.",
    next_experiment: "relubricate",
    simplicity: 5,
};

fn fallen(c: &Context<'_>, speed_m_s: f64, power: f64) -> Option<Vec<Vec<f64>>> {
    // a guide's law has the term, unless its file says 0
    if has_stribeck(c) {
        return None;
    }
    let v = &c.motion.velocity_m_s;
    shown([odd(c, |n| (-(v[n].abs() / speed_m_s).powf(power)).exp())])
}

/// Whether the law's drag falls with speed anywhere.
fn has_stribeck(c: &Context<'_>) -> bool {
    !c.steady.hersey.is_empty() && c.by_viscosity_n.iter().zip(&c.direction).any(|(f, d)| f * d < -1e-9)
}

/// What the viscous term of the law counts: Hersey number, or speed.
fn argument(c: &Context<'_>) -> Option<Vec<f64>> {
    let h: Vec<f64> = if c.steady.hersey.is_empty() {
        c.motion.velocity_m_s.iter().map(|v| v.abs()).collect()
    } else {
        c.steady.hersey.iter().map(|h| if h.is_finite() { *h } else { 0.0 }).collect()
    };
    (span(&h).1 > 0.0).then_some(h)
}

/// Load per ball of every row, N; `None` for a law without.
fn loads(c: &Context<'_>) -> Option<Vec<f64>> {
    let q = &c.steady.load_per_ball_n;
    (!q.is_empty()).then(|| q.iter().map(|q| if q.is_finite() { q.max(0.0) } else { 0.0 }).collect())
}
