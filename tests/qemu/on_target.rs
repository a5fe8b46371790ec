//! The core's page of bits, on the desk, on the emulator's Cortex-M4F and on QEMU's.

use std::process::Command;
use system_tests::{image, root};
use virtual_board::run_bare;

fn desk() -> String {
    let mut page = String::new();
    on_target::report(&mut page).expect("a String takes everything");
    page
}

#[test]
fn same_bits_on_the_virtual_board() {
    let bare = run_bare(&image::read("on-target"), 60_000_000_000, &[]).expect("the emulator takes the image");
    assert_eq!(bare.exit_status, Some(0));
    assert_eq!(String::from_utf8_lossy(&bare.output), desk());
}

/// `netduinoplus2` is an STM32F405 to QEMU: the same flash and RAM, so the same `memory.x`.
#[test]
fn same_bits_on_qemu() {
    let image = root().join("target/images/on-target.elf");
    let run = Command::new("qemu-system-arm")
        .args(["-M", "netduinoplus2", "-display", "none", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(&image)
        .output()
        .expect("qemu-system-arm, which ./verify installs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(String::from_utf8_lossy(&run.stdout), desk());
}

/// The page itself, so that a change of any bit is seen in the change that makes it.
#[test]
fn page_is_the_recorded_one() {
    assert_eq!(desk(), include_str!("on_target.out"));
}
