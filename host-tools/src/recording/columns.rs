//! Columns as requested and as read from a file of any kind.

use super::{Losses, Mapping, Place, Selection, Unusable};

/// What an empty or a spoilt cell of a column costs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Need {
    /// Either costs the row.
    Everywhere,
    /// An empty cell is not measured; a spoilt one costs the row.
    Sound,
    /// Either is not measured.
    Anything,
}

/// A column that is asked for.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    /// Its name here.
    pub(super) name: String,
    /// Its place among the columns of the file.
    pub(super) place: usize,
    /// `value = cell·scale + offset`
    pub(super) scale: f64,
    /// See `scale`.
    pub(super) offset: f64,
    /// What its empty and spoilt cells cost.
    pub(super) need: Need,
    /// Whether only whole numbers mean something.
    pub(super) whole: bool,
    /// Its name in messages: with that of the file where they differ.
    pub(super) told: String,
}

impl Wanted {
    /// A column as it stands in the file.
    pub(super) fn plain(name: String, place: usize, need: Need) -> Self {
        Wanted { told: name.clone(), name, place, scale: 1.0, offset: 0.0, need, whole: false }
    }

    /// The value for a cell; without a mapping it is unchanged to the last bit.
    #[inline]
    pub(super) fn value(&self, cell: f64) -> f64 {
        if self.scale == 1.0 && self.offset == 0.0 { cell } else { cell * self.scale + self.offset }
    }
}

/// The names of the columns that a file has.
#[derive(Clone, Debug)]
pub(super) struct Header {
    /// The file.
    pub(super) file: String,
    /// Their names, in its order.
    pub(super) names: Vec<String>,
    /// Line of the header row; `None` where the file has no lines.
    pub(super) line: Option<u64>,
}

impl Header {
    fn place(&self) -> String {
        self.line.map_or_else(String::new, |line| format!("line {line}: "))
    }

    fn told(&self) -> String {
        let what = if self.line.is_some() { "the header row has" } else { "the file has" };
        // a file of something else may have thousands
        let more = match self.names.len().saturating_sub(50) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!("{what}: {}{more}", self.names[..self.names.len().min(50)].join(", "))
    }

    /// Where a column stands.
    ///
    /// # Errors
    /// [`Unusable::DuplicateColumn`] when it stands twice.
    pub(super) fn find(&self, name: &str) -> Result<Option<usize>, Unusable> {
        let mut places = self.names.iter().enumerate().filter(|(_, n)| *n == name).map(|(place, _)| place);
        match (places.next(), places.next()) {
            (Some(first), Some(second)) => Err(Unusable::DuplicateColumn {
                file: self.file.clone(),
                place: self.place(),
                column: name.to_owned(),
                first: first + 1,
                second: second + 1,
            }),
            (place, _) => Ok(place),
        }
    }

    /// A column that is not there.
    pub(super) fn missing(&self, column: &str, advice: &str) -> Unusable {
        let is_meant = |name: &&String| name.eq_ignore_ascii_case(column);
        let meant =
            self.names.iter().find(is_meant).map(|name| format!("; did you mean {name}? --column {column}={name}"));
        let advice = meant.as_deref().unwrap_or(advice);
        Unusable::MissingColumn {
            file: self.file.clone(),
            place: self.place(),
            column: column.to_owned(),
            found: self.told() + advice,
        }
    }

    /// The column that is to be read as `name`, mapped or by its own name; `None` when there is none.
    ///
    /// # Errors
    /// [`Unusable`] when a mapping names a column that is not there and needed, or a name stands twice.
    pub(super) fn wanted(&self, name: &str, need: Need, mappings: &[Mapping]) -> Result<Option<Wanted>, Unusable> {
        let Some(mapping) = mappings.iter().find(|mapping| mapping.name == name) else {
            return Ok(self.find(name)?.map(|place| Wanted::plain(name.to_owned(), place, need)));
        };
        let column = &mapping.column;
        let place = match self.find(column)? {
            Some(place) => place,
            None if !mapping.is_needed => return Ok(None),
            None => return Err(self.missing(column, &format!(" (asked for by --column {name}={column}:...)"))),
        };
        Ok(Some(Wanted {
            name: name.to_owned(),
            place,
            scale: mapping.scale,
            offset: mapping.offset,
            need,
            whole: false,
            told: if name == column { name.to_owned() } else { format!("{name} (from {column})") },
        }))
    }

