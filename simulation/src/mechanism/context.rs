//! Context: everything that a mechanism may depend on, row by row.
//!
//! Direction, travel and rests come from the displacement over a window of a few hundredths of a second, so that the
//! noise of an encoder at rest is neither motion nor a reversal. Distances telescope: they are differences of position
//! since the last reversal, not sums of noisy steps.

use model_core::exact::Exact;

use crate::file::{Law, Simulation};
use crate::guide::Lubricant;
use crate::law::{Factors, Missing, Steady};
use crate::motion::Motion;
use crate::run::Run;

use super::id::Id;
use super::onset::Onsets;
use super::path::Path;

/// Relative step of the central differences.
const STEP: f64 = 1e-3;

/// Half window over which the speed along the path is taken, s: long enough for an encoder count to be negligible,
/// short enough to show a drive's change of speed.
const PATH_S: f64 = 0.1;

/// Load per ball at about 3 kN of preload, N.
const USUAL_LOAD_N: f64 = 150.0;

/// Step in the logarithm of the viscosity for the second derivative.
const CURVATURE_STEP: f64 = 0.02;

/// Periodic dimensions of a ball guide, m.
///
/// Without a guide those of the published block, from which the search for a wavelength starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// Ball diameter.
    pub ball_diameter_m: f64,
    /// Distance of two balls.
    pub ball_pitch_m: f64,
    /// Length of rail that carries the block at a time.
    pub loaded_length_m: f64,
    /// Number of balls that carry load, all rows together.
    pub loaded_balls: f64,
}

/// Loaded length over balls per row of THK's SHS35: 93 mm for 13 balls (assumed, from the block's outline).
const PITCH_M: f64 = 93e-3 / 13.0;

impl Geometry {
    fn of(law: &Law) -> Self {
        let (diameter, per_row, balls) = match law {
            Law::Guide(set) => {
                let guide = set.exact().guide();
                (guide.ball_diameter_m, f64::from(guide.balls_per_row), guide.loaded_balls())
            }
            _ => (6.35e-3, 13.0, 52.0),
        };
        // the pitch grows with the ball, as a cage of the same design would
        let pitch = PITCH_M * diameter / 6.35e-3;
        Geometry {
            ball_diameter_m: diameter,
            ball_pitch_m: pitch,
            loaded_length_m: pitch * per_row,
            loaded_balls: balls,
        }
    }
}

/// Everything that a mechanism may depend on, for one run. Every column has a value per row.
pub struct Context<'a> {
    /// The recording.
    pub run: &'a Run,
    /// Its motion.
    pub motion: &'a Motion,
    /// The law's values.
    pub steady: Steady,
    /// `dF/d ln(preload)`, signed, N; zeros for laws without a preload.
    pub by_preload_n: Vec<f64>,
    /// `dF/d ln(viscosity)`, signed, N; zeros for laws without a viscosity.
    pub by_viscosity_n: Vec<f64>,
    /// Sign of motion, -1 or 1; keeps its last value at rest, and takes the next one before the first motion.
    pub direction: Vec<f64>,
    /// Distance travelled since the first row of the run, m.
    pub travel_m: Vec<f64>,
    /// Distance since the last reversal or the last start after a rest, m; [`FAR_M`] where a part starts in motion.
    pub since_reversal_m: Vec<f64>,
    /// How long the carriage rested before the present movement, s; 0 where it did not.
    pub dwell_s: Vec<f64>,
    /// Whether the carriage rests.
    pub at_rest: Vec<bool>,
    /// Periodic dimensions of the guide.
    pub geometry: Geometry,
    /// Part of the law's friction that is proportional to speed, N, unsigned; for a column of force, what grows with
    /// speed.
    pub viscous_n: Vec<f64>,
    /// `d²F/d ln(viscosity)²`, signed, N; empty for laws without a viscosity.
    pub viscosity_curvature_n: Vec<f64>,
    /// Whether the law's friction has a part that falls with speed.
    pub has_stribeck: bool,
    /// Whether the law's oil thins with the measured temperature.
    pub viscosity_follows_temperature: bool,
    /// The law's force at another speed than the recorded one, N: that of the path or, for a law with a noisy speed and
    /// where no position was recorded, the calm one. `None` without a recorded speed.
    pub at_path_speed_n: Option<Vec<f64>>,
    /// Acceleration of that speed, m/s².
    pub path_acceleration_m_s2: Option<Vec<f64>>,
    /// Mass that the law accelerates, kg.
    pub moved_mass_kg: f64,
    /// Contacts and friction of a ball guide.
    pub(crate) exact: Option<Exact>,
    /// Movements, turns and rests.
    pub(crate) path: Path,
    /// Starts and stops between rows.
    pub(crate) onsets: Onsets,
}

