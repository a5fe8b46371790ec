//! What the noise looks like, and the filter that makes it white.
//!
//! Friction noise is coloured and its slow part looks like drift, wear and warm-up. The filter has two stages:
//!
//! 1. an autoregression of the order that the information criterion asks for (exact from the first row of a stretch
//!    on: Durbin and Levinson's predictors of every lower order),
//! 2. first-order shelves, one an octave, for the slow part that no short autoregression sees. Their heights come
//!    from the Haar (Allan) variance of what stage 1 leaves. Towards rest the noise is never taken to fall, and a
//!    variance that few differences tell is taken larger than it looks.
//!
//! Both are linear and the same for every column, so that a fit stays unbiased whatever they get wrong; what they get
//! wrong about the size of the noise is the matter of [`crate::noise::locks`].
//!
//! ```text
//! rows         the one linear operation on every column
//! locks        is an effect real? two tests that must agree
//! ```

pub(crate) mod locks;
pub(crate) mod rows;

use crate::numbers::bridge::{bridge, gaps};

/// Longest autoregression.
pub(crate) const MAX_ORDER: usize = 16;

/// Most shelves: the slowest of them sees a million rows.
const MOST_SHELVES: usize = 20;

/// A filter that makes the noise white with variance 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Whitening {
    /// Predictors of order 0, 1, ..; the last is that of the stationary filter.
    predictors: Vec<Vec<f64>>,
    /// 1/σ of the innovation of each order.
    gains: Vec<f64>,
    shelves: Vec<Shelf>,
}

/// `H(s) = (s + ω_z)/(s + ω_p)`, bilinear.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shelf {
    b: [f64; 2],
    a: f64,
    at_rest: f64,
}

impl Shelf {
    /// Lets the power below `frequency` (of the sampling rate) through by 1/`ratio`.
    fn new(frequency: f64, ratio: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency;
        let quarter = ratio.sqrt().sqrt();
        let (pole, zero) = (omega * quarter, omega / quarter);
        Shelf {
            b: [(2.0 + zero) / (2.0 + pole), (zero - 2.0) / (2.0 + pole)],
            a: (pole - 2.0) / (2.0 + pole),
            at_rest: zero / pole,
        }
    }

    /// Backwards in time: what the transposed filter does, away from the ends of a stretch.
    fn apply_backwards(&self, x: &mut [f64]) {
        let (mut before, mut out) = (0.0, 0.0);
        for x in x.iter_mut().rev() {
            let next = self.b[0] * *x + self.b[1] * before - self.a * out;
            before = *x;
            out = next;
            *x = next;
        }
    }

    /// Squared gain at an angle per row.
    fn power(&self, cos: f64) -> f64 {
        let [b0, b1] = self.b;
        (b0 * b0 + b1 * b1 + 2.0 * b0 * b1 * cos) / (1.0 + self.a * self.a + 2.0 * self.a * cos)
    }
}

/// Columns that go through the shelves side by side.
const ABREAST: usize = 8;

/// Shelves one behind the other over rows of `N` columns, as if the first row had lasted for ever before it. Row by row
/// through all of them: a row waits for the one before in every shelf, but neither shelves nor columns wait for one
/// another.
struct Cascade<'a, const N: usize> {
    shelves: &'a [Shelf],
    rows: &'a mut [[f64; N]],
}

impl<const N: usize> pulp::NullaryFnOnce for Cascade<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Some(first) = self.rows.first() else { return };
        let nothing = Shelf { b: [0.0; 2], a: 0.0, at_rest: 0.0 };
        let mut states = [(nothing, [0.0; N], [0.0; N]); MOST_SHELVES];
        let mut input = *first;
        for ((own, before, out), shelf) in states.iter_mut().zip(self.shelves) {
            (*own, *before, *out) = (*shelf, input, input.map(|x| x * shelf.at_rest));
            for k in 0..N {
                input[k] = shelf.b[0] * input[k] + shelf.b[1] * before[k] - shelf.a * out[k];
            }
        }
        let states = &mut states[..self.shelves.len().min(MOST_SHELVES)];
        for row in self.rows {
            let mut signal = *row;
            for (shelf, before, out) in states.iter_mut() {
                let mut next = [0.0; N];
                for k in 0..N {
                    next[k] = shelf.b[0] * signal[k] + shelf.b[1] * before[k] - shelf.a * out[k];
                }
                (*before, *out) = (signal, next);
                signal = next;
            }
            *row = signal;
        }
    }
}

