//! A plain second opinion on service messages, written from their documentation, and messages to try it with.

#![allow(clippy::expect_used, reason = "a comparison fails by panicking")]

use can_wire::service::{Abort, Action, BlockState, OBJECTS, Server, Settings, Type, UploadState, server};
use can_wire::{BoardKind, NodeId, RawFrame, ResetCause, crc32};

/// The key of the block under test.
pub(crate) const KEY: u32 = 0x1234_5678;

const NODE: u8 = 9;

/// Numbers from a fixed seed: xorshift64.
pub(crate) struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// Below n.
    pub(crate) fn below(&mut self, n: u64) -> u64 {
        (self.bits() >> 11) % n
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

/// What must come of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// No answer, nothing done.
    Silent,
    /// An abort from the client: no answer.
    GivenUp,
    Refused(Abort),
    Taken,
}

/// The block as its documentation has it.
struct Plain {
    unlocked_at_s: Option<u32>,
    changes: u32,
    zeroing: bool,
    limits: [u32; 4],
    size: usize,
    image: Vec<u8>,
    toggle: bool,
    upload: UploadState,
}

/// Both sides of the comparison.
pub(crate) struct Trial {
    random: Random,
    server: Server,
    plain: Plain,
    block: BlockState,
    /// Messages of each verdict: silent, given up, refused, taken.
    pub(crate) seen: [u64; 4],
    /// Abort codes given, in the order of [`Abort::ALL`].
    pub(crate) aborts: [u64; 15],
}

impl Trial {
    pub(crate) fn new(seed: u64) -> Self {
        let node = NodeId::new(NODE).expect("a node");
        Trial {
            random: Random(seed),
            server: Server::new(node, KEY, Settings::DELIVERED),
            plain: Plain {
                unlocked_at_s: None,
                changes: 0,
                zeroing: false,
                limits: [0xFFFF; 4],
                size: 0,
                image: Vec::new(),
                toggle: false,
                upload: UploadState::None,
            },
            block: BlockState {
                moving: false,
                uptime_s: 0,
                error_register: 0,
                board: BoardKind::Stm32g474,
                unique: [1, 2, 3],
                version: [0, 1, 0],
                reset_cause: ResetCause::PowerOn,
                boot_count: 1,
                lost_blocks: 0,
                frames_dropped: 0,
                bus_offs: 0,
                active_image: 7,
                image_publish_every_blocks: 10,
                burst_state: 0,
                burst_dropped: 0,
            },
            seen: [0; 4],
            aborts: [0; 15],
        }
    }

    /// One message, one comparison.
    ///
    /// # Panics
    /// When the block does not do what its documentation says.
    pub(crate) fn step(&mut self) {
        self.world();
        let frame = self.message();
        let verdict = self.plain.judge(&frame, &self.block);
        let before = self.server.clone();
        let answer = self.server.handle(&frame, &self.block);
        let context = || format!("{frame:02X?} {:?}", self.block);
        let abort = answer.frame.filter(|f| f.data[0] == 0x80).map(|f| {
            let code = u32::from_le_bytes(f.data[4..].try_into().expect("four bytes"));
            Abort::from_code(code).expect("a code of the table")
        });
        if let Some(sent) = answer.frame {
            assert_eq!(sent.id, 0x580 + u16::from(NODE), "{}", context());
        }
        match verdict {
            Verdict::Silent | Verdict::GivenUp => {
                assert_eq!((answer.frame, answer.action), (None, None), "{}", context());
            }
            Verdict::Refused(why) => {
                assert_eq!((abort, answer.action), (Some(why), None), "{}", context());
                self.aborts[Abort::ALL.iter().position(|a| *a == why).expect("listed")] += 1;
            }
            Verdict::Taken => assert!(answer.frame.is_some() && abort.is_none(), "{abort:?} {}", context()),
        }
        if matches!(verdict, Verdict::Silent | Verdict::Refused(_)) {
            assert!(self.server == before, "changed by {}", context());
        }
        assert_eq!(self.server.changes(), self.plain.changes, "{}", context());
        assert_eq!(self.server.is_unlocked(self.block.uptime_s), self.plain.unlocked(&self.block), "{}", context());
        self.seen[match verdict {
            Verdict::Silent => 0,
            Verdict::GivenUp => 1,
            Verdict::Refused(_) => 2,
            Verdict::Taken => 3,
        }] += 1;
        match answer.action {
            Some(Action::SaveImage) => assert_eq!(self.server.image(), self.plain.image, "{}", context()),
            Some(Action::Burst(order)) => assert!(order.blocks > 0 && order.past <= order.blocks),
            _ => {}
        }
    }

