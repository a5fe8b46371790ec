//! Real drives whose answer is known: two lead screws, one with a Stribeck curve and one without, and a ball screw that
//! wore for 1015 hours, of which 30 readings are too little to name a cause.
//!
//! The recordings are not part of the repository; `host_tools::trial::real` says where they come from.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

const SIMULATION: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n[axis]\n\
                          moved_mass_kg = 0.0\n";

fn data(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("GUIDEBLOCK_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = folder.join(name);
    if !path.exists() {
        eprintln!("skipped: no {}; set GUIDEBLOCK_DATA to the folder of the recordings", path.display());
        return None;
    }
    Some(path)
}

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("real-drives");
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn diagnose(recording: &Path, more: &[&str]) -> (Option<i32>, Value) {
    // beside the recording, under its name: tests that run at once do not write over each other's
    let simulation = recording.with_extension("toml");
    let simulation = folder().join(simulation.file_name().unwrap());
    fs::write(&simulation, SIMULATION).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .arg("diagnose")
        .arg(recording)
        .args(["--simulation", simulation.to_str().unwrap(), "--json", "-"])
        .args(more)
        .output()
        .unwrap();
    let found = serde_json::from_slice(&output.stdout).expect("a report, even where nothing could be used");
    (output.status.code(), found)
}

fn names(found: &Value, id: &str) -> bool {
    let mut named = found["mechanisms"].as_array().unwrap().iter();
    named.any(|m| m["id"] == id || m["equivalents"].as_array().unwrap().iter().any(|e| e == id))
}

/// The runs of a drive, both directions, at the speed that each was set to: its name, in rpm, `n` for backward. The
/// measured speed is the same in steps of 1 rpm. 1 mm a radian and 1 N a mN m stand for the lead, which is not stated.
fn lead_screw(drive: &str) -> Option<PathBuf> {
    let path = data("leadscrew_runs.csv")?;
    let mut text = "time_s,velocity_m_s,drag_force_n,segment\n".to_owned();
    let (mut run, mut segment, mut start, mut time) = (String::new(), 0, 0.0, 0.0);
    for row in csv::Reader::from_path(path).unwrap().records().map(Result::unwrap).filter(|row| &row[0] == drive) {
        if row[1] != run {
            (run, segment, start) = (row[1].to_owned(), segment + 1, time + 5.0);
        }
        let (sign, rpm) = run.strip_prefix('n').map_or((1.0, &*run), |rpm| (-1.0, rpm));
        let speed = sign * rpm.parse::<f64>().unwrap() * std::f64::consts::TAU / 60.0 * 1e-3;
        let torque: f64 = row[4].parse().unwrap();
        time = start + row[2].parse::<f64>().unwrap();
        writeln!(text, "{time:.4},{speed},{},{segment}", torque * 1e3).unwrap();
    }
    let file = folder().join(format!("drive-{drive}.csv"));
    fs::write(&file, text).unwrap();
    Some(file)
}

/// The plain nut: its friction falls with speed first. The recording has one load and a fall and a rise of the
/// friction, so that the curve is named with what could bend it alike.
#[test]
fn the_plain_lead_screw_has_a_stribeck_curve() {
    let Some(recording) = lead_screw("1") else { return };
    let (status, found) = diagnose(&recording, &[]);
    assert_eq!(status, Some(1), "{found:#}");
    assert!(names(&found, "stribeck"), "{found:#}");
    assert_eq!(found["mechanisms"].as_array().unwrap().len(), 1, "{found:#}");
}

/// The nut with a preload spring, the negative control.
#[test]
fn the_preloaded_lead_screw_has_none() {
    let Some(recording) = lead_screw("2") else { return };
    let (status, found) = diagnose(&recording, &[]);
    assert_eq!(status, Some(0), "{found:#}");
    assert!(found["verdict"] == "match" || found["verdict"] == "insufficient-data", "{found:#}");
    assert_eq!(found["mechanisms"].as_array().unwrap().len(), 0, "{found:#}");
}

/// 30 readings in 1015 hours, speed and age in one: no cause is named, and the report says why.
#[test]
fn a_ball_screw_read_thirty_times_is_too_little() {
    let Some(recording) = data("xjtu_wear.csv") else { return };
    for torque in ["friction_torque_upper", "friction_torque_lower"] {
        // a lead of 8 mm
        let force = format!("drag_force_n={torque}:785.4");
        let speed = "velocity_m_s=speed_rpm_of_next_block:1.3333e-4";
        let columns = ["--column", "time_s=hours:3600", "--column", speed, "--column", &force];
        let (status, found) = diagnose(&recording, &columns);
        assert_eq!((status, &found["verdict"]), (Some(3), &"insufficient-data".into()), "{found:#}");
        let why = found["data_quality"]["warnings"][0].as_str().unwrap();
        assert!(why.contains("30 usable rows of 30 rows, at least 200 are needed"), "{why}");
    }
}

/// What `trial real` asks of every recording, EMPS with its published constants among them.
#[test]
fn every_recording_is_answered_as_its_authors_state() {
    let Some(recording) = data("emps_train.csv") else { return };
    let program = env!("CARGO_BIN_EXE_guideblock");
    let out = folder().join("all");
    let mut command = Command::new(program);
    command.args(["trial", "real", "--binary", program, "--data"]).arg(recording.parent().unwrap());
    assert!(command.arg("--out").arg(&out).output().unwrap().status.success());
    let answers: Vec<Value> = serde_json::from_slice(&fs::read(out.join("real.json")).unwrap()).unwrap();
    for answer in &answers {
        assert_eq!(answer["is_right"], true, "{answer:#}");
    }
    assert!(!answers.is_empty());
}
