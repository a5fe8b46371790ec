//! Menu of runs that may be asked for: their cost, how each drives the axis, and what it does to a cause.
//!
//! Every run is a short form of what its code asks for, with about a minute of rows: enough to judge which run is worth
//! its time. Minutes are assumed values for a person at a rig: half an hour to re-clamp a block, an hour for ten
//! kelvin, three quarters of an hour for seals.

use simulation::mechanism::Id;
use simulation::profile::{Course, Dwell, Ladder, Map, Modulation, Order, Reversal, Staircase, Unfit, WarmUp};

use super::scene::Scene;

/// Highest sampling rate of a short run, rows/s.
const RATE_HZ: f64 = 100.0;

/// The same for fast effects.
const FAST_HZ: f64 = 200.0;

/// The same for runs of hours.
const SLOW_HZ: f64 = 1.0;

/// Known added mass, and assumed mass of a carriage where none is stated, kg.
pub(super) const KNOWN_MASS_KG: f64 = 10.0;

/// Step of temperature, K.
const WARMER_K: f64 = 10.0;

/// A run that may be asked for.
pub(super) struct Entry {
    /// Code of the schema.
    pub(super) code: &'static str,
    /// Cost, min.
    pub(super) minutes: f64,
    /// Motion and conditions; empty where the axis does not allow the run.
    pub(super) drive: fn(&Scene) -> Result<Vec<Course>, Unfit>,
}

/// All runs that can be simulated, the cheapest first. `P10`, which takes a month, is not among them.
pub(super) const MENU: &[Entry] = &[
    Entry {
        code: "two-frequencies",
        minutes: 3.0,
        drive: |scene| {
            let amplitudes_m = vec![scene.stroke_up_to(2e-3)];
            let reversal = Reversal { amplitudes_m, frequencies_hz: vec![0.3, 3.0], cycles: 8 };
            one(reversal.course(scene.rate_hz(FAST_HZ), &scene.conditions))
        },
    },
    Entry {
        code: "P5",
        minutes: 5.0,
        drive: |scene| {
            let amplitudes_m = [1e-5, 1e-4, 2e-3].map(|most| scene.stroke_up_to(most)).to_vec();
            let reversal = Reversal { amplitudes_m, frequencies_hz: vec![0.2, 2.0], cycles: 4 };
            one(reversal.course(scene.rate_hz(FAST_HZ), &scene.conditions))
        },
    },
    Entry { code: "zero-force", minutes: 5.0, drive: |scene| Ok(vec![scene.resting(20.0, scene.rate_hz(RATE_HZ))]) },
    Entry {
        code: "P6",
        minutes: 6.0,
        drive: |scene| {
            let modulation =
                Modulation { speed_m_s: scene.stroke_up_to(0.25) / 25.0, hold_s: 6.0, ..Modulation::default() };
            one(modulation.course(scene.rate_hz(FAST_HZ), &scene.conditions))
        },
    },
    Entry { code: "P0", minutes: 10.0, drive: |scene| Ok(vec![scene.resting(40.0, scene.rate_hz(RATE_HZ))]) },
    Entry {
        code: "P1",
        minutes: 10.0,
        drive: |scene| {
            one(Staircase { order: Order::Both, ..scene.staircase() }.course(scene.rate_hz(RATE_HZ), &scene.conditions))
        },
    },
    Entry {
        code: "P4",
        minutes: 10.0,
        drive: |scene| {
            let fast = scene.fastest();
            let speeds_m_s = vec![fast.min(scene.span_m / 20.0), fast];
            let map = Map { speeds_m_s, length_m: scene.span_m, strokes: 2, ..Map::default() };
            one(map.course(scene.rate_hz(RATE_HZ), &scene.conditions))
        },
    },
    Entry { code: "disconnect-chain", minutes: 10.0, drive: again },
    Entry { code: "known-mass", minutes: 15.0, drive: swinging },
    Entry {
        code: "P7",
        minutes: 20.0,
        drive: |scene| {
            let length_m = scene.stroke_up_to(0.01);
            let dwell = Dwell { dwells_s: vec![1.0, 10.0, 100.0], length_m, ..Dwell::default() };
            one(dwell.course(scene.rate_hz(RATE_HZ), &scene.conditions))
        },
    },
    Entry { code: "second-preload", minutes: 30.0, drive: |scene| scene.at_preload(0.4, scene.rate_hz(RATE_HZ)) },
    Entry { code: "turn-block", minutes: 30.0, drive: again },
    Entry { code: "relubricate", minutes: 30.0, drive: again },
    Entry { code: "unload", minutes: 40.0, drive: |scene| scene.at_preload(0.1, scene.rate_hz(RATE_HZ)) },
    Entry {
        code: "P9",
        minutes: 45.0,
        drive: |scene| {
            let load_n = scene.conditions.preload_n.map_or(500.0, |preload| 0.3 * preload);
            [load_n, -load_n].map(|load| scene.loaded(load, scene.rate_hz(RATE_HZ))).into_iter().collect()
        },
    },
    Entry { code: "seals-off", minutes: 45.0, drive: again },
    Entry {
        code: "second-temperature",
        minutes: 60.0,
        drive: |scene| scene.warmer(&[WARMER_K], scene.rate_hz(RATE_HZ)),
    },
    Entry { code: "repeat-later", minutes: 60.0, drive: again },
    Entry {
        code: "P2",
        minutes: 90.0,
        drive: |scene| {
            let Some(preload) = scene.preload_n() else { return Ok(Vec::new()) };
            let preloads_n = [0.3, 1.0, 3.0].map(|factor| factor * preload).to_vec();
            one(Ladder { preloads_n, staircase: scene.staircase() }.course(scene.rate_hz(RATE_HZ), &scene.conditions))
        },
    },
    Entry {
        code: "P3",
        minutes: 180.0,
        drive: |scene| scene.warmer(&[0.0, WARMER_K, 2.0 * WARMER_K], scene.rate_hz(RATE_HZ)),
    },
    Entry {
        code: "P8",
        minutes: 190.0,
        drive: |scene| {
            let Some(ambient_degc) = scene.conditions.temperature_degc else { return Ok(Vec::new()) };
            let (speed_m_s, length_m) = (scene.fastest(), scene.span_m);
            one(WarmUp { ambient_degc, speed_m_s, length_m, ..WarmUp::default() }
                .course(scene.rate_hz(SLOW_HZ), &scene.conditions))
        },
    },
];

