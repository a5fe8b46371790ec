//! A guide's calibration in words, and as JSON.

use calibration::convention::DECISIVE;
use model_core::contact::HerseySpeed;
use serde_json::{Value, json};

use super::Calibration;

/// Name of a convention.
pub(super) fn convention(speed: HerseySpeed) -> &'static str {
    match speed {
        HerseySpeed::Slip => "slip",
        HerseySpeed::Carriage => "carriage",
    }
}

/// Sentence on which convention the strokes support.
pub(super) fn decision(found: &Calibration) -> String {
    let difference = found.convention_difference;
    let used = convention(found.set.exact().guide().hersey_speed);
    match found.decision {
        Some(better) => format!(
            "Hersey number: the strokes ask for the {} speed (difference of AIC {:.1}; {DECISIVE} is decisive); used: {used}",
            convention(better),
            difference.abs()
        ),
        None => format!(
            "Hersey number: the strokes cannot tell sliding speed from carriage speed (difference of AIC {:.1}; {DECISIVE} \
             is decisive); used: {used}",
            difference.abs()
        ),
    }
}

/// Sentence on the difference of the directions.
pub(super) fn directions(found: &Calibration) -> String {
    match found.asymmetry {
        None => "Directions: only one, or their mean, was measured".to_owned(),
        Some(a) => {
            let numbers = format!(
                "offset {:+.3} ± {:.3} N, {:+.2} ± {:.2} % of the force, probability of chance {:.2e}",
                a.offset_n.0,
                1.96 * a.offset_n.1,
                100.0 * a.gain.0,
                196.0 * a.gain.1,
                a.p_value
            );
            if found.is_asymmetric() {
                format!("Directions differ and their mean is fitted: {numbers}")
            } else {
                format!("Directions agree: {numbers}")
            }
        }
    }
}

/// Sentence on the pattern in the residuals.
pub(super) fn pattern(found: &Calibration) -> String {
    match found.pattern {
        None => "Pattern in the residuals: cannot be judged, no stroke was repeated".to_owned(),
        Some(p) if p < 0.01 => format!(
            "Pattern in the residuals: yes (probability of chance {p:.1e}): the law misses something that repeats, and the \
             intervals above, which do not know of it, are too narrow; see the residual map"
        ),
        Some(p) => format!("Pattern in the residuals: none (probability of chance {p:.2})"),
    }
}

/// Lines for the terminal.
pub fn describe(found: &Calibration) -> Vec<String> {
    let fit = &found.fit;
    let loads =
        found.grid.iter().map(|c| c.reference_n).fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
    let mut lines = vec![
        format!(
            "{} strokes in {} cells, {:.0} to {:.0} N; they scatter by {:.2} % of the force and {:.3} N",
            found.cells.len(),
            found.grid.len(),
            loads.0,
            loads.1,
            100.0 * fit.noise.relative,
            fit.noise.absolute_n
        ),
        decision(found),
        directions(found),
        format!("{:20} {:>14} {:>12}   68 %                         95 %", "", "value", "sigma"),
    ];
    for c in &found.constants {
        let (one, two) = (c.ci68, c.ci95);
        let open = if c.is_of_law() && !c.is_determined { "  not determined" } else { "" };
        lines.push(format!(
            "{:20} {:>14.6e} {:>12.2e}   {:>12.5e} {:>12.5e}   {:>12.5e} {:>12.5e} {}{open}",
            c.name, c.value, c.sigma, one.from, one.to, two.from, two.to, c.unit
        ));
    }
    for (d, own) in &found.directions {
        let values: Vec<String> = own.values().iter().map(|x| format!("{x:.4e}")).collect();
        lines.push(format!("  direction {d:+} alone: {}", values.join("  ")));
    }
    lines.push(pattern(found));
    lines.extend(doubts(found));
    lines
}

/// What the strokes leave open, in lines.
pub fn doubts(found: &Calibration) -> Vec<String> {
    let doubts = found.doubts.iter().map(|d| format!("  - {}", d.text));
    std::iter::once("What these strokes leave open:".to_owned()).chain(doubts).collect()
}

/// The calibration as one JSON object.
pub fn object(name_of_input: &str, found: &Calibration) -> Value {
    let fit = &found.fit;
    let constants: Vec<Value> = found
        .constants
        .iter()
        .map(|c| {
            json!({
                "name": c.name, "unit": c.unit, "value": c.value, "sigma": c.sigma,
                // an end that is not determined is null
                "ci68": [c.ci68.from, c.ci68.to], "ci95": [c.ci95.from, c.ci95.to], "determined": c.is_determined,
            })
        })
        .collect();
    let rows = fit.covariance.nrows();
    let balls = found.set.exact().guide().loaded_balls();
    json!({
        "schema": "guideblock.calibration/1",
        "recording": name_of_input,
        "strokes": found.cells.len(),
        "hersey": convention(found.set.exact().guide().hersey_speed),
        "hersey_decided_by_strokes": found.decision.map(convention),
        "aic_carriage_less_slip": found.convention_difference,
        "constants": constants,
        "covariance": (0..rows).map(|a| (0..rows).map(|b| fit.covariance[(a, b)]).collect()).collect::<Vec<Vec<f64>>>(),
        "noise": {"relative": fit.noise.relative, "absolute_n": fit.noise.absolute_n},
        "chi2": fit.chi2,
        "freedom": fit.freedom(),
        "asymmetry": found.asymmetry.map(|a| json!({
            "offset_n": a.offset_n.0, "offset_sigma_n": a.offset_n.1, "gain": a.gain.0, "gain_sigma": a.gain.1,
            "p_value": a.p_value, "taken_off": found.is_asymmetric(),
        })),
        "directions": found.directions.iter().map(|(d, own)| json!({
            "direction": d, "values": own.values(), "sigmas": (0..4).map(|n| own.sigma(n)).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "pattern_p_value": found.pattern,
        "not_determined": found.doubts.iter().map(|d| json!({"code": d.code, "text": d.text})).collect::<Vec<_>>(),
        "cells": found.grid.iter().map(|c| json!({
            "reference_n": c.reference_n, "speed_m_s": c.speed_m_s, "direction": c.direction, "hersey": c.hersey,
            "strokes": c.strokes, "friction_coefficient": c.friction, "friction_coefficient_sigma": c.friction_sigma,
            "residual_over_sigma": c.residual,
        })).collect::<Vec<_>>(),
        "fitted_strokes": found.cells.iter().zip(&fit.sigmas_n).zip(&fit.residuals_n).map(|((c, sigma), residual)| json!({
            "normal_force_n": balls * c.load_per_ball_n,
            "hersey": c.hersey(found.set.exact(), found.set.hersey_scale()),
            "force_n": c.force_n, "sigma_n": sigma, "residual_n": residual, "seals": c.has_seals,
            "speed_m_s": c.speed_m_s,
        })).collect::<Vec<_>>(),
    })
}
