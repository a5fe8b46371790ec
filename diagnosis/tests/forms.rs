//! Causes that act otherwise than in their first form: each written here from its own formula.
#![allow(clippy::expect_used, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod common;

use diagnosis::report::Diagnosis;
use diagnosis::{Options, diagnose};
use simulation::profile::{Conditions, Course, Order, Staircase};
use simulation::run::Run;

use crate::common::{USUAL, ids, outcome, recorded, simulation};

const PRELOAD_N: f64 = 3000.0;

/// Strokes at four speeds under a load, N.
fn under(load_n: f64) -> Course {
    let conditions = Conditions { external_load_n: Some(load_n), ..USUAL };
    let speeds_m_s = vec![0.01, 0.03, 0.06, 0.1];
    let strokes = Staircase { speeds_m_s, length_m: 0.15, order: Order::Both, ..Staircase::default() };
    strokes.course(200.0, &conditions).unwrap()
}

/// Recordings under loads of both signs, with a braking force of load and law, N.
fn loaded(brake: impl Fn(f64, f64) -> f64) -> Diagnosis {
    let simulation = simulation("");
    let run = |load_n: f64| {
        let course = under(load_n);
        let law_n = simulation.force(&course.run, &course.motion).unwrap();
        let rows: Vec<(f64, f64)> = course.run.time_s.iter().copied().zip(law_n).collect();
        let at = |t: f64| rows[rows.partition_point(|(time, _)| *time < t)].1.abs();
        recorded(&simulation, course, |t, _, _| brake(load_n, at(t)))
    };
    let runs: Vec<Run> = [0.0, 1500.0, -3000.0, 4500.0].map(run).into();
    diagnose(&runs, &[], &simulation, &Options::default()).diagnosis
}

/// A load that is carried by contacts of its own: 1 N of drag per kN.
#[test]
fn a_load_may_drag_by_itself() {
    let found = loaded(|load_n, _| 1e-3 * load_n.abs());
    assert_eq!(ids(&found), ["external-load"]);
    let drag = &found.mechanisms[0].parameters[0];
    assert_eq!(drag.name, "drag_per_kn_n");
    assert!(drag.ci95[0] < 1.0 && 1.0 < drag.ci95[1], "{drag:?}");
}

/// The sum of the balls' loads alone, as E13 has it: one row has the approach D (1 + t), the other D (1 - t),
///
/// ```text
/// (1 + t)^1.5 - (1 - t)^1.5 = W/F_p,   drag x ((1 + t)^1.5 + (1 - t)^1.5)/2
/// ```
#[test]
fn a_load_may_act_through_the_sum_of_the_balls_loads_alone() {
    let carried = |load_n: f64| {
        let (mut least, mut most) = (0.0, 1.0);
        for _ in 0..50 {
            let t: f64 = 0.5 * (least + most);
            let is_more = (1.0 + t).powf(1.5) - (1.0 - t).powf(1.5) > load_n.abs() / PRELOAD_N;
            (least, most) = if is_more { (least, t) } else { (t, most) };
        }
        0.5 * ((1.0 + least).powf(1.5) + (1.0 - least).powf(1.5))
    };
    assert!((carried(PRELOAD_N) - 1.042).abs() < 1e-3 && (carried(0.5 * PRELOAD_N) - 1.011).abs() < 1e-3);
    let found = loaded(|load_n, law_n| law_n * (carried(load_n) - 1.0));
    assert_eq!(ids(&found), ["external-load"]);
    let part = &found.mechanisms[0].parameters[0];
    assert!(part.ci95[0] < 1.0 && 1.0 < part.ci95[1], "{part:?}");
}

/// Oil that flows back while it is used up: what is missing settles with time, towards more at higher speed, and fills up
/// in a rest.
#[test]
fn a_film_may_starve_with_time_and_not_with_travel() {
    let speeds_m_s = vec![0.05, 0.4, 0.1, 0.6];
    let staircase = Staircase { speeds_m_s, length_m: 0.5, strokes: 6, pause_s: 1.0, ..Staircase::default() };
    let course = staircase.course(200.0, &USUAL).unwrap();
    let simulation = simulation("");
    let law_n = simulation.force(&course.run, &course.motion).unwrap();
    let mut missing = 0.0;
    let starved: Vec<f64> = course
        .motion
        .velocity_m_s
        .iter()
        .zip(&law_n)
        .map(|(v, law_n)| {
            let (towards, within_s) = if *v == 0.0 { (0.0, 6.0) } else { (v.abs() / (v.abs() + 0.3), 10.0) };
            missing += (towards - missing) * (1.0 / 200.0) / within_s;
            0.3 * missing * law_n.abs()
        })
        .collect();
    let row = |t: f64| ((200.0 * t).round() as usize).min(starved.len() - 1);
    let found = outcome(&recorded(&simulation, course, |t, _, _| starved[row(t)]), &simulation).diagnosis;
    assert_eq!(ids(&found), ["starvation"]);
}
