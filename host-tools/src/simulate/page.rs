//! A simulated force as a page for people.

use simulation::motion::Motion;

use crate::report::chart::Chart;
use crate::report::page::Page;

/// Largest number of drawn points of a cloud.
const MOST_POINTS: usize = 3000;

/// A force over the rows of a run; NaN where there is none.
pub type Series<'a> = (&'a str, &'a [f64]);

/// Makes the page: what was asked for in a sentence, each force over time and over the velocity, and facts in a table.
///
/// The last series is drawn on top.
pub fn page(
    title: &str,
    lead: &str,
    time_s: &[f64],
    motion: &Motion,
    forces: &[Series],
    facts: &[Vec<String>],
) -> String {
    let mut page = Page::new(title);
    page.lead(lead);
    let (mut over_time, mut over_speed) = (
        Chart::new("Force over time", "time (s)", "force of the drive (N)"),
        Chart::new("Force over velocity", "velocity (m/s)", "force of the drive (N)").from_zero(),
    );
    let stride = time_s.len().div_ceil(MOST_POINTS).max(1);
    for (n, (name, force)) in forces.iter().enumerate() {
        let line = time_s.iter().copied().zip(force.iter().copied()).collect();
        // can be told apart without colour, too
        over_time = if n == 0 { over_time.line(name, line) } else { over_time.dashed(name, line) };
        let points = motion.velocity_m_s.iter().zip(*force).step_by(stride).filter(|(_, f)| f.is_finite());
        over_speed = over_speed.points(name, points.map(|(v, f)| (*v, *f, 0.0)).collect());
    }
    let travel = Chart::new("Motion", "time (s)", "velocity (m/s)")
        .height(200.0)
        .line("velocity", time_s.iter().copied().zip(motion.velocity_m_s.iter().copied()).collect());
    page.heading("Over time").picture(&over_time.svg()).picture(&travel.svg());
    page.heading("Over velocity").picture(&over_speed.svg());
    if stride > 1 {
        page.prose(&format!("One of {stride} samples is drawn over the velocity."));
    }
    page.heading("In numbers").table(&["", "value"], facts);
    page.finish()
}
