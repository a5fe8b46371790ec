//! Store of parameter images in flash: whenever power is cut, the block starts with the old image or the new one.
//!
//! Two regions of whole erase units, each a row of places of 1 KiB. A save programs the next blank place; programmed
//! flash is never programmed again, and a region is erased only while the other one holds the newest image.
//!
//! ```text
//! place  0                       576       992        1008                                     1024
//!       +-----------------------+---------+----------+------------+-------------+-------+------+
//!       | record, see can-wire  | erased  | settings | generation | !generation | CRC   | GBOK |
//!       | up to 576 B           |         | 15 B     | u32        | u32         | u32   | 4 B  |
//!       +-----------------------+---------+----------+------------+-------------+-------+------+
//! ```
//!
//! A client's settings lie beside the image they were set for, so that both change at one instant: keeping settings
//! means saving the same image once more. A new image takes over the settings, but not a zero that was taken with
//! another zero code. Settings have their own CRC; damaged ones count as those of delivery.
//!
//! The last sixteen bytes, the commit, are written last, after the record was read back: they make it valid. They
//! repeat the record's CRC, so they fit no other record. The intact image with the largest generation counts; a damaged
//! one gives way to the one before it. A record without commit is valid in one place only, the first of the first
//! region, as generation 0: there a programmer puts it, after erasing both regions. Saves leave the first place of each
//! region alone.
//!
//! Erasing takes up to two seconds on the F405 and stops the processor, which its watchdog would not survive. So a save
//! never erases: [`Store::prepare`] does, at start-up before the watchdog runs, when the region in use is full.

use can_wire::parameters::{self, BadRecord};
use can_wire::service::Settings;
use embedded_storage::nor_flash::NorFlash;
use model_core::params::Params;

use crate::ports::{Keep, KeepError, Kept};

/// Bytes of a place; a multiple of what any chip programs at a time.
pub const PLACE: usize = 1024;

/// Bytes programmed at a time, a multiple of any chip's.
const WORDS: usize = 16;

const _: () = assert!(parameters::MAX_SIZE <= SETTINGS_AT && Settings::LENGTH <= WORDS);

/// Bytes of the commit, which makes a record valid.
const COMMIT: usize = 16;

/// Offset of the commit in a place.
const COMMIT_AT: usize = PLACE - COMMIT;

/// Offset of the settings in a place.
const SETTINGS_AT: usize = COMMIT_AT - WORDS;

/// Last bytes of a commit.
const OK: [u8; 4] = *b"GBOK";

/// Value of erased flash.
const ERASED: u8 = 0xFF;

/// Commit, which makes a record valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Commit {
    generation: u32,
    crc: [u8; 4],
}

impl Commit {
    fn of(bytes: &[u8]) -> Option<Commit> {
        let ([generation, complement, crc, ok], []) = bytes.as_chunks::<4>() else { return None };
        let generation = u32::from_le_bytes(*generation);
        let sound = generation == !u32::from_le_bytes(*complement) && *ok == OK && generation > 0;
        sound.then_some(Commit { generation, crc: *crc })
    }

    fn bytes(self) -> [u8; COMMIT] {
        let mut bytes = [0; COMMIT];
        let parts = [self.generation.to_le_bytes(), (!self.generation).to_le_bytes(), self.crc, OK];
        for (place, part) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(parts) {
            *place = part;
        }
        bytes
    }
}

/// Generation of the record in a place: `None` where there is none, or a damaged one.
fn generation(place: &[u8], takes_raw: bool) -> Option<u32> {
    let (record, commit) = place.split_at_checked(COMMIT_AT)?;
    if takes_raw && commit.iter().all(|b| *b == ERASED) {
        return parameters::is_whole(record).then_some(0);
    }
    let commit = Commit::of(commit)?;
    let crc = record.get(..parameters::length(record)?)?.last_chunk::<4>()?;
    (commit.crc == *crc && parameters::is_whole(record)).then_some(commit.generation)
}

/// The valid image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored<'a> {
    /// The record and what follows it in its place; where no image is valid, the first place, so that decoding says
    /// why.
    pub record: &'a [u8],
    /// Generation: number of images saved before it; `None` where no image is valid.
    pub generation: Option<u32>,
}

impl Stored<'_> {
    /// The settings kept beside this image; otherwise those of delivery.
    pub fn settings(&self) -> Settings {
        match self.generation {
            Some(_) => settings_in(self.record).unwrap_or(Settings::DELIVERED),
            None => Settings::DELIVERED,
        }
    }
}

/// The settings in a place, if they are intact.
fn settings_in(place: &[u8]) -> Option<Settings> {
    let bytes = place.get(SETTINGS_AT..)?.first_chunk::<{ Settings::LENGTH }>()?;
    Settings::from_bytes(bytes).ok()
}

