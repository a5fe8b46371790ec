//! The object table: everything that can be read and written.

use super::upload::MAX_IMAGE;
use Access::{Const, Read, ReadWrite, Write};
use Type::{Domain, I16, U8, U16, U32};

/// Data type of an object, as CiA 301 numbers them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Type {
    /// Two's complement, 2 bytes.
    I16 = 0x03,
    /// 1 byte.
    U8 = 0x05,
    /// 2 bytes.
    U16 = 0x06,
    /// 4 bytes.
    U32 = 0x07,
    /// Bytes, as many as the object allows; sent in segments.
    Domain = 0x0F,
}

impl Type {
    /// Bytes of a value; `None` for a domain.
    pub const fn length(self) -> Option<usize> {
        match self {
            U8 => Some(1),
            I16 | U16 => Some(2),
            U32 => Some(4),
            Domain => None,
        }
    }
}

/// Access of a client to an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never changes.
    Const,
    /// Can be read.
    Read,
    /// Can be written.
    Write,
    /// Can be read and written.
    ReadWrite,
}

impl Access {
    /// Whether a client may read.
    pub const fn readable(self) -> bool {
        !matches!(self, Write)
    }

    /// Whether a client may write.
    pub const fn writable(self) -> bool {
        matches!(self, Write | ReadWrite)
    }

    /// As an EDS names it.
    pub const fn name(self) -> &'static str {
        match self {
            Const => "const",
            Read => "ro",
            Write => "wo",
            ReadWrite => "rw",
        }
    }
}

/// Content of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the comment of each stands in the table")]
pub enum Field {
    DeviceType,
    ErrorRegister,
    Save,
    HeartbeatPeriod,
    Vendor,
    Product,
    Revision,
    Serial,
    UniqueLow,
    UniqueMiddle,
    UniqueHigh,
    Board,
    AlarmBelow,
    WarnBelow,
    WarnAbove,
    AlarmAbove,
    PublishingPeriod,
    TakeZero,
    ZeroShift,
    Image,
    ImageChecksum,
    ImageState,
    ImageActive,
    BootCount,
    ResetCause,
    LostBlocks,
    FramesDropped,
    BusOffs,
    ClearCounters,
    BurstOrder,
    BurstState,
    BurstLoad,
    BurstDropped,
    Key,
    Unlocked,
    Changes,
    Restart,
}

/// One object.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Index in the object dictionary.
    pub index: u16,
    /// Subindex; 0 where the object has no parts.
    pub sub: u8,
    /// What it holds.
    pub field: Field,
    /// Type of its value.
    pub kind: Type,
    /// Access of a client.
    pub access: Access,
    /// Smallest value that is accepted.
    pub low: u32,
    /// Largest value that is accepted; for a domain, its largest length in bytes.
    pub high: u32,
}

impl Object {
    /// Name, as an EDS has it.
    pub fn name(&self) -> &'static str {
        TEXTS.get(self.field as usize).map_or("", |(name, _)| name)
    }

    /// What it means, with its unit.
    pub fn comment(&self) -> &'static str {
        TEXTS.get(self.field as usize).map_or("", |(_, comment)| comment)
    }
}

/// Value to write to take the force's zero: `zero`.
pub const TAKE_ZERO: u32 = u32::from_le_bytes(*b"zero");

/// Value to write to keep the settings: `save`.
pub const SAVE: u32 = u32::from_le_bytes(*b"save");

/// Value to write to set the counters to 0: `clrc`.
pub const CLEAR: u32 = u32::from_le_bytes(*b"clrc");

/// Value to write to restart the block: `rset`.
pub const RESTART: u32 = u32::from_le_bytes(*b"rset");

/// Names of the objects that have parts.
pub const RECORDS: [(u16, &str); 11] = [
    (0x1010, "Store parameters"),
    (0x1018, "Identity"),
    (0x2000, "Unique identifier"),
    (0x2002, "Limits of the preload"),
    (0x2004, "Zero of the force"),
    (0x2005, "Parameter image"),
    (0x2006, "Counters"),
    (0x2007, "Burst"),
    (0x2008, "Lock"),
    (0x2009, "Changes"),
    (0x200A, "Restart"),
];

