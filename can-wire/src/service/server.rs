//! The block's side: requests in, answers and actions out.
//!
//! No clock, no bus, no memory but its own: the calling firmware, the shell, calls [`Server::handle`] for each frame,
//! sends the answer and carries the action out.

use super::objects::{self, Field, Object, Type};
use super::request::{self, Request};
use super::upload::Upload;
use super::{ANSWER_BASE, Abort, REQUEST_BASE, Settings, UploadState};
use crate::burst::Order;
use crate::frame::{LENGTH, NodeId, RawFrame};
use crate::heartbeat::{BoardKind, ResetCause};
use crate::service::limits::{Limits, OFF};

/// Time after the last change until the block locks itself, s.
pub const UNLOCKED_S: u32 = 300;

/// The key of a block as delivered: `gbky`. It prevents accidents, not attacks: CAN has no secrets.
pub const DELIVERED_KEY: u32 = u32::from_le_bytes(*b"gbky");

/// Time between two heartbeats, ms.
const HEARTBEAT_MS: u32 = 500;

/// Length of a block of samples, ms.
const BLOCK_MS: u16 = 10;

/// State of the block that answers need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockState {
    /// Whether the carriage moves, or its motion is not known.
    pub moving: bool,
    /// Time since the start, s.
    pub uptime_s: u32,
    /// CiA 301 error register.
    pub error_register: u8,
    /// Board that the firmware runs on.
    pub board: BoardKind,
    /// The chip's unique identifier, lowest word first.
    pub unique: [u32; 3],
    /// Firmware version: major, minor, patch.
    pub version: [u16; 3],
    /// What started the block.
    pub reset_cause: ResetCause,
    /// Starts since the supply was switched on.
    pub boot_count: u16,
    /// Blocks of samples lost.
    pub lost_blocks: u32,
    /// Frames displaced by newer ones.
    pub frames_dropped: u32,
    /// Times the controller left the bus.
    pub bus_offs: u32,
    /// Hash of the active parameter image; 0 without one.
    pub active_image: u32,
    /// Blocks between two estimates as the active image says.
    pub image_publish_every_blocks: u16,
    /// Phase of the burst, as object 2007.2 has it.
    pub burst_state: u8,
    /// Blocks of the last burst that found no room.
    pub burst_dropped: u32,
}

/// What the shell has to do about an accepted request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Use these settings from now on.
    Apply(Settings),
    /// Keep the settings over a reset, then call [`Server::kept`].
    Keep(Settings),
    /// Take the zero of the force, then call [`Server::zeroed`].
    TakeZero,
    /// Keep the image, [`Server::image`], then call [`Server::saved`].
    SaveImage,
    /// Set the counters to 0.
    ClearCounters,
    /// Start this burst.
    Burst(Order),
    /// End the burst under way.
    EndBurst,
    /// Restart, when the answer is out.
    Restart,
}

/// Outcome of the last request to take the zero, as object 2004.1 has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ZeroState {
    /// None was requested since the start.
    None = 0,
    /// It is being taken.
    Taking = 1,
    /// It was taken.
    Taken = 2,
    /// The carriage moved, samples were lost, or something pulls: the previous zero stays.
    NotTaken = 3,
}

/// Result of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Answer {
    /// Frame to be sent; `None` for an abort and for a frame that is not meant for the block.
    pub frame: Option<RawFrame>,
    /// Action to be done.
    pub action: Option<Action>,
}

/// The object server of one block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Server {
    node: NodeId,
    key: u32,
    settings: Settings,
    /// time at which the key was given or last used, s
    unlocked_at_s: Option<u32>,
    changes: u32,
    zero: ZeroState,
    keeps: bool,
    upload: Upload,
}

impl Server {
    /// A locked server with these settings. `key` must not be 0, which is the value that locks.
    pub const fn new(node: NodeId, key: u32, settings: Settings) -> Self {
        Server {
            node,
            key,
            settings,
            unlocked_at_s: None,
            changes: 0,
            zero: ZeroState::None,
            keeps: true,
            upload: Upload::new(),
        }
    }

