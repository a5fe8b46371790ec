//! Braking that comes for tenths of a second and goes, at times that nothing tells: a cage that jams, a clamp that
//! touches.
//!
//! Noise that is learnt from such a rest has its spectrum, and whitening hides it. In averages it stands out: whatever the
//! noise remembers, nearly all of them are as far from those around them as noise is, a few are many times farther, and
//! those brake.

use crate::beside::events::BUILT_UP_M;
use crate::noise::locks::least_of;
use crate::numbers::statistics::{median, robust_sigma};
use crate::recording::side::Side;

/// Times that are averaged over, s.
const AVERAGED_S: [f64; 4] = [0.1, 0.2, 0.4, 0.8];

/// Averages that begin within the length of one: a burst that lies across two of them shows in a third.
const OVERLAP: usize = 4;

/// Averages to either side whose median one is held against, in lengths of one: what changes more slowly is no burst.
const AROUND: usize = 4;

/// Fewest rows of an average: those of noise with tails have none any more.
const FEWEST_ROWS: usize = 8;

/// Lengths of averages that a part must have for its scale to be told.
const FEWEST: usize = 12;

/// Distance from those around, over the scale of averages, of one that stands out. None of 900 averages of Gaussian noise is
/// beyond 5, and a scale of few averages is off by a sixth. Of 114 clean opened recordings (trial 11) none has more than one
/// that brakes beyond two for every one that pushes.
const OUTSTANDING: f64 = 6.0;
const OUTSTANDING_OF_NOISE: f64 = 5.0;

/// Distance from the middle of its part, over the scale of rows, beyond which a row counts as if it were there: one row that
/// noise with tails throws far is no braking that lasts.
const FARTHEST: f64 = 4.0;

/// The same, of [`OUTSTANDING`], of rows as they are, for an average that is half as far out without them: what is so high is one,
/// however little of its height counts. Two of them are enough.
const TOWERING: f64 = 3.0;
const FEWEST_TOWERING: usize = 2;

/// Part of that distance at which an average still lies in a burst.
const HALF: f64 = 0.5;

/// Fewest bursts that brake, and how many more for one that pushes.
const FEWEST_BURSTS: usize = 3;
const FOR_ONE_THAT_PUSHES: usize = 2;

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
    let found: Vec<Bursts> = AVERAGED_S.iter().filter_map(|averaged_s| of_length(&parts, *averaged_s, rows)).collect();
    // averages of about their length have most of their force
    let power_n2 = found.iter().map(|bursts| bursts.power_n2).fold(0.0, f64::max);
    let p = least_of(found.iter().map(|bursts| bursts.p));
    (!found.is_empty()).then_some(Bursts { power_n2, p })
}

/// Those that last for about so long. `parts`: time between two rows, and the rows.
fn of_length(parts: &[(f64, Vec<f64>)], averaged_s: f64, rows: usize) -> Option<Bursts> {
    let (mut braking, mut towering, mut pushing, mut averages, mut squares) = (0, 0, 0, 0, 0.0);
    for (step_s, part) in parts {
        let width = ((averaged_s / step_s).round() as usize).max(FEWEST_ROWS);
        let Some(part) = Averages::of(part, width) else { continue };
        averages += part.from_others.iter().flatten().count();
        braking += part.bursts(1.0);
        towering += part.towering(1.0);
        pushing += part.bursts(-1.0);
        squares += part.squares_n2(1.0);
    }
    let expected = averages as f64 * 0.5 * libm::erfc(OUTSTANDING_OF_NOISE / std::f64::consts::SQRT_2);
    let by_chance = expected.powf(braking as f64) / libm::tgamma(braking as f64 + 1.0);
    let are_enough =
        braking >= FEWEST_BURSTS + FOR_ONE_THAT_PUSHES * pushing || (towering >= FEWEST_TOWERING && pushing == 0);
    are_enough.then(|| Bursts { power_n2: squares / rows.max(1) as f64, p: by_chance.min(1.0) })
}

/// Averages of one part.
struct Averages {
    /// From the median of those around, N, of rows no farther than [`FARTHEST`]; `None` where half of one or more is not
    /// compared.
    from_others: Vec<Option<f64>>,
    /// The same of rows as they are.
    in_full: Vec<Option<f64>>,
    /// Rows from one to the next.
    step: usize,
    /// Distance from which one stands out, N.
    outstanding_n: f64,
}

