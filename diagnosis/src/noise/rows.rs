//! Rows: which of them count, and the one linear operation that every column goes through before it is compared.
//!
//! Runs are concatenated. Rows that cannot be compared are bridged by straight lines where the gap is short, so that
//! the noise filter continues, and are dropped after the filter; a long gap or a border of a part starts a new stretch.
//! Very long recordings are averaged down first.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use simulation::run::{Break, Run};

use crate::noise::{Course, MAX_ORDER, Whitening, slowness, third_differences};
use crate::numbers::bridge::{bridge, gaps};
use crate::numbers::linear::Symmetric;
use crate::numbers::rounding::{following, is_coarse, quantum};
use crate::numbers::statistics::{rms, robust_sigma};

/// Longest gap that is bridged, s.
const BRIDGE_S: f64 = 0.25;

/// Number of compared rows above which rows are averaged down.
const MOST_ROWS: usize = 120_000;

/// Length of a block, s: longer than any correlation that whitening leaves.
const BLOCK_S: f64 = 5.0;

/// Number of folds to which blocks are dealt in turn.
pub(crate) const FOLDS: usize = 4;

/// Time for which a force stays within one quantisation step, s: about one travel at constant speed.
const WITHIN_A_STEP_S: f64 = 0.75;

/// Residuals of more standard deviations than this are down-weighted.
const TAIL: f64 = 4.0;

/// Residuals of more standard deviations than this do not count as noise when its colour is estimated.
const STANDS_OUT: f64 = 6.0;

/// Residuals of more standard deviations than this pull no harder (Huber) on a law that lacks some of the causes.
const HUBER: f64 = 1.5;

/// Least noise of a part, as a share of the loudest part's: without any, a part would decide every fit.
const QUIETEST: f64 = 1e-3;

/// Rows of one part between two long gaps.
#[derive(Clone, Debug)]
struct Stretch {
    run: usize,
    /// Part of the test profile, numbered over all runs; each has one noise level.
    group: usize,
    rows: Range<usize>,
    /// Bridged rows, counted from the start of the stretch: never the first or the last.
    bridged: Vec<Range<usize>>,
    keep: Vec<bool>,
    /// The kept rows as intervals.
    kept: Vec<Range<usize>>,
}

/// Consecutive stretches of one part of a run.
#[derive(Clone, Debug)]
struct Chain {
    stretches: Range<usize>,
    /// Averaged rows missing before each stretch (0 before the first), and its own number.
    rows: Vec<(usize, usize)>,
}

/// Columns whitened side by side.
const SIDE_BY_SIDE: usize = 8;

/// The rows that are compared, and their whitening and weights.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    /// First row of every run in the concatenation, and the number of all rows.
    pub(crate) starts: Vec<usize>,
    stretches: Vec<Stretch>,
    chains: Vec<Chain>,
    decimation: usize,
    whitening: Whitening,
    /// Course of the noise filter over every chain.
    courses: Arc<Vec<Course>>,
    /// One per compared row: 1/σ of its part of the profile, less for an outlier.
    weights: Vec<f32>,
    /// Compared rows of every block.
    pub(crate) blocks: Vec<Range<usize>>,
    /// Compared rows of every part of the profile; each has one noise level.
    pub(crate) groups: Vec<Range<usize>>,
    /// Quantisation step of the force channel, N; 0 where none is visible.
    step_n: f64,
    /// Rows for which a force stays within one step.
    within_a_step: f64,
}

impl Chain {
    /// The chain of the stretches from `first` on; `None` where there is none.
    fn of(stretches: &[Stretch], first: usize, decimation: usize) -> Option<Self> {
        let own = stretches.get(first..).filter(|own| !own.is_empty())?;
        let missing = own.windows(2).map(|two| (two[1].rows.start - two[0].rows.end) / decimation);
        let rows = std::iter::once(0).chain(missing).zip(own.iter().map(|stretch| stretch.keep.len())).collect();
        Some(Chain { stretches: first..stretches.len(), rows })
    }
}

