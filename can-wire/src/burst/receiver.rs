//! The desk's side of a burst: frames in, records out, and what to ask for.

use super::WINDOW;
use super::frames::{Asking, FdFrame, MODULUS, SEGMENT, Segment};
use super::pack::{self, MAX_BYTES, Record};
use crate::Reject;
use crate::checksum;
use crate::frame::{NodeId, RawFrame};

/// Places for segments that arrive out of order; a number further ahead than this counts as an old one.
const PLACES: u8 = MODULUS / 2;

/// Segments after which the desk sends an asking frame.
const ASK_EVERY: u8 = 8;

/// Puts the segments of one block's bursts in order and reads their records.
///
/// It may also just listen, to a log or beside another desk: a segment that the sender can no longer repeat is then
/// counted as lost, and reading goes on with the next record.
#[derive(Clone, Debug)]
pub struct Receiver {
    node: NodeId,
    /// segments by their number modulo [`PLACES`]
    places: [Option<Segment>; PLACES as usize],
    /// number of the segment that is read next
    next: u8,
    /// one more than the highest number seen
    end: u8,
    /// segments before this number that have not arrived are lost
    floor: u8,
    /// number of the burst, once its header has come
    number: Option<u8>,
    partial: [u8; MAX_BYTES],
    partial_length: usize,
    /// nothing is read until a record begins
    astray: bool,
    crc: Option<u32>,
    crc_before_record: Option<u32>,
    lost: u32,
    lost_before: u32,
    /// header of the next burst, while the rest of the last one is read
    following: Option<Segment>,
    ended: bool,
    intact: bool,
    since_asked: u8,
    counter: u8,
}

impl Receiver {
    /// Nothing heard yet.
    pub const fn new(node: NodeId) -> Self {
        Receiver {
            node,
            places: [None; PLACES as usize],
            next: 0,
            end: 0,
            floor: 0,
            number: None,
            partial: [0; MAX_BYTES],
            partial_length: 0,
            astray: false,
            crc: None,
            crc_before_record: None,
            lost: 0,
            lost_before: 0,
            following: None,
            ended: false,
            intact: false,
            since_asked: 0,
            counter: 0,
        }
    }

    /// Segments lost for good, of all bursts so far; always 0 where a desk asks for them in time.
    pub fn lost(&self) -> u32 {
        self.lost
    }

    /// Whether a burst has begun and its trailer has not been read.
    pub fn is_under_way(&self) -> bool {
        self.number.is_some() && !self.ended
    }

    /// Whether the trailer has been read and its CRC is that of all segments before it.
    pub fn is_intact(&self) -> bool {
        self.ended && self.intact
    }

    /// Takes a frame. Call [`next_record`](Self::next_record) afterwards until it has no more.
    ///
    /// # Errors
    /// Those of [`Segment::decode`], and [`Reject::UnknownIdentifier`] for another node; nothing is changed then.
    pub fn take(&mut self, frame: &RawFrame) -> Result<(), Reject> {
        let (node, segment) = Segment::decode(frame.id, &frame.data)?;
        if node != self.node {
            return Err(Reject::UnknownIdentifier(frame.id));
        }
        self.place(segment);
        Ok(())
    }

    /// Takes a frame of CAN FD.
    ///
    /// # Errors
    /// Those of [`FdFrame::decode`], and as [`take`](Self::take).
    pub fn take_fd(&mut self, frame: &FdFrame) -> Result<(), Reject> {
        let (node, segments) = FdFrame::decode(frame.id, &frame.data)?;
        if node != self.node {
            return Err(Reject::UnknownIdentifier(frame.id));
        }
        segments.for_each(|segment| self.place(segment));
        Ok(())
    }

    /// The next record in order, if it has arrived.
    pub fn next_record(&mut self) -> Option<Record> {
        loop {
            let place = self.places.get_mut(usize::from(self.next % PLACES))?;
            let Some(segment) = place.take() else {
                if ahead(self.next, self.floor) == 0 || self.ended {
                    let header = self.following.take()?;
                    self.begin(pack::number_of_header(&header.bytes)?);
                    self.place(header);
                    continue;
                }
                self.step();
                self.stray();
                continue;
            };
            self.step();
            if let Some(record) = self.read(&segment) {
                return Some(record);
            }
        }
    }

