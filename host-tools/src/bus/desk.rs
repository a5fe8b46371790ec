//! A block in memory, as if it lay on a desk: the firmware's object server and burst, fed with made-up samples, on a
//! bus that can lose frames. Its time passes only while a client waits.

use std::collections::VecDeque;
use std::time::Duration;

use can_wire::burst::{Cause, FRAME_BITS, Sender, State};
use can_wire::service::server::{DELIVERED_KEY, Server};
use can_wire::service::{Action, BlockState, Settings, UploadState};
use can_wire::{BoardKind, NodeId, RawFrame, ResetCause};
use model_core::sample::{RawBlock, SAMPLES_PER_BLOCK};

use super::{Bus, BusError, Event, Heard};
use crate::candump::Micros;

/// Segments of its ring: as many as the firmware's.
const RING: usize = 512;

/// Length of a block of samples, ms.
const BLOCK_MS: u64 = 10;

/// What kind of block and bus it is.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// Its node.
    pub node: NodeId,
    /// Frames lost, per thousand, both ways.
    pub loss: u64,
    /// Whether the carriage goes to and fro.
    pub moves: bool,
    /// Whether images are kept; otherwise it has no store.
    pub keeps: bool,
}

impl Default for Setup {
    /// Node 1 at rest, nothing lost, with a store.
    fn default() -> Self {
        Setup { node: NodeId::FIRST, loss: 0, moves: false, keeps: true }
    }
}

/// The block and the bus to it.
#[derive(Debug)]
pub struct Desk {
    setup: Setup,
    server: Server,
    sender: Sender<RING>,
    now_ms: u64,
    /// frames that the load limit allows, in thousandths
    allowed: u64,
    inbox: VecDeque<RawFrame>,
    random: u64,
    saved_at_ms: Option<u64>,
    zero_at_ms: Option<u64>,
    restarts: u16,
    /// Hash of the image in use.
    active_image: u32,
    next_image: Option<u32>,
    /// What it sampled, for comparison.
    pub sampled: Vec<RawBlock>,
}

impl Desk {
    /// A block that has been running for a second.
    pub fn new(setup: Setup) -> Self {
        let mut desk = Desk {
            setup,
            server: Server::new(setup.node, DELIVERED_KEY, Settings::DELIVERED),
            sender: Sender::new(setup.node, 0),
            now_ms: 0,
            allowed: 0,
            inbox: VecDeque::new(),
            random: 0x9E37_79B9_7F4A_7C15,
            saved_at_ms: None,
            zero_at_ms: None,
            restarts: 0,
            active_image: 0,
            next_image: None,
            sampled: Vec::new(),
        };
        (0..1000).for_each(|_| desk.millisecond());
        desk
    }

