//! Errors of a derived acceleration must not pass for a cause; structures excited by rolling, and hum.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::Diagnosis;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

const AXIS: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20.0\n\
                    viscous_n_s_m = 200.0\noffset_n = 0.0\n[axis]\nmoved_mass_kg = 100.0\n[tolerance]\nfriction = 0.03\n\
                    mass = 0.02\n";

/// Strokes at eight speeds, at this rate of rows.
fn strokes(rate_hz: f64) -> Course {
    let speeds_m_s = vec![0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, 0.13];
    let staircase = Staircase { speeds_m_s, length_m: 0.2, order: Order::Both, ..Staircase::default() };
    staircase.course(rate_hz, &Conditions::default()).unwrap()
}

fn diagnosis(run: &Run, simulation: &Simulation) -> Diagnosis {
    diagnose(std::slice::from_ref(run), &[], simulation, &Options::default()).diagnosis
}

/// Diagnosis of a force, N, plus something that rings, in white noise of 0.2 N.
fn beside(force: &[f64], ringing: &[f64], run: &Run, simulation: &Simulation) -> Diagnosis {
    let mut noise = Noise::new(6, 0);
    let drag_force_n = force.iter().zip(ringing).map(|(f, x)| f + x + 0.2 * noise.gaussian()).collect();
    diagnosis(&Run { drag_force_n, ..run.clone() }, simulation)
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.mechanisms.iter().map(|found| found.id.as_str()).collect()
}

#[test]
fn noise_and_rounded_corners_of_a_derived_acceleration_are_no_physics() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let course = strokes(1000.0);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(5, 0);
    // slow noise, from which fast errors of the acceleration stand out
    let mut slow = 0.0;
    let drag_force_n = force
        .iter()
        .map(|force| {
            slow = 0.97 * slow + 0.1 * noise.gaussian();
            force + slow
        })
        .collect();
    let velocity_m_s = course.motion.velocity_m_s.iter().map(|v| v + 2e-6 * noise.gaussian()).collect();
    let run = Run { drag_force_n, velocity_m_s: Some(velocity_m_s), acceleration_m_s2: None, ..course.run };
    assert_eq!(ids(&diagnosis(&run, &simulation)), [""; 0]);
}

/// Cycles of a handling axis: half a metre at one of three speeds, an acceleration of 5 m/s² that begins and ends
/// abruptly, rests. Force of [`AXIS`] with `heavier` times its mass in white noise of 0.3 N, the position to 0.1 µm.
fn handled(rate_hz: f64, heavier: f64) -> Run {
    let acceleration_m_s2 = 5.0;
    let place = |t: f64, speed: f64| {
        let ramp_s = speed / acceleration_m_s2;
        let cruise_s = 0.5 / speed - ramp_s;
        match t.clamp(0.0, 2.0 * ramp_s + cruise_s) {
            t if t < ramp_s => (0.5 * acceleration_m_s2 * t * t, acceleration_m_s2 * t, acceleration_m_s2),
            t if t < ramp_s + cruise_s => (speed * (t - 0.5 * ramp_s), speed, 0.0),
            t => {
                let left_s = 2.0 * ramp_s + cruise_s - t;
                (0.5 - 0.5 * acceleration_m_s2 * left_s * left_s, acceleration_m_s2 * left_s, -acceleration_m_s2)
            }
        }
    };
    let mut noise = Noise::new(8, 0);
    let mut run = Run::default();
    let (mut position_m, cycle_s) = (Vec::new(), 2.5);
    for row in 0..(120.0 * rate_hz) as usize {
        let t = row as f64 / rate_hz;
        let (cycle, within_s) = ((t / cycle_s) as usize, t % cycle_s);
        let (x, v, a) = place(within_s, [0.3, 0.5, 0.8][cycle / 2 % 3]);
        let (x, sign) = if cycle % 2 == 0 { (x, 1.0) } else { (0.5 - x, -1.0) };
        let moves = v > 1e-9;
        let friction_n = if moves { 20.0 + 200.0 * v + 100.0 * heavier * a } else { 0.0 };
        run.time_s.push(t);
        position_m.push((x * 1e7).round() / 1e7);
        run.drag_force_n.push(sign * friction_n + 0.3 * noise.gaussian());
    }
    run.parts = vec![Part { rows: 0..run.time_s.len(), segment: None, starts: Break::Start }];
    Run { position_m: Some(position_m), ..run }
}

