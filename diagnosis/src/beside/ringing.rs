//! Ringing of the structure, found before the noise is estimated.
//!
//! A structure that rings after every jerk looks like narrow-band noise, and a whitening filter removes it with the
//! rest: an autoregression of order 2 is a resonator already. One of order 1 leaves it visible: what a resonance explains
//! there is removed from the residual that the noise is estimated from.

use simulation::mechanism::{Context, Id, definition};

use crate::beside::spectra::Spectra;
use crate::calibration::{Calibrated, prior};
use crate::fit::bench::Bench;
use crate::fit::member::{Candidate, Gain};
use crate::fit::pool::grid;
use crate::fit::refine::refine;
use crate::fit::rest::power;
use crate::fit::source::{Source, raw_columns};
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::recording::side::Side;

/// Order of an autoregression that can model the colour of friction noise, but no resonance.
const SHORT: usize = 1;

/// Evidence from which a resonance is removed, nats: friction noise alone stays below.
const RINGS: f64 = 100.0;

/// Most points of the grid over frequency and damping.
const POINTS: usize = 30;

/// Damping ratios with which a peak of the spectrum is tried.
const DAMPINGS: [f64; 4] = [0.01, 0.02, 0.04, 0.08];

/// Evidence for excitation by reversals and jerks, nats, above the best of a grid in noise.
const STRUCK: f64 = 10.0;

/// Relative distance of a peak from the resonance that reversals and jerks show best within which both are one, where
/// rolling excites it much harder than they do.
const NEAR: f64 = 0.1;

/// Resonances that were found.
pub(crate) struct Ringing {
    /// Resonances that peaks of the spectrum point to: a resonance is narrower than the steps of any grid.
    pub(crate) pointed: Vec<Source>,
    /// A structure that is mainly excited by rolling itself, which no force column follows.
    pub(crate) heard: Option<Heard>,
}

/// A resonance that the spectrum shows at every speed.
pub(crate) struct Heard {
    pub(crate) hz: f64,
    /// Half the frequency resolution, plus half the width of the peak, Hz.
    pub(crate) half_width_hz: f64,
    /// Mean square force of the peak, N².
    pub(crate) power_n2: f64,
    /// p-value of such a peak in noise without a resonance.
    pub(crate) p: f64,
    /// Whether the compared rows are averages in which it cancels.
    pub(crate) is_averaged_out: bool,
    /// The part that follows from the motion (excited by reversals and jerks), where there is one.
    pub(crate) struck: Option<(Source, Vec<f64>)>,
}

/// Estimates the noise anew where something rings.
pub(crate) fn unmask(
    nominal: &Nominal,
    calibrated: &Calibrated<'_>,
    training: &[bool],
    rows: &mut Rows,
) -> Result<Ringing, String> {
    let Calibrated { values, side, saturation, left } = calibrated;
    let mut short = rows.clone();
    short.learn_up_to(left, saturation.kept(), SHORT);
    let listened = Listened::of((nominal, side), training, left, &short);
    let pointed = at_peaks(&listened.peaks_hz);
    let mismatch = side.residual(nominal, values)?;
    let tangent = side.tangent(nominal, values)?;
    let bench =
        Bench::new(short, &side.contexts, training.to_vec(), &mismatch, tangent.clone(), prior(nominal, values));
    let law = bench.fit(&bench.law());
    let best_of = |sources: &[Source]| {
        let mut candidates = bench.candidates(sources.iter().cloned());
        bench.prepare_all(&mut candidates, &law.active);
        let nats = |candidate: &Candidate| bench.gain(candidate, &law).nats;
        let best = candidates.into_iter().max_by(|a, b| nats(a).total_cmp(&nats(b)));
        best.map(|candidate| refine(&bench, &candidate, &law))
    };
    let struck = best_of(&pointed);
    let definition = definition(Id::StructuralResonance);
    let shapes = grid(&definition.forms[0], POINTS, (0.0, 0.0)).into_iter();
    let on_grid: Vec<Source> = shapes.map(|shape| Source::Mechanism { definition, form: 0, shape }).collect();
    let everywhere = best_of(&on_grid);
    let rings = struck.iter().chain(&everywhere).max_by(|a, b| a.1.nats.total_cmp(&b.1.nats));
    if let Some((candidate, _)) = rings.filter(|(_, gain)| gain.nats > RINGS) {
        let extra = raw_columns(&candidate.source, &side.contexts).unwrap_or_default();
        let rest = saturation.rest(rows, &side.contexts, &mismatch, &tangent, &extra);
        rows.learn(&rest, saturation.kept());
    }
    let heard = listened.heard(struck.as_ref());
    Ok(Ringing { pointed, heard })
}

/// Resonances at peaks of the spectrum, in every form of one frequency and one damping: they differ by their phase.
fn at_peaks(peaks_hz: &[f64]) -> Vec<Source> {
    let definition = definition(Id::StructuralResonance);
    let names = |form: usize| definition.forms[form].shape.iter().map(|parameter| parameter.name);
    let of_one = (0..definition.forms.len()).filter(|form| names(*form).eq(names(0)));
    let at =
        |form: usize, hz: f64| DAMPINGS.map(|damping| Source::Mechanism { definition, form, shape: vec![hz, damping] });
    of_one.flat_map(|form| peaks_hz.iter().flat_map(move |hz| at(form, *hz))).collect()
}

