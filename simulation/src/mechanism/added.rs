//! A mechanism with its numbers.

use super::{Context, Form, Id, definition};
use crate::file::Simulation;
use crate::law::Missing;
use crate::motion::Motion;
use crate::run::Run;

/// A mechanism that an augmented simulation has: an entry of its file.
///
/// ```toml
/// [[mechanism]]
/// id = "viscous-drag"
/// form = "power"
/// exponent = 0.7
/// at_reference_speed_n = 1.2
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Added {
    /// Which one.
    pub id: Id,
    /// Number of its form.
    pub form: usize,
    /// In the order of the form's shape parameters.
    pub shape: Vec<f64>,
    /// In the order of the form's amplitudes.
    pub amplitudes: Vec<f64>,
}

impl Added {
    /// Its form; `None` for a number that the mechanism does not have.
    pub fn form(&self) -> Option<&'static Form> {
        definition(self.id).forms.get(self.form)
    }

    /// The force that it adds, N per row; `None` where the run cannot show it.
    pub fn force_n(&self, context: &Context<'_>) -> Option<Vec<f64>> {
        let columns = (self.form()?.columns)(context, &self.shape)?;
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
    /// Force of the law and its mechanisms, N per row; NaN where the law has none. A mechanism that the run cannot show
    /// adds nothing.
    ///
    /// # Errors
    /// [`Missing`].
    pub fn force(&self, run: &Run, motion: &Motion) -> Result<Vec<f64>, Missing> {
        if self.mechanisms.is_empty() {
            return Ok(self.steady(&crate::law::Factors::default(), run, motion)?.force_n);
        }
        let context = Context::of(self, run, motion)?;
        let mut force = context.steady.force_n.clone();
        for added in &self.mechanisms {
            for (sum, x) in force.iter_mut().zip(added.force_n(&context).unwrap_or_default()) {
                *sum += x;
            }
        }
        Ok(force)
    }
}
