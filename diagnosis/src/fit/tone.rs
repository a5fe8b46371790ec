//! A tone of one frequency: mains in the cable of a bridge, a pump, a fan.
//!
//! A line is narrower than anything that follows the motion or rings: over the whole recording its phase stays. In the spectrum of a rest `r`
//! over all of its time it is one bin above the noise around it, whose entries are exponentially distributed,
//!
//! ```text
//! z = |R(f)|²·ln 2 / median of |R|² around f,   P(z > x) = exp(-x)
//! ```
//!
//! and its size and phase are the same early and late, forward and backward, slow and fast: what a ripple makes of one speed is not.
//! Slower ones, and their orders, are the clocks' of the search. A line is found before the noise is learnt: a noise filter takes it all away.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use simulation::curve::Curve;
use simulation::mechanism::Context;

use crate::fit::story;
use crate::noise::rows::Rows;
use crate::numbers::peaks::peaks;
use crate::numbers::statistics::median;

/// Lowest frequency, Hz, and the highest, of the rate of the rows.
const LOWEST_HZ: f64 = 4.0;
const HIGHEST: f64 = 0.4;

/// Most places of the transform, and how often the recording fits into it.
const MOST_BINS: usize = 1 << 22;
const PADDED: f64 = 2.0;

/// Places to either side of a line that are it, and those that tell the noise around it.
const OF_LINE: usize = 4;
const AROUND: usize = 100;

/// Lines that are looked at, and the `z` that they ask for: that each of the groups of rows shows its phase.
const LINES: usize = 3;
const CLEAR: f64 = 100.0;

/// Part of its size that a line may differ by in a group of rows.
const STEADY: f64 = 0.35;

/// Fewest rows of a group.
const FEWEST: usize = 200;

/// Tones in what curves leave of a mismatch (one entry a row of all runs), the clearest first.
pub(crate) fn all(rows: &Rows, contexts: &[Context<'_>], left: &[f64]) -> Vec<Curve> {
    let Some(rest) = Rest::of(rows, contexts, left) else { return Vec::new() };
    let lines = rest.lines_hz().into_iter().map(|hz| rest.refined(hz)).filter(|hz| rest.is_steady(*hz));
    lines.map(|hz| story::tone(1.0 / hz, (1.0 / (rest.step_s * hz)) as usize)).collect()
}

/// What is left in the rows that are compared, each part by its own noise.
struct Rest {
    time_s: Vec<f64>,
    value: Vec<f64>,
    /// Squared weight of every row.
    power: Vec<f64>,
    velocity_m_s: Vec<f64>,
    /// Time of an average, s, and of the recording.
    step_s: f64,
    span_s: f64,
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
        let mut rest = Rest {
            time_s: Vec::new(),
            value: Vec::new(),
            power: Vec::new(),
            velocity_m_s: Vec::new(),
            step_s: step_s * rows.decimation() as f64,
            span_s: 0.0,
        };
        for (((t, v), value), power) in motion.zip(left).zip(powers).filter(|(_, power)| *power > 0.0) {
            if t.is_finite() && v.is_finite() && value.is_finite() {
                rest.time_s.push(t);
                rest.velocity_m_s.push(v);
                rest.value.push(value * power);
                rest.power.push(power);
            }
        }
        let ends = rest.time_s.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
        rest.span_s = ends.1 - ends.0;
        rest.time_s.iter_mut().for_each(|t| *t -= ends.0);
        (rest.step_s > 0.0 && rest.value.len() > 4 * FEWEST && LOWEST_HZ < HIGHEST / rest.step_s).then_some(rest)
    }

    /// Frequencies whose bin stands out of those around it.
    fn lines_hz(&self) -> Vec<f64> {
        let per_s = 1.0 / self.step_s;
        let places = PADDED * self.span_s * per_s;
        // a clock that jumps by years has more than can be counted
        if !(places <= MOST_BINS as f64) {
            return Vec::new();
        }
        let bins = (places as usize).next_power_of_two();
        let mut sums = vec![Complex::new(0.0, 0.0); bins];
        for (t, x) in self.time_s.iter().zip(&self.value) {
            sums[((t * per_s) as usize).min(bins - 1)].re += x;
        }
        FftPlanner::new().plan_fft_forward(bins).process(&mut sums);
        let powers: Vec<f64> = sums[..bins / 2].iter().map(|sum| sum.norm_sqr()).collect();
        let step_hz = per_s / bins as f64;
        let (first, last) = ((LOWEST_HZ / step_hz) as usize, (HIGHEST * per_s / step_hz) as usize);
        if first < AROUND || last + AROUND >= powers.len() || first >= last {
            return Vec::new();
        }
        let highest = peaks(&powers[first..last], 4 * LINES, OF_LINE, 0.0);
        let clear = |k: &usize| {
            let around = (k - AROUND..=k + AROUND).filter(|other| other.abs_diff(*k) > OF_LINE);
            median(around.map(|other| powers[other]).collect())
                .is_some_and(|usual| powers[*k] * std::f64::consts::LN_2 > CLEAR * usual)
        };
        highest.into_iter().map(|k| k + first).filter(clear).take(LINES).map(|k| k as f64 * step_hz).collect()
    }

    /// The frequency near one at which most is in phase.
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

    /// Size and phase of a wave in some of the rows, and their number.
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

    /// Whether a wave is the same in the quarters of the time, in both directions, and where the carriage is slow and fast.
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
