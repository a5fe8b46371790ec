//! The last third of a second: is this steady motion, and what are force and speed in it?
//!
//! All sums over the window are integers and therefore exact, so they can follow the window as it slides, at
//! the same cost for any length: nothing drifts, and nothing is added up anew.

use crate::calibration::ForceScale;
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
    /// Sum of the force codes, at most 65 520 for 12-bit codes.
    pub force: u32,
    /// Sum of the temperature codes.
    pub temperature: u32,
    /// Counts travelled.
    pub counts: i32,
    /// Whether a force code lies at a rail.
    pub at_rail: bool,
    /// The force code, if all samples have the same.
    pub frozen_at: Option<u16>,
}

impl Summary {
    /// Condenses the codes of a block; `counts` is what [`Encoder`](crate::encoder::Encoder) made of the rest.
    pub fn new(
        force: &[u16; SAMPLES_PER_BLOCK],
        temperature: &[u16; SAMPLES_PER_BLOCK],
        counts: i32,
        scale: &ForceScale,
    ) -> Self {
        let (mut sum, mut warm) = (0u32, 0u32);
        let (mut low, mut high) = (u16::MAX, 0u16);
        for (f, t) in force.iter().zip(temperature) {
            // sixteen u16 cannot reach 2^32
            sum = sum.wrapping_add(u32::from(*f));
            warm = warm.wrapping_add(u32::from(*t));
            low = low.min(*f);
            high = high.max(*f);
        }
        Summary {
            force: sum,
            temperature: warm,
            counts,
            at_rail: low <= scale.rail_low_code || high >= scale.rail_high_code,
            frozen_at: (low == high).then_some(low),
        }
    }

    /// Mean force code.
    pub fn force_code(&self) -> f32 {
        self.force as f32 / SAMPLES_PER_BLOCK as f32
    }
}

/// The ring of the last [`BLOCKS`] blocks with its sliding sums.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    blocks: [Place; BLOCKS],
    /// where the next block goes, which is also the oldest one when the ring is full
    next: usize,
    filled: usize,
    sums: Sums,
}

/// Sums over the blocks in the window.
#[derive(Clone, Copy, Debug)]
struct Sums {
    force: u32,
    temperature: u32,
    /// of squares of the blocks' force sums
    squares: u64,
    /// of products of neighbouring blocks' force sums
    neighbours: u64,
    quarters: [i32; 4],
    /// blocks with a code at a rail
    railed: usize,
    /// the code that has not moved, and for how many blocks, up to a full window
    frozen: Option<(u16, usize)>,
}

const NOTHING: Sums =
    Sums { force: 0, temperature: 0, squares: 0, neighbours: 0, quarters: [0; 4], railed: 0, frozen: None };

/// What must be kept of a block until it leaves the window.
#[derive(Clone, Copy, Debug)]
struct Place {
    force: u32,
    temperature: u32,
    counts: i32,
    at_rail: bool,
}

const EMPTY: Place = Place { force: 0, temperature: 0, counts: 0, at_rail: false };

/// Statistics of a full window, in codes and counts; the monitor converts them to SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Mean force code.
    pub force_code: f32,
    /// Standard deviation of that mean, codes; the correlation of blocks is allowed for.
    pub force_sigma: f32,
    /// Mean temperature code.
    pub temperature_code: f32,
    /// Counts travelled in each quarter, oldest first.
    pub quarters: [i32; 4],
}

impl View {
    /// Counts travelled in the window.
    pub fn counts(&self) -> i32 {
        let [a, b, c, d] = self.quarters;
        a.wrapping_add(b).wrapping_add(c).wrapping_add(d)
    }

    /// Largest difference of counts between two quarters.
    pub fn spread(&self) -> i32 {
        let [a, b, c, d] = self.quarters;
        let high = a.max(b).max(c.max(d));
        let low = a.min(b).min(c.min(d));
        high.wrapping_sub(low)
    }
}

impl Window {
    /// Empty.
    pub const fn new() -> Self {
        Window { blocks: [EMPTY; BLOCKS], next: 0, filled: 0, sums: NOTHING }
    }

    /// Forgets everything, after samples were lost.
    pub fn clear(&mut self) {
        self.filled = 0;
        self.sums = NOTHING;
    }

    /// The block `age` blocks before the newest, 0 to `BLOCKS - 1`; zeros where there is none.
    fn back(&self, age: usize) -> Place {
        // BLOCKS is a power of two, so the wrap does no harm
        let place = self.next.wrapping_sub(age + 1) % BLOCKS;
        if age < self.filled { self.blocks.get(place).copied().unwrap_or(EMPTY) } else { EMPTY }
    }

