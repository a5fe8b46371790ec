//! A simulated recording as a page for people.

use simulation::run::Run;

use crate::report::chart::Chart;
use crate::report::page::Page;

/// Makes the page; `facts` are said in words.
pub fn page(title: &str, run: &Run, facts: &[String]) -> String {
    let mut page = Page::new(title);
    for fact in facts {
        page.prose(fact);
    }
    let over = |name: &str, unit: &str, column: &[f64]| {
        Chart::new(name, "time (s)", unit).line(name, run.time_s.iter().copied().zip(column.iter().copied()).collect())
    };
    page.heading("Over time");
    page.picture(&over("drag force", "drag force (N)", &run.drag_force_n).svg());
    if let Some(x) = &run.position_m {
        page.picture(&over("position", "position (m)", x).height(240.0).svg());
    }
    if let Some(v) = &run.velocity_m_s {
        let points = v.iter().copied().zip(run.drag_force_n.iter().copied()).collect();
        let chart = Chart::new("Force over velocity", "velocity (m/s)", "drag force (N)").line("drag force", points);
        page.heading("Over velocity").picture(&chart.svg());
    }
    if let (Some(block), Some(rail)) = (&run.temperature_block_degc, &run.temperature_rail_degc) {
        let line = |column: &[f64]| run.time_s.iter().copied().zip(column.iter().copied()).collect::<Vec<_>>();
        let chart = Chart::new("Temperature", "time (s)", "temperature (°C)")
            .line("block", line(block))
            .dashed("rail", line(rail))
            .height(280.0);
        page.heading("Temperature").picture(&chart.svg());
    }
    page.finish()
}
