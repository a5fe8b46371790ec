//! Raw recordings: every sample as converters and encoder delivered it, integers only.
//!
//! ```text
//! # schema: guideblock.raw/1
//! # sample_rate_hz: 1600
//! tick,sample,force_code,temperature_code,encoder_count
//! 0,0,2048,1850,0
//! ```
//!
//! One row a sample. `tick` counts blocks of 16 samples, `sample` runs from 0 to 15 within one; lost samples
//! show as a jump of `tick`. Further lines starting with `#` are comments; columns are found by name. Replaying
//! such a file gives the very frames the block sent, because nothing in it has been converted yet.

use std::io::{BufRead, Write};

use model_core::calibration::CODE_MAX;
use model_core::sample::{RawBlock, SAMPLE_HZ, SAMPLES_PER_BLOCK};

use super::{Cost, Fault, Losses, Place, Unusable};

/// The value of `# schema:`.
pub const SCHEMA: &str = "guideblock.raw/1";

/// The columns, in the order they are written.
pub const COLUMNS: [&str; 5] = ["tick", "sample", "force_code", "temperature_code", "encoder_count"];

/// Largest legal value of each column.
const MAX: [u32; 5] = [u32::MAX, SAMPLES_PER_BLOCK as u32 - 1, CODE_MAX as u32, CODE_MAX as u32, u16::MAX as u32];

/// A raw recording: whole blocks in the order of their ticks, and what was lost in reading.
#[derive(Clone, Debug, PartialEq)]
pub struct RawRecording {
    /// The blocks. Ticks increase.
    pub blocks: Vec<RawBlock>,
    /// What could not be used.
    pub losses: Losses,
}

/// Reads a raw recording; `file` is its name in messages.
///
/// # Errors
/// [`Unusable`] when the file cannot be read, is something else, or holds not one whole block.
pub fn read(file: &str, input: impl BufRead) -> Result<RawRecording, Unusable> {
    let mut header = Header::default();
    let mut blocks = Assembler::default();
    for (n, line) in input.lines().enumerate() {
        let line = line.map_err(|source| Unusable::Io { file: file.to_owned(), source })?;
        let (line_number, line) = (n as u64 + 1, line.trim());
        if let Some(comment) = line.strip_prefix('#') {
            header.comment(file, line_number, comment)?;
        } else if !line.is_empty() {
            match &header.columns {
                None => header.columns(file, line_number, line)?,
                Some(columns) => blocks.row(line_number, line, columns),
            }
        }
    }
    let (blocks, losses) = blocks.finish();
    if header.columns.is_none() {
        return Err(Unusable::MissingColumn {
            file: file.to_owned(),
            place: "line 1: ".to_owned(),
            column: COLUMNS[0].to_owned(),
            found: "the file is empty".to_owned(),
        });
    }
    if blocks.is_empty() {
        return Err(Unusable::too_few(file, 0, "blocks of 16 samples", 1, &losses));
    }
    Ok(RawRecording { blocks, losses })
}

/// Writes blocks as a raw recording.
#[derive(Debug)]
pub struct Writer<W>(W);

impl<W: Write> Writer<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new(mut out: W) -> std::io::Result<Self> {
        writeln!(out, "# schema: {SCHEMA}\n# sample_rate_hz: {SAMPLE_HZ}\n{}", COLUMNS.join(","))?;
        Ok(Writer(out))
    }

    /// Writes a block, one row a sample.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn block(&mut self, block: &RawBlock) -> std::io::Result<()> {
        let samples = block.force.iter().zip(&block.temperature).zip(&block.position);
        for (n, ((force, temperature), position)) in samples.enumerate() {
            writeln!(self.0, "{},{n},{force},{temperature},{position}", block.tick)?;
        }
        Ok(())
    }

    /// Flushes.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn finish(mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

/// What stands above the rows.
#[derive(Default)]
struct Header {
    schema: bool,
    rate: bool,
    /// where each of [`COLUMNS`] stands, and how many cells the header row has
    columns: Option<Columns>,
}

struct Columns {
    places: [usize; COLUMNS.len()],
    cells: usize,
}

impl Header {
    fn comment(&mut self, file: &str, line: u64, comment: &str) -> Result<(), Unusable> {
        let Some((key, value)) = comment.split_once(':') else { return Ok(()) };
        let expected = match key.trim() {
            "schema" => SCHEMA.to_owned(),
            "sample_rate_hz" => SAMPLE_HZ.to_string(),
            _ => return Ok(()),
        };
        if value.trim() != expected {
            return Err(Unusable::Schema {
                file: file.to_owned(),
                line,
                expected: format!("# {}: {expected}", key.trim()),
                found: format!("#{comment}"),
                hint: "this version of guideblock replays no other",
            });
        }
        match key.trim() {
            "schema" => self.schema = true,
            _ => self.rate = true,
        }
        Ok(())
    }

