//! A guide and its oil: a published set, and the file that overrides values of it.
//!
//! A guide file is a simulation file; only its sections `[guide]` and `[lubricant]` are used here:
//!
//! ```toml
//! schema = "guideblock.simulation/1"
//!
//! [guide]
//! parameters = "zhou-2023"          # the published set that the keys below differ from
//! contact_angle_mode = "fixed"      # a production block
//!
//! [lubricant]
//! viscosity_cst = 68.0              # or viscosity_40_cst and viscosity_100_cst
//! ```
//!
//! Every value remembers where it comes from, and what the paper does not state is called assumed wherever it is
//! shown. The set `zhou-2023` has `contact_angle_mode = "exact"`: the paper's rig is a split block whose contact
//! angle rises with the load. In a production block, preloaded by oversize balls, it is `"fixed"`.

use std::fmt;
use std::ops::Range as Span;

use model_core::contact::{ContactAngle, Guide, HerseySpeed};
use model_core::exact::Exact;
use model_core::friction::Friction;
use model_core::quantity::{self, Range};
use model_core::reference::zhou_2023;
use model_core::viscosity::Walther;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The value of `schema`.
pub const SCHEMA: &str = "guideblock.simulation/1";

/// The published sets that `parameters` may name.
pub const PUBLISHED: [&str; 1] = ["zhou-2023"];

/// Legal `hersey_scale`; wide enough for any unit of viscosity.
pub const SCALE: Range = Range { name: "hersey_scale", min: 1e-6, max: 1e6, unit: "" };

/// Sections of a simulation file that say nothing about the guide or its oil.
const OTHER_SECTIONS: [&str; 4] = ["operation", "axis", "tolerance", "columns"];

/// Density that turns cSt into the carriage convention's viscosity number, kg/m³.
const OIL_DENSITY_KG_M3: f64 = 880.0;

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// The paper states it; where.
    Stated(&'static str),
    /// Nobody states it; why this value was taken.
    Assumed(&'static str),
    /// The guide file sets it.
    File,
}

impl fmt::Display for Provenance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Provenance::Stated(place) => write!(f, "stated by the paper, {place}"),
            Provenance::Assumed(why) => write!(f, "ASSUMED: {why}"),
            Provenance::File => f.write_str("set by the guide file"),
        }
    }
}

/// A value of a guide file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number in the unit that the key ends with.
    Number(f64),
    /// One of a few names.
    Name(&'static str),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(x) if *x != 0.0 && !(1e-4..1e6).contains(&x.abs()) => write!(f, "{x:e}"),
            Value::Number(x) => write!(f, "{x}"),
            Value::Name(name) => f.write_str(name),
        }
    }
}

/// One value and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Section of the file.
    pub section: &'static str,
    /// Key, with the unit.
    pub key: &'static str,
    /// Value.
    pub value: Value,
    /// Where it comes from.
    pub provenance: Provenance,
}

/// Viscosity of the oil, cSt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lubricant {
    /// The same at every temperature.
    Constant(f64),
    /// Falls with temperature.
    Walther(Walther),
}

/// A guide, its friction law and its oil.
#[derive(Clone, Debug)]
pub struct GuideSet {
    exact: Exact,
    hersey_scale: f64,
    lubricant: Lubricant,
    entries: Vec<Entry>,
}

/// Why a guide file is refused, and where.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {what}")]
pub struct BadGuide {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong, and what would be right.
    pub what: String,
}

impl GuideSet {
    /// The paper's guide and oil, nothing overridden.
    pub fn zhou_2023() -> Self {
        // no text, no place for a mistake: the published values are legal (held by a test)
        let (guide, friction) = (zhou_2023::GUIDE, zhou_2023::FRICTION);
        GuideSet {
            exact: Exact::new(guide, friction),
            hersey_scale: 1.0,
            lubricant: Lubricant::Walther(zhou_2023::OIL),
            entries: published(),
        }
    }

