//! Export: the simulation file with the calibrated parameters.
//!
//! Every factor goes to the number of the file that it multiplies: friction to the friction constants, viscosity to
//! `hersey_scale` (the two enter the law only as a product), preload to `[operation]` and, where the recording measures
//! it, to the scale that its column is read with. For a column of simulated force all three go to `[simulated_force]`:
//! they do not apply to an inertia that the column includes.

use simulation::Simulation;
use simulation::curve::{AddedCurve, Axis};
use simulation::file::Law;
use simulation::guide::GuideSet;
use simulation::law::Factors;

/// Applies the factors.
///
/// # Errors
/// A calibrated number that the file format does not allow; the text says which.
pub(crate) fn calibrated(simulation: &Simulation, factors: &Factors) -> Result<Simulation, String> {
    let mut calibrated = simulation.clone();
    match &mut calibrated.law {
        Law::Guide(set) => {
            let terms = [
                ("mu_coulomb", factors.friction * factors.mu_coulomb),
                ("mu_viscous", factors.friction * factors.mu_viscous),
                ("mu_stribeck", factors.friction * factors.mu_stribeck),
            ];
            for (key, factor) in terms {
                let constants = set.exact().friction();
                let now = match key {
                    "mu_coulomb" => constants.mu_coulomb,
                    "mu_viscous" => constants.mu_viscous,
                    _ => constants.mu_stribeck,
                };
                *set = with(set, key, now, factor)?;
            }
            *set = with(set, "hersey_scale", set.hersey_scale(), factors.viscosity)?;
            if let Some(preload) = &mut calibrated.preload_n {
                *preload *= factors.preload;
            }
            scale_column(&mut calibrated.columns, "preload_n", factors.preload);
        }
        Law::CoulombViscous { coulomb_n, viscous_n_s_m, .. } => {
            if let Some(coulomb) = coulomb_n {
                *coulomb *= factors.friction * factors.mu_coulomb;
            }
            if let Some(viscous) = viscous_n_s_m {
                *viscous *= factors.friction * factors.mu_viscous;
            }
        }
        Law::Column { friction, inertia, preload, viscosity } => {
            *friction *= factors.friction;
            *inertia *= factors.mass;
            *preload *= factors.preload;
            *viscosity *= factors.viscosity;
        }
    }
    if let Some(mass) = &mut calibrated.axis.moved_mass_kg {
        *mass *= factors.mass;
    }
    match Simulation::from_toml(&calibrated.to_toml()) {
        Ok(_) => Ok(calibrated),
        Err(bad) => Err(bad.what),
    }
}

/// Moves the knots of a curve over preload to where the calibrated file reads them: it scales that column by its
/// factor.
pub(crate) fn as_read(added: &mut AddedCurve, calibrated: &Simulation, factors: &Factors) {
    if added.curve.axis == Axis::Preload && matches!(calibrated.law, Law::Guide(_)) {
        added.curve.knots.iter_mut().for_each(|knot| *knot *= factors.preload);
    }
}

fn with(set: &GuideSet, key: &str, now: f64, factor: f64) -> Result<GuideSet, String> {
    if factor == 1.0 || now == 0.0 { Ok(set.clone()) } else { set.with_number(key, now * factor) }
}

/// Multiplies the scale that a column is read with.
fn scale_column(columns: &mut Vec<(String, String)>, name: &str, factor: f64) {
    if factor == 1.0 {
        return;
    }
    match columns.iter_mut().find(|(own, _)| own == name) {
        Some((_, mapping)) => {
            let mut parts = mapping.split(':');
            let column = parts.next().unwrap_or(name).to_owned();
            let mut number = |missing: f64| parts.next().and_then(|text| text.trim().parse().ok()).unwrap_or(missing);
            let (scale, offset) = (number(1.0), number(0.0));
            *mapping = format!("{column}:{:?}:{:?}", scale * factor, offset * factor);
        }
        None => columns.push((name.to_owned(), format!("{name}:{factor:?}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_reach_the_file() {
        let simulation = Simulation::from_toml(
            "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[operation]\npreload_n = 1000.0\n",
        )
        .expect("legal");
        let factors = Factors { preload: 1.1, friction: 0.9, viscosity: 1.2, ..Factors::default() };
        let calibrated = calibrated(&simulation, &factors).expect("in range");
        assert!((calibrated.preload_n.expect("given") - 1100.0).abs() < 1e-9);
        assert_eq!(calibrated.columns, [("preload_n".to_owned(), "preload_n:1.1".to_owned())]);
        let Law::Guide(set) = &calibrated.law else { panic!("a guide") };
        assert!((set.hersey_scale() - 1.2).abs() < 1e-12);
        assert!((set.exact().friction().mu_coulomb / 0.00182 - 0.9).abs() < 1e-9);
    }

    #[test]
    fn a_number_that_the_file_does_not_allow_is_told() {
        let simulation = Simulation::from_toml(
            "schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 1e6\n",
        )
        .expect("legal");
        let why = calibrated(&simulation, &Factors { friction: 1.1, ..Factors::default() }).expect_err("out of range");
        assert!(why.starts_with("guide.coulomb_n must lie between 0 and 1000000 N, not 11000"), "{why}");
    }
}
