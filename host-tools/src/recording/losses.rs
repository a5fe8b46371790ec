//! Faults of rows, and losses from reading a file.

use std::collections::BTreeMap;
use std::fmt;

use crate::report::number::short;

/// What is wrong with one row.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The row has fewer cells than the header.
    #[error("{found} cells instead of {expected}")]
    ShortLine {
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// The row has more cells than the header.
    #[error("{found} cells instead of {expected} (a decimal comma? then separate the columns with `;`)")]
    LongLine {
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// The last row has no line end and fewer cells than the header.
    #[error("the file ends after {found} of {expected} cells: the recorder was cut off")]
    CutOff {
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// The last row has no line end and its last cell is shorter than the one above.
    #[error(
        "the file ends within {cell:?}, which is shorter than the cell above and has no line end: the recorder was cut off"
    )]
    CutCell {
        /// What is left of it.
        cell: String,
    },
    /// The cell is no whole number of the legal range.
    #[error("{cell:?} is not a whole number from 0 to {max}")]
    NotACount {
        /// What stands there.
        cell: String,
        /// Largest legal value.
        max: u32,
    },
    /// The cell is no whole number.
    #[error("{cell:?} is not a whole number")]
    NotWhole {
        /// What stands there.
        cell: String,
    },
    /// The cell is no number.
    #[error("{cell:?} is not a number (decimal mark is the point)")]
    NotANumber {
        /// What stands there.
        cell: String,
    },
    /// The cell holds bytes that no text has.
    #[error("zero bytes instead of a number: the recorder lost power while writing")]
    ZeroBytes,
    /// The cell is infinite or not a number.
    #[error("{cell:?} is not finite")]
    NotFinite {
        /// What stands there.
        cell: String,
    },
    /// The cell is beyond 1e20.
    #[error("{cell:?} is larger than anything that is measured, in any unit")]
    TooLarge {
        /// What stands there.
        cell: String,
    },
    /// A cell without which the row means nothing is empty.
    #[error("not measured here, but every row needs it")]
    NotMeasured,
    /// A column of motion is empty too often to be used, and the other one is there.
    #[error("not measured in {rows} rows; the column is left out, {instead} is there")]
    MotionColumn {
        /// Rows without it.
        rows: usize,
        /// The column that is used.
        instead: &'static str,
    },
    /// The header row is not UTF-8.
    #[error("not UTF-8: read as Latin-1")]
    Latin1,
    /// The row below the header holds units.
    #[error("units instead of numbers; the row is left out")]
    UnitsRow,
    /// An optional column of which no cell can be used.
    #[error("{found} instead of numbers in every row; the column is left out")]
    NoNumbers {
        /// What stands there.
        found: String,
    },
    /// A column `segment` of texts.
    #[error("names of parts instead of numbers, read like that: {names}")]
    NamedParts {
        /// The numbers that the names are given.
        names: String,
    },
    /// A column `segment` of texts that hardly ever repeat.
    #[error("more than {most} different texts in {rows} rows are no parts of a test; the column is left out")]
    TooManyNames {
        /// Rows.
        rows: usize,
        /// As many parts could be.
        most: usize,
    },
    /// The velocity says the opposite of the position.
    #[error("has the opposite sign of what position_m does; map one of them with the scale -1")]
    OppositeVelocity,
    /// The file is not written as the contract says, but can be read.
    #[error("columns are separated by {separator:?} and the decimal mark is {mark:?}: read like that")]
    Dialect {
        /// What separates the columns.
        separator: char,
        /// The decimal mark.
        mark: char,
    },
    /// A block of samples lacks some.
    #[error("block {tick} has {found} of 16 samples in order; the block is left out and replay sees a gap")]
    IncompleteBlock {
        /// Tick of the block.
        tick: u32,
        /// Samples it has.
        found: usize,
    },
    /// A tick that is not larger than the one before.
    #[error("tick {tick} does not come after {last}; the block is left out (two recordings in one file?)")]
    TickBackward {
        /// Tick of the row.
        tick: u32,
        /// Tick of the block before.
        last: u32,
    },
    /// The time of the row before, again.
    #[error("time {time_s} s again")]
    TimeRepeated {
        /// The time.
        time_s: f64,
    },
    /// One row whose time fits neither the row before nor the row after, which fit each other.
    #[error("time {time_s} s stands between {from_s} s and {to_s} s")]
    TimeOutOfOrder {
        /// Time of the row before.
        from_s: f64,
        /// Time of this row.
        time_s: f64,
        /// Time of the row after.
        to_s: f64,
    },
    /// The clock jumped back for the first time.
    #[error("clock jumps back from {from_s} s to {to_s} s; what follows is a part of its own")]
    ClockJump {
        /// Time of the row before.
        from_s: f64,
        /// Time of this row.
        to_s: f64,
    },
    /// The clock jumped back once more.
    #[error(
        "time {to_s} s lies before {from_s} s and the clock jumped back before (several runs in one file? give each a number in a column segment)"
    )]
    TimeBackward {
        /// Time of the row before.
        from_s: f64,
        /// Time of this row.
        to_s: f64,
    },
    /// Samples are missing.
    #[error("{}; what follows is a part of its own", gap(*missing_s, *step_s))]
    Gap {
        /// Time without samples.
        missing_s: f64,
        /// Usual step.
        step_s: f64,
    },
}

