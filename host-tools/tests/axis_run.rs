//! The bundled run of an axis, seen through the virtual sensors and the block's pipeline on the desk.
//!
//! The run was made by an independent program (tests/golden/make_axis_run.py), so this holds the whole chain
//! from counts to newtons against formulas that share no code with it.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use host_tools::candump::Frame;
use host_tools::decode::{Decoder, Joiner};
use host_tools::judgement::{Accuracy, Point, accuracy};
use host_tools::parameters::from_bench;
use host_tools::recording::axis;
use host_tools::replay::Replay;
use host_tools::report::svg;
use host_tools::rig::Rig;
use host_tools::rig::front_end::{ChannelNoise, FrontEnd};
use host_tools::rig::track::Track;

const RUN: &str = include_str!("../runs/shs35_preload_loss.csv");
const BENCH: &str = include_str!("../runs/bench.toml");

/// The run as the block on this desk tells it; the seed decides the sensors' noise.
fn run(seed: u64) -> Vec<Point> {
    let record = from_bench(BENCH).expect("bundled");
    let (run, losses) = axis::read("bundled", RUN.as_bytes()).expect("bundled");
    assert_eq!(losses.problems, []);
    let track = Track::new(&run, run.longest_part()).expect("rows");
    let front_end = FrontEnd::new(record.params.calibration, ChannelNoise::BENCH, seed);
    let mut rig = Rig::new(track, front_end);
    let mut replay = Replay::new(&record).expect("legal");
    let (mut decoder, mut joiner) = (Decoder::new(None), Joiner::default());
    let mut points = Vec::new();
    for block in rig.record() {
        let Some(sent) = replay.block(&block) else { continue };
        for frame in sent.frames {
            let decoded = decoder.frame(&Frame::new(Some(sent.time), "desk", frame.id, &frame.data)).expect("sound");
            if let Some(reading) = joiner.take(&decoded) {
                let truth = rig.track().at(sent.time.seconds()).preload_n;
                points.push(Point::new(sent.time.seconds(), &reading, truth));
            }
        }
    }
    points
}

#[test]
fn the_block_follows_the_loss_of_preload() {
    for seed in 1..=3 {
        let points = run(seed);
        let Accuracy { readings, judged, covered, largest_error, rms_error, mean_band } = accuracy(&points);
        println!(
            "seed {seed}: {judged} of {readings} readings with preload, {covered} within 2 sigma, largest error {:.2} %, rms {:.2} %, band {:.1} %",
            100.0 * largest_error,
            100.0 * rms_error,
            100.0 * mean_band
        );
        assert_eq!(readings, 1199, "10 Hz over 119.99 s");
        assert!(judged > 700, "{judged}");
        // the specimen's friction, oil and seals are off by what the block says they may be
        assert_eq!(covered, judged);
        assert!(largest_error.abs() < 0.035, "{largest_error}");
        assert!(rms_error < 0.02, "{rms_error}");
        let mean = |from: f64, to: f64| {
            let given: Vec<_> =
                points.iter().filter(|p| p.time_s > from && p.time_s < to).filter_map(|p| p.preload_n).collect();
            f64::from(given.iter().sum::<f32>()) / given.len() as f64
        };
        // a specimen's deviation is mostly a factor, so the loss is seen better than the level
        let loss = mean(80.0, 120.0) / mean(1.0, 40.0);
        assert!((loss / 0.8 - 1.0).abs() < 0.01, "{loss}");
    }
    if let Ok(path) = std::env::var("PICTURE") {
        std::fs::write(path, svg::picture("SHS35 block losing preload", "desk", &run(1))).expect("writable");
    }
}
