//! The estimates of a recording as a page for people.

use calibration::staircase::Staircase;

use super::{Estimate, Summary};
use crate::report::chart::Chart;
use crate::report::page::Page;

/// Makes the page; `lead` is the answer in a sentence, `warning` what has to be known of the law.
pub fn page(
    name: &str,
    lead: &str,
    warning: Option<&str>,
    estimates: &[Estimate],
    summary: &Summary,
    staircase: Option<&Staircase>,
) -> String {
    let mut page = Page::new(&format!("Preload in {name}"));
    page.lead(lead);
    if let Some(warning) = warning {
        page.warning(warning);
    }
    let band = |e: &Estimate| e.preload.map_or((f64::NAN, f64::NAN), |p| p.band());
    let value = |e: &Estimate| e.preload.map_or(f64::NAN, |p| p.value_n);
    let over_time = Chart::new("Preload over time", "time (s)", "preload (N)")
        .band("two standard deviations", estimates.iter().map(|e| (e.window.time_s, band(e).0, band(e).1)).collect())
        .line("preload", estimates.iter().map(|e| (e.window.time_s, value(e))).collect());
    page.heading("Over time").picture(&over_time.svg());
    if !summary.places.is_empty() {
        let noise = |e: &Estimate| e.preload.map_or(f64::NAN, |p| 2.0 * p.noise_n);
        let over_position = Chart::new("Preload over position", "position (m)", "preload (N)").points(
            "window, two standard deviations of its noise",
            estimates.iter().map(|e| (e.window.position_m, value(e), noise(e))).collect(),
        );
        page.heading("Over position").picture(&over_position.svg());
        let rows: Vec<Vec<String>> = summary
            .places
            .iter()
            .map(|p| {
                vec![
                    format!("{:.4}", p.from_m),
                    format!("{:.4}", p.to_m),
                    p.windows.to_string(),
                    number(p.preload_n),
                    number(p.noise_n),
                ]
            })
            .collect();
        page.table(&["from (m)", "to (m)", "windows", "median preload (N)", "sigma of the noise (N)"], &rows);
    }
    if let Some(found) = staircase {
        page.heading("One preload for all speeds");
        let row = |name: &str, f: &calibration::staircase::Fitted| {
            vec![name.to_owned(), number(f.value), number(f.interval[0]), number(f.interval[1])]
        };
        let mut rows = vec![row("preload (N)", &found.preload_n)];
        rows.extend(found.seal_drag_n.as_ref().map(|f| row("constant seal drag (N)", f)));
        page.table(&["", "value", "95 % from", "95 % to"], &rows);
        page.prose(&format!("Sum of squared residuals over the degrees of freedom: {:.2}.", found.chi2_per_freedom));
    }
    if !summary.refused.is_empty() {
        page.heading("Windows without a preload");
        let rows: Vec<Vec<String>> =
            summary.refused.iter().map(|(reason, n)| vec![reason.name().to_owned(), n.to_string()]).collect();
        page.table(&["reason", "windows"], &rows);
    }
    page.finish()
}

/// A number for a table; nothing where there is none.
fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.2}") } else { String::new() }
}