/// Distance since a reversal that was not recorded, m.
pub const FAR_M: f64 = 1e3;

impl<'a> Context<'a> {
    /// Everything derived from a run, its motion and the law.
    ///
    /// # Errors
    /// [`Missing`] as [`Simulation::steady`].
    pub fn of(simulation: &Simulation, run: &'a Run, motion: &'a Motion) -> Result<Self, Missing> {
        let steady = simulation.steady(&Factors::default(), run, motion)?;
        let rows = run.len();
        let at = |factors: &Factors| simulation.steady(factors, run, motion).map(|other| other.force_n);
        let (mut by_preload_n, mut by_viscosity_n) = (vec![0.0; rows], vec![0.0; rows]);
        let mut viscosity_curvature_n = Vec::new();
        let viscous_n;
        let (mut has_stribeck, mut viscosity_follows_temperature, mut exact) = (false, false, None);
        if !matches!(simulation.law, Law::CoulombViscous { .. }) {
            let preload = |factor| at(&Factors { preload: factor, ..Factors::default() });
            let viscosity = |factor| at(&Factors { viscosity: factor, ..Factors::default() });
            by_preload_n = slope(&preload(1.0 + STEP)?, &steady.force_n, &preload(1.0 - STEP)?);
            by_viscosity_n = slope(&viscosity(1.0 + STEP)?, &steady.force_n, &viscosity(1.0 - STEP)?);
            let (up, down) = (viscosity(CURVATURE_STEP.exp())?, viscosity((-CURVATURE_STEP).exp())?);
            let bend = |n: usize| {
                let bend = (up[n] - 2.0 * steady.force_n[n] + down[n]) / (CURVATURE_STEP * CURVATURE_STEP);
                if bend.is_finite() || !steady.force_n[n].is_finite() { bend } else { 0.0 }
            };
            viscosity_curvature_n = (0..rows).map(bend).collect();
        }
        match &simulation.law {
            Law::Guide(set) => {
                let constants = set.exact().friction();
                let balls = set.exact().guide().loaded_balls();
                let of = |(q, h): (&f64, &f64)| balls * q * constants.mu_viscous * h;
                viscous_n = steady.load_per_ball_n.iter().zip(&steady.hersey).map(of).collect();
                has_stribeck = constants.mu_stribeck > 0.0;
                viscosity_follows_temperature = matches!(set.lubricant(), Lubricant::Walther(_));
                exact = Some(*set.exact());
            }
            Law::CoulombViscous { viscous_n_s_m, .. } => {
                let slope = viscous_n_s_m.unwrap_or(0.0);
                viscous_n = motion.velocity_m_s.iter().map(|v| slope * v.abs()).collect();
            }
            Law::Column { .. } => {
                let grows = |(by, sign): (&f64, &f64)| (by * sign).max(0.0);
                viscous_n = by_viscosity_n.iter().zip(&steady.direction).map(grows).collect();
            }
        }
        let (mut at_path_speed_n, mut path_acceleration_m_s2) = (None, None);
        let has_noisy_speed = simulation.mechanisms.iter().any(|added| added.id == Id::SpeedNoise);
        let path = match (&run.velocity_m_s, &run.position_m) {
            (Some(_), Some(_)) => Some(Motion::of_path(run, (PATH_S / run.step_s()).max(1.0) as usize)),
            // no cause that a search looks for: it is given the calm speed
            (Some(_), None) if has_noisy_speed => Some(motion.calmed(run)),
            _ => None,
        };
        if let Some(path) = path {
            at_path_speed_n = Some(simulation.steady(&Factors::default(), run, &path)?.force_n);
            path_acceleration_m_s2 = Some(path.acceleration_m_s2);
        }
        let path = Path::of(run, motion, simulation.axis.zero_speed_m_s);
        let onsets = Onsets::of(run, motion, &steady.direction);
        Ok(Context {
            run,
            motion,
            onsets,
            by_preload_n,
            by_viscosity_n,
            direction: path.direction.clone(),
            travel_m: path.travel_m.clone(),
            since_reversal_m: path.since_start_m.clone(),
            dwell_s: path.dwell_s.clone(),
            at_rest: path.at_rest.clone(),
            geometry: Geometry::of(&simulation.law),
            viscous_n,
            viscosity_curvature_n,
            has_stribeck,
            viscosity_follows_temperature,
            at_path_speed_n,
            path_acceleration_m_s2,
            moved_mass_kg: simulation.axis.moved_mass_kg.unwrap_or(0.0),
            exact,
            path,
            steady,
        })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.run.len()
    }

