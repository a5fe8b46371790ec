//! Messages as JSON lines: SI numbers with the unit in the key, `null` for numbers that the block did not know.

use can_wire::Message;
use model_core::consistency::Axis;
use serde::Serialize;

use super::csv::{hash, names, quality};
use crate::decode::Decoded;

#[derive(Serialize)]
struct Object {
    time_s: Option<f64>,
    node: u8,
    counter: u8,
    #[serde(flatten)]
    body: Body,
}

#[derive(Serialize)]
#[serde(tag = "message", rename_all = "kebab-case")]
enum Body {
    Estimate { preload_n: Option<f32>, sigma_n: Option<f32>, drag_force_n: Option<f32>, quality: &'static str },
    Motion { speed_m_s: Option<f32>, temperature_degc: Option<f32>, motion: &'static str, block_time_us: u32 },
    Fault { reasons: Vec<&'static str>, lost_blocks: u8, error_code: u16, error_register: u8 },
    Ripple { amplitude_n: Option<f32>, phase_rad: Option<f32>, wavelength_m: Option<f32> },
    Acting { acting: Vec<&'static str>, source: &'static str },
    Misfit { axis: Option<&'static str>, strength: Option<f32>, share: Option<f32>, since_s: Option<f32> },
    State { image: String, changes: u16, limits: &'static str, unlocked: bool, bursting: bool },
    Heartbeat { state: &'static str, reset: &'static str, board: &'static str, boot_count: u16, frames_dropped: u16 },
}

/// A message as one line of JSON, without the line's end.
pub fn object(decoded: &Decoded) -> String {
    let body = match decoded.message {
        Message::Estimate(m) => Body::Estimate {
            preload_n: m.preload_n,
            sigma_n: m.sigma_n,
            drag_force_n: m.drag_force_n,
            quality: quality(m.quality),
        },
        Message::Motion(m) => Body::Motion {
            speed_m_s: m.speed_m_s,
            temperature_degc: m.temperature_degc,
            motion: m.motion.name(),
            block_time_us: m.time_us,
        },
        Message::Fault(m) => Body::Fault {
            reasons: names(m.reasons),
            lost_blocks: m.lost_blocks,
            error_code: m.error_code,
            error_register: m.error_register,
        },
        Message::Ripple(m) => {
            Body::Ripple { amplitude_n: m.amplitude_n, phase_rad: m.phase_rad, wavelength_m: m.wavelength_m }
        }
        Message::Acting(m) => Body::Acting { acting: m.acting.names().collect(), source: m.source.name() },
        Message::Misfit(m) => {
            Body::Misfit { axis: m.axis.map(Axis::name), strength: m.strength, share: m.share, since_s: m.since_s }
        }
        Message::State(m) => Body::State {
            image: hash(m.image),
            changes: m.changes,
            limits: m.limits.name(),
            unlocked: m.unlocked,
            bursting: m.bursting,
        },
        Message::Heartbeat(m) => Body::Heartbeat {
            state: m.state.name(),
            reset: m.reset_cause.name(),
            board: m.board.name(),
            boot_count: m.boot_count,
            frames_dropped: m.frames_dropped,
        },
    };
    let object = Object {
        time_s: decoded.time.map(|t| t.seconds()),
        node: decoded.node.get(),
        counter: decoded.message.counter(),
        body,
    };
    // plain fields always have a JSON form
    serde_json::to_string(&object).unwrap_or_default()
}
