//! `guideblock simulate`: a recording's own motion, and every profile, read again by the other commands.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("simulate").join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn guideblock(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guideblock")).args(arguments).output().expect("runs")
}

fn done(arguments: &[&str]) -> Output {
    let output = guideblock(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Columns of a CSV file without empty cells.
fn column(path: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let place = text.lines().next().unwrap().split(',').position(|n| n == name).expect(name);
    text.lines().skip(1).map(|line| line.split(',').nth(place).unwrap().parse().unwrap_or(f64::NAN)).collect()
}

const PROFILES: [&str; 7] = ["staircase", "ladder", "map", "reversal", "modulation", "dwell", "warm-up"];

#[test]
fn a_recording_s_own_motion_gives_its_own_force_again() {
    let folder = folder("again");
    for profile in PROFILES {
        let [run, force] = ["run.csv", "force.csv"].map(|n| folder.join(format!("{profile}-{n}")));
        let mut arguments = vec!["simulate", "--profile", profile, "--rate=50", "--out", run.to_str().unwrap()];
        if profile == "warm-up" {
            arguments.push("--duration=120");
        }
        done(&arguments);
        done(&["simulate", run.to_str().unwrap(), "--out", force.to_str().unwrap()]);
        let (time, recorded) = (column(&run, "time_s"), column(&run, "drag_force_n"));
        assert_eq!(column(&force, "time_s"), time, "{profile}");
        // the law within 1e-9: the text holds every bit, and both ways give the same
        let simulated = column(&force, "simulated_force_n");
        let worst = simulated.iter().zip(&recorded).map(|(s, r)| (s - r).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-7, "{profile}: {worst}");
        assert!(recorded.iter().any(|f| f.abs() > 1.0), "{profile} has no force");
    }
}

#[test]
fn the_preload_that_went_in_comes_out() {
    let folder = folder("preload");
    for profile in ["staircase", "map", "modulation"] {
        let run = folder.join(format!("{profile}.parquet")).display().to_string();
        done(&["simulate", "--profile", profile, "--preload=4321", "--temperature=31", "--out", &run]);
        let found = json(&done(&["estimate", &run, "--json"]));
        let preload = found["preload_n"].as_f64().unwrap();
        assert!((preload / 4321.0 - 1.0).abs() < 1e-3, "{profile}: {preload}");
    }
}

#[test]
fn a_ladder_gives_its_constants_back() {
    use model_core::reference::zhou_2023::FRICTION;
    let ladder = folder("ladder").join("ladder.csv").display().to_string();
    done(&["simulate", "--profile=ladder", "--rate=100", "--repeats=2", "--noise=0.1", "--out", &ladder]);
    let found = json(&done(&["calibrate", &ladder, "--json"]));
    assert_eq!(found["hersey_decided_by_strokes"], "slip");
    let truth = [FRICTION.mu_coulomb, FRICTION.mu_viscous, FRICTION.mu_stribeck, FRICTION.stribeck_exponent];
    for (constant, truth) in found["constants"].as_array().unwrap().iter().zip(truth) {
        let value = constant["value"].as_f64().unwrap();
        assert!((value / truth - 1.0).abs() < 0.02, "{constant}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let folder = folder("seed");
    let bytes = |name: &str, seed: &str| {
        let out = folder.join(name);
        done(&["simulate", "--profile=map", "--repeats=1", "--sensors=block", seed, "--out", out.to_str().unwrap()]);
        fs::read(out).unwrap()
    };
    let one = bytes("a.csv", "--seed=5");
    assert_eq!(one, bytes("b.csv", "--seed=5"));
    assert_ne!(one, bytes("c.csv", "--seed=6"));
    // an encoder gives no velocity of its own
    assert!(!String::from_utf8_lossy(&one[..200]).contains("velocity"));
}

#[test]
fn rows_without_a_force_are_empty_and_counted() {
    let folder = folder("holes");
    let (run, out) = (folder.join("run.csv"), folder.join("out.csv"));
    let row = |n: usize| {
        let preload = if n.is_multiple_of(4) { "" } else { "2500" };
        format!("{:.2},0.05,10,{preload},25\n", 0.01 * n as f64)
    };
    let rows: String = (0..400).map(row).collect();
    let header = "time_s,velocity_m_s,drag_force_n,preload_n,temperature_block_degc\n";
    fs::write(&run, format!("{header}{}", rows.replacen(",10,", ",11,", 1))).unwrap();
    let output = done(&["simulate", run.to_str().unwrap(), "--out", out.to_str().unwrap(), "--json"]);
    assert_eq!(json(&output)["without_force"], 100);
    assert!(String::from_utf8_lossy(&output.stderr).contains("100 of 400 rows have no simulated force"));
    assert_eq!(column(&out, "simulated_force_n").iter().filter(|f| f.is_nan()).count(), 100);
}

#[test]
fn what_cannot_be_simulated_is_said() {
    let folder = folder("refused");
    let out = folder.join("never.csv").display().to_string();
    for (arguments, expected) in [
        (vec!["--profile=map", "--amplitudes=1"], "takes no --amplitudes; it takes --speeds, --length, --repeats"),
        (vec!["--profile=map", "--length=0.001"], "does not reach 0.1000 m/s"),
        (vec!["--profile=dwell", "--speeds=1,2"], "takes one speed"),
        (vec!["--profile=staircase", "--speeds=-1"], "speed must be above 0"),
        (vec!["--profile=map", "--preload=1e9"], "no force for a preload of 1000000000 N"),
        (vec!["--profile=warm-up", "--duration=1e12"], "more than 86400000"),
        (vec![], "required"),
    ] {
        let mut all = vec!["simulate", "--out", &out];
        all.extend(arguments);
        let output = guideblock(&all);
        let talk = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{talk}");
        assert!(talk.contains(expected), "{talk}");
        assert!(!Path::new(&out).exists());
    }
    let run = folder.join("run.csv");
    fs::write(
        &run,
        (0..300)
            .fold("time_s,velocity_m_s,drag_force_n\n".to_owned(), |text, n| text + &format!("{n},0.05,{}\n", n % 7)),
    )
    .unwrap();
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n").unwrap();
    let output = guideblock(&["simulate", run.to_str().unwrap(), "--simulation", simulation.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        String::from_utf8_lossy(&output.stderr)
            .contains("no column preload_n and the simulation no operation.preload_n")
    );
}

#[test]
fn a_closed_pipe_ends_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["simulate", "--profile=staircase"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(!String::from_utf8_lossy(&output.stderr).contains("cannot write"));
}
