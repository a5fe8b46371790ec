//! Faults in the emulator: each gives its documented reason within one window (0.32 s) and one publishing period.

use can_wire::parameters::ADDRESS;
use can_wire::{FaultMessage, HeartbeatMessage, Message, ResetCause, decode};
use model_core::sample::{Motion, Reason};
use object::{Object, ObjectSegment};
use system_tests::axis::{Feed, SAMPLE_S, Sample, readings};
use system_tests::image::{BENCH, CHIPS, firmware, record, symbol};
use virtual_board::{Chip, Outcome, VirtualBoard, symbols};

/// One window, one publishing period and the frames on their way, in samples.
const WITHIN: usize = 512 + 160 + 16;

/// Steady motion at 0.05 m/s under 3000 N.
fn steady(seconds: f64) -> Vec<Sample> {
    readings(&BENCH, seconds, 3000.0, 30.0, |t| 0.05 * t)
}

fn run(chip: Chip, feed: Feed) -> (Outcome, Feed) {
    VirtualBoard::new(chip, &firmware(chip)).with_flash(ADDRESS, &record(BENCH)).run(feed).expect("the image runs")
}

/// Every message with the number of samples taken before it left.
fn messages(feed: &Feed) -> Vec<(usize, Message)> {
    let read = |(n, f): &(usize, virtual_board::SentFrame)| (*n, decode(f.id, f.data()).expect("a sound frame").1);
    feed.frames.iter().map(read).collect()
}

fn last_heartbeat(feed: &Feed) -> HeartbeatMessage {
    let mut beats =
        messages(feed).into_iter().filter_map(|(_, m)| if let Message::Heartbeat(h) = m { Some(h) } else { None });
    beats.next_back().expect("a heartbeat")
}

fn last_fault(feed: &Feed) -> FaultMessage {
    let mut faults =
        messages(feed).into_iter().filter_map(|(_, m)| if let Message::Fault(f) = m { Some(f) } else { None });
    faults.next_back().expect("a fault frame")
}

/// The qualities of the estimates that left after `from` samples, with their sample numbers.
fn qualities(feed: &Feed, from: usize) -> Vec<(usize, Option<Reason>)> {
    let estimates = messages(feed).into_iter().filter_map(|(n, m)| match m {
        Message::Estimate(e) => Some((n, e.quality)),
        _ => None,
    });
    estimates.filter(|(n, _)| *n >= from).collect()
}

/// Changes the readings from sample 1600 on and asserts that `reason` is reported within one window.
fn reason_for(chip: Chip, reason: Reason, mut fault: impl FnMut(usize, &mut Sample)) {
    const FROM: usize = 1600;
    let mut list = steady(2.0);
    for (n, sample) in list.iter_mut().enumerate().skip(FROM) {
        fault(n, sample);
    }
    let (_, feed) = run(chip, Feed::new(list));
    let before = qualities(&feed, 800);
    assert!(before.iter().any(|(n, q)| *n < FROM && q.is_none()), "{chip:?} {reason:?}: trusted before");
    let told = before.iter().find(|(n, q)| *n > FROM && *q == Some(reason));
    let (at, _) = told.unwrap_or_else(|| panic!("{chip:?}: {reason:?} never told, {before:?}"));
    assert!(at - FROM <= WITHIN, "{chip:?}: {reason:?} after {} samples", at - FROM);
}

#[test]
fn bad_sensors_are_named_within_one_window() {
    for chip in CHIPS {
        reason_for(chip, Reason::ForceAtRail, |_, s| s.force_code = 4095);
        reason_for(chip, Reason::ForceAtRail, |_, s| s.force_code = 0);
        reason_for(chip, Reason::ForceStuck, |_, s| s.force_code = 2400);
        reason_for(chip, Reason::TemperatureMissing, |_, s| s.temperature_code = 4095);
        reason_for(chip, Reason::TemperatureMissing, |_, s| s.temperature_code = 0);
        let frozen = steady(2.0)[1607].encoder_count;
        reason_for(chip, Reason::EncoderStuck, |n, s| {
            s.encoder_count = if n > 1607 { frozen } else { s.encoder_count }
        });
    }
}

#[test]
fn converter_overrun_is_told_and_survived() {
    for chip in CHIPS {
        let feed = Feed::new(steady(3.0)).at(1600, |pins| pins.lose_conversion());
        let (outcome, feed) = run(chip, feed);
        let after = qualities(&feed, 1600);
        let told = after
            .iter()
            .find(|(_, q)| *q == Some(Reason::SamplesLost))
            .unwrap_or_else(|| panic!("{chip:?}: {after:?}"));
        assert!(told.0 - 1600 <= WITHIN, "{chip:?}: told after {} samples", told.0 - 1600);
        assert_eq!(after.last().map(|(_, q)| *q), Some(None), "{chip:?}: trusted again at the end");
        assert!(last_fault(&feed).lost_blocks > 0, "{chip:?}");
        assert!(outcome.resets.is_empty(), "{chip:?}");
    }
}

