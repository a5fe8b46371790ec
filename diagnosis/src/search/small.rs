//! Causes that carry next to nothing of what is explained: what the form of another leaves, rather than causes.

use simulation::mechanism::Id;

use crate::fit::bench::Bench;
use crate::fit::member::{Beside, Candidate, Gain, Member};
use crate::fit::pool::Pool;
use crate::fit::rest::{among, beyond, power};
use crate::numbers::linear::{Cholesky, Symmetric, dot};
use crate::search::adequacy;
use crate::search::found::amplitudes;
use crate::search::holds::{Floor, is_small, may_leave, shows_beside_leavings};

/// Share, in square, of what all causes explain together below which a cause is not named: less than a fourteenth of a
/// force is within the error of its form. Of 16 such fitted names on opened trials (9, 10 and seed 303) all were false,
/// but for those in records that were named wrong anyway.
pub(crate) const LEAST_SHARE: f64 = 0.005;

/// [`LEAST_SHARE`] for a cause with little evidence of its own beside the others.
pub(crate) const LEAST_SHARE_OF_SMALL: f64 = 0.035;

/// [`LEAST_SHARE`] for a cause with a shape parameter at its end: no real cause fits well there; it follows a form's
/// remainder, which no form in the library describes.
const LEAST_SHARE_AT_ITS_END: f64 = 2.0 * LEAST_SHARE_OF_SMALL;

/// Share of the summed squares of all forces from which a cause is named although it cancels in their sum, counting
/// only what the others do not imitate. Of six such names on opened trials (22 and 23) the two above it were right, and
/// one of the four below.
const LEAST_SHARE_AGAINST: f64 = 4.0 * LEAST_SHARE;

/// Share of what is explained, ringing included, below which nothing is named beside a structure that rings: that is
/// what its form leaves. Of eight such names on opened trials (24 to 30) seven were false, of some sixty above 0.02 four;
/// none was between.
const LEAST_SHARE_BESIDE_RINGING: f64 = 0.015;

/// Share of all evidence from which a cause is named however small its force averaged over all rows: it acts in few
/// rows.
const MUCH_EVIDENCE: f64 = 0.5;

/// Drops members, the smallest first, that carry next to nothing of what they explain together with all members whose
/// form may leave what they follow.
pub(crate) fn drop_small(bench: &Bench<'_>, pool: &Pool, members: &mut Vec<Member>) {
    while members.len() > 1 {
        let fit = bench.fit_members(members);
        let amplitudes = amplitudes(members, &fit);
        let force = |(member, x): (&Member, &Vec<f64>)| bench.force(&member.candidate.source, x);
        let tangent = imitated(bench, members);
        let forces: Vec<Vec<f64>> =
            members.iter().zip(&amplitudes).map(|pair| beyond(&bench.rows, &tangent, &force(pair))).collect();
        // a member's own force and those of all members that may leave it
        let together = |at: usize| -> Vec<&[f64]> {
            let leaving = |other: &usize| *other != at && may_leave(&members[*other], &members[at].candidate);
            let others = (0..members.len()).filter(leaving);
            std::iter::once(at).chain(others).map(|member| forces[member].as_slice()).collect()
        };
        let shares: Vec<f64> = (0..members.len()).map(|at| among(&together(at))[0]).collect();
        let evidence = 0.5 * (bench.fit(&bench.law()).rss - fit.rss);
        let shows =
            |own: &Candidate, gain: &Gain, others: &[Member]| shows_beside_leavings(bench, pool, own, gain, others);
        let least = |at: usize| {
            if bench.is_spoken_for(&members[at].candidate.source) {
                return 0.0;
            }
            let Beside { others, fit, own, gain } = bench.beside(members, at);
            let is_at_an_end = || adequacy::is_held_at_an_end(bench, &fit, &own, &gain);
            least_share(gain.nats / evidence, is_at_an_end, || {
                is_small(bench, &own, &gain, &others) && !shows(&own, &gain, &others)
            })
        };
        let pulls_against = |at: &usize| {
            let Beside { others, fit, own, gain } = bench.beside(members, *at);
            !adequacy::is_held_at_an_end(bench, &fit, &own, &gain)
                && share_against(&together(*at)) > LEAST_SHARE_AGAINST
                && shows(&own, &gain, &others)
        };
        let smallest = (0..members.len())
            .filter(|at| shares[*at] > LEAST_SHARE || !pulls_against(at))
            .min_by(|a, b| shares[*a].total_cmp(&shares[*b]));
        match smallest.filter(|at| shares[*at] < least(*at)) {
            Some(at) => members.remove(at),
            None => return,
        };
    }
}

