//! No command writes over what it reads, and none writes one file twice.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const SIMULATION: &str = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                          viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";

/// Exit status and standard error of a command in a folder.
fn guideblock(folder: &Path, arguments: &str) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
    let output = command.current_dir(folder).args(arguments.split(' ')).output().expect("runs");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("outputs").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("sub")).unwrap();
    fs::write(folder.join("sim.toml"), SIMULATION).unwrap();
    fs::write(folder.join("bench.toml"), "schema = \"guideblock.bench/1\"\n").unwrap();
    fs::write(folder.join("bus.log"), "").unwrap();
    let make = "simulate --profile staircase --noise-n 0.1 --rate 50 --simulation sim.toml --out run.csv";
    assert_eq!(guideblock(&folder, make).0, Some(0));
    assert_eq!(guideblock(&folder, "parameters --bench bench.toml --out block.bin").0, Some(0));
    folder
}

#[test]
fn inputs_are_never_written_over() {
    let folder = folder("inputs");
    let files = ["run.csv", "sim.toml", "bench.toml", "block.bin", "bus.log"];
    let contents = || files.map(|name| fs::read(folder.join(name)).unwrap());
    let before = contents();
    for (arguments, file, output, input) in [
        ("diagnose run.csv --simulation sim.toml --export run.csv", "run.csv", "--export", "RECORDING"),
        (
            "diagnose run.csv --simulation sim.toml --export sub/../sim.toml",
            "sub/../sim.toml",
            "--export",
            "--simulation",
        ),
        ("diagnose run.csv --simulation sim.toml --json ./run.csv", "./run.csv", "--json", "RECORDING"),
        ("diagnose bus.log --holdout run.csv --simulation sim.toml --html run.csv", "run.csv", "--html", "--holdout"),
        ("estimate run.csv --out run.csv", "run.csv", "--out", "RECORDING"),
        ("estimate run.csv --html run.csv", "run.csv", "--html", "RECORDING"),
        ("estimate run.csv --guide sim.toml --html sim.toml", "sim.toml", "--html", "--guide"),
        ("simulate run.csv --out run.csv", "run.csv", "--out", "RECORDING"),
        ("simulate run.csv --out new.csv --html run.csv", "run.csv", "--html", "RECORDING"),
        ("calibrate run.csv --record run.csv", "run.csv", "--record", "RECORDING"),
        ("calibrate run.csv --record new --bench bench.toml --out bench.toml", "bench.toml", "--out", "--bench"),
        ("image sim.toml --out sim.toml", "sim.toml", "--out", "SIMULATION"),
        ("image sim.toml --record block.bin --out block.bin", "block.bin", "--out", "--record"),
        ("parameters --bench bench.toml --out bench.toml", "bench.toml", "--out", "--bench"),
        ("convert run.csv ./run.csv", "./run.csv", "OUT", "IN"),
        ("record --from bus.log --out bus.log", "bus.log", "--out", "--from"),
        ("record --from desk --parameters block.bin --out block.bin", "block.bin", "--out", "--parameters"),
    ] {
        let what = format!("{output} would overwrite what {input} reads; give the result another name");
        assert_eq!(guideblock(&folder, arguments), (Some(2), format!("guideblock: {file}: {what}\n")), "{arguments}");
    }
    assert!(contents() == before, "something was written");
}

#[test]
fn outputs_are_apart() {
    let folder = folder("apart").join("sub");
    for arguments in [
        "diagnose ../run.csv --simulation ../sim.toml --json same --html ../sub/same",
        "simulate ../run.csv --out same.csv --html same.csv",
        "calibrate ../run.csv --out same --record ./same",
    ] {
        let (status, said) = guideblock(&folder, arguments);
        assert_eq!(status, Some(2), "{arguments}: {said}");
        assert!(said.contains(" would both write it; give each a name of its own"), "{said}");
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0, "nothing is written");
    // what takes everything and keeps nothing may be named twice
    let (status, said) = guideblock(&folder, "estimate ../run.csv --guide ../sim.toml --out new.csv --html /dev/null");
    assert_eq!(status, Some(0), "{said}");
    let (status, said) = guideblock(&folder, "paper --html /dev/stdout");
    assert_eq!(status, Some(0), "{said}");
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left beside the result");
}
