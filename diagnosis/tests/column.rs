//! Diagnosis of a simulation that is known only by its column of force.
#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::Verdict;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::file::Law;
use simulation::law::Factors;
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

/// The program behind the column: contacts that slip faster as they grow, at an angle that opens with the load.
const PROGRAM: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\nhersey = \"slip\"\n\
                       contact_angle_mode = \"exact\"\n[axis]\nmoved_mass_kg = 40.0\n";

const COLUMN: &str = "schema = \"guideblock.simulation/1\"\n";

const RATE_HZ: f64 = 200.0;

/// Strokes at one preload with noise of 0.5 %, recorded on a machine whose numbers are `factors` times those of the
/// program.
fn recorded(program: &Simulation, factors: &Factors, preload_n: f64, seed: u64) -> Run {
    let (rows, stroke) = (8000, 800);
    let speed = |n: usize| [0.003, 0.3, 0.01, 0.1, 0.6, 0.03][n / stroke % 6];
    let mut at = 0.5;
    let position_m = (0..rows)
        .map(|n| {
            let turn = std::f64::consts::TAU * (n % stroke) as f64 / stroke as f64;
            at += speed(n) * turn.sin() / RATE_HZ;
            at
        })
        .collect();
    let run = Run {
        time_s: (0..rows).map(|n| n as f64 / RATE_HZ).collect(),
        drag_force_n: vec![0.0; rows],
        position_m: Some(position_m),
        preload_n: Some(vec![preload_n; rows]),
        temperature_block_degc: Some(vec![40.0; rows]),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        ..Run::default()
    };
    let motion = Motion::of(&run);
    let of = |factors: &Factors| {
        let force = program.steady(factors, &run, &motion).expect("a complete run").force_n;
        force.into_iter().map(|force| if force.is_finite() { force } else { 0.0 }).collect::<Vec<f64>>()
    };
    let (told, mut drag_force_n) = (of(&Factors::default()), of(factors));
    let size_n = (drag_force_n.iter().map(|force| force * force).sum::<f64>() / rows as f64).sqrt();
    let mut noise = Noise::new(seed, 0);
    drag_force_n.iter_mut().for_each(|force| *force += 0.005 * size_n * noise.gaussian());
    Run { drag_force_n, simulated_force_n: Some(told), ..run }
}

/// Findings where a program has a quarter too little friction, `coulomb_n + viscous_n_s_m·V`, and the right inertia;
/// ramps that begin abruptly, at 100 Hz.
fn found_of_friction(coulomb_n: f64, viscous_n_s_m: f64) -> Vec<String> {
    let (rate_hz, mass_kg) = (100.0, 20.0);
    let mut noise = Noise::new(9, 0);
    let (mut run, mut position_m, mut told) = (Run::default(), Vec::new(), Vec::new());
    for row in 0..9000 {
        let t = f64::from(row) / rate_hz;
        let (stroke, within_s) = ((t / 3.0) as usize, t % 3.0);
        let (speed, a) = ([0.2, 0.35, 0.5][stroke / 2 % 3], 2.0);
        let ramp_s = speed / a;
        let cruise_s = 0.6 / speed - ramp_s;
        let (x, v, a) = match within_s {
            s if s < ramp_s => (0.5 * a * s * s, a * s, a),
            s if s < ramp_s + cruise_s => (speed * (s - 0.5 * ramp_s), speed, 0.0),
            s if s < 2.0 * ramp_s + cruise_s => {
                let left_s = 2.0 * ramp_s + cruise_s - s;
                (0.6 - 0.5 * a * left_s * left_s, a * left_s, -a)
            }
            _ => (0.6, 0.0, 0.0),
        };
        let (x, sign) = if stroke % 2 == 0 { (x, 1.0) } else { (0.6 - x, -1.0) };
        let friction_n = if v > 1e-9 { coulomb_n + viscous_n_s_m * v } else { 0.0 };
        run.time_s.push(t);
        position_m.push((x * 1e7).round() / 1e7);
        told.push(sign * (friction_n + mass_kg * a));
        run.drag_force_n.push(sign * (1.25 * friction_n + mass_kg * a) + 0.15 * noise.gaussian());
    }
    run.parts = vec![Part { rows: 0..run.time_s.len(), segment: None, starts: Break::Start }];
    let run = Run { position_m: Some(position_m), simulated_force_n: Some(told), ..run };
    let found =
        diagnose(&[run], &[], &Simulation::from_toml(COLUMN).expect("a sound file"), &Options::default()).diagnosis;
    found.mechanisms.into_iter().map(|found| found.id).collect()
}

