//! The law and the noise, learned from the rows that teach, and learned anew from fewer wherever rows are set aside.

use super::prepared::Prepared;
use super::{Refused, shifts};
use crate::answer::play::Play;
use crate::answer::scores::Held;
use crate::beside::events::{self, Spots};
use crate::beside::gap::gap;
use crate::beside::ringing::{self, Ringing};
use crate::calibration::{Calibrated, calibrate};
use crate::noise::rows::Rows;
use crate::recording::sanity::FEWEST_ROWS;
use crate::recording::side::Side;
use crate::search::case::{Case, Given};
use crate::search::found::Found;

/// What was learned from the rows that teach.
pub(super) struct Learned<'p> {
    prepared: &'p Prepared<'p>,
    /// Rows that teach; one entry per row of all runs.
    training: Vec<bool>,
    /// The same rows, whitened by their noise.
    rows: Rows,
    law: Calibrated<'p>,
}

/// What is learned anew after rows were set aside.
pub(super) enum Anew<'l> {
    /// The law, and the noise around it.
    Law,
    /// The noise alone, from what a search left; one entry per row of all runs.
    Noise(&'l [f64]),
}

impl<'p> Learned<'p> {
    /// Calibrates the law on the rows that can be compared and are not held out.
    pub(super) fn of(prepared: &'p Prepared<'p>, side: Side<'p>) -> Result<Self, Refused> {
        let training: Vec<bool> =
            side.compared.iter().zip(&prepared.split.held).map(|(compared, held)| *compared && !held).collect();
        let rows = Rows::new(side.runs, &training, prepared.coarsest);
        if rows.len() < FEWEST_ROWS {
            return Err(Refused::Motion(format!("only {} rows are left beside those set aside", rows.len())));
        }
        Ok(Learned::calibrated(prepared, training, rows, side)?)
    }

    fn calibrated(
        prepared: &'p Prepared<'p>,
        training: Vec<bool>,
        mut rows: Rows,
        side: Side<'p>,
    ) -> Result<Self, String> {
        let law = calibrate(prepared.simulation, &prepared.nominal, side, &mut rows, &training)?;
        Ok(Learned { prepared, training, rows, law })
    }

    /// Sets rows aside, and learns anew from the others.
    pub(super) fn without(
        self,
        set_aside: impl FnOnce(&Side<'_>, &mut [bool]),
        anew: Anew<'_>,
    ) -> Result<Self, String> {
        let Learned { prepared, mut training, law, .. } = self;
        set_aside(&law.side, &mut training);
        let mut rows = Rows::new(law.side.runs, &training, prepared.coarsest);
        match anew {
            Anew::Law => Learned::calibrated(prepared, training, rows, law.side),
            Anew::Noise(left) => {
                rows.learn(left, law.saturation.kept());
                Ok(Learned { prepared, training, rows, law })
            }
        }
    }

    /// Spots in what the law leaves.
    pub(super) fn spots(&self) -> Option<Spots> {
        events::spots(&self.law.side, &self.rows, &self.training, &self.law.left)
    }

    /// Spots that the causes found have hidden.
    pub(super) fn hidden_spots(&self, found: &Found<'_>) -> Option<Spots> {
        if found.members.is_empty() {
            return None;
        }
        let mut rows = self.rows.clone();
        rows.learn(&found.left, self.law.saturation.kept());
        events::spots(&self.law.side, &rows, &self.training, &found.left)
    }

    /// Estimates the noise anew where something rings.
    pub(super) fn unmask(&mut self) -> Result<Ringing, String> {
        ringing::unmask(&self.prepared.nominal, &self.law, &self.training, &mut self.rows)
    }

    /// Play of the coupling: as the search found it, else as the force shows it around reversals.
    pub(super) fn play(&self, found: &Found<'_>) -> Result<Option<Play>, String> {
        let Prepared { nominal, split, coarsest, .. } = self.prepared;
        let Calibrated { values, side, .. } = &self.law;
        let play = Play::of(nominal, side, &self.training, found);
        if play.is_some() || side.is_averaged || *coarsest != 1 {
            return Ok(play);
        }
        let gap = gap(side, &side.force(nominal, values)?, &split.held);
        Ok(gap.map(|gap| Play::shown(side, &gap, &split.held)))
    }

    /// The case of a search on these rows, which are compared from so much travel, m, after a reversal of the force on.
    pub(super) fn case<'a>(&'a self, given: Given<'a>, seen_from_m: f64) -> Case<'a> {
        let Calibrated { side, saturation, .. } = &self.law;
        Case { given, side, training: &self.training, saturation, seen_from_m }
    }

    /// The law's parameter values where calibration left them.
    pub(super) fn law_only(&self) -> &[f64] {
        &self.law.values
    }

    /// What is scored, and with which law.
    pub(super) fn held(&self, seed: u64) -> Held<'_> {
        let Prepared { holdout, split, coarsest, .. } = self.prepared;
        Held { others: holdout, split, coarsest: *coarsest, law_only: &self.law.values, seed }
    }

    /// Searches.
    pub(super) fn searched<'a>(&'a self, given: Given<'a>, seen_from_m: f64) -> Result<Found<'a>, String> {
        shifts::searched(&self.case(given, seen_from_m), &self.rows, &self.law.values)
    }
}
