//! The answer: the part of a diagnosis that is scored.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::truth::Effect;

/// A diagnosis.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: String,
    /// What was named.
    #[serde(default)]
    pub mechanisms: Vec<Named>,
    /// Where the mismatch is, the largest share first.
    #[serde(rename = "where", default)]
    pub places: Vec<Place>,
    /// Errors on rows that the search has not seen.
    #[serde(default)]
    pub holdout: Option<Holdout>,
    /// The run that it asks for.
    #[serde(default)]
    pub next_experiment: Option<NextExperiment>,
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
    /// Its numbers.
    #[serde(default)]
    pub parameters: Vec<Interval>,
}

/// A stated number with its interval.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Interval {
    /// Its name.
    pub name: String,
    /// Its value; `None` for null.
    #[serde(default)]
    pub value: Option<f64>,
    /// 95 % interval.
    #[serde(default)]
    pub ci95: Option<[f64; 2]>,
}

/// A stretch of an axis.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Place {
    /// The axis.
    pub axis: String,
    /// Lower end.
    #[serde(default)]
    pub from: Option<f64>,
    /// Upper end.
    #[serde(default)]
    pub to: Option<f64>,
    /// Whose place it is.
    #[serde(default)]
    pub id: Option<String>,
}

/// Errors on the part that was set aside.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Holdout {
    /// Parts of the recordings that were set aside, s from the first row of each.
    #[serde(default)]
    pub intervals_s: Vec<[f64; 2]>,
    /// The recording that each is of, from 0; the first of those of which nothing is said.
    #[serde(default)]
    pub intervals_of: Vec<usize>,
    /// After the tolerated constants were moved, N.
    #[serde(default)]
    pub rmse_calibrated_n: Option<f64>,
    /// After the search, N.
    #[serde(default)]
    pub rmse_after_n: Option<f64>,
}

/// The run that a diagnosis asks for.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct NextExperiment {
    /// Its code.
    #[serde(default)]
    pub code: String,
}

impl Named {
    /// Whether it names nothing.
    pub fn is_unknown(&self) -> bool {
        self.kind == "unknown" || self.id == "unknown"
    }

    /// Id and equivalents.
    pub fn set(&self) -> BTreeSet<&str> {
        std::iter::once(&self.id).chain(&self.equivalents).map(String::as_str).collect()
    }

    /// Whether the entry holds this effect.
    pub fn holds(&self, effect: &Effect) -> bool {
        let set = self.set();
        set.contains(effect.id.as_str()) || effect.also_allowed.iter().any(|id| set.contains(id.as_str()))
    }

    /// Whether its set is longer than any recording requires, or has a member that no effect in it allows: two
    /// hidden effects in one set are padding, too, as they can be told apart. A recording that was made undecidable
    /// requires as many members as an ideal analyser leaves open.
    pub fn is_padded(&self, effects: &[Effect], is_undecidable: bool) -> bool {
        const MOST: usize = 3;
        let set = self.set();
        !effects.iter().filter(|effect| self.holds(effect)).any(|effect| {
            let allowed = effect.allowed();
            // a design can be so poor that the true set itself is larger
            let true_set = if is_undecidable { allowed.len() } else { 1 + effect.equivalents.len() };
            let most = MOST.max(true_set);
            set.len() <= most && set.iter().all(|id| allowed.contains(id))
        })
    }
}
