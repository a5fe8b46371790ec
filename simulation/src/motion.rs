//! Position, velocity and acceleration of every row of a run, from whatever was measured.
//!
//! Derivatives are those of the parabola fitted to the rows around (Savitzky and Golay 1964), never across the border
//! of a part. The window is as short as the noise of the encoder allows: noise in velocity falls with the 1.5th power
//! of its length, and what happens within it is lost. That of a second derivative falls with the 2.5th power and is far
//! larger: where the acceleration comes from positions it has a window of its own, which grows row by row as far as
//! the motion is smooth.

use std::ops::Range;

use crate::run::Run;

/// Noise in a derived velocity that is accepted, of the run's RMS velocity.
const VELOCITY_NOISE: f64 = 2e-3;

/// Noise in a derived acceleration that is accepted, of the run's RMS acceleration.
const ACCELERATION_NOISE: f64 = 0.03;

/// Noise in a channel that is accepted as none, of its RMS.
const CALM: f64 = 1e-5;

/// Standard deviations of a shorter window's acceleration within which a longer one says the same.
const ALIKE: f64 = 3.0;

/// Part of the variance of normal numbers that is left without the largest twentieth.
const LEFT_OF_VARIANCE: f64 = 0.7588;

/// Longest window, rows to either side.
const MAX_REACH: usize = 50;

/// Motion of every row. All columns have the run's length.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Position, m; integrated from the velocity, from 0 at the first row of the run, where it was not measured.
    pub position_m: Vec<f64>,
    /// Velocity, m/s.
    pub velocity_m_s: Vec<f64>,
    /// Acceleration, m/s²: as measured, else derived.
    pub acceleration_m_s2: Vec<f64>,
    /// Rows to either side of a row that its velocity comes from.
    pub reach: usize,
    /// Most rows to either side of a row that its acceleration comes from.
    pub acceleration_reach: usize,
    /// Whether the position was measured.
    pub has_position: bool,
}

impl Motion {
    /// Derives what the run lacks.
    pub fn of(run: &Run) -> Self {
        let parts: Vec<Range<usize>> = run.parts.iter().map(|part| part.rows.clone()).collect();
        let step_s = run.step_s();
        let (reach, velocity_m_s) = match (&run.velocity_m_s, &run.position_m) {
            (Some(velocity), _) => (reach(velocity, &parts, 0.02 * rms(velocity)), velocity.clone()),
            (None, Some(position)) => {
                // the rough velocity that the limit of its noise is taken from
                let rough = rms(&slope(&run.time_s, position, &parts, 5));
                let reach = reach(position, &parts, VELOCITY_NOISE * rough * step_s);
                (reach, slope(&run.time_s, position, &parts, reach))
            }
            (None, None) => (1, vec![0.0; run.len()]),
        };
        let position_m = match &run.position_m {
            Some(position) => position.clone(),
            None => integral(&run.time_s, &velocity_m_s, &parts),
        };
        let derived = || match &run.velocity_m_s {
            Some(velocity) => (reach, slope(&run.time_s, velocity, &parts, reach)),
            None => smooth_bend(&run.time_s, &position_m, &parts, step_s, reach),
        };
        let (acceleration_reach, acceleration_m_s2) = match run.acceleration_m_s2.clone() {
            None => derived(),
            Some(mut measured) => {
                if measured.iter().any(|a| !a.is_finite()) {
                    // a cell that was not measured does not take the others with it
                    let missing = measured.iter_mut().zip(derived().1).filter(|(a, _)| !a.is_finite());
                    missing.for_each(|(a, derived)| *a = derived);
                }
                (reach, measured)
            }
        };
        let has_position = run.position_m.is_some();
        Motion { position_m, velocity_m_s, acceleration_m_s2, reach, acceleration_reach, has_position }
    }
}

/// A column of a run with less of its noise: in every row the parabola through as many rows around as agree with all fewer
/// ones, none at all beside a step. As it is where a cell of it is no number.
pub fn calm(run: &Run, column: &[f64]) -> Vec<f64> {
    if column.iter().any(|x| !x.is_finite()) {
        return column.to_vec();
    }
    let parts: Vec<Range<usize>> = run.parts.iter().map(|part| part.rows.clone()).collect();
    widened(&run.time_s, column, &parts, run.step_s(), 0, Wanted { derivative: 0, accepted: CALM }).1
}