/// All objects, by rising index and subindex.
pub static OBJECTS: [Object; 37] = [
    of(0x1000, 0, Field::DeviceType, U32, Const),
    of(0x1001, 0, Field::ErrorRegister, U8, Read),
    exactly(SAVE, of(0x1010, 1, Field::Save, U32, ReadWrite)),
    of(0x1017, 0, Field::HeartbeatPeriod, U16, Const),
    of(0x1018, 1, Field::Vendor, U32, Const),
    of(0x1018, 2, Field::Product, U32, Const),
    of(0x1018, 3, Field::Revision, U32, Const),
    of(0x1018, 4, Field::Serial, U32, Const),
    of(0x2000, 1, Field::UniqueLow, U32, Const),
    of(0x2000, 2, Field::UniqueMiddle, U32, Const),
    of(0x2000, 3, Field::UniqueHigh, U32, Const),
    of(0x2001, 0, Field::Board, U8, Const),
    of(0x2002, 1, Field::AlarmBelow, U16, ReadWrite),
    of(0x2002, 2, Field::WarnBelow, U16, ReadWrite),
    of(0x2002, 3, Field::WarnAbove, U16, ReadWrite),
    of(0x2002, 4, Field::AlarmAbove, U16, ReadWrite),
    within(10, 10_000, of(0x2003, 0, Field::PublishingPeriod, U16, ReadWrite)),
    exactly(TAKE_ZERO, of(0x2004, 1, Field::TakeZero, U32, ReadWrite)),
    of(0x2004, 2, Field::ZeroShift, I16, Read),
    within(1, MAX_IMAGE as u32, of(0x2005, 1, Field::Image, Domain, Write)),
    of(0x2005, 2, Field::ImageChecksum, U32, Write),
    of(0x2005, 3, Field::ImageState, U8, Read),
    of(0x2005, 4, Field::ImageActive, U32, Read),
    of(0x2006, 1, Field::BootCount, U16, Read),
    of(0x2006, 2, Field::ResetCause, U8, Read),
    of(0x2006, 3, Field::LostBlocks, U32, Read),
    of(0x2006, 4, Field::FramesDropped, U32, Read),
    of(0x2006, 5, Field::BusOffs, U32, Read),
    exactly(CLEAR, of(0x2006, 6, Field::ClearCounters, U32, Write)),
    of(0x2007, 1, Field::BurstOrder, U32, Write),
    of(0x2007, 2, Field::BurstState, U8, Read),
    within(1, 50, of(0x2007, 3, Field::BurstLoad, U8, ReadWrite)),
    of(0x2007, 4, Field::BurstDropped, U32, Read),
    of(0x2008, 1, Field::Key, U32, Write),
    of(0x2008, 2, Field::Unlocked, U8, Read),
    of(0x2009, 1, Field::Changes, U32, Read),
    exactly(RESTART, of(0x200A, 1, Field::Restart, U32, Write)),
];

/// Names and comments, in the order of [`OBJECTS`]. A separate table, because the block itself does not need them.
static TEXTS: [(&str, &str); OBJECTS.len()] = [
    ("Device type", "0: no CiA device profile."),
    ("Error register", "CiA 301: bit 0 any error, 3 temperature, 7 own."),
    (
        "Save all parameters",
        "Write 'save' (0x65766173) to keep limits, period, zero shift and bus load over a reset. Reads 0 when the last attempt failed.",
    ),
    ("Producer heartbeat time", "ms."),
    ("Vendor-ID", "0: none has been assigned."),
    ("Product code", "Board: 1 stm32f405, 2 stm32g474."),
    ("Revision number", "Firmware version: major in bits 24 to 31, minor in 16 to 23, patch in 0 to 15."),
    ("Serial number", "CRC-32 of the unique identifier."),
    ("Unique identifier 0", "Lowest word of the chip's unique identifier."),
    ("Unique identifier 1", "Its middle word."),
    ("Unique identifier 2", "Its highest word."),
    ("Board", "What the firmware runs on: 0 unknown, 1 stm32f405, 2 stm32g474."),
    ("Alarm below", "N; 65535: off."),
    ("Warning below", "N; 65535: off."),
    ("Warning above", "N; 65535: off."),
    ("Alarm above", "N; 65535: off."),
    ("Publishing period", "ms between two estimates, a multiple of 10."),
    (
        "Take zero",
        "Write 'zero' (0x6F72657A) while nothing pulls at the force sensor: the mean of one second becomes its zero. Reads 0 never asked for, 1 under way, 2 taken, 3 not taken.",
    ),
    ("Zero shift", "Sixteenths of a code by which the zero was moved."),
    ("Image", "The parameter image, in segments."),
    ("CRC-32", "Of the image just sent; when it is right the image is kept, and used from the next start on."),
    ("State", "Of the image sent: 0 none, 1 receiving, 2 complete, 3 saving, 4 saved, 5 failed."),
    ("Active image", "Hash of the image the block works with; 0: none, built-in parameters."),
    ("Starts", "Since the supply was switched on."),
    ("Reset cause", "As in the heartbeat."),
    ("Blocks lost", "Blocks of samples (10 ms) lost since start or clearing."),
    ("Frames dropped", "Frames displaced by newer ones since start or clearing."),
    ("Bus-offs", "Times the controller left the bus since start or clearing."),
    ("Clear", "Write 'clrc' (0x63726C63) to set parts 3 to 5 to 0."),
    (
        "Order",
        "Blocks to record in bits 0 to 15, 0 ends a burst; of them already past in bits 16 to 30; bit 31: nobody asks for lost frames again.",
    ),
    ("State", "0 idle, 1 recording and sending, 2 sending the rest."),
    ("Bus load", "Most of the bus that a burst takes, per cent."),
    ("Blocks dropped", "Blocks of the last burst that found no room."),
    ("Key", "Unlocks for five minutes after the last change; 0 locks."),
    ("Unlocked", "0 locked, 1 unlocked."),
    ("Accepted changes", "Writes taken under the key since the start."),
    ("Restart", "Write 'rset' (0x74657372) to start the block anew."),
];

