//! How a mechanism is described.

use super::{Context, Id};

/// Whether a cause is in the machine or in what measures it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// In the machine.
    Physics,
    /// In a sensor.
    Sensor,
}

/// Which sign an amplitude can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// Above 0.
    Positive,
    /// Below 0.
    Negative,
    /// Either.
    Free,
}

/// A number that a form is linear in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitude {
    /// Name, as a key of a file; it ends with the unit where it has one.
    pub name: &'static str,
    /// Unit; empty for a plain number.
    pub unit: &'static str,
    /// Sign that physics allows.
    pub sign: Sign,
    /// Size that is common in machines.
    pub typical: f64,
}

/// A number that a form is not linear in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeParameter {
    /// Name, as a key of a file; it ends with the unit where it has one.
    pub name: &'static str,
    /// Unit; empty for a plain number.
    pub unit: &'static str,
    /// Least value.
    pub from: f64,
    /// Largest value.
    pub to: f64,
    /// Whether places are spread evenly in the logarithm.
    pub log: bool,
    /// Places at which a search looks first.
    pub grid: usize,
}

/// Makes the columns of a form over the rows of a run, N for an amplitude of 1; `None` where the run cannot show it.
pub type Columns = fn(&Context<'_>, shape: &[f64]) -> Option<Vec<Vec<f64>>>;

/// One parametric form. Form 0 of a mechanism is the least one.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Name.
    pub name: &'static str,
    /// Numbers it is not linear in.
    pub shape: &'static [ShapeParameter],
    /// Numbers it is linear in.
    pub amplitudes: &'static [Amplitude],
    /// One column an amplitude.
    pub columns: Columns,
    /// Whether it is tied to a place or a phase along the rail, which two recordings share only where their positions
    /// have one zero.
    pub phase_bound: bool,
}

/// A mechanism.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    /// Its name.
    pub id: Id,
    /// Physics or sensor.
    pub kind: Kind,
    /// Its forms, the least first.
    pub forms: &'static [Form],
    /// Axis of the contract's `where` on which it shows first.
    pub axis: &'static str,
    /// The cause in a plain sentence.
    pub statement: &'static str,
    /// What would refute it.
    pub falsifier: &'static str,
    /// Code of the run that settles it best.
    pub next_experiment: &'static str,
    /// Of causes that a recording cannot tell apart the one with the lowest number leads.
    pub simplicity: u8,
}

/// An amplitude.
pub(super) const fn amplitude(name: &'static str, unit: &'static str, sign: Sign, typical: f64) -> Amplitude {
    Amplitude { name, unit, sign, typical }
}

/// A shape parameter whose places are spread in the logarithm.
pub(super) const fn scale(name: &'static str, unit: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit, from, to, log: true, grid }
}

/// A shape parameter whose places are spread evenly.
pub(super) const fn place(name: &'static str, unit: &'static str, from: f64, to: f64, grid: usize) -> ShapeParameter {
    ShapeParameter { name, unit, from, to, log: false, grid }
}
