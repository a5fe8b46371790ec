//! Equivalents: causes that this recording cannot tell from those found.

use simulation::mechanism::{Id, library};

use crate::fit::bench::Bench;
use crate::fit::least_squares::Fit;
use crate::fit::member::{Beside, Candidate, Gain, Member};
use crate::fit::pool::{Pool, Tolerances};
use crate::fit::refine::{refine, refine_all};
use crate::fit::source::{LATE, Source};
use crate::numbers::linear::{Cholesky, Symmetric, dot, products};
use crate::search::{adequacy, load_law};

/// Rivals at most this many nats behind are tied.
pub(crate) const TIE: f64 = 3.0;

/// Share of the evidence within which rivals are tied: two formulations of one cause differ by as much.
pub(crate) const NEAR: f64 = 0.004;

/// [`TIE`] and [`NEAR`] between causes whose delays are below one row: they differ only in second order of what the
/// rows do not resolve, by no more than a filter's second stage changes. A delay and a filter of the channel differ by
/// how it turns within a row, which starts and stops tell and nothing else: of eleven such delays named alone on opened
/// trials (26 to 30) six were filters.
const TIE_WITHIN_A_ROW: f64 = 9.0;
const NEAR_WITHIN_A_ROW: f64 = 0.02;

/// [`NEAR`] between an asymmetry and a constant: at one load only their growth with speed tells them apart, and for an
/// asymmetry no law of that is known.
const NEAR_OF_ASYMMETRY: f64 = 0.02;

/// [`NEAR`] between the oil's resistance in the contacts and that beside them: both grow with a power of the speed, one
/// of which is known and the other between 0.5 and 1. Of the names on opened trials (26 to 30) that beat the other by
/// less, six of 28 were wrong, of those that beat it by more four of 101. The plain form of the one has no exponent to
/// choose and yet explains more: then it is that (67 such names on opened trials 33 to 37 were right, none was wrong).
const NEAR_OF_VISCOUS: f64 = 0.02;

/// Share of a cause's evidence that a longer form may add without telling causes apart: half of what a form may leave
/// at all ([`FURTHER`](crate::search::holds::FURTHER)).
pub(crate) const LONGER_FORM: f64 = 0.01;

/// Share of a column's square below which a difference between two causes does not count.
const SAME: f64 = 1e-4;

/// A cause with its rivals.
pub(crate) struct Set {
    /// Simplest first; the first one leads.
    pub(crate) candidates: Vec<Candidate>,
    /// Probability that the true cause is among them, by the evidence against the others.
    pub(crate) confidence: f64,
}

impl Set {
    /// Confidence where the evidence against other causes was not summed.
    pub(crate) const CONFIDENCE: f64 = 0.95;

    /// The set of an unnamed effect, which has no rivals.
    pub(crate) fn alone(candidate: Candidate) -> Self {
        Set { candidates: vec![candidate], confidence: Self::CONFIDENCE }
    }
}

