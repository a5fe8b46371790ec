//! What of a cable chain's force is another's.
//!
//! A chain drags, and pulls the more the farther the carriage goes. Its drag and its constant pull are what a seal and an offset
//! are too, and only what changes along the rail speaks for a chain:
//!
//! ```text
//! it hardly changes along the rail                              a seal and an offset, no chain
//! mean pull / half of what it changes by over the stroke  ~ 0   a chain that hangs evenly about its middle
//!                                                         ~ 1   one that pulls at one end only
//!                                                        else   a chain, and an offset or a tilt beside it
//! ```

use simulation::mechanism::{Id, definition};

use crate::fit::bench::{Bench, Beside, Member};
use crate::fit::pool::grid;
use crate::fit::refine::refine;
use crate::fit::source::Source;
use crate::fit::spectrum::span;
use crate::search::holds::FURTHER;
use crate::search::{drop_idle, without};

/// How far the mean pull of a chain, of half of what it changes by, may be from 0 and from 1: the stroke that was passed over need
/// not be all of the chain's.
const UNEVEN: f64 = 0.25;

/// The forms that pull nothing on the average of the stroke.
const BALANCED: [&str; 2] = ["balanced", "balanced-rolling"];

/// Gives the constant parts of a cable chain's force to those whose they are. Answers whether there is more to search for.
pub(super) fn set_apart(bench: &mut Bench<'_>, members: &mut Vec<Member>) -> bool {
    let Some(at) = members.iter().position(|member| member.candidate.source.is(Id::CableChain)) else { return false };
    let others = without(members, at);
    let has = |id: Id| others.iter().any(|other| other.candidate.source.is(id));
    if has(Id::ForceOffset) || has(Id::GravityTilt) {
        return false;
    }
    let is_straight = !has(Id::SealDrag) && straighten(bench, members, at);
    !is_straight && balance(bench, members, at)
}

/// Whether it is a chain whose mean pull has been taken out: any other of its forms would take that back.
pub(super) fn is_balanced(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, form, .. }
        if definition.id == Id::CableChain && BALANCED.contains(&definition.forms[*form].name))
}

/// Replaces a chain that hardly changes along the rail by what is left of it then. Answers whether it did.
fn straighten(bench: &mut Bench<'_>, members: &mut Vec<Member>, at: usize) -> bool {
    let Beside { others, fit, gain, .. } = bench.beside(members, at);
    let mut instead = others;
    for candidate in bench.candidates([minimal(Id::SealDrag), minimal(Id::ForceOffset)]) {
        instead.push(bench.take(candidate));
    }
    let nats = 0.5 * (fit.rss - bench.fit_members(&instead).rss);
    if !(nats > (1.0 - FURTHER) * gain.nats) {
        return false;
    }
    *members = instead;
    drop_idle(bench, members);
    true
}

/// Takes a mean pull that is no chain's out of one. Answers whether it did.
fn balance(bench: &mut Bench<'_>, members: &mut Vec<Member>, at: usize) -> bool {
    let Source::Mechanism { definition, form, .. } = &members[at].candidate.source else { return false };
    let fit = bench.fit_members(members);
    let own =
        definition.forms[*form].amplitudes.iter().map(|amplitude| amplitude.name).zip(members[at].amplitudes(&fit));
    let of = |name: &str| own.clone().find(|(own, _)| *own == name).map_or(0.0, |(_, x)| x);
    let pull = [of("force_n"), of("force_per_m_n_m"), of("force_per_m2_n_m2")];
    let (from, to) = span(bench);
    if bench.is_relative || !(to > from) || pull[0] == 0.0 || !is_anothers(pull, from, to) {
        return false;
    }
    let balanced = (0..definition.forms.len()).filter(|form| BALANCED.contains(&definition.forms[*form].name));
    let shapes =
        |form: usize| grid(&definition.forms[form], usize::MAX, (from, to)).into_iter().map(move |shape| (form, shape));
    let source = |(form, shape)| Source::Mechanism { definition, form, shape };
    let mut without_chain = without(members, at);
    let Some(offset) = bench.candidate(minimal(Id::ForceOffset)) else { return false };
    without_chain.push(bench.take(offset));
    let beside = bench.fit_members(&without_chain);
    let best = bench
        .candidates(balanced.flat_map(shapes).map(source))
        .into_iter()
        .map(|mut candidate| {
            bench.prepare(&mut candidate, &beside.active);
            refine(bench, &candidate, &beside)
        })
        .max_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let Some((chain, _)) = best else { return false };
    without_chain.push(bench.take(chain));
    *members = without_chain;
    true
}

fn minimal(id: Id) -> Source {
    Source::Mechanism { definition: definition(id), form: 0, shape: Vec::new() }
}

/// Whether a pull `[N, N/m, N/m²]` over the stroke has a mean that no chain has by itself.
fn is_anothers(pull: [f64; 3], from: f64, to: f64) -> bool {
    let at = |x: f64| pull[0] + x * (pull[1] + x * pull[2]);
    let peak = Some(-0.5 * pull[1] / pull[2]).filter(|x| (from..=to).contains(x)).map_or(at(from), at);
    let ends = [at(from), at(to), peak];
    let (least, most) =
        (ends.iter().copied().fold(f64::INFINITY, f64::min), ends.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    // of a parabola, exactly
    let mean = (at(from) + 4.0 * at(0.5 * (from + to)) + at(to)) / 6.0;
    let share = mean.abs() / (0.5 * (most - least));
    share > UNEVEN && (share - 1.0).abs() > UNEVEN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_pull_is_a_chains_own_where_it_hangs_evenly_or_pulls_at_one_end() {
        // about the middle of 0.1 to 1.1 m, from one end, straight and curved
        assert!(!is_anothers([-1.8, 3.0, 0.0], 0.1, 1.1));
        assert!(!is_anothers([-2.0, 3.0, 0.3], 0.1, 1.1));
        assert!(!is_anothers([-0.3, 3.0, 0.0], 0.1, 1.1));
        assert!(!is_anothers([3.3, -3.0, 0.0], 0.1, 1.1));
        // with half as much again, and with far more than it changes by
        assert!(is_anothers([-1.0, 3.0, 0.0], 0.1, 1.1));
        assert!(is_anothers([-2.6, 3.0, 0.0], 0.1, 1.1));
        assert!(is_anothers([5.0, 0.2, 0.0], 0.1, 1.1));
    }
}