/// Rows that are missing and what tells it.
fn gap(missing_s: f64, step_s: f64) -> String {
    let rows = (missing_s / step_s).round();
    let rows = if rows == 1.0 { "1 row".to_owned() } else { format!("{rows} rows") };
    let [since_s, step_s] = [missing_s + step_s, step_s].map(|s| short(s, 4));
    format!("{rows} missing: {since_s} s since the last one, steps are {step_s} s")
}

impl Fault {
    /// The cell that is no number.
    fn cell(&self) -> String {
        match self {
            Fault::NotANumber { cell } | Fault::NotFinite { cell } | Fault::TooLarge { cell } => format!("{cell:?}"),
            _ => "zero bytes".to_owned(),
        }
    }

    /// Under which name rows that it costs are counted.
    pub fn id(&self) -> &'static str {
        match self {
            Fault::ShortLine { .. } => "short-line",
            Fault::LongLine { .. } => "long-line",
            Fault::CutOff { .. } | Fault::CutCell { .. } => "cut-off",
            Fault::NotACount { .. } | Fault::NotWhole { .. } | Fault::NotANumber { .. } => "not-a-number",
            Fault::ZeroBytes => "zero-bytes",
            Fault::NotFinite { .. } => "not-finite",
            Fault::TooLarge { .. } => "too-large",
            Fault::NotMeasured => "not-measured",
            Fault::MotionColumn { .. } => "motion-column",
            Fault::Latin1 => "latin-1",
            Fault::UnitsRow => "units-row",
            Fault::NoNumbers { .. } => "no-numbers",
            Fault::NamedParts { .. } => "named-parts",
            Fault::TooManyNames { .. } => "too-many-names",
            Fault::OppositeVelocity => "opposite-velocity",
            Fault::Dialect { .. } => "dialect",
            Fault::IncompleteBlock { .. } => "incomplete-block",
            Fault::TickBackward { .. } => "tick-backward",
            Fault::TimeRepeated { .. } => "time-repeated",
            Fault::TimeOutOfOrder { .. } => "time-out-of-order",
            Fault::ClockJump { .. } => "clock-jump",
            Fault::TimeBackward { .. } => "time-backward",
            Fault::Gap { .. } => "gap",
        }
    }
}

/// What a fault cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// The row.
    Row,
    /// The cell, which counts as not measured; the row is used.
    Cell,
    /// What the fault itself says.
    AsSaid,
}

/// Where a fault stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Line of a text file, the first is 1.
    Line(u64),
    /// Row of a table that has no lines, the first is 1.
    Row(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Row(row) => write!(f, "row {row}"),
        }
    }
}

