//! Writer of named columns as a CSV or Parquet file.

use std::io::{self, BufWriter, Write, stdout};
use std::path::Path;

use super::parquet;
use crate::files;

/// A column to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column<'a> {
    /// Its name, with the unit.
    pub name: &'a str,
    /// Its cells. All columns of a file have as many.
    pub cells: Cells<'a>,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cells<'a> {
    /// Numbers; NaN is not measured: an empty cell, or null.
    Numbers(&'a [f64]),
    /// Texts.
    Texts(&'a [String]),
}

impl Cells<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Cells::Numbers(numbers) => numbers.len(),
            Cells::Texts(texts) => texts.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a> Column<'a> {
    /// A column of numbers.
    pub fn numbers(name: &'a str, numbers: &'a [f64]) -> Self {
        Column { name, cells: Cells::Numbers(numbers) }
    }
}

/// Kinds of files that recordings are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Comma-separated text.
    Csv,
    /// Apache Parquet.
    Parquet,
}

impl Kind {
    /// The kind that a path asks for: `.parquet`, `.csv`, and CSV for `-`. `None` for any other ending.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(std::ffi::OsStr::to_str) {
            Some("parquet") => Some(Kind::Parquet),
            Some("csv") => Some(Kind::Csv),
            None if path == Path::new("-") => Some(Kind::Csv),
            _ => None,
        }
    }
}

/// Writes columns; the kind of the file follows from its ending ([`Kind::of`]), `-` is standard output.
///
/// The same columns give the same bytes. Numbers read again are the same to the last bit.
///
/// # Errors
/// Those of the system; [`InvalidInput`](io::ErrorKind::InvalidInput) when columns differ in length or the ending is
/// of no kind.
pub fn write(path: &Path, columns: &[Column]) -> io::Result<()> {
    let invalid = |why| Err(io::Error::new(io::ErrorKind::InvalidInput, why));
    let Some(kind) = Kind::of(path) else { return invalid("name it .csv or .parquet") };
    if columns.windows(2).any(|pair| pair[0].cells.len() != pair[1].cells.len()) {
        return invalid("the columns differ in length");
    }
    if path == Path::new("-") {
        return write_csv(stdout().lock(), columns);
    }
    files::put(path, |file| match kind {
        Kind::Csv => write_csv(file, columns),
        Kind::Parquet => {
            let mut out = BufWriter::new(file);
            parquet::write(&mut out, columns).map_err(io::Error::other)?;
            out.flush()
        }
    })
}

/// Rows that one thread formats at a time.
const BLOCK: usize = 1 << 12;

/// Writes columns as CSV.
///
/// # Errors
/// Those of the writer.
pub fn write_csv(mut out: impl Write, columns: &[Column]) -> io::Result<()> {
    let mut header = csv::Writer::from_writer(Vec::new());
    header.write_record(columns.iter().map(|column| column.name))?;
    out.write_all(&header.into_inner().map_err(|error| io::Error::other(error.to_string()))?)?;
    let rows = columns.first().map_or(0, |column| column.cells.len());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut from = 0;
    while from < rows {
        let blocks: Vec<_> = (0..threads)
            .map(|n| (from + n * BLOCK).min(rows)..(from + (n + 1) * BLOCK).min(rows))
            .filter(|block| !block.is_empty())
            .collect();
        from += threads * BLOCK;
        let texts: Vec<_> = std::thread::scope(|scope| {
            let running: Vec<_> = blocks.into_iter().map(|rows| scope.spawn(|| block(columns, rows))).collect();
            running.into_iter().map(|thread| thread.join().unwrap_or_else(|p| std::panic::resume_unwind(p))).collect()
        });
        for text in texts {
            out.write_all(&text?)?;
        }
    }
    out.flush()
}

/// Some rows as text.
fn block(columns: &[Column], rows: std::ops::Range<usize>) -> io::Result<Vec<u8>> {
    let mut text = Vec::with_capacity(rows.len() * columns.len() * 10);
    for row in rows {
        for (n, column) in columns.iter().enumerate() {
            if n > 0 {
                text.push(b',');
            }
            match column.cells {
                Cells::Numbers(numbers) => number(&mut text, numbers[row])?,
                Cells::Texts(texts) => quoted(&mut text, &texts[row]),
            }
        }
        text.push(b'\n');
    }
    Ok(text)
}

/// The shortest decimal that reads as the same number; nothing for NaN.
fn number(text: &mut Vec<u8>, number: f64) -> io::Result<()> {
    match number.abs() {
        size if size.is_nan() => Ok(()),
        size if size == 0.0 || (1e-5..1e16).contains(&size) => write!(text, "{number}"),
        _ => write!(text, "{number:e}"),
    }
}

fn quoted(text: &mut Vec<u8>, cell: &str) {
    // a row that starts with a comment sign would be skipped by readers
    if !cell.contains([',', '"', '\n', '\r']) && !cell.starts_with(['#', ' ']) && !cell.ends_with(' ') {
        return text.extend_from_slice(cell.as_bytes());
    }
    text.push(b'"');
    // one row a line: that is what readers of recordings rely on
    text.extend_from_slice(cell.replace('"', "\"\"").replace(['\n', '\r'], " ").as_bytes());
    text.push(b'"');
}
