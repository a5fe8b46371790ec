//! Adequacy: whether a cause that explains much is the one that really acts.
//!
//! The force of a true cause has one amplitude wherever it acts. The best of several wrong names follows the mismatch
//! in some blocks and misses it in others: given an amplitude of its own in every block, it would explain far more than
//! with a single one.
//!
//! ```text
//! r    residual of law and all causes, whitened     g    the cause's force, less what law and other causes imitate
//! unevenness = (Σ_b (r·g)_b²/(g·g)_b - blocks) / (g·g)
//! ```
//!
//! The sum is what one amplitude per block would explain beyond the single amplitude, which explains `g·g`; noise alone
//! would explain 1 per block.
//!
//! Where a cause's form states how its force grows with the load, a force that grows otherwise is another cause: see
//! [`load_law`](crate::search::load_law).

use simulation::curve::Axis;
use simulation::mechanism::{Id, Kind};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Candidate, Gain, Member};
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::source::{Source, UNEVEN_BY_NATURE};
use crate::fit::spectrum::is_wave;
use crate::noise::rows::Gram;
use crate::numbers::linear::{products, remove};
use crate::numbers::statistics::scatter;
use crate::search::equivalents::{NEAR, TIE};
use crate::search::holds::size_n;
use crate::search::load_law;

/// Why a cause that explains much is not named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Doubt {
    /// Its amplitude differs between parts of the recording.
    Uneven,
    /// It grows with the load otherwise than its form states.
    WithLoad,
    /// The mismatch is best approached with one of its shape parameters at the end of that parameter's range.
    AtTheEnd(&'static str),
    /// It acts more after a turn than along the stroke, although it would have to act along the stroke.
    HardlyAlongTheStroke,
    /// A slow curve or doubted cause stands beside this slow one: both may be one effect of unknown form.
    BesideNameless,
    /// It is the only name left, and something without a name is larger: it may be a part of that.
    LessThanNameless,
    /// Beside the other causes its force is larger than on any machine.
    BeyondAnyMachine(&'static str),
    /// So many causes with shape parameters do equally well that none of them can be named.
    OneOfMany(usize),
}

/// Number of tied causes with shape parameters from which on none of them is named. Read off opened trials (20 to 23):
/// sets with the right name have four at most; the two sets with more are of effects that the library lacks.
const MANY: usize = 5;

/// Doubt about a cause that this recording cannot tell from the others of its set.
pub(crate) fn doubt_of_many<'s>(set: impl Iterator<Item = &'s Source> + Clone) -> Option<Doubt> {
    let with_numbers = set.clone().filter(|source| source.shapes() > 0).count();
    (with_numbers >= MANY).then(|| Doubt::OneOfMany(set.count()))
}

/// Unevenness above which a name is doubted. Read off an opened trial (docs/trials/1): most right names stay below it,
/// about half of the names given to effects that the library lacks lie above.
const UNEVEN: f64 = 0.2;

/// Unevenness limit for a name with a shape parameter at an end of its range, and for one beside a doubted name.
const UNEVEN_BESIDE: f64 = 0.1;

/// Unevenness limit for a name once everything nameless beside it is taken away: amplitudes per block then explain as
/// much again as the name with a single one.
const UNEVEN_BESIDE_NAMELESS: f64 = 1.0;

/// Unevenness limit for a name that stands alone (no other name's form can leave the uneven part), and the least that
/// amplitudes per block must then explain, nats. Read off an opened trial (docs/trials/14): with that much evidence,
/// right names standing alone stay below 0.06.
const UNEVEN_ALONE: f64 = 0.08;
const LEAST_ALONE: f64 = 200.0;

/// Least that amplitudes per block must explain, nats: less than this is coloured noise that was not quite whitened ..
const LEAST: f64 = 30.0;

/// .. and least as a share of what all causes explain: less than this is what the form of a larger cause leaves.
pub(crate) const LEAST_SHARE: f64 = 0.04;

/// Share of a cause's total squared force below which a block tells nothing of its amplitude.
const SILENT: f64 = 1e-3;

/// Distance from an end of a shape parameter's range, as a share of the range, within which it counts as at the end.
const END: f64 = 0.01;

