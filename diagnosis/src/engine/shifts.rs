//! The search around the law within its tolerance, or with its own parameters shifted beyond it.

use crate::calibration::unbound;
use crate::fit::rest::power;
use crate::noise::rows::Rows;
use crate::search::case::Case;
use crate::search::found::Found;
use crate::search::law_alone::law_alone;
use crate::search::passes;

/// Largest share of the squared mismatch beyond its tolerance that a law with shifted parameters may leave: a quarter
/// of the power is half of the amplitude, and a law that follows less than half of the mismatch does not follow it.
const MOST_LEFT: f64 = 0.25;

/// The same for a law that cannot be the whole explanation whatever its parameters: no search starts there.
const FAR_TOO_MUCH: f64 = 2.0 * MOST_LEFT;

/// Searches around the law with its parameters where calibration left them.
pub(super) fn searched<'s>(case: &Case<'s>, rows: &Rows, law_only: &[f64]) -> Result<Found<'s>, String> {
    let start = unbound(case.given.nominal, case.side, rows, case.training, law_only)?;
    let mut kept = None;
    if start == law_only {
        return passes::run(case, rows.clone(), law_only, law_only, &mut kept);
    }
    // shifted parameters are accepted only if nothing else is needed; otherwise they have imitated a missing cause
    let of_law_n2 = |values: &[f64]| Ok::<f64, String>(power(rows, &case.side.residual(case.given.nominal, values)?));
    let within_n2 = of_law_n2(law_only)?;
    let leaves =
        |share: f64, left_n2: f64, noise_n: f64| left_n2 - noise_n.powi(2) >= share * (within_n2 - noise_n.powi(2));
    let is_it = |found: &Found<'_>| Ok::<bool, String>(!leaves(MOST_LEFT, found.left_n(case)?.powi(2), found.noise_n));
    if !leaves(FAR_TOO_MUCH, of_law_n2(&start)?, case.noise_n(rows, &start)?) {
        let found = passes::run(case, rows.clone(), &start, law_only, &mut kept)?;
        if found.is_shift_only() && is_it(&found)? {
            if found.members.len() == 1 {
                return Ok(found);
            }
            let alone = law_alone(case, rows, &start, law_only, &mut kept)?;
            return Ok(alone.unwrap_or(found));
        }
    }
    let within = passes::run(case, rows.clone(), law_only, law_only, &mut kept)?;
    if !within.members.is_empty() && !within.is_shift_only() {
        return Ok(within);
    }
    match law_alone(case, rows, &start, law_only, &mut kept)? {
        Some(alone) if is_it(&alone)? => Ok(alone),
        _ => Ok(within),
    }
}