/// A program may state friction at rest, where the machine has none and a tachometer reads a little: this is no travel
/// without force (play).
#[test]
fn what_a_program_says_of_a_rest_is_no_play() {
    let mut noise = Noise::new(11, 0);
    let (mut run, mut velocity_m_s, mut told) = (Run::default(), Vec::new(), Vec::new());
    for row in 0..18_000 {
        let t = f64::from(row) / RATE_HZ;
        let (stroke, within_s) = ((t / 3.0) as usize, t % 3.0);
        // ramps of a tenth of a second, three accelerations
        let v = [1.0, 2.0, 4.0][stroke % 3] * within_s.min(2.0 - within_s).clamp(0.0, 0.1);
        let sign = if stroke / 3 % 2 == 0 { 1.0 } else { -1.0 };
        let friction_n = sign * (20.0 + 30.0 * v);
        run.time_s.push(t);
        velocity_m_s.push(sign * v + 5e-6 + 2e-6 * noise.gaussian());
        told.push(if v > 1e-9 { friction_n } else { -20.0 });
        run.drag_force_n.push(if v > 1e-9 { friction_n } else { 0.0 } + 0.2 * noise.gaussian());
    }
    run.parts = vec![Part { rows: 0..run.time_s.len(), segment: None, starts: Break::Start }];
    let run = Run { velocity_m_s: Some(velocity_m_s), simulated_force_n: Some(told), ..run };
    let found =
        diagnose(&[run], &[], &Simulation::from_toml(COLUMN).expect("a sound file"), &Options::default()).diagnosis;
    assert_eq!(found.verdict, Verdict::Match, "{:#?}", found.mechanisms);
}

/// Errors of a derived acceleration at the corners of the motion must not pass for missing friction.
#[test]
fn a_program_whose_friction_is_off_beside_its_inertia_is_off_by_that() {
    assert_eq!(found_of_friction(16.0, 60.0), ["parameter-shift"]);
}

/// Where little of the friction depends on speed, something may be named beside the shift, but never instead of it.
#[test]
fn what_has_to_be_beyond_its_tolerance_is_told() {
    let found = found_of_friction(20.0, 8.0);
    assert!(found.iter().any(|id| id == "parameter-shift"), "{found:?}");
}

/// `friction` is one gain on the column, and the column holds an inertia.
#[test]
fn a_program_that_was_off_by_one_gain_as_a_whole_lacks_nothing() {
    let program = Simulation::from_toml(PROGRAM).expect("a sound file");
    let mut run = recorded(&program, &Factors::default(), 4500.0, 7);
    run.drag_force_n.iter_mut().for_each(|force| *force *= 1.05);
    let outcome = diagnose(&[run], &[], &Simulation::from_toml(COLUMN).expect("a sound file"), &Options::default());
    let found = &outcome.diagnosis;
    assert_eq!(found.verdict, Verdict::Match, "{:#?} {:?}", found.mechanisms, found.holdout);
    let file = outcome.augmented.expect("it was read");
    // at one preload, the gain of the friction may be one of the preload
    let Law::Column { friction, inertia, preload, .. } = file.law else { panic!("{:?}", file.law) };
    assert!((friction * preload - 1.05).abs() < 0.01 && (inertia - 1.05).abs() < 0.01, "{:?}", file.law);
}

#[test]
fn a_program_that_was_off_within_its_tolerance_lacks_nothing() {
    let program = Simulation::from_toml(PROGRAM).expect("a sound file");
    let factors = Factors { preload: 1.12, friction: 0.92, viscosity: 0.96, ..Factors::default() };
    let recorded = |(preload_n, seed): (f64, u64)| recorded(&program, &factors, preload_n, seed);
    let runs = [(500.0, 3), (1500.0, 4), (4500.0, 5), (9000.0, 6)].map(recorded);
    let outcome = diagnose(&runs, &[], &Simulation::from_toml(COLUMN).expect("a sound file"), &Options::default());
    let found = &outcome.diagnosis;
    assert_eq!(found.verdict, Verdict::Match, "{:#?} {:?}", found.mechanisms, found.holdout);
    // the inertia that the column holds is exact, and stays so in the exported file
    let file = outcome.augmented.expect("it was read");
    assert!(file.columns.is_empty() && matches!(file.law, Law::Column { friction, .. } if friction != 1.0), "{file:?}");
    for run in &runs {
        let motion = Motion::of(run);
        let force = file.force(run, &motion).expect("a complete run");
        let compared = |n: &usize| force[*n].is_finite() && motion.velocity_m_s[*n].abs() > 0.01;
        let rms = |of: &dyn Fn(usize) -> f64| {
            let squares: Vec<f64> = (0..run.len()).filter(compared).map(|n| of(n).powi(2)).collect();
            (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        };
        let error = rms(&|n| run.drag_force_n[n] - force[n]) / rms(&|n| run.drag_force_n[n]);
        assert!(error < 0.015, "{error}");
    }
}
