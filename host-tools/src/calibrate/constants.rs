//! The fitted constants with their intervals: computed once, as every end of an interval needs a fit.

use calibration::fit::{FrictionFit, NAMES};
use calibration::interval::Interval;

/// Units of the constants, in the order of [`NAMES`], then the seals'.
const UNITS: [&str; 6] = ["", "1/H", "", "1/H", "N", "N s/m"];

/// A fitted constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Name, as in a guide file; those of the seals `seal_coulomb_n` and `seal_viscous_n_s_m`.
    pub name: &'static str,
    /// Unit, H for that of the Hersey number; empty for a plain number.
    pub unit: &'static str,
    /// Value in that unit.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// 68 % confidence interval; an end that is not determined is infinite.
    pub ci68: Interval,
    /// 95 % confidence interval.
    pub ci95: Interval,
    /// Whether the strokes determine it, as [`FrictionFit::is_determined`].
    pub is_determined: bool,
}

impl Constant {
    /// Whether this is a constant of the friction law and no drag of the seals.
    pub fn is_of_law(&self) -> bool {
        NAMES.contains(&self.name)
    }
}

/// All constants of a fit: those of the law, then the seals' where they were fitted.
pub(super) fn constants(fit: &FrictionFit) -> Vec<Constant> {
    let names = NAMES.into_iter().chain(["seal_coulomb_n", "seal_viscous_n_s_m"]).zip(UNITS);
    let fitted = names.enumerate().take(fit.covariance.nrows());
    fitted
        .map(|(n, (name, unit))| Constant {
            name,
            unit,
            value: fit.constant(n),
            sigma: fit.sigma(n),
            ci68: fit.interval(n, 0.6827),
            ci95: fit.interval(n, 0.95),
            is_determined: fit.is_determined(n),
        })
        .collect()
}