    /// Nothing more will come: what is missing is lost.
    pub fn give_up(&mut self) {
        self.floor = self.end;
    }

    /// Whether an asking frame is due. Beside this, a desk sends one 20 ms after the last, as long as a burst is under
    /// way: the last one may have got lost.
    pub fn ask_due(&self) -> bool {
        self.number.is_some() && (self.since_asked >= ASK_EVERY || self.ended && self.since_asked > 0)
    }

    /// Asking frame: how far the desk has received and what it lacks. `None` before a header has arrived.
    pub fn ask(&mut self) -> Option<RawFrame> {
        let number = self.number? & 0xF;
        let known = ahead(self.next, self.end).min(WINDOW as u8);
        let mut missing = 0;
        for n in 0..known {
            if self.places.get(usize::from(self.next.wrapping_add(n) % PLACES)).is_none_or(Option::is_none) {
                missing |= 1 << n;
            }
        }
        let asking = Asking { next: self.next, missing, number, counter: self.counter };
        self.counter = self.counter.wrapping_add(1) & 0xF;
        self.since_asked = 0;
        Some(asking.encode(self.node))
    }

    fn place(&mut self, segment: Segment) {
        self.since_asked = self.since_asked.saturating_add(1);
        if segment.begins
            && segment.sequence == 0
            && let Some(number) = pack::number_of_header(&segment.bytes)
            && self.number != Some(number)
        {
            if self.is_under_way() {
                // nothing of the last burst is sent any more
                self.give_up();
                self.following = Some(segment);
                return;
            }
            self.begin(number);
        }
        let distance = ahead(self.next, segment.sequence);
        if distance >= PLACES || self.ended {
            return;
        }
        if usize::from(distance) >= WINDOW {
            // the sender keeps no more than one window of segments
            self.floor = segment.sequence.wrapping_sub(WINDOW as u8 - 1) % MODULUS;
        }
        if distance >= ahead(self.next, self.end) {
            self.end = (segment.sequence + 1) % MODULUS;
        }
        if let Some(place) = self.places.get_mut(usize::from(segment.sequence % PLACES)) {
            *place = Some(segment);
        }
    }

    /// Another burst begins. What arrived before its header may belong to the burst before: it is asked for again.
    fn begin(&mut self, number: u8) {
        let end = if self.number.is_none() && self.next == 0 { self.end } else { 0 };
        let (counter, lost) = (self.counter, self.lost);
        *self = Receiver { end, number: Some(number), counter, lost, lost_before: lost, ..Receiver::new(self.node) };
    }

    fn step(&mut self) {
        if self.next == self.floor {
            self.floor = (self.floor + 1) % MODULUS;
        }
        self.next = (self.next + 1) % MODULUS;
    }

    /// A segment is lost or unreadable.
    fn stray(&mut self) {
        self.lost = self.lost.saturating_add(1);
        (self.astray, self.partial_length) = (true, 0);
    }

    fn read(&mut self, segment: &Segment) -> Option<Record> {
        if segment.begins {
            (self.astray, self.partial_length, self.crc_before_record) = (false, 0, self.crc);
        }
        self.crc = Some(checksum::running(self.crc, &segment.bytes));
        if self.astray {
            return None;
        }
        let end = self.partial_length + SEGMENT;
        let Some(place) = self.partial.get_mut(self.partial_length..end).filter(|_| segment.begins || end > SEGMENT)
        else {
            self.stray();
            return None;
        };
        place.copy_from_slice(&segment.bytes);
        self.partial_length = end;
        match pack::unpack(self.partial.get(..end)?)? {
            None => {
                self.stray();
                None
            }
            Some(record) => {
                self.partial_length = 0;
                if let Record::Trailer(trailer) = record {
                    self.ended = true;
                    self.intact = self.lost == self.lost_before && self.crc_before_record == Some(trailer.crc);
                }
                Some(record)
            }
        }
    }
}

/// How far `to` lies ahead of `from`.
fn ahead(from: u8, to: u8) -> u8 {
    to.wrapping_sub(from) % MODULUS
}
