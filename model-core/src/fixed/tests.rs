use super::*;
use crate::contact::Guide;
use crate::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED, GUIDE_PRODUCTION};

const GUIDES: [Guide; 4] = [
    GUIDE,
    GUIDE_CARRIAGE_SPEED,
    GUIDE_PRODUCTION,
    Guide { conformity_rail: 0.505, conformity_slider: 0.505, ..GUIDE },
];

const SLIP_F64: reduced::Reduced<f64> = reduced::Reduced::of(&GUIDE, &FRICTION, 600.0);

/// The constants can be made when compiling; an impossible scale then fails to compile.
const SLIP: Reduced = match Reduced::of(&SLIP_F64) {
    Ok(law) => law,
    Err(_) => panic!("a constant has no place in its format"),
};

fn invert(law: &Reduced, force: f32, viscous: f32) -> Result<f64, OutOfDomain> {
    law.preload(Newtons::from_f32(force), ViscousSpeed::from_f32(viscous)).map(Newtons::to_f64)
}

fn drag(law: &Reduced, preload: f32, viscous: f32) -> Result<f64, OutOfDomain> {
    law.drag_force(Newtons::from_f32(preload), ViscousSpeed::from_f32(viscous)).map(Newtons::to_f64)
}

/// ν V that makes the group `x` at a drag force.
fn viscous_speed(law: &reduced::Reduced<f64>, force: f32, x: f64) -> f32 {
    let s1 = libm::cbrt(f64::from(force) * law.loads_per_force);
    let size = if law.hersey_speed == HerseySpeed::Slip { s1 } else { 1.0 / s1 };
    (x / (law.film_per_viscous_speed * size)) as f32
}

/// Drag forces from 0.05 N to beyond the load limit; for each, ν V with x from 0 to just beyond its limit.
fn domain(law: reduced::Reduced<f64>) -> impl Iterator<Item = (f32, f32)> {
    (0..900).flat_map(move |f| {
        let force = (0.05 * libm::pow(1e5, f64::from(f) / 900.0)) as f32;
        let x = |n: i32| if n == 0 { 0.0 } else { 1e-4 * libm::pow(1.02e6, f64::from(n) / 500.0) };
        (0..=500).map(move |n| (force, viscous_speed(&law, force, x(n))))
    })
}

/// Whether the f64 build turns from number to error within 2e-6 of these inputs.
fn at_a_border(law: &reduced::Reduced<f64>, force: f32, viscous: f32) -> bool {
    let verdict = |f: f64, v: f64| law.preload(f64::from(force) * f, f64::from(viscous) * v).err();
    let (low, high) = (1.0 - 2e-6, 1.0 + 2e-6);
    verdict(low, low) != verdict(high, high) || verdict(low, high) != verdict(high, low)
}

#[test]
fn follows_the_floating_point_builds_over_the_whole_domain() {
    let (mut to_f32, mut to_f64, mut numbers) = (0.0_f64, 0.0_f64, 0);
    for guide in GUIDES {
        let double = reduced::Reduced::of(&guide, &FRICTION, 600.0);
        let single = double.to_f32();
        let law = Reduced::of(&double).expect("constants fit");
        for (force, viscous) in domain(double) {
            match (invert(&law, force, viscous), single.preload(force, viscous)) {
                (Ok(got), Ok(single)) => {
                    to_f32 = to_f32.max((got / f64::from(single) - 1.0).abs());
                    if let Ok(double) = double.preload(f64::from(force), f64::from(viscous)) {
                        to_f64 = to_f64.max((got / double - 1.0).abs());
                        numbers += 1;
                    }
                }
                (Err(got), Err(single)) if got == single => {}
                (got, single) => {
                    assert!(at_a_border(&double, force, viscous), "{force} N, {viscous}: {got:?}, {single:?}");
                }
            }
        }
    }
    assert!(numbers > 1_000_000);
    // not stale either
    assert!(to_f32 <= WORST_DIFFERENCE_TO_F32 && to_f32 > 0.8 * WORST_DIFFERENCE_TO_F32, "{to_f32:e}");
    assert!(to_f64 < 1.5e-7, "{to_f64:e}");
}

