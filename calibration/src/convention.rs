//! Convention of the Hersey number, chosen by comparison: sliding speed of Eq. 12 or carriage speed.
//!
//! Both laws have the same number of constants and are fitted to the same strokes; the difference of their deviances
//! (-2 ln likelihood) is that of their AIC. Only the load distinguishes them: with slip H grows as `Q^(1/3)`, with the
//! carriage speed it falls as `Q^(-1/3)`.

use model_core::contact::HerseySpeed;
use simulation::guide::GuideSet;

use crate::cell::Cell;
use crate::fit::{FrictionFit, NoFit, Seals};

/// Difference of the deviances from which one convention is called better: odds of 150 to 1.
pub const DECISIVE: f64 = 10.0;

/// One guide's strokes fitted under both conventions.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Sliding speed.
    pub slip: (GuideSet, FrictionFit),
    /// Carriage speed.
    pub carriage: (GuideSet, FrictionFit),
}

impl Comparison {
    /// Fits both.
    ///
    /// # Errors
    /// [`NoFit`] where either law cannot be fitted.
    pub fn of(cells: &[Cell], set: &GuideSet, seals: Seals) -> Result<Self, NoFit> {
        let fitted = |speed: HerseySpeed| -> Result<(GuideSet, FrictionFit), NoFit> {
            let set = set.with_hersey_speed(speed);
            let fit = FrictionFit::of(cells, set.exact(), set.hersey_scale(), seals)?;
            Ok((set, fit))
        };
        Ok(Comparison { slip: fitted(HerseySpeed::Slip)?, carriage: fitted(HerseySpeed::Carriage)? })
    }

    /// Deviance with the carriage speed less that with slip: positive supports slip.
    pub fn difference(&self) -> f64 {
        self.carriage.1.deviance - self.slip.1.deviance
    }

    /// The convention that the strokes support; `None` where undecided.
    pub fn decision(&self) -> Option<HerseySpeed> {
        match self.difference() {
            d if d >= DECISIVE => Some(HerseySpeed::Slip),
            d if d <= -DECISIVE => Some(HerseySpeed::Carriage),
            _ => None,
        }
    }

    /// The fit under a convention.
    pub fn under(&self, speed: HerseySpeed) -> &(GuideSet, FrictionFit) {
        match speed {
            HerseySpeed::Slip => &self.slip,
            HerseySpeed::Carriage => &self.carriage,
        }
    }
}