impl Motion {
    /// Velocity with less of the noise of what it was measured by: [`calm`] where it was recorded, else the slope of as many
    /// positions as agree.
    pub fn calm_velocity(&self, run: &Run) -> Vec<f64> {
        match (&run.velocity_m_s, &run.position_m) {
            (Some(velocity), _) => calm(run, velocity),
            (None, Some(position)) => {
                let parts: Vec<Range<usize>> = run.parts.iter().map(|part| part.rows.clone()).collect();
                let slopes = Wanted { derivative: 1, accepted: CALM };
                widened(&run.time_s, position, &parts, run.step_s(), self.reach, slopes).1
            }
            (None, None) => self.velocity_m_s.clone(),
        }
    }

    /// Velocity and acceleration that a position would have, derived as those of this motion were.
    pub(crate) fn derived(&self, run: &Run, position_m: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let parts: Vec<Range<usize>> = run.parts.iter().map(|part| part.rows.clone()).collect();
        local(&run.time_s, position_m, &parts, self.reach, |[_, b, c]| (b, 2.0 * c)).into_iter().unzip()
    }

    /// Motion of the path alone, over this many rows to either side, whatever speed and acceleration were recorded.
    pub(crate) fn of_path(run: &Run, reach: usize) -> Self {
        let parts: Vec<Range<usize>> = run.parts.iter().map(|part| part.rows.clone()).collect();
        let position_m = run.position_m.clone().unwrap_or_else(|| vec![0.0; run.len()]);
        let reach = reach.clamp(2, MAX_REACH);
        Motion {
            velocity_m_s: slope(&run.time_s, &position_m, &parts, reach),
            acceleration_m_s2: bend(&run.time_s, &position_m, &parts, reach),
            reach,
            acceleration_reach: reach,
            has_position: run.position_m.is_some(),
            position_m,
        }
    }
}

/// Rows to either side so that the slope of `column` per row is known to `noise`:
/// a slope fitted to N rows has the standard deviation `σ sqrt(12/N³)`.
fn reach(column: &[f64], parts: &[Range<usize>], noise: f64) -> usize {
    let sigma = sigma(column, parts);
    let rows = if noise > 0.0 { (12.0 * (sigma / noise) * (sigma / noise)).cbrt() } else { 0.0 };
    ((0.5 * rows).ceil() as usize).clamp(2, MAX_REACH)
}

/// Standard deviation of the noise in a column.
fn sigma(column: &[f64], parts: &[Range<usize>]) -> f64 {
    // third differences of a smooth motion vanish; those of white noise have 20 times its variance. Those of a jerk are large
    // and no noise: the largest twentieth has no say
    let mut squares: Vec<f64> = Vec::new();
    for rows in parts {
        squares.extend(column[rows.clone()].windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).powi(2)));
    }
    let kept = squares.len() - squares.len() / 20;
    if kept < squares.len() {
        squares.select_nth_unstable_by(kept, f64::total_cmp);
        squares.truncate(kept);
    }
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (mean / (20.0 * LEFT_OF_VARIANCE)).sqrt()
}

fn rms(column: &[f64]) -> f64 {
    (column.iter().map(|x| x * x).sum::<f64>() / column.len().max(1) as f64).sqrt()
}

/// First derivative of the parabola through the rows around.
fn slope(time: &[f64], column: &[f64], parts: &[Range<usize>], reach: usize) -> Vec<f64> {
    local(time, column, parts, reach, |[_, b, _]| b)
}

/// Second derivative.
fn bend(time: &[f64], column: &[f64], parts: &[Range<usize>], reach: usize) -> Vec<f64> {
    local(time, column, parts, reach, |[_, _, c]| 2.0 * c)
}

/// Second derivative, and the most rows to either side that it comes from; the window [`widened`] from `reach` on.
fn smooth_bend(time: &[f64], column: &[f64], parts: &[Range<usize>], step_s: f64, reach: usize) -> (usize, Vec<f64>) {
    let bends = Wanted { derivative: 2, accepted: ACCELERATION_NOISE };
    widened(time, column, parts, step_s, reach, bends)
}

/// Which derivative of a column, and the noise in it that is accepted, of its RMS.
#[derive(Clone, Copy)]
struct Wanted {
    derivative: usize,
    accepted: f64,
}

impl Wanted {
    /// Its part of a parabola `a + b τ + c τ²`.
    fn of(self, [a, b, c]: [f64; 3]) -> f64 {
        [a, b, 2.0 * c][self.derivative]
    }

