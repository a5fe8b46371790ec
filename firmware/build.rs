//! Link flags of the image. They stand here and not in `.cargo/config.toml`, so that other programs for the
//! same target can be linked without defmt.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // memory.x is the workspace root's: the linker starts there
    println!("cargo:rerun-if-changed=../memory.x");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
            println!("cargo:rustc-link-arg-bins={argument}");
        }
    }
}
