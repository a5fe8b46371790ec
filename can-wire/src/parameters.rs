//! The parameter record: the parameters of a block as they lie in its flash.
//!
//! ```text
//! offset 0      4         6         8                8 + L     12 + L
//!       +------+---------+---------+----------------+---------+
//!       | GBPR | version | L       | postcard body  | CRC-32  |
//!       | 4 B  | u16     | u16     | L bytes        | u32     |
//!       +------+---------+---------+----------------+---------+
//! ```
//!
//! Little-endian. The body is [`ParameterRecord`] in postcard's own encoding; its order of fields is that of
//! the source, so any change of [`Params`] needs a new [`VERSION`]. The CRC is CRC-32/ISO-HDLC (that of
//! Ethernet and zip) over everything before it. What follows the record is not read.

use crate::NodeId;
use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use model_core::params::Params;
use serde::{Deserialize, Serialize};

/// Where the record lies in the flash of both boards: region `PARAMS` of memory.x.
pub const ADDRESS: u32 = 0x0806_0000;

/// Bytes of flash set aside for it.
pub const LENGTH: usize = 128 * 1024;

/// First bytes of a record.
pub const MAGIC: [u8; 4] = *b"GBPR";

/// Layout of the body.
pub const VERSION: u16 = 2;

/// Largest size of a record, bytes; a multiple of the units in which the chips' flash is programmed.
pub const MAX_SIZE: usize = 576;

/// Bytes before the body.
const HEADER: usize = 8;

/// Bytes after the body.
const TRAILER: usize = 4;

/// Used once at start-up, so without a table.
static CRC32: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Everything a block has to know.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterRecord {
    /// Node on the bus, 1 to 127.
    pub node: u8,
    /// Everything else.
    pub params: Params,
}

/// Why a record is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// The buffer is too short; [`MAX_SIZE`] always suffices.
    BufferTooShort,
    /// The node is not 1 to 127.
    NodeId(u8),
    /// The parameters are refused.
    Params(model_core::Error),
}

impl core::fmt::Display for EncodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            EncodeError::BufferTooShort => write!(f, "buffer too short for the record; give it {MAX_SIZE} bytes"),
            EncodeError::NodeId(n) => write!(f, "node {n} is not 1 to 127"),
            EncodeError::Params(e) => e.fmt(f),
        }
    }
}

impl core::error::Error for EncodeError {}

/// Why a record is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadRecord {
    /// Erased flash: nobody has written a record.
    Erased,
    /// It does not begin with [`MAGIC`].
    Magic,
    /// Its layout is not [`VERSION`] but this one.
    Version(u16),
    /// It is truncated, or longer than any record.
    Length,
    /// Bytes have changed since it was written.
    Crc,
    /// CRC correct, but no [`ParameterRecord`]: written by a program that did not raise the version.
    Body,
    /// The parameters are refused.
    Params(model_core::Error),
    /// The node is not 1 to 127.
    NodeId(u8),
}

impl core::fmt::Display for BadRecord {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            BadRecord::Erased => write!(f, "no parameter record: the flash is erased; write one"),
            BadRecord::Magic => write!(
                f,
                "no parameter record: it does not begin with GBPR; make one with `guideblock parameters --bench BENCH.toml --out RECORD`"
            ),
            BadRecord::Version(found) => write!(
                f,
                "parameter record of version {found}, this program reads version {VERSION}; write it anew with tools of the same release"
            ),
            BadRecord::Length => write!(f, "parameter record is cut or too long; write it anew"),
            BadRecord::Crc => write!(f, "parameter record is damaged (CRC); write it anew"),
            BadRecord::Body => write!(
                f,
                "parameter record does not hold what its version says; write it anew with tools of the same release"
            ),
            BadRecord::Params(e) => write!(f, "parameter record refused: {e}"),
            BadRecord::NodeId(n) => write!(f, "parameter record refused: node {n} is not 1 to 127"),
        }
    }
}

impl core::error::Error for BadRecord {}