/// Drops members, the smallest first, that carry next to nothing beside a structure that rings: a member, or one that the
/// spectrum shows. `heard_n2`: mean square of its force, N²; 0 where none is heard.
pub(crate) fn drop_beside_ringing(bench: &Bench<'_>, heard_n2: f64, members: &mut Vec<Member>) {
    let rings = |member: &Member| member.candidate.source.is(Id::StructuralResonance);
    while heard_n2 > 0.0 || members.iter().any(rings) {
        if !drop_smallest(bench, heard_n2, LEAST_SHARE_BESIDE_RINGING, members) {
            return;
        }
    }
}

/// Drops members, the smallest first, that carry next to nothing beside the noise of a recorded speed that was
/// discarded: the speed derived in its place leaves as much where the motion turns. `discarded_n2`: mean square of the
/// noise's effect on the force, N²; 0 where no speed was discarded.
pub(crate) fn drop_beside_noisy_speed(bench: &Bench<'_>, discarded_n2: f64, members: &mut Vec<Member>) {
    while discarded_n2 > 0.0 && drop_smallest(bench, discarded_n2, LEAST_SHARE, members) {}
}

/// Drops pairs of members of which nothing that matters is left where they act against one another: a filter and a
/// recording that is early by as much round off what noise there is.
pub(crate) fn drop_what_cancels(bench: &Bench<'_>, floor: Floor, members: &mut Vec<Member>) {
    while let Some((one, other)) = cancelling(bench, floor, members) {
        members.remove(other);
        members.remove(one);
    }
}

/// Two members, the former first, whose RMS force together is below the floor of either.
fn cancelling(bench: &Bench<'_>, floor: Floor, members: &[Member]) -> Option<(usize, usize)> {
    let fit = bench.fit_members(members);
    let forces: Vec<Vec<f64>> =
        members.iter().map(|member| bench.force(&member.candidate.source, &member.amplitudes(&fit))).collect();
    let is_asked = |at: &usize| !bench.is_spoken_for(&members[*at].candidate.source) && !forces[*at].is_empty();
    let asked: Vec<usize> = (0..members.len()).filter(is_asked).collect();
    let pairs =
        asked.iter().flat_map(|one| asked.iter().filter(move |other| *other > one).map(move |other| (*one, *other)));
    pairs.into_iter().find(|(one, other)| {
        let together: Vec<f64> = forces[*one].iter().zip(&forces[*other]).map(|(one, other)| one + other).collect();
        let least = floor.of(&members[*one].candidate.source).min(floor.of(&members[*other].candidate.source));
        power(&bench.rows, &together).sqrt() < least
    })
}

/// Drops the smallest member that neither rings nor is spoken for, if its share of what all explain together with
/// another mean square, N², is below `least`. Returns whether there was one.
fn drop_smallest(bench: &Bench<'_>, beside_n2: f64, least: f64, members: &mut Vec<Member>) -> bool {
    let fit = bench.fit_members(members);
    let tangent = imitated(bench, members);
    let beyond_law = |(member, amplitudes): (&Member, Vec<f64>)| {
        beyond(&bench.rows, &tangent, &bench.force(&member.candidate.source, &amplitudes))
    };
    let forces: Vec<Vec<f64>> = members.iter().zip(amplitudes(members, &fit)).map(beyond_law).collect();
    let forces: Vec<&[f64]> = forces.iter().map(Vec::as_slice).collect();
    let explained_n2 = explained_n2(&forces);
    let least = least * (explained_n2 + beside_n2) / explained_n2;
    let shares = among(&forces);
    let is_named = |at: &usize| {
        let source = &members[*at].candidate.source;
        source.is(Id::StructuralResonance) || bench.is_spoken_for(source)
    };
    let small = (0..members.len()).filter(|at| !is_named(at) && shares[*at] < least);
    let smallest = small.min_by(|a, b| shares[*a].total_cmp(&shares[*b]));
    smallest.map(|at| members.remove(at)).is_some()
}

/// Mean square of the sum of forces, N².
fn explained_n2(forces: &[&[f64]]) -> f64 {
    let rows = forces.first().map_or(0, |force| force.len());
    (0..rows).map(|n| forces.iter().map(|force| force[n]).sum::<f64>().powi(2)).sum::<f64>() / rows.max(1) as f64
}

/// What the law may imitate of a force: the columns of its parameters, except those that are off (a cause, which
/// imitates nothing).
pub(crate) fn imitated(bench: &Bench<'_>, members: &[Member]) -> Vec<Vec<f64>> {
    let is_off = |at: usize| {
        let is_it = |member: &Member| member.candidate.source.is_shift_of(at);
        members.iter().any(is_it)
    };
    bench.tangent.iter().enumerate().filter(|(at, _)| !is_off(*at)).map(|(_, column)| column.clone()).collect()
}

