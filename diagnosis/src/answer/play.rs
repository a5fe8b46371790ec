//! Play of a coupling, identified before all other causes.
//!
//! Within the gap no force arrives, beyond it all of it does. Neither the encoder nor the rows resolve where exactly
//! one becomes the other, and every row on the wrong side is off by the whole drag: a few of them outweigh everything
//! else. Once play is found, the rows up to its edge are excluded, and the search uses the others.

use simulation::mechanism::{Added, Context, Id, definition};

use crate::answer::finding::play;
use crate::answer::member::Named;
use crate::answer::region::region;
use crate::beside::gap::Gap;
use crate::fit::source::{Source, added, raw_columns, weighted};
use crate::nominal::Nominal;
use crate::recording::side::Side;
use crate::report::{Finding, Region};
use crate::search::found::Found;

/// Margin beyond the edge within which a row may still lie before it: as a share of the gap, and at least, m (what an
/// encoder of a micrometre does not resolve).
const BEYOND: f64 = 0.5;
const AT_LEAST_M: f64 = 3e-6;

/// Play that was found.
pub(crate) struct Play {
    source: Source,
    amplitudes: Vec<f64>,
    /// The finding without its share.
    finding: Finding,
    region: Option<Region>,
    /// Squared force, summed over the compared rows, N².
    pub(crate) squares_n2: f64,
    /// p-value of "nothing is missing".
    pub(crate) p: f64,
}

impl Play {
    /// Play as a member of a search's result, unless doubted.
    pub(crate) fn of(nominal: &Nominal, side: &Side<'_>, training: &[bool], found: &Found<'_>) -> Option<Self> {
        let is_play = |at: &usize| found.members[*at].candidate.source.is(Id::CouplingBacklash);
        let at = (0..found.members.len()).find(is_play).filter(|at| found.doubts[*at].is_none())?;
        let source = found.members[at].candidate.source.clone();
        let amplitudes = found.amplitudes().swap_remove(at);
        let force = found.bench.force(&source, &amplitudes);
        let compared = force.iter().zip(training).filter(|(_, compared)| **compared);
        Some(Play {
            squares_n2: compared.map(|(force, _)| force * force).sum(),
            finding: Named { nominal, found, variances: &found.fit.variances(), at, amplitudes: &amplitudes }
                .finding(0.0),
            region: region(side, training, &source, &force, 0.0, Id::CouplingBacklash.name()),
            p: found.p_no_mismatch,
            source,
            amplitudes,
        })
    }

    /// Smaller play that the force shows around the reversals that are not compared, excluding rows `held` back.
    pub(crate) fn shown(side: &Side<'_>, gap: &Gap, held: &[bool]) -> Self {
        let source =
            Source::Mechanism { definition: definition(Id::CouplingBacklash), form: 0, shape: vec![gap.gap_m] };
        let amplitudes = vec![1.0];
        let columns = raw_columns(&source, &side.contexts);
        let force = columns.map(|columns| weighted(&columns, &amplitudes)).unwrap_or_default();
        let is_told: Vec<bool> = force.iter().zip(held).map(|(force, held)| force.is_finite() && !held).collect();
        let told = force.iter().zip(&is_told).filter(|(_, told)| **told);
        Play {
            squares_n2: told.map(|(force, _)| force * force).sum(),
            finding: play(gap),
            region: region(side, &is_told, &source, &force, 0.0, Id::CouplingBacklash.name()),
            p: gap.p,
            source,
            amplitudes,
        }
    }

    /// Travel since the last reversal of the force from which on all of it arrives, m.
    pub(crate) fn edge_m(&self) -> f64 {
        let Source::Mechanism { shape, .. } = &self.source else { return 0.0 };
        let gap_m = shape.first().copied().unwrap_or(0.0);
        gap_m + shape.get(1).copied().unwrap_or(0.0) + (BEYOND * gap_m).max(AT_LEAST_M)
    }

    /// Removes the rows that may lie before the edge from the training rows.
    pub(crate) fn set_aside(&self, side: &Side<'_>, training: &mut [bool]) {
        let edge_m = self.edge_m();
        let since_m = side.contexts.iter().flat_map(Context::surely_since_push_m);
        training.iter_mut().zip(since_m).for_each(|(training, since_m)| *training &= since_m > edge_m);
    }

    /// Its force over the rows of all runs, N.
    pub(crate) fn force(&self, contexts: &[Context<'_>]) -> Vec<f64> {
        raw_columns(&self.source, contexts).map(|columns| weighted(&columns, &self.amplitudes)).unwrap_or_default()
    }

    /// The finding with this share of the mismatch.
    pub(crate) fn reported(&self, share: f64) -> (Finding, Option<Region>) {
        let finding = Finding { share_of_mismatch: share, ..self.finding.clone() };
        (finding, self.region.clone().map(|region| Region { share, ..region }))
    }

    /// Entry of a simulation file.
    pub(crate) fn added(&self) -> Option<Added> {
        added(&self.source, &self.amplitudes)
    }
}
