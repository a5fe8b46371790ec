//! From a simulation that the diagnosis augmented to the parameter image that a block runs.
//!
//! The law, its oil and every `[[mechanism]]` of the file go into the record; sensors, ranges, uncertainties, node and
//! the mark "calibrated" stay those of the record it is made from. A mechanism that the chip cannot run is refused by
//! name, and so is every `[[curve]]`: an image that silently lacked it would bring the error back that was just
//! explained.

mod carry;
mod page;
mod table;

use can_wire::parameters::{MAX_SIZE, ParameterRecord, encode, image_hash};
use model_core::left_out::LeftOut;
use model_core::params::Seals;
use model_core::quantity::range;
use model_core::reduced::Reduced;
use model_core::viscosity::ViscosityCubic;
use simulation::Simulation;
use simulation::file::Law;
use simulation::guide::{GuideSet, Lubricant};
use simulation::mechanism::Id;

pub use page::{describe, described_json, refusal_json, text, to_json};

/// Facts that the simulation does not hold and the block needs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Circumstances {
    /// External load while moving towards larger and towards smaller positions, N.
    pub external_load_n: Option<[f64; 2]>,
    /// Place on the rail at which the block is switched on, m, where positions of the simulation count from the rail's
    /// zero.
    pub start_m: f64,
    /// Temperatures that the image is to hold for, °C; without it those of the record.
    pub temperature_degc: Option<[f64; 2]>,
    /// Keep the record's friction law and oil and take the mechanisms alone: the diagnosis may have moved preload and
    /// friction together within their tolerances, which the drag does not tell apart and a calibrated block does.
    pub keep_law: bool,
}

/// An image, with the list of what was transferred from the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The record.
    pub record: ParameterRecord,
    /// Its bytes for the block's flash.
    pub bytes: Vec<u8>,
    /// Hash that identifies it.
    pub hash: u32,
    /// Each mechanism of the simulation and where it went.
    pub carried: Vec<Carried>,
    /// What a person should know before the image is used.
    pub notes: Vec<String>,
}

/// A mechanism that the image has.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// Which one.
    pub id: Id,
    /// Its form.
    pub form: &'static str,
    /// Where it went.
    pub how: String,
}

/// A mechanism or a curve that the chip cannot run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Name of the mechanism; `curve` of what has none.
    pub id: &'static str,
    /// Its form; of a curve the axis that it lies along.
    pub form: &'static str,
    /// Why, and what to do.
    pub why: String,
}

/// Why there is no image.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoImage {
    /// The law is none that a block can invert.
    #[error("{0}")]
    Law(&'static str),
    /// At least one mechanism or curve cannot be run; all of those are named.
    #[error("{}", sentences(.0))]
    Refused(Vec<Refused>),
    /// The oil's viscosity cannot be put into the block's form.
    #[error("the oil's viscosity between {0} and {1} °C: {2}; give --from-degc and --to-degc within its range")]
    Oil(f64, f64, model_core::Error),
    /// A number beyond what the block accepts.
    #[error("the block refuses the parameters: {0}")]
    Parameters(String),
}

fn sentences(refused: &[Refused]) -> String {
    let one = |r: &Refused| format!("{} (form {}) cannot run on the block: {}", r.id, r.form, r.why);
    refused.iter().map(one).collect::<Vec<_>>().join("\n")
}

/// Makes the image of a simulation, based on a record.
///
/// # Errors
/// [`NoImage`].
pub fn build(simulation: &Simulation, base: &ParameterRecord, told: &Circumstances) -> Result<Image, NoImage> {
    let Law::Guide(set) = &simulation.law else {
        return Err(NoImage::Law(
            "the simulation has no ball guide, so its drag does not tell a preload; give one with [guide]",
        ));
    };
    let mut record = *base;
    let params = &mut record.params;
    if told.keep_law {
        return finish(simulation, set, told, record, Vec::new());
    }
    let exact = set.exact();
    params.law = Reduced::of(exact.guide(), exact.friction(), f64::from(params.law.load_limit_n)).to_f32();
    params.viscosity_number_per_cst = set.hersey_scale() as f32;
    let [from, to] =
        told.temperature_degc.unwrap_or([params.viscosity.from_degc.into(), params.viscosity.to_degc.into()]);
    params.viscosity = match set.lubricant() {
        Lubricant::Constant(nu) => constant(nu, from, to),
        Lubricant::Walther(walther) => walther.cubic(from, to).map_err(|why| NoImage::Oil(from, to, why))?,
    };
    finish(simulation, set, told, record, notes(simulation))
}

/// What the law of a simulation changes in the meaning of a preload.
fn notes(simulation: &Simulation) -> Vec<String> {
    let scale = simulation.columns.iter().find(|(name, _)| name == "preload_n").and_then(|(_, mapping)| {
        let scale: f64 = mapping.split(':').nth(1)?.trim().parse().ok()?;
        (scale != 1.0).then_some(scale)
    });
    let note = |scale: f64| {
        format!(
            "the simulation's law belongs to preloads read with a factor of {scale:.4}: the block will tell preloads on that \
             scale; --keep-law takes the mechanisms alone and leaves a calibrated block its own"
        )
    };
    scale.map(note).into_iter().collect()
}

/// Everything but the law.
fn finish(
    simulation: &Simulation,
    set: &GuideSet,
    told: &Circumstances,
    mut record: ParameterRecord,
    notes: Vec<String>,
) -> Result<Image, NoImage> {
    let params = &mut record.params;
    // the simulation states all mechanisms; those of the record are replaced
    params.seals = Seals { coulomb_n: 0.0, viscous_n_s_m: 0.0 };
    params.left_out = LeftOut { start_m: told.start_m as f32, ..LeftOut::NOTHING };
    let carried = carry::all(simulation, set, told, params)?;
    let mut buffer = [0; MAX_SIZE];
    let bytes = encode(&record, &mut buffer).map_err(|why| NoImage::Parameters(why.to_string()))?.to_vec();
    let hash = image_hash(&bytes).unwrap_or_default();
    Ok(Image { record, bytes, hash, carried, notes })
}

/// An oil that does not change.
fn constant(nu: f64, from: f64, to: f64) -> ViscosityCubic {
    ViscosityCubic {
        centre_degc: (0.5 * (from + to)) as f32,
        from_degc: from as f32,
        to_degc: to as f32,
        ln: [nu.ln() as f32, 0.0, 0.0, 0.0],
    }
}

/// Largest value of a quantity that the block accepts.
fn most(name: &str) -> f64 {
    range(name).map_or(0.0, |r| r.max)
}

#[cfg(test)]
mod tests;
