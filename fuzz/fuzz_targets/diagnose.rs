//! Fuzz target: arbitrary bytes as simulation file and recording are read, diagnosed and written. Nothing may panic.
//!
//! A simulation file comes first, then a line `---`, then a recording as CSV.
//!
//! ```text
//! cargo +nightly fuzz run diagnose     # a nightly of 1.98 or later
//! ```
#![no_main]

use diagnosis::{Options, diagnose};
use host_tools::recording::{axis, silent};
use libfuzzer_sys::fuzz_target;
use simulation::Simulation;
use simulation::motion::Motion;

fuzz_target!(|bytes: &[u8]| {
    let Some(at) = bytes.windows(5).position(|window| window == b"\n---\n") else { return };
    let Ok(text) = std::str::from_utf8(&bytes[..at]) else { return };
    let recording = bytes[at + 5..].to_vec();
    let (simulation, run) = (Simulation::from_toml(text), axis::from_bytes("a.csv", recording, &[], &[], &silent));
    let (Ok(simulation), Ok((run, _))) = (simulation, run) else { return };
    let outcome = diagnose(&[run.clone()], &[], &simulation, &Options { seed: 0 });
    let _ = serde_json::to_string(&outcome.diagnosis);
    if let Some(augmented) = outcome.augmented
        && let Ok(again) = Simulation::from_toml(&augmented.to_toml())
    {
        let _ = again.force(&run, &Motion::of(&run));
    }
});
