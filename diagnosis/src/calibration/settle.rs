//! Where the law's numbers come to rest beside causes that were found.
//!
//! Two of its numbers may make up for one another, and a step that is right along a straight line is then far off along
//! the law: every step of Gauss and Newton is halved until it lowers what is left.

use crate::calibration::{moved, prior, way};
use crate::fit::bench::Bench;
use crate::fit::member::{Candidate, Member};
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::recording::side::Side;

/// Most steps, and most lengths that one is tried in.
const MOST_STEPS: usize = 8;
const MOST_TRIES: usize = 6;

/// Way of every number, relative, that ends it.
const ENOUGH: f64 = 2e-3;

/// All that stays as it is while the law moves.
pub(crate) struct Valley<'a> {
    pub(crate) nominal: &'a Nominal,
    pub(crate) side: &'a Side<'a>,
    pub(crate) rows: &'a Rows,
    pub(crate) training: &'a [bool],
    pub(crate) causes: Vec<&'a Candidate>,
}

/// Where the law comes to rest.
pub(crate) struct Bottom {
    pub(crate) values: Vec<f64>,
    /// Squared mismatch, whitened, that the causes leave there, with the price of moved numbers.
    pub(crate) left: f64,
}

/// What is known of one choice of the law's numbers.
struct Place {
    /// Squared mismatch that the causes leave there, with the price of moved numbers.
    left: f64,
    /// Step that leads to where nothing more is gained, as far as the law is straight.
    step: Vec<f64>,
}

impl Valley<'_> {
    /// The law's numbers, from `values` on and relative as those are; causes have whatever size is best there. A number
    /// that is said to have shifted is free.
    pub(crate) fn settled(&self, values: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.bottom(values)?.values)
    }

    /// The same, and what is left there.
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

    /// The lowest of the places that several choices of the numbers lead to: along a valley steps are short, and from
    /// elsewhere there may be a shorter way.
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

    /// What is left at some numbers, as in [`Bottom`].
    pub(crate) fn left(&self, values: &[f64]) -> Result<f64, String> {
        Ok(self.place(values)?.left)
    }

    /// Where a step, or what is left of it after a few halvings, lowers what is left.
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