#[test]
fn a_bus_without_acknowledgement_costs_no_sample() {
    for chip in CHIPS {
        let seconds = 7.0;
        let feed = Feed::new(steady(seconds))
            .at(1600, |pins| pins.acknowledge(false))
            .at(1600 + 8000, |pins| pins.acknowledge(true));
        let (outcome, feed) = run(chip, feed);
        // every trigger while the board ran gave a sample, in time
        let gaps = outcome.samples.windows(2).filter(|w| w[1].at - w[0].at > 700_000).count();
        assert_eq!(gaps, 0, "{chip:?}");
        assert!(outcome.samples.len() as f64 >= seconds / SAMPLE_S, "{chip:?}");
        assert_eq!(last_fault(&feed).lost_blocks, 0, "{chip:?}");
        let dropped = last_heartbeat(&feed).frames_dropped;
        // 5 s of two frames at 10 Hz, two heartbeats and one or two more a second; some wait in the controller
        assert!((95..=140).contains(&dropped), "{chip:?}: {dropped} dropped");
        assert!(outcome.unacknowledged > 0 && outcome.resets.is_empty(), "{chip:?}");
        let back = qualities(&feed, 1600 + 8000);
        assert!(back.len() >= 6 && back.last().is_some_and(|(_, q)| q.is_none()), "{chip:?}: {back:?}");
    }
}

#[test]
fn bus_off_is_survived() {
    for chip in CHIPS {
        let feed =
            Feed::new(steady(4.0)).at(1600, |pins| pins.disturb_bus(true)).at(3200, |pins| pins.disturb_bus(false));
        let (outcome, feed) = run(chip, feed);
        assert_eq!(outcome.samples.windows(2).filter(|w| w[1].at - w[0].at > 700_000).count(), 0, "{chip:?}");
        let back = qualities(&feed, 3200 + 800);
        assert!(back.len() >= 8 && back.iter().all(|(_, q)| q.is_none()), "{chip:?}: {back:?}");
        assert!(outcome.resets.is_empty(), "{chip:?}");
    }
}

/// Hangs the task that calls this function.
fn hung_in(chip: Chip, function: &[&str]) {
    let name = symbol(&symbols(&firmware(chip)).expect("an ELF image"), function);
    let feed = Feed::new(steady(3.0))
        .at(1600, move |pins| pins.hang(&name).expect("the symbol just found"))
        .until(4_000_000_000);
    let (outcome, feed) = run(chip, feed);
    assert_eq!(outcome.resets.len(), 1, "{chip:?} {function:?}: {:?}", outcome.resets);
    assert_eq!(outcome.resets[0].cause, virtual_board::ResetCause::Watchdog, "{chip:?} {function:?}");
    let at = outcome.resets[0].at;
    assert!((1_000_000_000..1_800_000_000).contains(&at), "{chip:?} {function:?}: reset at {at} ns");
    let beat = last_heartbeat(&feed);
    assert_eq!((beat.reset_cause, beat.boot_count), (ResetCause::Watchdog, 2), "{chip:?} {function:?}");
    let after: Vec<_> = feed.frames.iter().filter(|(_, f)| f.at > at).collect();
    assert!(after.len() > 10, "{chip:?} {function:?}: streams again");
}

#[test]
fn a_hung_task_ends_in_a_watchdog_reset_and_streaming_resumes() {
    for chip in CHIPS {
        for task in ["acquire", "estimate", "publish", "serve", "supervise"] {
            hung_in(chip, &["TaskStorage", task, "poll"]);
        }
        // and in the middle of the arithmetic
        hung_in(chip, &["monitor", "Monitor", "step"]);
    }
}

/// A write to an object of the block, whichever.
const WRITE: &[u8] = &[0x23, 0x01, 0x20, 1, 0, 0, 0, 0];

/// Where a function of an image stands: its address, and the place in the file.
fn function(elf: &[u8], fragments: &[&str]) -> (u32, usize) {
    let table = symbols(elf).expect("an ELF image");
    let at = table.find(&symbol(&table, fragments)).expect("just found").address;
    let file = object::File::parse(elf).expect("an ELF image");
    let holds = |s: &object::Segment<'_, '_>| (s.address()..s.address() + s.file_range().1).contains(&at.into());
    let segment = file.segments().find(holds).expect("loaded from the file");
    (at, (segment.file_range().0 + u64::from(at) - segment.address()) as usize)
}

