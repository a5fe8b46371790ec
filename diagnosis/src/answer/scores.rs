//! Scores of the three stages on held-out rows, and what each cause does there.

use simulation::curve::Axis;
use simulation::file::PositionReference;
use simulation::mechanism::{Context, Id};
use simulation::run::Run;

use crate::answer::aside::Aside;
use crate::answer::carried::Scored;
use crate::answer::elsewhere::Places;
use crate::answer::play::Play;
use crate::answer::proof::{self, Interval, Split, Stages};
use crate::fit::member::Member;
use crate::fit::source::{Source, raw_columns, weighted};
use crate::fit::spectrum::wavelength_m;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::numbers::statistics::rms;
use crate::recording::moving::Moving;
use crate::recording::side::Side;
use crate::report::{Carried, DataQuality, Holdout};
use crate::search::case::{Case, Given};
use crate::search::found::Found;
use crate::search::open_set::is_clock;

/// Scores, and residuals on the training recordings.
pub(crate) struct Proof {
    pub(crate) holdout: Holdout,
    /// How much of each member is present on the scored rows; `None` where they tell nothing of it.
    pub(crate) carried: Vec<Option<Carried>>,
    /// Residuals on all rows of the training recordings, held out or not.
    pub(crate) own: Stages,
    /// Scored rows averaged to one.
    pub(crate) averaged: usize,
}

/// The rows that are scored, and what with.
pub(crate) struct Held<'a> {
    /// Recordings that are only scored; none where `split` holds out a part of those that were searched.
    pub(crate) others: &'a [Run],
    pub(crate) split: &'a Split,
    /// Fewest rows that are averaged to one.
    pub(crate) coarsest: usize,
    /// The law as calibrated before any search.
    pub(crate) law_only: &'a [f64],
    /// Seed of the bootstrap.
    pub(crate) seed: u64,
}

/// Scores what was found.
pub(crate) fn score(case: &Case<'_>, held: &Held<'_>, found: &Found<'_>, aside: &Aside<'_>) -> Result<Proof, String> {
    let Case { given: Given { simulation, nominal, .. }, side, .. } = *case;
    let given = if nominal.is_incomplete() { held.law_only.to_vec() } else { nominal.start() };
    let scene = Scene {
        nominal,
        found,
        play: aside.play,
        law_only: nearer(case, held, &given)?,
        given,
        is_relative: simulation.axis.position_reference == PositionReference::Relative,
    };
    match held.others {
        [] => scene.proof(side, &Unseen::of_searched(side, held), held.seed),
        others => {
            let moving = Moving::as_recorded(others).calmed(side.moving.has_calm_speed);
            let (start, is_averaged) = (&scene.given, side.is_averaged);
            let other = Side::new(simulation, nominal, start, &moving, is_averaged, &mut DataQuality::default())?;
            scene.proof(side, &Unseen::of_others(&other, held), held.seed)
        }
    }
}

/// Rows that no search has seen.
struct Unseen<'a> {
    side: &'a Side<'a>,
    rows: Rows,
    intervals: Vec<Interval>,
    description: String,
    /// Whether they are of other runs than those that were searched.
    crosses_runs: bool,
}

impl<'a> Unseen<'a> {
    /// Rows held out of the recordings that were searched.
    fn of_searched(side: &'a Side<'a>, Held { split, coarsest, .. }: &Held<'_>) -> Self {
        let held: Vec<bool> = side.compared.iter().zip(&split.held).map(|(c, held)| *c && *held).collect();
        Unseen {
            side,
            rows: Rows::new(side.runs, &held, *coarsest),
            intervals: split.intervals.clone(),
            description: split.description.clone(),
            crosses_runs: split.crosses_runs,
        }
    }

    /// All rows of other recordings.
    fn of_others(side: &'a Side<'a>, Held { others, coarsest, .. }: &Held<'_>) -> Self {
        let names: Vec<String> = others.iter().map(|run| run.name.clone()).collect();
        Unseen {
            side,
            rows: Rows::new(others, &side.compared, *coarsest),
            intervals: proof::intervals(others, &vec![true; side.drag_n.len()]),
            description: format!("{} other recording(s): {}", others.len(), names.join(", ")),
            crosses_runs: true,
        }
    }

    /// Mean time between scored rows, s.
    fn step_s(&self) -> f64 {
        self.side.step_s() * self.rows.decimation() as f64
    }
}

/// The numbers of the law that leave the smaller RMS on the rows that taught: as given, or as calibrated. Calibration weighs by
/// the noise, which holds what is missing as well, and an improvement is not to be claimed over a law that it has made worse.
fn nearer(case: &Case<'_>, held: &Held<'_>, given: &[f64]) -> Result<Vec<f64>, String> {
    let Case { given: Given { nominal, .. }, side, .. } = *case;
    let left_n = |values: &[f64]| {
        let left = side.residual(nominal, values)?;
        let rows =
            left.iter().zip(&side.compared).zip(&held.split.held).filter(|((_, compared), held)| **compared && !**held);
        Ok::<f64, String>(rms(&rows.map(|((left, _), _)| *left).collect::<Vec<_>>()))
    };
    Ok(if left_n(held.law_only)? > left_n(given)? { given } else { held.law_only }.to_vec())
}

/// Causes that act at one place.
const LOCAL: [Id; 2] = [Id::RailJoint, Id::Contamination];

struct Scene<'a> {
    nominal: &'a Nominal,
    found: &'a Found<'a>,
    play: Option<&'a Play>,
    law_only: Vec<f64>,
    given: Vec<f64>,
    is_relative: bool,
}

