//! The library as a whole; the modules below check single mechanisms against their physics.

mod document;
mod motion_and_rest;
mod physics;
mod sensors;

use super::*;
use crate::file::{Law, Simulation};
use crate::mechanism::definition::Search;
use crate::motion::Motion;
use crate::run::{Break, Part, Run};

/// The ids of the contract, in its order.
const PHYSICS: &str = "seal-drag viscous-drag viscosity-temperature self-heating hysteresis-and-slip \
    hydrodynamic-rolling traction-saturation stribeck starvation run-in external-load moment-load rail-straightness \
    rail-joint preload-loss thermal-preload direction-asymmetry gravity-tilt inertia cable-chain drive-ripple \
    contamination ball-pass presliding frictional-lag breakaway-dwell structural-resonance";
const SENSOR: &str = "force-offset force-drift force-gain load-crosstalk force-lowpass time-misalignment \
    force-quantisation force-saturation coupling-backlash speed-noise encoder-cyclic-error";

const AXES: &str = "velocity position direction time travel temperature temperature-difference load preload \
    acceleration reversal-distance dwell wavelength frequency";

const EXPERIMENTS: &str = "P0 P1 P2 P3 P4 P5 P6 P7 P8 P9 P10 seals-off unload second-preload second-temperature \
    known-mass turn-block disconnect-chain two-frequencies zero-force repeat-later relubricate";

pub(super) fn simulation(text: &str) -> Simulation {
    Simulation::from_toml(&format!("schema = \"guideblock.simulation/1\"\n{text}")).expect("legal")
}

/// Laws with few and with many inputs.
pub(super) fn simulations() -> Vec<Simulation> {
    [
        "[guide]\n[operation]\npreload_n = 3000\n[axis]\nmoved_mass_kg = 5",
        "[guide]\nmu_stribeck = 0\ncontact_angle_mode = \"fixed\"\n[lubricant]\nviscosity_cst = 100\n[operation]\npreload_n = 3000",
        "[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\nviscous_n_s_m = 100\noffset_n = 0\n[axis]\nmoved_mass_kg = 0",
        "",
    ]
    .map(simulation)
    .into()
}

/// A run with everything in it: rests, reversals, slow and fast strokes over a metre, loads and temperatures that
/// change.
pub(super) fn rich(rows: usize) -> Run {
    let dt = 120.0 / rows as f64;
    let (mut x, mut positions, mut velocities) = (0.0, Vec::new(), Vec::new());
    for n in 0..rows {
        let t = n as f64 * dt;
        // a rest of two seconds in every ten, strokes of a second, the fastest 30 times as fast as the slowest
        let speed = 0.02 * (1.0 + 29.0 * (t / 120.0));
        let v = if t % 10.0 < 2.0 { 0.0 } else { speed * (std::f64::consts::PI * t).sin() };
        x += v * dt;
        positions.push(x + 0.4);
        velocities.push(v);
    }
    let column = |of: &dyn Fn(f64) -> f64| Some((0..rows).map(|n| of(n as f64 * dt)).collect::<Vec<f64>>());
    let sparse =
        |of: &dyn Fn(f64) -> f64| column(&|t| if (t / dt).round() as usize % 1000 == 3 { of(t) } else { f64::NAN });
    Run {
        name: "rich".to_owned(),
        time_s: (0..rows).map(|n| n as f64 * dt).collect(),
        // counts of 0.25 N
        drag_force_n: (0..rows).map(|n| 0.25 * (n % 40) as f64).collect(),
        position_m: Some(positions),
        velocity_m_s: Some(velocities),
        preload_n: column(&|t| 3000.0 + 500.0 * (0.1 * t).sin()),
        external_load_n: column(&|t| 4000.0 * (0.05 * t).sin()),
        temperature_block_degc: column(&|t| 22.0 + 0.1 * t),
        temperature_rail_degc: sparse(&|t| 21.0 + 0.02 * t),
        temperature_ambient_degc: sparse(&|_| 20.0),
        simulated_force_n: column(&|t| 20.0 * (std::f64::consts::PI * t).sin()),
        parts: vec![
            Part { rows: 0..rows / 2, segment: Some(1), starts: Break::Start },
            Part { rows: rows / 2..rows, segment: Some(2), starts: Break::Segment },
        ],
        ..Run::default()
    }
}