    /// The settings in use.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Writes accepted under the key since the start.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// Whether writes are accepted at this time, s since the start.
    pub fn is_unlocked(&self, uptime_s: u32) -> bool {
        self.unlocked_at_s.is_some_and(|at| uptime_s.wrapping_sub(at) < UNLOCKED_S)
    }

    /// The image that was sent, whole when [`Action::SaveImage`] asks to save it.
    pub fn image(&self) -> &[u8] {
        self.upload.image()
    }

    /// Report of the shell on saving the image: [`UploadState::Saved`], [`Failed`](UploadState::Failed) or
    /// [`Full`](UploadState::Full).
    pub fn saved(&mut self, outcome: UploadState) {
        if self.upload.state == UploadState::Saving {
            self.upload.state = outcome;
        }
    }

    /// Report of the shell: whether it has kept the settings.
    pub fn kept(&mut self, kept: bool) {
        self.keeps = kept;
    }

    /// Report of the shell on taking the zero: its distance above the one in use, in sixteenths of a code, or `None` if
    /// none could be taken. Returns the settings to use from now on, `None` if they stay.
    pub fn zeroed(&mut self, above_sixteenths: Option<i16>) -> Option<Settings> {
        let shift = above_sixteenths.and_then(|above| self.settings.zero_shift_sixteenths.checked_add(above));
        self.zero = if shift.is_some() { ZeroState::Taken } else { ZeroState::NotTaken };
        self.settings.zero_shift_sixteenths = shift?;
        Some(self.settings)
    }

    /// Takes a frame.
    #[inline(never)]
    pub fn handle(&mut self, frame: &RawFrame, block: &BlockState) -> Answer {
        if frame.id != REQUEST_BASE + u16::from(self.node.get()) {
            return Answer::default();
        }
        let (data, action) = match self.request(&frame.data, block) {
            Ok(Some((data, action))) => (data, action),
            Ok(None) => return Answer::default(),
            Err((index, sub, why)) => (request::refusal(index, sub, why), None),
        };
        Answer { frame: Some(RawFrame { id: ANSWER_BASE + u16::from(self.node.get()), data }), action }
    }

    #[allow(clippy::type_complexity, reason = "the two ends of one function")]
    fn request(
        &mut self,
        bytes: &[u8; LENGTH],
        block: &BlockState,
    ) -> Result<Option<([u8; LENGTH], Option<Action>)>, (u16, u8, Abort)> {
        let taken = |index, sub, action| Ok(Some((request::message(request::TAKEN, index, sub, [0; 4]), action)));
        match Request::of(bytes) {
            Request::Abort => {
                self.upload.abort();
                Ok(None)
            }
            Request::Unknown => {
                let [_, low, high, sub, ..] = *bytes;
                Err((u16::from_le_bytes([low, high]), sub, Abort::Command))
            }
            Request::Read { index, sub } => {
                let (length, value) = self.read(index, sub, block).map_err(|why| (index, sub, why))?;
                // 0x43, 0x4B, 0x4F: four bytes less those unused
                let command = 0x43 | (4 - length as u8) << 2;
                Ok(Some((request::message(command, index, sub, value.to_le_bytes()), None)))
            }
            Request::Write { index, sub, length, data } => {
                let action = self.write(index, sub, length, data, block).map_err(|why| (index, sub, why))?;
                taken(index, sub, action)
            }
            Request::Begin { index, sub, size } => {
                self.begin(index, sub, size, block).map_err(|why| (index, sub, why))?;
                taken(index, sub, None)
            }
            Request::Segment(segment) => {
                let why = |why| (0x2005, 1, why);
                self.may_change(block).map_err(why)?;
                self.upload.segment(&segment).map_err(why)?;
                let toggle = u8::from(segment.toggle) << 4;
                Ok(Some((request::message(0x20 | toggle, 0, 0, [0; 4]), None)))
            }
        }
    }

    /// Length and value of an object.
    fn read(&self, index: u16, sub: u8, block: &BlockState) -> Result<(usize, u32), Abort> {
        if sub == 0
            && let Some(parts) = objects::parts(index)
        {
            return Ok((1, parts.into()));
        }
        let object = objects::find(index, sub)?;
        if !object.access.readable() {
            return Err(Abort::WriteOnly);
        }
        let length = object.kind.length().ok_or(Abort::WriteOnly)?;
        Ok((length, self.value(object.field, block)))
    }

