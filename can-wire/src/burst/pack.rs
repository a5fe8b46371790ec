//! Lossless packing of the records of a burst.
//!
//! Bits fill bytes from the lowest up. The first two bits give the kind; unused bits of the last segment are 0.
//!
//! ```text
//! block    2 bits: 0 | tick 32 | first force, temperature, position, step 16 each | widths f, t, p 5 each |
//!          15 force differences of f bits | 15 temperature differences of t bits |
//!          14 differences of position steps of p bits
//! header   2 bits: 1 | version 6 | number 8 | cause 8 | blocks 16 | past 16 | image 32
//! trailer  2 bits: 2 | 0, 6 bits | blocks 16 | dropped 16 | CRC-32 of all segments before it
//! ```
//!
//! Differences are taken modulo 2^16 and folded so that small ones of both signs are small numbers
//! (0, -1, 1, -2, ... as 0, 1, 2, 3, ...). A block at rest takes 15 bytes, one in motion with a few codes of noise
//! about 28, one of pure noise 103.

use super::frames::SEGMENT;
use model_core::sample::{RawBlock, SAMPLES_PER_BLOCK};

/// Layout of all records.
pub const VERSION: u8 = 1;

/// Segments of the longest record.
pub const MAX_SEGMENTS: usize = 18;

/// Bytes of the longest record.
pub(crate) const MAX_BYTES: usize = MAX_SEGMENTS * SEGMENT;

/// Segments of a header, and of a trailer.
pub(crate) const END_SEGMENTS: usize = 2;

/// Bits of a block before its differences.
const BLOCK_HEAD: usize = 2 + 32 + 4 * 16 + 3 * 5;

/// Differences of position steps that are written: the first step is written whole.
const STEPS: usize = SAMPLES_PER_BLOCK - 2;

/// Why a burst was started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Cause {
    /// A client ordered it.
    Command = 0,
    /// The block noticed that its model does not fit.
    Notice = 1,
}

/// Record before the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Counts the bursts of a block, modulo 256.
    pub number: u8,
    /// Why it was started.
    pub cause: Cause,
    /// Blocks ordered.
    pub blocks: u16,
    /// How many of these were already sampled when it started.
    pub past: u16,
    /// Hash of the parameter image the block worked with.
    pub image: u32,
}

/// Record after the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trailer {
    /// Blocks sent.
    pub blocks: u16,
    /// Blocks that found no room in the ring; 65535 stands for that and more.
    pub dropped: u16,
    /// CRC-32 of all segments before the trailer.
    pub crc: u32,
}

/// A unit of meaning in a burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Record {
    /// The beginning.
    Header(Header),
    /// Sixteen samples.
    Block(RawBlock),
    /// The end.
    Trailer(Trailer),
}

/// A record as bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packed {
    bytes: [u8; MAX_BYTES],
    bits: usize,
}

impl Packed {
    const fn new() -> Self {
        Packed { bytes: [0; MAX_BYTES], bits: 0 }
    }

    /// Its segments.
    pub fn segments(&self) -> &[[u8; SEGMENT]] {
        let (segments, _) = self.bytes.as_chunks::<SEGMENT>();
        segments.get(..self.bits.div_ceil(8 * SEGMENT)).unwrap_or_default()
    }

    /// Appends the lowest `width` bits, at most 16. Not inlined: the firmware would hold thirty copies of it.
    #[inline(never)]
    fn put(&mut self, value: u16, width: u32) {
        let shifted = u32::from(value) << (self.bits % 8);
        let from = self.bits / 8;
        for (place, byte) in self.bytes.iter_mut().skip(from).zip(shifted.to_le_bytes()).take(3) {
            *place |= byte;
        }
        self.bits += width as usize;
    }

    fn put_u32(&mut self, value: u32) {
        let [b0, b1, b2, b3] = value.to_le_bytes();
        self.put(u16::from_le_bytes([b0, b1]), 16);
        self.put(u16::from_le_bytes([b2, b3]), 16);
    }
}

/// Packs a block.
#[inline(never)]
pub fn pack_block(block: &RawBlock) -> Packed {
    let mut packed = Packed::new();
    packed.put(0, 2);
    packed.put_u32(block.tick);
    let (force, temperature) = (differences(&block.force), differences(&block.temperature));
    let steps = steps(&block.position);
    let [f0, t0, p0] = [&block.force, &block.temperature, &block.position].map(|channel| channel[0]);
    for first in [f0, t0, p0, block.position[1].wrapping_sub(p0)] {
        packed.put(first, 16);
    }
    let widths = [width(&force), width(&temperature), width(&steps)];
    for width in widths {
        packed.put(width as u16, 5);
    }
    let [wide_force, wide_temperature, wide_steps] = widths;
    force.iter().for_each(|d| packed.put(*d, wide_force));
    temperature.iter().for_each(|d| packed.put(*d, wide_temperature));
    steps.iter().for_each(|d| packed.put(*d, wide_steps));
    packed
}

