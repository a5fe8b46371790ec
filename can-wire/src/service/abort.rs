//! Abort codes of CiA 301 that a block uses: why a request was refused.

/// A reason for refusal. Its number stands in bytes 4 to 7 of the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Abort {
    /// The toggle bit of a segment is that of the one before.
    Toggle = 0x0503_0000,
    /// No such command, or one that does not fit here: a segment of no image, a block transfer.
    Command = 0x0504_0001,
    /// The object can only be written.
    WriteOnly = 0x0601_0001,
    /// The object can only be read.
    ReadOnly = 0x0601_0002,
    /// There is no such object.
    NoObject = 0x0602_0000,
    /// The value contradicts another one, such as a warning limit beyond the alarm limit.
    Incompatible = 0x0604_0043,
    /// The length is not the object's, or not what was announced.
    Length = 0x0607_0010,
    /// More bytes than the object holds, or than were announced.
    TooLong = 0x0607_0012,
    /// Fewer bytes than the object needs.
    TooShort = 0x0607_0013,
    /// The object has no such part.
    NoSubindex = 0x0609_0011,
    /// The value is undefined, or a wrong key or CRC.
    Value = 0x0609_0030,
    /// The value is too large.
    TooHigh = 0x0609_0031,
    /// The value is too small.
    TooLow = 0x0609_0032,
    /// The block is locked: write the key first.
    Locked = 0x0800_0021,
    /// Not now: the carriage moves, an image is being saved, or a burst is under way.
    State = 0x0800_0022,
}

impl Abort {
    /// All of them.
    pub const ALL: [Abort; 15] = [
        Abort::Toggle,
        Abort::Command,
        Abort::WriteOnly,
        Abort::ReadOnly,
        Abort::NoObject,
        Abort::Incompatible,
        Abort::Length,
        Abort::TooLong,
        Abort::TooShort,
        Abort::NoSubindex,
        Abort::Value,
        Abort::TooHigh,
        Abort::TooLow,
        Abort::Locked,
        Abort::State,
    ];

    /// The number on the wire.
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The reason with this number; `None` for one that a block never gives.
    pub fn from_code(code: u32) -> Option<Abort> {
        Self::ALL.into_iter().find(|a| a.code() == code)
    }
}

impl core::fmt::Display for Abort {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Abort::Toggle => "a segment came twice or one is missing; send the image anew",
            Abort::Command => "the block does not know this command here; use a client as new as the block's firmware",
            Abort::WriteOnly => "the object can only be written",
            Abort::ReadOnly => "the object can only be read",
            Abort::NoObject => "there is no such object; use a client as new as the block's firmware",
            Abort::Incompatible => {
                "the value contradicts another one: limits go alarm, warning, warning, alarm from low to high"
            }
            Abort::Length => "the length is not that of the object",
            Abort::TooLong => "too many bytes",
            Abort::TooShort => "too few bytes",
            Abort::NoSubindex => "the object has no such part; use a client as new as the block's firmware",
            Abort::Value => "the value means nothing to the block, or key or checksum are wrong",
            Abort::TooHigh => "the value is too large",
            Abort::TooLow => "the value is too small",
            Abort::Locked => "the block is locked; give its key",
            Abort::State => "not now: the carriage moves, or the block is busy saving or sending; stop it or wait",
        })
    }
}

impl core::error::Error for Abort {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_told_apart() {
        for abort in Abort::ALL {
            assert_eq!(Abort::from_code(abort.code()), Some(abort));
        }
        assert_eq!(Abort::from_code(0), None);
        // as CiA 301 numbers them
        assert_eq!(Abort::Locked.code(), 0x0800_0021);
        assert_eq!(Abort::NoObject.code(), 0x0602_0000);
    }
}
