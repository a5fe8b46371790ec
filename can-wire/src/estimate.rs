//! The estimate frame, `0x180 + n`: preload, its standard deviation, and why there is none.
//!
//! ```text
//! byte  0        2        4        6                  7
//!      +--------+--------+--------+---------+--------+-----+
//!      | preload| sigma  | drag   | quality | counter| CRC |
//!      | u16 1 N| u16 1 N| i16    | 4 bits  | 4 bits | u8  |
//!      |        |        | 0.01 N | 7..4    | 3..0   |     |
//!      +--------+--------+--------+---------+--------+-----+
//! ```
//!
//! Quality 0: preload and sigma may be trusted. Otherwise it is the code of the most urgent
//! [`Reason`], and preload and sigma are not available. Exactly one of preload and reason is ever sent: an estimate
//! that has neither is sent as [`Reason::Stale`], one that has both without the preload. The drag force, positive
//! against the motion, is given whenever it is known.

use crate::frame::{self, LENGTH, RawFrame};
use crate::{Reject, number};
use model_core::sample::{Estimate, Reason};
use serde::{Deserialize, Serialize};

/// Counts per newton of preload and its standard deviation.
const PRELOAD_PER_N: f32 = 1.0;

/// Counts per newton of drag force.
const DRAG_PER_N: f32 = 100.0;

