use super::*;
use crate::calibration::CODE_MAX;
use crate::params::{Seals, Uncertainty};
use crate::reduced::DragLaw;

/// An ideal axis: constant preload and temperature, a position over time, sensors with dither only.
struct Axis {
    params: Params,
    preload_n: f32,
    temperature_degc: f32,
    monitor: Monitor,
    state: State,
    tick: u32,
    /// force beside the guide's, towards larger positions
    pull_n: f32,
    /// changes a block before the monitor sees it
    fault: Fault,
}

type Fault = fn(&mut RawBlock);

impl Axis {
    fn new(params: Params) -> Self {
        let monitor = params.build().expect("legal");
        Axis {
            params,
            preload_n: 3000.0,
            temperature_degc: 30.0,
            monitor,
            state: State::new(),
            tick: 0,
            pull_n: 0.0,
            fault: |_| {},
        }
    }

    fn drag(&self, speed: f32) -> f32 {
        let nu = self.params.viscosity.at(self.temperature_degc).expect("inside").cst;
        let contacts = self.params.law.drag_force(self.preload_n, nu * speed.abs()).expect("inside");
        let seals = self.params.seals.coulomb_n + self.params.seals.viscous_n_s_m * speed.abs();
        (contacts + seals) * speed.signum()
    }

    /// Runs `blocks` blocks along `path` (s -> m) with force `force` (m/s -> N); the last estimate.
    fn run(&mut self, blocks: u32, path: impl Fn(f64) -> f64) -> Estimate {
        let c = self.params.calibration;
        let mut last = None;
        for _ in 0..blocks {
            let at = |n: usize| (f64::from(self.tick) * 16.0 + n as f64) / 1600.0;
            let speed = ((path(at(16)) - path(at(0))) / 0.01) as f32;
            let force = if speed == 0.0 { 5.0 } else { self.drag(speed) + self.pull_n };
            // half a code of triangular dither spreads the rounding
            let dither = |n: usize| ((n * 7 % 16) as f32 - 7.5) / 8.0;
            let mut block = RawBlock {
                tick: self.tick,
                force: core::array::from_fn(|n| (c.force.code(force) + dither(n) + 0.5) as u16),
                temperature: [(c.thermistor.code(self.temperature_degc) + 0.5) as u16; 16],
                position: core::array::from_fn(|n| {
                    libm::floor(path(at(n)) / f64::from(c.metres_per_count)) as i64 as u16
                }),
            };
            (self.fault)(&mut block);
            if let Some(e) = self.monitor.step(&mut self.state, &block) {
                last = Some(e);
            }
            self.tick += 1;
        }
        last.expect("at least one publishing period")
    }
}

const CALIBRATED: Params = Params { calibrated: true, ..Params::ZHOU_2023 };

#[test]
fn finds_the_preload_at_every_speed_in_both_directions() {
    for speed in [0.0017, 0.005, 0.02, 0.05, 0.0999, -0.01, -0.08] {
        for (preload, temperature) in [(600.0, 10.0), (3000.0, 30.0), (7900.0, 60.0)] {
            let mut axis = Axis { preload_n: preload, temperature_degc: temperature, ..Axis::new(CALIBRATED) };
            let e = axis.run(100, |t| speed * t);
            let got = e.preload_n.unwrap_or_else(|| core::panic!("{speed} {preload}: {:?}", e.reasons));
            // a thermometer code is 0.03 to 0.1 K, a force code averaged 0.01 N
            assert!((got.value / preload - 1.0).abs() < 0.01, "{speed}: {} for {preload}", got.value);
            assert!(got.sigma > 0.02 * got.value && got.sigma < 0.12 * got.value, "{speed} {preload}: {}", got.sigma);
            let v = e.speed_m_s.expect("moving");
            assert!((v.value - speed as f32).abs() <= 3.0 * v.sigma, "{speed}: {v:?}");
            assert_eq!(e.motion, if speed > 0.0 { Motion::Forward } else { Motion::Backward });
        }
    }
}

