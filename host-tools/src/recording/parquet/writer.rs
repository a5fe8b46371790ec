//! Writer of columns as a Parquet file.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::super::write::{Cells, Column};

/// Rows of a row group. Several a file, so that several threads can read one.
pub(super) const GROUP_ROWS: usize = 1 << 18;

/// Writes columns as a Parquet file: numbers as doubles, NaN as null, texts as UTF-8; Snappy.
///
/// # Errors
/// Those of the writer.
pub(in super::super) fn write(out: impl Write + Send, columns: &[Column]) -> Result<(), ParquetError> {
    let field = |column: &Column| -> Result<_, ParquetError> {
        let (physical, logical, repetition) = match column.cells {
            Cells::Numbers(numbers) if numbers.iter().any(|v| v.is_nan()) => {
                (Physical::DOUBLE, None, Repetition::OPTIONAL)
            }
            Cells::Numbers(_) => (Physical::DOUBLE, None, Repetition::REQUIRED),
            Cells::Texts(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED),
        };
        let field = Type::primitive_type_builder(column.name, physical).with_repetition(repetition);
        Ok(Arc::new(field.with_logical_type(logical).build()?))
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("recording").with_fields(fields).build()?);
    // samples hardly ever repeat: a dictionary would be useless
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .build();
    let mut writer = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let rows = columns.first().map_or(0, |column| column.cells.len());
    let mut from = 0;
    while from < rows {
        let to = rows.min(from + GROUP_ROWS);
        let mut group = writer.next_row_group()?;
        for column in columns {
            let Some(mut into) = group.next_column()? else { break };
            match column.cells {
                Cells::Numbers(numbers) => {
                    let numbers = &numbers[from..to];
                    let levels: Vec<i16> = numbers.iter().map(|v| i16::from(!v.is_nan())).collect();
                    let measured: Vec<f64>;
                    let values = if levels.contains(&0) {
                        measured = numbers.iter().copied().filter(|v| !v.is_nan()).collect();
                        &measured
                    } else {
                        numbers
                    };
                    into.typed::<DoubleType>().write_batch(values, Some(&levels), None)?;
                }
                Cells::Texts(texts) => {
                    let texts: Vec<_> = texts[from..to].iter().map(|text| ByteArray::from(&**text)).collect();
                    into.typed::<ByteArrayType>().write_batch(&texts, None, None)?;
                }
            }
            into.close()?;
        }
        group.close()?;
        from = to;
    }
    writer.close()?;
    Ok(())
}
