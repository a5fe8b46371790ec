//! Clocks: periods in time at which the residual repeats, such as another machine's own cycle.
//!
//! As [`crate::fit::spectrum`] does for waves along the rail, one Fourier transform over time examines every period. A
//! wave `g(t)·e^{iωt}` with the carrier `g` lowers the squared residual `r` by
//!
//! ```text
//! |Σ r̃ g e^{-iωt}|²/|H(g cos ωt)|²
//! ```
//!
//! `r̃` is the residual filtered backwards through the noise filter `H`. The wave's size behind the filter is computed
//! at a few frequencies: a carrier that changes sign with the motion shifts a slow wave to frequencies that the filter
//! passes better, which the filter's response alone does not tell. A clock's force has edges, so its orders are summed.

use std::sync::Arc;

use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use simulation::curve::Carrier;
use simulation::mechanism::Context;
use simulation::run::{Part, Run};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::Candidate;
use crate::fit::source::Source;
use crate::fit::story;
use crate::numbers::peaks::peaks;

/// Shortest period, s, where the transform is long enough for it.
const SHORTEST_S: f64 = 0.5;

/// Least number of periods in the recording, and in its longest part without a break: what comes once per part is as
/// likely to belong to the part.
const PERIODS: f64 = 5.0;
const PERIODS_OF_PART: f64 = 1.5;

/// Orders that are summed: a clock's slow part is hidden in slow noise, its edges are not.
const ORDERS: usize = 8;

/// Samples of the transform per second, and its zero-padding factor.
const PER_S: f64 = 3.0 * ORDERS as f64 / SHORTEST_S;
const PADDED: f64 = 2.0;

/// Most bins: in a recording of many hours this lengthens the shortest period.
const MOST_BINS: usize = 1 << 20;

/// Most peaks pointed out per carrier.
const PEAKS: usize = 3;

/// Most clocks whose frequency is refined, and the least a clock must explain for that, nats: a third of what a curve
/// with so many knots costs.
const REFINED: usize = 2;
const WORTH_REFINING: f64 = 25.0;

/// Squared residual that a peak must promise to remove: far less than what a curve costs, more than noise shows.
const LEAST_GAIN: f64 = 40.0;

/// Bins to either side of a peak that belong to its flank.
const FLANK: usize = PADDED as usize * ORDERS;

/// Factor for a fit that imitates three quarters of a clock: its residual then shows only a quarter of what the clock
/// explains.
const IMITATED: f64 = 4.0;

/// Carriers of periodic effects.
const CARRIERS: [Carrier; 3] = [Carrier::Odd, Carrier::Drag, Carrier::Even];

/// Number of frequencies at which the size of waves is computed.
const SIZES: usize = 8;

/// The periods that a recording may show, and the size of a wave of each behind the noise filter.
pub(crate) struct Clocks {
    start_s: f64,
    span_s: f64,
    transform: Arc<dyn Fft<f64>>,
    bins: usize,
    per_s: f64,
    /// Frequencies examined, in steps of [`Clocks::step_hz`]: the lowest, and one beyond the highest.
    first: usize,
    last: usize,
    waves: Vec<Waves>,
}

/// Waves on one carrier.
struct Waves {
    carrier: Carrier,
    /// The carrier's value; one entry per row of all runs.
    weight: Vec<f64>,
    /// Logarithm of the squared size of a unit wave behind the noise filter, at frequencies in geometric steps.
    ln_sizes: Vec<f64>,
}

/// By how much waves would lower the squared whitened residual of a fit: twice their promised nats.
struct Heard {
    /// By a wave in each bin of the transform.
    gains: Vec<f64>,
    /// By all orders together of each examined frequency.
    together: Vec<f64>,
}

impl Heard {
    /// The largest reduction around an examined frequency.
    fn near(&self, j: usize) -> f64 {
        let around = j.saturating_sub(FLANK)..self.together.len().min(j + FLANK + 1);
        self.together[around].iter().fold(0.0, |most, x| x.max(most))
    }
}

/// The reduction by one order of an examined frequency.
fn of_order(gains: &[f64], j: usize, order: usize) -> f64 {
    gains.get((order * j + ORDERS / 2) / ORDERS).copied().unwrap_or(0.0)
}

