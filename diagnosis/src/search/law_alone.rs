//! The law alone, with as few of its own parameters off as are needed; or one cause that does as well as several of
//! them.
//!
//! ```text
//! L(free) = least squared whitened mismatch, plus the tolerance penalty of the parameters that are not free
//! a parameter is off where the law within tolerance cannot reach L, a further one where L falls by more than it costs
//! one cause replaces n parameters where L rises by less than n - 1 of them cost
//! ```
//!
//! Fitted along the law itself: far from the given values linearisation misleads, the more so the better two parameters
//! imitate one another.

use crate::calibration::settle::Bottom;
use crate::fit::bench::Bench;
use crate::fit::member::{Candidate, causes, without};
use crate::fit::pool::{Pool, Tolerances};
use crate::fit::rest::noise_rms;
use crate::fit::source::Source;
use crate::noise::rows::Rows;
use crate::numbers::statistics::rms;
use crate::search::adequacy::doubts;
use crate::search::case::{Case, Given};
use crate::search::equivalents::{Set, TIE, is_alike};
use crate::search::found::{Causes, Found};
use crate::search::passes::{Kept, Matters, prepared};

/// The result where the law alone, from `start` on, comes closer to the force than at `tolerated`, where its tolerance
/// ends; `None` where it does not, or where a cause is doubted.
pub(crate) fn law_alone<'s>(
    case: &Case<'s>,
    rows: &Rows,
    start: &[f64],
    tolerated: &[f64],
    kept: &mut Kept,
) -> Result<Option<Found<'s>>, String> {
    let Case { given: Given { nominal, .. }, side, .. } = *case;
    let bench = case.around(rows, start)?;
    let mut pool = prepared(case, rows, &bench, &Tolerances { nominal, moved: start }, kept);
    let price = 0.5 * bench.ln_rows() + (pool.kinds as f64).ln();
    let can_shift: Vec<usize> =
        (0..nominal.parameters.len()).filter(|at| nominal.parameters[*at].can_shift()).collect();
    let here = case.valley(rows, []).bottom(start)?;
    let left_n = |values: &[f64]| Ok::<f64, String>(rms(&rows.plain(&side.residual(nominal, values)?)));
    let beyond = 0.5 * (case.valley(rows, []).left(tolerated)? - here.left);
    if beyond < price || left_n(&here.values)? >= left_n(tolerated)? {
        return Ok(None);
    }
    let (free, here) = numbers_off(case, rows, &bench, &can_shift, here, price)?;
    if free.is_empty() {
        return Ok(None);
    }
    // twice the gain is the square of a standard normal variable
    let p = (libm::erfc(beyond.sqrt()) * can_shift.len() as f64).min(1.0);
    let off = Off { causes: &free, bottom: &here, p_no_mismatch: p };
    let mut found = off.found(case, rows, &mut pool, tolerated, None)?;
    if let Some(found) = &mut found {
        off.keep_rivals(case, rows, found)?;
    }
    if let Some(several) = &found
        && several.members.len() > 1
        && let Some((set, there)) = one_instead(case, rows, (several, &pool), &here, price)?
    {
        let one = set.candidates[..1].to_vec();
        let off = Off { causes: &one, bottom: &there, p_no_mismatch: p };
        found = off.found(case, rows, &mut pool, tolerated, Some(set))?.or(found);
    }
    *kept = Some((rows.clone(), pool));
    Ok(found)
}

/// The parameters that are off, the most telling first, and where the law settles with them free.
fn numbers_off(
    case: &Case<'_>,
    rows: &Rows,
    bench: &Bench<'_>,
    can_shift: &[usize],
    mut here: Bottom,
    price: f64,
) -> Result<(Vec<Candidate>, Bottom), String> {
    let given = case.given.nominal.start();
    let mut free: Vec<Candidate> = Vec::new();
    for _ in can_shift {
        let mut best: Option<(Bottom, Vec<Candidate>)> = None;
        for parameter in can_shift {
            let source = Source::Shift { parameter: *parameter };
            if free.iter().any(|other| other.source.is_kin(&source)) {
                continue;
            }
            let Some(candidate) = bench.candidate(source) else { continue };
            let mut with = free.clone();
            with.push(candidate);
            let there = case.valley(rows, &with).lowest(&here.values, &[&given])?;
            if best.as_ref().is_none_or(|(least, _)| there.left < least.left) {
                best = Some((there, with));
            }
        }
        let is_needed = |there: &Bottom| free.is_empty() || 0.5 * (here.left - there.left) > price;
        let Some((there, with)) = best.filter(|(there, _)| is_needed(there)) else { break };
        (here, free) = (there, with);
    }
    Ok((free, here))
}

