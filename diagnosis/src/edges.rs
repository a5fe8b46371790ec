//! How late the force follows a start and a stop: what tells a late channel from a filtered one, and both from friction
//! that follows its speed late.
//!
//! ```text
//! g(t) = (F(t) - F_before)/(F_after - F_before)       of one start from rest, or one stop
//! late   time from where the position leaves its rest, or comes to it, to where g passes 1/2
//! tail   ∫ (1 - g) dt behind that, of stops: the force of a carriage that rests is known
//! ```
//!
//! While the motion keeps its direction the three look alike. At its ends they do not: a channel that is late steps late,
//! a filter steps late and leaves a tail, and a friction whose size lags behind has its sign at once. The position leaves
//! its rest so slowly that a start is seen late, and a stop by as much too early: half the sum of both is free of it where
//! the ramps are alike, and how fast they go through two heights tells how alike they are.

use simulation::mechanism::Id;
use simulation::run::Run;

use crate::source::Source;

/// Starts, and stops, below which nothing is said.
const FEWEST: usize = 5;

/// Share of those seen whose force must pass the middle once, and when it does with the others.
const CLEAR: f64 = 0.8;

/// Least window to either side, s and rows.
const WINDOW_S: f64 = 0.06;
const WINDOW_ROWS: usize = 12;

/// Rows next to the step that say nothing of the levels beside it.
const BESIDE: usize = 4;

/// A step, of what the force scatters by at rest.
const STANDS_OUT: f64 = 15.0;

/// Way from rest that is a movement: of what the position scatters by, and at least, m.
const MOVED: f64 = 5.0;
const LEAST_M: f64 = 1e-7;

/// The second height of a ramp, of the first.
const FARTHER: f64 = 20.0;

/// Standard error of the mean lateness of starts, or of stops, from which nothing is said, s.
const SURE_S: f64 = 1e-3;

/// Standard errors that a cause may be off by.
const ERRORS: f64 = 3.0;

/// Tail from which a force is no merely late one, rows, and of what it is late by: a filter's is 0.7 of it.
const TAIL_ROWS: f64 = 0.05;
const TAIL_SHARE: f64 = 0.2;

/// Scatters from the median, and least time, s, beyond which a start or stop is another matter.
const OUTLYING: f64 = 3.0;
const OUTLYING_S: f64 = 0.01;

/// Share of the tail that a filter would leave that must be there.
const PRESENT: f64 = 0.5;

/// What filters before the samples are taken may be late by, s.
const FILTERS_S: f64 = 1e-4;

/// Standard errors from which a force that is late or fades needs no other evidence.
const SPEAKS: f64 = 5.0;

/// Lateness and tail of the force, s, with their standard errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edges {
    late_s: f64,
    late_error_s: f64,
    tail_s: f64,
    tail_error_s: f64,
    step_s: f64,
}

/// One start or stop.
struct Edge {
    late_s: f64,
    tail_s: f64,
    /// Time in which the position goes from the first height to the second.
    ramp_s: f64,
}

