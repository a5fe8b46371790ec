//! EMPS, a prismatic axis on a ball screw: the published models, and what `diagnose` makes of the same two recordings.
//!
//! `docs/emps.md` shows the table that is asserted here. The recordings are not part of the repository.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

mod authors;
mod filter;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use authors::{Recording, error_pct};
use serde_json::Value;

/// Nothing is given but the form of the law: all its constants are fitted on the train file.
const SIMULATION: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n[axis]\n\
                          position_reference = \"relative\"\n";

fn data(name: &str) -> Option<String> {
    let folder = std::env::var_os("GUIDEBLOCK_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = folder.join(name);
    if !path.exists() {
        eprintln!("skipped: no {}; set GUIDEBLOCK_DATA to the folder of the recordings", path.display());
        return None;
    }
    Some(path.display().to_string())
}

/// A column of a CSV file; empty cells are NaN.
fn column(path: &str, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let at = reader.headers().unwrap().iter().position(|h| h == name).unwrap();
    reader.records().map(|row| row.unwrap()[at].parse().unwrap_or(f64::NAN)).collect()
}

fn recording(path: &str) -> Recording {
    Recording { position_m: column(path, "position_m"), force_n: column(path, "drag_force_n") }
}

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("emps");
    fs::create_dir_all(&folder).unwrap();
    folder
}

struct Found {
    diagnosis: Value,
    /// The exported simulation, whole.
    exported: String,
    train: String,
    pulses: String,
}

/// The diagnosis, made once for all tests; none where the recordings are absent.
fn found() -> Option<&'static Found> {
    static FOUND: OnceLock<Option<Found>> = OnceLock::new();
    FOUND
        .get_or_init(|| {
            let (train, pulses) = (data("emps_train.csv")?, data("emps_pulses.csv")?);
            let [simulation, exported] = ["sim.toml", "exported.toml"].map(|n| folder().join(n).display().to_string());
            fs::write(&simulation, SIMULATION).unwrap();
            let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
                .args(["diagnose", &train, "--holdout", &pulses, "--simulation", &simulation])
                .args(["--export", &exported, "--json", "-"])
                .output()
                .unwrap();
            assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
            let diagnosis = serde_json::from_slice(&output.stdout).unwrap();
            Some(Found { diagnosis, exported: fs::read_to_string(exported).unwrap(), train, pulses })
        })
        .as_ref()
}

/// The exported simulation with what is said to carry over to another recording, and nothing else.
fn carried(found: &Found) -> String {
    let named = found.diagnosis["mechanisms"].as_array().unwrap();
    let mut tables = found.exported.split("[[mechanism]]");
    let head = tables.next().unwrap().to_owned();
    tables.fold(head, |file, table| {
        let is_of = |m: &&Value| table.contains(&format!("id = \"{}\"", m["id"].as_str().unwrap()));
        let carries = named.iter().find(is_of).is_none_or(|m| m["carried_over"] == true);
        if carries { file + "[[mechanism]]" + table } else { file }
    })
}

/// Error on a recording of what carries over, %, with what of the rest does not hang on a place: its mean along the stroke of
/// the train file, in either direction and as far as it goes with the force that carries over. The tool scores it so, too.
fn error_without_places(found: &Found, name: &str, path: &str) -> f64 {
    let file = carried(found);
    let (_, whole) = force_of(&found.exported, "whole", &found.train);
    let (train, part) = force_of(&file, "train", &found.train);
    let bound: Vec<f64> = whole.iter().zip(&part).map(|(whole, part)| whole - part).collect();
    let mean = authors::least_squares(&carriers(&train, &part), &bound);
    let (recording, mut said) = force_of(&file, name, path);
    for (column, x) in carriers(&recording, &said.clone()).iter().zip(mean) {
        said.iter_mut().zip(column).for_each(|(said, carrier)| *said += x * carrier);
    }
    error_pct(&recording.force_n, &said)
}

fn carriers(recording: &Recording, force: &[f64]) -> [Vec<f64>; 4] {
    let [_, velocity, _] = authors::motion(recording);
    let sign: Vec<f64> = velocity.iter().map(|v| v.signum()).collect();
    let by_direction = sign.iter().zip(force).map(|(sign, force)| sign * force).collect();
    [vec![1.0; sign.len()], sign, force.to_vec(), by_direction]
}

/// Error of a simulation file on a recording, %.
fn error_of(simulation: &str, name: &str, path: &str) -> f64 {
    let (recording, said) = force_of(simulation, name, path);
    error_pct(&recording.force_n, &said)
}

/// Force of a simulation file, N. The law gets the motion that the published models get.
fn force_of(simulation: &str, name: &str, path: &str) -> (Recording, Vec<f64>) {
    let [file, motion, out] =
        ["toml", "motion.csv", "force.csv"].map(|e| folder().join(format!("{name}.{e}")).display().to_string());
    fs::write(&file, simulation).unwrap();
    let recording = recording(path);
    let [position, velocity, acceleration] = authors::motion(&recording);
    let mut text = "time_s,position_m,velocity_m_s,acceleration_m_s2,drag_force_n\n".to_owned();
    for (n, force) in recording.force_n.iter().enumerate() {
        let row = [n as f64 * 1e-3, position[n], velocity[n], acceleration[n], *force];
        text += &(row.map(|cell| cell.to_string()).join(",") + "\n");
    }
    fs::write(&motion, text).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["simulate", &motion, "--simulation", &file, "--out", &out])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut said = column(&out, "simulated_force_n");
    // at rest the law says no force: the last one is held
    assert!(said.iter().filter(|f| f.is_nan()).count() <= 5);
    for n in 1..said.len() {
        if said[n].is_nan() {
            said[n] = said[n - 1];
        }
    }
    (recording, said)
}

