//! One page of a trial: what was sealed, what came out, rivals beside it, every answer that was not right.

use std::collections::BTreeMap;

use super::envelope::Envelope;
use super::matrix::Matrix;
use super::runner::Run;
use super::score::coverage::COMPARABLE;
use super::score::goals::goals;
use super::score::holdout::WITHOUT_ORACLE;
use super::score::tally::{Outcomes, Share, Step, detection, reliability, share, summary};
use super::score::{Outcome, Scored};
use crate::report::chart::Chart;
use crate::report::page::Page;

/// One program's exam.
#[derive(Clone, Debug)]
pub struct Exam {
    /// How it was run.
    pub run: Run,
    /// Every record.
    pub records: Vec<Scored>,
}

impl Exam {
    /// The program's name without its folders.
    pub fn name(&self) -> String {
        let short = |word: &String| word.rsplit('/').next().unwrap_or(word).to_owned();
        let words: Vec<String> = self.run.program.iter().map(short).collect();
        // an interpreter and its script tell less than the script's first argument
        let is_script = |word: &String| word.starts_with("python") || word.ends_with(".py");
        let skip = words.iter().take(words.len().saturating_sub(1)).take_while(|word| is_script(word)).count();
        words[skip..].join(" ")
    }
}

/// The page; the first exam is the candidate's, the others are rivals. `pictures` belong to the candidate's answers
/// that were not right, by record.
pub fn page(envelope: &Envelope, exams: &[Exam], pictures: &BTreeMap<String, Vec<String>>) -> String {
    let mut page = Page::new("Concealed trial");
    let Some(candidate) = exams.first() else { return page.finish() };
    let sums = summary(&candidate.records);
    page.lead(&format!(
        "{} records answered right; {} false alarms; {} wrong names.",
        sums.right, sums.false_alarms, sums.wrong_names
    ));
    page.prose(
        "The answers were sealed before any diagnosis: the root below was printed first, and every answer, recording and \
         diagnosis was held against its commitment when this page was made. A crash or a time-out counts as wrong. \
         Nothing was run again after looking.",
    );
    facts(&mut page, envelope, &candidate.run);
    page.heading("What was asked, and what came out");
    asked(&mut page, &candidate.records);
    page.heading("Every block");
    by_group(&mut page, "block", &sums.blocks);
    page.prose(
        "Rightly silent: too weak for an analyser that knew the exact shape and the noise. Partly: true names only, but a \
         visible effect or part of a set is missing. Padded: the true name among others that the recording rules out, or \
         in a set of more than three. Unnamed: reported as unknown.",
    );
    if !sums.manners.is_empty() {
        page.prose("The same by how the machine was moved and logged:");
        by_group(&mut page, "manner", &sums.manners);
    }
    page.heading("The same exam for others");
    rivals(&mut page, exams);
    page.heading("Detection against effect size");
    curve(&mut page, exams);
    page.heading("What was hidden, what was named");
    page.prose("Records with one effect or none; a set counts as the true name where it holds it.");
    page.picture(&Matrix::of(&candidate.records).svg());
    page.heading("Stated confidence");
    confidence(&mut page, &candidate.records);
    page.heading("Where it is");
    places(&mut page, &candidate.records);
    page.heading("Stated intervals");
    intervals(&mut page, &candidate.records);
    page.heading("Every answer that was not right");
    wrong(&mut page, &candidate.records, pictures);
    page.finish()
}

fn facts(page: &mut Page, envelope: &Envelope, run: &Run) {
    let mut rows = vec![
        vec!["root".to_owned(), envelope.root()],
        vec!["sealed (s since 1970)".to_owned(), envelope.made_s.to_string()],
        vec!["run started".to_owned(), run.started_s.to_string()],
        vec!["generator".to_owned(), envelope.generator.clone()],
        vec!["program".to_owned(), format!("{} ({})", run.program.join(" "), run.version)],
        vec!["answers hidden by".to_owned(), run.isolation.clone()],
    ];
    rows.extend(run.hashes.iter().map(|(file, hash)| vec![format!("BLAKE3 of {file}"), hash.clone()]));
    page.table(&["what", "value"], &rows);
    if run.isolation == "none" {
        page.warning("A rehearsal: the program could have read the answers.");
    }
}

