//! Spectrum over place: wavelengths along the rail at which the residual repeats.
//!
//! A wave `g(t)·e^{ikx(t)}` with the carrier `g` lowers the squared residual `r` by
//!
//! ```text
//! |Σ r̃ g e^{-ikx}|² · 2/(Σ g² |H(kv/2π)|²)
//! ```
//!
//! `r̃` is the residual filtered backwards through the noise filter, so that no wave needs to be filtered forwards, and
//! `H` is the filter's response at the frequency that the wave has at the row's speed `v`. With rows gathered by place,
//! the sum becomes a Fourier transform: one transform examines every wavelength. It is a first look; the waves it
//! points to are then fitted like every other cause.

use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use simulation::mechanism::{Definition, Form, Search};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::source::Source;
use crate::numbers::peaks::peaks;

/// Most bins of place; a million would resolve waves of micrometres along a metre.
const MOST_BINS: usize = 1 << 18;

/// Bins per wave: fewer blur it.
const PER_WAVE: f64 = 6.0;

/// Zero padding of the transform, as a multiple of the stroke, so that a peak does not fall between two bins.
const PADDED: f64 = 4.0;

/// Grid of speeds for the noise filter's response: the slowest, m/s, how many per octave, and how many in all.
const SLOWEST: f64 = 1e-4;
const PER_OCTAVE: f64 = 2.0;
const SPEEDS: usize = 30;

/// Most peaks pointed out.
const PEAKS: usize = 2;

/// Whether a form is a wave along the rail without other shape parameters.
pub(crate) fn is_wave(form: &Form) -> bool {
    form.shape.len() == 1 && form.shape[0].search == Search::Wave
}

/// Wavelength of a cause that is a wave, m; `None` for others.
pub(crate) fn wavelength_m(source: &Source) -> Option<f64> {
    match source {
        Source::Mechanism { definition, form, shape } if is_wave(&definition.forms[*form]) => shape.first().copied(),
        _ => None,
    }
}

/// Both ends of the compared stroke, m; the first lies beyond the second where there is none.
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

/// Number of independent wavelengths within a form's range: the trials of a search among them.
pub(crate) fn tried(form: &Form, span_m: f64) -> usize {
    let parameter = &form.shape[0];
    (2.0 * span_m * (1.0 / parameter.from - 1.0 / parameter.to)).clamp(1.0, 1e6) as usize
}

/// Residual of a fit, prepared for transforms.
pub(crate) struct Left {
    /// Residual filtered backwards through the noise filter; one entry per row of all runs.
    rest: Vec<f64>,
    /// Squared weight of every row.
    power: Vec<f64>,
    /// Squared response of the noise filter on a grid of the square root of frequency.
    response: Vec<f64>,
    ends_m: (f64, f64),
}

/// Entries of the response, from frequency 0 to half the sampling rate.
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

    /// Squared response at a frequency, as a fraction of the sampling rate; frequencies above half of it are aliased.
    fn response(&self, frequency: f64) -> f64 {
        let seen = (frequency - frequency.round()).abs();
        let at = ((2.0 * seen).sqrt() * (RESPONSES - 1) as f64) as usize;
        self.response[at.min(RESPONSES - 1)]
    }

    /// Wavelengths at which waves explain most of the residual, the best first.
    pub(crate) fn peaks(&self, bench: &Bench<'_>, waves: &Waves) -> Vec<f64> {
        let mut gains = vec![0.0; waves.last.saturating_sub(waves.first)];
        for carrier in &waves.carriers {
            let sums = self.gathered(bench, carrier, waves);
            for (gain, (sum, size)) in gains.iter_mut().zip(sums[waves.first..].iter().zip(&carrier.sizes)) {
                *gain += if *size > 0.0 { sum.norm_sqr() / size } else { 0.0 };
            }
        }
        let found = peaks(&gains, PEAKS, 2 * PADDED as usize, LEAST_GAIN);
        found.into_iter().map(|k| waves.length(waves.first + k)).collect()
    }

    /// Transform of residual times carrier over place.
    fn gathered(&self, bench: &Bench<'_>, carrier: &Carrier, waves: &Waves) -> Vec<Complex<f64>> {
        let mut sums = vec![Complex::new(0.0, 0.0); waves.bins];
        let per_m = waves.bins as f64 / waves.padded_m;
        let positions = bench.contexts.iter().flat_map(|context| &context.motion.position_m);
        for (row, x) in positions.enumerate().filter(|(row, x)| self.power[*row] > 0.0 && x.is_finite()) {
            let bin = ((x - self.ends_m.0) * per_m) as usize;
            sums[bin.min(waves.bins - 1)].re += self.rest[row] * carrier.column[row];
        }
        waves.transform.process(&mut sums);
        sums
    }
}