/// Packs a header.
#[inline(never)]
pub fn pack_header(header: &Header) -> Packed {
    let mut packed = Packed::new();
    packed.put(1, 2);
    packed.put(VERSION.into(), 6);
    packed.put(header.number.into(), 8);
    packed.put(header.cause as u16, 8);
    packed.put(header.blocks, 16);
    packed.put(header.past, 16);
    packed.put_u32(header.image);
    packed
}

/// Packs a trailer.
#[inline(never)]
pub fn pack_trailer(trailer: &Trailer) -> Packed {
    let mut packed = Packed::new();
    packed.put(2, 8);
    packed.put(trailer.blocks, 16);
    packed.put(trailer.dropped, 16);
    packed.put_u32(trailer.crc);
    packed
}

/// Reads a record from those of its segments that have arrived so far.
///
/// `None` while segments are missing, `Some(None)` if they are no record of this version.
pub fn unpack(bytes: &[u8]) -> Option<Option<Record>> {
    let mut bits = Bits { bytes, at: 0 };
    match bits.take(2)? {
        0 => block(&mut bits).map(|block| block.map(Record::Block)),
        1 => header(&mut bits).map(|header| header.map(Record::Header)),
        2 => {
            let reserved = bits.take(6)?;
            let trailer = Trailer { blocks: bits.take(16)?, dropped: bits.take(16)?, crc: bits.take_u32()? };
            Some((reserved == 0).then_some(Record::Trailer(trailer)))
        }
        _ => Some(None),
    }
}

/// The number of the burst, when this is the first segment of a header.
pub(crate) fn number_of_header(segment: &[u8; SEGMENT]) -> Option<u8> {
    let [kind, number, ..] = *segment;
    (kind == 1 | VERSION << 2).then_some(number)
}

fn header(bits: &mut Bits) -> Option<Option<Header>> {
    let version = bits.take(6)?;
    let number = bits.take(8)?.to_le_bytes()[0];
    let cause = match bits.take(8)? {
        0 => Some(Cause::Command),
        1 => Some(Cause::Notice),
        _ => None,
    };
    let (blocks, past, image) = (bits.take(16)?, bits.take(16)?, bits.take_u32()?);
    Some(cause.filter(|_| version == VERSION.into()).map(|cause| Header { number, cause, blocks, past, image }))
}

fn block(bits: &mut Bits) -> Option<Option<RawBlock>> {
    const N: usize = SAMPLES_PER_BLOCK;
    let mut block = RawBlock { tick: bits.take_u32()?, force: [0; N], temperature: [0; N], position: [0; N] };
    let (force, temperature, position, mut step) = (bits.take(16)?, bits.take(16)?, bits.take(16)?, bits.take(16)?);
    let (wide_force, wide_temperature, wide_steps) = (bits.take(5)?, bits.take(5)?, bits.take(5)?);
    if [wide_force, wide_temperature, wide_steps].iter().any(|width| *width > 16) {
        return Some(None);
    }
    for (channel, first, width) in
        [(&mut block.force, force, wide_force), (&mut block.temperature, temperature, wide_temperature)]
    {
        let mut value = first;
        channel[0] = first;
        for place in channel.iter_mut().skip(1) {
            value = value.wrapping_add(unfold(bits.take(width)?));
            *place = value;
        }
    }
    let mut value = position;
    for (n, place) in block.position.iter_mut().enumerate() {
        if n > 1 {
            step = step.wrapping_add(unfold(bits.take(wide_steps)?));
        }
        if n > 0 {
            value = value.wrapping_add(step);
        }
        *place = value;
    }
    Some(Some(block))
}

/// Folded differences of neighbours.
#[inline(never)]
fn differences(channel: &[u16; SAMPLES_PER_BLOCK]) -> [u16; SAMPLES_PER_BLOCK - 1] {
    let mut folded = [0; SAMPLES_PER_BLOCK - 1];
    for ((place, before), after) in folded.iter_mut().zip(channel).zip(&channel[1..]) {
        *place = fold(after.wrapping_sub(*before));
    }
    folded
}

/// Folded differences of neighbouring steps.
fn steps(channel: &[u16; SAMPLES_PER_BLOCK]) -> [u16; STEPS] {
    let mut folded = [0; STEPS];
    for (place, three) in folded.iter_mut().zip(channel.windows(3)) {
        if let [a, b, c] = three {
            *place = fold(c.wrapping_sub(*b).wrapping_sub(b.wrapping_sub(*a)));
        }
    }
    folded
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn fold(difference: u16) -> u16 {
    let sign = if difference & 0x8000 != 0 { 0xFFFF } else { 0 };
    difference << 1 ^ sign
}

fn unfold(folded: u16) -> u16 {
    let sign = if folded & 1 != 0 { 0xFFFF } else { 0 };
    folded >> 1 ^ sign
}

/// Bits of the widest number.
fn width(folded: &[u16]) -> u32 {
    16 - folded.iter().fold(0, |all, d| all | d).leading_zeros()
}

/// Reads what [`Packed::put`] wrote.
struct Bits<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Bits<'_> {
    /// The next `width` bits; `None` beyond the end, and for more than 16 bits.
    fn take(&mut self, width: u16) -> Option<u16> {
        let end = self.at + usize::from(width);
        if width > 16 || end > 8 * self.bytes.len() {
            return None;
        }
        let mut word = 0;
        for (n, byte) in self.bytes.iter().skip(self.at / 8).take(3).enumerate() {
            word |= u32::from(*byte) << (8 * n);
        }
        let value = word >> (self.at % 8) & ((1 << width) - 1);
        self.at = end;
        Some(value as u16)
    }

    fn take_u32(&mut self) -> Option<u32> {
        let (low, high) = (self.take(16)?, self.take(16)?);
        Some(u32::from(high) << 16 | u32::from(low))
    }
}

