//! Requests and answers as bytes.

use super::Abort;
use crate::frame::LENGTH;

/// Command of an answer: write taken, image begun.
pub(crate) const TAKEN: u8 = 0x60;

/// Command of an abort, either way.
pub(crate) const ABORT: u8 = 0x80;

/// A client's request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// The value of an object.
    Read { index: u16, sub: u8 },
    /// A new value, with its length if the request gives one.
    Write { index: u16, sub: u8, length: Option<usize>, data: [u8; 4] },
    /// An image of this size.
    Begin { index: u16, sub: u8, size: u32 },
    /// A part of it.
    Segment(Segment),
    /// The client gives up.
    Abort,
    /// Anything else.
    Unknown,
}

/// Up to seven bytes of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Segment {
    pub(crate) toggle: bool,
    pub(crate) last: bool,
    data: [u8; 7],
    used: usize,
}

impl Segment {
    pub(crate) fn bytes(&self) -> &[u8] {
        self.data.get(..self.used).unwrap_or_default()
    }
}

impl Request {
    /// Reads a request. Reserved bits must be 0, unused bytes may be anything.
    pub(crate) fn of(bytes: &[u8; LENGTH]) -> Request {
        let [command, low, high, sub, d0, d1, d2, d3] = *bytes;
        let (index, data) = (u16::from_le_bytes([low, high]), [d0, d1, d2, d3]);
        match command >> 5 {
            0 => {
                let unused = usize::from(command >> 1 & 7);
                Request::Segment(Segment {
                    toggle: command & 0x10 != 0,
                    last: command & 1 != 0,
                    data: [low, high, sub, d0, d1, d2, d3],
                    used: 7 - unused,
                })
            }
            // expedited without and with length, then begin of segments with their size
            1 if command == 0x22 => Request::Write { index, sub, length: None, data },
            1 if command & 0x13 == 0x03 => {
                Request::Write { index, sub, length: Some(4 - usize::from(command >> 2 & 3)), data }
            }
            1 if command == 0x21 => Request::Begin { index, sub, size: u32::from_le_bytes(data) },
            2 if command == 0x40 => Request::Read { index, sub },
            4 if command == ABORT => Request::Abort,
            _ => Request::Unknown,
        }
    }
}

/// The answer to a request about an object, or a request.
pub(crate) fn message(command: u8, index: u16, sub: u8, data: [u8; 4]) -> [u8; LENGTH] {
    let [low, high] = index.to_le_bytes();
    let [d0, d1, d2, d3] = data;
    [command, low, high, sub, d0, d1, d2, d3]
}

/// A refusal.
pub(crate) fn refusal(index: u16, sub: u8, why: Abort) -> [u8; LENGTH] {
    message(ABORT, index, sub, why.code().to_le_bytes())
}
