//! Whether a cause may be named beside those already there: it must be real, large enough, and not a remainder of
//! another cause's form.

use simulation::mechanism::{Id, Kind};

use crate::fit::bench::Bench;
use crate::fit::member::{Candidate, Gain, Member};
use crate::fit::pool::Pool;
use crate::fit::rest::{beyond, power};
use crate::fit::source::{LATE, Source};
use crate::fit::spectrum::{is_wave, wavelength_m};
use crate::noise::locks::Locks;
use crate::numbers::statistics::rms;
use crate::search::leavings;
use crate::search::opening::{Asked, is_open};

/// Share of all evidence below which a further cause is accepted only if its amplitude is constant over the recording:
/// a form is an idealisation, and what it leaves of its own cause's force, up to a seventh of it, is a fiftieth in
/// square.
pub(crate) const FURTHER: f64 = 0.02;

/// Share of all evidence below which a constant amplitude is not enough, and a cause must also show beside what the
/// [forms](crate::search::leavings) of others may leave: two standard deviations of the error of a form, squared. A
/// shift this small, which those forms imitate, is none.
const FURTHER_IF_EVEN: f64 = 4.0 * leavings::WRONG * leavings::WRONG;

/// The same for a wave along the rail, which no other form leaves.
const FURTHER_WAVE: f64 = 0.005;

/// Share of a drift's force below which a constant beside it is the misfit of the drift's curve.
const MISSED_BY_A_CURVE: f64 = 0.2;

/// Share of the evidence for a bent rail below which a joint counts as part of the bend, or the bend as part of the
/// joint: a rail has waves of every length, a form one or three of them; no wave or table is as sharp as a rail may be,
/// and a joint is the sharpest profile there is. A joint with three eighths of the bend's force has more.
const ONE_PROFILE: f64 = 0.14;

/// Share of the evidence for a late channel below which a filter beside a delay, or a delay beside a filter, is how the
/// one that is there turns: a filter of two unlike stages is a filter and a delay, and a delay of rows that were
/// interpolated is rounded.
const ONE_LATENESS: f64 = 0.05;

/// Distance from a joint within which local dirt counts as part of the rail's profile there, m: about the length of a
/// block.
const AT_A_JOINT_M: f64 = 0.05;

/// Most mass of a ringing structure, as a multiple of all mass that the drive accelerates; above 1 because forms are
/// wrong by some of it.
const MORE_MASS: f64 = 1.3;

/// Most of the simulation's mass by which less may move: a force in kN has an inertia that is all of it off.
const LESS_MASS: f64 = 0.9;

/// Causes that act where the force turns, mostly in rows that come too soon after it to be compared: alone, their size
/// is that in all rows.
const AT_TURNS: [Id; 3] = [Id::Presliding, Id::TimeMisalignment, Id::ForceLowpass];

/// Causes that pull to one side whichever way the carriage moves, as no friction does.
const TO_ONE_SIDE: [Id; 3] = [Id::ForceOffset, Id::GravityTilt, Id::ForceDrift];

/// A profile coarser than this many wavelengths cannot imitate the wave.
const COARSE: f64 = 2.0;

/// RMS force below which a cause is not worth reporting, N.
#[derive(Clone, Copy)]
pub(crate) struct Floor {
    /// For any cause.
    pub(crate) any_n: f64,
    /// For all but waves and what pulls to one side: what calibration leaves where its derivatives are inexact varies
    /// with the law, against the motion and not periodically with place.
    pub(crate) inexact_n: f64,
    /// For all but the quantisation itself: what is smaller cannot be told from it.
    pub(crate) rounding_n: f64,
    /// Whether quantisation steps are a considerable part of the noise; otherwise they are no cause.
    pub(crate) is_coarse: bool,
}