    fn columns(&mut self, file: &str, line: u64, row: &str) -> Result<(), Unusable> {
        for (seen, expected) in
            [(self.schema, format!("# schema: {SCHEMA}")), (self.rate, format!("# sample_rate_hz: {SAMPLE_HZ}"))]
        {
            if !seen {
                return Err(Unusable::Schema {
                    file: file.to_owned(),
                    line,
                    expected,
                    found: row.to_owned(),
                    hint: "a raw recording says above its header row what it is; if this file is one, add that line",
                });
            }
        }
        let names: Vec<_> = row.split(',').map(str::trim).collect();
        let mut places = [0; COLUMNS.len()];
        for (place, column) in places.iter_mut().zip(COLUMNS) {
            *place = names.iter().position(|name| *name == column).ok_or_else(|| Unusable::MissingColumn {
                file: file.to_owned(),
                place: format!("line {line}: "),
                column: column.to_owned(),
                found: format!("the header row has: {}", names.join(", ")),
            })?;
        }
        self.columns = Some(Columns { places, cells: names.len() });
        Ok(())
    }
}

/// Puts rows together to whole blocks.
#[derive(Default)]
struct Assembler {
    blocks: Vec<RawBlock>,
    losses: Losses,
    /// the block under way and how many samples it has
    building: Option<(RawBlock, usize)>,
    /// after a fault the rest of the block is lost without further words
    out_of_step: bool,
    line: u64,
}

impl Assembler {
    fn row(&mut self, line: u64, row: &str, columns: &Columns) {
        self.line = line;
        self.losses.rows += 1;
        let cells: Vec<_> = row.split(',').map(str::trim).collect();
        if cells.len() < columns.cells {
            return self.spoil(None, Fault::ShortLine { found: cells.len(), expected: columns.cells });
        }
        let mut numbers = [0; COLUMNS.len()];
        for (n, column) in COLUMNS.into_iter().enumerate() {
            let cell = cells[columns.places[n]];
            match cell.parse::<u32>() {
                Ok(number) if number <= MAX[n] => numbers[n] = number,
                _ => return self.spoil(Some(column), Fault::NotACount { cell: cell.to_owned(), max: MAX[n] }),
            }
        }
        self.sample(numbers);
    }

    fn sample(&mut self, numbers: [u32; COLUMNS.len()]) {
        let [tick, sample, ..] = numbers;
        // checked against MAX above, so nothing is cut off
        let [_, _, force, temperature, position] = numbers.map(|n| n as u16);
        if let Some((block, filled)) = self.building
            && (block.tick != tick || filled != sample as usize)
        {
            self.abandon(block.tick, filled);
        }
        if self.building.is_none() && sample != 0 {
            self.losses.count("incomplete-block", 1);
            if !self.out_of_step {
                self.out_of_step = true;
                let fault = Fault::IncompleteBlock { tick, found: 0 };
                self.losses.note(Place::Line(self.line), Some("sample"), fault, Cost::AsSaid);
            }
            return;
        }
        if self.building.is_none() {
            if let Some(last) = self.blocks.last()
                && tick <= last.tick
            {
                return self.spoil(Some("tick"), Fault::TickBackward { tick, last: last.tick });
            }
            self.out_of_step = false;
        }
        let empty = [0; SAMPLES_PER_BLOCK];
        let (block, filled) =
            self.building.get_or_insert((RawBlock { tick, force: empty, temperature: empty, position: empty }, 0));
        block.force[*filled] = force;
        block.temperature[*filled] = temperature;
        block.position[*filled] = position;
        *filled += 1;
        if *filled == SAMPLES_PER_BLOCK {
            self.blocks.push(*block);
            self.building = None;
        }
    }

    /// The row at hand cannot be used, and with it the block it belongs to.
    fn spoil(&mut self, column: Option<&'static str>, fault: Fault) {
        self.losses.count(fault.id(), 1 + self.building.take().map_or(0, |(_, filled)| filled as u64));
        let cost = if matches!(fault, Fault::TickBackward { .. }) { Cost::AsSaid } else { Cost::Row };
        self.losses.note(Place::Line(self.line), column, fault, cost);
        self.out_of_step = true;
    }

    fn abandon(&mut self, tick: u32, found: usize) {
        let fault = Fault::IncompleteBlock { tick, found };
        self.losses.count(fault.id(), found as u64);
        self.losses.note(Place::Line(self.line), None, fault, Cost::AsSaid);
        self.building = None;
        self.out_of_step = true;
    }

