//! A desk talks to the real image: it reads, writes and takes bursts, over a bus that goes off in between.

use std::time::Duration;

use can_wire::NodeId;
use can_wire::burst::{Order, Record};
use can_wire::parameters::ADDRESS;
use can_wire::service::server::DELIVERED_KEY;
use can_wire::service::{Abort, Field, objects};
use host_tools::block::{Client, ClientError, Outcome};
use host_tools::bus::emulated::{Emulated, link};
use host_tools::bus::{Bus, Event};
use host_tools::emulated::blocks;
use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use model_core::sample::RawBlock;
use system_tests::image::{BENCH, CHIPS, firmware, record};
use virtual_board::{Bench, Chip, Nanos, Outcome as Run, Pins, VirtualBoard};

const SECOND: Nanos = 1_000_000_000;

/// A carriage that rolls during one interval and rests otherwise; and a bus that is disturbed periodically.
struct Axis {
    front: FrontEnd,
    rolls: std::ops::Range<Nanos>,
    /// period of the disturbances, which last 12 ms, ns; 0: none
    disturbed_every: Nanos,
}

impl Axis {
    fn new(rolls: std::ops::Range<Nanos>, disturbed_every: Nanos) -> Self {
        Axis { front: FrontEnd::new(BENCH.calibration, ChannelNoise::BENCH, 3), rolls, disturbed_every }
    }
}

impl Bench for Axis {
    fn step(&mut self, now: Nanos, pins: &mut Pins<'_>) -> Option<Nanos> {
        let next = now + 625_000;
        let rolling = self.rolls.contains(&now);
        let travelled_m = |at: Nanos| 0.05e-9 * (at.clamp(self.rolls.start, self.rolls.end) - self.rolls.start) as f64;
        pins.force_code(self.front.force_code(if rolling { 20.0 } else { 2.0 }));
        pins.temperature_code(self.front.temperature_code(Some(30.0)));
        pins.move_encoder_to(self.front.encoder_count(travelled_m(next)), next);
        if self.disturbed_every > 0 {
            pins.disturb_bus(now % self.disturbed_every < 12_000_000);
        }
        // no run needs more; this ends the run of a desk that waits for ever
        (now < 60 * SECOND).then_some(next)
    }
}

/// Runs a board with this desk at its bus.
fn with_desk<T: Send>(chip: Chip, axis: Axis, desk: impl FnOnce(&mut Emulated) -> T + Send) -> (T, Run) {
    let (mut bus, linked) = link(axis);
    std::thread::scope(|scope| {
        let talking = scope.spawn(move || {
            let result = desk(&mut bus);
            drop(bus);
            result
        });
        let (elf, record) = (firmware(chip), record(BENCH));
        let (run, _) = VirtualBoard::new(chip, &elf).with_flash(ADDRESS, &record).run(linked).expect("the image runs");
        (talking.join().expect("the desk's side holds"), run)
    })
}

fn pass(bus: &mut Emulated, time: Duration) {
    let end = bus.now() + time;
    while bus.now() < end {
        assert_ne!(bus.receive(end.saturating_sub(bus.now())).expect("a bus"), Event::End);
    }
}

