//! Mechanisms: physics that a simulation may have left out, and measurement effects that look like it.
//!
//! ```text
//! id          their names
//! definition  definition of each: forms, equations, what would refute it
//! context     what a mechanism may depend on, row by row
//! library     all of them; one file per family beside it
//! added       a mechanism with numbers
//! ```
//!
//! Every form is `F = Σ amplitude·column(shape)`: linear in its amplitudes, so that a fit only has to search the few
//! shape parameters. What changes the preload or the oil acts through the law's own derivative, with one number for all
//! speeds and loads. `docs/mechanisms.md` lists them.

mod added;
mod context;
mod definition;
mod id;
mod library;
mod onset;
mod path;

mod contacts;
mod direction;
mod encoder;
mod filter;
mod inertia_and_chain;
mod load;
mod periodic;
mod presliding;
mod rail;
mod resonance;
mod seals_and_oil;
mod sensor_dynamics;
mod sensor_level;
mod table;
mod temperature;
mod travel;

pub use added::Added;
pub use context::{Context, FAR_M, Geometry};
pub use definition::{Amplitude, Columns, Definition, Form, Kind, Search, ShapeParameter, Sign};
pub use id::Id;
pub use library::{definition, library};

use Sign::{Free, Negative, Positive};

/// An amplitude.
const fn amplitude(name: &'static str, unit: &'static str, sign: Sign, typical: f64) -> Amplitude {
    Amplitude { name, unit, sign, typical, least: 0.0, most: f64::INFINITY }
}

/// A share of a whole: at most all of it, with 30 % allowance for what the law does not know of the whole.
const fn part(name: &'static str, typical: f64) -> Amplitude {
    Amplitude { name, unit: "", sign: Positive, typical, least: 0.0, most: 1.3 }
}

/// An amplitude with a limit that no machine exceeds.
const fn at_most(name: &'static str, unit: &'static str, sign: Sign, typical: f64, most: f64) -> Amplitude {
    Amplitude { name, unit, sign, typical, least: 0.0, most }
}

/// A share that is the whole, within `slack` for what the law does not know of it.
const fn whole(name: &'static str, slack: f64) -> Amplitude {
    Amplitude { name, unit: "", sign: Positive, typical: 1.0, least: 1.0 - slack, most: 1.0 + slack }
}

/// Both ends of the recorded stroke.
const STROKE: [ShapeParameter; 2] = [
    ShapeParameter { name: "from_m", unit: "m", from: -1e3, to: 1e3, log: false, grid: 2, search: Search::StrokeStart },
    ShapeParameter { name: "to_m", unit: "m", from: -1e3, to: 1e3, log: false, grid: 2, search: Search::StrokeEnd },
];

/// A shape parameter on a grid of equal ratios.
const fn ratio(name: &'static str, unit: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit, from, to, log: true, grid, search: Search::Grid }
}

/// A place along the rail, every 50 mm of the stroke: half the loaded length of an SHS35.
const PLACE: ShapeParameter =
    ShapeParameter { name: "place_m", unit: "m", from: -1e3, to: 1e3, log: false, grid: 40_001, search: Search::Place };

/// A length along the rail; the stroke must show at least half of it.
const fn along_stroke(name: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit: "m", from, to, log: true, grid, search: Search::AlongStroke }
}

/// A distance of travel; the recording must show at least half of it.
const fn along_travel(name: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit: "m", from, to, log: true, grid, search: Search::AlongTravel }
}

/// A distance since a reversal, which play of the coupling may hide.
const fn since_turn(name: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit: "m", from, to, log: true, grid, search: Search::SinceTurn }
}

/// The length of a wave along the rail, m, found by spectrum.
const fn wave(name: &'static str, from: f64, to: f64) -> ShapeParameter {
    ShapeParameter { name, unit: "m", from, to, log: true, grid: 60, search: Search::Wave }
}

/// A shape parameter on a grid of equal steps.
const fn steps(name: &'static str, unit: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit, from, to, log: false, grid, search: Search::Grid }
}

/// A shape parameter of either sign, on a grid that is finer near 0; `grid` is even, so that 0 is not on it.
const fn either_side(name: &'static str, unit: &'static str, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit, from: -to, to, log: false, grid, search: Search::EitherSide }
}

/// The columns, unless every one is zero in every row: then the run does not show the mechanism.
fn shown(columns: Columns) -> Option<Columns> {
    columns.iter().flatten().any(|x| *x != 0.0 && x.is_finite()).then_some(columns)
}

#[cfg(test)]
mod tests;
