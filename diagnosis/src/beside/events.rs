//! Spots: added friction where they are rolled over, at places that do not repeat, as of dirt in the contacts.
//!
//! No curve follows them, but each is short, all brake, and all have one length along the rail whatever the speed. An
//! electrical spike has one duration instead, and either sign; a rail joint is met again in every pass.

use crate::beside::corners::are_at_corners;
use crate::beside::pulses::{OUTSTANDING, Track, Width, outstanding, scores};
use crate::noise::rows::Rows;
use crate::numbers::rounding::quantum;
use crate::numbers::statistics::{at_least, line, median, robust_sigma, scatter};
use crate::recording::side::Side;

/// Lengths that are tried, m: from the contact of a ball with the rail to a few of them, each √2 times the one before:
/// a matched filter that is off by that much still sees nearly all.
const SHORTEST_M: f64 = 3e-4;
const LENGTHS: i32 = 8;

/// Number of durations that are tried, at the same ratio: from one row to the duration of a spot at the lowest speed.
const DURATIONS: i32 = 15;

/// p-value, over all lengths, below which spots are not chance: of so many that brake beside so few that push (eleven
/// of eleven are enough), or of fewer but very high ones.
const CHANCE: f64 = 4e-3;

/// Exponent of the heaviest noise tails that are allowed for: Student's t with three degrees of freedom. Noise that is
/// seen to have lighter tails, by so many standard deviations of their exponent, is granted no heavier ones.
const TAIL: f64 = 3.0;
const SEEN_TAIL: f64 = 2.0;

/// Largest squared score that counts for one spot: the largest alone do not tell what all have in common.
const MOST_OF_ONE: f64 = 100.0;

/// Travel after a reversal or a start over which friction builds up, m: what is left there is as long as a spot, and
/// stands out like a burst.
pub(crate) const BUILT_UP_M: f64 = 3e-3;

/// Travel to either side, m, over which the speed may change by at most this share: otherwise the force of inertia, and
/// whatever follows the speed, has the length of a spot.
const STEADY_M: f64 = 2e-3;
const STEADY: f64 = 0.2;

/// Quantisation step, as a multiple of the residual's spread in a part, from which noise no longer dithers the channel,
/// so that it flips between two steps for as long as a spot lasts: rounding alone has a spread of 0.37 steps.
const FLIPPING: f64 = 2.0;

/// Distance within which places count as the same, m, and share of all passes over the spots' places that meet a spot
/// again, from which spots are fixed to the rail: five times as many as the densest dirt would give by chance.
const SAME_M: f64 = 1e-3;
const MET_AGAIN: f64 = 0.2;

/// Score that pushing noise reaches in any recording.
const ORDINARY: f64 = 2.0;

/// Fewest spots, however high: no two are enough to say that they come at random.
const FEWEST: usize = 4;

/// Height of a spot that does not exceed its surroundings, N: half of all spots must have more.
const NOTHING_N: f64 = 1e-12;

/// Height, in quantisation steps, up to which a spot may be a single count: those seen where there was no dirt had 1.01
/// and 1.02 (docs/trials/18, 20).
const ONE_COUNT: f64 = 1.5;

/// Rows of a spot from which its length is resolved.
const RESOLVED: f64 = 3.0;

/// Fewest resolved spots for a conclusion, and the spread of their log speeds below which length and duration cannot be
/// told apart.
const FEW: usize = 6;
const SPREAD: f64 = 0.3;

/// Largest distance of the logarithms of two speeds that count as one (a drive's ripple), and the share of spots, one in
/// so many, that may have another speed.
const ONE_SPEED: f64 = 0.1;
const FEW_OTHERS: usize = 10;

/// Slope of log length over log speed that divides the two: 0 for one length, 1 for one duration.
const LIKE_DURATION: f64 = 0.5;

/// Relative loss of a score by a pulse that is no triangle: only a larger difference makes another width fit better.
const OTHER_SHAPE: f64 = 0.1;

/// Share of a score's noise that another width does not have in common: pulses whose widths differ by √2 share most
/// rows.
const OWN_NOISE: f64 = 0.5;

