use std::time::Instant;

use super::*;
use crate::run::{Break, Part};

/// A run of `rows` rows at 1 kHz between -0.1 and 0.1 m/s.
fn run(rows: usize) -> Run {
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * 1e-3).collect();
    Run {
        velocity_m_s: Some(time_s.iter().map(|t| 0.1 * libm::sin(*t)).collect()),
        drag_force_n: vec![0.0; rows],
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    }
}

fn with(run: &Run, preload: impl Fn(f64) -> f64, temperature: impl Fn(f64) -> f64) -> Run {
    Run {
        preload_n: Some(run.time_s.iter().map(|t| preload(*t)).collect()),
        temperature_block_degc: Some(run.time_s.iter().map(|t| temperature(*t)).collect()),
        ..run.clone()
    }
}

fn simulation(text: &str) -> Simulation {
    Simulation::from_toml(&format!("schema = \"guideblock.simulation/1\"\n{text}")).expect(text)
}

fn steady(simulation: &Simulation, run: &Run) -> Result<Steady, Missing> {
    simulation.steady(&Factors::default(), run, &Motion::of(run))
}

#[test]
fn rows_are_the_exact_model_to_1e_9() {
    for text in
        ["[guide]", "[guide]\nhersey = \"carriage\"\ncontact_angle_mode = \"fixed\"", "[lubricant]\nviscosity_cst = 68"]
    {
        let simulation = simulation(text);
        let Law::Guide(set) = &simulation.law else { panic!("{text}") };
        for rows in [500, 20_000] {
            // from light to heavy preload, cold to warm, with rows that were not measured
            let preload = |t: f64| {
                if ((t * 1e3) as usize).is_multiple_of(97) { f64::NAN } else { 20.0 + 9000.0 * libm::sin(t).abs() }
            };
            let run = with(&run(rows), preload, |t| 30.0 + 20.0 * libm::cos(0.3 * t));
            let (motion, got) = (Motion::of(&run), steady(&simulation, &run).expect("complete"));
            let mut compared = 0;
            for n in 0..rows {
                let p = run.preload_n.as_ref().expect("set")[n];
                if p.is_nan() {
                    assert!(got.force_n[n].is_nan() || got.direction[n] == 0.0);
                    continue;
                }
                let nu = match set.lubricant() {
                    crate::guide::Lubricant::Constant(nu) => nu,
                    crate::guide::Lubricant::Walther(oil) => {
                        oil.viscosity_cst(run.temperature_block_degc.as_ref().expect("set")[n])
                    }
                };
                let q = set.exact().load_of_preload(p).expect("within the geometry");
                let v = motion.velocity_m_s[n];
                let want = set.exact().drag_force_n(q, nu * set.hersey_scale(), v);
                let h = set.exact().hersey(q, nu * set.hersey_scale(), v);
                assert!((got.drag_n[n] / want - 1.0).abs() < 1e-9, "{n}: {} {want}", got.drag_n[n]);
                assert!((got.load_per_ball_n[n] / q - 1.0).abs() < 1e-9);
                assert!((got.viscosity_cst[n] / nu - 1.0).abs() < 1e-9);
                assert!((got.hersey[n] - h).abs() <= 1e-9 * h);
                let sign = if v.abs() < 3e-5 { 0.0 } else { v.signum() };
                assert_eq!(got.direction[n], sign);
                assert_eq!(got.force_n[n], sign * got.drag_n[n]);
                compared += 1;
            }
            assert!(compared > rows / 2);
        }
    }
}

#[test]
fn factors_scale_what_they_name() {
    let simulation =
        simulation("[lubricant]\nviscosity_cst = 100\n[operation]\npreload_n = 3000\n[axis]\nmoved_mass_kg = 2");
    let run = run(5000);
    let motion = Motion::of(&run);
    let of = |factors: Factors| simulation.steady(&factors, &run, &motion).expect("complete");
    let one = Factors::default();
    let base = of(one);
    let n = 1200;
    assert!((of(Factors { friction: 1.1, ..one }).drag_n[n] / base.drag_n[n] - 1.1).abs() < 1e-12);
    assert_eq!(of(Factors { viscosity: 2.0, ..one }).viscosity_cst[n], 200.0);
    assert_eq!(of(Factors { preload: 0.5, ..one }).preload_n[n], 1500.0);
    let heavier = of(Factors { mass: 3.0, ..one });
    assert!((heavier.force_n[n] - base.force_n[n] - 4.0 * motion.acceleration_m_s2[n]).abs() < 1e-9);
    // the three terms add up to the whole friction
    let term = |factors: Factors| of(factors).drag_n[n] - base.drag_n[n];
    let sum = term(Factors { mu_coulomb: 2.0, ..one })
        + term(Factors { mu_viscous: 2.0, ..one })
        + term(Factors { mu_stribeck: 2.0, ..one });
    assert!((sum / base.drag_n[n] - 1.0).abs() < 1e-12);
}

