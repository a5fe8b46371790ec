//! Output: text for terminals, CSV and JSON for programs, a picture and a page for people.

pub mod chart;
pub mod csv;
pub mod html;
pub mod json;
pub mod number;
pub mod page;
pub mod scale;
pub mod shares;
pub mod svg;
pub mod table;

use std::io::{self, Write};

use crate::decode::Decoded;

/// How decoded messages are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Aligned columns, one line a reading; faults and heartbeats when they change.
    Table,
    /// One row a message, one header.
    Csv,
    /// One JSON object a line and message.
    Json,
}

/// Writes decoded messages one by one.
#[derive(Debug)]
pub struct Emitter<W: Write>(Style<W>);

#[derive(Debug)]
enum Style<W: Write> {
    Table(W, table::Table),
    Csv(W, Vec<u8>),
    Json(W),
}

impl<W: Write> Emitter<W> {
    /// Starts; a table gets its header at once, so that it is seen before the first message comes.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(mut out: W, format: Format) -> io::Result<Self> {
        Ok(Emitter(match format {
            Format::Table => {
                writeln!(out, "{}", table::HEADER)?;
                Style::Table(out, table::Table::default())
            }
            Format::Csv => {
                writeln!(out, "{}", csv::header())?;
                Style::Csv(out, Vec::new())
            }
            Format::Json => Style::Json(out),
        }))
    }

    /// Writes a message.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn message(&mut self, decoded: &Decoded) -> io::Result<()> {
        match &mut self.0 {
            Style::Table(out, table) => match table.message(decoded) {
                Some(line) => writeln!(out, "{line}"),
                None => Ok(()),
            },
            Style::Csv(out, row) => {
                row.clear();
                csv::row(row, decoded);
                out.write_all(row)
            }
            Style::Json(out) => writeln!(out, "{}", json::object(decoded)),
        }
    }

    /// Flushes, so that a reader at the other end of a pipe sees everything so far.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Style::Table(out, _) | Style::Json(out) | Style::Csv(out, _) => out.flush(),
        }
    }

    /// Writes what was still waiting for its second half.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        if let Style::Table(mut out, table) = self.0 {
            for line in table.finish() {
                writeln!(out, "{line}")?;
            }
            out.flush()?;
        }
        Ok(())
    }
}
