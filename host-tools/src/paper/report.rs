//! The comparison as text, as JSON and as a page with the Stribeck picture.

use std::fmt::Write;

use model_core::reference::zhou_2023::{FRICTION, GUIDE};

use super::claims::{Findings, Verdict, summary};
use super::convention::{C2, C6, CONVENTIONS, QUOTED_MINIMA};
use crate::report::chart::Chart;
use crate::report::page::Page;

/// The comparison for a terminal: plain words, then the tables.
pub fn text(findings: &Findings) -> String {
    let mut out = String::new();
    // writing into a String cannot fail
    for line in summary(findings) {
        let _ = writeln!(out, "{line}");
    }
    let _ = writeln!(out, "\nSTATEMENTS THAT NO READING OF THE UNITS CHANGES");
    for claim in &findings.claims {
        let _ = writeln!(out, "\n{:<22} {} - {}", claim.verdict, claim.place, claim.about);
        let difference =
            if claim.difference.is_empty() { String::new() } else { format!("   difference {}", claim.difference) };
        let _ = writeln!(out, "{:<22} stated {}   computed {}{difference}", "", claim.stated, claim.computed);
    }
    let _ = writeln!(out, "\nREADINGS OF THE HERSEY NUMBER");
    for (convention, score) in CONVENTIONS.iter().zip(&findings.scores) {
        let _ = writeln!(
            out,
            "{}  {:<44} k_s H {} to {}",
            convention.name,
            convention.reading,
            short(score.exponent.0),
            short(score.exponent.1)
        );
    }
    let _ = writeln!(out, "\nSTATEMENTS ABOUT THE MEASURED GRID (+ holds, - contradicted)");
    for claim in &findings.grid {
        let _ = writeln!(out, "\n{}: {}", claim.place, claim.stated);
        for (convention, ruling) in CONVENTIONS.iter().zip(&claim.rulings) {
            let _ = writeln!(out, "  {} {}  {}", mark(ruling.verdict), convention.name, ruling.computed);
        }
    }
    out
}

/// Four digits at most, whatever the magnitude.
fn short(value: f64) -> String {
    if (0.01..1e4).contains(&value) {
        let decimals = if value < 1.0 {
            4
        } else if value < 100.0 {
            2
        } else {
            0
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.1e}")
    }
}

fn mark(verdict: Verdict) -> char {
    match verdict {
        Verdict::Holds | Verdict::WithinRounding => '+',
        Verdict::Contradicted => '-',
        Verdict::CannotBeChecked => '?',
    }
}

/// The comparison as one JSON object, without the line's end.
pub fn json(findings: &Findings) -> String {
    let readings: Vec<_> = CONVENTIONS
        .iter()
        .zip(&findings.scores)
        .map(|(c, score)| {
            serde_json::json!({
                "name": c.name, "reading": c.reading, "viscosity_number": c.viscosity_number,
                "hersey_speed": c.speed, "score": score,
            })
        })
        .collect();
    serde_json::json!({
        "schema": "guideblock.paper/1",
        "summary": summary(findings),
        "claims": findings.claims,
        "readings": readings,
        "grid": findings.grid,
    })
    .to_string()
}

/// The curve of Eq. 20 with what the paper quotes and what the readings cover.
pub fn stribeck_picture(findings: &Findings) -> String {
    let (from, to) = (1e-13_f64, 1e-9_f64);
    let curve = (0..=400).map(|n| from * (to / from).powf(f64::from(n) / 400.0)).map(|h| (h, FRICTION.coefficient(h)));
    let lowest = FRICTION.hersey_of_minimum();
    let smallest = FRICTION.coefficient(lowest);
    let mut chart = Chart::new(
        "Friction over Hersey number: the paper's curve and its own quoted minima",
        "Hersey number, in the paper's unit",
        "friction coefficient",
    )
    .log_x()
    .height(380.0)
    .line("Eq. 20", curve.take_while(|(_, mu)| *mu < 0.0052).collect())
    .points("smallest value of Eq. 20", vec![(lowest, smallest, 0.0)])
    .note(0.28 * lowest, 0.945 * smallest, &format!("{smallest:.7}"));
    for (place, name) in [(C6, "quoted minima, read as C6"), (C2, "quoted minima, read as C2")] {
        let convention = &CONVENTIONS[place];
        let model = convention.model(GUIDE.conformity_slider);
        let points = QUOTED_MINIMA
            .iter()
            .filter_map(|&(force, mu, speed)| {
                let q = model.load_of_lateral_force(force)?;
                Some((convention.hersey(&model, q, speed), mu, 0.0))
            })
            .collect::<Vec<_>>();
        for ((force, mu, _), point) in QUOTED_MINIMA.iter().zip(&points) {
            chart = chart.note(point.0, point.1, &format!("{mu:.5} at {force:.0} N"));
        }
        chart = chart.points(name, points);
    }
    if let Some(score) = findings.scores.get(C6) {
        chart = chart.region(score.hersey.0, score.hersey.1, "measured grid, read as C6");
    }
    chart.svg()
}

/// The comparison as a self-contained page.
pub fn page(findings: &Findings) -> String {
    let mut page = Page::new("What Zhou et al. 2023 state, and what their equations give");
    for line in summary(findings) {
        page.lead(&line);
    }
    page.picture(&stribeck_picture(findings));
    page.prose(
        "The line is Eq. 20. The quoted minima are friction coefficients at 500 and 1500 N and 0.6 m/min; where they \
         stand on the abscissa depends on the reading of the units, how far they lie below the curve's smallest value \
         does not.",
    );
    page.heading("Statements that no reading of the units changes");
    let rows: Vec<Vec<String>> = findings
        .claims
        .iter()
        .map(|c| {
            vec![
                c.place.to_owned(),
                c.about.to_owned(),
                c.stated.clone(),
                c.computed.clone(),
                c.difference.clone(),
                c.verdict.to_string(),
            ]
        })
        .collect();
    page.table(&["place", "about", "stated", "computed", "difference", "verdict"], &rows);
    page.heading("Readings of the Hersey number");
    let rows: Vec<Vec<String>> = CONVENTIONS
        .iter()
        .zip(&findings.scores)
        .map(|(c, s)| {
            vec![c.name.to_owned(), c.reading.to_owned(), format!("{} to {}", short(s.exponent.0), short(s.exponent.1))]
        })
        .collect();
    page.table(&["name", "reading", "k_s H on the measured grid"], &rows);
    page.heading("Statements about the measured grid, under every reading");
    page.prose("+ holds, − contradicted.");
    let mut header = vec!["place", "stated"];
    header.extend(CONVENTIONS.iter().map(|c| c.name));
    let rows: Vec<Vec<String>> = findings
        .grid
        .iter()
        .map(|claim| {
            let mut row = vec![claim.place.to_owned(), claim.stated.to_owned()];
            row.extend(claim.rulings.iter().map(|r| {
                let mark = if mark(r.verdict) == '-' { '−' } else { mark(r.verdict) };
                format!("({mark}) {}", r.computed)
            }));
            row
        })
        .collect();
    page.table(&header, &rows);
    page.finish()
}