    /// Standard deviation where the column's noise is 1, without a row around that of the column itself: of a parabola fitted to N rows `sqrt(9/(4N))` in its middle,
    /// `sqrt(12/N³)/Δt` its slope, `sqrt(720/N⁵)/Δt²` its second derivative.
    fn noise(self, reach: usize, step_s: f64) -> f64 {
        let rows = 2.0 * reach as f64 + 1.0;
        match self.derivative {
            0 if reach == 0 => 1.0,
            0 => (2.25 / rows).sqrt(),
            1 => (12.0 / rows.powi(3)).sqrt() / step_s,
            _ => (720.0 / rows.powi(5)).sqrt() / (step_s * step_s),
        }
    }
}

/// A derivative of a column, and the most rows to either side that it comes from. The window grows until noise is a small
/// part of the whole, but in no row further than what it says agrees with every shorter window (Lepskii 1991): a corner
/// stays one.
fn widened(
    time: &[f64],
    column: &[f64],
    parts: &[Range<usize>],
    step_s: f64,
    mut reach: usize,
    wanted: Wanted,
) -> (usize, Vec<f64>) {
    let mut found = local(time, column, parts, reach, |parabola| wanted.of(parabola));
    let sigma = sigma(column, parts);
    let mut agreed: Vec<Option<(f64, f64)>> = vec![Some((f64::NEG_INFINITY, f64::INFINITY)); found.len()];
    loop {
        let own = sigma * wanted.noise(reach, step_s);
        let size = (rms(&found).powi(2) - own * own).max(0.0).sqrt();
        if own.is_nan() || own <= wanted.accepted * size || reach >= MAX_REACH {
            return (reach, found);
        }
        for (agreed, found) in agreed.iter_mut().zip(&found) {
            *agreed = agreed.map(|(least, most)| (least.max(found - ALIKE * own), most.min(found + ALIKE * own)));
        }
        reach = (reach + reach.div_ceil(2)).clamp(2, MAX_REACH);
        for rows in parts {
            for n in rows.clone() {
                let Some((least, most)) = agreed[n] else { continue };
                let wider = wanted.of(around(time, column, rows, n, reach));
                if (least..=most).contains(&wider) {
                    found[n] = wider;
                } else {
                    agreed[n] = None;
                }
            }
        }
    }
}

/// What `of` keeps of the parabola [`around`] every row.
fn local<T: Copy + Default>(
    time: &[f64],
    column: &[f64],
    parts: &[Range<usize>],
    reach: usize,
    of: impl Fn([f64; 3]) -> T,
) -> Vec<T> {
    let mut out = vec![T::default(); column.len()];
    for rows in parts {
        for n in rows.clone() {
            out[n] = of(around(time, column, rows, n, reach));
        }
    }
    out
}

/// Fits `a + b τ + c τ²` around a row of a part, τ the time from it. Near the border of the part the window shrinks on the
/// far side only as far as it must.
fn around(time: &[f64], column: &[f64], rows: &Range<usize>, n: usize, reach: usize) -> [f64; 3] {
    let from = n.saturating_sub(reach).max(rows.start);
    let to = (n + reach + 1).min(rows.end);
    let (t0, x0) = (time[n], column[n]);
    // moments of τ and of the column, both counted from the row itself: no cancellation
    let (mut s, mut m) = ([0.0; 5], [0.0; 3]);
    for k in from..to {
        let (t, x) = (time[k] - t0, column[k] - x0);
        let t2 = t * t;
        for (sum, power) in s.iter_mut().zip([1.0, t, t2, t2 * t, t2 * t2]) {
            *sum += power;
        }
        for (sum, power) in m.iter_mut().zip([1.0, t, t2]) {
            *sum += power * x;
        }
    }
    let [a, b, c] = parabola(s, m);
    [x0 + a, b, c]
}

