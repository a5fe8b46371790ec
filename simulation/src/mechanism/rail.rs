//! Effects tied to places of the rail.

use std::f64::consts::TAU;

use super::context::Context;
use super::definition::{Columns, Definition, Form, Kind};
use super::id::Id;
use super::table::{FINE, entries, over_stroke};
use super::{Free, PLACE, Positive, STROKE, along_stroke, amplitude, ratio, shown, wave};

/// E15: `dF_p/F_p = 1.5 e(x)/D` with a slow wave e(x).
pub(super) const RAIL_STRAIGHTNESS: Definition = Definition {
    id: Id::RailStraightness,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[along_stroke("wavelength_m", 0.15, 4.0, 12)],
            amplitudes: &[amplitude("sine", "", Free, 0.05), amplitude("cosine", "", Free, 0.05)],
            columns: |context, shape| waves(context, &context.by_interference_n(), *shape.first()?, 1),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/de, k = 2π/wavelength",
        },
        Form {
            name: "three-orders",
            // orders of a wave much longer than the stroke cancel within it and diverge beyond
            shape: &[along_stroke("wavelength_m", 0.2, 1.5, 10)],
            amplitudes: &[
                amplitude("sine_1", "", Free, 0.05),
                amplitude("cosine_1", "", Free, 0.05),
                amplitude("sine_2", "", Free, 0.03),
                amplitude("cosine_2", "", Free, 0.03),
                amplitude("sine_3", "", Free, 0.02),
                amplitude("cosine_3", "", Free, 0.02),
            ],
            columns: |context, shape| waves(context, &context.by_interference_n(), *shape.first()?, 3),
            phase_bound: true,
            equation: "as minimal, with the second and third order of the wave",
        },
        Form {
            name: "bolts",
            // rails are bolted down every 60 to 150 mm
            shape: &[wave("wavelength_m", 0.055, 0.16)],
            amplitudes: &[amplitude("sine", "", Free, 0.05), amplitude("cosine", "", Free, 0.05)],
            columns: |context, shape| waves(context, &context.by_interference_n(), *shape.first()?, 1),
            phase_bound: true,
            equation: "as minimal, at the pitch of the bolts",
        },
        Form {
            name: "profile",
            shape: &STROKE,
            amplitudes: &entries::<FINE>("", 0.05),
            columns: |context, shape| over_stroke(context, &context.by_interference_n(), FINE, shape),
            phase_bound: true,
            equation: "F = p(x)·dF_law/de, p piecewise linear between 48 entries from one end of the stroke to the other",
        },
        Form {
            name: "share-three-orders",
            shape: &[along_stroke("wavelength_m", 0.2, 1.5, 10)],
            amplitudes: &[
                amplitude("sine_1", "", Free, 0.05),
                amplitude("cosine_1", "", Free, 0.05),
                amplitude("sine_2", "", Free, 0.03),
                amplitude("cosine_2", "", Free, 0.03),
                amplitude("sine_3", "", Free, 0.02),
                amplitude("cosine_3", "", Free, 0.02),
            ],
            columns: |context, shape| waves(context, &context.by_load_n(), *shape.first()?, 3),
            phase_bound: true,
            equation: "as three-orders, the preload changing by the same share at every preload, as in a mount that yields: \
                       dF_law/dlnF_p in place of dF_law/de",
        },
        Form {
            name: "share-profile",
            shape: &STROKE,
            amplitudes: &entries::<FINE>("", 0.05),
            columns: |context, shape| over_stroke(context, &context.by_load_n(), FINE, shape),
            phase_bound: true,
            equation: "as profile, the preload changing by the same share at every preload",
        },
    ],
    axis: "position",
    statement: "the rail is not straight or not parallel: the preload changes along it",
    falsifier: "a map over the stroke at another speed does not repeat the wave, or both directions do not share it",
    confused_with: "the weight of a cable chain or a tilt that changes along the rail, which do not change sign with \
                    direction; bolts, by their pitch",
    next_experiment: "P4",
    simplicity: 3,
};

fn waves(context: &Context<'_>, force: &[f64], wavelength: f64, orders: u32) -> Option<Columns> {
    if !context.motion.has_position {
        return None;
    }
    shown(context.waves(force, wavelength, orders))
}

/// Sine and cosine of an angle in turns, to 1e-9; whole turns, possibly a million, are subtracted first. Branch-free,
/// so that rows share a vector register.
#[inline]
fn turned(turns: f64) -> (f64, f64) {
    // nearest quarter turn: adding and subtracting 1.5·2^52 rounds
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let quarters = (4.0 * turns + ROUND) - ROUND;
    let angle = TAU * (turns - 0.25 * quarters);
    let square = angle * angle;
    // Taylor series up to |angle| = π/4
    let sin = angle
        * (1.0
            + square * (S[0] + square * (S[1] + square * (S[2] + square * (S[3] + square * (S[4] + square * S[5]))))));
    let cos =
        1.0 + square * (C[0] + square * (C[1] + square * (C[2] + square * (C[3] + square * (C[4] + square * C[5])))));
    // quarters modulo 4 is -1, 0, 1 or 2; magnitudes beyond 2^50 have no phase
    let quarter = quarters - 4.0 * ((0.25 * quarters - 0.125 + ROUND) - ROUND);
    let (swap, back) = (quarter == 1.0 || quarter == -1.0, quarter == 2.0);
    let (s, c) = if swap { (quarter * cos, -quarter * sin) } else { (sin, cos) };
    if back { (-s, -c) } else { (s, c) }
}

