//! The frames of the real image are those that the core computes from the same samples.

use can_wire::parameters::{ADDRESS, ParameterRecord};
use can_wire::{Kind, Message, RawFrame, decode};
use host_tools::emulated::blocks;
use host_tools::replay::Replay;
use model_core::sample::Reason;
use system_tests::axis::{Feed, readings};
use system_tests::image::{BENCH, CHIPS, firmware, record};
use virtual_board::{Chip, Outcome, SentFrame, VirtualBoard};

/// To and fro with a stop, 0.02 to 0.1 m/s.
fn path(t: f64) -> f64 {
    match t {
        t if t < 1.5 => 0.05 * t,
        t if t < 2.0 => 0.075,
        t if t < 3.0 => 0.075 - 0.1 * (t - 2.0),
        t => -0.025 + 0.02 * (t - 3.0),
    }
}

fn run(chip: Chip) -> Outcome {
    let feed = Feed::new(readings(&BENCH, 4.0, 3000.0, 30.0, path));
    let (elf, record) = (firmware(chip), record(BENCH));
    VirtualBoard::new(chip, &elf).with_flash(ADDRESS, &record).run(feed).expect("the image runs").0
}

/// Estimate and motion frames: those that follow from the samples alone.
fn of_samples(frames: &[SentFrame]) -> Vec<RawFrame> {
    let raw = |f: &SentFrame| RawFrame { id: f.id, data: f.data().try_into().expect("eight bytes") };
    let wanted = |f: &RawFrame| matches!(Kind::of(f.id), Ok((Kind::Estimate | Kind::Motion, _)));
    frames.iter().map(raw).filter(wanted).collect()
}

#[test]
fn frames_are_the_replay_of_the_samples_bit_for_bit() {
    let mut sent = Vec::new();
    for chip in CHIPS {
        let outcome = run(chip);
        let mut replay = Replay::new(&ParameterRecord { node: 1, params: BENCH }).expect("a legal record");
        let expected: Vec<RawFrame> =
            blocks(&outcome.samples).iter().filter_map(|b| replay.block(b)).flat_map(|s| s.frames).collect();
        let frames = of_samples(&outcome.frames);
        assert!(frames.len() >= 78, "{chip:?}: {} frames in 4 s", frames.len());
        assert_eq!(frames, expected[..frames.len()], "{chip:?}");
        assert!(expected.len() - frames.len() <= 2, "{chip:?}: only the last pair may still be on its way");
        assert!(outcome.resets.is_empty(), "{chip:?}: {:?}", outcome.resets);
        sent.push(frames);
    }
    assert_eq!(sent[0], sent[1], "F405 and G474 must agree");
}

#[test]
fn same_run_twice_is_the_same_run() {
    for chip in CHIPS {
        assert_eq!(run(chip), run(chip), "{chip:?}");
    }
}

#[test]
fn preload_is_right_where_it_is_given_and_absent_where_it_is_not() {
    let outcome = run(Chip::Stm32f405);
    let (mut given, mut turned) = (0, 0);
    for frame in of_samples(&outcome.frames) {
        let Ok((_, Message::Estimate(e))) = decode(frame.id, &frame.data) else { continue };
        assert_eq!(e.preload_n.is_some(), e.quality.is_none());
        if let Some(preload) = e.preload_n {
            given += 1;
            assert!((preload / 3000.0 - 1.0).abs() < 0.02, "{e:?}");
            assert!((preload - 3000.0).abs() < 2.0 * e.sigma_n.expect("beside the preload"), "{e:?}");
        }
        turned += usize::from(e.quality == Some(Reason::Reversing));
    }
    assert!(given >= 20 && turned >= 2, "{given} given, {turned} while turning");
}

#[test]
fn without_a_record_nothing_is_streamed_as_calibrated() {
    for chip in CHIPS {
        let feed = Feed::new(readings(&BENCH, 1.0, 3000.0, 30.0, |t| 0.05 * t));
        let (outcome, _) = VirtualBoard::new(chip, &firmware(chip)).run(feed).expect("the image runs");
        let frames = of_samples(&outcome.frames);
        assert!(frames.len() >= 18);
        for frame in frames {
            if let Ok((_, Message::Estimate(e))) = decode(frame.id, &frame.data) {
                assert_eq!((e.preload_n, e.quality), (None, Some(Reason::NotCalibrated)), "{chip:?}");
            }
        }
    }
}

