//! Narrow-band sounds that come and go, such as a neighbouring machine that runs up: spectral kurtosis.
//!
//! Noise estimated from such a residual has their spectrum, and whitening hides them. What noise has not is a frequency that
//! is loud at some times only. In frames of a part of the whitened residual,
//!
//! ```text
//! P(t, f)   power of frame t at frequency f: Hann window, frames that overlap by half
//! Q(t, f) = P(t, f)/(mean over t · mean over f of P/mean over t)     a level that changes for all f is none
//! K(f)    = <Q²>/<Q>² - 2     0 for noise, -1 for a steady tone, more for what comes and goes
//! σ(K)    = 2/√frames         of independent frames
//! ```
//!
//! Source: J. Antoni, The spectral kurtosis, Mechanical Systems and Signal Processing 20 (2006) 282-307; the second mean of
//! Q is ours, for noise whose level follows speed or load.

use std::ops::Range;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::noise::locks::least_of;

/// Rows of a frame: a short one for what lasts for some tenths of a second, a long one for slow frequencies.
const FRAMES: [usize; 2] = [128, 512];

/// Fewest frames of a part (with fewer, no mean over t leaves a frame its own), and of all parts.
const FEWEST_OF_PART: usize = 4;
const FEWEST: usize = 60;

/// Independent frames, of all that overlap by half under Hann windows.
const INDEPENDENT: f64 = 0.6;

/// Residuals of more standard deviations than this are clipped: a single spike is loud at all frequencies.
const FARTHEST: f32 = 4.0;

/// Power of a cell, in means, that belongs to a sound: of noise, one cell in 400 has more.
const LOUD: f64 = 6.0;

/// Standard deviations from which a frequency belongs to the band of the sound.
const OF_BAND: f64 = 5.0;

/// What comes and goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transients {
    /// p-value of "noise of one spectrum, at whatever level".
    pub(crate) p: f64,
    /// Squared force of what is loud, mean over all rows, N²: less where it is no louder than the noise.
    pub(crate) power_n2: f64,
    /// Lowest and highest frequency, as fractions of the sampling rate.
    pub(crate) band: (f64, f64),
}

/// Searches a residual for what comes and goes, within each part of the profile (`groups` of rows). `white` is whitened,
/// `left_n` as it is, N. `None` where too few frames tell.
pub(crate) fn transients(white: &[f32], left_n: &[f64], groups: &[Range<usize>]) -> Option<Transients> {
    let found: Vec<Transients> = FRAMES.iter().filter_map(|rows| of_frames(white, left_n, groups, *rows)).collect();
    let surest = found.iter().copied().min_by(|a, b| a.p.total_cmp(&b.p))?;
    Some(Transients { p: least_of(found.iter().map(|of| of.p)), ..surest })
}

fn of_frames(white: &[f32], left_n: &[f64], groups: &[Range<usize>], rows: usize) -> Option<Transients> {
    let fft = FftPlanner::new().plan_fft_forward(rows);
    let frames: Vec<Frame> =
        groups.iter().flat_map(|group| frames(&white[group.clone()], &left_n[group.clone()], &*fft)).collect();
    if frames.len() < FEWEST {
        return None;
    }
    let count = frames.len() as f64;
    let sigma = 2.0 / (INDEPENDENT * count).sqrt();
    let over_time = |f: usize, of: &dyn Fn(f64) -> f64| frames.iter().map(|frame| of(frame.loudness[f])).sum::<f64>();
    let kurtosis =
        |f: usize| over_time(f, &|q| q * q) * count / over_time(f, &|q| q).powi(2).max(f64::MIN_POSITIVE) - 2.0;
    let z: Vec<f64> = (0..rows / 2 - 1).map(|f| kurtosis(f) / sigma).collect();
    let highest = z.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let of_sampling = |f: usize| (f + 1) as f64 / rows as f64;
    let mut band = (0..z.len()).filter(|f| z[*f] >= OF_BAND.min(highest)).map(of_sampling);
    let first = band.next()?;
    Some(Transients {
        p: (z.len() as f64 * 0.5 * libm::erfc(highest / std::f64::consts::SQRT_2)).min(1.0),
        power_n2: frames.iter().map(Frame::loud_n2).sum::<f64>() / count,
        band: (first, band.next_back().unwrap_or(first)),
    })
}

/// One frame, by frequency, without the mean and the highest one.
struct Frame {
    /// `Q`.
    loudness: Vec<f64>,
    /// Squared force, mean over the frame, N².
    powers_n2: Vec<f64>,
}