fn asked(page: &mut Page, records: &[Scored]) {
    let rows: Vec<Vec<String>> = goals(records)
        .into_iter()
        .map(|goal| {
            let met = match goal.is_met {
                Some(true) => "yes",
                Some(false) => "NO",
                None => "-",
            };
            vec![goal.wanted.to_owned(), goal.got, met.to_owned()]
        })
        .collect();
    page.table(&["asked", "came out (95 % interval)", "reached"], &rows);
}

fn by_group(page: &mut Page, what: &str, groups: &Outcomes) {
    let header: Vec<&str> = std::iter::once(what).chain(Outcome::ALL.map(Outcome::name)).collect();
    let rows: Vec<Vec<String>> = groups
        .iter()
        .map(|(name, counts)| {
            std::iter::once(name.clone())
                .chain(Outcome::ALL.iter().map(|outcome| counts.get(outcome).copied().unwrap_or(0).to_string()))
                .collect()
        })
        .collect();
    page.table(&header, &rows);
}

fn rivals(page: &mut Page, exams: &[Exam]) {
    let number = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"));
    let rows: Vec<Vec<String>> = exams
        .iter()
        .map(|exam| {
            let sums = summary(&exam.records);
            vec![
                exam.name(),
                sums.right.part.to_string(),
                sums.false_alarms.to_string(),
                sums.wrong_names.to_string(),
                sums.misses.to_string(),
                sums.padded.part.to_string(),
                sums.flagged.to_string(),
                sums.no_answers.to_string(),
                number(sums.median_gain),
                format!("{:.0}", exam.run.limit_s),
                format!("{:.1}", sums.seconds / exam.records.len().max(1) as f64),
            ]
        })
        .collect();
    page.table(
        &[
            "program",
            "right",
            "false alarms",
            "wrong names",
            "misses",
            "padded",
            "unknown flagged",
            "no answer",
            "gain",
            "limit (s)",
            "s a record",
        ],
        &rows,
    );
    page.prose(
        "Right counts every block. Wrong names are those in records with one, two or three known effects or one that has no \
         name; misses are visible effects left out there and elsewhere. Gain: squared hold-out error removed over what an \
         oracle removes that knows law, effect and every constant, and reads the same motion, the median of records with an \
         effect of 1 % or more; a program that states no hold-out errors has none. PySR, Operon, DJ-STLSQ and LISDD did \
         not sit it.",
    );
}

fn curve(page: &mut Page, exams: &[Exam]) {
    let Some(candidate) = exams.first() else { return };
    let steps = detection(&candidate.records);
    let line = |of: &dyn Fn(&Step) -> Share| {
        steps.iter().map(|step| (step.strength_pct, of(step).value().unwrap_or(f64::NAN))).collect::<Vec<_>>()
    };
    let chart = Chart::new("single effects and sensor faults", "strength (% of drag RMS)", "share of records")
        .log_x()
        .from_zero()
        .height(300.0)
        .dashed("likelihood-ratio limit", line(&|step| step.visible))
        .line("named right", line(&|step| step.named))
        .dotted("noticed", line(&|step| step.detected));
    page.picture(&chart.svg());
    page.prose("The limit: the share of records in which an analyser sees the effect that knows its exact shape and the noise.");
    let others: Vec<(String, Vec<Step>)> =
        exams[1..].iter().map(|exam| (exam.name(), detection(&exam.records))).collect();
    let header: Vec<&str> = ["strength (%)", "limit", "noticed", "named right"]
        .into_iter()
        .chain(others.iter().map(|(name, _)| name.as_str()))
        .collect();
    let rows: Vec<Vec<String>> = steps
        .iter()
        .enumerate()
        .map(|(n, step)| {
            let mut row = vec![
                format!("{:.2}", step.strength_pct),
                step.visible.to_string(),
                step.detected.to_string(),
                step.named.to_string(),
            ];
            // every exam has the same records, and so the same steps
            row.extend(others.iter().map(|(_, steps)| steps.get(n).map_or(0, |step| step.named.part).to_string()));
            row
        })
        .collect();
    page.table(&header, &rows);
}

