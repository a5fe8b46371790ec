//! Braking that comes for tenths of a second and goes, at times that nothing tells: a cage that jams, a clamp that
//! touches.
//!
//! Noise that is learnt from such a rest has its spectrum, and whitening hides it. In averages it stands out: nearly all
//! are as far from their median as noise is, a few are many times farther, and those brake.

use crate::beside::events::BUILT_UP_M;
use crate::numbers::statistics::{median, robust_sigma};
use crate::recording::side::Side;

/// Times that are averaged over, s.
const AVERAGED_S: [f64; 3] = [0.1, 0.2, 0.4];

/// Fewest rows of an average: those of noise with tails have none any more.
const FEWEST_ROWS: usize = 8;

/// Fewest averages of a part from which its scale is told.
const FEWEST: usize = 12;

/// Distance from the median, over the scale of averages, of one that stands out. None of 900 averages of Gaussian noise is
/// beyond 5, and a scale of few averages is off by a third.
const OUTSTANDING: f64 = 8.0;
const OUTSTANDING_OF_NOISE: f64 = 5.0;

/// Fewest bursts that brake, and how many they are to one that pushes.
const FEWEST_BURSTS: usize = 3;
const TO_ONE_THAT_PUSHES: usize = 4;

/// What bursts there are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bursts {
    /// Squared force, mean over all compared rows, N².
    pub(crate) power_n2: f64,
    /// p-value of so many by chance.
    pub(crate) p: f64,
}

/// Looks for bursts in what the law leaves; `left` has an entry a row of all runs.
pub(crate) fn bursts(side: &Side<'_>, left: &[f64]) -> Option<Bursts> {
    let (mut parts, mut start) = (Vec::new(), 0);
    for context in &side.contexts {
        let step_s = context.run.step_s().max(1e-9);
        for part in &context.run.parts {
            let braking = |n: usize| {
                let is_told = side.compared[start + n] && context.since_reversal_m[n] > BUILT_UP_M;
                let braking = context.steady.direction[n] * left[start + n];
                if is_told && context.steady.direction[n] != 0.0 { braking } else { f64::NAN }
            };
            parts.push((step_s, part.rows.clone().map(braking).collect::<Vec<f64>>()));
        }
        start += context.run.len();
    }
    let rows = side.compared.iter().filter(|compared| **compared).count();
    AVERAGED_S.iter().filter_map(|averaged_s| of_length(&parts, *averaged_s, rows)).min_by(|a, b| a.p.total_cmp(&b.p))
}

/// Those that last for about so long. `parts`: time between two rows, and the rows.
fn of_length(parts: &[(f64, Vec<f64>)], averaged_s: f64, rows: usize) -> Option<Bursts> {
    let (mut braking, mut pushing, mut averages, mut squares) = (0, 0, 0, 0.0);
    for (step_s, part) in parts {
        let width = ((averaged_s / step_s) as usize).max(FEWEST_ROWS);
        let Some(part) = Averages::of(part, width) else { continue };
        averages += part.from_median.iter().flatten().count();
        let bursts = part.bursts(1.0);
        braking += bursts.len();
        pushing += part.bursts(-1.0).len();
        squares += bursts.iter().flat_map(|burst| burst.iter().flatten()).map(|x| x * x * width as f64).sum::<f64>();
    }
    let expected = averages as f64 * 0.5 * libm::erfc(OUTSTANDING_OF_NOISE / std::f64::consts::SQRT_2);
    let by_chance = expected.powf(braking as f64) / libm::tgamma(braking as f64 + 1.0);
    (braking >= FEWEST_BURSTS && braking >= TO_ONE_THAT_PUSHES * pushing)
        .then(|| Bursts { power_n2: squares / rows.max(1) as f64, p: by_chance.min(1.0) })
}

/// Averages of one part.
struct Averages {
    /// From their median, N; `None` where half of one or more is not compared.
    from_median: Vec<Option<f64>>,
    /// Distance from which one stands out, N.
    outstanding_n: f64,
}

impl Averages {
    /// `None` where too few tell their scale.
    fn of(part: &[f64], width: usize) -> Option<Self> {
        let average = |rows: &[f64]| {
            let told: Vec<f64> = rows.iter().copied().filter(|x| x.is_finite()).collect();
            (2 * told.len() > width).then(|| told.iter().sum::<f64>() / told.len() as f64)
        };
        let averages: Vec<Option<f64>> = part.chunks_exact(width).map(average).collect();
        let mut told: Vec<f64> = averages.iter().flatten().copied().collect();
        let median = median(told.clone())?;
        told.iter_mut().for_each(|x| *x -= median);
        let scale = robust_sigma(&told);
        let rows: Vec<f64> = part.iter().filter(|x| x.is_finite()).map(|x| x - median).collect();
        // what is smaller than the noise of a row a bump of the rail or the remains of the law may be as well
        let outstanding_n = (OUTSTANDING * scale).max(robust_sigma(&rows));
        let from_median = averages.into_iter().map(|x| x.map(|x| x - median)).collect();
        (told.len() >= FEWEST && scale > 0.0).then_some(Averages { from_median, outstanding_n })
    }

    /// Neighbours that all stand out to this side, +1 for what brakes.
    fn bursts(&self, side: f64) -> Vec<&[Option<f64>]> {
        let stands_out = |x: &Option<f64>| x.is_some_and(|x| side * x > self.outstanding_n);
        self.from_median.chunk_by(|a, b| stands_out(a) == stands_out(b)).filter(|group| stands_out(&group[0])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise that remembers, normal by the sum of twelve.
    fn noise(rows: usize, memory: f64) -> Vec<f64> {
        let (mut state, mut x) = (5u64, 0.0);
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        (0..rows)
            .map(|_| {
                let new: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                x = memory * x + (1.0 - memory * memory).sqrt() * new;
                x
            })
            .collect()
    }

    #[test]
    fn bursts_stand_out_of_red_noise_and_red_noise_does_not() {
        let red = noise(20_000, 0.9);
        let parts = |x: &[f64]| x.chunks(4000).map(|part| (0.005, part.to_vec())).collect::<Vec<_>>();
        assert_eq!(of_length(&parts(&red), 0.2, 20_000), None);
        let jams = |n: usize| if n % 2900 > 2800 { 12.0 } else { 0.0 };
        let jammed: Vec<f64> = red.iter().enumerate().map(|(n, x)| x + jams(n)).collect();
        let found = of_length(&parts(&jammed), 0.2, 20_000).expect("they stand out");
        assert!(found.p < 1e-12 && (2.0..8.0).contains(&found.power_n2), "{found:?}");
        let shaken: Vec<f64> = red.iter().enumerate().map(|(n, x)| x + jams(n) - jams(n + 1450)).collect();
        assert_eq!(of_length(&parts(&shaken), 0.2, 20_000), None, "what pushes as often as it brakes");
    }
}