impl Floor {
    /// For this cause.
    pub(crate) fn of(&self, source: &Source) -> f64 {
        let rounding_n = match (source.is(Id::ForceQuantisation), self.is_coarse) {
            (true, true) => 0.0,
            (true, false) => f64::INFINITY,
            (false, _) => self.rounding_n,
        };
        let is_like_law = !is_periodic(source) && !source.is_any(&TO_ONE_SIDE);
        let inexact_n = if is_like_law { self.inexact_n } else { 0.0 };
        self.any_n.max(rounding_n).max(inexact_n)
    }
}

/// Whether a candidate may be named beside the members: real and large enough.
///
/// The evidence for a shift is how far its tolerance would have to be stretched. The locks ask the data alone, which
/// cannot tell a free parameter from one with a tolerance.
pub(crate) fn holds(
    bench: &Bench<'_>,
    pool: &Pool,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
    floor: Floor,
) -> bool {
    if bench.is_spoken_for(&candidate.source) {
        // where starts and stops speak for it, all its force may lie in rows that are not compared
        return true;
    }
    let tiny = if is_periodic(&candidate.source) { FURTHER_WAVE } else { FURTHER_IF_EVEN };
    let is_tiny = gain.nats < tiny * (imitable(bench, candidate, members) + gain.nats)
        && !is_more_than_waves_leave(bench, candidate, gain, members);
    if matches!(candidate.source, Source::Shift { .. }) {
        return !is_tiny && gain.score > (pool.kinds as f64).ln();
    }
    (is_relevant(bench, candidate, gain, floor) || members.is_empty() && acts_at_turns(bench, candidate, gain, floor))
        && !is_of_one_profile(bench, candidate, gain, members)
        && !is_of_one_lateness(bench, candidate, gain, members)
        && !is_missed_by_a_curve(bench, candidate, gain, members)
        && !rings_with_more_than_moves(bench, candidate, gain, members)
        && !takes_all_that_moves(bench, candidate, gain)
        && shows(bench, pool, candidate, gain, members, is_tiny)
}

/// Whether both locks open for a candidate, either as it is or beside what the forms of others may leave (stricter,
/// apart from the scatter that those columns take up); a tiny candidate must pass both ways.
fn shows(
    bench: &Bench<'_>,
    pool: &Pool,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
    is_tiny: bool,
) -> bool {
    let opens = is_open(
        Asked::of(&candidate.source),
        &bench.locks(candidate, gain, members),
        pool.kinds,
        pool.points_of(&candidate.source),
    );
    if opens != is_tiny {
        return opens;
    }
    !members.is_empty() && shows_beside_leavings(bench, pool, candidate, gain, members)
}

/// Whether only waves could leave what a candidate follows, and its force beyond what the law imitates is larger than
/// the error of their forms: in noise with memory, anything slower than a wave gets little evidence for its force.
fn is_more_than_waves_leave(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    let leaving: Vec<&Member> = members.iter().filter(|member| may_leave(member, candidate)).collect();
    if leaving.is_empty() || !leaving.iter().all(|member| is_periodic(&member.candidate.source)) {
        return false;
    }
    let fit = bench.fit_members(members);
    let size_n = |member: &&Member| size_n(bench, &member.candidate.source, &member.amplitudes(&fit));
    let waves_n = leaving.iter().map(|member| size_n(member).powi(2)).sum::<f64>().sqrt();
    let own = bench.force(&candidate.source, &gain.amplitudes);
    !own.is_empty() && rms(&beyond(&bench.rows, &bench.tangent, &own)) > 2.0 * leavings::WRONG * waves_n
}

/// Whether a candidate is a joint that only sharpens the profile of a bent rail, a bend that only rounds a joint, or
/// dirt at a joint.
fn is_of_one_profile(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    if members.iter().any(|member| is_at_a_joint(&candidate.source, &member.candidate.source)) {
        return true;
    }
    is_little_beside_its_other(bench, candidate, gain, members, ([Id::RailJoint, Id::RailStraightness], ONE_PROFILE))
}

