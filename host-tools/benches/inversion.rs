//! How many preloads a second one core inverts, against a vectorised Newton solver in numpy in the same run, and how
//! exact both are.
//!
//! `cargo bench -p host-tools --bench inversion`
#![allow(clippy::expect_used, reason = "a bench that cannot run ends with the reason")]

use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use host_tools::batch;
use model_core::exact::Exact;
use model_core::reduced::Reduced;
use model_core::reference::zhou_2023::{FRICTION, GUIDE};

/// Forces inverted at once; with their two other columns they stay in the cache of one core.
const BATCH: usize = 16_384;

fn main() {
    let exact = Exact::new(GUIDE, FRICTION);
    let law = Reduced::of(&GUIDE, &FRICTION, 600.0).to_f32();
    // the paper's domain: Q 26 to 540 N, 20 to 400 cSt, 0.1 to 6 m/min, evenly scattered (golden ratio and its square)
    let spread = |n: usize, step: f64| (n as f64 * step).fract();
    let points: Vec<_> = (0..BATCH)
        .map(|n| {
            let q = 26.0 * 20.7f64.powf(spread(n, 0.618_033_988_75));
            let nu = 20.0 * 20f64.powf(spread(n, 0.754_877_666_25));
            let v = 0.1 / 60.0 * 60f64.powf(spread(n, 0.569_840_290_998));
            exact.at_load(q, nu, v)
        })
        .zip((0..BATCH).map(|n| {
            20.0 * 20f64.powf(spread(n, 0.754_877_666_25)) * 0.1 / 60.0 * 60f64.powf(spread(n, 0.569_840_290_998))
        }))
        .collect();
    let forces: Vec<f32> = points.iter().map(|(p, _)| p.drag_force_n as f32).collect();
    let viscous: Vec<f32> = points.iter().map(|(_, v)| *v as f32).collect();
    let mut preloads = vec![0f32; BATCH];

    let mut best = f64::INFINITY;
    for _ in 0..200 {
        let start = Instant::now();
        for _ in 0..8 {
            batch::preloads(&law, black_box(&forces), black_box(&viscous), black_box(&mut preloads));
        }
        best = best.min(start.elapsed().as_secs_f64() / 8.0);
    }
    let worst = points
        .iter()
        .zip(&preloads)
        .map(|((p, _), got)| (f64::from(*got) / p.preload_n - 1.0).abs())
        .fold(0.0, f64::max);
    let ours = best / BATCH as f64;
    println!("preload from drag force, f32, one core, {BATCH} at once");
    println!(
        "  own kernel          {:>7.2} ns each  {:>6.1} million/s  worst error {worst:.1e} against the exact model",
        1e9 * ours,
        1e-6 / ours
    );
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let rival = Command::new(root.join(".venv/bin/python")).arg(root.join("tests/python/newton_rival.py")).output();
    match rival.ok().filter(|out| out.status.success()) {
        Some(out) => {
            let text = String::from_utf8_lossy(&out.stdout);
            let mut words = text.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
            let (ns, error) = (words.next().unwrap_or(f64::NAN), words.next().unwrap_or(f64::NAN));
            println!(
                "  numpy Newton, f64   {ns:>7.2} ns each  {:>6.1} million/s  worst error {error:.1e} against its own law",
                1e3 / ns
            );
            println!("  ratio               {:>7.1}", ns / (1e9 * ours));
        }
        None => println!("  numpy Newton: not measured, .venv with numpy is missing (run ./verify once)"),
    }
}
