//! Scoring: what was hidden against what was said.
//!
//! An entry of the diagnosis is right where the true id, or one that the answer allows instead, is among the entry's id
//! and its equivalents. Anything else that is named is a wrong name. An effect that nobody names is a miss, unless
//! it was too weak for the ideal analyser too (`ideal_z` below [`VISIBLE`]). A crash, a time-out and a diagnosis that
//! cannot be read are wrong answers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::runner::{Ending, Run};
use super::{TrialError, json};

/// Score of the ideal analyser, in standard deviations, below which an effect cannot be seen.
pub const VISIBLE: f64 = 4.0;

/// What became of one record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Everything hidden was named, nothing else.
    Right,
    /// Nothing was said, and nothing could have been.
    RightlySilent,
    /// True names only, but some visible effect is missing, or a set of equivalents is incomplete.
    Partly,
    /// Nothing was named although something could be seen.
    Missed,
    /// A mismatch was reported where there is none.
    FalseAlarm,
    /// Something false was named.
    WrongName,
    /// A mismatch that has a name was reported without one.
    Unnamed,
    /// Crash, time-out, no readable diagnosis.
    NoAnswer,
}

impl Outcome {
    /// Whether it counts as correct.
    pub fn is_right(self) -> bool {
        matches!(self, Outcome::Right | Outcome::RightlySilent)
    }

    /// As written on the page.
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Right => "right",
            Outcome::RightlySilent => "rightly silent",
            Outcome::Partly => "partly",
            Outcome::Missed => "missed",
            Outcome::FalseAlarm => "false alarm",
            Outcome::WrongName => "wrong name",
            Outcome::Unnamed => "unnamed",
            Outcome::NoAnswer => "no answer",
        }
    }
}

/// One effect of an answer.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Effect {
    /// Its id.
    pub id: String,
    /// Ids that the recording cannot tell from it.
    #[serde(default)]
    pub equivalents: Vec<String>,
    /// Ids that the contract accepts instead.
    #[serde(default)]
    pub also_allowed: Vec<String>,
    /// RMS of what it adds, % of the drag's RMS.
    #[serde(default)]
    pub strength_alone_pct: f64,
    /// Score of the ideal analyser.
    #[serde(default)]
    pub ideal_z: f64,
}

/// What was hidden in a record; the fields of `truth.json` that scoring needs.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Truth {
    /// Kind of case.
    pub kind: String,
    /// Hidden effects.
    pub effects: Vec<Effect>,
    /// Verdict of a perfect analyser.
    pub expected_verdict: String,
    /// Noise of the force.
    #[serde(default)]
    pub noise: Noise,
}

/// Noise of the force.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Noise {
    /// Its law.
    pub law: String,
}

/// One entry of a diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Named {
    /// Its id.
    pub id: String,
    /// `physics`, `sensor`, `parameter` or `unknown`.
    #[serde(default)]
    pub kind: String,
    /// Stated probability.
    #[serde(default)]
    pub confidence: f64,
    /// What cannot be told from it.
    #[serde(default)]
    pub equivalents: Vec<String>,
}

impl Named {
    fn is_unknown(&self) -> bool {
        self.kind == "unknown" || self.id == "unknown"
    }

    fn set(&self) -> BTreeSet<&str> {
        std::iter::once(&self.id).chain(&self.equivalents).map(String::as_str).collect()
    }

    /// Whether the entry holds this effect.
    pub fn holds(&self, effect: &Effect) -> bool {
        let set = self.set();
        set.contains(effect.id.as_str()) || effect.also_allowed.iter().any(|id| set.contains(id.as_str()))
    }
}

/// The part of a diagnosis that is scored.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: String,
    /// What was named.
    #[serde(default)]
    pub mechanisms: Vec<Named>,
}

