//! Decoding of a log or a live bus into the messages of its blocks, with a tally of everything rejected.

use std::collections::BTreeMap;
use std::fmt;

use can_wire::{Alive, Kind, Message, NodeId};

use crate::candump::{self, Frame, Line, Micros, NotCandump};

/// A decoded frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decoded {
    /// Its time, if the log gives one.
    pub time: Option<Micros>,
    /// Node that sent it.
    pub node: NodeId,
    /// Its content.
    pub message: Message,
}

/// Decodes lines one by one and keeps the tally.
#[derive(Debug, Default)]
pub struct Decoder {
    only: Option<NodeId>,
    /// one or two in practice, so a linear search is fastest
    buses: Vec<(String, Bus)>,
    line: u64,
    tally: Tally,
}

/// State of one interface.
#[derive(Debug, Default)]
struct Bus {
    alive: Alive,
    boots: BTreeMap<NodeId, u16>,
}

/// Tally of the lines so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Frames decoded.
    pub decoded: u64,
    /// Frames of other devices, or of a node that was not asked for.
    pub ignored: u64,
    /// Nodes whose frames were ignored because another one was asked for: bit n for node n.
    pub others: u128,
    /// Frames that never came, by the alive counters of those that did.
    pub missing: u64,
    /// Frames and lines that were rejected, by reason.
    pub rejected: BTreeMap<&'static str, Rejected>,
}

/// Frames or lines rejected for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rejected {
    /// How many.
    pub count: u64,
    /// The first few lines, the first of a log is 1.
    pub lines: Vec<u64>,
    /// What was wrong with the first one, and what to do.
    pub first: String,
}

impl Rejected {
    /// Number of lines that are remembered.
    const LINES: usize = 5;
}

impl Tally {
    /// Numbers of the nodes that were seen and not asked for, as text; empty where there were none.
    pub fn other_nodes(&self) -> String {
        let seen = (0..128).filter(|node| self.others >> node & 1 == 1).map(|node| node.to_string());
        seen.collect::<Vec<_>>().join(", ")
    }
}

impl Decoder {
    /// Nothing seen yet; with `only`, frames of other nodes are ignored.
    pub fn new(only: Option<NodeId>) -> Self {
        Decoder { only, ..Self::default() }
    }

    /// Takes the next line of candump text. A line with bytes that are no text is rejected.
    pub fn line(&mut self, text: &[u8]) -> Option<Decoded> {
        self.line += 1;
        match candump::parse(&String::from_utf8_lossy(text)) {
            Ok(Line::Frame(frame)) => self.take(&frame),
            Ok(Line::Foreign) => {
                self.tally.ignored += 1;
                None
            }
            Ok(Line::Blank) => None,
            Err(why) => {
                self.reject(not_candump_name(why), &why);
                None
            }
        }
    }

    /// Takes the next frame of a source that is not text.
    pub fn frame(&mut self, frame: &Frame<'_>) -> Option<Decoded> {
        self.line += 1;
        self.take(frame)
    }

    /// The tally so far.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    fn take(&mut self, frame: &Frame<'_>) -> Option<Decoded> {
        match Kind::of(frame.id) {
            Ok((_, node)) if self.only.is_none_or(|only| only == node) => {}
            Ok((_, node)) => {
                self.tally.ignored += 1;
                self.tally.others |= 1 << (node.get() & 127);
                return None;
            }
            _ => {
                self.tally.ignored += 1;
                return None;
            }
        }
        let taken = can_wire::decode(frame.id, frame.data()).and_then(|(node, message)| {
            let bus = bus_of(&mut self.buses, frame.interface);
            bus.note_restart(node, &message);
            let missing = bus.alive.accept(frame.id, message.counter())?;
            Ok((Decoded { time: frame.time, node, message }, missing))
        });
        match taken {
            Ok((decoded, missing)) => {
                self.tally.decoded += 1;
                self.tally.missing += u64::from(missing);
                Some(decoded)
            }
            Err(reject) => {
                self.reject(reject.name(), &reject);
                None
            }
        }
    }

    fn reject(&mut self, name: &'static str, why: &dyn fmt::Display) {
        let line = self.line;
        let rejected = self.tally.rejected.entry(name).or_insert_with(|| Rejected {
            count: 0,
            lines: Vec::new(),
            first: why.to_string(),
        });
        rejected.count += 1;
        if rejected.lines.len() < Rejected::LINES {
            rejected.lines.push(line);
        }
    }
}