/// Writes a record into the beginning of `buffer` and returns that part of it.
///
/// # Errors
/// [`EncodeError::NodeId`] and [`EncodeError::Params`] for what [`decode`] would refuse,
/// [`EncodeError::BufferTooShort`] when it does not fit.
pub fn encode<'a>(record: &ParameterRecord, buffer: &'a mut [u8]) -> Result<&'a [u8], EncodeError> {
    NodeId::new(record.node).ok_or(EncodeError::NodeId(record.node))?;
    record.params.check().map_err(EncodeError::Params)?;
    seal(record, buffer).ok_or(EncodeError::BufferTooShort)
}

/// Writes the record without checking its values; `None` when it does not fit.
fn seal<'a>(record: &ParameterRecord, buffer: &'a mut [u8]) -> Option<&'a [u8]> {
    let (header, rest) = buffer.split_first_chunk_mut::<HEADER>()?;
    let body = postcard::to_slice(record, rest).ok()?.len();
    let [m0, m1, m2, m3] = MAGIC;
    let [v0, v1] = VERSION.to_le_bytes();
    let [l0, l1] = u16::try_from(body).ok()?.to_le_bytes();
    *header = [m0, m1, m2, m3, v0, v1, l0, l1];
    let end = HEADER + body;
    let crc = CRC32.checksum(buffer.get(..end)?).to_le_bytes();
    buffer.get_mut(end..end + TRAILER)?.copy_from_slice(&crc);
    buffer.get(..end + TRAILER)
}

/// Reads and checks the record at the beginning of `bytes`.
///
/// # Errors
/// See [`BadRecord`]; the checks come in the order of its variants, but for the node, which is checked before
/// the parameters.
pub fn decode(bytes: &[u8]) -> Result<ParameterRecord, BadRecord> {
    let mut params = Params::ZHOU_2023;
    let node = decode_into(bytes, &mut params)?;
    Ok(ParameterRecord { node: node.get(), params })
}

/// Reads and checks the record at the beginning of `bytes`, its parameters straight into `params`: the chip needs no
/// copy of them on its stack.
///
/// # Errors
/// As [`decode`]. The content of `params` is then meaningless.
pub fn decode_into(bytes: &[u8], params: &mut Params) -> Result<NodeId, BadRecord> {
    let (header, rest) = bytes.split_first_chunk::<HEADER>().ok_or(BadRecord::Length)?;
    if *header == [0xFF; HEADER] {
        return Err(BadRecord::Erased);
    }
    let [m0, m1, m2, m3, v0, v1, l0, l1] = *header;
    if [m0, m1, m2, m3] != MAGIC {
        return Err(BadRecord::Magic);
    }
    let version = u16::from_le_bytes([v0, v1]);
    if version != VERSION {
        return Err(BadRecord::Version(version));
    }
    let length = usize::from(u16::from_le_bytes([l0, l1]));
    let (body, trailer) = rest.split_at_checked(length).ok_or(BadRecord::Length)?;
    let crc = trailer.first_chunk::<TRAILER>().ok_or(BadRecord::Length)?;
    let covered = bytes.get(..HEADER + length).ok_or(BadRecord::Length)?;
    if CRC32.checksum(covered) != u32::from_le_bytes(*crc) {
        return Err(BadRecord::Crc);
    }
    let mut body = postcard::Deserializer::from_bytes(body);
    // the fields of ParameterRecord, one after the other
    let node = u8::deserialize(&mut body).map_err(|_| BadRecord::Body)?;
    Params::deserialize_in_place(&mut body, params).map_err(|_| BadRecord::Body)?;
    if !body.finalize().map_err(|_| BadRecord::Body)?.is_empty() {
        return Err(BadRecord::Body);
    }
    let node = NodeId::new(node).ok_or(BadRecord::NodeId(node))?;
    params.check().map_err(BadRecord::Params)?;
    Ok(node)
}

