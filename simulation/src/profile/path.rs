//! A path: consecutive phases, sampled at a rate.

use super::phase::{Phase, State};
use super::{Conditions, Course, Unfit};
use crate::motion::Motion;
use crate::run::{Break, Part, Run};

/// Most rows of a profile: more than 10 h at 1 kHz is a mistake in a number.
pub const MOST_ROWS: f64 = 4e7;

/// Shortest change of speed, s: no drive is faster.
const SHORTEST_RAMP_S: f64 = 0.02;

/// Start of a phase, and the conditions during it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Placed {
    start_s: f64,
    start_m: f64,
    phase: Phase,
    segment: i64,
    preload_n: Option<f64>,
}

/// A motion under construction. Starts at rest at position 0; time and position continue through all segments.
#[derive(Clone, Debug)]
pub(super) struct Path {
    acceleration_m_s2: f64,
    end_s: f64,
    end_m: f64,
    segment: i64,
    preload_n: Option<f64>,
    phases: Vec<Placed>,
}

impl Path {
    /// An empty path whose ramps reach this acceleration.
    pub(super) fn new(acceleration_m_s2: f64) -> Result<Self, Unfit> {
        Unfit::check("acceleration", acceleration_m_s2, 1e-3, 500.0, "m/s²")?;
        let segment = 0;
        Ok(Path { acceleration_m_s2, end_s: 0.0, end_m: 0.0, segment, preload_n: None, phases: Vec::new() })
    }

    /// Starts a new segment with the next number.
    pub(super) fn segment(&mut self) -> &mut Self {
        self.segment += 1;
        self
    }

    /// Sets the preload from here on.
    pub(super) fn preload(&mut self, preload_n: f64) -> &mut Self {
        self.preload_n = Some(preload_n);
        self
    }

    /// Appends a phase.
    pub(super) fn then(&mut self, phase: Phase) -> &mut Self {
        if phase.duration_s() > 0.0 {
            self.phases.push(Placed {
                start_s: self.end_s,
                start_m: self.end_m,
                phase,
                segment: self.segment,
                preload_n: self.preload_n,
            });
            self.end_s += phase.duration_s();
            self.end_m += phase.travel_m();
        }
        self
    }

    /// Appends a rest.
    pub(super) fn rest(&mut self, duration_s: f64) -> &mut Self {
        self.then(Phase::Rest { duration_s })
    }

    /// Duration of a ramp from rest to a speed, s.
    pub(super) fn ramp_s(&self, speed: f64) -> f64 {
        (1.5 * speed.abs() / self.acceleration_m_s2).max(SHORTEST_RAMP_S)
    }

    /// Distance of a ramp from rest to a speed, m.
    pub(super) fn ramp_m(&self, speed: f64) -> f64 {
        0.5 * speed.abs() * self.ramp_s(speed)
    }

    /// Appends a stroke from rest to rest: to a position at a speed.
    pub(super) fn go_to(&mut self, position_m: f64, speed: f64) -> Result<&mut Self, Unfit> {
        let way = position_m - self.end_m;
        let cruise_m = way.abs() - 2.0 * self.ramp_m(speed);
        if cruise_m < 0.0 {
            return Err(Unfit::TooShort { length_m: way.abs(), speed_m_s: speed, needed_m: 2.0 * self.ramp_m(speed) });
        }
        let (velocity, ramp_s) = (speed * way.signum(), self.ramp_s(speed));
        self.then(Phase::Ramp { from: 0.0, to: velocity, duration_s: ramp_s });
        self.then(Phase::Cruise { velocity, duration_s: cruise_m / speed });
        self.then(Phase::Ramp { from: velocity, to: 0.0, duration_s: ramp_s });
        // the sum of the phases equals this up to rounding, which must not accumulate over thousands of strokes
        self.end_m = position_m;
        Ok(self)
    }

    /// End of the path, s.
    pub(super) fn end_s(&self) -> f64 {
        self.end_s
    }

    /// End of the path, m.
    pub(super) fn end_m(&self) -> f64 {
        self.end_m
    }

