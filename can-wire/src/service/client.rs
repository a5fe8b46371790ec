//! The desk's side: requests as frames, and decoding of the answers.

use super::objects::{Object, Type};
use super::request::{self, message};
use super::{ANSWER_BASE, Abort, REQUEST_BASE};
use crate::frame::{NodeId, RawFrame};

/// Bytes of an image in one segment.
pub const SEGMENT: usize = 7;

/// Content of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reply {
    /// The value of the object that was read.
    Value(u32),
    /// The write was accepted, or the image begun.
    Taken,
    /// The segment with this toggle bit was accepted.
    SegmentTaken(bool),
    /// Refused.
    Refused(Abort),
    /// Refused with a code that no block of this release gives.
    RefusedOtherwise(u32),
}

/// Asks for the value of an object.
pub fn read(node: NodeId, object: &Object) -> RawFrame {
    to(node, message(0x40, object.index, object.sub, [0; 4]))
}

/// Writes a value; bytes that do not fit the object's type are left out. A domain is sent with [`begin`].
pub fn write(node: NodeId, object: &Object, value: u32) -> RawFrame {
    let length = object.kind.length().unwrap_or(4);
    let command = 0x23 | (4 - length as u8) << 2;
    to(node, message(command, object.index, object.sub, value.to_le_bytes()))
}

/// Begins to send an image of `size` bytes.
pub fn begin(node: NodeId, object: &Object, size: u32) -> RawFrame {
    to(node, message(0x21, object.index, object.sub, size.to_le_bytes()))
}

/// A part of an image: the first seven of `bytes`, or all if there are fewer. `toggle` is false in the first part.
pub fn segment(node: NodeId, bytes: &[u8], toggle: bool, last: bool) -> RawFrame {
    let mut data = [0; 8];
    let used = bytes.len().min(SEGMENT);
    for (place, byte) in data.iter_mut().skip(1).zip(bytes) {
        *place = *byte;
    }
    let unused = (SEGMENT - used) as u8;
    data[0] = u8::from(toggle) << 4 | unused << 1 | u8::from(last);
    to(node, data)
}

/// Gives up what was begun.
pub fn abort(node: NodeId, object: &Object) -> RawFrame {
    to(node, message(request::ABORT, object.index, object.sub, [0; 4]))
}

/// Reads an answer of `node` to a request about `object`; `None` for any other frame.
pub fn reply(node: NodeId, object: &Object, frame: &RawFrame) -> Option<Reply> {
    if frame.id != ANSWER_BASE + u16::from(node.get()) {
        return None;
    }
    let [command, low, high, sub, d0, d1, d2, d3] = frame.data;
    let value = u32::from_le_bytes([d0, d1, d2, d3]);
    if matches!(command, 0x20 | 0x30) {
        return (object.kind == Type::Domain).then_some(Reply::SegmentTaken(command == 0x30));
    }
    if (u16::from_le_bytes([low, high]), sub) != (object.index, object.sub) {
        return None;
    }
    match command {
        request::TAKEN => Some(Reply::Taken),
        request::ABORT => Some(Abort::from_code(value).map_or(Reply::RefusedOtherwise(value), Reply::Refused)),
        0x43 | 0x4B | 0x4F => {
            let unused = 8 * u32::from(command >> 2 & 3);
            Some(Reply::Value(value & (u32::MAX >> unused)))
        }
        _ => None,
    }
}

fn to(node: NodeId, data: [u8; 8]) -> RawFrame {
    RawFrame { id: REQUEST_BASE + u16::from(node.get()), data }
}
