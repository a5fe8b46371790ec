//! Scoring of the stated place of a mismatch: the axis, and the agreement of the stretch.
//!
//! Of several places the first counts, that with the largest share. The true stretch is the shortest run of cells with
//! [`CORE`] of the effect's energy; agreement is `F1 = 2 |stated ∩ true| / (|stated| + |true|)`, measured in samples.

use serde::Serialize;

use super::answer;
use super::truth::{Effect, Place, Stretch};

/// Share of the energy within the true stretch.
pub const CORE: f64 = 0.8;
/// A stretch is compared where means along its axis explain this share of the energy.
const EXPLAINED: f64 = 0.2;
/// Relative error at which a period is still the right one.
const PERIOD: f64 = 0.05;

/// A stated place, scored.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Located {
    /// The stated axis.
    pub axis: String,
    /// Whether a hidden effect depends on it; a period must agree as well.
    pub is_right: bool,
    /// Agreement of the stretch, where it can be told.
    pub f1: Option<f64>,
}

/// Scores the first place; `None` where none was stated or nothing is hidden.
pub fn locate(effects: &[Effect], places: &[answer::Place]) -> Option<Located> {
    let stated = places.first()?;
    let known = || effects.iter().map(|effect| &effect.place).filter(|place| !place.axes.is_empty());
    known().next()?;
    let right = known().find(|place| is_right(place, stated));
    let f1 = right.and_then(|place| place.stretches.get(&stated.axis)).and_then(|stretch| overlap(stretch, stated));
    Some(Located { axis: stated.axis.clone(), is_right: right.is_some(), f1 })
}

fn is_right(place: &Place, stated: &answer::Place) -> bool {
    if !place.axes.contains(&stated.axis) {
        return false;
    }
    let periods = match stated.axis.as_str() {
        "wavelength" => &place.wavelengths_m,
        "frequency" => &place.frequencies_hz,
        _ => return true,
    };
    let (Some(from), Some(to)) = (stated.from, stated.to) else { return false };
    let holds = |period: f64| from <= period * (1.0 + PERIOD) && to >= period * (1.0 - PERIOD);
    // of two tones a sweep covers what is in between
    let sweeps = periods.len() == 2 && stated.axis == "frequency" && from >= periods[0] && to <= periods[1];
    let harmonic = |n: f64| if stated.axis == "wavelength" { 1.0 / n } else { n };
    periods.is_empty() || sweeps || periods.iter().any(|p| [1.0, 2.0, 3.0].iter().any(|n| holds(p * harmonic(*n))))
}

fn overlap(stretch: &Stretch, stated: &answer::Place) -> Option<f64> {
    let (from, to) = (stated.from?, stated.to?);
    if stretch.explained < EXPLAINED {
        return None;
    }
    let core = core(stretch)?;
    // a stated end is rounded to the columns' digits
    let slack = 1e-6 * (to - from).abs().max(from.abs().max(to.abs()));
    let (mut both, mut said, mut is) = (0.0, 0.0, 0.0);
    for (n, samples) in stretch.samples.iter().enumerate() {
        let (low, high) = (*stretch.from.get(n)?, *stretch.to.get(n)?);
        let inside = if high > low {
            ((to.min(high) - from.max(low)) / (high - low)).clamp(0.0, 1.0)
        } else {
            f64::from(u8::from(low >= from - slack && low <= to + slack))
        };
        let is_core = f64::from(u8::from(core.contains(&n)));
        said += samples * inside;
        is += samples * is_core;
        both += samples * inside * is_core;
    }
    (said + is > 0.0).then(|| 2.0 * both / (said + is))
}

/// The shortest run of cells, measured in samples, with [`CORE`] of the energy.
fn core(stretch: &Stretch) -> Option<std::ops::Range<usize>> {
    let cells = stretch.energy.len().min(stretch.samples.len());
    let mut best: Option<(f64, std::ops::Range<usize>)> = None;
    for first in 0..cells {
        let (mut energy, mut samples) = (0.0, 0.0);
        for last in first..cells {
            energy += stretch.energy[last];
            samples += stretch.samples[last];
            if energy >= CORE - 1e-9 {
                if best.as_ref().is_none_or(|(least, _)| samples < *least) {
                    best = Some((samples, first..last + 1));
                }
                break;
            }
        }
    }
    best.map(|(_, cells)| cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stated(axis: &str, from: f64, to: f64) -> answer::Place {
        answer::Place { axis: axis.into(), from: Some(from), to: Some(to), id: None }
    }

    fn effect() -> Effect {
        let stretch = Stretch {
            explained: 0.9,
            from: vec![0.0, 1.0, 2.0, 3.0],
            to: vec![1.0, 2.0, 3.0, 4.0],
            samples: vec![0.25; 4],
            energy: vec![0.05, 0.5, 0.4, 0.05],
        };
        let place = Place {
            axes: vec!["velocity".into(), "wavelength".into()],
            stretches: [("velocity".to_owned(), stretch)].into(),
            wavelengths_m: vec![0.020],
            frequencies_hz: vec![],
        };
        Effect { place, ..Effect::default() }
    }

    #[test]
    fn the_largest_place_is_held_against_the_true_axis_and_stretch() {
        let effects = [effect()];
        let f1 = |from, to| locate(&effects, &[stated("velocity", from, to)]).unwrap().f1.unwrap();
        assert!((f1(1.0, 3.0) - 1.0).abs() < 1e-12);
        assert!((f1(0.0, 4.0) - 2.0 / 3.0).abs() < 1e-12);
        assert!((f1(2.0, 4.0) - 0.5).abs() < 1e-12);
        assert_eq!(f1(3.0, 4.0), 0.0);
        let wrong = locate(&effects, &[stated("time", 0.0, 1.0), stated("velocity", 1.0, 3.0)]).unwrap();
        assert!(!wrong.is_right && wrong.f1.is_none(), "only the first counts");
        assert_eq!(locate(&effects, &[]), None);
        assert_eq!(locate(&[], &[stated("time", 0.0, 1.0)]), None);
    }

    #[test]
    fn a_period_must_agree() {
        let is_right = |from, to| locate(&[effect()], &[stated("wavelength", from, to)]).unwrap().is_right;
        assert!(is_right(0.0199, 0.0201) && is_right(0.010, 0.010), "itself or a harmonic");
        assert!(!is_right(0.014, 0.015));
    }

    #[test]
    fn cells_of_single_values_count_as_a_whole() {
        let mut effect = effect();
        let stretch = effect.place.stretches.get_mut("velocity").unwrap();
        stretch.to = stretch.from.clone();
        let found = locate(&[effect], &[stated("velocity", 1.0, 2.0)]).unwrap();
        assert_eq!(found.f1, Some(1.0));
    }
}
