//! The misfit frame, `0x400 + n`: whether the model that the block runs fits what it sees.
//!
//! ```text
//! byte  0          2           4          6                  7
//!      +----------+-----------+----------+---------+--------+-----+
//!      | strength | share     | since    | axis    | counter| CRC |
//!      | u16      | u16       | u16      | 4 bits  | 4 bits | u8  |
//!      | 0.01 σ   | 0.01 %    | 1 s      | 7..4    | 3..0   |     |
//!      +----------+-----------+----------+---------+--------+-----+
//! ```
//!
//! `since` is available exactly while the model does not fit. `axis` 0: no axis has been seen well enough for a
//! judgement so far; otherwise it is the axis on which the estimates disagree most, and strength and share say how
//! surely and by how much. See [`model_core::consistency`].

use crate::frame::{self, LENGTH, RawFrame};
use crate::{Reject, number};
use model_core::consistency::{Axis, Verdict};
use model_core::sample::BLOCK_HZ;
use serde::{Deserialize, Serialize};

/// Counts per standard deviation.
const STRENGTH_PER_SIGMA: f32 = 100.0;

/// Counts per share of 1.
const SHARE_PER_ONE: f32 = 10_000.0;

/// Content of a misfit frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MisfitMessage {
    /// The axis on which the estimates disagree most; `None` before there is a judgement.
    pub axis: Option<Axis>,
    /// How surely they disagree, standard deviations, to 0.01, at least 0; present exactly when the axis is.
    pub strength: Option<f32>,
    /// By how much, share of the drag force, to 0.0001; present exactly when the axis is.
    pub share: Option<f32>,
    /// For how long the model has not fitted, s, to 1; 65531 stands for that and more. `None`: it fits, or there is no
    /// judgement.
    pub since_s: Option<f32>,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    strength: u16,
    #[serde(with = "postcard::fixint::le")]
    share: u16,
    #[serde(with = "postcard::fixint::le")]
    since: u16,
    axis_counter: u8,
    crc: u8,
}

/// `tick` is that of the newest block of samples.
pub(crate) fn encode(identifier: u16, counter: u8, verdict: &Verdict, tick: u32) -> RawFrame {
    let known = verdict.worst.filter(|(_, f)| f.strength.is_finite() && f.share.is_finite());
    // ticks wrap
    let since = verdict.misfit_since.map(|since| (tick.wrapping_sub(since) / BLOCK_HZ) as f32);
    frame::seal(
        identifier,
        &Wire {
            strength: number::to_u16(known.map(|(_, f)| f.strength), STRENGTH_PER_SIGMA),
            share: number::to_u16(known.map(|(_, f)| f.share), SHARE_PER_ONE),
            since: number::to_u16(since, 1.0),
            axis_counter: frame::join(counter, known.map_or(0, |(axis, _)| axis as u8 + 1)),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<MisfitMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let read = |field: &'static str, code: u16, per_unit: f32| {
        number::from_u16(code, per_unit).map_err(|code| Reject::UndefinedCode { field, code })
    };
    let strength = read("strength", wire.strength, STRENGTH_PER_SIGMA)?;
    let share = read("share", wire.share, SHARE_PER_ONE)?;
    let since_s = read("since", wire.since, 1.0)?;
    let (counter, code) = frame::split(wire.axis_counter);
    let axis = match code {
        0 => None,
        code => Some(
            Axis::ALL
                .into_iter()
                .find(|axis| *axis as u8 + 1 == code)
                .ok_or(Reject::UndefinedCode { field: "axis", code: code.into() })?,
        ),
    };
    for (field, present) in [("strength", strength.is_some()), ("share", share.is_some())] {
        if present != axis.is_some() {
            return Err(Reject::Contradiction { field });
        }
    }
    Ok(MisfitMessage { axis, strength, share, since_s, counter })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};
    use model_core::consistency::bins::Finding;

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn read(frame: RawFrame) -> MisfitMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Misfit(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    fn verdict(axis: Axis, strength: f32, share: f32, misfit_since: Option<u32>) -> Verdict {
        Verdict { worst: Some((axis, Finding { strength, share })), misfit_since, judged: 1 }
    }

    #[test]
    fn eight_bytes() {
        let wire = Wire { strength: 0xFFFF, share: 0xFFFF, since: 0xFFFF, axis_counter: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        let frame = publisher.misfit(&verdict(Axis::Position, 7.25, 0.031, Some(1000)), 13_900);
        assert_eq!(frame.id, 0x405);
        assert_eq!(frame.data[..7], [0xD5, 0x02, 0x36, 0x01, 0x81, 0x00, 0x30]);
        let message = MisfitMessage {
            axis: Some(Axis::Position),
            strength: Some(7.25),
            share: Some(0.031),
            since_s: Some(129.0),
            counter: 0,
        };
        assert_eq!(read(frame), message);
        let frame = publisher.misfit(&Verdict::NONE, 5);
        assert_eq!(frame.data[..7], [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01]);
        let nothing = MisfitMessage { axis: None, strength: None, share: None, since_s: None, counter: 1 };
        assert_eq!(read(frame), nothing);
    }

    #[test]
    fn numbers_saturate_and_ticks_wrap() {
        let message = read(Publisher::new(NODE).misfit(&verdict(Axis::Speed, -3.0, 9.0, Some(u32::MAX - 99)), 200));
        assert_eq!((message.strength, message.share, message.since_s), (Some(0.0), Some(6.5531), Some(3.0)));
        let message = read(Publisher::new(NODE).misfit(&verdict(Axis::Speed, 1e9, 0.0, Some(0)), 90_000_000));
        assert_eq!((message.strength, message.since_s), (Some(655.31), Some(65_531.0)));
        let message = read(Publisher::new(NODE).misfit(&verdict(Axis::Speed, f32::NAN, 0.0, None), 0));
        assert_eq!(message.axis, None);
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { strength: 0, share: 0, since: 0, axis_counter: 0x10, crc: 0 };
        let undefined = |field, code| Reject::UndefinedCode { field, code };
        for (wire, reason) in [
            (Wire { strength: 0xFFFD, ..good }, undefined("strength", 0xFFFD)),
            (Wire { share: 0xFFFD, ..good }, undefined("share", 0xFFFD)),
            (Wire { since: 0xFFFD, ..good }, undefined("since", 0xFFFD)),
            (Wire { axis_counter: 0x50, ..good }, undefined("axis", 5)),
            (Wire { strength: 0xFFFF, ..good }, Reject::Contradiction { field: "strength" }),
            (Wire { axis_counter: 0x00, ..good }, Reject::Contradiction { field: "strength" }),
            (Wire { share: 0xFFFF, ..good }, Reject::Contradiction { field: "share" }),
        ] {
            let frame = frame::seal(0x405, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
        }
    }
}
