//! What the runs can show at all: the lengths that they pass over, and preloads that differ.

use simulation::mechanism::{Context, Search};

use crate::fit::source::Source;

/// Ratio of largest to least preload from which forms that differ by their load are told apart.
const SEVERAL: f64 = 1.3;

/// See the module.
pub(super) struct Told {
    /// Whether preloads differ so much that a share of the preload and a change of the interference are
    /// distinguishable.
    has_several_loads: bool,
    /// Stroke and travel of the longest run, m.
    stroke_m: f64,
    travel_m: f64,
    /// Both ends of what all runs pass over, m.
    pub(super) rail_m: (f64, f64),
}

impl Told {
    pub(super) fn of(contexts: &[Context<'_>]) -> Self {
        Told {
            has_several_loads: has_several_loads(contexts),
            stroke_m: contexts.iter().map(|c| length_m(ends_m([c]))).fold(0.0, f64::max),
            travel_m: contexts.iter().filter_map(|c| c.travel_m.last().copied()).fold(0.0, f64::max),
            rail_m: ends_m(contexts),
        }
    }

    /// Whether the runs show at least half of every length of a source, and lengths since a turn are at least
    /// `seen_from_m`.
    pub(super) fn is_told(&self, source: &Source, seen_from_m: f64) -> bool {
        let Source::Mechanism { definition, form, shape } = source else { return true };
        if definition.forms[*form].is_of_share() && !self.has_several_loads {
            return false;
        }
        definition.forms[*form].shape.iter().zip(shape).all(|(parameter, value)| match parameter.search {
            Search::AlongStroke => *value <= 2.0 * self.stroke_m,
            Search::AlongTravel => *value <= 2.0 * self.travel_m,
            Search::SinceTurn => *value >= seen_from_m,
            _ => true,
        })
    }
}

/// Both ends of what these runs pass over, m; the first lies beyond the second where there is none.
fn ends_m<'c>(contexts: impl IntoIterator<Item = &'c Context<'c>>) -> (f64, f64) {
    let positions = contexts.into_iter().flat_map(|context| &context.motion.position_m).filter(|x| x.is_finite());
    positions.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), x| (from.min(*x), to.max(*x)))
}

fn length_m((from, to): (f64, f64)) -> f64 {
    (to - from).max(0.0)
}

fn has_several_loads(contexts: &[Context<'_>]) -> bool {
    let preloads = contexts.iter().flat_map(|context| &context.steady.preload_n).filter(|p| p.is_finite());
    let (least, most) = preloads.fold((f64::INFINITY, 0.0f64), |(least, most), p| (least.min(*p), most.max(*p)));
    most > SEVERAL * least
}
