use super::*;
use crate::file::{Law, Simulation};
use crate::guide::GuideSet;
use crate::motion::Motion;
use crate::profile::{Conditions, Ladder, Staircase};
use crate::run::Run;

/// A rich run: two preloads, speeds over a decade, rests, temperatures, a load.
fn rich() -> (Simulation, Run) {
    let staircase =
        Staircase { speeds_m_s: vec![0.004, 0.02, 0.08], length_m: 0.3, hold_s: 0.0, ..Staircase::default() };
    let ladder = Ladder { preloads_n: vec![1500.0, 4000.0], staircase };
    let mut run = ladder.course(400.0, &Conditions::default()).expect("drivable").run;
    let rows = run.len();
    let share = |n: usize| n as f64 / rows as f64;
    run.temperature_block_degc = Some((0..rows).map(|n| 24.0 + 9.0 * share(n)).collect());
    run.temperature_rail_degc = Some((0..rows).map(|n| 24.0 + 4.0 * share(n)).collect());
    run.external_load_n = Some((0..rows).map(|n| 1500.0 * (9.0 * share(n)).sin()).collect());
    let set = GuideSet::zhou_2023().with_number("viscosity_cst", 100.0).expect("legal");
    let mut simulation = Simulation::of(Law::Guide(set));
    simulation.axis.moved_mass_kg = Some(4.0);
    (simulation, run)
}

#[test]
fn the_library_has_every_name_once_and_in_order() {
    assert_eq!(library().len(), 38);
    for (definition, id) in library().iter().zip(Id::ALL) {
        assert_eq!(definition.id, *id);
        assert_eq!(super::definition(*id).id, *id);
        assert_eq!(Id::from_name(id.name()), Some(*id));
    }
    assert_eq!(Id::from_name("seal_drag"), None);
}

#[test]
fn every_form_makes_as_many_columns_as_it_has_amplitudes_and_all_are_numbers() {
    let (simulation, run) = rich();
    let motion = Motion::of(&run);
    let context = Context::of(&simulation, &run, &motion).expect("a law");
    for definition in library() {
        let mut seen = false;
        for form in definition.forms {
            let middle: Vec<f64> = form
                .shape
                .iter()
                .map(|p| match (p.name, p.log) {
                    ("place_m", _) => 0.15,
                    // the run is short
                    ("length_m", _) => p.from,
                    // resolved at the slowest speed only
                    ("period_m", _) => 1e-4,
                    (_, true) => (p.from * p.to).sqrt(),
                    (_, false) => 0.5 * (p.from + p.to),
                })
                .collect();
            let Some(columns) = (form.columns)(&context, &middle) else { continue };
            seen = true;
            assert_eq!(columns.len(), form.amplitudes.len(), "{} {}", definition.id.name(), form.name);
            for column in &columns {
                assert_eq!(column.len(), run.len());
                assert!(column.iter().all(|x| x.is_finite()), "{} {}", definition.id.name(), form.name);
            }
        }
        // a guide's law has a Stribeck term
        assert!(seen || definition.id == Id::Stribeck, "{} shows nowhere", definition.id.name());
    }
}

#[test]
fn what_a_run_lacks_is_not_shown() {
    let (simulation, rich) = rich();
    let run = Run {
        temperature_block_degc: None,
        temperature_rail_degc: None,
        external_load_n: None,
        position_m: None,
        preload_n: Some(vec![3000.0; rich.len()]),
        ..rich
    };
    let motion = Motion::of(&run);
    let context = Context::of(&simulation, &run, &motion).expect("a law");
    for id in [
        Id::ViscosityTemperature,
        Id::ThermalPreload,
        Id::ExternalLoad,
        Id::LoadCrosstalk,
        Id::RailStraightness,
        Id::BallPass,
        Id::DriveRipple,
        Id::RailJoint,
        Id::CableChain,
        Id::Stribeck,
    ] {
        let form = &definition(id).forms[0];
        let shape: Vec<f64> = form.shape.iter().map(|p| if p.log { (p.from * p.to).sqrt() } else { 1.0 }).collect();
        assert!((form.columns)(&context, &shape).is_none(), "{}", id.name());
    }
}