    /// Time goes by, the shell finishes what it was told to do.
    fn world(&mut self) {
        let random = &mut self.random;
        self.block.uptime_s = self.block.uptime_s.wrapping_add(u32::from(random.one_in(4)));
        if random.one_in(2000) {
            self.block.uptime_s = self.block.uptime_s.wrapping_add(server::UNLOCKED_S);
        }
        if random.one_in(50) {
            self.block.moving = random.one_in(4);
        }
        if random.one_in(50) {
            self.block.burst_state = random.below(3) as u8;
        }
        if self.plain.upload == UploadState::Saving && random.one_in(8) {
            let kept = random.one_in(2);
            self.server.saved(if kept { UploadState::Saved } else { UploadState::Failed });
            self.plain.upload = if kept { UploadState::Saved } else { UploadState::Failed };
        }
        if self.plain.zeroing && random.one_in(8) {
            let shift = random.one_in(2).then(|| random.below(9) as i16 - 4);
            let _ = self.server.zeroed(shift);
            self.plain.zeroing = false;
        }
    }

    /// A message: what a client would say next, that with damage, or noise.
    fn message(&mut self) -> RawFrame {
        let mut data: [u8; 8] = match self.random.below(12) {
            0 => self.random.bits().to_le_bytes(),
            1 => write(0x2008, 1, 4, KEY),
            2..=5 => self.next_of_image(),
            _ => self.about_an_object(),
        };
        for _ in 0..self.random.below(12).saturating_sub(9) {
            let bit = self.random.below(64) as usize;
            data[bit / 8] ^= 1 << (bit % 8);
        }
        let id = if self.random.one_in(40) { self.random.below(0x800) as u16 } else { 0x600 + u16::from(NODE) };
        RawFrame { id, data }
    }

    fn about_an_object(&mut self) -> [u8; 8] {
        let object = &OBJECTS[self.random.below(OBJECTS.len() as u64) as usize];
        let value = match self.random.below(4) {
            0 => object.low,
            1 => object.high,
            2 => 10 * self.random.below(500) as u32,
            _ => self.random.bits() as u32,
        };
        let length = object.kind.length().unwrap_or(1 + self.random.below(4) as usize);
        let mut data = match self.random.below(8) {
            0 | 1 => [0x40, 0, 0, 0, 1, 2, 3, 4],
            2 => write(0, 0, 1 + self.random.below(4) as usize, value),
            3 => [0x22, 0, 0, 0, value as u8, (value >> 8) as u8, (value >> 16) as u8, (value >> 24) as u8],
            _ => write(0, 0, length, value),
        };
        [data[1], data[2]] = object.index.to_le_bytes();
        data[3] = object.sub;
        data
    }

    /// What a client that loads an image would say, more or less.
    fn next_of_image(&mut self) -> [u8; 8] {
        match self.plain.upload {
            UploadState::Receiving if !self.random.one_in(300) => {
                let left = self.plain.size - self.plain.image.len();
                let part: Vec<u8> = (0..left.min(7)).map(|_| self.random.below(256) as u8).collect();
                let last = part.len() == left;
                let mut data = [0; 8];
                data[1..=part.len()].copy_from_slice(&part);
                data[0] = u8::from(self.plain.toggle) << 4 | (7 - part.len() as u8) << 1 | u8::from(last);
                data
            }
            UploadState::Complete if !self.random.one_in(3) => write(0x2005, 2, 4, crc32(&self.plain.image)),
            _ => {
                let longest = if self.random.one_in(20) { 1100 } else { 30 };
                let size = 1 + self.random.below(longest);
                write(0x2005, 1, 0, size as u32)
            }
        }
    }
}