#[test]
fn a_damaged_record_is_no_record() {
    let mut damaged = record(BENCH);
    damaged[20] ^= 1;
    let feed = Feed::new(readings(&BENCH, 0.6, 3000.0, 30.0, |t| 0.05 * t));
    let elf = firmware(Chip::Stm32f405);
    let (outcome, _) =
        VirtualBoard::new(Chip::Stm32f405, &elf).with_flash(ADDRESS, &damaged).run(feed).expect("the image runs");
    for frame in of_samples(&outcome.frames) {
        if let Ok((_, Message::Estimate(e))) = decode(frame.id, &frame.data) {
            assert_eq!(e.quality, Some(Reason::NotCalibrated));
        }
    }
}

#[test]
fn publishes_a_hundred_times_a_second_when_asked() {
    let params = model_core::params::Params { publish_every_blocks: 1, ..BENCH };
    let feed = Feed::new(readings(&params, 2.0, 3000.0, 30.0, |t| 0.05 * t));
    let elf = firmware(Chip::Stm32f405);
    let (outcome, _) = VirtualBoard::new(Chip::Stm32f405, &elf)
        .with_flash(ADDRESS, &record(params))
        .run(feed)
        .expect("the image runs");
    let frames = of_samples(&outcome.frames);
    // two frames each 10 ms, and those of the run's tail of 30 ms
    assert!((396..=408).contains(&frames.len()), "{} frames in 2 s", frames.len());
}

/// The state frame names the newest image in flash: a programmer's, or one that was saved later.
#[test]
fn the_newest_image_in_flash_is_the_one_that_runs() {
    use can_wire::Source;
    use can_wire::parameters::image_hash;
    const PLACE: usize = 1024;
    let mut params = BENCH;
    let programmed = record(params);
    params.left_out.seal.coulomb_n = [0.5; 2];
    let later = record(params);
    // a place as the firmware's store fills it: the record, and its commit in the last sixteen bytes
    let place = |generation: u32, whole: bool| {
        let mut place = later.clone();
        let crc = later[later.len() - 4..].to_vec();
        place.resize(PLACE - 16, 0xFF);
        place.extend(generation.to_le_bytes());
        place.extend((!generation).to_le_bytes());
        place.extend(crc);
        place.extend(if whole { b"GBOK" } else { b"GBO\xFF" });
        place
    };
    for chip in CHIPS {
        for (saved, expected) in
            [(None, &programmed), (Some(place(1, false)), &programmed), (Some(place(1, true)), &later)]
        {
            let elf = firmware(chip);
            let mut board = VirtualBoard::new(chip, &elf).with_flash(ADDRESS, &programmed);
            if let Some(saved) = &saved {
                board = board.with_flash(ADDRESS + PLACE as u32, saved);
            }
            let feed = Feed::new(readings(&BENCH, 2.0, 3000.0, 30.0, path));
            let frames = board.run(feed).expect("the image runs").0.frames;
            let (mut images, mut actings) = (0, 0);
            for frame in &frames {
                match decode(frame.id, frame.data()) {
                    Ok((_, Message::State(state))) => {
                        images += 1;
                        assert_eq!(Some(state.image), image_hash(expected), "{chip:?}");
                    }
                    Ok((_, Message::Acting(beside))) => {
                        actings += 1;
                        assert_eq!(beside.source, Source::Calibrated, "{chip:?}");
                        assert_eq!(beside.acting.names().next(), (expected == &later).then_some("seal"));
                    }
                    _ => {}
                }
            }
            assert_eq!((images, actings), (2, 2), "{chip:?}: once a second");
            let misfits = frames.iter().filter(|f| Kind::of(f.id).is_ok_and(|(kind, _)| kind == Kind::Misfit)).count();
            assert_eq!(misfits, 2, "{chip:?}: once a second");
        }
    }
}
