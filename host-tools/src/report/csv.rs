//! Messages as rows of CSV: one row a message, an empty cell where that kind of message has no such number.

use can_wire::Message;
use model_core::sample::{Reason, Reasons};
use serde::Serialize;

use crate::decode::Decoded;

/// What `quality` says when the preload may be trusted.
pub const TRUSTED: &str = "trusted";

/// The name of an estimate's quality.
pub fn quality(reason: Option<Reason>) -> &'static str {
    reason.map_or(TRUSTED, Reason::name)
}

/// A row; the fields are the columns, units in their names.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    time_s: Option<String>,
    node: u8,
    message: &'static str,
    counter: u8,
    preload_n: Option<f32>,
    sigma_n: Option<f32>,
    drag_force_n: Option<f32>,
    quality: Option<&'static str>,
    speed_m_s: Option<f32>,
    temperature_degc: Option<f32>,
    motion: Option<&'static str>,
    block_time_us: Option<u32>,
    reasons: Option<String>,
    lost_blocks: Option<u8>,
    error_code: Option<u16>,
    amplitude_n: Option<f32>,
    phase_rad: Option<f32>,
    wavelength_m: Option<f32>,
    state: Option<&'static str>,
    reset: Option<&'static str>,
    boot_count: Option<u16>,
    frames_dropped: Option<u16>,
}

/// A message as a row.
pub fn row(decoded: &Decoded) -> Row {
    let row = Row {
        time_s: decoded.time.map(|t| t.to_string()),
        node: decoded.node.get(),
        counter: decoded.message.counter(),
        ..Row::default()
    };
    match decoded.message {
        Message::Estimate(m) => Row {
            message: "estimate",
            preload_n: m.preload_n,
            sigma_n: m.sigma_n,
            drag_force_n: m.drag_force_n,
            quality: Some(quality(m.quality)),
            ..row
        },
        Message::Motion(m) => Row {
            message: "motion",
            speed_m_s: m.speed_m_s,
            temperature_degc: m.temperature_degc,
            motion: Some(m.motion.name()),
            block_time_us: Some(m.time_us),
            ..row
        },
        Message::Fault(m) => Row {
            message: "fault",
            reasons: Some(names(m.reasons).join(" ")),
            lost_blocks: Some(m.lost_blocks),
            error_code: Some(m.error_code),
            ..row
        },
        Message::Ripple(m) => Row {
            message: "ripple",
            amplitude_n: m.amplitude_n,
            phase_rad: m.phase_rad,
            wavelength_m: m.wavelength_m,
            ..row
        },
        Message::Heartbeat(m) => Row {
            message: "heartbeat",
            state: Some(m.state.name()),
            reset: Some(m.reset_cause.name()),
            boot_count: Some(m.boot_count),
            frames_dropped: Some(m.frames_dropped),
            ..row
        },
    }
}

/// The names of a set of reasons, most urgent first.
pub fn names(set: Reasons) -> Vec<&'static str> {
    set.iter().map(Reason::name).collect()
}
