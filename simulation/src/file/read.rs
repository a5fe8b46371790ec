//! Reading: from the text of a simulation file to the simulation.

use std::ops::Range as Span;

use model_core::quantity::{self, Range};
use toml::de::DeTable;

use super::{Axis, Law, PositionReference, SCHEMA, Simulation, Tolerance, curves, mechanisms};
use crate::document::{Item, Mistake, items, parse};
use crate::guide::GuideSet;

/// Sections of a file, in the order that messages list them.
const SECTIONS: [&str; 10] = [
    "schema",
    "guide",
    "lubricant",
    "operation",
    "axis",
    "tolerance",
    "columns",
    COLUMN,
    mechanisms::SECTION,
    curves::SECTION,
];

/// Section of a column of simulated force.
pub(super) const COLUMN: &str = "simulated_force";

/// Legal factors on what the program that made the column assumed.
const ASSUMED: Range = Range { name: "factor", min: 0.05, max: 20.0, unit: "" };

/// The only `law` beside that of a ball guide.
pub(super) const COULOMB_VISCOUS: &str = "coulomb-viscous";

/// Legal `zero_speed_m_s`.
const ZERO_SPEED: Range = Range { name: "zero_speed_m_s", min: 0.0, max: 1.0, unit: "m/s" };

/// Legal relative standard deviations.
const RELATIVE: Range = Range { name: "tolerance", min: 0.0, max: 10.0, unit: "" };

/// Legal constants of the coulomb-viscous law; wide enough for a torque or a current read as a force.
const COULOMB: Range = Range { name: "coulomb_n", min: 0.0, max: 1e6, unit: "N" };
const VISCOUS: Range = Range { name: "viscous_n_s_m", min: -1e7, max: 1e7, unit: "N s/m" };
const OFFSET: Range = Range { name: "offset_n", min: -1e6, max: 1e6, unit: "N" };

pub(super) fn simulation(text: &str) -> Result<Simulation, Mistake> {
    let file = parse(text)?;
    let file: &DeTable<'_> = file.get_ref();
    match items("", file).find(|item| item.key == "schema") {
        Some(item) if item.value.get_ref().as_str() == Some(SCHEMA) => {}
        Some(item) => return Err(item.wrong(format!("expected schema = \"{SCHEMA}\""))),
        None => return Err(Mistake::at_start(format!("expected schema = \"{SCHEMA}\" as first key"))),
    }
    let mut simulation = Simulation::of(Law::COLUMN);
    for item in items("", file) {
        match item.key {
            // these sections define the law together and are read at once
            "schema" | "guide" | "lubricant" | COLUMN => {}
            "operation" => simulation.preload_n = operation(item.table()?)?,
            "axis" => simulation.axis = axis(item.table()?)?,
            "tolerance" => simulation.tolerance = tolerance(item.table()?)?,
            "columns" => simulation.columns = columns(item.table()?)?,
            mechanisms::SECTION => simulation.mechanisms = mechanisms::read(&item)?,
            curves::SECTION => simulation.curves = curves::read(&item)?,
            _ => {
                let what = format!("there is no section {}; there are: {}", item.key, SECTIONS.join(", "));
                return Err(Mistake::new(&item.key_span, what));
            }
        }
    }
    simulation.law = law(file)?;
    Ok(simulation)
}

/// The law that the sections `[guide]`, `[lubricant]` and `[operation]` describe together.
fn law(file: &DeTable<'_>) -> Result<Law, Mistake> {
    let (guide, place) = section(file, "guide")?;
    let (lubricant, oil) = section(file, "lubricant")?;
    let (column, of_column) = section(file, COLUMN)?;
    let has_operation = file.iter().any(|(key, _)| key.get_ref() == "operation");
    if place.is_none() && oil.is_none() && !has_operation {
        return simulated_force(&column);
    }
    if let Some(span) = of_column {
        return Err(Mistake::new(
            &span,
            format!("[{COLUMN}] means nothing beside a law of its own; leave out one of them"),
        ));
    }
    if let Some(item) = guide.iter().find(|item| item.key == "law") {
        if item.value.get_ref().as_str() != Some(COULOMB_VISCOUS) {
            let what = format!("guide.law must be \"{COULOMB_VISCOUS}\"; leave it out for a ball guide");
            return Err(item.wrong(what));
        }
        return match oil {
            Some(span) => Err(Mistake::new(&span, format!("[lubricant] means nothing to law = \"{COULOMB_VISCOUS}\""))),
            None => coulomb_viscous(&guide),
        };
    }
    let place = place.or(oil).unwrap_or_default();
    GuideSet::read(&guide, &lubricant, &place).map(Law::Guide)
}

