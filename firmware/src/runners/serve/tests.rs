use can_wire::burst::{Receiver, Record};
use can_wire::service::server::DELIVERED_KEY;
use can_wire::service::{Abort, Field, OBJECTS, Object, UploadState, client, client::Reply};
use can_wire::{Beside, Health, NodeId, Publisher, crc32};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::channel::Channel;
use model_core::left_out::Acting;
use model_core::sample::SAMPLES_PER_BLOCK;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::*;
use crate::ports::FrameSink;
use crate::runners::estimate::Report;
use crate::runners::publish::Publish;
use crate::runners::rehearsal::{Controller, Desk, Inbox};
use crate::timeline::BLOCK_US;

const NODE: NodeId = NodeId::FIRST;

type Saved = Rc<RefCell<Vec<(Kept, Vec<u8>)>>>;

/// A store that takes as long as flash does.
struct Flash<'a>(&'a Desk, Saved, Result<(), KeepError>);
impl Keep for Flash<'_> {
    async fn save(&mut self, what: Kept, bytes: &[u8]) -> Result<(), KeepError> {
        self.0.sleep_until(self.0.now_us() + 700_000).await;
        self.1.borrow_mut().push((what, bytes.to_vec()));
        self.2
    }
}

struct Button(Rc<Cell<u32>>);
impl Restart for Button {
    fn restart(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

/// What a client received, and what became of its requests.
#[derive(Default)]
struct Seen {
    replies: Vec<Reply>,
    records: Vec<Record>,
    sampled: Vec<RawBlock>,
    kept: Saved,
    restarts: Rc<Cell<u32>>,
    settings: Vec<Settings>,
    facts: Facts,
    burst_frames: Vec<u64>,
    silent_us: u64,
    bus_offs: u32,
}

fn object(field: Field) -> &'static Object {
    OBJECTS.iter().find(|o| o.field == field).unwrap()
}

fn write(field: Field, value: u32) -> (&'static Object, RawFrame) {
    (object(field), client::write(NODE, object(field), value))
}

fn read(field: Field) -> (&'static Object, RawFrame) {
    (object(field), client::read(NODE, object(field)))
}

/// Samples at rest until `moves_at_ms`, then in motion.
fn block(tick: u32, moves_at_ms: u32) -> RawBlock {
    const N: usize = SAMPLES_PER_BLOCK;
    let travelled = (tick * 10).saturating_sub(moves_at_ms) as u16;
    RawBlock {
        tick,
        force: std::array::from_fn(|n| 2060 + (tick as u16).wrapping_mul(7).wrapping_add(n as u16 * 5) % 4),
        temperature: [1850; N],
        position: std::array::from_fn(|n| travelled.wrapping_mul(50).wrapping_add(n as u16 * u16::from(travelled > 0))),
    }
}

/// Runs a block and a client that sends the requests of `script` one by one, each when the previous one was answered,
/// and asks for missing segments of a burst. Every eleventh frame of a burst is lost; the bus is off when `off` says
/// so.
fn converse(
    script: &[(u64, (&'static Object, RawFrame))],
    for_us: u64,
    moves_at_ms: u32,
    flash: Result<(), KeepError>,
    off: impl Fn(u64) -> bool,
) -> Seen {
    let mut seen = Seen::default();
    let (desk, bus, inbox, liveness) = (Desk::new(), Controller::new(), Inbox::default(), Liveness::new());
    let (reports, tuning, notices) = (Signal::<NoopRawMutex, Report>::new(), Signal::new(), Signal::new());
    let (copies, outgoing) = (Channel::new(), Channel::new());
    let facts = Facts::new();
    let mut server = Server::new(NODE, DELIVERED_KEY, Settings::DELIVERED);
    let mut sender = Sender::new(NODE, 0);
    let identity = Identity {
        board: BoardKind::Stm32g474,
        unique: [1, 2, 3],
        version: [0, 1, 0],
        reset_cause: ResetCause::PowerOn,
        boot_count: 1,
        active_image: 0xABCD,
        publish_every_blocks: 10,
        zero_code: 2048.0,
    };
    let serve = Serve {
        source: &inbox,
        keep: Flash(&desk, Rc::clone(&seen.kept), flash),
        restart: Button(Rc::clone(&seen.restarts)),
        server: &mut server,
        sender: &mut sender,
        blocks: copies.receiver(),
        notices: &notices,
        outgoing: outgoing.sender(),
        tuning: &tuning,
        facts: &facts,
        identity,
        clock: &desk,
        liveness: &liveness,
    };
    let health = Health {
        reset_cause: ResetCause::PowerOn,
        board: BoardKind::Stm32g474,
        boot_count: 1,
        frames_dropped: 0,
        operational: false,
    };
    let publish = Publish {
        sink: &bus,
        publisher: Publisher::new(NODE),
        reports: &reports,
        outgoing: outgoing.receiver(),
        facts: &facts,
        health,
        image: 0,
        beside: Beside { acting: Acting::NONE, record: false, calibrated: false },
        wavelength_m: 0.0143,
        clock: &desk,
        liveness: &liveness,
    };
    let sampled = RefCell::new(Vec::new());
    let feed = async {
        for tick in 0..u32::MAX {
            desk.sleep_until(u64::from(tick + 1) * BLOCK_US).await;
            let block = block(tick, moves_at_ms);
            sampled.borrow_mut().push(block);
            let _ = copies.try_send(block);
        }
    };
    // the client's clock
    let beat = async {
        for at_us in (0..u64::MAX).step_by(1000) {
            desk.sleep_until(at_us).await;
        }
    };
    let mut receiver = Receiver::new(NODE);
    let (mut step, mut waiting, mut read_frames, mut last_asked_us, mut count) = (0, false, 0, 0, 0);
    let mut heard_us = 0;
    let all = embassy_futures::join::join4(feed, beat, publish.run(), serve.run());
    desk.run_watching(for_us, all, || {
        let now_us = desk.now_us();
        [Member::Acquire, Member::Estimate].into_iter().for_each(|m| liveness.report(m));
        if liveness.take_all() {
            heard_us = now_us;
        }
        seen.silent_us = seen.silent_us.max(now_us - heard_us);
        // a controller with nothing to send never leaves the bus
        let now_off = off(now_us) && (bus.off.get() || !FrameSink::is_idle(&&bus));
        seen.bus_offs += u32::from(now_off && !bus.off.replace(now_off));
        bus.off.set(now_off);
        if off(now_us) {
            return;
        }
        bus.transmit(now_us);
        let log = bus.log.borrow();
        for (at_us, frame) in &log[read_frames..] {
            if (0x480..0x500).contains(&frame.id) {
                seen.burst_frames.push(*at_us);
                count += 1;
                if count % 11 != 0 {
                    receiver.take(frame).unwrap();
                }
            } else if waiting && let Some(reply) = client::reply(NODE, script[step].1.0, frame) {
                seen.replies.push(reply);
                (waiting, step) = (false, step + 1);
            }
        }
        read_frames = log.len();
        while let Some(record) = receiver.next_record() {
            seen.records.push(record);
        }
        if receiver.ask_due() || receiver.is_under_way() && now_us - last_asked_us >= 20_000 {
            last_asked_us = now_us;
            inbox.put(receiver.ask().unwrap());
        }
        if let Some((from_us, (_, request))) = script.get(step)
            && !waiting
            && now_us >= *from_us
        {
            inbox.put(*request);
            waiting = true;
        }
        if let Some(settings) = tuning.try_take() {
            seen.settings.push(settings);
        }
    });
    seen.sampled = sampled.into_inner();
    seen.facts = facts;
    seen
}

fn blocks(seen: &Seen) -> Vec<RawBlock> {
    seen.records.iter().filter_map(|r| if let Record::Block(b) = r { Some(*b) } else { None }).collect()
}

#[test]
fn it_tells_who_it_is_and_changes_nothing_while_it_moves() {
    let warn = || write(Field::WarnBelow, 2000);
    let script = [
        (0, read(Field::Board)),
        (0, read(Field::ImageActive)),
        (0, warn()),
        // nothing known about motion yet
        (0, write(Field::Key, DELIVERED_KEY)),
        (0, warn()),
        (700_000, warn()),
        (700_000, write(Field::PublishingPeriod, 50)),
        (1_000_000, read(Field::Changes)),
        (2_100_000, warn()),
    ];
    let seen = converse(&script, 2_500_000, 2000, Ok(()), |_| false);
    let expected = [
        Reply::Value(2),
        Reply::Value(0xABCD),
        Reply::Refused(Abort::Locked),
        Reply::Taken,
        Reply::Refused(Abort::State),
        Reply::Taken,
        Reply::Taken,
        Reply::Value(2),
        Reply::Refused(Abort::State),
    ];
    assert_eq!(seen.replies, expected);
    assert_eq!(seen.facts.limits().warn_below_n, Some(2000));
    assert_eq!(seen.settings.last().and_then(|s| s.publish_every_blocks), Some(5));
    assert!(seen.facts.unlocked.load(Ordering::Relaxed) && seen.facts.changes.load(Ordering::Relaxed) == 2);
}

#[test]
fn a_burst_is_complete_in_spite_of_loss_and_bus_off_and_keeps_its_share() {
    let order = Order { blocks: 400, past: 50, asked: true };
    // off for 5 ms in every 200
    let off = |us: u64| (1_000..6_000).contains(&(us % 200_000));
    let seen = converse(&[(1_500_000, write(Field::BurstOrder, order.value()))], 9_000_000, 0, Ok(()), off);
    assert_eq!(seen.replies, [Reply::Taken]);
    let got = blocks(&seen);
    let from = got[0].tick as usize;
    assert_eq!(got, seen.sampled[from..from + 400]);
    assert!((95..=102).contains(&from), "{from}");
    let Some(Record::Trailer(trailer)) = seen.records.last() else { panic!("no trailer") };
    assert_eq!((trailer.blocks, trailer.dropped), (400, 0));
    assert_eq!(seen.facts.bus_offs.get(), seen.bus_offs);
    assert!(seen.bus_offs >= 18, "{}", seen.bus_offs);
    // at most the share of any quarter of a second, plus the frames by which it may lag
    for (n, from_us) in seen.burst_frames.iter().enumerate() {
        let within = seen.burst_frames[n..].iter().take_while(|at| *at - from_us < 250_000).count();
        assert!(within as u64 * FRAME_US <= 250_000 / 5 + 6 * FRAME_US, "{within} at {from_us}");
    }
    assert!(seen.silent_us <= REPORT_WITHIN_US, "{}", seen.silent_us);
    assert!(!seen.facts.bursting.load(Ordering::Relaxed));
}

#[test]
fn an_image_is_kept_while_the_block_stays_alive() {
    let image: Vec<u8> = (0..300_u32).map(|n| (n * 11) as u8).collect();
    let domain = object(Field::Image);
    for result in [Ok(()), Err(KeepError::Memory)] {
        let mut script =
            vec![(700_000, write(Field::Key, DELIVERED_KEY)), (0, (domain, client::begin(NODE, domain, 300)))];
        let parts: Vec<&[u8]> = image.chunks(client::SEGMENT).collect();
        for (n, part) in parts.iter().enumerate() {
            script.push((0, (domain, client::segment(NODE, part, n % 2 == 1, n + 1 == parts.len()))));
        }
        script.push((0, write(Field::ImageChecksum, crc32(&image))));
        script.push((2_500_000, read(Field::ImageState)));
        script.push((0, write(Field::Restart, u32::from_le_bytes(*b"rset"))));
        let seen = converse(&script, 3_000_000, u32::MAX, result, |_| false);
        let state = if result.is_ok() { UploadState::Saved } else { UploadState::Failed };
        let [.., checksum, told, restart] = &seen.replies[..] else { panic!("{:?}", seen.replies) };
        assert_eq!((checksum, told, restart), (&Reply::Taken, &Reply::Value(state as u32), &Reply::Taken));
        assert_eq!(*seen.kept.borrow(), [(Kept::Image, image.clone())]);
        assert_eq!(seen.restarts.get(), 1);
        assert!(seen.silent_us <= REPORT_WITHIN_US, "{}", seen.silent_us);
    }
}

#[test]
fn a_zero_is_taken_at_rest_and_settings_are_kept_on_command() {
    let script = [
        (700_000, write(Field::Key, DELIVERED_KEY)),
        (0, write(Field::TakeZero, u32::from_le_bytes(*b"zero"))),
        (2_200_000, read(Field::ZeroShift)),
        (0, write(Field::Save, u32::from_le_bytes(*b"save"))),
    ];
    let seen = converse(&script, 4_000_000, u32::MAX, Ok(()), |_| false);
    // the force is 2060 to 2063, the zero 2048: 13.5 codes
    assert_eq!(seen.replies[2], Reply::Value(216));
    let settings = Settings { zero_shift_sixteenths: 216, ..Settings::DELIVERED };
    assert_eq!(seen.settings, [settings]);
    assert_eq!(*seen.kept.borrow(), [(Kept::Settings, settings.to_bytes().to_vec())]);
    // a failure to keep them is reported
    let ask = [script[0], script[3], (2_500_000, read(Field::Save))];
    for (result, value) in [(Ok(()), 1), (Err(KeepError::NoStore), 0)] {
        let seen = converse(&ask, 4_000_000, u32::MAX, result, |_| false);
        assert_eq!(seen.replies, [Reply::Taken, Reply::Taken, Reply::Value(value)]);
    }
    // motion ends it
    let seen = converse(&script[..3], 4_000_000, 1500, Ok(()), |_| false);
    assert_eq!((seen.replies[2], seen.settings.len()), (Reply::Value(0), 0));
}

#[test]
fn a_notice_starts_a_burst_by_itself() {
    let (desk, inbox, liveness) = (Desk::new(), Inbox::default(), Liveness::new());
    let (tuning, notices) = (Signal::<NoopRawMutex, Settings>::new(), Signal::new());
    let (copies, outgoing, facts) = (Channel::new(), Channel::new(), Facts::new());
    let mut server = Server::new(NODE, DELIVERED_KEY, Settings::DELIVERED);
    let mut sender = Sender::new(NODE, 0);
    let serve = Serve {
        source: &inbox,
        keep: Flash(&desk, Rc::default(), Ok(())),
        restart: Button(Rc::default()),
        server: &mut server,
        sender: &mut sender,
        blocks: copies.receiver(),
        notices: &notices,
        outgoing: outgoing.sender(),
        tuning: &tuning,
        facts: &facts,
        identity: Identity {
            board: BoardKind::Unknown,
            unique: [0; 3],
            version: [0; 3],
            reset_cause: ResetCause::Unknown,
            boot_count: 1,
            active_image: 5,
            publish_every_blocks: 10,
            zero_code: 2048.0,
        },
        clock: &desk,
        liveness: &liveness,
    };
    notices.signal(Order { blocks: 10, past: 0, asked: true });
    let mut receiver = Receiver::new(NODE);
    desk.run_watching(200_000, serve.run(), || {
        while let Ok(frame) = outgoing.try_receive() {
            receiver.take(&frame).unwrap();
        }
    });
    let Some(Record::Header(header)) = receiver.next_record() else { panic!("no header") };
    assert_eq!((header.cause, header.blocks, header.image), (Cause::Notice, 10, 5));
}