/// Whether a candidate is one of two causes that act alike, the other is a member, and the candidate explains less than
/// this share of what that one does.
fn is_little_beside_its_other(
    bench: &Bench<'_>,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
    (two, share): ([Id; 2], f64),
) -> bool {
    let Some(own) = two.iter().position(|id| candidate.source.is(*id)) else { return false };
    let Some(at) = members.iter().position(|member| member.candidate.source.is(two[1 - own])) else { return false };
    gain.nats < share * bench.beside(members, at).gain.nats
}

/// Whether a candidate is a filter that only rounds the delay that is there, or a delay that only sets back the filter.
fn is_of_one_lateness(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    is_little_beside_its_other(bench, candidate, gain, members, (LATE, ONE_LATENESS))
}

/// Whether a cause is dirt at the place of a joint.
fn is_at_a_joint(dirt: &Source, joint: &Source) -> bool {
    let places_m = place_m(dirt, Id::Contamination).zip(place_m(joint, Id::RailJoint));
    places_m.is_some_and(|(dirt_m, joint_m)| (dirt_m - joint_m).abs() < AT_A_JOINT_M)
}

/// Whether a candidate is a constant that is small beside a drift: a curve of a few parameters starts less steeply than
/// a zero that settles.
fn is_missed_by_a_curve(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    if !candidate.source.is_any(&[Id::ForceOffset, Id::GravityTilt]) {
        return false;
    }
    let Some(drift) = members.iter().find(|member| member.candidate.source.is(Id::ForceDrift)) else { return false };
    let fit = bench.fit_members(members);
    size_n(bench, &candidate.source, &gain.amplitudes)
        < MISSED_BY_A_CURVE * size_n(bench, &drift.candidate.source, &drift.amplitudes(&fit))
}

/// Whether a candidate is a structure that rings with more mass than the drive accelerates: such a fit corrects, beside
/// an inertia, the derived acceleration at the corners of ramps.
fn rings_with_more_than_moves(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, members: &[Member]) -> bool {
    let Some(ringing_kg) = mass_kg(&candidate.source, Id::StructuralResonance, &gain.amplitudes) else { return false };
    let fit = bench.fit_members(members);
    let mass_of = |member: &Member| mass_kg(&member.candidate.source, Id::Inertia, &member.amplitudes(&fit));
    let moved_kg = members.iter().find_map(mass_of);
    let known_kg = bench.contexts.first().map_or(0.0, |context| context.moved_mass_kg);
    moved_kg.is_some_and(|moved_kg| ringing_kg > MORE_MASS * (moved_kg + known_kg))
}

/// Whether a candidate is a lack of mass that leaves next to nothing of what the simulation accelerates.
fn takes_all_that_moves(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain) -> bool {
    let known_kg = bench.contexts.first().map_or(0.0, |context| context.moved_mass_kg);
    mass_kg(&candidate.source, Id::Inertia, &gain.amplitudes).is_some_and(|mass_kg| mass_kg < -LESS_MASS * known_kg)
}

/// Mass among the amplitudes of a cause, kg; `None` for another cause.
fn mass_kg(source: &Source, id: Id, amplitudes: &[f64]) -> Option<f64> {
    let Source::Mechanism { definition, form, .. } = source else { return None };
    let masses = definition.forms[*form].amplitudes.iter().zip(amplitudes).filter(|(what, _)| what.unit == "kg");
    (definition.id == id).then(|| masses.map(|(_, kg)| kg).sum())
}

/// Whether a cause is real even beside what the forms of others may leave.
pub(crate) fn shows_beside_leavings(
    bench: &Bench<'_>,
    pool: &Pool,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
) -> bool {
    locks_beside_leavings(bench, candidate, gain, members).is_some_and(|locks| {
        is_open(Asked::of(&candidate.source), &locks, pool.kinds, pool.points_of(&candidate.source))
    })
}

