//! Averaged spectra of the residual at low and high speed: a peak at every speed comes neither from the rail nor from a
//! screw.

use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::noise::rows::Rows;
use crate::numbers::peaks::peaks;
use crate::numbers::statistics::{line, mean, median};
use crate::recording::side::Side;

/// Window length, s: ringing with a hundredth of critical damping at 20 Hz lasts half of it.
const WINDOW_S: f64 = 1.0;

/// Fewest and most rows of a window.
const LEAST_WINDOW: usize = 64;
const MOST_WINDOW: usize = 8192;

/// Number of pieces below which the window is halved: less resolution, but more pieces to average.
const FEWEST_PIECES: usize = 32;

/// Most peaks examined, and their least height relative to the median around them.
const PEAKS: usize = 3;
const STANDS_OUT: f64 = 2.0;

/// Least height of a ringing peak relative to the median around it, at low and at high speed. What is tied to the rail
/// or a screw has another frequency at another speed, and a sweep by another machine is broad; a structure damped by a
/// few hundredths reaches seven and more, a sweep over a tenth of its frequency to either side five.
const AT_EVERY_SPEED: f64 = 6.0;

/// The same where both reversals and rolling excite it, which is unique to a structure: a creeping carriage excites
/// little.
const STRUCK_BY_BOTH: f64 = 2.5;

/// A peak in one run alone rests on few pieces: its largest p-value, and its least median height over pieces. Ringing
/// has a median height of five and more; a sweep, or a ripple at changing speed, less than two. A run of few speeds may
/// meet a ripple at one speed and its order at another.
const IN_ONE_RUN: f64 = 1e-6;
const IN_EVERY_PIECE: f64 = 3.0;

/// Speed ratio of both halves below which they tell nothing of that ..
const APART: f64 = 1.5;

/// .. and the ratio needed to tell a peak in a few pieces only from a sweep.
const FAR_APART: f64 = 4.0;

/// Width of a speed class, in ln V, and the number of classes that must show a peak at every speed.
const ALIKE: f64 = 0.25;
const FEWEST_SPEEDS: usize = 4;

/// Standard deviations that make sure.
const SURELY: f64 = 3.0;

/// Bins to either side of a peak that belong to it.
const FLANK: usize = 2;

/// One window of a residual.
struct Piece {
    /// Mean speed over the distance travelled, m/s.
    speed_m_s: f64,
    /// Power at every frequency.
    power: Vec<f64>,
    /// Median power of its run over frequency: used as scale, so that a loud run does not drown ringing in a quiet one.
    loudness: f64,
}

/// Pieces of a run.
struct OfRun(Vec<Piece>);

/// Averaged spectra of a residual, over all runs and per run.
pub(crate) struct Spectra {
    /// Duration of a piece, s; its inverse is the frequency resolution.
    pub(crate) window_s: f64,
    runs: Vec<OfRun>,
}

/// A peak at every speed.
pub(crate) struct Peak {
    /// Its share of the total power.
    pub(crate) share: f64,
    /// Its p-value in noise without it.
    pub(crate) p: f64,
    /// Whether its power certainly grows with speed, as excitation by rolling does and mains hum does not.
    pub(crate) is_rolled: bool,
    /// Whether it is as high at every speed as only ringing is.
    pub(crate) is_high: bool,
}

/// Mean power of pieces, each divided by its own scale.
fn averaged(pieces: &[&Piece], scale: impl Fn(&Piece) -> f64) -> Vec<f64> {
    let number = pieces.len() as f64;
    let mut averaged = vec![0.0; pieces.first().map_or(0, |piece| piece.power.len())];
    for piece in pieces {
        let scale = scale(piece) * number;
        averaged.iter_mut().zip(&piece.power).for_each(|(averaged, power)| *averaged += power / scale);
    }
    averaged
}

/// The pieces of some runs.
fn pieces(runs: &[OfRun]) -> Vec<&Piece> {
    runs.iter().flat_map(|run| &run.0).collect()
}

/// Height of a bin relative to the median around it.
fn height(power: &[f64], k: usize) -> f64 {
    let around = power[k - k / 4..(k + k / 4 + 1).min(power.len())].to_vec();
    power[k] / median(around).unwrap_or(0.0).max(f64::MIN_POSITIVE)
}

/// Bins of a peak.
fn around(power: &[f64], at: usize) -> &[f64] {
    &power[at.saturating_sub(FLANK)..(at + FLANK + 1).min(power.len())]
}

impl OfRun {
    fn of(mut pieces: Vec<Piece>) -> Self {
        let power = averaged(&pieces.iter().collect::<Vec<_>>(), |_| 1.0);
        let loudness = median(power).unwrap_or(0.0).max(f64::MIN_POSITIVE);
        pieces.iter_mut().for_each(|piece| piece.loudness = loudness);
        OfRun(pieces)
    }

    /// Total power of all pieces.
    fn power(&self) -> f64 {
        self.0.iter().flat_map(|piece| &piece.power).sum()
    }

