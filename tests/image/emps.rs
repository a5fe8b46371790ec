//! A real axis recording (EMPS, a ball-screw axis) fed to the image: it runs to the end, every frame carries a
//! validity, and no number is given outside the guide's range.
//!
//! The recording's licence does not allow it in the repository. Set `GUIDEBLOCK_DATA` to a folder that holds
//! `emps_train.csv`, or put it into `../shared/data`; without it the test says so and passes.

use can_wire::burst::DATA_BASE;
use can_wire::parameters::ADDRESS;
use can_wire::{Message, decode};
use host_tools::recording::axis;
use host_tools::rig::Rig;
use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use host_tools::rig::track::Track;
use model_core::params::Params;
use model_core::sample::{Motion, Reason};
use system_tests::axis::{Feed, SAMPLE_S, Sample};
use system_tests::image::{BENCH, CHIPS, firmware, record};
use system_tests::root;
use virtual_board::VirtualBoard;

#[test]
fn a_real_axis_recording_runs_through_the_image() {
    let folder = std::env::var_os("GUIDEBLOCK_DATA").map_or_else(|| root().join("../shared/data"), Into::into);
    let path = folder.join("emps_train.csv");
    let Ok(file) = std::fs::File::open(&path) else {
        println!("skipped: {} is not there (set GUIDEBLOCK_DATA to the folder that holds it)", path.display());
        return;
    };
    let (run, _) = axis::read("emps_train.csv", file).expect("a recording");
    // the axis weighs 95 kg and its force reaches 120 N: a bridge of ±200 N
    let mut params = Params { moved_mass_kg: 95.0, ..BENCH };
    params.calibration.force.newtons_per_code *= 2.0;
    let track = Track::new(&run, run.longest_part()).expect("rows");
    let seconds = track.duration_s();
    assert!(seconds > 24.0, "{seconds} s");
    // the axis has no thermometer: one at 30 °C stands in
    let mut front = FrontEnd::new(params.calibration, ChannelNoise::BENCH, 5);
    let warm = front.temperature_code(Some(30.0));
    let mut rig = Rig::new(track, front);
    let sample = |n: usize| {
        let time_s = n as f64 * SAMPLE_S;
        let (force_code, _) = rig.codes(time_s);
        Sample { force_code, temperature_code: warm, encoder_count: rig.encoder_count(time_s) }
    };
    let list: Vec<_> = (0..(seconds / SAMPLE_S) as usize).map(sample).collect();
    for chip in CHIPS {
        let (outcome, feed) = VirtualBoard::new(chip, &firmware(chip))
            .with_flash(ADDRESS, &record(params))
            .run(Feed::new(list.clone()))
            .expect("the image runs");
        assert!(outcome.resets.is_empty(), "{chip:?}");
        let (mut estimates, mut numbers, mut reasons) =
            (0usize, 0usize, std::collections::BTreeMap::<&str, usize>::new());
        let mut quality = None;
        let mut states = Vec::new();
        // the record is of another axis: the block may report that with a burst
        let is_burst = |id: u16| (DATA_BASE..DATA_BASE + 0x80).contains(&id);
        for (_, frame) in feed.frames.iter().filter(|(_, frame)| !is_burst(frame.id)) {
            match decode(frame.id, frame.data()).expect("a sound frame").1 {
                Message::Estimate(e) => {
                    estimates += 1;
                    assert_eq!(e.preload_n.is_some(), e.quality.is_none(), "{chip:?}: {e:?}");
                    numbers += usize::from(e.preload_n.is_some());
                    *reasons.entry(e.quality.map_or("trusted", Reason::name)).or_default() += 1;
                    quality = e.quality;
                }
                Message::Motion(m) => {
                    states.push(m.motion);
                    let Some(speed) = m.speed_m_s else { continue };
                    // the paper's guide is calibrated up to 0.1 m/s
                    assert!(quality.is_some() || speed.abs() <= 0.1001, "{chip:?}: a preload at {speed} m/s");
                }
                _ => {}
            }
        }
        println!("{chip:?}: {estimates} estimates in {seconds:.1} s, {numbers} with a preload, reasons {reasons:?}");
        assert!(estimates as f64 >= 10.0 * seconds - 3.0, "{chip:?}: {estimates} estimates");
        for state in [Motion::Accelerating, Motion::Reversing] {
            assert!(states.contains(&state), "{chip:?}: {state:?} never told");
        }
        assert!(reasons.contains_key("accelerating") && reasons.contains_key("reversing"), "{reasons:?}");
    }
}
