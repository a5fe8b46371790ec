//! Wavelengths along the rail at which a rest repeats.
//!
//! A wave `g(t)·e^{ikx(t)}` with the carrier `g` lowers the squared rest `r` by
//!
//! ```text
//! |Σ r̃ g e^{-ikx}|² · 2/(Σ g² |H(kv/2π)|²)
//! ```
//!
//! `r̃` is the rest sent backwards through the noise filter, so that no wave needs to go forwards through it, and `H` the
//! filter's response at the frequency that the wave has at the speed `v` of the row. The sum over rows is a Fourier
//! transform once rows are gathered by their place: one transform tells every wavelength. It is a first look; what it
//! points to is then fitted as every other cause.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use simulation::mechanism::{Definition, Form, Search};

use crate::bench::{Bench, Fit, Source};

/// Most places that rows are gathered in; a million would tell waves of micrometres along a metre.
const MOST_BINS: usize = 1 << 18;

/// Places per wave: fewer blur it.
const PER_WAVE: f64 = 6.0;

/// The transform is taken over this many times the stroke, so that a peak does not fall between two of its numbers.
const PADDED: f64 = 4.0;

/// Speeds of which the response of the noise filter is taken: the slowest, m/s, how many an octave, and how many.
const SLOWEST: f64 = 1e-4;
const PER_OCTAVE: f64 = 2.0;
const SPEEDS: usize = 30;

/// Peaks that are pointed out.
const PEAKS: usize = 2;

/// Whether a form is a wave along the rail and has no other shape.
pub(crate) fn is_wave(form: &Form) -> bool {
    form.shape.len() == 1 && form.shape[0].search == Search::Wave
}

/// Both ends of the stroke that is compared, m; the first one lies beyond the second where there is none.
pub(crate) fn span(bench: &Bench<'_>) -> (f64, f64) {
    let mut compared = bench.compared.iter();
    let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
    for context in bench.contexts {
        for (x, compared) in context.motion.position_m.iter().zip(&mut compared) {
            if *compared && x.is_finite() {
                ends = (ends.0.min(*x), ends.1.max(*x));
            }
        }
    }
    ends
}

/// Wavelengths within a form's range that differ: what a search among them has tried.
pub(crate) fn tried(form: &Form, span_m: f64) -> usize {
    let parameter = &form.shape[0];
    (2.0 * span_m * (1.0 / parameter.from - 1.0 / parameter.to)).clamp(1.0, 1e6) as usize
}

/// What a fit leaves, ready for a transform.
pub(crate) struct Left {
    /// Backwards through the noise filter, one entry a row of all runs.
    rest: Vec<f64>,
    /// Squared weight of every row.
    power: Vec<f64>,
    /// Squared response of the noise filter, over the root of the frequency.
    response: Vec<f64>,
    ends_m: (f64, f64),
}

/// Entries of the response, from rest to half the sampling rate.
const RESPONSES: usize = 256;

impl Left {
    pub(crate) fn of(bench: &Bench<'_>, fit: &Fit) -> Self {
        let frequency = |n: usize| 0.5 * (n as f64 / (RESPONSES - 1) as f64).powi(2);
        Left {
            rest: bench.rows.backwards(&bench.rest(fit)),
            power: bench.rows.power_weights(),
            response: (0..RESPONSES).map(|n| bench.rows.response(frequency(n))).collect(),
            ends_m: span(bench),
        }
    }

    /// At a frequency of the sampling rate; those above half of it are seen as those below.
    fn response(&self, frequency: f64) -> f64 {
        let seen = (frequency - frequency.round()).abs();
        let at = ((2.0 * seen).sqrt() * (RESPONSES - 1) as f64) as usize;
        self.response[at.min(RESPONSES - 1)]
    }

    /// Wavelengths of a form that explain most of what is left, the best first.
    pub(crate) fn peaks(&self, bench: &Bench<'_>, definition: &'static Definition, form: usize) -> Vec<f64> {
        let shape = &definition.forms[form].shape[0];
        let (low, high) = self.ends_m;
        let span = high - low;
        if !(span > 2.0 * shape.from) {
            return Vec::new();
        }
        // a wave without end: its cosine is the carrier
        let endless = Source::Mechanism { definition, form, shape: vec![1e12] };
        let Some(columns) = bench.raw(&endless) else { return Vec::new() };
        // orders of one wave share its carrier
        let mut carriers: Vec<Vec<f64>> = columns.into_iter().skip(1).step_by(2).collect();
        carriers.dedup();
        carriers.retain(|carrier| carrier.iter().any(|x| *x != 0.0));
        if carriers.is_empty() {
            return Vec::new();
        }
        let bins = (PER_WAVE * PADDED * span / shape.from).clamp(64.0, MOST_BINS as f64) as usize;
        let bins = bins.next_power_of_two();
        let length = PADDED * span;
        let gathered: Vec<_> = carriers.iter().map(|carrier| self.gathered(bench, carrier, bins, length)).collect();
        let gain = |k: usize| -> f64 {
            let per_row = bench.step_s * k as f64 / length;
            let of = |(sums, powers): &(Vec<Complex<f64>>, Vec<(f64, f64)>)| {
                let size: f64 = powers.iter().map(|(speed, power)| power * self.response(speed * per_row)).sum();
                if size > 0.0 { sums[k].norm_sqr() / size } else { 0.0 }
            };
            gathered.iter().map(of).sum()
        };
        let first = ((length / shape.to).ceil() as usize).max(1);
        let last = ((length / shape.from) as usize).min(bins * 4 / 10);
        let gains: Vec<f64> = (first..=last).map(gain).collect();
        let mut peaks: Vec<usize> = Vec::new();
        for _ in 0..PEAKS {
            let apart = |k: usize| peaks.iter().all(|peak| k.abs_diff(*peak) > 2 * PADDED as usize);
            let best = (0..gains.len()).filter(|k| apart(*k)).max_by(|a, b| gains[*a].total_cmp(&gains[*b]));
            peaks.extend(best.filter(|k| gains[*k] > 1.0));
        }
        peaks.into_iter().map(|k| (length / (first + k) as f64).clamp(shape.from, shape.to)).collect()
    }

    /// Transform of the rest times the carrier over the place, and the power of the carrier at every speed, m/s.
    fn gathered(
        &self,
        bench: &Bench<'_>,
        carrier: &[f64],
        bins: usize,
        length: f64,
    ) -> (Vec<Complex<f64>>, Vec<(f64, f64)>) {
        let mut sums = vec![Complex::new(0.0, 0.0); bins];
        let mut powers: Vec<(f64, f64)> =
            (0..SPEEDS).map(|n| (SLOWEST * ((n as f64 + 0.5) / PER_OCTAVE).exp2(), 0.0)).collect();
        let motions = bench.contexts.iter().flat_map(|c| c.motion.position_m.iter().zip(&c.motion.velocity_m_s));
        for (row, (x, v)) in motions.enumerate() {
            if !(self.power[row] > 0.0 && x.is_finite()) {
                continue;
            }
            let bin = ((x - self.ends_m.0) / length * bins as f64) as usize;
            sums[bin.min(bins - 1)].re += self.rest[row] * carrier[row];
            let speed = ((v.abs() / SLOWEST).max(1.0).log2() * PER_OCTAVE) as usize;
            powers[speed.min(SPEEDS - 1)].1 += carrier[row] * carrier[row] * self.power[row];
        }
        powers.retain(|(_, power)| *power > 0.0);
        FftPlanner::new().plan_fft_forward(bins).process(&mut sums);
        (sums, powers)
    }
}
