//! The state frame, `0x680 + n`: the parameter image in use, and changes made on the block.
//!
//! ```text
//! byte  0              4         6                                         7
//!      +--------------+---------+------+----------+--------+--------+-----+
//!      | image        | changes | burst| unlocked | limits | counter| CRC |
//!      | u32          | u16     | bit 7| bit 6    | 5..4   | 3..0   | u8  |
//!      +--------------+---------+------+----------+--------+--------+-----+
//! ```
//!
//! Sent every second, and at once when anything in it changes, so that every listener sees when a block is unlocked,
//! changed, or given other parameters. The count stops at 65535.

use crate::Reject;
use crate::frame::{self, LENGTH, RawFrame};
use crate::service::LimitState;
use serde::{Deserialize, Serialize};

/// What the firmware sends in a state frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Workings {
    /// Hash of the active parameter image; 0: none, the built-in parameters.
    pub image: u32,
    /// Changes accepted since the start.
    pub changes: u32,
    /// On which side of its limits the preload lies.
    pub limits: LimitState,
    /// Whether the block accepts changes.
    pub unlocked: bool,
    /// Whether a burst is under way.
    pub bursting: bool,
}

/// Content of a state frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateMessage {
    /// Hash of the active parameter image; 0: none, the built-in parameters.
    pub image: u32,
    /// Changes accepted since the start; 65535 stands for that and more.
    pub changes: u16,
    /// On which side of its limits the preload lies.
    pub limits: LimitState,
    /// Whether the block accepts changes.
    pub unlocked: bool,
    /// Whether a burst is under way.
    pub bursting: bool,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    image: u32,
    #[serde(with = "postcard::fixint::le")]
    changes: u16,
    counter: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, workings: &Workings) -> RawFrame {
    let code = workings.limits as u8 | u8::from(workings.unlocked) << 2 | u8::from(workings.bursting) << 3;
    frame::seal(
        identifier,
        &Wire {
            image: workings.image,
            changes: u16::try_from(workings.changes).unwrap_or(u16::MAX),
            counter: frame::join(counter, code),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<StateMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let (counter, code) = frame::split(wire.counter);
    let limits = LimitState::ALL.into_iter().find(|l| *l as u8 == code & 3);
    Ok(StateMessage {
        image: wire.image,
        changes: wire.changes,
        limits: limits.ok_or(Reject::UndefinedCode { field: "limits", code: code.into() })?,
        unlocked: code & 4 != 0,
        bursting: code & 8 != 0,
        counter,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};

    #[test]
    fn eight_bytes() {
        let wire = Wire { image: u32::MAX, changes: u16::MAX, counter: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).map(|b| b.len()), Ok(LENGTH));
    }

    #[test]
    fn literal_bytes_both_ways() {
        let node = NodeId::new(5).unwrap();
        let workings = Workings {
            image: 0x1234_5678,
            changes: 70_000,
            limits: LimitState::Warning,
            unlocked: true,
            bursting: true,
        };
        let frame = Publisher::new(node).state(&workings);
        assert_eq!((frame.id, &frame.data[..7]), (0x685, &[0x78, 0x56, 0x34, 0x12, 0xFF, 0xFF, 0xE0][..]));
        let Ok((_, Message::State(message))) = crate::decode(frame.id, &frame.data) else { panic!() };
        let expected = StateMessage {
            image: 0x1234_5678,
            changes: 0xFFFF,
            limits: LimitState::Warning,
            unlocked: true,
            bursting: true,
            counter: 0,
        };
        assert_eq!(message, expected);
    }

    #[test]
    fn every_code_survives() {
        for code in 0..16 {
            let limits = LimitState::ALL[code & 3];
            let workings = Workings { limits, unlocked: code & 4 != 0, bursting: code & 8 != 0, ..Workings::default() };
            let frame = Publisher::new(NodeId::FIRST).state(&workings);
            let Ok((_, Message::State(m))) = crate::decode(frame.id, &frame.data) else { panic!() };
            assert_eq!((m.limits, m.unlocked, m.bursting), (limits, workings.unlocked, workings.bursting));
        }
    }
}
