//! `guideblock simulate` over its command line: the motion of a recording, driven profiles, sensors.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use host_tools::recording::{open, silent};
use model_core::exact::Exact;
use model_core::reference::zhou_2023::{FRICTION, GUIDE};
use simulation::guide::{GuideSet, Lubricant};
use simulation::run::Run;

const SIMULATION: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n\
                          [lubricant]\nviscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

/// A folder with a simulation file, else empty.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("simulate").join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("writable");
    fs::write(folder.join("sim.toml"), SIMULATION).expect("writable");
    folder
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn guideblock(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = command(folder, arguments).output().expect("the binary of this package");
    (status.code(), String::from_utf8(stdout).expect("text"), String::from_utf8(stderr).expect("text"))
}

/// `guideblock simulate --simulation sim.toml`, which must succeed; what it says.
fn simulate(folder: &Path, arguments: &[&str]) -> (String, String) {
    let (status, stdout, stderr) = guideblock(folder, &[&["simulate", "--simulation", "sim.toml"], arguments].concat());
    assert_eq!(status, Some(0), "{arguments:?}: {stderr}");
    (stdout, stderr)
}

/// Viscosity of the published set's oil.
fn viscosity_cst(degc: f64) -> f64 {
    match GuideSet::zhou_2023().lubricant() {
        Lubricant::Walther(oil) => oil.viscosity_cst(degc),
        Lubricant::Constant(nu) => nu,
    }
}

fn read(folder: &Path, name: &str) -> Run {
    let (run, losses) = open(&folder.join(name), &[], &[], &silent).expect("usable");
    assert_eq!((losses.found, losses.gaps), (0, 0), "{:?}", losses.describe(name));
    run
}

/// Rows of a table with `time_s,simulated_force_n`; NaN where a cell is empty.
fn cells(text: &str) -> Vec<(f64, f64)> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time_s,simulated_force_n"));
    let number = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().expect("a number") };
    lines.map(|line| line.split_once(',').expect("two cells")).map(|(t, f)| (number(t), number(f))).collect()
}

/// A recording at 100 Hz, columns `time_s,velocity_m_s,drag_force_n,preload_n,temperature_block_degc`.
fn record(rows: usize, row: impl Fn(usize) -> [String; 4]) -> String {
    let mut text = String::from("time_s,velocity_m_s,drag_force_n,preload_n,temperature_block_degc\n");
    for n in 0..rows {
        writeln!(text, "{},{}", n as f64 / 100.0, row(n).join(",")).expect("a text");
    }
    text
}

#[test]
fn every_sample_has_the_exact_model_s_force_with_the_sign_of_the_motion() {
    let folder = folder("exact");
    let exact = Exact::new(GUIDE, FRICTION);
    let velocity = |n: usize| 0.05 * (0.01 * n as f64).sin();
    let preload = |n: usize| 2000.0 + 2.0 * n as f64;
    let temperature = |n: usize| 25.0 + 0.01 * n as f64;
    let text = record(1000, |n| [velocity(n), (n % 7) as f64, preload(n), temperature(n)].map(|x: f64| x.to_string()));
    fs::write(folder.join("run.csv"), text).expect("writable");
    // the oil's viscosity follows the temperature
    fs::write(folder.join("sim.toml"), "schema = \"guideblock.simulation/1\"\n[guide]\n").expect("writable");
    let (stdout, stderr) = simulate(&folder, &["run.csv"]);
    let got = cells(&stdout);
    assert_eq!(got.len(), 1000);
    let mut at_rest = 0;
    for (n, (time, force)) in got.iter().enumerate() {
        assert_eq!(*time, n as f64 / 100.0);
        if velocity(n).abs() < 3e-5 {
            assert!(force.is_nan(), "{n}");
            at_rest += 1;
            continue;
        }
        let q = exact.load_of_preload(preload(n)).expect("within the geometry");
        let expected = exact.drag_force_n(q, viscosity_cst(temperature(n)), velocity(n).abs()).copysign(velocity(n));
        assert!((force - expected).abs() < 1e-8 * expected.abs(), "{n}: {force} {expected}");
    }
    assert!(at_rest > 0);
    assert!(
        stderr.contains(&format!(
            "run.csv: {at_rest} of 1000 cells are empty: at rest, where friction is not determined (slower than \
             axis.zero_speed_m_s)\n"
        )),
        "{stderr}"
    );
}