/// One record, scored.
#[derive(Clone, Debug, Serialize)]
pub struct Scored {
    /// Name of the record.
    pub id: String,
    /// Block of the composition.
    pub block: String,
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
    /// Stated probability and whether it was so, entry by entry.
    pub confidences: Vec<(f64, bool)>,
    /// Squared hold-out error removed over what an oracle removes; only where the diagnosis states both errors.
    pub holdout_gain: Option<f64>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

/// Scores one record. `diagnosis` is `None` after a crash, a time-out, or where nothing readable was written.
pub fn outcome(truth: &Truth, diagnosis: Option<&Diagnosis>) -> Outcome {
    let Some(diagnosis) = diagnosis else { return Outcome::NoAnswer };
    let (unknown, named): (Vec<_>, Vec<_>) = diagnosis.mechanisms.iter().partition(|entry| entry.is_unknown());
    if truth.expected_verdict == "insufficient-data" {
        return match (diagnosis.verdict.as_str(), named.is_empty()) {
            ("insufficient-data", _) => Outcome::Right,
            (_, false) => Outcome::WrongName,
            _ => Outcome::Missed,
        };
    }
    if truth.effects.is_empty() {
        return match diagnosis.verdict.as_str() {
            _ if !diagnosis.mechanisms.is_empty() => Outcome::FalseAlarm,
            "match" => Outcome::Right,
            "insufficient-data" => Outcome::Missed,
            _ => Outcome::FalseAlarm,
        };
    }
    if truth.kind == "unknown" {
        return match (named.is_empty(), unknown.is_empty()) {
            (false, _) => Outcome::WrongName,
            (true, false) => Outcome::Right,
            (true, true) if truth.effects.iter().all(|e| e.ideal_z < VISIBLE) => Outcome::RightlySilent,
            (true, true) => Outcome::Missed,
        };
    }
    if named.iter().any(|entry| !truth.effects.iter().any(|effect| entry.holds(effect))) {
        return Outcome::WrongName;
    }
    let visible: Vec<_> = truth.effects.iter().filter(|effect| effect.ideal_z >= VISIBLE).collect();
    let found = |effect: &Effect| named.iter().any(|entry| entry.holds(effect));
    let is_complete = |effect: &Effect| {
        named.iter().filter(|entry| entry.holds(effect)).any(|entry| {
            let set = entry.set();
            // a set is only asked for where the design was made so that nobody can decide
            truth.kind != "undecidable" || effect.equivalents.iter().all(|id| set.contains(id.as_str()))
        })
    };
    match (named.is_empty(), unknown.is_empty()) {
        (true, false) => Outcome::Unnamed,
        (true, true) if visible.is_empty() => Outcome::RightlySilent,
        (true, true) => Outcome::Missed,
        _ if visible.iter().all(|effect| found(effect) && is_complete(effect)) => Outcome::Right,
        _ => Outcome::Partly,
    }
}

/// Scores a run.
///
/// # Errors
/// [`TrialError::File`] or [`TrialError::Malformed`] where an answer cannot be read; an unreadable diagnosis is no
/// error but a wrong answer.
pub fn score(folder: &Path, results: &Path, run: &Run) -> Result<Vec<Scored>, TrialError> {
    let answers = folder.join("answers");
    let trial = json(&answers.join("trial.json"))?;
    let mut all = Vec::new();
    for (id, ending) in &run.records {
        let path = answers.join(format!("{id}.truth.json"));
        let truth: Truth = serde_json::from_value(json(&path)?).map_err(|why| super::malformed(&path, why))?;
        let block = trial["blocks"][id].as_str().unwrap_or("?").to_owned();
        all.push(one(id, block, &truth, ending, &results.join(format!("{id}.json"))));
    }
    Ok(all)
}

fn one(id: &str, block: String, truth: &Truth, ending: &Ending, path: &Path) -> Scored {
    let has_ended = ending.status.starts_with("exit");
    let raw = json(path).ok().filter(|_| has_ended);
    let mut diagnosis: Option<Diagnosis> = raw.clone().and_then(|value| serde_json::from_value(value).ok());
    if diagnosis.is_none() && ending.status == "exit 3" {
        diagnosis = Some(Diagnosis { verdict: "insufficient-data".to_owned(), mechanisms: Vec::new() });
    }
    let said = diagnosis.clone().unwrap_or_default();
    let confidences = said.mechanisms.iter().filter(|entry| !entry.is_unknown());
    let confidences =
        confidences.map(|entry| (entry.confidence, truth.effects.iter().any(|e| entry.holds(e)))).collect();
    let name =
        |entry: &Named| std::iter::once(&entry.id).chain(&entry.equivalents).cloned().collect::<Vec<_>>().join(" or ");
    Scored {
        id: id.to_owned(),
        block,
        outcome: outcome(truth, diagnosis.as_ref()),
        hidden: truth.effects.iter().map(|e| format!("{} {:.2} %", e.id, e.strength_alone_pct)).collect(),
        named: said.mechanisms.iter().map(name).collect(),
        verdict: if said.verdict.is_empty() { ending.status.clone() } else { said.verdict },
        noise: truth.noise.law.clone(),
        strength_pct: truth.effects.first().map_or(0.0, |e| e.strength_alone_pct),
        ideal_z: truth.effects.first().map_or(0.0, |e| e.ideal_z),
        confidences,
        holdout_gain: raw.as_ref().and_then(gain),
        seconds: ending.seconds,
    }
}

/// Share of the reducible squared error of the hold-out that was removed: `(before² - after²)/(before² - floor²)`,
/// with the errors after calibration, after the search, and the stated floor. Where nothing is reducible: none.
fn gain(diagnosis: &Value) -> Option<f64> {
    let holdout = &diagnosis["holdout"];
    let square = |value: &Value| value.as_f64().map(|v| v * v);
    let (before, after) = (square(&holdout["rmse_calibrated_n"])?, square(&holdout["rmse_after_n"])?);
    let floor = square(&diagnosis["noise_floor_n"])?;
    (before > 1.02 * floor).then(|| (before - after) / (before - floor))
}

/// Sums over a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Records of every block by outcome.
    pub blocks: BTreeMap<String, BTreeMap<Outcome, usize>>,
    /// Alarms where nothing was to be reported, and how many such records there are.
    pub false_alarms: (usize, usize),
    /// Wrong names, and the records with something of a known or unknown kind in them.
    pub wrong_names: (usize, usize),
    /// Visible effects missed, or only partly named, of the same.
    pub misses: (usize, usize),
    /// Unknown effects flagged, of those that could be seen.
    pub flagged: (usize, usize),
    /// Crashes, time-outs and unreadable diagnoses.
    pub no_answers: usize,
    /// Expected calibration error of the stated confidence: mean |stated - true| over ten bins, weighted.
    pub calibration_error: f64,
    /// Median share of the reducible hold-out error removed, where an effect is 1 % or more.
    pub median_gain: Option<f64>,
    /// Total wall-clock time of the diagnoses, s.
    pub seconds: f64,
}

