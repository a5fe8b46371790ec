//! How long a diagnosis takes over the number of rows: with nothing missing, and with a seal that the simulation lacks.
//!
//! `cargo bench -p diagnosis --bench rows`
#![allow(clippy::expect_used, reason = "a bench that cannot run ends with the reason")]

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

use diagnosis::{Options, diagnose};
use simulation::Simulation;
use simulation::law::Factors;
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};

/// Rows of all runs together: 72 000 are 12 runs of 30 s at 200 Hz, 3.6 million ten minutes more than 50 of those.
const ROWS: [usize; 7] = [18_000, 36_000, 72_000, 144_000, 360_000, 1_200_000, 3_600_000];

/// Rows of one part: 30 s.
const PART: usize = 6000;

/// Time between two rows, s.
const STEP_S: f64 = 0.005;

/// A diagnosis of few rows is timed so often, and its best time counts.
const REPEATS: usize = 3;

const SIMULATION: &str =
    "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[operation]\npreload_n = 3000\n";

fn main() {
    let simulation = Simulation::from_toml(SIMULATION).expect("a legal file");
    println!("{:>9}  {:>20}  {:>20}", "rows", "nothing missing, s", "a seal missing, s");
    for rows in ROWS {
        let times = [0.0, 1.0].map(|seal_n| {
            let run = [run(rows, &simulation, seal_n)];
            best_s(if rows > 200_000 { 1 } else { REPEATS }, || diagnose(&run, &[], &simulation, &Options::default()))
        });
        println!("{rows:>9}  {:>20.2}  {:>20.2}", times[0], times[1]);
    }
}

/// Strokes at another speed in every part, 1 % noise.
fn run(rows: usize, simulation: &Simulation, seal_n: f64) -> Run {
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * STEP_S).collect();
    let position = |t: f64| {
        let part = (t / STEP_S) as usize / PART;
        let strokes_per_s = 0.03 * (1 + part % 6) as f64;
        0.3 - 0.3 * (2.0 * PI * strokes_per_s * t).cos()
    };
    let parts = (0..rows).step_by(PART);
    let part = |start: usize| Part {
        rows: start..(start + PART).min(rows),
        segment: Some((start / PART) as i64),
        starts: if start == 0 { Break::Start } else { Break::Segment },
    };
    let mut run = Run {
        position_m: Some(time_s.iter().map(|t| position(*t)).collect()),
        preload_n: Some((0..rows).map(|n| 2000.0 + 500.0 * (n / PART % 5) as f64).collect()),
        temperature_block_degc: Some(vec![30.0; rows]),
        drag_force_n: vec![0.0; rows],
        parts: parts.map(part).collect(),
        time_s,
        ..Run::default()
    };
    let motion = Motion::of(&run);
    let steady = simulation.steady(&Factors::default(), &run, &motion).expect("a complete run");
    let mut noise = Noise(7);
    run.drag_force_n = steady
        .force_n
        .iter()
        .zip(&steady.direction)
        .map(|(force, sign)| if force.is_finite() { force + sign * seal_n } else { 0.0 } + 0.2 * noise.next())
        .collect();
    run
}

fn best_s<T>(repeats: usize, mut of: impl FnMut() -> T) -> f64 {
    let time = |_| {
        let started = Instant::now();
        black_box(of());
        started.elapsed().as_secs_f64()
    };
    (0..repeats).map(time).fold(f64::INFINITY, f64::min)
}

/// Nearly normal numbers: sums of twelve.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut draw = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| draw()).sum::<f64>() - 6.0
    }
}
