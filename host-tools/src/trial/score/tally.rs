//! Sums over a run: blocks by outcome, shares, curves.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Outcome, Scored, VISIBLE};

/// A share: part of a number of records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Share {
    /// How many.
    pub part: usize,
    /// Of how many.
    pub of: usize,
}

impl Share {
    /// The quotient; `None` of nothing.
    pub fn value(self) -> Option<f64> {
        (self.of > 0).then(|| self.part as f64 / self.of as f64)
    }

    /// Wilson's 95 % interval of the quotient.
    pub fn interval(self) -> Option<(f64, f64)> {
        let (p, n, z2) = (self.value()?, self.of as f64, 1.96_f64.powi(2));
        let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = 1.96 * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt() / (1.0 + z2 / n);
        // rounding may pass the ends by a hair
        Some(((middle - half).max(0.0), (middle + half).min(1.0)))
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.part, self.of)
    }
}

/// Share of records for which `counts` holds among those for which `keep` holds.
pub fn share(all: &[Scored], keep: impl Fn(&Scored) -> bool, counts: impl Fn(&Scored) -> bool) -> Share {
    let kept = || all.iter().filter(|record| keep(record));
    Share { part: kept().filter(|record| counts(record)).count(), of: kept().count() }
}

/// Blocks whose names the protocol counts together: one, two, three known effects, or one that has no name.
pub const NAMED_BLOCKS: [&str; 4] = ["single", "pair", "triple", "unknown"];

/// Records of every group by outcome.
pub type Outcomes = BTreeMap<String, BTreeMap<Outcome, usize>>;

/// Sums over a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Records of every block by outcome.
    pub blocks: Outcomes,
    /// The same of every manner of moving and logging; empty where the generator knows one.
    pub manners: Outcomes,
    /// Correct answers.
    pub right: Share,
    /// Alarms, of any kind, where nothing or only a shifted constant was hidden: a rightly named shift is none.
    pub false_alarms: Share,
    /// Wrong names in [`NAMED_BLOCKS`].
    pub wrong_names: Share,
    /// Wrong names in the other blocks with something hidden.
    pub wrong_names_elsewhere: Share,
    /// Records with something hidden where a visible effect was missed, left without a name, or named only in part.
    pub misses: Share,
    /// True names among others that the recording rules out.
    pub padded: Share,
    /// Unknown effects flagged, of those that can be seen.
    pub flagged: Share,
    /// Right axes of the largest place, of the records that state one.
    pub axes: Share,
    /// Median agreement of the stretch, F1.
    pub median_f1: Option<f64>,
    /// 90 % intervals that hold the truth.
    pub covered_90: Share,
    /// 95 % intervals that hold the truth.
    pub covered_95: Share,
    /// Undecidable records whose next run is the one that decides.
    pub next_runs: Share,
    /// Crashes, time-outs and unreadable diagnoses.
    pub no_answers: usize,
    /// Median size of the sets that hold a true id.
    pub median_set: Option<f64>,
    /// Expected calibration error of the stated confidence: mean |stated - true| over ten bins, weighted.
    pub calibration_error: Option<f64>,
    /// Median of the hold-out gain over the oracle's, where an effect is 1 % or more.
    pub median_gain: Option<f64>,
    /// Records behind it.
    pub gains: usize,
    /// Total wall-clock time of the diagnoses, s.
    pub seconds: f64,
}

/// Middle value; the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

/// Gains that the median is taken of: something of 1 % or more is hidden, rounded as the ladder of strengths is.
pub fn gains(all: &[Scored]) -> Vec<f64> {
    all.iter().filter(|r| r.strength_pct >= 0.95).filter_map(|r| r.holdout_gain).collect()
}

