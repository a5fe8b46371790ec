//! A tone: one steady frequency, such as mains in a bridge's cable, a pump or a fan.
//!
//! A line is narrower than anything that follows the motion or rings: its phase is constant over the whole recording.
//! In the spectrum of a residual `r` over all its time it is one bin above the surrounding noise, whose bins are
//! exponentially distributed,
//!
//! ```text
//! z = |R(f)|²·ln 2 / median of |R|² around f,   P(z > x) = exp(-x)
//! ```
//!
//! and its size and phase are the same early and late, forward and backward, slow and fast, unlike those of a ripple at
//! one speed. Slower tones, and their orders, are left to the clocks of the search. Lines are found before the noise is
//! estimated: a noise filter would remove them completely.

use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use simulation::curve::Curve;
use simulation::mechanism::Context;

use crate::fit::story;
use crate::noise::rows::Rows;
use crate::numbers::statistics::median;

/// Lowest frequency, Hz, and the highest as a fraction of the sampling rate.
const LOWEST_HZ: f64 = 4.0;
const HIGHEST: f64 = 0.4;

/// Most bins of the transform, and its zero-padding factor.
const MOST_BINS: usize = 1 << 22;
const PADDED: f64 = 2.0;

/// Bins to either side that belong to a line within one part, and those beyond that tell the surrounding noise. Several
/// parts with rests between them spread a line into a comb as wide as the line of a single part.
const OF_LINE: usize = 4;
const AROUND: usize = 100;

/// Most lines, and most peaks examined for them.
const LINES: usize = 3;
const LOOKED_AT: usize = 4 * LINES;

/// The `z` of a bin to be examined, and that of a line over what is left without it, at which each group of rows shows
/// its phase. Parts, and rows that are not compared, spread a line over all bins near it.
const SEEN: f64 = 25.0;
const CLEAR: f64 = 100.0;

/// Share of its size by which a line may differ in a group of rows.
const STEADY: f64 = 0.35;

/// Fewest rows of a group.
const FEWEST: usize = 200;

