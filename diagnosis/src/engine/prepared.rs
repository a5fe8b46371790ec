//! Runs, checked, and made comparable with the law.

use std::borrow::Cow;

use simulation::Simulation;
use simulation::run::Run;
use simulation::session::joined;

use super::{Asked, Refused};
use crate::answer::proof::Split;
use crate::beside::ringing::Ringing;
use crate::beside::speed::{self, SetAside};
use crate::fit::edges::Edges;
use crate::fit::ends::Ends;
use crate::fit::skew::Skew;
use crate::nominal::Nominal;
use crate::numbers::rounding::quantum;
use crate::numbers::statistics::rms;
use crate::recording::condense::{condensed, factor};
use crate::recording::moving::Moving;
use crate::recording::resolution::coarsest;
use crate::recording::sanity;
use crate::recording::side::Side;
use crate::report::DataQuality;
use crate::search::case::Given;

/// Runs that may be compared with the law, and what their channels tell before any fit.
pub(super) struct Prepared<'s> {
    pub(super) simulation: &'s Simulation,
    pub(super) nominal: Nominal,
    moving: Moving<'static>,
    /// Recordings that are only scored.
    pub(super) holdout: Cow<'s, [Run]>,
    pub(super) split: Split,
    edges: Option<Edges>,
    /// A recorded speed that was discarded.
    pub(super) speed: Option<SetAside>,
    /// Whether the speed is noisier than one derived from a position.
    is_noisy: bool,
    /// Recorded rows averaged to one.
    together: usize,
    /// Fewest rows that the search averages to one: as many as the channels need to resolve the motion.
    pub(super) coarsest: usize,
}

impl<'s> Prepared<'s> {
    /// Checks the runs, and averages, joins and smooths them. Defects are added to the warnings.
    pub(super) fn of(asked: &Asked<'s>, quality: &mut DataQuality) -> Result<Self, Refused> {
        let simulation = asked.simulation;
        let nominal = Nominal::new(simulation);
        check_channels(asked.runs, quality)?;
        let edges = edges(asked, quality);
        let together = factor(asked.runs);
        let [runs, holdout] = [asked.runs, asked.holdout].map(|runs| averaged(runs, together));
        let split = asked.split(&runs);
        let recorded = Moving::as_recorded(&runs);
        check_moves(&recorded, quality)?;
        // only now, since hold-out and faults are decided on the recordings as given
        let session = joined(simulation, &runs);
        let recorded = session.as_deref().map_or(recorded, Moving::as_recorded);
        let speed = speed::set_aside(simulation, &nominal, &recorded);
        let bare;
        let (moving, holdout) = match &speed {
            Some(speed) => {
                quality.warnings.push(speed.said());
                bare = speed::without(&recorded.runs);
                (Moving::as_recorded(&bare), Cow::Owned(speed::without(&holdout)))
            }
            None => (recorded, holdout),
        };
        let is_noisy = speed::is_noisy(&moving.runs);
        let moving = moving.calmed(!is_noisy);
        let coarsest = coarsest(&nominal, &moving.runs, &moving.motions);
        // averages have no fast acceleration, and the one derived from a noisy speed is a cause of its own
        let nominal = if is_noisy || coarsest > 1 { nominal.of_law() } else { nominal };
        Ok(Prepared { simulation, nominal, moving, holdout, split, edges, speed, is_noisy, together, coarsest })
    }

    /// Everything derived from the runs, with the law as given, where that allows a judgement.
    pub(super) fn side(&self, quality: &mut DataQuality) -> Result<Side<'_>, Refused> {
        let (nominal, start) = (&self.nominal, self.nominal.start());
        let side = Side::new(self.simulation, nominal, &start, &self.moving, self.together > 1, quality)?;
        quality.count_averages(self.together);
        if !nominal.is_incomplete() {
            let compared = |column: &[f64]| -> Vec<f64> {
                column.iter().zip(&side.compared).filter(|(_, compared)| **compared).map(|(x, _)| *x).collect()
            };
            let simulated = side.force(nominal, &start)?;
            sanity::scale(rms(&compared(&side.drag_n)), rms(&compared(&simulated)), quality);
        }
        if quality.used < sanity::FEWEST_ROWS {
            return Err(Refused::Motion(format!(
                "{} of {} rows can be compared; at least {} are needed: the carriage hardly moves, or the law lacks an input",
                quality.used,
                quality.samples,
                sanity::FEWEST_ROWS
            )));
        }
        Ok(side)
    }

    /// What no search changes.
    pub(super) fn given<'a>(&'a self, ringing: &'a Ringing) -> Given<'a> {
        // where a recorded speed was discarded, changes of the remaining one are no acceleration to excite a resonance
        let is_pointed = !self.is_noisy && self.speed.is_none();
        Given {
            simulation: self.simulation,
            nominal: &self.nominal,
            ringing: is_pointed.then_some(ringing.pointed.as_slice()),
            heard_n2: ringing.heard.as_ref().map_or(0.0, |heard| heard.power_n2),
            discarded_n2: self.speed.as_ref().map_or(0.0, |speed| speed.power_n2),
            edges: self.edges,
            step_n: self.moving.runs.iter().filter_map(|run| quantum(&run.drag_force_n)).max_by(f64::total_cmp),
        }
    }
}

fn check_channels(runs: &[Run], quality: &mut DataQuality) -> Result<(), Refused> {
    if runs.is_empty() {
        return Err(Refused::File("no run to diagnose".to_owned()));
    }
    let bad = |run| sanity::channels(run, quality);
    runs.iter().find_map(bad).map_or(Ok(()), |reason| Err(Refused::File(reason)))
}

fn check_moves(recorded: &Moving<'_>, quality: &mut DataQuality) -> Result<(), Refused> {
    let bad = |(run, motion)| sanity::moves(run, motion, quality);
    recorded.runs.iter().zip(&recorded.motions).find_map(bad).map_or(Ok(()), |reason| Err(Refused::File(reason)))
}

/// What starts and stops of the runs as recorded tell of a delay between motion and force, and of skewed clocks.
fn edges(asked: &Asked<'_>, quality: &mut DataQuality) -> Option<Edges> {
    let moved_kg = asked.simulation.axis.moved_mass_kg.unwrap_or(0.0);
    let ends = Ends::of(asked.runs, &asked.split(asked.runs).held, moved_kg);
    quality.warnings.extend(ends.as_ref().and_then(Skew::of).map(|skew| skew.said()));
    ends.as_ref().and_then(Edges::of)
}

/// Averages of so many rows each.
fn averaged(runs: &[Run], together: usize) -> Cow<'_, [Run]> {
    match together {
        ..=1 => Cow::Borrowed(runs),
        _ => Cow::Owned(runs.iter().map(|run| condensed(run, together)).collect()),
    }
}
