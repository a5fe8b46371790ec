//! Where a cause acts.

use simulation::curve::Axis;

use crate::fit::source::Source;
use crate::recording::side::Side;
use crate::report::Region;

/// Region where a cause acts: the part of its axis that holds the central 90 % of its power.
pub(crate) fn region(
    side: &Side<'_>,
    compared: &[bool],
    source: &Source,
    force: &[f64],
    share: f64,
    id: &str,
) -> Option<Region> {
    let axis_name = match source {
        Source::Mechanism { definition, .. } => definition.axis,
        Source::Shift { .. } => "velocity",
        Source::Story { curve } => curve.axis.name(),
    };
    if let ("wavelength" | "frequency", Source::Mechanism { definition, form, shape }) = (axis_name, source) {
        let unit = if axis_name == "wavelength" { "m" } else { "Hz" };
        let at = definition.forms[*form].shape.iter().position(|parameter| parameter.unit == unit)?;
        return Some(Region { axis: definition.axis, from: shape[at], to: shape[at], unit, share, id: id.to_owned() });
    }
    if let Source::Story { curve } = source
        && let Some(period_s) = curve.period_s()
    {
        let hz = 1.0 / period_s;
        return Some(Region { axis: "frequency", from: hz, to: hz, unit: "Hz", share, id: id.to_owned() });
    }
    let axis = Axis::of_name(axis_name)?;
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut start = 0;
    for context in &side.contexts {
        if let Some(values) = axis.values(context) {
            for (n, value) in values.iter().enumerate() {
                if compared[start + n] && value.is_finite() {
                    points.push((*value, force[start + n] * force[start + n]));
                }
            }
        }
        start += context.run.len();
    }
    points.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = points.iter().map(|(_, power)| power).sum();
    let (mut sum, mut from, mut to) = (0.0, None, None);
    for (value, power) in &points {
        sum += power;
        if from.is_none() && sum >= 0.05 * total {
            from = Some(*value);
        }
        if to.is_none() && sum >= 0.95 * total {
            to = Some(*value);
        }
    }
    Some(Region { axis: axis.name(), from: from?, to: to?, unit: axis.unit(), share, id: id.to_owned() })
}