#[test]
fn rows_that_cannot_be_used_keep_their_places() {
    let folder = folder("places");
    let text = record(400, |n| {
        let preload = if n == 20 { String::new() } else { "3000".to_owned() };
        let force = match n {
            10 => String::new(),
            11 => "broken".to_owned(),
            _ => (30 + n % 3).to_string(),
        };
        ["0.02".to_owned(), force, preload, String::new()]
    });
    fs::write(folder.join("run.csv"), &text).expect("writable");
    let (from_file, stderr) = simulate(&folder, &["run.csv"]);
    let got = cells(&from_file);
    let empty: Vec<usize> = (0..got.len()).filter(|n| got[*n].1.is_nan()).collect();
    assert_eq!((got.len(), empty), (400, vec![10, 11, 20]));
    assert!(got.iter().enumerate().all(|(n, (t, _))| *t == n as f64 / 100.0));
    assert!(stderr.contains("run.csv: 1 of 400 cells are empty: preload_n not measured there\n"), "{stderr}");
    assert!(stderr.contains("run.csv: 2 of 400 cells are empty: the row could not be used (see above)\n"), "{stderr}");
    // nothing at all is a file of empty cells, and a failure
    let still = record(300, |n| ["0".to_owned(), (n % 5).to_string(), "3000".to_owned(), String::new()]);
    fs::write(folder.join("still.csv"), still).expect("writable");
    let (status, stdout, stderr) = guideblock(&folder, &["simulate", "still.csv", "--simulation", "sim.toml"]);
    assert_eq!((status, cells(&stdout).len()), (Some(3), 300));
    assert!(stderr.contains("300 of 300 cells are empty: at rest") && stderr.contains("no sample has"), "{stderr}");
    // through a pipe just the same, and as Parquet
    let mut child = command(&folder, &["simulate", "-", "--simulation", "sim.toml"]);
    let mut child = child.stdin(Stdio::piped()).spawn().expect("the binary");
    child.stdin.take().expect("piped").write_all(text.as_bytes()).expect("it reads its input");
    assert_eq!(String::from_utf8(child.wait_with_output().expect("it ends").stdout).expect("text"), from_file);
    simulate(&folder, &["run.csv", "--out", "out.parquet"]);
    assert_eq!(guideblock(&folder, &["convert", "out.parquet", "-"]).1, from_file);
}

#[test]
fn foreign_columns_are_mapped_by_the_command_line_or_the_simulation() {
    let folder = folder("mapped");
    let mut text = String::from("ms,v_mm_s,current,drive\n");
    for n in 0..600 {
        writeln!(text, "{},{},{},{}", 10 * (n / 2), 20 + n % 2, 0.1 * f64::from(n % 5), n % 2).expect("a text");
    }
    fs::write(folder.join("run.csv"), text).expect("writable");
    let mapped = [
        "run.csv",
        "--column",
        "time_s=ms:0.001",
        "--column",
        "velocity_m_s=v_mm_s:0.001",
        "--column",
        "drag_force_n=current:35.15",
        "--where",
        "drive=1",
    ];
    let (by_command, _) = simulate(&folder, &mapped);
    let got = cells(&by_command);
    assert_eq!((got.len(), got[299].0), (300, 2.99));
    let columns =
        "[columns]\ntime_s = \"ms:0.001\"\nvelocity_m_s = \"v_mm_s:0.001\"\ndrag_force_n = \"current:35.15\"\n";
    fs::write(folder.join("sim.toml"), SIMULATION.to_owned() + columns).expect("writable");
    assert_eq!(simulate(&folder, &["run.csv", "--where", "drive=1"]).0, by_command);
}