    /// Power of a peak above its surroundings, over all pieces.
    fn excess(&self, at: usize) -> f64 {
        let power = averaged(&self.0.iter().collect::<Vec<_>>(), |_| 1.0);
        let floor = power[at] / height(&power, at).max(f64::MIN_POSITIVE);
        self.0.len() as f64 * around(&power, at).iter().map(|power| power - floor).sum::<f64>()
    }

    /// Log speed and log power of a peak, piece by piece, less their means.
    fn growth(&self, at: usize) -> Vec<(f64, f64)> {
        let of_piece = |piece: &Piece| (piece.speed_m_s.ln(), around(&piece.power, at).iter().sum::<f64>().ln());
        let (speeds, powers): (Vec<f64>, Vec<f64>) =
            self.0.iter().map(of_piece).filter(|(x, y)| x.is_finite() && y.is_finite()).unzip();
        let (speed, power) = (mean(&speeds), mean(&powers));
        speeds.into_iter().zip(powers).map(|(x, y)| (x - speed, y - power)).collect()
    }
}

/// Whether the power of a peak certainly grows with speed within the runs.
///
/// ```text
/// slope / standard error = √((1/l² - 1)·freedom),   l: relative residual scatter of the line
/// ```
fn grows_with_speed(runs: &[OfRun], at: usize) -> bool {
    let of_runs: Vec<Vec<(f64, f64)>> = runs.iter().map(|run| run.growth(at)).collect();
    // one mean per run, and the slope
    let lost = 1 + of_runs.iter().filter(|points| !points.is_empty()).count();
    let points = of_runs.concat();
    let (_, slope, left) = line(&points);
    let freedom = points.len().saturating_sub(lost) as f64;
    slope > 0.0 && (1.0 / (left * left) - 1.0) * freedom > SURELY * SURELY
}

/// Number of speed classes at which a bin stands out in half of the pieces: the orders of a ripple coincide at few.
fn speeds(pieces: &[&Piece], at: usize) -> usize {
    let cell = |piece: &Piece| (piece.speed_m_s.ln() / ALIKE).floor();
    // `pieces`: slowest first
    let cells = pieces.chunk_by(|a, b| cell(a) == cell(b));
    cells.filter(|cell| is_steady(cell, at)).count()
}

/// Whether a bin stands out in at least half of the pieces: a sweep passes through it in few.
fn is_steady(pieces: &[&Piece], at: usize) -> bool {
    median_height(pieces, at).is_some_and(|height| height > IN_EVERY_PIECE)
}

fn median_height(pieces: &[&Piece], at: usize) -> Option<f64> {
    median(pieces.iter().map(|piece| height(&piece.power, at)).collect())
}

/// Whether a bin stands out in the median piece: what passes through it now and then, a sweep or the orders of a ripple
/// at changing speed, leaves it to the noise in most pieces.
///
/// ```text
/// median height of n pieces of noise = 1 ± 1/(ln 2·√(n/2)),   n/2: pieces overlap by half
/// ```
fn is_usual(pieces: &[&Piece], at: usize) -> bool {
    let error = 1.0 / (std::f64::consts::LN_2 * (0.5 * pieces.len() as f64).sqrt());
    median_height(pieces, at).is_some_and(|height| height > 1.0 + SURELY * error)
}

impl Spectra {
    /// Spectra of a residual over the compared rows; `None` where no stretch is long enough.
    pub(crate) fn of(residual: &[impl Into<f64> + Copy], rows: &Rows, side: &Side<'_>) -> Option<Self> {
        let step_s = side.step_s() * rows.decimation() as f64;
        let longest = rows.groups.iter().map(ExactSizeIterator::len).max()?;
        let wanted = ((WINDOW_S / step_s) as usize).clamp(LEAST_WINDOW, MOST_WINDOW).next_power_of_two();
        let mut window = if wanted > longest { (longest / 2 + 1).next_power_of_two() } else { wanted };
        let pieces = |window: usize| rows.groups.iter().map(|group| 2 * group.len() / window).sum::<usize>();
        while window > LEAST_WINDOW && pieces(window) < FEWEST_PIECES {
            window /= 2;
        }
        if window < LEAST_WINDOW || window > longest {
            return None;
        }
        let speeds: Vec<f64> =
            side.moving.motions.iter().flat_map(|motion| motion.velocity_m_s.iter().map(|v| v.abs())).collect();
        let speeds = rows.plain(&speeds);
        let starts = |group: &Range<usize>| (group.start..(group.end + 1).saturating_sub(window)).step_by(window / 2);
        // weighted by distance: a rest within the window does not lower the speed
        let speed = |start: usize| {
            let own = &speeds[start..start + window];
            let way: f64 = own.iter().sum();
            if way > 0.0 { own.iter().map(|v| v * v).sum::<f64>() / way } else { 0.0 }
        };
        let transform = FftPlanner::new().plan_fft_forward(window);
        let spectrum = |start: usize| {
            // Hann's window
            let tapered = |n: usize| {
                let taper = 0.5 - 0.5 * (std::f64::consts::TAU * n as f64 / window as f64).cos();
                Complex::new(residual[start + n].into() * taper, 0.0)
            };
            let mut piece: Vec<Complex<f64>> = (0..window).map(tapered).collect();
            transform.process(&mut piece);
            piece[..window / 2].iter().map(Complex::norm_sqr).collect()
        };
        let piece = |start: usize| Piece { speed_m_s: speed(start), power: spectrum(start), loudness: 1.0 };
        let runs = rows.groups.iter().filter(|group| group.len() >= window);
        let runs = runs.map(|group| OfRun::of(starts(group).map(piece).collect())).collect();
        Some(Spectra { window_s: window as f64 * step_s, runs })
    }

