//! Goals of the trial, and its results.

use serde::Serialize;

use super::tally::{NAMED_BLOCKS, Share, gains, median, share, summary};
use super::{Outcome, Scored, VISIBLE};

/// A goal that was stated before the trial.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Goal {
    /// What was asked.
    pub wanted: &'static str,
    /// What came out.
    pub got: String,
    /// Whether it was reached; `None` where the trial has no such records.
    pub is_met: Option<bool>,
}

/// Every goal of the protocol.
pub fn goals(all: &[Scored]) -> Vec<Goal> {
    let sums = summary(all);
    let at_least = |wanted, counted: Share, least: f64| Goal {
        wanted,
        got: written(counted),
        is_met: counted.value().map(|value| value >= least),
    };
    let is_right = |r: &Scored| r.outcome == Outcome::Right;
    let single = |from: f64, to: f64, white: bool| {
        move |r: &Scored| {
            r.block == "single"
                && r.ideal_z >= VISIBLE
                && (from..to).contains(&r.strength_pct)
                && (!white || r.noise == "white")
        }
    };
    let at_most = |wanted, counted: Share, most: usize| Goal {
        wanted,
        got: written(counted),
        is_met: (counted.of > 0).then_some(counted.part <= most),
    };
    let named = share(all, |r| NAMED_BLOCKS.contains(&r.block.as_str()), |r| r.outcome == Outcome::WrongName);
    let misnamed = share(all, |r| r.block == "unknown", |r| r.outcome == Outcome::WrongName);
    let gain = median(gains(all));
    vec![
        at_most("no false alarm where nothing is hidden", sums.false_alarms, 0),
        at_most("at most 3 wrong names in 480", named, 3 * named.of / 480),
        at_least("single effects of 1 % and above named in 95 %", share(all, single(0.95, 1e9, false), is_right), 0.95),
        at_least(
            "single effects of 0.3 % named in 85 %, white noise",
            share(all, single(0.28, 0.32, true), is_right),
            0.85,
        ),
        at_least(
            "both effects of a pair named in 90 %",
            share(all, |r| r.block == "pair", |r| r.outcome.is_right()),
            0.90,
        ),
        at_least("unknown effects flagged in 90 %", sums.flagged, 0.90),
        Goal {
            wanted: "unknown effects given a name in at most 2 %",
            got: written(misnamed),
            is_met: misnamed.value().map(|value| value <= 0.02),
        },
        at_least(
            "undecidable records answered with the right set in 90 %",
            share(all, |r| r.block == "undecidable", is_right),
            0.90,
        ),
        Goal {
            wanted: "90 % intervals hold the truth in 85 to 95 %",
            got: written(sums.covered_90),
            is_met: sums.covered_90.value().map(|value| (0.85..=0.95).contains(&value)),
        },
        Goal {
            wanted: "hold-out gain at least 0.98 of the oracle's, median from 1 % on",
            got: gain.map_or_else(|| "-".to_owned(), |gain| format!("{gain:.3} ({} records)", sums.gains)),
            is_met: gain.map(|gain| gain >= 0.98),
        },
    ]
}

fn written(counted: Share) -> String {
    let percent = |x: f64| 100.0 * x;
    match (counted.value(), counted.interval()) {
        (Some(value), Some((low, high))) => {
            format!("{counted}: {:.1} % ({:.1} to {:.1})", percent(value), percent(low), percent(high))
        }
        _ => "no such record".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tally::tests::record;
    use super::*;

    #[test]
    fn goals_are_met_missed_or_open() {
        let is_met = |all: &[Scored]| goals(all).into_iter().map(|goal| goal.is_met).collect::<Vec<_>>();
        assert!(is_met(&[]).iter().all(Option::is_none));
        let good = [record("clean", Outcome::Right), record("single", Outcome::Right), record("pair", Outcome::Right)];
        let met = is_met(&good);
        assert_eq!((met[0], met[1], met[2], met[4]), (Some(true), Some(true), Some(true), Some(true)));
        let bad = [
            record("clean", Outcome::FalseAlarm),
            record("single", Outcome::WrongName),
            record("pair", Outcome::Partly),
            record("unknown", Outcome::WrongName),
        ];
        let met = is_met(&bad);
        assert!([0, 1, 2, 4, 5, 6].iter().all(|n| met[*n] == Some(false)), "{met:?}");
        // too weak for anybody: not asked for
        let mut faint = record("single", Outcome::RightlySilent);
        faint.ideal_z = 1.0;
        assert_eq!(is_met(&[faint])[2], None);
    }
}
