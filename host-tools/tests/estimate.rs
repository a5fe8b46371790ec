//! `guideblock estimate`: bands that cover the truth, reasons where there is none, a staircase from a file.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use host_tools::estimate::{Settings, Summary, estimate, window_s};
use model_core::sample::Reason;
use simulation::Simulation;
use simulation::file::{Law, Tolerance};
use simulation::guide::GuideSet;
use simulation::law::Factors;
use simulation::motion::Motion;
use simulation::run::{Break, Part, Run};

/// Compares with a file of `tests/cli`; `BLESS=1 cargo test` writes it anew.
fn expect(name: &str, got: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli").join(name);
    if std::env::var_os("BLESS").is_some() {
        fs::write(&path, got).expect("writable");
    }
    let expected = fs::read_to_string(&path).unwrap_or_default();
    assert!(got == expected, "{name} is no longer what is printed:\n{got}");
}

/// Numbers of a normal distribution: the sum of twelve even ones, from a linear congruence.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}

fn simulation(tolerance: Tolerance) -> Simulation {
    let set = GuideSet::zhou_2023().with_number("viscosity_cst", 100.0).expect("legal");
    Simulation { preload_n: Some(3000.0), tolerance, ..Simulation::of(Law::Guide(set)) }
}

const EXACT: Tolerance =
    Tolerance { preload: 0.0, friction: 0.0, viscosity: 0.0, friction_terms: 0.0, mass: 0.0, relevance: 0.0 };

/// A run at 1 kHz whose velocity is given over time, with the drag that the simulation says and white noise.
fn record(rows: usize, velocity: impl Fn(f64) -> f64, factors: &Factors, sigma_n: f64, seed: u64) -> Run {
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * 1e-3).collect();
    let velocity: Vec<f64> = time_s.iter().map(|t| velocity(*t)).collect();
    let mut place = 0.0;
    let position = velocity.iter().map(|v| {
        place += v * 1e-3;
        place
    });
    let position: Vec<f64> = position.collect();
    let mut run = Run {
        name: "made".to_owned(),
        position_m: Some(position),
        velocity_m_s: Some(velocity),
        drag_force_n: vec![0.0; rows],
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    };
    let steady = simulation(EXACT).steady(factors, &run, &Motion::of(&run)).expect("complete");
    let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d);
    run.drag_force_n = steady.force_n.iter().map(|f| f + sigma_n * noise.next()).collect();
    run
}

#[test]
fn two_sigma_of_noise_cover_the_truth_in_95_percent_of_the_windows() {
    let settings = Settings { ball_pass_ripple: 0.0, ..Settings::default() };
    let (mut inside, mut count) = (0u32, 0u32);
    for seed in 0..40 {
        let run = record(20_000, |_| 0.05, &Factors::default(), 0.5, seed);
        for e in estimate(&run, &simulation(EXACT), &settings).expect("a guide") {
            if let Some(p) = e.preload {
                count += 1;
                inside += u32::from(p.band().0 <= 3000.0 && 3000.0 <= p.band().1);
            }
        }
    }
    let share = f64::from(inside) / f64::from(count);
    println!("{share:.4} of {count}");
    assert!(count > 3000);
    assert!((0.93..=0.975).contains(&share), "{share}");
}

#[test]
fn with_an_uncertain_law_two_sigma_still_cover_the_truth() {
    let tolerance = Tolerance::default();
    let settings = Settings { ball_pass_ripple: 0.0, ..Settings::default() };
    let mut draw = Noise(7);
    let (mut inside, mut stated, mut square) = (0u32, 0.0, 0.0);
    for seed in 0..600 {
        let factors = Factors {
            friction: 1.0 + tolerance.friction * draw.next(),
            viscosity: 1.0 + tolerance.viscosity * draw.next(),
            ..Factors::default()
        };
        let run = record(2000, |_| 0.03, &factors, 0.5, seed);
        let summary = Summary::of(&estimate(&run, &simulation(tolerance), &settings).expect("a guide"));
        inside += u32::from((summary.preload_n - 3000.0).abs() <= 2.0 * summary.sigma_n);
        stated += summary.sigma_n / 600.0;
        square += (summary.preload_n - 3000.0) * (summary.preload_n - 3000.0) / 600.0;
    }
    let share = f64::from(inside) / 600.0;
    println!("{share:.4}, stated {stated:.1} N, found {:.1} N", square.sqrt());
    assert!((0.93..=0.975).contains(&share), "{share}");
}

