//! The bus of an emulated board, as a desk sees it: waiting on it lets the board's time pass.
//!
//! Board and desk run in two threads, in turns: the same commands give the same run.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

use can_wire::RawFrame;
use virtual_board::{Bench, Nanos, Pins, SentFrame};

use super::{Bus, BusError, Event, Heard};
use crate::candump::Micros;

/// Time between two exchanges with the board, ns.
const LOOK: Nanos = 500_000;

/// What the board sends at each exchange.
struct Look {
    now: Nanos,
    frames: Vec<SentFrame>,
}

/// The desk's end.
#[derive(Debug)]
pub struct Emulated {
    looks: Receiver<Look>,
    frames: SyncSender<Vec<RawFrame>>,
    outbox: Vec<RawFrame>,
    inbox: VecDeque<Heard>,
    now: Nanos,
    /// whether the board waits for the desk's frames
    turn: bool,
}

/// The board's end: a world for its other pins, and the bus. Ends when the desk's end is dropped.
#[derive(Debug)]
pub struct Linked<W> {
    world: W,
    looks: SyncSender<Look>,
    frames: Receiver<Vec<RawFrame>>,
}

/// A bus between a desk and a board in this world. The world must leave the frames to the desk.
pub fn link<W: Bench>(world: W) -> (Emulated, Linked<W>) {
    let (look_sender, looks) = sync_channel(0);
    let (frames, frame_receiver) = sync_channel(0);
    let desk = Emulated { looks, frames, outbox: Vec::new(), inbox: VecDeque::new(), now: 0, turn: false };
    (desk, Linked { world, looks: look_sender, frames: frame_receiver })
}

impl<W: Bench> Bench for Linked<W> {
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
        let next = self.world.step(now, pins)?;
        self.looks.send(Look { now, frames: pins.take_frames() }).ok()?;
        for frame in self.frames.recv().ok()? {
            pins.receive(frame.id, &frame.data);
        }
        Some(next.min(now + LOOK))
    }
}

impl Bus for Emulated {
    fn send(&mut self, frame: &RawFrame) -> Result<(), BusError> {
        self.outbox.push(*frame);
        Ok(())
    }

    fn receive(&mut self, wait: Duration) -> Result<Event, BusError> {
        let end = self.now + u64::try_from(wait.as_nanos()).unwrap_or(Nanos::MAX / 2);
        loop {
            if let Some(heard) = self.inbox.pop_front() {
                return Ok(Event::Frame(heard));
            }
            if self.turn && self.now >= end {
                return Ok(Event::Silence);
            }
            if self.turn && self.frames.send(std::mem::take(&mut self.outbox)).is_err() {
                return Ok(Event::End);
            }
            let Ok(look) = self.looks.recv() else { return Ok(Event::End) };
            (self.now, self.turn) = (look.now, true);
            let heard = look.frames.iter().filter_map(|f| {
                let data = f.data().try_into().ok()?;
                Some(Heard { time: Some(Micros(f.at / 1000)), frame: RawFrame { id: f.id, data } })
            });
            self.inbox.extend(heard);
        }
    }

    fn now(&self) -> Duration {
        Duration::from_nanos(self.now)
    }
}
