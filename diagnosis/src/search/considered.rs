//! Causes that were considered and not named, and why.

use crate::fit::bench::Bench;
use crate::fit::member::{Gain, Member};
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::refine::refine;
use crate::fit::source::Source;
use crate::report::Considered;

/// Most causes that are listed.
const LISTED: usize = 8;

/// Share of the evidence below which a cause, alone, is no rival.
const RIVAL: f64 = 0.02;

/// Share of the evidence below which a cause, beside those named, is superfluous.
const SUPERFLUOUS: f64 = 0.01;

/// The strongest causes that are neither members nor their equivalents (`equivalents`: ids).
pub(crate) fn of(
    bench: &Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &[Member],
    equivalents: &[String],
) -> Vec<Considered> {
    let law = bench.fit(&bench.law());
    let now = bench.fit_members(members);
    let alone = pool.ranked_causes(bench, &law, tolerances);
    let strongest = alone.first().map_or(0.0, |(_, gain)| gain.nats);
    let evidence = (0.5 * (law.rss - now.rss)).max(strongest);
    if members.is_empty() || !(evidence > 0.0) {
        return Vec::new();
    }
    let beside: Vec<(usize, Gain)> = pool.ranked_causes(bench, &now, tolerances);
    let mut listed = Vec::new();
    for (index, _) in alone {
        if listed.len() == LISTED {
            break;
        }
        let source = pool.causes[index].source.clone();
        let id = source.id().to_owned();
        let is_known = |member: &Member| member.candidate.source.is_kin(&source);
        if members.iter().any(is_known) || equivalents.contains(&id) || source.is_shift() {
            continue;
        }
        let (_, gain) = refine(bench, &pool.causes[index], &law);
        let share_alone = gain.nats / evidence;
        if share_alone < RIVAL {
            continue;
        }
        let more = beside
            .iter()
            .find(|(other, _)| pool.causes[*other].source.is_kin(&source))
            .map_or(0.0, |(_, gain)| gain.nats / evidence);
        let reason = if more < SUPERFLUOUS {
            "what was named explains all that it would"
        } else {
            "it explains something beside what was named, but too little, or not in every part of the recording"
        };
        listed.push(Considered { id, share_alone, share_beside: more, reason: reason.to_owned() });
    }
    // an unnamed curve is listed where it explains something beside the names
    for (index, gain) in ranked(bench, &mut pool.stories, &now, tolerances).into_iter().take(1) {
        if gain.nats / evidence > SUPERFLUOUS
            && let Source::Story { curve } = &pool.stories[index].source
        {
            listed.push(Considered {
                id: format!("unknown ({} {})", curve.axis.name(), curve.carrier.words()),
                share_alone: 0.0,
                share_beside: gain.nats / evidence,
                reason: "a curve without a name; what it explains beside the names is too little for an unknown cause"
                    .to_owned(),
            });
        }
    }
    listed
}