#[test]
fn coulomb_and_viscous_friction_need_all_their_numbers() {
    let run = run(1000);
    let text = "[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\nviscous_n_s_m = 200\noffset_n = -3\n[axis]\n";
    assert_eq!(steady(&simulation(text), &run), Err(Missing::NotFitted("axis.moved_mass_kg")));
    let whole = simulation(&format!("{text}moved_mass_kg = 95"));
    let (motion, got) = (Motion::of(&run), steady(&whole, &run).expect("complete"));
    for n in [0, 400, 999] {
        let (v, a) = (motion.velocity_m_s[n], motion.acceleration_m_s2[n]);
        let friction = if v == 0.0 { 0.0 } else { v.signum() * 20.0 + 200.0 * v };
        assert!((got.force_n[n] - (friction - 3.0 + 95.0 * a)).abs() < 1e-9, "{n}");
    }
    assert!(got.preload_n.is_empty() && got.hersey.is_empty());
    let open = simulation("[guide]\nlaw = \"coulomb-viscous\"");
    assert_eq!(steady(&open, &run), Err(Missing::NotFitted("guide.coulomb_n")));
}

#[test]
fn what_is_missing_is_named() {
    let bare = run(300);
    assert_eq!(steady(&simulation("[guide]"), &bare), Err(Missing::Preload));
    assert_eq!(steady(&simulation("[operation]\npreload_n = 3000"), &bare), Err(Missing::Temperature));
    // a column without a value is no column
    let empty = with(&bare, |_| f64::NAN, |_| f64::NAN);
    assert_eq!(steady(&simulation("[guide]"), &empty), Err(Missing::Preload));
    assert_eq!(steady(&simulation(""), &bare), Err(Missing::SimulatedForce));
    let column = Run { simulated_force_n: Some(vec![-2.0; 300]), ..bare };
    let got = simulation("").steady(&Factors { friction: 1.5, ..Factors::default() }, &column, &Motion::of(&column));
    assert_eq!(got.expect("complete").force_n[200], -3.0);
}

/// A lag of the friction, or what grows over a rest, begins from the friction that the carriage had, not from none.
#[test]
fn friction_of_a_column_is_held_while_the_carriage_rests() {
    let speed = |n: usize| if (50..100).contains(&n) || (200..250).contains(&n) { -0.1 } else { 0.0 };
    let column = Run {
        velocity_m_s: Some((0..300).map(speed).collect()),
        simulated_force_n: Some((0..300).map(|n| if speed(n) < 0.0 { -2.0 - 0.01 * n as f64 } else { 0.0 }).collect()),
        ..run(300)
    };
    let got = steady(&simulation(""), &column).expect("complete");
    let drag_n = [0, 60, 150, 220, 299].map(|n| got.drag_n[n]);
    assert_eq!(drag_n, [2.5, 2.6, 2.99, 4.2, 4.49]);
    assert_eq!([got.force_n[0], got.force_n[150]], [0.0, 0.0]);
}

#[test]
fn no_preload_makes_no_drag_and_too_much_has_no_value() {
    let run = with(&run(400), |t| if t < 0.2 { 0.0 } else { 1e6 }, |_| 40.0);
    let got = steady(&simulation("[guide]"), &run).expect("complete");
    assert_eq!(got.drag_n[100], 0.0);
    assert!(got.force_n[300].is_nan());
}

/// Run with `--ignored --nocapture` on the desk: 3.6 million rows, preload and temperature measured.
#[test]
#[ignore = "a measurement"]
fn time_of_an_hour_at_one_kilohertz() {
    let run = with(&run(3_600_000), |t| 3000.0 + 10.0 * libm::sin(1e3 * t), |t| 30.0 + 0.002 * t);
    let motion = Motion::of(&run);
    let constant = simulation("[lubricant]\nviscosity_cst = 100\n[operation]\npreload_n = 3000");
    let bare = Run { preload_n: None, ..run.clone() };
    for (what, simulation, run) in [("measured", &simulation("[guide]"), &run), ("constant", &constant, &bare)] {
        let start = Instant::now();
        let got = simulation.steady(&Factors::default(), run, &motion).expect("complete");
        println!("{what}: {:?}, {} rows", start.elapsed(), got.force_n.len());
    }
}
