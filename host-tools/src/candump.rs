//! candump text, read and written: the output of `candump -L`, `candump` and `candump -ta`, one frame a line.
//!
//! ```text
//! (1436509052.249713) can0 181#0011223344556677            log format, also what we write
//!  (1436509052.249713)  can0  181   [8]  00 11 22 33 44 55 66 77
//!   can0  181   [8]  00 11 22 33 44 55 66 77               no time known
//! ```
//!
//! The block sends classical data frames with 11-bit identifiers and nothing else. Extended, remote, error and
//! FD frames are recognised, so that they are not taken for damage, and left alone.

use std::fmt;

/// A time stamp, microseconds since the logger's own origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Micros(pub u64);

impl Micros {
    /// The same in seconds, the nearest f64: it prints with the digits that were read.
    pub fn seconds(self) -> f64 {
        self.0 as f64 / 1e6
    }
}

impl fmt::Display for Micros {
    /// Seconds with six decimals.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = format!("{}.{:06}", self.0 / 1_000_000, self.0 % 1_000_000);
        f.pad(&text)
    }
}

/// A classical data frame with an 11-bit identifier, as a line of text carried it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// When, if the line says so.
    pub time: Option<Micros>,
    /// Name of the interface, such as `can0`.
    pub interface: &'a str,
    /// Identifier, 0 to 0x7FF.
    pub id: u16,
    bytes: [u8; 8],
    length: usize,
}

impl<'a> Frame<'a> {
    /// A frame; bytes after the eighth do not fit and are left out.
    pub fn new(time: Option<Micros>, interface: &'a str, id: u16, data: &[u8]) -> Self {
        let mut bytes = [0; 8];
        let length = data.len().min(8);
        bytes[..length].copy_from_slice(&data[..length]);
        Frame { time, interface, id, bytes, length }
    }

    /// The data bytes, none to eight.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

impl fmt::Display for Frame<'_> {
    /// The log format; time zero where none is known.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}) {} {:03X}#", self.time.unwrap_or(Micros(0)), self.interface, self.id)?;
        for byte in self.data() {
            write!(f, "{byte:02X}")?;
        }
        Ok(())
    }
}

/// What one line holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line<'a> {
    /// Nothing, or a comment starting with `#` or `;`.
    Blank,
    /// A frame of a kind the block never sends: extended, remote, error or FD.
    Foreign,
    /// A classical data frame with an 11-bit identifier.
    Frame(Frame<'a>),
}

/// Why a line is not candump text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NotCandump {
    /// The parenthesis does not hold seconds.
    #[error("time stamp is not (seconds.fraction): log with `candump -L` or `candump -ta`")]
    Time,
    /// No interface, identifier and data after it.
    #[error("not a frame: expected `(1436509052.249713) can0 181#0011223344556677` or `can0 181 [8] 00 11 ...`")]
    Shape,
    /// The identifier is not three or eight hexadecimal digits.
    #[error("identifier is not three (11-bit) or eight (29-bit) hexadecimal digits")]
    Identifier,
    /// The data are not whole hexadecimal bytes.
    #[error("data are not pairs of hexadecimal digits, at most eight, as many as the line says")]
    Data,
}

/// Reads one line.
///
/// # Errors
/// [`NotCandump`] says which part cannot be read.
pub fn parse(line: &str) -> Result<Line<'_>, NotCandump> {
    let line = line.trim_ascii();
    if line.is_empty() || line.starts_with(['#', ';']) {
        return Ok(Line::Blank);
    }
    let (time, rest) = match line.strip_prefix('(') {
        Some(rest) => {
            let (time, rest) = rest.split_once(')').ok_or(NotCandump::Time)?;
            (Some(seconds(time.trim_ascii()).ok_or(NotCandump::Time)?), rest)
        }
        None => (None, line),
    };
    let mut words = rest.split_ascii_whitespace();
    let interface = words.next().ok_or(NotCandump::Shape)?;
    let word = words.next().ok_or(NotCandump::Shape)?;
    match word.split_once('#') {
        Some((id, data)) => log_format(time, interface, id, data),
        None => {
            // `candump -x` puts the direction and two flags before the identifier
            let id = match word {
                "RX" | "TX" => words.by_ref().find(|w| *w != "-" && *w != "B" && *w != "E").ok_or(NotCandump::Shape)?,
                id => id,
            };
            screen_format(time, interface, id, words)
        }
    }
}