#[test]
fn corners_of_a_speed_are_no_physics_and_a_mass_that_is_off_is_found_beside_them() {
    let given = Simulation::from_toml(AXIS).unwrap();
    let fitted =
        Simulation::from_toml("schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n").unwrap();
    for rate_hz in [100.0, 250.0] {
        for simulation in [&given, &fitted] {
            let found = diagnosis(&handled(rate_hz, 1.0), simulation);
            assert_eq!(ids(&found), [""; 0], "{rate_hz} Hz");
            assert!((found.noise_floor_n - 0.3).abs() < 0.03, "{}", found.noise_floor_n);
        }
        assert_eq!(ids(&diagnosis(&handled(rate_hz, 1.15), &given)), ["parameter-shift"]);
    }
}

/// Force, N, of a structure excited by random rolling noise: `frequency` in Hz of each row, `damping` relative to
/// critical.
fn struck(
    course: &Course,
    rate_hz: f64,
    damping: f64,
    frequency: impl Fn(usize) -> f64,
    grows_with_speed: bool,
) -> Vec<f64> {
    let mut noise = Noise::new(9, 0);
    let (mut before, mut last) = (0.0, 0.0);
    let next = |n: usize| {
        let angle = std::f64::consts::TAU * frequency(n) / rate_hz;
        let decay = (-damping * angle).exp();
        let speed = if grows_with_speed { course.motion.velocity_m_s[n].abs() } else { 0.05 };
        let x = 2.0 * decay * angle.cos() * last - decay * decay * before + 0.4 * speed.sqrt() * noise.gaussian();
        (before, last) = (last, x);
        x
    };
    (0..course.run.len()).map(next).collect()
}

#[test]
fn a_structure_that_rolling_strikes_is_heard_and_what_sweeps_is_not_one() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let rate_hz = 500.0;
    let course = strokes(rate_hz);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let with = |ringing: &[f64]| beside(&force, ringing, &course.run, &simulation);
    for damping in [0.015, 0.04] {
        let found = with(&struck(&course, rate_hz, damping, |_| 47.0, true));
        assert_eq!(ids(&found), ["structural-resonance"], "{damping}");
        let frequency = found.mechanisms[0].parameters.iter().find(|number| number.name == "frequency_hz").unwrap();
        assert!(frequency.ci95[0] <= 47.0 && 47.0 <= frequency.ci95[1], "{damping}: {frequency:?}");
    }
    // a sweep from 42 to 52 Hz every second, as of a machine nearby that starts up
    let found = with(&struck(&course, rate_hz, 0.015, |n| 42.0 + 10.0 * (n as f64 / rate_hz).fract(), false));
    assert!(!ids(&found).contains(&"structural-resonance"), "{:?}", ids(&found));
}

/// A ringing structure's form leaves a hundredth of its force.
#[test]
fn what_has_next_to_nothing_beside_a_structure_that_rings_has_no_name() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let rate_hz = 500.0;
    let course = strokes(rate_hz);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let ringing = struck(&course, rate_hz, 0.02, |_| 47.0, true);
    let ringing_n = (ringing.iter().map(|x| x * x).sum::<f64>() / ringing.len() as f64).sqrt();
    let with = |share: f64| {
        let offset_n = share.sqrt() * ringing_n;
        let both: Vec<f64> = ringing.iter().map(|x| x + offset_n).collect();
        beside(&force, &both, &course.run, &simulation)
    };
    assert_eq!(ids(&with(0.008)), ["structural-resonance"]);
    assert_eq!(ids(&with(0.03)), ["structural-resonance", "force-offset"]);
}

#[test]
fn a_structure_that_rings_in_a_quiet_run_is_heard_beside_a_loud_one() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let rate_hz = 500.0;
    let course = strokes(rate_hz);
    let form = "\n[[mechanism]]\nid = \"structural-resonance\"\nfrequency_hz = 47.0\ndamping = 0.02\npart = 0.01\nmass_kg = 2.0\n";
    let rings = Simulation::from_toml(&format!("{AXIS}{form}")).unwrap();
    let with = |simulation_of_force: &Simulation, struck: Vec<f64>| {
        let force = simulation_of_force.force(&course.run, &course.motion).unwrap();
        let mut noise = Noise::new(6, 0);
        let mut run = |level_n: f64| {
            let drag_force_n =
                force.iter().zip(&struck).map(|(f, x)| f + 0.1 * x + level_n * noise.gaussian()).collect();
            Run { drag_force_n, ..course.run.clone() }
        };
        let runs = [run(3.0), run(0.05)];
        diagnose(&runs, &[], &simulation, &Options::default()).diagnosis
    };
    let found = with(&rings, struck(&course, rate_hz, 0.02, |_| 47.0, true));
    assert_eq!(ids(&found), ["structural-resonance"], "{:#?}", found.mechanisms);
    // a sweep from 42 to 52 Hz every four seconds
    let found =
        with(&simulation, struck(&course, rate_hz, 0.015, |n| 42.0 + 10.0 * (n as f64 / rate_hz / 4.0).fract(), false));
    assert!(!ids(&found).contains(&"structural-resonance"), "{:#?}", found.mechanisms);
}

