//! Reading an hour of samples at 1 kHz, as CSV and as Parquet, beside what pandas takes for the same files; and writing one.
//!
//! ```sh
//! cargo bench --profile desk -p host-tools --bench reading
//! ```
//!
//! The files are made once, in the folder of cargo's artefacts. Memory is told of a process of its own that reads one
//! file once. pandas is asked where `python3` (or what `PYTHON` names) has it, with pyarrow for Parquet.
#![allow(clippy::expect_used, reason = "a benchmark that cannot run has nothing to say")]

use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use host_tools::recording::{Column, open, silent, write};
use simulation::run::Run;

/// One hour at 1 kHz.
const ROWS: usize = 3_600_000;

/// What this program is called with to read one file and tell its own memory.
const ONCE: &str = "--read-once";

fn read(file: &Path) -> Run {
    let (run, losses) = open(file, &[], &[], &silent).expect("it was made to be read");
    assert_eq!((run.len(), losses.lost, run.parts.len()), (ROWS, 0, 1));
    run
}

fn file(ending: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("hour").with_extension(ending)
}

/// A reciprocating carriage with friction that grows with speed, and white noise of 1 N peak to peak.
fn make() {
    let (csv, parquet) = (file("csv"), file("parquet"));
    if !csv.exists() {
        let partial = file("part");
        let mut out = BufWriter::with_capacity(1 << 20, fs::File::create(&partial).expect("writable"));
        writeln!(out, "time_s,position_m,velocity_m_s,drag_force_n").expect("writable");
        let mut seed = 12_345u64;
        for n in 0..ROWS {
            let time_s = n as f64 * 1e-3;
            seed ^= seed << 13;
            seed ^= seed >> 7;
            seed ^= seed << 17;
            let noise = (seed >> 40) as f64 / 16_777_216.0 - 0.5;
            let (position, velocity) = (0.15 * (0.7 * time_s).sin(), 0.105 * (0.7 * time_s).cos());
            let force = 20.0 * velocity.signum() + 80.0 * velocity + noise;
            writeln!(out, "{time_s:.3},{position:.7},{velocity:.6},{force:.4}").expect("writable");
        }
        out.flush().expect("writable");
        fs::rename(partial, &csv).expect("writable");
    }
    if !parquet.exists() {
        let run = read(&csv);
        let columns = [
            Column::numbers("time_s", &run.time_s),
            Column::numbers("position_m", run.position_m.as_deref().expect("there")),
            Column::numbers("velocity_m_s", run.velocity_m_s.as_deref().expect("there")),
            Column::numbers("drag_force_n", &run.drag_force_n),
        ];
        write(&parquet, &columns).expect("writable");
    }
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn csv() -> Run {
    read(&file("csv"))
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn parquet() -> Run {
    read(&file("parquet"))
}

/// The most memory this process ever had, where the system tells.
fn peak() -> String {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.map_or_else(|| "peak memory not told by this system".to_owned(), |kb| format!("peak memory {}", kb.trim()))
}

/// The whole of `guideblock estimate` on either file, from start to windows written, and its memory.
fn estimate() {
    const RUNS: usize = 9;
    for ending in ["csv", "parquet"] {
        let windows = file("windows.csv");
        let mut times: Vec<f64> = (0..RUNS)
            .map(|_| {
                let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
                command.arg("estimate").arg(file(ending)).args(["--viscosity", "100", "--json", "--out"]).arg(&windows);
                let start = Instant::now();
                let output = command.output().expect("runs");
                assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
                start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let (best, median) = (1e3 * times[0], 1e3 * times[RUNS / 2]);
        println!("guideblock estimate, {ending}, whole process: {best:.0} ms best of {RUNS}, {median:.0} ms median");
    }
}

/// `guideblock simulate` over an hour at 1 kHz: a driven profile with noise, and the force along its motion.
fn simulate() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("simulated");
    fs::create_dir_all(&folder).expect("writable");
    let law = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\nviscosity_cst = 100.0\n\
               [operation]\npreload_n = 3000.0\n";
    fs::write(folder.join("sim.toml"), law).expect("writable");
    let driven = "--profile warmup --rate 1000 --run 3599 --stop 0 --resume 0 --noise-n 0.1 --out driven.csv";
    for (what, arguments) in [("driven", driven), ("along a recording", "driven.csv --out along.csv")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
        command.current_dir(&folder).args(["simulate", "--simulation", "sim.toml"]).args(arguments.split(' '));
        let start = Instant::now();
        let output = command.output().expect("runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        println!("guideblock simulate, {what}, whole process: {:.1} s", start.elapsed().as_secs_f64());
    }
    fs::remove_dir_all(&folder).expect("it was made here");
}

fn pandas() {
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let script = "
import sys, time, pandas
def best(name, read, path):
    times = []
    for _ in range(5):
        start = time.perf_counter(); rows = len(read(path)); times.append(time.perf_counter() - start)
    print(f'pandas {pandas.__version__} {name}: {min(times) * 1e3:.0f} ms best of 5, {sorted(times)[2] * 1e3:.0f} ms median, {rows} rows')
best('read_csv (C engine)', pandas.read_csv, sys.argv[1])
try:
    import pyarrow
    best('read_parquet', pandas.read_parquet, sys.argv[2])
except ImportError:
    print('pyarrow is not there: no read_parquet')
";
    let run = Command::new(&python).args(["-c", script]).args([file("csv"), file("parquet")]).output();
    match run {
        Ok(output) if output.status.success() => print!("{}", String::from_utf8_lossy(&output.stdout)),
        _ => println!("{python} has no pandas: nothing to compare with (set PYTHON to one that has)"),
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    if arguments.next().as_deref() == Some(ONCE) {
        let file = PathBuf::from(arguments.next().expect("the file"));
        let start = Instant::now();
        let run = read(&file);
        println!("{} ms, {}", start.elapsed().as_millis(), peak());
        drop(run);
        return;
    }
    make();
    divan::main();
    // `cargo test --benches` only wants to see that it runs
    if std::env::args().any(|argument| argument == "--bench") {
        for ending in ["csv", "parquet"] {
            let own = std::env::current_exe().expect("a path");
            let output = Command::new(own).arg(ONCE).arg(file(ending)).output().expect("itself");
            let bytes = fs::metadata(file(ending)).map_or(0, |meta| meta.len());
            print!("{ending}, {} MB, read once: {}", bytes / 1_000_000, String::from_utf8_lossy(&output.stdout));
        }
        estimate();
        simulate();
        pandas();
    }
}
