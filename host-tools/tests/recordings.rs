//! `guideblock convert` over its command line: what it writes, what it says, and its exit status.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use host_tools::recording::{Mapping, open, silent, table};
use simulation::run::Break;

const HEADER: &str = "t_ms,position_m,gtau,note,drive\n";

/// 600 rows of two drives at 100 Hz each.
fn rows() -> String {
    let row = |n: usize| {
        format!("{},{:.4},{},\"run, {}\",{}\n", n / 2 * 10, n as f64 * 1e-4, (n % 7) as f64 / 10.0, n % 2, n % 2 + 1)
    };
    (0..600).map(row).collect()
}

/// A folder for the files of one test, empty.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("recordings").join(test);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("writable");
    folder
}

fn command(folder: &PathBuf, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_guideblock"));
    command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn guideblock(folder: &PathBuf, arguments: &[&str]) -> (Option<i32>, String, String) {
    let Output { status, stdout, stderr } = command(folder, arguments).output().expect("the binary of this package");
    (status.code(), String::from_utf8(stdout).expect("text"), String::from_utf8(stderr).expect("text"))
}

#[test]
fn columns_go_to_parquet_and_back() {
    let folder = folder("back");
    fs::write(folder.join("a.csv"), HEADER.to_owned() + &rows()).expect("writable");
    let mapped = ["--column", "time_s=t_ms:0.001", "--column", "drag_force_n=gtau:35.15", "--where", "drive=2"];
    let quiet = (Some(0), String::new(), String::new());
    assert_eq!(guideblock(&folder, &[&["convert", "a.csv", "a.parquet"], &mapped[..]].concat()), quiet);
    assert_eq!(guideblock(&folder, &["convert", "a.parquet", "b.csv"]), quiet);
    let written = fs::read_to_string(folder.join("b.csv")).expect("written");
    let lines: Vec<_> = written.lines().collect();
    assert_eq!(lines.len(), 301);
    assert_eq!(
        lines[..3],
        ["time_s,position_m,drag_force_n,note,drive", "0,0.0001,3.515,\"run, 1\",2", &*{
            // the product as it is, rounded once
            format!("0.01,0.0003,{},\"run, 1\",2", 0.3 * 35.15)
        }]
    );
    // by CSV alone the bytes are the same, and the same again
    assert_eq!(
        guideblock(&folder, &[&["convert", "a.csv", "-"], &mapped[..]].concat()),
        (Some(0), written, String::new())
    );
    let first = fs::read(folder.join("a.parquet")).expect("written");
    assert!(first.starts_with(b"PAR1"));
    guideblock(&folder, &["convert", "b.csv", "c.parquet"]);
    assert_eq!(fs::read(folder.join("c.parquet")).expect("written"), first);
}

#[test]
fn a_pipe_is_read_just_the_same() {
    let folder = folder("pipe");
    fs::write(folder.join("a.csv"), HEADER.to_owned() + &rows()).expect("writable");
    guideblock(&folder, &["convert", "a.csv", "a.parquet"]);
    for input in ["a.csv", "a.parquet"] {
        let bytes = fs::read(folder.join(input)).expect("written");
        let mut child = command(&folder, &["convert", "-", "-"]).stdin(Stdio::piped()).spawn().expect("the binary");
        let mut into = child.stdin.take().expect("piped");
        let writer = std::thread::spawn(move || into.write_all(&bytes).expect("it reads all of its input"));
        let output = child.wait_with_output().expect("it ends");
        writer.join().expect("written");
        assert_eq!(output.status.code(), Some(0));
        let (_, expected, _) = guideblock(&folder, &["convert", input, "-"]);
        assert_eq!(String::from_utf8(output.stdout).expect("text"), expected);
    }
}

#[test]
fn damage_is_told_and_the_rest_is_used() {
    let folder = folder("damage");
    let text = (HEADER.to_owned() + &rows())
        .replace("\n30,0.0007,0,", "\n30,0.0007,zero,")
        .replace("\n40,0.0008,0.1,\"run, 0\",1\n", "\n40,0.0008\n");
    fs::write(folder.join("a.csv"), text.trim_end()).expect("writable");
    let (status, out, said) = guideblock(&folder, &["convert", "a.csv", "-", "--column", "drag_force_n=gtau:2"]);
    assert_eq!(status, Some(0));
    assert_eq!(
        said,
        "a.csv: line 9: column drag_force_n (from gtau): \"zero\" is not a number (decimal mark is the point); it counts \
         as not measured\na.csv: line 10: 2 cells instead of 5; the row is left out\na.csv: 1 of 600 rows lost\n"
    );
    assert_eq!(out.lines().count(), 600);
    assert_eq!(out.lines().nth(8), Some("30,0.0007,,\"run, 1\",2"));
}

#[test]
fn wrong_usage_and_unusable_files_have_their_status() {
    let folder = folder("status");
    fs::write(folder.join("a.csv"), HEADER.to_owned() + &rows()).expect("writable");
    fs::write(folder.join("empty.csv"), "").expect("writable");
    fs::write(folder.join("header.csv"), HEADER).expect("writable");
    fs::write(folder.join("broken.parquet"), "PAR1 and no more").expect("writable");
    fs::write(folder.join("zip.csv"), "PK\x03\x04").expect("writable");
    for (arguments, status, message) in [
        (&["convert", "none.csv", "-"][..], 2, "guideblock: none.csv: there is no such file\n"),
        (
            &["convert", "a.csv", "a.xlsx"],
            2,
            "guideblock: a.xlsx: name it .csv or .parquet, so that it is clear what to write\n",
        ),
        (
            &["convert", "a.csv", "./a.csv"],
            2,
            "guideblock: ./a.csv: OUT would overwrite what IN reads; give the result another name\n",
        ),
        (&["convert", "a.csv", "no/such/a.csv"], 2, "guideblock: no/such/a.csv: there is no such folder\n"),
        (
            &["convert", "a.csv", "-", "--column", "x=gtau", "--column", "x=note"],
            2,
            "guideblock: --column x=... is given twice\n",
        ),
        (
            &["convert", "a.csv", "-", "--column", "x=tau"],
            3,
            "guideblock: a.csv: line 1: no column tau; the header row has: t_ms, position_m, gtau, note, drive (asked for \
             by --column x=tau:...)\n",
        ),
        (
            &["convert", "a.csv", "-", "--where", "drive=3"],
            3,
            "guideblock: a.csv: no row has drive = 3; column drive has: 1, 2\n",
        ),
        (&["convert", "empty.csv", "-"], 3, "guideblock: empty.csv: the file is empty\n"),
        (
            &["convert", "header.csv", "-"],
            3,
            "guideblock: header.csv: 0 usable rows of 0 rows, at least 1 are needed\n",
        ),
        (
            &["convert", "zip.csv", "-"],
            3,
            "guideblock: zip.csv: this is a spreadsheet or zip archive, not a recording; save the sheet as CSV, or unpack \
             the archive\n",
        ),
    ] {
        assert_eq!(guideblock(&folder, arguments), (Some(status), String::new(), message.to_owned()));
    }
    let (status, out, said) = guideblock(&folder, &["convert", "broken.parquet", "-"]);
    assert_eq!((status, out), (Some(3), String::new()));
    assert!(said.starts_with("guideblock: broken.parquet: not a sound Parquet file: "), "{said}");
    let (status, _, said) = guideblock(&folder, &["convert", "a.csv", "-", "--column", "gtau:35"]);
    assert_eq!(status, Some(2));
    assert!(
        said.contains("expected NAME=COLUMN:SCALE[:OFFSET], as drag_force_n=gtau:35.15, found \"gtau:35\""),
        "{said}"
    );
}

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    let folder = folder("closed");
    let many: String = (0..200).map(|_| rows()).collect();
    fs::write(folder.join("a.csv"), HEADER.to_owned() + &many).expect("writable");
    let mut child = command(&folder, &["convert", "a.csv", "-"]).spawn().expect("the binary");
    let mut first = [0; 100];
    child.stdout.take().expect("piped").read_exact(&mut first).expect("there is that much");
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned()), (Some(0), String::new()));
}

