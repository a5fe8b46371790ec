//! A run: the recording of an axis as columns of equal length in SI units, split where time or the profile breaks.

use std::ops::Range;

/// Number of time differences that are sampled for the median.
const AMONG: usize = 16_000;

/// A column that a recording may lack; NaN where a row has no value.
pub type Optional = Option<Vec<f64>>;

/// One run. Every column present has as many entries as `time_s`; time rises within a part.
///
/// `drag_force_n` is the force that the drive applies to the carriage, positive towards +position: in steady motion it
/// has the sign of the velocity. At least one of `position_m` and `velocity_m_s` is present.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// Name in reports, usually that of the file.
    pub name: String,
    /// Time, s. Falls only where a part starts, with [`Break::ClockJump`] or [`Break::Segment`].
    pub time_s: Vec<f64>,
    /// Drag force, N, finite in every row.
    pub drag_force_n: Vec<f64>,
    /// Position along the rail, m, finite in every row.
    pub position_m: Option<Vec<f64>>,
    /// Velocity, m/s, signed, finite in every row.
    pub velocity_m_s: Option<Vec<f64>>,
    /// Measured acceleration along travel, m/s².
    pub acceleration_m_s2: Optional,
    /// Reference preload, N.
    pub preload_n: Optional,
    /// Known vertical load on the block, N.
    pub external_load_n: Optional,
    /// Temperature of the block, °C.
    pub temperature_block_degc: Optional,
    /// Temperature of the rail, °C.
    pub temperature_rail_degc: Optional,
    /// Temperature of the surroundings, °C.
    pub temperature_ambient_degc: Optional,
    /// Drag force according to another program, N.
    pub simulated_force_n: Optional,
    /// The parts, in order; together they cover every row once.
    pub parts: Vec<Part>,
}

/// Rows without an interruption.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which rows.
    pub rows: Range<usize>,
    /// Number in the column `segment`, where there is one.
    pub segment: Option<i64>,
    /// Why a part starts here.
    pub starts: Break,
}

/// Why a part of a run starts. Memory of the friction (presliding, dwell) restarts with every part; heat and travel
/// continue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Break {
    /// The recording starts.
    Start,
    /// The column `segment` changes: the next part of a test profile. A jump in time, either way, is normal here.
    Segment,
    /// Samples are missing.
    Gap,
    /// The clock jumped back.
    ClockJump,
}

impl Run {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no row at all.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Rows of every part, in order.
    pub(crate) fn part_rows(&self) -> Vec<Range<usize>> {
        self.parts.iter().map(|part| part.rows.clone()).collect()
    }

    /// Rows of the longest part, the first among equals; empty without a part.
    pub fn longest_part(&self) -> Range<usize> {
        // `max_by_key` would take the last among equals; a reader expects the first
        let longer = |a: Range<usize>, b: Range<usize>| if b.len() > a.len() { b } else { a };
        self.parts.iter().map(|part| part.rows.clone()).reduce(longer).unwrap_or(0..0)
    }

    /// Rows of every part of the profile: parts that only a gap separates belong together.
    pub fn profile_parts(&self) -> Vec<Range<usize>> {
        let mut parts: Vec<(Option<i64>, Range<usize>)> = Vec::new();
        for part in &self.parts {
            match parts.last_mut() {
                Some((last, range)) if *last == part.segment => range.end = part.rows.end,
                _ => parts.push((part.segment, part.rows.clone())),
            }
        }
        parts.into_iter().map(|(_, rows)| rows).collect()
    }

    /// Median time between rows, s, from some 16 000 differences spread evenly over a long run; NaN with fewer than two
    /// rows in one part.
    pub fn step_s(&self) -> f64 {
        // odd: otherwise, with a logger that writes every second row late, only the late ones might be sampled
        let every = (self.len() / AMONG) | 1;
        let mut steps: Vec<f64> = self
            .parts
            .iter()
            .flat_map(|part| self.time_s[part.rows.clone()].windows(2).step_by(every).map(|pair| pair[1] - pair[0]))
            .collect();
        let middle = steps.len() / 2;
        if steps.is_empty() {
            return f64::NAN;
        }
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_that_within_parts() {
        let part = |rows| Part { rows, segment: None, starts: Break::Start };
        let run =
            Run { time_s: vec![0.0, 1.0, 2.0, 90.0, 91.0], parts: vec![part(0..3), part(3..5)], ..Run::default() };
        assert_eq!(run.step_s(), 1.0);
        assert!(Run::default().step_s().is_nan());
        assert_eq!(run.longest_part(), 0..3);
        assert_eq!(Run::default().longest_part(), 0..0);
    }
}