    #[inline(never)]
    fn value(&self, field: Field, block: &BlockState) -> u32 {
        let limit = |l: Option<u16>| u32::from(l.unwrap_or(OFF));
        let [low, middle, high] = block.unique;
        let limits = &self.settings.limits;
        match field {
            Field::DeviceType | Field::Vendor => 0,
            Field::ErrorRegister => block.error_register.into(),
            // CiA 301: 1: saves on command; 0: cannot save
            Field::Save => self.keeps.into(),
            Field::HeartbeatPeriod => HEARTBEAT_MS,
            Field::Product | Field::Board => block.board as u32,
            Field::Revision => {
                let [major, minor, patch] = block.version.map(u32::from);
                (major & 0xFF) << 24 | (minor & 0xFF) << 16 | patch
            }
            Field::Serial => serial(block.unique),
            Field::UniqueLow => low,
            Field::UniqueMiddle => middle,
            Field::UniqueHigh => high,
            Field::AlarmBelow => limit(limits.alarm_below_n),
            Field::WarnBelow => limit(limits.warn_below_n),
            Field::WarnAbove => limit(limits.warn_above_n),
            Field::AlarmAbove => limit(limits.alarm_above_n),
            Field::PublishingPeriod => {
                let blocks = self.settings.publish_every_blocks.unwrap_or(block.image_publish_every_blocks);
                u32::from(blocks) * u32::from(BLOCK_MS)
            }
            Field::ZeroShift => u16::from_le_bytes(self.settings.zero_shift_sixteenths.to_le_bytes()).into(),
            Field::TakeZero => self.zero as u32,
            Field::ImageState => self.upload.state as u32,
            Field::ImageActive => block.active_image,
            Field::BootCount => block.boot_count.into(),
            Field::ResetCause => block.reset_cause as u32,
            Field::LostBlocks => block.lost_blocks,
            Field::FramesDropped => block.frames_dropped,
            Field::BusOffs => block.bus_offs,
            Field::BurstState => block.burst_state.into(),
            Field::BurstLoad => self.settings.burst_load_percent.into(),
            Field::BurstDropped => block.burst_dropped,
            Field::Unlocked => self.is_unlocked(block.uptime_s).into(),
            Field::Changes => self.changes,
            // write-only: refused by the caller before
            Field::Image
            | Field::ImageChecksum
            | Field::ClearCounters
            | Field::BurstOrder
            | Field::Key
            | Field::Restart => 0,
        }
    }

    #[inline(never)]
    fn write(
        &mut self,
        index: u16,
        sub: u8,
        length: Option<usize>,
        data: [u8; 4],
        block: &BlockState,
    ) -> Result<Option<Action>, Abort> {
        let object = writable(index, sub)?;
        let value = checked(object, length, data)?;
        match object.field {
            Field::Key => {
                self.unlock(value, block)?;
                return Ok(None);
            }
            Field::BurstOrder => return self.burst(value, block).map(Some),
            _ => self.may_change(block)?,
        }
        let action = self.change(object.field, value)?;
        self.changes = self.changes.saturating_add(1);
        self.unlocked_at_s = Some(block.uptime_s);
        Ok(Some(action))
    }

    /// Whether anything may be changed now.
    #[inline(never)]
    fn may_change(&self, block: &BlockState) -> Result<(), Abort> {
        if !self.is_unlocked(block.uptime_s) {
            return Err(Abort::Locked);
        }
        if block.moving || self.zero == ZeroState::Taking || self.upload.state == UploadState::Saving {
            return Err(Abort::State);
        }
        Ok(())
    }

    fn unlock(&mut self, key: u32, block: &BlockState) -> Result<(), Abort> {
        self.unlocked_at_s = match key {
            0 => None,
            key if key == self.key => Some(block.uptime_s),
            _ => return Err(Abort::Value),
        };
        Ok(())
    }