    /// Reads a guide file.
    ///
    /// # Errors
    /// [`BadGuide`]: no TOML, another schema, a key that does not exist, a value of the wrong kind or out of range,
    /// a friction law whose drag does not tell the preload.
    pub fn from_toml(text: &str) -> Result<Self, BadGuide> {
        let bad = |span: Span<usize>, what: String| bad_at(text, span.start, what);
        let file = DeTable::parse(text)
            .map_err(|error| bad(error.span().unwrap_or_default(), error.message().trim_end().to_owned()))?;
        let file = file.get_ref();
        if !file.iter().any(|(key, value)| key.get_ref() == "schema" && value.get_ref().as_str() == Some(SCHEMA)) {
            return Err(bad(0..0, format!("expected schema = \"{SCHEMA}\" as first key")));
        }
        let mut set = GuideSet::zhou_2023();
        let mut lubricant_keys = Vec::new();
        for (key, value) in file {
            let name: &str = key.get_ref();
            match name {
                "schema" => {}
                "guide" | "lubricant" => {
                    let Some(section) = value.get_ref().as_table() else {
                        return Err(bad(value.span(), format!("{name} must be a table")));
                    };
                    for (key, value) in section {
                        let inner: &str = key.get_ref();
                        set.override_with(name, inner, key.span(), value).map_err(|(span, what)| bad(span, what))?;
                        if name == "lubricant" {
                            lubricant_keys.push((inner.to_owned(), key.span()));
                        }
                    }
                }
                _ if OTHER_SECTIONS.contains(&name) => {}
                _ => {
                    let known = format!("schema, guide, lubricant, {}", OTHER_SECTIONS.join(", "));
                    return Err(bad(key.span(), format!("there is no section {name}; there are: {known}")));
                }
            }
        }
        set.choose_lubricant(&lubricant_keys).map_err(|(span, what)| bad(span, what))?;
        set.rebuild().map_err(|what| {
            let guide = file.iter().find(|(key, _)| key.get_ref() == "guide");
            bad(guide.map_or(0..0, |(key, _)| key.span()), what)
        })?;
        Ok(set)
    }

    /// The model.
    pub const fn exact(&self) -> &Exact {
        &self.exact
    }

    /// What the model calls viscosity, over ν in cSt.
    pub const fn hersey_scale(&self) -> f64 {
        self.hersey_scale
    }

    /// The oil.
    pub const fn lubricant(&self) -> Lubricant {
        self.lubricant
    }

    /// Every value with its provenance, in the order of the file format.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn override_with(
        &mut self,
        section: &str,
        key: &str,
        key_span: Span<usize>,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<(), (Span<usize>, String)> {
        let refuse = |what: String| Err((value.span(), what));
        if (section, key) == ("guide", "parameters") {
            return match value.get_ref().as_str() {
                Some(name) if PUBLISHED.contains(&name) => Ok(()),
                _ => refuse(format!("guide.parameters must be one of: \"{}\"", PUBLISHED.join("\", \""))),
            };
        }
        if (section, key) == ("guide", "law") {
            return refuse("guide.law describes an axis without a ball guide; it has no preload".to_owned());
        }
        let place = if (section, key) == ("lubricant", "viscosity_cst") {
            // not part of the published set: takes the place of its two viscosities
            self.entries.push(Entry {
                section: "lubricant",
                key: "viscosity_cst",
                value: Value::Number(f64::NAN),
                provenance: Provenance::File,
            });
            self.entries.last_mut()
        } else {
            self.entries.iter_mut().find(|e| e.section == section && e.key == key && is_settable(e.key))
        };
        let Some(place) = place else {
            return Err((key_span, format!("there is no key {section}.{key}; there are: {}", known(section))));
        };
        place.value = match place.value {
            Value::Name(_) => {
                let names = choices(place.key);
                match value.get_ref().as_str().and_then(|got| names.iter().find(|name| **name == got)) {
                    Some(name) => Value::Name(name),
                    None => {
                        return refuse(format!("{section}.{key} must be one of: \"{}\"", names.join("\", \"")));
                    }
                }
            }
            Value::Number(_) => {
                let Some(number) = number(value.get_ref()) else {
                    return refuse(format!("{section}.{key} must be a number"));
                };
                check(place.key, number).or_else(|why| refuse(format!("{section}.{why}")))?;
                Value::Number(number)
            }
        };
        place.provenance = Provenance::File;
        Ok(())
    }

    /// Keeps the one description of the oil that holds.
    fn choose_lubricant(&mut self, keys: &[(String, Span<usize>)]) -> Result<(), (Span<usize>, String)> {
        let place = |name: &str| keys.iter().find(|(key, _)| key == name).map(|(_, span)| span.clone());
        match (place("viscosity_cst"), place("viscosity_40_cst"), place("viscosity_100_cst")) {
            (Some(_), Some(span), _) | (Some(_), None, Some(span)) => Err((
                span,
                "give either lubricant.viscosity_cst or viscosity_40_cst with viscosity_100_cst, not both".to_owned(),
            )),
            (None, Some(span), None) | (None, None, Some(span)) => {
                Err((span, "lubricant.viscosity_40_cst and viscosity_100_cst belong together; give both".to_owned()))
            }
            (Some(_), None, None) => {
                self.entries.retain(|e| !matches!(e.key, "viscosity_40_cst" | "viscosity_100_cst"));
                self.lubricant = Lubricant::Constant(self.number("viscosity_cst"));
                Ok(())
            }
            (None, Some(_), Some(span)) => {
                let walther =
                    Walther::from_40_and_100(self.number("viscosity_40_cst"), self.number("viscosity_100_cst"));
                self.lubricant =
                    Lubricant::Walther(walther.map_err(|_| {
                        (span, "lubricant.viscosity_100_cst must lie below viscosity_40_cst".to_owned())
                    })?);
                Ok(())
            }
            (None, None, None) => Ok(()),
        }
    }

