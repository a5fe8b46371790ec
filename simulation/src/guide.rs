//! A guide and its oil: a published set, and what a file overrides in it.
//!
//! ```toml
//! [guide]
//! parameters = "zhou-2023"          # the published set that the keys below differ from
//! contact_angle_mode = "fixed"      # a production block
//!
//! [lubricant]
//! viscosity_cst = 68.0              # or viscosity_40_cst and viscosity_100_cst
//! ```
//!
//! Every value carries its provenance, and what no paper states is called assumed wherever it is shown.

use std::ops::Range as Span;

use model_core::contact::{ContactAngle, Guide, HerseySpeed};
use model_core::exact::Exact;
use model_core::friction::Friction;
use model_core::quantity::{self, Range};
use model_core::viscosity::Walther;

use crate::document::{BadFile, Item, Mistake, within};
use crate::file::{Law, Simulation};
use crate::published::{Entry, Provenance, Published, SETS, Value, named};

/// Legal `hersey_scale`; wide enough for any unit of viscosity.
pub const SCALE: Range = Range { name: "hersey_scale", min: 1e-6, max: 1e6, unit: "" };

/// Density that converts cSt to the viscosity number of the carriage convention, kg/m³.
const OIL_DENSITY_KG_M3: f64 = 880.0;

/// Key that replaces the two viscosities of a data sheet.
const CONSTANT_VISCOSITY: &str = "viscosity_cst";

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
    parameters: &'static Published,
    exact: Exact,
    hersey_scale: f64,
    lubricant: Lubricant,
    entries: Vec<Entry>,
}

impl PartialEq for GuideSet {
    fn eq(&self, other: &Self) -> bool {
        // the model follows from the entries, so they suffice
        self.parameters.name == other.parameters.name && self.entries == other.entries
    }
}

impl GuideSet {
    /// The guide and oil of Zhou et al. 2023, nothing overridden.
    pub fn zhou_2023() -> Self {
        const SET: &Published = &SETS[0];
        GuideSet::published(SET)
    }

    /// A published set, nothing overridden.
    pub(crate) fn published(parameters: &'static Published) -> Self {
        use model_core::reference::zhou_2023::{FRICTION, GUIDE, OIL};
        let mut set = GuideSet {
            parameters,
            exact: Exact::new(GUIDE, FRICTION),
            hersey_scale: 1.0,
            lubricant: Lubricant::Walther(OIL),
            entries: parameters.entries(),
        };
        // cannot fail: published values are legal (ensured by a test); if not, the placeholders above would stay
        let _ = set.derive();
        set
    }

    /// Reads a simulation file for its guide and oil alone.
    ///
    /// # Errors
    /// [`BadFile`] as [`Simulation::from_toml`]; a file whose law is not that of a ball guide.
    pub fn from_toml(text: &str) -> Result<Self, BadFile> {
        match Simulation::from_toml(text)?.law {
            Law::Guide(set) => Ok(set),
            Law::CoulombViscous { .. } => Err(BadFile::at(
                text,
                Mistake::at_start("guide.law describes an axis without a ball guide; it has no preload"),
            )),
            Law::Column { .. } => Err(BadFile::at(
                text,
                Mistake::at_start("the file describes no guide; add [guide] with parameters = \"zhou-2023\""),
            )),
        }
    }

    /// The exact model, Eq. 1 to 21 of Zhou 2023.
    pub const fn exact(&self) -> &Exact {
        &self.exact
    }

    /// Factor from ν in cSt to the model's viscosity number: 1 with slip, 60·ρ·1e-6 (ρ in kg/m³) with the carriage
    /// speed.
    pub const fn hersey_scale(&self) -> f64 {
        self.hersey_scale
    }

    /// The oil.
    pub const fn lubricant(&self) -> Lubricant {
        self.lubricant
    }