/// Reach of a spot to either side, in its lengths, and at least, in rows.
const REACH: f64 = 2.0;
const MARGIN: usize = 2;

/// Travel to either side of a spot that its baseline is taken from, m: several spot lengths.
const BASELINE_M: f64 = 4e-3;

/// Least number of rows to either side of a spot for its baseline.
const BASELINE_ROWS: usize = 15;

/// A positive number, and the standard deviation of its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) relative: f64,
}

/// Common properties of the spots.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spots {
    /// Number that the block rolls over per metre.
    pub(crate) per_m: Number,
    /// Length along the rail, m.
    pub(crate) length_m: Number,
    /// Height, N.
    pub(crate) force_n: Number,
    /// Squared force, summed over the spots' rows, N².
    pub(crate) squares_n2: f64,
    /// Whether pulses of one duration would look alike.
    pub(crate) may_have_one_duration: bool,
    /// p-value of the hypothesis that spots push as often as they brake.
    pub(crate) p: f64,
    /// Rows within reach of a spot; all runs concatenated.
    pub(crate) rows: Vec<bool>,
}

impl Spots {
    /// Removes their rows from the training rows, where they would bias the search towards anything that brakes.
    pub(crate) fn set_aside(&self, training: &mut [bool]) {
        for (training, spot) in training.iter_mut().zip(&self.rows) {
            *training &= !spot;
        }
    }
}

/// Pulses of one width.
struct Pulses {
    scores: Vec<Vec<f64>>,
    /// Track and row of those that brake, and the number of those that push.
    braking: Vec<(usize, usize)>,
    pushing: usize,
    /// Squared scores of those that brake, less those of the others, each limited to [`MOST_OF_ONE`].
    evidence: f64,
    /// Sum of the scores, unlimited.
    sum: f64,
}

/// Searches for spots in the residual of all curves. `compared` and `left`: one entry per row of all runs.
pub(crate) fn spots(side: &Side<'_>, rows: &Rows, compared: &[bool], left: &[f64]) -> Option<Spots> {
    let tracks = tracks(side, rows, compared, left);
    let lengths: Vec<(f64, Pulses)> =
        ladder(SHORTEST_M, LENGTHS).map(|length_m| (length_m, Pulses::of(&tracks, Width::Length(length_m)))).collect();
    let evidence = |index: &usize| lengths[*index].1.evidence;
    let best = (0..lengths.len()).max_by(|a, b| evidence(a).total_cmp(&evidence(b)))?;
    let spots = &lengths[best].1;
    let by_count = at_least(spots.braking.len(), spots.pushing, 0.5);
    let p = (by_count.min(so_high(&tracks, spots, Width::Length(lengths[best].0))) * f64::from(LENGTHS)).min(1.0);
    if p > CHANCE {
        return None;
    }
    let common = common(&tracks, &lengths, best);
    if common == Common::Duration || is_fixed(side, &tracks, &spots.braking) || are_at_corners(&tracks, &spots.braking)
    {
        return None;
    }
    // at the shortest length it may be shorter than a ball's contact, which nothing rolled over has
    let spots = described(&tracks, &lengths, best, common, p, left.len());
    let is_one = spots.length_m.value > 1.01 * SHORTEST_M;
    let step_n = side.contexts.iter().filter_map(|context| quantum(&context.run.drag_force_n)).fold(0.0, f64::max);
    (is_one && spots.force_n.value > NOTHING_N.max(ONE_COUNT * step_n)).then_some(spots)
}

/// Geometric series with ratio √2.
fn ladder(from: f64, count: i32) -> impl Iterator<Item = f64> {
    (0..count).map(move |step| from * (0.5 * f64::from(step)).exp2())
}