impl Scene<'_> {
    /// `side`: the recordings that were searched.
    fn proof(&self, side: &Side<'_>, unseen: &Unseen<'_>, seed: u64) -> Result<Proof, String> {
        let stages = self.stages(unseen.side, unseen.crosses_runs)?;
        let score = proof::score(&stages, &unseen.rows, &unseen.intervals, unseen.step_s(), seed);
        Ok(Proof {
            holdout: Holdout { description: unseen.description.clone(), ..score },
            carried: self.carried(unseen, &stages)?,
            own: self.stages(side, false)?,
            averaged: unseen.rows.decimation(),
        })
    }

    fn stages(&self, side: &Side<'_>, crosses: bool) -> Result<Stages, String> {
        let calibrated = side.residual(self.nominal, &self.law_only)?;
        let mut after = match crosses && self.is_all_of_its_time() {
            true => calibrated.clone(),
            false => self.with_members(side, crosses)?,
        };
        let play = self.play.map(|play| play.force(&side.contexts)).unwrap_or_default();
        after.iter_mut().zip(play).for_each(|(after, force)| *after -= force);
        Ok(Stages { before: side.residual(self.nominal, &self.given)?, calibrated, after })
    }

    /// Residual of the law beside the members, and of these.
    fn with_members(&self, side: &Side<'_>, crosses: bool) -> Result<Vec<f64>, String> {
        let mut left = side.residual(self.nominal, &self.found.with_shifts)?;
        for at in 0..self.found.members.len() {
            let force = match self.is_elsewhere(at, crosses) {
                true => self.without_place(&side.contexts, at),
                false => self.force(&side.contexts, at),
            };
            left.iter_mut().zip(force.unwrap_or_default()).for_each(|(left, force)| *left -= force);
        }
        Ok(left)
    }

    /// Whether everything found is bound to the time of its recording: then only the law says anything of another
    /// recording, and beside such curves it may have been moved far off.
    fn is_all_of_its_time(&self) -> bool {
        (0..self.found.members.len()).all(|at| self.is_of_its_time(at))
    }

    /// Whether a member is a curve over a recording's time or travel, which differ in another recording, or another
    /// unnamed effect that was fitted beside such a curve.
    fn is_of_its_time(&self, at: usize) -> bool {
        let Found { members, doubts, .. } = self.found;
        let is_nameless = members[at].candidate.source.is_story() || doubts[at].is_some();
        is_nameless && members.iter().any(|member| follows_time(&member.candidate.source))
    }

    /// Whether a member is bound to places or to a time that another recording does not share.
    fn is_elsewhere(&self, at: usize, crosses: bool) -> bool {
        let source = &self.found.members[at].candidate.source;
        // another recording does not share the phase of a clock
        crosses && (is_clock(source) || self.is_of_its_time(at) || (self.is_relative && source.is_phase_bound()))
    }

    /// Force of a member; `None` where no run shows it.
    fn force(&self, contexts: &[Context<'_>], at: usize) -> Option<Vec<f64>> {
        let member = &self.found.members[at];
        let source = &member.candidate.source;
        Some(weighted(&raw_columns(source, contexts)?, &member.amplitudes(&self.found.fit)))
    }

    /// What a member predicts where places differ from those of the training runs: its mean. A wave has none, and what
    /// acts at one place is nowhere else.
    fn without_place(&self, contexts: &[Context<'_>], at: usize) -> Option<Vec<f64>> {
        let Found { bench, members, fit, .. } = self.found;
        let source = &members[at].candidate.source;
        if wavelength_m(source).is_some() || source.is_any(&LOCAL) {
            return None;
        }
        let columns = raw_columns(source, bench.contexts)?;
        let places = Places::of(bench.contexts, &bench.compared);
        Some(places.force(&columns, &members[at].amplitudes(fit), contexts))
    }

    /// How much of each member is present, everything else as it was found.
    fn carried(&self, unseen: &Unseen<'_>, stages: &Stages) -> Result<Vec<Option<Carried>>, String> {
        let (found, side) = (self.found, unseen.side);
        if found.members.is_empty() || unseen.rows.len() == 0 {
            return Ok(vec![None; found.members.len()]);
        }
        let of = |(at, member): (usize, &Member)| match &member.candidate.source {
            Source::Shift { parameter } => self.force_of_shift(side, *parameter).ok(),
            _ if self.is_elsewhere(at, unseen.crosses_runs) => None,
            _ => self.force(&side.contexts, at),
        };
        let forces: Vec<Option<Vec<f64>>> = found.members.iter().enumerate().map(of).collect();
        let law = side.tangent(self.nominal, &found.with_shifts)?;
        let all: Vec<Vec<f64>> = forces.iter().flatten().cloned().collect();
        let scored = Scored::new(&unseen.rows, &stages.after, &law, &all);
        let share = |(member, force): (&Member, &Option<Vec<f64>>)| match &member.candidate.source {
            Source::Shift { .. } => scored.share_of_shift(force.as_ref()?),
            _ => scored.share(force.as_ref()?),
        };
        Ok(found.members.iter().zip(&forces).map(share).collect())
    }

    /// Effect of a shifted law parameter beside the others.
    fn force_of_shift(&self, side: &Side<'_>, parameter: usize) -> Result<Vec<f64>, String> {
        let mut values = self.found.with_shifts.clone();
        values[parameter] = 0.0;
        let without = side.residual(self.nominal, &values)?;
        let with = side.residual(self.nominal, &self.found.with_shifts)?;
        Ok(without.iter().zip(with).map(|(without, with)| without - with).collect())
    }
}

/// Whether a curve follows a recording's time or travel, which differ in another recording.
fn follows_time(source: &Source) -> bool {
    matches!(source, Source::Story { curve } if matches!(curve.axis, Axis::Time | Axis::Travel))
}
