//! Mappings of columns and selections of rows of a foreign file: `--column` and `--where`.

use std::fmt;
use std::str::FromStr;

/// A column made from another one: `value = cell·scale + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    /// The column that is wanted, as `drag_force_n`.
    pub name: String,
    /// The column of the file it is made from.
    pub column: String,
    /// Factor on the cell, in the unit of `name` per unit of `column`. Finite, not 0.
    pub scale: f64,
    /// What is added after that, in the unit of `name`. Finite.
    pub offset: f64,
    /// Whether a file without that column is refused. A mapping that only scales a column of its own name is not
    /// needed.
    pub is_needed: bool,
}

/// Why a mapping or a selection is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MappingError {
    /// There is no `=`.
    #[error("expected NAME=COLUMN:SCALE[:OFFSET], as drag_force_n=gtau:35.15, found {0:?}")]
    NoName(String),
    /// A name is empty.
    #[error("{0:?} lacks the name of a column; expected NAME=COLUMN:SCALE[:OFFSET]")]
    Empty(String),
    /// Scale or offset is no finite number.
    #[error("{what} {found:?} of {name} is not a finite number")]
    NotANumber {
        /// Scale or offset.
        what: &'static str,
        /// The wanted column.
        name: String,
        /// What stands there.
        found: String,
    },
    /// The scale is zero.
    #[error("a scale of 0 would make {0} zero in every row")]
    ZeroScale(String),
    /// Too many colons.
    #[error("{text:?} of {name}: expected COLUMN:SCALE[:OFFSET]")]
    TooMany {
        /// The wanted column.
        name: String,
        /// What stands there.
        text: String,
    },
    /// A selection that is none.
    #[error("expected COLUMN=VALUE, as drive=1, found {0:?}")]
    NoValue(String),
}

impl Mapping {
    /// A mapping from the two halves of an entry `NAME = "COLUMN[:SCALE[:OFFSET]]"`, as a simulation file has them. A
    /// simulation goes with many recordings: where it scales a column by its own name, as a calibrated preload, one
    /// without that column is not refused.
    ///
    /// # Errors
    /// [`MappingError`] when one of the names is empty or a number is none.
    pub fn new(name: &str, text: &str) -> Result<Self, MappingError> {
        let name = name.trim().to_owned();
        let parts: Vec<_> = text.split(':').map(str::trim).collect();
        let (column, scale, offset) = match parts[..] {
            [column] => (column, "1", "0"),
            [column, scale] => (column, scale, "0"),
            [column, scale, offset] => (column, scale, offset),
            _ => return Err(MappingError::TooMany { name, text: text.to_owned() }),
        };
        if name.is_empty() || column.is_empty() {
            return Err(MappingError::Empty(format!("{name}={text}")));
        }
        let number = |what, text: &str| match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(MappingError::NotANumber { what, name: name.clone(), found: text.to_owned() }),
        };
        let (scale, offset) = (number("the scale", scale)?, number("the offset", offset)?);
        if scale == 0.0 {
            return Err(MappingError::ZeroScale(name));
        }
        Ok(Mapping { column: column.to_owned(), scale, offset, is_needed: column != name, name })
    }
}

impl FromStr for Mapping {
    type Err = MappingError;

    fn from_str(text: &str) -> Result<Self, MappingError> {
        let (name, rest) = text.split_once('=').ok_or_else(|| MappingError::NoName(text.to_owned()))?;
        Ok(Mapping { is_needed: true, ..Mapping::new(name, rest)? })
    }
}

/// Which rows of a file are read: those whose `column` is `value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// The column.
    pub column: String,
    /// The value. A number is equal to a number of another spelling, as 1 to 1.0.
    pub value: String,
    number: Option<f64>,
}

impl Selection {
    /// Whether a cell is the wanted one.
    pub(super) fn takes(&self, cell: &[u8]) -> bool {
        let cell = cell.trim_ascii();
        cell == self.value.as_bytes()
            || self.number.is_some_and(|wanted| {
                std::str::from_utf8(cell).is_ok_and(|cell| cell.parse::<f64>().is_ok_and(|number| number == wanted))
            })
    }
}

impl FromStr for Selection {
    type Err = MappingError;

    fn from_str(text: &str) -> Result<Self, MappingError> {
        match text.split_once('=').map(|(column, value)| (column.trim(), value.trim())) {
            Some((column, value)) if !column.is_empty() && !value.is_empty() => {
                Ok(Selection { column: column.to_owned(), value: value.to_owned(), number: value.parse().ok() })
            }
            _ => Err(MappingError::NoValue(text.to_owned())),
        }
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}", self.column, self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mappings_are_read() {
        let mapping = |name: &str, column: &str, scale, offset| Mapping {
            name: name.to_owned(),
            column: column.to_owned(),
            scale,
            offset,
            is_needed: true,
        };
        for (text, expected) in [
            ("drag_force_n=gtau:35.15", mapping("drag_force_n", "gtau", 35.15, 0.0)),
            ("temperature_block_degc = T : 1 : -273.15", mapping("temperature_block_degc", "T", 1.0, -273.15)),
            ("position_m=x", mapping("position_m", "x", 1.0, 0.0)),
        ] {
            assert_eq!(text.parse(), Ok(expected));
        }
        assert_eq!(Mapping::new("a", "b:2"), Ok(mapping("a", "b", 2.0, 0.0)));
        assert_eq!(Mapping::new("a", "a:2"), Ok(Mapping { is_needed: false, ..mapping("a", "a", 2.0, 0.0) }));
    }

    #[test]
    fn what_is_no_mapping_is_said() {
        for (text, message) in [
            ("gtau:35", "expected NAME=COLUMN:SCALE[:OFFSET], as drag_force_n=gtau:35.15, found \"gtau:35\""),
            ("=gtau", "\"=gtau\" lacks the name of a column; expected NAME=COLUMN:SCALE[:OFFSET]"),
            ("drag_force_n=:2", "\"drag_force_n=:2\" lacks the name of a column; expected NAME=COLUMN:SCALE[:OFFSET]"),
            ("a=b:x", "the scale \"x\" of a is not a finite number"),
            ("a=b:1:inf", "the offset \"inf\" of a is not a finite number"),
            ("a=b:0", "a scale of 0 would make a zero in every row"),
            ("a=b:1:2:3", "\"b:1:2:3\" of a: expected COLUMN:SCALE[:OFFSET]"),
        ] {
            assert_eq!(text.parse::<Mapping>().expect_err("wrong").to_string(), message);
        }
        assert_eq!(
            "drive".parse::<Selection>().expect_err("wrong").to_string(),
            "expected COLUMN=VALUE, as drive=1, found \"drive\""
        );
    }

    #[test]
    fn a_selection_takes_numbers_of_any_spelling_and_texts_as_they_are() {
        let one: Selection = "drive=1".parse().expect("sound");
        assert!([b"1".as_slice(), b" 1.0", b"1e0"].iter().all(|cell| one.takes(cell)));
        assert!([b"2".as_slice(), b"", b"one"].iter().all(|cell| !one.takes(cell)));
        let run: Selection = "run=n200".parse().expect("sound");
        assert!(run.takes(b"n200") && !run.takes(b"n20"));
    }
}
