//! Dialect of a text file: byte-order mark, separator, decimal mark, header row; and detection of files that are no
//! text.

use memchr::{memchr, memchr_iter};

use super::cell::{cells, decoded, number};
use super::columns::Header;
use super::{Cost, Fault, Losses, Place, Unusable};

/// Dialect of a text file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    /// Between cells.
    pub(super) separator: u8,
    /// Whether the decimal mark is the comma.
    pub(super) comma: bool,
}

impl Dialect {
    /// The remark about it; `None` when it is as the contract wants it.
    pub(super) fn told(self) -> Option<Fault> {
        let mark = if self.comma { ',' } else { '.' };
        (self.separator != b',').then_some(Fault::Dialect { separator: char::from(self.separator), mark })
    }
}

/// A text file up to its first row.
#[derive(Clone, Debug)]
pub(super) struct Opening {
    pub(super) dialect: Dialect,
    pub(super) header: Header,
    /// Line of the header row, or of the row of units below it.
    pub(super) line: u64,
    /// Where the row after it starts, bytes.
    pub(super) rows: usize,
    /// Whether the row below the header holds units and is left out.
    pub(super) has_units: bool,
    /// Whether the header row is no UTF-8 and was read as Latin-1.
    pub(super) is_latin_1: bool,
}

impl Opening {
    /// What has to be said about it.
    pub(super) fn told(&self) -> Losses {
        let mut said = Losses::default();
        let header = Place::Line(self.line - u64::from(self.has_units));
        if let Some(fault) = self.dialect.told() {
            said.note(header, None, fault, Cost::AsSaid);
        }
        if self.is_latin_1 {
            said.note(header, None, Fault::Latin1, Cost::AsSaid);
        }
        if self.has_units {
            said.note(Place::Line(self.line), None, Fault::UnitsRow, Cost::AsSaid);
        }
        said
    }
}

/// Lines that decide on the decimal mark.
const LOOKED_AT: usize = 100;

/// Reads the header row; `file` is the file's name in messages.
///
/// # Errors
/// [`Unusable`] when the file is empty, no text, or starts with numbers.
pub(super) fn opening(file: &str, bytes: &[u8]) -> Result<Opening, Unusable> {
    if bytes.is_empty() {
        return Err(Unusable::Empty { file: file.to_owned() });
    }
    if let Some((kind, advice)) = foreign(bytes) {
        return Err(Unusable::OtherKind { file: file.to_owned(), kind, advice });
    }
    let mut at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let mut line = 0;
    let (header, rows) = loop {
        if at >= bytes.len() {
            return Err(Unusable::Empty { file: file.to_owned() });
        }
        line += 1;
        let end = memchr(b'\n', &bytes[at..]).map_or(bytes.len(), |n| at + n);
        let text = bytes[at..end].trim_ascii();
        let rows = (end + 1).min(bytes.len());
        if text.starts_with(b"# schema: guideblock.raw") {
            let advice = "`guideblock replay` sends it through the block's pipeline";
            let kind = "a raw recording of a block";
            return Err(Unusable::OtherKind { file: file.to_owned(), kind, advice });
        }
        if !text.is_empty() && !text.starts_with(b"#") {
            break (text, rows);
        }
        at = rows;
    };
    let separator = separator(header);
    let dialect = Dialect { separator, comma: separator != b',' && has_decimal_comma(&bytes[rows..]) };
    let names: Vec<_> = cells(header, separator).iter().map(|cell| decoded(cell.trim_ascii())).collect();
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(Unusable::NoHeader { file: file.to_owned(), line });
    }
    let is_latin_1 = std::str::from_utf8(header).is_err();
    let header = Header { file: file.to_owned(), names, line: Some(line) };
    Ok(match units_row(&bytes[rows..], dialect, header.names.len()) {
        Some(length) => Opening { dialect, header, line: line + 1, rows: rows + length, has_units: true, is_latin_1 },
        None => Opening { dialect, header, line, rows, has_units: false, is_latin_1 },
    })
}

/// Bytes of the first row where it holds no number in any cell, and the row below it does: units.
fn units_row(rows: &[u8], dialect: Dialect, columns: usize) -> Option<usize> {
    let length = memchr(b'\n', rows)? + 1;
    let counts = |line: &[u8]| {
        let cells = cells(line.trim_ascii(), dialect.separator);
        let filled = cells.iter().filter(|cell| !cell.trim_ascii().is_empty());
        let (numbers, texts): (Vec<_>, Vec<_>) = filled.partition(|cell| number(cell, dialect.comma).is_ok());
        (cells.len(), numbers.len(), texts.len())
    };
    let (units, below) = (&rows[..length], rows[length..].split(|byte| *byte == b'\n').next()?);
    let is_row_of_units = matches!(counts(units), (all, 0, 2..) if all == columns) && counts(below).1 > 0;
    (is_row_of_units && !units.starts_with(b"#")).then_some(length)
}

/// Files that are sometimes handed over in place of CSV, by how they start.
fn foreign(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let start = &bytes[..bytes.len().min(4096)];
    if start.starts_with(b"PK\x03\x04") {
        return Some(("a spreadsheet or zip archive", "save the sheet as CSV, or unpack the archive"));
    }
    if start.starts_with(b"\x1f\x8b") {
        return Some(("compressed with gzip", "unpack it first, as in `gunzip -c FILE | guideblock ... -`"));
    }
    if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
        return Some(("UTF-16 text", "save it as UTF-8"));
    }
    // the header row of a text holds no zero byte; further down zero bytes mean that the recorder lost power
    let header = memchr(b'\n', start).map_or(start, |end| &start[..end]);
    if memchr(0, header).is_some() {
        return Some((
            "no text (zero bytes where the header row should stand)",
            "save the recording as CSV or Parquet",
        ));
    }
    if memchr(b'\n', bytes).is_none() && memchr(b'\r', bytes).is_some() {
        return Some(("text with bare carriage returns as line ends", "save it with line feeds"));
    }
    None
}

fn separator(header: &[u8]) -> u8 {
    let count = |byte| memchr_iter(byte, header).count();
    let (commas, semicolons, tabs) = (count(b','), count(b';'), count(b'\t'));
    if semicolons > commas {
        b';'
    } else if tabs > commas {
        b'\t'
    } else {
        b','
    }
}

/// Whether the cells of rows with another separator contain commas.
fn has_decimal_comma(rows: &[u8]) -> bool {
    rows.split(|byte| *byte == b'\n')
        .take(LOOKED_AT)
        .any(|line| line.windows(3).any(|w| w[1] == b',' && w[0].is_ascii_digit() && w[2].is_ascii_digit()))
}
