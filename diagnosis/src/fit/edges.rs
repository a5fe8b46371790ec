//! How late the force follows a start and a stop: what tells a late channel from a filtered one, and both from friction
//! that follows its speed late.
//!
//! ```text
//! g(t) = (F(t) - F_before)/(F_after - F_before)       of one start from rest, or one stop
//! late   time from where the position leaves its rest, or comes to it, to where g passes 1/2
//! tail   ∫ (1 - g) dt behind that, of stops, as far as the window goes: the force of a carriage that rests is known
//! near   the same of the first rows, above those behind them: slow noise has no part in it
//! ```
//!
//! While the motion keeps its direction the three look alike. At its ends they do not: a channel that is late steps late,
//! a filter steps late and leaves a tail, and a friction whose size lags behind has its sign at once. The position leaves
//! its rest so slowly that a start is seen late, and a stop by as much too early: half the sum of both is free of it where
//! the ramps are alike, and how fast they go through two heights tells how alike they are. Where the acceleration was measured, the force that
//! a known mass takes is none of F: one that is larger than the friction would pass the middle elsewhere.

use simulation::mechanism::Id;
use simulation::run::Run;

use crate::fit::source::Source;
use crate::noise::locks::least_of;
use crate::numbers::statistics::{mean, median, robust_sigma, scatter};

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

/// One window in so many is one of rest; way within others, of what it is there.
const FEW: usize = 50;
const STILL: f64 = 3.0;

/// Way from rest that is a movement: of what the position scatters by, and at least, m.
const MOVED: f64 = 5.0;
const LEAST_M: f64 = 1e-7;

/// The second height of a ramp, of the first, and windows within which it must be reached.
const FARTHER: f64 = 20.0;
const RAMP: usize = 10;

/// Standard error of the mean lateness of starts, or of stops, from which nothing is said, s.
const SURE_S: f64 = 1e-3;

/// Rows by which starts may be later than stops without play: a law has no force at once either.
const PLAY_ROWS: f64 = 0.5;

/// Standard errors that a cause may be off by.
const ERRORS: f64 = 3.0;

/// Standard errors from which a force is taken to fade.
const FADES: f64 = 4.0;

/// Tail from which a force is no merely late one, s, rows, and of what it is late by: a filter's is 0.7 of it.
const TAIL_S: f64 = 2e-4;
const TAIL_ROWS: f64 = 0.05;
const TAIL_SHARE: f64 = 0.2;

/// Rows in which a filter that is fast fades, and those behind them that they are held against.
const NEAR: usize = 2;
const BEHIND: usize = 6;

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
    near_s: f64,
    near_error_s: f64,
    step_s: f64,
    window_s: f64,
}

/// One start or stop.
struct Edge {
    run: usize,
    /// Time of its run.
    at_s: f64,
    late_s: f64,
    tail_s: f64,
    near_s: f64,
    /// Time in which the position goes from the first height to the second.
    ramp_s: f64,
}

/// Starts and stops of all runs, and how many of each there are whose force may pass the middle more than once.
pub(crate) struct Ends {
    starts: (Vec<Edge>, usize),
    stops: (Vec<Edge>, usize),
    step_s: f64,
}

impl Ends {
    /// `None` without a position. Rows that are `held` back (one entry a row of all runs) have no say. `mass_kg`: what is known
    /// to be moved.
    pub(crate) fn of(runs: &[Run], held: &[bool], mass_kg: f64) -> Option<Self> {
        let (mut starts, mut stops) = ((Vec::new(), 0), (Vec::new(), 0));
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
                        starts.1 += 1;
                        starts.0.extend(edge.map(|edge| Edge { run: number, at_s: at_s(rest.end), ..edge }));
                    }
                    // a stop is a start in time reversed: late there is early here
                    let back = x.len() - rest.end..x.len() - rest.start;
                    if let Some(edge) = start(&x_back, &f_back, back, step_s) {
                        stops.1 += 1;
                        let of =
                            |edge: Edge| Edge { run: number, at_s: at_s(rest.start), late_s: -edge.late_s, ..edge };
                        stops.0.extend(edge.map(of));
                    }
                }
            }
        }
        let step_s = runs.iter().map(Run::step_s).find(|step| *step > 0.0)?;
        Some(Ends { starts: (alike(starts.0), starts.1), stops: (alike(stops.0), stops.1), step_s })
    }
}

