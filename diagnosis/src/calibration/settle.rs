//! Settling: the law's parameters that fit best beside given causes.
//!
//! Two parameters may compensate one another, and a step that is right in the linearised law is then far off along the
//! law itself: every Gauss-Newton step is halved until it lowers the residual.

use crate::calibration::{moved, prior, way};
use crate::fit::bench::Bench;
use crate::fit::member::{Candidate, Member};
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::recording::side::Side;

/// Most steps, and most halvings of each.
const MOST_STEPS: usize = 8;
const MOST_TRIES: usize = 6;

/// Largest relative change of a parameter below which iteration ends.
const ENOUGH: f64 = 2e-3;

/// All that is fixed while the law moves.
pub(crate) struct Valley<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) side: &'a Side<'a>,
    pub(crate) rows: &'a Rows,
    pub(crate) training: &'a [bool],
    pub(crate) causes: Vec<&'a Candidate>,
}

/// Where the law settles.
pub(crate) struct Bottom {
    pub(crate) values: Vec<f64>,
    /// Squared whitened residual beside the causes, plus the tolerance penalty of moved parameters.
    pub(crate) left: f64,
}

/// Evaluation of one set of the law's parameters.
struct Place {
    /// Squared residual beside the causes, plus the tolerance penalty of moved parameters.
    left: f64,
    /// Gauss-Newton step to the minimum of the linearised law.
    step: Vec<f64>,
}

impl Valley<'_> {
    /// The law's parameters where it settles, starting from `values` (both relative); causes have their best amplitudes
    /// there. A parameter that is among the causes as a shift is free of its tolerance.
    pub(crate) fn settled(&self, values: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.bottom(values)?.values)
    }

    /// The same, with the residual there.
    pub(crate) fn bottom(&self, values: &[f64]) -> Result<Bottom, String> {
        let mut values = values.to_vec();
        let mut here = self.place(&values)?;
        for _ in 0..MOST_STEPS {
            let Some((there, place)) = self.lower(&values, &here)? else { break };
            let way = way(&values, &there);
            (values, here) = (there, place);
            if way < ENOUGH {
                break;
            }
        }
        Ok(Bottom { values, left: here.left })
    }

    /// The lowest place reached from several starting values: along a valley steps are short, and from elsewhere the
    /// way may be shorter.
    pub(crate) fn lowest(&self, first: &[f64], others: &[&[f64]]) -> Result<Bottom, String> {
        let mut lowest = self.bottom(first)?;
        for start in others {
            let there = self.bottom(start)?;
            if there.left < lowest.left {
                lowest = there;
            }
        }
        Ok(lowest)
    }

    /// The residual at given parameters, as in [`Bottom`].
    pub(crate) fn left(&self, values: &[f64]) -> Result<f64, String> {
        Ok(self.place(values)?.left)
    }

    /// A place where the step, halved if necessary, lowers the residual.
    fn lower(&self, values: &[f64], here: &Place) -> Result<Option<(Vec<f64>, Place)>, String> {
        let mut step = here.step.clone();
        for _ in 0..MOST_TRIES {
            let there = moved(self.nominal, values, &step);
            let place = self.place(&there)?;
            if place.left < here.left {
                return Ok(Some((there, place)));
            }
            step.iter_mut().for_each(|step| *step *= 0.5);
        }
        Ok(None)
    }

    fn place(&self, values: &[f64]) -> Result<Place, String> {
        let Valley { nominal, side, rows, training, causes } = self;
        let mut prior = prior(nominal, values);
        let mut beside = Vec::new();
        for cause in causes {
            match cause.source {
                Source::Shift { parameter } => prior[parameter] = (0.0, 0.0),
                _ => beside.push((*cause).clone()),
            }
        }
        let price: f64 = prior.iter().zip(values).map(|((precision, _), value)| precision * value * value).sum();
        let (mismatch, tangent) = (side.residual(nominal, values)?, side.tangent(nominal, values)?);
        let mut bench = Bench::new((*rows).clone(), &[], training.to_vec(), &mismatch, tangent, prior);
        let beside: Vec<Member> = beside.into_iter().map(|cause| bench.take(cause)).collect();
        let fit = bench.fit_members(&beside);
        let law = bench.law();
        let step = law.iter().map(|column| fit.value_of(*column)).collect();
        let of_causes: Vec<usize> = fit.active.iter().copied().filter(|column| !law.contains(column)).collect();
        Ok(Place { left: bench.fit(&of_causes).rss + price, step })
    }
}