/// Distance from the end, as a share of the range, that serves for comparison as clearly inside.
const INSIDE: f64 = 0.1;

/// Share of what all causes explain that an unnamed curve may explain beside a cause over travel or temperature, and
/// the least it must explain to matter, nats: wear, depletion and warming, rightly modelled, leave nothing to a curve.
/// Read off opened trials (docs/trials/19, 20): 0.02 at most beside right names, 0.07 and more beside wrong ones.
const LEFT_TO_CURVES: f64 = 0.04;
const LEAST_LEFT_TO_CURVES: f64 = 20.0;

/// Largest amplitude of a physical cause, as a multiple of the most that a machine has; some excess is allowed because
/// causes may pull against one another. Read off opened trials (20 to 23): one right name has 1.47, the others 1.1 at
/// most; four false ones have 1.24 to 5.5.
const BEYOND: f64 = 1.5;

/// Axes of causes that leave nothing to an unnamed curve.
const LEAVES_NO_CURVE: [Axis; 3] = [Axis::Travel, Axis::Temperature, Axis::TemperatureDifference];

/// Axes along which things change over a whole session.
const SLOW: [&str; 3] = ["time", "travel", "temperature-difference"];

/// The doubt about each member, if there is one.
pub(crate) fn doubts(bench: &Bench<'_>, fit: &Fit, members: &[Member]) -> Vec<Option<Doubt>> {
    let rest = bench.rest(fit);
    let evidence = 0.5 * (bench.fit(&bench.law()).rss - fit.rss);
    let least = LEAST.max(LEAST_SHARE * evidence);
    let with = |limits| -> Vec<Option<Doubt>> {
        (0..members.len()).map(|at| doubt(bench, fit, members, at, &rest, limits)).collect()
    };
    let mut found = with((UNEVEN, least));
    if members.iter().filter(|member| !member.candidate.source.is_story()).count() == 1 {
        let alone = with((UNEVEN_ALONE, least.max(LEAST_ALONE)));
        found.iter_mut().zip(alone).for_each(|(found, alone)| *found = found.or(alone));
    }
    if found.iter().any(Option::is_some) {
        // beside a doubted name the others may be parts of the same effect
        let beside = with((UNEVEN_BESIDE, least));
        found.iter_mut().zip(beside).for_each(|(found, beside)| *found = found.or(beside));
    }
    take_back_what_the_nameless_follows(bench, members, &mut found);
    let is_nameless = |at: &usize| found[*at].is_some() || members[*at].candidate.source.is_story();
    let (nameless, named): (Vec<usize>, Vec<usize>) = (0..members.len()).partition(is_nameless);
    // where several names stand, what is unnamed is their remainder, however large it is
    if let [only] = named[..] {
        let size_n = |at: usize| size_n(bench, &members[at].candidate.source, &members[at].amplitudes(fit));
        let is_less = || nameless.iter().any(|at| size_n(*at) > size_n(only));
        if may_be_a_part(&members[only].candidate.source) && is_less() {
            found[only] = Some(Doubt::LessThanNameless);
        }
    }
    let is_slow: Vec<bool> = members.iter().map(|member| is_slow(&member.candidate.source)).collect();
    let is_nameless = |at: usize| found[at].is_some() || members[at].candidate.source.is_story();
    if (0..members.len()).any(|at| is_slow[at] && is_nameless(at)) {
        for at in (0..members.len()).filter(|at| is_slow[*at] && !members[*at].candidate.source.is_story()) {
            found[at] = found[at].or(Some(Doubt::BesideNameless));
        }
    }
    found
}

/// Doubts names whose unevenness is covered by something without a name beside them: with all that is nameless taken
/// away, amplitudes per block explain more than the name does with one.
fn take_back_what_the_nameless_follows(bench: &Bench<'_>, members: &[Member], found: &mut [Option<Doubt>]) {
    let is_named = |at: &usize| found[*at].is_none() && !members[*at].candidate.source.is_story();
    let named: Vec<usize> = (0..members.len()).filter(is_named).collect();
    if named.len() == members.len() {
        return;
    }
    let alone: Vec<Member> = named.iter().map(|at| members[*at].clone()).collect();
    let fit = bench.fit_members(&alone);
    let rest = bench.rest(&fit);
    for (at, member) in named.into_iter().zip(&alone) {
        let source = &member.candidate.source;
        if source.is_shift() || source.is_any(&UNEVEN_BY_NATURE) {
            continue;
        }
        let (uneven, nats) = unevenness(bench, &own_force(bench, &fit, member), &rest);
        if uneven > UNEVEN_BESIDE_NAMELESS && nats > LEAST {
            found[at] = Some(Doubt::Uneven);
        }
    }
}

