//! Bursts: braking for tenths of a second at times that nothing predicts, such as a cage that jams or a clamp that
//! touches; or pushing to one side, whatever the motion, such as another machine on the same frame.
//!
//! Noise estimated from such a residual has its spectrum, and whitening hides it. In averages over time it stands out:
//! whatever the correlation of the noise, nearly all averages deviate from their neighbours as noise does, a few
//! deviate many times more, and those brake.

use crate::beside::events::BUILT_UP_M;
use crate::noise::locks::least_of;
use crate::numbers::statistics::{median, robust_sigma};
use crate::recording::side::Side;

/// Averaging times, s.
const AVERAGED_S: [f64; 4] = [0.1, 0.2, 0.4, 0.8];

/// Averages begun per averaging time: a burst that lies across two of them falls into a third.
const OVERLAP: usize = 4;

/// Averages to either side, in averaging times, whose median is the reference: a slower change is no burst.
const AROUND: usize = 4;

/// Fewest rows of an average: with so many, heavy-tailed noise has no tails left.
const FEWEST_ROWS: usize = 8;

/// Least length of a part for its scale to be estimated, in averaging times.
const FEWEST: usize = 12;

/// Distance from the neighbours, in units of the scale of averages, from which one stands out. None of 900 averages of
/// Gaussian noise is beyond 5, and a scale from few averages is off by a sixth. Of 114 clean recordings of the opened
/// trial 11 none has more than one average that brakes beyond two for every one that pushes.
const OUTSTANDING: f64 = 6.0;
const OUTSTANDING_OF_NOISE: f64 = 5.0;

/// Distance from the median of its part, in units of the scale of rows, at which a row is clipped: one far row of
/// heavy-tailed noise is no lasting braking.
const FARTHEST: f64 = 4.0;

/// Distance of an unclipped average, in units of its outstanding distance, that suffices if its clipped value is half
/// as far out as [`OUTSTANDING`] asks: so high a burst counts, however little clipping leaves of it. Two of them are
/// enough.
const TOWERING: f64 = 3.0;
const FEWEST_TOWERING: usize = 2;

/// Share of the outstanding distance at which an average still belongs to a burst.
const HALF: f64 = 0.5;

/// Fewest bursts along a pull, and how many more are needed for each one the other way.
const FEWEST_BURSTS: usize = 3;
const FOR_ONE_THAT_PUSHES: usize = 2;

/// The bursts of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bursts {
    /// Squared force, mean over all compared rows, N².
    pub(crate) power_n2: f64,
    /// p-value of so many by chance.
    pub(crate) p: f64,
}

/// What a burst follows: the direction of motion, which it brakes, or none, so that it pushes to one side of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pull {
    AgainstMotion,
    Forwards,
    Backwards,
}

/// Searches for bursts in the law's residual; `left`: one entry per row of all runs.
pub(crate) fn bursts(side: &Side<'_>, left: &[f64]) -> Option<Bursts> {
    let rows = side.compared.iter().filter(|compared| **compared).count();
    let found: Vec<Bursts> = [Pull::AgainstMotion, Pull::Forwards, Pull::Backwards]
        .into_iter()
        .flat_map(|pull| {
            let parts = parts(side, left, pull);
            AVERAGED_S.map(|averaged_s| of_length(&parts, averaged_s, rows))
        })
        .flatten()
        .collect();
    // averages of about the bursts' length have most of their force
    let power_n2 = found.iter().map(|bursts| bursts.power_n2).fold(0.0, f64::max);
    let p = least_of(found.iter().map(|bursts| bursts.p));
    (!found.is_empty()).then_some(Bursts { power_n2, p })
}

/// Time between two rows of every part, s, and what is left in them, positive along a pull; NaN where nothing is compared.
fn parts(side: &Side<'_>, left: &[f64], pull: Pull) -> Vec<(f64, Vec<f64>)> {
    let (mut parts, mut start) = (Vec::new(), 0);
    for context in &side.contexts {
        let step_s = context.run.step_s().max(1e-9);
        for part in &context.run.parts {
            let along = |n: usize| {
                let direction = context.steady.direction[n];
                let is_told = side.compared[start + n] && context.since_reversal_m[n] > BUILT_UP_M && direction != 0.0;
                let sign = match pull {
                    Pull::AgainstMotion => direction,
                    Pull::Forwards => 1.0,
                    Pull::Backwards => -1.0,
                };
                if is_told { sign * left[start + n] } else { f64::NAN }
            };
            parts.push((step_s, part.rows.clone().map(along).collect()));
        }
        start += context.run.len();
    }
    parts
}

/// Bursts of about one length. `parts`: time between two rows, and the rows.
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
    /// Deviation from the median of the neighbours, N, with rows clipped at [`FARTHEST`]; `None` where half of an
    /// average's rows or more are not compared.
    from_others: Vec<Option<f64>>,
    /// The same of unclipped rows.
    in_full: Vec<Option<f64>>,
    /// Rows from one average to the next.
    step: usize,
    /// Deviation from which an average stands out, N.
    outstanding_n: f64,
}

impl Averages {
    /// `None` where too few averages determine their scale.
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
        // anything below the noise of a row may as well be a bump of the rail or a remainder of the law
        let scale = robust_sigma(&told);
        let outstanding_n = (OUTSTANDING * scale).max(scale_of_rows);
        (told.len() * step >= FEWEST * width && scale > 0.0).then_some(Averages {
            from_others,
            in_full,
            step,
            outstanding_n,
        })
    }

    /// Number of bursts to one side, +1 for those that brake; what begins within the length of one average is one
    /// burst.
    fn bursts(&self, side: f64) -> usize {
        self.count(|clipped, full| side * clipped > self.outstanding_n || self.towers(side, clipped, full))
    }

    /// Number of those that tower over the others (see [`TOWERING`]).
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

    /// Squared force of the bursts to one side, summed over rows, N².
    fn squares_n2(&self, side: f64) -> f64 {
        // averages across the end of a burst have a part of its force
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

    /// Correlated noise, normal as the sum of twelve uniform numbers.
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
        // far rows of heavy-tailed noise, to the side that brakes
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
