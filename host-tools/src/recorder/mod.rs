//! Recorder of bursts into files that survive whatever ends the recording.
//!
//! ```text
//! time_s,position_m,drag_force_n,temperature_block_degc,segment      a recording that diagnose takes
//! # schema: guideblock.raw/1 ...                                      raw, that replay takes
//! ```
//!
//! Rows are only ever appended, a whole block of samples with one call, and reach the disk at least once a second.
//! A recording that was cut is continued after its last row: a row that was cut off ends there, is reported and left
//! out when the file is read, and costs nothing else.
//!
//! `time_s` is the block's own clock, its ticks; each burst, and each gap within one, begins a new `segment`. Positions
//! have the encoder's zero at the block's start, modulo 65536 counts: within a segment they are unbroken, from one to
//! the next they may be off by a multiple of that.

mod rows;

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::time::{Duration, Instant};

use can_wire::burst::Record;
use model_core::calibration::Calibration;

pub use rows::Kind;
use rows::Rows;

/// What has been written reaches the disk within this time.
const SYNC_EVERY: Duration = Duration::from_secs(1);

/// A file that grows.
#[derive(Debug)]
pub struct Recorder {
    file: File,
    rows: Rows,
    text: Vec<u8>,
    synced: Instant,
}

/// Why a file is not continued.
#[derive(Debug, thiserror::Error)]
pub enum RecorderError {
    /// It cannot be opened, read or written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is something else.
    #[error("line 1: expected {expected:?}, found {found:?}; name another file, or remove this one")]
    Other {
        /// The first line of such a recording.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
}

impl Recorder {
    /// Opens a file, or continues one.
    ///
    /// # Errors
    /// [`RecorderError`].
    pub fn open(path: &Path, kind: Kind, calibration: Calibration) -> Result<Self, RecorderError> {
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        let mut before = String::new();
        // only a file of another program can be cut within a character
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(0))?;
        file.read_to_end(&mut bytes)?;
        before.push_str(&String::from_utf8_lossy(&bytes));
        let mut rows = Rows::new(kind, calibration);
        match before.lines().next() {
            None => file.write_all(kind.header().as_bytes())?,
            Some(_) if kind.header().starts_with(&before) => {
                // cut within its header
                file.write_all(&kind.header().as_bytes()[before.len()..])?;
            }
            Some(_) if before.starts_with(kind.header()) => {
                if !before.ends_with('\n') {
                    file.write_all(b"\n")?;
                }
                rows.carry_on(&before);
            }
            Some(found) => {
                let found: String = found.chars().take(60).collect();
                return Err(RecorderError::Other { expected: kind.first_line(), found });
            }
        }
        file.sync_data()?;
        Ok(Recorder { file, rows, text: Vec::new(), synced: Instant::now() })
    }

    /// Appends a record.
    ///
    /// # Errors
    /// Those of the file.
    pub fn append(&mut self, record: &Record) -> io::Result<()> {
        self.text.clear();
        self.rows.of(record, &mut self.text);
        if !self.text.is_empty() {
            self.file.write_all(&self.text)?;
        }
        if self.synced.elapsed() >= SYNC_EVERY {
            self.sync()?;
        }
        Ok(())
    }

    /// Rows written since it was opened.
    pub fn rows(&self) -> u64 {
        self.rows.written()
    }