impl Edges {
    /// `None` where the runs do not rest often enough, or their force does not step there.
    pub(crate) fn of(ends: &Ends) -> Option<Self> {
        let is_clear =
            |(edges, seen): &(Vec<Edge>, usize)| edges.len() >= FEWEST && edges.len() as f64 >= CLEAR * *seen as f64;
        if !is_clear(&ends.starts) || !is_clear(&ends.stops) {
            return None;
        }
        let (starts, stops, step_s) = (&ends.starts.0, &ends.stops.0, ends.step_s);
        // mean and its standard error
        let of = |edges: &[Edge], what: fn(&Edge) -> f64| {
            let values: Vec<f64> = edges.iter().map(what).collect();
            (mean(&values), scatter(&values) / (values.len() as f64).sqrt())
        };
        let (start, stop) = (of(starts, |edge| edge.late_s), of(stops, |edge| edge.late_s));
        if start.1 > SURE_S || stop.1 > SURE_S {
            return None;
        }
        let ramp = |edges: &[Edge]| level(&edges.iter().map(|edge| edge.ramp_s).collect::<Vec<_>>()).map(|(s, _)| s);
        // play lets a start alone be late
        let play_s = start.0 - stop.0;
        if play_s > (ERRORS * start.1.hypot(stop.1)).max(PLAY_ROWS * step_s) {
            return None;
        }
        let unlike_s = 0.5 * (ramp(starts)? - ramp(stops)?).abs();
        let (tail, near) = (of(stops, |edge| edge.tail_s), of(stops, |edge| edge.near_s));
        Some(Edges {
            late_s: 0.5 * (start.0 + stop.0),
            late_error_s: (0.5 * start.1.hypot(stop.1)).hypot(FILTERS_S) + (unlike_s + 0.5 * play_s.max(0.0)) / ERRORS,
            tail_s: tail.0,
            tail_error_s: tail.1,
            near_s: near.0,
            near_error_s: near.1,
            step_s,
            window_s: window(step_s) as f64 * step_s,
        })
    }

    /// Whether a cause may act so that the force has these edges.
    pub(crate) fn allow(&self, source: &Source) -> bool {
        let Source::Mechanism { definition, form, shape } = source else { return true };
        match definition.id {
            Id::FrictionalLag => !self.has_tail() && self.late_s.abs() <= self.slack_s(),
            Id::TimeMisalignment => {
                let (least, most) = self.delays();
                !self.has_tail() && shape.first().is_none_or(|delay| (least..=most).contains(delay))
            }
            Id::ForceLowpass => {
                let time = shape.first().copied().unwrap_or(0.0) * if *form == 0 { 1.0 } else { 2.0 };
                // behind its middle exp(-t/τ) has half of its area, of which the window sees all but the end
                let seen_s = time * (0.5 - (-self.window_s / time.max(1e-9)).exp()).max(0.0);
                let is_there = self.tail_s + ERRORS * self.tail_error_s >= PRESENT * seen_s;
                is_there && (!self.is_late() || self.fades_by(ERRORS))
            }
            _ => true,
        }
    }

    /// Whether starts and stops alone are evidence for a cause, whatever the rest of the recording shows of it.
    pub(crate) fn speak_for(&self, source: &Source) -> bool {
        let is_faded = self.fades_by(SPEAKS) && self.late_s > self.slack_s();
        source.is(Id::TimeMisalignment) && self.is_late() || source.is(Id::ForceLowpass) && is_faded
    }

    /// Whether the force is surely late and does not fade.
    fn is_late(&self) -> bool {
        self.late_s.abs() > SPEAKS * self.late_error_s && !self.has_tail()
    }