/// A file of measured data, which is not in the repository; `None` where it is not there.
fn measured(name: &str) -> Option<PathBuf> {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path = std::env::var_os("GUIDEBLOCK_DATA").map_or_else(beside, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: {} is not there (set GUIDEBLOCK_DATA to the folder that holds it)", path.display());
    None
}

#[test]
fn measured_tables_are_read_through_mappings() {
    let parsed = |texts: &[&str]| -> Vec<Mapping> { texts.iter().map(|text| text.parse().expect("sound")).collect() };
    if let Some(path) = measured("emps_train.csv") {
        let (run, losses) = open(&path, &[], &[], &silent).expect("usable");
        assert_eq!((run.len(), run.parts.len(), losses.describe("emps").len()), (24_841, 1, 0));
    }
    if let Some(path) = measured("leadscrew_runs.csv") {
        // a screw of 1 mm a radian; the clock starts anew with every run
        let mappings =
            parsed(&["time_s=t_s", "velocity_m_s=velocity_rad_s:1e-3", "drag_force_n=torque_Nm:1e3", "segment=run"]);
        let drive = ["drive=2".parse().expect("sound")];
        let (run, losses) = open(&path, &mappings, &drive, &silent).expect("usable");
        let runs = run.parts.iter().filter(|part| part.starts != Break::Gap).count();
        // those that turned back are called n10 to n200: the column is one of names, and no row is lost
        assert_eq!((losses.rows, losses.rejected.len(), losses.lost), (15_000, 0, 0));
        assert_eq!((losses.gaps, runs), (0, 30), "one part a run, 15 each way");
        assert!(open(&path, &[], &[], &silent).expect_err("foreign").to_string().contains("no column time_s"));
    }
    if let Some(path) = measured("leadscrew_stribeck.csv") {
        let mappings = parsed(&["velocity_m_s=velocity_rad_s:1e-3", "drag_force_n=torque_Nm:1e3"]);
        let drive = ["drive=1".parse().expect("sound")];
        let wanted = ["velocity_m_s", "drag_force_n"];
        let (table, losses) =
            table::open(&path, &wanted, &["temperature"], &mappings, &drive, &silent).expect("usable");
        assert_eq!((table.len() as u64, losses.found), (losses.rows, 0));
        let velocity = table.column("velocity_m_s").expect("asked for");
        assert_eq!((velocity[0], table.column("temperature")), (-20.84342 * 1e-3, None));
    }
}