/// A stack overflow leaves RAM before it overwrites a variable: the number of starts, which start-up code does not
/// initialise, survives.
#[test]
fn a_stack_that_overflows_ends_in_a_watchdog_reset_and_harms_no_variable() {
    for chip in CHIPS {
        // the function `write`, first called after a second, becomes
        // an endless recursion: push {r0-r7}, and back to it
        let mut elf = firmware(chip);
        let (_, place) = function(&elf, &["6server", "6Server5write"]);
        elf[place..place + 4].copy_from_slice(&[0xFF, 0xB4, 0xFD, 0xE7]);
        let feed = Feed::new(steady(3.0)).at(1600, |pins| pins.receive(0x601, WRITE)).until(4_000_000_000);
        let (outcome, feed) =
            VirtualBoard::new(chip, &elf).with_flash(ADDRESS, &record(BENCH)).run(feed).expect("the image runs");
        assert_eq!(outcome.resets.len(), 1, "{chip:?}: {:?}", outcome.resets);
        let reset = &outcome.resets[0];
        assert_eq!(reset.cause, virtual_board::ResetCause::Watchdog, "{chip:?}");
        assert!((1_000_000_000..1_800_000_000).contains(&reset.at), "{chip:?}: reset at {} ns", reset.at);
        let beat = last_heartbeat(&feed);
        assert_eq!((beat.reset_cause, beat.boot_count), (ResetCause::Watchdog, 2), "{chip:?}");
        assert!(feed.frames.iter().filter(|(_, f)| f.at > reset.at).count() > 10, "{chip:?}: streams again");
    }
}

/// `b.w` from an address to another (ARMv7-M A7.7.12, T4).
fn branch(from: u32, to: u32) -> [u8; 4] {
    let offset = to.wrapping_sub(from + 4);
    let (sign, bit) = (offset >> 31, |n: u32| offset >> n & 1);
    let j = |n: u32| !(bit(n) ^ sign) & 1;
    let first = 0xF000 | sign << 10 | offset >> 12 & 0x3FF;
    let second = 0x9000 | j(23) << 13 | j(22) << 11 | offset >> 1 & 0x7FF;
    let [a, b] = [first, second].map(|halfword| (halfword as u16).to_le_bytes());
    [a[0], a[1], b[0], b[1]]
}

/// Run in which the processor takes an NMI at the first write to the block, a second after its start. The emulated core
/// has no line for it, so a detour into a function makes an NMI pend; `ecc`: flash reports an uncorrectable error.
fn nmi(ecc: bool) -> Outcome {
    /// Address of the detour, behind the image, where flash is erased.
    const DETOUR: u32 = 0x0805_0000;
    let mut elf = firmware(Chip::Stm32g474);
    let (at, place) = function(&elf, &["6server", "6Server5write"]);
    let mut detour: Vec<u8> = [
        0xB403, // push {r0, r1}
        0xF64E, 0x5004, 0xF2CE, 0x0000, // r0: ICSR
        0x2101, 0x07C9, 0x6001, // NMIPENDSET
        0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F,    // dsb, isb
        0xBC03u16, // pop {r0, r1}
    ]
    .into_iter()
    .flat_map(u16::to_le_bytes)
    .collect();
    let begins: [u8; 4] = elf[place..place + 4].try_into().expect("four bytes");
    // a push, and with a frame pointer its setting: both are position-independent
    assert!(matches!(begins, [_, 0xB5, _, 0xAF]) || begins[..2] == [0x2D, 0xE9], "{begins:x?}");
    detour.extend(begins);
    detour.extend(branch(DETOUR + detour.len() as u32, at + 4));
    elf[place..place + 4].copy_from_slice(&branch(at, DETOUR));
    let feed = Feed::new(steady(3.0)).at(1600, move |pins| {
        if ecc {
            pins.find_flash_error();
        }
        pins.receive(0x601, WRITE);
    });
    let record = record(BENCH);
    let board = VirtualBoard::new(Chip::Stm32g474, &elf).with_flash(ADDRESS, &record).with_flash(DETOUR, &detour);
    let (outcome, feed) = board.run(feed).expect("the image runs");
    let answered = feed.frames.iter().any(|(_, f)| f.id == 0x581);
    assert_eq!(answered, ecc, "the function went on, or did not");
    outcome
}

#[test]
fn flash_that_its_ecc_cannot_mend_is_read_on() {
    let outcome = nmi(true);
    assert!(outcome.resets.is_empty(), "{:?}", outcome.resets);
    // every other cause of an NMI restarts the block at once
    let outcome = nmi(false);
    let causes: Vec<_> = outcome.resets.iter().map(|r| r.cause).collect();
    assert_eq!(causes, [virtual_board::ResetCause::Software]);
}

#[test]
fn standstill_and_reversal_have_their_own_state() {
    let path = |t: f64| {
        if t < 1.0 {
            0.05 * t
        } else if t < 2.0 {
            0.05
        } else {
            0.05 - 0.05 * (t - 2.0)
        }
    };
    let (_, feed) = run(Chip::Stm32f405, Feed::new(readings(&BENCH, 3.0, 3000.0, 30.0, path)));
    let states: Vec<Motion> = messages(&feed)
        .into_iter()
        .filter_map(|(_, m)| if let Message::Motion(m) = m { Some(m.motion) } else { None })
        .collect();
    for state in [Motion::Forward, Motion::Rest, Motion::Reversing, Motion::Backward] {
        assert!(states.contains(&state), "{state:?} never told: {states:?}");
    }
    assert_eq!(states.last(), Some(&Motion::Backward));
}
