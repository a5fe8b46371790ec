//! The last third of a second: is this steady motion, and what are force and speed in it?

use crate::num;
use crate::sample::{BLOCK_PERIOD_S, SAMPLES_PER_BLOCK};

/// Blocks in the window. Shorter: ball-pass ripple and encoder steps dominate. Longer: short strokes never
/// give an estimate.
pub const BLOCKS: usize = 32;

/// Blocks in a quarter of the window.
const QUARTER: usize = BLOCKS / 4;

/// Length of the window, s.
pub const WINDOW_S: f32 = BLOCKS as f32 * BLOCK_PERIOD_S;

/// One block, condensed. Sums of codes are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Sum of the force codes.
    pub force: u32,
    /// Smallest force code.
    pub force_min: u16,
    /// Largest force code.
    pub force_max: u16,
    /// Sum of the temperature codes.
    pub temperature: u32,
    /// Counts travelled.
    pub counts: i32,
}

impl Summary {
    /// Condenses the codes of a block; `counts` is what [`Encoder`](crate::encoder::Encoder) made of the rest.
    pub fn new(force: &[u16; SAMPLES_PER_BLOCK], temperature: &[u16; SAMPLES_PER_BLOCK], counts: i32) -> Self {
        let (mut sum, mut warm) = (0u32, 0u32);
        let (mut low, mut high) = (u16::MAX, 0u16);
        for (f, t) in force.iter().zip(temperature) {
            sum += u32::from(*f);
            warm += u32::from(*t);
            low = low.min(*f);
            high = high.max(*f);
        }
        Summary { force: sum, force_min: low, force_max: high, temperature: warm, counts }
    }

    /// Mean force code.
    pub fn force_code(&self) -> f32 {
        self.force as f32 / SAMPLES_PER_BLOCK as f32
    }
}

/// The ring of the last [`BLOCKS`] blocks.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    blocks: [Summary; BLOCKS],
    /// where the next block goes, which is also the oldest one when the ring is full
    next: usize,
    filled: usize,
}

/// What a full window says. Codes and counts; the monitor turns them into SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Mean force code.
    pub force_code: f32,
    /// Standard deviation of that mean, codes; blocks are not taken as independent.
    pub force_sigma: f32,
    /// Smallest and largest force code.
    pub force_codes: (u16, u16),
    /// Mean temperature code.
    pub temperature_code: f32,
    /// Counts travelled in each quarter, oldest first.
    pub quarters: [i32; 4],
}

impl View {
    /// Counts travelled in the window.
    pub fn counts(&self) -> i32 {
        self.quarters.iter().sum()
    }

    /// Largest difference of counts between two quarters.
    pub fn spread(&self) -> i32 {
        let (mut low, mut high) = (i32::MAX, i32::MIN);
        for q in self.quarters {
            low = low.min(q);
            high = high.max(q);
        }
        high - low
    }
}

impl Window {
    /// Empty.
    pub const fn new() -> Self {
        Window {
            blocks: [Summary { force: 0, force_min: 0, force_max: 0, temperature: 0, counts: 0 }; BLOCKS],
            next: 0,
            filled: 0,
        }
    }

    /// Forgets everything, after samples were lost.
    pub fn clear(&mut self) {
        self.next = 0;
        self.filled = 0;
    }

    /// Adds the newest block and drops the oldest.
    pub fn push(&mut self, block: Summary) {
        if let Some(place) = self.blocks.get_mut(self.next) {
            *place = block;
        }
        self.next = (self.next + 1) % BLOCKS;
        self.filled = (self.filled + 1).min(BLOCKS);
    }

    /// Whether the window is full.
    pub fn is_full(&self) -> bool {
        self.filled == BLOCKS
    }

