//! Pulses: a matched filter for short pulses of one width, behind the noise filter.
//!
//! For a pulse `s` in a mismatch `r` that the noise filter `W` whitens, `sᵀ(WᵀW r)` is the sufficient statistic. Its
//! scale is its own robust deviation over rows where a pulse has about as many rows, either in the same part or over
//! all, whichever is larger: noise of any colour then gives scores of size 1, and noise of symmetric distribution as
//! many below as above 0, whatever its tails.

use std::ops::Range;

use crate::noise::MAX_ORDER;
use crate::numbers::statistics::robust_sigma;

/// Classes of pulse duration (rows) per octave: the scale changes little within one.
const CLASSES_AN_OCTAVE: f64 = 2.0;

/// Longest pulse that is told from longer ones, rows.
const LONGEST_ROWS: f64 = 1e5;

/// Number of adjacent pulses needed to estimate a scale to within a fifth.
const SIDE_BY_SIDE: f64 = 20.0;

/// Score that stands out: Gaussian noise gives one in ten recordings.
pub(crate) const OUTSTANDING: f64 = 4.5;

/// Travel between two pulses that count separately, m: several lengths, so that the filtered flanks of one pulse are
/// not another.
const APART_M: f64 = 4e-3;

/// Data along the rows of one part of a run.
pub(crate) struct Track {
    /// Its rows among those of all runs, concatenated.
    pub(crate) rows: Range<usize>,
    pub(crate) step_s: f64,
    pub(crate) travel_m: Vec<f64>,
    pub(crate) speed_m_s: Vec<f64>,
    pub(crate) acceleration_m_s2: Vec<f64>,
    /// `r`, positive against the motion, N.
    pub(crate) left_n: Vec<f64>,
    /// `WᵀW r`, positive against the motion, over its scale; 0 where not compared.
    pub(crate) braking: Vec<f64>,
    pub(crate) compared: Vec<bool>,
    /// Rows far from a reversal or a start.
    pub(crate) is_built_up: Vec<bool>,
    /// Rows where a pulse can be told from other transients.
    pub(crate) is_told: Vec<bool>,
}

impl Track {
    /// First and last row within so much travel of each row, m.
    pub(crate) fn windows(&self, reach_m: f64) -> Vec<(usize, usize)> {
        let x = &self.travel_m;
        let (mut from, mut to) = (0, 0);
        (0..x.len())
            .map(|n| {
                while x[n] - x[from] > reach_m {
                    from += 1;
                }
                to = to.max(n);
                while to + 1 < x.len() && x[to + 1] - x[n] <= reach_m {
                    to += 1;
                }
                (from, to)
            })
            .collect()
    }
}

/// The common width of all pulses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Width {
    /// m of travel.
    Length(f64),
    /// s.
    Duration(f64),
}

impl Width {
    /// Rows of a pulse.
    fn rows(self, speed_m_s: f64, step_s: f64) -> f64 {
        match self {
            Width::Length(length_m) => length_m / (speed_m_s * step_s).max(1e-12),
            Width::Duration(duration_s) => duration_s / step_s.max(1e-12),
        }
    }
}

/// Score of a pulse centred on every row, track by track; 0 where it has no scale.
pub(crate) fn scores(tracks: &[Track], width: Width) -> Vec<Vec<f64>> {
    let (mut filtered, mut classes): (Vec<Vec<f64>>, Vec<Vec<Option<usize>>>) = (Vec::new(), Vec::new());
    let (mut everywhere, mut by_track) = (Classes::default(), Vec::new());
    for track in tracks {
        let (of_track, is_whole) = matched(track, width);
        let class = |n: usize| {
            let rows = width.rows(track.speed_m_s[n], track.step_s).clamp(1.0, LONGEST_ROWS);
            is_whole[n].then(|| (CLASSES_AN_OCTAVE * rows.log2()).round() as usize)
        };
        let of_rows: Vec<Option<usize>> = (0..of_track.len()).map(class).collect();
        let mut own = Classes::default();
        for (n, class) in of_rows.iter().enumerate().filter(|(n, _)| track.is_told[*n]) {
            if let Some(class) = class {
                own.push(*class, of_track[n]);
                everywhere.push(*class, of_track[n]);
            }
        }
        by_track.push(own.scales());
        filtered.push(of_track);
        classes.push(of_rows);
    }
    let everywhere = everywhere.scales();
    let of_class = |scales: &[f64], class: usize| scales.get(class).copied().unwrap_or(0.0);
    for ((of_track, classes), own) in filtered.iter_mut().zip(classes).zip(&by_track) {
        for (x, class) in of_track.iter_mut().zip(classes) {
            let scale = class.map_or(0.0, |class| of_class(own, class).max(of_class(&everywhere, class)));
            *x = if scale > 0.0 { *x / scale } else { 0.0 };
        }
    }
    filtered
}

/// Filtered rows by class of pulse duration.
#[derive(Default)]
struct Classes(Vec<Vec<f64>>);

impl Classes {
    fn push(&mut self, class: usize, x: f64) {
        self.0.resize(self.0.len().max(class + 1), Vec::new());
        self.0[class].push(x);
    }