/// Doubts causes that should leave nothing to a curve where an unnamed curve explains more beside all causes.
pub(crate) fn doubt_what_leaves_a_curve(
    bench: &Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &[Member],
    found: &mut [Option<Doubt>],
) {
    if !members.iter().any(|member| leaves_no_curve(&member.candidate.source)) {
        return;
    }
    let fit = bench.fit_members(members);
    let evidence = 0.5 * (bench.fit(&bench.law()).rss - fit.rss);
    // noise alone gives half a nat per column
    let of_curves = ranked(bench, &mut pool.stories, &fit, tolerances)
        .into_iter()
        .map(|(index, gain)| gain.nats - pool.stories[index].columns.len() as f64);
    if of_curves.fold(0.0, f64::max) > LEAST_LEFT_TO_CURVES.max(LEFT_TO_CURVES * evidence) {
        for (member, doubt) in members.iter().zip(found) {
            if leaves_no_curve(&member.candidate.source) {
                *doubt = doubt.or(Some(Doubt::BesideNameless));
            }
        }
    }
}

/// Whether a cause acts along the travel or a temperature.
fn leaves_no_curve(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, .. }
        if LEAVES_NO_CURVE.iter().any(|axis| definition.axis == axis.name()))
}

/// Whether a cause may be a part of a larger unnamed one. Exempt are causes tied to places (the place itself identifies
/// them), waves (no part of anything smooth) and sensor faults (they have forms of their own).
fn may_be_a_part(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, form, .. }
        if definition.kind == Kind::Physics && !is_wave(&definition.forms[*form]) && !source.is_phase_bound())
}

/// Whether a cause changes over a whole session, with time, travel or temperature difference, as wear and warming do.
fn is_slow(source: &Source) -> bool {
    match source {
        Source::Mechanism { definition, .. } => SLOW.contains(&definition.axis),
        Source::Story { curve } => SLOW.contains(&curve.axis.name()),
        Source::Shift { .. } => false,
    }
}

/// Name of the amplitude by which a physical cause is larger than on any machine.
fn beyond_any_machine(source: &Source, amplitudes: &[f64]) -> Option<&'static str> {
    let Source::Mechanism { definition, form, .. } = source else { return None };
    if definition.kind != Kind::Physics {
        return None;
    }
    let mut of_form = definition.forms[*form].amplitudes.iter().zip(amplitudes);
    of_form.find(|(amplitude, x)| x.abs() > BEYOND * amplitude.most).map(|(amplitude, _)| amplitude.name)
}

fn doubt(
    bench: &Bench<'_>,
    fit: &Fit,
    members: &[Member],
    at: usize,
    rest: &[f32],
    (most, least): (f64, f64),
) -> Option<Doubt> {
    let member = &members[at];
    if member.candidate.source.is_story() {
        return None;
    }
    let ends = numbers_at_their_end(&member.candidate.source);
    if let Some(name) = ends.iter().find(|name| is_telling(&member.candidate.source, name)) {
        return Some(Doubt::AtTheEnd(name));
    }
    if let Some(name) = beyond_any_machine(&member.candidate.source, &member.amplitudes(fit)) {
        return Some(Doubt::BeyondAnyMachine(name));
    }
    if hardly_pulls(bench, fit, member) {
        return Some(Doubt::HardlyAlongTheStroke);
    }
    if member.candidate.source.is_any(&UNEVEN_BY_NATURE) {
        return None;
    }
    let force = own_force(bench, fit, member);
    // where the law's other parameters imitate a shift, the data alone cannot tell its size
    let is_imitated = member.candidate.source.is_shift() && products(&[&force], &[&force])[0] < 2.0 * LEAST;
    if is_imitated {
        return None;
    }
    if load_law::is_another(bench, fit, members, at, rest) {
        return Some(Doubt::WithLoad);
    }
    let (uneven, nats) = unevenness(bench, &force, rest);
    if nats < least {
        return None;
    }
    match ends.first() {
        Some(name) if uneven > UNEVEN_BESIDE && uneven <= most => Some(Doubt::AtTheEnd(name)),
        _ => (uneven > most).then_some(Doubt::Uneven),
    }
}

