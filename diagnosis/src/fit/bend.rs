//! Whether a profile fitted as a bent rail really bends.
//!
//! ```text
//! e(x) = e_0 + e_n(x)      |e_0| < rms(e_n(x))
//! ```
//!
//! e: what the profile adds to the interference (or the share of the preload), e_0: its mean over the rail. The preload
//! that a simulation states is that of the whole rail: a constant change of it is a preload that is off, or anything
//! else that grows with the drag, and says nothing of the rail. A wave of twice the stroke is half a wave there, which
//! is almost a constant.

use std::f64::consts::TAU;

use simulation::mechanism::{Id, Search};

use crate::fit::source::Source;

/// Places between the ends of the rail at which a profile is evaluated.
const PLACES: usize = 64;

/// Whether a source is a bent rail whose profile, with these amplitudes over a rail between these ends (m), has a mean
/// larger than its RMS variation.
pub(crate) fn is_level(source: &Source, amplitudes: &[f64], (from, to): (f64, f64)) -> bool {
    let Source::Mechanism { definition, form, shape } = source else { return false };
    if definition.id != Id::RailStraightness || !(to > from) {
        return false;
    }
    let profile: Vec<f64> = match (definition.forms[*form].shape, shape.as_slice()) {
        ([parameter], [wavelength]) if parameter.search == Search::AlongStroke => (0..PLACES)
            .map(|n| from + (to - from) * (n as f64 + 0.5) / PLACES as f64)
            .map(|x| wave(amplitudes, TAU * x / wavelength))
            .collect(),
        _ => amplitudes.to_vec(),
    };
    let mean = profile.iter().sum::<f64>() / profile.len() as f64;
    let change = profile.iter().map(|e| (e - mean) * (e - mean)).sum::<f64>() / profile.len() as f64;
    mean * mean > change
}

/// Sum over all orders of their sine and cosine.
fn wave(amplitudes: &[f64], phase: f64) -> f64 {
    let order = |(n, pair): (usize, &[f64])| {
        let (sin, cos) = ((n + 1) as f64 * phase).sin_cos();
        pair.iter().zip([sin, cos]).map(|(amplitude, of)| amplitude * of).sum::<f64>()
    };
    amplitudes.chunks(2).enumerate().map(order).sum()
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::definition;

    use super::*;

    fn is_level_of(form: &str, shape: &[f64], amplitudes: &[f64]) -> bool {
        let definition = definition(Id::RailStraightness);
        let form = definition.forms.iter().position(|own| own.name == form).expect("a form of the rail");
        super::is_level(&Source::Mechanism { definition, form, shape: shape.to_vec() }, amplitudes, (0.1, 1.1))
    }

    #[test]
    fn a_wave_of_the_stroke_is_a_bend_and_the_arch_of_one_of_twice_the_stroke_is_mostly_its_mean() {
        assert!(!is_level_of("minimal", &[1.0], &[0.02, 0.01]));
        // from -1 to 1 over the stroke, and from 0 over 1 to 0
        let half = |phase_at_middle: f64| {
            let (sin, cos) = (phase_at_middle - TAU * 0.6 / 2.0).sin_cos();
            [0.02 * cos, 0.02 * sin]
        };
        assert!(!is_level_of("minimal", &[2.0], &half(0.0)));
        assert!(is_level_of("minimal", &[2.0], &half(0.25 * TAU)));
    }

    #[test]
    fn a_table_is_a_bend_by_what_it_changes_by() {
        let table = |mean: f64| (0..48).map(|n| mean + 0.01 * (f64::from(n) * TAU / 47.0).sin()).collect::<Vec<_>>();
        assert!(!is_level_of("profile", &[0.1, 1.1], &table(0.005)));
        assert!(is_level_of("profile", &[0.1, 1.1], &table(0.02)));
    }
}