/// The items of a section and its position; empty where there is no such section.
fn section<'a>(file: &'a DeTable<'a>, name: &'a str) -> Result<(Vec<Item<'a>>, Option<Span<usize>>), Mistake> {
    match items("", file).find(|item| item.key == name) {
        Some(item) => Ok((items(name, item.table()?).collect(), Some(item.key_span))),
        None => Ok((Vec::new(), None)),
    }
}

fn simulated_force(column: &[Item<'_>]) -> Result<Law, Mistake> {
    let (mut friction, mut inertia, mut preload, mut viscosity) = (1.0, 1.0, 1.0, 1.0);
    for item in column {
        match item.key {
            "friction" => friction = item.number(&ASSUMED)?,
            "inertia" => inertia = item.number(&ASSUMED)?,
            "preload" => preload = item.number(&ASSUMED)?,
            "viscosity" => viscosity = item.number(&ASSUMED)?,
            _ => return Err(item.unknown(&["friction", "inertia", "preload", "viscosity"])),
        }
    }
    Ok(Law::Column { friction, inertia, preload, viscosity })
}

fn coulomb_viscous(guide: &[Item<'_>]) -> Result<Law, Mistake> {
    let (mut coulomb_n, mut viscous_n_s_m, mut offset_n) = (None, None, None);
    for item in guide {
        match item.key {
            "law" => {}
            "coulomb_n" => coulomb_n = Some(item.number(&COULOMB)?),
            "viscous_n_s_m" => viscous_n_s_m = Some(item.number(&VISCOUS)?),
            "offset_n" => offset_n = Some(item.number(&OFFSET)?),
            _ => return Err(item.unknown(&["law", "coulomb_n", "viscous_n_s_m", "offset_n"])),
        }
    }
    Ok(Law::CoulombViscous { coulomb_n, viscous_n_s_m, offset_n })
}

fn operation(table: &DeTable<'_>) -> Result<Option<f64>, Mistake> {
    let mut preload_n = None;
    for item in items("operation", table) {
        match item.key {
            "preload_n" => preload_n = Some(item.number(&legal("preload_n"))?),
            _ => return Err(item.unknown(&["preload_n"])),
        }
    }
    Ok(preload_n)
}

fn axis(table: &DeTable<'_>) -> Result<Axis, Mistake> {
    let mut axis = Axis::default();
    for item in items("axis", table) {
        match item.key {
            "moved_mass_kg" => axis.moved_mass_kg = Some(item.number(&legal("moved_mass_kg"))?),
            "zero_speed_m_s" => axis.zero_speed_m_s = item.number(&ZERO_SPEED)?,
            "position_reference" => {
                axis.position_reference = match item.one_of(&["absolute", "relative"])? {
                    "relative" => PositionReference::Relative,
                    _ => PositionReference::Absolute,
                }
            }
            _ => return Err(item.unknown(&["moved_mass_kg", "zero_speed_m_s", "position_reference"])),
        }
    }
    Ok(axis)
}

fn tolerance(table: &DeTable<'_>) -> Result<Tolerance, Mistake> {
    let mut tolerance = Tolerance::default();
    for item in items("tolerance", table) {
        let place = match item.key {
            "preload" => &mut tolerance.preload,
            "friction" => &mut tolerance.friction,
            "viscosity" => &mut tolerance.viscosity,
            "friction_terms" => &mut tolerance.friction_terms,
            "mass" => &mut tolerance.mass,
            "relevance" => &mut tolerance.relevance,
            _ => {
                let known = ["preload", "friction", "viscosity", "friction_terms", "mass", "relevance"];
                return Err(item.unknown(&known));
            }
        };
        *place = item.number(&RELATIVE)?;
    }
    Ok(tolerance)
}

/// Kept as text: the recording's reader interprets mappings.
fn columns(table: &DeTable<'_>) -> Result<Vec<(String, String)>, Mistake> {
    let mut columns = Vec::new();
    for item in items("columns", table) {
        let text = item.text()?;
        if text.is_empty() {
            return Err(item.wrong(format!("{} must be \"column:scale\" or \"column:scale:offset\"", item.name())));
        }
        columns.push((item.key.to_owned(), text.to_owned()));
    }
    Ok(columns)
}

/// The legal range of a quantity; empty for an unknown name (all names used here are known).
fn legal(name: &'static str) -> Range {
    quantity::range(name).copied().unwrap_or(Range { name, min: f64::NAN, max: f64::NAN, unit: "" })
}
