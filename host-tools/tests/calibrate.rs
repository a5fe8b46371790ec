//! `guideblock calibrate`: a guide from raw strokes, an axis from a table, and what is said when neither can be.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use model_core::exact::Exact;
use model_core::reference::zhou_2023::{FRICTION, GUIDE};
use serde_json::Value;
use simulation::sensor::Noise;

/// Drag of the seals in the recordings below, N and N s/m, and zero of the force sensor, N.
const SEAL_N: f64 = 0.8;
const SEAL_N_S_M: f64 = 4.0;
const OFFSET_N: f64 = 0.25;

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("calibrate").join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn calibrate(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guideblock")).arg("calibrate").args(arguments).output().expect("runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Strokes to and fro at 100 Hz, a segment a load: two of each speed, 1 % from stroke to stroke and 0.05 N from row to
/// row; with ramps between that belong to no stroke.
fn ladder(loads_n: &[f64], speeds: &[f64], seals: bool) -> String {
    let model = Exact::new(GUIDE, FRICTION);
    let mut noise = Noise::new(7, 0);
    let mut csv = "time_s,position_m,velocity_m_s,drag_force_n,preload_n,segment\n".to_owned();
    let (mut time, mut place) = (0.0, 0.1);
    for (segment, load) in loads_n.iter().enumerate() {
        let q = if *load > 0.0 { model.load_of_preload(*load).unwrap() } else { 0.0 };
        let drag = |v: f64| {
            let seal = if seals { SEAL_N + SEAL_N_S_M * v } else { 0.0 };
            seal + if q > 0.0 { model.drag_force_n(q, 100.0, v) } else { 0.0 }
        };
        for speed in speeds.iter().flat_map(|v| [*v, *v]) {
            for d in [1.0, -1.0] {
                let stroke = 1.0 + 0.01 * noise.gaussian();
                for row in 0..160 {
                    // 0.15 s up, 1.3 s steady, 0.15 s down
                    let ramp = (f64::from(row.min(159 - row)) / 15.0).min(1.0);
                    let v = d * speed * ramp;
                    let force = d * drag(speed) * stroke * ramp + OFFSET_N + 0.05 * noise.gaussian();
                    writeln!(csv, "{time:.2},{place:.7},{v:.7},{force:.5},{load},{segment}").unwrap();
                    time += 0.01;
                    place += 0.01 * v;
                }
            }
        }
    }
    csv
}

const SPEEDS: [f64; 10] = [0.0017, 0.0033, 0.005, 0.0083, 0.0133, 0.02, 0.033, 0.05, 0.075, 0.1];

#[test]
fn a_guide_comes_out_of_raw_strokes() {
    let folder = folder("guide");
    let recording = folder.join("ladder.csv");
    fs::write(&recording, ladder(&[0.0, 1000.0, 2000.0, 4000.0, 6000.0, 8000.0], &SPEEDS, true)).unwrap();
    let [guide, record, page] = ["guide.toml", "block.bin", "page.html"].map(|n| folder.join(n).display().to_string());
    let output = calibrate(&[
        recording.to_str().unwrap(),
        "--viscosity=100",
        "--json",
        "--out",
        &guide,
        "--record",
        &record,
        "--html",
        &page,
    ]);
    let found = json(&output);
    assert_eq!(found["strokes"], 240);
    assert_eq!(found["hersey_decided_by_strokes"], "slip");
    let truth = [
        FRICTION.mu_coulomb,
        FRICTION.mu_viscous,
        FRICTION.mu_stribeck,
        FRICTION.stribeck_exponent,
        SEAL_N,
        SEAL_N_S_M,
    ];
    let constants = found["constants"].as_array().unwrap();
    assert_eq!(constants.len(), truth.len());
    for (constant, truth) in constants.iter().zip(truth) {
        let (value, sigma) = (constant["value"].as_f64().unwrap(), constant["sigma"].as_f64().unwrap());
        // the seed is fixed: four standard deviations are never chance
        assert!((value - truth).abs() < 4.0 * sigma, "{constant}: {truth}");
    }
    let offset = &found["asymmetry"];
    assert_eq!(offset["taken_off"], true);
    assert!((offset["offset_n"].as_f64().unwrap() - OFFSET_N).abs() < 0.03, "{offset}");
    assert!(found["pattern_p_value"].as_f64().unwrap() > 0.01);

    // the guide goes on into the other commands, the record into the block
    let estimate = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["estimate", recording.to_str().unwrap(), "--json", "--guide", &guide])
        .output()
        .unwrap();
    assert!(estimate.status.success(), "{}", text(&estimate.stderr));
    let record = host_tools::parameters::from_bytes(&fs::read(record).unwrap()).expect("sound");
    assert!(record.params.calibrated);
    assert!((f64::from(record.params.seals.coulomb_n) - SEAL_N).abs() < 0.05);
    assert!((record.params.range.preload_to_n - 8000.0).abs() < 1.0);
    assert!((record.params.range.speed_from_m_s / 0.0017 - 1.0).abs() < 0.01);
    let page = fs::read_to_string(page).unwrap();
    assert!(page.contains("<svg") && page.contains("Direction -1") && !page.contains("<script"), "no picture");
}

