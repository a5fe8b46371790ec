//! The law with as few of its own numbers off as it takes, and nothing beside it.
//!
//! ```text
//! L(free) = least squared mismatch, whitened, with the price of the numbers that are not free
//! a number is off where the tolerance of all ends before L does, and a further one where L falls by more than it costs
//! ```
//!
//! Along the law itself: far from where it was given, straight lines mislead, the more the better two numbers imitate one
//! another.

use crate::calibration::settle::Bottom;
use crate::fit::bench::{Candidate, causes, without};
use crate::fit::pool::Tolerances;
use crate::fit::rest::noise_rms;
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::numbers::statistics::rms;
use crate::search::adequacy::doubts;
use crate::search::case::{Case, Given};
use crate::search::equivalents::TIE;
use crate::search::found::{Causes, Found};
use crate::search::passes::{Kept, irrelevant_n, prepared};

/// What is found where the law alone, from `start` on, comes nearer to the force than at `tolerated`, where its tolerance
/// ends; `None` where it does not, or where its numbers would have to be others here than there.
pub(crate) fn law_alone<'s>(
    case: &Case<'s>,
    rows: &Rows,
    start: &[f64],
    tolerated: &[f64],
    kept: &mut Kept,
) -> Result<Option<Found<'s>>, String> {
    let Case { given: Given { nominal, .. }, side, saturation, .. } = *case;
    let bench = case.around(rows, start)?;
    let mut pool = prepared(case, rows, &bench, &Tolerances { nominal, moved: start }, kept);
    let price = 0.5 * bench.ln_rows() + (pool.kinds as f64).ln();
    let can_shift: Vec<usize> =
        (0..nominal.parameters.len()).filter(|at| nominal.parameters[*at].can_shift()).collect();
    let mut free: Vec<Candidate> = Vec::new();
    let mut here = case.valley(rows, &free).bottom(start)?;
    let left_n = |values: &[f64]| Ok::<f64, String>(rms(&rows.plain(&side.residual(nominal, values)?)));
    let beyond = 0.5 * (case.valley(rows, &free).left(tolerated)? - here.left);
    if beyond < price || left_n(&here.values)? >= left_n(tolerated)? {
        return Ok(None);
    }
    for _ in &can_shift {
        let mut best: Option<(Bottom, Vec<Candidate>)> = None;
        for parameter in &can_shift {
            let source = Source::Shift { parameter: *parameter };
            if free.iter().any(|other| other.source.is_kin(&source)) {
                continue;
            }
            let Some(candidate) = bench.candidate(source) else { continue };
            let mut with = free.clone();
            with.push(candidate);
            let there = case.valley(rows, &with).lowest(&here.values, &[&nominal.start()])?;
            if best.as_ref().is_none_or(|(least, _)| there.left < least.left) {
                best = Some((there, with));
            }
        }
        let is_needed = |there: &Bottom| free.is_empty() || 0.5 * (here.left - there.left) > price;
        let Some((there, with)) = best.filter(|(there, _)| is_needed(there)) else { break };
        (here, free) = (there, with);
    }
    if free.is_empty() {
        return Ok(None);
    }
    let (mismatch, tangent) = (side.residual(nominal, &here.values)?, side.tangent(nominal, &here.values)?);
    let left = saturation.rest(rows, &side.contexts, &mismatch, &tangent, &[]);
    let noise_n = noise_rms(rows, &left);
    let values = here.values.clone();
    let mut bench = case.around(rows, &values)?;
    let mut members = Vec::with_capacity(free.len());
    for candidate in bench.candidates(free.into_iter().map(|shift| shift.source)) {
        members.push(bench.take(candidate));
    }
    let doubts = doubts(&bench, &bench.fit_members(&members), &members);
    if doubts.iter().any(Option::is_some) {
        return Ok(None);
    }
    let mut found = Causes {
        bench,
        members,
        doubts,
        values,
        has_landed: true,
        // twice the gain is the square of a standard normal number
        p_no_mismatch: (libm::erfc(beyond.sqrt()) * can_shift.len() as f64).min(1.0),
        noise_n,
        irrelevant_n: irrelevant_n(case, rows, &mismatch)?,
        left,
        coarse_step_n: case.coarse_step_n(noise_n),
    }
    .found(case, &mut pool, tolerated)?;
    // what stands for the shift along a straight line need not do so along the law
    for at in 0..found.members.len() {
        let shift = found.members[at].candidate.source.clone();
        let others = without(&found.members, at);
        let mut rivals = Vec::new();
        for rival in std::mem::take(&mut found.sets[at].candidates) {
            let is_one = rival.source.is_kin(&shift) || {
                let valley = case.valley(rows, causes(&others).chain([&rival]));
                0.5 * (valley.bottom(&found.with_shifts)?.left - here.left) < TIE
            };
            rivals.extend(is_one.then_some(rival));
        }
        found.sets[at].candidates = rivals;
    }
    *kept = Some((rows.clone(), pool));
    Ok(Some(found))
}
