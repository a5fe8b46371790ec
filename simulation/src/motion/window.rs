//! A column and its derivatives from a window of rows around each row.
//!
//! They are those of the parabola fitted to the window (Savitzky and Golay 1964), never across the border of a part.

use std::ops::Range;

use crate::run::Run;

/// Accepted noise of a derived acceleration, relative to the run's RMS acceleration.
pub(super) const ACCELERATION_NOISE: f64 = 0.03;

/// Noise of a channel that is accepted as none, relative to its RMS.
const CALM: f64 = 1e-5;

/// Standard deviations of a shorter window within which a longer one agrees with it.
const ALIKE: f64 = 3.0;

/// Share of the variance of normal numbers that is left without the largest twentieth.
const LEFT_OF_VARIANCE: f64 = 0.7588;

/// Shortest window, rows to either side.
pub(super) const FEWEST: usize = 2;

/// Longest window, rows to either side.
pub(super) const MAX_REACH: usize = 50;

/// A column of a run with less noise, in its own unit, one entry per row: in every row, the value of the parabola
/// through the largest window that agrees with all shorter ones; unchanged beside a step. The whole column is unchanged
/// where a cell of it is not finite.
pub fn calm(run: &Run, column: &[f64]) -> Vec<f64> {
    if column.iter().any(|x| !x.is_finite()) {
        return column.to_vec();
    }
    let level = Wanted { derivative: 0, accepted: CALM };
    widened(&run.time_s, column, &run.part_rows(), run.step_s(), 0, level).1
}

/// First derivative over the largest agreeing window, at least `reach` rows to either side; of [`TwoWindows`] where that
/// window is biased already.
pub(super) fn calm_slope(time: &[f64], column: &[f64], parts: &[Range<usize>], step_s: f64, reach: usize) -> Vec<f64> {
    let calm = widened(time, column, parts, step_s, reach, Wanted { derivative: 1, accepted: CALM }).1;
    TwoWindows::of(time, column, parts, reach).where_biased(calm, column, parts, step_s)
}

/// Rows to either side for which the slope of `column` per row has the standard deviation `noise`: a slope fitted to N
/// rows has `σ sqrt(12/N³)`.
pub(super) fn reach(column: &[f64], parts: &[Range<usize>], noise: f64) -> usize {
    let sigma = sigma(column, parts);
    let rows = if noise > 0.0 { (12.0 * (sigma / noise) * (sigma / noise)).cbrt() } else { 0.0 };
    ((0.5 * rows).ceil() as usize).clamp(FEWEST, MAX_REACH)
}

/// Standard deviation of the noise in a column, from the differences that contain the least of the motion: a smooth one
/// vanishes in the third, one that swings within a few rows in the fifth.
fn sigma(column: &[f64], parts: &[Range<usize>]) -> f64 {
    let third = of_differences(column, parts, [1.0, -3.0, 3.0, -1.0]);
    third.min(of_differences(column, parts, [1.0, -5.0, 10.0, -10.0, 5.0, -1.0]))
}

/// Standard deviation of white noise that has these differences. A jerk makes large ones that are no noise: the largest
/// twentieth is left out.
fn of_differences<const ROWS: usize>(column: &[f64], parts: &[Range<usize>], weights: [f64; ROWS]) -> f64 {
    let of_row = |rows: &[f64]| rows.iter().zip(weights).map(|(x, weight)| weight * x).sum::<f64>().powi(2);
    let windows = parts.iter().flat_map(|rows| column[rows.clone()].windows(ROWS));
    let mut squares: Vec<f64> = windows.map(of_row).collect();
    let kept = squares.len() - squares.len() / 20;
    if kept < squares.len() {
        squares.select_nth_unstable_by(kept, f64::total_cmp);
        squares.truncate(kept);
    }
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let of_white = weights.iter().map(|weight| weight * weight).sum::<f64>();
    (mean / (of_white * LEFT_OF_VARIANCE)).sqrt()
}

pub(super) fn rms(column: &[f64]) -> f64 {
    (column.iter().map(|x| x * x).sum::<f64>() / column.len().max(1) as f64).sqrt()
}

/// First derivative of the parabola through the window.
pub(super) fn slope(time: &[f64], column: &[f64], parts: &[Range<usize>], reach: usize) -> Vec<f64> {
    local(time, column, parts, reach, |[_, b, _]| b)
}

/// First derivative, of [`TwoWindows`] where one is biased.
pub(super) fn sharp_slope(time: &[f64], column: &[f64], parts: &[Range<usize>], step_s: f64, reach: usize) -> Vec<f64> {
    let two = TwoWindows::of(time, column, parts, reach);
    two.where_biased(two.long.clone(), column, parts, step_s)
}

