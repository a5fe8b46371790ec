//! `guideblock preload` and `guideblock drag`: what they print, byte for byte, and their exit status.
//!
//! Expected outputs are in `tests/cli`; `BLESS=1 cargo test` writes them anew.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};

fn guideblock(arguments: &[&str], stdin: &str) -> (Option<i32>, String, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary of this package");
    // a refused command does not read its input
    let _ = child.stdin.take().expect("piped").write_all(stdin.as_bytes());
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
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
fn a_working_point_is_shown_whole() {
    let inputs = ["--speed-m-min", "3", "--temperature", "25", "--seal-drag", "4"];
    for (name, first) in [("preload", ["preload", "--force", "20"]), ("drag", ["drag", "--preload", "3000"])] {
        let (status, stdout, stderr) = guideblock(&[&first[..], &inputs[..]].concat(), "");
        assert_eq!((status, stderr.as_str()), (Some(0), ""));
        expect(&format!("{name}.table"), &stdout);
    }
    let (status, stdout, stderr) =
        guideblock(&["preload", "--force", "20", "--speed", "-0.05", "--viscosity", "100", "--json"], "");
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    expect("preload.json", &stdout);
}

#[test]
fn drag_and_preload_undo_each_other() {
    let of = |arguments: &[&str], key: &str| -> f64 {
        let (status, stdout, stderr) = guideblock(arguments, "");
        assert_eq!(status, Some(0), "{stderr}");
        let object: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
        object["working_point"][key].as_f64().expect("a number")
    };
    let inputs = ["--speed", "0.02", "--viscosity", "68", "--seal-drag", "3", "--json"];
    let force = of(&[&["drag", "--preload", "2500"], &inputs[..]].concat(), "force_n");
    let back = of(&[&["preload", "--force", &force.to_string()], &inputs[..]].concat(), "preload_n");
    assert!((back / 2500.0 - 1.0).abs() < 1e-12, "{back}");
}

#[test]
fn a_table_keeps_its_columns_and_bad_rows_their_reason() {
    let table = "note,drag_force_n,velocity_m_s,viscosity_cst\n\
                 a,20,0.05,100\n\"b, quoted\",-20,-0.05,\n\
                 c,x,0.05,100\nd,-20,0.05,100\ne,20,,100\nf,20,50,100\ng,20\n";
    for arguments in [["preload", "--csv", "--viscosity", "100"], ["preload", "-", "--viscosity", "100"]] {
        let (status, stdout, stderr) = guideblock(&arguments, table);
        assert_eq!(status, Some(0), "{stderr}");
        expect("preload.csv", &stdout);
        expect("preload.stderr", &stderr);
    }
    // what is outside of what was measured has a result and the words that the single point has
    let (status, stdout, _) = guideblock(&["preload", "--csv"], "force_n,speed_m_s,viscosity_cst\n30,15,100\n");
    assert_eq!(status, Some(0));
    assert!(stdout.contains(",speed_m_s 15.000000 is outside the measured 0.001667 to 0.100000 m/s"), "{stdout}");
    let (status, stdout, _) = guideblock(&["drag", "--csv"], "preload_n,speed_m_min,temperature_degc\n3000,3,25\n");
    assert_eq!(status, Some(0));
    expect("drag.csv", &stdout);
}

#[test]
fn mistakes_have_their_exit_status() {
    let status = |arguments: &[&str], stdin: &str| guideblock(arguments, stdin).0;
    assert_eq!(status(&["preload", "--speed", "0.05"], ""), Some(2));
    assert_eq!(status(&["preload", "--force", "20", "--speed", "0.05"], ""), Some(2));
    assert_eq!(status(&["preload", "--force", "-20", "--speed", "0.05", "--viscosity", "100"], ""), Some(2));
    assert_eq!(status(&["drag", "--csv"], "preload_n,speed_m_s\n3000,0.05\n"), Some(3));
    assert_eq!(status(&["drag", "--csv"], "speed_m_s\n0.05\n"), Some(3));
    let (empty, _, said) = guideblock(&["drag", "--csv"], "");
    assert!(empty == Some(3) && said.contains("standard input: it is empty"), "{said}");
    let at_rest = ["preload", "--force", "20", "--speed-m-min", "0", "--viscosity", "100"];
    let (status_at_rest, _, said) = guideblock(&at_rest, "");
    assert!(status_at_rest == Some(2) && said.contains("speed_m_s must be above 0"), "{said}");
    assert_eq!(status(&["drag", "no such file"], ""), Some(2));
}

#[test]
fn a_live_table_is_answered_row_by_row() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["drag", "--csv", "--viscosity", "100"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the binary of this package");
    let (mut stdin, mut stdout) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
    stdin.write_all(b"preload_n,speed_m_s\n3000,0.05\n").expect("it reads");
    // the pipe stays open: what comes now came without its end
    let mut got = String::new();
    let mut byte = [0];
    while got.matches('\n').count() < 2 {
        stdout.read_exact(&mut byte).expect("an answer");
        got.push(char::from(byte[0]));
    }
    assert!(got.starts_with("preload_n,speed_m_s,calculated_force_n,reason\n3000,0.05,"), "{got}");
    // the reader goes; the next row finds a closed pipe
    drop(stdout);
    let _ = stdin.write_all("3000,0.05\n".repeat(20_000).as_bytes());
    drop(stdin);
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
}
