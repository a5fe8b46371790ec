use super::*;
use can_wire::parameters::ParameterRecord;
use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Bytes that a chip programs at a time: 4 on the F405, 8 with ECC on the G474; embassy's driver takes 16 at a time.
const WORD: usize = 8;

/// Bytes that are erased at a time. Small, so that regions fill and change within a test.
const UNIT: usize = 2048;

const REGIONS: [u32; 2] = [0, 2 * UNIT as u32];
const LENGTH: u32 = 2 * UNIT as u32;

/// What a power cut does to the word or erase unit that was being written.
#[derive(Clone, Copy, Debug)]
enum Torn {
    /// Nothing of it happened.
    Nothing,
    /// Some bits of it, by chance of this seed.
    Some(u64),
    /// All of it, but without a report of success.
    All,
}

/// A flash that is stricter than the chips: it refuses to program what is not erased, to program or erase parts of a
/// word or unit, and after its power was cut it refuses everything.
struct Flash {
    memory: Vec<u8>,
    /// operations until the power is cut
    left: Option<u32>,
    torn: Torn,
    operations: u32,
}

#[derive(Debug)]
struct Refusal;

impl NorFlashError for Refusal {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn new() -> Self {
        Flash { memory: vec![ERASED; 2 * LENGTH as usize], left: None, torn: Torn::Nothing, operations: 0 }
    }

    /// The power comes back.
    fn restart(&mut self) {
        self.left = None;
    }

    /// Counts an operation on these bytes, which would become `after`; power may be cut within it.
    fn operate(&mut self, at: usize, after: &[u8]) -> Result<(), Refusal> {
        self.operations += 1;
        let cut = match &mut self.left {
            Some(0) => return Err(Refusal),
            Some(left) => {
                *left -= 1;
                *left == 0
            }
            None => false,
        };
        let cells = &mut self.memory[at..at + after.len()];
        match (cut, self.torn) {
            (false, _) | (true, Torn::All) => cells.copy_from_slice(after),
            (true, Torn::Nothing) => {}
            (true, Torn::Some(mut seed)) => {
                for (cell, after) in cells.iter_mut().zip(after) {
                    seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    let mask = (seed >> 33) as u8;
                    *cell = (*cell & !mask) | (after & mask);
                }
            }
        }
        if cut { Err(Refusal) } else { Ok(()) }
    }

    fn stored(&self) -> Stored<'_> {
        let (first, second) = self.memory.split_at(LENGTH as usize);
        newest([first, second])
    }
}

impl ErrorType for Flash {
    type Error = Refusal;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refusal> {
        if self.left == Some(0) {
            return Err(Refusal);
        }
        bytes.copy_from_slice(&self.memory[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = UNIT;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD), "part of a word");
        for (n, word) in bytes.chunks(WORD).enumerate() {
            let at = offset as usize + n * WORD;
            assert!(self.memory[at..at + WORD].iter().all(|b| *b == ERASED), "programmed twice at {at}");
            self.operate(at, word)?;
        }
        Ok(())
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refusal> {
        assert!((from as usize).is_multiple_of(UNIT) && (to as usize).is_multiple_of(UNIT), "part of a unit");
        for at in (from as usize..to as usize).step_by(UNIT) {
            self.operate(at, &[ERASED; UNIT])?;
        }
        Ok(())
    }
}

/// An image that differs from every other in its sensors' zero.
fn image(n: u32) -> Vec<u8> {
    let mut params = Params { calibrated: true, ..Params::ZHOU_2023 };
    params.calibration.force.zero_code = 2000.0 + n as f32;
    params.left_out.seal.coulomb_n = [n as f32, 2.0];
    let mut buffer = [0; parameters::MAX_SIZE];
    parameters::encode(&ParameterRecord { node: 5, params }, &mut buffer).unwrap().to_vec()
}

fn store(flash: Flash) -> Store<'static, Flash> {
    Store::new(flash, REGIONS, LENGTH, Box::leak(Box::new([0; PLACE])))
}

/// Which of two images a start would find, by what it decodes to.
fn found(flash: &Flash, images: &[&[u8]]) -> Option<usize> {
    let stored = flash.stored();
    let decoded = parameters::decode(stored.record).ok()?;
    images.iter().position(|image| parameters::decode(image) == Ok(decoded))
}

