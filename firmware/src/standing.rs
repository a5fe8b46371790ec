//! Standstill of the carriage, from raw samples alone, and the zero of the force during it.

use model_core::sample::RawBlock;

use crate::timeline::BLOCK_US;

/// Blocks without motion that count as standstill: half a second.
const BLOCKS: u8 = 50;

/// Counts that an encoder at rest may flicker.
const FLICKER: u16 = 8;

/// Time without samples after which nothing is known, µs.
const UNKNOWN_AFTER_US: u64 = 10 * BLOCK_US;

/// Detector of motion. Unknown counts as motion: standstill must be certain.
#[derive(Clone, Copy, Debug)]
pub struct Standing {
    reference: u16,
    still: u8,
    last_us: Option<u64>,
}

impl Standing {
    /// Nothing known.
    pub const fn new() -> Self {
        Standing { reference: 0, still: 0, last_us: None }
    }

    /// Takes the newest samples.
    pub fn step(&mut self, block: &RawBlock, now_us: u64) {
        let near = |count: &u16| count.wrapping_sub(self.reference).wrapping_add(FLICKER) <= 2 * FLICKER;
        if self.last_us.is_some() && block.position.iter().all(near) {
            self.still = self.still.saturating_add(1);
        } else {
            let [.., last] = block.position;
            (self.reference, self.still) = (last, 0);
        }
        self.last_us = Some(now_us);
    }

    /// Whether the carriage has stood for half a second and samples still come.
    pub fn is_standing(&self, now_us: u64) -> bool {
        self.still >= BLOCKS && self.last_us.is_some_and(|last| now_us - last < UNKNOWN_AFTER_US)
    }
}

impl Default for Standing {
    fn default() -> Self {
        Self::new()
    }
}

/// Blocks over which a zero is averaged: with their 1600 codes, the mean in sixteenths is their sum divided by 100.
const ZERO_BLOCKS: u8 = 100;

/// Largest shift of a zero, sixteenths of a code: 10 % of the converter's range. Further away something pulls.
const ZERO_WITHIN: i32 = 4096 * 16 / 10;

/// The mean of the force codes over one second of standing still.
#[derive(Clone, Copy, Debug)]
pub struct ZeroTaking {
    zero_in_use: i32,
    sum: u32,
    blocks: u8,
    expected_tick: Option<u32>,
}

impl ZeroTaking {
    /// Begins; `zero_in_use` in sixteenths of a code.
    pub const fn new(zero_in_use: i32) -> Self {
        ZeroTaking { zero_in_use, sum: 0, blocks: 0, expected_tick: None }
    }

    /// Takes the newest samples. Returns `None` while it goes on; `Some(None)` when no zero can be taken (motion, lost
    /// samples, or more than a tenth of the range away); otherwise the distance of the mean above the zero in use, to
    /// the nearest sixteenth of a code.
    pub fn step(&mut self, block: &RawBlock, standing: bool) -> Option<Option<i16>> {
        if !standing || self.expected_tick.is_some_and(|tick| tick != block.tick) {
            return Some(None);
        }
        self.expected_tick = Some(block.tick.wrapping_add(1));
        self.sum += block.force.iter().copied().map(u32::from).sum::<u32>();
        self.blocks += 1;
        if self.blocks < ZERO_BLOCKS {
            return None;
        }
        let per_sixteenth = u32::from(ZERO_BLOCKS);
        let mean = ((self.sum + per_sixteenth / 2) / per_sixteenth) as i32;
        let above = mean - self.zero_in_use;
        Some(i16::try_from(above).ok().filter(|_| above.abs() <= ZERO_WITHIN))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(tick: u32, position: u16, force: u16) -> RawBlock {
        let flicker = |n: usize| (n % 2) as u16;
        RawBlock {
            tick,
            force: std::array::from_fn(|n| force + flicker(n)),
            temperature: [1850; 16],
            position: std::array::from_fn(|n| position.wrapping_add(flicker(n))),
        }
    }

    #[test]
    fn half_a_second_of_rest_is_standing_and_silence_is_not() {
        let mut standing = Standing::new();
        let now = |n: u64| n * BLOCK_US;
        for n in 0..200_u16 {
            // rolls until block 99, at the wrap of the counter
            let position = 65_530_u16.wrapping_add(n.min(99) * 20);
            standing.step(&block(n.into(), position, 2000), now(n.into()));
            assert_eq!(standing.is_standing(now(n.into())), n >= 99 + 50, "{n}");
        }
        assert!(standing.is_standing(now(199) + UNKNOWN_AFTER_US - 1));
        assert!(!standing.is_standing(now(199) + UNKNOWN_AFTER_US));
        // creeping is motion: the reference stays where it was
        for n in 200..300 {
            standing.step(&block(n, (n - 200) as u16, 2000), now(n.into()));
        }
        assert!(!standing.is_standing(now(299)));
    }

    #[test]
    fn a_zero_is_the_mean_to_a_sixteenth() {
        let mut zero = ZeroTaking::new(2048 * 16);
        let taken: Vec<_> = (0..100).filter_map(|tick| zero.step(&block(tick, 0, 2050), true)).collect();
        assert_eq!(taken, [Some(40)]);
        let mut zero = ZeroTaking::new(2048 * 16);
        assert_eq!(zero.step(&block(0, 0, 2050), true), None);
        assert_eq!(zero.step(&block(2, 0, 2050), true), Some(None), "a gap");
        assert_eq!(ZeroTaking::new(0).step(&block(0, 0, 2050), false), Some(None), "motion");
        let mut zero = ZeroTaking::new(2048 * 16);
        let far: Vec<_> = (0..100).filter_map(|tick| zero.step(&block(tick, 0, 2600), true)).collect();
        assert_eq!(far, [None], "something pulls");
    }
}