/// A write of so many bytes; of none, the beginning of an image.
fn write(index: u16, sub: u8, length: usize, value: u32) -> [u8; 8] {
    let command = if length == 0 { 0x21 } else { 0x23 | (4 - length as u8) << 2 };
    let ([i0, i1], [v0, v1, v2, v3]) = (index.to_le_bytes(), value.to_le_bytes());
    [command, i0, i1, sub, v0, v1, v2, v3]
}

impl Plain {
    fn unlocked(&self, block: &BlockState) -> bool {
        self.unlocked_at_s.is_some_and(|at| block.uptime_s.wrapping_sub(at) < 300)
    }

    fn may_change(&self, block: &BlockState) -> Result<(), Abort> {
        if !self.unlocked(block) {
            Err(Abort::Locked)
        } else if block.moving || self.zeroing || self.upload == UploadState::Saving {
            Err(Abort::State)
        } else {
            Ok(())
        }
    }

    fn judge(&mut self, frame: &RawFrame, block: &BlockState) -> Verdict {
        if frame.id != 0x609 {
            return Verdict::Silent;
        }
        let (command, d) = (frame.data[0], frame.data);
        let (index, sub) = (u16::from_le_bytes([d[1], d[2]]), d[3]);
        let value = u32::from_le_bytes([d[4], d[5], d[6], d[7]]);
        let result = match command {
            0x80 => {
                if self.upload == UploadState::Receiving {
                    self.upload = UploadState::None;
                    self.image.clear();
                }
                return Verdict::GivenUp;
            }
            0x00..=0x1F => self.segment(command, &d[1..], block),
            0x40 => read(index, sub),
            0x21 => self.begin(index, sub, value, block),
            0x22 => self.write(index, sub, None, value, block),
            0x23 | 0x27 | 0x2B | 0x2F => self.write(index, sub, Some(4 - (command as usize >> 2 & 3)), value, block),
            _ => Err(Abort::Command),
        };
        match result {
            Ok(()) => Verdict::Taken,
            Err(why) => Verdict::Refused(why),
        }
    }

    fn segment(&mut self, command: u8, bytes: &[u8], block: &BlockState) -> Result<(), Abort> {
        self.may_change(block)?;
        if self.upload != UploadState::Receiving {
            return Err(Abort::Command);
        }
        if (command & 0x10 != 0) != self.toggle {
            return Err(Abort::Toggle);
        }
        let used = 7 - usize::from(command >> 1 & 7);
        let end = self.image.len() + used;
        if end > self.size {
            return Err(Abort::TooLong);
        }
        let last = command & 1 != 0;
        if used == 0 || last != (end == self.size) {
            return Err(Abort::Length);
        }
        self.image.extend(&bytes[..used]);
        self.toggle = !self.toggle;
        if last {
            self.upload = UploadState::Complete;
        }
        Ok(())
    }

    fn begin(&mut self, index: u16, sub: u8, size: u32, block: &BlockState) -> Result<(), Abort> {
        if writable(index, sub)? != Type::Domain {
            return Err(Abort::Command);
        }
        self.may_change(block)?;
        match size {
            0 => Err(Abort::TooShort),
            1..=1024 => {
                (self.size, self.toggle, self.upload) = (size as usize, false, UploadState::Receiving);
                self.image.clear();
                Ok(())
            }
            _ => Err(Abort::TooLong),
        }
    }

