//! An axis' friction over its speed in words, and as JSON.

use calibration::axis_curve::{AxisCurve, Measured, Selection};
use serde_json::{Value, json};

fn constants(curve: &AxisCurve) -> Vec<(&'static str, Measured)> {
    [
        ("Coulomb", Some(curve.coulomb)),
        ("viscous", Some(curve.viscous)),
        ("offset of the directions", curve.offset),
        ("viscous, by direction", curve.viscous_asymmetry),
        ("Stribeck", curve.stribeck),
        ("Stribeck speed", curve.stribeck_speed),
    ]
    .into_iter()
    .filter_map(|(name, value)| value.map(|v| (name, v)))
    .collect()
}

/// Whether a Stribeck term is supported, in a sentence.
pub(super) fn verdict(found: &Selection) -> String {
    let least = |stribeck: bool| {
        found.trials.iter().filter(|t| t.terms.stribeck == stribeck).map(|t| t.error).fold(f64::INFINITY, f64::min)
    };
    let (without, with) = (least(false), least(true));
    if found.supports_stribeck {
        format!(
            "A Stribeck term is supported: a speed left out is foretold to {with:.4e} with it, {without:.4e} without"
        )
    } else {
        format!(
            "A Stribeck term is not supported: a speed left out is foretold to {with:.4e} with it, {without:.4e} without"
        )
    }
}

/// Lines for the terminal.
pub fn describe(found: &Selection) -> Vec<String> {
    let mut lines = vec![
        verdict(found),
        format!("Root of the mean squared error, leaving out one of {} speeds at a time:", found.speeds),
    ];
    for trial in &found.trials {
        let chosen = if trial.terms == found.curve.terms { "  <- chosen" } else { "" };
        lines.push(format!("  {:42} {:>12.4e}{chosen}", trial.terms.name(), trial.error));
    }
    lines.push(format!("{}:", found.curve.terms.name()));
    for (name, (value, sigma)) in constants(&found.curve) {
        lines.push(format!("  {name:42} {value:>12.4e} +- {:.1e}", 2.0 * sigma));
    }
    lines.push(format!("  {:42} {:>12.4e}", "root of the mean squared residual", found.curve.rms));
    lines
}

/// As one JSON object.
pub fn object(name_of_input: &str, found: &Selection) -> Value {
    json!({
        "schema": "guideblock.calibration/1",
        "recording": name_of_input,
        "law": found.curve.terms.name(),
        "stribeck_supported": found.supports_stribeck,
        "speeds": found.speeds,
        "leave_one_speed_out": found.trials.iter().map(|t| json!({
            "law": t.terms.name(), "stribeck": t.terms.stribeck, "viscous_asymmetry": t.terms.viscous_asymmetry,
            "rms_error": t.error,
        })).collect::<Vec<_>>(),
        "constants": constants(&found.curve).iter().map(|(name, (value, sigma))| json!({
            "name": name, "value": value, "sigma": sigma,
        })).collect::<Vec<_>>(),
        "rms_residual": found.curve.rms,
    })
}