/// Derivatives of the motion at the rate of the rows are too noisy, so rows are averaged; ringing is searched for
/// before.
#[test]
fn a_structure_is_heard_between_the_averages_that_a_derived_motion_asks_for() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let rate_hz = 1000.0;
    let course = strokes(rate_hz);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let run = Run { velocity_m_s: None, acceleration_m_s2: None, ..course.run.clone() };
    let found = beside(&force, &struck(&course, rate_hz, 0.02, |_| 47.0, true), &run, &simulation);
    assert_eq!(ids(&found), ["structural-resonance"], "{:#?}", found.mechanisms);
}

#[test]
fn a_structure_is_heard_beside_what_reversals_show_better_and_a_hum_is_none() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let rate_hz = 500.0;
    let course = strokes(rate_hz);
    let late = format!("{AXIS}\n[[mechanism]]\nid = \"force-lowpass\"\ntime_s = 0.004\npart = 1.0\n");
    let force = Simulation::from_toml(&late).unwrap().force(&course.run, &course.motion).unwrap();
    let with = |ringing: &[f64]| beside(&force, ringing, &course.run, &simulation);
    let found = with(&struck(&course, rate_hz, 0.015, |_| 47.0, true));
    assert!(ids(&found).contains(&"structural-resonance"), "{:#?}", found.mechanisms);
    let hum = (0..course.run.len()).map(|n| 0.4 * (std::f64::consts::TAU * 50.0 * n as f64 / rate_hz + 0.3).sin());
    let found = with(&hum.collect::<Vec<f64>>());
    assert!(!ids(&found).contains(&"structural-resonance"), "{:#?}", found.mechanisms);
}

/// A tone within the noise, as of a pump nearby, which the noise filter would take for the colour of the noise.
#[test]
fn a_hum_is_unknown_with_its_frequency_and_no_noise() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    for (rate_hz, hz, size_n) in [(250.0, 50.0, 0.2), (500.0, 50.0, 0.8), (200.0, 7.31, 0.3)] {
        let course = strokes(rate_hz);
        let force = simulation.force(&course.run, &course.motion).unwrap();
        let hum = course.run.time_s.iter().map(|t| size_n * (std::f64::consts::TAU * hz * t + 0.3).sin());
        let found = beside(&force, &hum.collect::<Vec<f64>>(), &course.run, &simulation);
        assert_eq!(ids(&found), ["unknown"], "{hz} Hz");
        let heard_hz = found.regions.iter().find(|region| region.axis == "frequency").map(|region| region.from);
        assert!(heard_hz.is_some_and(|heard| (heard - hz).abs() < 0.01 * hz), "{:?}", found.regions);
        assert!(found.holdout.rmse_after_n < 0.21, "{hz} Hz at {rate_hz} Hz: {:?}", found.holdout);
    }
}

/// Rests between parts turn the spectral line into a comb, and with few rows a period its curve has few places.
#[test]
fn a_hum_goes_on_between_parts() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    for (rate_hz, hz) in [(100.0, 36.1), (200.0, 50.0)] {
        let mut course = strokes(rate_hz);
        let rows = course.run.len();
        let part = |n: usize| 6 * n / rows;
        let bounds = (0..=6).map(|k| (k * rows).div_ceil(6)).collect::<Vec<_>>();
        let starts = |k: usize| if k == 0 { Break::Start } else { Break::Segment };
        let of = |k: usize| Part { rows: bounds[k]..bounds[k + 1], segment: Some(k as i64), starts: starts(k) };
        course.run.parts = (0..6).map(of).collect();
        let force = simulation.force(&course.run, &course.motion).unwrap();
        let rested_s = |n: usize| [0.0, 31.7, 80.2, 140.9, 171.3, 230.6][part(n)];
        course.run.time_s.iter_mut().enumerate().for_each(|(n, t)| *t += rested_s(n));
        let hum = course.run.time_s.iter().map(|t| 0.3 * (std::f64::consts::TAU * hz * t + 0.3).sin());
        let found = beside(&force, &hum.collect::<Vec<f64>>(), &course.run, &simulation);
        assert_eq!(ids(&found), ["unknown"], "{hz} Hz: {:#?} {:?}", found.mechanisms, found.holdout);
        assert!(found.holdout.rmse_after_n < 0.21, "{hz} Hz at {rate_hz} Hz: {:?}", found.holdout);
    }
}