/// The bus of an interface, a new one where it was not seen before.
fn bus_of<'a>(buses: &'a mut Vec<(String, Bus)>, interface: &str) -> &'a mut Bus {
    let at = buses.iter().position(|(name, _)| name == interface).unwrap_or_else(|| {
        buses.push((interface.to_owned(), Bus::default()));
        buses.len() - 1
    });
    &mut buses[at].1
}

impl Bus {
    /// A block that started anew counts from 0 again, which is no repetition.
    fn note_restart(&mut self, node: NodeId, message: &Message) {
        if let Message::Heartbeat(beat) = message
            && self.boots.insert(node, beat.boot_count).is_some_and(|before| before != beat.boot_count)
        {
            self.alive.forget(node);
        }
    }
}

impl fmt::Display for Tally {
    /// One line a fact; lines of the log that were not taken are named.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames decoded, {} others ignored", self.decoded, self.ignored)?;
        if self.missing > 0 {
            write!(f, "\n{} frames missing by their alive counters", self.missing)?;
        }
        for (name, rejected) in &self.rejected {
            let lines: Vec<_> = rejected.lines.iter().map(u64::to_string).collect();
            let more = if rejected.count > rejected.lines.len() as u64 { ", ..." } else { "" };
            let (count, first) = (rejected.count, &rejected.first);
            write!(f, "\n{count} rejected ({name}), line {}{more}: {first}", lines.join(", "))?;
        }
        Ok(())
    }
}

/// The reason's name beside those of [`can_wire::Reject::name`].
fn not_candump_name(why: NotCandump) -> &'static str {
    match why {
        NotCandump::Time => "candump-time",
        NotCandump::Shape => "candump-line",
        NotCandump::Identifier => "candump-identifier",
        NotCandump::Data => "candump-data",
    }
}

/// An estimate and the motion that belongs to it: what a person reads as one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Time of the later of the two.
    pub time: Option<Micros>,
    /// Node that sent it.
    pub node: NodeId,
    /// Preload, drag force, quality.
    pub estimate: can_wire::EstimateMessage,
    /// Speed, temperature, motion; `None` when that frame is missing.
    pub motion: Option<can_wire::MotionMessage>,
}

/// Joins estimates with the motion frames of the same alive counter.
#[derive(Debug, Default)]
pub struct Joiner {
    waiting: BTreeMap<NodeId, Reading>,
}

impl Joiner {
    /// Takes a message; returns a reading when one is complete, or when its motion can no longer arrive.
    pub fn take(&mut self, decoded: &Decoded) -> Option<Reading> {
        let Decoded { time, node, message } = *decoded;
        match message {
            Message::Estimate(estimate) => self.waiting.insert(node, Reading { time, node, estimate, motion: None }),
            Message::Motion(motion) => {
                let reading = self.waiting.remove(&node)?;
                let belongs = reading.estimate.counter == motion.counter;
                Some(if belongs { Reading { time, motion: Some(motion), ..reading } } else { reading })
            }
            Message::Fault(_)
            | Message::Acting(_)
            | Message::Ripple(_)
            | Message::Misfit(_)
            | Message::State(_)
            | Message::Heartbeat(_) => None,
        }
    }

