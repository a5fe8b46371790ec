//! Cells of a text file: where they stand in a line, and the number that one holds.

use std::borrow::Cow;

use memchr::memchr;

use super::Fault;
use super::columns::{Need, Wanted};

/// At most this many bytes of a cell are shown in a message.
const TOLD_BYTES: usize = 40;

/// A cell as text for a message, whatever bytes it holds, shortened.
pub(super) fn told(cell: &[u8]) -> String {
    if cell.len() <= TOLD_BYTES {
        return String::from_utf8_lossy(cell).into_owned();
    }
    String::from_utf8_lossy(&cell[..TOLD_BYTES]).into_owned() + "..."
}

/// Bytes as text: UTF-8, else Latin-1, in which every byte is a character.
pub(super) fn decoded(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().copied().map(char::from).collect(),
    }
}

/// A cell as a number, `None` when it is empty.
///
/// # Errors
/// [`Fault`] when it is no finite number.
pub(super) fn number(cell: &[u8], comma: bool) -> Result<Option<f64>, Fault> {
    let cell = cell.trim_ascii();
    if cell.is_empty() {
        return Ok(None);
    }
    if cell.contains(&0) {
        return Err(Fault::ZeroBytes);
    }
    let parsed = match std::str::from_utf8(cell) {
        Ok(text) if comma && text.contains(',') => text.replace(',', ".").parse::<f64>().ok(),
        Ok(text) => text.parse::<f64>().ok(),
        Err(_) => None,
    };
    match parsed {
        Some(number) if number.is_finite() => Ok(Some(number)),
        Some(_) => Err(Fault::NotFinite { cell: told(cell) }),
        None => Err(Fault::NotANumber { cell: told(cell) }),
    }
}

/// Largest number that a recording may hold, in any unit: nanoseconds since 1970 and every 64-bit counter are below.
const LARGEST: f64 = 1e20;

/// Whether a number may have been measured: squares of larger ones leave the range of numbers.
pub(super) fn is_measurable(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// What is wrong with a number that is not [measurable](is_measurable).
pub(super) fn immeasurable(value: f64, cell: String) -> Fault {
    if value.is_finite() { Fault::TooLarge { cell } } else { Fault::NotFinite { cell } }
}

/// Whether a number is whole and fits an `i64`.
pub(super) fn is_whole(value: f64) -> bool {
    value as i64 as f64 == value
}

/// The value of a cell; NaN where it is empty and may be.
pub(super) fn value(cell: &[u8], comma: bool, wanted: &Wanted) -> Result<f64, Fault> {
    let Some(cell_value) = number(cell, comma)? else {
        return if wanted.need == Need::Everywhere { Err(Fault::NotMeasured) } else { Ok(f64::NAN) };
    };
    let value = wanted.value(cell_value);
    if !is_measurable(value) {
        return Err(immeasurable(value, told(cell.trim_ascii())));
    }
    if wanted.whole && !is_whole(value) {
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
pub(super) fn plain(text: &[u8]) -> Option<(f64, usize)> {
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

/// The cells of a line without its line end. A quoted cell may hold the separator and, doubled, quotes, but no line
/// end: a quote that is never closed takes the rest of the line, not that of the file.
pub(super) fn cells(line: &[u8], separator: u8) -> Vec<Cow<'_, [u8]>> {
    if memchr(b'"', line).is_none() {
        return line.split(|byte| *byte == separator).map(Into::into).collect();
    }
    let mut cells = Vec::new();
    let mut rest = line;
    loop {
        let start = rest.iter().take_while(|byte| **byte == b' ').count();
        let cell = if rest.get(start) == Some(&b'"') { quoted(&mut rest, start + 1) } else { Cow::Borrowed(&b""[..]) };
        // text between a closing quote and the separator belongs to the cell, as in other readers
        let end = memchr(separator, rest).unwrap_or(rest.len());
        cells.push(match (cell.is_empty(), rest[..end].trim_ascii()) {
            (true, _) => Cow::Borrowed(&rest[..end]),
            (false, []) => cell,
            (false, more) => Cow::Owned([&cell, more].concat()),
        });
        if end == rest.len() {
            return cells;
        }
        rest = &rest[end + 1..];
    }
}

/// What stands in quotes from `start` on; leaves in `rest` what follows them.
fn quoted<'a>(rest: &mut &'a [u8], start: usize) -> Cow<'a, [u8]> {
    let (text, mut cell, mut from) = (*rest, Cow::Borrowed(&b""[..]), start);
    loop {
        let end = memchr(b'"', &text[from..]).map_or(text.len(), |end| from + end);
        match cell.is_empty() {
            true => cell = Cow::Borrowed(&text[from..end]),
            false => cell.to_mut().extend_from_slice(&text[from..end]),
        }
        if text.get(end + 1) != Some(&b'"') {
            *rest = &text[(end + 1).min(text.len())..];
            return cell;
        }
        cell.to_mut().push(b'"');
        from = end + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_numbers_are_the_nearest() {
        let mut seed = 7u64;
        let mut below = |end: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % end
        };
        for _ in 0..300_000 {
            let (a, b) = (below(10_000), below(1_000_000));
            let cell = match below(10) {
                0 => format!("{a}{b}{b}{b}.{b}"),
                1 => format!("0.{:030}{a}", 0),
                2 => format!("{a}.{b}{b:06}{b:06}{b:06}"),
                3 => format!("-{a}.{b}e-{}", below(330)),
                4 => format!("900719925474{:04}", below(10_000)),
                5 => format!("-.{b}"),
                6 => format!("{a}."),
                _ => format!("{a}.{b},7"),
            };
            let (number, bytes) = plain(cell.as_bytes()).expect("a number");
            let expected: f64 = cell[..bytes].parse().expect("a number");
            assert_eq!((number.to_bits(), bytes), (expected.to_bits(), cell.trim_end_matches(",7").len()), "{cell}");
        }
        for cell in ["", ",1", "-", ".", "nan", "inf", "1e999", "x"] {
            assert_eq!(plain(cell.as_bytes()), None, "{cell}");
        }
    }

    #[test]
    fn quoted_cells_are_those_that_other_readers_find() {
        for line in [
            r#"1,"2",3"#,
            r#""a,b","c""d",e"#,
            r#""","","#,
            r#""",x"#,
            r#""""",""""""#,
            r#"a"b,c"#,
            r#""a"b,c"#,
            r#""a" ,c"#,
            r#""open,1,2"#,
            r#"1,"open"#,
            r#"1,2,""#,
            r#""a""#,
        ] {
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
            let mut record = csv::ByteRecord::new();
            assert!(reader.read_byte_record(&mut record).expect("memory"));
            let ours: Vec<_> = cells(line.as_bytes(), b',').iter().map(|cell| cell.trim_ascii().to_vec()).collect();
            let theirs: Vec<_> = record.iter().map(|cell| cell.trim_ascii().to_vec()).collect();
            assert_eq!(ours, theirs, "{line}");
        }
    }
}
