//! The entries `[[mechanism]]` of an augmented simulation file.

use std::fmt::Write;

use toml::de::{DeTable, DeValue};

use crate::document::{Item, Mistake, items};
use crate::mechanism::{Added, Form, Id, definition};

/// Reads all entries.
pub(super) fn read(item: &Item<'_>) -> Result<Vec<Added>, Mistake> {
    let wrong = || item.wrong("mechanism must be a list of tables, each under [[mechanism]]");
    let list = item.value.get_ref().as_array().ok_or_else(wrong)?;
    list.iter()
        .map(|entry| match entry.get_ref() {
            DeValue::Table(table) => one(table, &entry.span().start),
            _ => Err(wrong()),
        })
        .collect()
}

fn one(table: &DeTable<'_>, offset: &usize) -> Result<Added, Mistake> {
    let all: Vec<Item<'_>> = items("mechanism", table).collect();
    let find = |key: &str| all.iter().find(|item| item.key == key);
    let here = *offset..*offset;
    let id = find("id").ok_or_else(|| Mistake::new(&here, "mechanism.id is missing"))?;
    let Some(name) = Id::from_name(id.text()?) else {
        let known: Vec<&str> = Id::ALL.iter().map(|id| id.name()).collect();
        return Err(id.wrong(format!("there is no mechanism {}; there are: {}", id.text()?, known.join(", "))));
    };
    let forms = definition(name).forms;
    let form = match find("form") {
        None => 0,
        Some(item) => {
            let text = item.text()?;
            forms.iter().position(|form| form.name == text).ok_or_else(|| {
                let known: Vec<&str> = forms.iter().map(|form| form.name).collect();
                item.wrong(format!("{} has no form {text}; it has: {}", name.name(), known.join(", ")))
            })?
        }
    };
    let described: &Form = &forms[form];
    let names = || described.shape.iter().map(|p| p.name).chain(described.amplitudes.iter().map(|a| a.name));
    for item in &all {
        if !["id", "form"].contains(&item.key) && !names().any(|name| name == item.key) {
            let known: Vec<&str> = ["id", "form"].into_iter().chain(names()).collect();
            return Err(item.unknown(&known));
        }
    }
    let number = |key: &str| -> Result<f64, Mistake> {
        let item = find(key).ok_or_else(|| {
            Mistake::new(&id.key_span, format!("mechanism {} needs {key} (form {})", name.name(), described.name))
        })?;
        let x = item.any_number()?;
        if x.is_finite() { Ok(x) } else { Err(item.wrong(format!("{} must be a finite number", item.name()))) }
    };
    let mut shape = Vec::with_capacity(described.shape.len());
    for parameter in described.shape {
        let x = number(parameter.name)?;
        // a search may end a little beyond the places it started from
        if x == 0.0 && parameter.log {
            let what = format!("mechanism.{} must be above 0", parameter.name);
            return Err(Mistake::new(&id.key_span, what));
        }
        shape.push(x);
    }
    let amplitudes = described.amplitudes.iter().map(|a| number(a.name)).collect::<Result<_, _>>()?;
    Ok(Added { id: name, form, shape, amplitudes })
}

/// One entry as text.
pub(super) fn write(added: &Added) -> String {
    let Some(form) = added.form() else { return String::new() };
    let mut text = format!("\n[[mechanism]]\nid = \"{}\"\nform = \"{}\"\n", added.id.name(), form.name);
    let shape = form.shape.iter().map(|p| (p.name, p.unit)).zip(&added.shape);
    let amplitudes = form.amplitudes.iter().map(|a| (a.name, a.unit)).zip(&added.amplitudes);
    for ((name, unit), x) in shape.chain(amplitudes) {
        let unit = if unit.is_empty() { String::new() } else { format!("   # {unit}") };
        // writing to a String cannot fail
        let _ = writeln!(text, "{name} = {x:?}{unit}");
    }
    text
}
