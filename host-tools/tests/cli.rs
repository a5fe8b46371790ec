//! What the commands print, byte for byte, and their exit status.
//!
//! Inputs and expected outputs are in `tests/cli`. After a change that is meant, `BLESS=1 cargo test` writes the
//! expected outputs anew; read the difference before committing it.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a command left behind.
struct Run {
    status: Option<i32>,
    stdout: String,
    stderr: String,
}

fn guideblock(arguments: &[&str], stdin: &[u8]) -> Run {
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary of this package");
    child.stdin.take().expect("piped").write_all(stdin).expect("it reads all of its input");
    let output = child.wait_with_output().expect("it ends");
    Run {
        status: output.status.code(),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

/// Compares with a file of `tests/cli`.
fn expect(name: &str, got: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli").join(name);
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, got).expect("writable");
    }
    let expected = fs::read_to_string(&path).unwrap_or_default();
    assert!(got == expected, "{name} is no longer what is printed:\n{got}");
}

#[test]
fn decode_prints_every_format() {
    for format in ["table", "csv", "json"] {
        let run = guideblock(&["decode", "tests/cli/bus.log", "--format", format], b"");
        expect(&format!("bus.{format}"), &run.stdout);
        expect("bus.stderr", &run.stderr);
        assert_eq!(run.status, Some(0));
    }
}

#[test]
fn logs_of_other_programs_are_named() {
    for (log, kind) in [
        ("date Sat Nov 28 10:00:00 2026\nbase hex  timestamps absolute\n", "a Vector log (.asc)"),
        (";$FILEVERSION=1.1\n     1)       0.1 Rx         0181  8  00\n", "a PCAN trace (.trc)"),
    ] {
        let run = guideblock(&["decode"], log.as_bytes());
        let what = "make it candump text with python-can: `python3 -m can.logconvert IN OUT.log`";
        assert_eq!(run.status, Some(3));
        assert_eq!(run.stderr, format!("guideblock: standard input: this is {kind}; {what}\n"));
    }
}

#[test]
fn decode_reads_a_pipe_just_the_same() {
    let log = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/bus.log")).expect("checked in");
    let piped = guideblock(&["decode"], &log);
    let file = guideblock(&["decode", "tests/cli/bus.log"], b"");
    assert_eq!(piped.stdout, file.stdout);
    assert_eq!(piped.stderr, file.stderr);
}

#[test]
fn decode_tells_when_nothing_is_there() {
    let run = guideblock(&["decode", "tests/cli/bus.log", "--node", "2"], b"");
    assert_eq!(run.status, Some(3));
    let said = "guideblock: tests/cli/bus.log: no frame of a guide block is of node 2; seen: 1\n";
    assert!(run.stderr.ends_with(said), "{}", run.stderr);
    let run = guideblock(&["decode", "--node", "2"], b"(1.0) can0 123#00\n");
    assert!(run.stderr.ends_with("guideblock: standard input: no frame of a guide block\n"), "{}", run.stderr);
    let run = guideblock(&["decode"], b"\x00\xffnot candump\n");
    assert_eq!(run.status, Some(3));
    assert!(run.stderr.contains("1 rejected (candump-"), "{}", run.stderr);
}

#[test]
fn a_live_bus_is_decoded_line_by_line() {
    use std::io::{BufRead, BufReader};
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["decode", "--format", "json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary of this package");
    let mut bus = child.stdin.take().expect("piped");
    let mut said = BufReader::new(child.stdout.take().expect("piped"));
    for (frame, preload) in [("181#BA0B5E007C070CD1", "3002.0"), ("181#B90B5E007B070DE7", "3001.0")] {
        writeln!(bus, "(6.1) can0 {frame}").expect("it listens");
        let mut line = String::new();
        // hangs if the answer waits for more input
        said.read_line(&mut line).expect("it answers");
        assert!(line.contains(&format!("\"preload_n\":{preload}")), "{line}");
    }
    drop(bus);
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}

#[test]
fn a_closed_pipe_is_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["replay", "tests/cli/steady.raw.csv", "--format", "candump"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary of this package");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()));
}

