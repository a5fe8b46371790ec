//! Columns of numbers from a text file, by several threads.
//!
//! The file is cut at line ends into pieces, one a thread. A row of plain numbers is read in one go, cell after cell;
//! any row that is not that (quotes, an empty cell where one is needed, something that is no number, too few cells)
//! is read again by the slow path, which reports its faults. Both give the same numbers: those of the nearest `f64`.
//! The result does not depend on the number of pieces.

use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};

use memchr::{memchr, memchr_iter, memchr2, memrchr};

use super::cell::{cells, is_measurable, is_whole, plain, told, value};
use super::columns::{Header, Need, Numbers, Places, Wanted};
use super::dialect::{Dialect, Opening, opening};
use super::{Cost, Fault, Losses, PIECE, Place, Progress, Selection, Unusable};

/// Lines between two calls of the progress.
const PROGRESS_LINES: u64 = 1 << 15;

/// Reads the columns that `choose` asks for after it has seen the header row.
///
/// # Errors
/// [`Unusable`] when it is no text with a header row, what `choose` refuses, or no row is a selected one.
pub(super) fn read(
    file: &str,
    bytes: impl AsRef<[u8]>,
    choose: impl FnOnce(&Header) -> Result<Vec<Wanted>, Unusable>,
    selections: &[Selection],
    progress: Progress,
) -> Result<(Vec<Wanted>, Numbers), Unusable> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    read_in(file, bytes, choose, selections, progress, |length| threads.min(length / PIECE))
}

/// The same in a number of pieces that follows from the length.
pub(super) fn read_in(
    file: &str,
    bytes: impl AsRef<[u8]>,
    choose: impl FnOnce(&Header) -> Result<Vec<Wanted>, Unusable>,
    selections: &[Selection],
    progress: Progress,
    pieces: impl FnOnce(usize) -> usize,
) -> Result<(Vec<Wanted>, Numbers), Unusable> {
    let text = bytes.as_ref();
    let opened = opening(file, text)?;
    let said = opened.told();
    let Opening { dialect, header, line, rows, .. } = opened;
    let wanted = choose(&header)?;
    let plan = Plan::new(&header, dialect, &wanted, selections)?;
    let (body, of) = (&text[rows..], text.len() as u64);
    let done = AtomicU64::new(rows as u64);
    let tell = |more: usize| progress(done.fetch_add(more as u64, Ordering::Relaxed) + more as u64, of);
    let pieces = cut(body, pieces(body.len()).max(1));
    let lines = at_once(pieces.clone(), &|piece| lines(&body[piece]));
    // zeroed memory is committed only where a thread writes to it
    let mut columns: Vec<Vec<f64>> = wanted.iter().map(|_| vec![0.0; lines.iter().sum()]).collect();
    let tasks = pieces.into_iter().zip(shares(&mut columns, &lines)).collect();
    let read = at_once(tasks, &|(piece, mut into)| plan.piece(body, piece, &mut into, &tell));
    if let Some(missed) = plan.nothing_selected(&header, &read, body) {
        return Err(missed);
    }
    drop(bytes);
    let mut numbers = join(read, columns, &lines, line);
    numbers.losses.absorb(said);
    Ok((wanted, numbers))
}

/// Cuts at line ends.
fn cut(body: &[u8], pieces: usize) -> Vec<Range<usize>> {
    let mut cuts = vec![0];
    for n in 1..pieces {
        let from = (body.len() / pieces * n).max(cuts.last().copied().unwrap_or(0));
        cuts.push(memchr(b'\n', &body[from..]).map_or(body.len(), |end| from + end + 1));
    }
    cuts.push(body.len());
    cuts.windows(2).map(|w| w[0]..w[1]).collect()
}

