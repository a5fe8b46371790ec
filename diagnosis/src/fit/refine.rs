//! Refinement of a cause's shape beyond its first grid.

use rayon::prelude::*;
use simulation::mechanism::{Search, ShapeParameter};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Candidate, Gain};
use crate::fit::source::Source;
use crate::fit::spectrum::span;

/// Refines the shape by halving steps around its present value.
pub(crate) fn refine(bench: &Bench<'_>, candidate: &Candidate, fit: &Fit) -> (Candidate, Gain) {
    let mut best = candidate.clone();
    bench.prepare(&mut best, &fit.active);
    let mut gain = bench.gain(&best, fit);
    let Source::Mechanism { definition, form, .. } = best.source else { return (best, gain) };
    let parameters = definition.forms[form].shape;
    let mut steps: Vec<f64> = match &best.source {
        Source::Mechanism { shape, .. } => {
            parameters.iter().zip(shape).map(|(p, x)| first_step(p, *x, bench)).collect()
        }
        _ => Vec::new(),
    };
    let rounds = if parameters.is_empty() { 0 } else { 5 };
    for _ in 0..rounds {
        for (k, parameter) in parameters.iter().enumerate().filter(|(_, parameter)| is_searched(parameter)) {
            for side in [-1.0, 1.0] {
                let Source::Mechanism { shape, .. } = &best.source else { break };
                let mut shape = shape.clone();
                let share = parameter.share_of(shape[k]);
                let moved = (share + side * steps[k]).clamp(0.0, 1.0);
                if moved == share {
                    continue;
                }
                shape[k] = parameter.at(moved);
                let source = Source::Mechanism { definition, form, shape };
                let Some(other) = bench.prepared(source, &fit.active) else { continue };
                let other_gain = bench.gain(&other, fit);
                if other_gain.score > gain.score {
                    (best, gain) = (other, other_gain);
                    break;
                }
            }
            steps[k] *= 0.5;
        }
    }
    (best, gain)
}

/// Refines several, on all processors, in the same order.
pub(crate) fn refine_all<'c>(
    bench: &Bench<'_>,
    candidates: impl IntoIterator<Item = &'c Candidate>,
    fit: &Fit,
) -> Vec<(Candidate, Gain)> {
    let candidates: Vec<&Candidate> = candidates.into_iter().collect();
    candidates.into_par_iter().map(|candidate| refine(bench, candidate, fit)).collect()
}

fn is_searched(parameter: &ShapeParameter) -> bool {
    !matches!(parameter.search, Search::StrokeStart | Search::StrokeEnd)
}

/// First step of a refinement, as a share of the range: half a step of the grid; for a wave, the change that turns its
/// phase by an eighth of a period over the stroke.
fn first_step(parameter: &ShapeParameter, value: f64, bench: &Bench<'_>) -> f64 {
    if parameter.search == Search::Wave {
        let (start, end) = span(bench);
        0.125 * value / (end - start).max(value) / (parameter.to / parameter.from).ln()
    } else {
        0.5 / (parameter.grid.max(2) - 1) as f64
    }
}