    fn write(
        &mut self,
        index: u16,
        sub: u8,
        given: Option<usize>,
        value: u32,
        block: &BlockState,
    ) -> Result<(), Abort> {
        let length = match writable(index, sub)? {
            Type::U8 => 1,
            Type::U16 | Type::I16 => 2,
            Type::U32 => 4,
            Type::Domain => return Err(Abort::Command),
        };
        let given = given.unwrap_or(length);
        if given != length {
            return Err(if given < length { Abort::TooShort } else { Abort::TooLong });
        }
        let value = if length == 4 { value } else { value & ((1 << (8 * length)) - 1) };
        let signature = |word: &[u8; 4]| if value == u32::from_le_bytes(*word) { Ok(()) } else { Err(Abort::Value) };
        let within = |low, high| match value {
            v if v < low => Err(Abort::TooLow),
            v if v > high => Err(Abort::TooHigh),
            _ => Ok(()),
        };
        // what the table says about the value comes before who may write
        match (index, sub) {
            (0x1010, 1) => signature(b"save")?,
            (0x2003, 0) => within(10, 10_000)?,
            (0x2004, 1) => signature(b"zero")?,
            (0x2006, 6) => signature(b"clrc")?,
            (0x2007, 3) => within(1, 50)?,
            (0x200A, 1) => signature(b"rset")?,
            (0x2008, 1) => {
                if value != 0 && value != KEY {
                    return Err(Abort::Value);
                }
                self.unlocked_at_s = (value != 0).then_some(block.uptime_s);
                return Ok(());
            }
            (0x2007, 1) => {
                let (blocks, past) = (value & 0xFFFF, value >> 16 & 0x7FFF);
                return match (blocks, value) {
                    (0, 0) => Ok(()),
                    (0, _) => Err(Abort::Value),
                    _ if past > blocks => Err(Abort::Value),
                    _ if block.burst_state != 0 => Err(Abort::State),
                    _ => Ok(()),
                };
            }
            _ => {}
        }
        self.may_change(block)?;
        match (index, sub) {
            (0x2002, _) => {
                let mut limits = self.limits;
                limits[usize::from(sub) - 1] = value;
                let set: Vec<u32> = limits.into_iter().filter(|l| *l != 0xFFFF).collect();
                // from low to high, and the first one that does not fit is the one complained about
                for n in 0..set.len() {
                    if set[n] > 0xFFFB {
                        return Err(Abort::TooHigh);
                    }
                    if n > 0 && set[n] < set[n - 1] {
                        return Err(Abort::Incompatible);
                    }
                }
                self.limits = limits;
            }
            (0x2003, 0) if value % 10 != 0 => return Err(Abort::Value),
            (0x2004, 1) => self.zeroing = true,
            (0x2005, 2) => {
                if self.upload != UploadState::Complete {
                    return Err(Abort::State);
                }
                if value != crc32(&self.image) {
                    return Err(Abort::Value);
                }
                self.upload = UploadState::Saving;
            }
            _ => {}
        }
        self.changes += 1;
        self.unlocked_at_s = Some(block.uptime_s);
        Ok(())
    }
}

/// Type of an object, or why there is none. Parts 0 are those of records.
fn kind(index: u16, sub: u8) -> Result<Type, Abort> {
    let all: Vec<_> = OBJECTS.iter().filter(|o| o.index == index).collect();
    if all.is_empty() {
        return Err(Abort::NoObject);
    }
    match all.iter().find(|o| o.sub == sub) {
        Some(object) => Ok(object.kind),
        None if sub == 0 => Ok(Type::U8),
        None => Err(Abort::NoSubindex),
    }
}

fn writable(index: u16, sub: u8) -> Result<Type, Abort> {
    let kind = kind(index, sub)?;
    let object = OBJECTS.iter().find(|o| (o.index, o.sub) == (index, sub));
    if object.is_some_and(|o| o.access.writable()) { Ok(kind) } else { Err(Abort::ReadOnly) }
}

fn read(index: u16, sub: u8) -> Result<(), Abort> {
    kind(index, sub)?;
    let object = OBJECTS.iter().find(|o| (o.index, o.sub) == (index, sub));
    if object.is_none_or(|o| o.access.readable()) { Ok(()) } else { Err(Abort::WriteOnly) }
}
