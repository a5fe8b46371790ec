//! Bursts over a bus that loses frames and goes off: what arrives is what was sampled, byte for byte.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use can_wire::burst::{Cause, FRAME_BITS, FdFrame, Header, Order, Receiver, Record, Sender, State, Trailer};
use can_wire::{NodeId, RawFrame};
use model_core::sample::RawBlock;

const NODE: NodeId = NodeId::new(5).unwrap();

/// Ring of the firmware.
const RING: usize = 512;

/// Frames a millisecond at the default load, a fifth of 500 kbit/s, in thousandths.
const FRAMES_A_S: u32 = 500_000 / 5 / FRAME_BITS;

/// Numbers from a fixed seed: xorshift64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % n
    }
}

/// An axis under way: 0.1 m/s with 1 µm a count, noise of a few codes.
fn sampled(tick: u32, random: &mut Random) -> RawBlock {
    RawBlock {
        tick,
        force: std::array::from_fn(|_| 2100 + random.below(7) as u16),
        temperature: std::array::from_fn(|_| 1850 + random.below(2) as u16),
        position: std::array::from_fn(|n| (f64::from(tick * 16 + n as u32) * 62.5) as u64 as u16),
    }
}

/// A bus between a block and a desk, a millisecond at a time.
struct Link {
    random: Random,
    sender: Sender<RING>,
    receiver: Receiver,
    /// per thousand, either way
    loss: u64,
    off_until_ms: u32,
    bus_offs: u32,
    /// one bus-off every so many ms; 0: none
    off_every_ms: u32,
    now_ms: u32,
    /// thousandths of a frame that the load limit allows
    allowed: u32,
    waiting: Option<RawFrame>,
    last_asked_ms: u32,
    sampled: Vec<RawBlock>,
    records: Vec<Record>,
    frames: u32,
    asks: bool,
}

impl Link {
    fn new(seed: u64, loss: u64, off_every_ms: u32) -> Self {
        Link {
            random: Random(seed),
            sender: Sender::new(NODE, 0),
            receiver: Receiver::new(NODE),
            loss,
            off_until_ms: 0,
            bus_offs: 0,
            off_every_ms,
            now_ms: 0,
            allowed: 0,
            waiting: None,
            last_asked_ms: 0,
            sampled: Vec::new(),
            records: Vec::new(),
            frames: 0,
            asks: true,
        }
    }

    fn lost(&mut self) -> bool {
        self.random.below(1000) < self.loss
    }

    fn step(&mut self) {
        self.now_ms += 1;
        if self.now_ms.is_multiple_of(10) {
            let block = sampled(self.now_ms / 10, &mut self.random);
            self.sender.append(&block);
            self.sampled.push(block);
        }
        if self.off_every_ms > 0 && self.now_ms.is_multiple_of(self.off_every_ms) {
            // 128 times 11 bits are 2.8 ms; whatever caused it may last longer
            self.off_until_ms = self.now_ms + 3 + self.random.below(12) as u32;
            self.bus_offs += 1;
        }
        self.allowed = (self.allowed + FRAMES_A_S).min(2000);
        while self.now_ms >= self.off_until_ms && self.allowed >= 1000 {
            self.waiting = self.waiting.take().or_else(|| self.sender.next(self.now_ms));
            let Some(frame) = self.waiting.take() else { break };
            self.allowed -= 1000;
            self.frames += 1;
            if !self.lost() {
                self.receiver.take(&frame).unwrap();
            }
            while let Some(record) = self.receiver.next_record() {
                self.records.push(record);
            }
        }
        let silent = self.receiver.is_under_way() && self.now_ms - self.last_asked_ms >= 20;
        if self.asks && self.now_ms >= self.off_until_ms && (self.receiver.ask_due() || silent) {
            self.last_asked_ms = self.now_ms;
            if let Some(asking) = self.receiver.ask()
                && !self.lost()
            {
                let _ = self.sender.asked(&asking, self.now_ms);
            }
        }
    }

    fn run_until_idle(&mut self, at_most_ms: u32) {
        let end = self.now_ms + at_most_ms;
        while self.sender.state() != State::Idle && self.now_ms < end {
            self.step();
        }
        assert_eq!(self.sender.state(), State::Idle, "after {} ms", self.now_ms);
    }

    fn burst(&mut self, order: Order) -> (Header, Vec<RawBlock>, Trailer) {
        self.records.clear();
        assert!(self.sender.start(order, Cause::Command, 0xABCD, self.now_ms));
        let expected = 15 * u32::from(order.blocks);
        self.run_until_idle(200_000 + 10 * expected);
        let blocks = self.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None });
        let (Some(Record::Header(header)), Some(Record::Trailer(trailer))) =
            (self.records.first(), self.records.last())
        else {
            panic!("{:?}", self.records)
        };
        (*header, blocks.collect(), *trailer)
    }

    /// The blocks with the ticks of these.
    fn truth(&self, got: &[RawBlock]) -> Vec<RawBlock> {
        got.iter().map(|b| *self.sampled.iter().find(|s| s.tick == b.tick).unwrap()).collect()
    }
}

