//! The parts of a test that a column `segment` names by texts: they are numbered in the order in which they come.

use super::cell::{is_whole, told};
use super::columns::{Numbers, Wanted};
use super::source::Source;
use super::{Cost, Fault, Losses, Unusable};

/// Share of the rows up to which a segment that is no whole number is a spoilt cell; where more are none, the column
/// holds names.
const SPOILT: f64 = 0.01;

/// Rows of a part on average below which texts tell something else apart than parts of a test.
const ROWS_A_PART: usize = 20;

/// Names that are told.
const TOLD: usize = 8;

/// Reads columns by `read`; a `segment` of texts becomes the numbers of the parts that they name.
pub(super) fn read(
    source: &Source,
    mut wanted: Vec<Wanted>,
    read: impl Fn(&[Wanted]) -> Result<Numbers, Unusable>,
) -> Result<(Vec<Wanted>, Numbers), Unusable> {
    let Some(at) = wanted.iter().position(|wanted| wanted.name == "segment") else {
        let numbers = read(&wanted)?;
        return Ok((wanted, numbers));
    };
    let is_text = matches!(source, Source::Parquet(table) if table.not_numbers(wanted[at].place).is_some());
    let plain = match is_text {
        true => None,
        false => Some(read(&wanted)?),
    };
    let plain = match plain {
        Some(plain) if are_few(spoilt(&plain), plain.losses.rows) => return Ok((wanted, plain)),
        plain => plain,
    };
    let segment = wanted.remove(at);
    let mut numbers = read(&wanted)?;
    let lines: Vec<u64> = (0..numbers.places.len()).map(|row| numbers.places.line(row)).collect();
    let texts = source.texts(segment.place, &lines)?;
    let (column, fault) = match (of(&texts), plain) {
        (Segments::Numbers, Some(plain)) => {
            wanted.insert(at, segment);
            return Ok((wanted, plain));
        }
        // of a kind of column that is text in the file
        (Segments::Numbers, None) => (Some(texts.iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect()), None),
        (Segments::Named(column, fault), _) => (Some(column), Some(fault)),
        (Segments::Unusable(fault), _) => (None, Some(fault)),
    };
    let mut said = Losses::default();
    if let Some(fault) = fault {
        said.note(numbers.places.place(0), Some(&segment.told), fault, Cost::AsSaid);
    }
    numbers.losses.absorb(said);
    if let Some(column) = column {
        numbers.columns.insert(at, column);
        numbers.spoilt.insert(at, 0);
        wanted.insert(at, segment);
    }
    Ok((wanted, numbers))
}

/// Rows that cells cost which are no numbers or not whole.
fn spoilt(numbers: &Numbers) -> u64 {
    numbers.losses.rejected.get("not-a-number").copied().unwrap_or(0)
}

/// What the texts of the column are.
#[derive(Debug, PartialEq)]
enum Segments {
    /// Whole numbers, a few of them spoilt.
    Numbers,
    /// Names of parts: their numbers row by row, NaN where there is none.
    Named(Vec<f64>, Fault),
    /// Neither.
    Unusable(Fault),
}

/// Whether so many of all rows may be spoilt.
fn are_few(spoilt: u64, rows: u64) -> bool {
    spoilt as f64 <= SPOILT * rows as f64
}

/// Looks at the texts of a column, one a row.
fn of(texts: &[String]) -> Segments {
    let is_name = |text: &&String| !text.is_empty() && !text.parse().is_ok_and(is_whole);
    if are_few(texts.iter().filter(is_name).count() as u64, texts.len() as u64) {
        return Segments::Numbers;
    }
    let most = texts.len() / ROWS_A_PART;
    let (mut names, mut numbers): (Vec<&str>, Vec<f64>) = (Vec::new(), Vec::with_capacity(texts.len()));
    let mut last = 0;
    for text in texts {
        if text.is_empty() {
            numbers.push(f64::NAN);
            continue;
        }
        // the name of the row before is the usual one
        if names.get(last) != Some(&&**text) {
            last = names.iter().position(|name| name == text).unwrap_or_else(|| {
                names.push(text);
                names.len() - 1
            });
        }
        if names.len() > most {
            return Segments::Unusable(Fault::TooManyNames { rows: texts.len(), most });
        }
        numbers.push((last + 1) as f64);
    }
    let told: Vec<_> = names
        .iter()
        .take(TOLD)
        .enumerate()
        .map(|(n, name)| format!("{} is {}", told(name.as_bytes()), n + 1))
        .collect();
    let more = if names.len() > TOLD { ", ..." } else { "" };
    Segments::Named(numbers, Fault::NamedParts { names: told.join(", ") + more })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(list: &[(&str, usize)]) -> Vec<String> {
        list.iter().flat_map(|(text, rows)| vec![(*text).to_owned(); *rows]).collect()
    }

    #[test]
    fn equal_names_are_one_part() {
        let Segments::Named(numbers, fault) = of(&texts(&[("up", 30), ("down", 30), ("", 1), ("up", 30)])) else {
            panic!("names")
        };
        assert_eq!([numbers[0], numbers[30], numbers[61]], [1.0, 2.0, 1.0]);
        assert!(numbers[60].is_nan());
        assert_eq!(fault, Fault::NamedParts { names: "up is 1, down is 2".to_owned() });
        assert!(matches!(of(&texts(&[("0", 30), ("0.1", 30)])), Segments::Named(..)));
    }

    #[test]
    fn numbers_and_other_texts_are_no_names() {
        assert_eq!(of(&texts(&[("1", 300), ("1.5", 1), ("", 20)])), Segments::Numbers);
        let stamps: Vec<_> = (0..300).map(|n| format!("12:00:{n}")).collect();
        assert_eq!(of(&stamps), Segments::Unusable(Fault::TooManyNames { rows: 300, most: 15 }));
    }
}
