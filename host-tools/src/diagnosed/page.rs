//! The page of a diagnosis: plain words first, numbers beside them, pictures below.

use diagnosis::report::{Diagnosis, Finding, Verdict};

use super::{AxisView, carried_over};
use crate::report::chart::Chart;
use crate::report::number::{short, significant, with_space};
use crate::report::page::Page;
use crate::report::shares;

/// Makes the page. `views` may be empty where there was nothing to compare.
pub fn page(name: &str, diagnosis: &Diagnosis, views: &[AxisView]) -> String {
    let mut page = Page::new(&format!("What the simulation of {name} leaves out"));
    page.lead(&lead(diagnosis));
    for warning in &diagnosis.data_quality.warnings {
        page.warning(warning);
    }
    score(&mut page, diagnosis);
    if !diagnosis.mechanisms.is_empty() {
        causes(&mut page, diagnosis);
    }
    if !diagnosis.considered.is_empty() {
        considered(&mut page, diagnosis);
    }
    if let Some(next) = &diagnosis.next_experiment {
        page.heading("What to run next").prose(&format!("{}: {}", next.code, next.text));
        if let Some(promise) = next.promise() {
            page.prose(&format!("It {promise}."));
        }
        for other in &next.alternatives {
            page.prose(&format!("Or {}: {} It {}.", other.code, other.text, other.promise()));
        }
    }
    pictures(&mut page, diagnosis, views);
    quality(&mut page, diagnosis);
    page.finish()
}

/// Probability of chance below which a difference is certain.
const CERTAIN: f64 = 1e-6;

/// Least probability that is stated: none is known more exactly.
const LEAST_SAID: f64 = 1e-9;

/// A probability by chance as it is said.
pub fn probability(p: f64) -> String {
    if p < LEAST_SAID { format!("p < {LEAST_SAID:e}") } else { format!("p = {}", short(p, 3)) }
}

/// Why a simulation that certainly differs is a match all the same; `None` where it does not differ, or more is said.
pub fn of_no_interest(diagnosis: &Diagnosis) -> Option<&'static str> {
    let is_match = diagnosis.verdict == Verdict::Match;
    (is_match && diagnosis.p_no_mismatch < CERTAIN).then_some("a difference is certain, and below the relevance limit")
}

/// The answer in a sentence.
fn lead(diagnosis: &Diagnosis) -> String {
    let names = || diagnosis.mechanisms.iter().map(named).collect::<Vec<_>>().join("; ");
    match diagnosis.verdict {
        Verdict::Match => "Nothing is missing: the simulation fits within its own tolerance.".to_owned(),
        Verdict::InsufficientData => "The recording does not allow a judgement.".to_owned(),
        Verdict::Explained => format!("Something is missing, and it has a name: {}.", names()),
        Verdict::Ambiguous => {
            format!("Something is missing; this recording leaves more than one name open: {}.", names())
        }
        Verdict::Unexplained => format!("Something is missing for which there is no name here: {}.", names()),
    }
}

fn named(finding: &Finding) -> String {
    if finding.equivalents.is_empty() {
        finding.id.clone()
    } else {
        format!("{} or {}", finding.id, finding.equivalents.join(" or "))
    }
}

fn score(page: &mut Page, diagnosis: &Diagnosis) {
    let h = &diagnosis.holdout;
    page.heading("Does it fit better?");
    page.prose(&format!("Scored on rows that no step of the search has seen: {}.", h.description));
    let error = |of_n: f64| if h.is_scored() { newtons(of_n) } else { "not scored".to_owned() };
    let rows = vec![
        vec!["the simulation as given".to_owned(), error(h.rmse_before_n)],
        vec!["its own parameters moved within their tolerance".to_owned(), error(h.rmse_calibrated_n)],
        vec!["with what was found".to_owned(), error(h.rmse_after_n)],
        vec!["noise that repeats nowhere".to_owned(), newtons(diagnosis.noise_floor_n)],
    ];
    page.table(&["", "root of the mean squared error (N)"], &rows);
    let [low, high] = h.improvement_ci95;
    if let Some(why) = of_no_interest(diagnosis) {
        page.prose(&format!("Nothing is named: {why}."));
    }
    let removed = match h.is_scored() {
        true => format!(
            "Of the error that its own parameters leave, {:.1} to {:.1} % is removed (95 %). ",
            100.0 * low,
            100.0 * high
        ),
        false => String::new(),
    };
    page.prose(&format!("{removed}Of such a mismatch by chance: {}.", probability(diagnosis.p_no_mismatch)));
}

fn considered(page: &mut Page, diagnosis: &Diagnosis) {
    page.heading("What else was considered");
    let percent = |share: f64| format!("{:.1}", 100.0 * share);
    let rows: Vec<Vec<String>> = diagnosis
        .considered
        .iter()
        .map(|c| vec![c.id.clone(), percent(c.share_alone), percent(c.share_beside), c.reason.clone()])
        .collect();
    page.table(&["cause", "alone (% of the evidence)", "beside what was named (%)", "why it is not named"], &rows);
}

