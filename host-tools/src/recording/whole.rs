//! All columns of a file, whatever their names and content, to be written again by [`write()`](super::write()).

use std::path::Path;

use super::columns::{Header, Need, Numbers, Wanted, check_once};
use super::source::Source;
use super::write::{Cells, Column};
use super::{Cost, Fault, Losses, Mapping, Place, Progress, Selection, Unusable, axis, load};

/// A file's columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Whole {
    columns: Vec<(String, Values)>,
}

#[derive(Clone, Debug, PartialEq)]
enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<String>),
}

impl Whole {
    /// The columns, ready to be written.
    pub fn columns<'a>(&'a self) -> Vec<Column<'a>> {
        let column = |(name, values): &'a (String, Values)| Column {
            name,
            cells: match values {
                Values::Numbers(numbers) => Cells::Numbers(numbers),
                Values::Texts(texts) => Cells::Texts(texts),
            },
        };
        self.columns.iter().map(column).collect()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.columns().first().map_or(0, |column| column.cells.len())
    }

    /// Whether there is no row; never, for a file that was read.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Reads every column of a CSV or Parquet file. The path `-` is standard input.
///
/// A mapped column stands where the column it is made from stood. Columns of a run and mapped ones hold numbers, and a
/// spoilt cell there is not measured; any other column, and a `segment`, of which a cell is no number is text. Only rows with too few or
/// too many cells are left out: nothing is said here about time or units.
///
/// # Errors
/// [`Unusable`] when the file cannot be read, lacks a mapped column, has a name twice, or holds no row.
pub fn open(
    path: &Path,
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Whole, Losses), Unusable> {
    let (file, bytes) = load(path)?;
    from_bytes(&file, bytes, mappings, selections, progress)
}

/// The same from memory; `file` is its name in messages.
///
/// # Errors
/// As [`open`].
pub fn from_bytes(
    file: &str,
    bytes: Vec<u8>,
    mappings: &[Mapping],
    selections: &[Selection],
    progress: Progress,
) -> Result<(Whole, Losses), Unusable> {
    check_once(mappings)?;
    let source = Source::of(file, bytes)?;
    let wanted = every(source.header(), mappings)?;
    let is_fixed = |wanted: &Wanted| holds_numbers(&wanted.name) || mappings.iter().any(|m| m.name == wanted.name);
    let mut is_text: Vec<bool> = wanted.iter().map(|w| !is_fixed(w) && source.looks_like_text(w.place)).collect();
    // a column may turn out to be text far down
    let numbers = loop {
        let of_numbers: Vec<_> =
            wanted.iter().zip(&is_text).filter(|(_, text)| !**text).map(|(w, _)| w.clone()).collect();
        let numbers = source.numbers(file, of_numbers, selections, progress)?;
        let mut read = numbers.columns.iter().zip(&numbers.spoilt);
        let mut is_over = true;
        for (wanted, is_text) in wanted.iter().zip(&mut is_text).filter(|(_, text)| !**text) {
            let Some((column, spoilt)) = read.next() else { break };
            if !is_fixed(wanted) && (*spoilt > 0 || source.is_inexact(wanted.place, column)) {
                (*is_text, is_over) = (true, false);
            }
        }
        if is_over {
            break numbers;
        }
    };
    let Numbers { columns, places, mut losses, .. } = numbers;
    if source.is_latin_1() && !losses.problems.iter().any(|problem| problem.fault == Fault::Latin1) {
        let mut said = Losses::default();
        said.note(Place::Line(source.header().line.unwrap_or(1)), None, Fault::Latin1, Cost::AsSaid);
        losses.absorb(said);
    }
    if places.len() == 0 {
        return Err(Unusable::too_few(file, 0, "rows", 1, &losses));
    }
    let lines: Vec<u64> = (0..places.len()).map(|row| places.line(row)).collect();
    let mut columns = columns.into_iter();
    let mut whole = Vec::with_capacity(wanted.len());
    for (wanted, is_text) in wanted.into_iter().zip(is_text) {
        let values = match is_text {
            true => Values::Texts(source.texts(wanted.place, &lines)?),
            false => Values::Numbers(columns.next().unwrap_or_default()),
        };
        whole.push((wanted.name, values));
    }
    Ok((Whole { columns: whole }, losses))
}

/// Whether a column of that name holds numbers alone; a `segment` may hold names.
fn holds_numbers(name: &str) -> bool {
    name != "segment" && axis::names().contains(&name)
}

/// Every column of a file once, mapped ones in the place of what they are made from.
fn every(header: &Header, mappings: &[Mapping]) -> Result<Vec<Wanted>, Unusable> {
    let mapped: Vec<_> = mappings
        .iter()
        .map(|mapping| header.wanted(&mapping.name, Need::Anything, mappings))
        .collect::<Result<Vec<_>, _>>()?
        .into_iter()
        .flatten()
        .collect();
    let mut wanted = Vec::new();
    for (place, name) in header.names.iter().enumerate() {
        let here: Vec<_> = mapped.iter().filter(|wanted| wanted.place == place).cloned().collect();
        if !here.is_empty() {
            wanted.extend(here);
        } else if name.is_empty() {
            let name = format!("column_{}", place + 1);
            wanted.push(Wanted { told: name.clone(), ..Wanted::plain(name, place, Need::Anything) });
        } else if mapped.iter().all(|wanted| wanted.name != *name) {
            header.find(name)?;
            wanted.push(Wanted::plain(name.clone(), place, Need::Anything));
        }
    }
    Ok(wanted)
}