fn confidence(page: &mut Page, records: &[Scored]) {
    let bins = reliability(records);
    if bins.is_empty() {
        page.prose("Nothing was named.");
        return;
    }
    let chart = Chart::new("stated against true", "stated confidence", "share true")
        .from_zero()
        .height(240.0)
        .dashed("perfect", vec![(0.0, 0.0), (1.0, 1.0)])
        // one standard deviation of a share
        .points(
            "entries",
            bins.iter()
                .map(|bin| {
                    let deviation = (bin.is_true * (1.0 - bin.is_true) / bin.entries as f64).sqrt();
                    (bin.stated, bin.is_true, deviation)
                })
                .collect(),
        );
    page.picture(&chart.svg());
    let rows: Vec<Vec<String>> = bins
        .iter()
        .map(|bin| vec![format!("{:.3}", bin.stated), format!("{:.3}", bin.is_true), bin.entries.to_string()])
        .collect();
    page.table(&["stated", "true", "entries"], &rows);
    if let Some(error) = summary(records).calibration_error {
        page.prose(&format!(
            "Expected calibration error: {error:.3}, the mean distance of the two, weighted by entries."
        ));
    }
}

fn places(page: &mut Page, records: &[Scored]) {
    let sums = summary(records);
    let mut blocks: Vec<&str> = records.iter().map(|record| record.block.as_str()).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let is_right = |r: &Scored| r.location.as_ref().is_some_and(|place| place.is_right);
    let rows: Vec<Vec<String>> = blocks
        .iter()
        .map(|block| (block, share(records, |r| r.block == *block && r.location.is_some(), is_right)))
        .filter(|(_, hits)| hits.of > 0)
        .map(|(block, hits)| vec![(*block).to_owned(), hits.to_string()])
        .collect();
    if rows.is_empty() {
        page.prose("No place was stated.");
        return;
    }
    page.table(&["block", "right axis"], &rows);
    let f1 = sums.median_f1.map_or_else(|| "-".to_owned(), |f1| format!("{f1:.2}"));
    page.prose(&format!(
        "{} right axes: the place with the largest share lies on a variable of the hidden effect's own equation (a period \
         within 5 %). Median agreement of the stretch, F1 in samples against the shortest one with 80 % of the effect's \
         energy: {f1}.",
        sums.axes
    ));
}

fn intervals(page: &mut Page, records: &[Scored]) {
    let mut by_name: BTreeMap<&str, (usize, usize, usize)> = BTreeMap::new();
    for interval in records.iter().flat_map(|record| &record.intervals) {
        let counts = by_name.entry(&interval.parameter).or_default();
        *counts = (counts.0 + usize::from(interval.is_in_90), counts.1 + usize::from(interval.is_in_95), counts.2 + 1);
    }
    let rows: Vec<Vec<String>> = by_name
        .iter()
        .map(|(name, (in_90, in_95, of))| {
            vec![(*name).to_owned(), format!("{in_90} of {of}"), format!("{in_95} of {of}")]
        })
        .collect();
    if !rows.is_empty() {
        page.table(&["number", "in 90 %", "in 95 %"], &rows);
    }
    page.prose(&format!(
        "Compared are the numbers that mean the same in generator and analyser, where the effect was named by its own id: {}. \
         All other effects are written by other forms on purpose. The hold-out gain leaves out {}, whose recorded \
         force or motion has no noise-free twin.",
        COMPARABLE.join(", "),
        WITHOUT_ORACLE.join(", ")
    ));
}

fn wrong(page: &mut Page, records: &[Scored], pictures: &BTreeMap<String, Vec<String>>) {
    let listed: Vec<&Scored> = records.iter().filter(|record| !record.outcome.is_right()).collect();
    if listed.is_empty() {
        page.prose("None.");
        return;
    }
    page.prose(
        "Before: recorded less simulated, with the simulation's constants moved as the diagnosis moved them. After: with \
         what it added. Hidden: the true noise-free force less the same simulation. Means over cells.",
    );
    for record in listed {
        let hidden = if record.hidden.is_empty() { "nothing".to_owned() } else { record.hidden.join(", ") };
        let answer = if record.named.is_empty() { record.verdict.clone() } else { record.named.join(", ") };
        page.table(
            &["record", "block", "outcome", "hidden", "answer", "noise", "ideal score"],
            &[vec![
                record.id.clone(),
                record.block.clone(),
                record.outcome.name().to_owned(),
                hidden,
                answer,
                record.noise.clone(),
                format!("{:.1}", record.ideal_z),
            ]],
        );
        for picture in pictures.get(&record.id).into_iter().flatten() {
            page.picture(picture);
        }
    }
}
