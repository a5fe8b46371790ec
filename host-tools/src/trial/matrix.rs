//! The confusion matrix as a picture: hidden effects as rows, named ones as columns.
//!
//! On the diagonal, in blue, stand true names; beside it, in orange, false ones; in grey what is neither: a match, an
//! unknown. Numbers stand in the cells, so that no meaning rests on colour alone.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::score::Scored;

const LEFT: f64 = 190.0;
const TOP: f64 = 170.0;
const WIDTH: f64 = 1000.0;
const ROW: f64 = 17.0;
/// Widest cell, px.
const WIDEST: f64 = 34.0;

const STYLE: &str = "\
.m text{font:11px system-ui,'Segoe UI','DejaVu Sans',sans-serif;fill:#1b1f23}.m .head{font-size:17px;font-weight:600}.m .n{text-anchor:middle}\
.m .paper{fill:#fff}.m .grid{stroke:#d8dee4}.m .good{fill:#56b4e9}.m .bad{fill:#e69f00}.m .other{fill:#8c959f}\
@media screen and (prefers-color-scheme:dark){.m text{fill:#e6edf3}.m .paper{fill:#0d1117}.m .grid{stroke:#30363d}\
.m .good{fill:#0072b2}.m .bad{fill:#a35200}.m .other{fill:#57606a}}";

/// Count and kind of a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Cell {
    count: usize,
    is_true: bool,
}

/// What stands in a column when nothing was named.
const SILENT: [&str; 4] = ["match", "unknown", "insufficient-data", "no answer"];

/// The matrix of records that hide one effect or nothing. A set counts as the true id where it holds it.
#[derive(Clone, Debug, Default)]
pub struct Matrix {
    cells: BTreeMap<(String, String), Cell>,
}

impl Matrix {
    /// Counts.
    pub fn of(records: &[Scored]) -> Self {
        let mut matrix = Matrix::default();
        for record in records.iter().filter(|record| record.hidden.len() < 2) {
            let hidden = record.hidden.first().and_then(|text| text.split(' ').next()).unwrap_or("nothing");
            let mut named: BTreeSet<(String, bool)> = BTreeSet::new();
            for (set, (_, is_true)) in record.named.iter().zip(&record.confidences) {
                let leads = set.split(" or ").next().unwrap_or(set);
                let name = if *is_true { hidden } else { leads };
                named.insert((name.to_owned(), *is_true));
            }
            if named.is_empty() {
                let verdict = if SILENT.contains(&record.verdict.as_str()) { &record.verdict } else { "no answer" };
                let is_true = hidden == "nothing" && verdict == "match";
                named.insert((verdict.to_owned(), is_true));
            }
            for (name, is_true) in named {
                let cell = matrix.cells.entry((hidden.to_owned(), name)).or_default();
                cell.count += 1;
                cell.is_true |= is_true;
            }
        }
        matrix
    }

    /// Number of records with this hidden effect and this answer.
    pub fn count(&self, hidden: &str, named: &str) -> usize {
        self.cells.get(&(hidden.to_owned(), named.to_owned())).map_or(0, |cell| cell.count)
    }

    /// The picture, 1000 px wide.
    pub fn svg(&self) -> String {
        let rows: Vec<&str> =
            self.cells.keys().map(|(hidden, _)| hidden.as_str()).collect::<BTreeSet<_>>().into_iter().collect();
        let named: BTreeSet<&str> = self.cells.keys().map(|(_, named)| named.as_str()).collect();
        // the order of the rows makes a diagonal; what names nothing stands last
        let mut columns: Vec<&str> =
            rows.iter().copied().filter(|id| named.contains(id) && !SILENT.contains(id)).collect();
        columns.extend(named.iter().filter(|id| !rows.contains(id) && !SILENT.contains(id)));
        columns.extend(SILENT.iter().filter(|id| named.contains(**id)));
        let width = ((WIDTH - LEFT - 20.0) / columns.len().max(1) as f64).min(WIDEST);
        let mut out = String::new();
        // writing into a String cannot fail
        let _ =
            writeln!(out, "<text class=\"head\" x=\"8\" y=\"24\">Hidden, row by row; named, column by column</text>");
        for (c, name) in columns.iter().enumerate() {
            let x = LEFT + width * (c as f64 + 0.5) + 4.0;
            let _ = writeln!(out, "<text transform=\"translate({x:.1} {:.1}) rotate(-60)\">{name}</text>", TOP - 8.0);
        }
        for (r, hidden) in rows.iter().enumerate() {
            let y = TOP + ROW * r as f64;
            let total: usize = columns.iter().map(|named| self.count(hidden, named)).sum();
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M8 {:.1}H{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{hidden}</text>",
                y + ROW,
                LEFT + width * columns.len() as f64,
                LEFT - 8.0,
                y + 12.5
            );
            for (c, named) in columns.iter().enumerate() {
                let Some(cell) = self.cells.get(&((*hidden).to_owned(), (*named).to_owned())) else { continue };
                let class = match (cell.is_true, SILENT.contains(named)) {
                    (true, _) => "good",
                    (false, true) => "other",
                    (false, false) => "bad",
                };
                let x = LEFT + width * c as f64;
                let _ = writeln!(
                    out,
                    "<rect class=\"{class}\" fill-opacity=\"{:.2}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>\
                     <text class=\"n\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                    0.25 + 0.75 * cell.count as f64 / total.max(1) as f64,
                    width - 1.0,
                    ROW - 1.0,
                    x + 0.5 * width,
                    y + 12.5,
                    cell.count
                );
            }
        }
        let height = TOP + ROW * rows.len() as f64 + 10.0;
        format!(
            "<svg class=\"m\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" \
             aria-label=\"confusion matrix\">\n<style>{STYLE}</style>\n\
             <rect class=\"paper\" width=\"{WIDTH}\" height=\"{height:.0}\"/>\n{out}</svg>\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::score::Outcome;
    use super::super::score::tally::tests::record;
    use super::*;

    #[test]
    fn true_names_stand_on_the_diagonal_and_silence_stands_last() {
        let said = |named: &str, is_true: bool, verdict: &str| {
            let mut one = record("single", Outcome::Right);
            one.verdict = verdict.into();
            if !named.is_empty() {
                one.named = vec![named.into()];
                one.confidences = vec![(0.9, is_true)];
            }
            one
        };
        let mut clean = record("clean", Outcome::Right);
        clean.verdict = "match".into();
        let matrix = Matrix::of(&[
            said("run-in or seal-drag", true, "ambiguous"),
            said("run-in", false, "explained"),
            said("", false, "match"),
            said("", false, "time-out"),
            clean,
        ]);
        let counts = ["seal-drag", "run-in", "match", "no answer"].map(|named| matrix.count("seal-drag", named));
        assert_eq!(counts, [1, 1, 1, 1]);
        assert_eq!(matrix.count("nothing", "match"), 1);
        let svg = matrix.svg();
        assert_eq!(svg.matches("class=\"good\"").count(), 2);
        assert_eq!(svg.matches("class=\"bad\"").count(), 1);
        assert_eq!(svg.matches("class=\"other\"").count(), 2);
    }
}
