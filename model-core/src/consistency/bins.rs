//! Analysis of variance of the passages through the bins of one axis: do the means of the bins agree?
//!
//! ```text
//! between   SB = Σ n_b (m_b - m)²            B - 1 degrees of freedom
//! within    s² = Σ_b Σ (y_i - m_b)²/(N - B)  of passages; neighbours correlate by ρ, so f = (1+ρ)/(1-ρ)
//! chance    c² = s² f + σ₀²                  σ₀: scatter always assumed: an s² small by luck proves nothing
//! F         = SB/((B - 1) c²)                with B - 1 and n = (N - B)/f · (c²/(s² f))² degrees of freedom
//! strength  = ((1-b) F^⅓ - (1-a))/√(b F^⅔ + a),  a = 2/9(B - 1), b = 2/9n      Paulson 1942: F as standard deviations
//! share²    = (SB - (B - 1) c²)/N            variance between the bins less that of chance
//! ```
//!
//! Where the level itself may drift (preload does), the axis follows it: level and bin mean share the deviation of a
//! passage, `level += follow·(y - level - m_b)`. A drift then goes into the level and a difference between bins into
//! the bins, however long the block stays in one. The scatter within bins is then taken from successive differences,
//! `(y_i - y_i-1)²/2` (von Neumann 1941), so that a growing effect does not hide behind its own growth. The estimate of
//! ρ from deviations from means of a few passages per bin is too small by (1 + 3ρ)/n (Kendall 1954), which is added
//! back.
//!
//! A bin with many passages forgets half of them, so that a repaired model, or a block that has changed, is judged by
//! its present behaviour.

use crate::num;

/// Largest number of bins of an axis.
pub(super) const MOST: usize = 32;

/// Least number of passages of a bin that counts. Fewer: one bad passage makes a bin's mean.
const LEAST: f32 = 3.0;

/// Least degrees of freedom of chance for a judgement.
const LEAST_FREEDOM: f32 = 8.0;

/// Degrees of freedom that a step from passage to passage is worth: neighbouring steps share one.
const STEPS_COUNT: f32 = 2.0 / 3.0;

/// Scatter of passages that is always assumed (σ₀), share of the drag. Smaller: a few quiet passages make chance look
/// small. Larger: it takes more passages to see an effect of relevant size.
const ALWAYS_THERE: f32 = 0.0025;

/// Passages of a bin at which it forgets half of them. Fewer: small effects drown in chance. More: a repaired model is
/// suspected for longer.
const FORGET: f32 = 24.0;

/// Estimates after which a passage ends even within one bin.
const LONGEST: f32 = 200.0;

/// Passages over which the correlation of neighbours is remembered.
const CORRELATION_MEMORY: f32 = 64.0;

/// Result of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// How surely the bins disagree, standard deviations; 0 and below is chance.
    pub strength: f32,
    /// By how much they disagree, RMS over passages, share of the drag force.
    pub share: f32,
}

/// Passages of one bin.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bin {
    passages: f32,
    mean: f32,
    /// newest passage
    last: f32,
    /// sum of squared deviations
    square: f32,
}

const EMPTY: Bin = Bin { passages: 0.0, mean: 0.0, last: 0.0, square: 0.0 };

impl Bin {
    /// Adds a passage; `step`: count half the squared step from the last one instead of the deviation from the mean.
    fn add(&mut self, y: f32, step: bool) {
        if self.passages >= FORGET {
            self.passages *= 0.5;
            self.square *= 0.5;
        }
        let first = self.passages == 0.0;
        self.passages += 1.0;
        let off = y - self.mean;
        self.mean += off / self.passages;
        if !step {
            self.square += off * (y - self.mean);
        } else if !first {
            self.square += 0.5 * (y - self.last) * (y - self.last);
        }
        self.last = y;
    }

    fn join(self, other: Bin) -> Bin {
        let passages = self.passages + other.passages;
        if passages == 0.0 {
            return EMPTY;
        }
        let off = other.mean - self.mean;
        Bin {
            passages,
            mean: self.mean + off * other.passages / passages,
            last: if other.passages > self.passages { other.last } else { self.last },
            square: self.square + other.square + off * off * self.passages * other.passages / passages,
        }
    }
}

/// The bins of one axis and the passage under way.
#[derive(Clone, Copy, Debug)]
pub struct Bins {
    bins: [Bin; MOST],
    /// bin of the passage under way; its sum and number of estimates
    at: usize,
    sum: f32,
    count: f32,
    /// deviation of the last passage from its bin's mean, and the running products
    before: f32,
    lagged: f32,
    squared: f32,
    level: f32,
    changed: bool,
}

impl Bins {
    /// Nothing seen. All zeros, so that the chip needs no copy of it in flash.
    pub(super) const fn new() -> Self {
        Bins {
            bins: [EMPTY; MOST],
            at: 0,
            sum: 0.0,
            count: 0.0,
            before: 0.0,
            lagged: 0.0,
            squared: 0.0,
            level: 0.0,
            changed: false,
        }
    }

