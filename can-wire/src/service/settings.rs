//! Settings of a block, and the bytes in which they are kept.
//!
//! ```text
//! byte  0       2       4       6       8          10      12     13        14
//!      +-------+-------+-------+-------+----------+-------+------+---------+-----+
//!      | alarm | warn  | warn  | alarm | publish  | zero  | load | version | CRC |
//!      | below | below | above | above | blocks   | shift | u8   | u8      | u8  |
//!      +-------+-------+-------+-------+----------+-------+------+---------+-----+
//! ```
//!
//! With one byte more, the CRC would begin to miss errors of two bits.

use super::Limits;
use super::limits::OFF;
use crate::frame;

/// Layout of the bytes.
const VERSION: u8 = 1;

/// Takes the place of the identifier in the CRC.
const CRC_SEED: u16 = 0x5347;

/// What a client has set. It is stored as [`to_bytes`](Self::to_bytes) and restored at the next start by
/// [`from_bytes`](Self::from_bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Limits of the preload.
    pub limits: Limits,
    /// Blocks of 10 ms between two estimates, 1 to 1000; `None`: as in the parameter image.
    pub publish_every_blocks: Option<u16>,
    /// Shift added to the force converter's zero code of the parameter image, in sixteenths of a code.
    pub zero_shift_sixteenths: i16,
    /// Largest share of the bus that a burst may take, per cent, 1 to 50.
    pub burst_load_percent: u8,
}

/// Why bytes are no settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadSettings {
    /// Another version.
    Version(u8),
    /// Bytes have changed.
    Crc,
    /// A value is illegal.
    Value(&'static str),
}

impl core::fmt::Display for BadSettings {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            BadSettings::Version(found) => write!(f, "settings of version {found}, this program reads {VERSION}"),
            BadSettings::Crc => f.write_str("settings are damaged (CRC)"),
            BadSettings::Value(name) => write!(f, "settings hold a {name} that is not legal"),
        }
    }
}

impl core::error::Error for BadSettings {}

impl Settings {
    /// Bytes of [`to_bytes`](Self::to_bytes).
    pub const LENGTH: usize = 15;

    /// As delivered: no limits, publishing as the image says, no shift, bursts on a fifth of the bus.
    pub const DELIVERED: Settings =
        Settings { limits: Limits::OFF, publish_every_blocks: None, zero_shift_sixteenths: 0, burst_load_percent: 20 };

    /// The bytes to keep.
    pub fn to_bytes(&self) -> [u8; Self::LENGTH] {
        let [alarm_below, warn_below, warn_above, alarm_above] =
            self.limits.rising().map(|limit| limit.unwrap_or(OFF).to_le_bytes());
        let publish = self.publish_every_blocks.unwrap_or(0).to_le_bytes();
        let shift = self.zero_shift_sixteenths.to_le_bytes();
        let mut bytes = [0; Self::LENGTH];
        let words = [alarm_below, warn_below, warn_above, alarm_above, publish, shift];
        for (place, word) in bytes.as_chunks_mut::<2>().0.iter_mut().zip(words) {
            *place = word;
        }
        let [.., load, version, _] = &mut bytes;
        (*load, *version) = (self.burst_load_percent, VERSION);
        let crc = frame::crc_of(CRC_SEED, &bytes[..Self::LENGTH - 1]);
        bytes[Self::LENGTH - 1] = crc;
        bytes
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// [`BadSettings`]; the CRC is checked first, the rest in the order of the variants.
    pub fn from_bytes(bytes: &[u8; Self::LENGTH]) -> Result<Settings, BadSettings> {
        let [rest @ .., crc] = bytes;
        if frame::crc_of(CRC_SEED, rest) != *crc {
            return Err(BadSettings::Crc);
        }
        let [words @ .., load, version] = rest;
        if *version != VERSION {
            return Err(BadSettings::Version(*version));
        }
        let mut numbers = [0_u16; 6];
        for (number, word) in numbers.iter_mut().zip(words.as_chunks::<2>().0) {
            *number = u16::from_le_bytes(*word);
        }
        let [limits @ .., publish, shift] = numbers;
        let limits = Limits::of(limits.map(|l| (l != OFF).then_some(l))).map_err(|_| BadSettings::Value("limit"))?;
        let settings = Settings {
            limits,
            publish_every_blocks: (publish != 0).then_some(publish),
            zero_shift_sixteenths: i16::from_le_bytes(shift.to_le_bytes()),
            burst_load_percent: *load,
        };
        if publish > 1000 {
            return Err(BadSettings::Value("publishing period"));
        }
        if !(1..=50).contains(load) {
            return Err(BadSettings::Value("bus load"));
        }
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOME: Settings = Settings {
        limits: Limits {
            alarm_below_n: Some(1000),
            warn_below_n: None,
            warn_above_n: Some(4000),
            alarm_above_n: Some(65531),
        },
        publish_every_blocks: Some(1),
        zero_shift_sixteenths: -300,
        burst_load_percent: 50,
    };

    #[test]
    fn survive_the_way_there_and_back() {
        for settings in [SOME, Settings::DELIVERED] {
            assert_eq!(Settings::from_bytes(&settings.to_bytes()), Ok(settings));
        }
        assert_eq!(SOME.to_bytes()[..14], [0xE8, 3, 0xFF, 0xFF, 0xA0, 15, 0xFB, 0xFF, 1, 0, 0xD4, 0xFE, 50, 1]);
    }

    #[test]
    fn every_error_of_up_to_two_bits_is_found() {
        let good = SOME.to_bytes();
        for a in 0..120 {
            for b in a..120 {
                let mut bad = good;
                bad[a / 8] ^= 1 << (a % 8);
                if b != a {
                    bad[b / 8] ^= 1 << (b % 8);
                }
                assert_eq!(Settings::from_bytes(&bad), Err(BadSettings::Crc), "{a} {b}");
            }
        }
        // erased and zeroed memory
        assert!(Settings::from_bytes(&[0xFF; 15]).is_err() && Settings::from_bytes(&[0; 15]).is_err());
    }
}
