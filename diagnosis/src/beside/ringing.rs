//! Ringing of the structure, before the noise is learnt.
//!
//! A structure that rings after every jerk looks like noise of one frequency, and a filter that makes noise white takes
//! it out with the rest. A filter too short for that, an autoregression of order 2, leaves it to be seen: what a
//! resonance explains there is taken from the residual that the noise is learnt from.

use simulation::mechanism::{Id, definition};

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

/// Order of an autoregression that has room for the colour of friction, but hardly for a frequency.
const SHORT: usize = 2;

/// Evidence from which a resonance is taken out, nats: what friction noise rings of itself stays below.
const RINGS: f64 = 100.0;

/// Most points of the grid over frequency and damping.
const POINTS: usize = 30;

/// Dampings with which a peak of the spectrum is tried.
const DAMPINGS: [f64; 4] = [0.01, 0.02, 0.04, 0.08];

/// Evidence for what reversals and jerks strike, nats, from which it is more than the best of a grid in noise.
const STRUCK: f64 = 10.0;

/// Distance of a peak, of its frequency, from the resonance that reversals and jerks show best: the same one, where rolling
/// strikes it much harder than they do.
const NEAR: f64 = 0.1;

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
    /// Half the distance of two entries of the spectrum, and of the peak, Hz.
    pub(crate) half_width_hz: f64,
    /// Mean square force of the peak, N².
    pub(crate) power_n2: f64,
    /// p-value of such a peak in noise without one.
    pub(crate) p: f64,
    /// Whether the rows that are compared are averages that are blind to it.
    pub(crate) is_averaged_out: bool,
    /// The part that follows from the motion, what reversals and jerks strike, where there is one.
    pub(crate) struck: Option<(Source, Vec<f64>)>,
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
    short.learn_up_to(left, saturation.kept(), SHORT);
    let listened = Listened::of(side, training, left, &short);
    let pointed: Vec<Vec<f64>> =
        listened.peaks_hz.iter().flat_map(|hz| DAMPINGS.iter().map(move |damping| vec![*hz, *damping])).collect();
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
        let rest = saturation.rest(rows, &side.contexts, &mismatch, &tangent, &extra);
        rows.learn(&rest, saturation.kept());
    }
    let heard = listened.heard(struck.as_ref());
    Ok(Ringing { pointed, heard })
}

/// What is heard of a residual at the rate of its recording: averages are blind to what rings between them.
struct Listened {
    /// Frequencies that stand out of what a short autoregression leaves, the highest first.
    peaks_hz: Vec<f64>,
    /// Of the residual as it is.
    spectra: Option<Spectra>,
    power_n2: f64,
    /// Whether the rows that are compared are averages of those that were listened to.
    is_finer: bool,
}

impl Listened {
    /// `left` has an entry a row of all runs; `short`: the rows that are compared, whitened by a short autoregression.
    fn of(side: &Side<'_>, training: &[bool], left: &[f64], short: &Rows) -> Self {
        let finest = (short.decimation() > 1).then(|| Rows::new(side.runs, training, 1));
        let mut finer = finest.filter(|finest| finest.decimation() < short.decimation());
        if let Some(finer) = &mut finer {
            finer.learn_up_to(left, &[], SHORT);
        }
        let rows = finer.as_ref().unwrap_or(short);
        let [from_hz, to_hz] = range(0);
        let whitened = Spectra::of(&rows.white(left), rows, side);
        Listened {
            peaks_hz: whitened.map_or_else(Vec::new, |spectra| spectra.peaks(from_hz, to_hz)),
            spectra: Spectra::of(&rows.plain(left), rows, side),
            power_n2: power(rows, left),
            is_finer: finer.is_some(),
        }
    }

    /// The highest peak at every speed that reversals strike too, or that rolling surely strikes.
    fn heard(&self, struck: Option<&(Candidate, Gain)>) -> Option<Heard> {
        let spectra = self.spectra.as_ref()?;
        // at the end of what its damping can be it is too damped to ring
        let most = 0.99 * range(1)[1];
        self.peaks_hz.iter().find_map(|hz| {
            let peak = spectra.at_every_speed(*hz)?;
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
                // a damped resonance is as broad as that, and the highest entry of its peak is anywhere within
                half_width_hz: 0.5 / spectra.window_s + damping * hz,
                power_n2: peak.share * self.power_n2,
                p: peak.p,
                is_averaged_out: self.is_finer,
                struck: struck.map(|(candidate, gain, _)| (candidate.source.clone(), gain.amplitudes.clone())),
            })
        })
    }
}

/// What a number of a resonance's shape can be: its frequency, Hz, or its damping.
fn range(number: usize) -> [f64; 2] {
    let parameter = &definition(Id::StructuralResonance).forms[0].shape[number];
    [parameter.from, parameter.to]
}