fn order(blocks: u16, past: u16) -> Order {
    Order { blocks, past, asked: true }
}

#[test]
fn a_quiet_bus_gives_what_was_sampled_before_and_after() {
    let mut link = Link::new(1, 0, 0);
    (0..2000).for_each(|_| link.step());
    let (header, blocks, trailer) = link.burst(order(150, 60));
    assert_eq!((header.blocks, header.past, header.image, header.cause), (150, 60, 0xABCD, Cause::Command));
    assert_eq!(blocks, link.truth(&blocks));
    let ticks: Vec<u32> = blocks.iter().map(|b| b.tick).collect();
    assert_eq!(ticks, (141..291).collect::<Vec<_>>());
    assert_eq!((trailer.blocks, trailer.dropped), (150, 0));
    assert!(link.receiver.is_intact() && link.receiver.lost() == 0);
    // a second burst follows the first one
    let (header, blocks, _) = link.burst(order(20, 0));
    assert_eq!((header.number, blocks.len()), (2, 20));
    assert!(link.receiver.is_intact());
}

#[test]
fn five_per_cent_loss_and_a_thousand_bus_offs_lose_nothing() {
    // a bus-off every 60 ms, 3 to 14 ms long, for a minute
    let mut link = Link::new(2, 50, 60);
    (0..700).for_each(|_| link.step());
    const BLOCKS: u16 = 6200;
    let (_, got, trailer) = link.burst(order(BLOCKS, 40));
    assert_eq!(got, link.truth(&got));
    assert!(link.receiver.is_intact(), "{trailer:?}");
    assert_eq!((got.len(), trailer.dropped), (BLOCKS.into(), 0));
    assert!(got.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1));
    println!("{} blocks, {} frames, {} bus-offs, {} ms", got.len(), link.frames, link.bus_offs, link.now_ms);
    assert!(link.bus_offs >= 1000, "{}", link.bus_offs);
}

#[test]
fn what_fits_the_ring_survives_any_outage() {
    for seed in 1..40 {
        let mut link = Link::new(seed, 50, 0);
        (0..900).for_each(|_| link.step());
        assert!(link.sender.start(order(85, 40), Cause::Notice, 0, link.now_ms));
        // nothing gets through for ten seconds
        link.off_until_ms = link.now_ms + 10_000;
        link.run_until_idle(60_000);
        let blocks: Vec<RawBlock> =
            link.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect();
        assert_eq!((blocks.len(), &blocks), (85, &link.truth(&blocks)), "{seed}");
        assert!(link.receiver.is_intact() && link.sender.dropped() == 0, "{seed}");
    }
}

#[test]
fn a_burst_that_outruns_the_bus_says_what_it_left_out() {
    let mut link = Link::new(3, 0, 0);
    assert!(link.sender.start(order(300, 0), Cause::Command, 0, 0));
    link.off_until_ms = 4000;
    link.run_until_idle(60_000);
    let blocks: Vec<RawBlock> =
        link.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect();
    let Some(Record::Trailer(trailer)) = link.records.last() else { panic!() };
    assert_eq!((blocks.len(), trailer.blocks), (300, 300));
    assert!(trailer.dropped > 200, "{trailer:?}");
    assert_eq!(u32::from(trailer.dropped), link.sender.dropped());
    let gaps: u32 = blocks.windows(2).map(|pair| pair[1].tick - pair[0].tick - 1).sum();
    assert_eq!((gaps, blocks.clone()), (trailer.dropped.into(), link.truth(&blocks)));
}

#[test]
fn whoever_only_listens_loses_what_is_lost_and_nothing_else() {
    let mut link = Link::new(4, 10, 0);
    link.asks = false;
    assert!(link.sender.start(Order { blocks: 400, past: 0, asked: false }, Cause::Command, 0, 0));
    link.run_until_idle(60_000);
    link.receiver.give_up();
    while let Some(record) = link.receiver.next_record() {
        link.records.push(record);
    }
    let blocks: Vec<RawBlock> =
        link.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect();
    assert_eq!(blocks, link.truth(&blocks));
    assert!(blocks.len() < 400 && blocks.len() > 360, "{}", blocks.len());
    assert!(link.receiver.lost() > 0 && !link.receiver.is_intact());
}

