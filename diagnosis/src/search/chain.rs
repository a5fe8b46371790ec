//! Cable chain: which parts of its force belong to another cause.
//!
//! A chain drags, and pulls the more the farther the carriage goes. A seal and an offset explain its drag and constant
//! pull as well; only a pull that changes along the rail speaks for a chain:
//!
//! ```text
//! it hardly changes along the rail                          a seal and an offset, no chain
//! mean pull / half of its change over the stroke  <= 3      a chain: its pull is nothing within a stroke of the ends
//!                                                 > 3       a chain, and an offset or a tilt beside it
//! ```

use simulation::mechanism::{Id, definition};

use crate::fit::bench::Bench;
use crate::fit::member::{Beside, Member};
use crate::fit::pool::grid;
use crate::fit::refine::refine_all;
use crate::fit::source::{Source, is_balanced};
use crate::fit::spectrum::span;
use crate::search::holds::FURTHER;
use crate::search::{drop_idle, without};

/// Largest ratio of mean pull to half its change over the stroke that is the chain's own: where it pulls with nothing lies
/// within one stroke of the stroke's ends then.
const OWN: f64 = 3.0;

/// Standard errors by which the mean pull must lie beyond that.
const SURE: f64 = 3.0;

/// Reassigns the constant parts of a cable chain's force to seal and offset. Returns whether more is to be searched
/// for.
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

/// Replaces a chain whose pull hardly changes along the rail by a seal and an offset. Returns whether it did.
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

/// Moves a mean pull that the chain cannot have out of it, into an offset. Returns whether it did.
fn balance(bench: &mut Bench<'_>, members: &mut Vec<Member>, at: usize) -> bool {
    let Source::Mechanism { definition, form, .. } = &members[at].candidate.source else { return false };
    let fit = bench.fit_members(members);
    let own =
        definition.forms[*form].amplitudes.iter().map(|amplitude| amplitude.name).zip(members[at].amplitudes(&fit));
    let of = |name: &str| own.clone().find(|(own, _)| *own == name).map_or(0.0, |(_, x)| x);
    let pull = [of("force_n"), of("force_per_m_n_m"), of("force_per_m2_n_m2")];
    let (from, to) = span(bench);
    if bench.is_relative || !(to > from) || pull[0] == 0.0 {
        return false;
    }
    let (mean_n, beyond_n) = beyond_its_own(pull, from, to);
    if beyond_n <= 0.0 {
        return false;
    }
    let balanced = (0..definition.forms.len()).filter(|form| is_balanced(&definition.forms[*form]));
    let shapes =
        |form: usize| grid(&definition.forms[form], usize::MAX, (from, to)).into_iter().map(move |shape| (form, shape));
    let source = |(form, shape)| Source::Mechanism { definition, form, shape };
    let mut instead = without(members, at);
    let Some(offset) = bench.candidate(minimal(Id::ForceOffset)) else { return false };
    instead.push(bench.take(offset));
    let beside = bench.fit_members(&instead);
    let chains = bench.candidates(balanced.flat_map(shapes).map(source));
    let best = refine_all(bench, &chains, &beside).into_iter().max_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let Some((chain, _)) = best else { return false };
    let offset_at = instead.len() - 1;
    instead.push(bench.take(chain));
    // twice the evidence (nats) is the squared ratio of the mean to its standard error
    let evidence = bench.beside(&instead, offset_at).gain.nats;
    let is_told = beyond_n * (2.0 * evidence).sqrt() > SURE * mean_n.abs();
    if is_told {
        *members = instead;
    }
    is_told
}

fn minimal(id: Id) -> Source {
    Source::Mechanism { definition: definition(id), form: 0, shape: Vec::new() }
}

/// Mean of a pull `[N, N/m, N/m²]` over the stroke, and how far it lies beyond what a chain can have itself, N (≤ 0:
/// within).
fn beyond_its_own(pull: [f64; 3], from: f64, to: f64) -> (f64, f64) {
    let at = |x: f64| pull[0] + x * (pull[1] + x * pull[2]);
    let peak = Some(-0.5 * pull[1] / pull[2]).filter(|x| (from..=to).contains(x)).map_or(at(from), at);
    let ends = [at(from), at(to), peak];
    let least = ends.iter().copied().fold(f64::INFINITY, f64::min);
    let most = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let half = 0.5 * (most - least);
    // Simpson's rule, exact for a parabola
    let mean = (at(from) + 4.0 * at(0.5 * (from + to)) + at(to)) / 6.0;
    (mean, mean.abs() - OWN * half)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(pull: [f64; 3], from: f64, to: f64) -> bool {
        beyond_its_own(pull, from, to).1 <= 0.0
    }

    #[test]
    fn a_mean_pull_is_a_chains_own_where_it_hangs_straight_within_a_stroke_of_the_ends() {
        // about the middle of 0.1 to 1.1 m, from one end, straight and curved
        assert!(own([-1.8, 3.0, 0.0], 0.1, 1.1));
        assert!(own([-2.0, 3.0, 0.3], 0.1, 1.1));
        assert!(own([-0.3, 3.0, 0.0], 0.1, 1.1));
        assert!(own([3.3, -3.0, 0.0], 0.1, 1.1));
        // over part of its way: it hangs straight half a stroke before the first end
        assert!(own([1.2, 3.0, 0.0], 0.1, 1.1));
        // two strokes before it, and with far more than its change
        assert!(!own([5.7, 3.0, 0.0], 0.1, 1.1));
        assert!(!own([5.0, 0.2, 0.0], 0.1, 1.1));
    }
}