    fn burst(&self, value: u32, block: &BlockState) -> Result<Action, Abort> {
        let order = Order::of(value);
        if order.blocks == 0 {
            return if value == 0 { Ok(Action::EndBurst) } else { Err(Abort::Value) };
        }
        if order.past > order.blocks {
            return Err(Abort::Value);
        }
        if block.burst_state != 0 {
            return Err(Abort::State);
        }
        Ok(Action::Burst(order))
    }

    /// Changes a setting, or returns the action to be done. Checks everything before it changes anything.
    fn change(&mut self, field: Field, value: u32) -> Result<Action, Abort> {
        let mut settings = self.settings;
        let [alarm_below, warn_below, warn_above, alarm_above] = settings.limits.rising();
        let limit = u16::try_from(value).ok().filter(|l| *l != OFF);
        let rising = match field {
            Field::AlarmBelow => Some([limit, warn_below, warn_above, alarm_above]),
            Field::WarnBelow => Some([alarm_below, limit, warn_above, alarm_above]),
            Field::WarnAbove => Some([alarm_below, warn_below, limit, alarm_above]),
            Field::AlarmAbove => Some([alarm_below, warn_below, warn_above, limit]),
            _ => None,
        };
        match field {
            Field::PublishingPeriod => {
                let ms = u16::try_from(value).map_err(|_| Abort::TooHigh)?;
                if !ms.is_multiple_of(BLOCK_MS) {
                    return Err(Abort::Value);
                }
                settings.publish_every_blocks = Some(ms / BLOCK_MS);
            }
            Field::BurstLoad => settings.burst_load_percent = u8::try_from(value).map_err(|_| Abort::TooHigh)?,
            Field::Save => return Ok(Action::Keep(settings)),
            Field::TakeZero => {
                self.zero = ZeroState::Taking;
                return Ok(Action::TakeZero);
            }
            Field::ImageChecksum => return self.upload.commit(value).map(|()| Action::SaveImage),
            Field::ClearCounters => return Ok(Action::ClearCounters),
            Field::Restart => return Ok(Action::Restart),
            _ => settings.limits = Limits::of(rising.ok_or(Abort::ReadOnly)?)?,
        }
        self.settings = settings;
        Ok(Action::Apply(settings))
    }

    fn begin(&mut self, index: u16, sub: u8, size: u32, block: &BlockState) -> Result<(), Abort> {
        let object = writable(index, sub)?;
        if object.kind != Type::Domain {
            // four bytes need no segments
            return Err(Abort::Command);
        }
        self.may_change(block)?;
        self.upload.begin(size)
    }
}

/// The object, if it may be written.
fn writable(index: u16, sub: u8) -> Result<&'static Object, Abort> {
    if sub == 0 && objects::parts(index).is_some() {
        return Err(Abort::ReadOnly);
    }
    let object = objects::find(index, sub)?;
    if object.access.writable() { Ok(object) } else { Err(Abort::ReadOnly) }
}

/// The value, if it has the object's length and lies in its range.
fn checked(object: &Object, length: Option<usize>, data: [u8; 4]) -> Result<u32, Abort> {
    let expected = object.kind.length().ok_or(Abort::Command)?;
    match length.unwrap_or(expected).cmp(&expected) {
        core::cmp::Ordering::Less => return Err(Abort::TooShort),
        core::cmp::Ordering::Greater => return Err(Abort::TooLong),
        core::cmp::Ordering::Equal => {}
    }
    let unused = 8 * (4 - expected as u32);
    let value = u32::from_le_bytes(data) & (u32::MAX >> unused);
    if object.low == object.high && value != object.low {
        return Err(Abort::Value);
    }
    if value < object.low {
        return Err(Abort::TooLow);
    }
    if value > object.high {
        return Err(Abort::TooHigh);
    }
    Ok(value)
}

/// The serial number of a chip: the CRC-32 of its unique identifier, lowest byte first.
pub fn serial(unique: [u32; 3]) -> u32 {
    let mut bytes = [0; 12];
    for (place, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(unique) {
        *place = word.to_le_bytes();
    }
    crate::checksum::crc32(&bytes)
}
