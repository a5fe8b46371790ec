//! A guide, a recording of it beside which something may act, and its diagnosis.
#![allow(dead_code, reason = "each file of tests uses some of it")]

use diagnosis::report::Diagnosis;
use diagnosis::{Options, Outcome, diagnose};
use simulation::Simulation;
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::Run;
use simulation::sensor::Noise;

pub(crate) const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                     viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

pub(crate) const USUAL: Conditions =
    Conditions { preload_n: Some(3000.0), temperature_degc: Some(40.0), external_load_n: None };

/// White noise of the force, N.
pub(crate) const NOISE_N: f64 = 0.3;

/// More than a minute of strokes at eight speeds, at 200 Hz.
pub(crate) fn strokes() -> Course {
    let speeds_m_s = vec![0.003, 0.006, 0.012, 0.025, 0.04, 0.06, 0.08, 0.1];
    Staircase { speeds_m_s, length_m: 0.15, order: Order::Both, ..Staircase::default() }.course(200.0, &USUAL).unwrap()
}

pub(crate) fn simulation(more: &str) -> Simulation {
    Simulation::from_toml(&format!("{GUIDE}{more}")).unwrap()
}

/// The law's force with noise plus a force against the motion, N: `brake` of time, speed and travel.
pub(crate) fn recorded(simulation: &Simulation, course: Course, brake: impl Fn(f64, f64, f64) -> f64) -> Run {
    let force = simulation.force(&course.run, &course.motion).unwrap();
    let mut noise = Noise::new(7, 0);
    let (mut travel_m, mut before) = (0.0, course.motion.position_m[0]);
    let mut drag_force_n = Vec::new();
    for (n, force) in force.iter().enumerate() {
        let (x, v) = (course.motion.position_m[n], course.motion.velocity_m_s[n]);
        travel_m += (x - before).abs();
        before = x;
        let braked = if v == 0.0 { 0.0 } else { v.signum() * brake(course.run.time_s[n], v.abs(), travel_m) };
        drag_force_n.push(force + braked + NOISE_N * noise.gaussian());
    }
    Run { drag_force_n, ..course.run }
}

pub(crate) fn nothing(_: f64, _: f64, _: f64) -> f64 {
    0.0
}

pub(crate) fn outcome(run: &Run, simulation: &Simulation) -> Outcome {
    diagnose(std::slice::from_ref(run), &[], simulation, &Options::default())
}

pub(crate) fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.mechanisms.iter().map(|found| found.id.as_str()).collect()
}

/// The only number of the only finding.
pub(crate) fn number(diagnosis: &Diagnosis) -> f64 {
    let [found] = diagnosis.mechanisms.as_slice() else { panic!("{:#?}", diagnosis.mechanisms) };
    let [number] = found.parameters.as_slice() else { panic!("{found:#?}") };
    assert!(number.ci95[0] < number.value && number.value < number.ci95[1], "{number:?}");
    number.value
}