#[test]
fn a_known_mass_is_taken_off_where_an_unknown_one_silences() {
    let path = |t: f64| 0.08 * t + 0.005 * t * t;
    let unknown = Params { moved_mass_kg: 60.0, ..CALIBRATED };
    let mut axis = Axis { pull_n: 60.0 * 0.01, ..Axis::new(unknown) };
    assert_eq!(axis.run(60, path).motion, Motion::Accelerating);
    let mut known = unknown;
    known.left_out.pull.inertia_kg = 60.0;
    let mut axis = Axis { pull_n: 60.0 * 0.01, ..Axis::new(known) };
    let e = axis.run(60, path);
    assert!((e.preload_n.expect("trusted").value / 3000.0 - 1.0).abs() < 0.01, "{e:?}");
    // the same force, taken for the guide's, is several per cent of preload
    let mut axis = Axis { pull_n: 60.0 * 0.01, ..Axis::new(CALIBRATED) };
    assert!(axis.run(60, path).preload_n.expect("trusted").value > 1.025 * 3000.0);
}

#[test]
fn what_acts_beside_the_law_is_taken_off_in_either_direction() {
    let mut params = CALIBRATED;
    params.left_out.seal.coulomb_n = [4.0, 3.0];
    params.left_out.sensor.offset_n = -1.5;
    params.left_out.start_m = 0.4;
    params.left_out.pull.per_m_n_m = 2.0;
    for (speed, seals) in [(0.05, 4.0), (-0.05, 3.0f32)] {
        // after 0.6 s the window's middle lies 0.44 s along the way
        let place = 0.4 + speed * 0.44;
        let pull_n = seals * (speed as f32).signum() - 1.5 + 2.0 * place as f32;
        let mut axis = Axis { pull_n, ..Axis::new(params) };
        let e = axis.run(60, |t| speed * t);
        let got = e.preload_n.expect("trusted").value;
        assert!((got / 3000.0 - 1.0).abs() < 0.01, "{speed}: {got}");
        let at = axis.state.working_point().expect("trusted");
        assert!((f64::from(at.place_m) - speed * 0.44).abs() < 1e-4, "{at:?}");
    }
}

#[test]
fn seals_are_taken_off() {
    let mut axis = Axis::new(Params { seals: Seals { coulomb_n: 4.0, viscous_n_s_m: 20.0 }, ..CALIBRATED });
    let e = axis.run(60, |t| 0.05 * t);
    assert!((e.preload_n.expect("trusted").value / 3000.0 - 1.0).abs() < 0.01);
    let clean = Axis::new(CALIBRATED).drag(0.05);
    assert!((e.drag_force_n.expect("steady").value - clean - 5.0).abs() < 0.05);
}

/// Asserts that the estimate is silent for this reason and carries no preload.
fn silent(e: &Estimate, reason: Reason) {
    assert!(e.reasons.contains(reason), "{:?} lacks {reason:?}", e.reasons.first());
    assert_eq!(e.preload_n, None);
}