/// Every point of a form's grid, wavelengths thinned out.
pub(super) fn shapes(form: &Form) -> Vec<Vec<f64>> {
    let mut points = vec![Vec::new()];
    for p in form.shape {
        let count = p.grid.min(15);
        let share = |k: usize| k as f64 / (count - 1) as f64;
        let value = |k: usize| if p.search == Search::Place { -0.5 + 2.0 * share(k) } else { p.at(share(k)) };
        points = points
            .iter()
            .flat_map(|point| (0..count).map(move |k| point.iter().copied().chain([value(k)]).collect()))
            .collect();
    }
    points
}

#[test]
fn ids_are_those_of_the_contract_in_its_order() {
    let names: Vec<&str> = Id::ALL.iter().map(|id| id.name()).collect();
    let contract: Vec<&str> = PHYSICS.split_whitespace().chain(SENSOR.split_whitespace()).collect();
    assert_eq!(names, contract);
    for id in Id::ALL {
        assert_eq!(Id::from_name(id.name()), Some(*id));
    }
    assert_eq!(Id::from_name("parameter-shift"), None);
    let listed: Vec<&str> = library().iter().map(|definition| definition.id.name()).collect();
    assert_eq!(listed, contract, "one definition each");
    for definition in library() {
        let sensor = SENSOR.split_whitespace().any(|name| name == definition.id.name());
        assert_eq!(definition.kind, if sensor { Kind::Sensor } else { Kind::Physics }, "{}", definition.id);
    }
}

#[test]
fn every_definition_says_what_it_claims_and_what_would_prove_it_wrong() {
    for definition in library() {
        let id = definition.id;
        assert!(AXES.split_whitespace().any(|axis| axis == definition.axis), "{id}: axis {}", definition.axis);
        let code = definition.next_experiment;
        assert!(EXPERIMENTS.split_whitespace().any(|known| known == code), "{id}: {code}");
        for text in [definition.statement, definition.falsifier, definition.confused_with] {
            assert!(text.len() > 30 && text.len() < 260, "{id}: {text}");
            assert!(text.starts_with(|c: char| c.is_lowercase() || text.starts_with("Coulomb")), "{id}: {text}");
            assert!(!text.ends_with('.'), "{id}: {text}");
            assert!(!text.contains("  "), "{id}: {text}");
        }
        assert_eq!(definition.forms.first().map(|form| form.name), Some("minimal"), "{id}");
        for form in definition.forms {
            let mut names: Vec<&str> = form.shape.iter().map(|p| p.name).collect();
            names.extend(form.amplitudes.iter().map(|a| a.name));
            names.extend(["id", "form"]);
            let count = names.len();
            names.sort_unstable();
            names.dedup();
            assert_eq!(names.len(), count, "{id} {}: a name twice", form.name);
            assert!(!form.amplitudes.is_empty() && form.equation.starts_with(|c: char| !c.is_whitespace()), "{id}");
            for p in form.shape {
                assert!(p.from < p.to && p.grid >= 2 && (!p.log || p.from > 0.0), "{id} {}", p.name);
                for share in [0.0, 0.25, 0.5, 0.9, 1.0] {
                    assert!((p.share_of(p.at(share)) - share).abs() < 1e-9, "{id} {}", p.name);
                }
            }
            for a in form.amplitudes {
                assert!(a.sign.allows(a.typical) && a.typical != 0.0, "{id} {}", a.name);
            }
        }
        let names: Vec<&str> = definition.forms.iter().map(|form| form.name).collect();
        let mut unique = names.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), names.len(), "{id}: a form twice");
    }
}

