//! All that a mechanism may depend on, row by row of one run.

use crate::file::{Law, Simulation};
use crate::law::{Factors, Missing, Steady};
use crate::motion::Motion;
use crate::run::Run;

/// Relative step by which preload and viscosity are varied.
const STEP: f64 = 0.02;

/// Distance from a reversal that counts as far where none was seen, m.
const FAR_M: f64 = 1.0;

/// Rest below this is a reversal, not a dwell, s.
const DWELL_S: f64 = 0.05;

/// Dimensions of the guide. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Ball diameter, m.
    pub ball_diameter_m: f64,
    /// Balls under load.
    pub loaded_balls: f64,
    /// Length of the loaded zone, m: that of 13 balls on 93 mm, scaled with the balls.
    pub loaded_length_m: f64,
    /// Carriage travel per ball entering the loaded zone, m: twice the pitch of the balls.
    pub ball_pass_m: f64,
}

impl Geometry {
    fn of(simulation: &Simulation) -> Self {
        let (diameter, balls, per_row) = match &simulation.law {
            Law::Guide(set) => {
                let guide = set.exact().guide();
                (guide.ball_diameter_m, guide.loaded_balls(), f64::from(guide.balls_per_row))
            }
            _ => (6.35e-3, 52.0, 13.0),
        };
        // 93 mm for 13 balls of 6.35 mm (assumed): a pitch of 7.15 mm
        let pitch = 93e-3 / 13.0 * diameter / 6.35e-3;
        Geometry {
            ball_diameter_m: diameter,
            loaded_balls: balls,
            loaded_length_m: pitch * per_row,
            ball_pass_m: 2.0 * pitch,
        }
    }
}

/// A run under a law, with what mechanisms are made of. All columns have the run's length.
#[derive(Clone, Debug)]
pub struct Context<'a> {
    /// The run.
    pub run: &'a Run,
    /// Its motion.
    pub motion: &'a Motion,
    /// What the law says.
    pub steady: Steady,
    /// ∂F/∂ln(preload), N, signed; 0 for a law without preload.
    pub by_preload_n: Vec<f64>,
    /// ∂F/∂ln(viscosity), N, signed; 0 for a law without oil.
    pub by_viscosity_n: Vec<f64>,
    /// ∂²F/∂ln(viscosity)², N, signed.
    pub by_viscosity_2_n: Vec<f64>,
    /// Sign of the motion, -1 or 1; at rest that of the last motion, before the first that of the first.
    pub direction: Vec<f64>,
    /// Way from the first row of the run, m; goes on over the parts.
    pub travel_m: Vec<f64>,
    /// Way since the last reversal or start, m; a metre and more where a part starts in motion.
    pub since_reversal_m: Vec<f64>,
    /// Rest before the present movement, s.
    pub dwell_s: Vec<f64>,
    /// Whether the carriage stands.
    pub at_rest: Vec<bool>,
    /// The guide.
    pub geometry: Geometry,
}

impl<'a> Context<'a> {
    /// Makes the context of a run. `motion` must be that of `run`.
    ///
    /// # Errors
    /// [`Missing`]: the law has no value for this run.
    pub fn of(simulation: &Simulation, run: &'a Run, motion: &'a Motion) -> Result<Self, Missing> {
        let steady = simulation.steady(&Factors::default(), run, motion)?;
        let varied = |factors: &dyn Fn(f64) -> Factors| -> Result<[Vec<f64>; 2], Missing> {
            let above = simulation.steady(&factors(STEP.exp()), run, motion)?.force_n;
            let below = simulation.steady(&factors((-STEP).exp()), run, motion)?.force_n;
            Ok([above, below])
        };
        let slope = |[above, below]: &[Vec<f64>; 2]| -> Vec<f64> {
            above.iter().zip(below).map(|(a, b)| finite((a - b) / (2.0 * STEP))).collect()
        };
        let zeros = || vec![0.0; run.len()];
        let (by_preload_n, by_viscosity_n, by_viscosity_2_n) = match &simulation.law {
            Law::Guide(_) => {
                let preload = varied(&|x| Factors { preload: x, ..Factors::default() })?;
                let viscosity = varied(&|x| Factors { viscosity: x, ..Factors::default() })?;
                let bend = viscosity[0].iter().zip(&viscosity[1]).zip(&steady.force_n);
                let bend = bend.map(|((a, b), f)| finite((a - 2.0 * f + b) / (STEP * STEP))).collect();
                (slope(&preload), slope(&viscosity), bend)
            }
            _ => (zeros(), zeros(), zeros()),
        };
        let mut context = Context {
            run,
            motion,
            by_preload_n,
            by_viscosity_n,
            by_viscosity_2_n,
            direction: steady.direction.clone(),
            travel_m: zeros(),
            since_reversal_m: zeros(),
            dwell_s: zeros(),
            at_rest: steady.direction.iter().map(|d| *d == 0.0).collect(),
            geometry: Geometry::of(simulation),
            steady,
        };
        context.remember();
        Ok(context)
    }

    /// Fills what depends on the motion before: direction, travel, way since the reversal, dwell.
    fn remember(&mut self) {
        let position = &self.motion.position_m;
        let mut travel = 0.0;
        for part in &self.run.parts {
            let rows = part.rows.clone();
            let first = self.direction[rows.clone()].iter().copied().find(|d| *d != 0.0).unwrap_or(1.0);
            let (mut direction, mut since, mut rest, mut dwell) = (first, FAR_M, 0.0, 0.0);
            for n in rows.clone() {
                let (way, time) = if n > rows.start {
                    ((position[n] - position[n - 1]).abs(), self.run.time_s[n] - self.run.time_s[n - 1])
                } else {
                    (0.0, 0.0)
                };
                let way = if way.is_finite() { way } else { 0.0 };
                travel += way;
                since += way;
                if self.at_rest[n] {
                    rest += time;
                } else {
                    if self.direction[n] != direction {
                        (since, dwell) = (0.0, if rest > DWELL_S { rest } else { 0.0 });
                    } else if rest > DWELL_S {
                        (since, dwell) = (0.0, rest);
                    }
                    (direction, rest) = (self.direction[n], 0.0);
                }
                self.direction[n] = direction;
                self.travel_m[n] = travel;
                self.since_reversal_m[n] = since;
                self.dwell_s[n] = dwell;
            }
        }
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.run.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.run.is_empty()
    }
}

fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { 0.0 }
}