/// Does every task on a thread of its own, the first on this one.
fn at_once<T: Send, R: Send>(tasks: Vec<T>, work: &(impl Fn(T) -> R + Sync)) -> Vec<R> {
    std::thread::scope(|scope| {
        let mut tasks = tasks.into_iter();
        let first = tasks.next();
        let others: Vec<_> = tasks.map(|task| scope.spawn(move || work(task))).collect();
        let first = first.map(work);
        let others = others.into_iter().map(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic)));
        first.into_iter().chain(others).collect()
    })
}

/// Lines of a text; the last one may lack its end.
fn lines(text: &[u8]) -> usize {
    memchr_iter(b'\n', text).count() + usize::from(text.last().is_some_and(|byte| *byte != b'\n'))
}

/// For each piece, the rows of every column that it may fill: as many as it has lines.
fn shares<'a>(columns: &'a mut [Vec<f64>], lines: &[usize]) -> Vec<Vec<&'a mut [f64]>> {
    let mut shares: Vec<Vec<_>> = lines.iter().map(|_| Vec::new()).collect();
    for column in columns {
        let mut rest = &mut column[..];
        for (share, lines) in shares.iter_mut().zip(lines) {
            let (own, others) = rest.split_at_mut(*lines);
            share.push(own);
            rest = others;
        }
    }
    shares
}

/// Results of one thread beside the numbers. Lines are counted from 0 at the start of its piece.
struct Piece {
    places: Places,
    lines: u64,
    losses: Losses,
    /// spoilt cells of used rows, for every column
    spoilt: Vec<u64>,
}

/// Puts pieces together, each of which could have filled as many rows as it has `lines`; the header stands in `line`.
fn join(pieces: Vec<Piece>, mut columns: Vec<Vec<f64>>, lines: &[usize], line: u64) -> Numbers {
    let (mut from, mut to) = (0, 0);
    for (piece, lines) in pieces.iter().zip(lines) {
        let rows = piece.places.len();
        if from != to {
            columns.iter_mut().for_each(|column| column.copy_within(from..from + rows, to));
        }
        (from, to) = (from + lines, to + rows);
    }
    for column in &mut columns {
        column.truncate(to);
        column.shrink_to_fit();
    }
    let mut numbers =
        Numbers { spoilt: vec![0; columns.len()], columns, places: Places::default(), losses: Losses::default() };
    let mut first = line + 1;
    for mut piece in pieces {
        for problem in &mut piece.losses.problems {
            if let Place::Line(line) = &mut problem.place {
                *line += first;
            }
        }
        numbers.losses.absorb(piece.losses);
        numbers.spoilt.iter_mut().zip(&piece.spoilt).for_each(|(all, spoilt)| *all += spoilt);
        numbers.places.append(&piece.places, first);
        first += piece.lines;
    }
    numbers
}

/// Result of the fast path for a row.
enum Row {
    /// Numbers, and how many bytes of the file.
    Plain(usize),
    /// Not asked for, and how many bytes.
    Other(usize),
    /// Something for the slow path.
    Odd,
}

/// What is to be done with one cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    /// Which number it is.
    source: Option<usize>,
    /// Whether rows are chosen by it.
    chooses: bool,
}

/// How rows are read.
struct Plan<'a> {
    dialect: Dialect,
    cells: Vec<Cell>,
    /// which number each wanted column is made from
    sources: Vec<usize>,
    /// how many numbers there are
    numbers: usize,
    wanted: &'a [Wanted],
    selections: &'a [Selection],
    /// where the columns of `selections` stand
    selected: Vec<usize>,
}

impl<'a> Plan<'a> {
    fn new(
        header: &Header,
        dialect: Dialect,
        wanted: &'a [Wanted],
        selections: &'a [Selection],
    ) -> Result<Self, Unusable> {
        let mut cells = vec![Cell::default(); header.names.len()];
        let (mut sources, mut numbers) = (Vec::new(), 0);
        for wanted in wanted {
            // two columns may be made from one
            let source = *cells[wanted.place].source.get_or_insert(numbers);
            numbers = numbers.max(source + 1);
            sources.push(source);
        }
        let selected = header.selected(selections)?;
        for place in &selected {
            cells[*place].chooses = true;
        }
        Ok(Plan { dialect, cells, sources, numbers, wanted, selections, selected })
    }