/// Content of an estimate frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateMessage {
    /// Preload, N, to 1 N; present exactly when `quality` is `None`. 65531 stands for that and more.
    pub preload_n: Option<f32>,
    /// Its standard deviation (1 σ), N, to 1 N; present exactly when the preload is.
    pub sigma_n: Option<f32>,
    /// Drag force, N, to 0.01 N, positive against the motion; ±327.67 stands for that and more.
    pub drag_force_n: Option<f32>,
    /// Why there is no preload: the most urgent reason. `None`: the preload may be trusted.
    pub quality: Option<Reason>,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    preload: u16,
    #[serde(with = "postcard::fixint::le")]
    sigma: u16,
    #[serde(with = "postcard::fixint::le")]
    drag: i16,
    counter_quality: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, estimate: &Estimate) -> RawFrame {
    let known = estimate.preload_n.filter(|m| m.value.is_finite() && m.sigma.is_finite());
    let (known, quality) = match (known, estimate.reasons.first_code()) {
        (None, 0) => (None, Reason::Stale as u8),
        (known, 0) => (known, 0),
        (_, code) => (None, code),
    };
    frame::seal(
        identifier,
        &Wire {
            preload: number::to_u16(known.map(|m| m.value), PRELOAD_PER_N),
            sigma: number::to_u16(known.map(|m| m.sigma), PRELOAD_PER_N),
            drag: number::to_i16(estimate.drag_force_n.map(|m| m.value), DRAG_PER_N),
            counter_quality: frame::join(counter, quality),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<EstimateMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let (counter, code) = frame::split(wire.counter_quality);
    let number =
        |field, code| number::from_u16(code, PRELOAD_PER_N).map_err(|code| Reject::UndefinedCode { field, code });
    let preload_n = number("preload", wire.preload)?;
    let sigma_n = number("sigma", wire.sigma)?;
    let quality = Reason::from_code(code);
    if preload_n.is_some() != quality.is_none() {
        return Err(Reject::Contradiction { field: "preload" });
    }
    if sigma_n.is_some() != quality.is_none() {
        return Err(Reject::Contradiction { field: "sigma" });
    }
    Ok(EstimateMessage { preload_n, sigma_n, drag_force_n: number::from_i16(wire.drag, DRAG_PER_N), quality, counter })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};
    use model_core::sample::{Measured, Motion, Reasons};

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn trusted() -> Estimate {
        Estimate {
            tick: 0,
            preload_n: Some(Measured { value: 2873.4, sigma: 61.5 }),
            drag_force_n: Some(Measured { value: 21.074, sigma: 0.2 }),
            speed_m_s: Some(Measured { value: 0.0833, sigma: 1e-4 }),
            temperature_degc: Some(31.41),
            motion: Motion::Forward,
            reasons: Reasons::NONE,
        }
    }

    fn with(reasons: &[Reason]) -> Estimate {
        let mut estimate = trusted();
        reasons.iter().for_each(|r| estimate.reasons.insert(*r));
        estimate
    }

    fn read(frame: RawFrame) -> EstimateMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Estimate(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bytes() {
        let wire = Wire { preload: 0xFFFF, sigma: 0xFFFF, drag: -32768, counter_quality: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        let frame = publisher.estimate(&trusted());
        assert_eq!(frame, RawFrame { id: 0x185, data: [0x39, 0x0B, 0x3E, 0x00, 0x3B, 0x08, 0x00, 0x88] });
        let message = EstimateMessage {
            preload_n: Some(2873.0),
            sigma_n: Some(62.0),
            drag_force_n: Some(21.07),
            quality: None,
            counter: 0,
        };
        assert_eq!(read(frame), message);

        let mut silent = with(&[Reason::NotCalibrated, Reason::NoMotion]);
        silent.preload_n = None;
        silent.drag_force_n = None;
        let frame = publisher.estimate(&silent);
        assert_eq!(frame, RawFrame { id: 0x185, data: [0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0x80, 0x11, 0xB6] });
        let message = EstimateMessage {
            preload_n: None,
            sigma_n: None,
            drag_force_n: None,
            quality: Some(Reason::NotCalibrated),
            counter: 1,
        };
        assert_eq!(read(frame), message);
    }

    #[test]
    fn a_preload_goes_out_only_without_reason() {
        for reason in Reason::ALL {
            let message = read(Publisher::new(NODE).estimate(&with(&[reason])));
            assert_eq!((message.preload_n, message.sigma_n, message.quality), (None, None, Some(reason)));
            assert_eq!(message.drag_force_n, Some(21.07));
        }
    }

    #[test]
    fn neither_preload_nor_reason_is_stale() {
        for preload_n in [
            None,
            Some(Measured { value: f32::NAN, sigma: 1.0 }),
            Some(Measured { value: 3000.0, sigma: f32::INFINITY }),
        ] {
            let message = read(Publisher::new(NODE).estimate(&Estimate { preload_n, ..trusted() }));
            assert_eq!((message.preload_n, message.sigma_n, message.quality), (None, None, Some(Reason::Stale)));
        }
    }

    #[test]
    fn large_numbers_saturate() {
        let preload_n = Some(Measured { value: 1e9, sigma: 1e9 });
        let drag_force_n = Some(Measured { value: -1e9, sigma: 0.0 });
        let message = read(Publisher::new(NODE).estimate(&Estimate { preload_n, drag_force_n, ..trusted() }));
        assert_eq!(message.preload_n, Some(65531.0));
        assert_eq!(message.sigma_n, Some(65531.0));
        assert_eq!(message.drag_force_n, Some(-327.67));
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { preload: 3000, sigma: 60, drag: 0, counter_quality: 0, crc: 0 };
        let contradiction = |field| Reject::Contradiction { field };
        let undefined = |field, code| Reject::UndefinedCode { field, code };
        for (wire, reason) in [
            (Wire { counter_quality: 0x10, ..good }, contradiction("preload")),
            (Wire { preload: 0xFFFF, ..good }, contradiction("preload")),
            (Wire { sigma: 0xFFFF, ..good }, contradiction("sigma")),
            (Wire { preload: 0xFFFF, counter_quality: 0xF0, ..good }, contradiction("sigma")),
            (Wire { preload: 0xFFFC, ..good }, undefined("preload", 0xFFFC)),
            (Wire { sigma: 0xFFFE, ..good }, undefined("sigma", 0xFFFE)),
        ] {
            let frame = frame::seal(0x185, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
        }
    }
}
