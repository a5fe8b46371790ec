//! A calibration as a page for people.

use std::collections::BTreeMap;

use calibration::axis_curve::{Point, Selection};
use calibration::levels::levels;

use super::{Calibration, axis_words, guide_words};
use crate::report::chart::{Chart, Map};
use crate::report::page::Page;

/// Points of a drawn curve.
const POINTS: usize = 200;

/// The page of a guide.
pub fn guide(name: &str, found: &Calibration) -> String {
    let mut page = Page::new(&format!("Friction law from {name}"));
    let fit = &found.fit;
    page.lead(&format!(
        "{} strokes give mu(H) = {:.4e} + {:.4e} H + {:.4e} exp(-{:.4e} H).",
        found.cells.len(),
        fit.friction.mu_coulomb,
        fit.friction.mu_viscous,
        fit.friction.mu_stribeck,
        fit.friction.stribeck_exponent
    ));
    for sentence in [guide_words::decision(found), guide_words::directions(found), guide_words::pattern(found)] {
        page.prose(&sentence);
    }
    let loaded = || found.grid.iter().filter(|c| c.friction.is_finite() && c.hersey > 0.0);
    let (least, most) = loaded().fold((f64::INFINITY, 0.0f64), |(a, b), c| (a.min(c.hersey), b.max(c.hersey)));
    let at = |n: usize| least * (most / least).powf(n as f64 / (POINTS - 1) as f64);
    let curve = |of: &dyn Fn(f64) -> (f64, f64)| -> Vec<(f64, f64, f64)> {
        (0..POINTS).map(at).map(|h| (h, of(h).0, of(h).1)).collect()
    };
    let law = |h: f64| fit.friction.coefficient(h);
    let two = |h: f64| 2.0 * law(h) * fit.friction_uncertainty(h);
    let chart = Chart::new("Stribeck curve", "Hersey number", "friction coefficient")
        .log_x()
        .points(
            "strokes, mean and two standard deviations",
            loaded().map(|c| (c.hersey, c.friction, 2.0 * c.friction_sigma)).collect(),
        )
        .band("two standard deviations of the law", curve(&|h| (law(h) - two(h), law(h) + two(h))))
        .line("fitted law", curve(&|h| (law(h), 0.0)).into_iter().map(|(h, y, _)| (h, y)).collect());
    page.heading("Friction coefficient over the Hersey number").picture(&chart.svg());
    constants(&mut page, found);
    residuals(&mut page, found);
    page.heading("What these strokes leave open").list(found.doubts.iter().map(|d| &d.text));
    page.heading("Guide");
    let rows: Vec<Vec<String>> = found
        .set
        .entries()
        .iter()
        .filter(|e| !e.key.starts_with("mu_") && e.key != "stribeck_exponent")
        .map(|e| vec![e.key.to_owned(), e.value.to_string(), e.provenance.to_string()])
        .collect();
    page.table(&["key", "value", "where from"], &rows);
    page.finish()
}

fn constants(page: &mut Page, found: &Calibration) {
    let number = |x: f64| if x.is_finite() { format!("{x:.5e}") } else { "open".to_owned() };
    let rows: Vec<Vec<String>> = found
        .constants
        .iter()
        .map(|c| {
            vec![
                c.name.to_owned(),
                number(c.value),
                number(c.sigma),
                number(c.ci95.from),
                number(c.ci95.to),
                if c.is_determined { "yes" } else { "no" }.to_owned(),
            ]
        })
        .collect();
    page.heading("Constants");
    page.table(&["constant", "value", "sigma", "95 % from", "95 % to", "determined"], &rows);
}

/// The residual map: loads downwards, speeds to the right, a map a direction.
fn residuals(page: &mut Page, found: &Calibration) {
    page.heading("Residuals over load and speed");
    page.prose("Measured less fitted, in standard deviations of the cell's mean. Chance alone leaves most within 2 and no pattern.");
    let (load_of, loads) = levels(&found.grid.iter().map(|c| c.reference_n).collect::<Vec<_>>());
    let (speed_of, speeds) = levels(&found.grid.iter().map(|c| c.speed_m_s).collect::<Vec<_>>());
    let columns: Vec<String> = speeds.iter().map(|v| format!("{v:.4}")).collect();
    let rows: Vec<String> = loads.iter().map(|f| format!("{f:.0} N")).collect();
    let mut maps: BTreeMap<bool, Vec<Vec<f64>>> = BTreeMap::new();
    for (n, cell) in found.grid.iter().enumerate() {
        let map = maps.entry(cell.direction < 0.0).or_insert_with(|| vec![vec![f64::NAN; speeds.len()]; loads.len()]);
        map[load_of[n]][speed_of[n]] = cell.residual;
    }
    for (is_back, values) in &maps {
        let title = if *is_back { "Direction -1" } else { "Direction +1" };
        let map = Map {
            title,
            columns: ("speed (m/s)", &columns),
            rows: ("load", &rows),
            values,
            quantity: "residual over sigma",
        };
        page.picture(&map.svg());
    }
}

/// The page of an axis.
pub fn axis(name: &str, points: &[Point], found: &Selection) -> String {
    let mut page = Page::new(&format!("Friction over speed from {name}"));
    page.lead(&axis_words::verdict(found));
    let side = |back: bool| -> Vec<(f64, f64, f64)> {
        points.iter().filter(|p| (p.velocity < 0.0) == back).map(|p| (p.velocity.abs(), p.force.abs(), 0.0)).collect()
    };
    let top = points.iter().fold(0.0, |m: f64, p| m.max(p.velocity.abs()));
    let curve = |d: f64| -> Vec<(f64, f64)> {
        (1..=POINTS).map(|n| top * n as f64 / POINTS as f64).map(|v| (v, (found.curve.force(d * v)).abs())).collect()
    };
    let mut chart =
        Chart::new("Friction over speed", "speed (m/s, or as mapped)", "force against the motion (N, or as mapped)");
    if !side(false).is_empty() {
        chart = chart.points("measured, +", side(false)).line("law, +", curve(1.0));
    }
    if !side(true).is_empty() {
        chart = chart.points("measured, -", side(true)).dashed("law, -", curve(-1.0));
    }
    page.heading("Measured and fitted").picture(&chart.svg());
    page.heading("Which terms are supported");
    page.prose("Every law foretells one speed from all others, one after another. A longer law is taken when its squared errors are smaller by more than the standard error of the difference.");
    let rows: Vec<Vec<String>> =
        found.trials.iter().map(|t| vec![t.terms.name().to_owned(), format!("{:.4e}", t.error)]).collect();
    page.table(&["law", "error at a speed left out"], &rows);
    page.heading("Constants").list(axis_words::describe(found).iter().skip(3 + found.trials.len()));
    page.finish()
}