#[test]
fn the_other_laws_are_simulated_too() {
    let folder = folder("laws");
    let mut text = String::from("time_s,velocity_m_s,acceleration_m_s2,drag_force_n,simulated_force_n\n");
    for n in 0..300 {
        let column = if n == 5 { String::new() } else { n.to_string() };
        writeln!(
            text,
            "{},{},{},{},{column}",
            f64::from(n) / 100.0,
            0.01 * f64::from(n % 3 - 1),
            0.1 * f64::from(n),
            n % 7
        )
        .expect("a text");
    }
    fs::write(folder.join("run.csv"), text).expect("writable");
    let of = |law: &str| {
        fs::write(folder.join("sim.toml"), format!("schema = \"guideblock.simulation/1\"\n{law}")).expect("writable");
        cells(&simulate(&folder, &["run.csv"]).0)
    };
    let axis = of("[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\nviscous_n_s_m = 100\noffset_n = 2\n\
                   [axis]\nmoved_mass_kg = 5\n");
    for (n, (_, force)) in axis.iter().enumerate() {
        let sign = f64::from(n as i32 % 3 - 1);
        let expected = sign * (20.0 + 1.0) + 2.0 + 5.0 * 0.1 * n as f64;
        assert!(if sign == 0.0 { force.is_nan() } else { (force - expected).abs() < 1e-9 }, "{n}: {force}");
    }
    let column = of("[tolerance]\nfriction = 0.1\n");
    assert!(column.iter().enumerate().all(|(n, (_, f))| if n == 5 { f.is_nan() } else { *f == n as f64 }));
}

#[test]
fn a_force_without_a_name_is_simulated_and_said_to_be_left_out_where_the_run_does_not_tell_its_axis() {
    let folder = folder("curves");
    let law = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\nviscous_n_s_m = 0\n\
               offset_n = 0\n[axis]\nmoved_mass_kg = 0\n";
    let curve =
        |axis: &str| format!("[[curve]]\naxis = \"{axis}\"\ncarrier = \"drag\"\nat = [0, 0.1]\nheight = [0, 0.5]\n");
    fs::write(folder.join("sim.toml"), [law, &curve("velocity"), &curve("load")].concat()).expect("writable");
    let row = |n: usize| [format!("{}", 1e-4 * (n + 1) as f64), format!("{}", n % 7), String::new(), String::new()];
    fs::write(folder.join("run.csv"), record(300, row)).expect("writable");
    let (rows, said) = simulate(&folder, &["run.csv"]);
    for (n, (_, force)) in cells(&rows).iter().enumerate() {
        let expected = 20.0 * (1.0 + 5.0 * 1e-4 * (n + 1) as f64);
        assert!((force - expected).abs() < 1e-9, "{n}: {force}");
    }
    let line = "run.csv: the curve over load is left out of the force: nothing in the run tells its load";
    assert!(said.contains(line) && !said.contains("over velocity"), "{said}");
    let (_, said) = simulate(&folder, &["--profile", "map", "--preload", "3000", "--out", "map.csv"]);
    assert!(said.contains("map: the curve over load is left out"), "{said}");
}

/// The `staircase` part of `guideblock estimate --staircase`, and the whole.
fn estimate(folder: &Path, name: &str, more: &[&str]) -> serde_json::Value {
    let arguments = [&["estimate", name, "--guide", "sim.toml", "--json"], more].concat();
    let (status, stdout, stderr) = guideblock(folder, &arguments);
    assert_eq!(status, Some(0), "{name}: {stderr}");
    serde_json::from_str(&stdout).expect("JSON")
}

#[test]
fn profiles_are_recordings_whose_preload_comes_back() {
    let folder = folder("profiles");
    for (name, columns, options) in [
        ("staircase", "", &["--preload", "4321"][..]),
        ("map", "", &["--preload", "4321", "--strokes", "2"]),
        ("modulation", "", &["--preload", "4321"]),
        ("dwell", ",external_load_n", &["--preload", "4321", "--dwells", "1,10", "--external-load", "-200"]),
        (
            "warmup",
            ",temperature_block_degc,temperature_rail_degc,temperature_ambient_degc",
            &["--preload", "4321", "--run", "120", "--stop", "30", "--resume", "60"],
        ),
    ] {
        let file = format!("{name}.csv");
        let (stdout, stderr) = simulate(&folder, &[&["--profile", name, "--out", &file], options].concat());
        assert!(stdout.is_empty() && stderr.starts_with(&format!("{name}: ")), "{stderr}");
        let text = fs::read_to_string(folder.join(&file)).expect("written");
        let expected = format!("time_s,position_m,velocity_m_s,drag_force_n,preload_n{columns},segment");
        assert_eq!(text.lines().next(), Some(&*expected));
        let run = read(&folder, &file);
        assert!(run.preload_n.as_ref().is_some_and(|p| p.iter().all(|p| *p == 4321.0)));
        let found = estimate(&folder, &file, &[]);
        // a modulated speed is not steady within a window: what is left of it is less exact
        let tight = if name == "modulation" { 2e-3 } else { 2e-5 };
        assert!(found["usable"].as_u64() > Some(20), "{name}: {found}");
        for preload in [&found["windows_90_percent_n"][0], &found["windows_90_percent_n"][1], &found["preload_n"]] {
            let preload = preload.as_f64().expect("a number");
            assert!((preload / 4321.0 - 1.0).abs() < tight, "{name}: {preload}");
        }
        // and the simulation of that recording is the recording
        let again = cells(&simulate(&folder, &[&file]).0);
        let steady = |n: usize| run.velocity_m_s.as_ref().is_some_and(|v| v[n].abs() >= 3e-5);
        assert_eq!(again.len(), run.len());
        for (n, (_, force)) in again.iter().enumerate() {
            assert!(if steady(n) { (force - run.drag_force_n[n]).abs() < 1e-9 } else { force.is_nan() }, "{n}");
        }
    }
    let found = estimate(&folder, "staircase.csv", &["--staircase"]);
    let preload = found["staircase"]["preload_n"]["value"].as_f64().expect("fitted");
    assert_eq!(found["staircase"]["speeds"], 20);
    assert!((preload / 4321.0 - 1.0).abs() < 2e-5, "{preload}");
}