/// A used flash: a programmer's record and `saves` saves, with a restart wherever room was needed.
fn lived(saves: u32) -> Flash {
    let mut flash = Flash::new();
    let raw = image(0);
    flash.memory[..raw.len()].copy_from_slice(&raw);
    let mut store = store(flash);
    for n in 1..=saves {
        store.prepare().unwrap();
        assert_eq!(store.save(&image(n)), Ok(n));
    }
    store.flash
}

#[test]
fn the_newest_of_many_saves_is_found() {
    for saves in 0..20 {
        let flash = lived(saves);
        assert_eq!(flash.stored().generation, Some(saves));
        assert_eq!(found(&flash, &[&image(saves)]), Some(0));
    }
}

#[test]
fn without_room_a_save_is_refused_until_the_next_start() {
    let mut store = store(lived(0));
    // three places in each region beside the programmer's
    for n in 1..=6 {
        assert_eq!(store.save(&image(n)), Ok(n));
    }
    assert_eq!(store.save(&image(7)), Err(SaveError::Full));
    assert_eq!(found(&store.flash, &[&image(6)]), Some(0));
    assert_eq!(store.prepare(), Ok(true));
    assert_eq!(store.prepare(), Ok(false));
    assert_eq!(store.save(&image(7)), Ok(7));
    assert_eq!(found(&store.flash, &[&image(7)]), Some(0));
}

/// Every single operation of a save and of making room, each torn in several ways, at every stage of the regions.
#[test]
fn wherever_the_power_is_cut_the_old_or_the_new_image_is_found() {
    let torn = [Torn::Nothing, Torn::All, Torn::Some(1), Torn::Some(2), Torn::Some(3), Torn::Some(4)];
    let (mut cuts, mut olds, mut news) = (0, 0, 0);
    for saves in 0..14 {
        let next = image(saves + 1);
        let mut whole = store(lived(saves));
        let before = whole.flash.operations;
        whole.prepare().unwrap();
        whole.save(&next).unwrap();
        let operations = whole.flash.operations - before;
        for cut in 1..=operations {
            for torn in torn {
                let mut flash = lived(saves);
                (flash.left, flash.torn) = (Some(cut), torn);
                let mut store = store(flash);
                // the last operation may be the commit itself: then the save has failed, and the image is there
                let outcome = store.prepare().and_then(|_| store.save(&next));
                assert!(outcome.is_err(), "cut {cut} of {operations}");
                store.flash.restart();
                let old = image(saves);
                let which = found(&store.flash, &[&old, &next]).unwrap_or_else(|| {
                    panic!("{saves} saves, cut {cut} of {operations}, {torn:?}: neither the old nor the new image")
                });
                cuts += 1;
                if which == 0 {
                    olds += 1
                } else {
                    news += 1
                }
                // operation goes on: the next start makes room, the next save succeeds
                let found_generation = store.flash.stored().generation.unwrap();
                store.prepare().unwrap();
                assert_eq!(found(&store.flash, &[&old, &next]), Some(which), "making room lost the image");
                assert_eq!(store.save(&image(99)), Ok(found_generation + 1));
                assert_eq!(found(&store.flash, &[&image(99)]), Some(0));
            }
        }
    }
    println!("{cuts} cuts: {olds} found the old image, {news} the new one");
    assert!(cuts > 4000 && news > 0);
}

/// The same on a block without an image: it finds nothing, and is uncalibrated, or the whole new image.
#[test]
fn a_first_save_that_is_cut_leaves_nothing_or_all() {
    let next = image(1);
    let mut whole = store(Flash::new());
    whole.save(&next).unwrap();
    for cut in 1..=whole.flash.operations {
        for seed in 0..8 {
            let mut flash = Flash::new();
            (flash.left, flash.torn) = (Some(cut), Torn::Some(seed));
            let mut store = store(flash);
            assert!(store.save(&next).is_err());
            store.flash.restart();
            assert_eq!(found(&store.flash, &[&next]).is_some(), store.flash.stored().generation.is_some());
            if store.flash.stored().generation.is_none() {
                assert!(parameters::decode(store.flash.stored().record).is_err());
            }
            assert!(store.save(&next).is_ok());
        }
    }
}

