//! The last fit, for a law whose own numbers were left out: what causes are made of (a share of the law's friction)
//! depends on those numbers, and the file that is written holds both.
//!
//! ```text
//! repeat: columns of the causes at the law's numbers -> law and causes fitted together -> the law's numbers
//! ```

use simulation::Simulation;

use crate::calibration::{moved, prior, room, way};
use crate::fit::bench::Bench;
use crate::fit::member::Member;
use crate::nominal::Nominal;
use crate::recording::side::Side;
use crate::search::found::{Found, amplitudes};

/// Most rounds.
const MOST_ROUNDS: usize = 40;

/// Change of the law's numbers, of their size, that ends it: whitened columns are kept in single precision.
const STILL: f64 = 1e-4;

/// The law's numbers, and the amplitudes of every member.
pub(crate) type Together = (Vec<f64>, Vec<Vec<f64>>);

/// What fits together. `None` where it does not come to rest.
pub(crate) fn together(
    simulation: &Simulation,
    nominal: &Nominal,
    side: &Side<'_>,
    training: &[bool],
    found: &Found<'_>,
) -> Result<Option<Together>, String> {
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
