//! Findings without a fit: a cause's name, what a channel shows of it, and a sentence.

use simulation::mechanism::{Id, definition};

use crate::answer::member::TRUST_IN_DOUBT;
use crate::beside::events::{Number, Spots};
use crate::beside::gap::Gap;
use crate::beside::ringing::Heard;
use crate::report::{Estimate, Finding};

/// An unknown effect that no curve follows.
pub(crate) fn comes_and_goes(share: f64) -> Finding {
    let statement = "Something comes and goes that follows neither place, speed, load, temperature nor time: the noise is \
                     not the same throughout a part.";
    nameless(statement, share)
}

/// A simulation far from the force, where nothing that was tried comes nearer.
pub(crate) fn far_off(share: f64) -> Finding {
    let statement = "The simulation is far from the force, and neither its own numbers nor any cause or curve brings it \
                     nearer: is it this machine's, and are its units those of the recording?";
    nameless(statement, share)
}

fn nameless(statement: &str, share: f64) -> Finding {
    Finding {
        id: "unknown".to_owned(),
        kind: "unknown",
        confidence: 0.95,
        equivalents: Vec::new(),
        carried_over: None,
        on_holdout: None,
        parameters: Vec::new(),
        share_of_mismatch: share,
        statement: statement.to_owned(),
    }
}

/// Relative half-width of the interval of a value read off a channel: recordings are written with few digits.
const READ: f64 = 2e-3;

/// A finding that a channel shows directly, with one number.
fn shown(id: Id, number: (&str, f64, &str), share: f64) -> Finding {
    let (name, value, unit) = number;
    let definition = definition(id);
    Finding {
        id: id.name().to_owned(),
        kind: definition.kind.name(),
        confidence: 0.95,
        equivalents: Vec::new(),
        carried_over: None,
        on_holdout: None,
        parameters: vec![read(name, value, unit)],
        share_of_mismatch: share,
        statement: definition.statement.to_owned(),
    }
}

/// A value read off a channel.
fn read(name: &str, value: f64, unit: &str) -> Estimate {
    let ci95 = [1.0 - READ, 1.0 + READ].map(|of| of * value);
    Estimate { name: name.to_owned(), value, ci95, unit: unit.to_owned() }
}

/// Name of the quantisation step of a force channel.
const STEP: &str = "step_n";

/// The quantisation step of a force channel, N.
pub(crate) fn step(step_n: f64) -> Estimate {
    read(STEP, step_n, "N")
}

/// A force channel whose quantisation steps are as coarse as the noise.
pub(crate) fn quantisation(step_n: f64, share: f64) -> Finding {
    shown(Id::ForceQuantisation, (STEP, step_n, "N"), share)
}

/// A force channel that saturates before the force does.
pub(crate) fn saturation(limit_n: f64, share: f64) -> Finding {
    shown(Id::ForceSaturation, ("limit_n", limit_n, "N"), share)
}

/// A recorded speed that is noisier than one derived from the position.
pub(crate) fn speed_noise(variance_m2_s2: f64, share: f64) -> Finding {
    shown(Id::SpeedNoise, ("variance_m2_s2", variance_m2_s2, "m2/s2"), share)
}

/// An encoder whose error shows in the speed that it recorded.
pub(crate) fn encoder(period_m: f64, share: f64) -> Finding {
    shown(Id::EncoderCyclicError, ("period_m", period_m, "m"), share)
}

/// A structure that is mainly excited by rolling.
pub(crate) fn resonance(heard: &Heard, share: f64) -> Finding {
    let mut finding = shown(Id::StructuralResonance, ("frequency_hz", heard.hz, "Hz"), share);
    for estimate in &mut finding.parameters {
        estimate.ci95 = [heard.hz - heard.half_width_hz, heard.hz + heard.half_width_hz];
    }
    finding
}

/// Play that the force shows around reversals.
pub(crate) fn play(gap: &Gap) -> Finding {
    let mut finding = shown(Id::CouplingBacklash, ("gap_m", gap.gap_m, "m"), 0.0);
    for estimate in &mut finding.parameters {
        estimate.ci95 = gap.ci95_m;
    }
    finding
}

/// Spots that no form of the library represents.
pub(crate) fn contamination(spots: &Spots, share: f64) -> Finding {
    let number = |name: &str, number: Number, unit: &str| Estimate {
        name: name.to_owned(),
        value: number.value,
        ci95: [-1.96, 1.96].map(|sigmas| number.value * (sigmas * number.relative).exp()),
        unit: unit.to_owned(),
    };
    let (confidence, beside) = match spots.may_have_one_duration {
        true => (TRUST_IN_DOUBT, "; pulses of one duration would look alike here: run slower as well"),
        false => (0.95, ""),
    };
    Finding {
        id: Id::Contamination.name().to_owned(),
        kind: "physics",
        confidence,
        equivalents: Vec::new(),
        carried_over: None,
        on_holdout: None,
        parameters: vec![
            number("spots_per_m", spots.per_m, "1/m"),
            number("length_m", spots.length_m, "m"),
            number("drag_n", spots.force_n, "N"),
        ],
        share_of_mismatch: share,
        statement: definition(Id::Contamination).statement.to_owned() + beside,
    }
}