/// Finds the valid image in the memory of the two regions.
pub fn newest<'a>(regions: [&'a [u8]; 2]) -> Stored<'a> {
    let [first, _] = regions;
    let mut best = Stored { record: first.get(..COMMIT_AT).unwrap_or(first), generation: None };
    for (n, region) in regions.into_iter().enumerate() {
        for (k, place) in region.as_chunks::<PLACE>().0.iter().enumerate() {
            let Some(generation) = generation(place, (n, k) == (0, 0)) else { continue };
            if best.generation.is_none_or(|before| generation > before) {
                best = Stored { record: place.get(..COMMIT_AT).unwrap_or(place), generation: Some(generation) };
            }
        }
    }
    best
}

/// Why an image was not saved. The block runs, and starts, with the one it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// It is no image that a block would accept.
    Refused(BadRecord),
    /// No blank place is left until the next start, which makes room.
    Full,
    /// The flash refused it, or does not read back what was written.
    Flash,
}

impl core::fmt::Display for SaveError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            SaveError::Refused(why) => why.fmt(f),
            SaveError::Full => write!(f, "no blank place for the image is left; restart the block and send it again"),
            SaveError::Flash => write!(f, "the flash did not take the image; send it again"),
        }
    }
}

impl core::error::Error for SaveError {}

/// The two regions behind a flash driver.
pub struct Store<'a, F> {
    flash: F,
    /// offsets of the regions in the driver's addresses
    regions: [u32; 2],
    /// length of each region, bytes
    length: u32,
    /// buffer of one place, for reading
    place: &'a mut [u8; PLACE],
}

/// Where the newest image is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Found {
    region: usize,
    at: u32,
    generation: u32,
}

impl<'a, F: NorFlash> Store<'a, F> {
    /// Regions of `length` bytes at these offsets, whole erase units each; `place` is memory to read into.
    pub const fn new(flash: F, regions: [u32; 2], length: u32, place: &'a mut [u8; PLACE]) -> Self {
        Store { flash, regions, length, place }
    }

    /// The driver.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Makes room for the next save, if there is none: erases the region that does not hold the newest image. To be
    /// called before the watchdog runs. Returns whether it has erased.
    ///
    /// # Errors
    /// [`SaveError::Flash`].
    pub fn prepare(&mut self) -> Result<bool, SaveError> {
        let region = self.newest()?.map_or(1, |found| found.region);
        if self.blank_place(region)?.is_some() || self.blank_place(1 - region)?.is_some() {
            return Ok(false);
        }
        let start = self.regions[1 - region];
        self.flash.erase(start, start + self.length).map_err(|_| SaveError::Flash)?;
        Ok(true)
    }

    /// Saves an image and returns its generation; from then on the next start finds it.
    ///
    /// Takes a few milliseconds, during which some chips cannot read flash at all: not to be called while moving.
    ///
    /// # Errors
    /// [`SaveError`].
    pub fn save(&mut self, record: &[u8]) -> Result<u32, SaveError> {
        let mut scratch = Params::ZHOU_2023;
        parameters::decode_into(record, &mut scratch).map_err(SaveError::Refused)?;
        // a record that decodes has a legal length
        let record = parameters::length(record).and_then(|n| record.get(..n)).ok_or(SaveError::Flash)?;
        let crc = *record.last_chunk::<4>().ok_or(SaveError::Flash)?;
        let zero_code = scratch.calibration.force.zero_code;
        let found = self.newest()?;
        let settings = self.settings_for(found, zero_code, &mut scratch)?;
        let (place, generation) = self.next(found)?;
        // whole words; the last one is padded with the value of erased flash
        let (words, rest) = record.as_chunks::<WORDS>();
        let words = words.as_flattened();
        self.program(place, words)?;
        if !rest.is_empty() {
            let mut last = [ERASED; WORDS];
            last.get_mut(..rest.len()).ok_or(SaveError::Flash)?.copy_from_slice(rest);
            self.program(place + words.len() as u32, &last)?;
        }
        self.finish(place, settings, Commit { generation, crc })?;
        Ok(generation)
    }

    /// Keeps settings: saves the newest image once more, with these beside it.
    ///
    /// # Errors
    /// [`SaveError::Refused`] where there is no image; else as [`save`](Self::save).
    pub fn save_settings(&mut self, settings: &Settings) -> Result<u32, SaveError> {
        let found = self.newest()?.ok_or(SaveError::Refused(BadRecord::Erased))?;
        let (place, generation) = self.next(Some(found))?;
        self.read(found.at)?;
        let length = parameters::length(self.place).ok_or(SaveError::Flash)?;
        let crc = self.place.get(..length).and_then(|record| record.last_chunk::<4>());
        let crc = *crc.ok_or(SaveError::Flash)?;
        let mut words = [ERASED; WORDS];
        for offset in (0..length as u32).step_by(WORDS) {
            self.flash.read(found.at + offset, &mut words).map_err(|_| SaveError::Flash)?;
            self.program(place + offset, &words)?;
        }
        self.finish(place, Some(*settings), Commit { generation, crc })?;
        Ok(generation)
    }

