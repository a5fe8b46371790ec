//! Bursts: all raw samples of a period, sent over the bus without loss.
//!
//! A block keeps its newest raw samples in a ring in memory. A burst of N blocks (10 ms each, some of them already
//! past when it starts) is packed without loss ([`pack`]), cut into segments of six bytes, numbered, and sent
//! from `0x480 + n`, one segment a frame. The desk reports on `0x500 + n` up to where it has everything and what
//! it lacks; the block keeps each segment until it is reported as received.
//!
//! ```text
//! data, 0x480 + n, block to desk
//! byte  0                    6                         7
//!      +--------------------+--------+----------------+-----+
//!      | segment            | begins | sequence       | CRC |
//!      | 6 bytes            | bit 7  | bits 6..0      | u8  |
//!      +--------------------+--------+----------------+-----+
//!
//! asking, 0x500 + n, desk to block
//! byte  0          1                            6                  7
//!      +----------+----------------------------+---------+--------+-----+
//!      | next     | missing: bit i stands for  | burst   | counter| CRC |
//!      | sequence | next + i, 40 bits          | number  | 3..0   | u8  |
//!      |          |                            | 7..4    |        |     |
//!      +----------+----------------------------+---------+--------+-----+
//!
//! data on CAN FD, 64 bytes, same identifier
//! byte  0                    60         61                       63
//!      +--------------------+----------+------------------------+-----+
//!      | 1 to 10 segments   | sequence | begins: bits 0..9,     | CRC |
//!      |                    | of first | how many: bits 12..15  | u8  |
//!      +--------------------+----------+------------------------+-----+
//! ```
//!
//! The CRC is the one of all frames. `begins` marks the first segment of a record, so that a receiver that joins late
//! finds the next one. A burst starts at sequence 0 with a header, ends with a trailer that holds the CRC-32 of all
//! segments before it, and has blocks in between ([`Record`]). At most [`WINDOW`] segments are under way.
//!
//! **Identifiers and bus load**: the identifiers are those of CANopen's fourth pair of process data, in priority below
//! everything cyclic but above service answers and heartbeats. Bursts never take more of the bus than the load limit, a
//! fifth as delivered (object 2007.3). A bus-off or a slow desk costs time; a ring that fills up meanwhile leaves
//! blocks out, which shows in their ticks and in the trailer. A segment that has been numbered arrives, or the burst
//! ends. A burst that is no longer than the ring is therefore always whole.

pub mod frames;
pub mod pack;
mod receiver;
mod ring;
mod sender;

pub use frames::{FdFrame, SEGMENT};
pub use pack::{Cause, Header, Record, Trailer};
pub use receiver::Receiver;
pub use sender::{Sender, State};

/// Identifier of segments, without the node.
pub const DATA_BASE: u16 = 0x480;

/// Identifier of asking frames, without the node.
pub const ASK_BASE: u16 = 0x500;

/// Segments that may be under way: as many as one asking frame can name.
pub const WINDOW: usize = 40;

/// Bits of a frame with eight bytes and an 11-bit identifier, with the largest number of stuff bits and the interframe
/// space behind it.
pub const FRAME_BITS: u32 = 135;

/// What a burst is to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Order {
    /// Blocks of 10 ms in all.
    pub blocks: u16,
    /// How many of these have already been sampled, as far as the ring still has them; at most 32767.
    pub past: u16,
    /// Whether a desk sends asking frames for what got lost. Otherwise every segment is sent once.
    pub asked: bool,
}

impl Order {
    /// Bit that marks an order without asking frames.
    const UNASKED: u32 = 1 << 31;

    /// Reads the value of object 2007.1.
    pub const fn of(value: u32) -> Order {
        let [b0, b1, p0, p1] = value.to_le_bytes();
        Order {
            blocks: u16::from_le_bytes([b0, b1]),
            past: u16::from_le_bytes([p0, p1 & 0x7F]),
            asked: value & Self::UNASKED == 0,
        }
    }

    /// The value of object 2007.1.
    pub const fn value(self) -> u32 {
        let [b0, b1] = self.blocks.to_le_bytes();
        let [p0, p1] = self.past.to_le_bytes();
        let value = u32::from_le_bytes([b0, b1, p0, p1 & 0x7F]);
        if self.asked { value } else { value | Self::UNASKED }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_survive_the_way_there_and_back() {
        for (blocks, past, asked, value) in [
            (0, 0, true, 0),
            (100, 30, true, 0x001E_0064),
            (0xFFFF, 0x7FFF, false, 0xFFFF_FFFF),
            (1, 0, false, 0x8000_0001),
        ] {
            let order = Order { blocks, past, asked };
            assert_eq!(order.value(), value);
            assert_eq!(Order::of(value), order);
        }
    }
}
