//! The motion frame, `0x280 + n`: what the carriage did while the estimate was taken.
//!
//! ```text
//! byte  0         2           4        6                  7
//!      +---------+-----------+--------+---------+--------+-----+
//!      | speed   |temperature| time   | motion  | counter| CRC |
//!      | i16     | i16       | u16    | 4 bits  | 4 bits | u8  |
//!      | 0.1 mm/s| 0.01 degC | 10 us  | 7..4    | 3..0   |     |
//!      +---------+-----------+--------+---------+--------+-----+
//! ```
//!
//! Speed reaches ±3.2767 m/s, as the fastest guides do; the price is a rounding of up to 0.05 mm/s, 3 % of
//! the slowest calibrated speed. The estimate itself is made from the unrounded speed.
//! Time is that of the newest block of samples in the estimate, `tick·1000 mod 65536`: it wraps every 0.65536 s and has
//! no "not available" code. It ties the frame to its estimate frame; the times of different guide blocks are unrelated.
//! Motion is the code of [`Motion`].

use crate::frame::{self, LENGTH, RawFrame};
use crate::{Reject, number};
use model_core::sample::{BLOCK_HZ, Estimate, Motion};
use serde::{Deserialize, Serialize};

/// Counts per m/s.
const SPEED_PER_M_S: f32 = 10_000.0;

/// Counts per °C.
const TEMPERATURE_PER_DEGC: f32 = 100.0;

/// Microseconds per count of time.
const TIME_US: u32 = 10;

/// Counts of time per tick.
const TIME_PER_TICK: u32 = 1_000_000 / TIME_US / BLOCK_HZ;

/// Content of a motion frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionMessage {
    /// Carriage speed, m/s, to 0.1 mm/s; ±3.2767 stands for that and more.
    pub speed_m_s: Option<f32>,
    /// Temperature of the block, °C, to 0.01; ±327.67 stands for that and more.
    pub temperature_degc: Option<f32>,
    /// Time of the newest block in the estimate, µs, 0 to 655 350 in steps of 10, then 0 again.
    pub time_us: u32,
    /// What the carriage does.
    pub motion: Motion,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    #[serde(with = "postcard::fixint::le")]
    speed: i16,
    #[serde(with = "postcard::fixint::le")]
    temperature: i16,
    #[serde(with = "postcard::fixint::le")]
    time: u16,
    counter_motion: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, estimate: &Estimate) -> RawFrame {
    let [low, high, ..] = estimate.tick.wrapping_mul(TIME_PER_TICK).to_le_bytes();
    frame::seal(
        identifier,
        &Wire {
            speed: number::to_i16(estimate.speed_m_s.map(|m| m.value), SPEED_PER_M_S),
            temperature: number::to_i16(estimate.temperature_degc, TEMPERATURE_PER_DEGC),
            time: u16::from_le_bytes([low, high]),
            counter_motion: frame::join(counter, estimate.motion as u8),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<MotionMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let (counter, code) = frame::split(wire.counter_motion);
    Ok(MotionMessage {
        speed_m_s: number::from_i16(wire.speed, SPEED_PER_M_S),
        temperature_degc: number::from_i16(wire.temperature, TEMPERATURE_PER_DEGC),
        time_us: u32::from(wire.time) * TIME_US,
        motion: Motion::from_code(code).ok_or(Reject::UndefinedCode { field: "motion", code: code.into() })?,
        counter,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};
    use model_core::sample::{Measured, Reasons};

    const NODE: NodeId = NodeId::new(5).unwrap();

    const BACKWARD: Estimate = Estimate {
        tick: 1_234_567,
        preload_n: None,
        drag_force_n: None,
        speed_m_s: Some(Measured { value: -0.083_32, sigma: 1e-4 }),
        temperature_degc: Some(31.412),
        motion: Motion::Backward,
        reasons: Reasons::NONE,
    };

    fn read(frame: RawFrame) -> MotionMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((NODE, Message::Motion(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bytes() {
        let wire = Wire { speed: -32768, temperature: -32768, time: 0xFFFF, counter_motion: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let mut publisher = Publisher::new(NODE);
        let frame = publisher.motion(&BACKWARD);
        assert_eq!(frame, RawFrame { id: 0x285, data: [0xBF, 0xFC, 0x45, 0x0C, 0x58, 0xFF, 0x30, 0xC1] });
        let message = MotionMessage {
            speed_m_s: Some(-0.0833),
            temperature_degc: Some(31.41),
            time_us: 653_680,
            motion: Motion::Backward,
            counter: 0,
        };
        assert_eq!(read(frame), message);

        let silent = Estimate { tick: 0, speed_m_s: None, temperature_degc: None, motion: Motion::Unknown, ..BACKWARD };
        let frame = publisher.motion(&silent);
        assert_eq!(frame, RawFrame { id: 0x285, data: [0x00, 0x80, 0x00, 0x80, 0x00, 0x00, 0x01, 0xA2] });
        let message =
            MotionMessage { speed_m_s: None, temperature_degc: None, time_us: 0, motion: Motion::Unknown, counter: 1 };
        assert_eq!(read(frame), message);
    }

    #[test]
    fn time_advances_by_ten_milliseconds_a_tick_also_when_ticks_wrap() {
        let time = |tick| read(Publisher::new(NODE).motion(&Estimate { tick, ..BACKWARD })).time_us;
        for tick in [0, 64, 65, 65_535, u32::MAX - 1, u32::MAX] {
            let step = (time(u32::wrapping_add(tick, 1)) + 655_360 - time(tick)) % 655_360;
            assert_eq!(step, 10_000, "{tick}");
        }
    }

    #[test]
    fn numbers_saturate_and_every_motion_has_its_code() {
        for motion in Motion::ALL {
            let speed_m_s = Some(Measured { value: 4.0, sigma: 0.0 });
            let fast = Estimate { speed_m_s, temperature_degc: Some(-400.0), motion, ..BACKWARD };
            let message = read(Publisher::new(NODE).motion(&fast));
            assert_eq!(message.speed_m_s, Some(3.2767));
            assert_eq!(message.temperature_degc, Some(-327.67));
            assert_eq!(message.motion, motion);
        }
        let frame = frame::seal(0x285, &Wire { speed: 0, temperature: 0, time: 0, counter_motion: 0x60, crc: 0 });
        let reason = Reject::UndefinedCode { field: "motion", code: 6 };
        assert_eq!(crate::decode(frame.id, &frame.data), Err(reason));
    }
}
