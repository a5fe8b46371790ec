//! The one table of legal ranges: it feeds the checks, the messages and the test generators.

use crate::Error;

/// Legal range of one quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Name as parameter files and messages spell it.
    pub name: &'static str,
    /// Smallest legal value.
    pub min: f64,
    /// Largest legal value.
    pub max: f64,
    /// Unit of both.
    pub unit: &'static str,
}

const fn row(name: &'static str, min: f64, max: f64, unit: &'static str) -> Range {
    Range { name, min, max, unit }
}

/// Every quantity that a person can set.
///
/// Wide on purpose: a range says for which values the formulas work, not which are sensible.
pub const RANGES: [Range; 44] = [
    row("ball_diameter_m", 0.5e-3, 50e-3, "m"),
    row("balls_per_row", 1.0, 200.0, "balls"),
    row("contact_angle_rad", 0.1, 1.4, "rad"),
    row("conformity", 0.501, 0.6, "(groove radius over ball diameter)"),
    row("young_modulus_pa", 50e9, 800e9, "Pa"),
    row("poisson_ratio", 0.0, 0.49, ""),
    row("initial_interference_m", 0.0, 100e-6, "m"),
    row("mu_coulomb", 1e-5, 0.5, ""),
    row("mu_viscous", 0.0, 1e12, "1/m"),
    row("mu_stribeck", 0.0, 0.5, ""),
    row("stribeck_exponent", 1e3, 1e16, "1/m"),
    row("viscosity_cst", 0.1, 1e5, "cSt"),
    row("newtons_per_code", -100.0, 100.0, "N"),
    row("zero_code", 0.0, 4095.0, "codes"),
    row("rail_low_code", 0.0, 4095.0, "codes"),
    row("rail_high_code", 0.0, 4095.0, "codes"),
    row("metres_per_count", -1e-3, 1e-3, "m"),
    row("thermistor_ohm", 10.0, 1e7, "ohm"),
    row("thermistor_beta_k", 500.0, 10_000.0, "K"),
    row("speed_m_s", 0.0, 20.0, "m/s"),
    row("preload_n", 0.0, 1e6, "N"),
    row("temperature_degc", -60.0, 200.0, "degC"),
    row("seal_drag_n", 0.0, 1e4, "N"),
    row("seal_viscous_n_s_m", 0.0, 1e5, "N s/m"),
    row("moved_mass_kg", 0.0, 1e5, "kg"),
    row("publish_every_blocks", 1.0, 1000.0, "blocks of 10 ms"),
    row("presliding_guard_m", 0.0, 0.1, "m"),
    row("ball_pass_wavelength_m", 1e-4, 1.0, "m"),
    row("relative_sigma", 0.0, 1.0, ""),
    row("force_sigma_n", 0.0, 1e4, "N"),
    row("temperature_sigma_k", 0.0, 50.0, "K"),
    row("braking_limit_m_s2", 0.1, 1000.0, "m/s2"),
    row("left_out_part", -0.5, 0.5, ""),
    row("left_out_force_n", -1e4, 1e4, "N"),
    row("left_out_viscous_n_s_m", -1e5, 1e5, "N s/m or N/m"),
    row("speed_exponent", 0.0, 3.0, ""),
    row("oil_part", 0.0, 2.0, ""),
    row("load_part", 0.0, 2.0, ""),
    row("external_load_n", -1e6, 1e6, "N (at most 1.4 times the lowest preload)"),
    row("lag_s", -1.0, 1.0, "s"),
    row("wavelength_m", 1e-6, 100.0, "m"),
    row("place_m", -1e4, 1e4, "m"),
    row("rail_knots", 2.0, 64.0, "knots"),
    row("rail_step_m", 1e-4, 10.0, "m"),
];

/// The row of [`RANGES`] with this name.
#[inline(never)]
pub fn range(name: &str) -> Option<&'static Range> {
    RANGES.iter().find(|r| r.name == name)
}

/// Checks a value against its row of [`RANGES`].
///
/// # Errors
/// [`Error::NonFinite`] or [`Error::OutOfRange`], naming the quantity; a name without a row is refused too.
pub fn check(name: &'static str, value: f64) -> Result<(), Error> {
    if !value.is_finite() {
        return Err(Error::NonFinite(name));
    }
    match range(name) {
        Some(r) if value >= r.min && value <= r.max => Ok(()),
        _ => Err(Error::OutOfRange(name)),
    }
}

/// [`check`] for a value kept in f32: a limit rounded to f32 is still legal.
///
/// # Errors
/// As [`check`].
#[inline(never)]
pub fn check_f32(name: &'static str, value: f32) -> Result<(), Error> {
    match range(name) {
        Some(r) if value >= r.min as f32 && value <= r.max as f32 => Ok(()),
        _ if value.is_finite() => Err(Error::OutOfRange(name)),
        _ => Err(Error::NonFinite(name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_range_and_has_one_name() {
        for (n, r) in RANGES.iter().enumerate() {
            assert!(r.min < r.max, "{}", r.name);
            assert!(RANGES[..n].iter().all(|o| o.name != r.name), "{} twice", r.name);
        }
    }

    #[test]
    fn borders_are_legal_and_beyond_is_not() {
        assert_eq!(check("conformity", 0.501), Ok(()));
        assert_eq!(check("conformity", 0.5), Err(Error::OutOfRange("conformity")));
        assert_eq!(check("conformity", f64::NAN), Err(Error::NonFinite("conformity")));
        assert_eq!(check("no such thing", 1.0), Err(Error::OutOfRange("no such thing")));
        // 0.1 as f32 is a little more than 0.1
        assert_eq!(check_f32("presliding_guard_m", 0.1), Ok(()));
        assert_eq!(check_f32("presliding_guard_m", 0.100_001), Err(Error::OutOfRange("presliding_guard_m")));
        assert_eq!(check_f32("presliding_guard_m", f32::NAN), Err(Error::NonFinite("presliding_guard_m")));
    }
}
