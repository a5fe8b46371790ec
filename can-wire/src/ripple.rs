//! The ripple frame, `0x380 + n`: ripple of the drag force as balls enter the loaded zone.
//!
//! ```text
//! byte  0          2           4          6                  7
//!      +----------+-----------+----------+---------+--------+-----+
//!      | amplitude| phase     |wavelength| 0       | counter| CRC |
//!      | u16      | i16       | u16      | 4 bits  | 4 bits | u8  |
//!      | 0.001 N  | 0.0001 rad| 0.001 mm | 7..4    | 3..0   |     |
//!      +----------+-----------+----------+---------+--------+-----+
//! ```
//!
//! Amplitude and phase become available together, after enough travel.

use crate::frame::{self, LENGTH, RawFrame};
use crate::{Reject, number};
use model_core::ripple::Ripple;
use serde::{Deserialize, Serialize};

/// Counts per newton.
const AMPLITUDE_PER_N: f32 = 1000.0;

/// Counts per radian.
const PHASE_PER_RAD: f32 = 10_000.0;

/// Counts per metre.
const WAVELENGTH_PER_M: f32 = 1e6;

/// Content of a ripple frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RippleMessage {
    /// Amplitude of the drag force's ripple, N (half of peak to peak), to 0.001; 65.531 stands for that and more.
    pub amplitude_n: Option<f32>,
    /// Its phase at position 0, rad, -π to π, to 0.0001; present exactly when the amplitude is.
    pub phase_rad: Option<f32>,
    /// Travel per ball that enters the loaded zone, m, to 1 µm; 0.065531 stands for that and more.
    pub wavelength_m: Option<f32>,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    amplitude: u16,
    #[serde(with = "postcard::fixint::le")]
    phase: i16,
    #[serde(with = "postcard::fixint::le")]
    wavelength: u16,
    counter: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, ripple: Option<Ripple>, wavelength_m: f32) -> RawFrame {
    let known = ripple.filter(|r| r.amplitude_n.is_finite() && r.phase_rad.is_finite());
    frame::seal(
        identifier,
        &Wire {
            amplitude: number::to_u16(known.map(|r| r.amplitude_n), AMPLITUDE_PER_N),
            phase: number::to_i16(known.map(|r| r.phase_rad), PHASE_PER_RAD),
            wavelength: number::to_u16(Some(wavelength_m), WAVELENGTH_PER_M),
            counter: frame::join(counter, 0),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<RippleMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let amplitude_n = number::from_u16(wire.amplitude, AMPLITUDE_PER_N)
        .map_err(|code| Reject::UndefinedCode { field: "amplitude", code })?;
    let wavelength_m = number::from_u16(wire.wavelength, WAVELENGTH_PER_M)
        .map_err(|code| Reject::UndefinedCode { field: "wavelength", code })?;
    let phase_rad = number::from_i16(wire.phase, PHASE_PER_RAD);
    if amplitude_n.is_some() != phase_rad.is_some() {
        return Err(Reject::Contradiction { field: "phase" });
    }
    Ok(RippleMessage { amplitude_n, phase_rad, wavelength_m, counter: frame::only_counter(wire.counter)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn read(frame: RawFrame) -> RippleMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Ripple(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bytes() {
        let wire = Wire { amplitude: 0xFFFF, phase: -32768, wavelength: 0xFFFF, counter: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        let frame = publisher.ripple(Some(Ripple { amplitude_n: 0.213, phase_rad: -1.234_5 }), 14.3e-3);
        assert_eq!(frame, RawFrame { id: 0x385, data: [0xD5, 0x00, 0xC7, 0xCF, 0xDC, 0x37, 0x00, 0xB6] });
        let message = RippleMessage {
            amplitude_n: Some(0.213),
            phase_rad: Some(-1.2345),
            wavelength_m: Some(0.0143),
            counter: 0,
        };
        assert_eq!(read(frame), message);

        let frame = publisher.ripple(None, 14.3e-3);
        assert_eq!(frame, RawFrame { id: 0x385, data: [0xFF, 0xFF, 0x00, 0x80, 0xDC, 0x37, 0x01, 0x73] });
        let message = RippleMessage { amplitude_n: None, phase_rad: None, wavelength_m: Some(0.0143), counter: 1 };
        assert_eq!(read(frame), message);
    }

    #[test]
    fn numbers_saturate_or_are_not_available() {
        let message = read(Publisher::new(NODE).ripple(Some(Ripple { amplitude_n: 99.0, phase_rad: -4.0 }), 0.1));
        assert_eq!(message.amplitude_n, Some(65.531));
        assert_eq!(message.phase_rad, Some(-3.2767));
        assert_eq!(message.wavelength_m, Some(0.065_531));
        let message =
            read(Publisher::new(NODE).ripple(Some(Ripple { amplitude_n: 1.0, phase_rad: f32::NAN }), f32::NAN));
        assert_eq!((message.amplitude_n, message.phase_rad, message.wavelength_m), (None, None, None));
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { amplitude: 0, phase: 0, wavelength: 0, counter: 0, crc: 0 };
        let undefined = |field, code| Reject::UndefinedCode { field, code };
        for (wire, reason) in [
            (Wire { amplitude: 0xFFFD, ..good }, undefined("amplitude", 0xFFFD)),
            (Wire { wavelength: 0xFFFD, ..good }, undefined("wavelength", 0xFFFD)),
            (Wire { counter: 0x10, ..good }, undefined("reserved", 1)),
            (Wire { amplitude: 0xFFFF, ..good }, Reject::Contradiction { field: "phase" }),
            (Wire { phase: -32768, ..good }, Reject::Contradiction { field: "phase" }),
        ] {
            let frame = frame::seal(0x385, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
        }
    }
}
