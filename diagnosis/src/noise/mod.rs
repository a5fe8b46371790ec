//! Noise model, and the filter that whitens it.
//!
//! Friction noise is coloured, and its slow part looks like drift, wear and warm-up. The filter has two stages:
//!
//! 1. an autoregression whose order the information criterion chooses (exact from the first row of a stretch on: Durbin
//!    and Levinson's predictors of every lower order),
//! 2. first-order shelves, one per octave, for the slow part that no short autoregression sees. Their heights come from
//!    the Haar (Allan) variance of what stage 1 leaves. Towards low frequency the noise is never taken to fall, a
//!    variance from few differences is overestimated on purpose, and where a fit has absorbed most of the slow part the
//!    noise is extrapolated.
//!
//! Both stages are linear and the same for every column, so a fit stays unbiased however wrong they are; errors of the
//! noise's size are the matter of [`crate::noise::locks`].
//!
//! ```text
//! rows         the one linear operation on every column
//! shelves      the slow part of the noise
//! locks        is an effect real? two tests that must agree
//! ```

pub(crate) mod locks;
pub(crate) mod rows;
mod shelves;

pub(crate) use crate::noise::shelves::Course;
use crate::noise::shelves::{MOST_SHELVES, Shelf, Shelves};
use crate::numbers::bridge::{bridge, gaps};

/// Longest autoregression, rows.
pub(crate) const MAX_ORDER: usize = 16;

/// A filter that whitens the noise to variance 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Whitening {
    /// Predictors of order 0, 1, ..; the last is that of the stationary filter.
    predictors: Vec<Vec<f64>>,
    /// 1/σ of the innovation of each order.
    gains: Vec<f64>,
    shelves: Shelves,
}

impl Whitening {
    /// The identity filter.
    pub(crate) fn none() -> Self {
        Whitening { predictors: vec![Vec::new()], gains: vec![1.0], shelves: Shelves::default() }
    }