/// Solves the normal equations of the parabola; a straight line, or nothing, where the rows do not allow more.
fn parabola(s: [f64; 5], m: [f64; 3]) -> [f64; 3] {
    let minor = |a: f64, b: f64, c: f64, d: f64| a * d - b * c;
    let (c00, c01, c02) = (minor(s[2], s[3], s[3], s[4]), minor(s[1], s[3], s[2], s[4]), minor(s[1], s[2], s[2], s[3]));
    let determinant = s[0] * c00 - s[1] * c01 + s[2] * c02;
    if determinant > 1e-12 * s[0] * s[2] * s[4] {
        let c11 = minor(s[0], s[2], s[2], s[4]);
        let c12 = minor(s[0], s[1], s[2], s[3]);
        let c22 = minor(s[0], s[1], s[1], s[2]);
        return [
            (c00 * m[0] - c01 * m[1] + c02 * m[2]) / determinant,
            (-c01 * m[0] + c11 * m[1] - c12 * m[2]) / determinant,
            (c02 * m[0] - c12 * m[1] + c22 * m[2]) / determinant,
        ];
    }
    let line = minor(s[0], s[1], s[1], s[2]);
    if line > 0.0 { [minor(m[0], m[1], s[1], s[2]) / line, (s[0] * m[1] - s[1] * m[0]) / line, 0.0] } else { [0.0; 3] }
}