#[test]
fn replay_prints_every_format() {
    let record = Path::new(env!("CARGO_TARGET_TMPDIR")).join("steady.record");
    let record = record.to_str().expect("text");
    let made = guideblock(&["parameters", "--bench", "runs/bench.toml", "--out", record], b"");
    assert_eq!(made.status, Some(0), "{}", made.stderr);
    assert!(made.stderr.ends_with(" bytes for 0x08060000, node 1, calibrated\n"), "{}", made.stderr);
    for format in ["table", "csv", "json", "candump"] {
        let run = guideblock(&["replay", "tests/cli/steady.raw.csv", "--parameters", record, "--format", format], b"");
        expect(&format!("steady.{format}"), &run.stdout);
        assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
    }
    let unprogrammed = guideblock(&["replay", "tests/cli/steady.raw.csv"], b"");
    expect("unprogrammed.table", &unprogrammed.stdout);
}

#[test]
fn replay_uses_what_is_left_and_counts_what_is_lost() {
    let run = guideblock(&["replay", "tests/cli/damaged.raw.csv", "--format", "candump"], b"");
    expect("damaged.candump", &run.stdout);
    expect("damaged.stderr", &run.stderr);
    assert_eq!(run.status, Some(0));
}

#[test]
fn replay_refuses_with_line_and_column() {
    for (file, message) in [
        (
            "tests/cli/renamed.raw.csv",
            "guideblock: tests/cli/renamed.raw.csv: line 3: no column temperature_code; the header row has: tick, sample, \
             force_code, ntc, encoder_count\n",
        ),
        (
            "tests/cli/bus.log",
            "guideblock: tests/cli/bus.log: line 2: expected `# schema: guideblock.raw/1`, found \"(0.000538) can0 \
             701#00110100000000F1\"; a raw recording says above its header row what it is; if this file is one, add that \
             line\n",
        ),
    ] {
        let run = guideblock(&["replay", file], b"");
        assert_eq!((run.status, run.stdout.as_str(), run.stderr.as_str()), (Some(3), "", message));
    }
    let run = guideblock(&["replay", "tests/cli/steady.raw.csv", "--parameters", "tests/cli/bus.log"], b"");
    assert_eq!(run.status, Some(3));
    assert_eq!(
        run.stderr,
        "guideblock: tests/cli/bus.log: no parameter record: it does not begin with GBPR; make one with \
         `guideblock parameters --bench BENCH.toml --out RECORD`\n"
    );
}

#[test]
fn wrong_usage_is_told_from_wrong_data() {
    for arguments in [
        &["decode", "no such file"][..],
        &["decode", "--node", "128"],
        &["decode", "--format", "xml"],
        &["replay"],
        &["parameters"],
        &["parameters", "--bench", "runs/bench.toml"],
        &["frobnicate"],
    ] {
        let run = guideblock(arguments, b"");
        assert_eq!((run.status, run.stdout.as_str()), (Some(2), ""), "{arguments:?}");
        assert!(!run.stderr.is_empty(), "{arguments:?}");
    }
    // a command with two ways names both
    for (command, ways) in [("parameters", ["--bench", "--show"]), ("simulate", ["RUN.csv", "--profile"])] {
        let run = guideblock(&[command], b"");
        assert!(run.status == Some(2) && ways.iter().all(|way| run.stderr.contains(way)), "{}", run.stderr);
    }
}

#[test]
fn a_record_shows_as_the_bench_file_it_can_be_made_from() {
    let path = |name: &str| Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).to_str().expect("text").to_owned();
    let (first, bench, second) = (path("first.record"), path("shown.toml"), path("second.record"));
    assert_eq!(guideblock(&["parameters", "--bench", "runs/bench.toml", "--out", &first], b"").status, Some(0));
    let shown = guideblock(&["parameters", "--show", &first], b"");
    expect("bench.shown.toml", &shown.stdout);
    fs::write(&bench, &shown.stdout).expect("writable");
    assert_eq!(guideblock(&["parameters", "--bench", &bench, "--out", &second], b"").status, Some(0));
    assert_eq!(fs::read(first).expect("written"), fs::read(&second).expect("written"));
    let wrong = path("wrong.toml");
    fs::write(&wrong, "schema = \"guideblock.bench/1\"\n[seals]\ndrag = 3\n").expect("writable");
    let run = guideblock(&["parameters", "--bench", &wrong, "--out", &second], b"");
    assert_eq!(run.status, Some(3));
    assert!(
        run.stderr.ends_with(
            "wrong.toml: line 3, column 1: there is no parameter seals.drag; there are: coulomb_n, viscous_n_s_m\n"
        ),
        "{}",
        run.stderr
    );
}