#[test]
fn what_came_of_a_burst_is_read_before_the_next_one() {
    // the end of the first burst never comes
    let mut link = Link::new(8, 0, 0);
    assert!(link.sender.start(order(40, 0), Cause::Command, 0, 0));
    let mut frames = Vec::new();
    for now_ms in 1..3000 {
        if now_ms % 10 == 0 {
            let block = sampled(now_ms / 10, &mut link.random);
            link.sender.append(&block);
            link.sampled.push(block);
        }
        if link.sender.state() == State::Idle {
            link.sender.start(order(40, 0), Cause::Command, 0, now_ms);
        }
        while let Some(frame) = link.sender.next(now_ms) {
            frames.push(frame);
            link.receiver.take(&frame).unwrap();
            while link.receiver.next_record().is_some() {}
        }
        if let Some(asking) = link.receiver.ask() {
            let _ = link.sender.asked(&asking, now_ms);
        }
    }
    let header = |f: &RawFrame| f.data[6] == 0x80 && f.data[0] == 5;
    let second = frames.iter().skip(1).position(header).unwrap() + 1;
    // holes in the last window of the first burst
    let holes = [second - 1, second - 9, second - 20];
    let (mut listener, mut records) = (Receiver::new(NODE), Vec::new());
    for (_, frame) in frames.iter().enumerate().filter(|(n, _)| !holes.contains(n)) {
        listener.take(frame).unwrap();
        while let Some(record) = listener.next_record() {
            records.push(record);
        }
    }
    let second = records.iter().skip(1).position(|r| matches!(r, Record::Header(_))).unwrap() + 1;
    let first: Vec<RawBlock> =
        records[..second].iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect();
    assert_eq!(first, link.truth(&first));
    // that the very last segment is missing shows in the trailer that is not there, and nowhere else
    assert_eq!((first.len(), listener.lost()), (38, 2));
    assert!(matches!(records[second + 40], Record::Block(_)) && matches!(records[second + 41], Record::Trailer(_)));
}

#[test]
fn a_burst_that_nobody_takes_is_given_up_and_the_ring_goes_on() {
    let mut link = Link::new(5, 0, 0);
    link.asks = false;
    assert!(link.sender.start(order(100, 0), Cause::Command, 0, 0));
    link.run_until_idle(60_000);
    assert!((30_000..40_000).contains(&link.now_ms), "{}", link.now_ms);
    link.asks = true;
    (0..500).for_each(|_| link.step());
    let (_, blocks, _) = link.burst(order(60, 30));
    assert_eq!(blocks.len(), 60);
    assert!(link.receiver.is_intact());
}

#[test]
fn an_end_ends_it_and_frames_of_others_change_nothing() {
    let mut link = Link::new(6, 50, 0);
    assert!(link.sender.start(order(60_000, 0), Cause::Command, 0, 0));
    assert!(!link.sender.start(order(1, 0), Cause::Command, 0, 0), "one at a time");
    (0..1000).for_each(|_| link.step());
    let other = NodeId::new(6).unwrap();
    let mut stranger = Receiver::new(other);
    for id in [0x505, 0x506, 0x485, 0x123] {
        for byte in 0..=255 {
            let _ = link.sender.asked(&RawFrame { id, data: [byte; 8] }, link.now_ms);
            let _ = link.receiver.take(&RawFrame { id, data: [byte; 8] });
        }
    }
    assert!(stranger.take(&link.sender.next(link.now_ms).unwrap()).is_err());
    link.sender.end();
    link.run_until_idle(10_000);
    let Some(Record::Trailer(trailer)) = link.records.last() else { panic!("no trailer") };
    assert!((95..=100).contains(&trailer.blocks) && link.receiver.is_intact(), "{trailer:?}");
}

#[test]
fn can_fd_carries_the_same_burst_in_a_tenth_of_the_frames() {
    let (mut sender, mut receiver, mut random) = (Sender::<RING>::new(NODE, 0), Receiver::new(NODE), Random(7));
    let truth: Vec<RawBlock> = (0..80).map(|tick| sampled(tick, &mut random)).collect();
    truth.iter().for_each(|block| sender.append(block));
    assert!(sender.start(order(80, 80), Cause::Command, 0, 0));
    let (mut got, mut frames) = (Vec::new(), 0);
    for now_ms in 0..10_000 {
        if let Some(frame) = sender.next_fd(now_ms) {
            frames += 1;
            if random.below(20) > 0 {
                let copy = FdFrame { id: frame.id, data: frame.data };
                receiver.take_fd(&copy).unwrap();
            }
        }
        while let Some(record) = receiver.next_record() {
            got.extend(if let Record::Block(block) = record { Some(block) } else { None });
        }
        if (now_ms % 5 == 0 || receiver.ask_due())
            && let Some(asking) = receiver.ask()
        {
            let _ = sender.asked(&asking, now_ms);
        }
    }
    assert_eq!(got, truth);
    assert!(receiver.is_intact() && sender.state() == State::Idle);
    println!("{frames} FD frames for {} blocks", got.len());
    assert!(frames < 80, "{frames}");
}
