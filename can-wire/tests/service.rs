//! Service messages against a plain second opinion, and step by step.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod reference;

use can_wire::service::{Abort, Action, BlockState, OBJECTS, Object, Server, Settings, UploadState, client};
use can_wire::service::{Field, client::Reply};
use can_wire::{BoardKind, NodeId, RawFrame, ResetCause, crc32};
use reference::{KEY, Trial};
use std::time::{Duration, Instant};

const NODE: NodeId = NodeId::new(9).unwrap();

const STANDING: BlockState = BlockState {
    moving: false,
    uptime_s: 100,
    error_register: 0x81,
    board: BoardKind::Stm32g474,
    unique: [0x1111_1111, 0x2222_2222, 0x3333_3333],
    version: [1, 2, 3],
    reset_cause: ResetCause::Watchdog,
    boot_count: 4,
    lost_blocks: 5,
    frames_dropped: 6,
    bus_offs: 7,
    active_image: 0xCAFE_F00D,
    image_publish_every_blocks: 10,
    burst_state: 0,
    burst_dropped: 8,
};

fn object(field: Field) -> &'static Object {
    OBJECTS.iter().find(|o| o.field == field).unwrap()
}

fn ask(server: &mut Server, block: &BlockState, field: Field, request: RawFrame) -> (Reply, Option<Action>) {
    let answer = server.handle(&request, block);
    (client::reply(NODE, object(field), &answer.frame.unwrap()).unwrap(), answer.action)
}

fn read(server: &mut Server, field: Field) -> Reply {
    ask(server, &STANDING, field, client::read(NODE, object(field))).0
}

fn write(server: &mut Server, block: &BlockState, field: Field, value: u32) -> (Reply, Option<Action>) {
    ask(server, block, field, client::write(NODE, object(field), value))
}

/// About three seconds of messages; `cargo run --release --example malformed` has ten million.
#[test]
fn what_is_not_taken_changes_nothing_and_is_answered_as_documented() {
    let (mut trial, start) = (Trial::new(20_261_121), Instant::now());
    while start.elapsed() < Duration::from_secs(2) {
        (0..2000).for_each(|_| trial.step());
    }
    println!("silent, given up, refused, taken: {:?}; aborts {:?}", trial.seen, trial.aborts);
    assert!(trial.seen.iter().all(|n| *n > 10), "{:?}", trial.seen);
    // every reason for refusal was met
    assert!(trial.aborts.iter().all(|n| *n > 0), "{:?}", trial.aborts);
}

#[test]
fn a_block_tells_what_it_is() {
    let mut server = Server::new(NODE, KEY, Settings::DELIVERED);
    for (field, value) in [
        (Field::DeviceType, 0),
        (Field::ErrorRegister, 0x81),
        (Field::Product, 2),
        (Field::Revision, 0x0102_0003),
        (Field::Serial, crc32(&[0x11, 0x11, 0x11, 0x11, 0x22, 0x22, 0x22, 0x22, 0x33, 0x33, 0x33, 0x33])),
        (Field::UniqueMiddle, 0x2222_2222),
        (Field::AlarmBelow, 0xFFFF),
        (Field::PublishingPeriod, 100),
        (Field::ImageActive, 0xCAFE_F00D),
        (Field::BootCount, 4),
        (Field::ResetCause, 3),
        (Field::BusOffs, 7),
        (Field::Unlocked, 0),
    ] {
        assert_eq!(read(&mut server, field), Reply::Value(value), "{field:?}");
    }
    // literal bytes: identity, part 4
    let answer = server.handle(&RawFrame { id: 0x609, data: [0x40, 0x18, 0x10, 2, 0, 0, 0, 0] }, &STANDING);
    assert_eq!(answer.frame, Some(RawFrame { id: 0x589, data: [0x43, 0x18, 0x10, 2, 2, 0, 0, 0] }));
    let answer = server.handle(&RawFrame { id: 0x609, data: [0x40, 0x18, 0x10, 0, 0, 0, 0, 0] }, &STANDING);
    assert_eq!(answer.frame, Some(RawFrame { id: 0x589, data: [0x4F, 0x18, 0x10, 0, 4, 0, 0, 0] }));
    let answer = server.handle(&RawFrame { id: 0x609, data: [0x40, 0x99, 0x20, 0, 0, 0, 0, 0] }, &STANDING);
    assert_eq!(answer.frame, Some(RawFrame { id: 0x589, data: [0x80, 0x99, 0x20, 0, 0, 0, 2, 6] }));
}

