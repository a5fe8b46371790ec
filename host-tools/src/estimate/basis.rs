//! Provenance of the inverted law.

use serde::Serialize;
use simulation::Simulation;
use simulation::file::Law;
use simulation::published::Provenance;

/// The constants of Eq. 19, which a calibration determines.
const FRICTION: [&str; 4] = ["mu_coulomb", "mu_viscous", "mu_stribeck", "stribeck_exponent"];

/// Provenance of the numbers of a law.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Basis {
    /// Name of the published set.
    pub parameters: &'static str,
    /// Whether the simulation file sets all constants of the friction.
    pub is_calibrated: bool,
    /// Keys whose values no paper states and the file does not set.
    pub assumed: Vec<&'static str>,
}

impl Basis {
    /// That of a simulation; `None` where its law is not that of a ball guide.
    pub fn of(simulation: &Simulation) -> Option<Self> {
        let Law::Guide(set) = &simulation.law else { return None };
        let is_set = |key: &str| set.entries().iter().any(|e| e.key == key && e.provenance == Provenance::File);
        let is_assumed = |provenance: &Provenance| matches!(provenance, Provenance::Assumed(_));
        Some(Basis {
            parameters: set.parameters().name,
            is_calibrated: FRICTION.iter().all(|key| is_set(key)),
            assumed: set.entries().iter().filter(|e| is_assumed(&e.provenance)).map(|e| e.key).collect(),
        })
    }

    /// What a reader of the preload has to know; nothing where the guide was calibrated.
    pub fn warning(&self) -> Option<String> {
        let assumed = if self.assumed.is_empty() { "nothing".to_owned() } else { self.assumed.join(", ") };
        (!self.is_calibrated).then(|| {
            format!(
                "the friction law is the published one of {}, not calibrated on this guide; ASSUMED: {assumed}",
                self.parameters
            )
        })
    }
}