    /// Derives the model from the entries.
    fn rebuild(&mut self) -> Result<(), String> {
        let guide = Guide {
            ball_diameter_m: self.number("ball_diameter_m"),
            // checked to be a whole number from 1 to 200
            balls_per_row: self.number("balls_per_row") as u32,
            contact_angle_rad: self.number("contact_angle_deg").to_radians(),
            conformity_rail: self.number("conformity"),
            conformity_slider: self.number("conformity"),
            young_modulus_pa: self.number("young_modulus_pa"),
            poisson_ratio: self.number("poisson_ratio"),
            initial_interference_m: self.number("initial_interference_m"),
            hersey_speed: match self.name("hersey") {
                "carriage" => HerseySpeed::Carriage,
                _ => HerseySpeed::Slip,
            },
            contact_angle: match self.name("contact_angle_mode") {
                "fixed" => ContactAngle::Fixed,
                _ => ContactAngle::Exact,
            },
        };
        guide.check().map_err(|why| why.to_string())?;
        let friction = Friction {
            mu_coulomb: self.number("mu_coulomb"),
            mu_viscous: self.number("mu_viscous"),
            mu_stribeck: self.number("mu_stribeck"),
            stribeck_exponent: self.number("stribeck_exponent"),
        };
        tells_the_preload(&guide, &friction)?;
        // the carriage convention counts 60 η, η in Pa·s
        if guide.hersey_speed == HerseySpeed::Carriage
            && let Some(scale) = self.entries.iter_mut().find(|e| e.key == "hersey_scale")
            && scale.provenance != Provenance::File
        {
            scale.value = Value::Number(60e-6 * OIL_DENSITY_KG_M3);
            scale.provenance = Provenance::Assumed("60 times η in Pa·s, for an oil of 880 kg/m³");
        }
        self.hersey_scale = self.number("hersey_scale");
        self.exact = Exact::new(guide, friction);
        Ok(())
    }

    /// A number that is among the entries by construction; NaN, which every check refuses, if it were not.
    fn number(&self, key: &str) -> f64 {
        self.entries.iter().find(|e| e.key == key).map_or(f64::NAN, |e| match e.value {
            Value::Number(x) => x,
            Value::Name(_) => f64::NAN,
        })
    }

    fn name(&self, key: &str) -> &'static str {
        self.entries.iter().find(|e| e.key == key).map_or("", |e| match e.value {
            Value::Name(name) => name,
            Value::Number(_) => "",
        })
    }
}

/// The published set, value by value.
fn published() -> Vec<Entry> {
    use Provenance::{Assumed, Stated};
    let (g, f) = (zhou_2023::GUIDE, zhou_2023::FRICTION);
    let steel = "bearing steel";
    let number = |key, x, provenance| Entry { section: "guide", key, value: Value::Number(x), provenance };
    let name = |key, x, provenance| Entry { section: "guide", key, value: Value::Name(x), provenance };
    let oil = |key, x, provenance| Entry { section: "lubricant", key, value: Value::Number(x), provenance };
    vec![
        number("ball_diameter_m", g.ball_diameter_m, Stated("table 1")),
        number("balls_per_row", f64::from(g.balls_per_row), Stated("table 1")),
        number("contact_angle_deg", g.contact_angle_rad.to_degrees(), Stated("table 1")),
        number(
            "conformity",
            g.conformity_rail,
            Assumed("only values up to 0.514 let the measured grid visit both lubrication regimes"),
        ),
        number("young_modulus_pa", g.young_modulus_pa, Assumed(steel)),
        number("poisson_ratio", g.poisson_ratio, Assumed(steel)),
        number("initial_interference_m", g.initial_interference_m, Assumed("the test block is split")),
        number("mu_coulomb", f.mu_coulomb, Stated("eq. 20")),
        number("mu_viscous", f.mu_viscous, Stated("eq. 20")),
        number("mu_stribeck", f.mu_stribeck, Stated("eq. 20")),
        number("stribeck_exponent", f.stribeck_exponent, Stated("eq. 20")),
        name("hersey", "slip", Assumed("the sliding speed of eq. 12; the text also allows the carriage speed")),
        name("contact_angle_mode", "exact", Stated("eq. 3 and 4: its split block; a production block is \"fixed\"")),
        number("hersey_scale", 1.0, Assumed("the viscosity in H counts in cSt")),
        oil("viscosity_40_cst", 100.0, Assumed("the paper says 100; taken as the viscosity grade, at 40 °C")),
        oil("viscosity_100_cst", 11.0, Assumed("usual for an oil of viscosity grade 100")),
    ]
}