impl Clocks {
    /// `None` where the recording is too short for any.
    pub(crate) fn new(bench: &Bench<'_>) -> Option<Self> {
        let power = bench.rows.power_weights();
        let ends = times(bench).zip(&power).filter(|(t, power)| **power > 0.0 && t.is_finite()).map(|(t, _)| t);
        let (start_s, end) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        let span_s = end - start_s;
        if !(span_s > 2.0 * PERIODS * SHORTEST_S) {
            return None;
        }
        let per_s = PER_S.min(MOST_BINS as f64 / (PADDED * span_s));
        let shortest_s = SHORTEST_S * PER_S / per_s;
        let longest_s = (span_s / PERIODS).min(longest_part_s(bench) / PERIODS_OF_PART);
        if !(longest_s > shortest_s) {
            return None;
        }
        let bins = ((per_s * PADDED * span_s) as usize).next_power_of_two();
        let transform = FftPlanner::new().plan_fft_forward(bins);
        let mut clocks = Clocks { start_s, span_s, transform, bins, per_s, first: 0, last: 0, waves: Vec::new() };
        clocks.first = (1.0 / longest_s / clocks.step_hz()).ceil() as usize;
        clocks.last = (1.0 / shortest_s / clocks.step_hz()) as usize;
        let wave = |n: usize| -> Vec<f64> {
            let omega = std::f64::consts::TAU * clocks.of_size(n);
            times(bench).map(|t| if t.is_finite() { (omega * (t - start_s)).sin() } else { 0.0 }).collect()
        };
        let bare: Vec<Vec<f64>> = (0..SIZES).map(wave).collect();
        clocks.waves = CARRIERS.par_iter().map(|carrier| Waves::of(bench, *carrier, &bare)).collect();
        Some(clocks)
    }

    /// Number of independent periods that are examined.
    pub(crate) fn tried(&self) -> usize {
        CARRIERS.len() * (self.last - self.first) / PADDED as usize
    }

    /// What the freedom of one clock costs, nats.
    pub(crate) fn cost(bench: &Bench<'_>) -> f64 {
        0.5 * story::CLOCK_KNOTS as f64 * bench.ln_rows()
    }

    /// Clocks that the residuals of `fits` point to, refined. A clock must be able to explain `least` nats beyond the
    /// first fit, and so must show in that fit's residual, too.
    pub(crate) fn pointed_out(&self, bench: &Bench<'_>, fits: &[&Fit], least: f64) -> Vec<Candidate> {
        let mut beyond_first: Option<Vec<Heard>> = None;
        let mut candidates = Vec::new();
        for fit in fits {
            let heard = self.heard(bench, fit);
            let first = beyond_first.as_ref().unwrap_or(&heard);
            let mut found: Vec<Clock> = Vec::new();
            for ((waves, heard), first) in self.waves.iter().zip(&heard).zip(first) {
                let shows = |j: &usize| 0.5 * IMITATED * first.near(*j) > least;
                let highest = peaks(&heard.together, PEAKS, FLANK, LEAST_GAIN);
                let near = |j: usize| self.near(bench, fit, waves.carrier, (self.first + j, heard));
                let shown: Vec<usize> = highest.into_iter().filter(shows).collect();
                found.par_extend(shown.into_par_iter().filter_map(near));
            }
            found.sort_by(|a, b| b.nats.total_cmp(&a.nats));
            found
                .par_iter_mut()
                .take(REFINED)
                .filter(|clock| clock.nats > WORTH_REFINING)
                .for_each(|clock| clock.refine(bench, fit, self.span_s));
            candidates.extend(found.into_iter().map(|clock| clock.candidate));
            beyond_first.get_or_insert(heard);
        }
        candidates
    }

    /// Reductions of a fit's residual over all periods, for every carrier.
    fn heard(&self, bench: &Bench<'_>, fit: &Fit) -> Vec<Heard> {
        let power = bench.rows.power_weights();
        let rest = bench.rows.backwards(&bench.rest(fit));
        let of = |waves: &Waves| {
            let mut sums = vec![Complex::new(0.0, 0.0); self.bins];
            for (row, t) in times(bench).enumerate().filter(|(row, t)| power[*row] > 0.0 && t.is_finite()) {
                sums[(((t - self.start_s) * self.per_s) as usize).min(self.bins - 1)].re +=
                    rest[row] * waves.weight[row];
            }
            self.transform.process(&mut sums);
            let gains: Vec<f64> =
                sums[..self.bins / 2].iter().enumerate().map(|(k, sum)| sum.norm_sqr() / self.size(waves, k)).collect();
            let all_orders = |j: usize| (1..=ORDERS).map(|order| of_order(&gains, j, order)).sum();
            Heard { together: (self.first..self.last).map(all_orders).collect(), gains }
        };
        self.waves.par_iter().map(of).collect()
    }

