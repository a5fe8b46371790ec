//! The block's side of a burst: samples in, frames out.

use model_core::sample::RawBlock;

use super::frames::{Asking, FD_SEGMENTS, FdFrame, MODULUS, Segment};
use super::pack::{self, Cause, END_SEGMENTS, Header, MAX_SEGMENTS, Trailer};
use super::ring::Ring;
use super::{Order, WINDOW};
use crate::Reject;
use crate::checksum;
use crate::frame::{NodeId, RawFrame};

/// Time without progress after which the oldest segment is sent again, ms.
const PROBE_MS: u32 = 100;

/// Repetitions without an answer before a burst is given up: half a minute in which the bus took them.
const PROBES: u16 = 300;

/// Phase of a burst; the number is the value of object 2007.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// None under way; the ring follows the samples.
    Idle = 0,
    /// Blocks are recorded and sent.
    Recording = 1,
    /// All blocks are in the ring; the rest is sent.
    Sending = 2,
}

/// The ring of a block and the burst that is sent from it. `N` segments, about 8 bytes of memory each; 5 segments hold
/// 10 ms of motion.
#[derive(Clone, Debug)]
pub struct Sender<const N: usize> {
    node: NodeId,
    ring: Ring<N>,
    state: State,
    order: Order,
    number: u8,
    /// blocks of this burst that are or were in the ring
    recorded: u16,
    dropped: u32,
    /// CRC-32 of all segments before the trailer
    crc: u32,
    /// sequence number of the oldest segment in the ring
    base: u8,
    /// number of segments, from the oldest on, that have been sent
    sent: usize,
    /// those of them to be sent again: bit i is the i-th oldest
    again: u64,
    /// when a segment was sent or arrived last, ms
    quiet_since_ms: u32,
    probes: u16,
}

impl<const N: usize> Sender<N> {
    /// An empty ring. `number` is that of the first burst; after a restart a block begins with another number, so
    /// that nobody takes its first burst for the rest of the last one.
    pub const fn new(node: NodeId, number: u8) -> Self {
        const { assert!(N >= MAX_SEGMENTS + 2 * END_SEGMENTS + WINDOW, "no room for a window and a block") };
        Sender {
            node,
            ring: Ring::new(),
            state: State::Idle,
            order: Order { blocks: 0, past: 0, asked: true },
            number,
            recorded: 0,
            dropped: 0,
            crc: 0,
            base: 0,
            sent: 0,
            again: 0,
            quiet_since_ms: 0,
            probes: 0,
        }
    }

    /// Phase of the burst.
    pub fn state(&self) -> State {
        self.state
    }

    /// Blocks of the last burst that found no room.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// Takes the newest samples. While no burst is under way they displace the oldest ones; while one is recorded a
    /// block without room is dropped.
    #[inline(never)]
    pub fn append(&mut self, block: &RawBlock) {
        let packed = pack::pack_block(block);
        match self.state {
            State::Idle => {
                while !self.ring.push(&packed) {
                    self.ring.drop_record();
                }
            }
            State::Recording => {
                // the trailer must always find its place
                if self.ring.room() < packed.segments().len() + END_SEGMENTS || !self.ring.push(&packed) {
                    self.dropped = self.dropped.saturating_add(1);
                    return;
                }
                for segment in packed.segments() {
                    self.crc = checksum::running(Some(self.crc), segment);
                }
                self.recorded += 1;
                if self.recorded >= self.order.blocks {
                    self.close();
                }
            }
            State::Sending => {}
        }
    }

    /// Starts a burst; returns `false` and does nothing while one is under way or when no blocks are ordered.
    #[inline(never)]
    pub fn start(&mut self, order: Order, cause: Cause, image: u32, now_ms: u32) -> bool {
        if self.state != State::Idle || order.blocks == 0 {
            return false;
        }
        let wanted = order.past.min(order.blocks);
        while self.ring.records() > wanted
            || self.ring.length() > 0 && self.ring.room() < MAX_SEGMENTS + 2 * END_SEGMENTS
        {
            self.ring.drop_record();
        }
        let past = self.ring.records();
        self.number = self.number.wrapping_add(1);
        let header = Header { number: self.number, cause, blocks: order.blocks, past, image };
        self.ring.lead(&pack::pack_header(&header));
        let mut crc = None;
        for n in 0..self.ring.length() {
            if let Some((_, bytes)) = self.ring.get(n) {
                crc = Some(checksum::running(crc, &bytes));
            }
        }
        self.crc = crc.unwrap_or_default();
        (self.order, self.recorded, self.dropped) = (order, past, 0);
        (self.base, self.sent, self.again) = (0, 0, 0);
        (self.quiet_since_ms, self.probes) = (now_ms, 0);
        self.state = State::Recording;
        if self.recorded >= order.blocks {
            self.close();
        }
        true
    }

    /// Ends the burst: what is in the ring is still sent. A second call drops that, too.
    pub fn end(&mut self) {
        match self.state {
            State::Idle => {}
            State::Recording => self.close(),
            State::Sending => self.forget(),
        }
    }