fn refused(result: Result<(), ClientError>) -> Abort {
    match result {
        Err(ClientError::Refused { why, .. }) => why,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_image_tells_who_it_is_and_takes_changes_at_rest_only() {
    for chip in CHIPS {
        // rolls from 4 s to 5 s
        let axis = Axis::new(4 * SECOND..5 * SECOND, 0);
        let ((), run) = with_desk(chip, axis, |bus| {
            pass(bus, Duration::from_millis(1000));
            let stranger = Client::new(bus, NodeId::LAST).identify();
            assert!(matches!(stranger, Err(ClientError::Silent { node: 127 })), "{stranger:?}");
            let mut client = Client::new(bus, NodeId::FIRST);
            let identity = client.identify().expect("answers");
            let board = if chip == Chip::Stm32f405 { "stm32f405" } else { "stm32g474" };
            assert_eq!((identity.board, identity.version, identity.reset_cause), (board, [0, 1, 0], "power-on"));
            assert_eq!(refused(client.write(Field::WarnBelow, 2000)), Abort::Locked);
            client.unlock(DELIVERED_KEY).expect("the key");
            client.write(Field::WarnBelow, 2000).expect("at rest");
            client.write(Field::PublishingPeriod, 50).expect("at rest");
            let left = Duration::from_millis(4500).saturating_sub(bus.now());
            pass(bus, left);
            let mut client = Client::new(bus, NodeId::FIRST);
            assert_eq!(refused(client.write(Field::WarnBelow, 1000)), Abort::State);
            assert_eq!(refused(client.write(Field::TakeZero, objects::TAKE_ZERO)), Abort::State);
            pass(bus, Duration::from_millis(1500));
            let mut client = Client::new(bus, NodeId::FIRST);
            // 2 N at rest; the bench's zero is code 2048
            let shift = client.take_zero().expect("at rest");
            let expected = 2.0 / f64::from(BENCH.calibration.force.newtons_per_code);
            assert!((shift - expected).abs() < 0.2, "{shift} codes instead of {expected}");
            assert_eq!(client.read(Field::Changes).expect("answers"), 3);
            let error = client.load_image(&[1, 2, 3], |_, _| {}).expect_err("no image");
            assert!(matches!(error, ClientError::NotKept { .. }), "{error}");
            // the emulated F405 drops writes to its flash, and the block reports that the save failed
            let keeps = chip == Chip::Stm32g474;
            let saved = client.save();
            assert!(if keeps { saved.is_ok() } else { matches!(saved, Err(ClientError::NotSaved(1))) }, "{saved:?}");
            client.write(Field::Restart, objects::RESTART).expect("at rest");
            pass(bus, Duration::from_millis(800));
            let again = Client::new(bus, NodeId::FIRST).identify().expect("answers");
            assert_eq!((again.starts, again.reset_cause, again.changes), (2, "software", 0));
            let mut client = Client::new(bus, NodeId::FIRST);
            assert_eq!(client.read(Field::WarnBelow).expect("answers"), if keeps { 2000 } else { 0xFFFF });
            assert_eq!(client.read(Field::PublishingPeriod).expect("answers"), if keeps { 50 } else { 100 });
            let zero = client.read(Field::ZeroShift).expect("answers");
            assert_eq!(zero != 0, keeps, "{zero}");
        });
        assert_eq!(run.resets.len(), 1, "{chip:?}: {:?}", run.resets);
        // the period between two estimates is halved from the write on
        let estimates: Vec<Nanos> = run.frames.iter().filter(|f| f.id == 0x181).map(|f| f.at).collect();
        let period = |at: Nanos| {
            let n = estimates.iter().position(|t| *t > at).expect("estimates go on");
            (estimates[n + 1] - estimates[n]) / 1_000_000
        };
        assert_eq!((period(SECOND).next_multiple_of(10), period(7 * SECOND / 2).next_multiple_of(10)), (100, 50));
    }
}

#[test]
fn a_burst_over_a_bus_that_goes_off_is_what_was_sampled() {
    for chip in CHIPS {
        // three times a second, for 12 ms, all frames of the block meet bit errors
        let axis = Axis::new(0..60 * SECOND, SECOND / 3);
        let ((got, outcome, bus_offs), run) = with_desk(chip, axis, |bus| {
            pass(bus, Duration::from_millis(1500));
            let mut client = Client::new(bus, NodeId::FIRST);
            let mut got: Vec<RawBlock> = Vec::new();
            let order = Order { blocks: 300, past: 60, asked: true };
            let outcome = client.burst(order, &mut |record| {
                if let Record::Block(block) = record {
                    got.push(*block);
                }
            });
            (got, outcome.expect("comes"), client.read(Field::BusOffs).expect("answers"))
        });
        assert_eq!(outcome, Outcome { intact: true, blocks: 300, dropped: 0, lost: 0 }, "{chip:?}");
        let sampled = blocks(&run.samples);
        let from = sampled.iter().position(|b| b.tick == got[0].tick).expect("sampled");
        assert_eq!(got, sampled[from..from + 300], "{chip:?}");
        assert!(run.resets.is_empty(), "{chip:?}: {:?}", run.resets);
        println!("{chip:?}: {bus_offs} bus-offs counted by the block");
        assert!(bus_offs >= 3, "{chip:?}: {bus_offs} bus-offs");
        // at most its share of the bus, a fifth, plus the frames by which it may lag
        let burst: Vec<Nanos> = run.frames.iter().filter(|f| f.id == 0x481).map(|f| f.at).collect();
        for (n, from) in burst.iter().enumerate() {
            let within = burst[n..].iter().take_while(|at| *at - from < SECOND / 4).count();
            assert!(within <= 192, "{chip:?}: {within} frames in a quarter of a second");
        }
    }
}
