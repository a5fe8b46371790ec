//! Faults of a single channel, and what a file says wrongly of it.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use diagnosis::report::{Diagnosis, Verdict};
use diagnosis::{Options, Outcome, Refused, diagnose};
use simulation::Simulation;
use simulation::motion::Motion;
use simulation::profile::{Course, Order, Staircase};
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

use crate::common::{NOISE_N, USUAL, ids, nothing, number, outcome, recorded, simulation, strokes};

/// Sum of the shares of the mismatch: those of the findings and the unexplained one.
fn shared_out(diagnosis: &Diagnosis) -> f64 {
    diagnosis.mechanisms.iter().map(|found| found.share_of_mismatch).sum::<f64>()
        + diagnosis.unexplained.share_of_mismatch
}

/// Strokes at five speeds, with a rest of a second before each.
fn resting() -> Course {
    let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.05];
    let strokes = Staircase { speeds_m_s, length_m: 0.1, pause_s: 1.0, order: Order::Both, ..Staircase::default() };
    strokes.course(200.0, &USUAL).unwrap()
}

#[test]
fn a_channel_that_ends_is_named_its_rows_set_aside_and_not_found_again() {
    let simulation = simulation("");
    let mut run = recorded(&simulation, strokes(), nothing);
    let limit = 0.95 * run.drag_force_n.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let clipped = run.drag_force_n.iter().filter(|x| x.abs() >= limit).count();
    run.drag_force_n.iter_mut().for_each(|x| *x = x.clamp(-limit, limit));
    let found = outcome(&run, &simulation);
    assert_eq!(ids(&found.diagnosis), ["force-saturation"]);
    assert!((number(&found.diagnosis) / limit - 1.0).abs() < 1e-9);
    assert!((shared_out(&found.diagnosis) - 1.0).abs() < 1e-9, "{}", shared_out(&found.diagnosis));
    assert_eq!(found.diagnosis.p_no_mismatch, 0.0);
    assert!(found.diagnosis.data_quality.rejected["near-an-end-of-the-force-channel"] >= clipped);
    let again = outcome(&run, &found.augmented.unwrap());
    assert_eq!(ids(&again.diagnosis), [""; 0]);
}

#[test]
fn a_step_is_named_where_it_is_coarser_than_the_noise_and_not_where_noise_carries_over_it() {
    let simulation = simulation("");
    let noisy = recorded(&simulation, strokes(), nothing);
    let counted = |step: f64| {
        let drag_force_n = noisy.drag_force_n.iter().map(|x| (x / step).round() * step).collect();
        outcome(&Run { drag_force_n, ..noisy.clone() }, &simulation).diagnosis
    };
    let coarse = counted(1.5);
    assert_eq!(ids(&coarse), ["force-quantisation"]);
    let step = &coarse.mechanisms[0].parameters[0];
    assert_eq!(step.name, "step_n");
    assert!((step.value / 1.5 - 1.0).abs() < 1e-6 && step.ci95[0] < 1.5 && 1.5 < step.ci95[1], "{step:?}");
    assert!((shared_out(&coarse) - 1.0).abs() < 1e-9, "{}", shared_out(&coarse));
    assert_eq!(ids(&counted(0.2)), [""; 0]);
}

#[test]
fn a_recorded_speed_that_only_adds_noise_is_set_aside_and_said_so() {
    let simulation = simulation("[axis]\nmoved_mass_kg = 10.0\n");
    let of = |noise_m_s: f64| {
        let course = strokes();
        let mut noise = Noise::new(3, 0);
        let recorded_speed = course.motion.velocity_m_s.iter().map(|v| v + noise_m_s * noise.gaussian()).collect();
        let run = Run { acceleration_m_s2: None, ..recorded(&simulation, course, nothing) };
        outcome(&Run { velocity_m_s: Some(recorded_speed), ..run }, &simulation).diagnosis
    };
    let noisy = of(1e-3);
    assert_eq!(ids(&noisy), ["speed-noise"]);
    assert!((number(&noisy).sqrt() / 1e-3 - 1.0).abs() < 0.05, "{}", number(&noisy).sqrt());
    assert!(noisy.data_quality.warnings.iter().any(|line| line.contains("recorded speed")), "{:?}", noisy.data_quality);
    assert_eq!(ids(&of(0.0)), [""; 0]);
}

