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
    let mut all: Vec<Added> = Vec::new();
    for value in entries {
        let added = entry(value)?;
        // the same cause at another place or of another size is one more
        if all.contains(&added) {
            let what = format!("{} stands there twice with the same numbers; leave one entry of it", added.id);
            return Err(Mistake::new(&value.span(), what));
        }
        all.push(added);
    }
    Ok(all)
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
    let mut values = numbers(form).map(|(name, unit, legal)| {
        let Some(item) = of(name) else {
            let unit = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
            return Err(Mistake::new(
                &id.key_span,
                format!("{} of form \"{}\" needs {name}{unit}", definition.id, form.name),
            ));
        };
        let x = item.any_number()?;
        if legal.allows(x) {
            Ok(x)
        } else {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            Err(item.wrong(format!("{} must be {}{unit}, not {x}", item.name(), legal.text())))
        }
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

/// What a number of a form may be.
#[derive(Clone, Copy)]
struct Legal {
    above_0: bool,
    from: f64,
    to: f64,
}

impl Legal {
    const fn between(from: f64, to: f64) -> Self {
        Legal { above_0: false, from, to }
    }

    fn allows(self, x: f64) -> bool {
        x >= self.from && x <= self.to && !(self.above_0 && x == 0.0)
    }

    fn text(self) -> String {
        match self {
            Legal { above_0: true, to, .. } => format!("above 0 and at most {to:e}"),
            Legal { from: 0.0, to, .. } => format!("0 or above, and at most {to:e}"),
            Legal { from, to: 0.0, .. } => format!("0 or below, and at least {from:e}"),
            Legal { from, to, .. } => format!("a number from {from:e} to {to:e}"),
        }
    }
}

/// Name, unit and what is legal of every number of a form, shape first.
fn numbers(form: &'static Form) -> impl Iterator<Item = (&'static str, &'static str, Legal)> {
    use crate::mechanism::Sign;
    let shape = form.shape.iter().map(|p| {
        let legal =
            if p.log { Legal { above_0: true, from: 0.0, to: LARGEST } } else { Legal::between(-LARGEST, LARGEST) };
        (p.name, p.unit, legal)
    });
    let amplitudes = form.amplitudes.iter().map(|a| {
        let legal = match a.sign {
            Sign::Positive => Legal::between(0.0, LARGEST),
            Sign::Negative => Legal::between(-LARGEST, 0.0),
            Sign::Free => Legal::between(-LARGEST, LARGEST),
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
