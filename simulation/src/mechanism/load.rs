//! Known loads and moments on the block.

use super::context::{Context, filled};
use super::definition::{Definition, Form, Kind};
use super::id::Id;
use super::{Free, Positive, amplitude, at_most, shown, steps};

/// E13: a load W loads one half of the preloaded contacts and relieves the other, `(1+t)^1.5 - (1-t)^1.5 = W/F_p`;
/// beyond `W = 2√2 F_p` one half is unloaded.
pub(super) const EXTERNAL_LOAD: Definition = Definition {
    id: Id::ExternalLoad,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[at_most("part", "", Positive, 1.0, 20.0)],
            columns: |context, _| shown(vec![symmetric(context, Coefficient::OfTheFilm)?]),
            phase_bound: false,
            equation: "F = part·F_law·(r+·m(r+) + r-·m(r-) - 2)/2, r+ = (1+t)^1.5, r- = (1-t)^1.5, r+ - r- = |W|/F_p, \
                       m(r) = μ(H(r·Q))/μ(H(Q)), of a column of force r^(k-1), k = dlnF_law/dlnF_p; without a preload \
                       F = part·sign(V)·|W|/1000",
        },
        Form {
            name: "load-only",
            shape: &[],
            amplitudes: &[at_most("part", "", Positive, 1.0, 20.0)],
            columns: |context, _| shown(vec![symmetric(context, Coefficient::Same)?]),
            phase_bound: false,
            equation: "F = part·F_law·(r+ + r- - 2)/2, r+ and r- as in minimal: the coefficient stays that of the law's load",
        },
        Form {
            name: "carried",
            shape: &[],
            amplitudes: &[amplitude("drag_per_kn_n", "N", Positive, 1.0)],
            columns: |context, _| {
                let load = filled(context.run.external_load_n.as_ref())?;
                shown(vec![context.against_motion(|n| load[n].abs() / 1000.0)])
            },
            phase_bound: false,
            equation: "F = drag_per_kn·sign(V)·|W|/1000: the load is carried by contacts of its own",
        },
        Form {
            name: "lopsided",
            shape: &[],
            amplitudes: &[at_most("part", "", Positive, 1.0, 20.0), at_most("preload_per_load", "", Free, 0.02, 0.05)],
            columns: |context, _| {
                let load = filled(context.run.external_load_n.as_ref())?;
                let force = context.by_load_n();
                let preload = &context.steady.preload_n;
                let of = |n: usize| {
                    let p = preload.get(n).copied().unwrap_or(1000.0);
                    if p > 0.0 { force[n] * load[n] / p } else { 0.0 }
                };
                shown(vec![symmetric(context, Coefficient::OfTheFilm)?, context.rows(of)])
            },
            phase_bound: false,
            equation: "as minimal, and preload_per_load·W/F_p·dF_law/dlnF_p: the two halves are not alike",
        },
    ],
    axis: "load",
    statement: "the known load on the block changes how its balls share the load, and with it the friction",
    falsifier: "the friction does not depend on the load, or pushing and pulling with the same weight differ",
    confused_with: "a higher preload: reverse the load, its effect stays the same; crosstalk of the load into the force \
                    sensor: it does not change sign with direction",
    next_experiment: "P9",
    simplicity: 2,
};

/// Largest exponent of the load that any friction has: where a column of force is nearly 0, its slope relative to it is
/// meaningless.
const STEEPEST: f64 = 4.0;

/// Friction coefficient of contacts whose load is no longer that of the law.
#[derive(Clone, Copy)]
enum Coefficient {
    /// That of the law's load: friction grows with the sum of the loads, as E13 has it.
    Same,
    /// That of the film at their own load.
    OfTheFilm,
}

/// Change of friction by two halves of the contacts at their own loads, relative to both at the law's load.
///
/// ```text
/// F_law·(r+ + r- - 2)/2,   r± = (1 ± t)^1.5                     at the same coefficient
/// F_law·(r+·μ(H(r+·Q)) + r-·μ(H(r-·Q)) - 2μ(H))/2μ(H)           at that of the film
/// F_law·(r+^k + r-^k - 2)/2,   k = dlnF_law/dlnF_p              the same, of laws without a friction coefficient
/// ```
fn symmetric(context: &Context<'_>, coefficient: Coefficient) -> Option<Vec<f64>> {
    let load = filled(context.run.external_load_n.as_ref())?;
    let preload = &context.steady.preload_n;
    if preload.is_empty() {
        return Some(context.against_motion(|n| load[n].abs() / 1000.0));
    }
    let drag = &context.steady.drag_n;
    let mut last = (f64::NAN, [1.0; 2]);
    let mut column = vec![0.0; context.len()];
    for (n, rise) in column.iter_mut().enumerate() {
        let sign = context.steady.direction[n];
        if sign == 0.0 || !(preload[n] > 0.0 && drag[n] > 0.0) {
            continue;
        }
        let ratio = load[n].abs() / preload[n];
        if last.0 != ratio {
            last = (ratio, halves(ratio));
        }
        let of_half = |load: f64| match (coefficient, &context.exact) {
            _ if load <= 0.0 => 0.0,
            (Coefficient::Same, _) => load,
            (Coefficient::OfTheFilm, Some(exact)) => {
                // beyond its geometry a contact is given the film at its limit
                let (own, most_n) = (context.steady.load_per_ball_n[n], exact.load_limit_n());
                let film = |load_n: f64| exact.hersey(load_n.min(0.99 * most_n), 1.0, 1.0);
                let (hersey, friction) = (context.steady.hersey[n], exact.friction());
                load * friction.coefficient(hersey * film(load * own) / film(own)) / friction.coefficient(hersey)
            }
            (Coefficient::OfTheFilm, None) => {
                libm::pow(load, (context.by_preload_n[n] / (sign * drag[n])).clamp(0.0, STEEPEST))
            }
        };
        *rise = sign * drag[n] * (0.5 * last.1.map(of_half).iter().sum::<f64>() - 1.0);
    }
    Some(column)
}

