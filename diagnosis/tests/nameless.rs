//! Unnamed effects: the exported simulation contains them, and a diagnosis with it does not find them again.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::{Diagnosis, Verdict};
use diagnosis::{Options, Outcome, diagnose};
use simulation::Simulation;
use simulation::curve::{Axis, Carrier};
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::Run;
use simulation::sensor::Noise;

const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                     viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

/// White noise of the force, N.
const NOISE_N: f64 = 0.3;

/// More than a minute of strokes at eight speeds, at 200 Hz.
fn strokes() -> Course {
    let at = Conditions { preload_n: Some(3000.0), temperature_degc: Some(40.0), external_load_n: None };
    let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.04, 0.06, 0.08, 0.1];
    Staircase { speeds_m_s, length_m: 0.15, order: Order::Both, ..Staircase::default() }.course(200.0, &at).unwrap()
}

/// The law's force with noise plus a force against the motion, N: `brake` of time and speed.
fn recorded(brake: impl Fn(f64, f64) -> f64) -> Run {
    let course = strokes();
    let force = Simulation::from_toml(GUIDE).unwrap().force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(7, 0);
    let disturbed = |(n, force): (usize, &f64)| {
        let v = course.motion.velocity_m_s[n];
        let braked = if v == 0.0 { 0.0 } else { v.signum() * brake(course.run.time_s[n], v.abs()) };
        force + braked + NOISE_N * noise.gaussian()
    };
    let drag_force_n = force.iter().enumerate().map(disturbed).collect();
    Run { drag_force_n, ..course.run }
}

fn outcome(run: &Run, simulation: &Simulation) -> Outcome {
    diagnose(std::slice::from_ref(run), &[], simulation, &Options::default())
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.mechanisms.iter().map(|found| found.id.as_str()).collect()
}

/// The run with its preload scaled by the file's mapping of that column.
fn as_read(run: &Run, file: &Simulation) -> Run {
    let mapping = file.columns.iter().find(|(name, _)| name == "preload_n");
    let scale: f64 = mapping.map_or(1.0, |(_, text)| text.split(':').nth(1).unwrap().parse().unwrap());
    let preload_n = run.preload_n.as_ref().map(|column| column.iter().map(|p| scale * p).collect());
    Run { preload_n, ..run.clone() }
}

/// Diagnoses, reads the exported file back and diagnoses with it again: nothing is found, and the residual is that of
/// the first diagnosis. Returns the file.
fn found_once(brake: impl Fn(f64, f64) -> f64) -> Simulation {
    let run = recorded(brake);
    let first = outcome(&run, &Simulation::from_toml(GUIDE).unwrap());
    assert_eq!(ids(&first.diagnosis), ["unknown"]);
    let exported = first.augmented.unwrap();
    let file = Simulation::from_toml(&exported.to_toml()).unwrap();
    assert_eq!(file, exported);
    let again = outcome(&as_read(&run, &file), &file).diagnosis;
    assert_eq!((again.verdict, ids(&again)), (Verdict::Match, vec![]), "{:?}", again.unexplained);
    let (before, after) = (&again.holdout.rmse_before_n, &first.diagnosis.holdout.rmse_after_n);
    assert!((before / after - 1.0).abs() < 0.01, "{before} {after}");
    file
}

#[test]
fn a_brake_on_another_machine_s_clock_is_found_once() {
    let period_s = 5.37;
    let file = found_once(|t, _| 0.5 - 0.5 * (std::f64::consts::TAU * t / period_s).cos());
    let [added] = file.curves.as_slice() else { panic!("{:?}", file.curves) };
    // an effect that repeats after one period also repeats after several
    let periods = added.curve.period_s().expect("a clock") / period_s;
    assert!((periods / periods.round() - 1.0).abs() < 5e-3, "{added:?}");
    assert!(file.mechanisms.is_empty(), "{:?}", file.mechanisms);
}

#[test]
fn a_force_of_its_time_is_found_once() {
    let file = found_once(|t, _| 1.5 * (-((t - 60.0) / 20.0).powi(2)).exp());
    assert!(file.curves.iter().any(|added| added.curve.axis == Axis::Time), "{:?}", file.curves);
}

#[test]
fn air_is_found_once_and_simulated_on_another_recording() {
    let file = found_once(|_, v| 200.0 * v * v);
    let [added] = file.curves.as_slice() else { panic!("{:?}", file.curves) };
    assert_eq!((added.curve.axis, added.curve.carrier), (Axis::Velocity, Carrier::Odd));
    // law and curve may divide the force between them in any way; their sum is right
    let course = strokes();
    let simulated = file.force(&as_read(&course.run, &file), &course.motion).unwrap();
    let law = Simulation::from_toml(GUIDE).unwrap().force(&course.run, &course.motion).unwrap();
    let square = |(n, simulated): (usize, &f64)| {
        let v = course.motion.velocity_m_s[n];
        (simulated - law[n] - 200.0 * v * v.abs()).powi(2)
    };
    let rms_n = (simulated.iter().enumerate().map(square).sum::<f64>() / simulated.len() as f64).sqrt();
    assert!(rms_n < 0.1, "{rms_n}");
}

#[test]
fn a_chain_that_only_bends_stands_in_and_one_that_pulls_is_named() {
    let of = |pull_n_m: f64| {
        let chain = format!(
            "[[mechanism]]\nid = \"cable-chain\"\nform = \"rolling\"\ndrag_n = 0.0\nbending_n = 1.5\n\
             force_per_m_n_m = {pull_n_m:.1}\nforce_per_m2_n_m2 = 0.0\nforce_n = 0.0\nlength_m = 0.03\n"
        );
        let course = strokes();
        let force =
            Simulation::from_toml(&(GUIDE.to_owned() + &chain)).unwrap().force(&course.run, &course.motion).unwrap();
        let mut noise = Noise::new(11, 0);
        let drag_force_n = force.iter().map(|force| force + NOISE_N * noise.gaussian()).collect();
        outcome(&Run { drag_force_n, ..course.run }, &Simulation::from_toml(GUIDE).unwrap()).diagnosis
    };
    let bends = of(0.0);
    assert_eq!(ids(&bends), ["unknown"]);
    assert!(bends.mechanisms[0].statement.contains("cable-chain comes nearest"), "{:?}", bends.mechanisms);
    assert_eq!(ids(&of(60.0)), ["cable-chain"]);
}

/// A noise law takes on the spectrum of a sound, and whitening hides it: what is loud at some times only is no noise.
#[test]
fn a_neighbour_that_runs_up_and_down_is_no_noise() {
    let clean = recorded(|_, _| 0.0);
    let with = |newtons: f64| {
        let mut run = clean.clone();
        for (force, t) in run.drag_force_n.iter_mut().zip(&run.time_s) {
            // from 5 to 20 Hz and back in 12 s
            let phase = std::f64::consts::PI * 25.0 * t - 0.5 * 15.0 * 12.0 * (std::f64::consts::TAU * t / 12.0).cos();
            *force += newtons * phase.sin();
        }
        outcome(&run, &Simulation::from_toml(GUIDE).unwrap()).diagnosis
    };
    assert_eq!(with(0.0).verdict, Verdict::Match);
    let found = with(0.2);
    assert_eq!(ids(&found), ["unknown"]);
    assert!(found.mechanisms[0].statement.contains("comes and goes"), "{}", found.mechanisms[0].statement);
}