/// Bins of stated confidence: (mean stated, share true, entries).
pub fn reliability(all: &[Scored]) -> Vec<(f64, f64, usize)> {
    let mut bins = [(0.0, 0.0, 0_usize); 10];
    for (stated, is_true) in all.iter().flat_map(|record| &record.confidences) {
        let bin = &mut bins[((stated * 10.0) as usize).min(9)];
        *bin = (bin.0 + stated, bin.1 + f64::from(u8::from(*is_true)), bin.2 + 1);
    }
    bins.iter().filter(|bin| bin.2 > 0).map(|bin| (bin.0 / bin.2 as f64, bin.1 / bin.2 as f64, bin.2)).collect()
}

/// Adds up.
pub fn summary(all: &[Scored]) -> Summary {
    let mut blocks: BTreeMap<String, BTreeMap<Outcome, usize>> = BTreeMap::new();
    for record in all {
        *blocks.entry(record.block.clone()).or_default().entry(record.outcome).or_default() += 1;
    }
    let count = |keep: &dyn Fn(&&Scored) -> bool| all.iter().filter(keep).count();
    let is_clean = |r: &&Scored| r.block == "clean";
    let hides = |r: &&Scored| !r.hidden.is_empty() && r.block != "clean";
    let bins = reliability(all);
    let entries: usize = bins.iter().map(|bin| bin.2).sum();
    let error: f64 = bins.iter().map(|(stated, is_true, n)| (stated - is_true).abs() * *n as f64).sum();
    let mut gains: Vec<f64> = all.iter().filter(|r| r.strength_pct >= 1.0).filter_map(|r| r.holdout_gain).collect();
    gains.sort_by(f64::total_cmp);
    Summary {
        false_alarms: (
            count(&|r| is_clean(r) && matches!(r.outcome, Outcome::FalseAlarm | Outcome::WrongName)),
            count(&is_clean),
        ),
        wrong_names: (count(&|r| hides(r) && r.outcome == Outcome::WrongName), count(&hides)),
        misses: (
            count(&|r| hides(r) && matches!(r.outcome, Outcome::Missed | Outcome::Partly | Outcome::Unnamed)),
            count(&hides),
        ),
        flagged: (
            count(&|r| r.block == "unknown" && r.outcome == Outcome::Right),
            count(&|r| r.block == "unknown" && r.ideal_z >= VISIBLE),
        ),
        no_answers: count(&|r| r.outcome == Outcome::NoAnswer),
        calibration_error: if entries == 0 { 0.0 } else { error / entries as f64 },
        median_gain: gains.get(gains.len() / 2).copied(),
        seconds: all.iter().map(|r| r.seconds).sum(),
        blocks,
    }
}

