//! Decoding candump text against python-can with cantools, on the same log in the same run.
//!
//! `cargo bench -p host-tools --bench decode`
#![allow(clippy::expect_used, reason = "a bench that cannot run ends with the reason")]

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use can_wire::{NodeId, Publisher};
use host_tools::candump::{Frame, Micros};
use model_core::sample::{Estimate, Measured, Motion, Reasons};

/// Frames in the log.
const FRAMES: usize = 2_000_000;
/// Frames that the rival is given: the first of the log, so that a run stays short.
const RIVAL_FRAMES: usize = 200_000;

fn main() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (log, short) = (folder.join("decode.log"), folder.join("decode-short.log"));
    write_log(&log, FRAMES);
    write_log(&short, RIVAL_FRAMES);
    let megabytes = std::fs::metadata(&log).expect("the log").len() as f64 / 1e6;

    println!("candump text, {FRAMES} frames ({megabytes:.0} MB), whole process from file to closed pipe");
    let mut ours = f64::INFINITY;
    for format in ["table", "csv", "json"] {
        let best = (0..3).map(|_| decode(&log, format)).fold(f64::INFINITY, f64::min);
        println!("  guideblock decode --format {format:<6} {:>9.0} frames/s", FRAMES as f64 / best);
        if format == "csv" {
            ours = FRAMES as f64 / best;
        }
    }
    match rival(&short) {
        Some(rate) => {
            println!("  python-can + cantools          {rate:>9.0} frames/s (decoded, nothing printed)");
            println!("  ratio, csv against it          {:>9.1}", ours / rate);
        }
        None => println!("  python-can + cantools: not measured, .venv is missing (run ./verify once)"),
    }
}

/// One block's estimates and motions, 5 ms apart, as `candump -L` writes them.
fn write_log(path: &Path, frames: usize) {
    let mut block = Publisher::new(NodeId::FIRST);
    let mut text = String::with_capacity(48 * frames);
    let measured = |value: f32, sigma: f32| Some(Measured { value, sigma });
    for n in 0..frames / 2 {
        let estimate = Estimate {
            tick: n as u32,
            preload_n: measured(3000.0 + (n % 997) as f32, 120.0),
            drag_force_n: measured(20.0 + (n % 89) as f32 * 0.01, 0.1),
            speed_m_s: measured(0.1, 1e-4),
            temperature_degc: Some(24.5),
            motion: Motion::Forward,
            reasons: Reasons::NONE,
        };
        let at = Some(Micros(1_700_000_000_000_000 + 10_000 * n as u64));
        for frame in [block.estimate(&estimate), block.motion(&estimate)] {
            let _ = writeln!(text, "{}", Frame::new(at, "can0", frame.id, &frame.data));
        }
    }
    std::fs::write(path, text).expect("the log");
}

/// Seconds that the command takes.
fn decode(log: &Path, format: &str) -> f64 {
    let start = Instant::now();
    let status = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["decode", "--format", format])
        .arg(log)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .expect("guideblock runs");
    assert!(status.success());
    start.elapsed().as_secs_f64()
}

fn rival(log: &Path) -> Option<f64> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = Command::new(root.join(".venv/bin/python"))
        .arg(root.join("tests/python/decode_rival.py"))
        .args([root.join("can-wire/guideblock.dbc").as_os_str(), log.as_os_str()])
        .output()
        .ok()?;
    String::from_utf8_lossy(&out.stdout).trim().parse().ok()
}
