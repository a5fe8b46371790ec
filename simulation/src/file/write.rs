//! Writing: from the simulation to text that reads back as the same.

use std::fmt::Write;

use super::read::{COLUMN, COULOMB_VISCOUS};
use super::{Axis, Law, PositionReference, SCHEMA, Simulation, Tolerance, curves, mechanisms};
use crate::guide::{GuideSet, is_settable};
use crate::published::{Provenance, Value};

pub(super) fn simulation(simulation: &Simulation) -> String {
    let mut text = format!("schema = \"{SCHEMA}\"\n");
    match &simulation.law {
        Law::Guide(set) => guide(&mut text, set),
        Law::CoulombViscous { coulomb_n, viscous_n_s_m, offset_n } => {
            line(&mut text, format_args!("\n[guide]\nlaw = \"{COULOMB_VISCOUS}\""));
            let constants = [("coulomb_n", coulomb_n), ("viscous_n_s_m", viscous_n_s_m), ("offset_n", offset_n)];
            for (key, value) in constants {
                match value {
                    Some(x) => line(&mut text, format_args!("{key} = {x:?}")),
                    None => line(&mut text, format_args!("# {key} is fitted")),
                }
            }
        }
        Law::Column { friction, inertia, preload, viscosity } => {
            if simulation.law != Law::COLUMN {
                line(&mut text, format_args!("\n[{COLUMN}]\nfriction = {friction:?}"));
                line(&mut text, format_args!("inertia = {inertia:?}"));
                line(&mut text, format_args!("preload = {preload:?}\nviscosity = {viscosity:?}"));
            }
        }
    }
    if let Some(x) = simulation.preload_n {
        line(&mut text, format_args!("\n[operation]\npreload_n = {x:?}"));
    }
    axis(&mut text, &simulation.axis);
    tolerance(&mut text, &simulation.tolerance);
    if !simulation.columns.is_empty() {
        text.push_str("\n[columns]\n");
        for (key, mapping) in &simulation.columns {
            // the format's own serialiser quotes any text correctly
            line(&mut text, format_args!("{} = {}", quoted(key), quoted(mapping)));
        }
    }
    mechanisms::write(&mut text, &simulation.mechanisms);
    curves::write(&mut text, &simulation.curves);
    text
}

fn guide(text: &mut String, set: &GuideSet) {
    let parameters = set.parameters();
    line(text, format_args!("\n[guide]\nparameters = \"{}\"   # {}", parameters.name, parameters.source));
    let mut section = "guide";
    for entry in set.entries() {
        if entry.section != section {
            section = entry.section;
            line(text, format_args!("\n[{section}]"));
        }
        let value = match entry.value {
            Value::Number(x) if entry.key == "balls_per_row" => format!("{x}"),
            Value::Number(x) => format!("{x:?}"),
            Value::Name(name) => format!("\"{name}\""),
        };
        if entry.provenance == Provenance::File {
            line(text, format_args!("{} = {value}", entry.key));
        } else if is_settable(entry.key) {
            line(text, format_args!("# {} = {value}   # {}", entry.key, entry.provenance));
        } else {
            line(text, format_args!("# {} is {value}: {}", entry.key, entry.provenance));
        }
    }
}

fn axis(text: &mut String, axis: &Axis) {
    text.push_str("\n[axis]\n");
    if let Some(x) = axis.moved_mass_kg {
        line(text, format_args!("moved_mass_kg = {x:?}"));
    }
    line(text, format_args!("zero_speed_m_s = {:?}", axis.zero_speed_m_s));
    let reference = match axis.position_reference {
        PositionReference::Absolute => "absolute",
        PositionReference::Relative => "relative",
    };
    line(text, format_args!("position_reference = \"{reference}\""));
}

fn tolerance(text: &mut String, tolerance: &Tolerance) {
    let Tolerance { preload, friction, viscosity, friction_terms, mass, relevance } = *tolerance;
    text.push_str("\n[tolerance]\n");
    for (key, x) in [
        ("preload", preload),
        ("friction", friction),
        ("viscosity", viscosity),
        ("friction_terms", friction_terms),
        ("mass", mass),
        ("relevance", relevance),
    ] {
        line(text, format_args!("{key} = {x:?}"));
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Appends a line; writing to a string cannot fail.
fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    let _ = writeln!(text, "{arguments}");
}