/// Whether a cable chain's bending force (after a turn) exceeds its pull along the stroke: it then looks like many
/// other effects that follow a turn.
fn hardly_pulls(bench: &Bench<'_>, fit: &Fit, member: &Member) -> bool {
    let source = &member.candidate.source;
    let Source::Mechanism { definition, form, .. } = source else { return false };
    if definition.id != Id::CableChain {
        return false;
    }
    let force_n = |name: &str| {
        let own = definition.forms[*form].amplitudes.iter().zip(&member.base);
        let amplitude = |what: &str, base| if what.starts_with(name) { fit.value_of(base) } else { 0.0 };
        let amplitudes: Vec<f64> = own.map(|(what, base)| amplitude(what.name, *base)).collect();
        scatter(&bench.rows.plain(&bench.force(source, &amplitudes)))
    };
    force_n("bending") > force_n("force_per_m")
}

/// Whether a member's amplitude is the same throughout, as a small cause beside a large one must show.
pub(crate) fn is_even(bench: &Bench<'_>, members: &[Member], at: usize) -> bool {
    let fit = bench.fit_members(members);
    unevenness(bench, &own_force(bench, &fit, &members[at]), &bench.rest(&fit)).0 < UNEVEN_BESIDE
}

/// A member's whitened force, less what law and other causes imitate.
fn own_force(bench: &Bench<'_>, fit: &Fit, member: &Member) -> Vec<f32> {
    let mut force = vec![0.0f32; bench.base[0].len()];
    for column in member.base.iter().filter(|column| fit.active.contains(column)) {
        let amplitude = fit.value_of(*column) as f32;
        force.iter_mut().zip(&bench.base[*column]).for_each(|(force, x)| *force += amplitude * x);
    }
    // a shift is one of the law's own columns, set free: it must not be removed from itself
    let own = match &member.candidate.source {
        Source::Shift { parameter } => Some(parameter + 1),
        _ => None,
    };
    let others: Vec<&[f32]> = fit
        .active
        .iter()
        .filter(|column| !member.base.contains(column) && Some(**column) != own)
        .map(|column| bench.base[*column].as_slice())
        .collect();
    remove(&mut force, &others);
    force
}

/// Unevenness of a force, and what amplitudes per block would explain beyond a single one, nats.
fn unevenness(bench: &Bench<'_>, force: &[f32], rest: &[f32]) -> (f64, f64) {
    let gram = Gram::of(&[rest, force], &bench.rows.blocks);
    let all = gram.total.get(1, 1);
    let (mut explained, mut blocks) = (0.0, 0.0);
    for block in gram.blocks.iter().filter(|block| block.get(1, 1) > SILENT * all) {
        explained += block.get(0, 1) * block.get(0, 1) / block.get(1, 1);
        blocks += 1.0;
    }
    let more = explained - blocks;
    if all > 0.0 { (more / all, 0.5 * more) } else { (0.0, 0.0) }
}

/// Names of the shape parameters of a cause that lie at an end of their range.
fn numbers_at_their_end(source: &Source) -> Vec<&'static str> {
    let Source::Mechanism { definition, form, shape } = source else { return Vec::new() };
    let parameters = definition.forms[*form].shape.iter().zip(shape);
    parameters
        .filter(|(parameter, value)| !is_inside(parameter.share_of(**value)))
        .map(|(parameter, _)| parameter.name)
        .collect()
}

/// Whether a shape parameter of a cause lies at an end of its range.
pub(crate) fn is_at_an_end(source: &Source) -> bool {
    !numbers_at_their_end(source).is_empty()
}

