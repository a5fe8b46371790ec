//! Identifier, alive counter and CRC: what all frames have in common.

use crate::Reject;
use crc::{CRC_8_AUTOSAR, Crc};
use serde::{Serialize, de::DeserializeOwned};

/// Length of every frame's data.
pub(crate) const LENGTH: usize = 8;

/// Index of the CRC byte.
const CRC_AT: usize = LENGTH - 1;

/// Bits of an identifier that hold the node; the others give the kind.
const NODE_BITS: u16 = 0x7F;

/// A static, so that the table of 256 bytes stays in flash.
static CRC8: Crc<u8> = Crc::<u8>::new(&CRC_8_AUTOSAR);

/// A block's address on the bus, 1 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

impl NodeId {
    /// Node 1, which a block without parameter record uses.
    pub const FIRST: NodeId = NodeId(1);

    /// The last node, 127.
    pub const LAST: NodeId = NodeId(127);

    /// `None` for 0 (CANopen: all nodes) and above 127.
    pub const fn new(n: u8) -> Option<NodeId> {
        if n >= Self::FIRST.0 && n <= Self::LAST.0 { Some(NodeId(n)) } else { None }
    }

    /// The number, 1 to 127.
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// The kinds of frames, in the order in which they win the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// What is wrong, and since when samples were lost.
    Fault,
    /// Preload with its standard deviation, drag force, quality.
    Estimate,
    /// Speed, temperature, time, what the carriage does.
    Motion,
    /// Mechanisms that act beside the drag law.
    Acting,
    /// Ball-pass ripple of the drag force.
    Ripple,
    /// Whether the model fits.
    Misfit,
    /// Parameter image in use, and changes made on the block.
    State,
    /// Sign of life, reset cause, losses.
    Heartbeat,
}

impl Kind {
    /// All kinds, highest priority first.
    pub const ALL: [Kind; 8] = [
        Kind::Fault,
        Kind::Estimate,
        Kind::Motion,
        Kind::Acting,
        Kind::Ripple,
        Kind::Misfit,
        Kind::State,
        Kind::Heartbeat,
    ];

    /// The identifier without its node.
    pub const fn base(self) -> u16 {
        match self {
            Kind::Fault => 0x080,
            Kind::Estimate => 0x180,
            Kind::Motion => 0x280,
            Kind::Acting => 0x300,
            Kind::Ripple => 0x380,
            Kind::Misfit => 0x400,
            Kind::State => 0x680,
            Kind::Heartbeat => 0x700,
        }
    }

    /// The identifier of this kind of frame from `node`.
    pub fn identifier(self, node: NodeId) -> u16 {
        self.base() + u16::from(node.0)
    }

    /// Kind and node of an identifier.
    ///
    /// # Errors
    /// [`Reject::UnknownIdentifier`] when no kind has it, [`Reject::NodeRange`] when its node is 0.
    pub fn of(identifier: u16) -> Result<(Kind, NodeId), Reject> {
        let base = identifier & !NODE_BITS;
        let kind = Self::ALL.into_iter().find(|k| k.base() == base).ok_or(Reject::UnknownIdentifier(identifier))?;
        let [low, _] = (identifier & NODE_BITS).to_le_bytes();
        Ok((kind, NodeId::new(low).ok_or(Reject::NodeRange)?))
    }
}

/// A frame as a controller sends and receives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawFrame {
    /// 11-bit identifier.
    pub id: u16,
    /// The data; every frame has 8 bytes.
    pub data: [u8; LENGTH],
}

/// CRC over the identifier and all data but the CRC itself.
fn crc(identifier: u16, data: &[u8; LENGTH]) -> u8 {
    crc_of(identifier, &data[..CRC_AT])
}

/// CRC over the identifier and these bytes.
pub(crate) fn crc_of(identifier: u16, bytes: &[u8]) -> u8 {
    let mut digest = CRC8.digest();
    digest.update(&identifier.to_le_bytes());
    digest.update(bytes);
    digest.finalize()
}

/// Lays out `wire` and puts the CRC over its last byte.
///
/// All wire structs have 8 bytes, which their tests assert. Should one not fit after all, all bytes stay 0xFF, which no
/// receiver accepts: the CRC is wrong.
pub(crate) fn seal<T: Serialize>(identifier: u16, wire: &T) -> RawFrame {
    let mut data = [0xFF; LENGTH];
    if postcard::to_slice(wire, &mut data).is_ok() {
        data[CRC_AT] = crc(identifier, &data);
    }
    RawFrame { id: identifier, data }
}

/// Checks length and CRC.
pub(crate) fn open(identifier: u16, data: &[u8]) -> Result<&[u8; LENGTH], Reject> {
    let data: &[u8; LENGTH] = data.try_into().map_err(|_| Reject::Length(data.len()))?;
    let expected = crc(identifier, data);
    let found = data[CRC_AT];
    if expected == found { Ok(data) } else { Err(Reject::Crc { expected, found }) }
}

/// Reads a wire struct of 8 bytes.
pub(crate) fn read<T: DeserializeOwned>(data: &[u8; LENGTH]) -> Result<T, Reject> {
    postcard::from_bytes(data).map_err(|_| Reject::Length(LENGTH))
}