    /// The next segment that may go out. It counts as sent: the caller keeps it until the bus has it.
    pub fn next(&mut self, now_ms: u32) -> Option<RawFrame> {
        let (_, segment) = self.pick(now_ms)?;
        self.let_go();
        Some(segment.encode(self.node))
    }

    /// As [`next`](Self::next), with as many segments as an FD frame holds.
    pub fn next_fd(&mut self, now_ms: u32) -> Option<FdFrame> {
        let mut bundle = [Segment::default(); FD_SEGMENTS];
        let (first, segment) = self.pick(now_ms)?;
        bundle[0] = segment;
        let mut count = 1;
        let mut last = first;
        // whatever follows the first one in the ring, if it may go as well
        while count < FD_SEGMENTS {
            let due = last + 1 == self.sent && self.may_send_new() || self.again >> (last + 1) & 1 != 0;
            let Some(segment) = due.then(|| self.segment(last + 1)).flatten() else { break };
            last += 1;
            self.mark_sent(last);
            bundle[count] = segment;
            count += 1;
        }
        self.let_go();
        Some(FdFrame::encode(self.node, bundle.get(..count).unwrap_or_default()))
    }

    /// Takes an asking frame of the desk; frames of other kinds and nodes are refused.
    ///
    /// # Errors
    /// Those of [`Asking::decode`], [`Reject::UnknownIdentifier`] for another node, and [`Reject::Contradiction`] for
    /// another burst or for segments that were never sent. Nothing is changed then.
    #[inline(never)]
    pub fn asked(&mut self, frame: &RawFrame, now_ms: u32) -> Result<(), Reject> {
        let (node, asking) = Asking::decode(frame.id, &frame.data)?;
        if node != self.node {
            return Err(Reject::UnknownIdentifier(frame.id));
        }
        let ahead = usize::from(asking.next.wrapping_sub(self.base) % MODULUS);
        if self.state == State::Idle || asking.number != self.number & 0xF || ahead > self.sent {
            return Err(Reject::Contradiction { field: "next" });
        }
        self.release(ahead);
        self.again |= asking.missing & ((1 << self.sent) - 1);
        self.probes = 0;
        // an asking frame without progress may come from a desk that has not seen the last segments
        if ahead > 0 || self.again != 0 {
            self.quiet_since_ms = now_ms;
        }
        if self.state == State::Sending && self.ring.length() == 0 {
            self.state = State::Idle;
        }
        Ok(())
    }

    /// Distance from the oldest, and the segment; marked as sent.
    #[inline(never)]
    fn pick(&mut self, now_ms: u32) -> Option<(usize, Segment)> {
        if self.state == State::Idle {
            return None;
        }
        let oldest_lost = self.again.trailing_zeros() as usize;
        let distance = if oldest_lost < self.sent {
            oldest_lost
        } else if self.may_send_new() {
            self.sent
        } else if self.sent > 0 && now_ms.wrapping_sub(self.quiet_since_ms) >= PROBE_MS {
            self.probes += 1;
            if self.probes > PROBES {
                self.forget();
                return None;
            }
            0
        } else {
            return None;
        };
        let segment = self.segment(distance)?;
        self.mark_sent(distance);
        self.quiet_since_ms = now_ms;
        Some((distance, segment))
    }

    fn may_send_new(&self) -> bool {
        self.sent < WINDOW && self.sent < self.ring.length()
    }

    fn segment(&self, distance: usize) -> Option<Segment> {
        let (begins, bytes) = self.ring.get(distance)?;
        // the distance is below the window
        let sequence = self.base.wrapping_add(distance as u8) % MODULUS;
        Some(Segment { sequence, begins, bytes })
    }

    fn mark_sent(&mut self, distance: usize) {
        self.again &= !(1 << distance);
        self.sent = self.sent.max(distance + 1);
    }

    /// Forgets sent segments that nobody will ask for.
    fn let_go(&mut self) {
        if !self.order.asked {
            self.release(self.sent);
            if self.state == State::Sending && self.ring.length() == 0 {
                self.state = State::Idle;
            }
        }
    }

    /// Forgets segments that have arrived.
    fn release(&mut self, segments: usize) {
        self.ring.release(segments);
        self.sent -= segments.min(self.sent);
        self.again = self.again.checked_shr(segments as u32).unwrap_or(0);
        self.base = self.base.wrapping_add(segments as u8) % MODULUS;
    }

    /// Puts the trailer behind the last block.
    #[inline(never)]
    fn close(&mut self) {
        let dropped = u16::try_from(self.dropped).unwrap_or(u16::MAX);
        let trailer = Trailer { blocks: self.recorded, dropped, crc: self.crc };
        if self.ring.push(&pack::pack_trailer(&trailer)) {
            self.state = State::Sending;
        } else {
            // room for it was kept free; should there be none, no burst is better than one without an end
            self.forget();
        }
    }

    fn forget(&mut self) {
        self.ring.clear();
        (self.sent, self.again, self.state) = (0, 0, State::Idle);
    }
}