    /// Whether the run has no row.
    pub fn is_empty(&self) -> bool {
        self.run.is_empty()
    }

    /// Distance since the force expected by the law last changed its sign, m: there a coupling moves from one flank to
    /// the other. Without inertia this is the distance since the last reversal; a decelerated mass changes the flank
    /// earlier. [`FAR_M`] until the first change.
    pub fn since_push_m(&self) -> Vec<f64> {
        self.since_flank_m(false)
    }

    /// The least that [`since_push_m`](Self::since_push_m) can be, m: the sign changes anywhere between two rows, before
    /// the first row, and in a rest, before which a mass may push for a moment that no row shows.
    pub fn surely_since_push_m(&self) -> Vec<f64> {
        self.since_flank_m(true)
    }

    fn since_flank_m(&self, is_least: bool) -> Vec<f64> {
        let (mut sign, mut from) = (0.0, None);
        (0..self.len())
            .map(|n| {
                let now = self.steady.force_n[n];
                if self.path.starts[n] {
                    (sign, from) = (0.0, None);
                }
                let is_changed = now.is_finite() && now != 0.0 && now.signum() != sign;
                if is_changed && sign != 0.0 {
                    from = Some(self.travel_m[n] - self.path.step_m[n]);
                }
                if is_changed {
                    sign = now.signum();
                }
                if is_least && (is_changed || self.at_rest[n] || self.path.starts[n]) {
                    from = Some(self.travel_m[n]);
                }
                from.map_or(FAR_M, |from| (self.travel_m[n] - from).max(0.0))
            })
            .collect()
    }

    /// Speed of a row, m/s, without sign.
    pub fn speed_m_s(&self, row: usize) -> f64 {
        self.motion.velocity_m_s[row].abs()
    }

