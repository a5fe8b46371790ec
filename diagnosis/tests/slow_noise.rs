//! Slow noise in one recording with rests is no cause.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use diagnosis::report::Verdict;
use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

const GUIDE: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                     viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

const RATE_HZ: f64 = 100.0;

/// Four minutes of strokes with rests of 0.3 to 2 s, as a machine logs them, with noise of 1 % that has the same power
/// in every octave.
fn recorded(simulation: &Simulation, seed: u64) -> Run {
    let mut noise = Noise::new(seed, 0);
    let (rows, mut at) = (24_000, 0.1);
    let mut position_m = Vec::with_capacity(rows);
    while position_m.len() < rows {
        let (to, speed) = (0.05 + 1.1 * noise.even(), 10f64.powf(-1.8 + 1.6 * noise.even()));
        let length = (1.875 * (to - at).abs() / speed * RATE_HZ).max(30.0) as usize;
        let way = |s: f64| s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
        position_m.extend((1..=length).map(|n| at + (to - at) * way(n as f64 / length as f64)));
        at = to;
        position_m.resize(position_m.len() + ((0.3 + 1.7 * noise.even()) * RATE_HZ) as usize, at);
    }
    position_m.truncate(rows);
    let run = Run {
        time_s: (0..rows).map(|n| n as f64 / RATE_HZ).collect(),
        drag_force_n: vec![0.0; rows],
        position_m: Some(position_m),
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        ..Run::default()
    };
    let force = simulation.force(&run, &Motion::of(&run)).expect("a complete run");
    let told = || force.iter().filter(|force| force.is_finite());
    let size_n = (told().map(|force| force * force).sum::<f64>() / told().count() as f64).sqrt();
    let mut octaves: Vec<(f64, f64)> =
        (0..16).map(|octave| ((-1.0 / f64::from(1u32 << octave)).exp(), noise.gaussian())).collect();
    let mut wandering = || {
        for (memory, state) in &mut octaves {
            *state = *memory * *state + (1.0 - *memory * *memory).sqrt() * noise.gaussian();
        }
        octaves.iter().map(|(_, state)| state).sum::<f64>() / 4.0
    };
    let held = |force: &f64| if force.is_finite() { *force } else { 0.0 };
    let drag_force_n = force.iter().map(|force| held(force) + 0.01 * size_n * wandering()).collect();
    Run { drag_force_n, ..run }
}

#[test]
fn noise_that_wanders_through_rests_is_no_curve_over_time() {
    let simulation = Simulation::from_toml(GUIDE).expect("a sound file");
    for seed in 1..=6 {
        let outcome = diagnose(&[recorded(&simulation, seed)], &[], &simulation, &Options::default());
        let found = &outcome.diagnosis;
        assert_eq!(found.verdict, Verdict::Match, "seed {seed}: {:#?}", found.mechanisms);
    }
}
