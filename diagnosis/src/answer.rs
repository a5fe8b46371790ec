//! The diagnosis and the augmented simulation, written down from what was found.

use simulation::Simulation;
use simulation::mechanism::{Added, Id};

use crate::balance::{Aside, Balance};
use crate::bench::Member;
use crate::equivalents;
use crate::experiment;
use crate::export;
use crate::finding::{
    comes_and_goes, contamination, far_off, finding, quantisation, resonance, saturation, speed_noise,
};
use crate::found::Found;
use crate::locks::least_of;
use crate::nominal::Nominal;
use crate::refit;
use crate::region::region;
use crate::report::{DataQuality, Diagnosis, Finding, NextExperiment, Region, SCHEMA, Unexplained, Verdict};
use crate::rest::shares;
use crate::scores::Proof;
use crate::side::Side;
use crate::source::added;

/// Error on rows that were set aside, of that of the simulation as it was given, from which on a warning is due.
const WORSE: f64 = 1.1;

/// What is left, of the noise, from which a simulation that nothing was found beside does not match.
const FAR_OFF: f64 = 3.0;

/// Share of the mismatch, in square, that is left and not said to be noise-like.
const MORE_THAN_NOISE: f64 = 0.1;

/// Writes both.
#[expect(clippy::too_many_arguments, reason = "what was found, and where it is written down")]
pub(crate) fn write(
    simulation: &Simulation,
    nominal: &Nominal,
    side: &Side<'_>,
    training: &[bool],
    found: &Found<'_>,
    aside: &Aside<'_>,
    proof: Proof,
    quality: &mut DataQuality,
) -> Result<(Diagnosis, Simulation), String> {
    let balance = Balance::of(simulation, side, found, aside, &proof);
    let Aside { spots, speed, heard, play } = *aside;
    let amplitudes = found.amplitudes();
    let forces: Vec<Vec<f64>> = found
        .members
        .iter()
        .zip(&amplitudes)
        .map(|(member, amplitudes)| found.bench.force(&member.candidate.source, amplitudes))
        .collect();
    let shares = shares(&found.bench.rows, &found.bench.tangent, &forces, balance.explained());
    let variances = found.fit.variances();
    let mut findings: Vec<(Finding, Option<Region>)> = found
        .members
        .iter()
        .enumerate()
        .map(|(at, member)| {
            let mut finding = finding(nominal, found, &variances, at, &amplitudes[at], shares[at]);
            finding.carried_over = proof.carried[at];
            let region = region(side, training, &member.candidate.source, &forces[at], shares[at], &finding.id);
            (finding, region)
        })
        .collect();
    doubt_beside_unknown(&mut findings, balance.unsteady.unwrap_or(0.0));
    if let Some((spots, share)) = spots.zip(balance.spots) {
        findings.push((contamination(spots, share), None));
    } else if let Some(share) = balance.unsteady {
        findings.push((comes_and_goes(share), None));
    }
    let least_n = found.irrelevant_n.max(FAR_OFF * balance.noise_n);
    let is_far_off = found.members.is_empty() && balance.unexplained_n > least_n;
    findings.extend(is_far_off.then(|| (far_off(balance.unexplained), None)));
    let rounding = found.coarse_step_n.zip(balance.rounding);
    let clipped = side.limit_n.zip(balance.clipped);
    findings.extend(rounding.map(|(step, share)| (quantisation(step, share), None)));
    findings.extend(clipped.map(|(limit, share)| (saturation(limit, share), None)));
    let heard = heard.zip(balance.heard);
    if let Some((heard, share)) = heard {
        // too damped to ring where reversals strike it, and heard all the same: rolling strikes it harder
        let is_stand_in = |at: &usize| found.members[*at].candidate.source.is(Id::StructuralResonance);
        match (0..found.members.len()).find(is_stand_in) {
            Some(at) => findings[at].0 = resonance(heard, share + findings[at].0.share_of_mismatch),
            None => findings.push((resonance(heard, share), None)),
        }
    }
    let noisy = speed.zip(balance.speed);
    findings.extend(noisy.map(|(speed, share)| (speed_noise(speed.variance_m2_s2, share), None)));
    let play = play.zip(balance.play);
    findings.extend(play.map(|(play, share)| play.reported(share)));
    let next_experiment = next_experiment(nominal, side, found, &findings);
    findings.sort_by(|a, b| b.0.share_of_mismatch.total_cmp(&a.0.share_of_mismatch));
    let findings = with_one_unknown(findings);
    let (mechanisms, regions): (Vec<Finding>, Vec<Option<Region>>) = findings.into_iter().unzip();
    let mut written = (found.with_shifts.clone(), amplitudes);
    if nominal.is_incomplete() && !found.members.is_empty() {
        match refit::together(simulation, nominal, side, training, found)? {
            Some(both) => written = both,
            None => quality.warnings.push(
                "law and causes do not come to rest together: the augmented simulation is only near what was found"
                    .to_owned(),
            ),
        }
    }
    let mut augmented = augmented(nominal, &written.0, &found.members, &written.1, &mut quality.warnings);
    let mass_kg = simulation.axis.moved_mass_kg.unwrap_or(0.0);
    augmented.mechanisms.extend(noisy.map(|_| Added {
        id: Id::SpeedNoise,
        form: 1,
        shape: Vec::new(),
        amplitudes: vec![1.0, mass_kg],
    }));
    augmented.mechanisms.extend(heard.and_then(|(heard, _)| added(&heard.source, &heard.amplitudes)));
    augmented.mechanisms.extend(play.and_then(|(play, _)| play.added()));
    let shown = |id, shape: f64| Added { id, form: 0, shape: vec![shape], amplitudes: vec![1.0] };
    let noise_over_step = |(step, _): (f64, f64)| (balance.noise_n / step).clamp(0.02, 0.5);
    augmented.mechanisms.extend(rounding.map(|it| shown(Id::ForceQuantisation, noise_over_step(it))));
    augmented.mechanisms.extend(clipped.map(|(limit, _)| shown(Id::ForceSaturation, limit)));
    let held = &proof.holdout;
    let is_worse =
        held.improvement_ci95[1] < 0.0 || held.rmse_after_n > WORSE * held.rmse_before_n.min(held.rmse_calibrated_n);
    if !found.members.is_empty() && is_worse {
        let text = "what was found makes the error larger on the rows that were set aside: it does not carry over, and the \
                    augmented simulation is not to be used there";
        quality.warnings.push(text.to_owned());
    }
    let (taught, scored) = (found.bench.rows.decimation(), proof.averaged);
    if scored > taught {
        let text = format!(
            "the error is that of averages of {scored} rows and the noise that of {taught}: what changes faster than those \
             averages is not scored"
        );
        quality.warnings.push(text);
    }
    let signature = match mechanisms.is_empty() {
        true => "nothing beyond the noise",
        false if balance.unexplained > MORE_THAN_NOISE => {
            "more than noise is left, which no cause of the library follows"
        }
        false => "the rest is noise-like",
    };
    let diagnosis = Diagnosis {
        schema: SCHEMA,
        verdict: verdict(&mechanisms, balance.unexplained),
        // what a channel shows by itself is no matter of chance
        p_no_mismatch: if rounding.is_some() || clipped.is_some() || noisy.is_some() {
            0.0
        } else {
            let beside = [spots.map(|spots| spots.p), heard.map(|(heard, _)| heard.p), play.map(|(play, _)| play.p)];
            let p_far_off = if is_far_off { 0.0 } else { 1.0 };
            least_of([p_far_off, found.p_no_mismatch, balance.p_steady].into_iter().chain(beside.into_iter().flatten()))
        },
        noise_floor_n: balance.noise_n,
        holdout: proof.holdout,
        regions: regions.into_iter().flatten().collect(),
        unexplained: Unexplained {
            rmse_n: balance.unexplained_n,
            share_of_mismatch: balance.unexplained,
            signature: signature.to_owned(),
        },
        next_experiment,
        mechanisms,
        considered: found.considered.clone(),
        data_quality: std::mem::take(quality),
    };
    Ok((diagnosis, augmented))
}