/// Loads of the two halves relative to the load without W: `(1+t)^1.5` and `(1-t)^1.5`, with the t that belongs to
/// `W/F_p`.
fn halves(ratio: f64) -> [f64; 2] {
    let decompressed = 2.0 * std::f64::consts::SQRT_2;
    if ratio >= decompressed {
        return [ratio, 0.0];
    }
    // W/F_p = 3t - t³/8 ..., concave in t: Newton's iteration from below converges monotonically
    let mut t = ratio / 3.0;
    for _ in 0..20 {
        let (up, down) = (libm::sqrt(1.0 + t), libm::sqrt((1.0 - t).max(0.0)));
        let miss = up * up * up - down * down * down - ratio;
        let next = (t - miss / (1.5 * (up + down))).clamp(0.0, 1.0);
        let done = (next - t).abs() < 1e-13;
        t = next;
        if done {
            break;
        }
    }
    [1.0 + t, 1.0 - t].map(|deflection| deflection * libm::sqrt(deflection.max(0.0)))
}

/// Largest relative rise of the preload at 100 N of drag: no lever explains more. It is 3/8 (θ y/D_0)², 0.13 for a drive
/// half a metre above the rail of the published block and eight times that at the 1.4 m of a portal.
const MOST_BY_MOMENT: f64 = 1.0;

/// E14: a moment tilts the block; the sum of its ball loads grows with the square of the moment.
pub(super) const MOMENT_LOAD: Definition = Definition {
    id: Id::MomentLoad,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[],
            amplitudes: &[at_most("preload_at_100_n", "", Positive, 0.05, MOST_BY_MOMENT)],
            columns: |context, _| shown(vec![moment(context, 0.0, OWN_STIFFNESS)]),
            phase_bound: false,
            equation: "F = preload_at_100_n·(F_law/100 N)²·(Q/150 N)^-2·dF_law/dlnF_p: the drive pulls above or below the rail",
        },
        Form {
            name: "yielding-mount",
            shape: &[],
            amplitudes: &[at_most("preload_at_100_n", "", Positive, 0.05, MOST_BY_MOMENT)],
            columns: |context, _| shown(vec![moment(context, 0.0, YIELDING_MOUNT)]),
            phase_bound: false,
            equation: "as minimal with (Q/150 N)^(-4/3): what the rail and the table stand on gives way, and not the block",
        },
        Form {
            name: "table",
            shape: &[steps("mass_kg", "kg", -200.0, 200.0, 11)],
            amplitudes: &[at_most("preload_at_100_n", "", Positive, 0.05, MOST_BY_MOMENT)],
            columns: |context, shape| shown(vec![moment(context, *shape.first()?, OWN_STIFFNESS)]),
            phase_bound: false,
            equation: "as minimal with (F_law + mass·a) for F_law: the inertia of a mass above the rail tilts it as well",
        },
    ],
    axis: "acceleration",
    statement: "the drive's force or a mass above the rail tilts the block, which raises the sum of its loads",
    falsifier: "pulling at the height of the rail leaves the added friction as it is",
    confused_with: "a known load: the moment follows the height of the pull; preload: it does not follow the drive's force",
    next_experiment: "P9",
    simplicity: 6,
};

/// Exponents by which the rise falls with the load per ball: where the block's own contacts resist the moment, and
/// where the compliance of their mount determines the tilt.
///
/// ```text
/// own contacts    tilt ∝ moment·Q^(-1/3), interference D ∝ Q^(2/3)  ->  (tilt/D)² ∝ moment²·Q^-2
/// their mount     tilt ∝ moment                                     ->  (tilt/D)² ∝ moment²·Q^(-4/3)
/// ```
const OWN_STIFFNESS: f64 = 2.0;
const YIELDING_MOUNT: f64 = 4.0 / 3.0;

fn moment(context: &Context<'_>, mass_kg: f64, falls_with_load: f64) -> Vec<f64> {
    let by_load = context.by_load_n();
    let (force, a) = (&context.steady.force_n, &context.motion.acceleration_m_s2);
    let of = |n: usize| {
        let inertia = if a[n].is_finite() { mass_kg * a[n] } else { 0.0 };
        let share = (force[n] + inertia) / 100.0;
        by_load[n] * share * share * libm::pow(context.relative_load(n).max(1e-3), -falls_with_load)
    };
    context.rows(of)
}