#[test]
fn nothing_is_set_without_the_key_nor_while_it_moves() {
    let mut server = Server::new(NODE, KEY, Settings::DELIVERED);
    let moving = BlockState { moving: true, ..STANDING };
    let refused = |why| (Reply::Refused(why), None);
    assert_eq!(write(&mut server, &STANDING, Field::WarnBelow, 2000), refused(Abort::Locked));
    assert_eq!(write(&mut server, &STANDING, Field::Key, KEY ^ 1), refused(Abort::Value));
    assert_eq!(write(&mut server, &STANDING, Field::Key, KEY), (Reply::Taken, None));
    assert_eq!(write(&mut server, &moving, Field::WarnBelow, 2000), refused(Abort::State));
    assert_eq!(server.changes(), 0);
    let (reply, action) = write(&mut server, &STANDING, Field::WarnBelow, 2000);
    let Some(Action::Apply(settings)) = action else { panic!("{action:?}") };
    assert_eq!((reply, settings.limits.warn_below_n, server.changes()), (Reply::Taken, Some(2000), 1));
    assert_eq!(write(&mut server, &STANDING, Field::AlarmBelow, 2001), refused(Abort::Incompatible));
    assert_eq!(read(&mut server, Field::WarnBelow), Reply::Value(2000));
    // five minutes after the last change
    let later = |s| BlockState { uptime_s: STANDING.uptime_s + s, ..STANDING };
    assert_eq!(write(&mut server, &later(299), Field::BurstLoad, 30).0, Reply::Taken);
    assert_eq!(write(&mut server, &later(599), Field::BurstLoad, 30), refused(Abort::Locked));
    // a burst needs no key and runs while it moves: that is what it is for
    assert!(matches!(write(&mut server, &moving, Field::BurstOrder, 100), (Reply::Taken, Some(Action::Burst(_)))));
    assert_eq!(server.changes(), 2);
}

#[test]
fn an_image_arrives_whole_or_not_at_all() {
    let image: Vec<u8> = (0..1000_u32).map(|n| (n * 7) as u8).collect();
    let mut server = Server::new(NODE, KEY, Settings::DELIVERED);
    let domain = object(Field::Image);
    let begin = |server: &mut Server| ask(server, &STANDING, Field::Image, client::begin(NODE, domain, 1000)).0;
    assert_eq!(begin(&mut server), Reply::Refused(Abort::Locked));
    write(&mut server, &STANDING, Field::Key, KEY);
    assert_eq!(begin(&mut server), Reply::Taken);
    let parts: Vec<&[u8]> = image.chunks(client::SEGMENT).collect();
    for (n, part) in parts.iter().enumerate() {
        let (toggle, last) = (n % 2 == 1, n + 1 == parts.len());
        let request = client::segment(NODE, part, toggle, last);
        assert_eq!(ask(&mut server, &STANDING, Field::Image, request).0, Reply::SegmentTaken(toggle));
        if !last {
            // the same again is refused and does no harm
            assert_eq!(ask(&mut server, &STANDING, Field::Image, request).0, Reply::Refused(Abort::Toggle));
            assert_eq!(write(&mut server, &STANDING, Field::ImageChecksum, 0).0, Reply::Refused(Abort::State));
        }
    }
    assert_eq!(write(&mut server, &STANDING, Field::ImageChecksum, 1), (Reply::Refused(Abort::Value), None));
    let taken = write(&mut server, &STANDING, Field::ImageChecksum, crc32(&image));
    assert_eq!(taken, (Reply::Taken, Some(Action::SaveImage)));
    assert_eq!((server.image(), server.changes()), (&image[..], 1));
    assert_eq!(read(&mut server, Field::ImageState), Reply::Value(UploadState::Saving as u32));
    assert_eq!(begin(&mut server), Reply::Refused(Abort::State));
    server.saved(UploadState::Saved);
    assert_eq!(read(&mut server, Field::ImageState), Reply::Value(UploadState::Saved as u32));
}

#[test]
fn a_zero_is_added_to_the_one_before() {
    let mut server = Server::new(NODE, KEY, Settings { zero_shift_sixteenths: 100, ..Settings::DELIVERED });
    write(&mut server, &STANDING, Field::Key, KEY);
    let zero = u32::from_le_bytes(*b"zero");
    assert_eq!(write(&mut server, &STANDING, Field::TakeZero, zero), (Reply::Taken, Some(Action::TakeZero)));
    assert_eq!(write(&mut server, &STANDING, Field::TakeZero, zero), (Reply::Refused(Abort::State), None));
    assert_eq!(server.zeroed(Some(-116)).map(|s| s.zero_shift_sixteenths), Some(-16));
    assert_eq!(read(&mut server, Field::ZeroShift), Reply::Value(0xFFF0));
    assert_eq!(write(&mut server, &STANDING, Field::TakeZero, zero).0, Reply::Taken);
    assert_eq!(server.zeroed(None), None);
    assert_eq!(server.settings().zero_shift_sixteenths, -16);
}
