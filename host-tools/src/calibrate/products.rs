//! Products of a calibration: the guide file, an axis' file, and the parameter record of a block.

use can_wire::parameters::ParameterRecord;
use model_core::reduced::Reduced;
use model_core::viscosity::ViscosityCubic;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::Lubricant;

use super::Calibration;
use calibration::axis_curve::{Measured, Selection};
use calibration::fit::NAMES;
use simulation::mechanism::{Added, Id};

/// Why the fitted law is not written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unfit {
    /// The constants are not those of a law.
    #[error("the fitted constants make no usable law: {0}; what the strokes leave open is listed above")]
    Law(String),
    /// A constant is not determined.
    #[error("{0} is not determined by these strokes, so a block that used it would give numbers that mean nothing")]
    Open(&'static str),
}

/// The given guide with the fitted constants; its tolerance is the fit's uncertainty of the friction coefficient.
///
/// # Errors
/// [`Unfit::Law`].
pub fn guide_file(calibration: &Calibration, base: &Simulation) -> Result<Simulation, Unfit> {
    let numbers: Vec<(&str, f64)> = NAMES.into_iter().zip(calibration.fit.values()).collect();
    let set = calibration.set.with_numbers(&numbers).map_err(Unfit::Law)?;
    let mut simulation = Simulation { law: Law::Guide(set), ..base.clone() };
    simulation.tolerance.friction = friction_sigma(calibration);
    Ok(simulation)
}

/// The axis as a simulation file: its Coulomb and viscous friction as the law, the terms beyond it as mechanisms. Its
/// mass does not show in strokes at steady speed and is left to be fitted.
pub fn axis_file(found: &Selection) -> Simulation {
    let curve = &found.curve;
    let value = |m: Option<Measured>| m.map(|m| m.0);
    let mut simulation = Simulation::of(Law::CoulombViscous {
        coulomb_n: Some(curve.coulomb.0),
        viscous_n_s_m: Some(curve.viscous.0),
        offset_n: Some(value(curve.offset).unwrap_or(0.0)),
    });
    if let (Some(force), Some(speed)) = (value(curve.stribeck), value(curve.stribeck_speed)) {
        let stribeck = Added { id: Id::Stribeck, form: 0, shape: vec![speed], amplitudes: vec![force] };
        simulation.mechanisms.push(stribeck);
    }
    if let Some(viscous) = value(curve.viscous_asymmetry) {
        // the form whose first amplitude is the share of the friction, before the part that grows with speed
        simulation.mechanisms.push(Added {
            id: Id::DirectionAsymmetry,
            form: 1,
            shape: Vec::new(),
            amplitudes: vec![0.0, viscous],
        });
    }
    simulation
}

/// Relative standard deviation of the friction coefficient over the strokes, RMS.
fn friction_sigma(calibration: &Calibration) -> f64 {
    let set = &calibration.set;
    let loaded = calibration.cells.iter().filter(|c| c.load_per_ball_n > 0.0);
    let squares: Vec<f64> = loaded
        .map(|c| calibration.fit.friction_uncertainty(c.hersey(set.exact(), set.hersey_scale())))
        .map(|u| u * u)
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The record of a block: `base` with the fitted law, seals and limits, marked as calibrated.
///
/// # Errors
/// [`Unfit`].
pub fn record(calibration: &Calibration, base: &ParameterRecord) -> Result<ParameterRecord, Unfit> {
    if let Some(open) = calibration.constants.iter().find(|c| c.is_of_law() && !c.is_determined) {
        return Err(Unfit::Open(open.name));
    }
    let numbers: Vec<(&str, f64)> = NAMES.into_iter().zip(calibration.fit.values()).collect();
    let set = calibration.set.with_numbers(&numbers).map_err(Unfit::Law)?;
    let exact = set.exact();
    let loaded = || calibration.cells.iter().filter(|c| c.load_per_ball_n > 0.0);
    let ends = |of: &dyn Fn(&calibration::cell::Cell) -> f64| {
        loaded().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    };
    let highest = ends(&|c| c.load_per_ball_n).1;
    let mut params = base.params;
    params.calibrated = true;
    // headroom of a quarter, so that a load at the edge of the range still gives a number beside its reason
    params.law = Reduced::of(exact.guide(), exact.friction(), 1.25 * highest).to_f32();
    params.viscosity_number_per_cst = set.hersey_scale() as f32;
    params.viscosity = match set.lubricant() {
        Lubricant::Walther(oil) => oil
            .cubic(f64::from(params.viscosity.from_degc), f64::from(params.viscosity.to_degc))
            .map_err(|why| Unfit::Law(format!("the oil's viscosity: {why}")))?,
        // a constant viscosity: no slope
        Lubricant::Constant(nu) => ViscosityCubic { ln: [nu.ln() as f32, 0.0, 0.0, 0.0], ..params.viscosity },
    };
    if let Some(drag) = calibration.fit.seal_drag_n {
        params.seals.coulomb_n = drag as f32;
        params.seals.viscous_n_s_m = calibration.fit.seal_viscous_n_s_m.unwrap_or(0.0) as f32;
        params.uncertainty.seals_n = calibration.fit.sigma(4) as f32;
    }
    let (preload, speed) = (ends(&|c| exact.preload_n(c.load_per_ball_n)), ends(&|c| c.speed_m_s));
    params.range.preload_from_n = preload.0 as f32;
    params.range.preload_to_n = preload.1 as f32;
    params.range.speed_from_m_s = speed.0 as f32;
    params.range.speed_to_m_s = speed.1 as f32;
    params.uncertainty.friction = friction_sigma(calibration) as f32;
    Ok(ParameterRecord { params, ..*base })
}