#[test]
fn every_reason_is_given_and_ends() {
    let steady = |t: f64| 0.05 * t;
    silent(&Axis::new(Params::ZHOU_2023).run(60, steady), Reason::NotCalibrated);
    silent(&Axis::new(CALIBRATED).run(10, steady), Reason::Settling);
    silent(&Axis::new(CALIBRATED).run(60, |_| 0.1), Reason::NoMotion);
    silent(&Axis::new(CALIBRATED).run(60, |t| 0.2 * t), Reason::SpeedOutOfRange);
    silent(&Axis::new(CALIBRATED).run(200, |t| 0.0005 * t), Reason::SpeedOutOfRange);
    // a triangle of 0.2 s
    let triangle = |t: f64| 0.05 * libm::fabs(t % 0.2 - 0.1);
    silent(&Axis::new(CALIBRATED).run(60, triangle), Reason::Reversing);
    silent(&Axis::new(CALIBRATED).run(60, |t| 0.04 * t * t), Reason::Accelerating);
    let mut cold = Axis { temperature_degc: 6.0, ..Axis::new(CALIBRATED) };
    cold.fault = |b| b.temperature = [3200; 16];
    silent(&cold.run(60, steady), Reason::TemperatureOutOfRange);
    silent(&Axis { preload_n: 400.0, ..Axis::new(CALIBRATED) }.run(60, steady), Reason::LoadOutOfRange);
    let stale = Axis::new(CALIBRATED).monitor.stale(7);
    silent(&stale, Reason::Stale);
    assert_eq!(stale.tick, 7);

    let faults: [(Reason, Fault); 5] = [
        (Reason::ForceAtRail, |b| b.force[3] = CODE_MAX),
        (Reason::ForceAtRail, |b| b.force[9] = 0),
        (Reason::ForceStuck, |b| b.force = [2100; 16]),
        (Reason::TemperatureMissing, |b| b.temperature = [CODE_MAX; 16]),
        (Reason::ForceAssists, |b| b.force = b.force.map(|c| 4096 - c)),
    ];
    for (reason, fault) in faults {
        let mut axis = Axis::new(CALIBRATED);
        assert!(axis.run(60, steady).reasons.is_empty());
        axis.fault = fault;
        // one window, and at most one publishing period, later
        silent(&axis.run(40, steady), reason);
        axis.fault = |_| {};
        let e = axis.run(50, steady);
        assert!(e.reasons.is_empty() && e.preload_n.is_some(), "{reason:?}: {:?}", e.reasons.first());
    }
}

#[test]
fn presliding_after_a_reversal_is_left_out() {
    // 0.1 s forward, then back for good: the window clears 0.42 s after the turn
    let path = |t: f64| if t < 1.0 { 0.02 * t } else { 0.02 * (2.0 - t) };
    let mut axis = Axis::new(CALIBRATED);
    assert!(axis.run(100, path).reasons.is_empty());
    silent(&axis.run(10, path), Reason::Reversing);
    silent(&axis.run(20, path), Reason::Reversing);
    let e = axis.run(30, path);
    assert_eq!((e.motion, e.reasons), (Motion::Backward, Reasons::NONE));
}

#[test]
fn lost_samples_empty_the_window_and_are_counted() {
    let steady = |t: f64| 0.05 * t;
    let mut axis = Axis::new(CALIBRATED);
    axis.run(60, steady);
    axis.tick += 7;
    let e = axis.run(13, steady);
    silent(&e, Reason::SamplesLost);
    assert_eq!(axis.state.lost_blocks(), 7);
    assert!(axis.run(30, steady).reasons.is_empty());
}

#[test]
fn nothing_survives_a_gap() {
    let mut axis = Axis::new(Params { publish_every_blocks: 1, ..CALIBRATED });
    // far enough for the ripple to be learnt
    axis.run(500, |t| 0.05 * t);
    assert!(axis.state.ripple().is_some());
    axis.tick += 7;
    silent(&axis.run(31, |t| 0.05 * t), Reason::SamplesLost);
    assert_eq!(axis.state.ripple(), None);
    // the first whole window after it is not trusted yet: a reversal may have passed unseen
    silent(&axis.run(1, |t| 0.05 * t), Reason::Reversing);
    let e = axis.run(3, |t| 0.05 * t);
    assert_eq!((e.motion, e.reasons), (Motion::Forward, Reasons::NONE));
}

#[test]
fn a_reversal_forgets_the_ripple() {
    let mut axis = Axis::new(CALIBRATED);
    let path = |t: f64| if t < 5.0 { 0.05 * t } else { 0.5 - 0.05 * t };
    axis.run(500, path);
    assert!(axis.state.ripple().is_some());
    axis.run(10, path);
    assert_eq!(axis.state.ripple(), None);
}

