//! Sessions: consecutive recordings joined to one, so that heat, travel and drift continue across them.
//!
//! Two recordings belong together where the clock of the second continues after the end of the first, and where they
//! have the same columns and rate. Where positions are relative, each recording has its own zero, and nothing is
//! joined.

use crate::Simulation;
use crate::file::PositionReference;
use crate::run::{Break, Part, Run};

/// Longest time between two recordings of one session, s.
const LONGEST_PAUSE_S: f64 = 3600.0;

/// Relative difference below which two rates are equal.
const SAME_RATE: f64 = 0.01;

/// The recordings, in the order of their clocks, with those of one session joined; the order of rows is kept. `None`
/// where no two belong together.
pub fn joined(simulation: &Simulation, runs: &[Run]) -> Option<Vec<Run>> {
    if simulation.axis.position_reference == PositionReference::Relative {
        return None;
    }
    let mut all: Vec<Run> = Vec::new();
    for run in runs {
        match all.last_mut().filter(|last| goes_on(last, run)) {
            Some(last) => append(last, run),
            None => all.push(run.clone()),
        }
    }
    (all.len() < runs.len()).then_some(all)
}

fn goes_on(first: &Run, second: &Run) -> bool {
    let (Some(end), Some(start)) = (first.time_s.last(), second.time_s.first()) else { return false };
    let (rate, other) = (first.step_s(), second.step_s());
    start > end
        && start - end < LONGEST_PAUSE_S
        && (rate - other).abs() < SAME_RATE * rate
        && optional(first).map(|column| column.is_some()) == optional(second).map(|column| column.is_some())
}

fn append(run: &mut Run, next: &Run) {
    let rows = run.len();
    run.name = format!("{}, {}", run.name, next.name);
    run.time_s.extend(&next.time_s);
    run.drag_force_n.extend(&next.drag_force_n);
    let others = optional(next);
    for (own, next) in optional_mut(run).into_iter().zip(others) {
        if let (Some(own), Some(next)) = (own, next) {
            own.extend(next);
        }
    }
    run.parts.extend(next.parts.iter().map(|part| Part {
        rows: rows + part.rows.start..rows + part.rows.end,
        segment: part.segment,
        starts: if part.starts == Break::Start { Break::Segment } else { part.starts },
    }));
}

/// Every column that a run may lack.
fn optional(run: &Run) -> [Option<&Vec<f64>>; 9] {
    [
        &run.position_m,
        &run.velocity_m_s,
        &run.acceleration_m_s2,
        &run.preload_n,
        &run.external_load_n,
        &run.temperature_block_degc,
        &run.temperature_rail_degc,
        &run.temperature_ambient_degc,
        &run.simulated_force_n,
    ]
    .map(Option::as_ref)
}

/// The same columns, mutable, in the same order.
fn optional_mut(run: &mut Run) -> [Option<&mut Vec<f64>>; 9] {
    [
        &mut run.position_m,
        &mut run.velocity_m_s,
        &mut run.acceleration_m_s2,
        &mut run.preload_n,
        &mut run.external_load_n,
        &mut run.temperature_block_degc,
        &mut run.temperature_rail_degc,
        &mut run.temperature_ambient_degc,
        &mut run.simulated_force_n,
    ]
    .map(Option::as_mut)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::Law;

    fn run(from_s: f64) -> Run {
        let time_s: Vec<f64> = (0..100).map(|n| from_s + 0.01 * f64::from(n)).collect();
        Run {
            name: format!("{from_s}.csv"),
            drag_force_n: time_s.clone(),
            position_m: Some(time_s.clone()),
            time_s,
            parts: vec![Part { rows: 0..100, segment: None, starts: Break::Start }],
            ..Run::default()
        }
    }

    fn joined(runs: &[Run]) -> Option<Vec<Run>> {
        super::joined(&Simulation::of(Law::COLUMN), runs)
    }

    #[test]
    fn a_clock_that_goes_on_joins_and_any_other_does_not() {
        let session = joined(&[run(0.0), run(60.0), run(0.0)]).expect("two of three");
        assert_eq!(session.iter().map(Run::len).collect::<Vec<_>>(), [200, 100]);
        let first = &session[0];
        assert_eq!(
            (first.name.as_str(), first.time_s[100], first.position_m.as_ref().unwrap()[100]),
            ("0.csv, 60.csv", 60.0, 60.0)
        );
        assert_eq!(first.parts[1], Part { rows: 100..200, segment: None, starts: Break::Segment });
        assert!(joined(&[run(0.0), run(1e5)]).is_none() && joined(&[run(60.0), run(0.0)]).is_none());
        let warm = Run { temperature_block_degc: Some(vec![20.0; 100]), ..run(60.0) };
        assert!(joined(&[run(0.0), warm]).is_none());
    }
}