    /// The clock at frequency index `j`, or at its strongest order, whichever explains more: what repeats after a
    /// period also repeats after several.
    fn near(&self, bench: &Bench<'_>, fit: &Fit, carrier: Carrier, (j, heard): (usize, &Heard)) -> Option<Clock> {
        let gain = |order: &usize| of_order(&heard.gains, j, *order);
        let strongest = (1..=ORDERS).max_by(|a, b| gain(a).total_cmp(&gain(b))).filter(|order| *order > 1);
        std::iter::once(1)
            .chain(strongest)
            .filter_map(|order| Clock::at(bench, fit, (order * j) as f64 * self.step_hz(), carrier))
            .max_by(|a, b| a.nats.total_cmp(&b.nats))
    }

    /// Step of the frequencies examined, Hz: fine enough for the highest order, which determines a period best.
    fn step_hz(&self) -> f64 {
        self.per_s / (self.bins * ORDERS) as f64
    }

    /// Frequency of the `n`th computed size, Hz.
    fn of_size(&self, n: usize) -> f64 {
        let (low, high) = (self.first as f64, (self.last * ORDERS) as f64);
        low * (high / low).powf(n as f64 / (SIZES - 1) as f64) * self.step_hz()
    }

    /// Squared size of a unit wave in a bin of the transform, mean over its phases.
    fn size(&self, waves: &Waves, bin: usize) -> f64 {
        let steps = (bin * ORDERS) as f64 / self.first as f64;
        let steps = steps.ln() / ((self.last * ORDERS) as f64 / self.first as f64).ln() * (SIZES - 1) as f64;
        let steps = steps.clamp(0.0, (SIZES - 1) as f64 - 1e-9);
        let (low, share) = (steps as usize, steps.fract());
        ((1.0 - share) * waves.ln_sizes[low] + share * waves.ln_sizes[low + 1]).exp()
    }
}

impl Waves {
    /// Applies a carrier to bare waves, given in the order of their frequencies.
    fn of(bench: &Bench<'_>, carrier: Carrier, bare: &[Vec<f64>]) -> Self {
        let of_run = |context: &Context<'_>| (0..context.run.len()).map(|n| carrier.of(context, n)).collect::<Vec<_>>();
        let weight: Vec<f64> = bench.contexts.iter().flat_map(of_run).collect();
        let carried: Vec<Vec<f64>> =
            bare.iter().map(|wave| wave.iter().zip(&weight).map(|(x, weight)| x * weight).collect()).collect();
        let white = bench.rows.white_all(&carried.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let square = |x: &Vec<f32>| x.iter().map(|x| f64::from(*x) * f64::from(*x)).sum::<f64>();
        // a carrier that is zero throughout has no size, and no residual lies along it
        let ln_sizes = white.iter().map(|x| square(x).max(f64::MIN_POSITIVE).ln()).collect();
        Waves { carrier, weight, ln_sizes }
    }
}

/// Time of every row of all runs, s.
fn times(bench: &Bench<'_>) -> impl Iterator<Item = f64> {
    bench.contexts.iter().flat_map(|context| context.run.time_s.iter().copied())
}

/// Length of the longest part of a run without a break, s.
fn longest_part_s(bench: &Bench<'_>) -> f64 {
    let runs = bench.contexts.iter().map(|context| context.run);
    let length = |run: &Run, part: &Part| run.time_s[part.rows.end - 1] - run.time_s[part.rows.start];
    let parts =
        runs.flat_map(|run| run.parts.iter().filter(|part| !part.rows.is_empty()).map(|part| length(run, part)));
    parts.fold(0.0, f64::max)
}

/// A clock and what it explains beyond a fit.
struct Clock {
    hz: f64,
    carrier: Carrier,
    candidate: Candidate,
    nats: f64,
}

impl Clock {
    fn at(bench: &Bench<'_>, fit: &Fit, hz: f64, carrier: Carrier) -> Option<Self> {
        let mut candidate = bench.candidate(Source::Story { curve: story::clock(1.0 / hz, carrier) })?;
        bench.prepare(&mut candidate, &fit.active);
        let nats = bench.gain(&candidate, fit).nats;
        Some(Clock { hz, carrier, candidate, nats })
    }

    /// Moves to the best frequency nearby: edges need a finer frequency than the spectrum resolves.
    fn refine(&mut self, bench: &Bench<'_>, fit: &Fit, span_s: f64) {
        let mut step = 0.125 / span_s;
        for _ in 0..4 {
            for side in [-1.0, 1.0] {
                if let Some(other) = Clock::at(bench, fit, self.hz + side * step, self.carrier)
                    && other.nats > self.nats
                {
                    *self = other;
                    break;
                }
            }
            step *= 0.5;
        }
    }
}