/// Bits of a block with these widths.
const fn block_bits(force: usize, temperature: usize, steps: usize) -> usize {
    BLOCK_HEAD + (SAMPLES_PER_BLOCK - 1) * (force + temperature) + STEPS * steps
}

const _: () = assert!(block_bits(16, 16, 16) <= 8 * MAX_BYTES);

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Numbers from a fixed seed: xorshift64.
    pub(super) fn random(state: &mut u64) -> u16 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 24) as u16
    }

    fn there_and_back(block: &RawBlock) -> usize {
        let packed = pack_block(block);
        let bytes: Vec<u8> = packed.segments().concat();
        assert_eq!(unpack(&bytes), Some(Some(Record::Block(*block))));
        // not before its last segment
        for segments in 0..packed.segments().len() {
            assert_eq!(unpack(&bytes[..segments * SEGMENT]), None, "{segments}");
        }
        packed.segments().len()
    }

    #[test]
    fn blocks_lose_nothing() {
        let mut state = 0x9E37_79B9_7F4A_7C15;
        for round in 0..20_000_u32 {
            let mask = [0, 1, 0xF, 0xFFF, 0xFFFF][round as usize % 5];
            let mut channel = || std::array::from_fn(|_| random(&mut state) & mask);
            let (force, temperature, position) = (channel(), channel(), channel());
            let tick = u32::MAX - round * 7;
            assert!(there_and_back(&RawBlock { tick, force, temperature, position }) <= MAX_SEGMENTS);
        }
        let between = |other| std::array::from_fn(|n| if n % 2 == 0 { 0 } else { other });
        let (far, half) = (between(0x8000), between(0x4000));
        let block = RawBlock { tick: 0, force: far, temperature: far, position: half };
        assert_eq!(there_and_back(&block), MAX_SEGMENTS);
    }

    #[test]
    fn sizes_are_those_stated() {
        let rest = RawBlock { tick: 7, force: [2100; 16], temperature: [1850; 16], position: [12; 16] };
        assert_eq!(pack_block(&rest).bits.div_ceil(8), 15);
        let mut state = 1;
        // 0.1 m/s with 1 µm a count, 2 codes of noise on force, 1 on temperature
        let moving = RawBlock {
            tick: 7,
            force: std::array::from_fn(|_| 2100 + random(&mut state) % 5),
            temperature: std::array::from_fn(|_| 1850 + random(&mut state) % 2),
            position: std::array::from_fn(|n| (n as f64 * 62.5) as u16),
        };
        let bytes = pack_block(&moving).bits.div_ceil(8);
        assert!((26..=30).contains(&bytes), "{bytes}");
        assert_eq!(block_bits(16, 16, 16).div_ceil(8), 103);
    }

    #[test]
    fn headers_and_trailers_lose_nothing() {
        for cause in [Cause::Command, Cause::Notice] {
            let header = Header { number: 0xA5, cause, blocks: 0xFFFE, past: 0x1234, image: 0xDEAD_BEEF };
            let packed = pack_header(&header);
            assert_eq!(packed.segments().len(), END_SEGMENTS);
            assert_eq!(unpack(&packed.segments().concat()), Some(Some(Record::Header(header))));
        }
        let trailer = Trailer { blocks: 3, dropped: 0xFFFF, crc: 0x8000_0001 };
        let packed = pack_trailer(&trailer);
        assert_eq!(packed.segments().len(), END_SEGMENTS);
        assert_eq!(unpack(&packed.segments().concat()), Some(Some(Record::Trailer(trailer))));
    }

    #[test]
    fn anything_else_is_no_record() {
        let mut state = 3;
        for _ in 0..100_000 {
            let bytes: [u8; MAX_BYTES] = std::array::from_fn(|_| random(&mut state) as u8);
            match unpack(&bytes) {
                None => panic!("as long as the longest"),
                // only a block is anything at all
                Some(Some(Record::Block(_))) => assert_eq!(bytes[0] & 3, 0),
                _ => {}
            }
        }
        assert_eq!(unpack(&[3; 12]), Some(None));
        assert_eq!(unpack(&[1 | 2 << 2; 12]), Some(None), "another version");
    }
}