impl Frame {
    /// Squared force of what is louder than noise, N².
    fn loud_n2(&self) -> f64 {
        let cells = self.loudness.iter().zip(&self.powers_n2).filter(|(q, _)| **q > LOUD);
        cells.map(|(q, power_n2)| power_n2 * (1.0 - 1.0 / q)).sum()
    }
}

/// Frames of one part; nothing of a part that is too short.
fn frames(white: &[f32], left_n: &[f64], fft: &dyn Fft<f64>) -> Vec<Frame> {
    let rows = fft.len();
    let starts = (0..).step_by(rows / 2).take_while(|start| start + rows <= white.len());
    let frame = |start: usize| {
        let clipped = white[start..start + rows].iter().map(|x| f64::from(x.clamp(-FARTHEST, FARTHEST)));
        let plain = left_n[start..start + rows].iter().copied();
        Frame { loudness: powers(clipped, fft), powers_n2: powers(plain, fft) }
    };
    let mut frames: Vec<Frame> = starts.map(frame).collect();
    if frames.len() < FEWEST_OF_PART {
        return Vec::new();
    }
    let over_time = |f: usize| frames.iter().map(|frame| frame.loudness[f]).sum::<f64>() / frames.len() as f64;
    let means: Vec<f64> = (0..rows / 2 - 1).map(over_time).collect();
    for Frame { loudness, .. } in &mut frames {
        loudness.iter_mut().zip(&means).for_each(|(power, mean)| *power /= mean.max(f64::MIN_POSITIVE));
        let level = loudness.iter().sum::<f64>() / loudness.len() as f64;
        loudness.iter_mut().for_each(|power| *power /= level.max(f64::MIN_POSITIVE));
    }
    frames
}

/// Power of the rows of one frame at each frequency but the mean and the highest: their sum is the mean square.
fn powers(rows: impl ExactSizeIterator<Item = f64>, fft: &dyn Fft<f64>) -> Vec<f64> {
    let count = rows.len();
    let hann = |n: usize| 0.5 - 0.5 * (std::f64::consts::TAU * n as f64 / count as f64).cos();
    let mut spectrum: Vec<Complex<f64>> = rows.enumerate().map(|(n, x)| Complex::new(hann(n) * x, 0.0)).collect();
    fft.process(&mut spectrum);
    // a Hann window has 3/8 of the power, and either side of the spectrum half of it
    let scale = 2.0 * 8.0 / 3.0 / (count * count) as f64;
    spectrum[1..count / 2].iter().map(|x| scale * x.norm_sqr()).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use simulation::sensor::Noise;

    use super::*;

    const ROWS: usize = 20_000;
    const PARTS: [Range<usize>; 2] = [0..10_000, 10_000..ROWS];

    fn residual(of: impl Fn(usize, f64) -> f64) -> Vec<f32> {
        let mut noise = Noise::new(3, 0);
        (0..ROWS).map(|n| of(n, noise.gaussian()) as f32).collect()
    }

    fn newtons(rest: &[f32]) -> Vec<f64> {
        rest.iter().map(|x| f64::from(*x)).collect()
    }

    #[test]
    fn a_sound_that_runs_up_and_down_is_found_with_its_band() {
        // from 0.025 to 0.1 of the sampling rate and back every 2400 rows, half as strong as the noise
        let phase = |n: f64| TAU * 0.0625 * n - 0.0375 * 2400.0 * (TAU * n / 2400.0).cos();
        let chirp = residual(|n, noise| noise + 0.7 * phase(n as f64).sin());
        let found = transients(&chirp, &newtons(&chirp), &PARTS).expect("enough frames");
        // of the quarter that it has
        assert!(found.p < 1e-12 && (0.04..0.3).contains(&found.power_n2), "{found:?}");
        assert!(found.band.0 > 0.015 && found.band.1 < 0.12, "{found:?}");
    }

    #[test]
    fn noise_of_changing_level_with_far_tails_and_a_steady_tone_are_none() {
        let level = residual(|n, noise| noise * (1.0 + 0.9 * (n as f64 / 700.0).sin()));
        let tails = residual(|n, noise| if n % 37 == 0 { 4.0 * noise } else { noise });
        let tone = residual(|n, noise| noise + 0.5 * (TAU * 0.1 * n as f64).sin());
        for (name, rest) in [("level", level), ("tails", tails), ("tone", tone)] {
            let found = transients(&rest, &newtons(&rest), &PARTS).expect("enough frames");
            assert!(found.p > 1e-4, "{name}: {found:?}");
        }
        assert_eq!(transients(&[0.0; 1000], &[0.0; 1000], &[0..500, 500..1000]), None);
        let silent = transients(&[0.0; ROWS], &[0.0; ROWS], &PARTS);
        assert!(silent.is_none_or(|of| of.p > 0.5), "{silent:?}");
    }
}