const fn of(index: u16, sub: u8, field: Field, kind: Type, access: Access) -> Object {
    let high = match kind {
        U8 => 0xFF,
        I16 | U16 => 0xFFFF,
        U32 | Domain => u32::MAX,
    };
    Object { index, sub, field, kind, access, low: 0, high }
}

const fn within(low: u32, high: u32, object: Object) -> Object {
    Object { low, high, ..object }
}

/// An object that accepts one value only.
const fn exactly(value: u32, object: Object) -> Object {
    within(value, value, object)
}

/// The object at this index and subindex.
///
/// # Errors
/// [`Abort::NoObject`](super::Abort::NoObject) or [`Abort::NoSubindex`](super::Abort::NoSubindex).
pub fn find(index: u16, sub: u8) -> Result<&'static Object, super::Abort> {
    let mut known = false;
    for object in &OBJECTS {
        if object.index == index {
            if object.sub == sub {
                return Ok(object);
            }
            known = true;
        }
    }
    Err(if known { super::Abort::NoSubindex } else { super::Abort::NoObject })
}

/// The largest subindex of a record; `None` if the index is no record.
pub(crate) fn parts(index: u16) -> Option<u8> {
    OBJECTS.iter().filter(|o| o.index == index && o.sub > 0).map(|o| o.sub).max()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_table_is_in_order_and_every_field_stands_in_it_once() {
        let places: Vec<_> = OBJECTS.iter().map(|o| (o.index, o.sub)).collect();
        assert!(places.is_sorted_by(|a, b| a < b));
        for (n, object) in OBJECTS.iter().enumerate() {
            assert_eq!(object.field as usize, n, "{}", object.name());
            assert!(object.low <= object.high && !object.comment().is_empty());
            assert!(object.name().is_ascii() && object.comment().is_ascii());
        }
    }

    #[test]
    fn every_record_has_its_name_and_all_its_parts() {
        let mut records: Vec<u16> = OBJECTS.iter().filter(|o| o.sub > 0).map(|o| o.index).collect();
        records.dedup();
        assert_eq!(records, RECORDS.map(|(index, _)| index));
        for index in records {
            let subs: Vec<u8> = OBJECTS.iter().filter(|o| o.index == index).map(|o| o.sub).collect();
            assert_eq!(subs, (1..=parts(index).unwrap()).collect::<Vec<_>>());
        }
    }

    #[test]
    fn comments_name_the_signatures_they_mean() {
        for object in OBJECTS.iter().filter(|o| o.low == o.high) {
            let text =
                std::format!("'{}' (0x{:08X})", std::str::from_utf8(&object.low.to_le_bytes()).unwrap(), object.low);
            assert!(object.comment().contains(&text), "{text}: {}", object.comment());
        }
    }
}
