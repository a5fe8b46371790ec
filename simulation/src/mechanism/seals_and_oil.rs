//! Friction of seals, and of oil away from the loaded contacts.

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Positive, amplitude, ratio, shown};

/// E1: `F = F_s·sign(V)`; the richer form lets the lips lift a little with speed.
pub(super) const SEAL_DRAG: Definition = Definition {
    id: Id::SealDrag,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0)],
            columns: |context, _| constant(context),
            phase_bound: false,
            equation: "F = drag·sign(V)",
        },
        Form {
            name: "lip",
            shape: &[],
            amplitudes: &[amplitude("drag_n", "N", Positive, 5.0), amplitude("drag_per_decade_n", "N", Positive, 0.5)],
            columns: lip,
            phase_bound: false,
            equation: "F = sign(V)·(drag + drag_per_decade·log10(1 + |V|/(1 mm/s)))",
        },
    ],
    axis: "direction",
    statement: "seals, wipers or the cage add a friction that does not depend on load, and hardly on speed",
    falsifier: "with the seals off, or at a second preload, the added friction is not the same number of newtons",
    confused_with: "Coulomb friction in the contacts, exactly so at one preload: a second preload or a run with the seals \
                    off tells; a cable chain: disconnect it",
    next_experiment: "seals-off",
    simplicity: 1,
};

fn constant(context: &Context<'_>) -> Option<Columns> {
    shown(vec![context.against_motion(|_| 1.0)])
}

fn lip(context: &Context<'_>, _: &[f64]) -> Option<Columns> {
    let lift = context.against_motion(|n| libm::log10(1.0 + context.speed_m_s(n) / 1e-3));
    shown(vec![context.against_motion(|_| 1.0), lift])
}

/// E2 and E11: `F = c V^n`, n from 0.3 to 1 (physics of seal lips and churned grease), and a little beyond.
pub(super) const VISCOUS_DRAG: Definition = Definition {
    id: Id::ViscousDrag,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("exponent", "", 0.3, 1.25, 5)],
            amplitudes: &[amplitude("drag_at_100_mm_s_n", "N", Positive, 3.0)],
            columns: viscous,
            phase_bound: false,
            equation: "F = drag·sign(V)·(|V|/(0.1 m/s))^exponent",
        },
        Form {
            name: "churning",
            shape: &[ratio("exponent", "", 0.3, 1.25, 5)],
            amplitudes: &[
                amplitude("drag_at_100_mm_s_n", "N", Positive, 3.0),
                amplitude("drag_at_100_mm_s_and_100_cst_n", "N", Positive, 3.0),
            ],
            columns: churning,
            phase_bound: false,
            equation: "F = sign(V)·(|V|/(0.1 m/s))^exponent·(drag + drag_at_100_cst·ν/100 cSt)",
        },
    ],
    axis: "velocity",
    statement: "seals or churned grease add a friction that grows with speed and not with load",
    falsifier: "with the block unloaded, or at a second preload, the friction that grows with speed is not the same",
    confused_with: "the viscous term of the law, exactly so at one preload: a second preload; seals against churned grease: \
                    a second temperature",
    next_experiment: "second-preload",
    simplicity: 2,
};

fn viscous(context: &Context<'_>, shape: &[f64]) -> Option<Columns> {
    let exponent = *shape.first()?;
    shown(vec![context.against_motion(|n| libm::pow(context.speed_m_s(n) / 0.1, exponent))])
}

fn churning(context: &Context<'_>, shape: &[f64]) -> Option<Columns> {
    let nu = &context.steady.viscosity_cst;
    let warm = nu.first()?;
    if nu.iter().all(|x| x == warm) {
        return None;
    }
    let mut columns = viscous(context, shape)?;
    let churned = columns[0].iter().zip(nu).map(|(force, nu)| force * nu / 100.0).collect();
    columns.push(churned);
    Some(columns)
}