/// The file format has no key for the interference: it belongs to the split block alone.
fn is_settable(key: &str) -> bool {
    key != "initial_interference_m"
}

fn known(section: &str) -> String {
    let mut keys = match section {
        "guide" => vec!["parameters"],
        _ => vec!["viscosity_cst"],
    };
    keys.extend(published().iter().filter(|e| e.section == section && is_settable(e.key)).map(|e| e.key));
    keys.join(", ")
}

fn choices(key: &str) -> &'static [&'static str] {
    match key {
        "hersey" => &["slip", "carriage"],
        _ => &["fixed", "exact"],
    }
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        // beyond 2^53 nothing is in range anyway
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        DeValue::Float(x) => x.as_str().parse().ok(),
        _ => None,
    }
}

/// Checks a value in the file's unit; the message names the key and the range in that unit.
fn check(key: &'static str, x: f64) -> Result<(), String> {
    let range = match key {
        "contact_angle_deg" => quantity::range("contact_angle_rad").map(|r| Range {
            name: key,
            // rounded inwards, so that every value the message allows is accepted
            min: (r.min.to_degrees() * 100.0).ceil() / 100.0,
            max: (r.max.to_degrees() * 100.0).floor() / 100.0,
            unit: "deg",
        }),
        "hersey_scale" => Some(SCALE),
        "viscosity_40_cst" | "viscosity_100_cst" => quantity::range("viscosity_cst").map(|r| Range { name: key, ..*r }),
        _ => quantity::range(key).copied(),
    };
    let Some(r) = range else { return Err(format!("{key} has no legal range")) };
    if !(x >= r.min && x <= r.max) {
        return Err(format!("{key} must lie between {} and {} {}, not {x}", r.min, r.max, r.unit).replace(" ,", ","));
    }
    if key == "balls_per_row" && x.fract() != 0.0 {
        return Err(format!("{key} must be a whole number, not {x}"));
    }
    Ok(())
}

/// Refuses friction constants under which one drag force belongs to several preloads.
///
/// `dlnF_f/dlnQ = 1 + (dlnH/dlnQ)(dlnμ/dlnH)` must stay positive. With slip dlnH/dlnQ is 1/3 and a little more at
/// high loads, so that a fall of μ steeper than `H^-2` is refused; with the carriage speed it is -1/3 and dlnμ/dlnH
/// never exceeds 1.
fn tells_the_preload(guide: &Guide, friction: &Friction) -> Result<(), String> {
    let steepest = (0..400)
        .map(|n| 1e-2 * libm::pow(1e4, f64::from(n) / 399.0) / friction.stribeck_exponent)
        .map(|h| h * friction.slope(h) / friction.coefficient(h))
        .fold(0.0, f64::min);
    if guide.hersey_speed == HerseySpeed::Slip && steepest < -2.0 {
        return Err(format!(
            "with these friction constants several preloads make the same drag force: friction falls with the {steepest:.1}th \
             power of the Hersey number; raise guide.mu_coulomb or lower guide.mu_stribeck"
        ));
    }
    Ok(())
}

