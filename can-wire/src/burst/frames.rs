//! Burst segments and asking frames: encoding and decoding.

use super::{ASK_BASE, DATA_BASE};
use crate::Reject;
use crate::frame::{self, LENGTH, NodeId, RawFrame};

/// Bytes of a segment.
pub const SEGMENT: usize = 6;

/// Segments in one FD frame.
pub const FD_SEGMENTS: usize = 10;

/// Bytes of an FD frame.
pub const FD_LENGTH: usize = 64;

/// Number of sequence numbers: they count modulo this.
pub(crate) const MODULUS: u8 = 128;

/// Bit of byte 6 that marks the first segment of a record.
const BEGINS: u8 = 0x80;

/// A piece of the burst, numbered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Segment {
    /// Its number, 0 to 127.
    pub sequence: u8,
    /// Whether a record begins with it.
    pub begins: bool,
    /// Its bytes.
    pub bytes: [u8; SEGMENT],
}

/// A CAN FD frame of 64 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FdFrame {
    /// 11-bit identifier.
    pub id: u16,
    /// The data.
    pub data: [u8; FD_LENGTH],
}

/// Content of an asking frame: how far the desk has received a burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asking {
    /// Sequence number of the first segment that has not arrived yet.
    pub next: u8,
    /// Segments to be sent again: bit i stands for `next + i`. 40 bits.
    pub missing: u64,
    /// Low four bits of the burst's number.
    pub number: u8,
    /// Alive counter, 0 to 15.
    pub counter: u8,
}

impl Segment {
    /// The frame.
    pub fn encode(&self, node: NodeId) -> RawFrame {
        let begins = if self.begins { BEGINS } else { 0 };
        let [b0, b1, b2, b3, b4, b5] = self.bytes;
        closed(DATA_BASE, node, [b0, b1, b2, b3, b4, b5, begins | self.sequence & !BEGINS, 0])
    }

    /// Checks and reads a frame.
    ///
    /// # Errors
    /// [`Reject::UnknownIdentifier`], [`Reject::NodeRange`], [`Reject::Length`], [`Reject::Crc`], in this order.
    pub fn decode(id: u16, data: &[u8]) -> Result<(NodeId, Segment), Reject> {
        let node = node_of(DATA_BASE, id)?;
        let [b0, b1, b2, b3, b4, b5, number, _] = *frame::open(id, data)?;
        let segment =
            Segment { sequence: number & !BEGINS, begins: number & BEGINS != 0, bytes: [b0, b1, b2, b3, b4, b5] };
        Ok((node, segment))
    }
}

impl FdFrame {
    /// Puts segments with consecutive numbers into one frame; those after the tenth are left out.
    pub fn encode(node: NodeId, segments: &[Segment]) -> FdFrame {
        let id = DATA_BASE + u16::from(node.get());
        let mut data = [0; FD_LENGTH];
        let mut flags = 0_u16;
        for ((n, segment), place) in segments.iter().enumerate().zip(data.as_chunks_mut::<SEGMENT>().0) {
            if n < FD_SEGMENTS {
                *place = segment.bytes;
                flags = (flags & 0xFFF | u16::from(segment.begins) << n) | (n as u16 + 1) << 12;
            }
        }
        let [low, high] = flags.to_le_bytes();
        let first = segments.first().map_or(0, |s| s.sequence);
        let [.., s, f0, f1, _] = &mut data;
        (*s, *f0, *f1) = (first, low, high);
        data[FD_LENGTH - 1] = frame::crc_of(id, &data[..FD_LENGTH - 1]);
        FdFrame { id, data }
    }

    /// Checks and reads a frame: the segments, in order.
    ///
    /// # Errors
    /// As [`Segment::decode`], and [`Reject::UndefinedCode`] for a count of 0 or above 10.
    pub fn decode(id: u16, data: &[u8]) -> Result<(NodeId, impl Iterator<Item = Segment> + '_), Reject> {
        let node = node_of(DATA_BASE, id)?;
        let whole: &[u8; FD_LENGTH] = data.try_into().map_err(|_| Reject::Length(data.len()))?;
        let [rest @ .., found] = whole;
        let expected = frame::crc_of(id, rest);
        if expected != *found {
            return Err(Reject::Crc { expected, found: *found });
        }
        let [bytes @ .., first, low, high] = rest;
        let flags = u16::from_le_bytes([*low, *high]);
        let (count, first) = (usize::from(flags >> 12), *first);
        if !(1..=FD_SEGMENTS).contains(&count) {
            return Err(Reject::UndefinedCode { field: "segments", code: flags >> 12 });
        }
        if first >= MODULUS {
            return Err(Reject::UndefinedCode { field: "sequence", code: first.into() });
        }
        let segments = bytes.as_chunks::<SEGMENT>().0.iter().take(count).enumerate().map(move |(n, bytes)| Segment {
            sequence: first.wrapping_add(n as u8) % MODULUS,
            begins: flags >> n & 1 != 0,
            bytes: *bytes,
        });
        Ok((node, segments))
    }
}