impl Edges {
    /// `None` where the runs do not rest often enough, or their force does not step there.
    pub(crate) fn of(runs: &[Run]) -> Option<Self> {
        let (mut starts, mut stops) = (Vec::new(), Vec::new());
        let mut seen = [0usize; 2];
        for run in runs {
            let position = run.position_m.as_ref()?;
            let step_s = run.step_s();
            if !(step_s > 0.0) {
                continue;
            }
            for part in &run.parts {
                let (x, f) = (&position[part.rows.clone()], &run.drag_force_n[part.rows.clone()]);
                let reversed = |values: &[f64]| values.iter().rev().copied().collect::<Vec<f64>>();
                for rest in rests(x) {
                    if let Some(edge) = start(x, f, rest.clone(), step_s) {
                        seen[0] += 1;
                        starts.extend(edge);
                    }
                    // a stop is a start in time reversed: late there is early here
                    let back = x.len() - rest.end..x.len() - rest.start;
                    if let Some(edge) = start(&reversed(x), &reversed(f), back, step_s) {
                        seen[1] += 1;
                        stops.extend(edge.map(|edge| Edge { late_s: -edge.late_s, ..edge }));
                    }
                }
            }
        }
        let starts = alike(starts, seen[0])?;
        let stops = alike(stops, seen[1])?;
        let of = |edges: &[Edge], what: fn(&Edge) -> f64| mean(&edges.iter().map(what).collect::<Vec<_>>());
        let (start, stop) = (of(&starts, |edge| edge.late_s), of(&stops, |edge| edge.late_s));
        if start.1 > SURE_S || stop.1 > SURE_S {
            return None;
        }
        let ramp = |edges: &[Edge]| level(&edges.iter().map(|edge| edge.ramp_s).collect::<Vec<_>>()).map(|(s, _)| s);
        // play lets a start alone be late
        if start.0 - stop.0 > ERRORS * start.1.hypot(stop.1) {
            return None;
        }
        let unlike_s = 0.5 * (ramp(&starts)? - ramp(&stops)?).abs();
        let tail = of(&stops, |edge| edge.tail_s);
        Some(Edges {
            late_s: 0.5 * (start.0 + stop.0),
            late_error_s: (0.5 * start.1.hypot(stop.1)).hypot(FILTERS_S) + unlike_s / ERRORS,
            tail_s: tail.0,
            tail_error_s: tail.1,
            step_s: runs.iter().map(Run::step_s).find(|step| *step > 0.0)?,
        })
    }

    /// Whether a cause may act so that the force has these edges.
    pub(crate) fn allow(&self, source: &Source) -> bool {
        let Source::Mechanism { definition, form, shape } = source else { return true };
        match definition.id {
            Id::FrictionalLag => self.late_s.abs() <= self.slack_s(),
            Id::TimeMisalignment => {
                let (least, most) = self.delays();
                !self.has_tail() && shape.first().is_none_or(|delay| (least..=most).contains(delay))
            }
            Id::ForceLowpass => {
                let time = shape.first().copied().unwrap_or(0.0) * if *form == 0 { 1.0 } else { 2.0 };
                // behind its middle exp(-t/τ) has half of its area
                let is_there = self.tail_s + ERRORS * self.tail_error_s >= PRESENT * 0.5 * time;
                is_there && (!self.is_late() || self.tail_s > ERRORS * self.tail_error_s)
            }
            _ => true,
        }
    }

    /// Whether starts and stops alone are evidence for a cause, whatever the rest of the recording shows of it.
    pub(crate) fn speak_for(&self, source: &Source) -> bool {
        let is_faded = self.has_tail() && self.tail_s > SPEAKS * self.tail_error_s;
        source.is(Id::TimeMisalignment) && self.is_late() || source.is(Id::ForceLowpass) && is_faded
    }

    /// Whether the force is surely late and does not fade.
    fn is_late(&self) -> bool {
        self.late_s.abs() > SPEAKS * self.late_error_s && !self.has_tail()
    }

    /// p-value of "the force is neither late nor fades".
    pub(crate) fn p(&self) -> f64 {
        let p = |errors: f64| libm::erfc(errors.abs() / std::f64::consts::SQRT_2);
        p(self.late_s / self.late_error_s).min(p(self.tail_s / self.tail_error_s))
    }

    /// Keeps the amplitudes of a cause to what the edges tell of them.
    pub(crate) fn bind(&self, source: &Source, bounds: &mut [(f64, f64)]) {
        let Source::Mechanism { definition, form: 0, .. } = source else { return };
        if definition.id == Id::TimeMisalignment {
            let (least, most) = self.delays();
            bounds.iter_mut().for_each(|bounds| *bounds = (bounds.0.max(least), bounds.1.min(most)));
        }
    }

    fn slack_s(&self) -> f64 {
        ERRORS * self.late_error_s
    }

    /// Least and largest delay of the whole force, s.
    fn delays(&self) -> (f64, f64) {
        (self.late_s - self.slack_s(), self.late_s + self.slack_s())
    }

    /// Whether the force fades where a carriage stops, in time with its being late.
    fn has_tail(&self) -> bool {
        let least = (TAIL_ROWS * self.step_s).max(TAIL_SHARE * self.late_s);
        self.late_s > self.slack_s() && self.tail_s > least + ERRORS * self.tail_error_s
    }
}