fn bad_at(text: &str, offset: usize, what: String) -> BadGuide {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    BadGuide { line, column, what }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<GuideSet, String> {
        GuideSet::from_toml(&format!("schema = \"guideblock.simulation/1\"\n{text}")).map_err(|why| why.to_string())
    }

    #[test]
    fn an_empty_file_is_the_published_set() {
        let set = read("[operation]\npreload_n = 3000\n[axis]\n[tolerance]\n[columns]\n").expect("legal");
        assert_eq!(*set.exact().friction(), zhou_2023::FRICTION);
        let guide = set.exact().guide();
        assert!((guide.contact_angle_rad - zhou_2023::GUIDE.contact_angle_rad).abs() < 1e-15);
        assert_eq!(Guide { contact_angle_rad: zhou_2023::GUIDE.contact_angle_rad, ..*guide }, zhou_2023::GUIDE);
        assert_eq!(set.entries(), GuideSet::zhou_2023().entries());
        for e in set.entries() {
            if is_settable(e.key)
                && let Value::Number(x) = e.value
            {
                assert_eq!(check(e.key, x), Ok(()));
            }
        }
    }

    #[test]
    fn overrides_reach_the_model_and_say_so() {
        let set = read(
            "[guide]\nparameters = \"zhou-2023\"\nballs_per_row = 10\nhersey = \"carriage\"\nmu_stribeck = 0\n\
             contact_angle_mode = \"fixed\"\nconformity = 0.52\n[lubricant]\nviscosity_cst = 68\n",
        )
        .expect("legal");
        let guide = set.exact().guide();
        assert_eq!((guide.balls_per_row, guide.hersey_speed), (10, HerseySpeed::Carriage));
        assert_eq!(
            (guide.contact_angle, guide.conformity_rail, guide.conformity_slider),
            (ContactAngle::Fixed, 0.52, 0.52)
        );
        assert_eq!(set.exact().friction().mu_stribeck, 0.0);
        assert_eq!(set.lubricant(), Lubricant::Constant(68.0));
        assert!((set.hersey_scale() / 0.0528 - 1.0).abs() < 1e-12);
        let of = |key| set.entries().iter().find(|e| e.key == key).map(|e| e.provenance);
        assert_eq!(of("balls_per_row"), Some(Provenance::File));
        assert_eq!(of("ball_diameter_m"), Some(Provenance::Stated("table 1")));
        assert!(matches!(of("young_modulus_pa"), Some(Provenance::Assumed(_))));
        assert_eq!(of("viscosity_40_cst"), None);
    }

    #[test]
    fn mistakes_have_line_column_and_what_would_be_right() {
        for (text, message) in [
            (
                "[lubricant]\nviscosity = 3",
                "line 3, column 1: there is no key lubricant.viscosity; there are: viscosity_cst, viscosity_40_cst, viscosity_100_cst",
            ),
            (
                "[oil]",
                "line 2, column 2: there is no section oil; there are: schema, guide, lubricant, operation, axis, tolerance, columns",
            ),
            ("guide = 3", "line 2, column 9: guide must be a table"),
            ("[guide]\nhersey = \"both\"", "line 3, column 10: guide.hersey must be one of: \"slip\", \"carriage\""),
            ("[guide]\nparameters = \"x\"", "line 3, column 14: guide.parameters must be one of: \"zhou-2023\""),
            ("[guide]\nconformity = \"x\"", "line 3, column 14: guide.conformity must be a number"),
            (
                "[guide]\nconformity = 0.5",
                "line 3, column 14: guide.conformity must lie between 0.501 and 0.6 (groove radius over ball diameter), not 0.5",
            ),
            (
                "[guide]\npoisson_ratio = nan",
                "line 3, column 17: guide.poisson_ratio must lie between 0 and 0.49, not NaN",
            ),
            ("[guide]\nballs_per_row = 9.5", "line 3, column 17: guide.balls_per_row must be a whole number, not 9.5"),
            (
                "[guide]\ncontact_angle_deg = 0.785",
                "line 3, column 21: guide.contact_angle_deg must lie between 5.73 and 80.21 deg, not 0.785",
            ),
            (
                "[lubricant]\nviscosity_40_cst = 9",
                "line 3, column 1: lubricant.viscosity_40_cst and viscosity_100_cst belong together; give both",
            ),
            (
                "[lubricant]\nviscosity_40_cst = 9\nviscosity_100_cst = 10",
                "line 4, column 1: lubricant.viscosity_100_cst must lie below viscosity_40_cst",
            ),
            (
                "[lubricant]\nviscosity_40_cst = 9\nviscosity_100_cst = 3\nviscosity_cst = 3",
                "line 3, column 1: give either lubricant.viscosity_cst or viscosity_40_cst with viscosity_100_cst, not both",
            ),
        ] {
            assert_eq!(read(text).expect_err(text), message);
        }
        assert!(read("[guide]\nlaw = \"coulomb-viscous\"").expect_err("no guide").contains("no preload"));
        assert!(
            read("[guide]\nmu_stribeck = 0.4\nmu_coulomb = 1e-5").expect_err("ambiguous").contains("several preloads")
        );
        assert!(read("[guide").expect_err("syntax").starts_with("line 2, column 7: "), "{:?}", read("[guide"));
        assert_eq!(
            GuideSet::from_toml("[guide]").expect_err("no schema").to_string(),
            "line 1, column 1: expected schema = \"guideblock.simulation/1\" as first key"
        );
    }
}
