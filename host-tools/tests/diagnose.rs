//! `guideblock diagnose`: nothing made up, what was concealed found and modelled, and no input that makes it stumble.
//!
//! The recordings here are made by this project's own simulation, so that they show the path from end to end and no
//! more; whether causes are named on recordings of another hand is what `tests/concealed` is for.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

const SIMULATION: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                          viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("diagnose").join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn guideblock(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guideblock")).args(arguments).output().expect("runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A ladder driven under a simulation file, 1 % of noise.
fn record(folder: &Path, simulation: &str, seed: &str) -> String {
    let (file, run) = (folder.join("concealed.toml"), folder.join(format!("run-{seed}.csv")).display().to_string());
    fs::write(&file, simulation).unwrap();
    let output = guideblock(&[
        "simulate",
        "--profile",
        "ladder",
        "--preloads",
        "1500,3000,5000",
        "--speeds",
        "0.003,0.01,0.03,0.08",
        "--rate",
        "100",
        "--noise-n",
        "0.3",
        "--seed",
        seed,
        "--simulation",
        file.to_str().unwrap(),
        "--out",
        &run,
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    run
}

fn diagnose(recordings: &[&str], simulation: &Path, more: &[&str]) -> (Option<i32>, Value, String) {
    let mut arguments = vec!["diagnose"];
    arguments.extend(recordings);
    arguments.extend(["--simulation", simulation.to_str().unwrap(), "--json", "-"]);
    arguments.extend(more);
    let output = guideblock(&arguments);
    let stderr = text(&output.stderr);
    assert!(!stderr.contains("panicked"), "{stderr}");
    (output.status.code(), serde_json::from_slice(&output.stdout).unwrap_or(Value::Null), stderr)
}

#[test]
fn a_simulation_that_fits_is_left_alone() {
    let folder = folder("clean");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let run = record(&folder, SIMULATION, "1");
    let (status, found, stderr) = diagnose(&[&run], &simulation, &[]);
    assert_eq!((status, &found["verdict"]), (Some(0), &Value::from("match")), "{found:#} {stderr}");
    assert_eq!(found["mechanisms"].as_array().map(Vec::len), Some(0));
}

#[test]
fn seals_that_were_left_out_are_named_modelled_and_found_once() {
    let folder = folder("seals");
    let [simulation, augmented, page] = ["sim.toml", "augmented.toml", "page.html"].map(|n| folder.join(n));
    fs::write(&simulation, SIMULATION).unwrap();
    let concealed = format!("{SIMULATION}[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 2.5\n");
    let (run, other) = (record(&folder, &concealed, "2"), record(&folder, &concealed, "3"));
    let more = ["--holdout", &other, "--export", augmented.to_str().unwrap(), "--html", page.to_str().unwrap()];
    let (status, found, _) = diagnose(&[&run], &simulation, &more);
    assert_eq!(status, Some(1), "{found:#}");
    let first = &found["mechanisms"][0];
    assert_eq!(first["id"], "seal-drag", "{found:#}");
    let error = |stage: &str| found["holdout"][stage].as_f64().unwrap();
    assert!(error("rmse_after_n") < 0.35 && error("rmse_calibrated_n") > 0.5, "{found:#}");
    let there = &first["on_holdout"]["ci95"];
    let holds_one = there[0].as_f64().unwrap() < 1.0 && there[1].as_f64().unwrap() > 1.0;
    assert!(first["carried_over"] == true && holds_one, "{first:#}");
    assert!(fs::read_to_string(page).unwrap().contains("seal-drag"));

    // the file that knows it leaves nothing to be found
    let (status, again, _) = diagnose(&[&other], &augmented, &[]);
    assert_eq!((status, &again["verdict"]), (Some(0), &Value::from("match")), "{again:#}");
}

/// What calibration moves of the preload is exported as the scale of its column, too, and goes with recordings that have none.
#[test]
fn what_is_exported_takes_a_recording_without_a_preload() {
    let folder = folder("no-preload");
    let [simulation, augmented] = ["sim.toml", "augmented.toml"].map(|name| folder.join(name));
    fs::write(&simulation, SIMULATION).unwrap();
    let concealed = format!("{SIMULATION}[[mechanism]]\nid = \"force-offset\"\noffset_n = 2.0\n");
    let whole = fs::read_to_string(record(&folder, &concealed, "4")).unwrap();
    let place = whole.lines().next().unwrap().split(',').position(|name| name == "preload_n").unwrap();
    let bare = folder.join("bare.csv").display().to_string();
    // the part at 3000 N, as the simulation says, without the column that says so
    let parts = whole.lines().filter(|line| [Some("preload_n"), Some("3000")].contains(&line.split(',').nth(place)));
    let without = |line: &str| {
        let cells: Vec<&str> = line.split(',').enumerate().filter(|(n, _)| *n != place).map(|(_, cell)| cell).collect();
        cells.join(",") + "\n"
    };
    fs::write(&bare, parts.map(without).collect::<String>()).unwrap();
    let (status, found, _) = diagnose(&[&bare], &simulation, &["--export", augmented.to_str().unwrap()]);
    assert_eq!((status, &found["mechanisms"][0]["id"]), (Some(1), &Value::from("force-offset")), "{found:#}");
    assert!(fs::read_to_string(&augmented).unwrap().contains("\"preload_n:"), "calibration moved no preload");
    let (status, again, stderr) = diagnose(&[&bare], &augmented, &[]);
    assert_eq!((status, &again["verdict"]), (Some(0), &Value::from("match")), "{again:#} {stderr}");
}

/// What the page of formats shows for copying is a simulation file, and its keys are all there are.
#[test]
fn the_page_of_formats_is_true() {
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/formats.md")).unwrap();
    let examples: Vec<&str> = page.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(examples.len(), 2);
    for example in examples {
        simulation::Simulation::from_toml(example).expect("an example that can be copied");
    }
    for column in host_tools::recording::axis::names() {
        assert!(page.contains(&format!("`{column}`")), "{column} is not on the page");
    }
    // the reader lists what it knows where it knows not
    for section in ["guide", "lubricant", "operation", "axis", "tolerance", "simulated_force"] {
        let file = format!("schema = \"guideblock.simulation/1\"\n[{section}]\nno_such_key = 1\n");
        let said = simulation::Simulation::from_toml(&file).expect_err("no such key").to_string();
        let known = said.split("there are: ").nth(1).expect("the known keys");
        for key in known.split(", ") {
            assert!(page.contains(&format!("`{}`", key.trim())), "{section}.{key} is not on the page");
        }
    }
}

/// Rows that teach the search cannot score it: the same file, a copy of it, and a part of it are refused.
#[test]
fn a_holdout_that_the_search_has_seen_is_refused() {
    let folder = folder("twins");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let run = record(&folder, SIMULATION, "5");
    let lines = fs::read_to_string(&run).unwrap();
    let part = folder.join("part.csv").display().to_string();
    let rows = lines.split_inclusive('\n').enumerate().filter(|(n, _)| *n == 0 || (1000..4000).contains(n));
    fs::write(&part, rows.map(|(_, line)| line).collect::<String>()).unwrap();
    let copy = folder.join("copy.parquet").display().to_string();
    assert!(guideblock(&["convert", &run, &copy]).status.success());
    for (searched, held) in [(&run, &run), (&run, &copy), (&run, &part), (&part, &copy)] {
        let (status, _, stderr) = diagnose(&[searched], &simulation, &["--holdout", held]);
        assert_eq!(status, Some(2), "{held}: {stderr}");
        assert!(stderr.contains(&format!("--holdout {held}: holds the rows of {searched}")), "{stderr}");
    }
}

/// An error of rows that cannot be compared is no number.
#[test]
fn a_holdout_at_rest_scores_nothing() {
    let folder = folder("rest");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let concealed = format!("{SIMULATION}[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 2.5\n");
    let (run, other) = (record(&folder, &concealed, "2"), record(&folder, &concealed, "3"));
    let lines = fs::read_to_string(&other).unwrap();
    let names: Vec<&str> = lines.lines().next().unwrap().split(',').collect();
    let at_rest = |(n, line): (usize, &str)| {
        let cells = names.iter().zip(line.split(',')).map(|(name, cell)| match *name {
            "position_m" if n > 0 => "0.5",
            "velocity_m_s" | "acceleration_m_s2" if n > 0 => "0",
            _ => cell,
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    };
    let still = folder.join("still.csv").display().to_string();
    fs::write(&still, lines.lines().enumerate().map(at_rest).collect::<String>()).unwrap();
    let (_, found, stderr) = diagnose(&[&run], &simulation, &["--holdout", &still]);
    let holdout = &found["holdout"];
    assert_eq!(found["mechanisms"][0]["id"], "seal-drag", "{found:#} {stderr}");
    assert!(holdout["intervals_s"].as_array().unwrap().is_empty() && holdout["rmse_after_n"] == 0.0, "{holdout:#}");
    assert_eq!(found["mechanisms"][0]["on_holdout"], Value::Null, "{found:#}");
    let warnings = found["data_quality"]["warnings"].to_string();
    assert!(warnings.contains("nothing is scored there"), "{warnings}");
}

#[test]
fn the_same_input_gives_the_same_bytes_from_one_thread_or_two() {
    let folder = folder("same");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let run = record(&folder, &format!("{SIMULATION}[[mechanism]]\nid = \"force-offset\"\noffset_n = 1.0\n"), "4");
    let arguments = ["diagnose", &run, "--simulation", simulation.to_str().unwrap(), "--json", "-"];
    let once = guideblock(&arguments).stdout;
    assert_eq!(once, guideblock(&arguments).stdout);
    // one core is one thread everywhere in this program
    let pinned = Command::new("taskset").args(["-c", "0", env!("CARGO_BIN_EXE_guideblock")]).args(arguments).output();
    match pinned {
        Ok(output) => assert_eq!(once, output.stdout),
        Err(_) => eprintln!("skipped: this system has no taskset"),
    }
}

/// A simulation file that is none is unusable data, as it is to every other command that reads one.
/// What one can do about it differs: another run, or another file.
#[test]
fn a_motion_that_allows_no_judgement_is_told_from_a_file_of_no_use() {
    let folder = folder("refused");
    let (guide, lawless) = (folder.join("guide.toml"), folder.join("lawless.toml"));
    fs::write(&guide, SIMULATION).unwrap();
    fs::write(&lawless, "schema = \"guideblock.simulation/1\"\n").unwrap();
    let file = |name: &str, row: &dyn Fn(f64) -> [f64; 2]| {
        let rows = (0..2000).map(|n| {
            let [position_m, drag_n] = row(f64::from(n) * 0.01);
            format!("{},{position_m},{},3000\n", f64::from(n) * 0.01, drag_n + 0.1 * f64::from(n * 7919 % 13))
        });
        let path = folder.join(name);
        fs::write(&path, "time_s,position_m,drag_force_n,preload_n\n".to_owned() + &rows.collect::<String>()).unwrap();
        path.display().to_string()
    };
    let sound = file("sound.csv", &|time_s| [0.1 * time_s.sin(), 20.0 * time_s.cos().signum()]);
    let still = file("still.csv", &|_| [0.1, 0.0]);
    let other_unit = file("other-unit.csv", &|time_s| [15.0 * time_s.sin(), 20.0 * time_s.cos().signum()]);
    for (recording, simulation, expected, reason) in [
        (&still, &guide, 0, "the carriage hardly moves"),
        (&other_unit, &guide, 3, "the carriage would move at"),
        (&sound, &lawless, 3, "no column simulated_force_n"),
    ] {
        let (status, found, stderr) = diagnose(&[recording], simulation, &[]);
        assert_eq!((status, &found["verdict"]), (Some(expected), &"insufficient-data".into()), "{recording}: {stderr}");
        assert!(found["data_quality"]["warnings"].to_string().contains(reason), "{recording}: {found:#}");
        // what is wrong with a file is said where messages go, too
        assert_eq!(stderr.contains(reason), expected == 3, "{recording}: {stderr}");
    }
}

#[test]
fn a_bad_simulation_file_has_the_status_of_bad_data() {
    let folder = folder("bad");
    let (sound, run) = (folder.join("sim.toml"), folder.join("run.csv").display().to_string());
    fs::write(&sound, SIMULATION).unwrap();
    let rows = (0..300).map(|n| format!("{},{},20\n", f64::from(n) * 0.01, f64::from(n) * 0.0005));
    fs::write(&run, rows.fold("time_s,position_m,drag_force_n\n".to_owned(), |all, row| all + &row)).unwrap();
    let columns = format!("{SIMULATION}[columns]\ndrag_force_n = \"tau:x\"\n");
    for (name, bytes, message) in [
        ("key.toml", SIMULATION.replace("preload_n", "preload").into_bytes(), "key.toml: line 7, column 1: "),
        (
            "columns.toml",
            columns.into_bytes(),
            "columns.toml: line 9, column 1: columns.drag_force_n: the scale \"x\" of drag_force_n is not a finite number",
        ),
        (
            "name.toml",
            format!("{SIMULATION}[columns]\nfoo = \"bar:2\"\n").into_bytes(),
            "name.toml: line 9, column 1: nothing reads a column foo; there are: time_s, ",
        ),
        ("binary.toml", b"PAR1\xff\xfe".to_vec(), "binary.toml: this is no text; a simulation file is TOML"),
    ] {
        let simulation = folder.join(name);
        fs::write(&simulation, bytes).unwrap();
        let simulation = simulation.to_str().unwrap();
        for arguments in [
            &["diagnose", &run, "--simulation", simulation][..],
            &["simulate", &run, "--simulation", simulation],
            &["estimate", &run, "--guide", simulation],
            &["calibrate", &run, "--guide", simulation],
        ] {
            let output = guideblock(arguments);
            let stderr = text(&output.stderr);
            assert_eq!(output.status.code(), Some(3), "{arguments:?}: {stderr}");
            assert!(stderr.contains(message), "{arguments:?}: {stderr}");
        }
    }
    let (status, _, stderr) = diagnose(&[&run], &folder.join("none.toml"), &[]);
    assert_eq!(status, Some(2), "{stderr}");
}

#[test]
fn a_recording_counts_once() {
    let folder = folder("twice");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let run = record(&folder, SIMULATION, "1");
    let copy = folder.join("copy.csv").display().to_string();
    fs::copy(&run, &copy).unwrap();
    for other in [&run, &copy] {
        let (status, _, stderr) = diagnose(&[&run, other], &simulation, &[]);
        assert_eq!(status, Some(2), "{stderr}");
        assert!(stderr.contains(&format!("{other}: holds the rows of {run}: rows that count twice")), "{stderr}");
    }
}

/// A negative value reaches the option that refuses it, and what reading cost is said once.
#[test]
fn messages_are_those_of_the_option_and_come_once() {
    let folder = folder("once");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let run = record(&folder, SIMULATION, "1");
    let (status, _, stderr) = diagnose(&[&run], &simulation, &["--seed", "-1"]);
    assert_eq!(status, Some(2));
    assert!(stderr.contains("'-1'") && stderr.contains("a seed is a whole number from 0 to 2^64 - 1"), "{stderr}");
    let rows = fs::read_to_string(&run).unwrap();
    let without: Vec<_> = rows.lines().enumerate().filter(|(n, _)| *n != 700).map(|(_, line)| line).collect();
    fs::write(&run, without.join("\n") + "\n").unwrap();
    let output = guideblock(&["diagnose", &run, "--simulation", simulation.to_str().unwrap()]);
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(stderr.contains("1 row missing: 0.02 s since the last one, steps are 0.01 s"), "{stderr}");
    assert!(!stderr.contains("rows lost") && !stdout.contains("missing:"), "{stderr}{stdout}");
}

/// The commands of the README's section on diagnosis print what it says they do.
#[test]
fn the_readme_shows_what_is_printed() {
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md")).unwrap();
    let folder = folder("readme");
    let run = |arguments: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
        command.current_dir(&folder).args(arguments.split(' ')).output().expect("runs")
    };
    let of_section = |start: &'static str| {
        let line = readme.lines().find(|line| line.starts_with(start)).expect("a command of the README");
        line["guideblock ".len()..].split("  #").next().unwrap().trim().to_owned()
    };
    for start in ["guideblock simulate --profile ladder", "guideblock calibrate ladder"] {
        assert!(run(&of_section(start)).status.success(), "{start}");
    }
    let guide = fs::read_to_string(folder.join("guide.toml")).unwrap();
    let simulation = format!("{guide}[operation]\npreload_n = 3000.0\n");
    fs::write(folder.join("sim.toml"), &simulation).unwrap();
    let seals = "[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 2.0\n";
    fs::write(folder.join("real.toml"), format!("{simulation}{seals}")).unwrap();
    let simulates = "guideblock simulate --profile staircase --simulation real.toml";
    let drives: Vec<_> = readme.lines().filter(|line| line.starts_with(simulates)).collect();
    assert_eq!(drives.len(), 2);
    for drive in drives {
        assert!(run(&drive["guideblock ".len()..]).status.success(), "{drive}");
    }
    let printed = text(&run(&of_section("guideblock diagnose worn.csv")).stdout);
    let told = readme.split("```text\nnothing missing").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    for line in format!("nothing missing{told}").lines() {
        assert!(printed.lines().any(|own| own == line), "not printed: {line}\n{printed}");
    }
}

#[test]
fn without_any_force_to_compare_with_there_is_no_verdict() {
    let folder = folder("no-law");
    let simulation = folder.join("sim.toml");
    let run = record(&folder, SIMULATION, "1");
    fs::write(&simulation, "schema = \"guideblock.simulation/1\"\n").unwrap();
    let (status, _, stderr) = diagnose(&[&run], &simulation, &[]);
    assert_eq!(status, Some(3), "{stderr}");
    assert!(stderr.contains("no column simulated_force_n and the simulation no [guide]; add [guide]"), "{stderr}");
}

/// Files that nobody should hand in get a clear answer, and never a panic.
#[test]
fn no_input_makes_it_stumble() {
    let folder = folder("odd");
    let simulation = folder.join("sim.toml");
    fs::write(&simulation, SIMULATION).unwrap();
    let file = |name: &str, rows: usize, row: &dyn Fn(usize) -> String| -> String {
        let path = folder.join(name);
        let header = "time_s,position_m,velocity_m_s,drag_force_n,preload_n,temperature_block_degc\n";
        fs::write(&path, (0..rows).fold(header.to_owned(), |all, n| all + &row(n) + "\n")).unwrap();
        path.display().to_string()
    };
    let wave = |n: usize| (n as f64 * 0.02).sin();
    let noise = |n: usize| ((n as f64 * 0.618_034).fract() - 0.5) * 0.2;
    let cases: Vec<(&str, String, &[i32])> = vec![
        (
            "constant force",
            file("constant.csv", 2000, &|n| {
                format!("{},{},{},5,3000,25", n as f64 * 0.01, wave(n) * 0.1, 0.2 * (n as f64 * 0.02).cos())
            }),
            &[3],
        ),
        ("no motion", file("still.csv", 2000, &|n| format!("{},0.1,0,{},3000,25", n as f64 * 0.01, noise(n))), &[0, 3]),
        (
            "twenty rows",
            file("twenty.csv", 20, &|n| {
                format!("{},{},0.05,{},3000,25", n as f64 * 0.01, n as f64 * 0.0005, 20.0 + noise(n))
            }),
            &[3],
        ),
        (
            "empty columns",
            file("empty.csv", 2000, &|n| {
                format!("{},{},{},{},,", n as f64 * 0.01, 0.0005 * n as f64, 0.05, 25.0 + noise(n))
            }),
            &[0, 1],
        ),
        (
            "huge numbers",
            file("huge.csv", 2000, &|n| {
                format!("{},{},0.05,{},3000,25", n as f64 * 0.01, 0.0005 * n as f64, 1e300 * noise(n))
            }),
            &[0, 1, 3],
        ),
        (
            "a force of nothing but noise",
            file("noise.csv", 2000, &|n| {
                format!("{},{},0.05,{},3000,25", n as f64 * 0.01, 0.0005 * n as f64, noise(n))
            }),
            &[0, 1, 3],
        ),
    ];
    for (name, path, allowed) in &cases {
        let (status, _, stderr) = diagnose(&[path], &simulation, &[]);
        assert!(status.is_some_and(|s| allowed.contains(&s)), "{name}: {status:?} {stderr}");
    }
    // an absurd simulation of a sound recording
    let sound = file("sound.csv", 4000, &|n| {
        let v = 0.2 * (n as f64 * 0.02).cos();
        format!("{},{},{v},{},3000,25", n as f64 * 0.01, wave(n) * 0.1, v.signum() * 25.0 + noise(n))
    });
    for absurd in [
        SIMULATION.replace("3000.0", "1e6"),
        SIMULATION.replace("3000.0", "0.0"),
        SIMULATION.replace("100.0", "1e-3"),
        format!("{SIMULATION}[axis]\nmoved_mass_kg = 1e5\n"),
        "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\n".to_owned(),
        "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 1e6\n".to_owned(),
    ] {
        let path = folder.join("absurd.toml");
        fs::write(&path, &absurd).unwrap();
        let (status, _, stderr) = diagnose(&[&sound], &path, &[]);
        assert!(matches!(status, Some(0..=3)), "{absurd}: {status:?} {stderr}");
    }
}
