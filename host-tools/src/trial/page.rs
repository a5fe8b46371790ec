//! One page of a trial: what was sealed, what came out, rivals beside it, every wrong answer.

use std::collections::{BTreeMap, BTreeSet};

use super::envelope::Envelope;
use super::runner::Run;
use super::score::{Outcome, Scored, Summary, detection, reliability, summary};
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
    fn name(&self) -> String {
        let short = |word: &String| word.rsplit('/').next().unwrap_or(word).to_owned();
        self.run.program.iter().map(short).collect::<Vec<_>>().join(" ")
    }
}

const OUTCOMES: [Outcome; 8] = [
    Outcome::Right,
    Outcome::RightlySilent,
    Outcome::Partly,
    Outcome::Missed,
    Outcome::Unnamed,
    Outcome::FalseAlarm,
    Outcome::WrongName,
    Outcome::NoAnswer,
];

/// The page; the first exam is the candidate's, the others are rivals.
pub fn page(envelope: &Envelope, exams: &[Exam]) -> String {
    let mut page = Page::new("Concealed trial");
    let Some(candidate) = exams.first() else { return page.finish() };
    let sums = summary(&candidate.records);
    let right = candidate.records.iter().filter(|record| record.outcome.is_right()).count();
    page.lead(&format!(
        "{right} of {} records answered right; {} false alarms in {}; {} wrong names in {}.",
        candidate.records.len(),
        sums.false_alarms.0,
        sums.false_alarms.1,
        sums.wrong_names.0,
        sums.wrong_names.1
    ));
    page.prose(
        "The answers were sealed before any diagnosis: the root below was printed first, and every answer, recording and \
         diagnosis was held against its commitment when this page was made. A crash or a time-out counts as wrong.",
    );
    facts(&mut page, envelope, &candidate.run);
    page.heading("Every block");
    blocks(&mut page, &sums);
    page.heading("The same exam for others");
    rivals(&mut page, exams);
    page.heading("Detection against effect size");
    curve(&mut page, exams);
    confusion(&mut page, &candidate.records);
    confidence(&mut page, &candidate.records);
    wrong(&mut page, &candidate.records);
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
    rows.extend(
        run.hashes
            .iter()
            .map(|(file, hash)| vec![format!("BLAKE3 of {}", file.rsplit('/').next().unwrap_or(file)), hash.clone()]),
    );
    page.table(&["what", "value"], &rows);
    if run.isolation == "none" {
        page.warning("A rehearsal: the program could have read the answers.");
    }
}

fn blocks(page: &mut Page, sums: &Summary) {
    let header: Vec<&str> = std::iter::once("block").chain(OUTCOMES.map(Outcome::name)).collect();
    let rows: Vec<Vec<String>> = sums
        .blocks
        .iter()
        .map(|(block, counts)| {
            std::iter::once(block.clone())
                .chain(OUTCOMES.iter().map(|outcome| counts.get(outcome).copied().unwrap_or(0).to_string()))
                .collect()
        })
        .collect();
    page.table(&header, &rows);
    page.prose(
        "Partly: true names only, but a visible effect or part of a set is missing. Unnamed: reported as unknown. \
         Rightly silent: too weak for an analyser that knew the exact shape and the noise.",
    );
}

fn rivals(page: &mut Page, exams: &[Exam]) {
    let of = |(part, all): (usize, usize)| format!("{part} of {all}");
    let rows: Vec<Vec<String>> = exams
        .iter()
        .map(|exam| {
            let sums = summary(&exam.records);
            vec![
                exam.name(),
                exam.records.iter().filter(|record| record.outcome.is_right()).count().to_string(),
                of(sums.false_alarms),
                of(sums.wrong_names),
                of(sums.misses),
                of(sums.flagged),
                sums.no_answers.to_string(),
                sums.median_gain.map_or_else(|| "-".to_owned(), |gain| format!("{gain:.3}")),
                format!("{:.0}", sums.seconds),
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
            "unknown flagged",
            "no answer",
            "gain",
            "time (s)",
        ],
        &rows,
    );
}

fn curve(page: &mut Page, exams: &[Exam]) {
    let mut chart = Chart::new("named right, single effects", "strength (% of drag RMS)", "share").log_x().from_zero();
    for (n, exam) in exams.iter().enumerate() {
        let steps = detection(&exam.records);
        if n == 0 {
            chart = chart.dashed("likelihood-ratio limit", steps.iter().map(|s| (s.0, s.2)).collect());
        }
        chart = chart.line(&exam.name(), steps.iter().map(|s| (s.0, s.1)).collect());
    }
    page.picture(&chart.svg());
}

fn confusion(page: &mut Page, records: &[Scored]) {
    page.heading("What was hidden, what was named");
    let id = |text: &String| text.split(' ').next().unwrap_or_default().to_owned();
    let mut counts: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for record in records.iter().filter(|record| record.hidden.len() < 2) {
        let hidden = record.hidden.first().map_or_else(|| "nothing".to_owned(), id);
        let named: BTreeSet<String> = if record.named.is_empty() {
            std::iter::once(record.verdict.clone()).collect()
        } else {
            record.named.iter().map(id).collect()
        };
        for name in named {
            *counts.entry(hidden.clone()).or_default().entry(name).or_default() += 1;
        }
    }
    let rows: Vec<Vec<String>> = counts
        .iter()
        .map(|(hidden, named)| {
            let text: Vec<String> = named.iter().map(|(name, n)| format!("{name} × {n}")).collect();
            vec![hidden.clone(), text.join(", ")]
        })
        .collect();
    page.prose("Records with one effect or none; an answer without names stands as its verdict.");
    page.table(&["hidden", "answers"], &rows);
}

fn confidence(page: &mut Page, records: &[Scored]) {
    page.heading("Stated confidence");
    let bins = reliability(records);
    if bins.is_empty() {
        page.prose("Nothing was named.");
        return;
    }
    let chart = Chart::new("stated against true", "stated confidence", "share true")
        .from_zero()
        .dashed("perfect", vec![(0.0, 0.0), (1.0, 1.0)])
        // one standard deviation of a share
        .points("entries", bins.iter().map(|(s, t, n)| (*s, *t, (t * (1.0 - t) / *n as f64).sqrt())).collect());
    page.picture(&chart.svg());
}

fn wrong(page: &mut Page, records: &[Scored]) {
    page.heading("Every answer that was not right");
    let rows: Vec<Vec<String>> = records
        .iter()
        .filter(|record| !record.outcome.is_right())
        .map(|record| {
            vec![
                record.id.clone(),
                record.block.clone(),
                record.outcome.name().to_owned(),
                if record.hidden.is_empty() { "nothing".to_owned() } else { record.hidden.join(", ") },
                if record.named.is_empty() { record.verdict.clone() } else { record.named.join(", ") },
                record.noise.clone(),
                format!("{:.1}", record.ideal_z),
            ]
        })
        .collect();
    if rows.is_empty() {
        page.prose("None.");
    } else {
        page.table(&["record", "block", "outcome", "hidden", "answer", "noise", "ideal score"], &rows);
    }
}