impl Whitening {
    /// Leaves everything as it is.
    pub(crate) fn none() -> Self {
        Whitening { predictors: vec![Vec::new()], gains: vec![1.0], shelves: Vec::new() }
    }

    /// Of residuals of variance about 1, stretch by stretch; an autoregression of order `most` at most. A row that is not a
    /// number tells nothing.
    pub(crate) fn of(stretches: &[Vec<f64>], most: usize) -> Self {
        let mut whitening = autoregression(stretches, most.min(MAX_ORDER));
        let longest = stretches.iter().map(Vec::len).max().unwrap_or(0);
        let levels = (1..=MOST_SHELVES).take_while(|level| longest >> level >= 2).count();
        let mut heights = vec![1.0; levels];
        for _ in 0..3 {
            let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied_where_told(x)).collect();
            let measured = haar(&white, levels);
            for (height, measured) in heights.iter_mut().zip(measured) {
                *height *= measured;
            }
            let reference = heights.first().copied().unwrap_or(1.0).max(1e-9);
            let mut guarded: Vec<f64> = heights.iter().map(|height| height / reference).collect();
            for level in 1..levels {
                guarded[level] = guarded[level].max(guarded[level - 1]);
            }
            whitening.shelves = (1..levels)
                .filter(|level| guarded[*level] > 1.02 * guarded[level - 1])
                .map(|level| Shelf::new(0.5 / f64::from(1u32 << level), guarded[level] / guarded[level - 1]))
                .collect();
        }
        whitening
    }

    /// Order of the autoregression.
    pub(crate) fn order(&self) -> usize {
        self.predictors.len() - 1
    }

    /// What the predictors do not foresee of the rows of one stretch, over its σ.
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
            // newest last, as the window has it
            let reversed: Vec<f64> = phi.iter().rev().map(|phi| -phi * gain).collect();
            spare.extend(x.iter().skip(order).map(|x| x * gain));
            let filtered = spare.get_mut(order..).unwrap_or_default();
            // tap by tap over many rows: rows do not wait for one another, and every sum keeps its order
            pulp::Arch::new().dispatch(Taps { taps: &reversed, x, filtered });
        }
        std::mem::swap(x, spare);
    }

    /// The same for the rows of one stretch of several columns.
    pub(crate) fn apply_all(&self, columns: &mut [Vec<f64>], spare: &mut Vec<f64>) {
        for x in columns.iter_mut() {
            self.predict(x, spare);
        }
        if self.shelves.is_empty() {
            return;
        }
        let mut rest = columns;
        while !rest.is_empty() {
            // fewer than half of the places are dearer than one by one
            let abreast = if rest.len() > ABREAST / 2 { rest.len().min(ABREAST) } else { 1 };
            let (some, others) = rest.split_at_mut(abreast);
            if abreast == 1 {
                self.through_shelves::<1>(some);
            } else {
                self.through_shelves::<ABREAST>(some);
            }
            rest = others;
        }
    }

    fn through_shelves<const N: usize>(&self, columns: &mut [Vec<f64>]) {
        let mut rows = vec![[0.0; N]; columns.first().map_or(0, Vec::len)];
        for (k, column) in columns.iter().enumerate() {
            rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = *x);
        }
        pulp::Arch::new().dispatch(Cascade { shelves: &self.shelves, rows: &mut rows });
        for (k, column) in columns.iter_mut().enumerate() {
            rows.iter().zip(column).for_each(|(row, x)| *x = row[k]);
        }
    }

    /// The transposed filter on the rows of one stretch.
    pub(crate) fn apply_backwards(&self, x: &mut [f64]) {
        for shelf in &self.shelves {
            shelf.apply_backwards(x);
        }
        let order = self.order();
        let (phi, gain) = (&self.predictors[order], self.gains[order]);
        for n in 0..x.len() {
            let ahead: f64 = phi.iter().zip(&x[n + 1..]).map(|(phi, x)| phi * x).sum();
            x[n] = gain * (x[n] - ahead);
        }
    }

    /// Squared gain at a frequency, of the sampling rate.
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
        gain * gain * (re * re + im * im) * self.shelves.iter().map(|shelf| shelf.power(cos)).product::<f64>()
    }

    fn applied(&self, x: &[f64]) -> Vec<f64> {
        let mut out = [x.to_vec()];
        self.apply_all(&mut out, &mut Vec::new());
        let [out] = out;
        out
    }

    /// The same where rows are missing: straight lines lead across them, and they are missing again behind the filter.
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

