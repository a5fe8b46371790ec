//! The nominal law: the simulation's force as a function of the parameters that it assumes to within a tolerance.

use rayon::prelude::*;
use simulation::Simulation;
use simulation::file::Law;
use simulation::law::{ERROR_OF_COLUMN, Factors, Missing};
use simulation::motion::Motion;
use simulation::run::Run;

/// A parameter that calibration may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Parameter {
    /// Name in a parameter shift.
    pub(crate) name: &'static str,
    /// Unit of the value: empty for a relative change.
    pub(crate) unit: &'static str,
    /// Relative standard deviation; `None` where the simulation leaves the parameter out altogether.
    pub(crate) sigma: Option<f64>,
    /// Range that a simulation file allows for a parameter that was left out.
    pub(crate) range: (f64, f64),
    which: Which,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Which {
    Preload,
    Friction,
    Viscosity,
    MuCoulomb,
    MuViscous,
    MuStribeck,
    Mass,
    FreeCoulomb,
    FreeViscous,
    FreeOffset,
    FreeMass,
    /// Averaging window, as a multiple of the reach of the derived acceleration.
    FastAcceleration(usize),
    /// Dependence on the preload that a column of simulated force does not state.
    WithLoad(WithLoad),
    /// Gain of the inertia in a column of simulated force: its program may be off by one gain as a whole.
    InertiaOfColumn,
}

/// A force of the column times the logarithm of the preload.
#[derive(Clone, Copy, Debug, PartialEq)]
enum WithLoad {
    /// The friction of the column, for a contact angle that opens with the preload.
    Friction,
    /// The slope of the column over viscosity, for a slip that grows with the contacts.
    Slope,
}

impl Parameter {
    /// Whether it is a parameter of the law, which may be off, and not one for what the recording or column leaves
    /// uncertain.
    fn is_of_law(&self) -> bool {
        !matches!(self.which, Which::FastAcceleration(_) | Which::WithLoad(_) | Which::InertiaOfColumn)
    }

    /// Whether it may be found to be off.
    pub(crate) fn can_shift(&self) -> bool {
        self.sigma.is_some() && self.is_of_law()
    }

    /// Least and largest value.
    pub(crate) fn ends(&self) -> (f64, f64) {
        match self.sigma {
            Some(_) if self.is_of_law() => (LOWEST, HIGHEST),
            _ => self.range,
        }
    }

    /// Value after a step.
    pub(crate) fn moved(&self, value: f64, step: f64) -> f64 {
        let (least, most) = self.ends();
        if step.is_finite() { (value + step).clamp(least, most) } else { value }
    }
}

/// Limits of the relative change of a factor: it stays positive during Gauss-Newton steps.
const LOWEST: f64 = -0.95;
const HIGHEST: f64 = 4.0;

/// A law and its parameters.
#[derive(Clone, Debug)]
pub(crate) struct Nominal {
    simulation: Simulation,
    pub(crate) parameters: Vec<Parameter>,
}

/// Largest magnitude of a parameter that the simulation left out, N and N s/m; largest mass, kg.
const LARGEST: f64 = 1e6;
const HEAVIEST_KG: f64 = 1e5;

/// Prior standard deviation of the share of the fast acceleration that is not real: anything between nothing and all.
const FAST: f64 = 1.0;

/// Prior standard deviations of the change of a column's friction and slope per unit of the logarithm of the preload: a
/// contact angle adds up to 0.04 to the exponent of a preload that is off by a twentieth, and the Hersey number varies
/// with the cube root of the load in either direction.
const WITH_LOAD: [(WithLoad, f64); 2] = [(WithLoad::Friction, 0.002), (WithLoad::Slope, 0.01)];

/// Preload at which those changes are 0, N.
const REFERENCE_N: f64 = 2000.0;

/// Windows of the fast acceleration, in reaches of differentiation; several, because noise and rounded corners differ
/// in shape.
const WINDOWS: [usize; 3] = [1, 2, 4];

/// Relative step of the tangent.
const STEP: f64 = 1e-3;

