//! A ripple of the drive: in correlated noise, beside effects that are smooth along the stroke, and in another
//! recording.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::Diagnosis;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::Run;
use simulation::sensor::Noise;

const AXIS: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20.0\n\
                    viscous_n_s_m = 200.0\noffset_n = 0.0\n[tolerance]\nfriction = 0.03\n[axis]\nmoved_mass_kg = 0.0\n";

/// Period of the drive, m.
const LEAD_M: f64 = 0.01;

fn simulation(position_reference: &str) -> Simulation {
    Simulation::from_toml(&format!("{AXIS}position_reference = \"{position_reference}\"\n")).unwrap()
}

/// Strokes to and fro at these speeds, at 200 Hz.
fn strokes(speeds_m_s: &[f64]) -> Course {
    let staircase =
        Staircase { speeds_m_s: speeds_m_s.to_vec(), length_m: 0.3, order: Order::Both, ..Staircase::default() };
    staircase.course(200.0, &Conditions::default()).unwrap()
}

/// Ripple of three orders, N: `sizes` are their amplitudes, `from_m` is its origin.
fn ripple(x: f64, from_m: f64, sizes: [f64; 3]) -> f64 {
    let angle = std::f64::consts::TAU * (x - from_m) / LEAD_M;
    (1..).zip(sizes).map(|(order, size)| size * (f64::from(order) * angle + f64::from(order)).sin()).sum()
}

/// The law's force, `more` of the place, N, and AR(1) noise of this RMS, N, with the coefficient `memory`.
fn recorded(course: &Course, more: impl Fn(f64) -> f64, noise_n: f64, memory: f64) -> Run {
    let force = simulation("absolute").force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(21, 0);
    let (mut slow, fresh) = (0.0, noise_n * (1.0 - memory * memory).sqrt());
    let disturbed = |(force, x): (&f64, &f64)| {
        slow = memory * slow + fresh * noise.gaussian();
        force + more(*x) + slow
    };
    Run { drag_force_n: force.iter().zip(&course.motion.position_m).map(disturbed).collect(), ..course.run.clone() }
}

fn diagnosis(run: &Run, holdout: &[Run], simulation: &Simulation) -> Diagnosis {
    diagnose(std::slice::from_ref(run), holdout, simulation, &Options::default()).diagnosis
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.mechanisms.iter().map(|found| found.id.as_str()).collect()
}

#[test]
fn at_one_speed_a_ripple_is_no_colour_of_the_noise() {
    let course = strokes(&[0.06; 8]);
    let run = recorded(&course, |x| ripple(x, 0.0, [0.2, 0.08, 0.05]), 0.4, 0.95);
    let found = diagnosis(&run, &[], &simulation("absolute"));
    assert_eq!(ids(&found), ["drive-ripple"], "{found:?}");
    let lead = found.mechanisms[0].parameters.iter().find(|number| number.name == "wavelength_m").unwrap();
    assert!((lead.value / LEAD_M - 1.0).abs() < 1e-3, "{lead:?}");
    // the noise alone is no ripple
    assert_eq!(ids(&diagnosis(&recorded(&course, |_| 0.0, 0.4, 0.95), &[], &simulation("absolute"))), [""; 0]);
}

/// Three speeds make three frequencies of it, which a filter would remove from the noise.
#[test]
fn a_bolt_pattern_many_times_as_loud_as_the_noise_is_no_colour_of_it() {
    let staircase =
        Staircase { speeds_m_s: vec![0.05, 0.1, 0.3], length_m: 1.2, order: Order::Both, ..Staircase::default() };
    let course = staircase.course(200.0, &Conditions::default()).unwrap();
    let bolts = |x: f64| 0.06 * (std::f64::consts::TAU * x / 0.08).sin();
    // tighter groove, more friction
    let force = simulation("absolute").force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(21, 0);
    let drags = |(force, x): (&f64, &f64)| force * (1.0 + bolts(*x)) + 0.05 * noise.gaussian();
    let drag_force_n = force.iter().zip(&course.motion.position_m).map(drags).collect();
    let run = Run { drag_force_n, ..course.run };
    let found = diagnosis(&run, &[], &simulation("absolute"));
    assert_eq!(ids(&found), ["rail-straightness"]);
    assert!(found.noise_floor_n < 0.06, "{}", found.noise_floor_n);
}

#[test]
fn a_chain_is_named_beside_a_ripple_of_many_times_its_evidence() {
    let course = strokes(&[0.02, 0.04, 0.06, 0.1]);
    let more = |x: f64| ripple(x, 0.0, [4.5, 1.5, 0.0]) + 5.0 * x;
    let found = diagnosis(&recorded(&course, more, 0.4, 0.98), &[], &simulation("absolute"));
    assert_eq!(ids(&found), ["drive-ripple", "cable-chain"]);
}

#[test]
fn a_ripple_says_nothing_of_a_recording_whose_places_have_another_zero() {
    // over short strokes within one wave its mean is not 0
    let staircase = Staircase { speeds_m_s: vec![0.001, 0.002], length_m: 0.004, ..Staircase::default() };
    let short = staircase.course(200.0, &Conditions::default()).unwrap();
    let other = recorded(&short, |x| ripple(x, 0.0043, [2.0, 0.5, 0.2]), 0.2, 0.0);
    let course = strokes(&[0.02, 0.04, 0.06, 0.1]);
    let run = recorded(&course, |x| ripple(x, 0.0, [2.0, 0.5, 0.2]), 0.2, 0.0);
    let found = diagnosis(&run, std::slice::from_ref(&other), &simulation("relative"));
    assert_eq!(ids(&found), ["drive-ripple"]);
    let held = &found.holdout;
    assert!((held.rmse_after_n / held.rmse_calibrated_n - 1.0).abs() < 1e-3, "{held:?}");
}
