//! CAN interface of a guide block: its frames, their layout as a DBC, and the parameter record.
//!
//! Classical CAN, 11-bit identifiers, always 8 data bytes, everything little-endian and byte-aligned so that
//! a PLC can map it. The identifiers are those of the CANopen predefined connection set, node `n` = 1 to 127;
//! the smaller identifier wins the bus:
//!
//! | identifier | frame | sent | layout |
//! |---|---|---|---|
//! | `0x080 + n` | fault | when the reasons change, and every second | [`fault`] |
//! | `0x180 + n` | estimate | at the publishing rate | [`estimate`] |
//! | `0x280 + n` | motion | at the publishing rate | [`motion`] |
//! | `0x300 + n` | acting | every second | [`acting`] |
//! | `0x380 + n` | ripple | every second | [`ripple`] |
//! | `0x400 + n` | misfit | every second | [`misfit`] |
//! | `0x480 + n` | burst | while one is under way, below a share of the bus | [`burst`] |
//! | `0x500 + n` | asking, to the block | while a burst is under way | [`burst`] |
//! | `0x580 + n` | service answer | when asked | [`service`] |
//! | `0x600 + n` | service request, to the block | | [`service`] |
//! | `0x680 + n` | state | when it changes, and every second | [`state`](mod@state) |
//! | `0x700 + n` | heartbeat | every half second | [`heartbeat`] |
//!
//! Bursts take the identifiers of the fourth pair of process data, the last ones free in the predefined set; on a
//! G474 a burst may go out as CAN FD frames of 64 bytes under the same identifier. The acting and misfit frames take
//! identifiers of process data sent to a node, of which a block has none. The state frame lies between service and
//! heartbeat, where the set has nothing.
//!
//! All frames but those of service end alike (those of bursts have a sequence number in place of code and count):
//!
//! ```text
//! byte  6              7
//!      +------+-------+-----------------------------------------------------------+
//!      | code | count | CRC-8/AUTOSAR of identifier (2 bytes, low first), bytes 0-6 |
//!      +------+-------+-----------------------------------------------------------+
//! bits  7..4   3..0
//! ```
//!
//! `count` is a 4-bit alive counter, one more in each frame of an identifier; the meaning of `code` depends on the
//! frame. CAN's own CRC guards against errors on the wire; this one against those of gateways and software and against
//! mixed-up identifiers. It finds every error of up to three bits in a frame.
//!
//! A number that is not known is sent as "not available": `0xFFFF` in a u16, `-32768` in an i16. Known
//! numbers are rounded, then saturate at `0xFFFB` and at `±32767`; `0xFFFC` to `0xFFFE` are never sent.
//! Counts have no such code and stop at their largest value.
//!
//! [`Publisher`] makes the block's frames, [`decode`] and [`Alive`] check and read them, [`layout`] is the one table
//! that the DBC is written from.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod acting;
mod alive;
pub mod burst;
mod checksum;
pub mod estimate;
pub mod fault;
mod frame;
pub mod heartbeat;
pub mod layout;
mod message;
pub mod misfit;
pub mod motion;
mod number;
pub mod parameters;
mod publisher;
mod reject;
pub mod ripple;
pub mod service;
pub mod state;

pub use acting::{ActingMessage, Beside, Source};
pub use alive::Alive;
pub use checksum::crc32;
pub use estimate::EstimateMessage;
pub use fault::FaultMessage;
pub use frame::{Kind, NodeId, RawFrame};
pub use heartbeat::{BoardKind, Health, HeartbeatMessage, NmtState, ResetCause};
pub use message::{Message, decode};
pub use misfit::MisfitMessage;
pub use motion::MotionMessage;
pub use publisher::Publisher;
pub use reject::Reject;
pub use ripple::RippleMessage;
pub use state::{StateMessage, Workings};
