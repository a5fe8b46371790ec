//! The simulation file: what a run is compared with.
//!
//! ```toml
//! schema = "guideblock.simulation/1"
//!
//! [guide]                           # or law = "coulomb-viscous"
//! parameters = "zhou-2023"
//!
//! [operation]
//! preload_n = 3000.0
//!
//! [[mechanism]]                     # what acts beside the law; any number of them
//! id = "seal-drag"
//! drag_n = 4.2
//!
//! [[curve]]                         # what acts beside both and has no name; any number of them
//! axis = "velocity"
//! carrier = "odd"
//! at = [0.01, 0.1, 0.5]
//! height = [0.0, 0.4, 1.3]
//! ```
//!
//! Without `[guide]`, `[lubricant]` and `[operation]` a run is compared with its own column `simulated_force_n`.

mod curves;
mod mechanisms;
mod read;
mod write;

use crate::curve::AddedCurve;
use crate::document::BadFile;
use crate::guide::GuideSet;
use crate::mechanism::Added;

/// The value of `schema`.
pub const SCHEMA: &str = "guideblock.simulation/1";

/// A simulation: a law, its inputs, and how far it may be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// Law of the drag force.
    pub law: Law,
    /// Preload where a run has no column `preload_n`, N, 0 to 1e6.
    pub preload_n: Option<f64>,
    /// The axis.
    pub axis: Axis,
    /// Tolerances of the law's own parameters.
    pub tolerance: Tolerance,
    /// How columns of a recording are read: name and `column:scale[:offset]`, in the order of their names.
    pub columns: Vec<(String, String)>,
    /// Mechanisms that act beside the law, in the order of the file.
    pub mechanisms: Vec<Added>,
    /// Unnamed forces beside law and mechanisms, in the order of the file.
    pub curves: Vec<AddedCurve>,
}

/// Law of the drag force.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// A ball guide, Zhou 2023, Eq. 1 to 21.
    Guide(GuideSet),
    /// `F = coulomb·sign(V) + viscous·V + offset` and the axis' mass; `None` is fitted to the run.
    CoulombViscous {
        /// Constant friction, N.
        coulomb_n: Option<f64>,
        /// Friction that grows with speed, N s/m.
        viscous_n_s_m: Option<f64>,
        /// Force without motion, N; exact where it is given.
        offset_n: Option<f64>,
    },
    /// The run's own column `simulated_force_n`, made by another program. The numbers are factors on what that program
    /// is taken to have assumed, 0.05 to 20: 1 leaves its force unchanged.
    Column {
        /// Factor on the friction; an inertia in the column is not scaled.
        friction: f64,
        /// Factor on the inertia in the column.
        inertia: f64,
        /// Factor on the preload. Without a `preload_n` column, changing the preload has no effect.
        preload: f64,
        /// Factor on the viscosity.
        viscosity: f64,
    },
}

impl Law {
    /// The column unchanged.
    pub const COLUMN: Self = Law::Column { friction: 1.0, inertia: 1.0, preload: 1.0, viscosity: 1.0 };
}

/// The axis that carries the block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Mass that the law itself accelerates, kg, 0 to 1e5. `None` means 0 for a guide, and fitted for coulomb-viscous.
    pub moved_mass_kg: Option<f64>,
    /// Speed below which the carriage counts as standing, m/s, 0 to 1.
    pub zero_speed_m_s: f64,
    /// Whether positions of two recordings share a zero.
    pub position_reference: PositionReference,
}

impl Default for Axis {
    fn default() -> Self {
        Axis { moved_mass_kg: None, zero_speed_m_s: 3e-5, position_reference: PositionReference::Absolute }
    }
}

/// Whether positions of two recordings share a zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionReference {
    /// They do: what is tied to a place along the rail carries over.
    Absolute,
    /// They do not (incremental encoder).
    Relative,
}

/// Standard deviations (1 σ, relative, 0 to 10) of what the simulation assumes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// One gain on the preload.
    pub preload: f64,
    /// One factor on all friction terms, or on the friction in the column `simulated_force_n`.
    pub friction: f64,
    /// One factor on the viscosity.
    pub viscosity: f64,
    /// Independent factors on the friction terms beside the common one.
    pub friction_terms: f64,
    /// One factor on the moved mass.
    pub mass: f64,
    /// Share of the drag's RMS below which a mismatch is of no interest.
    pub relevance: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Tolerance { preload: 0.05, friction: 0.03, viscosity: 0.05, friction_terms: 0.0, mass: 0.0, relevance: 0.001 }
    }
}

impl Simulation {
    /// A law, with everything else as in an empty file.
    pub fn of(law: Law) -> Self {
        Simulation {
            law,
            preload_n: None,
            axis: Axis::default(),
            tolerance: Tolerance::default(),
            columns: Vec::new(),
            mechanisms: Vec::new(),
            curves: Vec::new(),
        }
    }

    /// Reads a simulation file.
    ///
    /// # Errors
    /// [`BadFile`]: no TOML, another schema, a section or key that does not exist, a value of the wrong kind or out of
    /// range, friction constants for which the drag does not determine the preload.
    pub fn from_toml(text: &str) -> Result<Self, BadFile> {
        read::simulation(text).map_err(|mistake| BadFile::at(text, mistake))
    }

    /// The file that reads back as this simulation; values that it does not set appear as comments with their
    /// provenance.
    pub fn to_toml(&self) -> String {
        write::simulation(self)
    }
}

#[cfg(test)]
mod tests;
