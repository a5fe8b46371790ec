//! The entries `[[mechanism]]` of a simulation file.
//!
//! ```toml
//! [[mechanism]]
//! id = "seal-drag"
//! form = "minimal"        # may be left out: the first one
//! drag_n = 4.2
//! ```

use std::fmt::Write;

use toml::Spanned;
use toml::de::DeValue;

use crate::document::{Item, Mistake, items};
use crate::mechanism::{Added, Definition, Form, Id, definition};

/// Section name.
pub(super) const SECTION: &str = "mechanism";

/// Reads all entries.
pub(super) fn read(item: &Item<'_>) -> Result<Vec<Added>, Mistake> {
    let Some(entries) = item.value.get_ref().as_array() else {
        return Err(item.wrong("mechanisms stand in entries that start with [[mechanism]], in two brackets"));
    };
    entries.iter().map(entry).collect()
}

fn entry(value: &Spanned<DeValue<'_>>) -> Result<Added, Mistake> {
    let Some(table) = value.get_ref().as_table() else {
        return Err(Mistake::new(&value.span(), "a mechanism must be a table with id, form and its numbers"));
    };
    let keys: Vec<Item<'_>> = items(SECTION, table).collect();
    let of = |key: &str| keys.iter().find(|item| item.key == key);
    let Some(id) = of("id") else {
        return Err(Mistake::new(&value.span(), "a mechanism needs an id, such as id = \"seal-drag\""));
    };
    let definition = named(id)?;
    let (index, form) = match of("form") {
        Some(item) => form(definition, item)?,
        None => definition.forms.first().map(|form| (0, form)).ok_or_else(|| id.wrong("it has no form"))?,
    };
    let names: Vec<&str> = numbers(form).map(|(name, ..)| name).collect();
    if let Some(other) = keys.iter().find(|item| !["id", "form"].contains(&item.key) && !names.contains(&item.key)) {
        let of =
            format!("{} of form \"{}\" has no {}; it has: {}", definition.id, form.name, other.key, names.join(", "));
        return Err(Mistake::new(&other.key_span, of));
    }
    let mut values = numbers(form).map(|(name, unit, kind)| {
        let Some(item) = of(name) else {
            let unit = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
            return Err(Mistake::new(
                &id.key_span,
                format!("{} of form \"{}\" needs {name}{unit}", definition.id, form.name),
            ));
        };
        let x = item.any_number()?;
        let legal = match kind {
            Number::Above0 => x > 0.0 && x <= LARGEST,
            Number::Any => x.abs() <= LARGEST,
            Number::NotNegative => (0.0..=LARGEST).contains(&x),
            Number::NotPositive => (-LARGEST..=0.0).contains(&x),
        };
        if legal { Ok(x) } else { Err(item.wrong(format!("{} must be {}, not {x}", item.name(), kind.text()))) }
    });
    let shape = values.by_ref().take(form.shape.len()).collect::<Result<Vec<f64>, Mistake>>()?;
    let amplitudes = values.collect::<Result<Vec<f64>, Mistake>>()?;
    Ok(Added { id: definition.id, form: index, shape, amplitudes })
}

fn named(item: &Item<'_>) -> Result<&'static Definition, Mistake> {
    let name = item.text()?;
    Id::from_name(name).map(definition).ok_or_else(|| {
        let names: Vec<&str> = Id::ALL.iter().map(|id| id.name()).collect();
        item.wrong(format!("there is no mechanism \"{name}\"; there are: {}", names.join(", ")))
    })
}

fn form(definition: &'static Definition, item: &Item<'_>) -> Result<(usize, &'static Form), Mistake> {
    let name = item.text()?;
    definition.forms.iter().enumerate().find(|(_, form)| form.name == name).ok_or_else(|| {
        let names: Vec<&str> = definition.forms.iter().map(|form| form.name).collect();
        item.wrong(format!("{} has no form \"{name}\"; it has: \"{}\"", definition.id, names.join("\", \"")))
    })
}

/// Largest number of a form, in its unit: with larger ones forces would overflow.
const LARGEST: f64 = 1e12;

/// Legal values of a number of a form.
#[derive(Clone, Copy)]
enum Number {
    Above0,
    Any,
    NotNegative,
    NotPositive,
}

impl Number {
    fn text(self) -> &'static str {
        match self {
            Number::Above0 => "above 0 and at most 1e12",
            Number::Any => "a number from -1e12 to 1e12",
            Number::NotNegative => "0 or above, and at most 1e12",
            Number::NotPositive => "0 or below, and at least -1e12",
        }
    }
}

/// Name, unit and legal values of every number of a form, shape first.
fn numbers(form: &'static Form) -> impl Iterator<Item = (&'static str, &'static str, Number)> {
    use crate::mechanism::Sign;
    let shape = form.shape.iter().map(|p| (p.name, p.unit, if p.log { Number::Above0 } else { Number::Any }));
    let amplitudes = form.amplitudes.iter().map(|a| {
        let legal = match a.sign {
            Sign::Positive => Number::NotNegative,
            Sign::Negative => Number::NotPositive,
            Sign::Free => Number::Any,
        };
        (a.name, a.unit, legal)
    });
    shape.chain(amplitudes)
}

/// Writes all entries; one whose form does not exist or has other numbers could not be read back and is omitted.
pub(super) fn write(text: &mut String, mechanisms: &[Added]) {
    for added in mechanisms {
        let Some(form) = added.form() else { continue };
        let values = added.shape.iter().chain(&added.amplitudes);
        if (added.shape.len(), added.amplitudes.len()) != (form.shape.len(), form.amplitudes.len()) {
            continue;
        }
        // writing to a string cannot fail
        let _ =
            writeln!(text, "\n[[{SECTION}]]\nid = \"{}\"\nform = \"{}\"   # {}", added.id, form.name, form.equation);
        for ((name, unit, _), x) in numbers(form).zip(values) {
            let unit = if unit.is_empty() { String::new() } else { format!("   # {unit}") };
            let _ = writeln!(text, "{name} = {x:?}{unit}");
        }
    }
}