/// The parts of all runs.
fn tracks(side: &Side<'_>, rows: &Rows, compared: &[bool], left: &[f64]) -> Vec<Track> {
    let rows = rows.with_tails();
    let matched = rows.backwards(&rows.white(left));
    let weights = rows.power_weights();
    let (mut tracks, mut start) = (Vec::new(), 0);
    for context in &side.contexts {
        let (step_n, step_s) = (quantum(&context.run.drag_force_n), context.run.step_s());
        for part in &context.run.parts {
            let own = start + part.rows.start..start + part.rows.end;
            let is_coarse = step_n.is_some_and(|step| step > FLIPPING * robust_sigma(&left[own.clone()]));
            let scaled = |n: usize| {
                let scaled = context.steady.direction[n] * matched[start + n] / weights[start + n].sqrt();
                if scaled.is_finite() { scaled } else { 0.0 }
            };
            let along = |n: usize| context.steady.direction[n] * left[start + n];
            let mut track = Track {
                step_s,
                left_n: part.rows.clone().map(along).collect(),
                travel_m: context.travel_m[part.rows.clone()].to_vec(),
                speed_m_s: part.rows.clone().map(|n| context.speed_m_s(n)).collect(),
                acceleration_m_s2: context.motion.acceleration_m_s2[part.rows.clone()].to_vec(),
                braking: part.rows.clone().map(scaled).collect(),
                compared: own.clone().map(|n| compared[n] && weights[n] > 0.0).collect(),
                is_built_up: part.rows.clone().map(|n| context.since_reversal_m[n] > BUILT_UP_M).collect(),
                is_told: Vec::new(),
                rows: own,
            };
            track.is_told = if is_coarse { vec![false; track.rows.len()] } else { told(&track) };
            tracks.push(track);
        }
        start += context.run.len();
    }
    tracks
}

/// Rows where only a spot can have the shape of one.
fn told(track: &Track) -> Vec<bool> {
    let (x, v) = (&track.travel_m, &track.speed_m_s);
    let is_told = |(n, (from, to)): (usize, (usize, usize))| {
        let is_steady = (v[to] - v[from]).abs() < STEADY * v[n] && x[to] - x[from] > STEADY_M;
        is_steady && track.compared[n] && track.is_built_up[n]
    };
    track.windows(STEADY_M).into_iter().enumerate().map(is_told).collect()
}

impl Pulses {
    fn of(tracks: &[Track], width: Width) -> Self {
        let mut pulses =
            Pulses { scores: scores(tracks, width), braking: Vec::new(), pushing: 0, evidence: 0.0, sum: 0.0 };
        for (index, (track, scores)) in tracks.iter().zip(&pulses.scores).enumerate() {
            for n in outstanding(track, scores, OUTSTANDING, |n| is_one(track, scores[n], n, width)) {
                let evidence = (scores[n] * scores[n]).min(MOST_OF_ONE);
                pulses.sum += scores[n];
                if scores[n] > 0.0 {
                    pulses.braking.push((index, n));
                    pulses.evidence += evidence;
                } else {
                    pulses.pushing += 1;
                    pulses.evidence -= evidence;
                }
            }
        }
        pulses
    }
}

/// Whether a row's score is that of a pulse there, and not of the flanks that the noise filter gives to its neighbours:
/// between two spots these add up to more than either.
fn is_one(track: &Track, score: f64, at: usize, width: Width) -> bool {
    track.is_told[at] && score * height(track, at, width).0 > 0.0
}

/// Probability of braking so far above the highest that pushes.
fn so_high(tracks: &[Track], spots: &Pulses, width: Width) -> f64 {
    if spots.braking.len() < FEWEST {
        return 1.0;
    }
    let of_track = |(track, scores): (&Track, &Vec<f64>)| -> Vec<f64> {
        let peaks = outstanding(track, scores, ORDINARY, |n| is_one(track, scores[n], n, width));
        peaks.into_iter().map(|n| -scores[n]).filter(|score| *score > ORDINARY).collect()
    };
    let pushing: Vec<f64> = tracks.iter().zip(&spots.scores).flat_map(of_track).collect();
    beyond(spots.braking.iter().map(|(track, n)| spots.scores[*track][*n]).collect(), &pushing)
}

