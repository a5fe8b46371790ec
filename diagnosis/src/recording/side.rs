//! Runs with everything derived from their motion.

use simulation::Simulation;
use simulation::law::Missing;
use simulation::mechanism::Context;
use simulation::run::Run;

use crate::nominal::Nominal;
use crate::recording::ends::ChannelEnds;
use crate::recording::moving::Moving;
use crate::recording::resolution::unresolved;
use crate::recording::sanity::Comparable;
use crate::report::DataQuality;

/// Runs with everything derived from their motion.
pub(crate) struct Side<'a> {
    pub(crate) moving: &'a Moving<'a>,
    pub(crate) runs: &'a [Run],
    pub(crate) contexts: Vec<Context<'a>>,
    /// Rows that can be compared; all runs concatenated.
    pub(crate) compared: Vec<bool>,
    /// Force of the simulation file's own mechanisms and curves, N.
    pub(crate) beside_law_n: Vec<f64>,
    pub(crate) drag_n: Vec<f64>,
    /// Rows at an end of the force channel; all runs concatenated.
    pub(crate) clipped: Vec<bool>,
    /// Magnitude of the force at which the channel saturates, N, where a run shows it.
    pub(crate) limit_n: Option<f64>,
    /// Whether every row is an average of several.
    pub(crate) is_averaged: bool,
}

impl<'a> Side<'a> {
    /// Derives everything from the runs, with the law's parameters at these values. Rejected rows are counted in
    /// `quality`.
    pub(crate) fn new(
        simulation: &Simulation,
        nominal: &Nominal,
        values: &[f64],
        moving: &'a Moving<'a>,
        is_averaged: bool,
        quality: &mut DataQuality,
    ) -> Result<Self, String> {
        let mut side = Side {
            moving,
            runs: &moving.runs,
            contexts: Vec::new(),
            compared: Vec::new(),
            beside_law_n: Vec::new(),
            drag_n: Vec::new(),
            clipped: Vec::new(),
            limit_n: None,
            is_averaged,
        };
        let complete = nominal.completed(values);
        for (((run, motion), smooth), recorded) in
            moving.runs.iter().zip(&moving.motions).zip(&moving.smooth).zip(&moving.recorded)
        {
            let context = Context::of(&complete, run, smooth).map_err(|why| said(run, &why))?;
            let comparable = Comparable {
                run,
                motion,
                steady: &context.steady,
                recorded: &complete.direction(recorded),
                unresolved: &unresolved(nominal, run, motion),
                is_averaged,
            };
            side.compared.extend(comparable.rows(quality));
            let ends = ChannelEnds::of(&run.drag_force_n);
            side.clipped.extend(run.drag_force_n.iter().map(|force| ends.has(*force)));
            side.limit_n = ends.limit_n().into_iter().chain(side.limit_n).min_by(f64::total_cmp);
            let start = side.beside_law_n.len();
            side.beside_law_n.resize(start + run.len(), 0.0);
            for force in simulation.beside_law_n(&context) {
                for (sum, force) in side.beside_law_n[start..].iter_mut().zip(force) {
                    *sum += if force.is_finite() { force } else { 0.0 };
                }
            }
            side.drag_n.extend(&run.drag_force_n);
            side.contexts.push(context);
        }
        Ok(side)
    }

    /// Force of the law and of the simulation file's own mechanisms and curves, N.
    pub(crate) fn force(&self, nominal: &Nominal, values: &[f64]) -> Result<Vec<f64>, String> {
        let mut force = Vec::with_capacity(self.drag_n.len());
        for (run, motion) in self.runs.iter().zip(&self.moving.motions) {
            force.extend(nominal.force(values, run, motion).map_err(|why| said(run, &why))?);
        }
        for (force, own) in force.iter_mut().zip(&self.beside_law_n) {
            *force += own;
        }
        Ok(force)
    }

    pub(crate) fn residual(&self, nominal: &Nominal, values: &[f64]) -> Result<Vec<f64>, String> {
        Ok(self.drag_n.iter().zip(self.force(nominal, values)?).map(|(drag, force)| drag - force).collect())
    }

    pub(crate) fn tangent(&self, nominal: &Nominal, values: &[f64]) -> Result<Vec<Vec<f64>>, String> {
        let mut columns = vec![Vec::with_capacity(self.drag_n.len()); values.len()];
        for ((run, motion), context) in
            self.runs.iter().zip(self.moving.motions.iter().zip(&self.moving.smooth)).zip(&self.contexts)
        {
            let force = nominal.force(values, run, motion.0).map_err(|why| said(run, &why))?;
            let own = nominal
                .tangent(values, run, motion, &force, &context.steady.direction)
                .map_err(|why| said(run, &why))?;
            for (column, own) in columns.iter_mut().zip(own) {
                // where the law has no slope, nothing can be said of its parameter
                column.extend(own.into_iter().map(|x| if x.is_finite() { x } else { 0.0 }));
            }
        }
        Ok(columns)
    }

    /// The same at other values of the law's parameters.
    pub(crate) fn again(&self, simulation: &Simulation, nominal: &Nominal, values: &[f64]) -> Result<Self, String> {
        Side::new(simulation, nominal, values, self.moving, self.is_averaged, &mut DataQuality::default())
    }

    pub(crate) fn step_s(&self) -> f64 {
        self.runs.iter().map(Run::step_s).find(|step| *step > 0.0).unwrap_or(1.0)
    }
}

pub(crate) fn said(run: &Run, why: &Missing) -> String {
    if run.name.is_empty() { why.to_string() } else { format!("{}: {why}", run.name) }
}
