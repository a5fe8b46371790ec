//! Parameter records from a bench file, and back.
//!
//! A bench file is TOML. It states what differs from the published set, [`Params::ZHOU_2023`]; keys are the
//! fields of [`Params`]:
//!
//! ```toml
//! schema = "guideblock.bench/1"
//! node = 1
//! calibrated = true           # without it the block never gives a preload
//!
//! [calibration.force]
//! zero_code = 2051.5
//! newtons_per_code = 0.0488
//! ```

use can_wire::parameters::{self as wire, BadRecord, EncodeError, MAX_SIZE, ParameterRecord};
use model_core::params::Params;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use crate::toml_place::{self, Key};

/// The value of `schema`.
pub const SCHEMA: &str = "guideblock.bench/1";

/// Why a bench file gives no record. The text says what to do.
#[derive(Debug, thiserror::Error)]
pub enum BadBench {
    /// Not TOML; the message has line and column.
    #[error("{0}")]
    Syntax(#[source] toml::de::Error),
    /// The file does not say that it is a bench file.
    #[error("expected schema = \"{SCHEMA}\" as first key")]
    Schema,
    /// No parameter has this name.
    #[error("there is no parameter {key}; there are: {known}")]
    UnknownKey {
        /// The key with the tables it stands in.
        key: String,
        /// The keys that may stand there.
        known: String,
    },
    /// A table where a value belongs, or the other way round.
    #[error("{key} must be a {expected}")]
    Shape {
        /// The key with the tables it stands in.
        key: String,
        /// Table or value.
        expected: &'static str,
    },
    /// A value of the wrong type.
    #[error("{}", .0.message())]
    Type(#[source] toml::de::Error),
    /// A value outside its range.
    #[error("{0}")]
    Refused(EncodeError),
    /// The same with where in the file it stands.
    #[error("line {line}, column {column}: {what}")]
    At {
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong there.
        what: Box<BadBench>,
    },
}

/// The whole of a bench file.
#[derive(Serialize, Deserialize)]
struct BenchFile {
    schema: String,
    node: u8,
    #[serde(flatten)]
    params: Params,
}

impl BenchFile {
    fn of(record: &ParameterRecord) -> Self {
        BenchFile { schema: SCHEMA.to_owned(), node: record.node, params: record.params }
    }
}

/// The record that a bench file describes.
///
/// # Errors
/// [`BadBench`], naming the key.
pub fn from_bench(text: &str) -> Result<ParameterRecord, BadBench> {
    let overrides: Table = text.parse().map_err(BadBench::Syntax)?;
    from_table(overrides.clone()).map_err(|what| match place(text, &overrides, &what) {
        Some(Key { line, column, .. }) => BadBench::At { line, column, what: Box::new(what) },
        None => what,
    })
}

/// Where a mistake stands.
fn place(text: &str, overrides: &Table, what: &BadBench) -> Option<Key> {
    match what {
        BadBench::Schema => toml_place::find(text, &["schema"]),
        BadBench::UnknownKey { key, .. } | BadBench::Shape { key, .. } => {
            toml_place::find(text, &key.split('.').collect::<Vec<_>>())
        }
        // the first key that would be refused if it stood there alone
        BadBench::Type(_) | BadBench::Refused(_) => {
            let is_wrong = |key: &Key| alone(overrides, &key.path).is_some_and(|table| from_table(table).is_err());
            toml_place::keys(text).into_iter().find(is_wrong)
        }
        BadBench::Syntax(_) | BadBench::At { .. } => None,
    }
}

/// The schema and one key of all.
fn alone(overrides: &Table, path: &[String]) -> Option<Table> {
    let mut value = overrides.get(path.first()?)?;
    for key in &path[1..] {
        value = value.get(key)?;
    }
    let nested = path[1..]
        .iter()
        .rev()
        .fold(value.clone(), |inner, key| Value::Table([(key.clone(), inner)].into_iter().collect()));
    let schema = ("schema".to_owned(), Value::String(SCHEMA.to_owned()));
    Some([schema, (path[0].clone(), nested)].into_iter().collect())
}

fn from_table(overrides: Table) -> Result<ParameterRecord, BadBench> {
    if overrides.get("schema").and_then(Value::as_str) != Some(SCHEMA) {
        return Err(BadBench::Schema);
    }
    let mut all: Table = to_bench(&crate::replay::UNPROGRAMMED).parse().map_err(BadBench::Syntax)?;
    override_with(&mut all, overrides, "")?;
    let file: BenchFile = all.try_into().map_err(BadBench::Type)?;
    let record = ParameterRecord { node: file.node, params: file.params };
    // refuse here what the block would refuse
    wire::encode(&record, &mut [0; MAX_SIZE]).map_err(BadBench::Refused)?;
    Ok(record)
}

/// The bench file that describes a record, every key spelt out.
pub fn to_bench(record: &ParameterRecord) -> String {
    // a plain struct of numbers and names always has a TOML form
    toml::to_string(&BenchFile::of(record)).unwrap_or_default()
}

/// The bytes for the block's flash, at [`wire::ADDRESS`].
///
/// # Errors
/// See [`EncodeError`].
pub fn to_bytes(record: &ParameterRecord) -> Result<Vec<u8>, EncodeError> {
    wire::encode(record, &mut [0; MAX_SIZE]).map(<[u8]>::to_vec)
}

/// Reads what [`to_bytes`] wrote.
///
/// # Errors
/// See [`BadRecord`].
pub fn from_bytes(bytes: &[u8]) -> Result<ParameterRecord, BadRecord> {
    wire::decode(bytes)
}

fn override_with(all: &mut Table, overrides: Table, within: &str) -> Result<(), BadBench> {
    for (key, value) in overrides {
        let path = if within.is_empty() { key.clone() } else { format!("{within}.{key}") };
        let known: Vec<_> = all.keys().cloned().collect();
        match (all.get_mut(&key), value) {
            (None, _) => return Err(BadBench::UnknownKey { key: path, known: known.join(", ") }),
            (Some(Value::Table(inner)), Value::Table(value)) => override_with(inner, value, &path)?,
            (Some(Value::Table(_)), _) => return Err(BadBench::Shape { key: path, expected: "table" }),
            (Some(_), Value::Table(_)) => return Err(BadBench::Shape { key: path, expected: "value" }),
            (Some(place), value) => *place = value,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::replay::UNPROGRAMMED;

    const HEAD: &str = "schema = \"guideblock.bench/1\"\n";

    #[test]
    fn an_empty_bench_is_the_published_set() {
        assert_eq!(from_bench(HEAD).expect("legal"), UNPROGRAMMED);
    }

    #[test]
    fn what_is_shown_is_read_again_bit_for_bit() {
        let mut record = UNPROGRAMMED;
        record.node = 127;
        record.params.calibrated = true;
        record.params.calibration.force.zero_code = 2051.503;
        record.params.viscosity.ln[3] = -2.674_901e-6;
        let shown = to_bench(&record);
        assert_eq!(from_bench(&shown).expect("legal"), record, "{shown}");
        assert_eq!(from_bytes(&to_bytes(&record).expect("legal")), Ok(record));
    }

    #[test]
    fn overrides_reach_nested_fields() {
        let record =
            from_bench(&format!("{HEAD}node = 9\n[seals]\ncoulomb_n = 2\n[calibration.force]\nzero_code = 2050.25\n"))
                .expect("legal");
        let mut expected = UNPROGRAMMED;
        expected.node = 9;
        expected.params.seals.coulomb_n = 2.0;
        expected.params.calibration.force.zero_code = 2050.25;
        assert_eq!(record, expected);
    }

    #[test]
    fn mistakes_are_named() {
        let message = |text: &str| from_bench(&format!("{HEAD}{text}")).expect_err("refused").to_string();
        assert_eq!(
            message("[calibration.force]\nzero = 1.0"),
            "line 3, column 1: there is no parameter calibration.force.zero; there are: newtons_per_code, rail_high_code, rail_low_code, zero_code"
        );
        assert_eq!(message("seals = 3.0"), "line 2, column 1: seals must be a table");
        assert_eq!(message("node.number = 3"), "line 2, column 6: node must be a value");
        assert_eq!(message("node = 128"), "line 2, column 1: node 128 is not 1 to 127");
        assert_eq!(
            message("[seals]\ncoulomb_n = -1.0"),
            "line 3, column 1: seal_drag_n must lie between 0 and 10000 N"
        );
        assert_eq!(
            message("calibrated = true\nnode = \"one\""),
            "line 3, column 1: invalid type: string \"one\", expected u8"
        );
        assert!(message("node = 3\nnode = 4").contains("line 3, column 1"), "{}", message("node = 3\nnode = 4"));
        assert!(message("node = ").contains("line 2"), "{}", message("node = "));
        assert_eq!(
            from_bench("node = 1").expect_err("refused").to_string(),
            "expected schema = \"guideblock.bench/1\" as first key"
        );
    }
}
