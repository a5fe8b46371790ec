//! Columns of numbers from a Parquet file, by row groups and columns on several threads, and the writer of such files.
//!
//! A null is "not measured". Numbers of any physical type are read as `f64`; nested columns and decimals are not.
//! A fault of a value is reported with the number of its row, counted from 1.

mod writer;

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use bytes::Bytes;
use parquet::basic::{LogicalType, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use super::cell::{immeasurable, is_measurable};
use super::columns::{Header, Need, Numbers, Places, Wanted};
use super::{Cost, Fault, Losses, Progress, Selection, Unusable};

pub(super) use writer::write;

/// What every Parquet file starts with.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// Rows that are decoded at once: they stay in the cache.
const BATCH: usize = 1 << 14;

/// NaN that stands for a null until nulls have been told from values that are NaN.
const NULL: u64 = 0x7ff8_0000_6e75_6c6c;

fn is_null(value: f64) -> bool {
    value.to_bits() == NULL
}

/// A Parquet file in memory.
pub(super) struct Table {
    header: Header,
    /// bytes of the file
    length: u64,
    reader: SerializedFileReader<Bytes>,
}

impl Table {
    /// Reads the description at the end of the file.
    pub(super) fn new(file: &str, bytes: Vec<u8>) -> Result<Self, Unusable> {
        let length = bytes.len() as u64;
        let reader = guarded(|| SerializedFileReader::new(Bytes::from(bytes))).map_err(|why| broken(file, &why))?;
        check_places(&reader, length).map_err(|why| broken(file, &why))?;
        let schema = reader.metadata().file_metadata().schema_descr();
        let names = schema.columns().iter().map(|column| column.path().string()).collect();
        Ok(Table { header: Header { file: file.to_owned(), names, line: None }, length, reader })
    }

    /// The names of the columns.
    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    /// Whether a column holds whole numbers that may be longer than `f64` allows.
    pub(super) fn is_whole(&self, place: usize) -> bool {
        self.column(place).physical_type() == Physical::INT64
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        self.reader.metadata().row_groups().iter().map(|group| group.num_rows().max(0) as usize).sum()
    }

    fn column(&self, place: usize) -> &ColumnDescriptor {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        &schema.columns()[place]
    }

    /// What a column holds, if not plain numbers.
    pub(super) fn not_numbers(&self, place: usize) -> Option<String> {
        let column = self.column(place);
        match column.physical_type() {
            _ if column.max_rep_level() > 0 => Some("lists".to_owned()),
            _ if matches!(column.logical_type_ref(), Some(LogicalType::Decimal { .. })) => Some("decimals".to_owned()),
            Physical::BYTE_ARRAY => Some("text".to_owned()),
            Physical::FIXED_LEN_BYTE_ARRAY | Physical::INT96 => Some(format!("{:?}", column.physical_type())),
            _ => None,
        }
    }

    fn refuse(&self, place: usize, name: &str) -> Result<(), Unusable> {
        match self.not_numbers(place) {
            None => Ok(()),
            Some(found) => Err(Unusable::NotNumbers { file: self.header.file.clone(), column: name.to_owned(), found }),
        }
    }

    /// The columns of numbers that `wanted` asks for.
    ///
    /// # Errors
    /// [`Unusable`] when a column holds something else, the file is damaged, or no row is a selected one.
    pub(super) fn numbers(
        &self,
        wanted: &[Wanted],
        selections: &[Selection],
        progress: Progress,
    ) -> Result<Numbers, Unusable> {
        let selected = self.header.selected(selections)?;
        for wanted in wanted {
            self.refuse(wanted.place, &wanted.told)?;
        }
        let mut columns = self.decoded(wanted, progress)?;
        let mut is_taken = vec![true; if selections.is_empty() { 0 } else { self.rows() }];
        for (selection, place) in selections.iter().zip(selected) {
            let cells = self.texts(place)?;
            is_taken.iter_mut().zip(&cells).for_each(|(taken, cell)| *taken &= selection.takes(cell.as_bytes()));
            if !is_taken.contains(&true) {
                return Err(self.nothing_selected(selections, selection, &cells));
            }
        }
        let mut losses = Losses { rows: self.rows() as u64, ..Losses::default() };
        let mut places = Places::rows(self.rows());
        if !is_taken.is_empty() {
            losses.rows = is_taken.iter().filter(|taken| **taken).count() as u64;
            keep(&mut columns, &mut places, &is_taken);
        }
        let is_kept = judge(wanted, &mut columns, &places, &mut losses);
        if !is_kept.is_empty() {
            keep(&mut columns, &mut places, &is_kept);
        }
        let spoilt = vec![0; columns.len()];
        Ok(Numbers { columns, places, losses, spoilt })
    }

    fn nothing_selected(&self, all: &[Selection], last: &Selection, cells: &[String]) -> Unusable {
        let mut seen: Vec<&str> = Vec::new();
        for cell in cells {
            if seen.len() < 8 && !seen.contains(&&**cell) {
                seen.push(cell);
            }
        }
        Unusable::NoSuchRow {
            file: self.header.file.clone(),
            wanted: all.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and "),
            found: format!("column {} has: {}", last.column, seen.join(", ")),
        }
    }

    /// Every value of the columns, nulls marked.
    fn decoded(&self, wanted: &[Wanted], progress: Progress) -> Result<Vec<Vec<f64>>, Unusable> {
        let mut columns: Vec<Vec<f64>> = wanted.iter().map(|_| vec![0.0; self.rows()]).collect();
        let mut tasks = Vec::new();
        for (column, wanted) in columns.iter_mut().zip(wanted) {
            let mut rest = &mut column[..];
            for group in 0..self.reader.num_row_groups() {
                let rows = self.reader.metadata().row_group(group).num_rows().max(0) as usize;
                let (slice, others) = rest.split_at_mut(rows.min(rest.len()));
                rest = others;
                tasks.push((group, wanted, slice));
            }
        }
        let (of, done) = (tasks.len() as u64, AtomicU64::new(0));
        let tasks = Mutex::new(tasks);
        let work = || -> Result<(), ParquetError> {
            loop {
                // a thread that panicked leaves the list as it was
                let task = tasks.lock().unwrap_or_else(PoisonError::into_inner).pop();
                let Some((group, wanted, slice)) = task else { return Ok(()) };
                guarded(|| decode(self.reader.get_row_group(group)?.get_column_reader(wanted.place)?, slice, wanted))?;
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress(self.length / of * done, self.length);
            }
        };
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(of.max(1) as usize);
        let outcome = std::thread::scope(|scope| {
            let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
            let own = work();
            let all = others.into_iter().map(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic)));
            all.fold(own, Result::and)
        });
        outcome.map_err(|why| broken(&self.header.file, &why))?;
        Ok(columns)
    }

    /// Every value of a column as text; nothing where it is null.
    ///
    /// # Errors
    /// [`Unusable`] when the column is nested or the file is damaged.
    pub(super) fn texts(&self, place: usize) -> Result<Vec<String>, Unusable> {
        let mut texts = Vec::with_capacity(self.rows());
        if self.column(place).max_rep_level() > 0 {
            self.refuse(place, &self.header.names[place])?;
        }
        for group in 0..self.reader.num_row_groups() {
            let read = guarded(|| {
                let reader = self.reader.get_row_group(group)?.get_column_reader(place)?;
                let mut put = |text: Option<String>| texts.push(text.unwrap_or_default());
                match reader {
                    ColumnReader::BoolColumnReader(reader) => {
                        each(reader, |v| put(v.map(|v| u8::from(*v).to_string())))
                    }
                    ColumnReader::Int32ColumnReader(reader) => each(reader, |v| put(v.map(ToString::to_string))),
                    ColumnReader::Int64ColumnReader(reader) => each(reader, |v| put(v.map(ToString::to_string))),
                    ColumnReader::FloatColumnReader(reader) => each(reader, |v| put(v.map(ToString::to_string))),
                    ColumnReader::DoubleColumnReader(reader) => each(reader, |v| put(v.map(ToString::to_string))),
                    ColumnReader::Int96ColumnReader(reader) => each(reader, |v| put(v.map(|v| format!("{v:?}")))),
                    ColumnReader::ByteArrayColumnReader(reader) => {
                        each(reader, |v| put(v.map(|v| String::from_utf8_lossy(v.data()).into_owned())))
                    }
                    ColumnReader::FixedLenByteArrayColumnReader(reader) => {
                        each(reader, |v| put(v.map(|v| String::from_utf8_lossy(v.data()).into_owned())))
                    }
                }
            });
            read.map_err(|why| broken(&self.header.file, &why))?;
        }
        Ok(texts)
    }
}