impl Rows {
    /// The rows of `compared` (one entry per row of all runs), with at least `coarsest` of them averaged to one.
    pub(crate) fn new(runs: &[Run], compared: &[bool], coarsest: usize) -> Self {
        let mut starts = vec![0];
        for run in runs {
            starts.push(starts.last().copied().unwrap_or(0) + run.len());
        }
        let total = compared.iter().filter(|c| **c).count();
        let decimation = total.div_ceil(MOST_ROWS).max(coarsest).max(1);
        let mut rows = Rows {
            stretches: Vec::new(),
            chains: Vec::new(),
            decimation,
            whitening: Whitening::none(),
            courses: Arc::default(),
            weights: Vec::new(),
            blocks: Vec::new(),
            groups: Vec::new(),
            step_n: runs.iter().filter_map(|run| quantum(&run.drag_force_n)).fold(0.0, f64::max),
            within_a_step: 1.0,
            starts,
        };
        let mut duration_s = 0.0;
        let mut group = 0;
        for (index, run) in runs.iter().enumerate() {
            duration_s += run.step_s().max(0.0) * run.len() as f64;
            let bridge = (BRIDGE_S / run.step_s()).max(1.0) as usize;
            for part in &run.parts {
                // gaps do not change the level of the noise
                group += usize::from(matches!(part.starts, Break::Start | Break::Segment));
                let compared = &compared[rows.starts[index]..rows.starts[index + 1]];
                let first = rows.stretches.len();
                for range in stretches(&compared[part.rows.clone()], bridge) {
                    let range = part.rows.start + range.start..part.rows.start + range.end;
                    let keep: Vec<bool> = compared[range.clone()]
                        .chunks(decimation)
                        .map(|chunk| chunk.len() == decimation && 2 * chunk.iter().filter(|c| **c).count() > decimation)
                        .collect();
                    let bridged = gaps(&compared[range.clone()]);
                    if keep.iter().filter(|keep| **keep).count() >= 8 {
                        let kept = stretches(&keep, 0);
                        rows.stretches.push(Stretch { run: index, group, rows: range, bridged, keep, kept });
                    }
                }
                rows.chains.extend(Chain::of(&rows.stretches, first, decimation));
            }
        }
        let step_s = runs.iter().map(Run::step_s).fold(0.0, f64::max) * decimation as f64;
        rows.within_a_step = (WITHIN_A_STEP_S / step_s).max(1.0);
        rows.number_blocks(runs, BLOCK_S.min(duration_s / 40.0));
        rows.weights = vec![1.0; rows.len()];
        rows.whiten_by(Whitening::none());
        rows
    }

    fn whiten_by(&mut self, whitening: Whitening) {
        self.courses = Arc::new(self.chains.iter().map(|chain| whitening.course(&chain.rows)).collect());
        self.whitening = whitening;
    }

    /// Whether both have the same noise model, so that columns whitened by one hold for the other. Both must be of the
    /// same runs.
    pub(crate) fn whiten_alike(&self, other: &Self) -> bool {
        self.whitening == other.whitening && self.weights == other.weights
    }

