//! What the library says of a mechanism.

use super::context::Context;
use super::id::Id;

/// One column per amplitude, each with a value per row of the run.
pub type Columns = Vec<Vec<f64>>;

/// What a mechanism belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Something that happens in the machine.
    Physics,
    /// Something that the measurement does.
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
    /// Whether a number has it.
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
    /// A size that would not surprise, for examples and tests; nothing is penalised by it.
    pub typical: f64,
    /// The smallest size that means anything, sign aside: a channel that is late is so as a whole.
    pub least: f64,
    /// The largest size that means anything: a part of a whole is at most the whole.
    pub most: f64,
}

/// How the values of a shape parameter are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// On a grid of equal steps or ratios first, then around the best of it.
    Grid,
    /// The same, the finer the closer to 0, which lies in the middle: `value = end·u³`, equal steps of u from -1 to 1.
    EitherSide,
    /// A place along the rail: as [`Self::Grid`], over the recorded stroke.
    Place,
    /// As [`Self::Grid`] up to twice the recorded stroke: a longer wave is a slope.
    AlongStroke,
    /// The same up to twice the recorded travel: a longer decay is a constant, and a seal's friction its simpler name.
    AlongTravel,
    /// The same from the travel on at which the force arrives after a reversal: beside play of the coupling, what is over
    /// before that is not seen.
    SinceTurn,
    /// The length of a wave along the rail: far more values differ than a grid could hold, and a spectrum over the
    /// position tells all of them at once.
    Wave,
    /// Not at all: the lower end of the stroke that was recorded.
    StrokeStart,
    /// Not at all: its upper end.
    StrokeEnd,
}

/// A number that the force depends on otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeParameter {
    /// Name in reports and files, unit included.
    pub name: &'static str,
    /// Unit; empty for a number without one.
    pub unit: &'static str,
    /// Least value that is searched.
    pub from: f64,
    /// Greatest value that is searched.
    pub to: f64,
    /// Whether the grid has equal ratios instead of equal steps.
    pub log: bool,
    /// Number of values that a first look needs.
    pub grid: usize,
    /// How it is searched.
    pub search: Search,
}

impl ShapeParameter {
    /// Where a value lies between the ends: 0 at the least, 1 at the greatest.
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

    /// The value that lies there.
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
    /// What the columns depend on, in the order that [`Self::columns`] takes them.
    pub shape: &'static [ShapeParameter],
    /// What the columns are multiplied by, in their order.
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
    /// Whether it changes every preload by the same share, and so is another form only over several preloads.
    pub fn is_of_share(&self) -> bool {
        self.name.starts_with("share")
    }
}

/// A mechanism of the library.
#[derive(Clone, Copy, Debug)]
pub struct Definition {
    /// Which one.
    pub id: Id,
    /// What it belongs to.
    pub kind: Kind,
    /// Its forms; the first is the one with the fewest numbers.
    pub forms: &'static [Form],
    /// Axis of a report's `where` on which it shows first.
    pub axis: &'static str,
    /// What is claimed when it is named, in one plain sentence.
    pub statement: &'static str,
    /// What would prove the claim wrong.
    pub falsifier: &'static str,
    /// What it is easily taken for, and what breaks the tie.
    pub confused_with: &'static str,
    /// Code of the run that settles it best.
    pub next_experiment: &'static str,
    /// The lower of two that a recording cannot tell apart is named.
    pub simplicity: u8,
}
