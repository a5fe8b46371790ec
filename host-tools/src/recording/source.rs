//! A file of either kind whose columns can be read more than once: as numbers or as texts.

use super::cell::{cells, decoded, number, told};
use super::columns::{Header, Numbers, Wanted};
use super::dialect::{Opening, opening};
use super::{Progress, Selection, Unusable, parquet, text};

/// Rows that decide whether a column that means nothing here holds numbers.
const LOOKED_AT: usize = 1000;

/// Whole numbers from here on are not all `f64`.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Digits from which a number may not be an `f64` and is kept as the text it is: a clock in ns, an identifier.
const LONG: usize = 16;

/// Where the columns come from.
pub(super) enum Source {
    Text(Opening, Vec<u8>),
    Parquet(parquet::Table),
}

impl Source {
    /// Looks at a file in memory; `file` is its name in messages.
    ///
    /// # Errors
    /// [`Unusable`] when it is neither a table of text nor Parquet.
    pub(super) fn of(file: &str, bytes: Vec<u8>) -> Result<Self, Unusable> {
        Ok(if bytes.starts_with(parquet::MAGIC) {
            Source::Parquet(parquet::Table::new(file, bytes)?)
        } else {
            Source::Text(opening(file, &bytes)?, bytes)
        })
    }

    /// The names of its columns.
    pub(super) fn header(&self) -> &Header {
        match self {
            Source::Text(opening, _) => &opening.header,
            Source::Parquet(table) => table.header(),
        }
    }

    /// Whether a text below the header row is no UTF-8.
    pub(super) fn is_latin_1(&self) -> bool {
        matches!(self, Source::Text(opening, bytes) if std::str::from_utf8(&bytes[opening.rows..]).is_err())
    }

    /// Whether the first rows of a column hold something that no `f64` can hold.
    pub(super) fn looks_like_text(&self, place: usize) -> bool {
        match self {
            Source::Parquet(table) => table.not_numbers(place).is_some(),
            Source::Text(opening, bytes) => {
                let Opening { dialect, rows, .. } = opening;
                bytes[*rows..].split(|byte| *byte == b'\n').take(LOOKED_AT).any(|line| {
                    cells(line, dialect.separator).get(place).is_some_and(|cell| {
                        let is_long =
                            cell.iter().filter(|byte| byte.is_ascii_digit()).count() >= LONG && !cell.contains(&b'.');
                        is_long || number(cell, dialect.comma).is_err()
                    })
                })
            }
        }
    }

    /// What a column holds of whose first rows none has a number.
    pub(super) fn no_numbers(&self, place: usize) -> Option<String> {
        let Source::Text(Opening { dialect, rows, .. }, bytes) = self else {
            return match self {
                Source::Parquet(table) => table.not_numbers(place),
                Source::Text(..) => None,
            };
        };
        let mut found = None;
        for line in bytes[*rows..].split(|byte| *byte == b'\n').take(LOOKED_AT) {
            let cells = cells(line, dialect.separator);
            let Some(cell) = cells.get(place) else { continue };
            match number(cell, dialect.comma) {
                Ok(None) => {}
                Ok(Some(_)) => return None,
                Err(_) => found = found.or_else(|| Some(format!("{:?}", told(cell.trim_ascii())))),
            }
        }
        found
    }

    /// Whether a column of whole numbers has lost digits.
    pub(super) fn is_inexact(&self, place: usize, column: &[f64]) -> bool {
        match self {
            Source::Text(..) => false,
            Source::Parquet(table) => table.is_whole(place) && column.iter().any(|v| v.abs() >= EXACT),
        }
    }

    /// Columns of numbers.
    ///
    /// # Errors
    /// [`Unusable`] when a column holds no numbers, the file is damaged, or no row is a selected one.
    pub(super) fn numbers(
        &self,
        file: &str,
        wanted: Vec<Wanted>,
        selections: &[Selection],
        progress: Progress,
    ) -> Result<Numbers, Unusable> {
        match self {
            Source::Text(_, bytes) => Ok(text::read(file, bytes, |_| Ok(wanted), selections, progress)?.1),
            Source::Parquet(table) => table.numbers(&wanted, selections, progress),
        }
    }

    /// The cells of a column in some lines, which rise.
    pub(super) fn texts(&self, place: usize, lines: &[u64]) -> Result<Vec<String>, Unusable> {
        let mut wanted = lines.iter().copied().peekable();
        match self {
            Source::Text(opening, bytes) => {
                let mut texts = Vec::with_capacity(lines.len());
                for (line, text) in (opening.line + 1..).zip(bytes[opening.rows..].split(|byte| *byte == b'\n')) {
                    if wanted.next_if_eq(&line).is_some() {
                        let text = text.strip_suffix(b"\r").unwrap_or(text);
                        let cells = cells(text, opening.dialect.separator);
                        let cell = cells.get(place).map_or(&b""[..], |cell| cell.trim_ascii());
                        texts.push(decoded(cell));
                    }
                }
                Ok(texts)
            }
            Source::Parquet(table) => {
                let texts = (1..).zip(table.texts(place)?);
                Ok(texts.filter(|(row, _)| wanted.next_if_eq(row).is_some()).map(|(_, text)| text).collect())
            }
        }
    }
}