/// A force that falls with speed has no viscous part that a file could hold.
#[test]
fn a_law_that_cannot_be_is_neither_shown_nor_written() {
    let folder = folder("unfit");
    let table = folder.join("means.csv");
    let row = |v: &f64| format!("{v},{},3000\n{},{},3000\n", 25.0 - 50.0 * v, -v, -25.0 + 50.0 * v);
    let rows: String = SPEEDS.iter().map(row).collect();
    fs::write(&table, format!("velocity_m_s,drag_force_n,preload_n\n{rows}")).unwrap();
    let (table, guide) = (table.display().to_string(), folder.join("guide.toml").display().to_string());
    for more in [&[][..], &["--json"], &["--out", &guide]] {
        let output = calibrate(&[&[&*table, "--viscosity=100"], more].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{more:?}: {said}");
        assert!(output.stdout.is_empty(), "{more:?}: {}", text(&output.stdout));
        assert!(said.contains("What these strokes leave open:\n  - "), "{said}");
        assert!(said.contains("make no usable law: mu_viscous must lie between 0 and"), "{said}");
    }
    assert!(!Path::new(&guide).exists());
}

/// A window of the usual length has 10 rows here, too few to tell their noise.
#[test]
fn fifty_hertz_have_the_same_strokes() {
    let folder = folder("slow");
    let recording = folder.join("ladder.csv");
    let full = ladder(&[1000.0, 4000.0, 8000.0], &SPEEDS, false);
    let thinned: String =
        full.lines().take(1).chain(full.lines().skip(1).step_by(2)).map(|l| l.to_owned() + "\n").collect();
    let strokes = |text: &str| {
        fs::write(&recording, text).unwrap();
        json(&calibrate(&[recording.to_str().unwrap(), "--viscosity=100", "--json"]))
    };
    let (all, half) = (strokes(&full), strokes(&thinned));
    assert_eq!((&all["strokes"], &half["strokes"]), (&120.into(), &120.into()));
    let friction = |found: &Value, cell: usize| found["cells"][cell]["friction_coefficient"].as_f64().unwrap();
    for cell in 0..half["cells"].as_array().unwrap().len() {
        let (a, b) = (friction(&all, cell), friction(&half, cell));
        assert!((a / b - 1.0).abs() < 0.02, "cell {cell}: {a}, at 50 Hz {b}");
    }
}

#[test]
fn strokes_without_seals_tell_what_the_seals_drag() {
    let folder = folder("seals");
    let recording = folder.join("ladder.csv");
    let with = ladder(&[1000.0, 4000.0, 8000.0], &SPEEDS, true);
    let (without, mut both) = (ladder(&[1000.0, 4000.0, 8000.0], &SPEEDS, false), with.clone());
    // later, and with other numbers of segments
    for line in without.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let (time, segment): (f64, i64) = (cells[0].parse().unwrap(), cells[5].parse().unwrap());
        writeln!(both, "{:.2},{},{}", time + 1000.0, cells[1..5].join(","), segment + 10).unwrap();
    }
    fs::write(&recording, both).unwrap();
    let path = recording.to_str().unwrap();
    let found = json(&calibrate(&[path, "--viscosity=100", "--json", "--seals-off=10,11,12"]));
    let constants = found["constants"].as_array().unwrap();
    for (n, truth) in [(4, SEAL_N), (5, SEAL_N_S_M)] {
        let (value, sigma) = (constants[n]["value"].as_f64().unwrap(), constants[n]["sigma"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * sigma && sigma < 0.5 * truth, "{}", constants[n]);
    }
}

#[test]
fn one_load_leaves_seals_and_convention_open() {
    let recording = folder("one").join("staircase.csv");
    fs::write(&recording, ladder(&[3000.0], &SPEEDS, true)).unwrap();
    let found = json(&calibrate(&[recording.to_str().unwrap(), "--viscosity=100", "--json"]));
    assert_eq!(found["hersey_decided_by_strokes"], Value::Null);
    let open: Vec<&str> =
        found["not_determined"].as_array().unwrap().iter().map(|d| d["code"].as_str().unwrap()).collect();
    for code in ["one-load", "seals", "one-temperature", "products"] {
        assert!(open.contains(&code), "{code} is not among {open:?}");
    }
    assert!(!open.contains(&"one-direction"));
}

/// The lead-screw drives of Mablekos-Alexiou, da Cruz and Bergeles 2021: drive 1 has a Stribeck curve, drive 2 none.
#[test]
fn the_real_lead_screws_are_told_apart() {
    let data = std::env::var_os("GUIDEBLOCK_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let table = data.join("leadscrew_stribeck.csv");
    if !table.exists() {
        eprintln!("skipped: no {}; set GUIDEBLOCK_DATA to the folder of the recordings", table.display());
        return;
    }
    let of = |drive: &str| {
        json(&calibrate(&[
            table.to_str().unwrap(),
            "--column=velocity_m_s=velocity_rad_s",
            "--column=drag_force_n=torque_Nm",
            drive,
            "--json",
        ]))
    };
    let error = |found: &Value, law: usize| found["leave_one_speed_out"][law]["rms_error"].as_f64().unwrap();
    let one = of("--where=drive=1");
    assert_eq!(one["stribeck_supported"], true);
    assert!(error(&one, 2) <= error(&one, 0) / 3.0, "{one}");
    let two = of("--where=drive=2");
    assert_eq!(two["stribeck_supported"], false);
    assert!(error(&two, 2) > error(&two, 0), "{two}");
}

/// The file of an axis simulates the very curve that was fitted.
#[test]
fn an_axis_goes_on_as_a_simulation_file() {
    let folder = folder("axis");
    let law = |v: f64| v.signum() * (20.0 + 200.0 * v.abs() + 6.0 * (-v.abs() / 0.02).exp()) - 3.0 + 30.0 * v.abs();
    let mut table = "velocity_m_s,drag_force_n\n".to_owned();
    let speeds = (1..=24).map(|n| 0.002 * 1.21f64.powi(n));
    for (n, v) in speeds.flat_map(|v| [v, -v]).enumerate() {
        let noise = 0.05 * ((n as f64 * 0.618_034).fract() - 0.5);
        writeln!(table, "{v},{}", law(v) + noise).unwrap();
    }
    let (means, axis, run) = (folder.join("means.csv"), folder.join("axis.toml"), folder.join("run.csv"));
    fs::write(&means, table).unwrap();
    let found = json(&calibrate(&[means.to_str().unwrap(), "--json", "--out", axis.to_str().unwrap()]));
    assert_eq!(found["stribeck_supported"], true);
    let file = fs::read_to_string(&axis).unwrap();
    assert!(file.contains("id = \"stribeck\"") && file.contains("form = \"by-speed\""), "{file}");
    let file = file.replace("[axis]", "[axis]\nmoved_mass_kg = 0.0");
    fs::write(&axis, file).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args([
            "simulate",
            "--profile",
            "map",
            "--speeds",
            "0.005,0.1",
            "--simulation",
            axis.to_str().unwrap(),
            "--out",
        ])
        .arg(&run)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let run = fs::read_to_string(run).unwrap();
    let names: Vec<&str> = run.lines().next().unwrap().split(',').collect();
    let place = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let (v, f) = (place("velocity_m_s"), place("drag_force_n"));
    for line in run.lines().skip(1) {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect();
        if cells[v].abs() > 0.004 {
            assert!((cells[f] - law(cells[v])).abs() < 0.1, "{line}: {}", law(cells[v]));
        }
    }
}

#[test]
fn what_cannot_be_calibrated_is_said() {
    let folder = folder("refused");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let full = ladder(&[3000.0], &SPEEDS[..3], false);
    let without_load: String =
        full.lines().map(|l| l.split(',').take(4).collect::<Vec<_>>().join(",") + "\n").collect();
    let plain = file("no_load.csv", &without_load);
    let guide = folder.join("never.toml").display().to_string();
    let swings = (0..500).map(|n| {
        let (t, w) = (f64::from(n) * 0.02, 4.0);
        format!("{t:.2},{:.7},{:.4},3000\n", 0.02 * (w * t).sin(), 20.0 * (w * t).cos().signum())
    });
    let unsteady =
        file("swings.csv", &swings.fold("time_s,position_m,drag_force_n,preload_n\n".to_owned(), |a, l| a + &l));
    let still = file("still.csv", "velocity_m_s,drag_force_n,preload_n\n0,5,3000\n0,6,3000\n");
    let few = file("few.csv", "velocity_m_s,drag_force_n,preload_n\n0.01,5,3000\n0.02,5,3000\n");
    for (arguments, expected) in [
        (vec![plain.as_str(), "--record", &guide], "a guide is calibrated from a column preload_n"),
        (vec![plain.as_str()], "3 speeds; at least 6 are needed"),
        (vec![file("full.csv", &full).as_str()], "no column temperature_block_degc"),
        (
            vec![unsteady.as_str(), "--viscosity=100"],
            "swings.csv: no stroke at steady speed; hold every speed within 5 % for at least 0.80 s",
        ),
        (vec![unsteady.as_str(), "--every=1"], "for at least 2.00 s"),
        (vec![still.as_str()], "no stroke at steady speed; velocity_m_s is 0 in every row"),
        (vec![few.as_str(), "--viscosity=100"], "2 strokes at known load"),
        (
            vec![file("heavy.csv", "velocity_m_s,drag_force_n,preload_n\n0.01,5,3e9\n").as_str(), "--viscosity=100"],
            "3000000000 N is beyond",
        ),
    ] {
        let output = calibrate(&arguments);
        assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
    assert!(!Path::new(&guide).exists());
}