/// Spectra of a residual at the recording's own sampling rate: averages are blind to ringing between them.
struct Listened {
    /// Frequencies that stand out after a short autoregression, the highest peak first.
    peaks_hz: Vec<f64>,
    /// Spectra of the unwhitened residual.
    spectra: Option<Spectra>,
    power_n2: f64,
    /// The same of the law's inertia, where its acceleration was derived: that is noise at the frequencies that the
    /// derivation lets pass.
    inertia: Option<(Spectra, f64)>,
    /// Whether the compared rows are averages of the rows used here.
    is_finer: bool,
}

/// Power of a peak in the law's derived inertia, as a share of that in the residual, from which no structure rings there.
const OF_INERTIA: f64 = 0.5;

impl Listened {
    /// `left`: one entry per row of all runs; `short`: the compared rows, whitened by a short autoregression.
    fn of((nominal, side): (&Nominal, &Side<'_>), training: &[bool], left: &[f64], short: &Rows) -> Self {
        let finest = (short.decimation() > 1).then(|| Rows::new(side.runs, training, 1));
        let mut finer = finest.filter(|finest| finest.decimation() < short.decimation());
        if let Some(finer) = &mut finer {
            finer.learn_up_to(left, &[], SHORT);
        }
        let rows = finer.as_ref().unwrap_or(short);
        let [from_hz, to_hz] = range(0);
        let whitened = Spectra::of(&rows.white(left), rows, side);
        let derived = derived_inertia_n(nominal, side);
        let inertia =
            derived.and_then(|force| Some((Spectra::of(&rows.plain(&force), rows, side)?, power(rows, &force))));
        Listened {
            peaks_hz: whitened.map_or_else(Vec::new, |spectra| spectra.peaks(from_hz, to_hz)),
            spectra: Spectra::of(&rows.plain(left), rows, side),
            power_n2: power(rows, left),
            inertia,
            is_finer: finer.is_some(),
        }
    }

    /// The highest peak at every speed that reversals excite too, or that rolling certainly excites.
    fn heard(&self, struck: Option<&(Candidate, Gain)>) -> Option<Heard> {
        let spectra = self.spectra.as_ref()?;
        // at the end of its range the damping is too large for ringing
        let most = 0.99 * range(1)[1];
        self.peaks_hz.iter().find_map(|hz| {
            let peak = spectra.at_every_speed(*hz)?;
            if self.in_inertia_n2(*hz) > OF_INERTIA * peak.share * self.power_n2 {
                return None;
            }
            let is_near = |shape: &[f64]| (hz - shape[0]).abs() < 1.5 / spectra.window_s + NEAR * hz;
            let struck = struck.and_then(|(candidate, gain)| match &candidate.source {
                Source::Mechanism { shape, .. } if is_near(shape) && shape[1] < most && gain.nats > STRUCK => {
                    Some((candidate, gain, shape[1]))
                }
                _ => None,
            });
            let is_one =
                if peak.is_high { struck.is_some() || peak.is_rolled } else { struck.is_some() && peak.is_rolled };
            if !is_one {
                return None;
            }
            let damping = struck.map_or(DAMPINGS[0], |(.., damping)| damping);
            Some(Heard {
                hz: *hz,
                // frequency uncertainty: the width of a damped resonance plus the resolution of the spectrum
                half_width_hz: 0.5 / spectra.window_s + damping * hz,
                power_n2: peak.share * self.power_n2,
                p: peak.p,
                is_averaged_out: self.is_finer,
                struck: struck.map(|(candidate, gain, _)| (candidate.source.clone(), gain.amplitudes.clone())),
            })
        })
    }
}

impl Listened {
    /// Mean square force of a peak in the law's derived inertia, N².
    fn in_inertia_n2(&self, hz: f64) -> f64 {
        let of = |(spectra, power_n2): &(Spectra, f64)| Some(spectra.at_every_speed(hz)?.share * power_n2);
        self.inertia.as_ref().and_then(of).unwrap_or(0.0)
    }
}

/// Inertia of the law, N, where its acceleration was derived in all runs; one entry per row of all runs.
fn derived_inertia_n(nominal: &Nominal, side: &Side<'_>) -> Option<Vec<f64>> {
    let of_run = |context: &Context<'_>| {
        let moved_kg = nominal.moved_kg(context.run, context.motion);
        let is_derived = context.run.acceleration_m_s2.is_none() && moved_kg > 0.0;
        is_derived.then(|| context.motion.acceleration_m_s2.iter().map(|a| moved_kg * a).collect::<Vec<f64>>())
    };
    let runs: Option<Vec<Vec<f64>>> = side.contexts.iter().map(of_run).collect();
    runs.map(|runs| runs.concat())
}

/// Range of a resonance's shape parameter: its frequency, Hz, or its damping ratio.
fn range(number: usize) -> [f64; 2] {
    let parameter = &definition(Id::StructuralResonance).forms[0].shape[number];
    [parameter.from, parameter.to]
}