    /// Adds the newest block and drops the oldest.
    pub fn push(&mut self, block: Summary) {
        let (oldest, second) = (self.back(BLOCKS - 1), self.back(BLOCKS - 2));
        let newest = self.back(0);
        let place =
            Place { force: block.force, temperature: block.temperature, counts: block.counts, at_rail: block.at_rail };
        // each quarter hands its oldest block down
        let handed = [
            oldest.counts,
            self.back(3 * QUARTER - 1).counts,
            self.back(2 * QUARTER - 1).counts,
            self.back(QUARTER - 1).counts,
            place.counts,
        ];
        let sums = &mut self.sums;
        let square = |x: Place, y: Place| u64::from(x.force) * u64::from(y.force);
        // a sum over the window, less what leaves, plus what comes: never negative, never near the type's end
        sums.force = sums.force.wrapping_sub(oldest.force).wrapping_add(place.force);
        sums.temperature = sums.temperature.wrapping_sub(oldest.temperature).wrapping_add(place.temperature);
        sums.squares = sums.squares.wrapping_sub(square(oldest, oldest)).wrapping_add(square(place, place));
        sums.neighbours = sums.neighbours.wrapping_sub(square(oldest, second)).wrapping_add(square(newest, place));
        sums.railed = sums.railed.wrapping_sub(usize::from(oldest.at_rail)).wrapping_add(usize::from(place.at_rail));
        for (quarter, pair) in sums.quarters.iter_mut().zip(handed.windows(2)) {
            if let [leaves, comes] = pair {
                *quarter = quarter.wrapping_sub(*leaves).wrapping_add(*comes);
            }
        }
        sums.frozen = match (block.frozen_at, sums.frozen) {
            (Some(code), Some((same, blocks))) if code == same => Some((code, (blocks + 1).min(BLOCKS))),
            (Some(code), _) => Some((code, 1)),
            (None, _) => None,
        };
        if let Some(free) = self.blocks.get_mut(self.next) {
            *free = place;
        }
        self.next = (self.next + 1) % BLOCKS;
        self.filled = (self.filled + 1).min(BLOCKS);
    }

    /// Whether the window is full.
    pub fn is_full(&self) -> bool {
        self.filled == BLOCKS
    }

    /// Whether a force code in the window lies at a rail.
    pub fn at_rail(&self) -> bool {
        self.sums.railed > 0
    }

    /// Whether the force code has not moved by a count over a whole window.
    pub fn is_frozen(&self) -> bool {
        matches!(self.sums.frozen, Some((_, BLOCKS)))
    }

    /// How much the mean force code of a block has changed from the oldest block to the newest, which lie
    /// `BLOCKS - 1` blocks apart; 0 before the window is full.
    pub fn force_change(&self) -> f32 {
        if !self.is_full() {
            return 0.0;
        }
        // sums of 16 codes: below 2^17, exact
        let change = self.back(0).force as f32 - self.back(BLOCKS - 1).force as f32;
        change / SAMPLES_PER_BLOCK as f32
    }