/// Probability of scores so far beyond the highest of the opposite sign, if noise has equal tails on both sides.
/// `others`: those of the opposite sign beyond [`ORDINARY`].
///
/// ```text
/// k scores beyond c times the highest of the others:  p = (1 + c^a)^-k,  a: exponent of the tails
/// ```
///
/// The number expected beyond the highest of the others is exponential with mean 1, and beyond `c` times it is `c^-a`
/// of that. The result is the best over all `k`, each of which may use `2^-k` of the level.
fn beyond(mut scores: Vec<f64>, others: &[f64]) -> f64 {
    scores.sort_by(|a, b| b.total_cmp(a));
    let (highest, tail) = (others.iter().copied().fold(ORDINARY, f64::max), tail(others));
    let of = |(k, score): (usize, &f64)| (2.0 / (1.0 + (score / highest).powf(tail))).powf(k as f64 + 1.0);
    scores.iter().enumerate().map(of).fold(1.0, f64::min)
}

/// Exponent of the heaviest tails that scores beyond [`ORDINARY`] may have, at least [`TAIL`].
///
/// ```text
/// a = n / Σ ln(score / ORDINARY),  with a standard deviation of a/√n        (Hill, Annals of Statistics 3, 1975)
/// ```
fn tail(scores: &[f64]) -> f64 {
    let (n, logarithms) = (scores.len() as f64, scores.iter().map(|score| (score / ORDINARY).ln()).sum::<f64>());
    let exponent = n / logarithms * (1.0 - SEEN_TAIL / n.sqrt());
    if exponent.is_finite() { exponent.max(TAIL) } else { TAIL }
}

/// What spots have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Common {
    Length,
    Duration,
    /// One or the other.
    Either,
}

/// Whether pulses of one duration fit spots clearly better than those of one length or, where too few spots are resolved
/// for their lengths to tell, clearly worse. At one speed a length is a duration.
fn common(tracks: &[Track], lengths: &[(f64, Pulses)], best: usize) -> Common {
    let row_s = tracks.iter().map(|track| track.step_s).fold(f64::INFINITY, f64::min);
    let spots = &lengths[best].1.braking;
    let durations = ladder(row_s, DURATIONS).map(|duration_s| Pulses::of(tracks, Width::Duration(duration_s)));
    let of_durations = durations.map(|pulses| fitting(&pulses, spots)).fold(f64::NEG_INFINITY, f64::max);
    let of_lengths = lengths.iter().map(|(_, pulses)| fitting(pulses, spots)).fold(f64::NEG_INFINITY, f64::max);
    let ahead = of_lengths - of_durations;
    let resolved = resolved(tracks, lengths, best);
    let speeds: Vec<f64> = resolved.iter().map(|(speed, _)| *speed).collect();
    if resolved.len() < FEW || scatter(&speeds) < SPREAD {
        let variance = |spot: &(usize, usize)| peak(&lengths[best].1, *spot).powi(-2);
        let noise = OWN_NOISE * spots.iter().map(variance).sum::<f64>().sqrt() / spots.len() as f64;
        return match ahead {
            _ if ahead < -noise => Common::Duration,
            _ if ahead < noise || is_at_one_speed(tracks, spots) => Common::Either,
            _ => Common::Length,
        };
    }
    let own: Vec<f64> = resolved.iter().map(|(_, length)| *length).collect();
    let slope = line(&speeds.iter().copied().zip(own).collect::<Vec<_>>()).1;
    match ahead < -OTHER_SHAPE || slope > LIKE_DURATION {
        true => Common::Duration,
        false if is_at_one_speed(tracks, spots) => Common::Either,
        false => Common::Length,
    }
}

/// Whether all spots but a few were rolled over at one speed.
fn is_at_one_speed(tracks: &[Track], spots: &[(usize, usize)]) -> bool {
    let speeds: Vec<f64> = spots.iter().map(|(track, n)| tracks[*track].speed_m_s[*n].ln()).collect();
    let usual = median(speeds.clone()).unwrap_or(0.0);
    let others = speeds.iter().filter(|speed| (*speed - usual).abs() > ONE_SPEED).count();
    others * FEW_OTHERS <= speeds.len()
}

/// Fit of pulses of one width to spots: mean logarithm of their scores, so that the highest alone do not decide. Noise
/// makes the logarithm of a score `s` scatter by `1/s`.
fn fitting(pulses: &Pulses, spots: &[(usize, usize)]) -> f64 {
    spots.iter().map(|spot| peak(pulses, *spot).ln()).sum::<f64>() / spots.len() as f64
}