#[test]
fn descriptions_are_those_of_the_contract() {
    const AXES: [&str; 14] = [
        "velocity",
        "position",
        "direction",
        "time",
        "travel",
        "temperature",
        "temperature-difference",
        "load",
        "preload",
        "acceleration",
        "reversal-distance",
        "dwell",
        "wavelength",
        "frequency",
    ];
    const EXPERIMENTS: [&str; 22] = [
        "P0",
        "P1",
        "P2",
        "P3",
        "P4",
        "P5",
        "P6",
        "P7",
        "P8",
        "P9",
        "P10",
        "seals-off",
        "unload",
        "second-preload",
        "second-temperature",
        "known-mass",
        "turn-block",
        "disconnect-chain",
        "two-frequencies",
        "zero-force",
        "repeat-later",
        "relubricate",
    ];
    for definition in library() {
        assert!(AXES.contains(&definition.axis), "{}", definition.axis);
        assert!(EXPERIMENTS.contains(&definition.next_experiment), "{}", definition.next_experiment);
        assert!(definition.statement.ends_with('.') && definition.falsifier.ends_with('.'));
        for form in definition.forms {
            assert!(form.shape.iter().all(|p| p.from < p.to && p.grid > 1), "{}", definition.id.name());
        }
    }
}

#[test]
fn an_augmented_file_comes_back_as_it_was() {
    let (mut simulation, run) = rich();
    for (n, definition) in library().iter().enumerate() {
        let form = definition.forms.len() - 1;
        let described = &definition.forms[form];
        simulation.mechanisms.push(Added {
            id: definition.id,
            form,
            shape: described.shape.iter().map(|p| p.from).collect(),
            amplitudes: described
                .amplitudes
                .iter()
                .enumerate()
                .map(|(k, a)| a.typical + (n + k) as f64 / 7.0)
                .collect(),
        });
    }
    let text = simulation.to_toml();
    let back = Simulation::from_toml(&text).expect("its own text");
    assert_eq!(back.mechanisms, simulation.mechanisms);
    assert_eq!(back.to_toml(), text);
    let motion = Motion::of(&run);
    let force = simulation.force(&run, &motion).expect("a law");
    assert_eq!(back.force(&run, &motion).expect("a law"), force);
}

#[test]
fn a_wrong_entry_is_named() {
    let said = |entry: &str| {
        let text = format!("schema = \"guideblock.simulation/1\"\n[guide]\n\n[[mechanism]]\n{entry}\n");
        Simulation::from_toml(&text).expect_err("wrong").to_string()
    };
    assert!(said("id = \"seal\"").starts_with("line 5, column 6: there is no mechanism seal; there are: seal-drag"));
    assert!(said("id = \"seal-drag\"").contains("needs seal_n (form constant)"));
    assert!(said("id = \"seal-drag\"\nseal_n = \"two\"").contains("line 6"));
    assert!(said("id = \"seal-drag\"\nseal_n = 1\nexponent = 2").contains("there is no key mechanism.exponent"));
    assert!(said("id = \"seal-drag\"\nform = \"odd\"").contains("has no form odd; it has: constant, grows-weakly"));
}

/// A reversal, a rest and a start are seen where they are.
#[test]
fn the_context_remembers_what_came_before() {
    let (simulation, run) = rich();
    let motion = Motion::of(&run);
    let c = Context::of(&simulation, &run, &motion).expect("a law");
    let first = c.at_rest.iter().position(|rest| !rest).expect("moves");
    assert!(c.dwell_s[first] > 0.15 && c.since_reversal_m[first] < 1e-3);
    let turn = (first..run.len()).find(|n| c.direction[*n] < 0.0).expect("turns");
    // the rest between the two strokes is in the direction of the first
    assert!(c.since_reversal_m[turn] < 1e-3 && c.dwell_s[turn] > 0.15 && c.since_reversal_m[turn - 10] > 0.29);
    assert!(c.travel_m[turn] > 0.3 && c.travel_m[turn] < 0.32);
    assert!(c.direction.iter().all(|d| d.abs() == 1.0));
    // the drag of a guide grows with preload nearly in proportion
    let ratio = c.by_preload_n[first + 200] / c.steady.force_n[first + 200];
    assert!(ratio > 0.7 && ratio < 1.1, "{ratio}");
}
