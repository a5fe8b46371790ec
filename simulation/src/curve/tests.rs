use super::*;
use crate::Simulation;
use crate::motion::Motion;
use crate::run::{Break, Part, Run};

const LAW: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\n\
                   viscous_n_s_m = 100\noffset_n = 0\n[axis]\nmoved_mass_kg = 0\n";

/// To and fro at speeds that change, with everything measured.
fn run() -> Run {
    let rows = 3000;
    let time_s: Vec<f64> = (0..rows).map(|n| 7.0 + 0.01 * f64::from(n)).collect();
    let column = |of: fn(f64) -> f64| Some(time_s.iter().map(|t| of(*t)).collect::<Vec<f64>>());
    Run {
        drag_force_n: vec![0.0; time_s.len()],
        position_m: column(|t| 0.2 - 0.2 * (t - 7.0).cos()),
        velocity_m_s: column(|t| 0.2 * (t - 7.0).sin()),
        preload_n: column(|t| 2000.0 + 30.0 * t),
        external_load_n: column(|t| 100.0 * (0.3 * t).sin()),
        temperature_block_degc: column(|t| 20.0 + 0.1 * t),
        temperature_rail_degc: column(|t| 20.0 + 0.03 * t),
        parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    }
}

fn added(axis: Axis, carrier: Carrier, knots: &[f64], heights: &[f64]) -> AddedCurve {
    AddedCurve { curve: Curve { axis, carrier, knots: knots.to_vec() }, heights: heights.to_vec() }
}

#[test]
fn heights_are_joined_by_lines_stay_beyond_the_ends_and_take_their_carrier() {
    let (simulation, run) = (Simulation::from_toml(LAW).expect("legal"), run());
    let motion = Motion::of(&run);
    let context = Context::of(&simulation, &run, &motion).expect("complete");
    let force = |carrier| added(Axis::Velocity, carrier, &[0.05, 0.15], &[1.0, 3.0]).force_n(&context).expect("shown");
    let (even, odd, drag) = (force(Carrier::Even), force(Carrier::Odd), force(Carrier::Drag));
    for n in 0..run.len() {
        let speed = motion.velocity_m_s[n].abs();
        let height = 1.0 + 20.0 * (speed.clamp(0.05, 0.15) - 0.05);
        let is = |force: f64, expected: f64| (force - expected).abs() < 1e-12 * (1.0 + expected.abs());
        assert!(is(even[n], height) && is(odd[n], height * context.steady.direction[n]), "{n}");
        assert!(is(drag[n], height * context.steady.direction[n] * (20.0 + 100.0 * speed)), "{n}");
    }
    assert!(context.steady.direction[0] == 0.0 && context.direction[0] == 1.0, "it starts from rest");
    // a clock follows the recording's time modulo its period and closes
    let clock = added(Axis::Clock, Carrier::Even, &[0.0, 1.0, 4.0], &[0.0, 1.0, 0.0]).force_n(&context).expect("shown");
    for (force, t) in clock.iter().zip(&run.time_s) {
        let within = t % 4.0;
        let height = if within < 1.0 { within } else { (4.0 - within) / 3.0 };
        assert!((force - height).abs() < 1e-9, "{t}: {force}");
    }
}

#[test]
fn a_simulation_s_force_has_its_curves_and_a_run_that_does_not_show_one_has_nothing_of_it() {
    let mut simulation = Simulation::from_toml(LAW).expect("legal");
    let bare = Run { temperature_rail_degc: None, external_load_n: None, preload_n: None, ..run() };
    let motion = Motion::of(&bare);
    let law = simulation.force(&bare, &motion).expect("complete");
    let shown = added(Axis::Temperature, Carrier::Even, &[0.0, 100.0], &[0.5, 0.5]);
    simulation.curves = [Axis::TemperatureDifference, Axis::Load, Axis::Preload]
        .map(|axis| added(axis, Carrier::Odd, &[0.0, 9.0], &[1.0, 2.0]))
        .to_vec();
    assert_eq!(simulation.force(&bare, &motion).expect("complete"), law);
    simulation.curves.push(shown);
    let with = simulation.force(&bare, &motion).expect("complete");
    assert!(law.iter().zip(&with).all(|(law, with)| (with - law - 0.5).abs() < 1e-12));
    let context = Context::of(&simulation, &bare, &motion).expect("complete");
    let is_shown: Vec<bool> = simulation.curves.iter().map(|added| added.force_n(&context).is_some()).collect();
    assert_eq!(is_shown, [false, false, false, true]);
    let unmeasured = Run { external_load_n: Some(vec![f64::NAN; bare.len()]), ..bare.clone() };
    let context = Context::of(&simulation, &unmeasured, &motion).expect("complete");
    assert_eq!(simulation.curves[1].force_n(&context), None);
}

#[test]
fn what_no_file_can_hold_is_not_sound() {
    let is_sound = |axis, knots: &[f64], heights: &[f64]| added(axis, Carrier::Odd, knots, heights).is_sound();
    assert!(is_sound(Axis::Position, &[-1.0, 1.0], &[0.0, 1.0]));
    assert!(is_sound(Axis::Clock, &[0.0, 1.0, 2.0], &[1.0, 3.0, 1.0]));
    for (axis, knots, heights) in [
        (Axis::Position, &[0.0][..], &[0.0][..]),
        (Axis::Position, &[0.0, 1.0], &[0.0]),
        (Axis::Position, &[0.0, 0.0], &[0.0, 1.0]),
        (Axis::Position, &[0.0, f64::NAN], &[0.0, 1.0]),
        (Axis::Position, &[0.0, 1.0], &[0.0, f64::INFINITY]),
        (Axis::Velocity, &[-1.0, 1.0], &[0.0, 1.0]),
        (Axis::Direction, &[-1.0, 2.0], &[0.0, 1.0]),
        (Axis::Clock, &[1.0, 2.0, 3.0], &[1.0, 3.0, 1.0]),
        (Axis::Clock, &[0.0, 1.0, 2.0], &[1.0, 3.0, 2.0]),
        (Axis::Clock, &[0.0, 1.0], &[1.0, 1.0]),
    ] {
        assert!(!is_sound(axis, knots, heights), "{axis:?} {knots:?} {heights:?}");
    }
}