#[test]
fn a_window_that_must_not_be_trusted_has_a_reason() {
    let of = |velocity: &dyn Fn(f64) -> f64| {
        let run = record(4000, velocity, &Factors::default(), 0.01, 1);
        let estimates = estimate(&run, &simulation(EXACT), &Settings::default()).expect("a guide");
        Summary::of(&estimates).refused.iter().map(|(reason, _)| *reason).collect::<Vec<_>>()
    };
    assert_eq!(of(&|_| 0.05), [Reason::Settling]);
    assert_eq!(of(&|_| 0.0), [Reason::NoMotion]);
    assert_eq!(of(&|t| if t < 2.1 { 0.05 } else { -0.05 }), [Reason::Reversing, Reason::Settling]);
    assert!(of(&|t| 0.02 + 0.02 * t).contains(&Reason::Accelerating));
    assert!(of(&|_| 0.2).contains(&Reason::SpeedOutOfRange));
    assert!(of(&|_| 0.0005).contains(&Reason::SpeedOutOfRange));
    let mut run = record(4000, |_| 0.05, &Factors::default(), 0.01, 1);
    let reasons = |run: &Run, simulation: &Simulation| {
        let estimates = estimate(run, simulation, &Settings::default()).expect("a guide");
        estimates.last().expect("windows").reasons.iter().collect::<Vec<_>>()
    };
    let light = Factors { preload: 0.1, ..Factors::default() };
    assert_eq!(reasons(&record(4000, |_| 0.05, &light, 0.01, 1), &simulation(EXACT)), [Reason::LoadOutOfRange]);
    run.drag_force_n.iter_mut().for_each(|f| *f = -*f);
    assert_eq!(reasons(&run, &simulation(EXACT)), [Reason::ForceAssists]);
    let walther = Simulation::of(Law::Guide(GuideSet::zhou_2023()));
    assert!(estimate(&run, &walther, &Settings::default()).is_err());
    run.temperature_block_degc = Some(vec![f64::NAN; 4000]);
    assert!(reasons(&run, &walther).contains(&Reason::TemperatureMissing));
}

