//! A motion put together from rests, ramps, strokes and waves, row by row.

use super::{Drive, MOST_ROWS, Undrivable};
use crate::run::{Break, Part, Run};

/// A motion under construction. Every piece lasts a whole number of rows and starts where the last one ended.
pub(super) struct Course {
    drive: Drive,
    position_m: Vec<f64>,
    velocity_m_s: Vec<f64>,
    acceleration_m_s2: Vec<f64>,
    /// First row and number of every segment.
    segments: Vec<(usize, i64)>,
    place: f64,
}

impl Course {
    pub(super) fn new(drive: &Drive) -> Result<Self, Undrivable> {
        super::positive("rate", &[drive.rate_hz])?;
        super::positive("acceleration", &[drive.acceleration_m_s2])?;
        Ok(Course {
            drive: *drive,
            position_m: Vec::new(),
            velocity_m_s: Vec::new(),
            acceleration_m_s2: Vec::new(),
            segments: Vec::new(),
            place: drive.origin_m,
        })
    }

    /// Starts a new part of the profile.
    pub(super) fn segment(&mut self) {
        self.segments.push((self.position_m.len(), self.segments.len() as i64));
    }

    /// Rows so far.
    pub(super) fn len(&self) -> usize {
        self.position_m.len()
    }

    fn push(&mut self, position: f64, velocity: f64, acceleration: f64) {
        self.position_m.push(position);
        self.velocity_m_s.push(velocity);
        self.acceleration_m_s2.push(acceleration);
    }

    /// Rows of a duration, at least 1; refused where the run would become too long.
    fn rows(&self, duration_s: f64) -> Result<usize, Undrivable> {
        let rows = (duration_s * self.drive.rate_hz).round().max(1.0);
        let all = rows + self.len() as f64;
        // a duration without end makes the largest number there is
        if all > MOST_ROWS as f64 { Err(Undrivable::TooLong(all as u64)) } else { Ok(rows as usize) }
    }

    /// Stands still.
    pub(super) fn rest(&mut self, duration_s: f64) -> Result<(), Undrivable> {
        for _ in 0..self.rows(duration_s)? {
            self.push(self.place, 0.0, 0.0);
        }
        Ok(())
    }

    /// Moves by a distance (signed) at a speed, with a ramp at either end.
    ///
    /// The ramps take whole rows, so that their acceleration is at most that of the drive; the distance is met.
    pub(super) fn stroke(&mut self, distance_m: f64, speed_m_s: f64) -> Result<(), Undrivable> {
        let (d, length, rate) = (distance_m.signum(), distance_m.abs(), self.drive.rate_hz);
        let ramp = (speed_m_s / self.drive.acceleration_m_s2 * rate).ceil().max(1.0);
        let steady = (length - speed_m_s * ramp / rate) / speed_m_s * rate;
        if steady < 1.0 {
            return Err(Undrivable::TooShort {
                stroke_m: length,
                speed_m_s,
                acceleration_m_s2: self.drive.acceleration_m_s2,
                needed_m: speed_m_s * ramp / rate,
            });
        }
        let steady = self.rows(steady / rate)? as f64;
        // the speed that covers the distance in whole rows
        let speed = length * rate / (steady + ramp);
        let acceleration = speed * rate / ramp;
        let (start, whole) = (self.place, 2.0 * ramp + steady);
        for row in 0..whole as usize {
            let row = row as f64;
            let (gone, v, a) = if row < ramp {
                (0.5 * acceleration * row * row / (rate * rate), acceleration * row / rate, acceleration)
            } else if row < ramp + steady {
                (speed * (row - 0.5 * ramp) / rate, speed, 0.0)
            } else {
                let left = whole - row;
                (length - 0.5 * acceleration * left * left / (rate * rate), acceleration * left / rate, -acceleration)
            };
            self.push(start + d * gone, d * v, d * a);
        }
        self.place = start + d * length;
        Ok(())
    }

    /// Follows `wave`, which gives position (from here), velocity and acceleration over the time from now.
    pub(super) fn follow(&mut self, duration_s: f64, wave: impl Fn(f64) -> (f64, f64, f64)) -> Result<(), Undrivable> {
        let start = self.place;
        let rows = self.rows(duration_s)?;
        for row in 0..rows {
            let (x, v, a) = wave(row as f64 / self.drive.rate_hz);
            self.push(start + x, v, a);
        }
        self.place = start + wave(rows as f64 / self.drive.rate_hz).0;
        Ok(())
    }

    /// The run.
    pub(super) fn finish(self) -> Run {
        let rows = self.len();
        let ends = self.segments.iter().skip(1).map(|s| s.0).chain([rows]);
        let parts = self.segments.iter().zip(ends).map(|((from, number), to)| Part {
            rows: *from..to,
            segment: Some(*number),
            starts: if *number == 0 { Break::Start } else { Break::Segment },
        });
        Run {
            name: String::new(),
            time_s: (0..rows).map(|n| n as f64 / self.drive.rate_hz).collect(),
            drag_force_n: vec![0.0; rows],
            position_m: Some(self.position_m),
            velocity_m_s: Some(self.velocity_m_s),
            acceleration_m_s2: Some(self.acceleration_m_s2),
            parts: parts.collect(),
            ..Run::default()
        }
    }
}