    /// A column with a value per row.
    pub(crate) fn rows(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.len()).map(of).collect()
    }

    /// A column with the sign of a force against the motion; 0 where the law sees no motion.
    pub(crate) fn against_motion(&self, of: impl Fn(usize) -> f64) -> Vec<f64> {
        self.steady
            .direction
            .iter()
            .enumerate()
            .map(|(n, sign)| if *sign == 0.0 { 0.0 } else { sign * of(n) })
            .collect()
    }

    /// Change of force per relative change of the preload, N per 1, signed. For laws without a preload, friction counts
    /// as proportional to load.
    pub(crate) fn by_load_n(&self) -> Vec<f64> {
        if self.steady.preload_n.is_empty() {
            return self.against_motion(|n| self.steady.drag_n[n]);
        }
        self.by_preload_n.clone()
    }

    /// Change of force per change of the interference between balls and raceways, N, signed; the unit is the change
    /// that equals 1 of the preload at 150 N per ball.
    ///
    /// ```text
    /// Q ∝ D^1.5  ->  dlnF_p = 1.5·dD/D ∝ dD·Q^(-2/3)
    /// ```
    ///
    /// A micrometre of the rail is a large share of a light preload and a small share of a heavy one.
    pub(crate) fn by_interference_n(&self) -> Vec<f64> {
        let mut force = self.by_load_n();
        for (n, force) in force.iter_mut().enumerate() {
            let load = self.relative_load(n);
            *force = if load > 0.0 { *force / libm::cbrt(load * load) } else { 0.0 };
        }
        force
    }

    /// `dF/d ln V` of the friction, signed, N: speed and viscosity enter as a product. `None` where no part of the law
    /// is known to grow with either.
    pub(crate) fn by_speed_n(&self) -> Option<Vec<f64>> {
        if !self.steady.viscosity_cst.is_empty() || self.by_viscosity_n.iter().any(|x| *x != 0.0) {
            return Some(self.by_viscosity_n.clone());
        }
        self.viscous_n.iter().any(|x| *x != 0.0).then(|| self.against_motion(|n| self.viscous_n[n]))
    }

    /// Change of force per relative change of the viscosity, N per 1, signed. For laws without a viscosity it is the
    /// friction that grows with speed, or all friction where no part is known to.
    pub(crate) fn by_oil_n(&self) -> Vec<f64> {
        self.by_speed_n().unwrap_or_else(|| self.against_motion(|n| self.steady.drag_n[n]))
    }

    /// Change of the law's force when the logarithm of the viscosity rises by `logs`, row by row, signed, N.
    pub(crate) fn thinned_n(&self, logs: &[f64]) -> Vec<f64> {
        let Some(friction) = self.exact.as_ref().map(Exact::friction) else {
            let (force, bend) = (self.by_oil_n(), &self.viscosity_curvature_n);
            return self.rows(|n| logs[n] * (force[n] + 0.5 * logs[n] * bend.get(n).unwrap_or(&0.0)));
        };
        let (q, h) = (&self.steady.load_per_ball_n, &self.steady.hersey);
        self.against_motion(|n| {
            let other = friction.coefficient(h[n] * libm::exp(logs[n])) - friction.coefficient(h[n]);
            self.geometry.loaded_balls * q[n] * other
        })
    }

    /// Friction of touching contacts, N, signed, proportional to the load; for laws without such a part, all friction.
    pub(crate) fn dry_n(&self) -> Vec<f64> {
        let Some(friction) = self.exact.as_ref().map(Exact::friction) else {
            return self.against_motion(|n| self.steady.drag_n[n]);
        };
        let q = &self.steady.load_per_ball_n;
        self.against_motion(|n| self.geometry.loaded_balls * friction.mu_coulomb * q[n])
    }

    /// Load per ball relative to 150 N (roughly that of 3 kN of preload); 1 for laws without a preload.
    pub(crate) fn relative_load(&self, row: usize) -> f64 {
        self.steady.load_per_ball_n.get(row).map_or(1.0, |q| q / USUAL_LOAD_N)
    }

    /// Share of the step to a row at which the motion reverses; `None` where it continues, or starts from rest.
    ///
    /// ```text
    /// θ = V[n-1]/(V[n-1] - V[n]), the speed being straight between two rows
    /// ```
    ///
    /// Friction jumps there, and is not linear between the rows.
    pub(crate) fn turn(&self, row: usize) -> Option<f64> {
        let before = row.checked_sub(1).filter(|_| !self.path.starts[row])?;
        let (before, after) = (self.motion.velocity_m_s[before], self.motion.velocity_m_s[row]);
        (before * after < 0.0).then(|| before / (before - after))
    }

    /// Share of the step to a row at which friction jumps: the motion reverses, begins or stops there.
    pub(crate) fn jump(&self, row: usize) -> Option<f64> {
        self.onsets.share(row).or_else(|| self.turn(row))
    }

    /// The law's force, N, without friction in rows that a window of the speed takes for moving before the carriage does.
    pub(crate) fn struck_n(&self) -> Vec<f64> {
        let Steady { force_n, drag_n, direction, .. } = &self.steady;
        self.rows(|n| if self.onsets.moves[n] { force_n[n] } else { force_n[n] - direction[n] * drag_n[n] })
    }

    /// Time since the previous row, s; 0 where a clock jumped back.
    pub(crate) fn step_s(&self, row: usize) -> f64 {
        if row == 0 { 0.0 } else { (self.run.time_s[row] - self.run.time_s[row - 1]).max(0.0) }
    }
}

/// Central difference; one-sided where the other side lies beyond the contact's geometry.
fn slope(up: &[f64], here: &[f64], down: &[f64]) -> Vec<f64> {
    let of = |((up, here), down): ((&f64, &f64), &f64)| {
        let central = (up - down) / (2.0 * STEP);
        if central.is_finite() || !here.is_finite() { central } else { (here - down) / STEP }
    };
    up.iter().zip(here).zip(down).map(of).collect()
}

/// A measured column with its unmeasured rows interpolated; `None` where nothing was measured.
pub(crate) fn filled(column: Option<&Vec<f64>>) -> Option<Vec<f64>> {
    let mut column = column?.clone();
    let mut last: Option<usize> = None;
    for n in 0..column.len() {
        if !column[n].is_finite() {
            continue;
        }
        let from = last.map_or(0, |at| at + 1);
        let (x1, x0) = (column[n], last.map_or(column[n], |at| column[at]));
        let width = (n + 1 - from) as f64;
        for (k, x) in column[from..n].iter_mut().enumerate() {
            *x = x0 + (x1 - x0) * (k + 1) as f64 / width;
        }
        last = Some(n);
    }
    let last = last?;
    let x = column[last];
    column[last..].fill(x);
    Some(column)
}

/// A column with non-finite values replaced by the previous value: input of a filter.
pub(crate) fn held(column: &[f64]) -> Vec<f64> {
    let mut last = column.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    let hold = |x: &f64| {
        if x.is_finite() {
            last = *x;
        }
        last
    };
    column.iter().map(hold).collect()
}
