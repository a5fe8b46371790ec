//! The heartbeat frame, `0x700 + n`: sign of life, reset cause, starts and dropped frames.
//!
//! ```text
//! byte  0     1                 2        4         6                  7
//!      +-----+-------+---------+--------+---------+---------+--------+-----+
//!      | NMT | board | reset   | boots  | frames  | 0       | counter| CRC |
//!      | u8  | 4 bits| cause   | u16    | dropped | 4 bits  | 4 bits | u8  |
//!      |     | 7..4  | 3..0    |        | u16     | 7..4    | 3..0   |     |
//!      +-----+-------+---------+--------+---------+---------+--------+-----+
//! ```
//!
//! Byte 0 is the CANopen heartbeat (CiA 301: 0 boot-up, 5 operational). A master that reads one byte can use it; one
//! that insists on a length of 1 cannot. Both counts stop at 65535.

use crate::Reject;
use crate::frame::{self, LENGTH, RawFrame};
use serde::{Deserialize, Serialize};

/// What started the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ResetCause {
    /// The chip reports none.
    Unknown = 0,
    /// Supply switched on.
    PowerOn = 1,
    /// Reset pin.
    Pin = 2,
    /// Independent watchdog: a task hung.
    Watchdog = 3,
    /// The firmware asked for it, after a panic or on command.
    Software = 4,
    /// Supply dipped.
    BrownOut = 5,
    /// Window watchdog.
    WindowWatchdog = 6,
    /// Illegal entry of a low-power mode.
    LowPower = 7,
}

impl ResetCause {
    /// All causes.
    pub const ALL: [ResetCause; 8] = [
        ResetCause::Unknown,
        ResetCause::PowerOn,
        ResetCause::Pin,
        ResetCause::Watchdog,
        ResetCause::Software,
        ResetCause::BrownOut,
        ResetCause::WindowWatchdog,
        ResetCause::LowPower,
    ];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            ResetCause::Unknown => "unknown",
            ResetCause::PowerOn => "power-on",
            ResetCause::Pin => "pin",
            ResetCause::Watchdog => "watchdog",
            ResetCause::Software => "software",
            ResetCause::BrownOut => "brown-out",
            ResetCause::WindowWatchdog => "window-watchdog",
            ResetCause::LowPower => "low-power",
        }
    }

    /// The cause with this code.
    pub fn from_code(code: u8) -> Option<ResetCause> {
        Self::ALL.into_iter().find(|c| *c as u8 == code)
    }
}

/// Which board the firmware runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum BoardKind {
    /// None of those below, a desk computer for instance.
    Unknown = 0,
    /// STM32F405RG.
    Stm32f405 = 1,
    /// STM32G474RE.
    Stm32g474 = 2,
}

impl BoardKind {
    /// All boards.
    pub const ALL: [BoardKind; 3] = [BoardKind::Unknown, BoardKind::Stm32f405, BoardKind::Stm32g474];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            BoardKind::Unknown => "unknown",
            BoardKind::Stm32f405 => "stm32f405",
            BoardKind::Stm32g474 => "stm32g474",
        }
    }

    /// The board with this code.
    pub fn from_code(code: u8) -> Option<BoardKind> {
        Self::ALL.into_iter().find(|b| *b as u8 == code)
    }
}

/// State of the block as CANopen's network management names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtState {
    /// Started, no estimate yet.
    BootUp = 0,
    /// Estimates are sent.
    Operational = 5,
}

impl NmtState {
    /// The states a block has.
    pub const ALL: [NmtState; 2] = [NmtState::BootUp, NmtState::Operational];

    /// The name used in tables, CSV and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            NmtState::BootUp => "boot-up",
            NmtState::Operational => "operational",
        }
    }

    /// The state with this code; `None` also for CANopen states that a block never has.
    pub fn from_code(code: u8) -> Option<NmtState> {
        Self::ALL.into_iter().find(|s| *s as u8 == code)
    }
}

/// What the firmware sends in a heartbeat frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Health {
    /// What started the block.
    pub reset_cause: ResetCause,
    /// Board that it runs on.
    pub board: BoardKind,
    /// Starts since the supply was switched on, this one included.
    pub boot_count: u16,
    /// Frames that found no free mailbox since the start.
    pub frames_dropped: u32,
    /// Whether estimates are sent.
    pub operational: bool,
}

/// Content of a heartbeat frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HeartbeatMessage {
    /// State of the block.
    pub state: NmtState,
    /// What started the block.
    pub reset_cause: ResetCause,
    /// Board that it runs on.
    pub board: BoardKind,
    /// Starts since the supply was switched on; 65535 stands for that and more.
    pub boot_count: u16,
    /// Frames that found no free mailbox since the start; 65535 stands for that and more.
    pub frames_dropped: u16,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

