//! Definition of a mechanism in the library.

use super::context::Context;
use super::id::Id;

/// One column per amplitude, each with a value per row of the run.
pub type Columns = Vec<Vec<f64>>;

/// Origin of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An effect in the machine.
    Physics,
    /// An effect of the measurement.
    Sensor,
}

impl Kind {
    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Physics => "physics",
            Kind::Sensor => "sensor",
        }
    }
}

/// The sign that an amplitude can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sign {
    /// 0 or above.
    Positive,
    /// 0 or below.
    Negative,
    /// Either.
    Free,
}

impl Sign {
    /// Whether a number has this sign.
    pub fn allows(self, x: f64) -> bool {
        match self {
            Sign::Positive => x >= 0.0,
            Sign::Negative => x <= 0.0,
            Sign::Free => true,
        }
    }
}

/// A number that the force is proportional to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitude {
    /// Name in reports and files, unit included.
    pub name: &'static str,
    /// Unit; empty for a number without one.
    pub unit: &'static str,
    /// Its sign.
    pub sign: Sign,
    /// A plausible magnitude, for examples and tests; nothing is penalised by it.
    pub typical: f64,
    /// Least meaningful magnitude: for example, a late channel is late as a whole.
    pub least: f64,
    /// Largest meaningful magnitude: for example, a part is at most the whole.
    pub most: f64,
}

/// Search method for a shape parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// On a grid of equal steps or ratios first, then around its best point.
    Grid,
    /// The same on both sides of 0, finer near 0: `value = end·u³` with equal steps of u from -1 to 1.
    EitherSide,
    /// A place along the rail: as [`Self::Grid`], over the recorded stroke.
    Place,
    /// As [`Self::Grid`], up to twice the recorded stroke: a longer wave is a slope.
    AlongStroke,
    /// As [`Self::Grid`], up to twice the recorded travel: a longer decay is a constant, for which seal friction is the
    /// simpler name.
    AlongTravel,
    /// As [`Self::Grid`], from the travel on at which the force arrives after a reversal: with play of the coupling,
    /// shorter effects are not seen.
    SinceTurn,
    /// Wavelength along the rail: too many distinguishable values for a grid, but a spectrum over position examines
    /// them all at once.
    Wave,
    /// Not searched: lower end of the recorded stroke.
    StrokeStart,
    /// Not searched: upper end of the recorded stroke.
    StrokeEnd,
}

/// A number on which the force depends nonlinearly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeParameter {
    /// Name in reports and files, unit included.
    pub name: &'static str,
    /// Unit; empty for a number without one.
    pub unit: &'static str,
    /// Least value searched.
    pub from: f64,
    /// Largest value searched.
    pub to: f64,
    /// Whether the grid has equal ratios instead of equal steps.
    pub log: bool,
    /// Number of grid points for a first look.
    pub grid: usize,
    /// Search method.
    pub search: Search,
}

impl ShapeParameter {
    /// Position of a value within the range: 0 at the least, 1 at the largest value.
    #[must_use]
    pub fn share_of(&self, value: f64) -> f64 {
        if self.log {
            (value / self.from).ln() / (self.to / self.from).ln()
        } else if self.search == Search::EitherSide {
            0.5 + 0.5 * (value / self.to).cbrt()
        } else {
            (value - self.from) / (self.to - self.from)
        }
    }

    /// The value at such a position.
    #[must_use]
    pub fn at(&self, share: f64) -> f64 {
        if self.log {
            self.from * (self.to / self.from).powf(share)
        } else if self.search == Search::EitherSide {
            self.to * (2.0 * share - 1.0).powi(3)
        } else {
            self.from + (self.to - self.from) * share
        }
    }
}

/// A parametric form of a mechanism: `F = Σ amplitude·column(shape)`, added to the law's force.
///
/// The sign is that of `drag_force_n`: the drive's force on the carriage, positive towards +position.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Name in reports and files.
    pub name: &'static str,
    /// Shape parameters on which the columns depend, in the order of [`Self::columns`].
    pub shape: &'static [ShapeParameter],
    /// Amplitudes that multiply the columns, in their order.
    pub amplitudes: &'static [Amplitude],
    /// The columns over the rows of a run, finite wherever the law's force is; `None` where this run cannot show the
    /// form: a column is missing, nothing rests or reverses, a place is not reached, or there are not as many numbers
    /// as shape parameters.
    pub columns: fn(&Context<'_>, &[f64]) -> Option<Columns>,
    /// Whether it is tied to a place or a phase along the rail, which two recordings share only with an absolute
    /// encoder.
    pub phase_bound: bool,
    /// The equation, in one line.
    pub equation: &'static str,
}

impl Form {
    /// Whether it changes every preload by the same share, which differs from other forms only over several preloads.
    pub fn is_of_share(&self) -> bool {
        self.name.starts_with("share")
    }
}

/// A mechanism of the library.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    /// Which one.
    pub id: Id,
    /// Physics or sensor.
    pub kind: Kind,
    /// Its forms; the first is the one with the fewest numbers.
    pub forms: &'static [Form],
    /// Axis of a report's `where` on which it shows best.
    pub axis: &'static str,
    /// The claim made by naming it, in one plain sentence.
    pub statement: &'static str,
    /// Observation that would refute the claim.
    pub falsifier: &'static str,
    /// Mechanisms easily confused with it, and what distinguishes them.
    pub confused_with: &'static str,
    /// Code of the run that best settles it.
    pub next_experiment: &'static str,
    /// Rank among mechanisms that a recording cannot tell apart: the lowest is named.
    pub simplicity: u8,
}
