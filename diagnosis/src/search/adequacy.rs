//! Whether a cause that explains much is what acts.
//!
//! The force of a true cause has the same size wherever it acts. The best of wrong names follows the mismatch here and
//! misses it there: given a size of its own in every block, it would explain far more than it does with one.
//!
//! ```text
//! r    what all causes leave, whitened        g    the cause's force without what law and other causes imitate
//! unevenness = (Σ_b (r·g)_b²/(g·g)_b - blocks) / (g·g)
//! ```
//!
//! The sum is what sizes of their own would explain beside the one size, which is `g·g`; noise alone would explain one
//! per block.
//!
//! Where the form says how the force grows with the load, a force that grows otherwise is another one: see
//! [`load_law`](crate::search::load_law).

use simulation::curve::Axis;
use simulation::mechanism::{Id, Kind};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Candidate, Gain, Member};
use crate::fit::pool::{Pool, Tolerances, ranked};
use crate::fit::source::Source;
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
    /// Its size is not the same throughout.
    Uneven,
    /// It grows with the load otherwise than its form says.
    WithLoad,
    /// Only the end of what one of its numbers can be comes near.
    AtTheEnd(&'static str),
    /// It acts after a turn more than along the stroke, where it would have to act.
    HardlyAlongTheStroke,
    /// Something beside it that changes as slowly has no name: one thing whose form is not known.
    BesideNameless,
    /// The only name, and what has none beside it explains more: it may be a part of that.
    LessThanNameless,
    /// Beside the others its force is more than any machine has.
    BeyondAnyMachine(&'static str),
    /// As many causes with numbers of their own do as well: what all follow tells of none.
    OneOfMany(usize),
}

/// Causes with numbers of their own that do as well as one another, from which on none of them is a name. Read off opened
/// trials (20 to 23): sets with the right name have four at most, the two that have more are of what the library lacks.
const MANY: usize = 5;

/// Doubt about a cause that this recording cannot tell from the others of a set.
pub(crate) fn doubt_of_many<'s>(set: impl Iterator<Item = &'s Source> + Clone) -> Option<Doubt> {
    let with_numbers = set.clone().filter(|source| source.shapes() > 0).count();
    (with_numbers >= MANY).then(|| Doubt::OneOfMany(set.count()))
}

/// Unevenness from which a name is doubted. Read off an opened trial (docs/trials/1): most right names stay
/// below it, about half of the names that were given to what the library does not know lie above.
const UNEVEN: f64 = 0.2;

/// The same for a name with a number at its end, and for one beside a doubtful name.
const UNEVEN_BESIDE: f64 = 0.1;

/// The same for a name that no other stands beside, whose forms might leave what is uneven, and what sizes of their own must
/// then explain at least, nats. Read off an opened trial (docs/trials/14): right names alone stay below 0.06 where so much tells.
const UNEVEN_ALONE: f64 = 0.08;
const LEAST_ALONE: f64 = 200.0;

/// What sizes of their own must explain at least, nats: less is coloured noise that was not quite whitened ..
const LEAST: f64 = 30.0;

/// .. and as a share of what all causes explain: less is what the form of a larger one leaves.
pub(crate) const LEAST_SHARE: f64 = 0.04;

/// Share of a cause's own force below which a block says nothing of its size.
const SILENT: f64 = 1e-3;

/// Share of its way at which a number is at its end.
const END: f64 = 0.01;

/// The same of a number that is farther in.
const INSIDE: f64 = 0.1;

/// Share of what all causes explain that a curve without a name may explain beside a cause that goes with the travel or a
/// temperature, and what it must explain at least, nats: what wears off, is used up or warms leaves no curve anything. Read off
/// opened trials (docs/trials/19, 20): beside right names it is 0.02 at most, beside wrong ones 0.07 and more.
const LEFT_TO_CURVES: f64 = 0.04;
const LEAST_LEFT_TO_CURVES: f64 = 20.0;

/// Most of what a machine has at most that a physical cause may seem to have beside others, which may pull against it. Read off
/// opened trials (20 to 23): of right names one has 1.47 of it and the others 1.1 at most, four false ones 1.24 to 5.5.
const BEYOND: f64 = 1.5;

/// Axes of causes that leave none.
const LEAVES_NO_CURVE: [Axis; 3] = [Axis::Travel, Axis::Temperature, Axis::TemperatureDifference];

/// Axes of what is slow.
const SLOW: [&str; 3] = ["time", "travel", "temperature-difference"];

/// What speaks against each member.
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
        // beside a doubtful name the others may be parts of the same thing
        let beside = with((UNEVEN_BESIDE, least));
        found.iter_mut().zip(beside).for_each(|(found, beside)| *found = found.or(beside));
    }
    let is_nameless = |at: &usize| found[*at].is_some() || members[*at].candidate.source.is_story();
    let (nameless, named): (Vec<usize>, Vec<usize>) = (0..members.len()).partition(is_nameless);
    // of several names what has none is what they leave, however large
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

