//! Ringing of the structure, before the noise is learnt.
//!
//! A structure that rings after every jerk looks like noise of one frequency, and a filter that makes noise white takes
//! it out with the rest. A filter too short for that, an autoregression of order 2, leaves it to be seen: what a
//! resonance explains there is taken from the residual that the noise is learnt from.

use std::ops::Range;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use simulation::mechanism::{Id, definition};

use crate::bench::{Bench, Candidate, Source, raw_columns};
use crate::calibration::{Calibrated, prior};
use crate::nominal::Nominal;
use crate::pool::grid;
use crate::refine::refine;
use crate::rest::power;
use crate::rows::Rows;
use crate::side::Side;

/// Order of an autoregression that has room for the colour of friction, but hardly for a frequency.
const SHORT: usize = 2;

/// Evidence from which a resonance is taken out, nats: what friction noise rings of itself stays below.
const RINGS: f64 = 100.0;

/// Most points of the grid over frequency and damping.
const POINTS: usize = 30;

/// Dampings with which a peak of the spectrum is tried.
const DAMPINGS: [f64; 4] = [0.01, 0.02, 0.04, 0.08];

/// Time that the spectrum looks at in one go, s: what rings with a hundredth of critical damping at 20 Hz lasts half of it.
const WINDOW_S: f64 = 1.0;

/// Fewest rows of such a window, and most.
const LEAST_WINDOW: usize = 64;
const MOST_WINDOW: usize = 8192;

/// Peaks that are looked at, and their height over the median around them.
const PEAKS: usize = 3;
const STANDS_OUT: f64 = 2.0;

/// Height of a peak over the median around it, slow and fast, of what rings. What is tied to the rail or to a screw is
/// elsewhere at another speed, what another machine sweeps through is broad; a structure that is damped by a few hundredths
/// stands out by ten and more.
const AT_EVERY_SPEED: f64 = 5.0;

/// Speeds of both halves that differ by less tell nothing of that.
const APART: f64 = 1.5;

/// What rings.
pub(crate) struct Ringing {
    /// Shapes of a resonance that peaks of the spectrum point to: a resonance is narrower than the steps of any grid.
    pub(crate) pointed: Vec<Vec<f64>>,
    /// A structure that is mostly struck by rolling itself, which no force column follows.
    pub(crate) heard: Option<Heard>,
}

/// A resonance that the spectrum shows at every speed.
pub(crate) struct Heard {
    pub(crate) hz: f64,
    /// Half the distance of two entries of the spectrum, Hz.
    pub(crate) half_width_hz: f64,
    /// Mean square force of the peak, N².
    pub(crate) power_n2: f64,
    /// p-value of such a peak in noise without one.
    pub(crate) p: f64,
    /// The part that follows from the motion: what reversals and jerks strike.
    pub(crate) source: Source,
    pub(crate) amplitudes: Vec<f64>,
}

/// Learns the noise anew where something rings.
pub(crate) fn unmask(
    nominal: &Nominal,
    calibrated: &Calibrated<'_>,
    training: &[bool],
    rows: &mut Rows,
) -> Result<Ringing, String> {
    let Calibrated { values, side, saturation, left } = calibrated;
    let definition = definition(Id::StructuralResonance);
    let form = &definition.forms[0];
    let mut short = rows.clone();
    short.learn_up_to(left, SHORT);
    let spectra = Spectra::of(&short.white(left), &short, side);
    let peaks = spectra.as_ref().map_or_else(Vec::new, |it| it.peaks(form.shape[0].from, form.shape[0].to));
    let pointed: Vec<Vec<f64>> =
        peaks.iter().flat_map(|hz| DAMPINGS.iter().map(move |damping| vec![*hz, *damping])).collect();
    let mismatch = side.residual(nominal, values)?;
    let tangent = side.tangent(nominal, values)?;
    let bench =
        Bench::new(short, &side.contexts, training.to_vec(), &mismatch, tangent.clone(), prior(nominal, values));
    let law = bench.fit(&bench.law());
    let best_of = |shapes: &[Vec<f64>]| {
        let source = |shape: &Vec<f64>| Source::Mechanism { definition, form: 0, shape: shape.clone() };
        let mut candidates = bench.candidates(shapes.iter().map(source));
        bench.prepare_all(&mut candidates, &law.active);
        let nats = |candidate: &Candidate| bench.gain(candidate, &law).nats;
        let best = candidates.into_iter().max_by(|a, b| nats(a).total_cmp(&nats(b)));
        best.map(|candidate| refine(&bench, &candidate, &law))
    };
    let struck = best_of(&pointed);
    let everywhere = best_of(&grid(form, POINTS, (0.0, 0.0)));
    let rings = struck.iter().chain(&everywhere).max_by(|a, b| a.1.nats.total_cmp(&b.1.nats));
    if let Some((candidate, _)) = rings.filter(|(_, gain)| gain.nats > RINGS) {
        let extra = raw_columns(&candidate.source, &side.contexts).unwrap_or_default();
        rows.learn(&saturation.rest(rows, &side.contexts, &mismatch, &tangent, &extra));
    }
    let heard = struck.zip(Spectra::of(&bench.rows.plain(left), &bench.rows, side)).and_then(|(struck, spectra)| {
        let (candidate, gain) = struck;
        let Source::Mechanism { shape, .. } = &candidate.source else { return None };
        let hz = spectra.nearest(shape[0], &peaks)?;
        let (share, p) = spectra.at_every_speed(hz)?;
        Some(Heard {
            hz,
            half_width_hz: 0.5 / spectra.window_s,
            power_n2: share * power(&bench.rows, left),
            p,
            source: candidate.source.clone(),
            amplitudes: gain.amplitudes,
        })
    });
    Ok(Ringing { pointed, heard })
}

