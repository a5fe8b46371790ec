//! The firmware program: memory and tasks for the runners of the library of the same name.
//!
//! `cargo fw-f405` and `cargo fw-g474` build it, `cargo flash-f405` and `cargo flash-g474` flash it with probe-rs
//! and show its log. In this crate's folder `cargo run --release` is `cargo flash-f405`.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]
#![deny(unsafe_code)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod image;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("the firmware runs on the chip: build it with `cargo fw-f405` or `cargo fw-g474`");
}
