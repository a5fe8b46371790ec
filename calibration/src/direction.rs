//! Whether the drag differs between the two directions of travel.
//!
//! ```text
//! F = law + d (offset + gain·law)        d: +1 or -1, the direction of the stroke; F against the motion
//! ```
//!
//! The two columns are tested beside the tangent of the whole law, so that what a constant of the law could explain
//! does not count as an asymmetry.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::cell::Cell;
use crate::fit::FrictionFit;

/// p-value below which an asymmetry is accepted.
pub const BELIEVED: f64 = 0.01;

/// A difference between the directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asymmetry {
    /// Half the difference that does not depend on the force, N, and its standard deviation: from the zero of the force
    /// sensor, tilt or a chain.
    pub offset_n: (f64, f64),
    /// Half the difference relative to the force, and its standard deviation.
    pub gain: (f64, f64),
    /// p-value of the difference (F test).
    pub p_value: f64,
}

impl Asymmetry {
    /// The asymmetry in the strokes of `fit`. `None` where not both directions were measured, or they were averaged.
    pub fn of(cells: &[Cell], fit: &FrictionFit) -> Option<Self> {
        let directions: Vec<f64> = cells.iter().map(|c| c.direction.signum()).collect();
        let both = [1.0, -1.0].iter().all(|d| directions.iter().filter(|x| *x == d).count() >= 3);
        if !both || cells.iter().any(|c| c.direction == 0.0) {
            return None;
        }
        let tangent = fit.tangent();
        let constants = tangent.ncols();
        let columns = DMatrix::from_fn(cells.len(), constants + 2, |n, j| match j {
            j if j < constants => tangent[(n, j)],
            j if j == constants => directions[n] / fit.sigmas_n[n],
            // the fitted force, not the measured one, whose noise would be in the column
            _ => directions[n] * (cells[n].force_n - fit.residuals_n[n]) / fit.sigmas_n[n],
        });
        let target = DVector::from_fn(cells.len(), |n, _| fit.residuals_n[n] / fit.sigmas_n[n]);
        // columns of unit length: constants of the law differ by ten orders of magnitude
        let lengths: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        let mut scaled = columns;
        for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
            column /= length.max(1e-300);
        }
        let inverse = (scaled.transpose() * &scaled).try_inverse()?;
        let found = &inverse * (scaled.transpose() * &target);
        let rest = (&target - &scaled * &found).norm_squared();
        let freedom = cells.len().checked_sub(constants + 2).filter(|f| *f > 0)? as f64;
        let ratio = ((target.norm_squared() - rest) / 2.0) / (rest / freedom);
        let spread = (rest / freedom).sqrt();
        let one = |j: usize| (found[j] / lengths[j], spread * inverse[(j, j)].sqrt() / lengths[j]);
        Some(Asymmetry {
            offset_n: one(constants),
            gain: one(constants + 1),
            p_value: FisherSnedecor::new(2.0, freedom).ok()?.sf(ratio.max(0.0)),
        })
    }

    /// The cells with the asymmetry removed.
    pub fn taken_off(&self, cells: &[Cell]) -> Vec<Cell> {
        let even = |c: &Cell| {
            let d = c.direction.signum();
            Cell { force_n: (c.force_n - d * self.offset_n.0) / (1.0 + d * self.gain.0), ..*c }
        };
        cells.iter().map(even).collect()
    }
}
