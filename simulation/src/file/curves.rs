//! The entries `[[curve]]` of a simulation file: unnamed forces.
//!
//! ```toml
//! [[curve]]
//! axis = "velocity"
//! carrier = "odd"
//! at = [0.01, 0.1, 0.5]       # m/s
//! height = [0.0, 0.4, 1.3]    # N
//! ```
//!
//! A periodic curve has `axis = "clock"` and a period; the height at its end equals that at 0 and is not written.

use std::fmt::Write;

use toml::Spanned;
use toml::de::DeValue;

use crate::curve::{AddedCurve, Axis, Carrier, Curve};
use crate::document::{Item, Mistake, items};

/// Section name.
pub(super) const SECTION: &str = "curve";

/// Keys of an entry.
const KEYS: [&str; 5] = ["axis", "carrier", "period_s", "at", "height"];

/// Reads all entries.
pub(super) fn read(item: &Item<'_>) -> Result<Vec<AddedCurve>, Mistake> {
    let Some(entries) = item.value.get_ref().as_array() else {
        return Err(item.wrong("curves stand in entries that start with [[curve]], in two brackets"));
    };
    entries.iter().map(entry).collect()
}

fn entry(value: &Spanned<DeValue<'_>>) -> Result<AddedCurve, Mistake> {
    let Some(table) = value.get_ref().as_table() else {
        return Err(Mistake::new(&value.span(), "a curve must be a table with axis, carrier, at and height"));
    };
    let keys: Vec<Item<'_>> = items(SECTION, table).collect();
    if let Some(other) = keys.iter().find(|item| !KEYS.contains(&item.key)) {
        return Err(other.unknown(&KEYS));
    }
    let of = |key: &str| keys.iter().find(|item| item.key == key);
    let needed = |key: &str, such: &str| {
        of(key).ok_or_else(|| Mistake::new(&value.span(), format!("a curve needs {key}, such as {key} = {such}")))
    };
    let name = needed("axis", "\"velocity\"")?.one_of(&Axis::ALL.map(Axis::name))?;
    let axis = Axis::of_name(name).unwrap_or(Axis::Velocity);
    let carrier = match needed("carrier", "\"odd\"")?.one_of(&Carrier::ALL.map(Carrier::name))? {
        "even" => Carrier::Even,
        "odd" => Carrier::Odd,
        _ => Carrier::Drag,
    };
    let mut knots = knots(needed("at", "[0.01, 0.1, 0.5]")?, axis)?;
    let height = needed("height", "[0.0, 0.4, 1.3]")?;
    let mut heights = numbers(height, [-AddedCurve::MOST, AddedCurve::MOST], "N")?;
    if heights.len() != knots.len() {
        let (n, k) = (heights.len(), knots.len());
        return Err(height.wrong(format!("curve.height must have one number for each of curve.at: {k}, not {n}")));
    }
    match (of("period_s"), axis) {
        (Some(item), Axis::Clock) => {
            close(item, &mut knots)?;
            heights.extend(heights.first().copied());
        }
        (None, Axis::Clock) => {
            return Err(Mistake::new(
                &value.span(),
                "a curve along a clock needs period_s in s, such as period_s = 5.0",
            ));
        }
        (Some(item), _) => return Err(Mistake::new(&item.key_span, "curve.period_s is for axis = \"clock\" alone")),
        (None, _) => {}
    }
    Ok(AddedCurve { curve: Curve { axis, carrier, knots }, heights })
}

/// The knots, without the end of a period.
fn knots(item: &Item<'_>, axis: Axis) -> Result<Vec<f64>, Mistake> {
    let knots = numbers(item, axis.ends(), axis.unit())?;
    if knots.len() < 2 {
        return Err(item.wrong("curve.at must have two numbers or more"));
    }
    if !knots.is_sorted_by(|a, b| a < b) {
        return Err(item.wrong("the numbers of curve.at must rise, each above the one before"));
    }
    if axis == Axis::Clock && knots.first() != Some(&0.0) {
        return Err(item.wrong("curve.at of a clock must start at 0"));
    }
    Ok(knots)
}

/// Adds the end of a period to its knots.
fn close(item: &Item<'_>, knots: &mut Vec<f64>) -> Result<(), Mistake> {
    let (period, last) = (item.any_number()?, knots.last().copied().unwrap_or(0.0));
    let most = Axis::Clock.ends()[1];
    if !(period > last && period <= most) {
        let what =
            format!("curve.period_s must be above the last number of curve.at and at most {most:e} s, not {period}");
        return Err(item.wrong(what));
    }
    knots.push(period);
    Ok(())
}

/// A list of numbers between two ends.
fn numbers(item: &Item<'_>, [least, most]: [f64; 2], unit: &str) -> Result<Vec<f64>, Mistake> {
    let Some(list) = item.value.get_ref().as_array() else {
        return Err(item.wrong(format!("{} must be a list of numbers", item.name())));
    };
    let number = |value| {
        let one = Item { value, ..item.clone() };
        let x = one.any_number()?;
        let legal = (least..=most).contains(&x);
        let what = || format!("{} must lie between {least:e} and {most:e} {unit}, not {x}", item.name());
        if legal { Ok(x) } else { Err(one.wrong(what())) }
    };
    list.iter().map(number).collect()
}

/// Writes all entries; one that is not sound could not be read back and is omitted.
pub(super) fn write(text: &mut String, curves: &[AddedCurve]) {
    for AddedCurve { curve, heights } in curves.iter().filter(|added| added.is_sound()) {
        let (axis, carrier) = (curve.axis, curve.carrier);
        let how = carrier.words();
        // writing to a string cannot fail
        let _ = writeln!(text, "\n[[{SECTION}]]   # a force that nobody has a name for, {how}");
        let _ = writeln!(text, "axis = \"{}\"\ncarrier = \"{}\"", axis.name(), carrier.name());
        let (mut at, mut height) = (curve.knots.as_slice(), heights.as_slice());
        if let (Some(period_s), [knots @ .., _], [open @ .., _]) = (curve.period_s(), at, height) {
            let _ = writeln!(text, "period_s = {period_s:?}");
            (at, height) = (knots, open);
        }
        let _ = writeln!(text, "at = {at:?}   # {}", axis.unit());
        let _ = writeln!(text, "height = {height:?}   # {}", carrier.unit());
    }
}