#[test]
fn columns_are_as_many_as_amplitudes_and_finite_wherever_the_law_is() {
    let run = rich(12_000);
    let without_speed = Run { velocity_m_s: None, ..run.clone() };
    let motions = [&run, &without_speed].map(Motion::of);
    let mut seen = Vec::new();
    for (simulation, (run, motion)) in
        simulations().iter().flat_map(|s| [(s, (&run, &motions[0])), (s, (&without_speed, &motions[1]))])
    {
        let context = Context::of(simulation, run, motion).expect("complete");
        assert!(context.steady.force_n.iter().all(|force| force.is_finite()));
        for definition in library() {
            for form in definition.forms {
                for shape in shapes(form) {
                    let Some(columns) = (form.columns)(&context, &shape) else { continue };
                    assert_eq!(columns.len(), form.amplitudes.len(), "{} {}", definition.id, form.name);
                    for (column, amplitude) in columns.iter().zip(form.amplitudes) {
                        assert_eq!(column.len(), run.len());
                        let bad = column.iter().position(|x| !x.is_finite());
                        assert_eq!(bad, None, "{} {} {} {shape:?}", definition.id, form.name, amplitude.name);
                    }
                    seen.push((definition.id, form.name));
                }
                if !form.shape.is_empty() {
                    assert!((form.columns)(&context, &[]).is_none(), "{} {}: no shape", definition.id, form.name);
                }
            }
        }
    }
    for definition in library() {
        for form in definition.forms {
            assert!(seen.contains(&(definition.id, form.name)), "{} {} shows nowhere", definition.id, form.name);
        }
    }
}

#[test]
fn what_a_run_does_not_measure_is_not_shown() {
    let bare = Run {
        position_m: None,
        preload_n: None,
        external_load_n: None,
        temperature_block_degc: None,
        temperature_rail_degc: None,
        temperature_ambient_degc: None,
        ..rich(12_000)
    };
    let mut steady = bare.clone();
    steady.velocity_m_s = Some(vec![0.1; bare.len()]);
    for (run, absent) in [
        (
            &bare,
            "viscosity-temperature external-load rail-straightness rail-joint thermal-preload cable-chain drive-ripple \
             contamination ball-pass encoder-cyclic-error",
        ),
        (
            &steady,
            "viscosity-temperature external-load rail-straightness rail-joint thermal-preload cable-chain drive-ripple \
             contamination ball-pass encoder-cyclic-error inertia presliding frictional-lag breakaway-dwell \
             structural-resonance force-lowpass time-misalignment coupling-backlash force-saturation",
        ),
    ] {
        let motion = Motion::of(run);
        let context = Context::of(&simulations()[1], run, &motion).expect("constant viscosity");
        for definition in library() {
            let of = |shape: Vec<f64>| (definition.forms[0].columns)(&context, &shape);
            let large = |column: &Vec<f64>| column.iter().any(|x| x.abs() > 1e-9);
            let shown = shapes(&definition.forms[0]).into_iter().filter_map(of).any(|c| c.iter().any(large));
            let expected = !absent.split_whitespace().any(|name| name == definition.id.name());
            assert_eq!(shown, expected, "{}", definition.id);
        }
    }
}

#[test]
fn a_simulation_s_force_is_its_law_and_what_acts_beside_it() {
    let run = rich(4000);
    let motion = Motion::of(&run);
    let mut simulation = simulations().remove(0);
    let law = simulation.force(&run, &motion).expect("complete");
    assert_eq!(law, simulation.steady(&crate::law::Factors::default(), &run, &motion).expect("complete").force_n);
    simulation.mechanisms = vec![
        Added { id: Id::Inertia, form: 0, shape: vec![], amplitudes: vec![3.0] },
        Added { id: Id::ForceOffset, form: 0, shape: vec![], amplitudes: vec![-0.5] },
        // numbers of another form add nothing
        Added { id: Id::SealDrag, form: 1, shape: vec![], amplitudes: vec![1.0] },
        Added { id: Id::SealDrag, form: 7, shape: vec![], amplitudes: vec![] },
    ];
    let both = simulation.force(&run, &motion).expect("complete");
    for n in 0..run.len() {
        let expected = law[n] + 3.0 * motion.acceleration_m_s2[n] - 0.5;
        assert!((both[n] - expected).abs() < 1e-12 * (1.0 + expected.abs()), "{n}");
    }
    assert!(matches!(simulation.law, Law::Guide(_)));
}
