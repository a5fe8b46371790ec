//! Rows whose derived motion depends on the window: beside corners of the speed.
//!
//! Where the motion is smooth, a window half as long gives the same derivative within its noise. Beside a corner it
//! does not, and the difference is about as large as the error.

use std::ops::Range;

use super::Motion;
use super::window::{bend, slope};
use crate::run::Run;

/// How many times the median of the differences a difference stands out from.
const STANDS_OUT: f64 = 6.0;

/// Share of the largest difference that is none.
const ROUNDING: f64 = 1e-9;

/// How far derived velocity and acceleration of a row may be off; 0 where they were measured and where they are smooth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Corner {
    /// m/s
    pub(crate) velocity_m_s: f64,
    /// m/s²
    pub(crate) acceleration_m_s2: f64,
}

impl Motion {
    /// One entry per row; `run` must be the run of this motion.
    pub(crate) fn corners(&self, run: &Run) -> Vec<Corner> {
        let (time, position, parts) = (&run.time_s, &self.position_m, run.part_rows());
        let (reach, half) = (self.reach, (self.reach / 2).max(1));
        let mut corners = vec![Corner::default(); run.len()];
        if run.velocity_m_s.is_none() && run.position_m.is_some() {
            let apart = apart(&slope(time, position, &parts, reach), &slope(time, position, &parts, half));
            for (corner, off) in corners.iter_mut().zip(standing_out(&apart, &run.profile_parts())) {
                corner.velocity_m_s = off;
            }
        }
        if run.acceleration_m_s2.is_none() {
            let short = match &run.velocity_m_s {
                Some(velocity) => slope(time, velocity, &parts, half),
                None => bend(time, position, &parts, half),
            };
            let apart = apart(&self.acceleration_m_s2, &short);
            for (corner, off) in corners.iter_mut().zip(standing_out(&apart, &run.profile_parts())) {
                corner.acceleration_m_s2 = off;
            }
        }
        corners
    }
}

fn apart(long: &[f64], short: &[f64]) -> Vec<f64> {
    long.iter().zip(short).map(|(long, short)| (long - short).abs()).collect()
}

/// The largest difference within a row to either side, where it stands out from those of its part; 0 elsewhere.
fn standing_out(apart: &[f64], parts: &[Range<usize>]) -> Vec<f64> {
    let mut out = vec![0.0; apart.len()];
    for rows in parts.iter().filter(|rows| !rows.is_empty()) {
        let own = &apart[rows.clone()];
        let mut sorted = own.to_vec();
        // rounding of numbers is no difference
        let least = ROUNDING * own.iter().copied().fold(0.0, f64::max);
        let level = STANDS_OUT * *sorted.select_nth_unstable_by(own.len() / 2, f64::total_cmp).1;
        for n in 0..own.len() {
            let around = &own[n.saturating_sub(1)..(n + 2).min(own.len())];
            let largest = around.iter().copied().fold(0.0, f64::max);
            out[rows.start + n] = if largest > level.max(least) { largest } else { 0.0 };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{Break, Part};

    /// A ramp of the speed between two constants, positions to the micrometre: only its two ends stand out, by about
    /// the error of the derived velocity there.
    #[test]
    fn only_the_ends_of_a_ramp_are_corners() {
        let (rows, step_s) = (400, 0.02);
        let speed = |t: f64| 0.01 + 0.2 * (t - 3.0).clamp(0.0, 1.0);
        let way =
            |t: f64| 0.01 * t + if t < 3.0 { 0.0 } else { 0.1 * (t - 3.0).min(1.0).powi(2) + 0.2 * (t - 4.0).max(0.0) };
        let time_s: Vec<f64> = (0..rows).map(|n| step_s * f64::from(n)).collect();
        let run = Run {
            position_m: Some(time_s.iter().map(|t| (1e6 * way(*t)).round() * 1e-6).collect()),
            drag_force_n: vec![0.0; time_s.len()],
            parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        };
        let motion = Motion::of(&run);
        let corners = motion.corners(&run);
        for (n, corner) in corners.iter().enumerate() {
            let t = step_s * n as f64;
            let is_end = [3.0, 4.0].iter().any(|end: &f64| (t - end).abs() < 3.5 * step_s);
            assert!(is_end || *corner == Corner::default(), "{t} s: {corner:?}");
            let off = (motion.velocity_m_s[n] - speed(t)).abs();
            assert!(off < 2e-4 || (0.3..3.0).contains(&(corner.velocity_m_s / off)), "{t} s: {corner:?}, off by {off}");
        }
        assert!(corners[150].velocity_m_s > 5e-4 && corners[150].acceleration_m_s2 > 0.02, "{:?}", corners[150]);
    }
}