/// Highest score in the rows next to a spot, because pulses of another width may peak beside it; at least 1, what noise
/// shows.
fn peak(pulses: &Pulses, (track, n): (usize, usize)) -> f64 {
    let scores = &pulses.scores[track];
    scores[n.saturating_sub(MARGIN)..scores.len().min(n + MARGIN + 1)].iter().fold(1.0, |most, score| most.max(*score))
}

/// Log speed and log length of the spots at speeds at which the best length lasts for several rows. Only the speed
/// selects: selected by their own rows, of fast spots only those would pass that noise makes long, and length would
/// seem to grow with speed.
fn resolved(tracks: &[Track], lengths: &[(f64, Pulses)], best: usize) -> Vec<(f64, f64)> {
    let (best_m, spots) = &lengths[best];
    let speed = |(track, n): &(usize, usize)| tracks[*track].speed_m_s[*n];
    let is_resolved = |spot: &&(usize, usize)| *best_m >= RESOLVED * speed(spot) * tracks[spot.0].step_s;
    spots.braking.iter().filter(is_resolved).map(|spot| (speed(spot).ln(), own_length_m(lengths, *spot).ln())).collect()
}

/// Length at which one spot stands out most, m.
fn own_length_m(lengths: &[(f64, Pulses)], (track, n): (usize, usize)) -> f64 {
    let score = |pulses: &Pulses| pulses.scores[track][n];
    lengths.iter().max_by(|a, b| score(&a.1).total_cmp(&score(&b.1))).map_or(0.0, |(length_m, _)| *length_m)
}

/// Length at which all spots together stand out most, m, if it is significantly longer than the shortest: the few rows
/// of one spot do not tell its length.
fn together_m(lengths: &[(f64, Pulses)], count: f64) -> Option<f64> {
    let (_, shortest) = lengths.first()?;
    let (longer_m, longer) = lengths.iter().max_by(|a, b| a.1.sum.total_cmp(&b.1.sum))?;
    (longer.sum > shortest.sum + count.sqrt()).then_some(*longer_m)
}

/// Whether braking is met again where the block passes its place again.
fn is_fixed(side: &Side<'_>, tracks: &[Track], spots: &[(usize, usize)]) -> bool {
    let position_m: Vec<f64> = side.contexts.iter().flat_map(|context| &context.motion.position_m).copied().collect();
    let of = |(track, n): &(usize, usize)| position_m[tracks[*track].rows.start + n];
    let places_m: Vec<f64> = spots.iter().map(of).collect();
    let (mut passes, mut met) = (0usize, 0usize);
    for place_m in &places_m {
        for track in tracks {
            let position_m = &position_m[track.rows.clone()];
            let crosses = |n: &usize| {
                (position_m[*n] - place_m) * (position_m[n + 1] - place_m) <= 0.0
                    && position_m[*n] != position_m[n + 1]
                    && track.is_told[*n]
            };
            passes += (0..position_m.len().saturating_sub(1)).filter(crosses).count();
        }
        met += places_m.iter().filter(|other| (*other - place_m).abs() < SAME_M).count();
    }
    // every spot counts one pass and one meeting of its own
    let (passes, met) = (passes.saturating_sub(places_m.len()), met.saturating_sub(places_m.len()));
    passes > 0 && met as f64 > MET_AGAIN * passes as f64
}