#[test]
fn a_heavy_axis_must_run_steadier_than_a_light_one() {
    // 9 mm/s²: within the spread of speed that is allowed, 0.9 N on 95 kg, 0.02 N on 2 kg
    let path = |t: f64| 0.05 * t + 0.0045 * t * t;
    assert!(Axis::new(CALIBRATED).run(60, path).reasons.is_empty());
    silent(&Axis::new(Params { moved_mass_kg: 95.0, ..CALIBRATED }).run(60, path), Reason::Accelerating);
}

#[test]
fn shaking_on_the_spot_is_reversing() {
    let mut axis = Axis::new(CALIBRATED);
    silent(&axis.run(64, |t| 2e-4 * libm::sin(core::f64::consts::TAU * t / 0.32)), Reason::Reversing);
}

#[test]
fn cold_oil_is_told_at_standstill_and_heavy_preload_in_motion() {
    let mut axis = Axis::new(CALIBRATED);
    axis.fault = |b| b.temperature = [3200; 16];
    let e = axis.run(60, |_| 0.1);
    silent(&e, Reason::TemperatureOutOfRange);
    silent(&e, Reason::NoMotion);
    silent(&Axis { preload_n: 8500.0, ..Axis::new(CALIBRATED) }.run(60, |t| 0.05 * t), Reason::LoadOutOfRange);
}

/// Each part of σ alone, against what the law makes of such a deviation.
#[test]
fn every_part_of_sigma_is_what_the_deviation_does() {
    const NONE: Uncertainty = Uncertainty {
        force_offset_n: 0.0,
        force_gain: 0.0,
        seals_n: 0.0,
        friction: 0.0,
        viscosity: 0.0,
        temperature_k: 0.0,
        ball_pass_ripple: 0.0,
    };
    // slow: a window far shorter than a ball pass sees all of the ripple
    const SPEED: f32 = 0.002;
    let law = CALIBRATED.law;
    let nu = |degc: f32| CALIBRATED.viscosity.at(degc).expect("inside").cst;
    let drag = Axis::new(CALIBRATED).drag(SPEED);
    let preload = |force: f32, nu: f32| law.preload(force, nu * SPEED).expect("inside");
    let sigma = |uncertainty: Uncertainty| {
        let e = Axis::new(Params { uncertainty, ..CALIBRATED }).run(100, |t| f64::from(SPEED) * t);
        e.preload_n.expect("trusted").sigma
    };
    let noise = sigma(NONE);
    for (uncertainty, force, viscosity) in [
        (Uncertainty { force_offset_n: 0.5, ..NONE }, 0.5, 1.0),
        (Uncertainty { force_gain: 0.02, ..NONE }, 0.02 * drag, 1.0),
        (Uncertainty { seals_n: 0.5, ..NONE }, 0.5, 1.0),
        (Uncertainty { friction: 0.02, ..NONE }, 0.02 * drag, 1.0),
        (Uncertainty { ball_pass_ripple: 0.02, ..NONE }, 0.02 * drag, 1.0),
        (Uncertainty { viscosity: 0.4, ..NONE }, 0.0, 1.4),
        (Uncertainty { temperature_k: 3.0, ..NONE }, 0.0, nu(27.0) / nu(30.0)),
    ] {
        let shift = (preload(drag + force, nu(30.0) * viscosity) - preload(drag, nu(30.0))).abs();
        let got = sigma(uncertainty);
        let alone = num::sqrt(got * got - noise * noise);
        // first order against a finite deviation, viscosity's being the largest
        assert!((alone / shift - 1.0).abs() < 0.2, "{uncertainty:?}: {alone} N for {shift} N");
    }
    // the speed's own scatter: a scale of a millimetre a count, where the film matters more
    let params = Params { uncertainty: NONE, ..CALIBRATED };
    let told = |params: Params| Axis::new(params).run(100, |t| 0.05 * t);
    let fine = told(params).preload_n.expect("trusted").sigma;
    let mut coarse = params;
    coarse.calibration.metres_per_count = 1e-3;
    let (e, drag) = (told(coarse), Axis::new(params).drag(0.05));
    let speed = e.speed_m_s.expect("moving");
    let at = |v: f32| law.preload(drag, nu(30.0) * v).expect("inside");
    let shift = (at(speed.value + speed.sigma) - at(speed.value)).abs();
    let got = e.preload_n.expect("trusted").sigma;
    let alone = num::sqrt(got * got - fine * fine);
    assert!((alone / shift - 1.0).abs() < 0.2, "{alone} N for {shift} N");
}

