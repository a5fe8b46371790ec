//! Averaged spectra of what is left, slow and fast: what stands out at every speed is neither of the rail nor of a screw.

use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::noise::rows::Rows;
use crate::numbers::peaks::peaks;
use crate::numbers::statistics::median;
use crate::recording::side::Side;

/// Time that the spectrum looks at in one go, s: what rings with a hundredth of critical damping at 20 Hz lasts half of it.
const WINDOW_S: f64 = 1.0;

/// Fewest rows of such a window, and most.
const LEAST_WINDOW: usize = 64;
const MOST_WINDOW: usize = 8192;

/// Pieces below which shorter ones, that tell a frequency less well, tell more.
const FEWEST_PIECES: usize = 32;

/// Peaks that are looked at, and their height over the median around them.
const PEAKS: usize = 3;
const STANDS_OUT: f64 = 2.0;

/// Height of a peak over the median around it, slow and fast, of what rings. What is tied to the rail or to a screw is
/// elsewhere at another speed, what another machine sweeps through is broad; a structure that is damped by a few hundredths
/// stands out by seven and more, and a sweep over a tenth of its frequency to either side by five.
const AT_EVERY_SPEED: f64 = 6.0;

/// A peak of one run alone has few pieces: its p-value, and its height in the middle one of them. What rings stands out by
/// five and more in that one, what sweeps and a ripple at changing speed by less than twice.
const IN_ONE_RUN: f64 = 1e-6;
const IN_EVERY_PIECE: f64 = 3.0;

/// Speeds of both halves that differ by less tell nothing of that ..
const APART: f64 = 1.5;

/// .. and nothing of how the power grows with the speed.
const FAR_APART: f64 = 4.0;

/// Standard deviations by which it must have grown.
const SURELY: f64 = 3.0;

/// Spectra of pieces of a residual, and their average, of the slower half of them and of the faster.
struct Halves {
    slow: Vec<f64>,
    fast: Vec<f64>,
    each: [Vec<Vec<f64>>; 2],
    /// Mean speed of the faster over that of the slower.
    apart: f64,
}

/// Averaged spectra of a residual, and of each of its runs: in a quiet one rings what a loud one drowns.
pub(crate) struct Spectra {
    /// Rows of a piece over their rate: the inverse of the distance of two entries, s.
    pub(crate) window_s: f64,
    all: Halves,
    runs: Vec<Halves>,
}

/// What stands out at every speed.
pub(crate) struct Peak {
    /// Share of its power in all.
    pub(crate) share: f64,
    /// Its p-value in noise without it.
    pub(crate) p: f64,
    /// Whether it surely has more power where the carriage is faster: what rolling strikes has, a hum of the mains has not.
    pub(crate) is_rolled: bool,
}

impl Halves {
    /// Of pieces that start at a row and have a mean speed.
    fn of(mut pieces: Vec<(usize, f64)>, spectrum: impl Fn(usize) -> Vec<f64>) -> Self {
        pieces.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (slower, faster) = pieces.split_at(pieces.len() / 2);
        let each = [slower, faster].map(|pieces| pieces.iter().map(|(start, _)| spectrum(*start)).collect::<Vec<_>>());
        let [slow, fast] = each.each_ref().map(|pieces| {
            let mut power = vec![0.0; pieces.first().map_or(0, Vec::len)];
            for piece in pieces {
                power.iter_mut().zip(piece).for_each(|(power, x)| *power += x / pieces.len() as f64);
            }
            power
        });
        let speed =
            |pieces: &[(usize, f64)]| pieces.iter().map(|(_, speed)| speed).sum::<f64>() / pieces.len().max(1) as f64;
        Halves { apart: speed(faster) / speed(slower), slow, fast, each }
    }

    /// Height of an entry over the median around it.
    fn height(power: &[f64], k: usize) -> f64 {
        let around = power[k - k / 4..(k + k / 4 + 1).min(power.len())].to_vec();
        power[k] / median(around).unwrap_or(0.0).max(f64::MIN_POSITIVE)
    }

    /// Pieces of either half.
    fn pieces(&self) -> usize {
        self.each[0].len()
    }

