//! Recordings: runs of an axis as CSV or Parquet ([`open`], [`axis`]), any other table of numbers ([`table`]), and raw
//! samples of a block ([`raw`]).
//!
//! ```text
//! file or pipe -> text (CSV) or parquet -> columns asked for -> axis: checks, parts -> simulation::run::Run
//!                                                            -> table
//!                                 -> all columns: whole -> write: CSV, Parquet
//! ```
//!
//! All readers follow one rule: what cannot be used is reported with line and column, left out and counted;
//! the rest is used. Only a file of which nothing can be used is an error ([`Unusable`]).

pub mod axis;
mod cell;
mod columns;
mod dialect;
mod losses;
mod mapping;
mod parquet;
mod parts;
pub mod raw;
mod segments;
mod source;
pub mod table;
mod text;
mod units;
mod unusable;
pub mod whole;
mod write;

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, stdin};
use std::path::Path;

use simulation::run::Run;

use columns::{Header, Numbers, Wanted};
pub use losses::{Cost, Fault, Losses, Place, Problem};
pub use mapping::{Mapping, MappingError, Selection};
pub use unusable::Unusable;
pub use write::{Cells, Column, Kind, write, write_csv};

/// Called now and then while a file is read, from any thread, with the bytes that are done and all bytes.
pub type Progress<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// A [`Progress`] that does nothing.
pub fn silent(_done: u64, _of: u64) {}

/// Size below which a second thread costs more than it saves, bytes.
const PIECE: usize = 1 << 20;

/// Reads a run of an axis. The path `-` is standard input.
///
/// `mappings` name columns that are called otherwise or are in another unit; where there are `selections`, only rows
/// that all of them take are read.
///
/// # Errors
/// [`Unusable`] when the file cannot be read, lacks a column, leaves fewer than [`axis::MIN_ROWS`] rows, has a force
/// that never changes, or units that cannot be meant.
pub fn open(
    path: &Path,
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Run, Losses), Unusable> {
    let (file, bytes) = load(path)?;
    axis::from_bytes(&file, bytes, mappings, selections, progress)
}

/// Two runs, one of each list, where the rows of one are those of the other or a stretch of them, whatever the files
/// are called and of whatever kind they are.
pub fn twins<'a>(seen: &'a [Run], kept: &'a [Run]) -> Option<(&'a Run, &'a Run)> {
    let mut pairs = seen.iter().flat_map(|run| kept.iter().map(move |other| (run, other)));
    pairs.find(|(run, other)| are_twins(run, other))
}

/// The same within one list.
pub fn twins_within(runs: &[Run]) -> Option<(&Run, &Run)> {
    let mut pairs = runs.iter().enumerate().flat_map(|(n, run)| runs[..n].iter().map(move |before| (before, run)));
    pairs.find(|(before, run)| are_twins(before, run))
}

fn are_twins(run: &Run, other: &Run) -> bool {
    let (short, long) = if run.len() < other.len() { (run, other) } else { (other, run) };
    let rows = short.len();
    // the clock first: it rises, so that nearly every place is decided by one row
    (0..=long.len() - rows).any(|n| {
        long.time_s[n..n + rows] == short.time_s[..] && long.drag_force_n[n..n + rows] == short.drag_force_n[..]
    })
}

/// The name of an input in messages and all of its bytes.
fn load(path: &Path) -> Result<(String, Vec<u8>), Unusable> {
    let (file, read) = if path == Path::new("-") {
        let mut bytes = Vec::new();
        ("standard input".to_owned(), stdin().lock().read_to_end(&mut bytes).map(|_| bytes))
    } else {
        (path.display().to_string(), whole(path))
    };
    match read {
        Ok(bytes) => Ok((file, bytes)),
        Err(source) => Err(Unusable::Io { file, source }),
    }
}

/// The bytes of a file, read by several threads.
fn whole(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let (meta, threads) = (file.metadata()?, std::thread::available_parallelism().map_or(1, usize::from));
    let length = usize::try_from(meta.len()).unwrap_or(0);
    if meta.is_file() && length > threads * PIECE {
        let mut bytes = vec![0; length];
        let share = length.div_ceil(threads);
        let read = std::thread::scope(|scope| {
            let read = |(n, piece): (usize, &mut [u8])| -> std::io::Result<()> {
                let mut file = File::open(path)?;
                file.seek(SeekFrom::Start((n * share) as u64))?;
                file.read_exact(piece)
            };
            let running: Vec<_> =
                bytes.chunks_mut(share).enumerate().map(|piece| scope.spawn(move || read(piece))).collect();
            // if the file shrinks meanwhile, or a thread cannot read, the whole file is read again
            running.into_iter().all(|thread| matches!(thread.join(), Ok(Ok(()))))
        });
        if read {
            return Ok(bytes);
        }
    }
    let mut bytes = Vec::with_capacity(length);
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The columns that `choose` asks for, from a file of either kind.
fn numbers(
    file: &str,
    bytes: Vec<u8>,
    choose: impl FnOnce(&Header) -> Result<Vec<Wanted>, Unusable>,
    selections: &[Selection],
    progress: Progress,
) -> Result<(Vec<Wanted>, Numbers), Unusable> {
    if bytes.starts_with(parquet::MAGIC) {
        let table = parquet::Table::new(file, bytes)?;
        let wanted = choose(table.header())?;
        let numbers = table.numbers(&wanted, selections, progress)?;
        return Ok((wanted, numbers));
    }
    let read = text::read(file, &bytes, choose, selections, progress);
    // freeing the bytes takes a tenth of the reading time; nobody has to wait for it
    std::thread::spawn(move || drop(bytes));
    read
}
