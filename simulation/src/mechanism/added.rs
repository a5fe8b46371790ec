//! Added mechanisms: entries of a simulation file, each a mechanism with its numbers.

use super::context::Context;
use super::definition::Form;
use super::id::Id;
use super::library::definition;
use crate::file::Simulation;
use crate::law::{Factors, Missing};
use crate::motion::Motion;
use crate::run::Run;

/// A mechanism with numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    /// Which one.
    pub id: Id,
    /// Which of its forms.
    pub form: usize,
    /// Values of the form's shape parameters.
    pub shape: Vec<f64>,
    /// Values of its amplitudes.
    pub amplitudes: Vec<f64>,
}

impl Added {
    /// Its form; `None` where there is no such form.
    pub fn form(&self) -> Option<&'static Form> {
        definition(self.id).forms.get(self.form)
    }

    /// The force that it adds to the law's, N per row; `None` where the run cannot show it or the numbers do not match
    /// the form.
    pub fn force_n(&self, context: &Context<'_>) -> Option<Vec<f64>> {
        let form = self.form()?;
        if self.shape.len() != form.shape.len() || self.amplitudes.len() != form.amplitudes.len() {
            return None;
        }
        let columns = (form.columns)(context, &self.shape)?;
        let mut force = vec![0.0; context.len()];
        for (column, amplitude) in columns.iter().zip(&self.amplitudes) {
            for (sum, x) in force.iter_mut().zip(column) {
                *sum += amplitude * x;
            }
        }
        Some(force)
    }
}

impl Simulation {
    /// Force of the drive on the carriage, N per row: the law, the mechanisms and the curves of the file.
    ///
    /// What the run cannot show adds nothing; [`Added::force_n`] and [`AddedCurve::force_n`] return `None` for it.
    ///
    /// [`AddedCurve::force_n`]: crate::curve::AddedCurve::force_n
    ///
    /// # Errors
    /// [`Missing`] as [`Simulation::steady`].
    pub fn force(&self, run: &Run, motion: &Motion) -> Result<Vec<f64>, Missing> {
        if self.mechanisms.is_empty() && self.curves.is_empty() {
            return Ok(self.steady(&Factors::default(), run, motion)?.force_n);
        }
        let context = Context::of(self, run, motion)?;
        let mut force = context.steady.force_n.clone();
        for own in self.beside_law_n(&context) {
            for (sum, x) in force.iter_mut().zip(own) {
                *sum += x;
            }
        }
        Ok(force)
    }

    /// Force of each mechanism and each curve of the file that the run shows, N per row.
    pub fn beside_law_n(&self, context: &Context<'_>) -> impl Iterator<Item = Vec<f64>> {
        let named = self.mechanisms.iter().filter_map(|added| added.force_n(context));
        named.chain(self.curves.iter().filter_map(|added| added.force_n(context)))
    }
}