/// A tachometer alone: between strokes the carriage rests for a second, and noise is no motion. What is exported calms
/// the speed in the same way.
#[test]
fn the_noise_of_a_tachometer_alone_is_named_and_a_rest_is_no_motion() {
    let simulation = simulation("");
    let course = resting();
    let speed = course.motion.velocity_m_s.clone();
    let still = recorded(&simulation, course, nothing);
    let of = |noise_m_s: f64| {
        let mut noise = Noise::new(3, 0);
        let velocity_m_s = Some(speed.iter().map(|v| v + noise_m_s * noise.gaussian()).collect());
        Run { velocity_m_s, position_m: None, acceleration_m_s2: None, ..still.clone() }
    };
    assert_eq!(ids(&outcome(&of(0.0), &simulation).diagnosis), [""; 0]);
    let noisy = of(6e-4);
    let found = outcome(&noisy, &simulation);
    assert_eq!(ids(&found.diagnosis), ["speed-noise"]);
    assert!((number(&found.diagnosis).sqrt() / 6e-4 - 1.0).abs() < 0.1, "{}", number(&found.diagnosis).sqrt());
    let moves: Vec<bool> = speed.iter().map(|v| v.abs() > 1e-3).collect();
    let error_n = |simulation: &Simulation| {
        let force = simulation.force(&noisy, &Motion::of(&noisy)).unwrap();
        let off = force.iter().zip(&noisy.drag_force_n).zip(&moves).filter(|(_, moves)| **moves);
        let squares: Vec<f64> = off.map(|((force, drag), _)| (force - drag).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    };
    let (as_given, exported) = (error_n(&simulation), error_n(&found.augmented.unwrap()));
    assert!(exported < 1.2 * NOISE_N && as_given > 1.3 * exported, "{as_given} N as given, {exported} N exported");
}

/// Beside an encoder the noise of a tachometer matters in rests alone, where it says motion.
#[test]
fn motion_that_is_noise_of_a_rest_is_told_by_the_position() {
    let simulation = simulation("");
    let course = resting();
    let mut noise = Noise::new(3, 0);
    let velocity_m_s = Some(course.motion.velocity_m_s.iter().map(|v| v + 6e-4 * noise.gaussian()).collect());
    let run = Run { velocity_m_s, acceleration_m_s2: None, ..recorded(&simulation, course, nothing) };
    assert_eq!(ids(&outcome(&run, &simulation).diagnosis), ["speed-noise"]);
}

#[test]
fn a_speed_in_another_unit_is_refused_and_not_taken_for_noise() {
    let simulation = simulation("[axis]\nmoved_mass_kg = 40.0\n");
    let course = strokes();
    let velocity_m_s = Some(course.motion.velocity_m_s.iter().map(|v| 1e3 * v).collect());
    let run = Run { velocity_m_s, ..recorded(&simulation, course, nothing) };
    let found = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&found), [""; 0]);
    let warnings = &found.data_quality.warnings;
    assert!(warnings.iter().any(|line| line.contains("m/s")), "{warnings:?}");
}

/// Times in minutes make speeds of a few metres per second, which a carriage may have; the acceleration knows better.
#[test]
fn times_in_minutes_are_told_by_the_acceleration() {
    let simulation = simulation("");
    let course = strokes();
    let acceleration_m_s2 = Some(course.motion.acceleration_m_s2.clone());
    let run = Run { acceleration_m_s2, velocity_m_s: None, ..recorded(&simulation, course, nothing) };
    assert_eq!(outcome(&run, &simulation).diagnosis.verdict, Verdict::Match);
    let time_s = run.time_s.iter().map(|t| t / 60.0).collect();
    let found = outcome(&Run { time_s, ..run }, &simulation).diagnosis;
    assert_eq!((found.verdict, ids(&found).len()), (Verdict::InsufficientData, 0), "{found:#?}");
    let warnings = &found.data_quality.warnings;
    assert!(warnings.iter().any(|line| line.contains("time in minutes is 3600")), "{warnings:?}");
}

#[test]
fn what_does_not_carry_over_is_said_to_make_things_worse() {
    let simulation = simulation("");
    let dragging = recorded(&simulation, strokes(), |_, _, _| 3.0);
    let clean = recorded(&simulation, strokes(), nothing);
    let warnings = |holdout: Run| {
        let outcome = diagnose(std::slice::from_ref(&dragging), &[holdout], &simulation, &Options::default());
        outcome.diagnosis.data_quality.warnings
    };
    let is_said = |warnings: Vec<String>| warnings.iter().any(|line| line.contains("does not carry over"));
    assert!(is_said(warnings(clean)));
    assert!(!is_said(warnings(dragging.clone())));
}