/// Whether a shape parameter of a cause is held at an end of its range: either that end alone is telling, or the cause
/// explains less a little farther in, by more than the tie between two indistinguishable causes. `fit`: law and others;
/// `gain`: what the cause adds.
pub(crate) fn is_held_at_an_end(bench: &Bench<'_>, fit: &Fit, own: &Candidate, gain: &Gain) -> bool {
    let Source::Mechanism { definition, form, shape } = &own.source else { return false };
    definition.forms[*form].shape.iter().enumerate().any(|(k, parameter)| {
        let share = parameter.share_of(shape[k]);
        if is_inside(share) || is_telling(&own.source, parameter.name) {
            return !is_inside(share);
        }
        let mut shape = shape.clone();
        shape[k] = parameter.at(share.clamp(INSIDE, 1.0 - INSIDE));
        let inside = bench.candidate(Source::Mechanism { definition, form: *form, shape });
        inside.is_none_or(|mut inside| {
            bench.prepare(&mut inside, &fit.active);
            gain.nats - bench.gain(&inside, fit).nats > TIE.max(NEAR * gain.nats)
        })
    })
}

fn is_inside(share: f64) -> bool {
    (END..=1.0 - END).contains(&share)
}

/// Whether a shape parameter that the minimal form lacks lies at an end of its range.
pub(crate) fn is_long_and_at_its_end(source: &Source) -> bool {
    let Source::Mechanism { definition, .. } = source else { return false };
    let minimal = definition.forms.first().map_or(&[][..], |form| form.shape);
    numbers_at_their_end(source).iter().any(|name| minimal.iter().all(|parameter| parameter.name != *name))
}