    /// Frequencies within a range, Hz, that stand out, the highest first.
    pub(crate) fn peaks(&self, from_hz: f64, to_hz: f64) -> Vec<f64> {
        let both = averaged(&pieces(&self.runs), |_| 1.0);
        let within = |k: &usize| (from_hz..=to_hz).contains(&(*k as f64 / self.window_s));
        let heights: Vec<f64> =
            (0..both.len()).map(|k| if k > 0 && within(&k) { height(&both, k) } else { 0.0 }).collect();
        let found = peaks(&heights, PEAKS, 2, STANDS_OUT);
        found.into_iter().map(|k| k as f64 / self.window_s).collect()
    }

    /// The peak at a frequency at low and high speed: over all runs, in the run where it is most certain, or a lower
    /// one over all.
    pub(crate) fn at_every_speed(&self, hz: f64) -> Option<Peak> {
        let at = (hz * self.window_s).round() as usize;
        let of_all = self.peak(&self.runs, at).map(|(peak, _)| peak);
        if of_all.as_ref().is_some_and(|peak| peak.is_high) {
            return of_all;
        }
        let of_run = |run: &OfRun| {
            let (peak, is_sure) = self.peak(std::slice::from_ref(run), at)?;
            let p = peak.p * self.runs.len() as f64;
            (peak.is_high && is_sure && p < IN_ONE_RUN).then_some(Peak { p, ..peak })
        };
        self.runs.iter().filter_map(of_run).min_by(|a, b| a.p.total_cmp(&b.p)).or(of_all)
    }

    /// The peak in a bin if it stands out in slow and in fast pieces, and whether it does so in most pieces at speeds
    /// far apart.
    fn peak(&self, runs: &[OfRun], at: usize) -> Option<(Peak, bool)> {
        let mut pieces = pieces(runs);
        pieces.sort_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s));
        let (slower, faster) = pieces.split_at(pieces.len() / 2);
        let halves = [slower, faster];
        let [slow_m_s, fast_m_s] =
            halves.map(|half| mean(&half.iter().map(|piece| piece.speed_m_s).collect::<Vec<_>>()));
        let apart = fast_m_s / slow_m_s;
        let spectra = halves.map(|half| averaged(half, |piece| piece.loudness));
        if !(apart > APART) || spectra.iter().any(|power| at >= power.len()) {
            return None;
        }
        let heights = spectra.each_ref().map(|power| height(power, at));
        if heights.iter().any(|height| !(*height > STRUCK_BY_BOTH)) {
            return None;
        }
        // P(mean of n unit exponentials > h) < exp(-n(h - 1 - ln h)); pieces overlap by half
        let nats = |h: f64| 0.5 * slower.len() as f64 * (h - 1.0 - h.ln());
        let evidence: f64 = heights.into_iter().map(nats).sum();
        let is_steady = halves.iter().all(|half| is_steady(half, at));
        // a peak met at one speed only can appear on both sides of a median speed that is close to it
        let is_everywhere =
            (is_steady || (apart > FAR_APART && is_usual(&pieces, at))) && speeds(&pieces, at) >= FEWEST_SPEEDS;
        let excess = runs.iter().map(|run| run.excess(at)).sum::<f64>().max(0.0);
        let peak = Peak {
            share: excess / self.runs.iter().map(OfRun::power).sum::<f64>(),
            p: (spectra[0].len() as f64 * (-evidence).exp()).min(1.0),
            is_rolled: is_everywhere && grows_with_speed(runs, at),
            is_high: is_everywhere && heights.iter().all(|height| *height > AT_EVERY_SPEED),
        };
        Some((peak, is_steady && apart > FAR_APART))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces with unit power but for one bin, whose heights are given.
    fn pieces(heights: impl Iterator<Item = f64>) -> Vec<Piece> {
        let of = |height: f64| {
            let mut power = vec![1.0; 64];
            power[20] = height;
            Piece { speed_m_s: 0.1, power, loudness: 1.0 }
        };
        heights.map(of).collect()
    }

    fn is_usual(pieces: &[Piece]) -> bool {
        super::is_usual(&pieces.iter().collect::<Vec<_>>(), 20)
    }

    #[test]
    fn what_passes_through_a_bin_in_a_third_of_the_pieces_is_not_usual_there() {
        let in_a_third = |n: usize| if n.is_multiple_of(3) { 900.0 } else { 1.1 };
        assert!(!is_usual(&pieces((0..120).map(in_a_third))));
        assert!(is_usual(&pieces((0..120).map(|_| 1.7))));
        // the fewer the pieces, the higher must a median stand
        assert!(!is_usual(&pieces((0..20).map(|_| 1.7))));
    }
}