    fn random(&mut self, below: u64) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) % below
    }

    fn is_lost(&mut self) -> bool {
        self.setup.loss > 0 && self.random(1000) < self.setup.loss
    }

    /// Samples of a block: to and fro between 0 and 50 mm at 50 mm/s, or at rest; with some codes of noise.
    fn block(&mut self, tick: u32) -> RawBlock {
        const N: usize = SAMPLES_PER_BLOCK;
        let moves = self.setup.moves;
        let place = |n: usize| {
            let turn = f64::from(tick * N as u32 + n as u32) / 1600.0 % 2.0;
            (if turn < 1.0 { turn } else { 2.0 - turn }) * 10_000.0
        };
        let forwards = tick % 200 < 100;
        let force = match (moves, forwards) {
            (false, _) => 2060,
            (true, true) => 2458,
            (true, false) => 1638,
        };
        RawBlock {
            tick,
            force: std::array::from_fn(|_| force + self.random(5) as u16 - 2),
            temperature: std::array::from_fn(|_| 2048 + self.random(2) as u16),
            position: std::array::from_fn(|n| if moves { place(n) as u16 } else { 0 }),
        }
    }

    fn state(&self) -> BlockState {
        BlockState {
            moving: self.setup.moves,
            uptime_s: u32::try_from(self.now_ms / 1000).unwrap_or(u32::MAX),
            error_register: 0x81,
            board: BoardKind::Unknown,
            unique: [0x6B73_6564, 0, 1],
            version: [0, 1, 0],
            reset_cause: ResetCause::PowerOn,
            boot_count: 1 + self.restarts,
            lost_blocks: 0,
            frames_dropped: 0,
            bus_offs: 0,
            active_image: self.active_image,
            image_publish_every_blocks: 10,
            burst_state: self.sender.state() as u8,
            burst_dropped: self.sender.dropped(),
        }
    }

    fn millisecond(&mut self) {
        self.now_ms += 1;
        if self.now_ms.is_multiple_of(BLOCK_MS) {
            let tick = u32::try_from(self.now_ms / BLOCK_MS).unwrap_or(u32::MAX);
            let block = self.block(tick);
            self.sender.append(&block);
            self.sampled.push(block);
        }
        if self.saved_at_ms.is_some_and(|at| self.now_ms >= at) {
            self.saved_at_ms = None;
            if self.setup.keeps {
                self.next_image = Some(can_wire::crc32(self.server.image()));
            }
            self.server.saved(if self.setup.keeps { UploadState::Saved } else { UploadState::Failed });
        }
        if self.zero_at_ms.is_some_and(|at| self.now_ms >= at) {
            self.zero_at_ms = None;
            let above = 16 * (2060 - 2048) - self.server.settings().zero_shift_sixteenths;
            let _ = self.server.zeroed(Some(above));
        }
        let share = u64::from(self.server.settings().burst_load_percent);
        self.allowed = (self.allowed + 500_000 * share / 100 / u64::from(FRAME_BITS)).min(3000);
        while self.allowed >= 1000 && self.sender.state() != State::Idle {
            let Some(frame) = self.sender.next(self.milliseconds()) else { break };
            self.allowed -= 1000;
            if !self.is_lost() {
                self.inbox.push_back(frame);
            }
        }
    }

    /// Wraps, as the firmware's does.
    fn milliseconds(&self) -> u32 {
        self.now_ms as u32
    }

    fn carry_out(&mut self, action: Action) {
        match action {
            Action::Apply(_) | Action::ClearCounters => {}
            Action::Keep(_) => self.server.kept(self.setup.keeps),
            Action::TakeZero => self.zero_at_ms = Some(self.now_ms + 1000),
            Action::SaveImage => self.saved_at_ms = Some(self.now_ms + 300),
            Action::Burst(order) => {
                let now_ms = self.milliseconds();
                let _ = self.sender.start(order, Cause::Command, self.active_image, now_ms);
            }
            Action::EndBurst => self.sender.end(),
            Action::Restart => {
                self.restarts += 1;
                self.active_image = self.next_image.unwrap_or(self.active_image);
                self.server = Server::new(self.setup.node, DELIVERED_KEY, Settings::DELIVERED);
            }
        }
    }
}

impl Bus for Desk {
    fn send(&mut self, frame: &RawFrame) -> Result<(), BusError> {
        if self.is_lost() {
            return Ok(());
        }
        let now_ms = self.milliseconds();
        let _ = self.sender.asked(frame, now_ms);
        let block = self.state();
        let answer = self.server.handle(frame, &block);
        if let Some(answer) = answer.frame
            && !self.is_lost()
        {
            self.inbox.push_back(answer);
        }
        if let Some(action) = answer.action {
            self.carry_out(action);
        }
        Ok(())
    }

    fn receive(&mut self, wait: Duration) -> Result<Event, BusError> {
        let end_ms = self.now_ms + wait.as_millis() as u64;
        loop {
            if let Some(frame) = self.inbox.pop_front() {
                return Ok(Event::Frame(Heard { time: Some(Micros(self.now_ms * 1000)), frame }));
            }
            if self.now_ms >= end_ms {
                return Ok(Event::Silence);
            }
            self.millisecond();
        }
    }

    fn now(&self) -> Duration {
        Duration::from_millis(self.now_ms)
    }
}