    /// Estimated from residuals of variance about 1, stretch by stretch, with an autoregression of order `most` at
    /// most. Rows that are NaN are skipped. `kept`: share of the noise that the fit left in the residuals, by level of
    /// [`slowness`].
    pub(crate) fn of(stretches: &[Vec<f64>], most: usize, kept: &[f64]) -> Self {
        let mut whitening = autoregression(stretches, most.min(MAX_ORDER));
        let longest = stretches.iter().map(Vec::len).max().unwrap_or(0);
        let levels = (1..=MOST_SHELVES).take_while(|level| longest >> level >= 1).count();
        let kept = |level: usize| kept.get(level).copied().unwrap_or(1.0);
        let mut heights = vec![1.0; levels];
        let mut told: Vec<Told> = Vec::new();
        for _ in 0..3 {
            let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied_where_told(x)).collect();
            told.clear();
            for (level, (height, own)) in heights.iter_mut().zip(haar(&white, levels)).enumerate() {
                *height *= own.variance;
                let freedom = own.count as f64 * kept(level);
                if told.len() == level && kept(level) >= LEAST_KEPT && freedom >= LEAST_FREEDOM {
                    told.push(Told { height: *height, freedom });
                }
            }
            whitening.shelves = shelves(&rising(&told, levels));
        }
        for level in 1..told.len() {
            let (before, [this, ..]) = told.split_at_mut(level) else { break };
            this.height = this.height.min(kept(level) * most_of_noise(before));
        }
        for (level, told) in told.iter_mut().enumerate() {
            // the fit has absorbed a part of the noise itself
            told.height /= kept(level);
            // few differences: better to overestimate the noise than to underestimate it
            if told.freedom < MANY {
                told.height *= 1.0 + 1.0 / told.freedom.sqrt();
            }
        }
        whitening.shelves = shelves(&going_on(rising(&told, levels), &told, levels));
        whitening
    }

    /// Order of the autoregression.
    pub(crate) fn order(&self) -> usize {
        self.predictors.len() - 1
    }

    /// Innovations of one stretch, divided by their standard deviation.
    fn predict(&self, x: &mut Vec<f64>, spare: &mut Vec<f64>) {
        spare.clear();
        let order = self.order();
        for n in 0..x.len().min(order) {
            let predicted: f64 = self.predictors[n].iter().enumerate().map(|(k, phi)| phi * x[n - 1 - k]).sum();
            spare.push((x[n] - predicted) * self.gains[n]);
        }
        let (phi, gain) = (&self.predictors[order], self.gains[order]);
        if order == 0 {
            spare.extend(x.iter().map(|x| x * gain));
        } else if x.len() > order {
            // newest last, as in the window
            let reversed: Vec<f64> = phi.iter().rev().map(|phi| -phi * gain).collect();
            spare.extend(x.iter().skip(order).map(|x| x * gain));
            let filtered = spare.get_mut(order..).unwrap_or_default();
            // tap by tap over many rows: rows do not depend on one another, and the order of summation is kept
            pulp::Arch::new().dispatch(Taps { taps: &reversed, x, filtered });
        }
        std::mem::swap(x, spare);
    }

    /// Course of the filter over consecutive stretches, each given as the number of missing rows before it (0 for the
    /// first) and its rows. The slow part continues across missing rows, the autoregression starts afresh.
    pub(crate) fn course(&self, stretches: &[(usize, usize)]) -> Course {
        self.shelves.course(stretches)
    }

    /// Filters several columns over a course, each given stretch by stretch; returns the rows of all stretches.
    pub(crate) fn apply_all(&self, columns: Vec<Vec<Vec<f64>>>, course: &Course) -> Vec<Vec<f64>> {
        let mut spare = Vec::new();
        let foreseen = |mut stretches: Vec<Vec<f64>>| {
            stretches.iter_mut().for_each(|x| self.predict(x, &mut spare));
            if stretches.len() == 1 { stretches.pop().unwrap_or_default() } else { stretches.concat() }
        };
        let mut columns: Vec<Vec<f64>> = columns.into_iter().map(foreseen).collect();
        self.shelves.apply_all(&mut columns, course);
        columns
    }

    /// The transposed filter on the rows of one stretch.
    pub(crate) fn apply_backwards(&self, x: &mut [f64]) {
        self.shelves.apply_backwards(x);
        let order = self.order();
        let (phi, gain) = (&self.predictors[order], self.gains[order]);
        for n in 0..x.len() {
            let ahead: f64 = phi.iter().zip(&x[n + 1..]).map(|(phi, x)| phi * x).sum();
            x[n] = gain * (x[n] - ahead);
        }
    }

    /// Squared gain at a frequency, as a fraction of the sampling rate.
    pub(crate) fn power(&self, frequency: f64) -> f64 {
        let order = self.order();
        let angle = std::f64::consts::TAU * frequency;
        let (mut re, mut im) = (1.0, 0.0);
        for (k, phi) in self.predictors[order].iter().enumerate() {
            let (sin, cos) = libm::sincos(angle * (k + 1) as f64);
            re -= phi * cos;
            im += phi * sin;
        }
        let cos = angle.cos();
        let gain = self.gains[order];
        gain * gain * (re * re + im * im) * self.shelves.power(cos)
    }

    fn applied(&self, x: &[f64]) -> Vec<f64> {
        self.apply_all(vec![vec![x.to_vec()]], &self.course(&[(0, x.len())])).pop().unwrap_or_default()
    }

    /// The same with missing rows: they are bridged by straight lines, and are missing again after the filter.
    fn applied_where_told(&self, x: &[f64]) -> Vec<f64> {
        let mut filled = x.to_vec();
        for gap in gaps(&x.iter().map(|x| x.is_finite()).collect::<Vec<_>>()) {
            bridge(&mut filled, &gap);
        }
        let mut out = self.applied(&filled);
        out.iter_mut().zip(x).filter(|(_, x)| !x.is_finite()).for_each(|(out, x)| *out = *x);
        out
    }
}

/// Rows that stay in the fastest cache while every tap passes over them.
const PIECE: usize = 1024;

/// Convolution: sums of taps times rows.
struct Taps<'a> {
    taps: &'a [f64],
    x: &'a [f64],
    filtered: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Taps<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (start, piece) in (0..).step_by(PIECE).zip(self.filtered.chunks_mut(PIECE)) {
            for (n, tap) in self.taps.iter().enumerate() {
                for (sum, x) in piece.iter_mut().zip(&self.x[start + n..]) {
                    *sum += tap * x;
                }
            }
        }
    }
}