/// What the other forces do not imitate of the first, as a share of the sum of all squares: where two forces oppose one
/// another, their sum has next to nothing of either.
fn share_against(forces: &[&[f64]]) -> f64 {
    let Some((own, others)) = forces.split_first() else { return 0.0 };
    let mut a = Symmetric::zeros(others.len());
    for i in 0..others.len() {
        (0..=i).for_each(|j| a.set(i, j, dot(others[i], others[j])));
    }
    let with: Vec<f64> = others.iter().map(|other| dot(other, own)).collect();
    let imitated = Cholesky::of(&a).forward(&with);
    let all: f64 = forces.iter().map(|force| dot(force, force)).sum();
    if all > 0.0 { (dot(own, own) - dot(&imitated, &imitated)) / all } else { 0.0 }
}

/// Share of what all members explain below which a cause with this share of the evidence is dropped.
fn least_share(of_evidence: f64, is_at_an_end: impl FnOnce() -> bool, is_small: impl FnOnce() -> bool) -> f64 {
    if of_evidence > MUCH_EVIDENCE {
        return 0.0;
    }
    if is_at_an_end() {
        return LEAST_SHARE_AT_ITS_END;
    }
    if is_small() { LEAST_SHARE_OF_SMALL } else { LEAST_SHARE }
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::mechanism::definition;
    use simulation::profile::{Conditions, Order, Staircase};
    use simulation::run::Run;
    use simulation::sensor::Noise;

    use super::*;
    use crate::fit::source::Source;
    use crate::search::workbench::{GUIDE, at_bench, taken};

    #[test]
    fn a_filter_and_a_recording_that_is_early_by_as_much_are_dropped_together_and_a_filter_alone_is_kept() {
        let simulation = Simulation::from_toml(GUIDE).expect("a sound file");
        let at = Conditions { preload_n: Some(3000.0), temperature_degc: Some(40.0), external_load_n: None };
        let staircase = Staircase { length_m: 0.1, order: Order::Both, ..Staircase::default() };
        let course = staircase.course(200.0, &at).expect("a course");
        let force = simulation.force(&course.run, &course.motion).expect("a force");
        // read ahead by so many rows, then filtered with a time constant of so many rows
        let left_with = |ahead: usize, filter: f64| {
            let (mut noise, mut filtered) = (Noise::new(3, 0), force[0]);
            let read = (0..force.len()).map(|n| {
                filtered += (force[(n + ahead).min(force.len() - 1)] - filtered) / (1.0 + filter);
                filtered + 0.2 * noise.gaussian()
            });
            let run = Run { drag_force_n: read.collect(), ..course.run.clone() };
            at_bench(&simulation, &[run], |bench, _, _| {
                let source = |id| Source::Mechanism { definition: definition(id), form: 0, shape: vec![2e-3] };
                let mut members = taken(bench, [Id::TimeMisalignment, Id::ForceLowpass].map(source));
                let floor = Floor { any_n: 0.02, inexact_n: 0.0, rounding_n: 0.0, is_coarse: false };
                drop_what_cancels(bench, floor, &mut members);
                members.len()
            })
        };
        assert_eq!([left_with(1, 1.0), left_with(0, 2.0)], [0, 2]);
    }

    #[test]
    fn what_pulls_against_another_counts_by_itself() {
        let force = |phase: f64| (0..1000).map(|n| (0.1 * f64::from(n) + phase).sin()).collect::<Vec<f64>>();
        let (large, small) = (force(0.0), force(2.0).iter().map(|x| 0.4 * x).collect::<Vec<f64>>());
        // the sum has less than nothing of it, and yet 0.83 of it is not imitated by the other
        assert!(among(&[&small, &large])[0] < LEAST_SHARE);
        let share = share_against(&[&small, &large]);
        assert!((share - 0.16 * 2f64.sin().powi(2) / 1.16).abs() < 1e-3, "{share}");
        assert!(share_against(&[&large.iter().map(|x| -x).collect::<Vec<f64>>(), &large]).abs() < 1e-9);
    }

    #[test]
    fn a_number_at_its_end_asks_for_a_larger_share() {
        let shares = |is_small: bool| [true, false].map(|is_at_an_end| least_share(0.1, || is_at_an_end, || is_small));
        assert_eq!(shares(false), [LEAST_SHARE_AT_ITS_END, LEAST_SHARE]);
        assert_eq!(shares(true), [LEAST_SHARE_AT_ITS_END, LEAST_SHARE_OF_SMALL]);
        // most of the evidence in few rows
        assert_eq!([0.4, 0.6].map(|part| least_share(part, || false, || true)), [LEAST_SHARE_OF_SMALL, 0.0]);
    }
}