/// Share of what has no name beside which nothing small is sure, and the share that is small there.
const MOSTLY_UNKNOWN: f64 = 0.5;
const SMALL_BESIDE: f64 = 0.15;

/// Takes small causes for a part of what has no name, where that is most of the mismatch. `more`: share without a name
/// beside the findings.
fn doubt_beside_unknown(findings: &mut [(Finding, Option<Region>)], more: f64) {
    let is_unknown = |finding: &Finding| finding.kind == "unknown";
    let unknown: f64 = findings.iter().filter(|(f, _)| is_unknown(f)).map(|(f, _)| f.share_of_mismatch).sum();
    if unknown + more < MOSTLY_UNKNOWN {
        return;
    }
    for (finding, _) in findings.iter_mut().filter(|(f, _)| !is_unknown(f) && f.share_of_mismatch < SMALL_BESIDE) {
        let statement = format!(
            "Something that the library has no name for; {} follows a small part of it and is kept in the augmented \
             simulation.",
            finding.id
        );
        *finding = Finding {
            id: "unknown".to_owned(),
            kind: "unknown",
            equivalents: Vec::new(),
            parameters: Vec::new(),
            statement,
            ..finding.clone()
        };
    }
}

/// All that has no name as one finding: the largest speaks for it.
fn with_one_unknown(findings: Vec<(Finding, Option<Region>)>) -> Vec<(Finding, Option<Region>)> {
    let mut written: Vec<(Finding, Option<Region>)> = Vec::new();
    for (finding, region) in findings {
        match written.iter_mut().find(|(other, _)| other.kind == "unknown" && finding.kind == "unknown") {
            Some((largest, _)) => largest.share_of_mismatch += finding.share_of_mismatch,
            None => written.push((finding, region)),
        }
    }
    written.sort_by(|a, b| b.0.share_of_mismatch.total_cmp(&a.0.share_of_mismatch));
    written
}