/// Squared residual that a peak must promise to remove: half of what the cheapest wave costs.
const LEAST_GAIN: f64 = 16.0;

/// Waves of a form: what does not depend on the residual to be explained.
pub(crate) struct Waves {
    carriers: Vec<Carrier>,
    bins: usize,
    /// Transform over that many bins.
    transform: Arc<dyn Fft<f64>>,
    /// Padded length of the transform, m.
    padded_m: f64,
    /// Number of waves along that length: the least, and one beyond the most.
    first: usize,
    last: usize,
    /// Shortest and longest wave, m.
    range_m: (f64, f64),
}

/// Factor of a wave that is not periodic.
struct Carrier {
    /// One entry per row of all runs.
    column: Vec<f64>,
    /// Half the squared size of a unit wave behind the noise filter, by number of waves from `first` on.
    sizes: Vec<f64>,
}

impl Waves {
    /// Waves of a form; without carriers where the stroke is too short.
    pub(crate) fn of(bench: &Bench<'_>, left: &Left, definition: &'static Definition, form: usize) -> Self {
        let shape = &definition.forms[form].shape[0];
        let span = left.ends_m.1 - left.ends_m.0;
        let places = if span > 2.0 * shape.from { PER_WAVE * PADDED * span / shape.from } else { 1.0 };
        let bins = (places.clamp(64.0, MOST_BINS as f64) as usize).next_power_of_two();
        let padded_m = PADDED * span;
        let mut waves = Waves {
            carriers: Vec::new(),
            bins,
            transform: FftPlanner::new().plan_fft_forward(bins),
            padded_m,
            first: ((padded_m / shape.to).ceil() as usize).max(1),
            last: ((padded_m / shape.from) as usize).min(bins * 4 / 10) + 1,
            range_m: (shape.from, shape.to),
        };
        if !(span > 2.0 * shape.from) {
            waves.last = waves.first;
            return waves;
        }
        // a wave of infinite length: its cosine is the carrier
        let endless = Source::Mechanism { definition, form, shape: vec![1e12] };
        // orders of one wave share its carrier
        let mut columns: Vec<Vec<f64>> =
            bench.raw(&endless).unwrap_or_default().into_iter().skip(1).step_by(2).collect();
        columns.dedup();
        columns.retain(|carrier| carrier.iter().any(|x| *x != 0.0));
        waves.carriers = columns
            .into_iter()
            .map(|column| {
                let powers = left.powers(bench, &column);
                let per_row = bench.step_s / waves.padded_m;
                let size = |k: usize| -> f64 {
                    let at = |speed: f64| left.response(speed * per_row * k as f64);
                    0.5 * powers.iter().map(|(speed, power)| power * at(*speed)).sum::<f64>()
                };
                Carrier { sizes: (waves.first..waves.last).map(size).collect(), column }
            })
            .collect();
        waves
    }

    fn length(&self, k: usize) -> f64 {
        (self.padded_m / k as f64).clamp(self.range_m.0, self.range_m.1)
    }
}

impl Left {
    /// Power of a carrier by speed, m/s.
    fn powers(&self, bench: &Bench<'_>, carrier: &[f64]) -> Vec<(f64, f64)> {
        let mut powers: Vec<(f64, f64)> =
            (0..SPEEDS).map(|n| (SLOWEST * ((n as f64 + 0.5) / PER_OCTAVE).exp2(), 0.0)).collect();
        let speeds = bench.contexts.iter().flat_map(|context| &context.motion.velocity_m_s);
        for (row, v) in speeds.enumerate().filter(|(row, _)| self.power[*row] > 0.0) {
            let speed = ((v.abs() / SLOWEST).max(1.0).log2() * PER_OCTAVE) as usize;
            powers[speed.min(SPEEDS - 1)].1 += carrier[row] * carrier[row] * self.power[row];
        }
        powers.retain(|(_, power)| *power > 0.0);
        powers
    }
}