    /// How much likelier they are with a force that is late or fades, nats.
    pub(crate) fn nats(&self) -> f64 {
        let square = |errors: f64| 0.5 * errors * errors;
        self.seen().into_iter().map(square).fold(0.0, f64::max)
    }

    /// p-value of "the force is neither late nor fades".
    pub(crate) fn p(&self) -> f64 {
        let p = |errors: f64| libm::erfc(errors.abs() / std::f64::consts::SQRT_2);
        least_of(self.seen().map(p))
    }

    /// Lateness and both tails, of their standard errors.
    fn seen(&self) -> [f64; 3] {
        [self.late_s / self.late_error_s, self.tail_s / self.tail_error_s, self.near_s / self.near_error_s]
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

    /// Whether the force fades where a carriage stops.
    fn has_tail(&self) -> bool {
        self.fades_by(FADES)
    }

    /// The same, surely by so many standard errors.
    fn fades_by(&self, errors: f64) -> bool {
        let least = TAIL_S.max(TAIL_ROWS * self.step_s).max(TAIL_SHARE * self.late_s);
        // slow noise is in the whole tail, and not in the near one
        self.near_s > least.max(errors * self.near_error_s) || self.tail_s > least + errors * self.tail_error_s
    }
}

/// By how much starts, or stops, come later and later.
struct Drift {
    /// s/s.
    rate: f64,
    error: f64,
    /// Longest time between two of a run, s.
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

/// How fast the clocks of force and position drift apart. Where rows fall, a start and the stop behind it share: both
/// together are no surer than either.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Skew {
    /// By how much the force falls behind, s/s.
    rate: f64,
    error: f64,
    /// Time within which it was seen, s.
    seen_s: f64,
}

impl Skew {
    /// `None` where there is no drift of a row and more, or starts and stops tell another one each: then the force itself
    /// comes later or sooner after a start.
    pub(crate) fn of(ends: &Ends) -> Option<Self> {
        let (starts, stops) = (Drift::of(&ends.starts.0)?, Drift::of(&ends.stops.0)?);
        let (rate, error) = (0.5 * (starts.rate + stops.rate), 0.5 * (starts.error + stops.error));
        let seen_s = starts.seen_s.min(stops.seen_s);
        let is_one = (starts.rate - stops.rate).abs() < ERRORS * error;
        let is_told = rate.abs() > SPEAKS * error && rate.abs() * seen_s > ends.step_s.max(SURE_S);
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

/// Rows of a window.
fn window(step_s: f64) -> usize {
    ((WINDOW_S / step_s) as usize).max(WINDOW_ROWS)
}

/// Those without outliers.
fn alike(mut edges: Vec<Edge>) -> Vec<Edge> {
    if let Some((middle, scatter)) = level(&edges.iter().map(|edge| edge.late_s).collect::<Vec<_>>()) {
        edges.retain(|edge| (edge.late_s - middle).abs() <= (OUTLYING * scatter).max(OUTLYING_S));
    }
    edges
}

/// The force without what the mass takes, where that was measured.
fn friction(run: &Run, mass_kg: f64) -> Vec<f64> {
    match run.acceleration_m_s2.as_ref().filter(|_| mass_kg > 0.0) {
        Some(acceleration) => run.drag_force_n.iter().zip(acceleration).map(|(f, a)| f - mass_kg * a).collect(),
        None => run.drag_force_n.clone(),
    }
}

/// Rests of a part: rows over which the position moves hardly more than where it moves least.
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

/// The start that ends a rest. `None` where none is seen or the force does not step; the inner `None` where it does so
/// without passing its middle once.
fn start(x: &[f64], f: &[f64], rest: std::ops::Range<usize>, step_s: f64) -> Option<Option<Edge>> {
    let window = window(step_s);
    let inner = rest.start + BESIDE..rest.end - BESIDE;
    let (place, off) = level(&x[inner.clone()])?;
    let height = (MOVED * off).max(LEAST_M);
    let middle = (inner.start + inner.end) / 2;
    let ramp_ends = (rest.end + RAMP * window).min(x.len());
    let way = |n: usize| (x[n] - place).abs();
    // between rows, by a straight line
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
    // a force that changes within a rest scatters more than it does at rest
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

/// Median of the values that are there, and how they scatter around it.
fn level(values: &[f64]) -> Option<(f64, f64)> {
    let finite = finite(values);
    let middle = median(finite.clone())?;
    Some((middle, robust_sigma(&finite.iter().map(|x| x - middle).collect::<Vec<_>>())))
}

fn finite(values: &[f64]) -> Vec<f64> {
    values.iter().copied().filter(|x| x.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::definition;
    use simulation::run::{Break, Part};
    use simulation::sensor::Noise;

    use super::*;

    /// What is moved, where an acceleration was measured.
    const MASS_KG: f64 = 20.0;

    /// Time of a stroke and the rest before it, s.
    const EACH_S: f64 = 1.2037;

    /// Time since a rest began, and the direction of the stroke behind it.
    fn since(t: f64) -> (f64, f64) {
        let is_forth = ((t / EACH_S).floor() as i64).rem_euclid(2) == 0;
        (t.rem_euclid(EACH_S), if is_forth { 1.0 } else { -1.0 })
    }

    /// Up within 0.1 s, down within 0.1 s, without jumps of the acceleration.
    fn speed_m_s(t: f64) -> f64 {
        let (since, direction) = since(t);
        let part = ((since - 0.4) / 0.1).min((0.9 - since) / 0.1).clamp(0.0, 1.0);
        direction * 0.05 * part * part * (3.0 - 2.0 * part)
    }

    /// The same with the force that a mass takes, up to two and a half times the friction's, and its acceleration.
    fn heavy(mut run: Run, late_s: f64) -> Run {
        let at = |t: f64| (speed_m_s(t + 1e-5) - speed_m_s(t - 1e-5)) / 2e-5;
        run.acceleration_m_s2 = Some(run.time_s.iter().map(|t| 1.7 * at(*t)).collect());
        for (f, t) in run.drag_force_n.iter_mut().zip(&run.time_s) {
            *f += MASS_KG * 1.7 * at(t - late_s);
        }
        run
    }

    /// Forty strokes to and fro with rests between, 10 N of friction with its sign `late_s` after that of the speed and
    /// through a filter of `filter_s`; after a turn, play takes `play_s` up.
    fn strokes(late_s: f64, filter_s: f64, play_s: f64) -> Run {
        strokes_at(5e-3, late_s, filter_s, play_s)
    }

    fn strokes_at(step_s: f64, late_s: f64, filter_s: f64, play_s: f64) -> Run {
        let fine = (1e4 * step_s) as usize;
        let mut noise = Noise::new(3, 0);
        let (mut x, mut filtered) = (0.0, 0.0);
        let mut run = Run { position_m: Some(Vec::new()), ..Run::default() };
        for n in 0..(40.0 * EACH_S / step_s) as usize {
            for k in 0..fine {
                let t = (n as f64 + k as f64 / fine as f64) * step_s;
                x += speed_m_s(t) * step_s / fine as f64;
                let (since, direction) = since(t - late_s);
                let force = if (0.4 + play_s..0.9).contains(&since) { 10.0 * direction } else { 0.0 };
                let share = if filter_s > 0.0 { 1.0 - (-step_s / fine as f64 / filter_s).exp() } else { 1.0 };
                filtered += share * (force - filtered);
            }
            run.time_s.push((n + 1) as f64 * step_s);
            run.drag_force_n.push(filtered + 0.05 * noise.gaussian());
            run.position_m.as_mut().expect("it was set").push(x + 2e-7 * noise.gaussian());
        }
        run.parts = vec![Part { rows: 0..run.time_s.len(), segment: None, starts: Break::Start }];
        run
    }

    fn ends(run: &Run) -> Option<Ends> {
        Ends::of(std::slice::from_ref(run), &vec![false; run.len()], MASS_KG)
    }

    fn of(run: Run) -> Option<Edges> {
        Edges::of(&ends(&run)?)
    }

    fn source(id: Id, shape: &[f64]) -> Source {
        Source::Mechanism { definition: definition(id), form: 0, shape: shape.to_vec() }
    }

    #[test]
    fn edges_tell_a_late_force_from_a_filtered_one_and_both_from_friction_that_lags() {
        let on_time = of(strokes(0.0, 0.0, 0.0)).expect("it rests and starts");
        assert!(on_time.late_s.abs() < 4e-4 && on_time.tail_s.abs() < 1e-4, "{on_time:?}");
        assert!(
            on_time.allow(&source(Id::FrictionalLag, &[0.01])) && !on_time.allow(&source(Id::ForceLowpass, &[0.01]))
        );
        assert!(!on_time.speak_for(&source(Id::TimeMisalignment, &[])));

        for delay_s in [-4e-3, 3e-3] {
            let late = of(strokes(delay_s, 0.0, 0.0)).expect("it rests and starts");
            assert!((late.late_s - delay_s).abs() < 4e-4 && late.tail_s.abs() < 1e-4, "{late:?}");
            assert!(
                late.speak_for(&source(Id::TimeMisalignment, &[])) && !late.speak_for(&source(Id::ForceLowpass, &[]))
            );
            assert!(
                !late.allow(&source(Id::FrictionalLag, &[0.01])) && !late.allow(&source(Id::ForceLowpass, &[3e-3]))
            );
            let mut bounds = [(-1.0, 1.0)];
            late.bind(&source(Id::TimeMisalignment, &[]), &mut bounds);
            assert!(bounds[0].0 < delay_s && delay_s < bounds[0].1 && bounds[0].1 - bounds[0].0 < 3e-3, "{bounds:?}");
        }

        let filtered = of(strokes(0.0, 4e-3, 0.0)).expect("it rests and starts");
        // half of what comes behind the middle of exp(-t/τ)
        assert!((filtered.tail_s - 2e-3).abs() < 3e-4 && (filtered.late_s - 2.8e-3).abs() < 4e-4, "{filtered:?}");
        assert!(
            filtered.speak_for(&source(Id::ForceLowpass, &[4e-3]))
                && filtered.allow(&source(Id::ForceLowpass, &[4e-3]))
        );
        assert!(
            !filtered.allow(&source(Id::TimeMisalignment, &[])) && !filtered.allow(&source(Id::FrictionalLag, &[0.01]))
        );
    }

    #[test]
    fn a_mass_whose_acceleration_was_measured_hides_nothing() {
        let on_time = of(heavy(strokes(0.0, 0.0, 0.0), 0.0)).expect("it rests and starts");
        assert!(on_time.late_s.abs() < 4e-4 && !on_time.has_tail() && !on_time.is_late(), "{on_time:?}");
        let late = of(heavy(strokes(3e-3, 0.0, 0.0), 3e-3)).expect("it rests and starts");
        assert!((late.late_s - 3e-3).abs() < 6e-4 && late.is_late(), "{late:?}");
        let mut unmeasured = heavy(strokes(0.0, 0.0, 0.0), 0.0);
        unmeasured.acceleration_m_s2 = None;
        let unmeasured = of(unmeasured);
        assert!(unmeasured.is_none(), "{unmeasured:?}");
    }

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

    #[test]
    fn a_slow_filter_is_seen_at_any_rate() {
        for step_s in [1e-3, 5e-3] {
            let filtered = of(strokes_at(step_s, 0.0, 0.025, 0.0)).expect("it rests and starts");
            let lowpass = source(Id::ForceLowpass, &[0.025]);
            assert!(filtered.speak_for(&lowpass) && filtered.allow(&lowpass), "{filtered:?}");
            assert!(!filtered.allow(&source(Id::TimeMisalignment, &[])), "{filtered:?}");
        }
    }

    #[test]
    fn play_and_a_carriage_that_does_not_rest_say_nothing() {
        assert!(of(strokes(0.0, 0.0, 0.04)).is_none());
        let mut run = strokes(0.0, 0.0, 0.0);
        run.position_m.as_mut().expect("it was set").iter_mut().enumerate().for_each(|(n, x)| *x = 1e-4 * n as f64);
        assert!(of(run).is_none());
    }
}