    /// The published set that this one is based on.
    pub const fn parameters(&self) -> &'static Published {
        self.parameters
    }

    /// Every value with its provenance, in the order of the file format.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The same with one number replaced, as if the file had set it.
    ///
    /// Keys and units are those of the file format; `viscosity_cst` replaces the two data-sheet viscosities.
    ///
    /// # Errors
    /// A text that names the key: it does not exist or is no number, the number is out of range, or the drag would no
    /// longer determine the preload.
    pub fn with_number(&self, key: &str, x: f64) -> Result<Self, String> {
        self.with_numbers(&[(key, x)])
    }

    /// The same with several numbers replaced at once, so that only their combination must be legal.
    ///
    /// # Errors
    /// As [`with_number`](Self::with_number).
    pub fn with_numbers(&self, numbers: &[(&str, f64)]) -> Result<Self, String> {
        let mut set = self.clone();
        for (key, x) in numbers {
            if *key == CONSTANT_VISCOSITY {
                set.make_viscosity_constant();
            }
            let Some(entry) = set.entries.iter_mut().find(|e| e.key == *key && is_settable(e.key)) else {
                return Err(format!("there is no key {key}"));
            };
            if !matches!(entry.value, Value::Number(_)) {
                return Err(format!("{key} is not a number"));
            }
            check(entry.key, *x).map_err(|what| format!("{key} {what}"))?;
            entry.value = Value::Number(*x);
            entry.provenance = Provenance::File;
        }
        set.derive()?;
        Ok(set)
    }

    /// The same with the other speed in the Hersey number, and the published set's scale for that speed.
    #[must_use]
    pub fn with_hersey_speed(&self, speed: HerseySpeed) -> Self {
        let mut set = self.clone();
        if self.exact.guide().hersey_speed == speed {
            return set;
        }
        let name = if speed == HerseySpeed::Carriage { "carriage" } else { "slip" };
        let published = self.parameters.entries();
        for entry in &mut set.entries {
            match entry.key {
                "hersey" => (entry.value, entry.provenance) = (Value::Name(name), Provenance::File),
                // a scale in a file was meant for the other speed
                "hersey_scale" => {
                    if let Some(own) = published.iter().find(|e| e.key == "hersey_scale") {
                        *entry = *own;
                    }
                }
                _ => {}
            }
        }
        // both speeds are legal for every geometry; the friction law may not be, and is what calibration determines
        let _ = set.derive();
        set
    }

    /// Reads the keys of `[guide]` and `[lubricant]`.
    pub(crate) fn read(guide: &[Item<'_>], lubricant: &[Item<'_>], place: &Span<usize>) -> Result<Self, Mistake> {
        let parameters = match guide.iter().find(|item| item.key == "parameters") {
            Some(item) => {
                let names: Vec<&'static str> = SETS.iter().map(|set| set.name).collect();
                named(item.one_of(&names)?)
            }
            None => None,
        };
        let mut set = parameters.map_or_else(GuideSet::zhou_2023, GuideSet::published);
        if lubricant.iter().any(|item| item.key == CONSTANT_VISCOSITY) {
            set.make_viscosity_constant();
        }
        for item in guide.iter().chain(lubricant) {
            if (item.section, item.key) != ("guide", "parameters") {
                set.take(item, lubricant)?;
            }
        }
        if let [one] = lubricant
            && one.key != CONSTANT_VISCOSITY
        {
            let what = "lubricant.viscosity_40_cst and viscosity_100_cst belong together; give both";
            return Err(Mistake::new(&one.key_span, what));
        }
        let hot = lubricant.iter().find(|item| item.key == "viscosity_100_cst");
        set.derive_lubricant()
            .map_err(|what| Mistake::new(hot.map_or(place, |item| &item.key_span), format!("lubricant.{what}")))?;
        set.derive().map_err(|what| Mistake::new(place, what))?;
        Ok(set)
    }

    fn take(&mut self, item: &Item<'_>, lubricant: &[Item<'_>]) -> Result<(), Mistake> {
        let known = known(item.section);
        let of = |e: &&mut Entry| e.section == item.section && e.key == item.key && is_settable(e.key);
        let Some(entry) = self.entries.iter_mut().find(of) else {
            if known.contains(&item.key) && lubricant.iter().any(|other| other.key == CONSTANT_VISCOSITY) {
                let what = "give either lubricant.viscosity_cst or viscosity_40_cst with viscosity_100_cst, not both";
                return Err(Mistake::new(&item.key_span, what));
            }
            return Err(item.unknown(&known));
        };
        entry.value = match entry.value {
            Value::Name(_) => Value::Name(item.one_of(choices(entry.key))?),
            Value::Number(_) => {
                let x = item.any_number()?;
                check(entry.key, x).map_err(|what| item.wrong(format!("{} {what}", item.name())))?;
                Value::Number(x)
            }
        };
        entry.provenance = Provenance::File;
        Ok(())
    }

    fn make_viscosity_constant(&mut self) {
        self.entries.retain(|e| e.section != "lubricant");
        self.entries.push(Entry {
            section: "lubricant",
            key: CONSTANT_VISCOSITY,
            value: Value::Number(f64::NAN),
            provenance: Provenance::File,
        });
    }

    /// Derives the model from the entries.
    fn derive(&mut self) -> Result<(), String> {
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
            hersey_speed: if self.name("hersey") == "carriage" { HerseySpeed::Carriage } else { HerseySpeed::Slip },
            contact_angle: if self.name("contact_angle_mode") == "fixed" {
                ContactAngle::Fixed
            } else {
                ContactAngle::Exact
            },
        };
        guide.check().map_err(|why| why.to_string())?;
        let friction = Friction {
            mu_coulomb: self.number("mu_coulomb"),
            mu_viscous: self.number("mu_viscous"),
            mu_stribeck: self.number("mu_stribeck"),
            stribeck_exponent: self.number("stribeck_exponent"),
        };
        self.derive_lubricant()?;
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
        tells_the_preload(&guide, &friction)
    }

    fn derive_lubricant(&mut self) -> Result<(), String> {
        self.lubricant = if self.entries.iter().any(|e| e.key == CONSTANT_VISCOSITY) {
            Lubricant::Constant(self.number(CONSTANT_VISCOSITY))
        } else {
            let walther = Walther::from_40_and_100(self.number("viscosity_40_cst"), self.number("viscosity_100_cst"));
            Lubricant::Walther(walther.map_err(|_| "viscosity_100_cst must lie below viscosity_40_cst".to_owned())?)
        };
        Ok(())
    }

    /// A number among the entries, where it is by construction; otherwise NaN, which every check refuses.
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

