//! Joint exchanges: one cause is exchanged while the shapes of all others are free.
//!
//! Causes taken up one after the other have adapted to one another: each is the best beside the other as it is, yet two
//! other causes may explain far more. A replacement is judged after the others have found their shapes and forms beside
//! it.

use crate::fit::bench::Bench;
use crate::fit::member::{Beside, Candidate, Member};
use crate::fit::pool::{Pool, Tolerances};
use crate::search::equivalents::LONGER_FORM;
use crate::search::{BETTER, is_of_one, worth};

/// Replacements tried per member, the best first.
const TRIED: usize = 3;

/// Share of a member's score that a replacement must reach, with the others as they are, to be tried.
const LEAST: f64 = 0.3;

/// Number of parameters from which on a cause may really be two simpler ones.
const RICH: usize = 3;

/// Share of all evidence that two causes must explain beyond the one they replace. Of such pairs on opened trials (23
/// to 25) three above it were right and one was false; of those below it one was right and five were false.
const FOR_TWO: f64 = 0.05;

/// Rounds in which the others adapt their shapes.
const ROUNDS: usize = 2;

/// Most exchanges, and most members among which causes are exchanged.
const MOST: usize = 3;
const MOST_MEMBERS: usize = 4;

/// Exchanges members as long as that explains more, by more than a longer form adds to one cause. Returns whether it
/// did.
pub(super) fn exchange(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut Vec<Member>,
) -> bool {
    let mut has_exchanged = false;
    for _ in 0..MOST {
        if members.len() > MOST_MEMBERS {
            break;
        }
        let now = worth(bench, members);
        let mut best: Option<(f64, Vec<Member>)> = None;
        for at in 0..members.len() {
            for mut exchanged in choices(bench, pool, tolerances, members, at) {
                settle(bench, pool, &mut exchanged);
                let then = worth(bench, &exchanged);
                let most = best.as_ref().map_or(now, |(most, _)| *most);
                if then > most.max(asked(now, exchanged.len() > members.len())) {
                    best = Some((then, exchanged));
                }
            }
        }
        let Some((_, exchanged)) = best else { break };
        *members = exchanged;
        has_exchanged = true;
    }
    has_exchanged
}

/// Worth that replacements must exceed where the present members have `now`, nats.
fn asked(now: f64, has_one_more: bool) -> f64 {
    let share = if has_one_more { FOR_TWO } else { LONGER_FORM };
    now + BETTER.max(share * now)
}

/// Sets of members with another cause in place of one, or with two in place of one that has many parameters.
fn choices(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &[Member],
    at: usize,
) -> Vec<Vec<Member>> {
    let may_be_two = members[at].candidate.freedom() >= RICH && !members[at].candidate.source.is_table();
    if members.len() < 2 && !may_be_two {
        return Vec::new();
    }
    let Beside { others, fit, own, gain } = bench.beside(members, at);
    let mut firsts: Vec<Candidate> = pool
        .ranked_causes(bench, &fit, tolerances)
        .into_iter()
        .filter(|(_, of)| of.score > LEAST * gain.score)
        .map(|(index, _)| &pool.causes[index])
        .filter(|cause| is_another(cause, members, pool, tolerances))
        .take(TRIED)
        .cloned()
        .collect();
    let another = firsts.len();
    if may_be_two && !own.source.is_minimal() {
        firsts.extend(pool.minimal(bench, &own.source, &fit).map(|(minimal, _)| minimal.clone()));
    }
    let mut choices: Vec<Vec<Member>> =
        firsts.into_iter().map(|first| others.iter().cloned().chain([bench.take(first)]).collect()).collect();
    if may_be_two {
        let two: Vec<_> = choices.iter().filter_map(|first| with_second(bench, pool, tolerances, first)).collect();
        choices.truncate(another);
        choices.extend(two);
    }
    if members.len() < 2 {
        choices.retain(|choice| choice.len() > 1);
    }
    choices
}

