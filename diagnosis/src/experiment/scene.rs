//! Scene of the next run: stroke, speeds and conditions of the recording.

use simulation::Simulation;
use simulation::file::Law;
use simulation::motion::Motion;
use simulation::profile::{Conditions, Course, Staircase, Unfit};
use simulation::run::{Break, Part, Run};

use crate::recording::side::Side;

/// Acceleration of the ramps, m/s².
const ACCELERATION_M_S2: f64 = 0.5;

/// Longest duration of the slowest stroke, s.
const STROKE_S: f64 = 8.0;

/// Number of speeds of a short staircase.
const SPEEDS: usize = 5;

/// Stroke, speeds and conditions that the next run can start from.
pub(super) struct Scene {
    pub(super) conditions: Conditions,
    /// Lower end of the stroke, m.
    pub(super) start_m: f64,
    /// Its length, m.
    pub(super) span_m: f64,
    fastest_m_s: f64,
    recorded_hz: f64,
    has_preload: bool,
}

impl Scene {
    pub(super) fn of(simulation: &Simulation, side: &Side<'_>) -> Self {
        let positions = || side.moving.motions.iter().flat_map(|motion| &motion.position_m);
        let start_m = positions().copied().fold(f64::INFINITY, f64::min);
        let end_m = positions().copied().fold(f64::NEG_INFINITY, f64::max);
        let fastest_m_s = side
            .moving
            .motions
            .iter()
            .flat_map(|motion| &motion.velocity_m_s)
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        let has_preload = matches!(simulation.law, Law::Guide(_));
        let preload_n = mean(side.runs, |run| run.preload_n.as_ref()).or(simulation.preload_n);
        Scene {
            conditions: Conditions {
                preload_n: preload_n.filter(|_| has_preload),
                external_load_n: mean(side.runs, |run| run.external_load_n.as_ref()),
                // a short run starts as cold as the recording did, before the heat of friction
                temperature_degc: side
                    .runs
                    .iter()
                    .find_map(|run| run.temperature_block_degc.as_ref()?.iter().copied().find(|x| x.is_finite())),
            },
            start_m,
            span_m: (end_m - start_m).clamp(1e-3, 1.0),
            fastest_m_s,
            recorded_hz: 1.0 / side.step_s(),
            has_preload,
        }
    }

    /// Sampling rate, rows/s: at most the recorded one, since noise per row would differ otherwise.
    pub(super) fn rate_hz(&self, most: f64) -> f64 {
        most.min(self.recorded_hz)
    }

    /// A stroke that fits on the rail, m.
    pub(super) fn stroke_up_to(&self, most_m: f64) -> f64 {
        most_m.min(0.5 * self.span_m)
    }

    /// The highest recorded speed, limited to what can be reached and left within a third of the stroke, m/s.
    pub(super) fn fastest(&self) -> f64 {
        self.fastest_m_s.min((self.span_m / 3.0 * ACCELERATION_M_S2 / 1.5).sqrt()).max(1e-5)
    }

    /// Preload of a law that has one, N.
    pub(super) fn preload_n(&self) -> Option<f64> {
        self.conditions.preload_n.filter(|_| self.has_preload)
    }

    /// A short staircase over the recorded speeds, once up.
    pub(super) fn staircase(&self) -> Staircase {
        let length_m = self.stroke_up_to(0.05);
        let most = self.fastest();
        let least = (length_m / STROKE_S).min(0.5 * most);
        let speed = |k: usize| least * libm::pow(most / least, k as f64 / (SPEEDS - 1) as f64);
        Staircase {
            speeds_m_s: (0..SPEEDS).map(speed).collect(),
            length_m,
            hold_s: 0.3 * self.span_m / most.max(least),
            order: simulation::profile::Order::Up,
            acceleration_m_s2: ACCELERATION_M_S2,
            ..Staircase::default()
        }
    }

    /// The staircase at a share of the preload; empty where the law has no preload.
    pub(super) fn at_preload(&self, part: f64, rate_hz: f64) -> Result<Vec<Course>, Unfit> {
        let Some(preload_n) = self.preload_n() else { return Ok(Vec::new()) };
        let conditions = Conditions { preload_n: Some(part * preload_n), ..self.conditions };
        Ok(vec![self.staircase().course(rate_hz, &conditions)?])
    }

    /// The staircase under a known load.
    pub(super) fn loaded(&self, external_load_n: f64, rate_hz: f64) -> Result<Course, Unfit> {
        let conditions = Conditions { external_load_n: Some(external_load_n), ..self.conditions };
        self.staircase().course(rate_hz, &conditions)
    }

    /// The staircase at temperatures above that of the recording; empty where none was measured.
    pub(super) fn warmer(&self, by_k: &[f64], rate_hz: f64) -> Result<Vec<Course>, Unfit> {
        let Some(temperature) = self.conditions.temperature_degc else { return Ok(Vec::new()) };
        let at = |by: &f64| {
            let conditions = Conditions { temperature_degc: Some(temperature + by), ..self.conditions };
            self.staircase().course(rate_hz, &conditions)
        };
        by_k.iter().map(at).collect()
    }

    /// The carriage at rest, off the sensor.
    pub(super) fn resting(&self, duration_s: f64, rate_hz: f64) -> Course {
        let rows = (duration_s * rate_hz) as usize;
        let column = |value: Option<f64>| value.map(|x| vec![x; rows]);
        let run = Run {
            time_s: (0..rows).map(|n| n as f64 / rate_hz).collect(),
            drag_force_n: vec![0.0; rows],
            position_m: Some(vec![0.0; rows]),
            velocity_m_s: Some(vec![0.0; rows]),
            preload_n: column(self.conditions.preload_n),
            external_load_n: column(self.conditions.external_load_n),
            temperature_block_degc: column(self.conditions.temperature_degc),
            temperature_rail_degc: column(self.conditions.temperature_degc),
            parts: vec![Part { rows: 0..rows, segment: Some(1), starts: Break::Start }],
            ..Run::default()
        };
        let motion = Motion {
            position_m: vec![0.0; rows],
            velocity_m_s: vec![0.0; rows],
            acceleration_m_s2: vec![0.0; rows],
            reach: 1,
            acceleration_reach: 1,
            has_position: true,
        };
        Course { run, motion }
    }
}

/// Mean of the finite values; `None` without any.
fn mean(runs: &[Run], column: impl Fn(&Run) -> Option<&Vec<f64>>) -> Option<f64> {
    let values = || runs.iter().filter_map(&column).flatten().filter(|x| x.is_finite());
    let count = values().count();
    (count > 0).then(|| values().sum::<f64>() / count as f64)
}
