//! Periods in time at which a rest repeats: what another machine does on its own clock.
//!
//! As [`crate::fit::spectrum`] does for waves along the rail, one Fourier transform over the time tells every period. A clock's
//! force has edges, so that its first orders are taken together.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use simulation::mechanism::Context;
use simulation::run::{Part, Run};

use crate::fit::bench::{Bench, Candidate, Fit};
use crate::fit::source::Source;
use crate::fit::story::{Carrier, Curve};
use crate::numbers::peaks::peaks;

/// Shortest period, s, where the transform has room for it.
const SHORTEST_S: f64 = 0.5;

/// Periods that a recording must show, and the longest of its parts without a break: what comes once in every part is as
/// likely to belong to the part.
const PERIODS: f64 = 5.0;
const PERIODS_OF_PART: f64 = 2.0;

/// Orders that are taken together.
const ORDERS: usize = 3;

/// Places of the transform a second, and how often the recording fits into it.
const PER_S: f64 = 4.0 * ORDERS as f64 / SHORTEST_S;
const PADDED: f64 = 4.0;

/// Most places: along a recording of many hours the shortest period is a longer one.
const MOST_BINS: usize = 1 << 20;

/// Peaks that are pointed out for every carrier.
const PEAKS: usize = 2;

/// Clocks whose frequency is refined, and what they must explain for that, nats: a third of what a curve with so many
/// knots costs.
const REFINED: usize = 2;
const WORTH_REFINING: f64 = 25.0;

/// Squared rise that a peak must promise to be pointed out: far less than what a curve costs, more than noise shows.
const LEAST_GAIN: f64 = 40.0;

/// Carriers of what may repeat.
const CARRIERS: [Carrier; 3] = [Carrier::Odd, Carrier::Drag, Carrier::Even];

/// Clocks that what a fit leaves points to, refined, and the number of periods that were looked at.
pub(crate) fn clocks(bench: &Bench<'_>, fit: &Fit) -> (Vec<Candidate>, usize) {
    let times = || bench.contexts.iter().flat_map(|context| &context.run.time_s);
    let power = bench.rows.power_weights();
    let ends = times().zip(&power).filter(|(t, power)| **power > 0.0 && t.is_finite()).map(|(t, _)| *t);
    let (start, end) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    let span = end - start;
    if !(span > 2.0 * PERIODS * SHORTEST_S) {
        return (Vec::new(), 1);
    }
    let per_s = PER_S.min(MOST_BINS as f64 / (PADDED * span));
    let shortest_s = SHORTEST_S * PER_S / per_s;
    let bins = ((per_s * PADDED * span) as usize).next_power_of_two();
    let padded_s = bins as f64 / per_s;
    let rest = bench.rows.backwards(&bench.rest(fit));
    let longest_s = (span / PERIODS).min(longest_part_s(bench) / PERIODS_OF_PART);
    let (first, last) = ((padded_s / longest_s).ceil() as usize, (padded_s / shortest_s) as usize);
    if !(longest_s > shortest_s) {
        return (Vec::new(), 1);
    }
    let transform = FftPlanner::new().plan_fft_forward(bins);
    let mut found: Vec<Clock> = Vec::new();
    for carrier in CARRIERS {
        let of_run = |context: &Context<'_>| (0..context.run.len()).map(|n| carrier.of(context, n)).collect::<Vec<_>>();
        let weight: Vec<f64> = bench.contexts.iter().flat_map(of_run).collect();
        let mut sums = vec![Complex::new(0.0, 0.0); bins];
        for (row, t) in times().enumerate().filter(|(row, t)| power[*row] > 0.0 && t.is_finite()) {
            sums[(((t - start) * per_s) as usize).min(bins - 1)].re += rest[row] * weight[row];
        }
        transform.process(&mut sums);
        let own: f64 = weight.iter().zip(&power).map(|(weight, power)| weight * weight * power).sum();
        let gain = |k: usize| {
            let response = bench.rows.response(k as f64 / padded_s * bench.step_s);
            if response > 0.0 && own > 0.0 { sums[k].norm_sqr() / (0.5 * own * response) } else { 0.0 }
        };
        let together: Vec<f64> = (first..last).map(|k| (1..=ORDERS).map(|order| gain(order * k)).sum()).collect();
        let highest = peaks(&together, PEAKS, 2 * PADDED as usize, LEAST_GAIN);
        let near = |k: usize| Clock::at(bench, fit, (first + k) as f64 / padded_s, carrier);
        found.extend(highest.into_iter().filter_map(near));
    }
    found.sort_by(|a, b| b.nats.total_cmp(&a.nats));
    for clock in found.iter_mut().take(REFINED).filter(|clock| clock.nats > WORTH_REFINING) {
        clock.refine(bench, fit, span);
    }
    let clocks = found.into_iter().map(|clock| clock.candidate).collect();
    (clocks, CARRIERS.len() * (last - first) / PADDED as usize)
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
        let mut candidate = bench.candidate(Source::Story { curve: Curve::clock(1.0 / hz, carrier) })?;
        bench.prepare(&mut candidate, &fit.active);
        let nats = bench.gain(&candidate, fit).nats;
        Some(Clock { hz, carrier, candidate, nats })
    }

    /// Moves to the frequency near it that explains most: edges ask for it more finely than the spectrum tells it.
    fn refine(&mut self, bench: &Bench<'_>, fit: &Fit, span_s: f64) {
        let mut step = 0.25 / span_s;
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
