//! Strokes to and fro with rests between: test data for starts and stops.

use simulation::run::{Break, Part, Run};
use simulation::sensor::Noise;

use crate::fit::ends::Ends;

/// Moved mass, where an acceleration was measured.
const MASS_KG: f64 = 20.0;

/// Duration of a stroke and the rest before it, s.
const EACH_S: f64 = 1.2037;

/// Time since the last rest began, and the direction of the stroke after it.
fn since(t: f64) -> (f64, f64) {
    let is_forth = ((t / EACH_S).floor() as i64).rem_euclid(2) == 0;
    (t.rem_euclid(EACH_S), if is_forth { 1.0 } else { -1.0 })
}

/// Speed: up within 0.1 s, down within 0.1 s, without jumps of the acceleration.
fn speed_m_s(t: f64) -> f64 {
    let (since, direction) = since(t);
    let part = ((since - 0.4) / 0.1).min((0.9 - since) / 0.1).clamp(0.0, 1.0);
    direction * 0.05 * part * part * (3.0 - 2.0 * part)
}

/// The same with the inertial force, up to two and a half times the friction, and the measured acceleration.
pub(super) fn heavy(mut run: Run, late_s: f64) -> Run {
    let at = |t: f64| (speed_m_s(t + 1e-5) - speed_m_s(t - 1e-5)) / 2e-5;
    run.acceleration_m_s2 = Some(run.time_s.iter().map(|t| 1.7 * at(*t)).collect());
    for (f, t) in run.drag_force_n.iter_mut().zip(&run.time_s) {
        *f += MASS_KG * 1.7 * at(t - late_s);
    }
    run
}

/// Forty strokes to and fro with rests between: 10 N of friction with its sign `late_s` after that of the speed,
/// through a filter of time constant `filter_s`; after a turn, play takes up `play_s`.
pub(super) fn strokes(late_s: f64, filter_s: f64, play_s: f64) -> Run {
    strokes_at(5e-3, late_s, filter_s, play_s)
}

pub(super) fn strokes_at(step_s: f64, late_s: f64, filter_s: f64, play_s: f64) -> Run {
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

pub(super) fn ends(run: &Run) -> Option<Ends> {
    Ends::of(std::slice::from_ref(run), &vec![false; run.len()], MASS_KG)
}