impl Nominal {
    pub(crate) fn new(simulation: &Simulation) -> Self {
        let tolerance = &simulation.tolerance;
        let mut nominal = Nominal { simulation: simulation.clone(), parameters: Vec::new() };
        let mut add = |which, name, unit, sigma: Option<f64>| {
            if sigma.is_none_or(|sigma| sigma > 0.0) {
                let range = match which {
                    Which::FreeCoulomb => (0.0, LARGEST),
                    Which::FreeMass => (0.0, HEAVIEST_KG),
                    _ => (-LARGEST, LARGEST),
                };
                nominal.parameters.push(Parameter { name, unit, sigma, range, which });
            }
        };
        match &mut nominal.simulation.law {
            Law::Guide(_) => {
                add(Which::Preload, "preload", "", Some(tolerance.preload));
                add(Which::Friction, "friction", "", Some(tolerance.friction));
                add(Which::Viscosity, "viscosity", "", Some(tolerance.viscosity));
                add(Which::MuCoulomb, "coulomb", "", Some(tolerance.friction_terms));
                add(Which::MuViscous, "viscous", "", Some(tolerance.friction_terms));
                add(Which::MuStribeck, "stribeck", "", Some(tolerance.friction_terms));
                add(Which::Mass, "mass", "", Some(tolerance.mass));
            }
            Law::CoulombViscous { coulomb_n, viscous_n_s_m, offset_n } => {
                if coulomb_n.is_some() || viscous_n_s_m.is_some() {
                    add(Which::Friction, "friction", "", Some(tolerance.friction));
                }
                match coulomb_n {
                    Some(_) => add(Which::MuCoulomb, "coulomb", "", Some(tolerance.friction_terms)),
                    None => add(Which::FreeCoulomb, "coulomb", "N", None),
                }
                match viscous_n_s_m {
                    Some(_) => add(Which::MuViscous, "viscous", "", Some(tolerance.friction_terms)),
                    None => add(Which::FreeViscous, "viscous", "N s/m", None),
                }
                if offset_n.is_none() {
                    add(Which::FreeOffset, "offset", "N", None);
                }
                match simulation.axis.moved_mass_kg {
                    Some(_) => add(Which::Mass, "mass", "", Some(tolerance.mass)),
                    None => add(Which::FreeMass, "mass", "kg", None),
                }
                for number in [coulomb_n, viscous_n_s_m, offset_n] {
                    number.get_or_insert(0.0);
                }
                nominal.simulation.axis.moved_mass_kg.get_or_insert(0.0);
            }
            Law::Column { .. } => {
                add(Which::Friction, "friction", "", Some(tolerance.friction));
                add(Which::Preload, "preload", "", Some(tolerance.preload));
                add(Which::Viscosity, "viscosity", "", Some(tolerance.viscosity));
                add(Which::InertiaOfColumn, "gain of the inertia", "", Some(tolerance.friction));
                // an exact preload needs no correction
                for (what, sigma) in WITH_LOAD.into_iter().filter(|_| tolerance.preload > 0.0) {
                    add(Which::WithLoad(what), "answer to the preload", "", Some(sigma));
                }
            }
        }
        if nominal.accelerates_mass() {
            let sigma = (!nominal.is_incomplete()).then_some(FAST);
            let range = (-HEAVIEST_KG, HEAVIEST_KG);
            nominal.parameters.extend(WINDOWS.map(|reaches| {
                let which = Which::FastAcceleration(reaches);
                Parameter { name: "fast acceleration", unit: "", sigma, range, which }
            }));
        }
        nominal
    }

    /// The same with all parameters of the law, but without those of the fast acceleration.
    pub(crate) fn of_law(&self) -> Self {
        let is_of_motion = |parameter: &&Parameter| matches!(parameter.which, Which::FastAcceleration(_));
        let parameters = self.parameters.iter().filter(|parameter| !is_of_motion(parameter)).copied().collect();
        Nominal { simulation: self.simulation.clone(), parameters }
    }

    /// Whether the law has an inertia.
    pub(crate) fn accelerates_mass(&self) -> bool {
        self.simulation.axis.moved_mass_kg.is_some_and(|mass| mass > 0.0)
            || self.parameters.iter().any(|parameter| parameter.which == Which::FreeMass)
    }

    /// Mass that the law accelerates in a run, kg: as stated, or else the slope over acceleration of the column of
    /// simulated force, or of the measured force.
    pub(crate) fn moved_kg(&self, run: &Run, motion: &Motion) -> f64 {
        let is_free = self.parameters.iter().any(|parameter| parameter.which == Which::FreeMass);
        let force_n = match (&self.simulation.law, &run.simulated_force_n) {
            (Law::Column { .. }, Some(column)) => column,
            _ if is_free => &run.drag_force_n,
            _ => return self.simulation.axis.moved_mass_kg.unwrap_or(0.0),
        };
        let rows = force_n.iter().zip(&motion.acceleration_m_s2).filter(|(f, a)| (*f * *a).is_finite());
        let (fa, aa) = rows.fold((0.0, 0.0), |(fa, aa), (f, a)| (fa + f * a, aa + a * a));
        if aa > 0.0 { (fa / aa).max(0.0) } else { 0.0 }
    }