/// Common properties of the spots at the best length. `all`: number of rows of all runs.
fn described(tracks: &[Track], lengths: &[(f64, Pulses)], best: usize, common: Common, p: f64, all: usize) -> Spots {
    let (length_m, spots) = &lengths[best];
    let count = spots.braking.len() as f64;
    let mut of_spots_m: Vec<f64> = resolved(tracks, lengths, best).into_iter().map(|(_, length)| length).collect();
    if of_spots_m.len() < FEW {
        of_spots_m = spots.braking.iter().map(|spot| own_length_m(lengths, *spot).ln()).collect();
    }
    let (mut heights_n, mut travel_m) = (Vec::new(), 0.0);
    let mut squares_n2 = 0.0;
    let mut rows = vec![false; all];
    for ((index, track), scores) in tracks.iter().enumerate().zip(&spots.scores) {
        let is_seen = |n: &usize| track.is_told[*n] && scores[*n] != 0.0;
        travel_m += (0..scores.len()).filter(is_seen).map(|n| track.speed_m_s[n] * track.step_s).sum::<f64>();
        // dirt does not wait for a steady speed
        let braking = outstanding(track, scores, OUTSTANDING, |n| track.compared[n] && track.is_built_up[n]);
        for n in braking.into_iter().filter(|n| scores[*n] > 0.0) {
            let (height_n, square_n2) = height(track, n, Width::Length(*length_m));
            squares_n2 += square_n2;
            if spots.braking.contains(&(index, n)) {
                heights_n.push(height_n.max(NOTHING_N).ln());
            }
            let is_reached = |m: &usize| {
                m.abs_diff(n) <= MARGIN || (track.travel_m[*m] - track.travel_m[n]).abs() <= REACH * length_m
            };
            let start = track.rows.start;
            (0..n).rev().take_while(is_reached).for_each(|m| rows[start + m] = true);
            (n..scores.len()).take_while(is_reached).for_each(|m| rows[start + m] = true);
        }
    }
    let of_each = typical(&of_spots_m);
    let is_shortest = of_each.value < 1.01 * SHORTEST_M;
    let together_m = if is_shortest { together_m(lengths, count) } else { None };
    Spots {
        // Poisson count of independent places
        per_m: Number { value: count / travel_m.max(1e-9), relative: 1.0 / count.max(1.0).sqrt() },
        length_m: Number { value: together_m.unwrap_or(of_each.value), ..of_each },
        force_n: typical(&heights_n),
        squares_n2,
        may_have_one_duration: common == Common::Either,
        p,
        rows,
    }
}

/// Height of a pulse above its surroundings, N, and its squared force, summed over its rows, N²: least-squares fit of
/// the triangle.
fn height(track: &Track, at: usize, width: Width) -> (f64, f64) {
    let away_m = |n: usize| (track.travel_m[n] - track.travel_m[at]).abs();
    let is_around = |n: &usize| away_m(*n) <= BASELINE_M || n.abs_diff(at) <= BASELINE_ROWS;
    let before = (0..at).rev().take_while(is_around);
    let around = before.chain((at..track.travel_m.len()).take_while(is_around));
    let around: Vec<usize> = around.filter(|n| track.compared[*n]).collect();
    let baseline = median(around.iter().map(|n| track.left_n[*n]).collect()).unwrap_or(0.0);
    let halves = |n: usize| match width {
        Width::Length(length_m) => 2.0 * away_m(n) / length_m,
        Width::Duration(duration_s) => 2.0 * track.step_s * n.abs_diff(at) as f64 / duration_s,
    };
    let shape = |n: usize| (1.0 - halves(n)).max(0.0);
    let along: f64 = around.iter().map(|n| shape(*n) * (track.left_n[*n] - baseline)).sum();
    let squared: f64 = around.iter().map(|n| shape(*n) * shape(*n)).sum();
    (along / squared.max(1.0), along * along / squared.max(1.0))
}

