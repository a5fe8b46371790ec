//! The fault frame, `0x080 + n`: all reasons against the estimate.
//!
//! ```text
//! byte  0          2         3        5      6                  7
//!      +----------+---------+--------+------+---------+--------+-----+
//!      | error    | error   | reasons| lost | 0       | counter| CRC |
//!      | code     | register| u16    |blocks| 4 bits  | 4 bits | u8  |
//!      | u16      | u8      | bit set| u8   | 7..4    | 3..0   |     |
//!      +----------+---------+--------+------+---------+--------+-----+
//! ```
//!
//! Bytes 0 to 2 are the CANopen emergency object (CiA 301), so that a master logs the block's faults like any
//! other device's. Bytes 3 and 4 have bit n set when the reason with code n holds. Lost blocks (10 ms of
//! samples each) are counted since start-up and stop at 255.
//!
//! | reason | error code | class in CiA 301 | register bits |
//! |---|---|---|---|
//! | none | `0x0000` | no error | |
//! | not calibrated | `0x6300` | software, data set | 0 generic, 7 manufacturer |
//! | force at rail | `0x5010` | device hardware | 0, 7 |
//! | force stuck | `0x5011` | device hardware | 0, 7 |
//! | encoder stuck | `0x5012` | device hardware | 0, 7 |
//! | temperature missing | `0x5013` | device hardware | 0, 3 temperature |
//! | temperature out of range | `0x4200` | temperature of the device | 0, 3 |
//! | samples lost | `0x6100` | internal software | 0, 7 |
//! | no motion, reversing, accelerating, settling | `0x0000` | no error: every axis does it | |
//! | speed out of range | `0xFF0C` | device specific | 0, 7 |
//! | load out of range | `0xFF0D` | device specific | 0, 7 |
//! | force assists | `0x9000` | external | 0, 7 |
//! | stale | `0x6101` | internal software | 0, 7 |
//!
//! The error code is that of the most urgent reason that has one, the register joins the bits of all.

use crate::Reject;
use crate::frame::{self, LENGTH, RawFrame};
use model_core::sample::{Reason, Reasons};
use serde::{Deserialize, Serialize};

/// Error register (CiA 301, object 1001h): any error.
const GENERIC: u8 = 1 << 0;
/// Error register: temperature.
const TEMPERATURE: u8 = 1 << 3;
/// Error register: manufacturer's own.
const MANUFACTURER: u8 = 1 << 7;

/// CiA 301 emergency error code of a reason; 0 for reasons of ordinary use, such as standing.
pub const fn error_code(reason: Reason) -> u16 {
    match reason {
        Reason::NotCalibrated => 0x6300,
        Reason::ForceAtRail => 0x5010,
        Reason::ForceStuck => 0x5011,
        Reason::EncoderStuck => 0x5012,
        Reason::TemperatureMissing => 0x5013,
        Reason::TemperatureOutOfRange => 0x4200,
        Reason::SamplesLost => 0x6100,
        Reason::NoMotion | Reason::Reversing | Reason::Accelerating | Reason::Settling => 0x0000,
        Reason::SpeedOutOfRange => 0xFF0C,
        Reason::LoadOutOfRange => 0xFF0D,
        Reason::ForceAssists => 0x9000,
        Reason::Stale => 0x6101,
    }
}

/// Bits of the CiA 301 error register that a reason sets.
pub const fn error_register(reason: Reason) -> u8 {
    match reason {
        Reason::TemperatureMissing | Reason::TemperatureOutOfRange => GENERIC | TEMPERATURE,
        _ if error_code(reason) == 0 => 0,
        _ => GENERIC | MANUFACTURER,
    }
}

/// Content of a fault frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultMessage {
    /// CiA 301 emergency error code; 0 without error.
    pub error_code: u16,
    /// CiA 301 error register; 0 without error.
    pub error_register: u8,
    /// All reasons against the estimate.
    pub reasons: Reasons,
    /// Blocks of samples lost since start-up; 255 stands for that and more.
    pub lost_blocks: u8,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    error_code: u16,
    error_register: u8,
    #[serde(with = "postcard::fixint::le")]
    reasons: u16,
    lost_blocks: u8,
    counter: u8,
    crc: u8,
}