/// Whether a shape parameter at this end is enough to doubt the cause: friction of seals or churned grease that grows
/// faster with speed than any seal or grease does, a structure too damped to ring, a chain that needs more than its own
/// radius to bend, rails that sag beyond their last bolt, a film that starves within a stroke or recovers at once or
/// never, a shear stress that stops growing before the carriage moves, contacts that roll before they have yielded at
/// all.
fn is_telling(source: &Source, name: &str) -> bool {
    let Source::Mechanism { definition, form, shape } = source else { return false };
    let parameters = definition.forms[*form].shape.iter().zip(shape);
    let is_upper = parameters.filter(|(what, _)| what.name == name).any(|(what, value)| *value > 0.5 * what.to);
    match (definition.id, name) {
        (Id::ViscousDrag, "exponent") | (Id::StructuralResonance, "damping") => is_upper,
        (Id::CableChain, "length_m") | (Id::RailJoint, "sag_m") => is_upper,
        (Id::Starvation | Id::Presliding, "length_m") | (Id::TractionSaturation, "speed_m_s") => !is_upper,
        (Id::Starvation, "recovery_s") => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::curve::{Carrier, Curve};
    use simulation::mechanism::definition;
    use simulation::profile::{Conditions, Order, Staircase};
    use simulation::run::Run;
    use simulation::sensor::Noise;

    use super::*;
    use crate::search::workbench::{GUIDE, at_bench, taken};

    fn at(id: Id, name: &str, at: f64) -> Source {
        let definition = definition(id);
        let form = definition.forms.iter().position(|form| form.name == name).expect("a form");
        let shape = definition.forms[form].shape.iter().map(|parameter| parameter.at(at)).collect();
        Source::Mechanism { definition, form, shape }
    }

    #[test]
    fn a_stress_that_never_grew_and_contacts_that_never_gave_way_are_doubted() {
        for (id, number) in [(Id::TractionSaturation, "speed_m_s"), (Id::Presliding, "length_m")] {
            assert!(is_telling(&at(id, "minimal", 0.0), number), "{id:?}");
            assert!(!is_telling(&at(id, "minimal", 1.0), number), "{id:?}");
        }
    }

    #[test]
    fn rails_that_sag_beyond_their_last_bolt_are_doubted() {
        assert!(is_telling(&at(Id::RailJoint, "sagging", 1.0), "sag_m"));
        assert!(!is_telling(&at(Id::RailJoint, "sagging", 0.0), "sag_m"));
    }

    #[test]
    fn what_is_tied_to_a_place_and_a_sensor_fault_are_no_part_of_what_has_no_name() {
        let parts = [(Id::SealDrag, "minimal"), (Id::Stribeck, "minimal"), (Id::RunIn, "minimal")];
        assert!(parts.iter().all(|(id, form)| may_be_a_part(&at(*id, form, 0.5))));
        let others =
            [(Id::DriveRipple, "minimal"), (Id::TimeMisalignment, "minimal"), (Id::ForceQuantisation, "minimal")];
        assert!(!others.iter().any(|(id, form)| may_be_a_part(&at(*id, form, 0.5))));
        assert!(!may_be_a_part(&Source::Shift { parameter: 0 }));
    }

    #[test]
    fn no_load_counts_a_hundredfold() {
        let load = at(Id::ExternalLoad, "lopsided", 0.5);
        assert_eq!(beyond_any_machine(&load, &[1.0, 0.02]), None);
        assert_eq!(beyond_any_machine(&load, &[110.0, 0.02]), Some("part"));
        assert_eq!(beyond_any_machine(&load, &[1.0, -0.33]), Some("preload_per_load"));
        assert_eq!(beyond_any_machine(&at(Id::SealDrag, "minimal", 0.5), &[1e3]), None);
    }

    #[test]
    fn what_five_causes_with_numbers_of_their_own_follow_is_none_of_them() {
        let shapeless = [Id::SealDrag, Id::ForceOffset, Id::GravityTilt, Id::LoadCrosstalk];
        let shaped = [Id::RunIn, Id::Starvation, Id::SelfHeating, Id::Stribeck, Id::ViscousDrag];
        let all: Vec<Source> = shapeless.iter().chain(&shaped).map(|id| at(*id, "minimal", 0.5)).collect();
        assert_eq!(doubt_of_many(all[..8].iter()), None);
        assert_eq!(doubt_of_many(all.iter()), Some(Doubt::OneOfMany(9)));
    }

    #[test]
    fn only_a_number_that_the_minimal_form_has_not_is_given_up_at_its_end() {
        assert!(is_long_and_at_its_end(&at(Id::CableChain, "rolling", 1.0)));
        assert!(!is_long_and_at_its_end(&at(Id::CableChain, "rolling", 0.5)));
        assert!(!is_long_and_at_its_end(&at(Id::ViscousDrag, "minimal", 1.0)));
    }

    /// Strokes against a seal that rubs with 1 N for some of the time, under a zero that is off by 2 N.
    fn rubbed(simulation: &Simulation, rubs: impl Fn(f64) -> bool) -> Run {
        let at = Conditions { preload_n: Some(3000.0), temperature_degc: Some(40.0), external_load_n: None };
        let speeds_m_s = vec![0.02, 0.05, 0.1, 0.2];
        let staircase = Staircase { speeds_m_s, length_m: 0.2, order: Order::Both, ..Staircase::default() };
        let course = staircase.course(200.0, &at).expect("a course");
        let force = simulation.force(&course.run, &course.motion).expect("a force");
        let mut noise = Noise::new(5, 0);
        let rubbing = |t: f64, v: f64| if rubs(t) && v != 0.0 { v.signum() } else { 0.0 };
        let rows = course.run.time_s.iter().zip(&course.motion.velocity_m_s).zip(force);
        let drag_force_n = rows.map(|((t, v), force)| 2.0 + force + rubbing(*t, *v) + 0.2 * noise.gaussian()).collect();
        Run { drag_force_n, ..course.run }
    }

    #[test]
    fn a_name_that_acts_for_six_seconds_is_doubted_although_a_curve_beside_it_makes_up_for_that() {
        let simulation = Simulation::from_toml(GUIDE).expect("a sound file");
        let doubts_of = |rubs: &dyn Fn(f64) -> bool| {
            at_bench(&simulation, &[rubbed(&simulation, rubs)], |bench, _, _| {
                let knots = (0..40).map(|n| f64::from(n) * 2.0).collect();
                let beside = Source::Story { curve: Curve { axis: Axis::Time, carrier: Carrier::Odd, knots } };
                let sources = [at(Id::SealDrag, "minimal", 0.5), at(Id::ForceOffset, "minimal", 0.5), beside];
                let members = taken(bench, sources);
                doubts(bench, &bench.fit_members(&members), &members)
            })
        };
        assert_eq!(doubts_of(&|_| true), [None; 3]);
        assert_eq!(doubts_of(&|t| (24.0..30.0).contains(&t)), [Some(Doubt::Uneven), None, None]);
    }
}
