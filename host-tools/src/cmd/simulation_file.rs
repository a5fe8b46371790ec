//! The simulation file that a command is given, and the mappings of columns in it.

use std::fs;
use std::path::Path;

use host_tools::recording::{Mapping, axis};
use host_tools::toml_place;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::GuideSet;

use super::Failure;

/// Columns that only tables of means have.
const OF_TABLES: [&str; 1] = ["drag_force_sigma_n"];

/// A simulation with how it wants columns to be read.
pub(crate) struct SimulationFile {
    pub(crate) simulation: Simulation,
    pub(crate) mappings: Vec<Mapping>,
}

impl SimulationFile {
    /// Reads a file. Whatever is wrong inside it is [`Failure::Data`]; that it cannot be opened is wrong usage.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        let unusable = |why: String| Failure::Data(format!("{}: {why}", path.display()));
        let text = text(path)?;
        let simulation = Simulation::from_toml(&text).map_err(|why| unusable(why.to_string()))?;
        let mapping = |(name, mapping): &(String, String)| {
            let at = toml_place::find(&text, &["columns", name])
                .map_or_else(String::new, |key| format!("line {}, column {}: ", key.line, key.column));
            let known: Vec<_> = axis::names().into_iter().chain(OF_TABLES).collect();
            if !known.contains(&&**name) {
                let what = format!("nothing reads a column {name}; there are: {}", known.join(", "));
                return Err(unusable(format!("{at}{what}")));
            }
            Mapping::new(name, mapping).map_err(|why| unusable(format!("{at}columns.{name}: {why}")))
        };
        let mappings = simulation.columns.iter().map(mapping).collect::<Result<_, _>>()?;
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

/// The text of a simulation file; a recording given by mistake is recognised.
pub(super) fn text(path: &Path) -> Result<String, Failure> {
    let bytes = fs::read(path).map_err(|error| Failure::io(path, error))?;
    String::from_utf8(bytes).map_err(|_| {
        let schema = simulation::file::SCHEMA;
        let what = format!("this is no text; a simulation file is TOML that starts with schema = \"{schema}\"");
        Failure::Data(format!("{}: {what}", path.display()))
    })
}