/// The ruler first: the published figures come out of the authors' method.
#[test]
fn the_published_errors_are_reproduced() {
    let (Some(train), Some(pulses)) = (data("emps_train.csv"), data("emps_pulses.csv")) else { return };
    let (train, pulses) = (recording(&train), recording(&pulses));
    let [nominal, asymmetric] = [false, true].map(|is_asymmetric| {
        let constants = authors::fit(&train, is_asymmetric);
        let errors = [&train, &pulses].map(|r| error_pct(&r.force_n, &authors::force(r, &constants)));
        println!("{constants:.3?}: train {:.3} %, pulses {:.3} %", errors[0], errors[1]);
        (constants, errors)
    });
    let close = |got: f64, published: f64, digits: f64| assert!((got - published).abs() < digits, "{got}, {published}");
    for (got, published) in nominal.0.iter().zip([95.109, 203.50, 20.394, -3.165]) {
        close(*got, published, 6e-3);
    }
    close(nominal.1[0], 4.0834, 1e-4);
    close(nominal.1[1], 5.9824, 1e-4);
    close(asymmetric.0[1], 166.7, 0.05);
    close(asymmetric.0[3], 240.4, 0.05);
    close(asymmetric.1[0], 3.1117, 1e-4);
    // not published; 5.40 by another hand's filters
    close(asymmetric.1[1], 5.365, 1e-3);
}

#[test]
fn what_the_train_file_teaches_halves_the_error_on_the_pulses() {
    let Some(found) = found() else { return };
    let [train, pulses] = [("train", &found.train), ("pulses", &found.pulses)]
        .map(|(name, path)| error_without_places(found, name, path));
    let whole = error_of(&found.exported, "whole", &found.train);
    println!("carried over: train {train:.3} %, pulses {pulses:.3} %; whole: train {whole:.3} %");
    assert!(pulses <= 2.8, "{pulses} %");
    assert!(train < 2.55 && whole < 2.0, "{train} % and {whole} %");
    let held = |stage: &str| found.diagnosis["holdout"][stage].as_f64().unwrap();
    assert!((held("rmse_before_n") - 2.82).abs() < 0.01 && held("rmse_after_n") < 1.58, "{:#}", found.diagnosis);
}

#[test]
fn the_asymmetry_of_the_screw_comes_first() {
    let Some(found) = found() else { return };
    let first = &found.diagnosis["mechanisms"][0];
    assert_eq!((&first["id"], &first["carried_over"]), (&"direction-asymmetry".into(), &true.into()), "{first:#}");
}

/// The PULSES file has no say: with another file in its place the same is exported.
#[test]
fn the_pulses_have_no_say() {
    let Some(found) = found() else { return };
    let [simulation, exported] = ["sim.toml", "swapped.toml"].map(|n| folder().join(n).display().to_string());
    // in its place the train file with a force 1 % larger (itself would be refused): were the search to look at it,
    // another simulation would come out
    let other = folder().join("larger.csv").display().to_string();
    let train = fs::read_to_string(&found.train).unwrap();
    let header = train.lines().next().unwrap();
    let at = header.split(',').position(|name| name == "drag_force_n").expect("a column of force");
    let larger = train.lines().skip(1).map(|line| {
        let cell = |(n, cell): (usize, &str)| {
            if n == at { (1.01 * cell.parse::<f64>().unwrap()).to_string() } else { cell.to_owned() }
        };
        line.split(',').enumerate().map(cell).collect::<Vec<_>>().join(",")
    });
    fs::write(&other, [header.to_owned()].into_iter().chain(larger).collect::<Vec<_>>().join("\n")).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["diagnose", &found.train, "--holdout", &other, "--simulation", &simulation, "--export", &exported])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(fs::read_to_string(exported).unwrap(), found.exported);
}

/// Positions are relative: nothing that is bound to a place is scored on another recording.
#[test]
fn nothing_that_is_bound_to_a_place_is_carried_over() {
    let Some(found) = found() else { return };
    let bound = ["drive-ripple", "ball-pass", "rail-straightness", "rail-joint", "encoder-cyclic-error"];
    for named in found.diagnosis["mechanisms"].as_array().unwrap() {
        if bound.contains(&named["id"].as_str().unwrap()) {
            assert_eq!(named["carried_over"], Value::Null, "{named:#}");
        }
    }
}

fn has(found: &Found, id: &str) -> bool {
    let named = found.diagnosis["mechanisms"].as_array().unwrap();
    named.iter().any(|m| m["id"] == id || m["equivalents"].as_array().unwrap().iter().any(|e| e == id))
}

/// Force that comes early or a frame that gives: one of them is named, and that it may be the other is said.
#[test]
#[ignore = "not reached: time-misalignment is named without structural-resonance beside it, see docs/emps.md"]
fn flexibility_and_delay_are_not_told_apart() {
    let Some(found) = found() else { return };
    assert!(has(found, "time-misalignment") && has(found, "structural-resonance"), "{:#}", found.diagnosis);
}

/// The ripple of 2.5 and 1.25 mm that the screw leaves in the force.
#[test]
fn the_ripple_of_the_screw_is_explained_where_it_was_seen() {
    let Some(found) = found() else { return };
    assert!(has(found, "drive-ripple"), "{:#}", found.diagnosis);
}