/// Whether `bytes` begin with a record of this [`VERSION`] with a correct CRC; its values are not checked.
pub fn is_whole(bytes: &[u8]) -> bool {
    let whole = |bytes: &[u8]| {
        let (covered, crc) = bytes.get(..length(bytes)?)?.split_last_chunk::<TRAILER>()?;
        let [v0, v1] = *covered.get(4..6)?.first_chunk::<2>()?;
        Some(u16::from_le_bytes([v0, v1]) == VERSION && CRC32.checksum(covered) == u32::from_le_bytes(*crc))
    };
    whole(bytes).unwrap_or(false)
}

/// Length of the record at the beginning of `bytes`, header and CRC included. Checks only that it lies within `bytes`
/// and begins with [`MAGIC`].
pub fn length(bytes: &[u8]) -> Option<usize> {
    let (header, _) = bytes.split_first_chunk::<HEADER>()?;
    let [m0, m1, m2, m3, _, _, l0, l1] = *header;
    let length = HEADER + usize::from(u16::from_le_bytes([l0, l1])) + TRAILER;
    ([m0, m1, m2, m3] == MAGIC && length <= bytes.len()).then_some(length)
}

/// Hash that identifies a parameter image: CRC-32 of the record's body, so of all parameters.
///
/// A block sends the hash of its image once a second ([`state`](mod@crate::state)). `None` if `bytes` begin with no
/// record; whether the record is sound, [`decode`] checks. Never 0, which stands for a block without a record.
pub fn image_hash(bytes: &[u8]) -> Option<u32> {
    let body = bytes.get(HEADER..length(bytes)? - TRAILER)?;
    Some(CRC32.checksum(body).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::left_out::WAVES;
    use model_core::left_out::oil::Oil;
    use model_core::left_out::rail::RailTable;
    use model_core::left_out::wave::{Acts, Wave};
    use std::vec::Vec;

    const RECORD: ParameterRecord = ParameterRecord { node: 5, params: Params::ZHOU_2023 };

    /// A block with all left-out mechanisms that it can run.
    fn augmented() -> ParameterRecord {
        let mut record = RECORD;
        let own = &mut record.params.left_out;
        own.seal.coulomb_n = [3.0, 2.5];
        own.viscous.at_100_mm_s_n = [2.0, 2.2];
        own.viscous.exponent = 0.8;
        own.oil = Oil { part: 0.93, law_cst: 100.0 };
        own.asymmetry.part = -0.04;
        own.load.load_n = [500.0, -300.0];
        own.pull.inertia_kg = 12.0;
        own.sensor.lag_s = 0.02;
        own.start_m = -0.3;
        own.waves =
            [Wave { acts: Acts::Force, wavelength_m: 0.0143, sine: [0.02, 0.01, 0.3], cosine: [0.1; 3] }; WAVES];
        own.rail =
            RailTable { acts: Acts::Drag, from_m: -0.5, step_m: 0.02, knots: 64, scale: 1e-3, ..RailTable::NONE };
        for (n, value) in own.rail.values.as_flattened_mut().iter_mut().enumerate() {
            *value = (i32::from(i16::MIN) + n as i32 * 1000) as i16;
        }
        record
    }

    const BOTH: [fn() -> ParameterRecord; 2] = [|| RECORD, augmented];

    fn bytes(record: &ParameterRecord) -> Vec<u8> {
        encode(record, &mut [0; MAX_SIZE]).unwrap().to_vec()
    }

    /// A record around any body, with its CRC.
    fn around(version: u16, body: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::from(MAGIC);
        bytes.extend(version.to_le_bytes());
        bytes.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
        bytes.extend(body);
        bytes.extend(CRC32.checksum(&bytes).to_le_bytes());
        bytes
    }

    #[test]
    fn survives_the_way_there_and_back() {
        for of in BOTH {
            let mut record = of();
            for (node, calibrated, publish_every_blocks) in [(1, false, 10), (127, true, 1)] {
                record.node = node;
                record.params.calibrated = calibrated;
                record.params.publish_every_blocks = publish_every_blocks;
                assert_eq!(decode(&bytes(&record)), Ok(record));
            }
        }
    }

    #[test]
    fn is_laid_out_as_drawn() {
        let bytes = bytes(&RECORD);
        let body = bytes.len() - HEADER - TRAILER;
        assert_eq!(bytes[..4], *b"GBPR");
        assert_eq!(bytes[4..6], [2, 0]);
        assert_eq!(bytes[6..8], u16::try_from(body).unwrap().to_le_bytes());
        // node, then `calibrated`
        assert_eq!(bytes[8..10], [5, 0]);
        assert_eq!(bytes, around(VERSION, &bytes[HEADER..HEADER + body]));
        // check value of CRC-32/ISO-HDLC
        assert_eq!(CRC32.checksum(b"123456789"), 0xCBF4_3926);
    }

    /// When this fails, [`Params`] has changed: raise [`VERSION`], then bring the list up to date.
    #[test]
    fn version_2_holds_these_fields_in_this_order() {
        let fields: Vec<_> = std::format!("{RECORD:?}")
            .split([' ', '{', '['])
            .filter_map(|word| word.strip_suffix(':').map(std::string::String::from))
            .collect();
        assert_eq!(VERSION, 2);
        assert_eq!(
            fields.join(" "),
            "node params calibrated calibration force zero_code newtons_per_code rail_low_code \
             rail_high_code thermistor nominal_ohm beta_k series_ohm metres_per_count law hersey_speed \
             loads_per_force preload_per_load angle_per_load film_per_viscous_speed slip_1 slip_2 viscous \
             stribeck mu_coulomb load_limit_n viscosity centre_degc from_degc to_degc ln \
             viscosity_number_per_cst seals coulomb_n viscous_n_s_m range speed_from_m_s speed_to_m_s \
             preload_from_n preload_to_n uncertainty force_offset_n force_gain seals_n friction viscosity \
             temperature_k ball_pass_ripple moved_mass_kg braking_limit_m_s2 presliding_guard_m \
             ball_pass_wavelength_m publish_every_blocks left_out seal coulomb_n per_decade_n smooth_m_s \
             viscous at_100_mm_s_n at_100_cst_n exponent oil part law_cst asymmetry part viscous_n_s_m load \
             load_n part preload_per_load pull force_n per_m_n_m inertia_kg sensor offset_n gain_error lag_s \
             start_m waves acts wavelength_m sine cosine acts wavelength_m sine cosine acts wavelength_m sine \
             cosine rail acts from_m step_m knots scale values"
        );
    }

    #[test]
    fn no_record_is_longer_than_stated() {
        let mut longest = RECORD;
        longest.params.calibration.force.rail_low_code = u16::MAX;
        longest.params.calibration.force.rail_high_code = u16::MAX;
        longest.params.publish_every_blocks = u16::MAX;
        longest.params.left_out.rail.values = [[i16::MIN; 16]; 4];
        let full = seal(&longest, &mut [0; MAX_SIZE]).unwrap().len();
        assert_eq!(full.next_multiple_of(8), MAX_SIZE);
    }

    #[test]
    fn what_follows_does_not_matter() {
        let mut flash = bytes(&RECORD);
        flash.resize(LENGTH, 0xFF);
        assert_eq!(decode(&flash), Ok(RECORD));
    }

    #[test]
    fn every_truncation_is_found() {
        for of in BOTH {
            let bytes = bytes(&of());
            for length in 0..bytes.len() {
                assert_eq!(decode(&bytes[..length]), Err(BadRecord::Length), "{length}");
                // as an interrupted download leaves it: erased flash from there on
                let mut flash = bytes[..length].to_vec();
                flash.resize(1024, 0xFF);
                let expected = match length {
                    0 => BadRecord::Erased,
                    1..4 => BadRecord::Magic,
                    4 => BadRecord::Version(0xFFFF),
                    5 => BadRecord::Version(0xFF02),
                    // a length of 0xFFxx, which no flash holds
                    6 | 7 => BadRecord::Length,
                    _ => BadRecord::Crc,
                };
                assert_eq!(decode(&flash), Err(expected), "{length}");
            }
        }
    }

    #[test]
    fn every_flipped_bit_is_found() {
        for of in BOTH {
            let good = bytes(&of());
            for bit in 0..8 * good.len() {
                let mut bad = good.clone();
                bad[bit / 8] ^= 1 << (bit % 8);
                let found = decode(&bad).unwrap_err();
                assert!(!is_whole(&bad));
                match bit / 8 {
                    0..4 => assert_eq!(found, BadRecord::Magic),
                    4..6 => assert!(matches!(found, BadRecord::Version(_))),
                    6..8 => assert!(matches!(found, BadRecord::Length | BadRecord::Crc)),
                    _ => assert_eq!(found, BadRecord::Crc),
                }
            }
        }
    }

    #[test]
    fn the_hash_is_that_of_what_the_block_knows() {
        let [plain, more] = BOTH.map(|of| bytes(&of()));
        assert_eq!(length(&plain), Some(plain.len()));
        assert_eq!(image_hash(&plain), Some(CRC32.checksum(&plain[HEADER..plain.len() - TRAILER])));
        assert_ne!(image_hash(&plain), image_hash(&more));
        // what follows does not matter, a changed field does
        assert_eq!(image_hash(&[plain.clone(), std::vec![0xFF; 99]].concat()), image_hash(&plain));
        for bit in 8 * HEADER..8 * (plain.len() - TRAILER) {
            let mut other = plain.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            assert_ne!(image_hash(&other), image_hash(&plain));
        }
        for nothing in [&plain[..plain.len() - 1], &[0xFF; 700], &[]] {
            assert_eq!((length(nothing), image_hash(nothing)), (None, None));
            assert!(!is_whole(nothing));
        }
    }

    #[test]
    fn a_sound_crc_is_not_enough() {
        let good = bytes(&RECORD);
        let body = &good[HEADER..good.len() - TRAILER];
        assert_eq!(decode(&around(VERSION + 1, body)), Err(BadRecord::Version(VERSION + 1)));
        assert_eq!(decode(&around(VERSION, &[body, &[0]].concat())), Err(BadRecord::Body));
        assert_eq!(decode(&around(VERSION, &body[..body.len() - 1])), Err(BadRecord::Body));
        let mut no_bool = body.to_vec();
        no_bool[1] = 2;
        assert_eq!(decode(&around(VERSION, &no_bool)), Err(BadRecord::Body));
        for node in [0, 128, 255] {
            let mut other = body.to_vec();
            other[0] = node;
            assert_eq!(decode(&around(VERSION, &other)), Err(BadRecord::NodeId(node)));
        }
        let mut bad = RECORD;
        bad.params.moved_mass_kg = f32::NAN;
        let refused = bad.params.build().unwrap_err();
        let mut buffer = [0; MAX_SIZE];
        assert_eq!(decode(seal(&bad, &mut buffer).unwrap()), Err(BadRecord::Params(refused)));
    }

    #[test]
    fn only_sound_records_are_written() {
        let mut buffer = [0; MAX_SIZE];
        for node in [0, 128] {
            assert_eq!(encode(&ParameterRecord { node, ..RECORD }, &mut buffer), Err(EncodeError::NodeId(node)));
        }
        let mut bad = RECORD;
        bad.params.moved_mass_kg = f32::NAN;
        assert_eq!(encode(&bad, &mut buffer), Err(EncodeError::Params(bad.params.build().unwrap_err())));
        let length = bytes(&RECORD).len();
        for short in 0..length {
            assert_eq!(encode(&RECORD, &mut buffer[..short]), Err(EncodeError::BufferTooShort), "{short}");
        }
        assert_eq!(encode(&RECORD, &mut buffer[..length]).map(<[u8]>::len), Ok(length));
    }
}
