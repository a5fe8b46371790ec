//! Starts from rest and stops, as the rows show them: when the force passes half of its step, and how much is left
//! after that.
//!
//! ```text
//! g(t) = (F(t) - F_before)/(F_after - F_before)       of one start from rest, or one stop
//! late   time from where the position leaves (or reaches) its rest to where g passes 1/2
//! tail   ∫ (1 - g) dt after that, of stops, to the end of the window: the force of a resting carriage is known
//! near   the same of the first rows only, above the mean of those behind them: slow noise cancels
//! ```
//!
//! Where the acceleration was measured, F excludes the inertial force of the known mass: where that exceeds the
//! friction, F would pass its middle at another time.

use simulation::run::Run;

use crate::numbers::statistics::{mean, median, robust_sigma, scatter};

/// Fewest starts, and fewest stops, for any conclusion.
pub(super) const FEWEST: usize = 5;

/// Least share of those seen that must be clear: force passing its middle once, at about the same delay as the others.
const CLEAR: f64 = 0.8;

/// Least window to either side, in s and in rows.
const WINDOW_S: f64 = 0.06;
const WINDOW_ROWS: usize = 12;

/// Rows next to the step that are not used for the levels beside it.
const BESIDE: usize = 4;

/// Least step of the force, as a multiple of its scatter at rest.
const STANDS_OUT: f64 = 15.0;

/// The quietest window in so many defines rest; the path in a window of rest, as a multiple of that window's.
const FEW: usize = 50;
const STILL: f64 = 3.0;

/// Distance from rest that counts as movement: as a multiple of the position's scatter, and at least, m.
const MOVED: f64 = 5.0;
const LEAST_M: f64 = 1e-7;

/// Second threshold of a start, as a multiple of the first, and the number of windows within which it must be reached.
const FARTHER: f64 = 20.0;
const RAMP: usize = 10;

/// Rows in which a fast filter fades, and the rows behind them that they are compared with.
const NEAR: usize = 2;
const BEHIND: usize = 6;

/// Robust standard deviations from the median, and the least time, s, beyond which a start or stop is an outlier.
const OUTLYING: f64 = 3.0;
const OUTLYING_S: f64 = 0.01;

/// One start or stop.
pub(super) struct Edge {
    pub(super) run: usize,
    /// Time within its run.
    pub(super) at_s: f64,
    pub(super) late_s: f64,
    pub(super) tail_s: f64,
    pub(super) near_s: f64,
    /// Time that the position takes from the first threshold to the second.
    ramp_s: f64,
}

/// Starts, or stops, of all runs.
#[derive(Default)]
pub(super) struct Seen {
    /// Those whose force passes its middle once, with about the delay of the others.
    pub(super) clear: Vec<Edge>,
    /// Number of all seen.
    number: usize,
}

impl Seen {
    /// Whether there are enough of them, and nearly all are clear.
    pub(super) fn say_something(&self) -> bool {
        self.clear.len() >= FEWEST && self.clear.len() as f64 >= CLEAR * self.number as f64
    }

    /// Median time that the position takes from the first threshold to the second; `None` without a clear one.
    pub(super) fn ramp_s(&self) -> Option<f64> {
        level(&self.clear.iter().map(|edge| edge.ramp_s).collect::<Vec<_>>()).map(|(ramp_s, _)| ramp_s)
    }

    /// Removes outliers.
    fn alike(mut self) -> Self {
        if let Some((middle, scatter)) = level(&self.clear.iter().map(|edge| edge.late_s).collect::<Vec<_>>()) {
            self.clear.retain(|edge| (edge.late_s - middle).abs() <= (OUTLYING * scatter).max(OUTLYING_S));
        }
        self
    }
}

/// Starts and stops of all runs.
pub(crate) struct Ends {
    pub(super) starts: Seen,
    pub(super) stops: Seen,
    /// Time between two rows, s.
    pub(super) step_s: f64,
}

impl Ends {
    /// `None` without a position. Rows `held` back (one entry per row of all runs) are not used. `mass_kg`: known moved
    /// mass.
    pub(crate) fn of(runs: &[Run], held: &[bool], mass_kg: f64) -> Option<Self> {
        let (mut starts, mut stops) = (Seen::default(), Seen::default());
        let mut rest_of_held = held;
        for (number, run) in runs.iter().enumerate() {
            let (held, others) = rest_of_held.split_at(run.len().min(rest_of_held.len()));
            rest_of_held = others;
            let position = run.position_m.as_ref()?;
            let step_s = run.step_s();
            if !(step_s > 0.0) {
                continue;
            }
            let is_held = held.iter().chain(std::iter::repeat(&false));
            let force: Vec<f64> = friction(run, mass_kg)
                .into_iter()
                .zip(is_held)
                .map(|(f, held)| if *held { f64::NAN } else { f })
                .collect();
            for part in &run.parts {
                let (x, f) = (&position[part.rows.clone()], &force[part.rows.clone()]);
                let rests = rests(x);
                if rests.is_empty() {
                    continue;
                }
                let reversed = |values: &[f64]| values.iter().rev().copied().collect::<Vec<f64>>();
                let (x_back, f_back) = (reversed(x), reversed(f));
                let at_s = |row: usize| run.time_s[part.rows.start + row.min(x.len() - 1)];
                for rest in rests {
                    if let Some(edge) = start(x, f, rest.clone(), step_s) {
                        starts.number += 1;
                        starts.clear.extend(edge.map(|edge| Edge { run: number, at_s: at_s(rest.end), ..edge }));
                    }
                    // a stop is a start in reversed time: late there is early here
                    let back = x.len() - rest.end..x.len() - rest.start;
                    if let Some(edge) = start(&x_back, &f_back, back, step_s) {
                        stops.number += 1;
                        let of =
                            |edge: Edge| Edge { run: number, at_s: at_s(rest.start), late_s: -edge.late_s, ..edge };
                        stops.clear.extend(edge.map(of));
                    }
                }
            }
        }
        let step_s = runs.iter().map(Run::step_s).find(|step| *step > 0.0)?;
        Some(Ends { starts: starts.alike(), stops: stops.alike(), step_s })
    }

