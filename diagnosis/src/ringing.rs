//! Ringing of the structure, before the noise is learnt.
//!
//! A structure that rings after every jerk looks like noise of one frequency, and a filter that makes noise white takes
//! it out with the rest. A filter too short for that, an autoregression of order 2, leaves it to be seen: what a
//! resonance explains there is taken from the residual that the noise is learnt from.

use simulation::mechanism::{Id, definition};

use crate::bench::{Bench, Source, raw_columns};
use crate::calibration::{Calibrated, prior};
use crate::nominal::Nominal;
use crate::pool::grid;
use crate::refine::refine;
use crate::rows::Rows;

/// Order of an autoregression that has room for the colour of friction, but hardly for a frequency.
const SHORT: usize = 2;

/// Evidence from which a resonance is taken out, nats: what friction noise rings of itself stays below.
const RINGS: f64 = 100.0;

/// Most points of the grid over frequency and damping.
const POINTS: usize = 30;

/// Learns the noise anew where something rings.
pub(crate) fn unmask(
    nominal: &Nominal,
    calibrated: &Calibrated<'_>,
    training: &[bool],
    rows: &mut Rows,
) -> Result<(), String> {
    let Calibrated { values, side, saturation, left } = calibrated;
    let definition = definition(Id::StructuralResonance);
    let mut short = rows.clone();
    short.learn_up_to(left, SHORT);
    let mismatch = side.residual(nominal, values)?;
    let tangent = side.tangent(nominal, values)?;
    let bench =
        Bench::new(short, &side.contexts, training.to_vec(), &mismatch, tangent.clone(), prior(nominal, values));
    let law = bench.fit(&bench.law());
    let mut best = None;
    for shape in grid(&definition.forms[0], POINTS, (0.0, 0.0)) {
        let Some(mut candidate) = bench.candidate(Source::Mechanism { definition, form: 0, shape }) else { continue };
        bench.prepare(&mut candidate, &law.active);
        let nats = bench.gain(&candidate, &law).nats;
        if best.as_ref().is_none_or(|(most, _)| nats > *most) {
            best = Some((nats, candidate));
        }
    }
    let Some((_, candidate)) = best.filter(|(nats, _)| *nats > RINGS) else { return Ok(()) };
    let (candidate, _) = refine(&bench, &candidate, &law);
    let extra = raw_columns(&candidate.source, &side.contexts).unwrap_or_default();
    rows.learn(&saturation.rest(rows, &side.contexts, &mismatch, &tangent, &extra));
    Ok(())
}