/// Calls the library and turns its panics, which some damaged files cause, into errors.
fn guarded<T>(call: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|_| Err(ParquetError::General("the data cannot be decoded".to_owned())))
}

/// Checks that every column lies within the file and has as many values as its row group has rows. The library and the
/// allocation of memory rely on it.
fn check_places(reader: &SerializedFileReader<Bytes>, length: u64) -> Result<(), ParquetError> {
    let wrong = |what: &str| Err(ParquetError::General(format!("the description of its columns is damaged: {what}")));
    let mut all_rows = 0usize;
    for group in reader.metadata().row_groups() {
        let Ok(rows) = usize::try_from(group.num_rows()) else { return wrong("rows") };
        all_rows = all_rows.saturating_add(rows);
        for column in group.columns() {
            let starts = [Some(column.data_page_offset()), column.dictionary_page_offset(), column.index_page_offset()];
            let sizes = [column.compressed_size(), column.uncompressed_size()];
            if starts.into_iter().flatten().chain(sizes).any(|place| place < 0) {
                return wrong("places");
            }
            let (start, size) = column.byte_range();
            if start.checked_add(size).is_none_or(|end| end > length) {
                return wrong("places");
            }
            if column.column_descr().max_rep_level() == 0 && usize::try_from(column.num_values()) != Ok(rows) {
                return wrong("values");
            }
        }
    }
    if Vec::<f64>::new().try_reserve_exact(all_rows).is_err() {
        return wrong("rows");
    }
    Ok(())
}