#[test]
fn drag_force_follows_and_is_inverted() {
    for guide in GUIDES {
        let double = reduced::Reduced::of(&guide, &FRICTION, 600.0);
        let law = Reduced::of(&double).expect("constants fit");
        let largest = double.preload_per_load * 600.0 / (1.0 + double.angle_per_load * libm::pow(600.0, 2.0 / 3.0));
        for p in 0..400 {
            let preload = (largest * (1.0 - 1e-6) * libm::pow(1e-4, f64::from(p) / 400.0)) as f32;
            for n in 0..100 {
                let viscous = if n == 0 { 0.0 } else { 1e-4 * libm::pow(1e6, f64::from(n) / 100.0) as f32 };
                let Ok(got) = drag(&law, preload, viscous) else { continue };
                let want = double.drag_force(f64::from(preload), f64::from(viscous)).expect("wider than the integers");
                assert!((got / want - 1.0).abs() < 1.5e-7, "{preload} N, {viscous}: {got} against {want}");
                let force = Newtons::from_f64(got);
                if let Ok(back) = law.preload(force, ViscousSpeed::from_f32(viscous)) {
                    assert!((back.to_f64() / f64::from(preload) - 1.0).abs() < 3e-7);
                } else {
                    // either x is above its limit or the load touches its own
                    assert!(double.preload(got * (1.0 + 1e-6), f64::from(viscous)).is_err());
                }
            }
        }
        // the film may be thicker here than the inversion allows, up to m = 64
        assert!(drag(&law, 1000.0, viscous_speed(&double, 5.0, 100.0)).is_ok());
        assert_eq!(drag(&law, 1000.0, 1e7), Err(OutOfDomain::ViscousSpeed));
    }
}