/// Averaged spectra of a residual's pieces, of the slower half of them and of the faster.
struct Spectra {
    /// Rows of a piece over their rate: the inverse of the distance of two entries, s.
    window_s: f64,
    slow: Vec<f64>,
    fast: Vec<f64>,
    /// Pieces of either.
    pieces: usize,
    /// Mean speed of the faster over that of the slower.
    apart: f64,
}

impl Spectra {
    /// Of a residual over the compared rows; `None` where no stretch is long enough.
    fn of(residual: &[impl Into<f64> + Copy], rows: &Rows, side: &Side<'_>) -> Option<Self> {
        let step_s = side.step_s() * rows.decimation() as f64;
        let longest = rows.groups.iter().map(ExactSizeIterator::len).max()?;
        let wanted = ((WINDOW_S / step_s) as usize).clamp(LEAST_WINDOW, MOST_WINDOW).next_power_of_two();
        let window = if wanted > longest { (longest / 2 + 1).next_power_of_two() } else { wanted };
        if window < LEAST_WINDOW || window > longest {
            return None;
        }
        let speeds: Vec<f64> =
            side.motions.iter().flat_map(|motion| motion.velocity_m_s.iter().map(|v| v.abs())).collect();
        let speeds = rows.plain(&speeds);
        let starts = |group: &Range<usize>| (group.start..(group.end + 1).saturating_sub(window)).step_by(window / 2);
        let mean = |start: &usize| speeds[*start..start + window].iter().sum::<f64>() / window as f64;
        let mut pieces: Vec<(usize, f64)> =
            rows.groups.iter().flat_map(starts).map(|start| (start, mean(&start))).collect();
        pieces.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (slower, faster) = pieces.split_at(pieces.len() / 2);
        let transform = FftPlanner::new().plan_fft_forward(window);
        let spectrum = |pieces: &[(usize, f64)]| {
            let mut power = vec![0.0; window / 2];
            for (start, _) in pieces {
                // Hann's window
                let tapered = |n: usize| {
                    let taper = 0.5 - 0.5 * (std::f64::consts::TAU * n as f64 / window as f64).cos();
                    Complex::new(residual[start + n].into() * taper, 0.0)
                };
                let mut piece: Vec<Complex<f64>> = (0..window).map(tapered).collect();
                transform.process(&mut piece);
                power.iter_mut().zip(&piece).for_each(|(power, x)| *power += x.norm_sqr() / pieces.len() as f64);
            }
            power
        };
        let speed =
            |pieces: &[(usize, f64)]| pieces.iter().map(|(_, speed)| speed).sum::<f64>() / pieces.len().max(1) as f64;
        Some(Spectra {
            window_s: window as f64 * step_s,
            pieces: slower.len(),
            apart: speed(faster) / speed(slower),
            slow: spectrum(slower),
            fast: spectrum(faster),
        })
    }

    /// Height of an entry over the median around it.
    fn height(power: &[f64], k: usize) -> f64 {
        let mut around = power[k - k / 4..(k + k / 4 + 1).min(power.len())].to_vec();
        around.sort_unstable_by(f64::total_cmp);
        power[k] / around[around.len() / 2].max(f64::MIN_POSITIVE)
    }

    /// Frequencies within a range, Hz, that stand out, the highest first.
    fn peaks(&self, from_hz: f64, to_hz: f64) -> Vec<f64> {
        let both: Vec<f64> = self.slow.iter().zip(&self.fast).map(|(slow, fast)| slow + fast).collect();
        let within = |k: &usize| (from_hz..=to_hz).contains(&(*k as f64 / self.window_s));
        let heights: Vec<(usize, f64)> = (1..both.len()).filter(within).map(|k| (k, Self::height(&both, k))).collect();
        let mut found: Vec<usize> = Vec::new();
        for _ in 0..PEAKS {
            let apart = |k: usize| found.iter().all(|other| k.abs_diff(*other) > 2);
            let best = heights.iter().filter(|(k, _)| apart(*k)).max_by(|a, b| a.1.total_cmp(&b.1));
            found.extend(best.filter(|(_, height)| *height > STANDS_OUT).map(|(k, _)| *k));
        }
        found.into_iter().map(|k| k as f64 / self.window_s).collect()
    }

    /// The one of some frequencies that is this one.
    fn nearest(&self, hz: f64, among: &[f64]) -> Option<f64> {
        among.iter().copied().find(|other| (hz - other).abs() * self.window_s < 1.5)
    }

    /// Share of the power in a peak that stands out in slow and in fast pieces, and its p-value.
    fn at_every_speed(&self, hz: f64) -> Option<(f64, f64)> {
        let at = (hz * self.window_s).round() as usize;
        let halves = [&self.slow, &self.fast];
        let heights = halves.map(|power| Self::height(power, at));
        if !(self.apart > APART) || heights.iter().any(|height| !(*height > AT_EVERY_SPEED)) {
            return None;
        }
        let share = |power: &[f64], height: f64| {
            let around = &power[at.saturating_sub(2)..(at + 3).min(power.len())];
            let floor = power[at] / height;
            around.iter().map(|x| (x - floor).max(0.0)).sum::<f64>() / power.iter().sum::<f64>()
        };
        let shares: f64 = halves.iter().zip(heights).map(|(power, height)| share(power, height)).sum();
        // P(mean of n unit exponentials > h) < exp(-n(h - 1 - ln h)); pieces overlap by half
        let nats: f64 = heights.iter().map(|h| 0.5 * self.pieces as f64 * (h - 1.0 - h.ln())).sum();
        Some((0.5 * shares, (self.slow.len() as f64 * (-nats).exp()).min(1.0)))
    }
}