/// The rivals that do as well as a member in its place.
pub(crate) fn of(
    bench: &Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &[Member],
    at: usize,
) -> Set {
    let Beside { others, fit, own, gain: own_gain } = &bench.beside(members, at);
    // what a longer form adds may be the minimal form's misfit to the same cause: it tells nothing apart
    let minimal = pool.minimal(bench, &own.source, fit);
    let minimal = minimal.filter(|(_, minimal)| minimal.nats > (1.0 - LONGER_FORM) * own_gain.nats);
    let own_score = minimal.as_ref().map_or(own_gain.score, |(_, minimal)| minimal.score.min(own_gain.score));
    let own_nats = minimal.as_ref().map_or(own_gain.nats, |(_, minimal)| minimal.nats.min(own_gain.nats));
    let minimal = minimal.map(|(candidate, _)| candidate.clone());
    let race = Race { bench, own, own_gain, own_nats, own_score };
    let mut candidates = vec![own.clone()];
    let mut tied: Vec<Rival> = Vec::new();
    let mut against = 0.0;
    if !own.source.is_story() {
        let far = (6.0 * race.tie()).max(0.2 * own_gain.nats);
        let rivals: Vec<usize> = pool
            .ranked_causes(bench, fit, tolerances)
            .into_iter()
            .filter(|(index, gain)| {
                let source = &pool.causes[*index].source;
                (gain.score > own_score - far || race.is_one_late_channel(source))
                    // where starts and stops speak for the member, a cause for which they do not is no rival
                    && (!bench.is_spoken_for(&own.source) || bench.is_spoken_for(source))
                    && !source.is_kin(&own.source)
                    && !others.iter().any(|other| is_of_one(&other.candidate.source, source))
            })
            .take(10)
            .map(|(index, _)| index)
            .collect();
        let refined = refine_all(bench, rivals.iter().map(|index| &pool.causes[*index]), fit);
        for (index, refined) in rivals.into_iter().zip(refined) {
            let mut rival = race.rival(refined);
            if rival.beyond() >= 0.0 {
                // the form that is best at the grid's points need not be best between them
                for other in pool.other_forms(bench, &pool.causes[index].source, fit) {
                    let other = race.rival(refine(bench, &pool.causes[other], fit));
                    if other.beyond() < rival.beyond() {
                        rival = other;
                    }
                }
            }
            if rival.beyond() >= 0.0 {
                // two formulations of one cause differ by a share of the evidence: a rival's deficit counts relative to
                // its tie
                against += (-rival.behind.min(rival.behind * TIE / rival.tie)).exp();
            } else if !race.is_told_by_load(others, fit, &rival) {
                tied.push(rival);
            }
        }
    }
    // a shifted parameter pays for its tolerance, so a rival may do far better: such rivals must tie with the best one
    let is_shift = matches!(own.source, Source::Shift { .. });
    let first = tied.iter().map(|rival| rival.behind).fold(0.0, f64::min);
    tied.retain(|rival| !is_shift || rival.behind.abs() < rival.tie || rival.behind - first < rival.tie);
    candidates.extend(tied.into_iter().map(|rival| rival.candidate));
    candidates.sort_by_key(|candidate| candidate.source.simplicity());
    let constants: Vec<Candidate> =
        candidates.iter().chain(&minimal).filter(|c| is_constant(bench, c)).cloned().collect();
    candidates.retain(|candidate| !constants.iter().any(|constant| is_with_more(candidate, constant)));
    Set { candidates, confidence: (1.0 / (1.0 + against)).clamp(0.5, 0.99) }
}

/// Exchanges members whose law of the load the recording refuses for causes that explain as much and whose law it
/// accepts.
pub(crate) fn exchange_refused(
    bench: &mut Bench<'_>,
    pool: &mut Pool,
    tolerances: &Tolerances<'_>,
    members: &mut [Member],
) {
    for at in 0..members.len() {
        if !load_law::has_law(&members[at].candidate.source) {
            continue;
        }
        let Beside { others, fit, own, gain } = bench.beside(members, at);
        if !load_law::refuses(bench, &fit, &others, (&own, &gain)) {
            continue;
        }
        let least = gain.nats - TIE.max(LONGER_FORM * gain.nats);
        let rivals: Vec<usize> = pool
            .ranked_causes(bench, &fit, tolerances)
            .into_iter()
            .map(|(index, _)| index)
            .filter(|index| {
                let source = &pool.causes[*index].source;
                load_law::has_law(source) && !members.iter().any(|member| member.candidate.source.is_kin(source))
            })
            .collect();
        let better = rivals
            .into_iter()
            .map(|index| refine(bench, &pool.causes[index], &fit))
            .find(|(rival, of)| of.nats > least && !load_law::refuses(bench, &fit, &others, (rival, of)));
        if let Some((rival, _)) = better {
            members[at] = bench.take(rival);
        }
    }
}

/// A cause in the place of a member.
struct Rival {
    candidate: Candidate,
    gain: Gain,
    /// Nats by which it is behind the member; negative where it does better.
    behind: f64,
    /// Nats by which it may be behind and still be tied.
    tie: f64,
}

impl Rival {
    /// Nats by which it is farther behind than a tie allows; below 0 the recording cannot tell it from the member.
    fn beyond(&self) -> f64 {
        self.behind - self.tie
    }
}

/// A race of a member against one rival after another.
struct Race<'a, 'b> {
    bench: &'a Bench<'b>,
    own: &'a Candidate,
    own_gain: &'a Gain,
    /// What the member explains, and its score (less what its freedom costs); of its minimal form where that is enough.
    own_nats: f64,
    own_score: f64,
}

impl Race<'_, '_> {
    /// Nats by which rivals may be behind.
    fn tie(&self) -> f64 {
        TIE.max(NEAR * self.own_gain.nats)
    }

    /// Whether the load tells a rival from the member, however well it explains the rest: the member follows its own
    /// law of the load, the rival does not follow its own. `fit`: of the others alone.
    fn is_told_by_load(&self, others: &[Member], fit: &Fit, rival: &Rival) -> bool {
        let is_refused = |cause| load_law::refuses(self.bench, fit, others, cause);
        load_law::has_law(&self.own.source)
            && is_refused((&rival.candidate, &rival.gain))
            && !is_refused((self.own, self.own_gain))
    }