fn broken(file: &str, why: &ParquetError) -> Unusable {
    Unusable::Parquet { file: file.to_owned(), why: why.to_string() }
}

fn keep(columns: &mut [Vec<f64>], places: &mut Places, is_kept: &[bool]) {
    for column in columns {
        let mut row = 0;
        column.retain(|_| {
            row += 1;
            is_kept[row - 1]
        });
    }
    *places = places.keep(is_kept);
}

/// Reports faults of values, makes nulls NaN and returns which rows can be used; empty when all can.
fn judge(wanted: &[Wanted], columns: &mut [Vec<f64>], places: &Places, losses: &mut Losses) -> Vec<bool> {
    let is_odd = |wanted: &Wanted, value: f64| !is_measurable(value) || (wanted.whole && value.fract() != 0.0);
    let odd: Vec<_> =
        wanted.iter().zip(&*columns).map(|(wanted, column)| column.iter().any(|v| is_odd(wanted, *v))).collect();
    if !odd.contains(&true) {
        return Vec::new();
    }
    let mut is_kept = vec![true; places.len()];
    for (row, is_kept) in is_kept.iter_mut().enumerate() {
        for ((wanted, column), _) in wanted.iter().zip(&mut *columns).zip(&odd).filter(|(_, odd)| **odd) {
            let value = column[row];
            if !is_odd(wanted, value) {
                continue;
            }
            let fault = match value {
                null if is_null(null) && wanted.need == Need::Everywhere => Fault::NotMeasured,
                null if is_null(null) => {
                    column[row] = f64::NAN;
                    continue;
                }
                value if is_measurable(value) => Fault::NotWhole { cell: value.to_string() },
                value => immeasurable(value, value.to_string()),
            };
            if wanted.need == Need::Anything {
                losses.note(places.place(row), Some(&wanted.told), fault, Cost::Cell);
                column[row] = f64::NAN;
                continue;
            }
            losses.reject(places.place(row), Some(&wanted.told), fault);
            *is_kept = false;
            break;
        }
    }
    if is_kept.contains(&false) { is_kept } else { Vec::new() }
}