    /// Reads a piece of the rows into its share of the columns.
    fn piece(
        &self,
        body: &[u8],
        piece: Range<usize>,
        into: &mut [&mut [f64]],
        tell: &(impl Fn(usize) + Sync),
    ) -> Piece {
        let (begin, text) = (piece.start, &body[piece]);
        let mut piece = Piece {
            places: Places::default(),
            lines: 0,
            losses: Losses::default(),
            spoilt: vec![0; self.wanted.len()],
        };
        let mut numbers = vec![0.0; self.numbers];
        let mut points = Vec::new();
        let (mut at, mut told) = (0, 0);
        while at < text.len() {
            let rest = &text[at..];
            let row = if self.dialect.comma {
                self.fast_comma(rest, &mut points, &mut numbers)
            } else {
                self.fast(rest, &mut numbers)
            };
            at += match row {
                Row::Plain(bytes) => {
                    let row = piece.places.len();
                    for ((wanted, source), column) in self.wanted.iter().zip(&self.sources).zip(&mut *into) {
                        column[row] = wanted.value(numbers[*source]);
                    }
                    piece.places.push(piece.lines);
                    piece.losses.rows += 1;
                    bytes
                }
                Row::Other(bytes) => bytes,
                Row::Odd => {
                    let end = memchr(b'\n', rest);
                    let bytes = end.unwrap_or(rest.len());
                    self.slow(&rest[..bytes], end.is_none().then(|| above(body, begin + at)), into, &mut piece);
                    bytes + usize::from(end.is_some())
                }
            };
            piece.lines += 1;
            if piece.lines.is_multiple_of(PROGRESS_LINES) {
                tell(at - told);
                told = at;
            }
        }
        tell(at - told);
        piece
    }

    /// A row of plain numbers.
    fn fast(&self, text: &[u8], numbers: &mut [f64]) -> Row {
        let separator = self.dialect.separator;
        let last = self.cells.len() - 1;
        let mut at = 0;
        let mut is_other = false;
        for (n, cell) in self.cells.iter().enumerate() {
            while text.get(at) == Some(&b' ') {
                at += 1;
            }
            let start = at;
            match cell.source {
                Some(source) => {
                    let is_quoted = text.get(at) == Some(&b'"') && !cell.chooses;
                    at += usize::from(is_quoted);
                    let (number, bytes) = plain(&text[at..]).unwrap_or((f64::NAN, 0));
                    numbers[source] = number;
                    at += bytes;
                    if is_quoted && text.get(at) != Some(&b'"') {
                        return Row::Odd;
                    }
                    at += usize::from(is_quoted);
                }
                None if text.get(at) == Some(&b'"') => return Row::Odd,
                None => match memchr2(separator, b'\n', &text[at..]) {
                    Some(bytes) => at += bytes,
                    None => return Row::Odd,
                },
            }
            // an empty cell, blanks and a carriage return may stand before the separator, nothing else
            while matches!(text.get(at), Some(b' ' | b'\r')) {
                at += 1;
            }
            let end = if n == last { b'\n' } else { separator };
            if text.get(at) != Some(&end) {
                return Row::Odd;
            }
            if cell.chooses {
                let cell = &text[start..at];
                let chosen = |(selection, place): (&Selection, &usize)| *place != n || selection.takes(cell);
                is_other |= !self.selections.iter().zip(&self.selected).all(chosen);
            }
            at += 1;
        }
        if is_other {
            return Row::Other(at);
        }
        for (wanted, source) in self.wanted.iter().zip(&self.sources) {
            let value = wanted.value(numbers[*source]);
            let is_sound = if value.is_nan() {
                wanted.need != Need::Everywhere
            } else {
                is_measurable(value) && (!wanted.whole || is_whole(value))
            };
            if !is_sound {
                return Row::Odd;
            }
        }
        Row::Plain(at)
    }

