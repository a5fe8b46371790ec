//! Turns, rests and distances in a context.

use super::*;

/// 1 kHz; positions from a function of time.
fn moved(seconds: f64, position: impl Fn(f64) -> f64) -> Run {
    let rows = (seconds * 1e3) as usize;
    let time_s: Vec<f64> = (0..rows).map(|n| n as f64 * 1e-3).collect();
    Run {
        position_m: Some(time_s.iter().map(|t| position(*t)).collect()),
        drag_force_n: vec![0.0; rows],
        parts: vec![Part { rows: 0..rows, segment: None, starts: Break::Start }],
        time_s,
        ..Run::default()
    }
}

/// Rests 1 s, goes 0.1 m in 1 s, rests 3 s, goes on 0.1 m in 1 s, turns at once and comes back 0.2 m in 2 s.
fn journey(t: f64) -> f64 {
    match t {
        t if t < 1.0 => 0.0,
        t if t < 2.0 => 0.1 * (t - 1.0),
        t if t < 5.0 => 0.1,
        t if t < 6.0 => 0.1 + 0.1 * (t - 5.0),
        t => 0.2 - 0.1 * (t - 6.0),
    }
}

#[test]
fn an_encoder_s_noise_at_rest_is_neither_motion_nor_a_turn() {
    // an encoder of 1 µm that flickers between two counts
    let noise = |t: f64| if ((t * 1e3).round() as i64 * 7919) % 13 < 6 { 0.0 } else { 1e-6 };
    let run = moved(8.0, |t| ((journey(t) + noise(t)) / 1e-6).round() * 1e-6);
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    let at = |t: f64| (t * 1e3) as usize;
    for (t, direction, travel, since, dwell, rests) in [
        (0.5, 1.0, 0.0, 0.0, 0.0, true),
        (1.5, 1.0, 0.05, 0.05, 1.0, false),
        (4.0, 1.0, 0.1, 0.1, 1.0, true),
        (5.5, 1.0, 0.15, 0.05, 3.0, false),
        (6.5, -1.0, 0.25, 0.05, 0.0, false),
        (7.9, -1.0, 0.39, 0.19, 0.0, false),
    ] {
        let n = at(t);
        assert_eq!((context.direction[n], context.at_rest[n]), (direction, rests), "{t}");
        assert!((context.travel_m[n] - travel).abs() < 1e-5, "{t}: {}", context.travel_m[n]);
        assert!((context.since_reversal_m[n] - since).abs() < 1e-4, "{t}: {}", context.since_reversal_m[n]);
        assert!((context.dwell_s[n] - dwell).abs() < 0.03, "{t}: {}", context.dwell_s[n]);
    }
    let turns = context.direction.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert_eq!(turns, 1);
}

#[test]
fn memory_restarts_with_a_part_and_travel_goes_on() {
    let mut run = moved(8.0, |t| if t < 6.0 { journey(t) } else { 5.0 + 0.1 * (t - 6.0) });
    run.parts = vec![
        Part { rows: 0..6000, segment: Some(1), starts: Break::Start },
        Part { rows: 6000..8000, segment: Some(2), starts: Break::Segment },
    ];
    let motion = Motion::of(&run);
    let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
    assert!((context.travel_m[7999] - 0.4).abs() < 1e-3, "{}", context.travel_m[7999]);
    assert_eq!(context.since_reversal_m[7000], FAR_M);
    assert_eq!(context.dwell_s[7000], 0.0);
}

/// A recording that begins as the carriage sets out counts as beginning at rest, whatever velocity its first window
/// shows; in one that begins in motion the distance so far is unknown.
#[test]
fn a_recording_may_begin_as_the_carriage_sets_out() {
    for (position, since_m) in [
        (&(|t: f64| 0.1 + 0.5 * t * t) as &dyn Fn(f64) -> f64, 0.5 * 0.1 * 0.1),
        (&|t: f64| 0.1 - 0.5 * t * t, 0.5 * 0.1 * 0.1),
        (&|t: f64| 0.1 + 0.02 * t + 0.5 * t * t, FAR_M),
        (&|t: f64| 0.1 + 0.05 * t, FAR_M),
    ] {
        let run = moved(0.5, |t| (position(t) / 1e-7).round() * 1e-7);
        let motion = Motion::of(&run);
        let context = Context::of(&simulations()[1], &run, &motion).expect("complete");
        assert_eq!(context.at_rest[0], since_m < FAR_M);
        assert!((context.since_reversal_m[100] - since_m).abs() < 1e-6, "{}", context.since_reversal_m[100]);
    }
}

#[test]
fn the_law_s_derivatives_are_those_of_the_law() {
    use crate::law::Factors;
    let run = rich(4000);
    let motion = Motion::of(&run);
    let simulation = &simulations()[0];
    let context = Context::of(simulation, &run, &motion).expect("complete");
    let force = |factors: Factors| simulation.steady(&factors, &run, &motion).expect("complete").force_n;
    let (more, thicker) = (
        force(Factors { preload: 1.01, ..Factors::default() }),
        force(Factors { viscosity: 1.01, ..Factors::default() }),
    );
    for n in 0..run.len() {
        let here = context.steady.force_n[n];
        let scale = 1e-4 * (1.0 + here.abs());
        assert!((here + 0.01 * context.by_preload_n[n] - more[n]).abs() < scale, "{n}");
        let second = 0.5 * 0.01 * 0.01 * (context.viscosity_curvature_n[n] - context.by_viscosity_n[n]);
        assert!((here + 0.01 * context.by_viscosity_n[n] + second - thicker[n]).abs() < 0.01 * scale, "{n}");
    }
    assert!(context.by_preload_n.iter().any(|x| *x > 10.0) && context.by_preload_n.iter().any(|x| *x < -10.0));
}