/// Doubts names of what leaves no curve anything where one without a name explains more beside all causes.
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
    // noise alone gives half a nat a column
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

/// Whether a cause goes with what has been travelled or with a temperature.
fn leaves_no_curve(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, .. }
        if LEAVES_NO_CURVE.iter().any(|axis| definition.axis == axis.name()))
}

/// Whether a cause may be a part of a larger one that has no name: what is tied to a place is told by the place, a wave is no
/// part of what is smooth, and a sensor fault has a form of its own.
fn may_be_a_part(source: &Source) -> bool {
    matches!(source, Source::Mechanism { definition, form, .. }
        if definition.kind == Kind::Physics && !is_wave(&definition.forms[*form]) && !source.is_phase_bound())
}

/// Whether a cause changes over a whole session: what grows with the time, the travel and the heat of a machine that is used.
fn is_slow(source: &Source) -> bool {
    match source {
        Source::Mechanism { definition, .. } => SLOW.contains(&definition.axis),
        Source::Story { curve } => SLOW.contains(&curve.axis.name()),
        Source::Shift { .. } => false,
    }
}

/// The amplitude of a physical cause that is more than any machine has.
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
    // what a structure is struck with, rolling among it, is not the same throughout, nor where a force lies between two steps
    if [Id::StructuralResonance, Id::ForceQuantisation].iter().any(|id| member.candidate.source.is(*id)) {
        return None;
    }
    let force = own_force(bench, fit, member);
    // the data alone cannot tell the size of a shift that the law's other numbers imitate
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

/// Whether a chain bends with more force than it pulls with along the stroke: what is left of it then follows a turn as many
/// things do.
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

/// Whether a member's size is the same throughout, as that of a small cause must be beside a large one.
pub(crate) fn is_even(bench: &Bench<'_>, members: &[Member], at: usize) -> bool {
    let fit = bench.fit_members(members);
    unevenness(bench, &own_force(bench, &fit, &members[at]), &bench.rest(&fit)).0 < UNEVEN_BESIDE
}

/// A member's force without what law and other causes imitate, whitened.
fn own_force(bench: &Bench<'_>, fit: &Fit, member: &Member) -> Vec<f32> {
    let mut force = vec![0.0f32; bench.base[0].len()];
    for column in member.base.iter().filter(|column| fit.active.contains(column)) {
        let amplitude = fit.value_of(*column) as f32;
        force.iter_mut().zip(&bench.base[*column]).for_each(|(force, x)| *force += amplitude * x);
    }
    // a shift is one of the law's own columns, set free
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

/// Unevenness of a force, and what sizes of their own would explain, nats.
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

/// Numbers of a cause's shape that lie at an end of what they can be.
fn numbers_at_their_end(source: &Source) -> Vec<&'static str> {
    let Source::Mechanism { definition, form, shape } = source else { return Vec::new() };
    let parameters = definition.forms[*form].shape.iter().zip(shape);
    parameters
        .filter(|(parameter, value)| !is_inside(parameter.share_of(**value)))
        .map(|(parameter, _)| parameter.name)
        .collect()
}

/// Whether a number of a cause lies at an end of what it can be, one that tells against it or from which it explains less a
/// little farther in, by more than two that cannot be told apart differ by. `fit`: of law and others, `gain`: of the cause beside them.
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

/// Whether a number that the minimal form has not lies at an end of what it can be.
pub(crate) fn is_long_and_at_its_end(source: &Source) -> bool {
    let Source::Mechanism { definition, .. } = source else { return false };
    let minimal = definition.forms.first().map_or(&[][..], |form| form.shape);
    numbers_at_their_end(source).iter().any(|name| minimal.iter().all(|parameter| parameter.name != *name))
}

/// Whether the end of a number alone is enough to doubt: friction of seals and churned grease that grows faster than any
/// seal or grease does, a structure that is too damped to ring, a chain that takes more than its own radius to bend, a film
/// that starves within a stroke or recovers at once or never, a shear stress that has stopped growing before the carriage
/// moves, contacts that roll before they have given way at all.
fn is_telling(source: &Source, name: &str) -> bool {
    let Source::Mechanism { definition, form, shape } = source else { return false };
    let parameters = definition.forms[*form].shape.iter().zip(shape);
    let is_upper = parameters.filter(|(what, _)| what.name == name).any(|(what, value)| *value > 0.5 * what.to);
    match (definition.id, name) {
        (Id::ViscousDrag, "exponent") | (Id::StructuralResonance, "damping") => is_upper,
        (Id::CableChain, "length_m") => is_upper,
        (Id::Starvation | Id::Presliding, "length_m") | (Id::TractionSaturation, "speed_m_s") => !is_upper,
        (Id::Starvation, "recovery_s") => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use simulation::mechanism::definition;

    use super::*;

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
}
