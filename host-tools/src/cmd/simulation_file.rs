//! The simulation file that a command is given, and the mappings of columns in it.

use std::fs;
use std::path::Path;

use host_tools::recording::Mapping;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::GuideSet;

use super::Failure;

/// A simulation with how it wants columns to be read.
pub(crate) struct SimulationFile {
    pub(crate) simulation: Simulation,
    pub(crate) mappings: Vec<Mapping>,
}

impl SimulationFile {
    /// Reads a file. Whatever is wrong inside it is [`Failure::Data`]; that it cannot be opened is wrong usage.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let unusable = |why: String| Failure::Data(format!("{}: {why}", path.display()));
        let simulation = Simulation::from_toml(&text(path)?).map_err(|why| unusable(why.to_string()))?;
        let mapping = |(name, text): &(String, String)| Mapping::new(name, text);
        let mappings = simulation.columns.iter().map(mapping).collect::<Result<_, _>>();
        let mappings = mappings.map_err(|why| unusable(format!("[columns]: {why}")))?;
        Ok(SimulationFile { simulation, mappings })
    }

    /// Reads a file; without one, the published set zhou-2023 stands in for it.
    pub(crate) fn or_published(path: Option<&Path>) -> Result<Self, Failure> {
        path.map_or_else(
            || {
                let simulation = Simulation::of(Law::Guide(GuideSet::zhou_2023()));
                Ok(SimulationFile { simulation, mappings: Vec::new() })
            },
            Self::open,
        )
    }

    /// The same with the oil at one viscosity, cSt, where the command line gives it.
    pub(crate) fn with_viscosity(mut self, viscosity_cst: Option<f64>) -> Result<Self, Failure> {
        if let (Some(nu), Law::Guide(set)) = (viscosity_cst, &self.simulation.law) {
            let set =
                set.with_number("viscosity_cst", nu).map_err(|why| Failure::Usage(format!("--viscosity: {why}")))?;
            self.simulation.law = Law::Guide(set);
        }
        Ok(self)
    }
}

/// The text of a simulation file, which a recording given by mistake is not.
pub(super) fn text(path: &Path) -> Result<String, Failure> {
    let bytes = fs::read(path).map_err(|error| Failure::file(path, error))?;
    String::from_utf8(bytes).map_err(|_| {
        let schema = simulation::file::SCHEMA;
        let what = format!("this is no text; a simulation file is TOML that starts with schema = \"{schema}\"");
        Failure::Data(format!("{}: {what}", path.display()))
    })
}