/// Tones in what curves leave of a mismatch (one entry per row of all runs), the clearest first.
pub(crate) fn all(rows: &Rows, contexts: &[Context<'_>], left: &[f64]) -> Vec<Curve> {
    let Some(rest) = Rest::of(rows, contexts, left) else { return Vec::new() };
    let step_s = rest.step_s;
    rest.lines_hz().into_iter().map(|hz| story::tone(1.0 / hz, (1.0 / (step_s * hz)) as usize)).collect()
}

/// Time from the first to the last finite time, s.
fn span_s(time_s: &[f64]) -> f64 {
    let known = time_s.iter().copied().filter(|t| t.is_finite());
    let (first, last) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    last - first
}

/// Power by frequency.
struct Spectrum {
    powers: Vec<f64>,
    step_hz: f64,
    /// Bins of the frequencies searched.
    range: Range<usize>,
}

impl Spectrum {
    /// The highest bin that stands out and is more than `of_line` from `others`.
    fn highest(&self, of_line: usize, others: &[usize]) -> Option<usize> {
        let is_apart = |place: &usize| others.iter().all(|other| place.abs_diff(*other) > of_line);
        let highest = self.range.clone().filter(is_apart).max_by(|a, b| self.powers[*a].total_cmp(&self.powers[*b]))?;
        (self.z(self.powers[highest], highest, of_line) > SEEN).then_some(highest)
    }

    /// A power relative to the noise around a bin, excluding the bins of its line; 0 where too few bins surround it.
    fn z(&self, power: f64, place: usize, of_line: usize) -> f64 {
        let reach = of_line.saturating_add(AROUND);
        if place < reach || place + reach >= self.powers.len() {
            return 0.0;
        }
        let around = (place - reach..=place + reach).filter(|other| other.abs_diff(place) > of_line);
        let usual = median(around.map(|other| self.powers[other]).collect()).unwrap_or(f64::INFINITY);
        power * std::f64::consts::LN_2 / usual
    }
}

/// Residual in the compared rows, each part weighted by its own noise.
#[derive(Clone)]
struct Rest {
    time_s: Vec<f64>,
    value: Vec<f64>,
    /// Squared weight of every row.
    power: Vec<f64>,
    velocity_m_s: Vec<f64>,
    /// Time per averaged row, duration of the recording, and median duration of a part, s.
    step_s: f64,
    span_s: f64,
    of_part_s: f64,
}

impl Rest {
    fn of(rows: &Rows, contexts: &[Context<'_>], left: &[f64]) -> Option<Self> {
        let powers = rows.flat(left).power_weights();
        let step_s = contexts.iter().map(|context| context.run.step_s()).fold(0.0, f64::max);
        let of_run = |context: &Context<'_>| {
            let own = context.run.time_s.iter().copied().zip(context.motion.velocity_m_s.iter().copied());
            own.collect::<Vec<_>>()
        };
        let motion = contexts.iter().flat_map(of_run);
        let parts_s = |context: &Context<'_>| {
            let parts = context.run.profile_parts().into_iter();
            parts.map(|part| span_s(&context.run.time_s[part])).collect::<Vec<_>>()
        };
        let mut rest = Rest {
            time_s: Vec::new(),
            value: Vec::new(),
            power: Vec::new(),
            velocity_m_s: Vec::new(),
            step_s: step_s * rows.decimation() as f64,
            span_s: 0.0,
            of_part_s: median(contexts.iter().flat_map(parts_s).collect()).unwrap_or(0.0),
        };
        for (((t, v), value), power) in motion.zip(left).zip(powers).filter(|(_, power)| *power > 0.0) {
            if t.is_finite() && v.is_finite() && value.is_finite() {
                rest.time_s.push(t);
                rest.velocity_m_s.push(v);
                rest.value.push(value * power);
                rest.power.push(power);
            }
        }
        rest.span_s = span_s(&rest.time_s);
        let first = rest.time_s.iter().copied().fold(f64::INFINITY, f64::min);
        rest.time_s.iter_mut().for_each(|t| *t -= first);
        (rest.step_s > 0.0 && rest.value.len() > 4 * FEWEST && LOWEST_HZ < HIGHEST / rest.step_s).then_some(rest)
    }

    /// Frequencies of the lines; each must exceed what is left without it and those before it.
    fn lines_hz(mut self) -> Vec<f64> {
        let (mut found, mut looked_at) = (Vec::new(), Vec::new());
        let Some(mut spectrum) = self.spectrum() else { return found };
        let of_line =
            (OF_LINE as f64 * (self.span_s / self.of_part_s).max(1.0)).min(spectrum.powers.len() as f64) as usize;
        for _ in 0..LOOKED_AT {
            let Some(place) = spectrum.highest(of_line, &looked_at) else { break };
            let hz = self.refined(place as f64 * spectrum.step_hz);
            looked_at.push(place);
            let without = self.without(hz);
            let Some(left) = without.spectrum() else { break };
            if left.z(spectrum.powers[place], place, OF_LINE) > CLEAR && self.is_steady(hz) {
                found.push(hz);
                if found.len() == LINES {
                    break;
                }
                (self, spectrum) = (without, left);
            }
        }
        found
    }

    fn spectrum(&self) -> Option<Spectrum> {
        let per_s = 1.0 / self.step_s;
        let places = PADDED * self.span_s * per_s;
        // guards against a time column that jumps by years
        if !(places <= MOST_BINS as f64) {
            return None;
        }
        let bins = (places as usize).next_power_of_two();
        let mut sums = vec![Complex::new(0.0, 0.0); bins];
        for (t, x) in self.time_s.iter().zip(&self.value) {
            sums[((t * per_s) as usize).min(bins - 1)].re += x;
        }
        FftPlanner::new().plan_fft_forward(bins).process(&mut sums);
        let step_hz = per_s / bins as f64;
        let range = (LOWEST_HZ / step_hz) as usize..(HIGHEST * per_s / step_hz) as usize;
        Some(Spectrum { powers: sums[..bins / 2].iter().map(|sum| sum.norm_sqr()).collect(), step_hz, range })
    }

    /// The same without the wave at this frequency.
    fn without(&self, hz: f64) -> Self {
        let wave = self.wave(hz, |_| true).map_or(Complex::new(0.0, 0.0), |(wave, _)| 2.0 * wave);
        let at = |n: usize| (wave * Complex::from_polar(1.0, std::f64::consts::TAU * hz * self.time_s[n])).re;
        let value = (0..self.value.len()).map(|n| self.value[n] - self.power[n] * at(n)).collect();
        Rest { value, ..self.clone() }
    }

    /// The nearby frequency of the largest coherent amplitude.
    fn refined(&self, mut hz: f64) -> f64 {
        let size = |hz: f64| self.wave(hz, |_| true).map_or(0.0, |(wave, _)| wave.norm());
        let (mut step, mut most) = (0.25 / (PADDED * self.span_s), size(hz));
        for _ in 0..6 {
            for side in [-1.0, 1.0] {
                let there = size(hz + side * step);
                if there > most {
                    (hz, most) = (hz + side * step, there);
                    break;
                }
            }
            step *= 0.5;
        }
        hz
    }

    /// Complex amplitude of a wave in some of the rows, and their number.
    fn wave(&self, hz: f64, of: impl Fn(usize) -> bool) -> Option<(Complex<f64>, usize)> {
        let omega = std::f64::consts::TAU * hz;
        let (mut sum, mut power, mut rows) = (Complex::new(0.0, 0.0), 0.0, 0);
        for n in (0..self.value.len()).filter(|n| of(*n)) {
            sum += Complex::from_polar(self.value[n], -omega * self.time_s[n]);
            power += self.power[n];
            rows += 1;
        }
        (power > 0.0).then(|| (sum / power, rows))
    }

    /// Whether a wave is the same in all quarters of the time, in both directions, and at slow and fast speeds.
    fn is_steady(&self, hz: f64) -> bool {
        let Some((whole, rows)) = self.wave(hz, |_| true) else { return false };
        let usual = median(self.velocity_m_s.iter().map(|v| v.abs()).collect()).unwrap_or(0.0);
        let is_alike = |of: &dyn Fn(usize) -> bool| match self.wave(hz, of) {
            Some((own, own_rows)) if own_rows >= FEWEST => (own - whole).norm() < STEADY * whole.norm(),
            _ => true,
        };
        (0..4).all(|quarter| is_alike(&|n| 4 * n / rows == quarter))
            && is_alike(&|n| self.velocity_m_s[n] > 0.0)
            && is_alike(&|n| self.velocity_m_s[n] < 0.0)
            && is_alike(&|n| self.velocity_m_s[n].abs() > usual)
            && is_alike(&|n| self.velocity_m_s[n].abs() < usual)
    }
}