/// Durbin and Levinson's recursion on the pooled autocovariance.
fn autoregression(stretches: &[Vec<f64>], most: usize) -> Whitening {
    let (mut rows, mut told) = (0, 0);
    let covariance: Vec<f64> = (0..=most)
        .map(|lag| {
            let (mut sum, mut pairs, mut places) = (0.0, 0u32, 0);
            for x in stretches.iter().filter(|x| x.len() > lag) {
                places += x.len() - lag;
                for product in x[lag..].iter().zip(x).map(|(a, b)| a * b).filter(|product| product.is_finite()) {
                    (sum, pairs) = (sum + product, pairs + 1);
                }
            }
            if lag == 0 {
                (rows, told) = (places, pairs);
            }
            // a longer lag has fewer places, and its covariance is scaled down accordingly
            sum / f64::from(pairs.max(1)) * places as f64 / rows.max(1) as f64
        })
        .collect();
    let mut whitening = Whitening::none();
    let mut variance = covariance[0];
    if !(variance > 0.0) {
        return whitening;
    }
    whitening.gains[0] = 1.0 / variance.sqrt();
    let rows = f64::from(told);
    let mut best = (rows * variance.ln(), 0);
    for order in 1..=most {
        let before = &whitening.predictors[order - 1];
        let predicted: f64 = before.iter().enumerate().map(|(k, phi)| phi * covariance[order - 1 - k]).sum();
        let reflection = (covariance[order] - predicted) / variance;
        let mut phi: Vec<f64> = (0..order - 1).map(|k| before[k] - reflection * before[order - 2 - k]).collect();
        phi.push(reflection);
        variance *= 1.0 - reflection * reflection;
        if !(variance > 1e-12 * covariance[0]) {
            break;
        }
        whitening.predictors.push(phi);
        whitening.gains.push(1.0 / variance.sqrt());
        let criterion = rows * variance.ln() + order as f64 * rows.ln();
        if criterion < best.0 {
            best = (criterion, order);
        }
    }
    whitening.predictors.truncate(best.1 + 1);
    whitening.gains.truncate(best.1 + 1);
    whitening
}

/// Least share of a window's rows that must be there for its mean to count.
const TOLD: f64 = 0.5;

/// Variance of the Haar differences at one level.
struct Level {
    variance: f64,
    /// Number of differences that determine it.
    count: usize,
}

/// Least share of the noise's slow power that a fit must keep for its residual to determine that level, and least
/// number of differences.
const LEAST_KEPT: f64 = 0.4;
const LEAST_FREEDOM: f64 = 4.0;

/// Number of differences from which a variance is reliable.
const MANY: f64 = 200.0;

/// Standard errors by which the noise must be seen to rise towards low frequency to be extrapolated as rising.
const SURE_RISE: f64 = 1.5;

/// Most by which it is extrapolated per octave, as for 1/f noise: what rises faster than that where it is measured is
/// no noise.
const MOST_RISE: f64 = 2.0;

/// Rise of the power of a random walk per octave, and the standard errors by which a faster rise counts as a cause, not
/// as noise.
const FASTEST_RISE: f64 = 4.0;
const SURE_CAUSE: f64 = 2.0;

/// Variance of the Haar differences, level by level: 1 at every level for white noise of variance 1. Missing rows are
/// skipped.
fn haar(stretches: &[Vec<f64>], levels: usize) -> Vec<Level> {
    let (mut sums, mut counts) = (vec![0.0; levels], vec![0usize; levels]);
    for stretch in stretches {
        // sum and number of the rows in every window
        let mut windows: Vec<(f64, f64)> =
            stretch.iter().map(|x| if x.is_finite() { (*x, 1.0) } else { (0.0, 0.0) }).collect();
        for level in 0..levels {
            let pairs = windows.len() / 2;
            if pairs == 0 {
                break;
            }
            let least = TOLD * f64::from(1u32 << level);
            for k in 0..pairs {
                let ((a, in_a), (b, in_b)) = (windows[2 * k], windows[2 * k + 1]);
                if in_a >= least && in_b >= least {
                    let difference = a / in_a - b / in_b;
                    sums[level] += difference * difference / (1.0 / in_a + 1.0 / in_b);
                    counts[level] += 1;
                }
                windows[k] = (a + b, in_a + in_b);
            }
            windows.truncate(pairs);
        }
    }
    let of_white = |count: usize, sum: f64| if count > 0 { sum / count as f64 } else { 1.0 };
    sums.into_iter().zip(counts).map(|(sum, count)| Level { variance: of_white(count, sum), count }).collect()
}

/// Known power of the noise at one level.
struct Told {
    height: f64,
    /// Number of differences that determine it.
    freedom: f64,
}