    fn finish(mut self) -> (Vec<RawBlock>, Losses) {
        if let Some((block, filled)) = self.building {
            self.abandon(block.tick, filled);
        }
        (self.blocks, self.losses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(tick: u32) -> RawBlock {
        RawBlock {
            tick,
            force: std::array::from_fn(|n| 2000 + n as u16),
            temperature: [1850; 16],
            position: std::array::from_fn(|n| 65_530u16.wrapping_add(n as u16)),
        }
    }

    fn written(ticks: &[u32]) -> String {
        let mut text = Vec::new();
        let mut writer = Writer::new(&mut text).expect("memory");
        for tick in ticks {
            writer.block(&block(*tick)).expect("memory");
        }
        writer.finish().expect("memory");
        String::from_utf8(text).expect("ASCII")
    }

    fn ticks(text: &str) -> (Vec<u32>, Losses) {
        let recording = read("a.csv", text.as_bytes()).expect("usable");
        assert!(recording.blocks.iter().all(|b| *b == block(b.tick)));
        (recording.blocks.iter().map(|b| b.tick).collect(), recording.losses)
    }

    #[test]
    fn what_is_written_is_read_again() {
        let (got, losses) = ticks(&written(&[0, 1, 2, 7]));
        assert_eq!(got, [0, 1, 2, 7]);
        assert_eq!(losses, Losses { rows: 64, ..Losses::default() });
    }

    #[test]
    fn a_spoilt_row_costs_its_block_and_is_named() {
        let text = written(&[0, 1, 2, 3]);
        let lines: Vec<_> = text.lines().collect();
        // row 5 of block 1 stands in line 4 + 16 + 5
        let spoilt = |replacement: &str| {
            let mut lines = lines.clone();
            lines[24] = replacement;
            ticks(&lines.join("\n"))
        };
        for (replacement, message) in [
            (
                "1,5,4096,1850,65535",
                "line 25: column force_code: \"4096\" is not a whole number from 0 to 4095; the row is left out",
            ),
            (
                "1,5,-1,1850,65535",
                "line 25: column force_code: \"-1\" is not a whole number from 0 to 4095; the row is left out",
            ),
            (
                "1,5,2005,1850,65536",
                "line 25: column encoder_count: \"65536\" is not a whole number from 0 to 65535; the row is left out",
            ),
            ("1,5,2005", "line 25: 3 cells instead of 5; the row is left out"),
            (
                "1,6,2005,1850,65535",
                "line 25: block 1 has 5 of 16 samples in order; the block is left out and replay sees a gap",
            ),
        ] {
            let (got, losses) = spoilt(replacement);
            assert_eq!(got, [0, 2, 3], "{replacement}");
            let messages: Vec<_> = losses.problems.iter().map(ToString::to_string).collect();
            assert_eq!(messages, [message]);
            assert_eq!((losses.rows, losses.lost), (64, 16));
        }
    }

    #[test]
    fn a_recorder_that_was_cut_off_loses_its_last_block() {
        let text = written(&[0, 1]);
        let (got, losses) = ticks(&text[..text.len() - 30]);
        assert_eq!(got, [0]);
        assert_eq!(losses.problems.len(), 1);
        assert!(losses.lost >= 14, "{losses:?}");
    }

    #[test]
    fn ticks_that_go_back_are_left_out() {
        let (got, losses) = ticks(&written(&[5, 6, 3, 9]));
        assert_eq!(got, [5, 6, 9]);
        assert_eq!(losses.problems.len(), 1);
        assert_eq!(losses.lost, 16);
    }

    #[test]
    fn something_else_is_refused_with_advice() {
        let message = |text: &str| read("a.csv", text.as_bytes()).expect_err("unusable").to_string();
        assert_eq!(
            message("tick,sample\n"),
            "a.csv: line 1: expected `# schema: guideblock.raw/1`, found \"tick,sample\"; a raw recording says above \
             its header row what it is; if this file is one, add that line"
        );
        assert!(
            message(&written(&[0]).replace("1600", "2000"))
                .starts_with("a.csv: line 2: expected `# sample_rate_hz: 1600`")
        );
        assert_eq!(
            message(&written(&[0]).replace("force_code", "force")),
            "a.csv: line 3: no column force_code; the header row has: tick, sample, force, temperature_code, encoder_count"
        );
        assert!(message("").starts_with("a.csv: line 1: no column tick"));
        assert_eq!(message(&written(&[])), "a.csv: 0 usable blocks of 16 samples of 0 rows, at least 1 are needed");
    }
}