/// The file format has no key for the interference: it belongs to the split block alone.
pub(crate) fn is_settable(key: &str) -> bool {
    key != "initial_interference_m"
}

/// Keys of a section that a file may set.
fn known(section: &str) -> Vec<&'static str> {
    let mut keys = if section == "guide" { vec!["parameters", "law"] } else { vec![CONSTANT_VISCOSITY] };
    let set = SETS[0].entries();
    keys.extend(set.iter().filter(|e| e.section == section && is_settable(e.key)).map(|e| e.key));
    keys
}

fn choices(key: &str) -> &'static [&'static str] {
    if key == "hersey" { &["slip", "carriage"] } else { &["fixed", "exact"] }
}

/// Checks a value in the file's unit; the text returned continues the key.
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
        "viscosity_40_cst" | "viscosity_100_cst" => quantity::range(CONSTANT_VISCOSITY).copied(),
        _ => quantity::range(key).copied(),
    };
    within(&range.ok_or_else(|| "has no legal range".to_owned())?, x)?;
    if key == "balls_per_row" && x.fract() != 0.0 {
        return Err(format!("must be a whole number, not {x}"));
    }
    Ok(())
}

/// Refuses friction constants for which several preloads give the same drag force.
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
            "with these friction constants several preloads make the same drag force: friction falls with the \
             {steepest:.1}th power of the Hersey number; raise guide.mu_coulomb or lower guide.mu_stribeck"
        ));
    }
    Ok(())
}