    /// Number of compared rows.
    pub(crate) fn len(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.end)
    }

    fn number_blocks(&mut self, runs: &[Run], block_s: f64) {
        let groups = self.stretches.last().map_or(0, |stretch| stretch.group + 1);
        let (mut blocks, mut of_groups) = (Vec::new(), vec![0..0; groups]);
        let (mut row, mut start, mut current) = (0, 0, None);
        for stretch in &self.stretches {
            let run = &runs[stretch.run];
            let first = run.time_s.first().copied().unwrap_or(0.0);
            for (k, _) in stretch.keep.iter().enumerate().filter(|(_, keep)| **keep) {
                let time = run.time_s[stretch.rows.start + k * self.decimation] - first;
                let block = (stretch.group, (time / block_s).floor() as i64);
                if current != Some(block) {
                    if row > start {
                        blocks.push(start..row);
                    }
                    (current, start) = (Some(block), row);
                }
                row += 1;
                let of_group: &mut Range<usize> = &mut of_groups[stretch.group];
                if of_group.start == of_group.end {
                    *of_group = row - 1..row;
                }
                of_group.end = row;
            }
        }
        if row > start {
            blocks.push(start..row);
        }
        // the last piece of a run is too short to stand alone
        let shortest = row / blocks.len().max(1) / 4;
        let mut merged: Vec<Range<usize>> = Vec::new();
        for block in blocks {
            match merged.last_mut() {
                Some(last) if block.len() < shortest => last.end = block.end,
                _ => merged.push(block),
            }
        }
        self.blocks = merged;
        self.groups = of_groups;
    }

    /// Compared rows of a column, averaged but not filtered.
    pub(crate) fn plain(&self, column: &[f64]) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.len());
        for stretch in &self.stretches {
            let x = self.averaged(stretch, column);
            stretch.kept.iter().for_each(|kept| out.extend_from_slice(&x[kept.clone()]));
        }
        out
    }

    /// Compared rows of a column after the noise filter, where noise has variance 1.
    pub(crate) fn white(&self, column: &[f64]) -> Vec<f32> {
        self.white_all(&[column]).pop().unwrap_or_default()
    }

    /// The same for many columns, cheaper than one after the other.
    pub(crate) fn white_all(&self, columns: &[&[f64]]) -> Vec<Vec<f32>> {
        let mut out: Vec<Vec<f32>> = columns.iter().map(|_| Vec::with_capacity(self.len())).collect();
        for (columns, out) in columns.chunks(SIDE_BY_SIDE).zip(out.chunks_mut(SIDE_BY_SIDE)) {
            for (chain, course) in self.chains.iter().zip(self.courses.iter()) {
                let stretches = &self.stretches[chain.stretches.clone()];
                let of = |column: &&[f64]| stretches.iter().map(|stretch| self.averaged(stretch, column)).collect();
                let white = self.whitening.apply_all(columns.iter().map(of).collect(), course);
                for (out, mut x) in out.iter_mut().zip(white.iter().map(Vec::as_slice)) {
                    for stretch in stretches {
                        let (own, others) = x.split_at(stretch.keep.len());
                        stretch.kept.iter().for_each(|kept| out.extend(own[kept.clone()].iter().map(|x| *x as f32)));
                        x = others;
                    }
                }
            }
        }
        for out in &mut out {
            for (x, weight) in out.iter_mut().zip(&self.weights) {
                *x *= weight;
            }
        }
        out
    }

    /// The adjoint: a whitened column sent backwards through weights, noise filter, bridges and averages; one entry per
    /// row of all runs. Its product with a raw column equals the product of both whitened.
    pub(crate) fn backwards(&self, column: &[f32]) -> Vec<f64> {
        let mut out = vec![0.0; self.starts.last().copied().unwrap_or(0)];
        let mut kept = column.iter().zip(&self.weights).map(|(x, weight)| f64::from(x * weight));
        for stretch in &self.stretches {
            let mut x: Vec<f64> =
                stretch.keep.iter().map(|keep| if *keep { kept.next().unwrap_or(0.0) } else { 0.0 }).collect();
            self.whitening.apply_backwards(&mut x);
            let from = self.starts[stretch.run] + stretch.rows.start;
            for (n, out) in out[from..from + stretch.rows.len()].iter_mut().enumerate() {
                *out = x.get(n / self.decimation).copied().unwrap_or(0.0) / self.decimation as f64;
            }
            for gap in &stretch.bridged {
                out[from + gap.start..from + gap.end].fill(0.0);
            }
        }
        out
    }

    /// Squared weight of every row of all runs; 0 where it is not compared.
    pub(crate) fn power_weights(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.starts.last().copied().unwrap_or(0)];
        let mut weights = self.weights.iter();
        for stretch in &self.stretches {
            let from = self.starts[stretch.run] + stretch.rows.start;
            for (k, _) in stretch.keep.iter().enumerate().filter(|(_, keep)| **keep) {
                let weight = weights.next().map_or(0.0, |weight| f64::from(weight * weight));
                let rows = k * self.decimation..((k + 1) * self.decimation).min(stretch.rows.len());
                out[from + rows.start..from + rows.end].fill(weight / self.decimation as f64);
            }
            for gap in &stretch.bridged {
                out[from + gap.start..from + gap.end].fill(0.0);
            }
        }
        out
    }

    /// Number of rows averaged to one.
    pub(crate) fn decimation(&self) -> usize {
        self.decimation
    }

    /// Squared response of averaging and noise filter at a frequency, as a fraction of the sampling rate.
    pub(crate) fn response(&self, frequency: f64) -> f64 {
        let averaged = if self.decimation > 1 {
            let angle = std::f64::consts::PI * frequency * self.decimation as f64;
            if angle.abs() > 1e-6 { angle.sin() / angle } else { 1.0 }
        } else {
            1.0
        };
        averaged * averaged * self.whitening.power(frequency * self.decimation as f64)
    }

    /// Estimates the noise from a residual (one entry per row of all runs) of a fit; `kept`: share of the noise that
    /// the fit leaves (see [`Whitening::of`]).
    pub(crate) fn learn(&mut self, residual: &[f64], kept: &[f64]) {
        self.learn_up_to(residual, kept, MAX_ORDER);
    }

    /// The same with an autoregression of order `most` at most.
    pub(crate) fn learn_up_to(&mut self, residual: &[f64], kept: &[f64], most: usize) {
        let plain = self.plain(residual);
        let scales: Vec<f64> = self.groups.iter().map(|rows| scale(&plain[rows.clone()])).collect();
        // rows that are bridged, or stand out of the noise, do not tell its colour
        let told = |stretch: &Stretch| {
            let scale = scales[stretch.group];
            let mut x: Vec<f64> = self.averaged(stretch, residual).iter().map(|x| x / scale).collect();
            let is_noise: Vec<bool> = x.iter().map(|x| x.abs() < STANDS_OUT).collect();
            for own in gaps(&is_noise) {
                // an outlying stretch rises and fades on both sides for about its own length
                let around = own.start.saturating_sub(own.len())..(own.end + own.len()).min(x.len());
                x[around].fill(f64::NAN);
            }
            x.iter_mut().zip(&stretch.keep).filter(|(_, keep)| !**keep).for_each(|(x, _)| *x = f64::NAN);
            x
        };
        self.whiten_by(Whitening::of(&self.chained(told), most, kept));
        self.weights = vec![1.0; self.len()];
        let white: Vec<f64> = self.white(residual).into_iter().map(f64::from).collect();
        let is_coarse = is_coarse(self.step_n, self.decimation, rms(&plain));
        for (rows, plain_sigma) in self.groups.iter().zip(&scales) {
            let sigma = scale(&white[rows.clone()]);
            let mut sum = 0.0;
            for n in rows.clone() {
                let size = (white[n] / sigma).abs();
                let weight = if size > TAIL { TAIL / size } else { 1.0 };
                sum += (weight * size) * (weight * size);
                self.weights[n] = (weight / sigma) as f32;
            }
            // coarse steps are searched for as a cause; fine steps add noise that is the same for many rows in a row
            let rounded = if is_coarse { 0.0 } else { following(self.step_n, *plain_sigma) };
            let more = 1.0 + self.within_a_step * rounded / (plain_sigma * plain_sigma);
            // unit variance of what is left of the tails
            let rest = (sum / rows.len().max(1) as f64 * more).sqrt();
            if rest > 0.0 {
                for weight in &mut self.weights[rows.clone()] {
                    *weight /= rest as f32;
                }
            }
        }
    }

    /// Applies `of` to the stretches and joins the results chain by chain: the noise continues where nothing is
    /// compared, and rows there are missing (NaN).
    fn chained(&self, of: impl Fn(&Stretch) -> Vec<f64>) -> Vec<Vec<f64>> {
        let of_chain = |chain: &Chain| -> Vec<f64> {
            let mut rows = Vec::new();
            for (stretch, (missing, _)) in self.stretches[chain.stretches.clone()].iter().zip(&chain.rows) {
                rows.resize(rows.len() + missing, f64::NAN);
                rows.extend(of(stretch));
            }
            rows
        };
        self.chains.iter().map(of_chain).collect()
    }

    /// How much quieter the fast noise of every part of the profile is than the loudest, for every row of all runs: from
    /// third differences of a column (one entry per row of all runs), in which nothing slow is left. 1 where nothing is
    /// compared.
    pub(crate) fn quietness(&self, column: &[f64]) -> Vec<f64> {
        let plain = self.plain(column);
        let of_group = |rows: &Range<usize>| robust_sigma(&third_differences(&plain[rows.clone()]));
        let sigmas: Vec<f64> = self.groups.iter().map(of_group).collect();
        let loudest = sigmas.iter().copied().fold(0.0, f64::max);
        let least = (self.step_n / 12f64.sqrt()).max(QUIETEST * loudest);
        let mut out = vec![1.0; self.starts.last().copied().unwrap_or(0)];
        for stretch in &self.stretches {
            let from = self.starts[stretch.run];
            let sigma = sigmas[stretch.group].max(least);
            if loudest > sigma {
                out[from + stretch.rows.start..from + stretch.rows.end].fill(loudest / sigma);
            }
        }
        out
    }

    /// Variance of a column's rows by [`slowness`].
    pub(crate) fn slowness(&self, column: &[f64]) -> Vec<f64> {
        slowness(&self.chained(|stretch| {
            let mut x = self.averaged(stretch, column);
            x.iter_mut().zip(&stretch.keep).filter(|(_, keep)| !**keep).for_each(|(x, _)| *x = f64::NAN);
            x
        }))
    }

    /// The same rows with Huber weights, for a law that lacks some of the causes: unwhitened, and a row far off
    /// (`residual`: one entry per row of all runs) pulls no more than one at [`HUBER`].
    pub(crate) fn flat(&self, residual: &[f64]) -> Self {
        let mut rows = self.clone();
        rows.whiten_by(Whitening::none());
        let plain = rows.plain(residual);
        for group in &rows.groups {
            let sigma = scale(&plain[group.clone()]);
            for n in group.clone() {
                let size = (plain[n] / sigma).abs();
                rows.weights[n] = ((HUBER / size).min(1.0).sqrt() / sigma) as f32;
            }
        }
        rows
    }

    /// Number of rows down-weighted as outliers by half or more.
    pub(crate) fn tails(&self) -> usize {
        let of_group = |group: &Range<usize>| {
            let weights = &self.weights[group.clone()];
            let largest = weights.iter().copied().fold(0.0, f32::max);
            weights.iter().filter(|weight| **weight < 0.5 * largest).count()
        };
        self.groups.iter().map(of_group).sum()
    }

    /// The same rows with outliers at full weight.
    pub(crate) fn with_tails(&self) -> Self {
        let mut rows = self.clone();
        for group in &self.groups {
            let weights = &mut rows.weights[group.clone()];
            let largest = weights.iter().copied().fold(0.0, f32::max);
            weights.fill(largest);
        }
        rows
    }

    /// Rows of a stretch with gaps bridged, averaged down.
    fn averaged(&self, stretch: &Stretch, column: &[f64]) -> Vec<f64> {
        let from = self.starts[stretch.run] + stretch.rows.start;
        let mut x = column[from..from + stretch.rows.len()].to_vec();
        for gap in &stretch.bridged {
            bridge(&mut x, gap);
        }
        if self.decimation == 1 {
            return x;
        }
        x.chunks(self.decimation).map(|chunk| chunk.iter().sum::<f64>() / chunk.len() as f64).collect()
    }
}