#[test]
fn says_what_the_f32_build_says_out_of_domain() {
    for guide in GUIDES {
        let double = reduced::Reduced::of(&guide, &FRICTION, 600.0);
        let (single, law) = (double.to_f32(), Reduced::of(&double).expect("constants fit"));
        let viscous = viscous_speed(&double, 20.0, 3.0);
        let forces =
            [0.0, -0.0, -3.0, -1e30, 9e-7, 1e-6, f32::MIN_POSITIVE, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        for force in forces {
            assert_eq!(invert(&law, force, viscous).err(), single.preload(force, viscous).err(), "{force}");
            assert_eq!(drag(&law, force, viscous), Err(OutOfDomain::Force), "{force}");
        }
        for bad in [-1.0, -1e-9, -1e30, f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(single.preload(20.0, bad), Err(OutOfDomain::ViscousSpeed));
            assert_eq!(invert(&law, 20.0, bad), Err(OutOfDomain::ViscousSpeed), "{bad}");
            assert_eq!(drag(&law, 20.0, bad), Err(OutOfDomain::ViscousSpeed), "{bad}");
        }
        for (force, viscous) in
            [(300.0, viscous), (20.0, 0.0), (20.0, 1e5), (1e9, 0.0), (2e9, 0.0), (1e-5, 0.0), (0.0, -1.0)]
        {
            assert_eq!(invert(&law, force, viscous).err(), single.preload(force, viscous).err(), "{force}, {viscous}");
        }
        for preload in [2e4, 1e5, 1e9] {
            assert_eq!(single.drag_force(preload, viscous), Err(OutOfDomain::Load));
            assert_eq!(drag(&law, preload, viscous), Err(OutOfDomain::Load));
        }
    }
}

#[test]
fn more_drag_is_more_preload() {
    for guide in GUIDES {
        let double = reduced::Reduced::of(&guide, &FRICTION, 600.0);
        let law = Reduced::of(&double).expect("constants fit");
        // the seams of the mantissa are the powers of two
        for octave in -4..7 {
            for offset in [1.0, 1.17, 1.41, 1.73] {
                for x in [0.0, 0.3, 1.0, 2.6, 9.0, 40.0, 87.0] {
                    let start = offset * libm::exp2(f64::from(octave));
                    let viscous = ViscousSpeed::from_f32(viscous_speed(&double, start as f32, x));
                    let mut last = 0.0;
                    for step in -40..40 {
                        let force = Newtons::from_f64(start * (1.0 + 1e-6 * f64::from(step)));
                        let Ok(preload) = law.preload(force, viscous) else { break };
                        assert!(preload.to_f64() > last, "{} N", force.to_f64());
                        last = preload.to_f64();
                    }
                }
            }
        }
    }
}

/// Debug builds check every bound: no law that [`Reduced::of`] accepts and no input break one.
#[test]
fn bounds_hold_at_the_corners_of_the_constants() {
    let area = libm::pow(SLIP_F64.load_limit_n, 2.0 / 3.0);
    let (mut state, mut answered) = (1u64, 0);
    for corner in 0..64u32 {
        let pick = |bit: u32, most: f64, least: f64| if corner >> bit & 1 == 1 { most } else { least };
        let law = Reduced::of(&reduced::Reduced {
            hersey_speed: if corner & 1 == 1 { HerseySpeed::Slip } else { HerseySpeed::Carriage },
            angle_per_load: pick(1, 0.999_999 / area, 0.0),
            slip_1: pick(2, 0.249_999 / area, 0.0),
            slip_2: pick(3, 0.062_499 / (area * area), 0.0),
            viscous: pick(4, 1.44, 0.0),
            stribeck: pick(5, 4.0, 0.0),
            ..SLIP_F64
        })
        .expect("within the bounds");
        for _ in 0..20_000 {
            let mut next = || {
                // MMIX by Knuth; the upper bits decide the size, the lower ones the digits
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 1 >> (state >> 58)) as i64
            };
            let (force, viscous) = (Newtons::from_bits(next()), ViscousSpeed::from_bits(next()));
            if let Ok(preload) = law.preload(force, viscous) {
                assert!(preload > Newtons::from_bits(-1) && preload < Newtons::MAX);
                answered += 1;
            }
            if let Ok(drag) = law.drag_force(force, viscous) {
                assert!(drag > Newtons::from_bits(-1) && drag < Newtons::MAX);
            }
        }
    }
    assert!(answered > 50_000, "{answered}");
}

#[test]
fn names_the_constant_without_a_place() {
    assert_eq!(Reduced::of(&SLIP_F64), Ok(SLIP));
    let cases = [
        (reduced::Reduced { viscous: 1.5, ..SLIP_F64 }, "viscous"),
        (reduced::Reduced { stribeck: 4.1, ..SLIP_F64 }, "stribeck"),
        (reduced::Reduced { slip_1: -1e-9, ..SLIP_F64 }, "slip_1"),
        (reduced::Reduced { slip_2: 2e-5, ..SLIP_F64 }, "slip_2"),
        (reduced::Reduced { angle_per_load: 0.02, ..SLIP_F64 }, "angle_per_load"),
        (reduced::Reduced { load_limit_n: 2e8, ..SLIP_F64 }, "load_limit_n"),
        (reduced::Reduced { film_per_viscous_speed: 0.0, ..SLIP_F64 }, "film_per_viscous_speed"),
    ];
    for (law, name) in cases {
        assert_eq!(Reduced::of(&law), Err(Error::OutOfRange(name)));
    }
    let law = reduced::Reduced { loads_per_force: f64::NAN, ..SLIP_F64 };
    assert_eq!(Reduced::of(&law), Err(Error::NonFinite("loads_per_force")));
}