fn one(course: Result<Course, Unfit>) -> Result<Vec<Course>, Unfit> {
    course.map(|course| vec![course])
}

/// The recorded kind of run again, in short.
fn again(scene: &Scene) -> Result<Vec<Course>, Unfit> {
    one(scene.staircase().course(scene.rate_hz(RATE_HZ), &scene.conditions))
}

/// Strokes, and an accelerated motion.
fn swinging(scene: &Scene) -> Result<Vec<Course>, Unfit> {
    let amplitudes_m = vec![scene.stroke_up_to(0.02)];
    let reversal = Reversal { amplitudes_m, frequencies_hz: vec![0.2, 1.0], cycles: 5 };
    Ok(vec![
        scene.staircase().course(scene.rate_hz(RATE_HZ), &scene.conditions)?,
        reversal.course(scene.rate_hz(RATE_HZ), &scene.conditions)?,
    ])
}

/// Whether the carriage is off the sensor, so that only the sensor's own effects are left.
pub(super) fn is_free(code: &str) -> bool {
    matches!(code, "zero-force" | "P0")
}

/// Dead weight that hangs on the sensor in the second half, N.
pub(super) fn dead_weight_n(code: &str) -> f64 {
    if code == "P0" { 50.0 } else { 0.0 }
}

/// Known added mass, kg.
pub(super) fn added_mass_kg(code: &str) -> f64 {
    if code == "known-mass" { KNOWN_MASS_KG } else { 0.0 }
}

/// Share of a cause's force that is left by the change that a run makes, apart from the effects of speed, load and
/// temperature. `mass_kg`: mass of the carriage.
pub(super) fn left_of(code: &str, id: Id, mass_kg: f64) -> f64 {
    match (code, id) {
        ("zero-force" | "P0", Id::ForceOffset | Id::ForceDrift | Id::ForceGain) => 1.0,
        ("zero-force" | "P0", _)
        | ("seals-off", Id::SealDrag)
        | ("disconnect-chain", Id::CableChain)
        | ("relubricate", Id::Starvation)
        | ("repeat-later", Id::RunIn) => 0.0,
        // bound to the block, whereas a tilt stays with the rail and an offset with the sensor
        ("turn-block", Id::DirectionAsymmetry) => -1.0,
        // its weight; a carriage of unknown mass is taken to be as heavy as the added mass
        ("known-mass", Id::GravityTilt) => 1.0 + KNOWN_MASS_KG / mass_kg,
        _ => 1.0,
    }
}

/// Whether a run changes anything for these causes: removing what none of them concerns would only repeat the
/// recording.
pub(super) fn touches(code: &str, ids: &[Option<Id>]) -> bool {
    let any = |which: &dyn Fn(Id) -> bool| ids.iter().flatten().any(|id| which(*id));
    match code {
        "seals-off" | "disconnect-chain" | "relubricate" | "repeat-later" | "turn-block" => {
            any(&|id| left_of(code, id, KNOWN_MASS_KG) != 1.0)
        }
        "known-mass" => any(&|id| {
            let by_mass = [Id::GravityTilt, Id::Inertia, Id::ForceGain, Id::ForceLowpass, Id::TimeMisalignment];
            by_mass.contains(&id) || id == Id::StructuralResonance
        }),
        _ => true,
    }
}