#[test]
fn an_axis_without_a_guide_is_driven_with_its_mass() {
    let folder = folder("axis");
    let axis = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20\n\
                viscous_n_s_m = 100\noffset_n = 2\n[axis]\nmoved_mass_kg = 50\n";
    fs::write(folder.join("sim.toml"), axis).expect("writable");
    simulate(
        &folder,
        &["--profile", "map", "--speeds-m-min", "6", "--strokes", "1", "--rate", "1000", "--out", "m.csv"],
    );
    let text = fs::read_to_string(folder.join("m.csv")).expect("written");
    assert_eq!(text.lines().next(), Some("time_s,position_m,velocity_m_s,drag_force_n,segment"));
    let run = read(&folder, "m.csv");
    let velocity = run.velocity_m_s.as_ref().expect("written");
    let mut fastest = 0.0f64;
    for n in 1..run.len() - 1 {
        // three rows around: right but for the first and last of a ramp, where the acceleration has a corner
        let a = (velocity[n + 1] - velocity[n - 1]) * 500.0;
        let sign = if velocity[n].abs() < 3e-5 { 0.0 } else { velocity[n].signum() };
        let expected = sign * (20.0 + 100.0 * velocity[n].abs()) + 2.0 + 50.0 * a;
        assert!((run.drag_force_n[n] - expected).abs() < 0.2, "{n}: {} {expected}", run.drag_force_n[n]);
        fastest = fastest.max(a.abs());
    }
    assert!((fastest - 0.5).abs() < 1e-3, "{fastest}");
}

#[test]
fn the_ladder_is_the_paper_s_grid_and_each_segment_tells_its_preload() {
    let folder = folder("ladder");
    simulate(&folder, &["--profile", "ladder", "--out", "ladder.csv"]);
    let run = read(&folder, "ladder.csv");
    assert_eq!(run.parts.len(), 10);
    let exact = Exact::new(GUIDE, FRICTION);
    for (n, part) in run.parts.iter().enumerate() {
        let truth = run.preload_n.as_ref().expect("written")[part.rows.start];
        let q = exact.load_of_lateral_force(500.0 + 1000.0 * n as f64).expect("within the geometry");
        assert_eq!(truth, exact.preload_n(q));
        assert_eq!(part.segment, Some(n as i64 + 1));
        let only = format!("segment={}", n + 1);
        let found = estimate(&folder, "ladder.csv", &["--where", &only, "--staircase"]);
        let preload = found["staircase"]["preload_n"]["value"].as_f64().expect("fitted");
        assert_eq!(found["staircase"]["speeds"], 20);
        assert!((preload / truth - 1.0).abs() < 2e-5, "{preload} {truth}");
    }
}

#[test]
fn a_reversal_turns_where_it_should() {
    let folder = folder("reversal");
    simulate(&folder, &["--profile", "reversal", "--amplitudes", "1e-3", "--frequencies", "0.5", "--out", "r.csv"]);
    let run = read(&folder, "r.csv");
    let moving = run.drag_force_n.iter().filter(|f| **f != 0.0);
    assert_eq!(moving.collect::<Vec<_>>().windows(2).filter(|w| *w[0] * *w[1] < 0.0).count(), 9);
    assert_eq!(run.time_s.last(), Some(&11.0));
}