/// Causes, and where the law has settled beside them.
struct Off<'a> {
    causes: &'a [Candidate],
    bottom: &'a Bottom,
    p_no_mismatch: f64,
}

impl Off<'_> {
    /// The result for these causes, with the rivals of the only one if already known; `None` where a cause is doubted.
    fn found<'s>(
        &self,
        case: &Case<'s>,
        rows: &Rows,
        pool: &mut Pool,
        tolerated: &[f64],
        set: Option<Set>,
    ) -> Result<Option<Found<'s>>, String> {
        let Case { given: Given { nominal, .. }, side, saturation, .. } = *case;
        let values = self.bottom.values.clone();
        let (mismatch, tangent) = (side.residual(nominal, &values)?, side.tangent(nominal, &values)?);
        let mut bench = case.around(rows, &values)?;
        let mut members = Vec::with_capacity(self.causes.len());
        let mut extra = Vec::new();
        for candidate in bench.candidates(self.causes.iter().map(|cause| cause.source.clone())) {
            extra.extend(bench.raw(&candidate.source).unwrap_or_default());
            members.push(bench.take(candidate));
        }
        let doubts = doubts(&bench, &bench.fit_members(&members), &members);
        if doubts.iter().any(Option::is_some) {
            return Ok(None);
        }
        let left = saturation.rest(rows, &side.contexts, &mismatch, &tangent, &extra);
        let noise_n = noise_rms(rows, &left, &mismatch);
        let causes = Causes {
            bench,
            members,
            doubts,
            values,
            has_landed: true,
            p_no_mismatch: self.p_no_mismatch,
            noise_n,
            irrelevant_n: Matters::of(case, rows, &mismatch)?.irrelevant_n(),
            left,
            coarse_step_n: case.coarse_step_n(rows, noise_n),
            sets: set.map(|set| vec![set]),
        };
        causes.found(case, pool, tolerated).map(Some)
    }

    /// Drops rivals that do not tie along the law itself: what is equivalent to a cause in the linearised law need not
    /// be so there.
    fn keep_rivals(&self, case: &Case<'_>, rows: &Rows, found: &mut Found<'_>) -> Result<(), String> {
        let start = case.given.nominal.start();
        for at in 0..found.members.len() {
            let own = found.members[at].candidate.source.clone();
            let others = without(&found.members, at);
            let mut rivals = Vec::new();
            for rival in std::mem::take(&mut found.sets[at].candidates) {
                let is_one = rival.source.is_kin(&own) || {
                    let valley = case.valley(rows, causes(&others).chain([&rival]));
                    0.5 * (valley.lowest(&found.with_shifts, &[&start])?.left - self.bottom.left) < TIE
                };
                rivals.extend(is_one.then_some(rival));
            }
            found.sets[at].candidates = rivals;
        }
        Ok(())
    }
}

/// Causes each of which explains what several parameters of the law do together at a lower cost, and where the law
/// settles beside the first. They come from the rivals of each parameter and from causes alike to one of those; kept
/// are those tied with the best.
fn one_instead(
    case: &Case<'_>,
    rows: &Rows,
    (several, pool): (&Found<'_>, &Pool),
    bottom: &Bottom,
    price: f64,
) -> Result<Option<(Set, Bottom)>, String> {
    let given = case.given.nominal.start();
    let saved = price * (several.members.len() - 1) as f64;
    let mut singles: Vec<(Candidate, Bottom)> = Vec::new();
    let rivals: Vec<&Candidate> = several.sets.iter().flat_map(|set| &set.candidates).collect();
    let alike = pool.causes.iter().filter(|cause| rivals.iter().any(|rival| is_alike(cause, rival)));
    for one in rivals.iter().copied().chain(alike) {
        if singles.iter().any(|(other, _)| other.source.is_kin(&one.source)) {
            continue;
        }
        let there = case.valley(rows, [one]).lowest(&given, &[&several.with_shifts])?;
        if 0.5 * (there.left - bottom.left) < saved {
            singles.push((one.clone(), there));
        }
    }
    let least = singles.iter().map(|(_, there)| there.left).fold(f64::INFINITY, f64::min);
    singles.retain(|(_, there)| 0.5 * (there.left - least) < TIE);
    singles.sort_by_key(|(one, _)| one.source.simplicity());
    let (candidates, mut bottoms): (Vec<Candidate>, Vec<Bottom>) = singles.into_iter().unzip();
    Ok((!bottoms.is_empty()).then(|| (Set { candidates, confidence: Set::CONFIDENCE }, bottoms.swap_remove(0))))
}
