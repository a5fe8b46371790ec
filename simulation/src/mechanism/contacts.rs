//! Friction inside the loaded contacts that the law's coefficient does not cover.

use super::context::Context;
use super::definition::{Amplitude, Columns, Definition, Form, Kind};
use super::id::Id;
use super::{Positive, amplitude, at_most, ratio, shown, steps, whole};

/// E5 to E7: `F ~ Q^(4/3)` to `Q^(5/3)`, hardly distinguishable, hence one exponent.
pub(super) const HYSTERESIS_AND_SLIP: Definition = Definition {
    id: Id::HysteresisAndSlip,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("drag_at_150_n_per_ball_n", "N", Positive, 2.0)],
            columns: |context, _| load_power(context, 1.5),
            phase_bound: false,
            equation: "F = drag·sign(V)·(Q/150 N)^1.5",
        },
        Form {
            name: "exponent",
            shape: &[steps("exponent", "", 1.3, 1.7, 3)],
            amplitudes: &[amplitude("drag_at_150_n_per_ball_n", "N", Positive, 2.0)],
            columns: |context, shape| load_power(context, *shape.first()?),
            phase_bound: false,
            equation: "F = drag·sign(V)·(Q/150 N)^exponent",
        },
    ],
    axis: "preload",
    statement: "the contacts lose energy by elastic hysteresis and differential slip, which rise faster than the load",
    falsifier: "over preloads of 1:10 the added friction does not rise faster than the preload",
    confused_with: "Coulomb friction, hydrodynamic rolling and seals, exactly so at one preload: three preloads over 1:10",
    next_experiment: "P2",
    simplicity: 5,
};

fn load_power(context: &Context<'_>, exponent: f64) -> Option<Columns> {
    if context.steady.load_per_ball_n.is_empty() {
        return None;
    }
    shown(vec![context.against_motion(|n| libm::pow(context.relative_load(n), exponent))])
}

/// E8, Houpert's form of the rolling resistance: `F ~ (η V)^0.66 Q^0.47`.
pub(super) const HYDRODYNAMIC_ROLLING: Definition = Definition {
    id: Id::HydrodynamicRolling,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[amplitude("drag_at_reference_n", "N", Positive, 0.5)],
            columns: |context, _| rolling(context, 0.66),
            phase_bound: false,
            equation: "F = drag·sign(V)·(ν/100 cSt · |V|/(0.1 m/s))^0.66·(Q/150 N)^0.47",
        },
        Form {
            name: "exponent",
            shape: &[steps("speed_exponent", "", 0.5, 0.8, 3)],
            amplitudes: &[amplitude("drag_at_reference_n", "N", Positive, 0.5)],
            columns: |context, shape| rolling(context, *shape.first()?),
            phase_bound: false,
            equation: "F = drag·sign(V)·(ν/100 cSt · |V|/(0.1 m/s))^speed_exponent·(Q/150 N)^0.47",
        },
    ],
    axis: "velocity",
    statement: "the oil in the inlet of the contacts resists rolling, by the 2/3 power of speed and viscosity and about \
                the root of the load",
    falsifier: "unloading the block takes the rise with speed away in proportion to the load, or leaves all of it",
    confused_with: "viscous drag and the viscous term of the law: a wide range of speeds, a second preload and a second \
                    temperature",
    next_experiment: "P3",
    simplicity: 6,
};

fn rolling(context: &Context<'_>, exponent: f64) -> Option<Columns> {
    let nu = &context.steady.viscosity_cst;
    if context.steady.load_per_ball_n.is_empty() {
        return None;
    }
    let of = |n: usize| {
        let nu = nu.get(n).map_or(1.0, |nu| nu / 100.0);
        libm::pow(nu * context.speed_m_s(n) / 0.1, exponent) * libm::pow(context.relative_load(n), 0.47)
    };
    shown(vec![context.against_motion(of)])
}

/// E9: the viscous term saturates, `x -> x_0 asinh(x/x_0)`. Far below `speed` only the onset shows, as the cube of the
/// speed: the range extends beyond the speeds of guides so that its end says nothing of the cause. The stress follows
/// the shear rate, which grows with the load as the slip in the contact does: in Eq. 20 as `Q^(1/3)`, and more where the
/// pressure thickens the oil.
pub(super) const TRACTION_SATURATION: Definition = Definition {
    id: Id::TractionSaturation,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("speed_m_s", "m/s", 2e-3, 5.0, 8)],
            amplitudes: &SATURATED,
            columns: |context, shape| saturation(context, *shape.first()?, 1.0 / 3.0),
            phase_bound: false,
            equation: "F = part·sign(V)·F_v·(asinh(x)/x - 1), x = |V|/speed·(ν/100 cSt)·(Q/150 N)^(1/3), without ν or Q \
                       where the law knows none, F_v the law's viscous friction",
        },
        Form {
            name: "pressure",
            shape: &[ratio("speed_m_s", "m/s", 2e-3, 5.0, 6), steps("load_exponent", "", 0.0, 1.0, 4)],
            amplitudes: &SATURATED,
            columns: |context, shape| saturation(context, *shape.first()?, *shape.get(1)?),
            phase_bound: false,
            equation: "F as above, x = |V|/speed·(ν/100 cSt)·(Q/150 N)^load_exponent",
        },
    ],
    axis: "velocity",
    statement: "the shear stress of the oil film saturates: viscous friction grows with the logarithm of speed",
    falsifier: "at speeds over two decades the friction rises in proportion to speed after all",
    confused_with: "viscous drag with an exponent below 1, inlet heating: speeds over two to three decades at two loads",
    next_experiment: "P1",
    simplicity: 6,
};

