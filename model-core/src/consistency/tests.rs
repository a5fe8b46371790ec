use super::*;
use crate::sample::{Measured, Motion, Reasons};

const PARAMS: Params = Params { calibrated: true, ..Params::ZHOU_2023 };

fn estimate(tick: u32, preload: f32, speed: f32, degc: f32) -> Estimate {
    let known = |value| Some(Measured { value, sigma: 0.01 * value });
    Estimate {
        tick,
        preload_n: known(preload),
        drag_force_n: known(20.0),
        speed_m_s: known(speed),
        temperature_degc: Some(degc),
        motion: Motion::Forward,
        reasons: Reasons::NONE,
    }
}

/// Strokes of 0.3 m to and fro at rising and falling speeds; `preload` of speed, place and tick.
fn strokes(count: usize, preload: impl Fn(f32, f32, u32) -> f32) -> Watch {
    let model = Consistency::new(&PARAMS);
    let mut watch = Watch::new();
    let (mut tick, mut place) = (0u32, 0.0f32);
    for n in 0..count {
        let speed = [0.01, 0.02, 0.04, 0.08][n / 2 % 4] * if n % 2 == 0 { 1.0 } else { -1.0f32 };
        for _ in 0..(0.3 / speed.abs() / 0.1) as u32 {
            tick += 10;
            place += 0.1 * speed;
            let noise = 1.0 + 0.003 * (((tick / 10).wrapping_mul(2_654_435_761) >> 16) as f32 / 32768.0 - 1.0);
            let known = estimate(tick, noise * preload(speed, place, tick), speed, 30.0);
            model.step(&mut watch, &known, Some(WorkingPoint { place_m: place, per_force: 1.1 }));
        }
        tick += 10;
        model.step(&mut watch, &Estimate { preload_n: None, ..estimate(tick, 1.0, 0.0, 30.0) }, None);
    }
    watch
}

#[test]
fn a_preload_that_depends_on_nothing_fits() {
    let verdict = strokes(200, |_, _, _| 3000.0).verdict();
    assert_eq!(verdict.misfit_since, None);
    // one temperature cannot be judged
    assert_eq!(verdict.judged, 0b0111);
    // a level that falls by a fifth is no misfit: the block is there to measure it
    let verdict = strokes(400, |_, _, tick| 3000.0 - 0.01 * tick as f32).verdict();
    assert_eq!(verdict.misfit_since, None, "{verdict:?}");
}

#[test]
fn what_it_depends_on_is_named() {
    let on = |verdict: Verdict| (verdict.worst.map(|(axis, _)| axis), verdict.misfit_since.is_some());
    assert_eq!(on(strokes(60, |v, _, _| 3000.0 * (1.0 + v.abs())).verdict()), (Some(Axis::Speed), true));
    assert_eq!(
        on(strokes(60, |v, _, _| if v > 0.0 { 3060.0 } else { 2940.0 }).verdict()),
        (Some(Axis::Direction), true)
    );
    let wave = |x: f32| 3000.0 * (1.0 + 0.04 * libm::sinf(20.0 * x));
    assert_eq!(on(strokes(60, |_, x, _| wave(x)).verdict()), (Some(Axis::Position), true));
}

#[test]
fn half_a_percent_is_significant_but_not_relevant() {
    let verdict = strokes(400, |v, _, _| if v > 0.0 { 3012.0 } else { 2988.0 }).verdict();
    let (axis, finding) = verdict.worst.expect("judged");
    assert_eq!((axis, verdict.misfit_since), (Axis::Direction, None));
    assert!(finding.strength > SIGNIFICANT && finding.share < RELEVANT, "{finding:?}");
}

#[test]
fn a_repaired_model_is_believed_again() {
    let model = Consistency::new(&PARAMS);
    let mut watch = Watch::new();
    let (mut raised, mut cleared) = (None, None);
    for n in 0..400u32 {
        let forward = n % 2 == 0;
        let off = if n < 100 { 0.03 } else { 0.0 } * if forward { 1.0 } else { -1.0 };
        let noise = 0.003 * ((n.wrapping_mul(2_654_435_761) >> 16) as f32 / 32768.0 - 1.0);
        for k in 0..10 {
            let speed = if forward { 0.02 } else { -0.02 };
            let known = estimate(20 * n + k, 3000.0 * (1.0 + off + noise), speed, 30.0);
            model.step(&mut watch, &known, Some(WorkingPoint { place_m: 0.0, per_force: 1.0 }));
        }
        match watch.verdict().misfit_since {
            Some(since) if raised.is_none() => raised = Some((n, since)),
            None if raised.is_some() && cleared.is_none() => cleared = Some(n),
            _ => {}
        }
    }
    let (raised, since) = raised.expect("3 % is a misfit");
    assert!(raised < 40 && since / 20 <= raised, "stroke {raised}, since tick {since}");
    assert!((101..250).contains(&cleared.expect("it fits again")), "{cleared:?}");
}

#[test]
fn bins_of_position_follow_the_stroke() {
    let mut places = Places::UNUSED;
    let mut bins = Bins::new();
    let mut last = 0;
    for n in 0..3000 {
        // a stroke of 1.3 m around 0.4 m, both ways
        let place = 0.4 + 0.65 * libm::sinf(n as f32 * 0.004);
        last = places.bin(place, &mut bins);
        bins.take(last, 0.0, 0.0);
        let (from, to) = bins.used();
        assert!(to - from < PLACES);
    }
    // 1.3 m in 32 bins of 10 mm times a power of two
    assert_eq!(places.width_m, 16.0 * PLACE_BIN_M / 2.0);
    let centre = (places.first + last as i32) as f32 * places.width_m;
    let place = 0.4 + 0.65 * libm::sinf(2999.0 * 0.004);
    assert!((0.0..places.width_m).contains(&(place - centre)), "{place} {centre}");
    // far beyond: nothing breaks
    for place in [1e6, -1e6, f32::NAN, f32::INFINITY] {
        assert!(places.bin(place, &mut bins) < PLACES);
    }
}