    /// Takes an estimate in a bin; a change of bin, or too many estimates, ends the passage. `follow`: share of a
    /// passage's deviation that the level takes over, 0 where the level is not followed.
    #[inline(never)]
    pub(super) fn take(&mut self, bin: usize, y: f32, follow: f32) {
        if bin != self.at || self.count >= LONGEST {
            self.interrupt(follow);
        }
        self.at = bin;
        self.sum += y;
        self.count += 1.0;
    }

    /// Ends the passage.
    #[cold]
    #[inline(never)]
    pub(super) fn interrupt(&mut self, follow: f32) {
        if self.count == 0.0 {
            return;
        }
        let mut y = self.sum / self.count - self.level;
        (self.sum, self.count) = (0.0, 0.0);
        let Some(bin) = self.bins.get_mut(self.at) else { return };
        if bin.passages > 0.0 {
            let off = y - if follow > 0.0 { bin.last } else { bin.mean };
            const SHARE: f32 = 1.0 / CORRELATION_MEMORY;
            self.lagged += SHARE * (off * self.before - self.lagged);
            self.squared += SHARE * (off * off - self.squared);
            self.before = off;
            let rise = follow * (y - bin.mean);
            self.level += rise;
            y -= rise;
        }
        bin.add(y, follow > 0.0);
        self.changed = true;
    }

    /// First and last bin in use, the one under way included.
    #[cold]
    #[inline(never)]
    pub(super) fn used(&self) -> (usize, usize) {
        let in_use =
            |n: &usize| (self.count > 0.0 && *n == self.at) || self.bins.get(*n).is_some_and(|bin| bin.passages > 0.0);
        let first = (0..MOST).find(in_use).unwrap_or(MOST / 2);
        (first, (0..MOST).rev().find(in_use).unwrap_or(first))
    }

    /// Moves every bin up by `by` places; those in use must stay inside.
    #[cold]
    #[inline(never)]
    pub(super) fn shift(&mut self, by: i32) {
        let old = self.bins;
        for (n, bin) in self.bins.iter_mut().enumerate() {
            let from = n as i32 - by;
            *bin = usize::try_from(from).ok().and_then(|from| old.get(from)).copied().unwrap_or(EMPTY);
        }
        self.at = (self.at as i32 + by).clamp(0, MOST as i32 - 1) as usize;
    }

    /// Joins neighbours into bins of double width; `odd` is 1 where the first bin is the second of its pair.
    #[cold]
    #[inline(never)]
    pub(super) fn merge_pairs(&mut self, odd: usize) {
        let old = self.bins;
        self.bins = [EMPTY; MOST];
        for (n, bin) in old.into_iter().enumerate() {
            if let Some(pair) = self.bins.get_mut((n + odd) / 2) {
                *pair = pair.join(bin);
            }
        }
        self.at = (self.at + odd) / 2;
    }