    /// The same where the decimal mark is the comma: a copy of the line has points.
    fn fast_comma(&self, text: &[u8], points: &mut Vec<u8>, numbers: &mut [f64]) -> Row {
        let Some(end) = memchr(b'\n', text) else { return Row::Odd };
        points.clear();
        points.extend(text[..=end].iter().map(point));
        self.fast(points, numbers)
    }

    /// A row that is not plain. `above` is the line before it where this one has no line end.
    fn slow(&self, line: &[u8], above: Option<&[u8]>, into: &mut [&mut [f64]], piece: &mut Piece) {
        let text = line.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            return;
        }
        let separator = self.dialect.separator;
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let cells = cells(line, separator);
        let chosen = |(selection, place): (&Selection, &usize)| {
            cells.get(*place).is_none_or(|cell| match self.dialect.comma {
                true => selection.takes(&with_points(cell)),
                false => selection.takes(cell),
            })
        };
        if !self.selections.iter().zip(&self.selected).all(chosen) {
            return;
        }
        piece.losses.rows += 1;
        let place = Place::Line(piece.lines);
        let (found, expected) = (cells.len(), self.cells.len());
        if found < expected {
            let fault = match above {
                Some(_) => Fault::CutOff { found, expected },
                None if memchr(0, line).is_some() => Fault::ZeroBytes,
                None => Fault::ShortLine { found, expected },
            };
            return piece.losses.reject(place, None, fault);
        }
        if cells[expected..].iter().any(|cell| !cell.trim_ascii().is_empty()) {
            return piece.losses.reject(place, None, Fault::LongLine { found, expected });
        }
        let mut row = Vec::with_capacity(self.wanted.len());
        for (wanted, spoilt) in self.wanted.iter().zip(&mut piece.spoilt) {
            match value(&cells[wanted.place], self.dialect.comma, wanted) {
                Ok(value) => row.push(value),
                Err(fault) if wanted.need == Need::Anything => {
                    *spoilt += 1;
                    piece.losses.note(place, Some(&wanted.told), fault, Cost::Cell);
                    row.push(f64::NAN);
                }
                Err(fault) => return piece.losses.reject(place, Some(&wanted.told), fault),
            }
        }
        if let Some(fault) = above.and_then(|above| self.cut_cell(&cells, above)) {
            let column = self.wanted.iter().find(|wanted| wanted.place + 1 == expected);
            return piece.losses.reject(place, column.map(|wanted| &*wanted.told), fault);
        }
        for (column, value) in into.iter_mut().zip(row) {
            column[piece.places.len()] = value;
        }
        piece.places.push(piece.lines);
    }

    /// Whether the last cell of a line without an end has lost digits: it is used, and shorter than the one above.
    fn cut_cell(&self, row: &[std::borrow::Cow<'_, [u8]>], above: &[u8]) -> Option<Fault> {
        let last = self.cells.len() - 1;
        self.cells[last].source?;
        let cell = row[last].trim_ascii();
        let above = cells(above.strip_suffix(b"\r").unwrap_or(above), self.dialect.separator);
        let is_cut = above.len() == row.len() && cell.len() < above[last].trim_ascii().len();
        is_cut.then(|| Fault::CutCell { cell: told(cell) })
    }

    /// Why no row was a selected one, where that is so.
    fn nothing_selected(&self, header: &Header, read: &[Piece], body: &[u8]) -> Option<Unusable> {
        if self.selections.is_empty() || read.iter().any(|piece| piece.losses.rows > 0) {
            return None;
        }
        let values = |place: usize| {
            let mut seen: Vec<String> = Vec::new();
            for line in body.split(|byte| *byte == b'\n') {
                if let Some(cell) = cells(line, self.dialect.separator).get(place)
                    && seen.len() <= 8
                    && !seen.iter().any(|value| value.as_bytes() == cell.trim_ascii())
                {
                    seen.push(told(cell.trim_ascii()));
                }
            }
            let more = if seen.len() > 8 { ", ..." } else { "" };
            seen.truncate(8);
            format!("column {} has: {}{more}", header.names[place], seen.join(", "))
        };
        let wanted: Vec<_> = self.selections.iter().map(ToString::to_string).collect();
        Some(Unusable::NoSuchRow {
            file: header.file.clone(),
            wanted: wanted.join(" and "),
            found: self.selected.iter().map(|place| values(*place)).collect::<Vec<_>>().join("; "),
        })
    }
}

