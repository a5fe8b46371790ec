//! A few of the pairs of `examples/malformed_files.rs`, from a seed of their own: whatever is handed in, nothing panics.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn nothing_that_is_handed_in_makes_it_panic() {
    // examples are built beside the program
    let program = Path::new(env!("CARGO_BIN_EXE_guideblock")).with_file_name("examples").join("malformed_files");
    if !program.exists() {
        eprintln!("skipped: no {}; cargo test builds it unless a single test is asked for", program.display());
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("malformed");
    fs::create_dir_all(&folder).expect("writable");
    let output = Command::new(program).args(["200", "7"]).arg(&folder).output().expect("runs");
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    let failed: Vec<&str> = said.lines().filter(|line| line.contains(": ")).collect();
    assert!(
        failed.is_empty() && said.contains(" 0 failed; slowest "),
        "{failed:#?}; the files are in {}",
        folder.display()
    );
    assert!(output.status.success(), "{said}");
}