#[cfg(test)]
mod tests {
    use super::super::silent;
    use super::*;

    fn whole(text: &str, mappings: &[&str]) -> Result<(Whole, Losses), Unusable> {
        let mappings: Vec<_> = mappings.iter().map(|text| text.parse().expect("sound")).collect();
        from_bytes("a.csv", text.as_bytes().to_vec(), &mappings, &[], &silent)
    }

    fn numbers(numbers: &[f64]) -> Values {
        Values::Numbers(numbers.to_vec())
    }

    fn texts(texts: &[&str]) -> Values {
        Values::Texts(texts.iter().map(|text| (*text).to_owned()).collect())
    }

    #[test]
    fn every_column_is_kept_as_what_it_is() {
        let text = "time_s,note,count,stamp,drag_force_n,\n0,\"a, \"\"b\"\"\",1,1700000000000000001,x,1\n1,,2\n2,c,3,1,2.5,0\n";
        let (whole, losses) = whole(text, &[]).expect("usable");
        let column = |name: &str, values| (name.to_owned(), values);
        assert_eq!(
            format!("{:?}", whole.columns),
            format!(
                "{:?}",
                [
                    column("time_s", numbers(&[0.0, 2.0])),
                    column("note", texts(&["a, \"b\"", "c"])),
                    column("count", numbers(&[1.0, 3.0])),
                    column("stamp", texts(&["1700000000000000001", "1"])),
                    column("drag_force_n", numbers(&[f64::NAN, 2.5])),
                    column("column_6", numbers(&[1.0, 0.0])),
                ]
            )
        );
        assert_eq!(
            losses.describe("a.csv"),
            [
                "a.csv: line 2: column drag_force_n: \"x\" is not a number (decimal mark is the point); it counts as not \
                 measured",
                "a.csv: line 3: 3 cells instead of 6; the row is left out",
                "a.csv: 1 of 3 rows lost"
            ]
        );
    }

    #[test]
    fn names_of_parts_and_latin_1_stay_and_a_row_of_units_goes() {
        let text = b"time_s,segment,Temp \xb0C,note\ns,,\xb0C,text\n0,A,20,\xfcber\n1,B,21,x\n".to_vec();
        let (whole, losses) = from_bytes("a.csv", text, &[], &[], &silent).expect("usable");
        let column = |name: &str, values| (name.to_owned(), values);
        assert_eq!(
            whole.columns,
            [
                column("time_s", numbers(&[0.0, 1.0])),
                column("segment", texts(&["A", "B"])),
                column("Temp °C", numbers(&[20.0, 21.0])),
                column("note", texts(&["über", "x"])),
            ]
        );
        let told = [
            "a.csv: line 1: not UTF-8: read as Latin-1",
            "a.csv: line 2: units instead of numbers; the row is left out",
        ];
        assert_eq!(losses.describe("a.csv"), told);
        let (_, losses) = from_bytes("a.csv", b"t,note\n1,\xfc\n".to_vec(), &[], &[], &silent).expect("usable");
        assert_eq!(losses.describe("a.csv"), ["a.csv: line 1: not UTF-8: read as Latin-1"]);
    }

    #[test]
    fn text_far_down_is_found() {
        let rows: String = (0..3000).map(|n| format!("{n},{}\n", if n == 2500 { "late" } else { "7" })).collect();
        let (whole, losses) = whole(&format!("time_s,mark\n{rows}"), &[]).expect("usable");
        let Values::Texts(marks) = &whole.columns[1].1 else { panic!("numbers") };
        assert_eq!((&*marks[2499], &*marks[2500], losses.found), ("7", "late", 0));
    }

    #[test]
    fn mapped_columns_take_the_place_of_theirs() {
        let (mapped, _) =
            whole("t,f,x\n1000,2,3\n", &["time_s=t:0.001", "x=f:2", "drag_force_n=f:10:1"]).expect("usable");
        let names: Vec<_> = mapped.columns.iter().map(|(name, _)| &**name).collect();
        assert_eq!(names, ["time_s", "x", "drag_force_n"]);
        assert_eq!(mapped.columns[2].1, numbers(&[21.0]));
        assert_eq!(
            whole("t,f\n1,2\n", &["x=g"]).expect_err("refused").to_string(),
            "a.csv: line 1: no column g; the header row has: t, f (asked for by --column x=g:...)"
        );
        assert_eq!(
            whole("t,t\n1,2\n", &[]).expect_err("refused").to_string(),
            "a.csv: line 1: column t is there twice (columns 1 and 2); name the one that is not meant differently"
        );
        assert_eq!(
            whole("t,f\n", &[]).expect_err("refused").to_string(),
            "a.csv: 0 usable rows of 0 rows, at least 1 are needed"
        );
    }
}
