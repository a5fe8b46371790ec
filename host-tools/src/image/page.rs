//! An image as a page for people and as JSON.

use std::fmt::Write;

use can_wire::parameters::{ADDRESS, BadRecord, ParameterRecord, VERSION, decode, image_hash, length};
use serde::Serialize;

use super::{Carried, Image, Refused};
use crate::parameters::to_bench;

/// The value of `schema`.
const SCHEMA: &str = "guideblock.image/1";

/// What was made, for people.
pub fn text(image: &Image) -> String {
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = writeln!(
        text,
        "image {:08x}: {} bytes for {ADDRESS:#010x}, {}",
        image.hash,
        image.bytes.len(),
        state(&image.record)
    );
    let _ = writeln!(text, "beside the law: {}", acting(&image.record));
    for carried in &image.carried {
        let _ = writeln!(text, "{} ({}): {}", carried.id, carried.form, carried.how);
    }
    text
}

/// What an image holds, for people: its head, then all parameters as a bench file.
///
/// # Errors
/// See [`BadRecord`].
pub fn describe(bytes: &[u8]) -> Result<String, BadRecord> {
    let record = decode(bytes)?;
    let (hash, length) = (image_hash(bytes).unwrap_or_default(), length(bytes).unwrap_or_default());
    let mut text = format!("# image {hash:08x}: version {VERSION}, {length} bytes, {}\n", state(&record));
    let _ = writeln!(text, "# beside the law: {}", acting(&record));
    text.push_str(&to_bench(&record));
    Ok(text)
}

fn state(record: &ParameterRecord) -> String {
    let calibrated = if record.params.calibrated { "calibrated" } else { "NOT calibrated: it gives no preload" };
    format!("node {}, {calibrated}", record.node)
}

fn acting(record: &ParameterRecord) -> String {
    let names: Vec<_> = record.params.left_out.acting().names().collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

#[derive(Serialize)]
struct Made<'a> {
    schema: &'static str,
    hash: String,
    version: u16,
    bytes: usize,
    node: u8,
    calibrated: bool,
    acting: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mechanisms: Option<Vec<Entry<'a>>>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    notes: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<&'a model_core::params::Params>,
}

#[derive(Serialize)]
struct Entry<'a> {
    id: &'static str,
    form: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    carried: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<&'a str>,
}

#[derive(Serialize)]
struct NotMade<'a> {
    schema: &'static str,
    refused: Vec<Entry<'a>>,
}

/// What was made, as one JSON object.
pub fn to_json<'a>(image: &'a Image) -> String {
    let entry = |c: &'a Carried| Entry { id: c.id.name(), form: c.form, carried: Some(&c.how), refused: None };
    let mechanisms = image.carried.iter().map(entry).collect();
    json(&Made {
        mechanisms: Some(mechanisms),
        notes: &image.notes,
        ..made(&image.record, image.hash, image.bytes.len())
    })
}

/// What an image holds, as one JSON object.
///
/// # Errors
/// See [`BadRecord`].
pub fn described_json(bytes: &[u8]) -> Result<String, BadRecord> {
    let record = decode(bytes)?;
    let (hash, length) = (image_hash(bytes).unwrap_or_default(), length(bytes).unwrap_or_default());
    Ok(json(&Made { parameters: Some(&record.params), ..made(&record, hash, length) }))
}

fn made<'a>(record: &ParameterRecord, hash: u32, bytes: usize) -> Made<'a> {
    Made {
        schema: SCHEMA,
        hash: format!("{hash:08x}"),
        version: VERSION,
        bytes,
        node: record.node,
        calibrated: record.params.calibrated,
        acting: record.params.left_out.acting().names().collect(),
        mechanisms: None,
        notes: &[],
        parameters: None,
    }
}

/// What was refused, as one JSON object.
pub fn refusal_json<'a>(refused: &'a [Refused]) -> String {
    let entry = |r: &'a Refused| Entry { id: r.id, form: r.form, carried: None, refused: Some(&r.why) };
    json(&NotMade { schema: SCHEMA, refused: refused.iter().map(entry).collect() })
}

fn json(value: &impl Serialize) -> String {
    // plain fields always have a JSON form
    serde_json::to_string_pretty(value).unwrap_or_default()
}