    /// Whether an entry stands out in half of the slow pieces and of the fast: what sweeps through it does so in a few.
    fn is_steady(&self, at: usize) -> bool {
        self.each.iter().all(|pieces| {
            let heights: Vec<f64> = pieces.iter().map(|power| Self::height(power, at)).collect();
            median(heights).is_some_and(|height| height > IN_EVERY_PIECE)
        })
    }

    /// The peak at an entry, if it stands out in slow and in fast pieces.
    fn at_every_speed(&self, at: usize) -> Option<Peak> {
        let halves = [&self.slow, &self.fast];
        if halves.iter().any(|power| at >= power.len()) {
            return None;
        }
        let heights = halves.map(|power| Self::height(power, at));
        if !(self.apart > APART) || heights.iter().any(|height| !(*height > AT_EVERY_SPEED)) {
            return None;
        }
        let of_peak = |power: &[f64], height: f64| {
            let around = &power[at.saturating_sub(2)..(at + 3).min(power.len())];
            let floor = power[at] / height;
            around.iter().map(|x| (x - floor).max(0.0)).sum::<f64>()
        };
        let [slow, fast] = [0, 1].map(|half| of_peak(halves[half], heights[half]));
        let shares = slow / self.slow.iter().sum::<f64>() + fast / self.fast.iter().sum::<f64>();
        // P(mean of n unit exponentials > h) < exp(-n(h - 1 - ln h)); pieces overlap by half
        let nats: f64 = heights.iter().map(|h| 0.5 * self.pieces() as f64 * (h - 1.0 - h.ln())).sum();
        // the logarithm of a mean of n unit exponentials scatters by 1/√n
        let sure = SURELY * (4.0 / self.pieces() as f64).sqrt();
        Some(Peak {
            share: 0.5 * shares,
            p: (self.slow.len() as f64 * (-nats).exp()).min(1.0),
            is_rolled: self.apart > FAR_APART && (fast / slow).ln() > sure,
        })
    }

    /// Power of all pieces.
    fn power(&self) -> f64 {
        self.pieces() as f64 * (self.slow.iter().sum::<f64>() + self.fast.iter().sum::<f64>())
    }
}

impl Spectra {
    /// Of a residual over the compared rows; `None` where no stretch is long enough.
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
        let mean = |start: usize| speeds[start..start + window].iter().sum::<f64>() / window as f64;
        let of_run = |group: &Range<usize>| starts(group).map(|start| (start, mean(start))).collect::<Vec<_>>();
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
        Some(Spectra {
            window_s: window as f64 * step_s,
            all: Halves::of(rows.groups.iter().flat_map(of_run).collect(), spectrum),
            runs: rows.groups.iter().map(|group| Halves::of(of_run(group), spectrum)).collect(),
        })
    }

    /// Frequencies within a range, Hz, that stand out, the highest first.
    pub(crate) fn peaks(&self, from_hz: f64, to_hz: f64) -> Vec<f64> {
        let both: Vec<f64> = self.all.slow.iter().zip(&self.all.fast).map(|(slow, fast)| slow + fast).collect();
        let within = |k: &usize| (from_hz..=to_hz).contains(&(*k as f64 / self.window_s));
        let heights: Vec<f64> =
            (0..both.len()).map(|k| if k > 0 && within(&k) { Halves::height(&both, k) } else { 0.0 }).collect();
        let found = peaks(&heights, PEAKS, 2, STANDS_OUT);
        found.into_iter().map(|k| k as f64 / self.window_s).collect()
    }

    /// What stands out at a frequency, slow and fast: in all runs together or else in the one where it is surest.
    pub(crate) fn at_every_speed(&self, hz: f64) -> Option<Peak> {
        let at = (hz * self.window_s).round() as usize;
        self.all.at_every_speed(at).or_else(|| {
            let of_run = |run: &Halves| {
                let peak = run.at_every_speed(at).filter(|_| run.is_steady(at))?;
                let p = peak.p * self.runs.len() as f64;
                (p < IN_ONE_RUN).then(|| Peak { share: peak.share * run.power() / self.all.power(), p, ..peak })
            };
            self.runs.iter().filter_map(of_run).min_by(|a, b| a.p.total_cmp(&b.p))
        })
    }
}
