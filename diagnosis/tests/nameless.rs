//! Effects without a name: none is given one, the exported simulation contains them, and a diagnosis with it does not
//! find them again.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use diagnosis::report::Verdict;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::curve::{Axis, Carrier};
use simulation::run::Run;
use simulation::sensor::Noise;

use crate::common::{GUIDE, NOISE_N, ids, nothing, outcome, recorded, simulation, strokes};

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
    let run = recorded(&simulation(""), strokes(), |t, v, _| brake(t, v));
    let first = outcome(&run, &simulation(""));
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
    let law = simulation("").force(&course.run, &course.motion).unwrap();
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
        outcome(&Run { drag_force_n, ..course.run }, &simulation("")).diagnosis
    };
    let bends = of(0.0);
    assert_eq!(ids(&bends), ["unknown"]);
    assert!(bends.mechanisms[0].statement.contains("cable-chain comes nearest"), "{:?}", bends.mechanisms);
    assert_eq!(ids(&of(60.0)), ["cable-chain"]);
}

/// A noise law takes on the spectrum of a sound, and whitening hides it: what is loud at some times only is no noise.
#[test]
fn a_neighbour_that_runs_up_and_down_is_no_noise() {
    let clean = recorded(&simulation(""), strokes(), nothing);
    let with = |newtons: f64| {
        let mut run = clean.clone();
        for (force, t) in run.drag_force_n.iter_mut().zip(&run.time_s) {
            // from 5 to 20 Hz and back in 12 s
            let phase = std::f64::consts::PI * 25.0 * t - 0.5 * 15.0 * 12.0 * (std::f64::consts::TAU * t / 12.0).cos();
            *force += newtons * phase.sin();
        }
        outcome(&run, &simulation("")).diagnosis
    };
    assert_eq!(with(0.0).verdict, Verdict::Match);
    let found = with(0.2);
    assert_eq!(ids(&found), ["unknown"]);
    assert!(found.mechanisms[0].statement.contains("comes and goes"), "{}", found.mechanisms[0].statement);
}

#[test]
fn a_clamp_on_another_machine_s_clock_is_unknown_with_its_period() {
    let simulation = simulation("");
    let period_s = 5.37;
    let clamp = |t: f64, _: f64, _: f64| if t.rem_euclid(period_s) < 0.35 * period_s { 0.8 } else { 0.0 };
    let found = outcome(&recorded(&simulation, strokes(), clamp), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    let [place] = found.regions.as_slice() else { panic!("{:?}", found.regions) };
    assert_eq!((place.axis, place.unit), ("frequency", "Hz"));
    assert!((place.from * period_s - 1.0).abs() < 5e-3, "{place:?}");
    assert!(found.holdout.rmse_after_n < 0.7 * found.holdout.rmse_calibrated_n, "{:?}", found.holdout);
}

#[test]
fn a_clamp_is_heard_above_noise_that_remembers_and_that_noise_is_none() {
    let simulation = simulation("");
    let period_s = 5.37;
    let of = |height_n: f64| {
        let clamp = |t: f64, _: f64, _: f64| if t.rem_euclid(period_s) < 0.35 * period_s { height_n } else { 0.0 };
        let mut run = recorded(&simulation, strokes(), clamp);
        // noise correlated over tenths of a second and over seconds
        let mut noise = Noise::new(31, 0);
        let (mut slow, mut slower) = (0.0, 0.0);
        for force in &mut run.drag_force_n {
            slow = 0.97 * slow + 0.24 * noise.gaussian();
            slower = 0.998 * slower + 0.06 * noise.gaussian();
            *force += NOISE_N * (slow + slower);
        }
        outcome(&run, &simulation).diagnosis
    };
    let found = of(1.0);
    assert_eq!(ids(&found), ["unknown"]);
    let [place] = found.regions.as_slice() else { panic!("{:?}", found.regions) };
    assert!((place.from * period_s - 1.0).abs() < 5e-3, "{place:?}");
    assert_eq!(ids(&of(0.0)), [""; 0]);
}

#[test]
fn what_goes_with_the_time_of_a_recording_is_scored_there_and_not_carried_to_another() {
    let simulation = simulation("");
    let bump = |t: f64, _: f64, _: f64| 1.5 * (-((t - 60.0) / 20.0).powi(2)).exp();
    let run = recorded(&simulation, strokes(), bump);
    let own = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&own), ["unknown"]);
    assert_eq!(own.regions[0].axis, "time");
    assert!(own.holdout.rmse_after_n < 0.95 * own.holdout.rmse_calibrated_n, "{:?}", own.holdout);
    let other = recorded(&simulation, strokes(), nothing);
    let both = diagnose(std::slice::from_ref(&run), std::slice::from_ref(&other), &simulation, &Options::default());
    let holdout = &both.diagnosis.holdout;
    assert_eq!(ids(&both.diagnosis), ["unknown"]);
    assert_eq!(holdout.rmse_after_n.to_bits(), holdout.rmse_calibrated_n.to_bits(), "{holdout:?}");
    assert_eq!(both.diagnosis.mechanisms[0].carried_over, None);
}

#[test]
fn a_force_that_no_cause_of_the_library_follows_gets_no_name() {
    let simulation = simulation("");
    // air drag, with the square of speed: it rises faster with speed than seals or grease
    let air = |_: f64, v: f64, _: f64| 200.0 * v * v;
    let found = outcome(&recorded(&simulation, strokes(), air), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    // a wiper that touches at random, for some tenths of a second
    let mut draws = Noise::new(21, 0);
    let touches: Vec<bool> = (0..2000).map(|_| draws.gaussian() > 0.8).collect();
    let wiper = |t: f64, _: f64, _: f64| if touches[(t / 0.7) as usize % touches.len()] { 1.5 } else { 0.0 };
    let found = outcome(&recorded(&simulation, strokes(), wiper), &simulation).diagnosis;
    assert_eq!(ids(&found), ["unknown"]);
    // no curve can follow it: the exported law is the calibrated one
    assert_eq!(found.holdout.rmse_after_n.to_bits(), found.holdout.rmse_calibrated_n.to_bits(), "{:?}", found.holdout);
}