/// Byte 6: the alive counter in the lower four bits, the frame's code in the upper four. Both are cut to four bits.
pub(crate) fn join(counter: u8, code: u8) -> u8 {
    (counter & 0xF) | (code << 4)
}

/// Alive counter and code from byte 6.
pub(crate) fn split(byte: u8) -> (u8, u8) {
    (byte & 0xF, byte >> 4)
}

/// Alive counter from a byte 6 without code.
///
/// # Errors
/// [`Reject::UndefinedCode`] when the upper four bits are not 0.
pub(crate) fn only_counter(byte: u8) -> Result<u8, Reject> {
    match split(byte) {
        (counter, 0) => Ok(counter),
        (_, code) => Err(Reject::UndefinedCode { field: "reserved", code: code.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Health, Publisher, decode, heartbeat};

    fn node(n: u8) -> NodeId {
        NodeId::new(n).unwrap()
    }

    fn a_frame() -> RawFrame {
        let health = Health {
            reset_cause: heartbeat::ResetCause::PowerOn,
            board: heartbeat::BoardKind::Stm32f405,
            boot_count: 1,
            frames_dropped: 0,
            operational: true,
        };
        Publisher::new(node(5)).heartbeat(&health)
    }

    #[test]
    fn nodes_are_1_to_127() {
        for n in 0..=255 {
            assert_eq!(NodeId::new(n).map(NodeId::get), (1..=127).contains(&n).then_some(n));
        }
    }

    #[test]
    fn any_block_s_fault_wins_over_any_estimate_and_so_on() {
        for pair in Kind::ALL.windows(2) {
            assert!(pair[0].identifier(NodeId::LAST) < pair[1].identifier(NodeId::FIRST));
        }
        for (n, kind) in Kind::ALL.into_iter().enumerate() {
            // the counters of Publisher and Alive are indexed by it
            assert_eq!(kind as usize, n);
        }
        let ids = [0x085, 0x185, 0x285, 0x305, 0x385, 0x405, 0x685, 0x705];
        assert_eq!(Kind::ALL.map(|k| k.identifier(node(5))), ids);
    }

    #[test]
    fn every_identifier_has_one_meaning() {
        let mut ours = 0;
        for id in 0..=u16::MAX {
            match Kind::of(id) {
                Ok((kind, node)) => {
                    assert_eq!(kind.identifier(node), id);
                    ours += 1;
                }
                Err(Reject::NodeRange) => assert!(Kind::ALL.iter().any(|k| k.base() == id)),
                Err(e) => assert_eq!(e, Reject::UnknownIdentifier(id)),
            }
        }
        assert_eq!(ours, 8 * 127);
    }

    #[test]
    fn crc_is_that_of_autosar() {
        // check value of the catalogue, and of AUTOSAR's specification: "123456789"
        assert_eq!(CRC8.checksum(b"123456789"), 0xDF);
        // the identifier goes first, low byte first
        assert_eq!(crc(0x3231, b"3456789?"), 0xDF);
    }

    #[test]
    fn every_error_of_up_to_three_bits_is_found() {
        let good = a_frame();
        let flip = |frame: &mut RawFrame, bit: usize| match bit.checked_sub(64) {
            None => frame.data[bit / 8] ^= 1 << (bit % 8),
            Some(bit) => frame.id ^= 1 << bit,
        };
        const BITS: usize = 64 + 11;
        let mut tried = 0;
        for a in 0..BITS {
            // a bit flipped twice makes an error of fewer bits
            for b in a..BITS {
                for c in b..BITS {
                    let mut bad = good;
                    [a, b, c].into_iter().for_each(|bit| flip(&mut bad, bit));
                    assert!(open(bad.id, &bad.data).is_err(), "{a} {b} {c}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, BITS * (BITS + 1) * (BITS + 2) / 6);
        assert!(open(good.id, &good.data).is_ok());
    }

    #[test]
    fn every_flipped_bit_is_rejected_for_its_reason() {
        let good = a_frame();
        for bit in 0..64 {
            let mut bad = good;
            bad.data[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(decode(bad.id, &bad.data), Err(Reject::Crc { .. })), "{bit}");
        }
        for bit in 0..11 {
            let id = good.id ^ 1 << bit;
            match (Kind::of(id), decode(id, &good.data)) {
                (Ok(_), Err(Reject::Crc { .. })) => {}
                (Err(reason), rejected) => assert_eq!(rejected, Err(reason), "{bit}"),
                other => panic!("{bit}: {other:?}"),
            }
        }
    }

    #[test]
    fn other_lengths_are_rejected() {
        let data = [0; 64];
        for length in (0..=64).filter(|n| *n != 8) {
            assert_eq!(decode(0x185, &data[..length]), Err(Reject::Length(length)));
        }
        assert_eq!(decode(0x123, &data[..3]), Err(Reject::UnknownIdentifier(0x123)));
        assert_eq!(decode(0x180, &data[..3]), Err(Reject::NodeRange));
    }

    #[test]
    fn byte_6_holds_two_halves() {
        for byte in 0..=255 {
            let (counter, code) = split(byte);
            assert!(counter < 16 && code < 16);
            assert_eq!(join(counter, code), byte);
            assert_eq!(only_counter(byte).ok(), (code == 0).then_some(counter));
        }
    }
}
