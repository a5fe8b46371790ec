//! How long the columns of every mechanism take over one run: what a search over the library is made of.
//!
//! `cargo bench -p simulation --bench mechanisms`
#![allow(clippy::expect_used, reason = "a bench that cannot run ends with the reason")]

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;

use simulation::Simulation;
use simulation::mechanism::{Context, Form, library};
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};

/// Two minutes at 600 Hz.
const ROWS: usize = 72_000;

/// A law is timed so often, and its best time counts.
const REPEATS: usize = 20;

/// Places in the range of every shape parameter; the first at which the run shows a mechanism is timed.
const SHARES: [f64; 7] = [0.5, 0.4, 0.6, 0.3, 0.7, 0.1, 0.9];

/// Laws that know much and little: a guide whose oil thins, and an axis without any preload.
const LAWS: [(&str, &str); 2] = [
    ("zhou-2023", "[guide]\n[operation]\npreload_n = 3000\n[axis]\nmoved_mass_kg = 5"),
    (
        "coulomb-viscous",
        "[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\nviscous_n_s_m = 100\noffset_n = 0\n[axis]\nmoved_mass_kg = 0",
    ),
];

fn main() {
    let run = run();
    let motion = Motion::of(&run);
    println!("columns of the minimal form of every mechanism, {ROWS} rows, one core, best of {REPEATS}");
    for (name, text) in LAWS {
        let simulation =
            Simulation::from_toml(&format!("schema = \"guideblock.simulation/1\"\n{text}")).expect("a legal file");
        let context = Context::of(&simulation, &run, &motion).expect("a complete run");
        println!("{name}");
        let prepared = best_ms(|| Context::of(&simulation, &run, &motion).map(|c| c.len()).ok());
        println!("  {:24}         {prepared:7.3} ms", "what all depend on");
        let mut sum = 0.0;
        for definition in library() {
            let Some(form) = definition.forms.first() else { continue };
            let shows =
                |share: &f64| (form.columns)(&context, &at(form, *share)).map(|columns| (*share, columns.len()));
            let (share, columns) = SHARES.iter().find_map(shows).unwrap_or((SHARES[0], 0));
            let shape = at(form, share);
            let took = best_ms(|| (form.columns)(&context, black_box(&shape)));
            sum += took;
            let shown = if columns == 0 { "not shown".to_owned() } else { format!("{columns} x") };
            println!("  {:22} {shown:>9} {took:8.3} ms", definition.id.name());
        }
        println!("  {:24}         {sum:7.3} ms", "all");
    }
}

/// Least time of a call, ms.
fn best_ms<T>(call: impl Fn() -> T) -> f64 {
    let time = |_| {
        let start = Instant::now();
        black_box(call());
        1e3 * start.elapsed().as_secs_f64()
    };
    (0..REPEATS).map(time).fold(f64::INFINITY, f64::min)
}

/// Shape parameters at a share of their ranges.
fn at(form: &Form, share: f64) -> Vec<f64> {
    form.shape.iter().map(|parameter| parameter.at(share)).collect()
}

/// Rests, reversals and strokes of 0.02 to 0.6 m/s, with every column that a mechanism asks for.
fn run() -> Run {
    let step_s = 120.0 / ROWS as f64;
    let column = |of: &dyn Fn(f64) -> f64| (0..ROWS).map(|n| of(n as f64 * step_s)).collect::<Vec<f64>>();
    let velocity = column(&|t| {
        let speed = 0.02 + 0.58 * t / 120.0;
        if t % 10.0 < 2.0 { 0.0 } else { speed * (PI * t).sin() }
    });
    let place = |x: &mut f64, v: &f64| {
        *x += v * step_s;
        Some(*x)
    };
    Run {
        name: "bench".to_owned(),
        time_s: column(&|t| t),
        // a channel with steps of 0.25 N and an end
        drag_force_n: (0..ROWS).map(|n| 0.25 * (n % 40) as f64).collect(),
        position_m: Some(velocity.iter().scan(0.4, place).collect()),
        velocity_m_s: Some(velocity),
        preload_n: Some(column(&|t| 3000.0 + 500.0 * (0.1 * t).sin())),
        external_load_n: Some(column(&|t| 4000.0 * (0.05 * t).sin())),
        temperature_block_degc: Some(column(&|t| 22.0 + 0.1 * t)),
        temperature_rail_degc: Some(column(&|t| 21.0 + 0.02 * t)),
        temperature_ambient_degc: Some(column(&|_| 20.0)),
        parts: vec![Part { rows: 0..ROWS, segment: None, starts: Break::Start }],
        ..Run::default()
    }
}