fn verdict(mechanisms: &[Finding], unexplained: f64) -> Verdict {
    let unknown: f64 = mechanisms.iter().filter(|f| f.kind == "unknown").map(|f| f.share_of_mismatch).sum();
    if mechanisms.is_empty() {
        Verdict::Match
    } else if unknown > 0.5 {
        Verdict::Unexplained
    } else if mechanisms.iter().any(|f| !f.equivalents.is_empty()) {
        Verdict::Ambiguous
    } else if unknown > 0.0 && unexplained + unknown > 0.5 {
        Verdict::Unexplained
    } else {
        Verdict::Explained
    }
}

/// The run that settles the largest finding that is open. `findings`: those of the members first, in their order.
fn next_experiment(
    nominal: &Nominal,
    side: &Side<'_>,
    found: &Found<'_>,
    findings: &[(Finding, Option<Region>)],
) -> Option<NextExperiment> {
    let open = |(finding, _): &(Finding, Option<Region>)| !finding.equivalents.is_empty();
    let largest = |best: usize, at: usize| {
        if findings[at].0.share_of_mismatch > findings[best].0.share_of_mismatch { at } else { best }
    };
    let code = match (0..findings.len()).filter(|at| open(&findings[*at])).reduce(largest) {
        Some(at) => {
            if at < found.members.len()
                && let Some(next) = experiment::next(nominal, side, found, at)
            {
                return Some(next);
            }
            let mut ids = findings[at].0.equivalents.clone();
            ids.insert(0, findings[at].0.id.clone());
            equivalents::advice(&ids)?
        }
        None if findings.iter().any(|(f, _)| f.kind == "unknown") => "repeat-later",
        None => return None,
    };
    Some(NextExperiment::advised(code, equivalents::text(code)))
}

/// The simulation with what was found; what a file cannot hold is said in the warnings.
fn augmented(
    nominal: &Nominal,
    values: &[f64],
    members: &[Member],
    amplitudes: &[Vec<f64>],
    warnings: &mut Vec<String>,
) -> Simulation {
    let complete = nominal.completed(values);
    let mut simulation = match export::calibrated(&complete, &nominal.factors(values)) {
        Ok(calibrated) => calibrated,
        Err(why) => {
            warnings.push(format!("the augmented simulation keeps the given parameters: {why}"));
            complete
        }
    };
    for (member, amplitudes) in members.iter().zip(amplitudes) {
        simulation.mechanisms.extend(added(&member.candidate.source, amplitudes));
    }
    simulation
}