#[test]
fn every_flipped_bit_of_the_newest_gives_way_to_the_one_before() {
    for saves in [1, 2] {
        let flash = lived(saves);
        let (old, new) = (image(saves - 1), image(saves));
        let at = saves as usize * PLACE;
        assert_eq!(&flash.memory[at..at + new.len()], new);
        let mut fell_back = 0;
        for bit in 0..8 * PLACE {
            let mut bad = Flash::new();
            bad.memory.copy_from_slice(&flash.memory);
            bad.memory[at + bit / 8] ^= 1 << (bit % 8);
            let which = found(&bad, &[&old, &new]).expect("one of them");
            // the padding between record and commit has no meaning
            let matters = bit / 8 < new.len() || bit / 8 >= COMMIT_AT;
            assert_eq!(which, usize::from(!matters), "byte {}", bit / 8);
            fell_back += usize::from(which == 0);
        }
        assert_eq!(fell_back, 8 * (new.len() + COMMIT));
    }
}

#[test]
fn what_a_block_would_refuse_is_not_saved() {
    let mut store = store(lived(1));
    let mut damaged = image(2);
    damaged[40] ^= 1;
    assert_eq!(store.save(&damaged), Err(SaveError::Refused(BadRecord::Crc)));
    assert_eq!(store.save(&[0xFF; 64]), Err(SaveError::Refused(BadRecord::Erased)));
    assert_eq!(store.save(&[]), Err(SaveError::Refused(BadRecord::Length)));
    assert_eq!(found(&store.flash, &[&image(1)]), Some(0));
}

#[test]
fn empty_regions_say_what_is_wrong() {
    let flash = Flash::new();
    assert_eq!(flash.stored().generation, None);
    assert_eq!(parameters::decode(flash.stored().record), Err(BadRecord::Erased));
    assert_eq!(newest([&[], &[]]), Stored { record: &[], generation: None });
}

const SET: Settings = Settings {
    publish_every_blocks: Some(5),
    zero_shift_sixteenths: -24,
    burst_load_percent: 30,
    ..Settings::DELIVERED
};

#[test]
fn settings_lie_beside_the_image_they_were_set_for() {
    let mut store = store(lived(2));
    assert_eq!(store.flash.stored().settings(), Settings::DELIVERED);
    assert_eq!(store.save_settings(&SET), Ok(3));
    assert_eq!(found(&store.flash, &[&image(2)]), Some(0));
    assert_eq!(store.flash.stored().settings(), SET);
    // the same image once more keeps them all, one with another zero code all but the zero
    assert_eq!(store.save(&image(2)), Ok(4));
    assert_eq!(store.flash.stored().settings(), SET);
    assert_eq!(store.save(&image(3)), Ok(5));
    assert_eq!(store.flash.stored().settings(), Settings { zero_shift_sixteenths: 0, ..SET });
    // nothing to keep them with
    let mut empty = self::store(Flash::new());
    assert_eq!(empty.save_settings(&SET), Err(SaveError::Refused(BadRecord::Erased)));
    assert_eq!(empty.flash.stored().settings(), Settings::DELIVERED);
}

#[test]
fn wherever_the_power_is_cut_the_old_or_the_new_settings_are_found() {
    let other = Settings { burst_load_percent: 7, ..SET };
    for saves in 0..7 {
        let prepared = || {
            let mut store = store(lived(saves));
            store.prepare().unwrap();
            store.save_settings(&other).unwrap();
            store.prepare().unwrap();
            store
        };
        let mut whole = prepared();
        let before = whole.flash.operations;
        whole.save_settings(&SET).unwrap();
        let operations = whole.flash.operations - before;
        for cut in 1..=operations {
            for torn in [Torn::Nothing, Torn::All, Torn::Some(1), Torn::Some(2), Torn::Some(3)] {
                let mut store = prepared();
                (store.flash.left, store.flash.torn) = (Some(cut), torn);
                assert!(store.save_settings(&SET).is_err());
                store.flash.restart();
                assert_eq!(found(&store.flash, &[&image(saves)]), Some(0), "{saves} {cut} {torn:?}");
                let kept = store.flash.stored().settings();
                assert!(kept == other || kept == SET && cut == operations, "{saves} {cut} {torn:?}: {kept:?}");
            }
        }
    }
}