const SATURATED: [Amplitude; 1] = [Amplitude { least: 0.3, ..at_most("part", "", Positive, 1.0, 3.0) }];

fn saturation(context: &Context<'_>, speed: f64, load_exponent: f64) -> Option<Columns> {
    if context.viscous_n.is_empty() {
        return None;
    }
    let of = |n: usize| {
        let x = of_film_m_s(context, n, load_exponent) / speed;
        // asinh(x)/x = 1 - x²/6 + ... without cancellation
        let less = if x < 1e-3 { -x * x / 6.0 } else { libm::asinh(x) / x - 1.0 };
        context.viscous_n[n] * less
    };
    shown(vec![context.against_motion(of)])
}

/// Speed that says as much of the oil film as the Hersey number of Eq. 20 does, m/s: that at 100 cSt and 150 N per ball
/// with the same film. Slip in the contact grows with the load as `Q^(2/3)` and the pressure as `Q^(1/3)`, so that the
/// Hersey number grows with `Q^(1/3)`. Laws without a viscosity or a load know the speed alone.
///
/// ```text
/// |V|·(ν/100 cSt)·(Q/150 N)^exponent
/// ```
fn of_film_m_s(context: &Context<'_>, row: usize, load_exponent: f64) -> f64 {
    let nu = context.steady.viscosity_cst.get(row).map_or(1.0, |nu| nu / 100.0);
    nu * context.speed_m_s(row) * libm::pow(context.relative_load(row), load_exponent)
}

/// Mixed friction: `F ~ Q exp(-(H/H_s)^δ)`, for laws without such a term.
pub(super) const STRIBECK: Definition = Definition {
    id: Id::Stribeck,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("speed_m_s", "m/s", 1e-3, 0.3, 7)],
            amplitudes: &[amplitude("rise_n", "N", Positive, 5.0)],
            columns: |context, shape| mixed(context, *shape.first()?, 1.0),
            phase_bound: false,
            equation: "F = rise·sign(V)·(Q/150 N)·exp(-x), x = |V|/speed·(ν/100 cSt)·(Q/150 N)^(1/3), without ν or Q where \
                       the law knows none",
        },
        Form {
            name: "exponent",
            shape: &[ratio("speed_m_s", "m/s", 1e-3, 0.3, 6), ratio("exponent", "", 0.5, 2.0, 3)],
            amplitudes: &[amplitude("rise_n", "N", Positive, 5.0)],
            columns: |context, shape| mixed(context, *shape.first()?, *shape.get(1)?),
            phase_bound: false,
            equation: "F = rise·sign(V)·(Q/150 N)·exp(-x^exponent)",
        },
    ],
    axis: "velocity",
    statement: "at low speed the surfaces touch: friction falls with speed until a film carries",
    falsifier: "a staircase of slow speeds, up and down, shows no fall of friction with speed",
    confused_with: "noise of the speed channel at low speed: derive speed over a longer window; breakaway: it ends after a \
                    distance, not at a speed",
    next_experiment: "P1",
    simplicity: 3,
};

fn mixed(context: &Context<'_>, speed: f64, exponent: f64) -> Option<Columns> {
    if context.has_stribeck {
        return None;
    }
    let of = |n: usize| {
        let x = of_film_m_s(context, n, 1.0 / 3.0) / speed;
        let x = if exponent == 1.0 { x } else { libm::pow(x, exponent) };
        context.relative_load(n) * libm::exp(-x)
    };
    shown(vec![context.against_motion(of)])
}

