//! Objects by the names a person types.

use can_wire::service::{Field, objects};
use host_tools::block::{Client, object};
use host_tools::report::csv::hash;

use super::of_client;
use crate::cmd::Failure;

/// What can be read and set, by name.
const NAMES: [(&str, Field); 24] = [
    ("error-register", Field::ErrorRegister),
    ("revision", Field::Revision),
    ("serial", Field::Serial),
    ("alarm-below", Field::AlarmBelow),
    ("warn-below", Field::WarnBelow),
    ("warn-above", Field::WarnAbove),
    ("alarm-above", Field::AlarmAbove),
    ("publishing-period", Field::PublishingPeriod),
    ("zero-shift", Field::ZeroShift),
    ("image-state", Field::ImageState),
    ("image-active", Field::ImageActive),
    ("starts", Field::BootCount),
    ("reset-cause", Field::ResetCause),
    ("lost-blocks", Field::LostBlocks),
    ("frames-dropped", Field::FramesDropped),
    ("bus-offs", Field::BusOffs),
    ("burst-state", Field::BurstState),
    ("burst-load", Field::BurstLoad),
    ("burst-dropped", Field::BurstDropped),
    ("unlocked", Field::Unlocked),
    ("changes", Field::Changes),
    ("save", Field::Save),
    ("clear-counters", Field::ClearCounters),
    ("restart", Field::Restart),
];

fn is_limit(field: Field) -> bool {
    matches!(field, Field::AlarmBelow | Field::WarnBelow | Field::WarnAbove | Field::AlarmAbove)
}

/// Value that is written to give a command.
fn signature(field: Field) -> Option<u32> {
    match field {
        Field::Save => Some(objects::SAVE),
        Field::ClearCounters => Some(objects::CLEAR),
        Field::Restart => Some(objects::RESTART),
        _ => None,
    }
}

/// All that can be read, in the order of the dictionary.
pub(super) fn all_readable() -> impl Iterator<Item = (&'static str, Field)> {
    NAMES.into_iter().filter(|(_, field)| signature(*field).is_none())
}

/// The object that is read under this name.
pub(super) fn readable(name: &str) -> Result<Field, Failure> {
    let found = all_readable().find(|(known, _)| *known == name);
    found.map(|(_, field)| field).ok_or_else(|| unknown(name, all_readable().map(|(known, _)| known)))
}

fn unknown<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Failure {
    Failure::Usage(format!("there is no {name:?}; it is one of: {}", known.collect::<Vec<_>>().join(", ")))
}

/// A value as a person reads it.
pub(super) fn shown(field: Field, value: u32) -> String {
    match field {
        field if is_limit(field) && value == 0xFFFF => "off".to_owned(),
        Field::ZeroShift => (f64::from(value as u16 as i16) / 16.0).to_string(),
        Field::Serial => format!("{value:08X}"),
        Field::ImageActive => hash(value),
        _ => value.to_string(),
    }
}

/// Sets an object.
pub(super) fn set(client: &mut Client, key: u32, name: &str, value: Option<&str>) -> Result<(), Failure> {
    let settable = || NAMES.into_iter().filter(|(_, field)| object(*field).access.writable());
    let Some((_, field)) = settable().find(|(known, _)| *known == name) else {
        return Err(unknown(name, settable().map(|(known, _)| known)));
    };
    let value = match (signature(field), value) {
        (Some(signature), None) => signature,
        (Some(_), Some(_)) => return Err(Failure::Usage(format!("{name} is a command and takes no value"))),
        (None, Some("off")) if is_limit(field) => 0xFFFF,
        (None, Some(text)) => {
            let (low, high) = (object(field).low, object(field).high);
            let value = text.parse().ok().filter(|value| (low..=high).contains(value));
            value
                .ok_or_else(|| Failure::Usage(format!("{name}: {text:?} is not a whole number from {low} to {high}")))?
        }
        (None, None) => return Err(Failure::Usage(format!("{name} needs a value"))),
    };
    client.unlock(key).map_err(of_client)?;
    match field {
        Field::Save => client.save().map_err(of_client),
        field => client.write(field, value).map_err(of_client),
    }
}