/// Rows that stay in the fastest memory while every tap goes by.
const PIECE: usize = 1024;

/// Sums of taps times rows.
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
            // a longer lag has fewer places: so much less counts what it tells
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

/// Share of a window's rows that must be there for its mean to be told.
const TOLD: f64 = 0.5;

/// Variance of Haar's differences, level by level: 1 at every level for white noise of variance 1. Rows that are missing
/// take no part.
fn haar(stretches: &[Vec<f64>], levels: usize) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0; levels], vec![0usize; levels]);
    for stretch in stretches {
        // sum and number of the rows of every window
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
    let mut variances = Vec::with_capacity(levels);
    for level in 0..levels {
        let count = counts[level] as f64;
        let before = variances.last().copied().unwrap_or(1.0);
        variances.push(if counts[level] < 4 {
            before
        } else {
            let variance = sums[level] / count;
            // few differences: rather too much noise than too little
            if count < 200.0 { variance * (1.0 + 1.0 / count.sqrt()) } else { variance }
        });
    }
    variances
}

/// Third differences over the root of 20: those of what is smooth vanish, those of white noise have its variance.
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
        let whitening = Whitening::of(&stretches, MAX_ORDER);
        let white: Vec<Vec<f64>> = stretches.iter().map(|x| whitening.applied(x)).collect();
        for (level, variance) in haar(&white, 9).into_iter().enumerate() {
            assert!((0.45..1.35).contains(&variance), "level {level}: {variance}");
        }
    }

    #[test]
    fn a_stretch_shorter_than_the_filter_is_filtered() {
        let whitening = Whitening::of(&[red(20_000, 0.9, 3)], MAX_ORDER);
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
        let whitening = Whitening::of(&[red(20_000, 0.95, 3)], MAX_ORDER);
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
        let whitening = Whitening::of(&[x], MAX_ORDER);
        for frequency in [0.01, 0.1, 0.5] {
            let power = whitening.power(frequency);
            assert!((0.7..1.4).contains(&power), "{frequency}: {power}");
        }
        // few differences tell the slowest part: it is taken larger than it looks
        assert!(whitening.power(0.0) > 0.4, "{}", whitening.power(0.0));
        // what leads across them would
        let mut bridged = white(20_000, 5);
        (0..bridged.len()).filter(|n| is_missing(*n)).for_each(|n| bridged[n] = 6.0);
        assert!(Whitening::of(&[bridged], MAX_ORDER).power(0.0) < 0.2);
    }

    #[test]
    fn white_noise_is_left_alone() {
        let whitening = Whitening::of(&[white(20_000, 5)], MAX_ORDER);
        assert!(whitening.order() <= 1);
        let out = whitening.applied(&white(1000, 6));
        let sigma = (out.iter().map(|x| x * x).sum::<f64>() / 1000.0).sqrt();
        assert!((sigma - 1.0).abs() < 0.1, "{sigma}");
    }
}
