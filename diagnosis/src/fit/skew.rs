//! Clock skew of force and position: starts and stops, each on their own, come later and later.

use crate::fit::ends::{Edge, Ends, FEWEST};
use crate::numbers::statistics::mean;

/// Standard errors by which the drifts of starts and of stops may differ.
const AGREE: f64 = 3.0;

/// Standard errors from which there is a drift.
const TOLD: f64 = 5.0;

/// Least time by which the clocks must have drifted apart, s; one row where that is longer.
const LEAST_S: f64 = 1e-3;

/// Drift of the delay of starts, or of stops.
struct Drift {
    /// s/s.
    rate: f64,
    error: f64,
    /// Longest time between two of the same run, s.
    seen_s: f64,
}

impl Drift {
    /// ```text
    /// late_k = late_r + rate (t_k - t_r)      r: run
    /// ```
    fn of(edges: &[Edge]) -> Option<Self> {
        let (mut tt, mut tl, mut ll, mut freedom, mut seen_s) = (0.0, 0.0, 0.0, 0usize, 0.0f64);
        for of_run in edges.chunk_by(|a, b| a.run == b.run) {
            let at_s = mean(&of_run.iter().map(|edge| edge.at_s).collect::<Vec<_>>());
            let late_s = mean(&of_run.iter().map(|edge| edge.late_s).collect::<Vec<_>>());
            for edge in of_run {
                let (t, late) = (edge.at_s - at_s, edge.late_s - late_s);
                (tt, tl, ll) = (tt + t * t, tl + t * late, ll + late * late);
            }
            freedom += of_run.len() - 1;
            seen_s = seen_s.max(of_run[of_run.len() - 1].at_s - of_run[0].at_s);
        }
        if freedom < FEWEST || !(tt > 0.0) {
            return None;
        }
        let rate = tl / tt;
        let variance = (ll - rate * tl).max(0.0) / (freedom - 1) as f64;
        Some(Drift { rate, error: (variance / tt).sqrt(), seen_s })
    }
}

/// Clock skew of force and position. A start and the stop behind it share the error of where rows fall, so both
/// together are no more certain than either.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skew {
    /// How fast the force falls behind, s/s.
    rate: f64,
    error: f64,
    /// Time over which it was seen, s.
    seen_s: f64,
}

impl Skew {
    /// `None` where the drift is less than a row, or starts and stops disagree: then the force itself comes later or
    /// sooner after a start.
    pub(crate) fn of(ends: &Ends) -> Option<Self> {
        let (starts, stops) = (Drift::of(&ends.starts.clear)?, Drift::of(&ends.stops.clear)?);
        let (rate, error) = (0.5 * (starts.rate + stops.rate), 0.5 * (starts.error + stops.error));
        let seen_s = starts.seen_s.min(stops.seen_s);
        let is_one = (starts.rate - stops.rate).abs() < AGREE * error;
        let is_told = rate.abs() > TOLD * error && rate.abs() * seen_s > ends.step_s.max(LEAST_S);
        (is_one && is_told).then_some(Skew { rate, error, seen_s })
    }

    /// In words.
    pub(crate) fn said(&self) -> String {
        let Skew { rate, error, seen_s } = self;
        format!(
            "the clocks of force and position drift apart by {:.0} ± {:.0} ppm: within {seen_s:.0} s the force {} by \
             {:.1} ms against the position",
            1e6 * rate.abs(),
            1e6 * error,
            if *rate > 0.0 { "falls behind" } else { "runs ahead" },
            1e3 * rate.abs() * seen_s
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::strokes::{ends, strokes};

    #[test]
    fn clocks_that_drift_apart_are_told_from_a_force_that_is_late() {
        for (late_s, ppm) in [(0.0, 0.0), (4e-3, 0.0), (0.0, 300.0), (-3e-3, -300.0), (0.0, 500.0)] {
            let mut run = strokes(late_s, 0.0, 0.0);
            // the force at t is what it was when its own clock read t
            let force = run.drag_force_n.clone();
            for (n, f) in run.drag_force_n.iter_mut().enumerate() {
                let at = n as f64 * (1.0 - 1e-6 * ppm);
                let (k, part) = (at.floor() as usize, at.fract());
                *f = force[k.min(force.len() - 1)] * (1.0 - part) + force[(k + 1).min(force.len() - 1)] * part;
            }
            let skew = Skew::of(&ends(&run).expect("it rests and starts"));
            let (found_ppm, error_ppm) = skew.map_or((0.0, 0.0), |skew| (1e6 * skew.rate, 1e6 * skew.error));
            assert!((found_ppm - ppm).abs() <= 3.0 * error_ppm, "{found_ppm} ppm for {ppm}: {skew:?}");
            assert!(error_ppm < 0.2 * ppm.abs() || ppm == 0.0, "{skew:?}");
        }
    }
}