#[test]
fn the_oil_of_a_warm_up_gets_thinner() {
    let folder = folder("thin");
    fs::write(
        folder.join("sim.toml"),
        "schema = \"guideblock.simulation/1\"\n[guide]\n[operation]\npreload_n = 3000\n",
    )
    .expect("writable");
    let warm = ["--profile", "warmup", "--out", "w.csv", "--run", "2000", "--stop", "0", "--resume", "0"];
    let (_, said) = simulate(&folder, &warm);
    assert!(!said.contains("which the oil's viscosity needs"), "{said}");
    let run = read(&folder, "w.csv");
    let exact = Exact::new(GUIDE, FRICTION);
    let q = exact.load_of_preload(3000.0).expect("within the geometry");
    let (temperature, velocity) =
        (run.temperature_block_degc.as_ref().expect("written"), run.velocity_m_s.as_ref().expect("written"));
    for n in (100..run.len()).step_by(997).filter(|n| velocity[*n].abs() >= 3e-5) {
        let t = 22.0 + 10.0 * (1.0 - (-run.time_s[n] / 900.0).exp());
        assert!((temperature[n] - t).abs() < 1e-9);
        let expected = exact.drag_force_n(q, viscosity_cst(t), velocity[n].abs()).copysign(velocity[n]);
        assert!((run.drag_force_n[n] - expected).abs() < 1e-6, "{n}");
    }
    // where no profile has temperatures, one is taken and named
    let (_, said) = simulate(&folder, &["--profile", "map", "--out", "m.csv"]);
    assert!(said.starts_with("block and rail at 40 °C, which the oil's viscosity needs"), "{said}");
    assert!(read(&folder, "m.csv").temperature_rail_degc.is_some_and(|column| column.iter().all(|t| *t == 40.0)));
}

#[test]
fn sensors_disturb_as_much_as_told_and_a_seed_gives_the_same_bytes() {
    let folder = folder("sensors");
    let of = |name: &str, options: &[&str]| {
        simulate(&folder, &[&["--profile", "map", "--strokes", "1", "--out", name], options].concat());
        (read(&folder, name), fs::read(folder.join(name)).expect("written"))
    };
    let (clean, _) = of("clean.csv", &[]);
    let noise = ["--noise-relative", "0.01", "--noise-n", "0.1"];
    let (noisy, bytes) = of("a.csv", &noise);
    assert_eq!(of("b.csv", &noise).1, bytes);
    assert_eq!(of("c.csv", &[&noise[..], &["--seed", "1"]].concat()).1, bytes);
    assert_ne!(of("d.csv", &[&noise[..], &["--seed", "2"]].concat()).1, bytes);
    // standardised residuals of some 28 000 rows: 1 to 1.3 % at three standard errors
    let square: f64 = noisy
        .drag_force_n
        .iter()
        .zip(&clean.drag_force_n)
        .map(|(f, truth)| ((f - truth) / (0.01 * truth).hypot(0.1)).powi(2))
        .sum();
    let size = (square / clean.len() as f64).sqrt();
    assert!((size - 1.0).abs() < 0.013, "{size}");
    assert_eq!((&noisy.velocity_m_s, &noisy.position_m), (&clean.velocity_m_s, &clean.position_m));

    let (stepped, _) = of("e.csv", &["--quantum-n", "0.5", "--position-quantum-m", "1e-5", "--speed-noise", "1e-4"]);
    for (f, truth) in stepped.drag_force_n.iter().zip(&clean.drag_force_n) {
        assert!((f / 0.5).fract() == 0.0 && (f - truth).abs() <= 0.25 + 1e-12, "{f} {truth}");
    }
    let speeds = |run: &Run| run.velocity_m_s.clone().expect("written");
    let square: f64 = speeds(&stepped).iter().zip(speeds(&clean)).map(|(a, b)| (a - b) * (a - b)).sum();
    assert!(((square / clean.len() as f64).sqrt() / 1e-4 - 1.0).abs() < 0.013);

    // a reversal from -F to F through 1 Hz: after a time constant 1/e of the step is left
    let (filtered, _) = of("f.csv", &["--lowpass-hz", "1"]);
    let turn = clean.drag_force_n.windows(2).position(|w| w[0] == 0.0 && w[1] < 0.0).expect("it comes back") + 1;
    let lag = 1.0 / std::f64::consts::TAU;
    let later = turn + (lag * 250.0) as usize;
    let (low, high) = (filtered.drag_force_n[turn - 1], clean.drag_force_n[later]);
    let left = (filtered.drag_force_n[later] - high) / (low - high);
    assert!((left - (-1.0f64).exp()).abs() < 0.03, "{left}");

    let (block, _) = of("g.csv", &["--sensors", "block"]);
    assert!(block.velocity_m_s.is_none());
    assert!(block.drag_force_n.iter().all(|f| (f / (100.0 / 2048.0)).fract() == 0.0));
    let square: f64 = block.drag_force_n.iter().zip(&clean.drag_force_n).map(|(a, b)| (a - b) * (a - b)).sum();
    let sigma = (square / clean.len() as f64).sqrt() / (100.0 / 2048.0);
    // 1.5 codes and the twelfth of rounding
    assert!((sigma / (1.5f64 * 1.5 + 1.0 / 12.0).sqrt() - 1.0).abs() < 0.02, "{sigma}");
    let found = estimate(&folder, "g.csv", &[]);
    assert!((found["preload_n"].as_f64().expect("a number") / 3000.0 - 1.0).abs() < 1e-3, "{found}");
}