    /// Time that is examined to either side of a start or stop, s.
    pub(super) fn window_s(&self) -> f64 {
        window(self.step_s) as f64 * self.step_s
    }
}

/// Rows of a window.
fn window(step_s: f64) -> usize {
    ((WINDOW_S / step_s) as usize).max(WINDOW_ROWS)
}

/// The force less the inertial force, where the acceleration was measured.
fn friction(run: &Run, mass_kg: f64) -> Vec<f64> {
    match run.acceleration_m_s2.as_ref().filter(|_| mass_kg > 0.0) {
        Some(acceleration) => run.drag_force_n.iter().zip(acceleration).map(|(f, a)| f - mass_kg * a).collect(),
        None => run.drag_force_n.clone(),
    }
}

/// Rests of a part: rows over which the position moves hardly more than in its quietest windows.
fn rests(x: &[f64]) -> Vec<std::ops::Range<usize>> {
    if x.len() < 4 * WINDOW_ROWS {
        return Vec::new();
    }
    let steps: Vec<f64> = x.windows(2).map(|two| (two[1] - two[0]).abs()).collect();
    let way: Vec<f64> = steps.windows(WINDOW_ROWS).map(|steps| steps.iter().sum()).collect();
    let mut sorted: Vec<f64> = way.iter().copied().filter(|way| way.is_finite()).collect();
    if sorted.is_empty() {
        return Vec::new();
    }
    let few = sorted.len() / FEW;
    let quiet = *sorted.select_nth_unstable_by(few, f64::total_cmp).1;
    let limit = (STILL * quiet).max(WINDOW_ROWS as f64 * LEAST_M);
    let mut rests = Vec::new();
    let mut from = None;
    for n in 0..=way.len() {
        match (way.get(n).is_some_and(|way| *way <= limit), from) {
            (true, None) => from = Some(n),
            (false, Some(start)) => {
                let rest = start..n - 1 + WINDOW_ROWS;
                if rest.len() >= 2 * WINDOW_ROWS {
                    rests.push(rest);
                }
                from = None;
            }
            _ => {}
        }
    }
    rests
}

/// The start that ends a rest. `None` where none is seen or the force does not step; the inner `None` where the force
/// steps but does not pass its middle exactly once.
fn start(x: &[f64], f: &[f64], rest: std::ops::Range<usize>, step_s: f64) -> Option<Option<Edge>> {
    let window = window(step_s);
    let inner = rest.start + BESIDE..rest.end - BESIDE;
    let (place, off) = level(&x[inner.clone()])?;
    let height = (MOVED * off).max(LEAST_M);
    let middle = (inner.start + inner.end) / 2;
    let ramp_ends = (rest.end + RAMP * window).min(x.len());
    let way = |n: usize| (x[n] - place).abs();
    // linear interpolation between rows
    let leaves = |height: f64| {
        let n = (middle..ramp_ends).find(|n| !(way(*n) <= height))?;
        let before = n.checked_sub(1).map_or(0.0, way);
        let part = (height - before) / (way(n) - before);
        Some((n, n as f64 - 1.0 + if (0.0..=1.0).contains(&part) { part } else { 1.0 }))
    };
    let ((at, left), (_, farther)) = (leaves(height)?, leaves(FARTHER * height)?);
    let (from, to) = (at.checked_sub(window)?, at + window);
    if to >= f.len() || from < rest.start || f[from..to].iter().any(|f| !f.is_finite()) {
        return None;
    }
    // plain scatter, not the robust one: a force that changes within a rest must count as noise
    let (before, noise) = (level(&f[inner.clone()])?.0, scatter(&finite(&f[inner])));
    let (after, _) = level(&f[at + BESIDE..to])?;
    if !((after - before).abs() > STANDS_OUT * noise.max(1e-9)) {
        return None;
    }
    let moved = |n: usize| (f[n] - before) / (after - before);
    let mut passes = (from + 1..to).filter(|n| (moved(*n) >= 0.5) != (moved(n - 1) >= 0.5));
    let (Some(passed), None) = (passes.next(), passes.next()) else { return Some(None) };
    let half = passed as f64 - 1.0 + (0.5 - moved(passed - 1)) / (moved(passed) - moved(passed - 1));
    let tail: f64 = (from..passed).map(moved).sum();
    let near = passed.saturating_sub(NEAR).max(from);
    let behind: Vec<f64> = (near.saturating_sub(BEHIND).max(from)..near).map(moved).collect();
    let above: f64 = (near..passed).map(moved).sum::<f64>() - (passed - near) as f64 * mean(&behind);
    Some(Some(Edge {
        run: 0,
        at_s: 0.0,
        late_s: (half - left) * step_s,
        tail_s: tail * step_s,
        near_s: above * step_s,
        ramp_s: (farther - left) * step_s,
    }))
}

/// Median and robust scatter of the finite values.
fn level(values: &[f64]) -> Option<(f64, f64)> {
    let finite = finite(values);
    let middle = median(finite.clone())?;
    Some((middle, robust_sigma(&finite.iter().map(|x| x - middle).collect::<Vec<_>>())))
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|x| x.is_finite()).collect()
}