/// First derivative in a window and in half of it, which together tell it without the bias of either.
///
/// ```text
/// slope of the parabola through 2r + 1 rows = V + β(r) Δt² V'',  β(r) = (3r² + 3r - 1)/30,  variance σ²/(Δt² S(r)),
/// S(r) = r(r + 1)(2r + 1)/3
/// ```
pub(super) struct TwoWindows {
    reach: usize,
    long: Vec<f64>,
    short: Vec<f64>,
}

impl TwoWindows {
    pub(super) fn of(time: &[f64], column: &[f64], parts: &[Range<usize>], reach: usize) -> Self {
        let of = |reach: usize| slope(time, column, parts, reach);
        TwoWindows { reach, long: of(reach), short: of(half(reach)) }
    }

    /// Without the bias, but with the noise of both.
    pub(super) fn sharp(&self, n: usize) -> f64 {
        let bias = |r: usize| ((3 * r * r + 3 * r) as f64 - 1.0) / 30.0;
        let (long, short) = (bias(self.reach), bias(half(self.reach)));
        self.short[n] + short / (long - short) * self.bent(n)
    }

    fn bent(&self, n: usize) -> f64 {
        self.short[n] - self.long[n]
    }

    /// A derivative `otherwise`, replaced where the windows differ by more than their noise, and by as much in the mean
    /// of neighbouring rows: a bias is alike there, the counts of an encoder are not. Not replaced where one of them
    /// rests or turns back, and near the border of a part.
    fn where_biased(&self, mut otherwise: Vec<f64>, column: &[f64], parts: &[Range<usize>], step_s: f64) -> Vec<f64> {
        let squares = |r: usize| (r * (r + 1) * (2 * r + 1)) as f64 / 3.0;
        let noise =
            sigma(column, parts) / step_s * (1.0 / squares(half(self.reach)) - 1.0 / squares(self.reach)).sqrt();
        let is_biased = |n: usize| {
            let around = (n - 1..n + 2).map(|m| self.bent(m)).sum::<f64>() / 3.0;
            let is_clear = self.bent(n).abs().min(around * self.bent(n).signum()) > ALIKE * noise;
            is_clear && self.short[n] * self.long[n] > 0.0 && self.sharp(n) * self.long[n] > 0.0
        };
        for rows in parts.iter().filter(|rows| rows.len() > 2 * self.reach) {
            let inner = rows.start + self.reach..rows.end - self.reach;
            inner.filter(|n| is_biased(*n)).for_each(|n| otherwise[n] = self.sharp(n));
        }
        otherwise
    }
}

/// Half a window, rows to either side.
fn half(reach: usize) -> usize {
    (reach / 2).max(1)
}

/// Second derivative.
pub(super) fn bend(time: &[f64], column: &[f64], parts: &[Range<usize>], reach: usize) -> Vec<f64> {
    local(time, column, parts, reach, |[_, _, c]| 2.0 * c)
}

/// Second derivative, and the most rows to either side that it is derived from; the window is [`widened`] from `reach`
/// on.
pub(super) fn smooth_bend(
    time: &[f64],
    column: &[f64],
    parts: &[Range<usize>],
    step_s: f64,
    reach: usize,
) -> (usize, Vec<f64>) {
    let bends = Wanted { derivative: 2, accepted: ACCELERATION_NOISE };
    widened(time, column, parts, step_s, reach, bends)
}

/// Derivative of a column, and its accepted noise relative to its RMS.
#[derive(Clone, Copy)]
struct Wanted {
    derivative: usize,
    accepted: f64,
}

impl Wanted {
    /// Its part of a parabola `a + b τ + c τ²`.
    fn of(self, [a, b, c]: [f64; 3]) -> f64 {
        [a, b, 2.0 * c][self.derivative]
    }

    /// Standard deviation for a column with standard deviation 1. For a parabola fitted to N rows it is `sqrt(9/(4N))`
    /// for the value in the middle, `sqrt(12/N³)/Δt` for the slope and `sqrt(720/N⁵)/Δt²` for the second derivative;
    /// for a single row it is 1.
    fn noise(self, reach: usize, step_s: f64) -> f64 {
        let rows = 2.0 * reach as f64 + 1.0;
        match self.derivative {
            0 if reach == 0 => 1.0,
            0 => (2.25 / rows).sqrt(),
            1 => (12.0 / rows.powi(3)).sqrt() / step_s,
            _ => (720.0 / rows.powi(5)).sqrt() / (step_s * step_s),
        }
    }
}