    /// Whether the member is a channel that is late by less than a row, and the other cause the same by other means: as
    /// a delay, or as a filter.
    fn is_one_late_channel(&self, other: &Source) -> bool {
        let late_s = late_by_s(self.own, self.own_gain).unwrap_or(0.0);
        self.own.source.is_any(&LATE) && other.is_any(&LATE) && (1e-9..self.bench.step_s).contains(&late_s)
    }

    /// A cause, with what it adds in the member's place, as a rival.
    fn rival(&self, (candidate, gain): (Candidate, Gain)) -> Rival {
        let Race { bench, own, own_gain, own_nats, own_score } = *self;
        // additional parameters count against a rival only where they are shape parameters, or are many
        let is_plain = candidate.source.shapes() == 0
            && (candidate.source.is_minimal() || candidate.freedom() <= own.freedom() + 1);
        let is_within_a_row = [(own, own_gain), (&candidate, &gain)]
            .iter()
            .all(|(late, gain)| late_by_s(late, gain).is_some_and(|late_s| late_s.abs() < bench.step_s));
        let is_viscous =
            [own, &candidate].iter().all(|cause| cause.source.is_any(&[Id::ViscousDrag, Id::HydrodynamicRolling]));
        let tie = if is_within_a_row && self.is_one_late_channel(&candidate.source) {
            f64::INFINITY
        } else if is_within_a_row {
            self.tie().max(TIE_WITHIN_A_ROW).max(NEAR_WITHIN_A_ROW * own_nats)
        } else if own.source.is(Id::DirectionAsymmetry) && is_constant(bench, &candidate) {
            self.tie().max(NEAR_OF_ASYMMETRY * own_nats)
        } else if is_viscous && own.source.is(Id::HydrodynamicRolling) && own.source.shapes() == 0 {
            0.0
        } else if is_viscous {
            self.tie().max(NEAR_OF_VISCOUS * own_nats)
        } else {
            self.tie()
        };
        let behind = if is_viscous && adequacy::is_at_an_end(&candidate.source) {
            // its exponent would have to be another than that resistance has
            f64::INFINITY
        } else if is_plain || is_within_a_row || is_viscous {
            own_nats - gain.nats
        } else {
            own_score - gain.score
        };
        Rival { candidate, gain, behind, tie }
    }
}

/// Whether two causes are of one kind, or both delay the channel.
fn is_of_one(a: &Source, b: &Source) -> bool {
    a.is_kin(b) || (a.is_any(&LATE) && b.is_any(&LATE))
}

/// Delay that a cause gives the force or its friction, s; `None` for causes that delay nothing.
fn late_by_s(candidate: &Candidate, gain: &Gain) -> Option<f64> {
    let Source::Mechanism { definition, form, shape } = &candidate.source else { return None };
    if !matches!(definition.id, Id::TimeMisalignment | Id::ForceLowpass | Id::FrictionalLag) {
        return None;
    }
    // either the amplitude is the delay itself, or it is the part of the force that a shape parameter (a time) delays
    let whole = if definition.forms[*form].shape.is_empty() { 1.0 } else { *shape.first()? };
    Some(whole * gain.amplitudes.first()?)
}

/// Whether a cause is a constant: of one magnitude wherever it acts.
fn is_constant(bench: &Bench<'_>, candidate: &Candidate) -> bool {
    let columns = bench.raw(&candidate.source).unwrap_or_default();
    candidate.source.is_minimal() && columns.iter().flatten().all(|x| *x == 0.0 || x.abs() == 1.0)
}

/// Whether a rival is a constant with an addition that does not show (a drift that does not drift is an offset): it
/// need not be listed beside the constant.
fn is_with_more(rich: &Candidate, constant: &Candidate) -> bool {
    rich.freedom() > constant.freedom()
        && !constant.source.is_kin(&rich.source)
        && constant.columns.iter().all(|column| left_by(column, &rich.columns) < SAME)
}

/// Whether two causes of one column each are the same in this recording.
pub(crate) fn is_alike(a: &Candidate, b: &Candidate) -> bool {
    matches!((a.columns.as_slice(), b.columns.as_slice()), ([column], [_]) if left_by(column, &b.columns) < SAME)
}

/// Share of a column's square that the others do not imitate.
fn left_by(column: &[f32], others: &[Vec<f32>]) -> f64 {
    let others: Vec<&[f32]> = others.iter().map(Vec::as_slice).collect();
    let forward = Cholesky::of(&Symmetric::gram(&others)).forward(&products(&others, &[column]));
    let own = products(&[column], &[column])[0];
    if own > 0.0 { 1.0 - dot(&forward, &forward) / own } else { 0.0 }
}