/// Trapezoidal integral; goes on across the borders of parts without a step.
fn integral(time: &[f64], column: &[f64], parts: &[Range<usize>]) -> Vec<f64> {
    let mut out = vec![0.0; column.len()];
    let mut sum = 0.0;
    for rows in parts {
        for n in rows.clone() {
            if n > rows.start {
                sum += 0.5 * (column[n] + column[n - 1]) * (time[n] - time[n - 1]);
            }
            out[n] = sum;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{Break, Part};

    fn run(position: impl Fn(f64) -> f64) -> Run {
        let time_s: Vec<f64> = (0..2000).map(|n| f64::from(n) * 1e-3).collect();
        Run {
            position_m: Some(time_s.iter().map(|t| position(*t)).collect()),
            drag_force_n: vec![0.0; 2000],
            parts: vec![
                Part { rows: 0..900, segment: None, starts: Break::Start },
                Part { rows: 900..2000, segment: None, starts: Break::Segment },
            ],
            time_s,
            ..Run::default()
        }
    }

    #[test]
    fn a_parabola_is_differentiated_exactly_up_to_its_ends() {
        let motion = Motion::of(&run(|t| 0.3 + 0.2 * t - 0.05 * t * t));
        for n in [0, 1, 450, 899, 900, 1999] {
            let t = n as f64 * 1e-3;
            assert!((motion.velocity_m_s[n] - (0.2 - 0.1 * t)).abs() < 1e-9, "{n}: {}", motion.velocity_m_s[n]);
            assert!((motion.acceleration_m_s2[n] + 0.1).abs() < 1e-6, "{n}: {}", motion.acceleration_m_s2[n]);
        }
    }

    #[test]
    fn the_window_grows_with_the_encoder_s_step() {
        let of = |step: f64| Motion::of(&run(|t| ((0.1 * (3.0 * t).sin()) / step).round() * step));
        let (fine, coarse) = (of(1e-8), of(5e-6));
        assert!(fine.reach < coarse.reach, "{} {}", fine.reach, coarse.reach);
        for motion in [&fine, &coarse] {
            let worst = (0..2000).map(|n| (motion.velocity_m_s[n] - 0.3 * (3e-3 * n as f64).cos()).abs());
            assert!(worst.fold(0.0, f64::max) < 0.01);
        }
    }

    /// To and fro at one speed, turning within a row, is as smooth as its encoder.
    #[test]
    fn hard_turns_are_no_noise() {
        let there = |t: f64| 0.1 * (1.0 - (4.0 * t).rem_euclid(2.0)).abs();
        assert_eq!(Motion::of(&run(|t| (there(t) / 1e-7).round() * 1e-7)).reach, 2);
    }

    /// Ten positions to the micrometre hold little of an acceleration; sixty hold it where it is smooth.
    #[test]
    fn an_acceleration_from_positions_has_a_window_of_its_own() {
        // there in the first part, back in the second, without a corner
        let way = |t: f64| if t < 0.9 { (t / 0.9, 0.9) } else { (1.0 - (t - 0.9) / 1.1, 1.1) };
        let smooth = |t: f64| {
            let (s, _) = way(t);
            0.1 * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s)
        };
        let bent = |t: f64| {
            let (s, seconds) = way(t);
            0.1 * s * (60.0 - 180.0 * s + 120.0 * s * s) / (seconds * seconds)
        };
        let motion = Motion::of(&run(|t| (smooth(t) / 5e-7).round() * 5e-7));
        let inner = || (0..2000).filter(|n| (60..840).contains(n) || (960..1940).contains(n));
        let truth: Vec<f64> = inner().map(|n| bent(1e-3 * n as f64)).collect();
        let off: Vec<f64> = inner().map(|n| motion.acceleration_m_s2[n] - bent(1e-3 * n as f64)).collect();
        assert!(motion.acceleration_reach > 2 * motion.reach, "{} {}", motion.acceleration_reach, motion.reach);
        assert!(rms(&off) < ACCELERATION_NOISE * rms(&truth), "{} of {}", rms(&off), rms(&truth));
    }

    /// A ramp of 20 rows in noise that asks for windows of 37: there it would read a sixth less.
    #[test]
    fn a_short_ramp_keeps_its_height() {
        let own =
            |t: f64| if t < 0.5 { 0.0 } else { 10.0 * (t - 0.5).min(0.02) * (2.0 * (t - 0.5) - (t - 0.5).min(0.02)) };
        let noise = |t: f64| 1.45e-5 * (2.0 * (43_758.545_3 * (12_989.8 * t).sin()).rem_euclid(1.0) - 1.0);
        let (run, rows) = (run(|t| own(t) + noise(t)), 0..2000);
        let position = run.position_m.as_ref().expect("set");
        let (reach, bends) = smooth_bend(&run.time_s, position, std::slice::from_ref(&rows), 1e-3, 2);
        assert_eq!(reach, 18);
        assert!((bends[510] - 20.0).abs() < 1.0, "{}", bends[510]);
        assert!(rms(&bends[600..1900]) < 0.2, "{}", rms(&bends[600..1900]));
    }

    #[test]
    fn a_calm_channel_loses_its_noise_and_keeps_its_steps() {
        let run = run(|_| 0.0);
        let own = |t: f64| if t < 0.4 { 0.02 * t } else { 0.1 + 0.3 * t * t };
        let noise = |n: usize| 1e-3 * (2.0 * (43_758.545_3 * (12.9898 * n as f64).sin()).rem_euclid(1.0) - 1.0);
        let column: Vec<f64> = run.time_s.iter().enumerate().map(|(n, t)| own(*t) + noise(n)).collect();
        let left: Vec<f64> = calm(&run, &column).iter().zip(&run.time_s).map(|(x, t)| x - own(*t)).collect();
        assert!(rms(&left) < 0.2 * rms(&(0..2000).map(noise).collect::<Vec<f64>>()), "{}", rms(&left));
        assert!(left.iter().all(|left| left.abs() < 2e-3));
        let clean: Vec<f64> = run.time_s.iter().map(|t| own(*t)).collect();
        assert!(calm(&run, &clean).iter().zip(&clean).all(|(a, b)| (a - b).abs() < 1e-6));
        let hole: Vec<f64> = column.iter().enumerate().map(|(n, x)| if n == 7 { f64::NAN } else { *x }).collect();
        assert!(calm(&run, &hole).iter().zip(&hole).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn a_calm_velocity_knows_more_of_a_smooth_path_than_a_short_window() {
        let noise = |t: f64| 1e-6 * (2.0 * (43_758.545_3 * (12_989.8 * t).sin()).rem_euclid(1.0) - 1.0);
        let run = run(|t| 0.1 * (3.0 * t).sin() + noise(t));
        let motion = Motion::of(&run);
        let off = |velocity: &[f64]| -> f64 {
            let off = velocity.iter().zip(&run.time_s).map(|(v, t)| v - 0.3 * (3.0 * t).cos());
            rms(&off.collect::<Vec<f64>>())
        };
        let (calm, short) = (off(&motion.calm_velocity(&run)), off(&motion.velocity_m_s));
        assert!(calm < 0.6 * short, "{calm} {short}");
    }

    #[test]
    fn position_comes_back_from_velocity() {
        let mut run = run(|_| 0.0);
        run.velocity_m_s = Some(run.time_s.iter().map(|t| t.cos()).collect());
        run.position_m = None;
        let motion = Motion::of(&run);
        // the step between the two parts is not travelled
        assert!((motion.position_m[899] - 0.899f64.sin()).abs() < 1e-6);
        assert_eq!(motion.position_m[900], motion.position_m[899]);
        assert!((motion.acceleration_m_s2[500] + 0.5f64.sin()).abs() < 1e-4);
        assert!(!motion.has_position);
    }
}
