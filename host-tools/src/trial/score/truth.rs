//! The truth: the fields of `truth.json` that scoring needs.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde_json::Value;

/// What was hidden in a record.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Truth {
    /// Kind of case.
    pub kind: String,
    /// Hidden effects.
    pub effects: Vec<Effect>,
    /// Verdict of a perfect analyser.
    pub expected_verdict: String,
    /// Next run that would decide, where the design cannot.
    #[serde(default)]
    pub next_experiment: Option<String>,
    /// Noise of the force.
    #[serde(default)]
    pub noise: Noise,
    /// RMS force by which the stated mass makes the noise of a recorded acceleration into error of any simulation, N.
    #[serde(default)]
    pub acceleration_noise_n: f64,
    /// Recordings, in the order of time; see [`Truth::files`].
    #[serde(default)]
    pub files: Vec<String>,
    /// How the machine was moved and logged; empty of generators that know one way.
    #[serde(default)]
    pub manner: String,
    /// Error of the stated constants, within their tolerance: true over stated, less 1.
    #[serde(default)]
    pub stated_constants_off: BTreeMap<String, f64>,
}

/// Noise of the force.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Noise {
    /// Its law.
    pub law: String,
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
    /// Ids that resemble it; in a set they are padding all the same.
    #[serde(default)]
    pub near: Vec<String>,
    /// RMS of what it adds, % of the drag's RMS.
    #[serde(default)]
    pub strength_alone_pct: f64,
    /// Score of the ideal analyser.
    #[serde(default)]
    pub ideal_z: f64,
    /// True parameters.
    #[serde(default)]
    pub parameters: Vec<Parameter>,
    /// Where it shows.
    #[serde(rename = "where", default)]
    pub place: Place,
}

/// A number or a word behind an effect.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// A number, a list of them, or a word.
    pub value: Value,
}

/// Where an effect shows.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Place {
    /// Axes of the contract on which it depends.
    #[serde(default)]
    pub axes: Vec<String>,
    /// How its energy lies along those of them that the session spans.
    #[serde(default)]
    pub stretches: BTreeMap<String, Stretch>,
    /// Periods in place or travel, m.
    #[serde(default)]
    pub wavelengths_m: Vec<f64>,
    /// Periods in time, Hz.
    #[serde(default)]
    pub frequencies_hz: Vec<f64>,
}

/// Energy along one axis, cell by cell.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct Stretch {
    /// Share of the energy that means along this axis explain.
    pub explained: f64,
    /// Lower ends of the cells.
    pub from: Vec<f64>,
    /// Upper ends.
    pub to: Vec<f64>,
    /// Share of the samples in each.
    pub samples: Vec<f64>,
    /// Share of the energy in each.
    pub energy: Vec<f64>,
}

impl Truth {
    /// Names of the recordings; an answer written by hand need not list the only one.
    pub fn files(&self) -> Vec<&str> {
        if self.files.is_empty() { vec!["recording.csv"] } else { self.files.iter().map(String::as_str).collect() }
    }
}

impl Effect {
    /// Every id that may stand in a set for this effect.
    pub fn allowed(&self) -> BTreeSet<&str> {
        std::iter::once(&self.id).chain(&self.equivalents).chain(&self.also_allowed).map(String::as_str).collect()
    }

    /// A parameter as a number.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|parameter| parameter.name == name)?.value.as_f64()
    }

    /// A parameter as a word.
    pub fn word(&self, name: &str) -> Option<&str> {
        self.parameters.iter().find(|parameter| parameter.name == name)?.value.as_str()
    }
}