/// E10: friction grows with the distance run since the film was last replenished.
pub(super) const STARVATION: Definition = Definition {
    id: Id::Starvation,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[ratio("length_m", "m", 0.5, 200.0, 6)],
            amplitudes: &STARVED,
            columns: |context, shape| starved(context, *shape.first()?, 10.0),
            phase_bound: false,
            equation: "F = (growth·F_c - thinning·dF_law/dlnν)·g; dg = (1 - g)·ds/length while moving, \
                       dg = -g·dt/(10 s) at rest: a starved film is as thin as that of a thinner oil",
        },
        Form {
            name: "recovery",
            shape: &[ratio("length_m", "m", 0.5, 200.0, 5), ratio("recovery_s", "s", 1.0, 300.0, 4)],
            amplitudes: &STARVED,
            columns: |context, shape| starved(context, *shape.first()?, *shape.get(1)?),
            phase_bound: false,
            equation: "as minimal, with recovery_s instead of 10 s",
        },
        Form {
            name: "film",
            shape: &[
                ratio("length_m", "m", 0.5, 200.0, 5),
                ratio("recovery_s", "s", 1.0, 300.0, 4),
                steps("depth", "", 0.3, 0.98, 3),
            ],
            amplitudes: &[amplitude("growth", "", Positive, 0.1), whole("part", 0.4)],
            columns: |context, shape| {
                let (dry, depth) = (dryness(context, *shape.first()?, *shape.get(1)?), *shape.get(2)?);
                let logs: Vec<f64> = dry.iter().map(|dry| libm::log1p(-depth * dry)).collect();
                let contact = context.dry_n();
                shown(vec![context.rows(|n| contact[n] * dry[n]), context.thinned_n(&logs)])
            },
            phase_bound: false,
            equation: "F = growth·F_c·g + part·(F_law(ν·(1 - depth·g)) - F_law(ν)), g as minimal, F_c the law's friction in \
                       proportion to the load",
        },
        Form {
            name: "reflow",
            shape: &[ratio("time_s", "s", 2.0, 200.0, 5), ratio("recovery_s", "s", 1.0, 300.0, 4)],
            amplitudes: &[amplitude("growth", "", Positive, 0.1)],
            columns: |context, shape| {
                let (dry, drag) = (undersupply(context, *shape.first()?, *shape.get(1)?), &context.steady.drag_n);
                shown(vec![context.against_motion(|n| drag[n] * dry[n])])
            },
            phase_bound: false,
            equation: "F = growth·F_law·g; dg = (V/(V + 0.3 m/s) - g)·dt/time while moving, dg = -g·dt/recovery_s at rest: \
                       oil flows back while it is used up, and the coefficient rises as a whole",
        },
    ],
    axis: "travel",
    statement: "the contacts use up the oil in front of them: the film thins while the block runs and recovers in a rest, \
                which drags more where contacts touch and less where the film is sheared",
    falsifier: "after a rest, a long stroke or fresh grease the friction stays where it was",
    confused_with: "self-heating, which lowers the viscosity: a temperature sensor; run-in, which does not come back after \
                    a rest",
    next_experiment: "P8",
    simplicity: 6,
};

/// Growth of dry contact through the film, and thinning of the film that is left.
const STARVED: [Amplitude; 2] = [amplitude("growth", "", Positive, 0.1), amplitude("thinning", "", Positive, 0.1)];

fn starved(context: &Context<'_>, length: f64, recovery: f64) -> Option<Columns> {
    let dry = dryness(context, length, recovery);
    let (touching, by_oil) = (context.dry_n(), context.by_oil_n());
    shown(vec![context.rows(|n| touching[n] * dry[n]), context.rows(|n| -by_oil[n] * dry[n])])
}

/// Speed at which the contacts use up half of the oil that flows back to them, m/s: the lowest at which E10 has starvation
/// set in.
const HALF_SUPPLIED_M_S: f64 = 0.3;

/// Part of the oil that is missing, row by row, where it flows back at all times; it takes so long to settle, s, while the
/// block moves and at rest.
fn undersupply(context: &Context<'_>, time: f64, recovery: f64) -> Vec<f64> {
    let mut missing = 0.0;
    (0..context.len())
        .map(|n| {
            let speed = context.speed_m_s(n);
            let (settles, within) = match context.at_rest[n] {
                true => (0.0, recovery),
                false => (speed / (speed + HALF_SUPPLIED_M_S), time),
            };
            let step = (settles - missing) * -libm::expm1(-context.step_s(n) / within);
            // a row without a speed says nothing of those behind it
            missing += if step.is_finite() { step } else { 0.0 };
            missing
        })
        .collect()
}

/// Depletion of the film, row by row: 0 fresh, 1 dry.
fn dryness(context: &Context<'_>, length: f64, recovery: f64) -> Vec<f64> {
    let mut dry = 0.0;
    (0..context.len())
        .map(|n| {
            if context.at_rest[n] {
                dry *= libm::exp(-context.step_s(n) / recovery);
            } else {
                dry = 1.0 - (1.0 - dry) * libm::exp(-context.path.step_m[n].max(0.0) / length);
            }
            dry
        })
        .collect()
}