/// Decodes a column of a row group.
fn decode(reader: ColumnReader, out: &mut [f64], wanted: &Wanted) -> Result<(), ParquetError> {
    match reader {
        ColumnReader::DoubleColumnReader(reader) => spread(reader, out, wanted, |v| *v),
        ColumnReader::FloatColumnReader(reader) => spread(reader, out, wanted, |v| f64::from(*v)),
        ColumnReader::Int64ColumnReader(reader) => spread(reader, out, wanted, |v| *v as f64),
        ColumnReader::Int32ColumnReader(reader) => spread(reader, out, wanted, |v| f64::from(*v)),
        ColumnReader::BoolColumnReader(reader) => spread(reader, out, wanted, |v| f64::from(u8::from(*v))),
        _ => Err(ParquetError::General(format!("column {} holds no numbers", wanted.told))),
    }
}

/// Puts the values of a column where they belong, nulls between them.
fn spread<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    out: &mut [f64],
    wanted: &Wanted,
    number: impl Fn(&T::T) -> f64,
) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut filled = 0;
    // a value that is no number must not be taken for a null
    let value = |v: &T::T| match wanted.value(number(v)) {
        value if value.is_nan() => f64::NAN,
        value => value,
    };
    while filled < out.len() {
        values.clear();
        levels.clear();
        let (rows, ..) = reader.read_records(BATCH.min(out.len() - filled), Some(&mut levels), None, &mut values)?;
        if rows == 0 {
            return Err(ParquetError::General(format!("column {} ends after {filled} rows", wanted.told)));
        }
        let batch = &mut out[filled..filled + rows];
        if values.len() == rows {
            batch.iter_mut().zip(&values).for_each(|(out, v)| *out = value(v));
        } else {
            let most = levels.iter().copied().max().unwrap_or(0).max(1);
            let mut values = values.iter();
            for (out, level) in batch.iter_mut().zip(&levels) {
                *out = (*level == most).then(|| values.next()).flatten().map_or(f64::from_bits(NULL), value);
            }
        }
        filled += rows;
    }
    Ok(())
}