    /// Samples the path at a rate, with the times `n/rate`.
    pub(super) fn sample(&self, name: &str, rate_hz: f64, conditions: &Conditions) -> Result<Course, Unfit> {
        Unfit::check("rate", rate_hz, 1.0, 1e5, "Hz")?;
        conditions.check()?;
        if self.end_s * rate_hz > MOST_ROWS {
            return Err(Unfit::TooLong { duration_s: self.end_s, rate_hz });
        }
        // only a warm-up can be without a phase: its durations may be 0
        if self.phases.is_empty() {
            return Err(Unfit::Nothing("run"));
        }
        // in range: just checked
        let rows = (self.end_s * rate_hz + 1e-9).floor() as usize + 1;
        let mut course = Course::empty(name, rows);
        let (mut preload, mut last) = (Vec::with_capacity(rows), usize::MAX);
        let mut place = 0;
        for n in 0..rows {
            let time_s = n as f64 / rate_hz;
            while place + 1 < self.phases.len() && self.phases[place + 1].start_s <= time_s {
                place += 1;
            }
            let placed = &self.phases[place];
            let into_s = (time_s - placed.start_s).clamp(0.0, placed.phase.duration_s());
            let State { position_m, velocity_m_s, acceleration_m_s2 } = placed.phase.at(into_s);
            course.run.time_s.push(time_s);
            course.motion.position_m.push(placed.start_m + position_m);
            course.motion.velocity_m_s.push(velocity_m_s);
            course.motion.acceleration_m_s2.push(acceleration_m_s2);
            preload.push(placed.preload_n.or(conditions.preload_n).unwrap_or(f64::NAN));
            if last == usize::MAX || self.phases[last].segment != placed.segment {
                let starts = if last == usize::MAX { Break::Start } else { Break::Segment };
                course.run.parts.push(Part { rows: n..n, segment: Some(placed.segment), starts });
            }
            last = place;
            if let Some(part) = course.run.parts.last_mut() {
                part.rows.end = n + 1;
            }
        }
        course.run.drag_force_n = vec![0.0; rows];
        course.run.position_m = Some(course.motion.position_m.clone());
        course.run.velocity_m_s = Some(course.motion.velocity_m_s.clone());
        course.run.preload_n = preload.iter().any(|p| p.is_finite()).then_some(preload);
        course.run.external_load_n = conditions.external_load_n.map(|load| vec![load; rows]);
        let temperature = conditions.temperature_degc.map(|t| vec![t; rows]);
        course.run.temperature_rail_degc.clone_from(&temperature);
        course.run.temperature_block_degc = temperature;
        Ok(course)
    }
}

impl Course {
    fn empty(name: &str, rows: usize) -> Self {
        let column = || Vec::with_capacity(rows);
        Course {
            run: Run { name: name.to_owned(), time_s: column(), ..Run::default() },
            motion: Motion {
                position_m: column(),
                velocity_m_s: column(),
                acceleration_m_s2: column(),
                reach: 1,
                acceleration_reach: 1,
                has_position: true,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(path: &Path, rate: f64) -> Course {
        path.sample("test", rate, &Conditions { preload_n: Some(3000.0), ..Conditions::default() }).expect("sound")
    }

    #[test]
    fn strokes_return_to_where_they_started_however_many() {
        let mut path = Path::new(0.5).expect("legal");
        path.segment();
        for _ in 0..1000 {
            path.go_to(0.3, 0.07).expect("long enough").go_to(0.1, 0.03).expect("long enough");
        }
        assert_eq!(path.end_m(), 0.1);
        let course = course(&path, 20.0);
        let (low, high) =
            course.motion.position_m.iter().skip(200).fold((1.0f64, 0.0f64), |(a, b), x| (a.min(*x), b.max(*x)));
        assert!(low > 0.1 - 1e-12 && high < 0.3 + 1e-12, "{low} {high}");
    }

    #[test]
    fn motion_is_continuous_and_accelerates_no_more_than_told() {
        let mut path = Path::new(0.5).expect("legal");
        path.segment().rest(0.1).go_to(0.2, 0.1).expect("long enough");
        path.segment().rest(0.1).go_to(-0.1, 0.05).expect("long enough").rest(0.2);
        let rate = 1000.0;
        let Course { run, motion } = course(&path, rate);
        let step = 1.0 / rate;
        for n in 1..run.len() {
            let by = motion.position_m[n] - motion.position_m[n - 1];
            assert!((by / step - 0.5 * (motion.velocity_m_s[n] + motion.velocity_m_s[n - 1])).abs() < 1e-4, "{n}");
            assert!((motion.velocity_m_s[n] - motion.velocity_m_s[n - 1]).abs() <= 0.5 * step * 1.001, "{n}");
            assert!(motion.acceleration_m_s2[n].abs() <= 0.5 + 1e-9);
        }
        assert_eq!(run.parts.len(), 2);
        assert_eq!((run.parts[1].segment, run.parts[1].rows.end), (Some(2), run.len()));
        assert_eq!(run.parts[0].rows.end, run.parts[1].rows.start);
        assert_eq!(motion.velocity_m_s.last(), Some(&0.0));
    }

    #[test]
    fn what_cannot_be_driven_is_refused() {
        let mut path = Path::new(0.5).expect("legal");
        assert!(matches!(path.go_to(0.01, 0.1), Err(Unfit::TooShort { .. })));
        assert!(matches!(Path::new(0.0), Err(Unfit::OutOfRange { what: "acceleration", .. })));
        path.segment().rest(1e6);
        let of = |rate| path.sample("test", rate, &Conditions::default());
        assert!(matches!(of(1000.0), Err(Unfit::TooLong { .. })));
        assert!(matches!(of(0.0), Err(Unfit::OutOfRange { what: "rate", .. })));
    }
}