fn log_format<'a>(time: Option<Micros>, interface: &'a str, id: &str, data: &str) -> Result<Line<'a>, NotCandump> {
    let Some(id) = identifier(id)? else { return Ok(Line::Foreign) };
    // `##` is an FD frame, `#R` a remote one
    if data.starts_with(['#', 'R']) {
        return Ok(Line::Foreign);
    }
    let (pairs, rest) = data.as_bytes().as_chunks::<2>();
    if !rest.is_empty() || pairs.len() > 8 {
        return Err(NotCandump::Data);
    }
    let mut bytes = [0; 8];
    for (byte, pair) in bytes.iter_mut().zip(pairs) {
        *byte = hexadecimal(pair).ok_or(NotCandump::Data)?;
    }
    Ok(Line::Frame(Frame { time, interface, id, bytes, length: pairs.len() }))
}

fn screen_format<'a, 'w>(
    time: Option<Micros>,
    interface: &'a str,
    id: &str,
    mut words: impl Iterator<Item = &'w str>,
) -> Result<Line<'a>, NotCandump> {
    let brackets = words.next().and_then(|w| w.strip_prefix('[')?.strip_suffix(']')).ok_or(NotCandump::Shape)?;
    let length: usize = brackets.parse().map_err(|_| NotCandump::Shape)?;
    let Some(id) = identifier(id)? else { return Ok(Line::Foreign) };
    // FD frames have two digits in the brackets
    if brackets.len() != 1 || length > 8 {
        return Ok(Line::Foreign);
    }
    let mut bytes = [0; 8];
    for byte in &mut bytes[..length] {
        let word = words.next().ok_or(NotCandump::Data)?;
        if word == "remote" {
            return Ok(Line::Foreign);
        }
        *byte = hexadecimal(word.as_bytes()).ok_or(NotCandump::Data)?;
    }
    if length == 0 && words.next() == Some("remote") {
        return Ok(Line::Foreign);
    }
    Ok(Line::Frame(Frame { time, interface, id, bytes, length }))
}

/// The 11-bit identifier, `None` for a 29-bit one (error frames are written as such).
fn identifier(text: &str) -> Result<Option<u16>, NotCandump> {
    let mut id: u16 = 0;
    for byte in text.bytes() {
        let digit = DIGITS[usize::from(byte)];
        if digit == NO_DIGIT {
            return Err(NotCandump::Identifier);
        }
        // of eight digits the upper ones are shifted out; they are not needed
        id = id << 4 | u16::from(digit);
    }
    match text.len() {
        3 if id <= 0x7FF => Ok(Some(id)),
        8 => Ok(None),
        _ => Err(NotCandump::Identifier),
    }
}

/// What a byte is worth as a hexadecimal digit.
const DIGITS: [u8; 256] = {
    let mut digits = [NO_DIGIT; 256];
    let mut value = 0;
    while value < 16 {
        digits[b"0123456789ABCDEF"[value] as usize] = value as u8;
        digits[b"0123456789abcdef"[value] as usize] = value as u8;
        value += 1;
    }
    digits
};

const NO_DIGIT: u8 = 0xFF;

fn hexadecimal(pair: &[u8]) -> Option<u8> {
    let &[high, low] = pair else { return None };
    let (high, low) = (DIGITS[usize::from(high)], DIGITS[usize::from(low)]);
    // no digit has the upper bits set
    if (high | low) & 0xF0 == 0 { Some(high << 4 | low) } else { None }
}