/// Adds up.
pub fn summary(all: &[Scored]) -> Summary {
    let counted = |group: &dyn Fn(&Scored) -> String| {
        let mut groups = Outcomes::new();
        for record in all {
            *groups.entry(group(record)).or_default().entry(record.outcome).or_default() += 1;
        }
        groups.remove("");
        groups
    };
    let is_named = |r: &Scored| NAMED_BLOCKS.contains(&r.block.as_str());
    let hides = |r: &Scored| !r.hidden.is_empty() && r.block != "clean";
    let is_wrong = |r: &Scored| r.outcome == Outcome::WrongName;
    let bins = reliability(all);
    let entries: usize = bins.iter().map(|bin| bin.entries).sum();
    let error: f64 = bins.iter().map(|bin| (bin.stated - bin.is_true).abs() * bin.entries as f64).sum();
    let intervals = || all.iter().flat_map(|r| &r.intervals);
    let of = intervals().count();
    let gains = gains(all);
    Summary {
        right: share(all, |_| true, |r| r.outcome.is_right()),
        false_alarms: share(
            all,
            |r| r.block == "clean",
            |r| matches!(r.outcome, Outcome::FalseAlarm | Outcome::WrongName),
        ),
        wrong_names: share(all, is_named, is_wrong),
        wrong_names_elsewhere: share(all, |r| hides(r) && !is_named(r), is_wrong),
        misses: share(all, hides, |r| matches!(r.outcome, Outcome::Missed | Outcome::Partly | Outcome::Unnamed)),
        padded: share(all, hides, |r| r.outcome == Outcome::Padded),
        flagged: share(all, |r| r.block == "unknown" && r.ideal_z >= VISIBLE, |r| r.outcome == Outcome::Right),
        axes: share(all, |r| r.location.is_some(), |r| r.location.as_ref().is_some_and(|place| place.is_right)),
        median_f1: median(all.iter().filter_map(|r| r.location.as_ref()?.f1).collect()),
        covered_90: Share { part: intervals().filter(|i| i.is_in_90).count(), of },
        covered_95: Share { part: intervals().filter(|i| i.is_in_95).count(), of },
        next_runs: share(all, |r| r.is_next_run_right.is_some(), |r| r.is_next_run_right == Some(true)),
        no_answers: all.iter().filter(|r| r.outcome == Outcome::NoAnswer).count(),
        median_set: median(all.iter().flat_map(|r| &r.set_sizes).map(|size| *size as f64).collect()),
        calibration_error: (entries > 0).then(|| error / entries as f64),
        gains: gains.len(),
        median_gain: median(gains),
        seconds: all.iter().map(|r| r.seconds).sum(),
        blocks: counted(&|record| record.block.clone()),
        manners: counted(&|record| record.manner.clone()),
    }
}

/// Entries with about the same stated confidence.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Mean stated confidence.
    pub stated: f64,
    /// Share of entries that were true.
    pub is_true: f64,
    /// How many entries.
    pub entries: usize,
}

/// Ten bins of stated confidence, those with entries.
pub fn reliability(all: &[Scored]) -> Vec<Bin> {
    let mut bins = [(0.0, 0.0, 0_usize); 10];
    for (stated, is_true) in all.iter().flat_map(|record| &record.confidences) {
        let bin = &mut bins[((stated * 10.0) as usize).min(9)];
        *bin = (bin.0 + stated, bin.1 + f64::from(u8::from(*is_true)), bin.2 + 1);
    }
    bins.iter()
        .filter(|bin| bin.2 > 0)
        .map(|bin| Bin { stated: bin.0 / bin.2 as f64, is_true: bin.1 / bin.2 as f64, entries: bin.2 })
        .collect()
}

/// One step of the detection curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Geometric mean of the strengths, % of the drag's RMS.
    pub strength_pct: f64,
    /// Records where any mismatch was reported.
    pub detected: Share,
    /// Records named right.
    pub named: Share,
    /// Records that an analyser could see who knew shape and noise: the likelihood-ratio limit.
    pub visible: Share,
}