#[derive(Serialize, Deserialize)]
struct Wire {
    nmt: u8,
    cause_board: u8,
    #[serde(with = "postcard::fixint::le")]
    boot_count: u16,
    #[serde(with = "postcard::fixint::le")]
    frames_dropped: u16,
    counter: u8,
    crc: u8,
}

pub(crate) fn encode(identifier: u16, counter: u8, health: &Health) -> RawFrame {
    let state = if health.operational { NmtState::Operational } else { NmtState::BootUp };
    frame::seal(
        identifier,
        &Wire {
            nmt: state as u8,
            cause_board: frame::join(health.reset_cause as u8, health.board as u8),
            boot_count: health.boot_count,
            frames_dropped: u16::try_from(health.frames_dropped).unwrap_or(u16::MAX),
            counter: frame::join(counter, 0),
            crc: 0,
        },
    )
}

pub(crate) fn decode(data: &[u8; LENGTH]) -> Result<HeartbeatMessage, Reject> {
    let wire: Wire = frame::read(data)?;
    let (cause, board) = frame::split(wire.cause_board);
    let undefined = |field, code: u8| Reject::UndefinedCode { field, code: code.into() };
    Ok(HeartbeatMessage {
        state: NmtState::from_code(wire.nmt).ok_or(undefined("nmt_state", wire.nmt))?,
        reset_cause: ResetCause::from_code(cause).ok_or(undefined("reset_cause", cause))?,
        board: BoardKind::from_code(board).ok_or(undefined("board", board))?,
        boot_count: wire.boot_count,
        frames_dropped: wire.frames_dropped,
        counter: frame::only_counter(wire.counter)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Message, NodeId, Publisher};

    fn read(frame: RawFrame) -> HeartbeatMessage {
        match crate::decode(frame.id, &frame.data) {
            Ok((_, Message::Heartbeat(message))) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn eight_bytes() {
        let wire =
            Wire { nmt: 0xFF, cause_board: 0xFF, boot_count: 0xFFFF, frames_dropped: 0xFFFF, counter: 0xFF, crc: 0xFF };
        assert_eq!(postcard::to_slice(&wire, &mut [0; 16]).unwrap().len(), LENGTH);
    }

    #[test]
    fn literal_bytes_both_ways() {
        let health = Health {
            reset_cause: ResetCause::Watchdog,
            board: BoardKind::Stm32g474,
            boot_count: 7,
            frames_dropped: 70_000,
            operational: true,
        };
        let frame = Publisher::new(NodeId::new(5).unwrap()).heartbeat(&health);
        assert_eq!(frame, RawFrame { id: 0x705, data: [0x05, 0x23, 0x07, 0x00, 0xFF, 0xFF, 0x00, 0xBC] });
        let message = HeartbeatMessage {
            state: NmtState::Operational,
            reset_cause: ResetCause::Watchdog,
            board: BoardKind::Stm32g474,
            boot_count: 7,
            frames_dropped: 65_535,
            counter: 0,
        };
        assert_eq!(read(frame), message);

        let health = Health {
            reset_cause: ResetCause::PowerOn,
            board: BoardKind::Stm32f405,
            boot_count: 1,
            frames_dropped: 0,
            operational: false,
        };
        let frame = Publisher::new(NodeId::LAST).heartbeat(&health);
        assert_eq!(frame, RawFrame { id: 0x77F, data: [0x00, 0x11, 0x01, 0x00, 0x00, 0x00, 0x00, 0x54] });
        let message = HeartbeatMessage {
            state: NmtState::BootUp,
            reset_cause: ResetCause::PowerOn,
            board: BoardKind::Stm32f405,
            boot_count: 1,
            frames_dropped: 0,
            counter: 0,
        };
        assert_eq!(read(frame), message);
    }

    #[test]
    fn every_code_survives() {
        for reset_cause in ResetCause::ALL {
            for board in BoardKind::ALL {
                let health = Health { reset_cause, board, boot_count: 0, frames_dropped: 0, operational: true };
                let message = read(Publisher::new(NodeId::FIRST).heartbeat(&health));
                assert_eq!((message.reset_cause, message.board), (reset_cause, board));
            }
        }
    }

    #[test]
    fn what_no_block_sends_is_rejected() {
        let good = Wire { nmt: 5, cause_board: 0, boot_count: 0, frames_dropped: 0, counter: 0, crc: 0 };
        for (wire, field, code) in [
            (Wire { nmt: 4, ..good }, "nmt_state", 4),
            (Wire { cause_board: 0x08, ..good }, "reset_cause", 8),
            (Wire { cause_board: 0x30, ..good }, "board", 3),
            (Wire { counter: 0xF0, ..good }, "reserved", 15),
        ] {
            let frame = frame::seal(0x705, &wire);
            assert_eq!(crate::decode(frame.id, &frame.data), Err(Reject::UndefinedCode { field, code }));
        }
    }
}