    /// Scale of every class; 0 where too few adjacent pulses determine it.
    fn scales(&self) -> Vec<f64> {
        let scale = |(class, members): (usize, &Vec<f64>)| {
            let rows = (class as f64 / CLASSES_AN_OCTAVE).exp2();
            if members.len() as f64 >= SIDE_BY_SIDE * rows { robust_sigma(members) } else { 0.0 }
        };
        self.0.iter().enumerate().map(scale).collect()
    }
}

/// Correlation with a triangle (close to any smooth pulse) at every row, and whether all rows under it are compared.
///
/// ```text
/// y(n) = Σ max(0, 1 - |u(m) - u(n)|) x(m),  u in units of half the base
/// ```
///
/// computed from running sums of `x` and `u x`, so that wide pulses cost no more than narrow ones.
fn matched(track: &Track, width: Width) -> (Vec<f64>, Vec<bool>) {
    let start_m = track.travel_m.first().copied().unwrap_or(0.0);
    let u: Vec<f64> = match width {
        Width::Length(length_m) => track.travel_m.iter().map(|x| 2.0 * (x - start_m) / length_m).collect(),
        Width::Duration(duration_s) => {
            (0..track.travel_m.len()).map(|n| 2.0 * track.step_s * n as f64 / duration_s).collect()
        }
    };
    let (mut sums, mut moments, mut missing) = (vec![0.0], vec![0.0], vec![0usize]);
    let (mut sum, mut moment, mut missed) = (0.0, 0.0, 0);
    for ((x, u), compared) in track.braking.iter().zip(&u).zip(&track.compared) {
        sum += x;
        moment += u * x;
        missed += usize::from(!compared);
        sums.push(sum);
        moments.push(moment);
        missing.push(missed);
    }
    let (mut from, mut to) = (0, 0);
    let (mut out, mut is_whole) = (Vec::with_capacity(u.len()), Vec::with_capacity(u.len()));
    for (n, here) in u.iter().enumerate() {
        while from < n && u[from] <= here - 1.0 {
            from += 1;
        }
        to = to.max(n + 1);
        while to < u.len() && u[to] < here + 1.0 {
            to += 1;
        }
        let before = (1.0 - here) * (sums[n] - sums[from]) + (moments[n] - moments[from]);
        let behind = (1.0 + here) * (sums[to] - sums[n]) - (moments[to] - moments[n]);
        out.push(before + behind);
        is_whole.push(missing[to] == missing[from]);
    }
    (out, is_whole)
}

/// Rows of a track with peaks of the score, of either sign, beyond a limit, the largest first; one per range over which
/// a pulse and its filtered flanks extend.
pub(crate) fn outstanding(track: &Track, scores: &[f64], beyond: f64, admitted: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut standing: Vec<usize> = (0..scores.len()).filter(|n| scores[*n].abs() > beyond && admitted(*n)).collect();
    standing.sort_by(|a, b| scores[*b].abs().total_cmp(&scores[*a].abs()));
    let mut is_taken = vec![false; scores.len()];
    let mut peaks = Vec::new();
    for n in standing {
        if is_taken[n] {
            continue;
        }
        peaks.push(n);
        let is_near = |m: usize| m.abs_diff(n) < MAX_ORDER || (track.travel_m[m] - track.travel_m[n]).abs() < APART_M;
        for m in (0..n).rev().take_while(|m| is_near(*m)).chain((n..scores.len()).take_while(|m| is_near(*m))) {
            is_taken[m] = true;
        }
    }
    peaks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(rows: usize, speed_m_s: f64, braking: Vec<f64>) -> Track {
        Track {
            rows: 0..rows,
            step_s: 0.01,
            travel_m: (0..rows).map(|n| n as f64 * 0.01 * speed_m_s).collect(),
            speed_m_s: vec![speed_m_s; rows],
            acceleration_m_s2: vec![0.0; rows],
            left_n: braking.clone(),
            braking,
            compared: vec![true; rows],
            is_built_up: vec![true; rows],
            is_told: vec![true; rows],
        }
    }

    #[test]
    fn running_sums_give_the_triangle() {
        let braking: Vec<f64> = (0..300).map(|n| (f64::from(n) * 0.37).sin() + 2.0).collect();
        let track = track(300, 0.02, braking.clone());
        let (out, is_whole) = matched(&track, Width::Length(3e-3));
        for (n, out) in out.iter().enumerate() {
            let weight = |m: usize| (1.0 - (m as f64 - n as f64).abs() * 2e-4 / 1.5e-3).max(0.0);
            let sum: f64 = braking.iter().enumerate().map(|(m, x)| weight(m) * x).sum();
            assert!((out - sum).abs() < 1e-9, "row {n}: {out} {sum}");
        }
        assert!(is_whole.iter().all(|is_whole| *is_whole));
    }

    #[test]
    fn nothing_and_constants_have_no_score() {
        assert!(scores(&[], Width::Length(1e-3)).is_empty());
        let flat = [track(0, 0.02, Vec::new()), track(500, 0.0, vec![0.0; 500])];
        for width in [Width::Length(1e-3), Width::Duration(0.05), Width::Duration(f64::NAN)] {
            assert!(scores(&flat, width).iter().flatten().all(|score| *score == 0.0));
        }
    }
}