    /// Result of the axis now: `None` where no passage ended since the last call, `Some(None)` where too little was
    /// seen.
    // `cold` makes the compiler optimise for size: this runs ten times a second at most
    #[cold]
    #[inline(never)]
    pub(super) fn evaluate(&mut self, follow: f32) -> Option<Option<Finding>> {
        if !core::mem::take(&mut self.changed) {
            return None;
        }
        let counted = || self.bins.iter().filter(|bin| bin.passages >= LEAST);
        let (mut bins, mut passages, mut sum, mut within) = (0.0f32, 0.0f32, 0.0f32, 0.0f32);
        for bin in counted() {
            bins += 1.0;
            passages += bin.passages;
            sum += bin.passages * bin.mean;
            within += bin.square;
        }
        let seen = if self.squared > 0.0 { self.lagged / self.squared } else { 0.0 };
        let rho = (seen + (1.0 + 3.0 * seen) * bins / passages.max(1.0)).clamp(0.0, 0.9);
        let longer = (1.0 + rho) / (1.0 - rho);
        let scatter = within / (passages - bins).max(1.0) * longer;
        let variance = scatter + ALWAYS_THERE * ALWAYS_THERE;
        // at a ratio of 1e3 chance is as good as known
        let known = (variance / scatter.max(1e-3 * variance)).max(1.0);
        let worth = if follow > 0.0 { STEPS_COUNT } else { 1.0 };
        let freedom = worth * (passages - bins) / longer * known * known;
        if bins < 2.0 || passages - bins < 2.0 || freedom < LEAST_FREEDOM {
            return Some(None);
        }
        let mean = sum / passages;
        let mut between = 0.0;
        for bin in counted() {
            between += bin.passages * (bin.mean - mean) * (bin.mean - mean);
        }
        let ratio = between / ((bins - 1.0) * variance);
        let (a, b) = (2.0 / (9.0 * (bins - 1.0)), 2.0 / (9.0 * freedom));
        let root = if ratio > 1e-9 { num::rough_cbrt(ratio) } else { 0.0 };
        let strength = ((1.0 - b) * root - (1.0 - a)) / num::sqrt(b * root * root + a);
        let share = num::sqrt(((between - (bins - 1.0) * variance) / passages).max(0.0));
        Some(Some(Finding { strength, share }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{RELEVANT, SIGNIFICANT};
    use super::*;

    const FOLLOWED: f32 = 0.0;

    struct Random(u64);

    impl Random {
        /// Nearly Gaussian: the sum of twelve.
        fn normal(&mut self) -> f32 {
            let mut sum = -6.0;
            for _ in 0..12 {
                self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (self.0 >> 40) as f32 / (1u64 << 24) as f32;
            }
            sum
        }
    }

    #[test]
    fn strength_is_in_standard_deviations() {
        let mut random = Random(3);
        for bins in [2usize, 8, 16] {
            let (mut sum, mut square, mut beyond, runs) = (0.0f64, 0.0f64, 0, 4000);
            for _ in 0..runs {
                let mut axis = Bins::new();
                for n in 0..20 * bins {
                    // far above the scatter that is always assumed
                    axis.take(n * 7 % bins, 0.1 * random.normal(), FOLLOWED);
                    axis.interrupt(FOLLOWED);
                }
                let found = axis.evaluate(FOLLOWED).flatten().expect("enough");
                sum += f64::from(found.strength);
                square += f64::from(found.strength) * f64::from(found.strength);
                beyond += usize::from(found.strength > 3.0);
            }
            let mean = sum / f64::from(runs);
            let deviation = libm::sqrt(square / f64::from(runs) - mean * mean);
            // clipping the correlation at zero makes the strength too small rather than too large
            assert!((-1.0..0.1).contains(&mean) && (0.7..1.1).contains(&deviation), "{bins}: {mean} {deviation}");
            assert!(beyond <= 8, "{bins}: {beyond} of {runs} beyond 3");
        }
    }

    #[test]
    fn share_is_the_planted_one() {
        let mut random = Random(9);
        let mut axis = Bins::new();
        for n in 0..160 {
            let bin = n % 8;
            axis.take(bin, 0.002 * random.normal() + if bin < 4 { 0.02 } else { -0.02 }, FOLLOWED);
        }
        axis.interrupt(FOLLOWED);
        let found = axis.evaluate(FOLLOWED).flatten().expect("enough");
        assert!((found.share - 0.02).abs() < 0.001 && found.strength > 8.0, "{found:?}");
        assert_eq!(axis.evaluate(FOLLOWED), None);
    }

    #[test]
    fn correlated_passages_are_no_evidence() {
        // noise of half a per cent, correlated over ten passages, while the axis drifts: a warm-up during slow noise
        let mut random = Random(5);
        let (mut alarms, runs) = (0, 300);
        for _ in 0..runs {
            let mut axis = Bins::new();
            let mut slow = 0.0;
            for n in 0..320 {
                slow = 0.9 * slow + 0.435_9 * random.normal();
                axis.take(n / 20, 0.005 * slow, FOLLOWED);
                axis.interrupt(FOLLOWED);
                let found = axis.evaluate(FOLLOWED).flatten();
                if found.is_some_and(|f| f.strength >= SIGNIFICANT && f.share >= RELEVANT) {
                    alarms += 1;
                    break;
                }
            }
        }
        assert_eq!(alarms, 0, "of {runs}");
    }

    #[test]
    fn a_drift_is_the_level_s_and_a_difference_the_bins() {
        let mut random = Random(7);
        for difference in [0.0, 0.03] {
            let mut axis = Bins::new();
            for n in 0..400 {
                // long stays in a bin, and a level that falls by 4 %
                let bin = n / 25 % 4;
                axis.take(
                    bin,
                    0.002 * random.normal() - 0.000_1 * n as f32 + difference * (bin % 2) as f32,
                    1.0 / 16.0,
                );
                axis.interrupt(1.0 / 16.0);
            }
            let found = axis.evaluate(1.0 / 16.0).flatten().expect("enough");
            assert!((found.share - 0.5 * difference).abs() < 0.004, "{found:?}");
            assert_eq!(found.strength > 5.0, difference > 0.0, "{found:?}");
        }
    }

    #[test]
    fn bins_move_and_merge_without_losing_a_passage() {
        let mut axis = Bins::new();
        for n in 4..9 {
            for k in 0..3 {
                axis.take(n, n as f32 + 0.1 * k as f32, FOLLOWED);
                axis.interrupt(FOLLOWED);
            }
        }
        let total = |axis: &Bins| axis.bins.iter().fold(EMPTY, |sum, bin| sum.join(*bin));
        let whole = total(&axis);
        assert_eq!(axis.used(), (4, 8));
        axis.shift(-4);
        assert_eq!(axis.used(), (0, 4));
        axis.shift(11);
        assert_eq!(axis.used(), (11, 15));
        axis.merge_pairs(1);
        assert_eq!(axis.used(), (6, 8));
        let after = total(&axis);
        assert_eq!(after.passages, 15.0);
        assert!((after.mean - whole.mean).abs() < 1e-5 && (after.square / whole.square - 1.0).abs() < 1e-5);
    }
}
