//! A loud wave along the rail, found before the noise is estimated.
//!
//! At two or three speeds a wave along the rail is two or three frequencies, which a noise filter takes for the colour of
//! the noise and removes. What tells it from noise is its phase: the same in every stroke.
//!
//! ```text
//! (a + b sgn V + c F) cos(2π x/λ) + (d + e sgn V + f F) sin(2π x/λ)      F: force of the law
//! ```
//!
//! The residual of all curves points to the wavelength, which curves along the rail have pulled away from its own, so
//! that those around it are fitted together with the curves.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use simulation::mechanism::Context;

use crate::fit::rest::power;
use crate::noise::rows::Rows;

/// Bins of place along the stroke, and zero padding of their transform.
const BINS: usize = 1024;
const PADDED: usize = 8;

/// Fewest waves along the stroke, and fewest bins per wave.
const FEWEST_WAVES: usize = 3;
const PER_WAVE: usize = 6;

/// Share of the power that curves leave from which a wave is loud.
const LOUD: f64 = 0.5;

/// Bins of the padded transform to either side of the peak in which the wave itself may be.
const AROUND: i32 = 8;

/// Columns of a loud wave, one entry per row of all runs; empty where there is none. `left`: what all curves leave of
/// the mismatch; `beside`: what they leave beside further columns.
pub(crate) fn wave(
    rows: &Rows,
    contexts: &[Context<'_>],
    left: &[f64],
    beside: impl Fn(&[Vec<f64>]) -> Vec<f64>,
) -> Vec<Vec<f64>> {
    let Some(peak) = Places::of(rows, contexts, left).and_then(|places| places.loudest()) else { return Vec::new() };
    let at = |k: i32| columns(contexts, peak.per_m + f64::from(k) * peak.step_per_m);
    let of = |k: i32| (k, power(rows, &beside(&at(k))));
    let best = (-AROUND..=AROUND).map(of).min_by(|a, b| a.1.total_cmp(&b.1));
    best.filter(|(_, beside)| *beside < (1.0 - LOUD) * power(rows, left)).map(|(k, _)| at(k)).unwrap_or_default()
}

/// The columns of a wave; 0 where place or law are unknown.
fn columns(contexts: &[Context<'_>], per_m: f64) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::new(); 6];
    for context in contexts {
        for ((x, direction), force) in
            context.motion.position_m.iter().zip(&context.direction).zip(&context.steady.force_n)
        {
            let (sin, cos) = (TAU * per_m * x).sin_cos();
            let carriers = [1.0, *direction, *force];
            let waves = carriers.iter().flat_map(|carrier| [carrier * cos, carrier * sin]);
            columns.iter_mut().zip(waves).for_each(|(column, x)| column.push(if x.is_finite() { x } else { 0.0 }));
        }
    }
    columns
}

/// A residual by place, once as it is and once with the sign of the motion.
struct Places {
    sums: [Vec<Complex<f64>>; 2],
    squares: f64,
    count: f64,
    span_m: f64,
}

struct Peak {
    per_m: f64,
    /// Step of the padded transform, 1/m.
    step_per_m: f64,
}

impl Places {
    /// `None` without a stroke.
    fn of(rows: &Rows, contexts: &[Context<'_>], left: &[f64]) -> Option<Self> {
        let weights = rows.flat(left).power_weights();
        let motion = contexts.iter().flat_map(|context| context.motion.position_m.iter().zip(&context.direction));
        let known = || {
            let all = motion.clone().zip(left).zip(&weights);
            all.filter(|(((x, _), left), weight)| **weight > 0.0 && x.is_finite() && left.is_finite())
        };
        let ends = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (((x, _), _), _)| (a.min(*x), b.max(*x)));
        let span_m = ends.1 - ends.0;
        if !(span_m > 0.0) {
            return None;
        }
        let zeros = || vec![Complex::new(0.0, 0.0); BINS * PADDED];
        let mut places = Places { sums: [zeros(), zeros()], squares: 0.0, count: 0.0, span_m };
        for (((x, direction), left), _) in known() {
            let bin = (((x - ends.0) / span_m * BINS as f64) as usize).min(BINS - 1);
            places.sums[0][bin].re += left;
            places.sums[1][bin].re += direction * left;
            places.squares += left * left;
            places.count += 1.0;
        }
        Some(places)
    }

    /// The wave that explains most, where a wave of nearly its length may be loud.
    fn loudest(mut self) -> Option<Peak> {
        let transform = FftPlanner::new().plan_fft_forward(BINS * PADDED);
        self.sums.iter_mut().for_each(|sums| transform.process(sums));
        let explained = |k: &usize| {
            2.0 * self.sums.iter().map(|sums| sums[*k].norm_sqr()).sum::<f64>() / (self.count * self.squares)
        };
        let waves = FEWEST_WAVES * PADDED..BINS * PADDED / PER_WAVE;
        let peak = waves.max_by(|a, b| explained(a).total_cmp(&explained(b)))?;
        let step_per_m = 1.0 / (PADDED as f64 * self.span_m);
        (explained(&peak) > 0.5 * LOUD).then_some(Peak { per_m: peak as f64 * step_per_m, step_per_m })
    }
}
