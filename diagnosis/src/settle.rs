//! Where the law's numbers come to rest beside causes that were found.
//!
//! Two of its numbers may make up for one another, and a step that is right along a straight line is then far off along
//! the law: every step of Gauss and Newton is halved until it lowers what is left.

use crate::bench::{Bench, Member, Source};
use crate::calibration::{moved, prior};
use crate::nominal::Nominal;
use crate::rows::Rows;
use crate::side::Side;

/// Most steps, and most times that one is halved.
const MOST_STEPS: usize = 5;
const MOST_HALVINGS: usize = 6;

/// Way of every number, relative, that ends it.
const ENOUGH: f64 = 2e-3;

/// The law's numbers from `values` on, whatever its causes' sizes are there. A number that is said to have shifted is free.
pub(crate) fn settled(
    nominal: &Nominal,
    side: &Side<'_>,
    rows: &Rows,
    training: &[bool],
    members: &[Member],
    values: &[f64],
) -> Result<Vec<f64>, String> {
    let at = |values: &[f64]| Place::of(nominal, side, rows, training, members, values);
    let mut values = values.to_vec();
    let mut here = at(&values)?;
    for _ in 0..MOST_STEPS {
        let mut next = None;
        for halvings in 0..MOST_HALVINGS {
            let part = 0.5f64.powi(halvings as i32);
            let step: Vec<f64> = here.step.iter().map(|step| part * step).collect();
            let there = moved(nominal, &values, &step);
            let place = at(&there)?;
            if place.left < here.left {
                next = Some((there, place));
                break;
            }
        }
        let Some((there, place)) = next else { break };
        let way = there.iter().zip(&values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        (values, here) = (there, place);
        if way < ENOUGH {
            break;
        }
    }
    Ok(values)
}

/// What is known of one choice of the law's numbers.
struct Place {
    /// Squared mismatch that the causes leave there, with the price of moved numbers.
    left: f64,
    /// Step that leads to where nothing more is gained, as far as the law is straight.
    step: Vec<f64>,
}

impl Place {
    fn of(
        nominal: &Nominal,
        side: &Side<'_>,
        rows: &Rows,
        training: &[bool],
        members: &[Member],
        values: &[f64],
    ) -> Result<Self, String> {
        let mut prior = prior(nominal, values);
        let mut causes = Vec::new();
        for member in members {
            match member.candidate.source {
                Source::Shift { parameter } => prior[parameter] = (0.0, 0.0),
                _ => causes.push(member.candidate.clone()),
            }
        }
        let price: f64 = prior.iter().zip(values).map(|((precision, _), value)| precision * value * value).sum();
        let (mismatch, tangent) = (side.residual(nominal, values)?, side.tangent(nominal, values)?);
        let mut bench = Bench::new(rows.clone(), &[], training.to_vec(), &mismatch, tangent, prior);
        let causes: Vec<Member> = causes.into_iter().map(|cause| bench.take(cause)).collect();
        let fit = bench.fit_members(&causes);
        let law = bench.law();
        let step = law.iter().map(|column| fit.value_of(*column)).collect();
        let of_causes: Vec<usize> = fit.active.iter().copied().filter(|column| !law.contains(column)).collect();
        Ok(Place { left: bench.fit(&of_causes).rss + price, step })
    }
}