#[test]
fn dbc_prints_the_checked_in_file_and_other_nodes() {
    let run = guideblock(&["dbc"], b"");
    let checked_in = Path::new(env!("CARGO_MANIFEST_DIR")).join("../can-wire/guideblock.dbc");
    assert_eq!(run.stdout, fs::read_to_string(checked_in).expect("checked in"));
    assert_eq!(run.status, Some(0));
    let other = guideblock(&["dbc", "--node", "127"], b"").stdout;
    assert!(other.contains("BO_ 511 GuideBlock127_Estimate: 8 GuideBlock127"), "{other}");
}

#[cfg(feature = "emulator")]
#[test]
fn demo_says_how_to_build_what_is_missing() {
    for (board, build) in [("f405", "cargo fw-f405"), ("g474", "cargo fw-g474")] {
        let run = guideblock(&["demo", "--board", board, "--image", "no such image"], b"");
        assert_eq!((run.status, run.stdout.as_str()), (Some(2), ""));
        assert!(run.stderr.starts_with("guideblock: no such image: "), "{}", run.stderr);
        assert!(run.stderr.contains(&format!("build one with `{build}`")), "{}", run.stderr);
    }
    let run = guideblock(&["demo", "--image", "runs/bench.toml", "--out", env!("CARGO_TARGET_TMPDIR")], b"");
    assert_eq!(run.status, Some(3), "{}", run.stderr);
}

#[test]
fn paper_says_what_holds_and_what_does_not() {
    let run = guideblock(&["paper"], b"");
    assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
    expect("paper.txt", &run.stdout);
    let json = guideblock(&["paper", "--json"], b"");
    let object: serde_json::Value = serde_json::from_str(&json.stdout).expect("one object");
    assert_eq!(object["schema"], "guideblock.paper/1");
    assert_eq!(object["readings"].as_array().map(Vec::len), Some(8));
    for claim in object["grid"].as_array().expect("a list") {
        assert_eq!(claim["rulings"].as_array().map(Vec::len), Some(8), "{claim}");
    }
}

#[test]
fn paper_page_needs_nothing_from_the_net() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paper.html");
    let run = guideblock(&["paper", "--html", path.to_str().expect("text")], b"");
    assert_eq!(run.status, Some(0), "{}", run.stderr);
    let page = fs::read_to_string(&path).expect("written");
    assert!(page.contains("<svg") && page.contains("0.00166 at 500 N") && page.contains("0.00197 at 1500 N"));
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("@media print"));
    for outside in ["src=", "href=", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    // a place that cannot be written is the caller's mistake, and nothing is printed as if all were well
    let bad = guideblock(&["paper", "--html", "/nowhere/at/all.html"], b"");
    assert_eq!((bad.status, bad.stdout.as_str()), (Some(2), ""));
}

#[test]
fn image_makes_shows_and_refuses() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let made = folder.join("augmented.bin").display().to_string();
    let bench = folder.join("base.bin").display().to_string();
    assert_eq!(guideblock(&["parameters", "--bench", "runs/bench.toml", "--out", &bench], b"").status, Some(0));
    for (name, more) in [("image.txt", None), ("image.json", Some("--json"))] {
        let mut arguments = vec!["image", "tests/cli/augmented.toml", "--record", &bench, "--out", &made];
        arguments.extend(more);
        let run = guideblock(&arguments, b"");
        assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
        expect(name, &run.stdout);
    }
    let run = guideblock(&["image", "--describe", &made], b"");
    assert_eq!(run.status, Some(0));
    expect("image.shown.toml", &run.stdout);
    // without the block's record it is not calibrated, and says so
    let run = guideblock(&["image", "tests/cli/augmented.toml", "--out", &made], b"");
    assert!(run.status == Some(0) && run.stderr.contains("NOT calibrated"), "{}", run.stderr);
    // what the block cannot run: no image, its name, exit status 3
    let refused = folder.join("refused.toml").display().to_string();
    let text =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/augmented.toml")).expect("text");
    let more = "\n[[mechanism]]\nid = \"thermal-preload\"\npreload_per_k = -0.02\n";
    fs::write(&refused, text + more).expect("writable");
    let none = folder.join("none.bin");
    let run = guideblock(&["image", &refused, "--json", "--out", &none.display().to_string()], b"");
    assert_eq!(run.status, Some(3));
    assert!(run.stdout.contains("\"thermal-preload\"") && run.stderr.contains("no thermometer in the rail"));
    assert!(!none.exists());
    for wrong in [&["image"][..], &["image", "x.toml"], &["image", "--describe", &made, "--out", "x"]] {
        assert_eq!(guideblock(wrong, b"").status, Some(2), "{wrong:?}");
    }
}
