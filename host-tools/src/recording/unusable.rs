//! Why nothing of a file can be used.

use super::Losses;

/// Why nothing of a file can be used. The text says what to do.
#[derive(Debug, thiserror::Error)]
pub enum Unusable {
    /// The file cannot be read.
    #[error("{file}: {}", crate::files::why(source))]
    Io {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// There is no byte in it.
    #[error("{file}: the file is empty")]
    Empty {
        /// The file.
        file: String,
    },
    /// The file is of another kind.
    #[error("{file}: this is {kind}, not a recording; {advice}")]
    OtherKind {
        /// The file.
        file: String,
        /// What it is.
        kind: &'static str,
        /// What to do.
        advice: &'static str,
    },
    /// A Parquet file that cannot be decoded.
    #[error("{file}: not a sound Parquet file: {why}")]
    Parquet {
        /// The file.
        file: String,
        /// What is wrong.
        why: String,
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
    /// The first row holds numbers.
    #[error(
        "{file}: line {line}: numbers where the names of the columns should stand; put a line above it, as `time_s,position_m,drag_force_n`"
    )]
    NoHeader {
        /// The file.
        file: String,
        /// The line.
        line: u64,
    },
    /// A column without which the file means nothing is missing.
    #[error("{file}: {place}no column {column}; {found}")]
    MissingColumn {
        /// The file.
        file: String,
        /// `line 1: `, or nothing where the file has no lines.
        place: String,
        /// The missing column, or what may stand in its place.
        column: String,
        /// The columns that are there, and what to do.
        found: String,
    },
    /// Two columns of one name, and one of them is needed.
    #[error(
        "{file}: {place}column {column} is there twice (columns {first} and {second}); name the one that is not meant differently"
    )]
    DuplicateColumn {
        /// The file.
        file: String,
        /// `line 1: `, or nothing where the file has no lines.
        place: String,
        /// The name.
        column: String,
        /// Number of the first, from 1.
        first: usize,
        /// Number of the second.
        second: usize,
    },
    /// A column of a Parquet file that is needed and holds no numbers.
    #[error("{file}: column {column} holds {found}, not numbers")]
    NotNumbers {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// What it holds.
        found: String,
    },
    /// A mapping gives a column that nothing here asks for.
    #[error("--column {column}=...: nothing reads a column {column}; there are: {known}")]
    UnknownName {
        /// The name that is given.
        column: String,
        /// The names that can be given.
        known: String,
    },
    /// Two mappings give the same column.
    #[error("--column {column}=... is given twice")]
    MappedTwice {
        /// That column.
        column: String,
    },
    /// No row is the one that was asked for.
    #[error("{file}: no row has {wanted}; {found}")]
    NoSuchRow {
        /// The file.
        file: String,
        /// What was asked for.
        wanted: String,
        /// What is there.
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
    /// The clock falls in many rows.
    #[error("{file}: column time_s: time runs backwards in {falls} of {rows} rows: sort the file by time")]
    Backwards {
        /// The file.
        file: String,
        /// Rows whose time is before that of the row above.
        falls: usize,
        /// All rows.
        rows: usize,
    },
    /// The force column holds one value.
    #[error("{file}: column drag_force_n is {value_n} N in every row: sensor not connected, or the wrong column")]
    ConstantForce {
        /// The file.
        file: String,
        /// That value.
        value_n: f64,
    },
    /// A column cannot be in the unit that its name says.
    #[error("{file}: column {column}: {why}{fix}")]
    Units {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// What cannot be, and what the unit may be instead.
        why: String,
        /// The option that reads the column in that unit, ready to be appended.
        fix: String,
    },
}

impl Unusable {
    /// Whether the command line is wrong, not the file.
    pub fn is_usage(&self) -> bool {
        matches!(self, Unusable::UnknownName { .. } | Unusable::MappedTwice { .. })
    }

    /// Whether the file could be read and only its content is useless: too few rows, a force that never changes,
    /// impossible units.
    pub fn was_read(&self) -> bool {
        matches!(
            self,
            Unusable::TooFew { .. }
                | Unusable::Backwards { .. }
                | Unusable::ConstantForce { .. }
                | Unusable::Units { .. }
        )
    }

    pub(super) fn too_few(file: &str, used: usize, what: &'static str, needed: usize, losses: &Losses) -> Self {
        let first = losses.problems.first().map_or_else(String::new, |p| format!("; first problem: {p}"));
        Unusable::TooFew { file: file.to_owned(), used, what, rows: losses.rows, needed, first }
    }
}