    /// Number of rows in which the carriage moves.
    pub(crate) fn moving_rows(&self, motion: &Motion) -> usize {
        self.simulation.direction(motion).iter().filter(|sign| **sign != 0.0).count()
    }

    /// Whether the inertia is part of a column, and exact as long as the column's friction is not far off.
    pub(crate) fn holds_its_inertia(&self) -> bool {
        matches!(self.simulation.law, Law::Column { .. })
    }

    /// Relative error that the derivatives may cause in what calibration changes.
    pub(crate) fn error_of_derivatives(&self) -> f64 {
        if matches!(self.simulation.law, Law::Column { .. }) { ERROR_OF_COLUMN } else { 0.0 }
    }

    /// Whether some parameter is fitted freely, so that the given simulation predicts nothing.
    pub(crate) fn is_incomplete(&self) -> bool {
        self.parameters.iter().any(|parameter| parameter.sigma.is_none())
    }

    /// Start of calibration: every factor as given, every missing parameter 0.
    pub(crate) fn start(&self) -> Vec<f64> {
        vec![0.0; self.parameters.len()]
    }

    /// Factors for these values (relative changes); freely fitted parameters are no factors.
    pub(crate) fn factors(&self, values: &[f64]) -> Factors {
        let mut factors = Factors::default();
        for (parameter, value) in self.parameters.iter().zip(values) {
            // limited: a factor of changed sign would be no calibration
            let factor = (1.0 + value).max(0.05);
            match parameter.which {
                Which::Preload => factors.preload = factor,
                Which::Friction => factors.friction = factor,
                Which::Viscosity => factors.viscosity = factor,
                Which::MuCoulomb => factors.mu_coulomb = factor,
                Which::MuViscous => factors.mu_viscous = factor,
                Which::MuStribeck => factors.mu_stribeck = factor,
                Which::Mass | Which::InertiaOfColumn => factors.mass = factor,
                _ => {}
            }
        }
        factors
    }

    /// The simulation with its missing parameters set to these values.
    pub(crate) fn completed(&self, values: &[f64]) -> Simulation {
        let mut simulation = self.simulation.clone();
        for (parameter, value) in self.parameters.iter().zip(values) {
            if let Law::CoulombViscous { coulomb_n, viscous_n_s_m, offset_n } = &mut simulation.law {
                match parameter.which {
                    Which::FreeCoulomb => *coulomb_n = Some(*value),
                    Which::FreeViscous => *viscous_n_s_m = Some(*value),
                    Which::FreeOffset => *offset_n = Some(*value),
                    Which::FreeMass => simulation.axis.moved_mass_kg = Some(*value),
                    _ => {}
                }
            }
        }
        simulation
    }

    /// Force of the law, N; NaN where it has no value.
    pub(crate) fn force(&self, values: &[f64], run: &Run, motion: &Motion) -> Result<Vec<f64>, Missing> {
        let steady = self.simulation.steady(&self.factors(values), run, motion)?;
        let mut force = steady.force_n;
        for (parameter, value) in self.parameters.iter().zip(values) {
            if *value == 0.0 {
                continue;
            }
            let free = match parameter.which {
                Which::WithLoad(what) => Some(self.with_load(what, values, run, motion)?),
                which => self.free_column(which, &steady.direction, run, motion),
            };
            if let Some(column) = free {
                for (force, x) in force.iter_mut().zip(column) {
                    *force += value * x;
                }
            }
        }
        Ok(force)
    }