/// A fault, where it stands and what it cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where.
    pub place: Place,
    /// Name of the column, where the fault is one of a cell.
    pub column: Option<String>,
    /// What is wrong.
    pub fault: Fault,
    /// What it cost.
    pub cost: Cost,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        if let Some(column) = &self.column {
            write!(f, "column {column}: ")?;
        }
        self.fault.fmt(f)?;
        f.write_str(match self.cost {
            Cost::Row => "; the row is left out",
            Cost::Cell => "; it counts as not measured",
            Cost::AsSaid => "",
        })
    }
}

/// What reading a file cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Losses {
    /// Rows of the file, header, comments and rows that were not asked for (`--where`) not counted.
    pub rows: u64,
    /// Rows that could not be used.
    pub lost: u64,
    /// Rows that could not be used by reason, [`Fault::id`]. Adds up to `lost`.
    pub rejected: BTreeMap<&'static str, u64>,
    /// Gaps in time inside a segment.
    pub gaps: u64,
    /// Everything found wrong, how often.
    pub found: u64,
    /// The first [`KEPT`](Self::KEPT) of it, in the order of the file.
    pub problems: Vec<Problem>,
}

impl Losses {
    /// How many problems [`describe`](Self::describe) spells out.
    pub const SPELT_OUT: usize = 5;

    /// How many problems are kept. A file may have one in every row; what is kept of it may not grow with it.
    pub const KEPT: usize = 32;

    /// A message a line, each with the file's name: the first problems, then how many more, then the loss.
    /// Empty when there is nothing to say.
    pub fn describe(&self, file: &str) -> Vec<String> {
        let mut lines: Vec<_> =
            self.problems.iter().take(Self::SPELT_OUT).map(|problem| format!("{file}: {problem}")).collect();
        if let more @ 1.. = self.found.saturating_sub(lines.len() as u64) {
            lines.push(format!("{file}: {more} more problems of these kinds"));
        }
        if self.lost > 0 {
            lines.push(format!("{file}: {} of {} rows lost", self.lost, self.rows));
        }
        lines
    }

    /// Something that costs no whole row, or whose cost is counted elsewhere.
    pub(super) fn note(&mut self, place: Place, column: Option<&str>, fault: Fault, cost: Cost) {
        self.found += 1;
        if self.problems.len() < Self::KEPT {
            self.problems.push(Problem { place, column: column.map(str::to_owned), fault, cost });
        }
    }

    /// A row that is left out.
    pub(super) fn reject(&mut self, place: Place, column: Option<&str>, fault: Fault) {
        self.count(fault.id(), 1);
        self.note(place, column, fault, Cost::Row);
    }

    /// Counts rows that are left out without a message each.
    pub(super) fn count(&mut self, id: &'static str, rows: u64) {
        self.lost += rows;
        *self.rejected.entry(id).or_default() += rows;
    }

    /// One message in place of one a row about a column of which no cell could be used.
    pub(super) fn gather(&mut self, column: &str, rows: u64) {
        let is_of_column = |problem: &Problem| problem.cost == Cost::Cell && problem.column.as_deref() == Some(column);
        let Some(first) = self.problems.iter().position(is_of_column) else { return };
        let (place, found) = (self.problems[first].place, self.problems[first].fault.cell());
        self.problems.retain(|problem| !is_of_column(problem));
        self.found -= rows;
        let mut said = Losses::default();
        said.note(place, Some(column), Fault::NoNumbers { found }, Cost::AsSaid);
        self.absorb(said);
    }

    /// Adds what another pass over the same file, or another piece of it, has found.
    pub(super) fn absorb(&mut self, other: Losses) {
        self.rows += other.rows;
        self.lost += other.lost;
        self.gaps += other.gaps;
        self.found += other.found;
        for (id, rows) in other.rejected {
            *self.rejected.entry(id).or_default() += rows;
        }
        self.problems.extend(other.problems);
        self.problems.sort_by_key(|problem| problem.place);
        // both lists hold the first ones of their pass, so the first of both are the first of all
        self.problems.truncate(Self::KEPT);
    }
}
