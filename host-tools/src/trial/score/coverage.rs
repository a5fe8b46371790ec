//! Whether stated intervals hold the truth, where a number means the same on both sides.
//!
//! Generator and analyser describe most effects by different forms on purpose; only the numbers of [`COMPARABLE`] mean the
//! same in both. A stated 95 % interval is scored as it is; its 90 % interval is the same shrunk about the value by
//! 1.645/1.960, as for a normal error.

use serde::Serialize;

use super::answer::Named;
use super::truth::{Effect, Truth};

/// Quantile of the normal law for 90 % over that for 95 %.
const SHRINK: f64 = 1.644_854 / 1.959_964;

/// A stated number against the true one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Covered {
    /// Id and name of the number.
    pub parameter: String,
    /// True value.
    pub truth: f64,
    /// Stated value.
    pub value: f64,
    /// Whether the 90 % interval holds the truth.
    pub is_in_90: bool,
    /// Whether the 95 % interval does.
    pub is_in_95: bool,
}

/// Ids and names of the numbers that are compared, as the page lists them.
pub const COMPARABLE: [&str; 13] = [
    "force-offset force_n",
    "gravity-tilt force_n",
    "force-gain excess",
    "inertia mass_kg",
    "time-misalignment advance_s",
    "force-lowpass time_s (first order)",
    "frictional-lag time_s (equal up and down)",
    "force-quantisation step_n",
    "drive-ripple wavelength_m",
    "encoder-cyclic-error period_m",
    "structural-resonance frequency_hz",
    "parameter-shift preload, friction, viscosity, mass, coulomb, viscous",
    "parameter-shift offset",
];

/// Name of the analyser's number and its true value, for an effect that was named by its own id.
fn comparable(effect: &Effect, truth: &Truth) -> Option<(String, f64)> {
    let sign = effect.number("sign").unwrap_or(1.0);
    let number = |name: &str| effect.number(name);
    let (name, value) = match effect.id.as_str() {
        "force-offset" => ("force_n", sign * number("offset_n")?),
        "gravity-tilt" => ("force_n", sign * number("weight_component_n")?),
        "force-gain" => ("excess", sign * number("gain_error")?),
        "inertia" => ("mass_kg", number("mass_kg")?),
        // a late force is a negative advance
        "time-misalignment" => ("advance_s", -sign * number("delay_s")?),
        "force-lowpass" if number("order") == Some(1.0) => ("time_s", number("time_constant_s")?),
        "frictional-lag" if number("down_ratio") == Some(1.0) => ("time_s", number("lag_s")?),
        "force-quantisation" => ("step_n", number("step_n")?),
        "drive-ripple" => ("wavelength_m", number("lead_m")?),
        "encoder-cyclic-error" => ("period_m", number("period_m")?),
        "structural-resonance" => ("frequency_hz", number("frequency_hz")?),
        "parameter-shift" => {
            let which = effect.word("parameter")?;
            let change = number("change")?;
            let off = truth.stated_constants_off.get(which).copied().unwrap_or(0.0);
            let factor = if which == "offset" { change } else { (1.0 + change) * (1.0 + off) };
            return Some((which.to_owned(), factor));
        }
        _ => return None,
    };
    Some((name.to_owned(), value))
}

/// Every comparable number of the named entries.
pub fn coverage(truth: &Truth, named: &[Named]) -> Vec<Covered> {
    let mut out = Vec::new();
    for effect in &truth.effects {
        let Some((name, is)) = comparable(effect, truth) else { continue };
        let entry = named.iter().find(|entry| entry.id == effect.id);
        let stated = entry.and_then(|entry| entry.parameters.iter().find(|p| is_called(&p.name, &name)));
        let Some((value, [low, high])) = stated.and_then(|p| Some((p.value?, p.ci95?))) else { continue };
        // a shift is stated as a factor or as its excess over 1
        let is_excess =
            effect.id == "parameter-shift" && name != "offset" && (value - is).abs() > (value - is + 1.0).abs();
        let is = if is_excess { is - 1.0 } else { is };
        let holds = |part: f64| is >= value - part * (value - low) && is <= value + part * (high - value);
        out.push(Covered {
            parameter: format!("{} {name}", effect.id),
            truth: is,
            value,
            is_in_90: holds(SHRINK),
            is_in_95: holds(1.0),
        });
    }
    out
}

/// A name with or without its unit.
fn is_called(stated: &str, name: &str) -> bool {
    let plain = ["_kg", "_hz", "_n", "_s", "_m"].iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    stated == name || stated == plain
}

#[cfg(test)]
mod tests {
    use super::super::answer::Interval;
    use super::super::truth::Parameter;
    use super::*;

    fn truth(id: &str, numbers: &[(&str, f64)]) -> Truth {
        let parameters =
            numbers.iter().map(|(name, value)| Parameter { name: (*name).into(), value: (*value).into() }).collect();
        Truth { effects: vec![Effect { id: id.into(), parameters, ..Effect::default() }], ..Truth::default() }
    }

    fn said(id: &str, name: &str, value: f64, ci95: [f64; 2]) -> [Named; 1] {
        let parameters = vec![Interval { name: name.into(), value: Some(value), ci95: Some(ci95) }];
        [Named { id: id.into(), parameters, ..Named::default() }]
    }

    #[test]
    fn intervals_are_held_against_numbers_that_mean_the_same() {
        let late = truth("time-misalignment", &[("delay_s", 0.010), ("sign", 1.0)]);
        let inside = |low, high| {
            let got = coverage(&late, &said("time-misalignment", "advance_s", -0.0098, [low, high]));
            (got[0].is_in_90, got[0].is_in_95)
        };
        assert_eq!(inside(-0.0101, -0.0095), (true, true));
        assert_eq!(inside(-0.01002, -0.0095), (false, true), "95 % holds it, 90 % does not");
        assert_eq!(inside(-0.0099, -0.0097), (false, false));
        // another form, another name, another id: not compared
        assert!(
            coverage(&truth("run-in", &[("first_n", 1.0)]), &said("run-in", "force_n", 1.0, [0.0, 2.0])).is_empty()
        );
        assert!(coverage(&late, &said("force-lowpass", "advance_s", -0.01, [-1.0, 1.0])).is_empty());
    }

    #[test]
    fn a_shift_is_a_factor_or_its_excess_and_holds_the_admitted_error_too() {
        let mut shift = truth("parameter-shift", &[("change", 0.05)]);
        shift.effects[0].parameters.push(Parameter { name: "parameter".into(), value: "friction".into() });
        shift.stated_constants_off.insert("friction".into(), -0.01);
        for (change, value, ci95) in [
            (0.05, 1.04, [1.03, 1.05]),
            (0.05, 0.04, [0.03, 0.05]),
            (1.0, 1.98, [1.97, 1.99]),
            (1.0, 0.98, [0.97, 0.99]),
        ] {
            shift.effects[0].parameters[0].value = change.into();
            let got = coverage(&shift, &said("parameter-shift", "friction", value, ci95));
            assert!(got[0].is_in_95 && (got[0].truth - value).abs() < 1e-3, "{got:?}");
        }
    }
}