/// The locks of a cause beside what the forms of others may leave. `None` for a cause tied to places: the few
/// polynomials do not cover it.
pub(crate) fn locks_beside_leavings(
    bench: &Bench<'_>,
    candidate: &Candidate,
    gain: &Gain,
    members: &[Member],
) -> Option<Locks> {
    if candidate.source.is_phase_bound() {
        return None;
    }
    let larger = members.iter().filter(|member| may_leave(member, candidate));
    let leavings = leavings::columns(bench, &bench.fit_members(members), larger);
    Some(bench.locks_beside(candidate, gain, members, &leavings))
}

/// Whether a cause adds no more to a fit than the forms of others may leave.
pub(crate) fn is_small(bench: &Bench<'_>, own: &Candidate, gain: &Gain, others: &[Member]) -> bool {
    gain.nats < FURTHER * (imitable(bench, own, others) + gain.nats)
}

/// Evidence of the members whose remainder a candidate could follow, nats: what a wave leaves is tied to the rail, so
/// nothing else follows it.
fn imitable(bench: &Bench<'_>, candidate: &Candidate, members: &[Member]) -> f64 {
    let others: Vec<Member> = members.iter().filter(|member| !may_leave(member, candidate)).cloned().collect();
    0.5 * (bench.fit_members(&others).rss - bench.fit_members(members).rss)
}

/// Whether a candidate could follow what the form of a member leaves. A wave leaves harmonics and sidebands, which only
/// a cause tied to places follows, and none much coarser than the wavelength.
pub(crate) fn may_leave(member: &Member, candidate: &Candidate) -> bool {
    let is_fine = || match (wavelength_m(&member.candidate.source), detail_m(&candidate.source)) {
        (Some(wave_m), Some(detail_m)) => detail_m < COARSE * wave_m,
        _ => true,
    };
    !is_periodic(&member.candidate.source) || (candidate.source.is_phase_bound() && is_fine())
}

/// Place of a cause of the given kind, m; `None` for another kind and for a cause without one place.
fn place_m(source: &Source, id: Id) -> Option<f64> {
    source.number("place_m").filter(|_| source.is(id))
}

/// Finest detail along the rail that a cause can follow, m: the shortest order of a wave, the spacing of a table's
/// entries, infinite for a polynomial over the stroke; `None` where unknown.
fn detail_m(source: &Source) -> Option<f64> {
    let Source::Mechanism { definition, shape, .. } = source else { return None };
    let amplitudes = source.amplitudes() as f64;
    match (definition.id, shape.as_slice()) {
        (Id::RailStraightness, [wave_m]) => Some(wave_m / (0.5 * amplitudes)),
        (Id::RailStraightness | Id::CableChain, [from_m, to_m]) => Some((to_m - from_m) / (amplitudes - 1.0)),
        (Id::CableChain, _) => Some(f64::INFINITY),
        _ => None,
    }
}

fn is_periodic(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, form, .. }
        if definition.kind == Kind::Physics && is_wave(&definition.forms[*form]))
}

/// Whether the RMS force of a cause exceeds its floor.
pub(crate) fn is_relevant(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, floor: Floor) -> bool {
    size_n(bench, &candidate.source, &gain.amplitudes) > floor.of(&candidate.source)
}

/// Whether a cause acts where the force turns, and its RMS force in all rows exceeds its floor.
fn acts_at_turns(bench: &Bench<'_>, candidate: &Candidate, gain: &Gain, floor: Floor) -> bool {
    let source = &candidate.source;
    is_at_turns(source) && rms_n(&bench.force(source, &gain.amplitudes)) > floor.of(source)
}

fn is_at_turns(source: &Source) -> bool {
    source.is_any(&AT_TURNS)
}

/// RMS of the force of a cause that stands alone, N: where it acts at turns, in all rows.
pub(crate) fn size_alone_n(bench: &Bench<'_>, source: &Source, amplitudes: &[f64]) -> f64 {
    let compared_n = size_n(bench, source, amplitudes);
    if is_at_turns(source) { compared_n.max(rms_n(&bench.force(source, amplitudes))) } else { compared_n }
}