    /// Derivative of the force with respect to each parameter, N per unit of the parameter.
    ///
    /// A mass acts on the `smooth` acceleration: the noise of a measured one is in the residual, too, and a column that
    /// shared it would bias the mass downwards (instrumental variable, as in Janot, Vandanjon and Gautier 2014).
    pub(crate) fn tangent(
        &self,
        values: &[f64],
        run: &Run,
        (motion, smooth): (&Motion, &Motion),
        force: &[f64],
        direction: &[f64],
    ) -> Result<Vec<Vec<f64>>, Missing> {
        let column = |(index, parameter): (usize, &Parameter)| -> Result<Vec<f64>, Missing> {
            if let Some(column) = self.free_column(parameter.which, direction, run, smooth) {
                return Ok(column);
            }
            if let Which::WithLoad(what) = parameter.which {
                return self.with_load(what, values, run, motion);
            }
            let mut moved = values.to_vec();
            moved[index] += STEP;
            let is_mass = matches!(parameter.which, Which::Mass | Which::InertiaOfColumn);
            if is_mass && run.acceleration_m_s2.is_some() {
                let force = self.force(values, run, smooth)?;
                let other = self.force(&moved, run, smooth)?;
                return Ok(other.iter().zip(&force).map(|(other, force)| (other - force) / STEP).collect());
            }
            let other = self.force(&moved, run, motion)?;
            Ok(other.iter().zip(force).map(|(other, force)| (other - force) / STEP).collect())
        };
        self.parameters.par_iter().enumerate().map(column).collect()
    }

    /// Force per unit of the dependence on preload that a column does not state; 0 where no preload was recorded.
    fn with_load(&self, what: WithLoad, values: &[f64], run: &Run, motion: &Motion) -> Result<Vec<f64>, Missing> {
        let factors = self.factors(values);
        let steady = self.simulation.steady(&factors, run, motion)?;
        let force: Vec<f64> = match what {
            WithLoad::Friction => steady.drag_n.iter().zip(&steady.direction).map(|(drag, sign)| drag * sign).collect(),
            WithLoad::Slope => {
                let thicker = Factors { viscosity: factors.viscosity * (1.0 + STEP), ..factors };
                let moved = self.simulation.steady(&thicker, run, motion)?.force_n;
                moved.iter().zip(&steady.force_n).map(|(moved, force)| (moved - force) / STEP).collect()
            }
        };
        let ln_load = |n: usize| {
            let load = run.preload_n.as_ref().map_or(REFERENCE_N, |preload| preload[n]) / REFERENCE_N;
            if load.is_finite() && load > 0.0 { libm::log(load) } else { 0.0 }
        };
        Ok(force.iter().enumerate().map(|(n, force)| force * ln_load(n)).collect())
    }

    /// Force per unit of a parameter that is no factor of the law.
    fn free_column(&self, which: Which, direction: &[f64], run: &Run, motion: &Motion) -> Option<Vec<f64>> {
        match which {
            Which::FreeCoulomb => Some(direction.to_vec()),
            Which::FreeViscous => Some(motion.velocity_m_s.clone()),
            Which::FreeOffset => Some(vec![1.0; direction.len()]),
            Which::FreeMass => Some(motion.acceleration_m_s2.clone()),
            Which::FastAcceleration(reaches) => {
                let mass = self.simulation.axis.moved_mass_kg.filter(|mass| *mass > 0.0).unwrap_or(1.0);
                Some(fast(run, motion, reaches * motion.acceleration_reach).into_iter().map(|a| mass * a).collect())
            }
            _ => None,
        }
    }
}

/// Fast part of a run's acceleration, m/s², for each of the windows; see [`fast`].
pub(crate) fn fast_accelerations(run: &Run, motion: &Motion) -> [Vec<f64>; WINDOWS.len()] {
    WINDOWS.map(|reaches| fast(run, motion, reaches * motion.acceleration_reach))
}

/// Deviation of a derived acceleration from its mean over a window: there it is noise or the rounded corner of a ramp,
/// and the force is more reliable. 0 where the acceleration was measured.
fn fast(run: &Run, motion: &Motion, reach: usize) -> Vec<f64> {
    let a = &motion.acceleration_m_s2;
    let mut fast = vec![0.0; a.len()];
    if run.acceleration_m_s2.is_some() {
        return fast;
    }
    for part in &run.parts {
        let own = &a[part.rows.clone()];
        let mut sums = vec![0.0; own.len() + 1];
        for (n, a) in own.iter().enumerate() {
            sums[n + 1] = sums[n] + a;
        }
        for n in 0..own.len() {
            // symmetric: a ramp leaves nothing
            let reach = reach.min(n).min(own.len() - 1 - n);
            let mean = (sums[n + reach + 1] - sums[n - reach]) / (2 * reach + 1) as f64;
            fast[part.rows.start + n] = own[n] - mean;
        }
    }
    fast
}
