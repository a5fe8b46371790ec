//! Packs the golden inverse vectors into binary tables, and gives the target binary its memory map.

#![expect(clippy::expect_used, reason = "a build script ends with the message")]
use std::path::Path;
use std::{env, fs};

/// Packs a table. One row: drag force, N, and viscosity times speed, each as the nearest f32, little-endian; expected
/// preload, N, as f64, so that its own rounding does not count against the core.
fn pack(csv: &Path) -> Vec<u8> {
    let text = fs::read_to_string(csv).expect("golden vectors");
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name).expect(name);
    let (force, nu, speed) = (column("F_f_N"), column("nu_cSt"), column("V_mps"));
    let (preload, inside) = (column("F_p_N"), column("in_paper_domain"));
    let mut out = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[inside] != "1" {
            continue;
        }
        let value = |n: usize| cells[n].parse::<f64>().expect("a number");
        out.extend((value(force) as f32).to_le_bytes());
        out.extend(((value(nu) * value(speed)) as f32).to_le_bytes());
        out.extend(value(preload).to_le_bytes());
    }
    out
}

fn main() {
    let out = env::var("OUT_DIR").expect("set by cargo");
    for convention in ["slip", "carriage"] {
        let csv = format!("../golden/inverse_{convention}.csv");
        println!("cargo:rerun-if-changed={csv}");
        fs::write(Path::new(&out).join(format!("{convention}.bin")), pack(Path::new(&csv))).expect("written");
    }
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        // memory.x is the workspace root's: the linker starts there
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
        println!("cargo:rustc-link-arg-bins=--nmagic");
        println!("cargo:rerun-if-changed=../../memory.x");
    }
}
