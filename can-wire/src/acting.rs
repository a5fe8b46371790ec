//! The acting frame, `0x300 + n`: mechanisms that act beside the drag law in the parameters that the block runs.
//!
//! ```text
//! byte  0           2           6                  7
//!      +-----------+-----------+---------+--------+-----+
//!      | acting    | reserved  | source  | counter| CRC |
//!      | u16, bits | 0         | 4 bits  | 4 bits | u8  |
//!      |           |           | 7..4    | 3..0   |     |
//!      +-----------+-----------+---------+--------+-----+
//! ```
//!
//! Bit n of `acting`: mechanism n of [`Acting::NAMES`] acts beside the law. The [`state`](mod@crate::state) frame says
//! which parameter image is running.

use crate::Reject;
use crate::frame::{self, LENGTH, RawFrame};
use model_core::left_out::Acting;
use serde::{Deserialize, Serialize};

/// Where the parameters come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Source {
    /// No record, or one that was refused: the published set, and so no preload.
    BuiltIn = 0,
    /// A record that is marked calibrated.
    Calibrated = 1,
    /// A record that is not marked calibrated: no preload.
    NotCalibrated = 2,
}

impl Source {
    /// All of them.
    pub const ALL: [Source; 3] = [Source::BuiltIn, Source::Calibrated, Source::NotCalibrated];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Source::BuiltIn => "built-in",
            Source::Calibrated => "calibrated",
            Source::NotCalibrated => "not-calibrated",
        }
    }
}

/// What the firmware sends in an acting frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beside {
    /// Mechanisms that act beside the law.
    pub acting: Acting,
    /// Whether the parameters come from a record.
    pub record: bool,
    /// Whether the parameters were measured for this block.
    pub calibrated: bool,
}

/// Content of an acting frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActingMessage {
    /// Mechanisms that act beside the law.
    pub acting: Acting,
    /// Where the parameters come from.
    pub source: Source,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    acting: u16,
    #[serde(with = "postcard::fixint::le")]
    reserved: u32,
    source_counter: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, beside: &Beside) -> RawFrame {
    let source = match (beside.record, beside.calibrated) {
        (false, _) => Source::BuiltIn,
        (true, true) => Source::Calibrated,
        (true, false) => Source::NotCalibrated,
    };
    let source_counter = frame::join(counter, source as u8);
    frame::seal(identifier, &Wire { acting: beside.acting.bits(), reserved: 0, source_counter, crc: 0 })
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<ActingMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let (counter, code) = frame::split(wire.source_counter);
    let source = Source::ALL
        .into_iter()
        .find(|source| *source as u8 == code)
        .ok_or(Reject::UndefinedCode { field: "source", code: code.into() })?;
    let acting = Acting::from_bits(wire.acting);
    if acting.bits() != wire.acting {
        return Err(Reject::UndefinedCode { field: "acting", code: wire.acting });
    }
    if wire.reserved != 0 {
        return Err(Reject::UndefinedCode { field: "reserved", code: wire.reserved as u16 });
    }
    Ok(ActingMessage { acting, source, counter })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn read(frame: RawFrame) -> ActingMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Acting(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        let acting = Acting::from_bits(0x0103);
        let frame = publisher.acting(&Beside { acting, record: true, calibrated: true });
        assert_eq!(frame.id, 0x305);
        assert_eq!(frame.data[..7], [0x03, 0x01, 0, 0, 0, 0, 0x10]);
        assert_eq!(read(frame), ActingMessage { acting, source: Source::Calibrated, counter: 0 });
        let frame = publisher.acting(&Beside { acting: Acting::NONE, record: true, calibrated: false });
        assert_eq!((read(frame).source, read(frame).counter), (Source::NotCalibrated, 1));
        // without a record nothing is calibrated, whatever `calibrated` says
        let frame = publisher.acting(&Beside { acting: Acting::NONE, record: false, calibrated: true });
        assert_eq!(read(frame).source, Source::BuiltIn);
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { acting: 0, reserved: 0, source_counter: 0x10, crc: 0 };
        let undefined = |field, code| Reject::UndefinedCode { field, code };
        for (wire, reason) in [
            (Wire { source_counter: 0x30, ..good }, undefined("source", 3)),
            (Wire { acting: 0x0200, ..good }, undefined("acting", 0x0200)),
            (Wire { reserved: 7, ..good }, undefined("reserved", 7)),
        ] {
            let frame = frame::seal(0x305, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
        }
    }
}
