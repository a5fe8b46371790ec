//! Whether spots lie where the acceleration changes: there whatever is late, filtered or follows a noisy speed leaves
//! something as short as a spot, and dirt lies anywhere.

use crate::beside::pulses::Track;
use crate::numbers::statistics::at_least;

/// Part of the way on which the acceleration changes most.
const CORNERS: f64 = 0.1;

/// Probability of so many spots there by chance, below which they are no dirt. Of the dirt in trial 34 a quarter lay
/// there at most (docs/decisions/0003-diagnosis.md).
const CHANCE: f64 = 1e-3;

/// Travel to either side over which the change is taken, m, and at least, in rows: what is left of a corner lies beside
/// it.
const BESIDE_M: f64 = 2e-3;
const BESIDE_ROWS: usize = 3;

/// Whether more of the spots (track, row) lie on the tenth of the way on which the acceleration changes most than
/// chance puts there.
pub(crate) fn are_at_corners(tracks: &[Track], spots: &[(usize, usize)]) -> bool {
    let changes: Vec<Vec<f64>> = tracks.iter().map(changes).collect();
    let (mut way, mut all_m) = (Vec::new(), 0.0);
    for (track, changes) in tracks.iter().zip(&changes) {
        for n in (0..changes.len()).filter(|n| track.is_told[*n]) {
            let travel_m = track.speed_m_s[n] * track.step_s;
            all_m += travel_m;
            way.push((changes[n], travel_m));
        }
    }
    way.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut so_far_m = 0.0;
    let least = way.iter().find(|(_, travel_m)| {
        so_far_m += travel_m;
        so_far_m > CORNERS * all_m
    });
    least.is_some_and(|(least, _)| {
        let there = spots.iter().filter(|(track, n)| changes[*track][*n] > *least).count();
        at_least(there, spots.len() - there, CORNERS) < CHANCE
    })
}

/// Difference of the accelerations on both sides of each row, m/s².
fn changes(track: &Track) -> Vec<f64> {
    let a = &track.acceleration_m_s2;
    let change = |(n, (from, to)): (usize, (usize, usize))| {
        let from = from.min(n.saturating_sub(BESIDE_ROWS));
        let to = to.max((n + BESIDE_ROWS).min(a.len() - 1));
        (a[to] - a[from]).abs()
    };
    track.windows(BESIDE_M).into_iter().enumerate().map(change).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four strokes at 0.1 m/s, each with one place where the acceleration changes.
    #[test]
    fn what_lies_where_the_acceleration_changes_is_no_dirt() {
        let (rows, corner) = (500, 200);
        // noise of an acceleration that is derived, and a corner
        let noise = |n: usize| 0.01 * ((n * 7919) % 101) as f64 / 101.0;
        let track = |start: usize| Track {
            rows: start..start + rows,
            step_s: 0.01,
            travel_m: (0..rows).map(|n| 1e-3 * n as f64).collect(),
            speed_m_s: vec![0.1; rows],
            acceleration_m_s2: (0..rows).map(|n| noise(start + n) + if n > corner { 1.0 } else { 0.0 }).collect(),
            left_n: vec![0.0; rows],
            braking: vec![0.0; rows],
            compared: vec![true; rows],
            is_built_up: vec![true; rows],
            is_told: vec![true; rows],
        };
        let tracks = [0, 1, 2, 3].map(|stroke| track(stroke * rows));
        let at = |places: [usize; 4]| [0, 1, 2, 3].map(|stroke| (stroke, places[stroke]));
        assert!(are_at_corners(&tracks, &at([199, 200, 201, 202])));
        assert!(!are_at_corners(&tracks, &at([60, 200, 350, 480])));
    }
}