/// Most power that noise can have in the octave after `before`: noise above the white floor (the fastest level) grows
/// at most like a random walk, 4x per octave.
fn most_of_noise(before: &[Told]) -> f64 {
    let [first, .., last] = before else { return f64::INFINITY };
    let sure = (SURE_CAUSE * (2.0 / last.freedom).sqrt()).exp();
    let highest = before.iter().map(|told| told.height).fold(0.0, f64::max) * sure;
    first.height + FASTEST_RISE * (highest - first.height)
}

/// Heights of shelves, the first 1: towards low frequency the noise is never taken to fall, and beyond the known levels
/// it stays.
fn rising(told: &[Told], levels: usize) -> Vec<f64> {
    let first = told.first().map_or(1.0, |first| first.height.max(1e-9));
    let mut most = 1.0f64;
    (0..levels)
        .map(|level| {
            most = told.get(level).map_or(most, |told| most.max(told.height / first));
            most
        })
        .collect()
}

/// The same, extrapolated beyond the known levels and by one octave beyond the last: it rises as it reliably did over
/// the last two octaves.
fn going_on(mut heights: Vec<f64>, told: &[Told], levels: usize) -> Vec<f64> {
    let [.., before, _, last] = told else { return heights };
    let error = (2.0 / before.freedom + 2.0 / last.freedom).sqrt();
    let ratio = heights[told.len() - 1] / heights[told.len() - 3];
    let rise = (0.5 * (ratio.ln() - SURE_RISE * error)).exp().clamp(1.0, MOST_RISE);
    heights.truncate(told.len());
    while heights.len() < (levels + 1).min(MOST_SHELVES) {
        heights.push(rise * heights[heights.len() - 1]);
    }
    heights
}

/// Shelves of these heights, one per octave.
fn shelves(heights: &[f64]) -> Shelves {
    let steps = heights.windows(2).enumerate().filter(|(_, two)| two[1] > 1.02 * two[0]);
    Shelves::new(steps.map(|(at, two)| Shelf::new(0.25 / f64::from(1u32 << at), two[1] / two[0])).collect())
}

/// Variance by slowness: of differences between means of 1, 2, 4, .. rows, relative to white noise. Rows that are NaN
/// are skipped.
pub(crate) fn slowness(stretches: &[Vec<f64>]) -> Vec<f64> {
    let longest = stretches.iter().map(Vec::len).max().unwrap_or(0);
    let levels = (1..=MOST_SHELVES).take_while(|level| longest >> level >= 1).count();
    haar(stretches, levels).iter().map(|level| level.variance).collect()
}