fn point(byte: &u8) -> u8 {
    if *byte == b',' { b'.' } else { *byte }
}

fn with_points(cell: &[u8]) -> Vec<u8> {
    cell.iter().map(point).collect()
}

/// The line before the one that starts at `at`; empty for the first one.
fn above(text: &[u8], at: usize) -> &[u8] {
    let before = &text[..at.saturating_sub(1)];
    &before[memrchr(b'\n', before).map_or(0, |end| end + 1)..]
}

#[cfg(test)]
mod tests {
    use super::super::silent;
    use super::*;

    /// Random numbers that are the same in every run (Marsaglia's xorshift).
    struct Random(u64);

    impl Random {
        fn below(&mut self, end: u64) -> u64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) % end
        }

        fn one_of<'a>(&mut self, list: &[&'a str]) -> &'a str {
            list[self.below(list.len() as u64) as usize]
        }

        /// A number as programs write them, or the like of it.
        fn cell(&mut self) -> String {
            let (a, b) = (self.below(10_000), self.below(1_000_000));
            match self.below(40) {
                0 => self
                    .one_of(&["", " ", "-", ".", "+", "e5", "1e", "nan", "-inf", "1.5.2", "0x10", "1 2", "\0", "é"])
                    .to_owned(),
                1 => self
                    .one_of(&["1.", ".5", "+3", "1e5", "-1E-3", "00012", "1e400", "-0", "1_000", " 7 ", "\t8"])
                    .to_owned(),
                2 => format!("{a}{b}{b}{b}.{b}"),
                3 => format!("0.{:030}{a}", 0),
                4 => format!("{a}.{b}{b:06}{b:06}{b:06}"),
                5 => format!("{a}.{b}e-{}", self.below(330)),
                6 => format!("\"{a}.{b}\""),
                7 => format!("9007199254740{:03}", self.below(1000)),
                8..20 => a.to_string(),
                _ => format!("{}{a}.{b}", self.one_of(&["", "-"])),
            }
        }

        /// A file with all kinds of damage.
        fn file(&mut self, separator: &str) -> String {
            let mut text = ["a", "note", "b", "c", "d"].join(separator) + "\n";
            for _ in 0..3 + self.below(400) {
                let mut cells = vec![
                    self.cell(),
                    self.one_of(&["x", "", "y z", "\"p,q;r\"", "\"open", "ß", "1"]).to_owned(),
                    self.cell(),
                    self.below(4).to_string(),
                    self.cell(),
                ];
                match self.below(60) {
                    0 => cells.truncate(self.below(5) as usize),
                    1 => cells.push(self.one_of(&["", " ", "1"]).to_owned()),
                    2 => cells = vec!["# a comment".to_owned()],
                    _ => {}
                }
                text += &cells.join(separator);
                text += self.one_of(&["\n", "\n", "\n", "\r\n", " \n"]);
            }
            for _ in 0..self.below(3) {
                text.pop();
            }
            text
        }
    }

    fn choose(header: &Header) -> Result<Vec<Wanted>, Unusable> {
        let column = |name: &str, place, need| Wanted::plain(name.to_owned(), place, need);
        assert_eq!(header.names.len(), 5);
        Ok(vec![
            column("a", 0, Need::Everywhere),
            Wanted { scale: 1000.0, offset: -1.0, ..column("b", 2, Need::Anything) },
            Wanted { whole: true, ..column("c", 3, Need::Sound) },
            column("d", 4, Need::Sound),
            Wanted { whole: true, ..column("again", 0, Need::Anything) },
        ])
    }

    /// Everything that comes out, in a form in which NaN is equal to NaN.
    fn outcome(numbers: Result<Numbers, Unusable>) -> String {
        match numbers {
            Ok(Numbers { columns, places, losses, spoilt }) => {
                let bits: Vec<Vec<u64>> = columns.iter().map(|c| c.iter().map(|v| v.to_bits()).collect()).collect();
                format!("{bits:?} {places:?} {losses:?} {spoilt:?}")
            }
            Err(why) => why.to_string(),
        }
    }

    /// The same file with every line read by the slow path.
    fn slowly(text: &str, selections: &[Selection]) -> Result<Numbers, Unusable> {
        let opened = opening("a.csv", text.as_bytes())?;
        let said = opened.told();
        let Opening { dialect, header, line, rows, .. } = opened;
        let wanted = choose(&header)?;
        let plan = Plan::new(&header, dialect, &wanted, selections)?;
        let (body, mut at) = (&text.as_bytes()[rows..], 0);
        let all = [lines(body)];
        let mut columns = vec![vec![0.0; all[0]]; wanted.len()];
        let mut into: Vec<_> = columns.iter_mut().map(|column| &mut column[..]).collect();
        let mut piece = plan.piece(b"", 0..0, &mut into, &|_| {});
        while at < body.len() {
            let end = memchr(b'\n', &body[at..]);
            let line = &body[at..end.map_or(body.len(), |end| at + end)];
            plan.slow(line, end.is_none().then(|| above(body, at)), &mut into, &mut piece);
            piece.lines += 1;
            at += line.len() + 1;
        }
        if let Some(missed) = plan.nothing_selected(&header, std::slice::from_ref(&piece), body) {
            return Err(missed);
        }
        let mut numbers = join(vec![piece], columns, &all, line);
        numbers.losses.absorb(said);
        Ok(numbers)
    }

    #[test]
    fn the_fast_path_the_slow_path_and_any_number_of_pieces_agree() {
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let (mut rows, mut lost, mut refused) = (0, 0, 0);
        for n in 0..600 {
            let mut text = random.file([",", ";", "\t"][n % 3]);
            if n % 5 == 1 {
                text = text.replace('.', ",");
            }
            let selections: Vec<Selection> = match n % 4 {
                0 => vec!["c=2".parse().expect("sound")],
                _ => Vec::new(),
            };
            let slow = slowly(&text, &selections);
            match &slow {
                Ok(numbers) => (rows, lost) = (rows + numbers.losses.rows, lost + numbers.losses.lost),
                Err(_) => refused += 1,
            }
            let slow = outcome(slow);
            for pieces in [1, 2, 3, 7, 50] {
                let fast =
                    read_in("a.csv", &text, choose, &selections, &silent, |_| pieces).map(|(_, numbers)| numbers);
                assert_eq!(outcome(fast), slow, "file {n} in {pieces} pieces:\n{text}");
            }
        }
        // the test would be empty if the files were all sound, or none was
        assert!(rows > 50_000 && lost > rows / 20 && lost < rows / 2 && refused < 100, "{rows} {lost} {refused}");
    }

    #[test]
    fn progress_ends_at_the_end() {
        let text: String = std::iter::once("a,note,b,c,d\n".to_owned())
            .chain((0..100_000).map(|n| format!("{n},x,1,2,3\n")))
            .collect();
        let seen = std::sync::Mutex::new(Vec::new());
        let tell = |done, of| seen.lock().expect("sound").push((done, of));
        read_in("a.csv", &text, choose, &[], &tell, |_| 2).expect("usable");
        let mut seen = seen.into_inner().expect("sound");
        seen.sort_unstable();
        assert!(seen.len() > 3, "{seen:?}");
        assert_eq!(seen.last(), Some(&(text.len() as u64, text.len() as u64)));
    }
}