#[test]
fn a_frozen_encoder_is_named() {
    // the drive goes on (the force with it), the scale does not
    let mut axis = Axis::new(CALIBRATED);
    let force = axis.drag(0.05);
    assert!(axis.run(60, |t| 0.05 * t).reasons.is_empty());
    let c = axis.params.calibration.force;
    for n in 0..40u32 {
        let at = |k: usize| 0.6f64 + f64::from(n) * 0.01 + k as f64 / 1600.0;
        let code = c.code(force) as u16;
        let block = RawBlock {
            tick: 60 + n,
            force: core::array::from_fn(|k| code + (k % 2) as u16),
            temperature: [1900; 16],
            position: core::array::from_fn(|k| (0.05 * at(k).min(0.604) / 5e-6) as u16),
        };
        if let Some(e) = axis.monitor.step(&mut axis.state, &block) {
            silent(&e, Reason::EncoderStuck);
            assert_eq!((e.speed_m_s, e.motion), (None, Motion::Unknown));
        }
    }
}

#[test]
fn tracks_the_ripple_but_keeps_it_off_the_mean() {
    let mut axis = Axis::new(CALIBRATED);
    let c = axis.params.calibration.force;
    let drag = axis.drag(0.05);
    for n in 0..600u32 {
        let x = |k: usize| 0.05 * (f64::from(n) * 0.01 + k as f64 / 1600.0);
        let ripple = |k: usize| 0.2 * libm::cos(core::f64::consts::TAU * x(k) / 14.3e-3);
        let block = RawBlock {
            tick: n,
            force: core::array::from_fn(|k| (c.code(drag + ripple(k) as f32) + (k % 3) as f32 - 0.5) as u16),
            temperature: [(axis.params.calibration.thermistor.code(30.0) + 0.5) as u16; 16],
            position: core::array::from_fn(|k| (x(k) / 5e-6) as i64 as u16),
        };
        axis.monitor.step(&mut axis.state, &block);
    }
    let r = axis.state.ripple().expect("learnt");
    assert!((r.amplitude_n - 0.2).abs() < 0.03, "{r:?}");
}

#[test]
fn whatever_the_codes_no_number_without_trust() {
    // pseudo-random blocks: no panic, and a preload only without any reason
    let mut x = 1u64;
    let mut random = move || {
        x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (x >> 48) as u16
    };
    let monitor = Params { publish_every_blocks: 1, ..CALIBRATED }.build().expect("legal");
    let mut state = State::new();
    for n in 0..20_000u32 {
        let wild = n % 400 > 200;
        let block = RawBlock {
            tick: n + u32::from(n % 997 == 0),
            force: core::array::from_fn(|_| if wild { random() } else { 2300 + random() % 5 }),
            temperature: core::array::from_fn(|_| if wild { random() } else { 1700 }),
            position: core::array::from_fn(|k| if wild { random() } else { (n * 100 + 6 * k as u32) as u16 }),
        };
        if let Some(e) = monitor.step(&mut state, &block) {
            assert_eq!(e.preload_n.is_some(), e.reasons.is_empty());
            if let Some(p) = e.preload_n {
                assert!(p.value.is_finite() && p.sigma.is_finite() && p.sigma > 0.0);
            }
        }
    }
}
