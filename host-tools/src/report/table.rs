//! Readings as aligned text for a terminal.

use std::collections::BTreeMap;

use can_wire::{ActingMessage, HeartbeatMessage, Message, MisfitMessage, NodeId, RippleMessage, StateMessage};
use model_core::consistency::Axis;
use model_core::sample::Reasons;

use super::csv::{hash, names};
use crate::candump::Micros;
use crate::decode::{Decoded, Joiner, Reading};

/// The line above the readings.
pub const HEADER: &str =
    "        time/s  node  preload/N   2σ/N  drag/N  speed/(mm/s)  temp/°C  motion        why no preload";

/// Letters of [`HEADER`] before its last column.
pub const WIDTH_WITHOUT_REASON: usize = 83;

/// Text in place of a missing number.
const NOTHING: &str = "--";

/// Turns messages into lines. Heartbeats and faults give a line when their content changes.
#[derive(Debug, Default)]
pub struct Table {
    joiner: Joiner,
    beats: BTreeMap<NodeId, HeartbeatMessage>,
    faults: BTreeMap<NodeId, (Reasons, u8)>,
    states: BTreeMap<NodeId, StateMessage>,
    misfits: BTreeMap<NodeId, (Option<Axis>, bool)>,
    actings: BTreeMap<NodeId, ActingMessage>,
}

impl Table {
    /// The line that this message completes, if it completes one.
    pub fn message(&mut self, decoded: &Decoded) -> Option<String> {
        let Decoded { time, node, message } = *decoded;
        let text = match message {
            Message::Estimate(_) | Message::Motion(_) => return self.joiner.take(decoded).map(|r| reading(&r)),
            Message::Heartbeat(beat) => {
                let said = HeartbeatMessage { counter: 0, ..beat };
                if self.beats.insert(node, said) == Some(said) {
                    return None;
                }
                heartbeat(&beat)
            }
            Message::Fault(fault) => {
                let said = (fault.reasons, fault.lost_blocks);
                if self.faults.insert(node, said) == Some(said) {
                    return None;
                }
                let names = match names(fault.reasons).join(", ") {
                    none if none.is_empty() => "none".to_owned(),
                    names => names,
                };
                format!("reasons: {names}; {} blocks of samples lost", fault.lost_blocks)
            }
            Message::State(state) => {
                let said = StateMessage { counter: 0, ..state };
                if self.states.insert(node, said) == Some(said) {
                    return None;
                }
                workings(&state)
            }
            Message::Ripple(ripple) => ball_pass(&ripple),
            Message::Misfit(misfit) => {
                // numbers flicker; what counts is whether and on which axis
                let said = (misfit.axis, misfit.since_s.is_some());
                if self.misfits.insert(node, said) == Some(said) {
                    return None;
                }
                fit(&misfit)
            }
            Message::Acting(acting) => {
                let said = ActingMessage { counter: 0, ..acting };
                if self.actings.insert(node, said) == Some(said) {
                    return None;
                }
                parameters(&acting)
            }
        };
        Some(format!("{:>14}  {:>4}  {text}", seconds(time), node.get()))
    }

    /// Readings whose second half never came.
    pub fn finish(self) -> impl Iterator<Item = String> {
        self.joiner.finish().map(|r| reading(&r))
    }
}

/// A reading as a line under [`HEADER`].
pub fn reading(reading: &Reading) -> String {
    let number = |value: Option<f32>, decimals: usize| match value {
        Some(value) => format!("{value:.decimals$}"),
        None => NOTHING.to_owned(),
    };
    let estimate = &reading.estimate;
    let motion = reading.motion.as_ref();
    let line = format!(
        "{:>14}  {:>4}  {:>9}  {:>5}  {:>6}  {:>12}  {:>7}  {:<12}  {}",
        seconds(reading.time),
        reading.node.get(),
        number(estimate.preload_n, 0),
        number(estimate.sigma_n.map(|s| 2.0 * s), 0),
        number(estimate.drag_force_n, 2),
        number(motion.and_then(|m| m.speed_m_s).map(|v| 1000.0 * v), 1),
        number(motion.and_then(|m| m.temperature_degc), 2),
        motion.map_or(NOTHING, |m| m.motion.name()),
        estimate.quality.map_or("", |reason| reason.name()),
    );
    line.trim_end().to_owned()
}

fn seconds(time: Option<Micros>) -> String {
    match time {
        // rounded in integers: an epoch time has too many digits to format a float plainly
        Some(Micros(micros)) => {
            let millis = (micros + 500) / 1000;
            format!("{}.{:03}", millis / 1000, millis % 1000)
        }
        None => NOTHING.to_owned(),
    }
}

fn heartbeat(beat: &HeartbeatMessage) -> String {
    format!(
        "heartbeat: {}, {}, start {} after {}, {} frames dropped",
        beat.state.name(),
        beat.board.name(),
        beat.boot_count,
        beat.reset_cause.name(),
        beat.frames_dropped
    )
}

fn workings(state: &StateMessage) -> String {
    let image = match state.image {
        0 => "built-in parameters".to_owned(),
        image => format!("image {}", hash(image)),
    };
    let lock = if state.unlocked { "unlocked" } else { "locked" };
    let burst = if state.bursting { ", sends a burst" } else { "" };
    format!("state: {image}, {} changes, {lock}, limits {}{burst}", state.changes, state.limits.name())
}

fn fit(misfit: &MisfitMessage) -> String {
    let (Some(axis), Some(strength), Some(share)) = (misfit.axis, misfit.strength, misfit.share) else {
        return "model: too little motion seen to judge it".to_owned();
    };
    let how = format!("{strength:.1} sigma, {:.1} % of the drag, over {}", 100.0 * share, axis.name());
    match misfit.since_s {
        Some(since) => format!("model does NOT fit, for {since:.0} s: {how}"),
        None => format!("model fits; most: {how}"),
    }
}

fn parameters(message: &ActingMessage) -> String {
    let acting: Vec<_> = message.acting.names().collect();
    let acting = if acting.is_empty() { "the law alone".to_owned() } else { format!("law with {}", acting.join(", ")) };
    format!("parameters {}: {acting}", message.source.name())
}

fn ball_pass(ripple: &RippleMessage) -> String {
    let (Some(amplitude), Some(wavelength)) = (ripple.amplitude_n, ripple.wavelength_m) else {
        return "ball-pass ripple: not known yet".to_owned();
    };
    format!("ball-pass ripple: {amplitude:.3} N every {:.3} mm", 1000.0 * wavelength)
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_wire::EstimateMessage;
    use model_core::sample::Reason;

    #[test]
    fn columns_stand_under_their_headings() {
        let estimate = EstimateMessage {
            preload_n: None,
            sigma_n: None,
            drag_force_n: None,
            quality: Some(Reason::Stale),
            counter: 0,
        };
        let line = reading(&Reading { time: Some(Micros(1_999_500)), node: NodeId::FIRST, estimate, motion: None });
        let (left, reason) = line.split_at(WIDTH_WITHOUT_REASON + 2);
        assert_eq!(reason, "stale");
        assert!(left.starts_with("         2.000     1         --"), "{left}");
        assert_eq!(HEADER.chars().skip(WIDTH_WITHOUT_REASON + 2).collect::<String>(), "why no preload");
        for heading in ["time/s", "node", "preload/N", "drag/N", "speed/(mm/s)", "temp/°C"] {
            let at = HEADER.find(heading).expect("in the header") + heading.len();
            let end = HEADER[..at].chars().count();
            assert!(!left[..end].ends_with(' ') && left[end..].starts_with(' '), "{heading}");
        }
    }
}
