//! Scoring: diagnosis against truth.
//!
//! ```text
//! truth.json, diagnosis -> outcome     right, missed, false alarm, wrong name, ...
//!                       -> location    axis and stretch of the largest place
//!                       -> coverage    intervals of numbers that mean the same on both sides
//!                       -> holdout     error removed, of what an oracle removes
//! all records           -> tally       sums, detection curve, reliability -> goals
//! ```

pub mod answer;
pub mod coverage;
pub mod goals;
pub mod holdout;
pub mod location;
pub mod outcome;
pub mod tally;
pub mod truth;

use std::path::Path;

use serde::Serialize;

use self::answer::{Diagnosis, Named};
use self::coverage::Covered;
use self::location::Located;
pub use self::outcome::{Outcome, VISIBLE};
use self::truth::Truth;
use super::runner::{Ending, Run};
use super::{TrialError, json, malformed};

/// One record, scored.
#[derive(Clone, Debug, Serialize)]
pub struct Scored {
    /// Name of the record.
    pub id: String,
    /// Block of the composition.
    pub block: String,
    /// How the machine was moved and logged, where the generator says it.
    pub manner: String,
    /// What became of it.
    pub outcome: Outcome,
    /// What was hidden.
    pub hidden: Vec<String>,
    /// What was named.
    pub named: Vec<String>,
    /// Verdict; the ending where there is none.
    pub verdict: String,
    /// Law of the noise.
    pub noise: String,
    /// Strength of the first hidden effect, %; 0 where nothing is hidden.
    pub strength_pct: f64,
    /// Score of the ideal analyser for it.
    pub ideal_z: f64,
    /// Whether any mismatch was reported.
    pub is_detected: bool,
    /// Stated probability and whether it was so, entry by entry.
    pub confidences: Vec<(f64, bool)>,
    /// Sizes of the sets that hold a true id.
    pub set_sizes: Vec<usize>,
    /// Whether the padding of a set merely resembles what was hidden.
    pub is_padded_with_near: bool,
    /// The largest stated place.
    pub location: Option<Located>,
    /// Stated intervals of comparable numbers.
    pub intervals: Vec<Covered>,
    /// Error of an oracle on the hold-out, N.
    pub oracle_n: Option<f64>,
    /// Squared hold-out error removed over what the oracle removes.
    pub holdout_gain: Option<f64>,
    /// Whether the run asked for is the one that decides; only where the design cannot.
    pub is_next_run_right: Option<bool>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

/// Scores a run.
///
/// # Errors
/// [`TrialError::File`] or [`TrialError::Malformed`] where an answer cannot be read; an unreadable diagnosis is no
/// error but a wrong answer.
pub fn score(folder: &Path, results: &Path, run: &Run) -> Result<Vec<Scored>, TrialError> {
    let trial = json(&folder.join("answers/trial.json"))?;
    let mut all = Vec::new();
    for (id, ending) in &run.records {
        let truth = truth_of(folder, id)?;
        let block = trial["blocks"][id].as_str().unwrap_or("?").to_owned();
        let diagnosis = diagnosis_of(&results.join(format!("{id}.json")), ending);
        let mut scored = one(id, block, &truth, diagnosis.as_ref(), ending);
        if let Some(holdout) = diagnosis.as_ref().and_then(|said| said.holdout.as_ref()) {
            scored.oracle_n = holdout::oracle(folder, id, &truth, holdout)?;
            scored.holdout_gain = scored.oracle_n.and_then(|oracle_n| holdout::gain(holdout, oracle_n));
        }
        all.push(scored);
    }
    Ok(all)
}

/// What was hidden in a record.
///
/// # Errors
/// [`TrialError::File`] or [`TrialError::Malformed`].
pub fn truth_of(folder: &Path, id: &str) -> Result<Truth, TrialError> {
    let path = folder.join("answers").join(format!("{id}.truth.json"));
    serde_json::from_value(json(&path)?).map_err(|why| malformed(&path, why))
}

/// The diagnosis of a record; `None` after a crash or a time-out, and where nothing readable was written.
pub fn diagnosis_of(path: &Path, ending: &Ending) -> Option<Diagnosis> {
    if !ending.status.starts_with("exit") {
        return None;
    }
    let read = json(path).ok().and_then(|value| serde_json::from_value(value).ok());
    // a file that cannot be used at all may end without a report
    let refused = || Diagnosis { verdict: "insufficient-data".to_owned(), ..Diagnosis::default() };
    read.or_else(|| (ending.status == "exit 3").then(refused))
}

fn one(id: &str, block: String, truth: &Truth, diagnosis: Option<&Diagnosis>, ending: &Ending) -> Scored {
    let said = diagnosis.cloned().unwrap_or_default();
    let is_held = |entry: &Named| match entry.is_unknown() {
        true => truth.kind == "unknown",
        false => truth.effects.iter().any(|effect| entry.holds(effect)),
    };
    let held = || said.mechanisms.iter().filter(|entry| !entry.is_unknown() && is_held(entry));
    let is_near = |entry: &Named| {
        let near = |id: &&str| truth.effects.iter().any(|e| e.allowed().contains(id) || e.near.iter().any(|n| n == id));
        entry.set().iter().all(near)
    };
    let name =
        |entry: &Named| std::iter::once(&entry.id).chain(&entry.equivalents).cloned().collect::<Vec<_>>().join(" or ");
    let outcome = outcome::outcome(truth, diagnosis);
    Scored {
        id: id.to_owned(),
        block,
        manner: truth.manner.clone(),
        outcome,
        hidden: truth.effects.iter().map(|e| format!("{} {:.2} %", e.id, e.strength_alone_pct)).collect(),
        named: said.mechanisms.iter().map(name).collect(),
        verdict: if said.verdict.is_empty() { ending.status.clone() } else { said.verdict.clone() },
        noise: truth.noise.law.clone(),
        strength_pct: truth.effects.first().map_or(0.0, |e| e.strength_alone_pct),
        ideal_z: truth.effects.first().map_or(0.0, |e| e.ideal_z),
        is_detected: matches!(said.verdict.as_str(), "explained" | "unexplained" | "ambiguous"),
        confidences: said.mechanisms.iter().map(|entry| (entry.confidence, is_held(entry))).collect(),
        set_sizes: held().map(|entry| entry.set().len()).collect(),
        is_padded_with_near: outcome == Outcome::Padded && held().all(is_near),
        location: location::locate(&truth.effects, &said.places),
        intervals: coverage::coverage(truth, &said.mechanisms),
        oracle_n: None,
        holdout_gain: None,
        is_next_run_right: truth
            .next_experiment
            .as_ref()
            .map(|wanted| said.next_experiment.as_ref().is_some_and(|next| next.code == *wanted)),
        seconds: ending.seconds,
    }
}