fn scale(x: &[f64]) -> f64 {
    let rms = (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt();
    let robust = robust_sigma(x);
    // coarse quantisation makes the robust estimate 0
    let sigma = if robust > 0.3 * rms { robust } else { rms };
    if sigma > 0.0 { sigma } else { 1e-12 }
}

/// Ranges of rows with at most `bridge` consecutive uncompared rows.
fn stretches(compared: &[bool], bridge: usize) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for n in (0..compared.len()).filter(|n| compared[*n]) {
        match ranges.last_mut() {
            Some(range) if n - range.end <= bridge => range.end = n + 1,
            _ => ranges.push(n..n + 1),
        }
    }
    ranges
}

/// Gram matrices (inner products) of a few whitened columns, block by block.
#[derive(Clone, Debug)]
pub(crate) struct Gram {
    pub(crate) blocks: Vec<Symmetric>,
    pub(crate) total: Symmetric,
    pub(crate) rows: Vec<usize>,
}

impl Gram {
    pub(crate) fn of(columns: &[&[f32]], blocks: &[Range<usize>]) -> Self {
        let size = columns.len();
        let of_block = |rows: &Range<usize>| {
            Symmetric::gram(&columns.iter().map(|column| &column[rows.clone()]).collect::<Vec<_>>())
        };
        let of_blocks: Vec<Symmetric> = blocks.par_iter().map(of_block).collect();
        let mut total = Symmetric::zeros(size);
        of_blocks.iter().for_each(|block| total.accumulate(block, 1.0));
        Gram { blocks: of_blocks, total, rows: blocks.iter().map(|rows| rows.len()).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::run::Part;

    fn run(rows: usize) -> Run {
        Run {
            time_s: (0..rows).map(|n| n as f64 * 0.01).collect(),
            drag_force_n: vec![0.0; rows],
            parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
            ..Run::default()
        }
    }

    #[test]
    fn short_gaps_are_bridged_and_long_ones_part_the_rows() {
        let runs = [run(1000), run(600)];
        let mut compared = vec![true; 1600];
        compared[100..110].fill(false);
        compared[400..500].fill(false);
        let rows = Rows::new(&runs, &compared, 1);
        assert_eq!(rows.len(), 1600 - 110);
        assert_eq!(rows.stretches.iter().map(|s| s.rows.clone()).collect::<Vec<_>>(), [0..400, 500..1000, 0..600]);
        let mut column: Vec<f64> = (0..1600).map(f64::from).collect();
        column[100..110].fill(f64::NAN);
        let plain = rows.plain(&column);
        assert_eq!((plain[99], plain[100], plain[390]), (99.0, 110.0, 500.0));
        assert_eq!(rows.blocks.last().map(|b| b.end), Some(1490));
    }

    #[test]
    fn gram_blocks_add_up() {
        let (a, b): (Vec<f32>, Vec<f32>) = ((0..100).map(|n| n as f32).collect(), vec![1.0; 100]);
        let gram = Gram::of(&[&a, &b], &[0..30, 30..100]);
        assert_eq!(gram.total.get(0, 1), 4950.0);
        assert_eq!(gram.blocks[0].get(1, 1), 30.0);
    }
}