/// Time in minutes makes speeds 60 times as high, but slow strokes then still look like a fast carriage: the mean
/// passes.
#[test]
fn a_time_in_minutes_is_no_recording_of_a_carriage() {
    let simulation = simulation("");
    let speeds_m_s = vec![0.05, 0.1, 0.2, 0.3];
    let course = Staircase { speeds_m_s, length_m: 0.3, order: Order::Both, ..Staircase::default() };
    let mut run = recorded(&simulation, course.course(200.0, &USUAL).unwrap(), nothing);
    run.velocity_m_s = None;
    run.acceleration_m_s2 = None;
    let read = outcome(&run, &simulation).diagnosis;
    assert_eq!(read.verdict, Verdict::Match, "{:?}", read.data_quality.warnings);
    run.time_s.iter_mut().for_each(|t| *t /= 60.0);
    let Outcome { diagnosis, refused, .. } = outcome(&run, &simulation);
    assert_eq!(diagnosis.verdict, Verdict::InsufficientData);
    assert!(diagnosis.data_quality.warnings.iter().any(|line| line.contains("the unit of time")), "{diagnosis:?}");
    assert!(matches!(refused, Some(Refused::File(_))), "{refused:?}");
}

#[test]
fn a_force_without_its_sign_is_asked_about() {
    let simulation = simulation("");
    let signed = recorded(&simulation, strokes(), nothing);
    let asks = |change: fn(f64) -> f64| {
        let mut run = signed.clone();
        run.drag_force_n.iter_mut().for_each(|force| *force = change(*force));
        outcome(&run, &simulation).diagnosis.data_quality.warnings.iter().any(|line| line.contains("is it a magnitude"))
    };
    assert!(asks(f64::abs) && asks(|force| -force.abs()));
    // a force with one sign is legal, too: a weight on the carriage beside friction in both directions
    assert!(!asks(|force| force) && !asks(|force| force + 60.0));
}

/// Strokes to and fro without rests, at 500 Hz; each entry: period in s, half a stroke in m.
fn to_and_fro(strokes: &[(f64, f64)]) -> Course {
    let (rate_hz, seconds) = (500.0, 20.0);
    let rows = (seconds * rate_hz) as usize;
    let position = |n: usize| {
        let (period_s, half_m) = strokes[n / rows];
        0.3 + half_m * (1.0 - (std::f64::consts::TAU * (n % rows) as f64 / rate_hz / period_s).cos())
    };
    let all = rows * strokes.len();
    let run = Run {
        time_s: (0..all).map(|n| n as f64 / rate_hz).collect(),
        position_m: Some((0..all).map(|n| (position(n) * 1e7).round() / 1e7).collect()),
        drag_force_n: vec![0.0; all],
        parts: vec![Part { rows: 0..all, segment: None, starts: Break::Start }],
        ..Run::default()
    };
    let motion = Motion::of(&run);
    Course { run, motion }
}

/// The force of a drive that keeps its force while the carriage rests, as `channel` distorts it.
fn held(run: &Run, moving: &[f64], channel: impl Fn(&[f64]) -> Vec<f64>) -> Run {
    let mut last = moving.iter().copied().find(|force| *force != 0.0).unwrap_or(0.0);
    let held: Vec<f64> = moving
        .iter()
        .map(|force| {
            last = if *force == 0.0 { last } else { *force };
            last
        })
        .collect();
    let mut noise = Noise::new(7, 0);
    let drag_force_n = channel(&held).iter().map(|force| force + NOISE_N * noise.gaussian()).collect();
    Run { drag_force_n, ..run.clone() }
}

#[test]
fn a_force_that_is_late_by_rows_is_late_and_no_noise_at_the_turns() {
    let simulation = simulation("");
    let course = to_and_fro(&[(10.0, 0.1), (5.0, 0.1), (2.0, 0.08), (1.0, 0.05)]);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    for rows in [5, 15] {
        let late = |force: &[f64]| (0..force.len()).map(|n| force[n.saturating_sub(rows)]).collect();
        let found = outcome(&held(&course.run, &force, late), &simulation).diagnosis;
        let first = &found.mechanisms[0];
        assert_eq!(first.id, "time-misalignment", "{found:#?}");
        let delay = first.parameters.iter().find(|parameter| parameter.name == "delay_s").unwrap();
        assert!((delay.value - rows as f64 / 500.0).abs() < 1e-3, "{delay:?}");
        assert!(found.holdout.rmse_after_n < 0.25 * found.holdout.rmse_calibrated_n, "{:?}", found.holdout);
    }
}

