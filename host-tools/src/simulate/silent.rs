//! Why a row has no simulated force.

use std::fmt;

use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::Lubricant;
use simulation::motion::Motion;
use simulation::run::Run;

use super::Simulated;

/// Why the law has no value for a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Silence {
    /// The carriage stands: friction can be anything up to the breakaway force.
    Rest,
    /// The preload was not measured in that row.
    Preload,
    /// The temperature that the oil's viscosity needs was not measured in that row.
    Temperature,
    /// The recording's own column `simulated_force_n` is empty there.
    Column,
    /// The preload is beyond what the contact's geometry carries, or below nothing.
    Load,
    /// The acceleration that the moved mass needs is not known there.
    Acceleration,
    /// The reader could not use the row.
    LeftOut,
}

impl Silence {
    /// Name in JSON.
    pub const fn id(self) -> &'static str {
        match self {
            Silence::Rest => "rest",
            Silence::Preload => "preload-not-measured",
            Silence::Temperature => "temperature-not-measured",
            Silence::Column => "simulated-force-not-given",
            Silence::Load => "load-out-of-range",
            Silence::Acceleration => "acceleration-not-known",
            Silence::LeftOut => "left-out",
        }
    }
}

impl fmt::Display for Silence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Silence::Rest => "at rest, where friction is not determined (slower than axis.zero_speed_m_s)",
            Silence::Preload => "preload_n not measured there",
            Silence::Temperature => "temperature_block_degc not measured there",
            Silence::Column => "simulated_force_n not given there",
            Silence::Load => "no load per ball for that preload_n in the contact's geometry",
            Silence::Acceleration => "acceleration not known there",
            Silence::LeftOut => "the row could not be used (see above)",
        })
    }
}

/// Every row without a value: its number and why, in order. Rows at rest are among them for laws of friction.
pub fn silences(simulation: &Simulation, run: &Run, motion: &Motion, simulated: &Simulated) -> Vec<(usize, Silence)> {
    let is_empty = |column: &Option<Vec<f64>>, n: usize| {
        // a column without any value is one that is not there
        column.as_ref().is_some_and(|c| c[n].is_nan())
    };
    let needs_temperature =
        matches!(&simulation.law, Law::Guide(set) if matches!(set.lubricant(), Lubricant::Walther(_)));
    let has_preload = run.preload_n.as_ref().is_some_and(|column| column.iter().any(|p| p.is_finite()));
    let why = |n: usize| {
        if matches!(simulation.law, Law::Column { .. }) {
            return simulated.force_n[n].is_nan().then_some(Silence::Column);
        }
        if simulated.direction[n] == 0.0 {
            return Some(Silence::Rest);
        }
        if simulated.force_n[n].is_finite() {
            return None;
        }
        Some(if has_preload && is_empty(&run.preload_n, n) {
            Silence::Preload
        } else if needs_temperature && is_empty(&run.temperature_block_degc, n) {
            Silence::Temperature
        } else if motion.acceleration_m_s2[n].is_nan() {
            Silence::Acceleration
        } else {
            Silence::Load
        })
    };
    (0..run.len()).filter_map(|n| why(n).map(|why| (n, why))).collect()
}
