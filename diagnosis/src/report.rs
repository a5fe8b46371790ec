//! The report of a diagnosis: structure of the public schema `guideblock.diagnosis/1`.

use std::collections::BTreeMap;

use serde::Serialize;

/// The value of `schema`.
pub const SCHEMA: &str = "guideblock.diagnosis/1";

/// The report on a simulation, given a recording. All numbers in SI, units in the names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// See [`Verdict`].
    pub verdict: Verdict,
    /// p-value of "nothing is missing", valid under autocorrelated noise.
    pub p_no_mismatch: f64,
    /// RMS of what no repeatable cause explains, at the recording's rate, N.
    pub noise_floor_n: f64,
    /// Score on rows that no step of the search has seen.
    pub holdout: Holdout,
    /// Where the mismatch lies.
    #[serde(rename = "where")]
    pub regions: Vec<Region>,
    /// What causes it, the largest share first.
    pub mechanisms: Vec<Finding>,
    /// What else was considered, and why it is not named.
    pub considered: Vec<Considered>,
    /// The unexplained rest.
    pub unexplained: Unexplained,
    /// The run that would settle what is open.
    pub next_experiment: Option<NextExperiment>,
    /// Defects of the recording.
    pub data_quality: DataQuality,
}

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The simulation fits, once what it only assumes has been moved within its tolerance.
    Match,
    /// Named causes explain the mismatch.
    Explained,
    /// Something without a name carries most of the mismatch.
    Unexplained,
    /// Some cause has equivalents that this recording cannot tell from it.
    Ambiguous,
    /// The recording does not allow a judgement.
    InsufficientData,
}

impl Verdict {
    /// As the schema writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Verdict::Match => "match",
            Verdict::Explained => "explained",
            Verdict::Unexplained => "unexplained",
            Verdict::Ambiguous => "ambiguous",
            Verdict::InsufficientData => "insufficient-data",
        }
    }
}

/// Errors on rows that no step of the search has seen; all 0 where none of them can be compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Holdout {
    /// The held-out rows, in words.
    pub description: String,
    /// Intervals of the held-out rows, s from the first row of the run; empty where nothing is scored.
    pub intervals_s: Vec<[f64; 2]>,
    /// Index of each interval's recording, from 0 in the order given; of the hold-out recordings where there are any.
    pub intervals_of: Vec<usize>,
    /// RMS error of the simulation as given, N.
    pub rmse_before_n: f64,
    /// RMS error with its own parameters moved within their tolerance, N.
    pub rmse_calibrated_n: f64,
    /// RMS error with the causes that were found, N.
    pub rmse_after_n: f64,
    /// 95 % interval of `1 - rmse_after/rmse_calibrated`.
    pub improvement_ci95: [f64; 2],
}

impl Holdout {
    /// Whether anything is scored.
    pub fn is_scored(&self) -> bool {
        !self.intervals_s.is_empty()
    }
}

/// A region of an axis in which the mismatch lies.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Region {
    /// Name of the axis.
    pub axis: &'static str,
    /// Start, in `unit`.
    pub from: f64,
    /// End, in `unit`.
    pub to: f64,
    /// Unit of the axis.
    pub unit: &'static str,
    /// Share of the mismatch.
    pub share: f64,
    /// Id of the cause.
    pub id: String,
}

/// A cause.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Its id.
    pub id: String,
    /// `physics`, `sensor`, `parameter` or `unknown`.
    pub kind: &'static str,
    /// Probability that the true cause is this or an equivalent.
    pub confidence: f64,
    /// Causes that this recording cannot tell from it.
    pub equivalents: Vec<String>,
    /// Its parameters.
    pub parameters: Vec<Estimate>,
    /// Share of the squared mismatch that calibration leaves.
    pub share_of_mismatch: f64,
    /// Whether more than half of its force is present on the scored rows, by two standard errors and with everything
    /// else as found; `null` where they tell nothing of it, such as a phase along a rail whose zero the other recording
    /// does not share.
    pub carried_over: Option<bool>,
    /// How much of its force is present there.
    pub on_holdout: Option<Carried>,
    /// One sentence.
    pub statement: String,
}