/// The members, and the cause that explains most beside them.
fn with_second(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &[Member],
) -> Option<Vec<Member>> {
    let fit = bench.fit_members(members);
    let ranked = pool.ranked_causes(bench, &fit, tolerances);
    let mut causes = ranked.into_iter().map(|(index, _)| &pool.causes[index]);
    let second = causes.find(|cause| is_another(cause, members, pool, tolerances))?.clone();
    Some(members.iter().cloned().chain([bench.take(second)]).collect())
}

/// Whether a cause is none of the members and no table.
fn is_another(cause: &Candidate, members: &[Member], pool: &Pool, tolerances: &Tolerances<'_>) -> bool {
    !cause.source.is_table() && !is_of_one(members, &cause.source, tolerances, pool.span_m)
}

/// Lets the causes adapt their forms and shapes to one another.
fn settle(bench: &mut Bench<'_>, pool: &mut Pool, members: &mut [Member]) {
    for _ in 0..ROUNDS {
        for at in 0..members.len() {
            // a table follows anything, whatever stands beside it
            if members[at].candidate.source.is_table() {
                continue;
            }
            let Beside { fit, own, .. } = bench.beside(members, at);
            let best = pool.best_of(bench, &own.source, &fit, 1).pop().map(|(candidate, _)| candidate);
            if let Some(best) = best.filter(|best| !best.source.is_same(&own.source)) {
                members[at] = bench.take(best);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::mechanism::{Added, Id, definition};
    use simulation::profile::{Conditions, Order, Staircase};
    use simulation::run::Run;
    use simulation::sensor::Noise;

    use super::*;
    use crate::fit::source::Source;
    use crate::search::polish;
    use crate::search::workbench::{GUIDE, at_bench, taken};

    #[test]
    fn a_further_name_is_asked_for_a_twentieth_more_and_none_is_given_for_what_chance_adds() {
        assert_eq!([false, true].map(|has_one_more| asked(1000.0, has_one_more)), [1010.0, 1050.0]);
        assert_eq!([false, true].map(|has_one_more| asked(20.0, has_one_more)), [23.0, 23.0]);
    }

    /// Strokes of a block that loses preload while it runs in a grease that grips.
    fn run(simulation: &Simulation, preload_n: f64) -> Run {
        let at = Conditions { preload_n: Some(preload_n), temperature_degc: Some(40.0), external_load_n: None };
        let speeds_m_s = vec![0.01, 0.03, 0.1, 0.3];
        let staircase = Staircase {
            speeds_m_s,
            length_m: 0.3,
            hold_s: 0.0,
            strokes: 3,
            order: Order::Both,
            ..Staircase::default()
        };
        let course = staircase.course(200.0, &at).expect("a course");
        let mut machine = simulation.clone();
        machine.mechanisms = vec![
            Added { id: Id::PreloadLoss, form: 1, shape: vec![3.2], amplitudes: vec![-0.04] },
            Added { id: Id::ViscousDrag, form: 0, shape: vec![0.64], amplitudes: vec![0.7] },
        ];
        let mut noise = Noise::new(preload_n as u64, 0);
        let force = machine.force(&course.run, &course.motion).expect("a force");
        Run { drag_force_n: force.iter().map(|f| f + 0.2 * noise.gaussian()).collect(), ..course.run }
    }

    #[test]
    fn a_run_in_beside_grease_that_suits_it_gives_way_to_a_loss_of_preload() {
        let simulation = Simulation::from_toml(GUIDE).expect("a sound file");
        let runs = [1500.0, 3000.0, 6000.0].map(|preload_n| run(&simulation, preload_n));
        let names = at_bench(&simulation, &runs, |bench, pool, tolerances| {
            let source = |(id, number)| Source::Mechanism { definition: definition(id), form: 0, shape: vec![number] };
            let mut members = taken(bench, [(Id::RunIn, 20.0), (Id::ViscousDrag, 0.4)].map(source));
            (0..3).for_each(|_| polish(bench, &mut members));
            assert!(exchange(bench, pool, tolerances, &mut members));
            let mut names: Vec<&str> = members.iter().map(|member| member.candidate.source.id()).collect();
            names.sort_unstable();
            names
        });
        assert_eq!(names, ["preload-loss", "viscous-drag"]);
    }
}