    /// The settings beside the image in use, as far as they hold for an image with this zero code.
    fn settings_for(
        &mut self,
        found: Option<Found>,
        zero_code: f32,
        scratch: &mut Params,
    ) -> Result<Option<Settings>, SaveError> {
        let Some(found) = found else { return Ok(None) };
        self.read(found.at)?;
        let Some(settings) = settings_in(self.place) else { return Ok(None) };
        let before = parameters::decode_into(self.place, scratch).map(|_| scratch.calibration.force.zero_code);
        let zero_shift_sixteenths = if before == Ok(zero_code) { settings.zero_shift_sixteenths } else { 0 };
        Ok(Some(Settings { zero_shift_sixteenths, ..settings }))
    }

    /// Place and generation of the next save.
    fn next(&mut self, found: Option<Found>) -> Result<(u32, u32), SaveError> {
        let generation = found.map_or(0, |f| f.generation).checked_add(1).ok_or(SaveError::Full)?;
        let region = found.map_or(0, |f| f.region);
        let place = match self.blank_place(region)? {
            Some(place) => place,
            None => self.blank_place(1 - region)?.ok_or(SaveError::Full)?,
        };
        Ok((place, generation))
    }

    /// Writes settings beside a record, then commits both.
    fn finish(&mut self, place: u32, settings: Option<Settings>, commit: Commit) -> Result<(), SaveError> {
        if let Some(settings) = settings {
            let mut words = [ERASED; WORDS];
            for (byte, value) in words.iter_mut().zip(settings.to_bytes()) {
                *byte = value;
            }
            self.program(place + SETTINGS_AT as u32, &words)?;
        }
        self.program(place + COMMIT_AT as u32, &commit.bytes())
    }

    /// Programs and reads back.
    fn program(&mut self, at: u32, bytes: &[u8]) -> Result<(), SaveError> {
        self.flash.write(at, bytes).map_err(|_| SaveError::Flash)?;
        let back = self.place.get_mut(..bytes.len()).ok_or(SaveError::Flash)?;
        self.flash.read(at, back).map_err(|_| SaveError::Flash)?;
        if back == bytes { Ok(()) } else { Err(SaveError::Flash) }
    }

    fn newest(&mut self) -> Result<Option<Found>, SaveError> {
        let mut best: Option<Found> = None;
        for region in 0..2 {
            for at in self.places(region) {
                self.read(at)?;
                let takes_raw = at == self.regions[0];
                if let Some(generation) = generation(self.place, takes_raw)
                    && best.is_none_or(|b| generation > b.generation)
                {
                    best = Some(Found { region, at, generation });
                }
            }
        }
        Ok(best)
    }

    /// The first blank place behind all programmed ones of a region.
    fn blank_place(&mut self, region: usize) -> Result<Option<u32>, SaveError> {
        let mut blank = None;
        // the first place of a region is the programmer's
        for at in self.places(region).skip(1) {
            self.read(at)?;
            if self.place.iter().any(|b| *b != ERASED) {
                blank = None;
            } else if blank.is_none() {
                blank = Some(at);
            }
        }
        Ok(blank)
    }

    fn read(&mut self, at: u32) -> Result<(), SaveError> {
        self.flash.read(at, self.place).map_err(|_| SaveError::Flash)
    }

    fn places(&self, region: usize) -> impl Iterator<Item = u32> + use<'a, F> {
        let start = self.regions.get(region).copied().unwrap_or_default();
        (start..start + self.length).step_by(PLACE)
    }
}

impl<F: NorFlash> Keep for Store<'_, F> {
    /// Does not await: the processor stands while flash is programmed, for a few milliseconds, and never erases.
    async fn save(&mut self, what: Kept, bytes: &[u8]) -> Result<(), KeepError> {
        let kept = match what {
            Kept::Image => self.save(bytes),
            Kept::Settings => match bytes.first_chunk().map(Settings::from_bytes) {
                Some(Ok(settings)) => self.save_settings(&settings),
                _ => return Err(KeepError::Refused),
            },
        };
        kept.map(|_| ()).map_err(|why| match why {
            SaveError::Refused(_) => KeepError::Refused,
            SaveError::Full => KeepError::Full,
            SaveError::Flash => KeepError::Memory,
        })
    }
}

#[cfg(test)]
mod tests;