/// Third differences divided by √20: those of smooth signals vanish, those of white noise keep its variance.
pub(crate) fn third_differences(x: &[f64]) -> Vec<f64> {
    let scale = 1.0 / 20.0f64.sqrt();
    x.windows(4).map(|w| scale * (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0])).filter(|d| d.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn white(rows: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        (0..rows).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    fn red(rows: usize, rho: f64, seed: u64) -> Vec<f64> {
        let mut x = 0.0;
        white(rows, seed)
            .into_iter()
            .map(|e| {
                x = rho * x + e * (1.0 - rho * rho).sqrt();
                x
            })
            .collect()
    }

    #[test]
    fn noise_of_several_memories_comes_out_white_at_every_scale() {
        let stretches: Vec<Vec<f64>> = (0..8)
            .map(|n| {
                let parts = [red(8192, 0.6, 3 + n), red(8192, 0.98, 103 + n), red(8192, 0.998, 203 + n)];
                (0..8192).map(|k| parts.iter().map(|p| p[k]).sum::<f64>() / 3f64.sqrt()).collect()
            })
            .collect();
        let whitening = Whitening::of(&stretches, MAX_ORDER, &[]);
        let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied(x)).collect();
        for (level, variance) in haar(&white, 9).iter().map(|level| level.variance).enumerate() {
            assert!((0.45..1.35).contains(&variance), "level {level}: {variance}");
        }
    }

    #[test]
    fn what_is_slow_is_as_sure_as_it_looks() {
        // memories of 2 to 500 rows in runs of 4000: a slope over all runs, or along each, that is not there
        let slopes: [fn(usize, usize) -> f64; 3] =
            [|_, _| 1.0, |run, _| run as f64 / 5.0 - 0.5, |_, row| row as f64 / 4000.0 - 0.5];
        let mut squares = [0.0; 3];
        const DRAWN: u64 = 16;
        for drawn in 0..DRAWN {
            let runs: Vec<Vec<f64>> = (0..6)
                .map(|run| {
                    let seed = 1000 * drawn + 10 * run;
                    let parts = [red(6000, 0.61, seed + 1), red(6000, 0.9692, seed + 2), red(6000, 0.998, seed + 3)];
                    (2000..6000).map(|k| parts.iter().map(|part| part[k]).sum::<f64>() / 3f64.sqrt()).collect()
                })
                .collect();
            let whitening = Whitening::of(&runs, MAX_ORDER, &[]);
            for (square, slope) in squares.iter_mut().zip(slopes) {
                let (mut with, mut size) = (0.0, 0.0);
                for (run, x) in runs.iter().enumerate() {
                    let column: Vec<f64> = (0..x.len()).map(|row| slope(run, row)).collect();
                    for (column, x) in whitening.applied(&column).iter().zip(whitening.applied(x)) {
                        (with, size) = (with + column * x, size + column * column);
                    }
                }
                *square += with * with / size / DRAWN as f64;
            }
        }
        // the square of a standard normal variable has a mean of 1
        assert!(squares.iter().all(|square| (0.3..2.5).contains(square)), "{squares:?}");
    }

    #[test]
    fn a_stretch_shorter_than_the_filter_is_filtered() {
        let whitening = Whitening::of(&[red(20_000, 0.9, 3)], MAX_ORDER, &[]);
        let long = whitening.applied(&white(100, 7));
        for rows in 0..20 {
            let mut short = white(100, 7);
            short.truncate(rows);
            let short = whitening.applied(&short);
            assert_eq!(short.len(), rows);
            assert!(short.iter().zip(&long).all(|(a, b)| (a - b).abs() < 1e-12), "{rows} rows");
        }
    }

    #[test]
    fn backwards_is_the_transposed_filter_away_from_the_ends() {
        let whitening = Whitening::of(&[red(20_000, 0.95, 3)], MAX_ORDER, &[]);
        let (mut a, mut b) = (vec![0.0; 4000], vec![0.0; 4000]);
        a[1500..2500].copy_from_slice(&white(1000, 11));
        b[1400..2400].copy_from_slice(&white(1000, 12));
        let forwards: f64 = whitening.applied(&a).iter().zip(&b).map(|(a, b)| a * b).sum();
        whitening.apply_backwards(&mut b);
        let backwards: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
        assert!((forwards - backwards).abs() < 1e-6 * forwards.abs().max(1.0), "{forwards} {backwards}");
    }

    #[test]
    fn rows_that_are_missing_do_not_colour_white_noise() {
        let mut x = white(20_000, 5);
        let is_missing = |n: usize| n % 500 < 120;
        (0..x.len()).filter(|n| is_missing(*n)).for_each(|n| x[n] = f64::NAN);
        let whitening = Whitening::of(&[x], MAX_ORDER, &[]);
        for frequency in [0.01, 0.1, 0.5] {
            let power = whitening.power(frequency);
            assert!((0.7..1.4).contains(&power), "{frequency}: {power}");
        }
        // few differences determine the slowest part: it is overestimated on purpose
        assert!(whitening.power(0.0) > 0.4, "{}", whitening.power(0.0));
        // bridges across them would
        let mut bridged = white(20_000, 5);
        (0..bridged.len()).filter(|n| is_missing(*n)).for_each(|n| bridged[n] = 6.0);
        assert!(Whitening::of(&[bridged], MAX_ORDER, &[]).power(0.0) < 0.2);
    }

    #[test]
    fn noise_rises_as_fast_as_a_walk_at_random_and_no_faster() {
        let told = |heights: &[f64]| -> Vec<Told> {
            heights.iter().map(|height| Told { height: *height, freedom: 1e5 }).collect()
        };
        assert_eq!(most_of_noise(&told(&[1.0])), f64::INFINITY);
        assert!(most_of_noise(&told(&[1.0, 1.0, 0.7])) < 1.1);
        // what exceeds the white floor of the fastest rows: 0.1, 0.4, 1.6
        let walk = most_of_noise(&told(&[1.0, 1.1, 1.4, 2.6]));
        assert!((7.4..7.6).contains(&walk), "{walk}");
    }

    #[test]
    fn white_noise_is_left_alone() {
        let whitening = Whitening::of(&[white(20_000, 5)], MAX_ORDER, &[]);
        assert!(whitening.order() <= 1);
        let out = whitening.applied(&white(1000, 6));
        let sigma = (out.iter().map(|x| x * x).sum::<f64>() / 1000.0).sqrt();
        assert!((sigma - 1.0).abs() < 0.1, "{sigma}");
    }
}