impl Averages {
    /// `None` where too few tell their scale.
    fn of(part: &[f64], width: usize) -> Option<Self> {
        if part.len() < FEWEST * width {
            return None;
        }
        let average = |rows: &[f64]| {
            let (sum, told) =
                rows.iter().filter(|x| x.is_finite()).fold((0.0, 0), |(sum, told), x| (sum + x, told + 1));
            (2 * told > width).then(|| sum / told as f64)
        };
        let middle = median(part.iter().copied().filter(|x| x.is_finite()).collect())?;
        let rows: Vec<f64> = part.iter().filter(|x| x.is_finite()).map(|x| x - middle).collect();
        let scale_of_rows = robust_sigma(&rows);
        let farthest = FARTHEST * scale_of_rows;
        let clipped: Vec<f64> = part.iter().map(|x| x.clamp(middle - farthest, middle + farthest)).collect();
        let step = (width / OVERLAP).max(1);
        let reach = AROUND * width / step;
        let from_others = |rows: &[f64]| -> Vec<Option<f64>> {
            let averages: Vec<Option<f64>> = rows.windows(width).step_by(step).map(average).collect();
            let from_others = |at: usize| {
                let around = &averages[at.saturating_sub(reach)..(at + reach + 1).min(averages.len())];
                Some(averages[at]? - median(around.iter().flatten().copied().collect())?)
            };
            (0..averages.len()).map(from_others).collect()
        };
        let (in_full, from_others) = (from_others(part), from_others(&clipped));
        let told: Vec<f64> = from_others.iter().flatten().copied().collect();
        // what is smaller than the noise of a row a bump of the rail or the remains of the law may be as well
        let scale = robust_sigma(&told);
        let outstanding_n = (OUTSTANDING * scale).max(scale_of_rows);
        (told.len() * step >= FEWEST * width && scale > 0.0).then_some(Averages {
            from_others,
            in_full,
            step,
            outstanding_n,
        })
    }

    /// How many stand out to this side, +1 for what brakes. What begins within the length of an average is one.
    fn bursts(&self, side: f64) -> usize {
        self.count(|clipped, full| side * clipped > self.outstanding_n || self.towers(side, clipped, full))
    }

    /// How many of them tower.
    fn towering(&self, side: f64) -> usize {
        self.count(|clipped, full| self.towers(side, clipped, full))
    }

    fn towers(&self, side: f64, clipped: f64, full: f64) -> bool {
        side * clipped > HALF * self.outstanding_n && side * full > TOWERING * self.outstanding_n
    }

    fn count(&self, is_one: impl Fn(f64, f64) -> bool) -> usize {
        let told = |at: usize| Some((self.from_others[at]?, self.in_full[at]?));
        let stands = |at: &usize| told(*at).is_some_and(|(clipped, full)| is_one(clipped, full));
        let standing: Vec<usize> = (0..self.from_others.len()).filter(stands).collect();
        standing.chunk_by(|a, b| b - a <= OVERLAP).count()
    }

    /// Squared force of those to this side, summed over rows, N².
    fn squares_n2(&self, side: f64) -> f64 {
        // what lies across the end of one has a part of its force
        let lies_in = |(clipped, full): &(&Option<f64>, &Option<f64>)| {
            let is_beyond = |x: Option<f64>, share: f64| x.is_some_and(|x| side * x > share * self.outstanding_n);
            is_beyond(**clipped, HALF) && is_beyond(**full, 1.0)
        };
        let parts = self.from_others.iter().zip(&self.in_full).filter(lies_in);
        parts.filter_map(|(_, full)| *full).map(|x| x * x * self.step as f64).sum()
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
        assert_eq!(AVERAGED_S.map(|s| of_length(&parts(&red), s, 20_000)), [None; 4]);
        let jams = |n: usize| if n % 2900 > 2800 { 4.5 } else { 0.0 };
        let jammed: Vec<f64> = red.iter().enumerate().map(|(n, x)| x + jams(n)).collect();
        let found = of_length(&parts(&jammed), 0.4, 20_000).expect("they stand out");
        assert!(found.p < 1e-12 && (0.3..0.9).contains(&found.power_n2), "{found:?}");
        // rows that noise with tails throws far, to the side that brakes
        let thrown: Vec<f64> =
            red.iter().enumerate().map(|(n, x)| x + if n % 1900 == 1000 { 60.0 } else { 0.0 }).collect();
        assert_eq!(AVERAGED_S.map(|s| of_length(&parts(&thrown), s, 20_000)), [None; 4]);
        let twice = |n: usize, height: f64| {
            if (5000..5120).contains(&n) || (13_000..13_120).contains(&n) { height } else { 0.0 }
        };
        let two = |height: f64| red.iter().enumerate().map(|(n, x)| x + twice(n, height)).collect::<Vec<f64>>();
        assert_eq!(of_length(&parts(&two(5.0)), 0.4, 20_000), None, "two that are no higher than noise may be");
        let towering = of_length(&parts(&two(40.0)), 0.4, 20_000).expect("two that tower");
        assert!((8.0..20.0).contains(&towering.power_n2), "{towering:?}");
        let shaken: Vec<f64> = red.iter().enumerate().map(|(n, x)| x + jams(n) - jams(n + 1450)).collect();
        assert_eq!(of_length(&parts(&shaken), 0.4, 20_000), None, "what pushes as often as it brakes");
    }
}