    /// Where the columns of selections stand.
    ///
    /// # Errors
    /// [`Unusable`] when one is not there, or there twice.
    pub(super) fn selected(&self, selections: &[Selection]) -> Result<Vec<usize>, Unusable> {
        let place = |selection: &Selection| {
            let advice = format!(" (asked for by --where {}={})", selection.column, selection.value);
            self.find(&selection.column)?.ok_or_else(|| self.missing(&selection.column, &advice))
        };
        selections.iter().map(place).collect()
    }
}

/// Mappings that all give something of `known`, each once.
///
/// # Errors
/// [`Unusable::UnknownName`] and [`Unusable::MappedTwice`].
pub(super) fn check_mappings(mappings: &[Mapping], known: &[&str]) -> Result<(), Unusable> {
    match mappings.iter().find(|mapping| !known.contains(&&*mapping.name)) {
        Some(unknown) => Err(Unusable::UnknownName { column: unknown.name.clone(), known: known.join(", ") }),
        None => check_once(mappings),
    }
}

/// Mappings that each give another column.
///
/// # Errors
/// [`Unusable::MappedTwice`].
pub(super) fn check_once(mappings: &[Mapping]) -> Result<(), Unusable> {
    for (n, mapping) in mappings.iter().enumerate() {
        if mappings[..n].iter().any(|before| before.name == mapping.name) {
            return Err(Unusable::MappedTwice { column: mapping.name.clone() });
        }
    }
    Ok(())
}

/// Numbers of the columns that were asked for, in that order; NaN where a cell was not measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbers {
    /// The columns, all of one length.
    pub(super) columns: Vec<Vec<f64>>,
    /// Where the rows stood in the file.
    pub(super) places: Places,
    /// What could not be used.
    pub(super) losses: Losses,
    /// For every column, how many cells of used rows were spoilt and count as not measured.
    pub(super) spoilt: Vec<u64>,
}

/// Where rows stood in a file: row and line rise together except where a line was left out, and only those are kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Places {
    /// A row and its line; the lines go on one by one until the next entry.
    steps: Vec<(usize, u64)>,
    next: (usize, u64),
    /// Whether they are rows of a table without lines.
    pub(super) are_rows: bool,
}

impl Places {
    /// The next row stands in this line.
    #[inline]
    pub(super) fn push(&mut self, line: u64) {
        if self.steps.is_empty() || line != self.next.1 {
            self.steps.push((self.next.0, line));
        }
        self.next = (self.next.0 + 1, line + 1);
    }

    /// Adds the places of a later piece of the file, whose lines were counted from `line`.
    pub(super) fn append(&mut self, later: &Places, line: u64) {
        for (n, (row, first)) in later.steps.iter().enumerate() {
            let end = later.steps.get(n + 1).map_or(later.next.0, |(row, _)| *row);
            self.push(first + line);
            self.next.0 += end - row - 1;
            self.next.1 += (end - row - 1) as u64;
        }
    }

    /// So many rows of a table without lines.
    pub(super) fn rows(rows: usize) -> Self {
        Places { steps: vec![(0, 1)], next: (rows, rows as u64 + 1), are_rows: true }
    }

    /// The places of some of the rows.
    pub(super) fn keep(&self, is_kept: &[bool]) -> Places {
        let mut places = Places { are_rows: self.are_rows, ..Places::default() };
        for row in (0..is_kept.len()).filter(|row| is_kept[*row]) {
            places.push(self.line(row));
        }
        places
    }

    /// How many rows there are.
    pub(super) fn len(&self) -> usize {
        self.next.0
    }

    /// Line of a row.
    pub(super) fn line(&self, row: usize) -> u64 {
        let step = self.steps.partition_point(|(first, _)| *first <= row).saturating_sub(1);
        self.steps.get(step).map_or(0, |(first, line)| line + (row - first) as u64)
    }

    /// Where a row stood.
    pub(super) fn place(&self, row: usize) -> Place {
        let at = self.line(row);
        if self.are_rows { Place::Row(at) } else { Place::Line(at) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_know_every_line_and_join() {
        let lines = [2u64, 3, 4, 7, 8, 20, 22, 23];
        for cut in 0..=lines.len() {
            let (mut first, mut second) = (Places::default(), Places::default());
            lines[..cut].iter().for_each(|line| first.push(*line));
            lines[cut..].iter().for_each(|line| second.push(*line - 2));
            first.append(&second, 2);
            assert_eq!((0..lines.len()).map(|row| first.line(row)).collect::<Vec<_>>(), lines, "{cut}");
            let mut whole = Places::default();
            lines.iter().for_each(|line| whole.push(*line));
            assert_eq!(first, whole, "{cut}");
        }
    }
}