#[test]
fn the_summary_is_json_and_the_page_has_pictures() {
    let folder = folder("summary");
    let stairs = ["--profile", "staircase", "--out", "s.csv", "--json", "--html", "s.html", "--noise-n", "0.2"];
    let (stdout, _) = simulate(&folder, &stairs);
    let object: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    let run = read(&folder, "s.csv");
    assert_eq!(
        (&object["schema"], &object["samples"], &object["segments"], &object["sensors"]["noise_n"]),
        (&"guideblock.driven/1".into(), &run.len().into(), &2.into(), &0.2.into())
    );
    let (stdout, _) = simulate(&folder, &["s.csv", "--out", "o.csv", "--json", "--html", "o.html"]);
    let object: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    let (values, rest) = (object["values"].as_u64(), object["empty"]["rest"].as_u64());
    assert_eq!(values.zip(rest).map(|(a, b)| a + b), Some(run.len() as u64));
    let difference = object["difference_rms_n"].as_f64().expect("a number");
    assert!((difference / 0.2 - 1.0).abs() < 0.01, "{difference}");
    for (page, legend) in [("s.html", "as the sensors show it"), ("o.html", "recorded")] {
        let page = fs::read_to_string(folder.join(page)).expect("written");
        assert!(page.matches("<svg").count() == 3 && page.contains(legend));
        assert!(page.contains("prefers-color-scheme:dark") && !page.contains("NaN"));
    }
}

