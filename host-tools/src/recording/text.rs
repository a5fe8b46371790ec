//! Columns of numbers out of a text file, by several threads.
//!
//! The file is cut at line ends into pieces, one a thread. A row of plain numbers is read in one go, cell after cell;
//! any row that is not that (quotes, an empty cell where one is needed, something that is no number, too few cells)
//! is looked at again by the slow path, which knows what to say. Both give the same numbers: those of the nearest
//! `f64`. What comes out does not depend on the number of pieces.

use std::sync::atomic::{AtomicU64, Ordering};

use memchr::{memchr, memchr_iter, memchr2, memrchr};

use super::columns::{Header, Need, Numbers, Places, Wanted, number, told};
use super::dialect::{Dialect, Opening, cells, opening};
use super::{Cost, Fault, Losses, Place, Progress, Selection, Unusable};

/// Below this a second thread costs more than it saves, bytes.
const PIECE: usize = 1 << 20;

/// Lines between two calls of the progress.
const PROGRESS_LINES: u64 = 1 << 15;

/// Reads the columns that `choose` asks for after it has seen the header row.
///
/// # Errors
/// [`Unusable`] when it is no text with a header row, what `choose` refuses, or no row is a selected one.
pub(super) fn read(
    file: &str,
    bytes: Vec<u8>,
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
    bytes: Vec<u8>,
    choose: impl FnOnce(&Header) -> Result<Vec<Wanted>, Unusable>,
    selections: &[Selection],
    progress: Progress,
    pieces: impl FnOnce(usize) -> usize,
) -> Result<(Vec<Wanted>, Numbers), Unusable> {
    let Opening { dialect, header, line, rows } = opening(file, &bytes)?;
    let wanted = choose(&header)?;
    let plan = Plan::new(&header, dialect, &wanted, selections)?;
    let body = &bytes[rows..];
    let done = AtomicU64::new(rows as u64);
    let tell = |more: usize| progress(done.fetch_add(more as u64, Ordering::Relaxed) + more as u64, bytes.len() as u64);
    let pieces = cut(body, pieces(body.len()).max(1));
    let read: Vec<Piece> = std::thread::scope(|scope| {
        let (first, others) = pieces.split_first().map_or((None, &[][..]), |(first, others)| (Some(first), others));
        let (plan, tell) = (&plan, &tell);
        let others: Vec<_> = others.iter().map(|piece| scope.spawn(move || plan.piece(piece, tell))).collect();
        let first = first.map(|piece| plan.piece(piece, tell));
        first
            .into_iter()
            .chain(others.into_iter().map(|other| match other.join() {
                Ok(piece) => piece,
                Err(panic) => std::panic::resume_unwind(panic),
            }))
            .collect()
    });
    if let Some(missed) = plan.nothing_selected(&header, &read, body) {
        return Err(missed);
    }
    drop(bytes);
    let mut numbers = join(read, wanted.len(), line);
    if let Some(fault) = dialect.told() {
        let mut said = Losses::default();
        said.note(Place::Line(line), None, fault, Cost::AsSaid);
        numbers.losses.absorb(said);
    }
    Ok((wanted, numbers))
}

/// Cuts at line ends.
fn cut(body: &[u8], pieces: usize) -> Vec<&[u8]> {
    let mut cuts = vec![0];
    for n in 1..pieces {
        let from = (body.len() / pieces * n).max(cuts.last().copied().unwrap_or(0));
        cuts.push(memchr(b'\n', &body[from..]).map_or(body.len(), |end| from + end + 1));
    }
    cuts.push(body.len());
    cuts.windows(2).map(|w| &body[w[0]..w[1]]).collect()
}

/// What one thread has read. Lines are counted from 0 at the start of its piece.
struct Piece {
    columns: Vec<Vec<f64>>,
    places: Places,
    lines: u64,
    losses: Losses,
}

/// Puts pieces together; the header stands in `line`.
fn join(pieces: Vec<Piece>, width: usize, line: u64) -> Numbers {
    let mut numbers = Numbers { columns: Vec::new(), places: Places::default(), losses: Losses::default() };
    let mut first = line + 1;
    let mut parts: Vec<Vec<Vec<f64>>> = (0..width).map(|_| Vec::new()).collect();
    for mut piece in pieces {
        for problem in &mut piece.losses.problems {
            if let Place::Line(line) = &mut problem.place {
                *line += first;
            }
        }
        numbers.losses.absorb(piece.losses);
        numbers.places.append(&piece.places, first);
        first += piece.lines;
        for (part, column) in parts.iter_mut().zip(piece.columns) {
            part.push(column);
        }
    }
    // column after column, so that only one is there twice
    numbers.columns = parts
        .into_iter()
        .map(|part| {
            let rows: usize = part.iter().map(Vec::len).sum();
            let mut part = part.into_iter();
            let mut whole = part.next().unwrap_or_default();
            whole.reserve_exact(rows - whole.len());
            part.for_each(|more| whole.extend_from_slice(&more));
            whole.shrink_to_fit();
            whole
        })
        .collect();
    numbers
}