#[test]
fn a_filter_is_found_where_the_drive_holds_its_force_at_rest() {
    let simulation = simulation("");
    let course = strokes();
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let filtered = |force: &[f64]| {
        let (mut y, keep) = (force[0], (-0.005f64 / 0.02).exp());
        let next = |u: &f64| {
            y = keep * y + (1.0 - keep) * u;
            y
        };
        force.iter().map(next).collect()
    };
    let found = outcome(&held(&course.run, &force, filtered), &simulation).diagnosis;
    assert_eq!(ids(&found), ["force-lowpass"], "{found:#?}");
    let time = found.mechanisms[0].parameters.iter().find(|parameter| parameter.name == "time_s").unwrap();
    assert!((time.value / 0.02 - 1.0).abs() < 0.2, "{time:?}");
}

/// Along a stroke the force hardly changes with time: a late force shows only where the stroke starts and stops.
#[test]
fn a_force_that_is_late_is_late_although_the_law_hardly_changes_along_the_stroke() {
    let simulation = simulation("[tolerance]\nrelevance = 0.02\n");
    let speeds_m_s = vec![0.02, 0.03, 0.04, 0.05, 0.06, 0.08];
    let with_rests = Staircase { speeds_m_s, length_m: 0.15, pause_s: 1.0, order: Order::Both, ..Staircase::default() };
    let mut run = recorded(&simulation, with_rests.course(200.0, &USUAL).unwrap(), nothing);
    let on_time = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&on_time), [""; 0], "{on_time:#?}");
    run.drag_force_n.rotate_right(1);
    let late = outcome(&run, &simulation).diagnosis;
    assert_eq!(ids(&late), ["time-misalignment"], "{late:#?}");
    assert!((number(&late) - 0.005).abs() < 1e-3, "{late:#?}");
}

/// Strokes with short rests between them, at 200 rows a second, with the force passed through `channel` at ten times that
/// rate.
fn sampled(channel: impl Fn(&[f64]) -> Vec<f64>, noise_n: f64) -> Run {
    let speeds_m_s = vec![0.02, 0.05, 0.1, 0.2, 0.3];
    let order = Order::Both;
    let fine = Staircase { speeds_m_s, length_m: 0.2, order, strokes: 3, hold_s: 0.0, ..Staircase::default() };
    let fine = fine.course(2000.0, &USUAL).unwrap();
    let force = channel(&simulation("").force(&fine.run, &fine.motion).unwrap());
    let every_tenth = |values: &[f64]| values.iter().step_by(10).copied().collect::<Vec<f64>>();
    let mut noise = Noise::new(7, 0);
    let drag_force_n: Vec<f64> = every_tenth(&force).iter().map(|force| force + noise_n * noise.gaussian()).collect();
    let rows = drag_force_n.len();
    Run {
        time_s: every_tenth(&fine.run.time_s),
        position_m: Some(every_tenth(&fine.motion.position_m)),
        drag_force_n,
        preload_n: Some(vec![3000.0; rows]),
        temperature_block_degc: Some(vec![40.0; rows]),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        ..Run::default()
    }
}

/// A first-order filter of this time, s, of rows half a millisecond apart.
fn filtered(force: &[f64], time_s: f64) -> Vec<f64> {
    let (mut y, keep) = (force[0], (-5e-4 / time_s).exp());
    let next = |u: &f64| {
        y = keep * y + (1.0 - keep) * u;
        y
    };
    force.iter().map(next).collect()
}

/// Its tail behind a start is a hundred times the noise, so the row that the friction begins in counts.
#[test]
fn a_filter_of_a_row_is_one_filter_of_its_time() {
    let found = outcome(&sampled(|force| filtered(force, 7e-3), 0.05), &simulation("")).diagnosis;
    assert_eq!(ids(&found), ["force-lowpass"], "{found:#?}");
    let numbers = &found.mechanisms[0].parameters;
    let of = |name: &str| numbers.iter().find(|number| number.name == name).map(|number| number.value).unwrap();
    assert!((of("time_s") * of("part") / 7e-3 - 1.0).abs() < 0.05, "{numbers:?}");
}

/// Where starts and stops do not say what the channel does within a row, the rest of the recording does not either.
#[test]
fn a_channel_late_by_less_than_a_row_is_late_or_filtered() {
    let late = |force: &[f64]| (0..force.len()).map(|n| force[n.saturating_sub(1)]).collect();
    for run in [sampled(late, 0.2), sampled(|force| filtered(force, 4e-4), 0.05)] {
        let found = outcome(&run, &simulation("")).diagnosis;
        let [cause] = found.mechanisms.as_slice() else { panic!("{found:#?}") };
        assert_eq!((cause.id.as_str(), cause.equivalents[0].as_str()), ("time-misalignment", "force-lowpass"));
    }
}
