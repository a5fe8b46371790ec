//! Runs and their motion, without the noise that a column would have in common with the mismatch.
//!
//! The law is evaluated at the channels' readings, so their noise is in the mismatch. It is also in every column made
//! from the law's force, and there it explains itself: the difference between a delayed force and an undelayed one is
//! mostly the noise of the speed. Law and columns are therefore evaluated at means over as many rows as agree within
//! noise.

use std::borrow::Cow;

use simulation::motion::{Motion, calm};
use simulation::run::Run;

use crate::numbers::statistics::robust_sigma;

/// Runs and their motion.
pub(crate) struct Moving<'r> {
    pub(crate) runs: Cow<'r, [Run]>,
    /// Motion at which the law is evaluated.
    pub(crate) motions: Vec<Motion>,
    /// The same without the noise of a measured acceleration: the motion at which mechanisms are evaluated.
    pub(crate) smooth: Vec<Motion>,
    /// Motion as it was recorded.
    pub(crate) recorded: Vec<Motion>,
    /// Whether the velocity is smoothed, too.
    pub(crate) has_calm_speed: bool,
}

impl<'r> Moving<'r> {
    /// Runs as they were recorded.
    pub(crate) fn as_recorded(runs: &'r [Run]) -> Self {
        let motions: Vec<Motion> = runs.iter().map(Motion::of).collect();
        let smooth = smoothed(runs, &motions);
        let recorded = motions.clone();
        Moving { runs: Cow::Borrowed(runs), motions, smooth, recorded, has_calm_speed: false }
    }

    /// The same with smoothed ("calm") channels. A velocity whose noise is a cause of its own keeps it.
    pub(crate) fn calmed(self, has_calm_speed: bool) -> Moving<'static> {
        let Moving { runs, mut motions, mut smooth, recorded, .. } = self;
        let mut calm_runs = Vec::with_capacity(runs.len());
        for ((run, motion), smooth) in runs.iter().zip(&mut motions).zip(&mut smooth) {
            if has_calm_speed {
                motion.velocity_m_s = motion.calm_velocity(run);
                smooth.velocity_m_s.clone_from(&motion.velocity_m_s);
            }
            let velocity_m_s = run.velocity_m_s.as_ref().map(|_| motion.velocity_m_s.clone());
            calm_runs.push(Run { velocity_m_s, ..calmed(run) });
        }
        Moving { runs: Cow::Owned(calm_runs), motions, smooth, recorded, has_calm_speed }
    }
}

/// A run with less noise in its loads and temperatures.
fn calmed(run: &Run) -> Run {
    let channel = |column: &Option<Vec<f64>>| column.as_ref().map(|column| calm(run, column));
    Run {
        preload_n: channel(&run.preload_n),
        external_load_n: channel(&run.external_load_n),
        temperature_block_degc: channel(&run.temperature_block_degc),
        temperature_rail_degc: channel(&run.temperature_rail_degc),
        temperature_ambient_degc: channel(&run.temperature_ambient_degc),
        ..run.clone()
    }
}

/// Standard deviations of their difference within which a derived acceleration is the measured one without its noise.
const ALIKE: f64 = 4.0;

/// Acceleration derived from the speed, or else from the position, of a run that measured it, m/s²; `None` where nothing
/// tells it twice.
pub(crate) fn derived_acceleration(run: &Run) -> Option<Vec<f64>> {
    let is_twice = run.acceleration_m_s2.is_some() && (run.position_m.is_some() || run.velocity_m_s.is_some());
    is_twice.then(|| Motion::of(&Run { acceleration_m_s2: None, ..run.clone() }).acceleration_m_s2)
}

/// Motion whose acceleration does not share its noise with the mismatch: where acceleration was measured, the derived
/// one, but for corners of the motion, which that rounds. The law's inertia keeps the measured one; a column with it
/// would explain noise by noise.
fn smoothed(runs: &[Run], motions: &[Motion]) -> Vec<Motion> {
    let of = |(run, motion): (&Run, &Motion)| {
        let mut motion = motion.clone();
        if let Some(derived) = derived_acceleration(run) {
            let measured = &mut motion.acceleration_m_s2;
            let apart: Vec<f64> = derived.iter().zip(measured.iter()).map(|(derived, a)| derived - a).collect();
            let most = ALIKE * robust_sigma(&apart);
            let both = measured.iter_mut().zip(derived).zip(apart);
            both.filter(|(_, apart)| apart.abs() <= most).for_each(|((a, derived), _)| *a = derived);
        }
        motion
    };
    runs.iter().zip(motions).map(of).collect()
}

#[cfg(test)]
mod tests {
    use simulation::run::{Break, Part};

    use super::*;

    /// A ramp of the speed between two constants: along it the derived acceleration, which has no noise, at its two ends
    /// the measured one, which is not rounded.
    #[test]
    fn a_measured_acceleration_is_kept_at_corners_and_no_noise_of_it_elsewhere() {
        let (rows, step_s) = (2000, 0.005);
        let time_s: Vec<f64> = (0..rows).map(|n| step_s * f64::from(n)).collect();
        let ramp = |t: f64| if (4.0..5.0).contains(&t) { 0.2 } else { 0.0 };
        let noise = |n: usize| 4e-3 * (2.7 * (n * n) as f64).sin();
        let run = Run {
            velocity_m_s: Some(time_s.iter().map(|t| 0.01 + 0.2 * (t - 4.0).clamp(0.0, 1.0)).collect()),
            acceleration_m_s2: Some(time_s.iter().enumerate().map(|(n, t)| ramp(*t) + noise(n)).collect()),
            drag_force_n: vec![0.0; time_s.len()],
            parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
            time_s,
            ..Run::default()
        };
        let moving = Moving::as_recorded(std::slice::from_ref(&run));
        let smooth = &moving.smooth[0].acceleration_m_s2;
        let off = |n: usize| (smooth[n] - ramp(run.time_s[n])).abs();
        let worst = |rows: std::ops::Range<usize>| rows.map(off).fold(0.0, f64::max);
        assert!(worst(100..780) < 1e-9 && worst(820..980) < 1e-9, "{} {}", worst(100..780), worst(820..980));
        assert!(worst(790..810) < 0.02, "rounded by {}", worst(790..810));
    }
}