    /// Statistics of a full window, `None` before it is full.
    ///
    /// The variance of the mean is that of n blocks shortened by their correlation at lag 1,
    /// `n_eff = n (1-ρ)/(1+ρ)`, ρ clipped to 0 to 0.95: ball-pass ripple must not pass for white noise.
    /// With S = Σ f_i over the blocks' force sums:
    ///
    /// ```text
    /// n Σ (f_i - S/n)²                     = n Σ f_i² - S²
    /// n² Σ (f_i - S/n)(f_{i+1} - S/n)      = n² Σ f_i f_{i+1} - n S (2S - f_first - f_last) + (n-1) S²
    /// ```
    pub fn view(&self) -> Option<View> {
        if !self.is_full() {
            return None;
        }
        const SAMPLES: f32 = (BLOCKS * SAMPLES_PER_BLOCK) as f32;
        const N: i64 = BLOCKS as i64;
        // 12-bit codes: S < 2^21, squares < 2^37, all terms below 2^48
        let sum = i64::from(self.sums.force);
        let ends = i64::from(self.back(0).force) + i64::from(self.back(BLOCKS - 1).force);
        let square = N * self.sums.squares as i64 - sum * sum;
        let lagged = N * N * self.sums.neighbours as i64 - N * sum * (2 * sum - ends) + (N - 1) * sum * sum;
        let variance = if square > 0 {
            let square = square as f32 / N as f32;
            let rho = (lagged as f32 / (N * N) as f32 / square).clamp(0.0, 0.95);
            square / ((BLOCKS - 1) * BLOCKS) as f32 * (1.0 + rho) / (1.0 - rho)
        } else {
            0.0
        };
        Some(View {
            force_code: self.sums.force as f32 / SAMPLES,
            force_sigma: num::sqrt(variance) / SAMPLES_PER_BLOCK as f32,
            temperature_code: self.sums.temperature as f32 / SAMPLES,
            quarters: self.sums.quarters,
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
    use crate::calibration::Calibration;

    fn summary(force: u16, counts: i32) -> Summary {
        Summary::new(&[force; 16], &[1000; 16], counts, &Calibration::BENCH.force)
    }

    fn fill(force: impl Fn(usize) -> u16, counts: impl Fn(usize) -> i32, blocks: usize) -> Window {
        let mut w = Window::new();
        for n in 0..blocks {
            w.push(summary(force(n), counts(n)));
        }
        w
    }

    #[test]
    fn keeps_the_newest_in_order() {
        let w = fill(|n| 100 + n as u16, |n| n as i32, 45);
        let v = w.view().expect("full");
        // blocks 13 to 44
        assert_eq!(v.quarters, [132, 196, 260, 324]);
        assert_eq!(v.counts(), 912);
        assert_eq!(v.spread(), 192);
        assert_eq!(v.force_code, 128.5);
        assert_eq!(w.force_change(), 31.0);
        assert_eq!(v.temperature_code, 1000.0);
    }

    #[test]
    fn says_nothing_before_it_is_full() {
        assert_eq!(fill(|_| 50, |_| 1, 31).view(), None);
        let mut w = fill(|_| 50, |_| 1, 40);
        assert!(w.is_full());
        w.clear();
        assert_eq!(w.view(), None);
        assert!(!w.is_frozen());
    }

    #[test]
    fn rails_and_frozen_codes_are_kept_for_a_window() {
        let mut w = fill(|n| if n == 0 { 4095 } else { 500 + (n % 2) as u16 }, |_| 1, 32);
        assert!(w.at_rail());
        w.push(summary(500, 1));
        assert!(!w.at_rail());
        for n in 0..31 {
            assert!(!w.is_frozen(), "{n}");
            w.push(summary(500, 1));
        }
        assert!(w.is_frozen());
        w.push(summary(501, 1));
        assert!(!w.is_frozen());
    }

    /// The sliding sums against the textbook forms in f64.
    #[test]
    fn sliding_sums_are_the_direct_ones() {
        let noise = |n: usize| 500 + ((n * 7919 + 31) * 2_654_435_761 % 1009 % 116) as u16;
        let ripple = |n: usize| (2000.0 + 47.0 * libm::sin(n as f64 * 0.45)) as u16;
        let top = |n: usize| 4095 - (n % 2) as u16;
        let series: [&dyn Fn(usize) -> u16; 3] = [&noise, &ripple, &top];
        for force in series {
            for blocks in [32, 33, 50, 1000] {
                let v = fill(force, |_| 1, blocks).view().expect("full");
                let f: [f64; 32] = core::array::from_fn(|n| f64::from(force(blocks - 32 + n)));
                let mean = f.iter().sum::<f64>() / 32.0;
                let square: f64 = f.iter().map(|x| (x - mean) * (x - mean)).sum();
                let lagged: f64 = f.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum();
                let rho = (lagged / square).clamp(0.0, 0.95);
                let sigma = libm::sqrt(square / (31.0 * 32.0) * (1.0 + rho) / (1.0 - rho));
                assert!((f64::from(v.force_sigma) / sigma - 1.0).abs() < 1e-5, "{} {sigma}", v.force_sigma);
                assert!((f64::from(v.force_code) - mean).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn sigma_widens_for_ripple_and_vanishes_for_nothing() {
        let noise = |n: usize| 500 + ((n * 7919 + 31) * 2_654_435_761 % 1009 % 116) as u16;
        let white = fill(noise, |_| 1, 32).view().expect("full").force_sigma;
        assert!((3.0..12.0).contains(&white), "{white}");
        let ripple = |n: usize| (500.0 + 47.0 * libm::sin(n as f64 * 0.45)) as u16;
        let slow = fill(ripple, |_| 1, 32).view().expect("full").force_sigma;
        assert!(slow > 2.0 * white, "{slow} against {white}");
        assert_eq!(fill(|_| 70, |_| 1, 32).view().expect("full").force_sigma, 0.0);
    }
}