    /// Has everything on disk.
    ///
    /// # Errors
    /// Those of the file.
    pub fn sync(&mut self) -> io::Result<()> {
        self.synced = Instant::now();
        self.file.sync_data()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording;
    use can_wire::burst::{Cause, Header, Trailer};
    use model_core::sample::{RawBlock, SAMPLES_PER_BLOCK};
    use std::fs;

    fn block(tick: u32) -> Record {
        let count = |n: usize| 65_000_u32.wrapping_add(tick * 16 + n as u32).wrapping_mul(10);
        Record::Block(RawBlock {
            tick,
            force: std::array::from_fn(|n| 2458 + (n % 3) as u16),
            temperature: [2048; SAMPLES_PER_BLOCK],
            position: std::array::from_fn(|n| count(n) as u16),
        })
    }

    fn burst(ticks: impl Iterator<Item = u32>) -> Vec<Record> {
        let header = Header { number: 1, cause: Cause::Command, blocks: 0, past: 0, image: 0 };
        let trailer = Trailer { blocks: 0, dropped: 0, crc: 0 };
        let blocks = ticks.map(block);
        std::iter::once(Record::Header(header)).chain(blocks).chain([Record::Trailer(trailer)]).collect()
    }

    fn write(path: &Path, kind: Kind, records: &[Record]) {
        let mut recorder = Recorder::open(path, kind, Calibration::BENCH).expect("opens");
        records.iter().for_each(|record| recorder.append(record).expect("writes"));
        recorder.sync().expect("syncs");
    }

    fn file(name: &str) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("guideblock-recorder-{}-{name}", std::process::id()));
        let _ = fs::remove_file(&path);
        path
    }

    #[test]
    fn a_burst_is_a_recording() {
        let path = file("run.csv");
        write(&path, Kind::Run, &burst((100..130).chain(140..160)));
        write(&path, Kind::Run, &burst(300..320));
        let (run, losses) = recording::open(&path, &[], &[], &recording::silent).expect("a recording");
        assert_eq!((losses.rows, losses.lost, losses.problems.len()), (70 * 16, 0, 0), "{losses:?}");
        assert_eq!(run.parts.len(), 3);
        let text = fs::read_to_string(&path).expect("text");
        let second = text.lines().nth(2).expect("rows");
        // tick 100, sample 1: 16 s of 1600 Hz; force 2459 is 20.07 N
        assert!(second.starts_with("1.000625,"), "{second}");
        assert!(second.contains(",20.068359"), "{second}");
        let _ = fs::remove_file(path);
    }

    #[test]
    fn a_raw_recording_replays() {
        let path = file("raw.csv");
        write(&path, Kind::Raw, &burst(5..25));
        write(&path, Kind::Raw, &burst(30..35));
        let text = fs::read(&path).expect("text");
        let raw = recording::raw::read("raw.csv", &text[..]).expect("a raw recording");
        assert_eq!(raw.blocks.len(), 25);
        for got in &raw.blocks {
            assert_eq!(Record::Block(*got), block(got.tick));
        }
        let _ = fs::remove_file(path);
    }

    #[test]
    fn a_file_that_was_cut_anywhere_is_readable_and_carried_on() {
        let (whole, cut) = (file("whole.csv"), file("cut.csv"));
        write(&whole, Kind::Run, &burst(100..140));
        let bytes = fs::read(&whole).expect("written");
        let row = bytes.len() / 640;
        for length in (0..120).chain((bytes.len() - 3 * row)..=bytes.len()) {
            fs::write(&cut, &bytes[..length]).expect("writable");
            if length > 100 * row {
                let (_, losses) = recording::open(&cut, &[], &[], &recording::silent).expect("readable");
                assert!(losses.problems.len() <= 1, "{length}: {losses:?}");
            }
            write(&cut, Kind::Run, &burst(200..240));
            let (run, losses) = recording::open(&cut, &[], &[], &recording::silent).expect("readable");
            assert!(losses.problems.len() <= 1 && losses.lost <= 1, "{length}: {losses:?}");
            assert!(losses.rows >= 640 && !run.parts.is_empty());
        }
        fs::write(&cut, "time,force\n1,2\n").expect("writable");
        let error = Recorder::open(&cut, Kind::Run, Calibration::BENCH).expect_err("something else").to_string();
        assert!(error.starts_with("line 1: expected \"time_s,position_m"), "{error}");
        let _ = (fs::remove_file(whole), fs::remove_file(cut));
    }

    #[test]
    fn a_block_that_started_anew_does_not_turn_time_back() {
        let path = file("anew.csv");
        write(&path, Kind::Run, &burst(1000..1020));
        write(&path, Kind::Run, &burst(10..30));
        let (run, losses) = recording::open(&path, &[], &[], &recording::silent).expect("a recording");
        assert_eq!((losses.problems.len(), run.parts.len()), (0, 2), "{losses:?}");
        let _ = fs::remove_file(path);
    }
}