/// The run that best settles between rivals: the one that most of them ask for in the library.
pub(crate) fn advice(ids: &[String]) -> Option<&'static str> {
    let asked: Vec<&'static str> =
        library().iter().filter(|d| ids.iter().any(|id| id == d.id.name())).map(|d| d.next_experiment).collect();
    asked.iter().copied().max_by_key(|code| {
        (asked.iter().filter(|other| *other == code).count(), std::cmp::Reverse(asked.iter().position(|a| a == code)))
    })
}

/// Instruction for the code of a run.
pub(crate) fn text(code: &str) -> &'static str {
    match code {
        "P0" => "Rest 30 s at both ends with the carriage free, then pull with a dead weight.",
        "P1" => "A staircase of 12 to 20 speeds, both directions, up and down, over one section of the rail.",
        "P2" => "The speed staircase at three preloads or loads that span a decade.",
        "P3" => "The speed staircase at three temperatures, 10 K apart.",
        "P4" => "The whole stroke slowly and fast, both directions, five times.",
        "P5" => "Reversals of 1, 10, 100 um and 2 mm at two frequencies a decade apart.",
        "P6" => "A speed that is modulated without reversing at three frequencies, with and without a known mass.",
        "P7" => "Rest 1, 10, 100 and 1000 s, then start slowly.",
        "P8" => "Run warm for two hours, rest one, resume for ten minutes.",
        "P9" => "Known weights up and down at three speeds.",
        "P10" => "The short staircase and the map again in a month.",
        "seals-off" => "Repeat with the seals taken off.",
        "unload" => "Repeat with the block unloaded.",
        "second-preload" => "Repeat at a second preload, as different as the rig allows.",
        "second-temperature" => "Repeat 10 K warmer.",
        "known-mass" => "Repeat with a known mass added to the carriage.",
        "turn-block" => "Turn the block round on the rail and repeat.",
        "disconnect-chain" => "Repeat with the cable chain taken off.",
        "two-frequencies" => "Reverse over the same stroke at two frequencies a decade apart.",
        "zero-force" => "Take the force off the sensor at both ends of the stroke and record its zero.",
        "relubricate" => "Relubricate and repeat.",
        _ => "Repeat the same run later.",
    }
}

#[cfg(test)]
mod tests {
    use simulation::Simulation;
    use simulation::mechanism::{Added, definition};
    use simulation::profile::{Conditions, Order, Staircase};
    use simulation::run::Run;
    use simulation::sensor::Noise;

    use super::*;
    use crate::search::workbench::{GUIDE, at_bench, taken};

    /// Strokes at three preloads with resistance of the oil in the contacts, N at 0.1 m/s, or beside them.
    fn runs(simulation: &Simulation, added: &Added) -> Vec<Run> {
        let mut machine = simulation.clone();
        machine.mechanisms = vec![added.clone()];
        let of = |preload_n: f64| {
            let at = Conditions { preload_n: Some(preload_n), temperature_degc: Some(40.0), external_load_n: None };
            let speeds_m_s = vec![0.01, 0.03, 0.1, 0.3];
            let staircase = Staircase { speeds_m_s, length_m: 0.3, order: Order::Both, ..Staircase::default() };
            let course = staircase.course(100.0, &at).expect("a course");
            let mut noise = Noise::new(preload_n as u64, 0);
            let force = machine.force(&course.run, &course.motion).expect("a force");
            Run { drag_force_n: force.iter().map(|f| f + 0.2 * noise.gaussian()).collect(), ..course.run }
        };
        [2500.0, 3000.0, 3600.0].map(of).to_vec()
    }

    /// Names of the causes that the recording cannot tell from the one that acts.
    fn tied(added: &Added) -> Vec<&'static str> {
        let simulation = Simulation::from_toml(GUIDE).expect("a sound file");
        at_bench(&simulation, &runs(&simulation, added), |bench, pool, tolerances| {
            let (definition, form) = (definition(added.id), added.form);
            let members = taken(bench, [Source::Mechanism { definition, form, shape: added.shape.clone() }]);
            of(bench, pool, tolerances, &members, 0).candidates.iter().map(|candidate| candidate.source.id()).collect()
        })
    }

    #[test]
    fn rolling_in_oil_and_drag_beside_it_are_told_by_an_exponent_that_is_not_needed_or_out_of_reach() {
        let rolling = Added { id: Id::HydrodynamicRolling, form: 0, shape: vec![], amplitudes: vec![0.03] };
        assert_eq!(tied(&rolling), ["hydrodynamic-rolling"]);
        // an exponent of 1 is at hand for what acts beside the contacts only
        let drag = Added { id: Id::ViscousDrag, form: 0, shape: vec![1.0], amplitudes: vec![0.05] };
        assert_eq!(tied(&drag), ["viscous-drag"]);
    }
}
