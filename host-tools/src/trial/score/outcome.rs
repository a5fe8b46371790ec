//! Outcome of one record.
//!
//! An entry of the diagnosis is right where the true id, or one that the answer allows instead, is among the entry's id
//! and its equivalents; every entry must stand for a different effect. Anything else that is named is a wrong name.
//! A set with a member that the answer does not allow, or larger than three, is padded and not right; in an undecidable
//! record it may hold all that an ideal analyser leaves open. An effect without an entry is a miss, unless it was too
//! weak for the ideal analyser, too (`ideal_z` below [`VISIBLE`]). A crash, a time-out
//! and a diagnosis that cannot be read are wrong answers.

use serde::Serialize;

use super::answer::{Diagnosis, Named};
use super::truth::{Effect, Truth};

/// Score of the ideal analyser, in standard deviations, below which an effect cannot be seen.
pub const VISIBLE: f64 = 4.0;

/// Outcome of one record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// Everything hidden was named, nothing else.
    Right,
    /// Nothing was named, and nothing could have been.
    RightlySilent,
    /// True names only, but some visible effect is missing, or a set of equivalents is incomplete.
    Partly,
    /// The true name stands among others that the recording rules out.
    Padded,
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
    /// In the order of the page.
    pub const ALL: [Outcome; 9] = [
        Outcome::Right,
        Outcome::RightlySilent,
        Outcome::Partly,
        Outcome::Padded,
        Outcome::Missed,
        Outcome::Unnamed,
        Outcome::FalseAlarm,
        Outcome::WrongName,
        Outcome::NoAnswer,
    ];

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
            Outcome::Padded => "padded",
            Outcome::Missed => "missed",
            Outcome::FalseAlarm => "false alarm",
            Outcome::WrongName => "wrong name",
            Outcome::Unnamed => "unnamed",
            Outcome::NoAnswer => "no answer",
        }
    }
}

/// Largest number of entries that stand for an effect of their own.
fn matched(entries: &[&Named], effects: &[&Effect]) -> usize {
    let Some((entry, rest)) = entries.split_first() else { return 0 };
    let without = matched(rest, effects);
    (0..effects.len())
        .filter(|n| entry.holds(effects[*n]))
        .map(|n| {
            let others: Vec<&Effect> =
                effects.iter().enumerate().filter(|(m, _)| *m != n).map(|(_, other)| *other).collect();
            1 + matched(rest, &others)
        })
        .fold(without, usize::max)
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
    let visible: Vec<&Effect> = truth.effects.iter().filter(|effect| effect.ideal_z >= VISIBLE).collect();
    if truth.kind == "unknown" {
        return match (named.is_empty(), unknown.is_empty()) {
            (false, _) => Outcome::WrongName,
            (true, false) => Outcome::Right,
            (true, true) if visible.is_empty() => Outcome::RightlySilent,
            (true, true) => Outcome::Missed,
        };
    }
    let all: Vec<&Effect> = truth.effects.iter().collect();
    // more entries than effects decide it without a search for pairs
    if named.len() > all.len() || matched(&named, &all) < named.len() {
        return Outcome::WrongName;
    }
    let is_complete = |effect: &Effect| {
        named.iter().filter(|entry| entry.holds(effect)).any(|entry| {
            let set = entry.set();
            // a complete set is required only where the design was made undecidable
            truth.kind != "undecidable" || effect.equivalents.iter().all(|id| set.contains(id.as_str()))
        })
    };
    match (named.is_empty(), unknown.is_empty()) {
        (true, false) => Outcome::Unnamed,
        (true, true) if visible.is_empty() => Outcome::RightlySilent,
        (true, true) => Outcome::Missed,
        _ if named.iter().any(|entry| entry.is_padded(&truth.effects, truth.kind == "undecidable")) => Outcome::Padded,
        _ if matched(&named, &visible) == visible.len() && visible.iter().all(|effect| is_complete(effect)) => {
            Outcome::Right
        }
        _ => Outcome::Partly,
    }
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
        Some(Diagnosis { verdict: verdict.into(), mechanisms, ..Diagnosis::default() })
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
    fn a_padded_set_is_not_right_and_one_entry_is_not_two_effects() {
        let mut offset = truth("single", vec![effect("force-offset", 50.0)]);
        offset.effects[0].equivalents = vec!["gravity-tilt".into()];
        offset.effects[0].also_allowed = vec!["load-crosstalk".into()];
        offset.effects[0].near = vec!["cable-chain".into()];
        let pair = truth("pair", vec![effect("seal-drag", 50.0), effect("run-in", 50.0)]);
        let mut wide = truth("undecidable", vec![effect("seal-drag", 50.0)]);
        wide.effects[0].equivalents = ["gravity-tilt", "force-offset", "hysteresis-and-slip"].map(String::from).into();
        let mut open = truth("undecidable", vec![effect("seal-drag", 50.0)]);
        open.effects[0].equivalents = vec!["gravity-tilt".into()];
        open.effects[0].also_allowed = ["run-in", "starvation", "inertia"].map(String::from).into();
        for (truth, answer, expected) in [
            (&offset, said("ambiguous", &[&["force-offset", "gravity-tilt"]]), Outcome::Right),
            (&offset, said("ambiguous", &[&["load-crosstalk", "force-offset", "gravity-tilt"]]), Outcome::Right),
            // a similar effect is not an indistinguishable one
            (&offset, said("ambiguous", &[&["force-offset", "cable-chain"]]), Outcome::Padded),
            (&offset, said("ambiguous", &[&["force-offset"], &["gravity-tilt"]]), Outcome::WrongName),
            (&pair, said("ambiguous", &[&["seal-drag", "run-in"]]), Outcome::Padded),
            (&pair, said("ambiguous", &[&["seal-drag", "run-in"], &["run-in"]]), Outcome::Padded),
            (
                &wide,
                said("ambiguous", &[&["seal-drag", "gravity-tilt", "force-offset", "hysteresis-and-slip"]]),
                Outcome::Right,
            ),
            (&wide, said("ambiguous", &[&["seal-drag", "gravity-tilt", "inertia"]]), Outcome::Padded),
            (&open, said("ambiguous", &[&["seal-drag", "gravity-tilt", "run-in", "starvation"]]), Outcome::Right),
            (&open, said("ambiguous", &[&["seal-drag", "run-in", "starvation"]]), Outcome::Partly),
        ] {
            assert_eq!(outcome(truth, answer.as_ref()), expected, "{truth:?} {answer:?}");
        }
        let mut many = said("ambiguous", &[&["force-offset", "gravity-tilt", "load-crosstalk", "inertia"]]);
        assert_eq!(outcome(&offset, many.as_ref()), Outcome::Padded);
        // four that are each allowed are still more than three
        offset.effects[0].also_allowed.push("inertia".into());
        assert_eq!(outcome(&offset, many.take().as_ref()), Outcome::Padded);
    }
}