/// Hands over the values of a column, `None` for nulls.
fn each<T: DataType>(mut reader: ColumnReaderImpl<T>, mut put: impl FnMut(Option<&T::T>)) -> Result<(), ParquetError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    loop {
        values.clear();
        levels.clear();
        let (rows, ..) = reader.read_records(BATCH, Some(&mut levels), None, &mut values)?;
        if rows == 0 {
            return Ok(());
        }
        if values.len() == rows {
            values.iter().for_each(|v| put(Some(v)));
            continue;
        }
        let most = levels.iter().copied().max().unwrap_or(0).max(1);
        let mut values = values.iter();
        for level in &levels {
            put((*level == most).then(|| values.next()).flatten());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parquet::basic::{Compression, Repetition};
    use parquet::data_type::{DoubleType, FloatType, Int32Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::types::Type;

    use super::super::{Cells, Column, Mapping, Place, axis, silent, table};
    use super::writer::GROUP_ROWS;
    use super::*;

    fn file(columns: &[Column]) -> Vec<u8> {
        let mut bytes = Vec::new();
        write(&mut bytes, columns).expect("memory");
        bytes
    }

    fn ramp(rows: usize, step: f64) -> Vec<f64> {
        (0..rows).map(|n| n as f64 * step).collect()
    }

    /// A file of two row groups with single precision and whole numbers that may be null, as other programs write it.
    fn foreign(rows: usize) -> Vec<u8> {
        let field = |name, physical| {
            Arc::new(
                Type::primitive_type_builder(name, physical)
                    .with_repetition(Repetition::OPTIONAL)
                    .build()
                    .expect("sound"),
            )
        };
        let fields = vec![
            field("time_s", Physical::DOUBLE),
            field("position_m", Physical::FLOAT),
            field("drag_force_n", Physical::DOUBLE),
            field("segment", Physical::INT32),
        ];
        let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().expect("sound"));
        let mut bytes = Vec::new();
        // a dictionary, as most programs try first
        let properties = Arc::new(WriterProperties::builder().set_compression(Compression::SNAPPY).build());
        let mut writer = SerializedFileWriter::new(&mut bytes, schema, properties).expect("sound");
        for group in 0..2 {
            let all = group * rows / 2..(group + 1) * rows / 2;
            let levels: Vec<i16> = all.clone().map(|n| i16::from(n % 100 != 7)).collect();
            let some: Vec<usize> = all.clone().filter(|n| n % 100 != 7).collect();
            let mut into = writer.next_row_group().expect("sound");
            let mut column = into.next_column().expect("sound").expect("time_s");
            let values: Vec<f64> = all.clone().map(|n| n as f64 * 0.01).collect();
            column.typed::<DoubleType>().write_batch(&values, Some(&vec![1; values.len()]), None).expect("sound");
            column.close().expect("sound");
            let mut column = into.next_column().expect("sound").expect("position_m");
            let values: Vec<f32> = all.clone().map(|n| n as f32 * 0.125).collect();
            column.typed::<FloatType>().write_batch(&values, Some(&vec![1; values.len()]), None).expect("sound");
            column.close().expect("sound");
            let mut column = into.next_column().expect("sound").expect("drag_force_n");
            let values: Vec<f64> = some.iter().map(|n| (n % 10) as f64).collect();
            column.typed::<DoubleType>().write_batch(&values, Some(&levels), None).expect("sound");
            column.close().expect("sound");
            let mut column = into.next_column().expect("sound").expect("segment");
            let values: Vec<i32> = all.clone().map(|_| group as i32).collect();
            column.typed::<Int32Type>().write_batch(&values, Some(&vec![1; values.len()]), None).expect("sound");
            column.close().expect("sound");
            into.close().expect("sound");
        }
        writer.close().expect("sound");
        bytes
    }

    #[test]
    fn what_is_written_is_read_again_to_the_last_bit() {
        // more than a row group, and more than a batch
        let rows = GROUP_ROWS + BATCH + 17;
        let time_s = ramp(rows, 0.001);
        let force: Vec<f64> = time_s.iter().map(|t| (t * 7.0).sin() / 3.0).collect();
        let mut preload = ramp(rows, 1e-3);
        preload[5] = f64::NAN;
        preload[rows - 1] = f64::NAN;
        let notes: Vec<String> = (0..rows).map(|n| format!("{}", n % 3)).collect();
        let bytes = file(&[
            Column { name: "note", cells: Cells::Texts(&notes) },
            Column::numbers("drag_force_n", &force),
            Column::numbers("preload_n", &preload),
            Column::numbers("time_s", &time_s),
            Column::numbers("velocity_m_s", &force),
        ]);
        let (run, losses) = axis::from_bytes("a.parquet", bytes.clone(), &[], &[], &silent).expect("usable");
        assert_eq!(losses, Losses { rows: rows as u64, ..Losses::default() });
        assert_eq!((&run.time_s, &run.drag_force_n, run.velocity_m_s.as_ref()), (&time_s, &force, Some(&force)));
        let bits = |column: &[f64]| column.iter().map(|v| v.is_nan() || v.to_bits() != 0).collect::<Vec<_>>();
        assert_eq!(bits(&run.preload_n.expect("there")), bits(&preload));
        let select = ["note=1".parse().expect("sound")];
        let (table, losses) =
            table::from_bytes("a.parquet", bytes, &["time_s"], &["nothing"], &[], &select, &silent).expect("usable");
        assert_eq!(table.column("time_s").expect("there")[1], time_s[4]);
        assert_eq!((table.len() as u64, table.column("nothing")), (losses.rows, None));
        assert_eq!(table.len(), notes.iter().filter(|note| *note == "1").count());
    }

    #[test]
    fn nulls_and_numbers_of_any_type_are_read() {
        let (run, losses) = axis::from_bytes("a.parquet", foreign(1000), &[], &[], &silent).expect("usable");
        assert_eq!((losses.rows, losses.lost, losses.gaps), (1000, 10, 10));
        assert_eq!(
            losses.problems[0].to_string(),
            "row 8: column drag_force_n: not measured here, but every row needs it; the row is left out"
        );
        assert_eq!(losses.problems[1].place, Place::Row(9));
        assert_eq!(run.parts.iter().map(|part| part.segment).max(), Some(Some(1)));
        assert_eq!(run.position_m.expect("there")[7], 1.0);
        let mapping: [Mapping; 1] = ["drag_force_n=drag_force_n:2:1".parse().expect("sound")];
        let select = ["segment=1".parse().expect("sound")];
        let (run, losses) = axis::from_bytes("a.parquet", foreign(1000), &mapping, &select, &silent).expect("usable");
        assert_eq!((losses.rows, losses.lost, run.len()), (500, 5, 495));
        assert_eq!(run.drag_force_n[..3], [1.0, 3.0, 5.0]);
        assert_eq!(losses.problems[0].place, Place::Row(508));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_row() {
        let mut force = ramp(300, 1.0);
        (force[10], force[20]) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut load = ramp(300, 1.0);
        (load[30], load[40]) = (f64::INFINITY, -1e308);
        let time_s = ramp(300, 0.01);
        let columns = |name| {
            file(&[
                Column::numbers("time_s", &time_s),
                Column::numbers("position_m", &time_s),
                Column::numbers(name, &force),
                Column::numbers("external_load_n", &load),
            ])
        };
        let (run, losses) = axis::from_bytes("a.parquet", columns("drag_force_n"), &[], &[], &silent).expect("usable");
        let messages: Vec<_> = losses.problems.iter().map(ToString::to_string).collect();
        assert_eq!(messages[0], "row 11: column drag_force_n: \"inf\" is not finite; the row is left out");
        assert_eq!(messages[2], "row 21: column drag_force_n: \"-inf\" is not finite; the row is left out");
        assert_eq!(messages[4], "row 31: column external_load_n: \"inf\" is not finite; it counts as not measured");
        assert!(
            messages[5].contains("\" is larger than anything that is measured, in any unit; it counts as not measured")
        );
        assert_eq!((run.len(), losses.lost, messages.len()), (298, 2, 6));
        let refused = |bytes: Vec<u8>, select: &[Selection]| {
            axis::from_bytes("a.parquet", bytes, &[], select, &silent).expect_err("refused").to_string()
        };
        assert_eq!(
            refused(columns("force"), &[]),
            "a.parquet: no column drag_force_n; the file has: time_s, position_m, force, external_load_n; --column \
             drag_force_n=COLUMN:SCALE reads it from another one"
        );
        let texts = vec!["x".to_owned(); 300];
        let text = file(&[
            Column::numbers("time_s", &time_s),
            Column::numbers("position_m", &time_s),
            Column { name: "drag_force_n", cells: Cells::Texts(&texts) },
        ]);
        assert_eq!(refused(text, &[]), "a.parquet: column drag_force_n holds text, not numbers");
        assert_eq!(
            refused(columns("drag_force_n"), &["time_s=-1".parse().expect("sound")]),
            "a.parquet: no row has time_s = -1; column time_s has: 0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07"
        );
        let sound = columns("drag_force_n");
        for cut in [4, 100, sound.len() - 1] {
            let message = refused(sound[..cut].to_vec(), &[]);
            assert!(message.starts_with("a.parquet: not a sound Parquet file: "), "{message}");
        }
    }

    #[test]
    fn damage_anywhere_is_an_error_and_never_a_panic() {
        let time_s = ramp(500, 0.01);
        let sound = file(&[Column::numbers("time_s", &time_s), Column::numbers("position_m", &time_s)]);
        let (mut seed, mut refused) = (1u64, 0);
        for _ in 0..2000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let mut bytes = sound.clone();
            let place = 4 + (seed >> 33) as usize % (bytes.len() - 4);
            bytes[place] ^= (seed >> 24) as u8 | 1;
            refused += usize::from(
                table::from_bytes("a.parquet", bytes, &["time_s", "position_m"], &[], &[], &[], &silent).is_err(),
            );
        }
        println!("{refused} of 2000 refused");
        assert!(refused > 100);
    }
}
