//! The ends of a force channel: a force that exceeds them stays at exactly that value.

use crate::noise::third_differences;
use crate::numbers::rounding::quantum;
use crate::numbers::statistics::robust_sigma;
use crate::recording::sanity::extremes;

/// Fewest rows at exactly the end of a channel that are no coincidence.
const ON_THE_EDGE: usize = 8;

/// Noise, relative to the range, below which a force has none: every sensor has more.
const WITHOUT_NOISE: f64 = 1e-6;

/// Shares of rows whose value the next row has, too: below the first in a channel whose noise exceeds its quantisation
/// step (two in five at the centre of a normal of one step's spread), from the second on at an end.
const SELDOM: f64 = 0.4;
const MOSTLY: f64 = 0.75;

/// Forces at which the channel saturates, N: many more rows lie at exactly that value than close to it.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChannelEnds(Vec<f64>);

impl ChannelEnds {
    pub(crate) fn of(x: &[f64]) -> Self {
        let (low, high) = extremes(x);
        // a force without noise has plateaus of its own: constant speed, constant friction
        let between = |x: &f64| *x > low && *x < high;
        let stretches = x.chunk_by(|a, b| between(a) && between(b));
        let noise: Vec<f64> = stretches.flat_map(third_differences).collect();
        if !(robust_sigma(&noise) > WITHOUT_NOISE * (high - low)) {
            return ChannelEnds::default();
        }
        let step = quantum(x).unwrap_or(0.0);
        // a coarsely quantised channel repeats values between the ends as well, and one that holds its samples every one
        let leaves = robust_sigma(&noise) > step && staying(x, between) < SELDOM;
        let often = most_often(x, low, high);
        let width = 0.002 * (high - low) + step;
        let is_end = |edge: &f64| {
            let on = x.iter().filter(|x| *x == edge).count();
            let beside = x.iter().filter(|x| *x != edge && (*x - edge).abs() <= width).count();
            on >= ON_THE_EDGE && on > 3 * beside && (on > 3 * often || leaves && staying(x, |x| x == edge) >= MOSTLY)
        };
        ChannelEnds([low, high].into_iter().filter(is_end).collect())
    }

    /// Whether a force lies at one of them.
    pub(crate) fn has(&self, force_n: f64) -> bool {
        self.0.contains(&force_n)
    }

    /// The smaller magnitude of the two, N.
    pub(crate) fn limit_n(&self) -> Option<f64> {
        self.0.iter().map(|end| end.abs()).min_by(f64::total_cmp)
    }
}

/// Share of the rows there whose value the next row has, too.
fn staying(x: &[f64], is_there: impl Fn(&f64) -> bool) -> f64 {
    let there = x.windows(2).filter(|pair| is_there(&pair[0]));
    let (count, stayed) =
        there.fold((0usize, 0usize), |(count, stayed), pair| (count + 1, stayed + usize::from(pair[0] == pair[1])));
    stayed as f64 / count.max(1) as f64
}

/// Number of occurrences of the most frequent value between both ends.
fn most_often(x: &[f64], low: f64, high: f64) -> usize {
    let mut between: Vec<f64> = x.iter().copied().filter(|x| *x > low && *x < high).collect();
    between.sort_unstable_by(f64::total_cmp);
    between.chunk_by(|a, b| a == b).map(<[f64]>::len).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clipped_force_has_an_end_and_the_plateau_of_one_without_noise_is_none() {
        // forth and back at constant speed: a trapezium, its tops flat
        let forth_and_back: Vec<f64> =
            (0..8000).map(|n| (f64::from(n) * 0.004).sin() * 30.0).map(|x| x.clamp(-8.0, 8.0)).collect();
        assert!(ChannelEnds::of(&forth_and_back).0.is_empty());
        let mut noise = simulation::sensor::Noise::new(1, 0);
        let clipped: Vec<f64> =
            forth_and_back.iter().map(|x| (x * 1.25 + 0.1 * noise.gaussian()).clamp(-8.0, 8.0)).collect();
        assert_eq!(ChannelEnds::of(&clipped).0, [-8.0, 8.0]);
        // a peak of the inertial force that ends in a channel of 0.05 N steps, whose values repeat at constant speed
        let rounded = |x: f64| (x / 0.05).round() * 0.05;
        let peaks: Vec<f64> = (0..8000)
            .map(|n| if n % 1000 < 8 { 20.0 } else { 8.0 } + 0.1 * noise.gaussian())
            .map(|x| rounded(x.min(15.0)))
            .collect();
        assert_eq!(ChannelEnds::of(&peaks).0, [rounded(15.0)]);
        // samples that are held for ten rows: the highest stays as long as any other
        let held: Vec<f64> = (0..800).flat_map(|_| [rounded(8.0 + noise.gaussian()); 10]).collect();
        assert!(ChannelEnds::of(&held).0.is_empty());
        // the same peaks in a channel that reaches higher
        let free: Vec<f64> =
            (0..8000).map(|n| rounded(if n % 1000 < 8 { 20.0 } else { 8.0 } + 0.1 * noise.gaussian())).collect();
        assert!(ChannelEnds::of(&free).0.is_empty());
    }
}