/// Median of numbers given by their logarithms; the median of normal numbers scatters by 1.25 times as much as their
/// mean.
fn typical(logarithms: &[f64]) -> Number {
    let relative = 1.25 * scatter(logarithms) / (logarithms.len().max(1) as f64).sqrt();
    Number { value: median(logarithms.to_vec()).unwrap_or(0.0).exp(), relative }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_of_few_rows_are_as_long_as_all_together_say() {
        let pulses = |sum: f64| Pulses { scores: Vec::new(), braking: Vec::new(), pushing: 0, evidence: 0.0, sum };
        let of = |sums: [f64; 3]| -> Vec<(f64, Pulses)> {
            ladder(SHORTEST_M, 3).zip(sums).map(|(length_m, sum)| (length_m, pulses(sum))).collect()
        };
        let longest_m = ladder(SHORTEST_M, 3).last();
        assert_eq!(together_m(&of([376.0, 380.0, 392.0]), 13.0), longest_m);
        assert_eq!(together_m(&of([376.0, 377.0, 379.0]), 13.0), None);
        assert_eq!(together_m(&of([376.0, 300.0, 200.0]), 13.0), None);
    }

    /// The filter of noise that remembers gives every spot flanks, which add up between two of them.
    #[test]
    fn nothing_pushes_between_two_spots() {
        let left_n: Vec<f64> = (0..400).map(|n| if [199, 201].contains(&n) { 1.0 } else { 0.0 }).collect();
        let differences = |n: usize| 2.0 * left_n[n] - left_n[n - 1] - left_n[n + 1];
        let braking = (0..400).map(|n| if (1..399).contains(&n) { differences(n) } else { 0.0 }).collect();
        let track = Track {
            rows: 0..400,
            step_s: 0.01,
            travel_m: (0..400).map(|n| 1e-3 * f64::from(n)).collect(),
            speed_m_s: vec![0.1; 400],
            acceleration_m_s2: vec![0.0; 400],
            left_n,
            braking,
            compared: vec![true; 400],
            is_built_up: vec![true; 400],
            is_told: vec![true; 400],
        };
        let width = Width::Length(SHORTEST_M);
        let score = |n: usize| track.braking[n];
        assert!((score(199), score(200), score(201)) == (2.0, -2.0, 2.0));
        assert_eq!([199, 200, 201].map(|n| is_one(&track, score(n), n, width)), [true, false, true]);
    }

    #[test]
    fn the_highest_spot_alone_does_not_tell_which_width_fits() {
        let of = |scores: [f64; 4]| {
            let scores = vec![vec![0.0, 0.0, scores[0], 0.0, 0.0], scores[1..].to_vec()];
            Pulses { scores, braking: Vec::new(), pushing: 0, evidence: 0.0, sum: 0.0 }
        };
        let spots = [(0, 2), (1, 0)];
        // the second lies beside its row, and where nothing is seen a score counts as that of noise
        let (all, highest) = (of([90.0, 5.0, 20.0, 0.0]), of([100.0, -3.0, 0.0, 0.5]));
        assert!((fitting(&all, &spots) - (90.0f64 * 20.0).ln() / 2.0).abs() < 1e-12);
        assert!((fitting(&highest, &spots) - 100.0f64.ln() / 2.0).abs() < 1e-12);
    }

    #[test]
    fn tails_are_granted_as_heavy_as_they_may_be_by_what_pushes() {
        // quantiles of tails with exponents 3 and 9
        let pareto = |exponent: f64| -> Vec<f64> {
            (0..60).map(|n| ORDINARY * ((f64::from(n) + 0.5) / 60.0).powf(-1.0 / exponent)).collect()
        };
        assert_eq!(tail(&pareto(3.0)), TAIL);
        assert!((6.0..7.5).contains(&tail(&pareto(9.0))), "{}", tail(&pareto(9.0)));
        assert_eq!([tail(&[]), tail(&[2.1]), tail(&[2.1; 3])], [TAIL; 3], "few tell nothing");
        let (spots, light) = (vec![6.0; 4], pareto(9.0));
        assert!(beyond(spots.clone(), &light) < 0.1 * beyond(spots, &[3.4]), "light tails make spots surer");
    }

    /// Both signs have tails with the allowed exponent: no more than the level's share of recordings falls below it.
    #[test]
    fn tails_as_heavy_as_granted_are_no_more_often_so_high_than_said() {
        let mut state = 7u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 + 0.5) / f64::from(1u32 << 31)
        };
        let (recordings, mut p) = (100_000, Vec::new());
        for _ in 0..recordings {
            let mut side = || (0..40).map(|_| ORDINARY * uniform().powf(-1.0 / TAIL)).collect::<Vec<f64>>();
            let (braking, pushing) = (side(), side());
            let standing = braking.into_iter().filter(|score| *score > OUTSTANDING).collect();
            p.push(beyond(standing, &pushing));
        }
        for level in [0.1, 0.01, CHANCE / f64::from(LENGTHS)] {
            let below = p.iter().filter(|p| **p < level).count() as f64;
            let expected = level * f64::from(recordings);
            assert!(
                below < expected + 3.0 * expected.sqrt() && below > 0.1 * expected,
                "{level}: {below} of {expected}"
            );
        }
    }
}