/// `seconds.fraction` with up to nine decimals; what is below a microsecond is cut off.
fn seconds(text: &str) -> Option<Micros> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    if whole.is_empty() || fraction.len() > 9 {
        return None;
    }
    let digit = |byte: u8| byte.is_ascii_digit().then(|| u64::from(byte - b'0'));
    let mut micros: u64 = 0;
    for byte in whole.bytes() {
        micros = micros.checked_mul(10)?.checked_add(digit(byte)?)?;
    }
    let mut unit = 1_000_000;
    micros = micros.checked_mul(unit)?;
    for byte in fraction.bytes() {
        unit /= 10;
        micros = micros.checked_add(digit(byte)? * unit)?;
    }
    Some(Micros(micros))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: [u8; 8] = [0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77];

    #[test]
    fn reads_what_candump_prints() {
        let at = Some(Micros(1_436_509_052_249_713));
        for (line, time, interface, data) in [
            ("(1436509052.249713) can0 181#0011223344556677", at, "can0", &BYTES[..]),
            ("(1436509052.249713) vcan12 181#0011223344556677 T\r\n", at, "vcan12", &BYTES[..]),
            (" (1436509052.249713)  can0  181   [8]  00 11 22 33 44 55 66 77", at, "can0", &BYTES[..]),
            ("  can0  181   [8]  00 11 22 33 44 55 66 77   '..\"3DUfw'", None, "can0", &BYTES[..]),
            ("  can0  RX - -  181   [8]  00 11 22 33 44 55 66 77", None, "can0", &BYTES[..]),
            ("  can0  181   [2]  00 11", None, "can0", &BYTES[..2]),
            ("can0 181#", None, "can0", &[]),
            ("can0 181 [0]", None, "can0", &[]),
        ] {
            assert_eq!(parse(line), Ok(Line::Frame(Frame::new(time, interface, 0x181, data))), "{line}");
        }
    }

    #[test]
    fn writes_what_it_reads() {
        let line = "(0000000012.000034) can0 7FF#0A";
        let Ok(Line::Frame(frame)) = parse(line) else { panic!("{line}") };
        assert_eq!(frame.to_string(), "(12.000034) can0 7FF#0A");
        assert_eq!(parse(&frame.to_string()), Ok(Line::Frame(frame)));
    }

    #[test]
    fn leaves_other_kinds_of_frames_alone() {
        for line in [
            "(1.0) can0 181##10011223344556677",
            "(1.0) can0 181#R",
            "(1.0) can0 181#R8",
            "(1.0) can0 00000181#00",
            "  can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME",
            "  can0  181   [0]  remote request",
            "  can0  181   [8]  remote request",
            "  can0  181   [08]  00 11 22 33 44 55 66 77",
        ] {
            assert_eq!(parse(line), Ok(Line::Foreign), "{line}");
        }
        for line in ["", "  \r\n", "# made by hand"] {
            assert_eq!(parse(line), Ok(Line::Blank), "{line}");
        }
    }

    #[test]
    fn says_what_it_cannot_read() {
        for (line, why) in [
            ("(2015-07-10 08:17:32.249713) can0 181#00", NotCandump::Time),
            ("(1.5 can0 181#00", NotCandump::Time),
            ("(1.0000000000) can0 181#00", NotCandump::Time),
            ("(1.5) can0", NotCandump::Shape),
            ("hello world", NotCandump::Shape),
            ("can0 181 8 00", NotCandump::Shape),
            ("can0 81#00", NotCandump::Identifier),
            ("can0 881#00", NotCandump::Identifier),
            ("can0 +81#00", NotCandump::Identifier),
            ("can0 181#0", NotCandump::Data),
            ("can0 181#0g", NotCandump::Data),
            ("can0 181#001122334455667788", NotCandump::Data),
            ("can0 181 [3] 00 11", NotCandump::Data),
            ("can0 181 [2] 00 1", NotCandump::Data),
        ] {
            assert_eq!(parse(line), Err(why), "{line}");
        }
    }
}
