//! Position, velocity and acceleration of every row of a run, from what was measured.
//!
//! What was not measured is derived in windows as short as the encoder's noise allows (`window.rs`): noise of the
//! velocity falls with the 1.5th power of their length, and faster changes are lost, but for what two windows tell
//! together of a velocity that swings within a few rows. Noise of a second derivative falls
//! with the 2.5th power and is far larger: an acceleration from positions therefore has its own window, which grows row
//! by row as far as the motion is smooth.

mod corners;
mod window;

use std::ops::Range;

use crate::run::Run;

use window::{FEWEST, MAX_REACH, TwoWindows, bend, calm_slope, local, reach, rms, sharp_slope, slope, smooth_bend};

pub(crate) use corners::Corner;
pub use window::calm;

/// Accepted noise of a derived velocity, relative to the run's RMS velocity.
const VELOCITY_NOISE: f64 = 2e-3;

/// Motion of every row. All columns have the run's length.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Position, m; integrated from the velocity, from 0 at the first row of the run, where it was not measured.
    pub position_m: Vec<f64>,
    /// Velocity, m/s.
    pub velocity_m_s: Vec<f64>,
    /// Acceleration, m/s²: as measured, else derived.
    pub acceleration_m_s2: Vec<f64>,
    /// Rows to either side that a row's velocity is derived from.
    pub reach: usize,
    /// Most rows to either side that a row's acceleration is derived from.
    pub acceleration_reach: usize,
    /// Whether the position was measured.
    pub has_position: bool,
}

impl Motion {
    /// Derives what the run lacks.
    pub fn of(run: &Run) -> Self {
        let parts = run.part_rows();
        let step_s = run.step_s();
        let (reach, velocity_m_s) = match (&run.velocity_m_s, &run.position_m) {
            (Some(velocity), _) => (reach(velocity, &parts, 0.02 * rms(velocity)), velocity.clone()),
            (None, Some(position)) => {
                // rough velocity, for the limit of its noise
                let rough = rms(&slope(&run.time_s, position, &parts, 5));
                let reach = reach(position, &parts, VELOCITY_NOISE * rough * step_s);
                (reach, sharp_slope(&run.time_s, position, &parts, step_s, reach))
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
                    // an unmeasured cell is replaced by its derived value, the others are kept
                    let missing = measured.iter_mut().zip(derived().1).filter(|(a, _)| !a.is_finite());
                    missing.for_each(|(a, derived)| *a = derived);
                }
                (reach, measured)
            }
        };
        let has_position = run.position_m.is_some();
        Motion { position_m, velocity_m_s, acceleration_m_s2, reach, acceleration_reach, has_position }
    }

    /// Velocity with less measurement noise, m/s: [`calm`] where it was recorded, otherwise the slope over as many
    /// positions as agree. One entry per row; `run` must be the run of this motion.
    pub fn calm_velocity(&self, run: &Run) -> Vec<f64> {
        match (&run.velocity_m_s, &run.position_m) {
            (Some(velocity), _) => calm(run, velocity),
            (None, Some(position)) => calm_slope(&run.time_s, position, &run.part_rows(), run.step_s(), self.reach),
            (None, None) => self.velocity_m_s.clone(),
        }
    }

    /// The same motion at its [`calm_velocity`](Self::calm_velocity); the acceleration is derived from that.
    pub(crate) fn calmed(&self, run: &Run) -> Self {
        let velocity_m_s = self.calm_velocity(run);
        let acceleration_m_s2 = self.derived_acceleration(run, &velocity_m_s);
        Motion { velocity_m_s, acceleration_m_s2, ..self.clone() }
    }

    /// Velocity without the bias of long windows, m/s: as recorded, otherwise from as few positions as their noise
    /// allows; where 5 rows are enough, what they and the inner 3 tell together ([`TwoWindows`]), in every row.
    pub(crate) fn sharp_velocity(&self, run: &Run) -> Vec<f64> {
        if run.velocity_m_s.is_some() || run.position_m.is_none() {
            return self.velocity_m_s.clone();
        }
        let (time, position, parts) = (&run.time_s, &self.position_m, run.part_rows());
        if self.reach > FEWEST {
            return slope(time, position, &parts, self.reach);
        }
        let two = TwoWindows::of(time, position, &parts, FEWEST);
        (0..run.len()).map(|n| two.sharp(n)).collect()
    }

    /// Velocity and acceleration of a position, derived in the same way as those of this motion.
    pub(crate) fn derived(&self, run: &Run, position_m: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let parts = run.part_rows();
        local(&run.time_s, position_m, &parts, self.reach, |[_, b, c]| (b, 2.0 * c)).into_iter().unzip()
    }

    /// Acceleration of a velocity, derived in the same way as that of this motion from a recorded velocity.
    pub(crate) fn derived_acceleration(&self, run: &Run, velocity_m_s: &[f64]) -> Vec<f64> {
        slope(&run.time_s, velocity_m_s, &run.part_rows(), self.reach)
    }

    /// Motion derived from the path alone, over this many rows to either side, whatever speed and acceleration were
    /// recorded.
    pub(crate) fn of_path(run: &Run, reach: usize) -> Self {
        let parts = run.part_rows();
        let position_m = run.position_m.clone().unwrap_or_else(|| vec![0.0; run.len()]);
        let reach = reach.clamp(FEWEST, MAX_REACH);
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

/// Trapezoidal integral; continues across the borders of parts without a step.
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
    use super::window::ACCELERATION_NOISE;
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

    /// To and fro at one speed, reversing within a row: the motion is as smooth as the encoder allows.
    #[test]
    fn hard_turns_are_no_noise() {
        let there = |t: f64| 0.1 * (1.0 - (4.0 * t).rem_euclid(2.0)).abs();
        assert_eq!(Motion::of(&run(|t| (there(t) / 1e-7).round() * 1e-7)).reach, 2);
    }

    /// A speed that swings three times a second, logged 50 times a second to the micrometre: parabolas through five rows
    /// read a twelfth too little of its swing.
    #[test]
    fn a_fast_swing_of_the_speed_keeps_its_height() {
        let omega = 6.0 * std::f64::consts::PI;
        let speed = |t: f64| 0.1 + 0.075 * (omega * t).sin();
        let place = |t: f64| 0.1 * t - 0.075 / omega * (omega * t).cos();
        let time_s: Vec<f64> = (0..2000).map(|n| f64::from(n) * 0.02).collect();
        let run = Run {
            position_m: Some(time_s.iter().map(|t| (place(*t) / 1e-6).round() * 1e-6).collect()),
            time_s: time_s.clone(),
            ..run(|_| 0.0)
        };
        let motion = Motion::of(&run);
        for velocity in [&motion.velocity_m_s, &motion.calm_velocity(&run)] {
            let off = |n: usize| (velocity[n] - speed(time_s[n])).abs();
            let worst = (10..1990_usize).filter(|n| n.abs_diff(900) > 5).map(off).fold(0.0, f64::max);
            assert!(worst < 4e-4, "{worst}");
        }
    }

    /// The bias of a window is never taken for a motion back, and where the carriage stops it stays where it is.
    #[test]
    fn a_hard_stop_is_no_motion_back() {
        let motion = Motion::of(&run(|t| 0.2 * t.min(0.5)));
        assert!(motion.velocity_m_s.iter().all(|v| *v >= 0.0));
        assert!(motion.velocity_m_s[503..890].iter().all(|v| *v == 0.0));
    }

    /// Ten positions to the micrometre contain little of an acceleration; sixty contain it where it is smooth.
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

    /// A ramp of 20 rows in noise that asks for windows of 37 rows, which would read a sixth too little.
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
