//! Any table of numbers: rows without a clock, such as means of runs at constant speed.

use std::path::Path;

use super::columns::{Header, Need, Wanted, check_mappings};
use super::{Losses, Mapping, Progress, Selection, Unusable, load, numbers};

/// Columns of numbers, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    /// Number of rows, at least 1.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether there is no row; never, for a table that was read.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A column that was asked for. `None` when the file does not have it; NaN where an optional one was not measured.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|place| &*self.columns[place])
    }
}

/// Reads the columns `required` and, where they are there, `optional`. The path `-` is standard input.
///
/// A row whose cell in a required column is empty or spoilt is left out; in an optional one it is not measured.
///
/// # Errors
/// [`Unusable`] when the file cannot be read, a required column is missing, or no row is left.
pub fn open(
    path: &Path,
    required: &[&str],
    optional: &[&str],
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Table, Losses), Unusable> {
    let (file, bytes) = load(path)?;
    from_bytes(&file, bytes, required, optional, mappings, selections, progress)
}

/// The same from memory; `file` is its name in messages.
///
/// # Errors
/// As [`open`].
pub fn from_bytes(
    file: &str,
    bytes: Vec<u8>,
    required: &[&str],
    optional: &[&str],
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Table, Losses), Unusable> {
    check_mappings(mappings, &[required, optional].concat())?;
    let choose = |header: &Header| -> Result<Vec<Wanted>, Unusable> {
        let mut wanted = Vec::new();
        for name in required {
            let advice = format!("; --column {name}=COLUMN:SCALE reads it from another one");
            let column = header.wanted(name, Need::Everywhere, mappings)?;
            wanted.push(column.ok_or_else(|| header.missing(name, &advice))?);
        }
        for name in optional {
            wanted.extend(header.wanted(name, Need::Anything, mappings)?);
        }
        Ok(wanted)
    };
    let (wanted, numbers) = numbers(file, bytes, choose, selections, progress)?;
    let rows = numbers.places.len();
    if rows == 0 {
        return Err(Unusable::too_few(file, 0, "rows", 1, &numbers.losses));
    }
    let names = wanted.into_iter().map(|wanted| wanted.name).collect();
    Ok((Table { names, columns: numbers.columns }, numbers.losses))
}
