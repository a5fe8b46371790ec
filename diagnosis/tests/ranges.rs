//! A number that a simulation file leaves out has a range; no cause may win by driving it out of that range.
#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use diagnosis::report::Verdict;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::file::Law;
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

const AXIS: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n";

const RATE_HZ: f64 = 200.0;

/// Smooth strokes at seven speeds and of different lengths, driven against a friction and a mass.
fn recorded(friction_n: impl Fn(f64) -> f64, mass_kg: f64, noise_n: f64) -> Run {
    let strokes = (0..24).map(|k| (600 + (k * 377) % 800, [0.02, 0.2, 0.005, 0.1, 0.05, 0.15, 0.01][k % 7]));
    let (mut velocity, mut acceleration): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for (rows, speed) in strokes {
        let turn = std::f64::consts::TAU / rows as f64;
        velocity.extend((0..rows).map(|n| speed * (turn * n as f64).sin()));
        acceleration.extend((0..rows).map(|n| speed * turn * RATE_HZ * (turn * n as f64).cos()));
    }
    let rows = velocity.len();
    let mut noise = Noise::new(5, 0);
    let mut at = 0.3;
    let position = velocity.iter().map(|v| {
        at += v / RATE_HZ;
        at
    });
    Run {
        position_m: Some(position.collect()),
        time_s: (0..rows).map(|n| n as f64 / RATE_HZ).collect(),
        drag_force_n: (0..rows)
            .map(|n| friction_n(velocity[n]) + mass_kg * acceleration[n] + noise_n * noise.gaussian())
            .collect(),
        velocity_m_s: Some(velocity),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        ..Run::default()
    }
}

/// Friction that rises from almost 0 along an inverted bell: a hump that falls with speed fits it only on top of a
/// Coulomb force of -20 N.
#[test]
fn a_coulomb_force_is_not_driven_below_nothing() {
    let friction_n = |v: f64| v.signum() * (1.0 + 20.0 * (1.0 - (-(v / 0.12).powi(2)).exp()));
    let run = recorded(friction_n, 20.0, 0.05);
    let outcome = diagnose(&[run], &[], &Simulation::from_toml(AXIS).expect("a sound file"), &Options::default());
    let found = &outcome.diagnosis;
    assert_ne!(found.verdict, Verdict::Match);
    assert!(found.mechanisms.iter().all(|named| named.id != "stribeck"), "{:#?}", found.mechanisms);
    assert!(found.holdout.rmse_after_n < found.holdout.rmse_calibrated_n, "{:?}", found.holdout);
    let Some(Law::CoulombViscous { coulomb_n: Some(coulomb_n), .. }) = outcome.augmented.map(|file| file.law) else {
        panic!("a law with all of its numbers");
    };
    assert!(coulomb_n >= 0.0, "{coulomb_n} N");
}
