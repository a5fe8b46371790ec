//! Delay of the force at starts and stops: it tells a late channel from a filtered one, and both from friction that
//! lags behind its speed.
//!
//! While the motion keeps its direction the three look alike; at its ends they do not: a late channel steps late, a
//! filter steps late and leaves a tail, and a friction whose size lags has its sign at once. The position leaves its
//! rest so slowly that a start is seen late, and a stop early by as much: the mean of both delays is free of this where
//! the ramps are alike, which the time they take between two thresholds shows.

use simulation::mechanism::Id;

use crate::fit::ends::{Edge, Ends};
use crate::fit::source::Source;
use crate::noise::locks::least_of;
use crate::numbers::statistics::{mean, scatter};

/// Largest standard error of the mean delay of starts, or of stops, for any conclusion, s.
const SURE_S: f64 = 1e-3;

/// Rows by which starts may be later than stops without play: the law's force does not rise at once either.
const PLAY_ROWS: f64 = 0.5;

/// Standard errors by which a cause may be off.
const ERRORS: f64 = 3.0;

/// Standard errors from which a force counts as fading.
const FADES: f64 = 4.0;

/// Tail above which a force is not merely late: in s, in rows, and as a share of the delay (a filter's tail is 0.7 of
/// it).
const TAIL_S: f64 = 2e-4;
const TAIL_ROWS: f64 = 0.05;
const TAIL_SHARE: f64 = 0.2;

/// Least share of the expected tail of a filter that must be there.
const PRESENT: f64 = 0.5;

/// Possible delay by filters before sampling, s.
const FILTERS_S: f64 = 1e-4;

/// Standard errors from which a late or fading force needs no other evidence.
const SPEAKS: f64 = 5.0;

/// Delay and tail of the force with their standard errors, s.
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

impl Edges {
    /// `None` where the runs do not rest often enough, or the force does not step there.
    pub(crate) fn of(ends: &Ends) -> Option<Self> {
        let Ends { starts, stops, step_s } = ends;
        if !starts.say_something() || !stops.say_something() {
            return None;
        }
        // mean and its standard error
        let of = |edges: &[Edge], what: fn(&Edge) -> f64| {
            let values: Vec<f64> = edges.iter().map(what).collect();
            (mean(&values), scatter(&values) / (values.len() as f64).sqrt())
        };
        let (start, stop) = (of(&starts.clear, |edge| edge.late_s), of(&stops.clear, |edge| edge.late_s));
        if start.1 > SURE_S || stop.1 > SURE_S {
            return None;
        }
        // play delays starts only
        let play_s = start.0 - stop.0;
        if play_s > (ERRORS * start.1.hypot(stop.1)).max(PLAY_ROWS * step_s) {
            return None;
        }
        let unlike_s = 0.5 * (starts.ramp_s()? - stops.ramp_s()?).abs();
        let (tail, near) = (of(&stops.clear, |edge| edge.tail_s), of(&stops.clear, |edge| edge.near_s));
        Some(Edges {
            late_s: 0.5 * (start.0 + stop.0),
            late_error_s: (0.5 * start.1.hypot(stop.1)).hypot(FILTERS_S) + (unlike_s + 0.5 * play_s.max(0.0)) / ERRORS,
            tail_s: tail.0,
            tail_error_s: tail.1,
            near_s: near.0,
            near_error_s: near.1,
            step_s: *step_s,
            window_s: ends.window_s(),
        })
    }

    /// Whether a cause is compatible with these edges.
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
                // half of the area of exp(-t/τ) lies behind its middle; the window misses the end of it
                let seen_s = time * (0.5 - (-self.window_s / time.max(1e-9)).exp()).max(0.0);
                let is_there = self.tail_s + ERRORS * self.tail_error_s >= PRESENT * seen_s;
                is_there && (!self.is_late() || self.fades_by(ERRORS))
            }
            _ => true,
        }
    }

    /// Whether starts and stops alone are evidence for a cause, whatever the rest of the recording shows.
    pub(crate) fn speak_for(&self, source: &Source) -> bool {
        let is_faded = self.fades_by(SPEAKS) && self.late_s > self.slack_s();
        source.is(Id::TimeMisalignment) && self.is_late() || source.is(Id::ForceLowpass) && is_faded
    }

    /// Whether the force is certainly late and does not fade.
    fn is_late(&self) -> bool {
        self.late_s.abs() > SPEAKS * self.late_error_s && !self.has_tail()
    }

    /// Evidence of the edges for a late or fading force, nats.
    pub(crate) fn nats(&self) -> f64 {
        let square = |errors: f64| 0.5 * errors * errors;
        self.seen().into_iter().map(square).fold(0.0, f64::max)
    }

    /// p-value of "the force is neither late nor fades".
    pub(crate) fn p(&self) -> f64 {
        let p = |errors: f64| libm::erfc(errors.abs() / std::f64::consts::SQRT_2);
        least_of(self.seen().map(p))
    }

    /// Delay and both tails in units of their standard errors.
    fn seen(&self) -> [f64; 3] {
        [self.late_s / self.late_error_s, self.tail_s / self.tail_error_s, self.near_s / self.near_error_s]
    }

    /// Restricts the amplitudes of a cause to what the edges allow.
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

    /// Whether the force fades where the carriage stops.
    fn has_tail(&self) -> bool {
        self.fades_by(FADES)
    }

    /// The same, by at least so many standard errors.
    fn fades_by(&self, errors: f64) -> bool {
        let least = TAIL_S.max(TAIL_ROWS * self.step_s).max(TAIL_SHARE * self.late_s);
        // slow noise contributes to the whole tail, but not to the near one
        self.near_s > least.max(errors * self.near_error_s) || self.tail_s > least + errors * self.tail_error_s
    }
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::definition;
    use simulation::run::Run;

    use super::*;
    use crate::fit::strokes::{ends, heavy, strokes, strokes_at};

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
        // the half of the area of exp(-t/τ) that lies behind its middle
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
