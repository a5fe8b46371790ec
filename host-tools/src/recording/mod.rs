//! Recordings: raw samples of a block ([`raw`]) and runs of an axis ([`axis`]).
//!
//! Both readers follow one rule: what cannot be used is named with line and column, left out and counted;
//! what is left is used. Only a file of which nothing can be used is an error ([`Unusable`]).

pub mod axis;
pub mod raw;

use std::fmt;

/// What is wrong with one row. The text says what was expected and what becomes of the row.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The row has fewer cells than the header, as when a recorder is cut off.
    #[error("{found} cells instead of {expected}; the row is left out")]
    ShortLine {
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
    },
    /// The cell is no whole number of the legal range.
    #[error("{cell:?} is not a whole number from 0 to {max}; the row is left out")]
    NotACount {
        /// What stands there.
        cell: String,
        /// Largest legal value.
        max: u32,
    },
    /// The cell is no number.
    #[error("{cell:?} is not a number (decimal mark is the point); the row is left out")]
    NotANumber {
        /// What stands there.
        cell: String,
    },
    /// The cell is infinite or not a number.
    #[error("{cell:?} is not finite; the row is left out")]
    NotFinite {
        /// What stands there.
        cell: String,
    },
    /// A cell without which the row means nothing is empty.
    #[error("not measured here, but every row needs it; the row is left out")]
    NotMeasured,
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
    #[error("time {time_s} s again; the row is left out")]
    TimeRepeated {
        /// The time.
        time_s: f64,
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
    #[error("time {to_s} s lies before {from_s} s; the row is left out")]
    TimeBackward {
        /// Time of the row before.
        from_s: f64,
        /// Time of this row.
        to_s: f64,
    },
    /// Samples are missing.
    #[error("{missing_s:.3} s without samples (median step {step_s:.4} s); what follows is a part of its own")]
    Gap {
        /// Time without samples.
        missing_s: f64,
        /// Usual step.
        step_s: f64,
    },
}

/// A fault and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Line of the file, the first is 1.
    pub line: u64,
    /// Name of the column, where the fault is one of a cell.
    pub column: Option<&'static str>,
    /// What is wrong.
    pub fault: Fault,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: ", self.line)?;
        if let Some(column) = self.column {
            write!(f, "column {column}: ")?;
        }
        self.fault.fmt(f)
    }
}

/// What reading a file cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Losses {
    /// Rows of the file, header and comments not counted.
    pub rows: u64,
    /// Rows that could not be used.
    pub lost: u64,
    /// Everything found wrong, in the order of the file.
    pub problems: Vec<Problem>,
}

impl Losses {
    /// How many problems [`describe`](Self::describe) spells out.
    pub const SPELT_OUT: usize = 5;

    /// A message a line, each with the file's name: the first problems, then how many more, then the loss.
    /// Empty when there is nothing to say.
    pub fn describe(&self, file: &str) -> Vec<String> {
        let mut lines: Vec<_> =
            self.problems.iter().take(Self::SPELT_OUT).map(|problem| format!("{file}: {problem}")).collect();
        if let more @ 1.. = self.problems.len().saturating_sub(Self::SPELT_OUT) {
            lines.push(format!("{file}: {more} more problems of these kinds"));
        }
        if !lines.is_empty() {
            lines.push(format!("{file}: {} of {} rows lost", self.lost, self.rows));
        }
        lines
    }

    fn note(&mut self, line: u64, column: Option<&'static str>, fault: Fault) {
        self.problems.push(Problem { line, column, fault });
    }
}

/// Why nothing of a file can be used. The text says what to do.
#[derive(Debug, thiserror::Error)]
pub enum Unusable {
    /// The file cannot be read.
    #[error("{file}: {source}")]
    Io {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file does not say that it is what is expected.
    #[error("{file}: line {line}: expected `{expected}`, found {found:?}; {hint}")]
    Schema {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The line that should stand there.
        expected: String,
        /// What stands there.
        found: String,
        /// What to do.
        hint: &'static str,
    },
    /// A column without which the file means nothing is missing.
    #[error("{file}: line {line}: no column {column}; the header row has: {found}")]
    MissingColumn {
        /// The file.
        file: String,
        /// The line of the header row.
        line: u64,
        /// The missing column, or what may stand in its place.
        column: &'static str,
        /// The columns that are there.
        found: String,
    },
    /// Too little is left.
    #[error("{file}: {used} usable {what} of {rows} rows, at least {needed} are needed{first}")]
    TooFew {
        /// The file.
        file: String,
        /// What is left.
        used: usize,
        /// Rows or blocks.
        what: &'static str,
        /// Rows of the file.
        rows: u64,
        /// What is needed.
        needed: usize,
        /// The first problem, ready to be appended.
        first: String,
    },
    /// The force column holds one value.
    #[error("{file}: column drag_force_n is {value_n} N in every row: sensor not connected, or the wrong column")]
    ConstantForce {
        /// The file.
        file: String,
        /// That value.
        value_n: f64,
    },
}

impl Unusable {
    fn too_few(file: &str, used: usize, what: &'static str, needed: usize, losses: &Losses) -> Self {
        let first = losses.problems.first().map_or_else(String::new, |p| format!("; first problem: {p}"));
        Unusable::TooFew { file: file.to_owned(), used, what, rows: losses.rows, needed, first }
    }
}