/// 10 mm at 0.1 and 0.3 m/s: the third order at one speed is the first at the other.
#[test]
fn a_ripple_whose_orders_meet_at_few_speeds_is_no_structure() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let staircase = Staircase { speeds_m_s: vec![0.1, 0.3], length_m: 0.4, order: Order::Both, ..Staircase::default() };
    let course = staircase.course(500.0, &Conditions::default()).unwrap();
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let place_m = course.run.position_m.as_ref().unwrap();
    let turn = |x: &f64| std::f64::consts::TAU * x / 0.01;
    // sharp ripple, as of a motor behind a slipping belt
    let ripple = place_m.iter().map(|x| 0.8 * turn(x).sin() / (1.0 - 0.7 * turn(x).cos()));
    let found = beside(&force, &ripple.collect::<Vec<f64>>(), &course.run, &simulation);
    assert!(!ids(&found).contains(&"structural-resonance"), "{:#?}", found.mechanisms);
}

/// A recording whose position and speed an encoder tells that errs by so much once per period.
fn erring(simulation: &Simulation, error_m: f64, period_m: f64) -> Run {
    let course = strokes(1000.0);
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(11, 0);
    let drag_force_n = force.iter().map(|force| force + 0.3 * noise.gaussian()).collect();
    let per_m = std::f64::consts::TAU / period_m;
    let positions = &course.motion.position_m;
    let position_m = positions.iter().map(|x| x + error_m * (per_m * x).sin()).collect();
    let speeds = course.motion.velocity_m_s.iter().zip(positions);
    let velocity_m_s = speeds.map(|(v, x)| v * (1.0 + error_m * per_m * (per_m * x).cos())).collect();
    Run {
        drag_force_n,
        position_m: Some(position_m),
        velocity_m_s: Some(velocity_m_s),
        acceleration_m_s2: None,
        ..course.run
    }
}

/// Of a wave of a millimetre a row takes a part, of one of 20 um several.
#[test]
fn an_encoder_that_errs_is_named_from_the_speed_it_recorded() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    for (error_m, period_m) in [(1e-7, 1e-3), (3e-7, 2e-5)] {
        let found = diagnosis(&erring(&simulation, error_m, period_m), &simulation);
        assert_eq!(ids(&found), ["encoder-cyclic-error"], "{period_m} m");
        let period = found.mechanisms[0].parameters.iter().find(|number| number.name == "period_m").unwrap();
        assert!((period.value / period_m - 1.0).abs() < 1e-3, "{period:?}");
    }
}

/// A strip of an axis that never rests: its structure rings in all rows, ten times as loud as the noise, with the phase
/// of its speed.
#[test]
fn a_structure_that_rings_throughout_is_no_colour_of_the_noise() {
    let simulation = Simulation::from_toml(AXIS).unwrap();
    let form = "\n[[mechanism]]\nid = \"structural-resonance\"\nform = \"turned\"\nfrequency_hz = 47.0\ndamping = 0.04\n\
                mass_kg = 0.0\nturned_kg = 4.0\n";
    let rings = Simulation::from_toml(&format!("{AXIS}{form}")).unwrap();
    let rate_hz = 500.0;
    let mut jolts = Noise::new(12, 0);
    // forth and back at one speed or another, which changes with a jolt every tenth of a second
    let (mut time_s, mut velocity_m_s, mut acceleration_m_s2) = (Vec::new(), Vec::new(), Vec::new());
    let (mut v, mut a) = (0.08, 0.0);
    for row in 0..60_000 {
        if row % 50 == 0 {
            let sign = if (row / 5000) % 2 == 0 { 1.0 } else { -1.0 };
            a = 10.0 * (sign * (0.08 + 0.03 * jolts.gaussian()) - v);
        }
        v += a / rate_hz;
        time_s.push(f64::from(row) / rate_hz);
        velocity_m_s.push(v);
        acceleration_m_s2.push(a);
    }
    let rows = time_s.len();
    let run = Run {
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        drag_force_n: vec![0.0; rows],
        velocity_m_s: Some(velocity_m_s),
        acceleration_m_s2: Some(acceleration_m_s2),
        time_s,
        ..Run::default()
    };
    let force = rings.force(&run, &simulation::motion::Motion::of(&run)).unwrap();
    let mut noise = Noise::new(13, 0);
    let drag_force_n = force.iter().map(|force| force + 0.1 * noise.gaussian()).collect();
    let found = diagnosis(&Run { drag_force_n, ..run }, &simulation);
    assert_eq!(ids(&found), ["structural-resonance"]);
    assert!((found.noise_floor_n - 0.1).abs() < 0.02, "{}", found.noise_floor_n);
}
