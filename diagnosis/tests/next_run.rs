//! The run that is asked for settles what it was asked for.
//!
//! A first recording leaves two explanations; the run that the diagnosis asks for is driven with the true cause in it,
//! and both recordings are diagnosed together.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::time::Instant;

use diagnosis::report::Diagnosis;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::mechanism::{Added, Id};
use simulation::profile::{Conditions, Course, Ladder, Map, Modulation, Order, Reversal, Staircase, WarmUp};
use simulation::run::Run;
use simulation::sensor::Noise;

const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                     viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

fn simulation() -> Simulation {
    Simulation::from_toml(GUIDE).expect("a sound file")
}

fn added(id: Id, shape: &[f64], amplitudes: &[f64]) -> Added {
    Added { id, form: 0, shape: shape.to_vec(), amplitudes: amplitudes.to_vec() }
}

/// What the sensor makes of a course where `cause` acts: white noise, from a seed.
fn recorded(course: Course, cause: &Added, noise_n: f64, seed: u64) -> Run {
    let mut simulation = simulation();
    simulation.mechanisms = vec![cause.clone()];
    let mut run = course.run;
    let force = simulation.force(&run, &course.motion).expect("the law has what it needs");
    let mut noise = Noise::new(seed, 0);
    run.drag_force_n = force.iter().map(|force| force + noise_n * noise.gaussian()).collect();
    run
}

fn diagnosed(runs: &[Run]) -> Diagnosis {
    diagnose(runs, &[], &simulation(), &Options::default()).diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<(String, Vec<String>)> {
    diagnosis.mechanisms.iter().map(|m| (m.id.clone(), m.equivalents.clone())).collect()
}

fn at(preload_n: f64) -> Conditions {
    Conditions { preload_n: Some(preload_n), temperature_degc: Some(22.0), external_load_n: None }
}

fn staircase(order: Order) -> Staircase {
    let speeds_m_s = vec![0.002, 0.005, 0.01, 0.02, 0.05, 0.1];
    Staircase { speeds_m_s, length_m: 0.05, order, ..Staircase::default() }
}

/// The run of a code of the schema, in full.
fn asked_for(code: &str, rate_hz: f64) -> Course {
    let usual = at(3000.0);
    match code {
        "second-preload" => staircase(Order::Both).course(rate_hz, &at(1200.0)),
        "second-temperature" => {
            staircase(Order::Both).course(rate_hz, &Conditions { temperature_degc: Some(34.0), ..usual })
        }
        "P1" => staircase(Order::Both).course(rate_hz, &usual),
        "P6" => Modulation::default().course(rate_hz, &usual),
        "two-frequencies" => {
            Reversal { amplitudes_m: vec![0.002], frequencies_hz: vec![0.3, 3.0], cycles: 20 }.course(rate_hz, &usual)
        }
        "P4" => Map { strokes: 2, speeds_m_s: vec![0.02, 0.1], ..Map::default() }.course(rate_hz, &usual),
        "P2" => {
            let preloads_n = [0.3, 1.0, 3.0].map(|part| part * 3000.0).to_vec();
            Ladder { preloads_n, staircase: staircase(Order::Up) }.course(rate_hz, &usual)
        }
        other => panic!("no run for {other}"),
    }
    .unwrap()
}

/// Diagnoses the first recording of `cause`, takes the advised run, and diagnoses both.
fn settled(name: &str, first: Course, cause: &Added, noise_n: f64, rival: Id) {
    let first = recorded(first, cause, noise_n, 1);
    let open = diagnosed(std::slice::from_ref(&first));
    println!("{name}: {:?}", names(&open));
    let ids: Vec<&String> = open.mechanisms.iter().flat_map(|m| m.equivalents.iter().chain([&m.id])).collect();
    let both = [cause.id, rival].iter().all(|id| ids.iter().any(|open| *open == id.name()));
    let Some(next) = open.next_experiment else {
        println!("    none");
        return;
    };
    println!(
        "    {} {:?} both {both} | {:?}",
        next.code,
        next.promise(),
        next.alternatives.iter().map(|a| (&a.code, a.expected_nats)).collect::<Vec<_>>()
    );
    if next.code == "zero-force" || next.code == "disconnect-chain" {
        return;
    }
    let hz = first.len() as f64 / first.time_s.last().unwrap();
    let second = recorded(asked_for(&next.code, hz.round()), cause, noise_n, 2);
    let closed = diagnosed(&[first, second]);
    println!("    -> {:?}", names(&closed));
}

#[test]
fn explore2() {
    let first = || staircase(Order::Both).course(100.0, &at(3000.0)).unwrap();
    let slow = || {
        WarmUp {
            speed_m_s: 0.02,
            run_s: 1800.0,
            stop_s: 0.0,
            resume_s: 0.0,
            block: simulation::profile::Warming { rise_k: 3.0, time_s: 900.0 },
            ..WarmUp::default()
        }
        .course(20.0, &at(3000.0))
        .unwrap()
    };
    let swing = || {
        Reversal { amplitudes_m: vec![0.02], frequencies_hz: vec![0.5], cycles: 30 }.course(200.0, &at(3000.0)).unwrap()
    };
    let fast = || {
        Modulation { speed_m_s: 0.005, depth: 0.3, frequencies_hz: vec![4.0], hold_s: 15.0, ..Modulation::default() }
            .course(200.0, &at(3000.0))
            .unwrap()
    };
    let single = || {
        Staircase { speeds_m_s: vec![0.02], strokes: 5, length_m: 0.1, ..Staircase::default() }
            .course(100.0, &at(3000.0))
            .unwrap()
    };

    settled("seal", first(), &added(Id::SealDrag, &[], &[3.0]), 0.3, Id::HysteresisAndSlip);
    settled("viscous", first(), &added(Id::ViscousDrag, &[0.7], &[3.0]), 0.3, Id::HydrodynamicRolling);
    settled("asym", single(), &added(Id::DirectionAsymmetry, &[], &[0.06]), 0.3, Id::ForceOffset);
    settled("tilt", single(), &added(Id::GravityTilt, &[], &[1.5]), 0.3, Id::ForceOffset);
    settled("inertia", swing(), &added(Id::Inertia, &[], &[8.0]), 0.3, Id::GravityTilt);
    settled("inertia-fast", fast(), &added(Id::Inertia, &[], &[2.0]), 0.3, Id::TimeMisalignment);

    for noise in [0.7, 1.5] {
        settled("viscT", slow(), &added(Id::ViscosityTemperature, &[22.0], &[1.0]), noise, Id::SelfHeating);
        settled("self", slow(), &added(Id::SelfHeating, &[900.0], &[-0.25]), noise, Id::ViscosityTemperature);
    }
}