/// Those without outliers; `None` where too few of what was seen are left.
fn alike(mut edges: Vec<Edge>, seen: usize) -> Option<Vec<Edge>> {
    let (middle, scatter) = level(&edges.iter().map(|edge| edge.late_s).collect::<Vec<_>>())?;
    edges.retain(|edge| (edge.late_s - middle).abs() <= (OUTLYING * scatter).max(OUTLYING_S));
    (edges.len() >= FEWEST && edges.len() as f64 >= CLEAR * seen as f64).then_some(edges)
}

/// Rests of a part: rows between which the position stays where it is.
fn rests(x: &[f64]) -> Vec<std::ops::Range<usize>> {
    if x.len() < 4 * WINDOW_ROWS {
        return Vec::new();
    }
    let way: Vec<f64> = x.windows(5).map(|five| (five[4] - five[0]).abs()).collect();
    let mut sorted: Vec<f64> = way.iter().copied().filter(|w| w.is_finite()).collect();
    if sorted.is_empty() {
        return Vec::new();
    }
    let few = sorted.len() / 50;
    let quiet = *sorted.select_nth_unstable_by(few, f64::total_cmp).1;
    let limit = (4.0 * quiet).max(LEAST_M);
    let mut rests = Vec::new();
    let mut from = None;
    for n in 0..=way.len() {
        match (way.get(n).is_some_and(|way| *way <= limit), from) {
            (true, None) => from = Some(n + 2),
            (false, Some(start)) => {
                if n + 2 - start >= 2 * WINDOW_ROWS {
                    rests.push(start..n + 2);
                }
                from = None;
            }
            _ => {}
        }
    }
    rests
}

/// The start that ends a rest. `None` where none is seen or the force does not step; the inner `None` where it does so
/// without passing its middle once.
fn start(x: &[f64], f: &[f64], rest: std::ops::Range<usize>, step_s: f64) -> Option<Option<Edge>> {
    let window = ((WINDOW_S / step_s) as usize).max(WINDOW_ROWS);
    let inner = rest.start + BESIDE..rest.end - BESIDE;
    let (place, scatter) = level(&x[inner.clone()])?;
    let height = (MOVED * scatter).max(LEAST_M);
    let middle = (inner.start + inner.end) / 2;
    let leaves = |height: f64| (middle..x.len()).find(|n| !((x[*n] - place).abs() <= height));
    let (at, farther) = (leaves(height)?, leaves(FARTHER * height)?);
    let (from, to) = (at.checked_sub(window)?, at + window);
    if to >= f.len() || from < rest.start || f[from..to].iter().any(|f| !f.is_finite()) {
        return None;
    }
    // a force that changes within a rest scatters more than it does at rest
    let (before, noise) = (level(&f[inner.clone()])?.0, scatter_of(&f[inner])?);
    let (after, _) = level(&f[at + BESIDE..to])?;
    if !((after - before).abs() > STANDS_OUT * noise.max(1e-9)) {
        return None;
    }
    let moved = |n: usize| (f[n] - before) / (after - before);
    let mut passes = (from + 1..to).filter(|n| (moved(*n) >= 0.5) != (moved(n - 1) >= 0.5));
    let (Some(passed), None) = (passes.next(), passes.next()) else { return Some(None) };
    let tail: f64 = (from..passed).rev().take(WINDOW_ROWS).map(moved).sum();
    Some(Some(Edge {
        late_s: (passed as f64 - at as f64) * step_s,
        tail_s: tail * step_s,
        ramp_s: (farther - at) as f64 * step_s,
    }))
}

/// Median and scatter of some values.
fn level(values: &[f64]) -> Option<(f64, f64)> {
    let median = |mut values: Vec<f64>| {
        let middle = values.len() / 2;
        (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
    };
    let middle = median(values.iter().copied().filter(|x| x.is_finite()).collect())?;
    let off = median(values.iter().map(|x| (x - middle).abs()).filter(|x| x.is_finite()).collect())?;
    Some((middle, 1.4826 * off))
}

/// Standard deviation of the values that are there.
fn scatter_of(values: &[f64]) -> Option<f64> {
    let finite: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    let count = finite.len() as f64;
    (finite.len() > 1).then(|| mean(&finite).1 * count.sqrt())
}

/// Mean and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (mean, (squares / (count - 1.0).max(1.0) / count).sqrt())
}