/// What a row is to the fast path.
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

    fn piece(&self, text: &[u8], tell: &(impl Fn(usize) + Sync)) -> Piece {
        // memory that is reserved and never touched costs nothing; growing costs a copy
        let start = &text[..text.len().min(PIECE / 16)];
        let rows = memchr_iter(b'\n', start).count() * (text.len() / start.len().max(1) + 1);
        let rows = (rows + rows / 16).min(text.len() / self.cells.len()) + 1;
        let mut piece = Piece {
            columns: self.wanted.iter().map(|_| Vec::with_capacity(rows)).collect(),
            places: Places::default(),
            lines: 0,
            losses: Losses::default(),
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
                    for ((wanted, source), column) in self.wanted.iter().zip(&self.sources).zip(&mut piece.columns) {
                        column.push(wanted.value(numbers[*source]));
                    }
                    piece.places.push(piece.lines);
                    piece.losses.rows += 1;
                    bytes
                }
                Row::Other(bytes) => bytes,
                Row::Odd => {
                    let end = memchr(b'\n', rest);
                    let bytes = end.unwrap_or(rest.len());
                    self.slow(&rest[..bytes], end.is_none().then(|| above(text, at)), &mut piece);
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
                Some(source) => match plain(&text[at..]) {
                    Some((number, bytes)) => {
                        numbers[source] = number;
                        at += bytes;
                    }
                    None => numbers[source] = f64::NAN,
                },
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
                value.is_finite() && (!wanted.whole || value.fract() == 0.0)
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
    fn slow(&self, line: &[u8], above: Option<&[u8]>, piece: &mut Piece) {
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
        for wanted in self.wanted {
            match value(&cells[wanted.place], self.dialect.comma, wanted) {
                Ok(value) => row.push(value),
                Err(fault) if wanted.need == Need::Anything => {
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
        for (column, value) in piece.columns.iter_mut().zip(row) {
            column.push(value);
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

/// The line before the one that starts at `at`; empty at the start of a piece.
fn above(text: &[u8], at: usize) -> &[u8] {
    let before = &text[..at.saturating_sub(1)];
    &before[memrchr(b'\n', before).map_or(0, |end| end + 1)..]
}

/// The value of a cell; NaN where it is empty and may be.
fn value(cell: &[u8], comma: bool, wanted: &Wanted) -> Result<f64, Fault> {
    let Some(cell_value) = number(cell, comma)? else {
        return if wanted.need == Need::Everywhere { Err(Fault::NotMeasured) } else { Ok(f64::NAN) };
    };
    let value = wanted.value(cell_value);
    if !value.is_finite() {
        return Err(Fault::NotFinite { cell: told(cell.trim_ascii()) });
    }
    if wanted.whole && value.fract() != 0.0 {
        return Err(Fault::NotWhole { cell: told(cell.trim_ascii()) });
    }
    Ok(value)
}

/// Powers of ten that `f64` holds exactly.
const TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// A finite number at the start of a text, and how many bytes it takes.
///
/// Digits that fit 53 bits over a power of ten that is exact are divided once, so the result is the nearest
/// (W. D. Clinger, How to read floating point numbers accurately, 1990); all others are left to the library.
#[inline]
fn plain(text: &[u8]) -> Option<(f64, usize)> {
    let mut at = usize::from(text.first() == Some(&b'-'));
    let (is_negative, start) = (at == 1, at);
    let mut mantissa = 0u64;
    let mut digit = |at: &mut usize| {
        let digit = text.get(*at).copied().unwrap_or(0).wrapping_sub(b'0');
        if digit < 10 {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            *at += 1;
        }
        digit < 10
    };
    while digit(&mut at) {}
    let (mut digits, mut decimals) = (at - start, 0);
    if text.get(at) == Some(&b'.') {
        at += 1;
        let point = at;
        while digit(&mut at) {}
        decimals = at - point;
        digits += decimals;
    }
    let is_short = (1..=19).contains(&digits) && mantissa <= 1 << 53;
    if is_short && !matches!(text.get(at), Some(b'e' | b'E')) {
        let number = mantissa as f64 / TENS[decimals];
        return Some((if is_negative { -number } else { number }, at));
    }
    // an empty cell is the usual reason to come here
    if digits == 0 && matches!(text.get(at), Some(b',' | b';' | b'\n' | b'\r')) {
        return None;
    }
    match fast_float2::parse_partial::<f64, _>(text) {
        Ok((number, bytes)) if number.is_finite() => Some((number, bytes)),
        _ => None,
    }
}