/// Detection curve over single effects and sensor faults.
pub fn detection(all: &[Scored]) -> Vec<Step> {
    const EDGES: [f64; 9] = [0.03, 0.075, 0.15, 0.25, 0.4, 0.75, 1.5, 2.5, 4.0];
    EDGES
        .windows(2)
        .filter_map(|edge| {
            let is_in = |r: &Scored| {
                (r.block == "single" || r.block == "sensor") && r.strength_pct >= edge[0] && r.strength_pct < edge[1]
            };
            let logs: Vec<f64> = all.iter().filter(|r| is_in(r)).map(|r| r.strength_pct.ln()).collect();
            (!logs.is_empty()).then(|| Step {
                strength_pct: (logs.iter().sum::<f64>() / logs.len() as f64).exp(),
                detected: share(all, is_in, |r| r.is_detected),
                named: share(all, is_in, |r| r.outcome == Outcome::Right),
                visible: share(all, is_in, |r| r.ideal_z >= VISIBLE),
            })
        })
        .collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::super::coverage::Covered;
    use super::super::location::Located;
    use super::*;

    /// A record with nothing special about it.
    pub(crate) fn record(block: &str, outcome: Outcome) -> Scored {
        Scored {
            id: "r1".into(),
            block: block.into(),
            outcome,
            hidden: if block == "clean" { vec![] } else { vec!["seal-drag 1.00 %".into()] },
            named: vec![],
            verdict: "explained".into(),
            manner: String::new(),
            noise: "white".into(),
            strength_pct: if block == "clean" { 0.0 } else { 1.0 },
            ideal_z: if block == "clean" { 0.0 } else { 50.0 },
            is_detected: outcome == Outcome::Right,
            confidences: vec![],
            set_sizes: vec![],
            is_padded_with_near: false,
            location: None,
            intervals: vec![],
            oracle_n: None,
            holdout_gain: None,
            is_next_run_right: None,
            seconds: 1.0,
        }
    }

    #[test]
    fn wrong_names_and_misses_are_counted_apart() {
        let all = [
            record("clean", Outcome::Right),
            record("clean", Outcome::FalseAlarm),
            record("single", Outcome::WrongName),
            record("single", Outcome::Missed),
            record("unknown", Outcome::Right),
            record("unknown", Outcome::WrongName),
            record("sensor", Outcome::WrongName),
            record("pair", Outcome::Padded),
        ];
        let sums = summary(&all);
        let shares = [sums.false_alarms, sums.wrong_names, sums.wrong_names_elsewhere, sums.misses, sums.padded];
        let expected = [(1, 2), (2, 5), (1, 1), (1, 6), (1, 6)];
        assert_eq!(shares.map(|s| (s.part, s.of)), expected);
        assert_eq!((sums.flagged.part, sums.flagged.of), (1, 2));
    }

    #[test]
    fn places_intervals_and_confidences_add_up() {
        let mut one = record("single", Outcome::Right);
        one.location = Some(Located { axis: "velocity".into(), is_right: true, f1: Some(0.8) });
        one.intervals =
            vec![Covered { parameter: "p".into(), truth: 1.0, value: 1.1, is_in_90: false, is_in_95: true }];
        one.confidences = vec![(0.95, true), (0.95, false)];
        one.holdout_gain = Some(0.99);
        one.set_sizes = vec![1, 2];
        let mut other = record("single", Outcome::WrongName);
        other.location = Some(Located { axis: "time".into(), is_right: false, f1: None });
        other.confidences = vec![(0.55, false)];
        other.holdout_gain = Some(0.5);
        other.strength_pct = 0.3;
        let sums = summary(&[one, other]);
        assert_eq!((sums.axes.to_string(), sums.median_f1), ("1 of 2".into(), Some(0.8)));
        assert_eq!((sums.covered_90.part, sums.covered_95.part, sums.covered_95.of), (0, 1, 1));
        // (2 * |0.95 - 0.5| + |0.55 - 0|) / 3
        assert!((sums.calibration_error.unwrap() - 1.45 / 3.0).abs() < 1e-12);
        assert_eq!((sums.median_gain, sums.gains, sums.median_set), (Some(0.99), 1, Some(1.5)));
    }

    #[test]
    fn the_curve_counts_seen_named_and_visible_apart() {
        let mut seen = record("single", Outcome::Unnamed);
        seen.is_detected = true;
        let mut faint = record("sensor", Outcome::RightlySilent);
        faint.ideal_z = 1.0;
        let steps = detection(&[seen, record("single", Outcome::Right), faint, record("pair", Outcome::Right)]);
        assert_eq!(steps.len(), 1);
        let counts = [steps[0].detected, steps[0].named, steps[0].visible].map(|s| (s.part, s.of));
        assert_eq!(counts, [(2, 3), (1, 3), (2, 3)]);
        assert!((steps[0].strength_pct - 1.0).abs() < 1e-12);
    }

    #[test]
    fn shares_know_how_sure_they_are() {
        let (low, high) = Share { part: 237, of: 240 }.interval().unwrap();
        assert!((low - 0.964).abs() < 1e-3 && high < 1.0, "{low} {high}");
        assert_eq!(Share::default().interval(), None);
        assert_eq!(median(vec![]), None);
    }
}
