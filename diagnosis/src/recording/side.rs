//! Runs with everything that follows from their motion.

use simulation::Simulation;
use simulation::law::Missing;
use simulation::mechanism::Context;
use simulation::motion::Motion;
use simulation::run::Run;

use crate::nominal::Nominal;
use crate::recording::sanity::{self, ChannelEnds};
use crate::report::DataQuality;

/// Runs with everything that follows from their motion.
pub(crate) struct Side<'a> {
    pub(crate) runs: &'a [Run],
    pub(crate) motions: &'a [Motion],
    /// The same with the noise of a measured acceleration taken out: what mechanisms are made of.
    pub(crate) smooth: &'a [Motion],
    pub(crate) contexts: Vec<Context<'a>>,
    /// Rows that can be compared, of all runs laid end to end.
    pub(crate) compared: Vec<bool>,
    /// Force that the simulation file's own mechanisms and curves add, N.
    pub(crate) beside_law_n: Vec<f64>,
    pub(crate) drag_n: Vec<f64>,
    /// Rows at an end of the force channel, of all runs laid end to end.
    pub(crate) clipped: Vec<bool>,
    /// Size of the force at which the channel ends, N, where a run shows it.
    pub(crate) limit_n: Option<f64>,
    /// Whether every row is an average of several.
    pub(crate) is_averaged: bool,
}

impl<'a> Side<'a> {
    /// What follows from the runs where the law's numbers have these values. Rows that cannot be compared are counted.
    pub(crate) fn new(
        simulation: &Simulation,
        nominal: &Nominal,
        values: &[f64],
        (runs, motions, smooth): (&'a [Run], &'a [Motion], &'a [Motion]),
        is_averaged: bool,
        quality: &mut DataQuality,
    ) -> Result<Self, String> {
        let mut side = Side {
            runs,
            motions,
            smooth,
            contexts: Vec::new(),
            compared: Vec::new(),
            beside_law_n: Vec::new(),
            drag_n: Vec::new(),
            clipped: Vec::new(),
            limit_n: None,
            is_averaged,
        };
        let complete = nominal.completed(values);
        for (run, motion) in runs.iter().zip(smooth) {
            let context = Context::of(&complete, run, motion).map_err(|why| said(run, &why))?;
            side.compared.extend(sanity::compared(run, motion, &context.steady, is_averaged, quality));
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

    /// Force of the law with what the simulation file has beside it.
    pub(crate) fn force(&self, nominal: &Nominal, values: &[f64]) -> Result<Vec<f64>, String> {
        let mut force = Vec::with_capacity(self.drag_n.len());
        for (run, motion) in self.runs.iter().zip(self.motions) {
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
        for ((run, motion), context) in self.runs.iter().zip(self.motions.iter().zip(self.smooth)).zip(&self.contexts) {
            let force = nominal.force(values, run, motion.0).map_err(|why| said(run, &why))?;
            let own = nominal
                .tangent(values, run, motion, &force, &context.steady.direction)
                .map_err(|why| said(run, &why))?;
            for (column, own) in columns.iter_mut().zip(own) {
                // where the law has no slope, nothing can be said of its number
                column.extend(own.into_iter().map(|x| if x.is_finite() { x } else { 0.0 }));
            }
        }
        Ok(columns)
    }

    /// The same where the law's numbers have other values.
    pub(crate) fn again(&self, simulation: &Simulation, nominal: &Nominal, values: &[f64]) -> Result<Self, String> {
        let parts = (self.runs, self.motions, self.smooth);
        Side::new(simulation, nominal, values, parts, self.is_averaged, &mut DataQuality::default())
    }

    pub(crate) fn step_s(&self) -> f64 {
        self.runs.iter().map(Run::step_s).find(|step| *step > 0.0).unwrap_or(1.0)
    }
}

/// Runs and their motion.
pub(crate) struct Moving<'r> {
    pub(crate) runs: &'r [Run],
    pub(crate) motions: Vec<Motion>,
    smooth: Vec<Motion>,
}

impl<'r> Moving<'r> {
    pub(crate) fn of(runs: &'r [Run]) -> Self {
        let motions: Vec<Motion> = runs.iter().map(Motion::of).collect();
        let smooth = smoothed(runs, &motions);
        Moving { runs, motions, smooth }
    }

    /// What a [`Side`] is made of.
    pub(crate) fn parts(&self) -> (&[Run], &[Motion], &[Motion]) {
        (self.runs, &self.motions, &self.smooth)
    }
}

/// Motion whose acceleration does not share its noise with the mismatch: that of the position where acceleration was
/// measured. The law's inertia keeps the measured one; a column that shared it would explain noise by noise.
fn smoothed(runs: &[Run], motions: &[Motion]) -> Vec<Motion> {
    runs.iter()
        .zip(motions)
        .map(|(run, motion)| {
            let mut motion = motion.clone();
            if run.acceleration_m_s2.is_some() && (run.position_m.is_some() || run.velocity_m_s.is_some()) {
                let bare = Run { acceleration_m_s2: None, ..run.clone() };
                motion.acceleration_m_s2 = Motion::of(&bare).acceleration_m_s2;
            }
            motion
        })
        .collect()
}

pub(crate) fn said(run: &Run, why: &Missing) -> String {
    if run.name.is_empty() { why.to_string() } else { format!("{}: {why}", run.name) }
}
