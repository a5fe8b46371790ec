//! Cable chain: whether what looks like one is a seal and an offset.
//!
//! A chain drags, and pulls the more the farther the carriage goes. A seal and an offset explain its drag and constant
//! pull as well; only a pull that changes along the rail speaks for a chain:
//!
//! ```text
//! it hardly changes along the rail      a seal and an offset, no chain
//! else                                  a chain; its constant pull is its own, since nothing in a recording tells it from
//!                                       an offset beside it
//! ```

use simulation::mechanism::{Id, definition};

use crate::fit::bench::Bench;
use crate::fit::member::{Beside, Member};
use crate::fit::source::Source;
use crate::search::holds::FURTHER;
use crate::search::{drop_idle, without};

/// Replaces a chain whose pull hardly changes along the rail by a seal and an offset. Returns whether more is to be
/// searched for.
pub(super) fn straighten(bench: &mut Bench<'_>, members: &mut Vec<Member>) -> bool {
    let Some(at) = members.iter().position(|member| member.candidate.source.is(Id::CableChain)) else { return false };
    let has_one_apart = without(members, at)
        .iter()
        .any(|other| other.candidate.source.is_any(&[Id::ForceOffset, Id::GravityTilt, Id::SealDrag]));
    if has_one_apart {
        return false;
    }
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

fn minimal(id: Id) -> Source {
    Source::Mechanism { definition: definition(id), form: 0, shape: Vec::new() }
}
