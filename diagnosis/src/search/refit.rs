//! The final fit for a law whose own parameters were left out of the simulation: the forms of causes (a share of the
//! law's friction) depend on those parameters, and the file written holds both.
//!
//! ```text
//! repeat: columns of the causes at the law's parameters -> joint fit of law and causes -> the law's parameters
//! ```

use crate::calibration::{moved, prior, room, way};
use crate::fit::bench::Bench;
use crate::fit::member::Member;
use crate::search::case::{Case, Given};
use crate::search::found::{Found, amplitudes};

/// Most iterations.
const MOST_ROUNDS: usize = 40;

/// Relative change of the law's parameters at which iteration ends: whitened columns have single precision.
const STILL: f64 = 1e-4;

/// The law's parameters, and the amplitudes of every member.
pub(crate) type Together = (Vec<f64>, Vec<Vec<f64>>);

/// The joint fit; `None` where it does not converge.
pub(crate) fn together(case: &Case<'_>, found: &Found<'_>) -> Result<Option<Together>, String> {
    let Case { given: Given { simulation, nominal, .. }, side, training, .. } = *case;
    let mut values = found.with_shifts.clone();
    for _ in 0..MOST_ROUNDS {
        let again = side.again(simulation, nominal, &values)?;
        let mismatch = again.residual(nominal, &values)?;
        let tangent = again.tangent(nominal, &values)?;
        let rows = found.bench.rows.clone();
        let mut bench =
            Bench::new(rows, &again.contexts, training.to_vec(), &mismatch, tangent, prior(nominal, &values))
                .within(room(nominal, &values));
        let mut members: Vec<Member> = Vec::with_capacity(found.members.len());
        for member in &found.members {
            let Some(candidate) = bench.candidate(member.candidate.source.clone()) else { return Ok(None) };
            members.push(bench.take(candidate));
        }
        let fit = bench.fit_members(&members);
        let next = moved(nominal, &values, &fit.values[..values.len()]);
        let size = next.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let way = way(&values, &next);
        values = next;
        if way <= STILL * size {
            return Ok(Some((values, amplitudes(&members, &fit))));
        }
    }
    Ok(None)
}