    /// Smallest and largest force code of the blocks it holds, `None` when it is empty.
    pub fn force_codes(&self) -> Option<(u16, u16)> {
        // until the ring is full it is filled from the front
        self.blocks
            .iter()
            .take(self.filled)
            .map(|b| (b.force_min, b.force_max))
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Statistics of a full window, `None` before it is full.
    ///
    /// The variance of the mean is that of n blocks shortened by their correlation at lag 1,
    /// `n_eff = n (1-ρ)/(1+ρ)`, ρ clipped to 0 to 0.95: ball-pass ripple must not pass for white noise.
    pub fn view(&self) -> Option<View> {
        if !self.is_full() {
            return None;
        }
        let (newer, older) = self.blocks.split_at_checked(self.next)?;
        let mut force = 0u32;
        let mut temperature = 0u32;
        let (mut low, mut high) = (u16::MAX, 0u16);
        let mut quarters = [0i32; 4];
        for (n, b) in older.iter().chain(newer).enumerate() {
            force += b.force;
            temperature += b.temperature;
            low = low.min(b.force_min);
            high = high.max(b.force_max);
            if let Some(q) = quarters.get_mut(n / QUARTER) {
                *q += b.counts;
            }
        }
        const SAMPLES: f32 = (BLOCKS * SAMPLES_PER_BLOCK) as f32;
        let block_mean = force as f32 / BLOCKS as f32;
        let (mut square, mut lagged, mut previous) = (0.0f32, 0.0f32, 0.0f32);
        for b in older.iter().chain(newer) {
            let d = b.force as f32 - block_mean;
            square += d * d;
            lagged += d * previous;
            previous = d;
        }
        let variance = if square > 0.0 {
            let rho = (lagged / square).clamp(0.0, 0.95);
            square / ((BLOCKS - 1) * BLOCKS) as f32 * (1.0 + rho) / (1.0 - rho)
        } else {
            0.0
        };
        Some(View {
            force_code: force as f32 / SAMPLES,
            force_sigma: num::sqrt(variance) / SAMPLES_PER_BLOCK as f32,
            force_codes: (low, high),
            temperature_code: temperature as f32 / SAMPLES,
            quarters,
        })
    }
}

impl Default for Window {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fill(force: impl Fn(usize) -> u16, counts: impl Fn(usize) -> i32, blocks: usize) -> Window {
        let mut w = Window::new();
        for n in 0..blocks {
            w.push(Summary::new(&[force(n); 16], &[1000; 16], counts(n)));
        }
        w
    }

    #[test]
    fn keeps_the_newest_in_order() {
        let w = fill(|n| n as u16, |n| n as i32, 45);
        let v = w.view().expect("full");
        // blocks 13 to 44
        assert_eq!(v.quarters, [132, 196, 260, 324]);
        assert_eq!(v.counts(), 912);
        assert_eq!(v.spread(), 192);
        assert_eq!(v.force_code, 28.5);
        assert_eq!(v.force_codes, (13, 44));
        assert_eq!(v.temperature_code, 1000.0);
    }

    #[test]
    fn says_nothing_before_it_is_full() {
        assert_eq!(fill(|_| 5, |_| 1, 31).view(), None);
        assert_eq!(fill(|n| n as u16, |_| 1, 3).force_codes(), Some((0, 2)));
        assert_eq!(Window::new().force_codes(), None);
        let mut w = fill(|_| 5, |_| 1, 40);
        assert!(w.is_full());
        w.clear();
        assert_eq!(w.view(), None);
    }

    #[test]
    fn sigma_covers_white_noise_and_widens_for_ripple() {
        // a fixed pseudo-random sequence with variance 33² over 0..=115
        let noise = |n: usize| 500 + ((n * 7919 + 31) * 2_654_435_761 % 1009 % 116) as u16;
        let white = fill(noise, |_| 1, 32).view().expect("full").force_sigma;
        assert!((3.0..12.0).contains(&white), "{white}");
        let ripple = |n: usize| (500.0 + 47.0 * libm::sin(n as f64 * 0.45)) as u16;
        let slow = fill(ripple, |_| 1, 32).view().expect("full").force_sigma;
        assert!(slow > 2.0 * white, "{slow} against {white}");
        assert_eq!(fill(|_| 7, |_| 1, 32).view().expect("full").force_sigma, 0.0);
    }
}