#[test]
fn wrong_usage_and_missing_columns_have_their_status() {
    let folder = folder("status");
    let text = record(300, |n| ["0.01".to_owned(), (n % 5).to_string(), "3000".to_owned(), String::new()]);
    fs::write(folder.join("run.csv"), text).expect("writable");
    let walther = "schema = \"guideblock.simulation/1\"\n[guide]\n";
    fs::write(folder.join("walther.toml"), walther).expect("writable");
    fs::write(folder.join("column.toml"), "schema = \"guideblock.simulation/1\"\n").expect("writable");
    fs::write(folder.join("bad.toml"), "schema = \"guideblock.simulation/1\"\n[guide]\nballs = 3\n").expect("writable");
    let axis = "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 3\n";
    fs::write(folder.join("axis.toml"), axis).expect("writable");
    for (arguments, status, message) in [
        (
            &["run.csv", "--simulation", "walther.toml"][..],
            3,
            "run.csv: the recording has no column temperature_block_degc",
        ),
        (&["run.csv", "--simulation", "column.toml"], 3, "run.csv: the recording has no column simulated_force_n"),
        (&["run.csv", "--simulation", "axis.toml"], 3, "run.csv: guide.viscous_n_s_m is not in the simulation"),
        (&["run.csv", "--simulation", "bad.toml"], 3, "bad.toml: line 3, column 1: "),
        (&["run.csv", "--simulation", "none.toml"], 2, "none.toml: there is no such file"),
        (&["none.csv", "--simulation", "sim.toml"], 2, "none.csv: there is no such file"),
        (&["run.csv", "--simulation", "sim.toml", "--out", "o.xlsx"], 2, "o.xlsx: name it .csv or .parquet"),
        (
            &["run.csv", "--simulation", "sim.toml", "--out", "run.csv"],
            2,
            "run.csv: --out would overwrite what RECORDING reads",
        ),
        (&["run.csv", "--simulation", "sim.toml", "--json"], 2, "--out"),
        (&["run.csv", "--simulation", "sim.toml", "--noise-n", "1"], 2, "--profile"),
        (&["--simulation", "sim.toml"], 2, "give a recording, `simulate RUN.csv`, or a test profile"),
        (&["run.csv", "--profile", "map", "--simulation", "sim.toml"], 2, "one of the two"),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--where", "a=1"],
            2,
            "--where and --column are for a recording",
        ),
        (&["--profile", "map", "--simulation", "walther.toml"], 2, "no operation.preload_n; give --preload"),
        (&["--profile", "map", "--simulation", "column.toml"], 3, "the simulation has no law"),
        (
            &["--profile", "map", "--simulation", "axis.toml"],
            3,
            "axis.toml: guide.viscous_n_s_m is not in the simulation",
        ),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--dwells", "1"],
            2,
            "--dwells means nothing to --profile map",
        ),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--speeds", "0.1,30"],
            2,
            "--profile map: --speeds must lie between 0.000001 and 20 m/s, not 30",
        ),
        (&["--profile", "map", "--simulation", "sim.toml", "--length", "0.01"], 2, "a stroke of 0.01 m is too short"),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--rate", "0"],
            2,
            "--rate must lie between 1 and 100000 Hz",
        ),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--noise-n", "-1"],
            2,
            "--noise-n must lie between 0 and 10000 N, not -1",
        ),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--noise-n", "1e5"],
            2,
            "--noise-n must lie between 0 and 10000 N",
        ),
        (
            &["--profile", "map", "--simulation", "sim.toml", "--preload", "900000"],
            2,
            "no value at a preload of 900000 N",
        ),
        (&["--profile", "ladder", "--simulation", "sim.toml", "--order", "both"], 2, "one segment per preload"),
        (&["--profile", "ladder", "--simulation", "sim.toml", "--preload", "9"], 2, "--preload means nothing"),
        (&["run.csv", "--simulation", "sim.toml", "--seed", "3"], 2, "--profile"),
        (&["--profile", "dwell", "--simulation", "sim.toml", "--dwells", "9,1"], 2, "dwells must grow"),
        (&["--profile", "dwell", "--simulation", "sim.toml", "--speeds", "1,2"], 2, "--speeds takes one value here"),
        (&["--profile", "warmup", "--simulation", "sim.toml", "--rate", "100000"], 2, "million rows"),
        (
            &["--profile", "warmup", "--simulation", "sim.toml", "--run", "0", "--stop", "0", "--resume", "0"],
            2,
            "--run needs",
        ),
        (&["--profile", "wobble", "--simulation", "sim.toml"], 2, "staircase"),
    ] {
        let (got, stdout, stderr) = guideblock(&folder, &[&["simulate"], arguments].concat());
        assert_eq!((got, &*stdout), (Some(status), ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let folder = folder("closed");
    let arguments = ["simulate", "--simulation", "sim.toml", "--profile", "map"];
    let mut child = command(&folder, &arguments).spawn().expect("the binary");
    let mut first = [0; 100];
    child.stdout.take().expect("piped").read_exact(&mut first).expect("there is that much");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()), (Some(0), String::new()));
}

#[test]
fn a_simulation_along_a_long_recording_has_a_row_for_each_of_its_rows() {
    let folder = folder("long");
    let driven = ["--profile", "warmup", "--rate", "1000", "--run", "300", "--stop", "0", "--resume", "0"];
    simulate(&folder, &[&driven[..], &["--noise-n", "0.1", "--out", "driven.csv"]].concat());
    simulate(&folder, &["driven.csv", "--out", "along.csv"]);
    let lines =
        |name: &str| fs::read(folder.join(name)).expect("written").iter().filter(|byte| **byte == b'\n').count();
    assert!((300_000..316_000).contains(&lines("driven.csv")), "{}", lines("driven.csv"));
    assert_eq!(lines("driven.csv"), lines("along.csv"));
    fs::remove_dir_all(&folder).expect("it was made here");
}