/// RMS over all rows that have a force, N.
fn rms_n(force: &[f64]) -> f64 {
    let known: Vec<f64> = force.iter().copied().filter(|x| x.is_finite()).collect();
    if known.is_empty() { 0.0 } else { rms(&known) }
}

/// RMS of a cause's force, N.
pub(crate) fn size_n(bench: &Bench<'_>, source: &Source, amplitudes: &[f64]) -> f64 {
    let force = bench.force(source, amplitudes);
    if force.is_empty() { 0.0 } else { power(&bench.rows, &force).sqrt() }
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::{Form, ShapeParameter, definition};

    use super::*;

    #[test]
    fn what_is_coarser_than_a_wave_follows_nothing_of_it() {
        let of = |id: Id, form: &str, shape: &[f64]| Source::Mechanism {
            definition: definition(id),
            form: definition(id).forms.iter().position(|own| own.name == form).expect("a form"),
            shape: shape.to_vec(),
        };
        let ripple = wavelength_m(&of(Id::DriveRipple, "two-orders", &[0.005])).expect("a wave");
        let profile = detail_m(&of(Id::RailStraightness, "profile", &[0.1, 1.04])).expect("a profile");
        assert!((profile - 0.02).abs() < 1e-12 && profile > COARSE * ripple);
        let orders = detail_m(&of(Id::RailStraightness, "three-orders", &[0.3])).expect("a wave of three orders");
        assert!((orders - 0.1).abs() < 1e-12);
        assert_eq!(detail_m(&of(Id::RailJoint, "minimal", &[0.3])), None);
        for polynomial in [of(Id::CableChain, "minimal", &[]), of(Id::CableChain, "rolling", &[0.03])] {
            assert!(detail_m(&polynomial).is_some_and(|detail_m| detail_m > COARSE * 0.1), "{polynomial:?}");
        }
    }

    #[test]
    fn dirt_at_a_joint_is_part_of_it_and_dirt_elsewhere_is_not() {
        let at = |id: Id, place_m: f64| {
            let definition = definition(id);
            let has_place = |form: &Form| form.shape.iter().any(|what| what.name == "place_m");
            let form = definition.forms.iter().position(has_place).expect("a form with a place");
            let number = |what: &ShapeParameter| if what.name == "place_m" { place_m } else { what.from };
            Source::Mechanism { definition, form, shape: definition.forms[form].shape.iter().map(number).collect() }
        };
        let joint = at(Id::RailJoint, 0.56);
        assert!(is_at_a_joint(&at(Id::Contamination, 0.58), &joint));
        assert!(!is_at_a_joint(&at(Id::Contamination, 0.70), &joint));
        assert!(!is_at_a_joint(&joint, &joint));
    }

    #[test]
    fn a_weight_is_no_error_of_a_law_that_is_off_and_a_seal_may_be_one() {
        let floor = Floor { any_n: 0.01, inexact_n: 0.3, rounding_n: 0.0, is_coarse: false };
        let least_n = |id: Id| floor.of(&Source::Mechanism { definition: definition(id), form: 0, shape: Vec::new() });
        assert_eq!([Id::GravityTilt, Id::ForceOffset, Id::SealDrag].map(least_n), [0.01, 0.01, 0.3]);
    }

    #[test]
    fn steps_that_noise_dithers_are_no_cause() {
        let quantisation =
            Source::Mechanism { definition: definition(Id::ForceQuantisation), form: 0, shape: vec![0.1] };
        let least_n = |is_coarse| Floor { any_n: 0.01, inexact_n: 0.0, rounding_n: 0.1, is_coarse }.of(&quantisation);
        assert_eq!([true, false].map(least_n), [0.01, f64::INFINITY]);
    }
}