/// Share of a force that is present on the scored rows: 1 for all, 0 for nothing of it, below 0 for the opposite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Carried {
    /// Share.
    pub share: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

/// A cause that was not named.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Considered {
    /// Its id.
    pub id: String,
    /// Evidence that it explains alone, relative to that of the named causes; above 1 where it explains more.
    pub share_alone: f64,
    /// Share that it explains beside the named causes.
    pub share_beside: f64,
    /// Why it is not named.
    pub reason: String,
}

/// A number with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Unit.
    pub unit: String,
}

/// The unexplained rest.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Unexplained {
    /// RMS of the repeatable mismatch that nothing explains, N.
    pub rmse_n: f64,
    /// Its share of the squared mismatch.
    pub share_of_mismatch: f64,
    /// What it looks like.
    pub signature: String,
}

/// The most informative further run for its time.
///
/// Where the runs of the menu could be simulated, it states their expected information: the smallest separation of the
/// explanations in `told`, with noise per row as in this recording, taken as white. Otherwise it is the library's
/// general advice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NextExperiment {
    /// Code of the schema.
    pub code: String,
    /// In words.
    pub text: String,
    /// Expected rise of the log odds between the explanations that it separates, at least.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_nats: Option<f64>,
    /// Assumed time at the rig, min.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub minutes: Option<f64>,
    /// Other runs that separate enough, by separation per time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alternatives: Vec<Alternative>,
    /// The explanations that it separates: at least the first from each of the others.
    #[serde(skip)]
    pub told: Vec<String>,
}

/// Another run that would settle it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Alternative {
    /// Code of the schema.
    pub code: String,
    /// In words.
    pub text: String,
    /// As [`NextExperiment::expected_nats`].
    pub expected_nats: f64,
    /// Time at the rig, min.
    pub minutes: f64,
}

impl NextExperiment {
    /// A run that is only advised, without simulation.
    pub(crate) fn advised(code: &str, text: &str) -> Self {
        let (code, text) = (code.to_owned(), text.to_owned());
        NextExperiment { code, text, expected_nats: None, minutes: None, alternatives: Vec::new(), told: Vec::new() }
    }

    /// Its expected information in plain words; `None` where unknown.
    pub fn promise(&self) -> Option<String> {
        let (first, others) = self.told.split_first()?;
        let gain = gain(self.expected_nats?, self.minutes?);
        Some(format!("tells {first} from {} {gain}", others.join(", ")))
    }
}

impl Alternative {
    /// Its expected information in plain words.
    pub fn promise(&self) -> String {
        format!("tells the same {}", gain(self.expected_nats, self.minutes))
    }
}

/// Largest power of ten of the odds that is stated: noise is never known well enough for more.
const MOST_DIGITS: f64 = 9.0;

fn gain(nats: f64, minutes: f64) -> String {
    let digits = (nats / std::f64::consts::LN_10).floor();
    if digits < MOST_DIGITS {
        format!("with odds of about 1e{digits:.0} to 1, in some {minutes:.0} min")
    } else {
        format!("with odds beyond 1e{MOST_DIGITS:.0} to 1, in some {minutes:.0} min")
    }
}

/// Defects of the recording.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DataQuality {
    /// Rows in the files.
    pub samples: usize,
    /// Rows compared.
    pub used: usize,
    /// Gaps in time.
    pub gaps: usize,
    /// Rows that were not compared, by reason.
    pub rejected: BTreeMap<&'static str, usize>,
    /// Other defects.
    pub warnings: Vec<String>,
}

impl DataQuality {
    /// Scales the counts so far, each row being the average of `together` rows.
    pub(crate) fn count_averages(&mut self, together: usize) {
        if together < 2 {
            return;
        }
        self.samples *= together;
        self.used *= together;
        self.rejected.values_mut().for_each(|rows| *rows *= together);
        self.warnings.push(format!("{together} rows averaged to one: what changes faster is not seen"));
    }
}
