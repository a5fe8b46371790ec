//! Reads candump log entries from standard input and prints what they say, one line each.
//!
//! A frame that is taken: name and value of everything in it, SI units, separated by commas; an empty value is
//! not available. Another one: `rejected,` and the reason's name. Counters are checked as on one bus.

use can_wire::{Alive, Message, Reject, decode};
use model_core::consistency::Axis;
use model_core::left_out::Acting;
use model_core::sample::Reason;
use std::fmt::Display;
use std::io::{BufRead, BufWriter, Write};

/// Identifier and data of an entry like `(0.000000) can0 185#0011223344556677`.
fn entry(line: &str) -> Option<(u16, Vec<u8>)> {
    let (id, data) = line.split_whitespace().find_map(|word| word.split_once('#'))?;
    let bytes = data.as_bytes().chunks(2);
    let bytes = bytes.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok());
    Some((u16::from_str_radix(id, 16).ok()?, bytes.collect::<Option<_>>()?))
}

fn number(name: &str, value: Option<f32>) -> String {
    format!("{name},{}", value.map_or(String::new(), |v| v.to_string()))
}

fn code(name: &str, value: impl Display) -> String {
    format!("{name},{value}")
}

fn fields(message: &Message) -> Vec<String> {
    let mut fields = match message {
        Message::Estimate(m) => vec![
            number("preload_n", m.preload_n),
            number("sigma_n", m.sigma_n),
            number("drag_force_n", m.drag_force_n),
            code("quality", m.quality.map_or("trusted", Reason::name)),
        ],
        Message::Motion(m) => vec![
            number("speed_m_s", m.speed_m_s),
            number("temperature_degc", m.temperature_degc),
            code("time_us", m.time_us),
            code("motion", m.motion.name()),
        ],
        Message::Ripple(m) => vec![
            number("amplitude_n", m.amplitude_n),
            number("phase_rad", m.phase_rad),
            number("wavelength_m", m.wavelength_m),
        ],
        Message::Acting(m) => {
            let acts = |name| u8::from(m.acting.names().any(|own| own == name));
            let mut fields = vec![code("source", m.source.name())];
            fields.extend(Acting::NAMES.map(|name| code(name, acts(name))));
            fields
        }
        Message::Misfit(m) => vec![
            code("axis", m.axis.map_or("not judged", Axis::name)),
            number("strength", m.strength),
            number("share", m.share),
            number("since_s", m.since_s),
        ],
        Message::State(m) => vec![
            code("image", m.image),
            code("changes", m.changes),
            code("limits", m.limits.name()),
            code("unlocked", u8::from(m.unlocked)),
            code("bursting", u8::from(m.bursting)),
        ],
        Message::Heartbeat(m) => vec![
            code("nmt_state", m.state.name()),
            code("reset_cause", m.reset_cause.name()),
            code("board", m.board.name()),
            code("boot_count", m.boot_count),
            code("frames_dropped", m.frames_dropped),
        ],
        Message::Fault(m) => vec![
            code("error_code", m.error_code),
            code("error_register", m.error_register),
            code("reasons", m.reasons.iter().map(Reason::name).collect::<Vec<_>>().join(" ")),
            code("lost_blocks", m.lost_blocks),
        ],
    };
    fields.push(code("counter", message.counter()));
    fields
}

fn main() -> std::io::Result<()> {
    let mut out = BufWriter::new(std::io::stdout().lock());
    let mut alive = Alive::new();
    let mut read = |id: u16, data: &[u8]| -> Result<Message, Reject> {
        let (_, message) = decode(id, data)?;
        alive.accept(id, message.counter())?;
        Ok(message)
    };
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let Some((id, data)) = entry(&line) else {
            eprintln!("no candump log entry: {line}");
            std::process::exit(3);
        };
        match read(id, &data) {
            Ok(message) => writeln!(out, "{}", fields(&message).join(","))?,
            Err(reason) => writeln!(out, "rejected,{}", reason.name())?,
        }
    }
    out.flush()
}
