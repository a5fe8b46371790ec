//! Path: movements, turns and rests of the carriage.

use crate::motion::Motion;
use crate::run::Run;

use super::context::FAR_M;

/// Averaging time of a mean position, s: two consecutive means tell motion from rest.
const WINDOW_S: f64 = 0.02;

/// Shortest stop that counts as a rest, s.
const LEAST_REST_S: f64 = 0.05;

/// Row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct Path {
    /// Sign of motion, kept at rest.
    pub(crate) direction: Vec<f64>,
    /// Distance from the first row.
    pub(crate) travel_m: Vec<f64>,
    /// Displacement since the row before along [`Self::direction`]; 0 in the first row of a part.
    pub(crate) step_m: Vec<f64>,
    /// Distance since the last reversal or start.
    pub(crate) since_start_m: Vec<f64>,
    /// Rest before the present movement, s.
    pub(crate) dwell_s: Vec<f64>,
    /// Whether the carriage rests.
    pub(crate) at_rest: Vec<bool>,
    /// First rows of parts.
    pub(crate) starts: Vec<bool>,
}

impl Path {
    pub(crate) fn of(run: &Run, motion: &Motion, zero_m_s: f64) -> Self {
        let rows = run.len();
        let mut path = Path {
            direction: vec![1.0; rows],
            travel_m: vec![0.0; rows],
            step_m: vec![0.0; rows],
            since_start_m: vec![FAR_M; rows],
            dwell_s: vec![0.0; rows],
            at_rest: vec![false; rows],
            starts: vec![false; rows],
        };
        let step_s = run.step_s();
        let reach = if step_s > 0.0 { ((WINDOW_S / step_s) as usize).max(1) } else { 1 };
        let mut travelled = 0.0;
        for part in &run.parts {
            travelled = path.part(run, motion, part.rows.clone(), (zero_m_s, reach), travelled);
        }
        path
    }

    fn part(
        &mut self,
        run: &Run,
        motion: &Motion,
        rows: std::ops::Range<usize>,
        (zero_m_s, reach): (f64, usize),
        mut travelled: f64,
    ) -> f64 {
        if rows.is_empty() {
            return travelled;
        }
        let (x, time) = (&motion.position_m, &run.time_s);
        // the means of the rows before and after differ by the displacement over half the window, with far less noise
        // than two single rows; near the ends of the part the window stays inside it
        let mut sums = Vec::with_capacity(rows.len() + 1);
        sums.push(0.0);
        for n in rows.clone() {
            sums.push(sums[sums.len() - 1] + (x[n] - x[rows.start]));
        }
        let reach = reach.min((rows.len() - 1) / 2);
        let window_s = 2.0 * reach as f64 * (time[rows.end - 1] - time[rows.start]) / rows.len() as f64;
        let sign = |n: usize| {
            // both means include the row itself, so they lie symmetrically around it
            let middle = (n - rows.start).clamp(reach, (rows.len() - 1 - reach).max(reach));
            let (from, to) = (middle - reach, (middle + reach + 1).min(rows.len()));
            let mean = |a: usize, b: usize| (sums[b] - sums[a]) / (b - a).max(1) as f64;
            let span = 0.5 * (time[rows.start + to - 1] - time[rows.start + from]);
            let speed = if span > 0.0 { (mean(middle, to) - mean(from, middle + 1)) / span } else { 0.0 };
            if speed.abs() < zero_m_s || speed == 0.0 { 0.0 } else { speed.signum() }
        };
        self.starts[rows.start] = true;
        let first = rows.clone().map(sign).find(|s| *s != 0.0).unwrap_or(1.0);
        let sets_out = sets_out(run, motion, rows.start);
        let moving = sign(rows.start) != 0.0 && !sets_out;
        let mut direction = first;
        // position of the last start; unknown where the part starts in motion
        let mut start: Option<f64> = (!moving).then(|| x[rows.start]);
        let mut dwell = 0.0;
        let mut resting: Option<f64> = (!moving).then(|| time[rows.start]);
        let mut furthest = x[rows.start];
        for n in rows.clone() {
            let now = if n == rows.start && sets_out { 0.0 } else { sign(n) };
            self.at_rest[n] = now == 0.0;
            let before = if n > rows.start { x[n - 1] } else { x[n] };
            let mut step = direction * (x[n] - before);
            if now == 0.0 {
                resting.get_or_insert(time[n]);
                furthest = if direction * (x[n] - furthest) > 0.0 { x[n] } else { furthest };
            } else {
                // the window shows motion before and after the rest one window too long
                let rested = resting.take().map_or(0.0, |from| time[n] - from + window_s);
                let turned = now != direction;
                if turned {
                    furthest = if direction * (x[n] - furthest) > 0.0 { x[n] } else { furthest };
                    direction = now;
                    travelled += (furthest - before).abs();
                    step = direction * (x[n] - furthest);
                    start = Some(furthest);
                    dwell = 0.0;
                } else if rested >= LEAST_REST_S {
                    start = Some(before);
                }
                if rested >= LEAST_REST_S {
                    dwell = rested;
                }
                furthest = x[n];
            }
            travelled += step;
            self.step_m[n] = step;
            self.direction[n] = direction;
            self.travel_m[n] = travelled.max(0.0);
            self.since_start_m[n] = start.map_or(FAR_M, |place| (direction * (x[n] - place)).max(0.0));
            self.dwell_s[n] = dwell;
        }
        travelled
    }
}

/// Whether the carriage starts from rest in a row: extrapolated back by one row, it would have stood still. Means over
/// a window already see motion there.
fn sets_out(run: &Run, motion: &Motion, row: usize) -> bool {
    let (speed, gain) = (motion.velocity_m_s[row], motion.acceleration_m_s2[row] * run.step_s());
    speed.abs() <= gain.abs()
}