impl Asking {
    /// The frame.
    pub fn encode(&self, node: NodeId) -> RawFrame {
        let [m0, m1, m2, m3, m4, ..] = self.missing.to_le_bytes();
        let last = frame::join(self.counter, self.number & 0xF);
        closed(ASK_BASE, node, [self.next, m0, m1, m2, m3, m4, last, 0])
    }

    /// Checks and reads a frame.
    ///
    /// # Errors
    /// As [`Segment::decode`], and [`Reject::UndefinedCode`] for a sequence above 127.
    pub fn decode(id: u16, data: &[u8]) -> Result<(NodeId, Asking), Reject> {
        let node = node_of(ASK_BASE, id)?;
        let [next, m0, m1, m2, m3, m4, last, _] = *frame::open(id, data)?;
        if next >= MODULUS {
            return Err(Reject::UndefinedCode { field: "next", code: next.into() });
        }
        let (counter, number) = frame::split(last);
        Ok((node, Asking { next, missing: u64::from_le_bytes([m0, m1, m2, m3, m4, 0, 0, 0]), number, counter }))
    }
}

/// The node, when the identifier is one of this base.
fn node_of(base: u16, id: u16) -> Result<NodeId, Reject> {
    let offset = id.checked_sub(base).filter(|offset| *offset < 0x80).ok_or(Reject::UnknownIdentifier(id))?;
    let [low, _] = offset.to_le_bytes();
    NodeId::new(low).ok_or(Reject::NodeRange)
}

/// The frame with its CRC.
fn closed(base: u16, node: NodeId, mut data: [u8; LENGTH]) -> RawFrame {
    let id = base + u16::from(node.get());
    data[LENGTH - 1] = frame::crc_of(id, &data[..LENGTH - 1]);
    RawFrame { id, data }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const NODE: NodeId = NodeId::new(5).unwrap();

    fn segment(n: u8) -> Segment {
        Segment { sequence: n % MODULUS, begins: n.is_multiple_of(3), bytes: [n, 1, 2, 3, 4, n] }
    }

    #[test]
    fn a_segment_is_laid_out_as_drawn() {
        let frame = Segment { sequence: 0x25, begins: true, bytes: [1, 2, 3, 4, 5, 6] }.encode(NODE);
        assert_eq!((frame.id, &frame.data[..7]), (0x485, &[1, 2, 3, 4, 5, 6, 0xA5][..]));
        let frame = Asking { next: 7, missing: 0x01_0000_8001, number: 0x1F, counter: 9 }.encode(NODE);
        assert_eq!((frame.id, &frame.data[..7]), (0x505, &[7, 1, 0x80, 0, 0, 1, 0xF9][..]));
    }

    #[test]
    fn frames_survive_the_way_there_and_back_and_no_flipped_bit_does() {
        for n in 0..MODULUS {
            let frame = segment(n).encode(NODE);
            assert_eq!(Segment::decode(frame.id, &frame.data), Ok((NODE, segment(n))));
            let asking = Asking { next: n, missing: 0xFF_0000_0000 | u64::from(n), number: n & 0xF, counter: 3 };
            let frame = asking.encode(NODE);
            assert_eq!(Asking::decode(frame.id, &frame.data), Ok((NODE, asking)));
            for bit in 0..64 {
                let mut bad = frame.data;
                bad[bit / 8] ^= 1 << (bit % 8);
                assert!(matches!(Asking::decode(frame.id, &bad), Err(Reject::Crc { .. })));
            }
        }
        assert_eq!(Segment::decode(0x505, &[0; 8]), Err(Reject::UnknownIdentifier(0x505)));
        assert_eq!(Segment::decode(0x480, &[0; 8]), Err(Reject::NodeRange));
        assert_eq!(Segment::decode(0x481, &[0; 7]), Err(Reject::Length(7)));
    }

    #[test]
    fn ten_segments_fit_an_fd_frame() {
        for (first, count) in [(0, 1), (120, 10), (5, 7)] {
            let segments: Vec<Segment> = (first..first + count).map(segment).collect();
            let frame = FdFrame::encode(NODE, &segments);
            let (node, read) = FdFrame::decode(frame.id, &frame.data).unwrap();
            assert_eq!((node, read.collect::<Vec<_>>()), (NODE, segments));
            for bit in 0..512 {
                let mut bad = frame.data;
                bad[bit / 8] ^= 1 << (bit % 8);
                assert!(matches!(FdFrame::decode(frame.id, &bad).map(|_| ()), Err(Reject::Crc { .. })));
            }
        }
        let none = FdFrame::encode(NODE, &[]);
        assert!(matches!(FdFrame::decode(none.id, &none.data).map(|_| ()), Err(Reject::UndefinedCode { .. })));
    }
}