/// Detection curve: strength (%, geometric middle of the step), share named right among the visible, share the ideal
/// analyser sees, records.
pub fn detection(all: &[Scored]) -> Vec<(f64, f64, f64, usize)> {
    const EDGES: [f64; 8] = [0.03, 0.075, 0.15, 0.25, 0.4, 0.75, 1.5, 4.0];
    let single = |r: &&Scored| r.block == "single" || r.block == "sensor";
    EDGES
        .windows(2)
        .filter_map(|edge| {
            let step: Vec<_> =
                all.iter().filter(single).filter(|r| r.strength_pct >= edge[0] && r.strength_pct < edge[1]).collect();
            let share = |n: usize| n as f64 / step.len() as f64;
            let right = step.iter().filter(|r| r.outcome == Outcome::Right).count();
            let visible = step.iter().filter(|r| r.ideal_z >= VISIBLE).count();
            (!step.is_empty()).then(|| ((edge[0] * edge[1]).sqrt(), share(right), share(visible), step.len()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(id: &str, z: f64) -> Effect {
        Effect { id: id.into(), strength_alone_pct: 1.0, ideal_z: z, ..Effect::default() }
    }

    fn truth(kind: &str, effects: Vec<Effect>) -> Truth {
        Truth { kind: kind.into(), effects, expected_verdict: "explained".into(), ..Truth::default() }
    }

    fn said(verdict: &str, sets: &[&[&str]]) -> Option<Diagnosis> {
        let mechanisms = sets
            .iter()
            .map(|set| Named {
                id: set[0].into(),
                equivalents: set[1..].iter().map(|id| (*id).into()).collect(),
                confidence: 0.9,
                ..Named::default()
            })
            .collect();
        Some(Diagnosis { verdict: verdict.into(), mechanisms })
    }

    #[test]
    fn hand_made_answers_are_scored_as_the_protocol_says() {
        let seal = truth("single", vec![effect("seal-drag", 50.0)]);
        let faint = truth("single", vec![effect("seal-drag", 2.0)]);
        let pair = truth("pair", vec![effect("seal-drag", 50.0), effect("run-in", 50.0)]);
        let unknown = truth("unknown", vec![effect("unknown", 50.0)]);
        let clean = Truth { kind: "clean".into(), expected_verdict: "match".into(), ..Truth::default() };
        let spoiled = Truth { expected_verdict: "insufficient-data".into(), ..clean.clone() };
        let mut open = truth("undecidable", vec![effect("seal-drag", 50.0)]);
        open.effects[0].equivalents = vec!["hysteresis-and-slip".into()];
        for (truth, answer, expected) in [
            (&seal, said("explained", &[&["seal-drag"]]), Outcome::Right),
            (&seal, said("ambiguous", &[&["run-in", "seal-drag"]]), Outcome::Right),
            (&seal, said("explained", &[&["seal-drag"], &["run-in"]]), Outcome::WrongName),
            (&seal, said("explained", &[&["run-in"]]), Outcome::WrongName),
            (&seal, said("unexplained", &[&["unknown"]]), Outcome::Unnamed),
            (&seal, said("match", &[]), Outcome::Missed),
            (&faint, said("match", &[]), Outcome::RightlySilent),
            (&pair, said("explained", &[&["seal-drag"], &["run-in"]]), Outcome::Right),
            (&pair, said("explained", &[&["run-in"]]), Outcome::Partly),
            (&unknown, said("unexplained", &[&["unknown"]]), Outcome::Right),
            (&unknown, said("explained", &[&["seal-drag"]]), Outcome::WrongName),
            (&unknown, said("match", &[]), Outcome::Missed),
            (&clean, said("match", &[]), Outcome::Right),
            (&clean, said("unexplained", &[&["unknown"]]), Outcome::FalseAlarm),
            (&clean, said("unexplained", &[]), Outcome::FalseAlarm),
            (&spoiled, said("insufficient-data", &[]), Outcome::Right),
            (&spoiled, said("match", &[]), Outcome::Missed),
            (&open, said("explained", &[&["seal-drag"]]), Outcome::Partly),
            (&open, said("ambiguous", &[&["hysteresis-and-slip", "seal-drag"]]), Outcome::Right),
            (&seal, None, Outcome::NoAnswer),
        ] {
            assert_eq!(outcome(truth, answer.as_ref()), expected, "{truth:?} {answer:?}");
        }
    }

    #[test]
    fn gain_is_the_share_of_what_can_be_removed() {
        let of = |after: f64| {
            gain(
                &serde_json::json!({"noise_floor_n": 3.0, "holdout": {"rmse_calibrated_n": 5.0, "rmse_after_n": after}}),
            )
        };
        assert_eq!(of(3.0), Some(1.0));
        assert_eq!(of(5.0), Some(0.0));
        assert_eq!(of(17.0_f64.sqrt()).map(|g| (g * 1e9).round() / 1e9), Some(0.5));
    }
}