#[test]
fn a_staircase_in_a_file_gives_its_preload() {
    // 20 speeds from 0.1 to 6 m/min, 2 s each
    let speed = |t: f64| 0.1 / 60.0 * libm::pow(60.0, (t / 2.0).floor() / 19.0);
    let run = record(40_000, speed, &Factors::default(), 0.1, 3);
    let mut text = String::from("time_s,position_m,velocity_m_s,drag_force_n\n");
    for n in 0..run.len() {
        let columns = [run.position_m.as_ref(), run.velocity_m_s.as_ref()].map(|c| c.expect("made")[n]);
        writeln!(text, "{},{},{},{}", run.time_s[n], columns[0], columns[1], run.drag_force_n[n] + 4.0)
            .expect("a text");
    }
    let folder = std::env::temp_dir().join(format!("guideblock-estimate-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("writable");
    let path = |name: &str| folder.join(name).display().to_string();
    fs::write(path("stairs.csv"), text).expect("writable");
    let ask = |more: &[&str]| {
        let recording = path("stairs.csv");
        let arguments = [&["estimate", &recording, "--viscosity", "100"], more].concat();
        let output = Command::new(env!("CARGO_BIN_EXE_guideblock")).args(arguments).output().expect("the binary");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        (output.status.code(), text(output.stdout), text(output.stderr))
    };
    let (status, stdout, stderr) = ask(&["--staircase", "--fit-seals", "--json"]);
    assert_eq!(status, Some(0), "{stderr}");
    let object: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
    let number = |v: &serde_json::Value| v.as_f64().expect("a number");
    assert_eq!((&object["law"]["parameters"], &object["law"]["is_calibrated"]), (&"zhou-2023".into(), &false.into()));
    assert!(stderr.contains("not calibrated on this guide; ASSUMED: conformity, "), "{stderr}");
    let found = &object["staircase"];
    assert_eq!(found["speeds"], 20);
    for (key, truth) in [("preload_n", 3000.0), ("seal_drag_n", 4.0)] {
        let (from, to) = (number(&found[key]["ci95"][0]), number(&found[key]["ci95"][1]));
        assert!(from <= truth && truth <= to && to - from < 0.5 * truth, "{key}: {found}");
    }
    let (status, stdout, stderr) = ask(&["--seal-drag", "4", "--html", &path("page.html")]);
    assert_eq!(status, Some(0), "{stderr}");
    assert!(stdout.starts_with("time_s,position_m,speed_m_s,drag_force_n,drag_sigma_n,viscosity_cst,preload_n,"));
    assert_eq!(stdout.lines().count(), 161);
    expect("estimate.stderr", &stderr);
    expect("estimate.csv", &stdout.split_inclusive('\n').take(20).collect::<String>());
    let page = fs::read_to_string(path("page.html")).expect("written");
    assert!(page.contains("Preload over time") && page.contains("not calibrated on this guide"));
    // who closes standard output early still gets the page
    let mut child = Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(["estimate", &path("stairs.csv"), "--viscosity", "100", "--html", &path("early.html")])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the binary");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("it ends").code(), Some(0));
    assert!(fs::metadata(path("early.html")).expect("written").len() > 1000);
    let (status, stdout, _) = ask(&["--seal-drag", "4", "--out", &path("windows.parquet")]);
    assert_eq!(status, Some(0));
    assert!(stdout.starts_with("preload "), "{stdout}");
    assert_eq!(ask(&["--out", &path("windows.txt")]).0, Some(2));
    assert_eq!(ask(&["--seal-drag", "400"]).0, Some(3));
    // two fifths of a window are none
    let (status, _, stderr) = ask(&["--every", "100"]);
    assert_eq!(status, Some(3));
    assert!(stderr.contains("no stretch without a gap is long enough for a window (100.000 s)"), "{stderr}");
    fs::remove_dir_all(&folder).expect("it was made here");
}

/// The same run with every `by`-th row of it.
fn thinned(run: &Run, by: usize) -> Run {
    let column = |all: &Vec<f64>| all.iter().step_by(by).copied().collect::<Vec<f64>>();
    let time_s = column(&run.time_s);
    Run {
        drag_force_n: column(&run.drag_force_n),
        position_m: run.position_m.as_ref().map(column),
        velocity_m_s: run.velocity_m_s.as_ref().map(column),
        parts: vec![Part { rows: 0..time_s.len(), segment: None, starts: Break::Start }],
        time_s,
        ..run.clone()
    }
}

/// At 50 Hz a quarter of a second is 12 rows, too few to tell their noise: windows get longer, and no more than that.
#[test]
fn a_window_holds_rows_enough_at_any_rate() {
    let fast = record(20_000, |_| 0.05, &Factors::default(), 0.1, 5);
    for (by, length_s, windows) in [(1, 0.25, 80), (10, 0.25, 80), (20, 0.4, 50), (100, 2.0, 10)] {
        let run = thinned(&fast, by);
        for run in [Run { velocity_m_s: None, ..run.clone() }, run] {
            assert!((window_s(&run, &run.parts[0], 0.25) - length_s).abs() < 1e-9);
            let estimates = estimate(&run, &simulation(EXACT), &Settings::default()).expect("a guide");
            assert_eq!(estimates.len(), windows, "every {by} ms");
            let summary = Summary::of(&estimates);
            // but for the first, where the carriage may just have turned
            assert_eq!(summary.usable, windows - 1, "every {by} ms: {:?}", summary.refused);
            assert!((summary.preload_n - 3000.0).abs() < 40.0, "every {by} ms: {} N", summary.preload_n);
        }
    }
}

/// Run with `--ignored --nocapture`: an hour at 1 kHz.
#[test]
#[ignore = "a measurement"]
fn time_of_an_hour_at_one_kilohertz() {
    let run = record(
        3_600_000,
        |t| if ((t / 10.0) as u64).is_multiple_of(2) { 0.05 } else { -0.05 },
        &Factors::default(),
        0.5,
        1,
    );
    for velocity in [true, false] {
        let run = if velocity { run.clone() } else { Run { velocity_m_s: None, ..run.clone() } };
        let start = Instant::now();
        let summary = Summary::of(&estimate(&run, &simulation(EXACT), &Settings::default()).expect("a guide"));
        println!("{:?}: {} of {} windows", start.elapsed(), summary.usable, summary.windows);
    }
}
