//! Whether carriage or encoder moved as a recorded speed says: then what looks like its noise is none.
//!
//! The position shows a smooth deviation from row to row; of one that is faster than the rows it shows the wavelength, if
//! an encoder errs that was read for both.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use simulation::run::Run;

/// Least part of the variance of a recorded speed around the derived one that the position shows from row to row, as a
/// share, from which it is no noise of the speed: carriage or encoder did move so, and a longer window smooths it.
const SHOWN: f64 = 0.5;

/// Least correlation of that with the row before: a speed that is nothing but the difference of noisy positions has none.
const SMOOTH: f64 = 0.5;

/// Shortest wave of an encoder's error that is looked for, m, bins per wave, and most bins of place.
const SHORTEST_M: f64 = 2e-6;
const PER_WAVE: f64 = 4.0;
const MOST_BINS: f64 = 2_097_152.0;

/// Slope of the position over the rows before and after each row, m/s; NaN at the ends of parts.
pub(crate) fn slopes(run: &Run) -> Vec<f64> {
    let mut slopes = vec![f64::NAN; run.len()];
    let Some(position) = &run.position_m else { return slopes };
    for rows in run.parts.iter().map(|part| part.rows.clone()) {
        for n in rows.start + 1..rows.end.max(1) - 1 {
            slopes[n] = (position[n + 1] - position[n - 1]) / (run.time_s[n + 1] - run.time_s[n - 1]);
        }
    }
    slopes
}

/// Whether a deviation of the speed is smooth, and the position shows it as well.
pub(crate) fn is_shown(deviation: &[f64], by_position: &[f64]) -> bool {
    let next = deviation.get(1..).unwrap_or_default();
    correlation(deviation, by_position).powi(2) > SHOWN && correlation(deviation, next) > SMOOTH
}

/// Wavelength of an encoder that errs in place and speed alike, m, where that is most of a speed's deviation from the
/// derived one:
///
/// ```text
/// dx = a sin(kx),   dV = a k V cos(kx)
/// ```
///
/// At a row or less per wave it looks like noise.
pub(crate) fn wave_m(run: &Run, velocity: &[f64], derived: &[f64]) -> Option<f64> {
    let position = run.position_m.as_ref()?;
    let known = || {
        let rows = position.iter().zip(velocity.iter().zip(derived));
        rows.filter(|(x, (v, derived))| x.is_finite() && v.is_finite() && derived.is_finite())
    };
    let ends = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (x, _)| (a.min(*x), b.max(*x)));
    let span_m = ends.1 - ends.0;
    if !(span_m > SHORTEST_M) {
        return None;
    }
    let bins = (PER_WAVE * span_m / SHORTEST_M).min(MOST_BINS) as usize;
    let mut sums = vec![Complex::new(0.0, 0.0); bins];
    let (mut of_speed, mut of_deviation) = (0.0, 0.0);
    for (x, (v, derived)) in known() {
        let bin = ((x - ends.0) / span_m * bins as f64) as usize;
        sums[bin.min(bins - 1)].re += (v - derived) * derived;
        of_speed += derived * derived;
        of_deviation += (v - derived).powi(2);
    }
    FftPlanner::new().plan_fft_forward(bins).process(&mut sums);
    // at least ten waves along the stroke, and at least four bins each
    let waves = (10..bins / PER_WAVE as usize).max_by(|a, b| sums[*a].norm_sqr().total_cmp(&sums[*b].norm_sqr()));
    waves.filter(|most| 2.0 * sums[*most].norm_sqr() > SHOWN * of_speed * of_deviation).map(|most| span_m / most as f64)
}

/// Correlation of two columns around 0, where both have a value.
fn correlation(one: &[f64], other: &[f64]) -> f64 {
    let (mut of_one, mut of_other, mut of_both) = (0.0, 0.0, 0.0);
    for (a, b) in one.iter().zip(other).filter(|(a, b)| a.is_finite() && b.is_finite()) {
        of_one += a * a;
        of_other += b * b;
        of_both += a * b;
    }
    if of_one > 0.0 && of_other > 0.0 { of_both / (of_one * of_other).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use simulation::run::{Break, Part};

    use super::*;
    use crate::beside::speed::is_noisy;

    #[test]
    fn a_speed_that_the_position_shows_row_by_row_is_no_noise() {
        let time_s: Vec<f64> = (0..1000).map(|n| 1e-3 * f64::from(n)).collect();
        let ripple = |t: f64| 2e-3 * (600.0 * t).cos();
        let noise: Vec<f64> = (0..1000).map(|n| 2e-3 * (2.7 * (n * n) as f64).sin()).collect();
        let run = Run {
            position_m: Some(time_s.iter().map(|t| 0.1 * t + 2e-3 / 600.0 * (600.0 * t).sin()).collect()),
            parts: vec![Part { rows: 0..1000, segment: None, starts: Break::Start }],
            drag_force_n: vec![0.0; 1000],
            time_s: time_s.clone(),
            ..Run::default()
        };
        let shown: Vec<f64> = slopes(&run).iter().map(|slope| slope - 0.1).collect();
        let rippled: Vec<f64> = time_s.iter().map(|t| ripple(*t)).collect();
        assert!(is_shown(&rippled, &shown) && !is_shown(&noise, &shown));
        // differences of noisy positions
        assert!(!is_shown(&noise, &noise));
        let recorded =
            |error: &[f64]| Run { velocity_m_s: Some(error.iter().map(|error| 0.1 + error).collect()), ..run.clone() };
        assert!(!is_noisy(&[recorded(&rippled)]) && is_noisy(&[recorded(&noise)]));
    }
    /// A wave of 20 um, of which a row takes two or three, read for place and speed.
    #[test]
    fn an_encoder_that_errs_between_two_rows_is_told_by_its_place() {
        let time_s: Vec<f64> = (0..8000).map(|n| 1e-3 * f64::from(n)).collect();
        let way = |t: f64| 0.05 * t + 0.005 * (1.0 - (2.0 * t).cos());
        let speed: Vec<f64> = time_s.iter().map(|t| 0.05 + 0.01 * (2.0 * t).sin()).collect();
        let (error_m, per_m) = (3e-7, std::f64::consts::TAU / 2e-5);
        let run = Run {
            position_m: Some(time_s.iter().map(|t| way(*t) + error_m * (per_m * way(*t)).sin()).collect()),
            drag_force_n: vec![0.0; 8000],
            parts: vec![Part { rows: 0..8000, segment: None, starts: Break::Start }],
            time_s: time_s.clone(),
            ..Run::default()
        };
        let errs = |(t, v): (&f64, &f64)| v * (1.0 + error_m * per_m * (per_m * way(*t)).cos());
        let wave: Vec<f64> = time_s.iter().zip(&speed).map(errs).collect();
        let noise: Vec<f64> =
            speed.iter().enumerate().map(|(n, v)| v * (1.0 + 0.1 * (2.7 * (n * n) as f64).sin())).collect();
        let found_m = wave_m(&run, &wave, &speed).expect("a wave");
        assert!((found_m / 2e-5 - 1.0).abs() < 1e-3 && wave_m(&run, &noise, &speed).is_none(), "{found_m}");
    }
}