/// Error code and register of a set of reasons.
fn emergency(reasons: Reasons) -> (u16, u8) {
    let code = reasons.iter().map(error_code).find(|code| *code != 0).unwrap_or(0);
    let register = reasons.iter().map(error_register).fold(0, |all, bits| all | bits);
    (code, register)
}

pub(crate) fn encode(identifier: u16, counter: u8, reasons: Reasons, lost_blocks: u32) -> RawFrame {
    let (error_code, error_register) = emergency(reasons);
    frame::seal(
        identifier,
        &Wire {
            error_code,
            error_register,
            reasons: reasons.bits(),
            lost_blocks: u8::try_from(lost_blocks).unwrap_or(u8::MAX),
            counter: frame::join(counter, 0),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<FaultMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let reasons = Reasons::from_bits(wire.reasons);
    if reasons.bits() != wire.reasons {
        return Err(Reject::UndefinedCode { field: "reasons", code: wire.reasons });
    }
    let (error_code, error_register) = emergency(reasons);
    if error_code != wire.error_code {
        return Err(Reject::Contradiction { field: "error_code" });
    }
    if error_register != wire.error_register {
        return Err(Reject::Contradiction { field: "error_register" });
    }
    Ok(FaultMessage {
        error_code,
        error_register,
        reasons,
        lost_blocks: wire.lost_blocks,
        counter: frame::only_counter(wire.counter)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn set(reasons: &[Reason]) -> Reasons {
        let mut set = Reasons::NONE;
        reasons.iter().for_each(|r| set.insert(*r));
        set
    }

    fn read(frame: RawFrame) -> FaultMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Fault(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bytes() {
        let wire = Wire {
            error_code: 0xFFFF,
            error_register: 0xFF,
            reasons: 0xFFFF,
            lost_blocks: 0xFF,
            counter: 0xFF,
            crc: 0xFF,
        };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        for (reasons, lost, data, error_code, error_register, lost_blocks) in [
            (
                set(&[Reason::TemperatureMissing, Reason::NoMotion]),
                300,
                [0x13, 0x50, 0x09, 0x20, 0x01, 0xFF, 0x00, 0xF5],
                0x5013,
                0x09,
                255,
            ),
            (set(&[Reason::NoMotion, Reason::Reversing]), 2, [0x00, 0x00, 0x00, 0x00, 0x03, 0x02, 0x01, 0x3E], 0, 0, 2),
            (
                set(&[Reason::NotCalibrated, Reason::TemperatureOutOfRange]),
                0,
                [0x00, 0x63, 0x89, 0x42, 0x00, 0x00, 0x02, 0x26],
                0x6300,
                0x89,
                0,
            ),
        ] {
            let frame = publisher.fault(reasons, lost);
            assert_eq!(frame, RawFrame { id: 0x085, data });
            let counter = data[6];
            assert_eq!(read(frame), FaultMessage { error_code, error_register, reasons, lost_blocks, counter });
        }
    }

    #[test]
    fn every_set_of_reasons_survives() {
        for bits in (0..=u16::MAX).step_by(2) {
            let reasons = Reasons::from_bits(bits);
            let message = read(Publisher::new(NODE).fault(reasons, 0));
            assert_eq!(message.reasons, reasons);
            // an error code exactly when the register shows an error
            assert_eq!(message.error_code != 0, message.error_register & GENERIC != 0);
            assert_eq!(message.error_code != 0, reasons.iter().any(|r| error_code(r) != 0));
        }
    }

    #[test]
    fn error_codes_are_unambiguous() {
        for (n, a) in Reason::ALL.into_iter().enumerate() {
            for b in &Reason::ALL[..n] {
                assert!(error_code(a) == 0 || error_code(a) != error_code(*b), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { error_code: 0x6300, error_register: 0x81, reasons: 2, lost_blocks: 0, counter: 0, crc: 0 };
        for (wire, reason) in [
            (Wire { reasons: 3, ..good }, Reject::UndefinedCode { field: "reasons", code: 3 }),
            (Wire { counter: 0x10, ..good }, Reject::UndefinedCode { field: "reserved", code: 1 }),
            (Wire { error_code: 0, ..good }, Reject::Contradiction { field: "error_code" }),
            (Wire { error_register: 0, ..good }, Reject::Contradiction { field: "error_register" }),
            (Wire { reasons: 0, ..good }, Reject::Contradiction { field: "error_code" }),
        ] {
            let frame = frame::seal(0x085, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
        }
    }
}