    /// The readings whose motion never came, at the end of a log.
    pub fn finish(self) -> impl Iterator<Item = Reading> {
        self.waiting.into_values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use can_wire::{BoardKind, Health, Publisher, RawFrame, ResetCause};
    use model_core::params::Params;

    fn publisher() -> Publisher {
        Publisher::new(NodeId::FIRST)
    }

    fn text(frame: RawFrame) -> String {
        Frame::new(Some(Micros(1_000)), "can0", frame.id, &frame.data).to_string()
    }

    fn stale(tick: u32) -> model_core::sample::Estimate {
        Params::ZHOU_2023.build().expect("legal").stale(tick)
    }

    #[test]
    fn every_line_is_accounted_for() {
        let mut block = publisher();
        let mut decoder = Decoder::new(None);
        let first = text(block.estimate(&stale(1)));
        assert!(decoder.line(first.as_bytes()).is_some());
        assert!(decoder.line(b"").is_none());
        assert!(decoder.line(b"(1.0) can0 123#00").is_none());
        assert!(decoder.line(b"(1.0) can0 00000181#00").is_none());
        assert!(decoder.line(first.as_bytes()).is_none(), "a copy");
        let _lost = block.estimate(&stale(2));
        let mut damaged = block.motion(&stale(2));
        damaged.data[0] ^= 1;
        assert!(decoder.line(text(damaged).as_bytes()).is_none());
        assert!(decoder.line(text(block.estimate(&stale(3))).as_bytes()).is_some());
        assert!(decoder.line(b"(1.0) can0 181#00").is_none());
        for _ in 0..7 {
            assert!(decoder.line(b"rubbish").is_none());
        }
        let tally = decoder.tally();
        assert_eq!((tally.decoded, tally.ignored, tally.missing), (2, 2, 1));
        let names: Vec<_> = tally.rejected.iter().map(|(name, r)| (*name, r.count, r.lines.clone())).collect();
        assert_eq!(
            names,
            [
                ("candump-line", 7, vec![9, 10, 11, 12, 13]),
                ("crc", 1, vec![6]),
                ("length", 1, vec![8]),
                ("repeated-counter", 1, vec![5])
            ]
        );
        assert!(tally.to_string().contains("\n7 rejected (candump-line), line 9, 10, 11, 12, 13, ...: not a frame"));
    }

    #[test]
    fn one_node_can_be_singled_out_and_interfaces_are_buses_of_their_own() {
        let frame = publisher().estimate(&stale(1));
        let mut decoder = Decoder::new(NodeId::new(2));
        assert!(decoder.line(text(frame).as_bytes()).is_none());
        assert_eq!((decoder.tally().ignored, decoder.tally().other_nodes().as_str()), (1, "1"));
        let mut decoder = Decoder::new(NodeId::new(1));
        assert!(decoder.line(text(frame).as_bytes()).is_some());
        assert!(decoder.line(text(frame).replace("can0", "can1").as_bytes()).is_some());
    }

    #[test]
    fn a_block_that_starts_anew_repeats_nothing() {
        let health = |boot_count| Health {
            reset_cause: ResetCause::Watchdog,
            board: BoardKind::Stm32f405,
            boot_count,
            frames_dropped: 0,
            operational: true,
        };
        let mut decoder = Decoder::new(None);
        for boot in 1..=2 {
            let mut block = publisher();
            assert!(decoder.line(text(block.heartbeat(&health(boot))).as_bytes()).is_some(), "boot {boot}");
            assert!(decoder.line(text(block.estimate(&stale(1))).as_bytes()).is_some(), "boot {boot}");
        }
        assert_eq!(decoder.tally().missing, 0);
    }

    #[test]
    fn readings_are_joined_by_their_counters() {
        let mut block = publisher();
        let mut joiner = Joiner::default();
        let mut take = |frame: RawFrame| {
            let (node, message) = can_wire::decode(frame.id, &frame.data).expect("sound");
            joiner.take(&Decoded { time: None, node, message })
        };
        assert!(take(block.estimate(&stale(1))).is_none());
        assert!(take(block.motion(&stale(1))).expect("complete").motion.is_some());
        assert!(take(block.estimate(&stale(2))).is_none());
        let _lost = block.motion(&stale(2));
        let late = take(block.estimate(&stale(3))).expect("given up");
        assert_eq!((late.estimate.counter, late.motion), (1, None));
        let _ = block.motion(&stale(3));
        assert_eq!(take(block.motion(&stale(4))).expect("not its own").motion, None);
        assert!(take(block.motion(&stale(5))).is_none());
    }
}