fn causes(page: &mut Page, diagnosis: &Diagnosis) {
    page.heading("What is missing");
    let left = &diagnosis.unexplained;
    let mut shares: Vec<(&str, f64, usize)> =
        diagnosis.mechanisms.iter().map(|m| (m.id.as_str(), m.share_of_mismatch, 0)).collect();
    shares.extend((left.share_of_mismatch > 0.0).then_some(("without explanation", left.share_of_mismatch, 5)));
    page.picture(&shares::svg("Share of the squared mismatch", &shares));
    let rows: Vec<Vec<String>> = diagnosis
        .mechanisms
        .iter()
        .enumerate()
        .map(|(n, m)| {
            vec![
                format!("{}", n + 1),
                m.id.clone(),
                m.kind.to_owned(),
                format!("{:.1} %", 100.0 * m.share_of_mismatch),
                format!("{:.2}", m.confidence),
                m.equivalents.join(", "),
                carried_over(m),
                m.statement.clone(),
            ]
        })
        .collect();
    let header = [
        "",
        "cause",
        "kind",
        "share",
        "confidence",
        "this recording cannot distinguish it from",
        "on held-back rows",
        "in words",
    ];
    page.table(&header, &rows);
    let rows: Vec<Vec<String>> = diagnosis
        .mechanisms
        .iter()
        .flat_map(|m| {
            m.parameters.iter().map(|p| {
                vec![
                    m.id.clone(),
                    p.name.clone(),
                    significant(p.value, 5),
                    significant(p.ci95[0], 4),
                    significant(p.ci95[1], 4),
                    with_space(&p.unit).trim_start().to_owned(),
                ]
            })
        })
        .collect();
    if !rows.is_empty() {
        page.table(&["cause", "parameter", "value", "95 % from", "95 % to", "unit"], &rows);
    }
    if left.share_of_mismatch > 0.0 {
        page.prose(&format!(
            "Without any explanation: {:.1} % of the squared mismatch, {} N. {}",
            100.0 * left.share_of_mismatch,
            newtons(left.rmse_n),
            left.signature
        ));
    }
}

/// Every axis, those on which a cause was located first.
fn pictures(page: &mut Page, diagnosis: &Diagnosis, views: &[AxisView]) {
    if views.is_empty() {
        return;
    }
    page.heading("Where");
    page.prose(
        "Measured less simulated force, mean of each stretch of an axis, before and after; shaded is where a cause shows. \
         Along speed, time, travel, preload and temperature the mismatch is counted against the motion.",
    );
    let located = |view: &&AxisView| diagnosis.regions.iter().any(|r| r.axis == view.axis);
    let (first, others): (Vec<&AxisView>, Vec<&AxisView>) = views.iter().partition(located);
    for view in first.into_iter().chain(others) {
        let unit = if view.unit.is_empty() { String::new() } else { format!(" ({})", view.unit) };
        let points = |of: &dyn Fn(&super::Bin) -> f64| view.bins.iter().map(|b| (b.at, of(b))).collect::<Vec<_>>();
        let (before, after) = (points(&|b| b.before_n), points(&|b| b.after_n));
        // a law that was left to be fitted has no force as given
        let is_given = before.iter().any(|(_, y)| y.is_finite());
        let alone = |line: &[(f64, f64)]| line.iter().map(|(x, y)| (*x, *y, 0.0)).collect();
        let mut chart = Chart::new(&format!("over {}", view.axis), &format!("{}{unit}", view.axis), "mismatch (N)");
        chart = match view.axis {
            // two directions: points, no line between them
            "direction" if is_given => chart.points("as given", alone(&before)),
            _ if is_given => chart.dashed("as given", before),
            _ => chart,
        };
        chart = match view.axis {
            "direction" => chart.points("with what was found", alone(&after)).from_zero(),
            _ => chart.line("with what was found", after),
        };
        chart = chart.height(260.0);
        for region in diagnosis.regions.iter().filter(|r| r.axis == view.axis) {
            chart = chart.region(region.from, region.to, &region.id);
        }
        page.picture(&chart.svg());
    }
    let elsewhere: Vec<String> = diagnosis
        .regions
        .iter()
        .filter(|r| views.iter().all(|v| v.axis != r.axis))
        .map(|r| {
            let [from, to, unit] = [short(r.from, 4), short(r.to, 4), with_space(r.unit)];
            format!("{}: {} from {from} to {to}{unit}", r.id, r.axis)
        })
        .collect();
    if !elsewhere.is_empty() {
        page.list(elsewhere);
    }
}

fn quality(page: &mut Page, diagnosis: &Diagnosis) {
    let q = &diagnosis.data_quality;
    page.heading("The recording");
    page.prose(&format!("{} of {} rows were compared; {} gaps in time.", q.used, q.samples, q.gaps));
    if !q.rejected.is_empty() {
        let rows: Vec<Vec<String>> =
            q.rejected.iter().map(|(reason, rows)| vec![(*reason).to_owned(), rows.to_string()]).collect();
        page.table(&["not compared because", "rows"], &rows);
    }
}

fn newtons(x: f64) -> String {
    significant(x, 4)
}