/// `(-1)^n/(2n + 1)!` and `(-1)^n/(2n)!` from n = 1 on.
const S: [f64; 6] =
    [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0];
const C: [f64; 6] = [-0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0, 1.0 / 479_001_600.0];

impl Context<'_> {
    /// A force times sine and cosine of the place, order by order.
    pub(super) fn waves(&self, force: &[f64], wavelength: f64, orders: u32) -> Columns {
        let per_metre = 1.0 / wavelength;
        let (mut sin, mut cos) = (vec![0.0; self.len()], vec![0.0; self.len()]);
        for ((sin, cos), x) in sin.iter_mut().zip(&mut cos).zip(&self.motion.position_m) {
            (*sin, *cos) = turned(x * per_metre);
        }
        let times_force = |wave: &[f64]| wave.iter().zip(force).map(|(wave, force)| wave * force).collect();
        let mut columns: Columns = vec![times_force(&sin), times_force(&cos)];
        for _ in 1..orders {
            let before = columns.len() - 2;
            // sin((n + 1)a) and cos((n + 1)a) from those of na
            let pairs = columns[before].iter().zip(&columns[before + 1]).zip(sin.iter().zip(&cos));
            let (sine, cosine) = pairs.map(|((s, c), (sin, cos))| (s * cos + c * sin, c * cos - s * sin)).unzip();
            columns.extend([sine, cosine]);
        }
        columns
    }

    /// Share of the loaded length that has passed a place, row by row: 0 before, 1 beyond. `None` where no row is near.
    fn passed(&self, place: f64) -> Option<Vec<f64>> {
        if !self.motion.has_position {
            return None;
        }
        let length = self.geometry.loaded_length_m;
        let share = |x: f64| (0.5 + (x - place) / length).clamp(0.0, 1.0);
        let inside = self.motion.position_m.iter().any(|x| (0.0..1.0).contains(&share(*x)) && share(*x) > 0.0);
        inside.then(|| self.motion.position_m.iter().map(|x| share(*x)).collect())
    }
}

/// E16: while the block stands on both rails, its balls are at different heights.
pub(super) const RAIL_JOINT: Definition = Definition {
    id: Id::RailJoint,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[PLACE],
            amplitudes: &[amplitude("preload", "", Free, 0.1)],
            columns: |context, shape| {
                let share = context.passed(*shape.first()?)?;
                let force = context.by_interference_n();
                shown(vec![context.rows(|n| force[n] * 4.0 * share[n] * (1.0 - share[n]))])
            },
            phase_bound: true,
            equation: "F = preload·4q(1 - q)·dF_law/de, q the share of the loaded length beyond place",
        },
        Form {
            name: "step",
            shape: &[PLACE],
            amplitudes: &[amplitude("preload", "", Free, 0.1), amplitude("preload_beyond", "", Free, 0.1)],
            columns: |context, shape| {
                let share = context.passed(*shape.first()?)?;
                let force = context.by_interference_n();
                let on = context.rows(|n| force[n] * 4.0 * share[n] * (1.0 - share[n]));
                shown(vec![on, context.rows(|n| force[n] * share[n])])
            },
            phase_bound: true,
            equation: "as minimal, and preload_beyond·q: the second rail lies at another height",
        },
        Form {
            name: "sagging",
            // bolts every 80 mm: an end overhangs the nearest by about half of that
            shape: &[PLACE, ratio("sag_m", "m", 0.005, 0.05, 4)],
            amplitudes: &[
                amplitude("preload_between", "", Free, 0.1),
                amplitude("preload_sag", "", Free, 0.1),
                amplitude("preload_beyond", "", Free, 0.1),
            ],
            columns: |context, shape| {
                let (place, sag) = (*shape.first()?, *shape.get(1)?);
                let (share, on) = (context.passed(place)?, patch(context, place)?);
                let (force, low) = (context.by_interference_n(), sagging(context, place, sag));
                shown(vec![
                    context.rows(|n| force[n] * on[n]),
                    context.rows(|n| force[n] * low[n]),
                    context.rows(|n| force[n] * share[n]),
                ])
            },
            phase_bound: true,
            equation: "as step with preload_between while the block stands on both rails for 4q(1 - q), and preload_sag times the \
                       mean of exp(-|x - place|/sag) over the loaded length: ends give way up to the bolts nearest to them",
        },
        Form {
            name: "edges",
            shape: &[PLACE],
            amplitudes: &[
                amplitude("preload", "", Free, 0.1),
                amplitude("preload_beyond", "", Free, 0.1),
                amplitude("preload_between", "", Free, 0.1),
                amplitude("preload_leaning", "", Free, 0.1),
            ],
            columns: |context, shape| {
                let place = *shape.first()?;
                let (share, on) = (context.passed(place)?, patch(context, place)?);
                let force = context.by_interference_n();
                let both = |n: usize| share[n] * (1.0 - share[n]);
                shown(vec![
                    context.rows(|n| force[n] * 4.0 * both(n)),
                    context.rows(|n| force[n] * share[n]),
                    context.rows(|n| force[n] * on[n]),
                    context.rows(|n| force[n] * 8.0 * both(n) * (share[n] - 0.5)),
                ])
            },
            phase_bound: true,
            equation: "as step, with preload_between while the block stands on both rails and preload_leaning·8q(1 - q)(q - 1/2)",
        },
    ],
    axis: "position",
    statement: "a step between two rails changes the preload while the block crosses it",
    falsifier: "the bump moves, or comes and goes, when the map over the stroke is repeated",
    confused_with: "dirt at that place: clean the rail and repeat",
    next_experiment: "P4",
    simplicity: 4,
};