/// A derivative of a column, and the most rows to either side that it is derived from. The window grows until the noise
/// is a small share of the whole, but in no row further than its result agrees with that of every shorter window
/// (Lepskii 1991): a corner stays a corner.
fn widened(
    time: &[f64],
    column: &[f64],
    parts: &[Range<usize>],
    step_s: f64,
    mut reach: usize,
    wanted: Wanted,
) -> (usize, Vec<f64>) {
    let mut found = local(time, column, parts, reach, |parabola| wanted.of(parabola));
    let sigma = sigma(column, parts);
    let mut agreed: Vec<Option<(f64, f64)>> = vec![Some((f64::NEG_INFINITY, f64::INFINITY)); found.len()];
    loop {
        let own = sigma * wanted.noise(reach, step_s);
        let size = (rms(&found).powi(2) - own * own).max(0.0).sqrt();
        if own.is_nan() || own <= wanted.accepted * size || reach >= MAX_REACH {
            return (reach, found);
        }
        for (agreed, found) in agreed.iter_mut().zip(&found) {
            *agreed = agreed.map(|(least, most)| (least.max(found - ALIKE * own), most.min(found + ALIKE * own)));
        }
        reach = (reach + reach.div_ceil(2)).clamp(FEWEST, MAX_REACH);
        for rows in parts {
            for n in rows.clone() {
                let Some((least, most)) = agreed[n] else { continue };
                let wider = wanted.of(around(time, column, rows, n, reach));
                if (least..=most).contains(&wider) {
                    found[n] = wider;
                } else {
                    agreed[n] = None;
                }
            }
        }
    }
}

/// Applies `of` to the parabola fitted [`around`] every row.
pub(super) fn local<T: Copy + Default>(
    time: &[f64],
    column: &[f64],
    parts: &[Range<usize>],
    reach: usize,
    of: impl Fn([f64; 3]) -> T,
) -> Vec<T> {
    let mut out = vec![T::default(); column.len()];
    for rows in parts {
        for n in rows.clone() {
            out[n] = of(around(time, column, rows, n, reach));
        }
    }
    out
}

/// Fits `a + b τ + c τ²` around a row of a part, with τ the time from it. Near the border of the part the window
/// shrinks only on the side of the border, and only as far as it must.
fn around(time: &[f64], column: &[f64], rows: &Range<usize>, n: usize, reach: usize) -> [f64; 3] {
    let from = n.saturating_sub(reach).max(rows.start);
    let to = (n + reach + 1).min(rows.end);
    let (t0, x0) = (time[n], column[n]);
    // moments of τ and of the column, both relative to the row itself: no cancellation
    let (mut s, mut m) = ([0.0; 5], [0.0; 3]);
    for k in from..to {
        let (t, x) = (time[k] - t0, column[k] - x0);
        let t2 = t * t;
        for (sum, power) in s.iter_mut().zip([1.0, t, t2, t2 * t, t2 * t2]) {
            *sum += power;
        }
        for (sum, power) in m.iter_mut().zip([1.0, t, t2]) {
            *sum += power * x;
        }
    }
    let [a, b, c] = parabola(s, m);
    [x0 + a, b, c]
}

/// Solves the normal equations of the parabola; a straight line or 0 where the rows do not allow more.
fn parabola(s: [f64; 5], m: [f64; 3]) -> [f64; 3] {
    let minor = |a: f64, b: f64, c: f64, d: f64| a * d - b * c;
    let (c00, c01, c02) = (minor(s[2], s[3], s[3], s[4]), minor(s[1], s[3], s[2], s[4]), minor(s[1], s[2], s[2], s[3]));
    let determinant = s[0] * c00 - s[1] * c01 + s[2] * c02;
    if determinant > 1e-12 * s[0] * s[2] * s[4] {
        let c11 = minor(s[0], s[2], s[2], s[4]);
        let c12 = minor(s[0], s[1], s[2], s[3]);
        let c22 = minor(s[0], s[1], s[1], s[2]);
        return [
            (c00 * m[0] - c01 * m[1] + c02 * m[2]) / determinant,
            (-c01 * m[0] + c11 * m[1] - c12 * m[2]) / determinant,
            (c02 * m[0] - c12 * m[1] + c22 * m[2]) / determinant,
        ];
    }
    let line = minor(s[0], s[1], s[1], s[2]);
    if line > 0.0 { [minor(m[0], m[1], s[1], s[2]) / line, (s[0] * m[1] - s[1] * m[0]) / line, 0.0] } else { [0.0; 3] }
}