/// E24: dirt on the rail loads every ball that crosses it; a particle stuck to a ball recurs with its turns.
pub(super) const CONTAMINATION: Definition = Definition {
    id: Id::Contamination,
    kind: Kind::Physics,
    forms: &[
        Form {
            name: "minimal",
            shape: &[PLACE],
            amplitudes: &[amplitude("drag_n", "N", Positive, 10.0)],
            columns: |context, shape| {
                let on = patch(context, *shape.first()?)?;
                shown(vec![context.against_motion(|n| on[n])])
            },
            phase_bound: true,
            equation: "F = drag·sign(V) while the loaded length covers place, rising and falling over one ball pitch",
        },
        Form {
            name: "later",
            shape: &[PLACE, ratio("after_travel_m", "m", 0.5, 50.0, 3)],
            amplitudes: &[amplitude("drag_n", "N", Positive, 10.0)],
            columns: |context, shape| {
                let on = patch(context, *shape.first()?)?;
                let after = *shape.get(1)?;
                let there = |n: usize| if context.travel_m[n] >= after { on[n] } else { 0.0 };
                shown(vec![context.against_motion(there)])
            },
            phase_bound: true,
            equation: "as minimal, from after_travel on",
        },
        Form {
            name: "particle",
            // half a turn of a ball between its two contacts: 2π times its radius of travel
            shape: &[wave("wavelength_m", 0.0190, 0.0210)],
            amplitudes: &[amplitude("sine", "", Free, 0.02), amplitude("cosine", "", Free, 0.02)],
            columns: |context, shape| waves(context, &context.by_interference_n(), *shape.first()?, 1),
            phase_bound: true,
            equation: "F = (sine·sin(kx) + cosine·cos(kx))·dF_law/de at half a turn of a ball, about 19.9 mm",
        },
    ],
    axis: "position",
    statement: "dirt on the rail or on a ball adds friction where it is rolled over",
    falsifier: "the friction is still there after the rail was cleaned and the block relubricated",
    confused_with: "a rail joint, which stays where it is; electrical spikes, which are short in time and not in distance",
    next_experiment: "relubricate",
    simplicity: 5,
};

/// Mean over the loaded length of `exp(-|x - place|/sag)`.
fn sagging(context: &Context<'_>, place: f64, sag: f64) -> Vec<f64> {
    let half = 0.5 * context.geometry.loaded_length_m;
    let integral = |u: f64| u.signum() * sag * -libm::expm1(-u.abs() / sag);
    let of = |x: &f64| (integral(x - place + half) - integral(x - place - half)) / (2.0 * half);
    context.motion.position_m.iter().map(of).collect()
}

/// Share of the loaded length above a place, smooth over one ball pitch.
fn patch(context: &Context<'_>, place: f64) -> Option<Vec<f64>> {
    context.passed(place)?;
    let geometry = &context.geometry;
    let half = 0.5 * geometry.loaded_length_m;
    let of = |x: &f64| (0.5 + (half - (x - place).abs()) / geometry.ball_pitch_m).clamp(0.0, 1.0);
    Some(context.motion.position_m.iter().map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_library() {
        for n in -40_000..40_000 {
            let turns = f64::from(n) * 0.013_7 + 1e5 * f64::from(n % 7);
            let (sin, cos) = turned(turns);
            let (s, c) = libm::sincos(TAU * (turns - turns.floor()));
            assert!((sin - s).abs() < 1e-9 && (cos - c).abs() < 1e-9, "{turns}: {sin} {s}, {cos} {c}");
        }
    }
}
