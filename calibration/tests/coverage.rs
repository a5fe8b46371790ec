//! Whether the stated intervals hold the truth as often as they say.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use calibration::cell::Cell;
use calibration::fit::{FrictionFit, NAMES, Seals};
use model_core::exact::Exact;
use model_core::friction::Friction;
use model_core::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED};
use simulation::sensor::Noise;

fn run(seed: u64, carriage: bool) -> (Friction, FrictionFit) {
    let mut noise = Noise::new(seed, u64::from(carriage));
    let mut factor = || 2f64.powf(noise.even());
    let truth = Friction {
        mu_coulomb: FRICTION.mu_coulomb * factor(),
        mu_viscous: FRICTION.mu_viscous * factor(),
        mu_stribeck: FRICTION.mu_stribeck * factor(),
        stribeck_exponent: FRICTION.stribeck_exponent * factor(),
    };
    let (guide, scale) = if carriage { (GUIDE_CARRIAGE_SPEED, 0.0528) } else { (GUIDE, 1.0) };
    let model = Exact::new(guide, truth);
    let mut cells = Vec::new();
    for load in 0..10 {
        let q = model.load_of_lateral_force(500.0 + 1000.0 * f64::from(load)).unwrap();
        for n in 0..20 {
            let v = if n < 10 { 0.1 * f64::from(n + 1) } else { 1.5 + 0.5 * f64::from(n - 10) } / 60.0;
            let clean = model.drag_force_n(q, 100.0 * scale, v);
            let force_n = clean * (1.0 + 0.01 * noise.gaussian()) + 0.1 * noise.gaussian();
            cells.push(Cell {
                load_per_ball_n: q,
                reference_n: 0.0,
                viscosity_cst: 100.0,
                speed_m_s: v,
                direction: 0.0,
                has_seals: false,
                force_n,
                sigma_n: f64::NAN,
            });
        }
    }
    let fit = FrictionFit::of(&cells, &model, scale, Seals::TakenOff).expect("a fit");
    (truth, fit)
}

/// Hits of the two intervals of a constant, over all seeds in which it is determined.
#[derive(Clone, Copy, Default)]
struct Hits {
    determined: usize,
    in_68: usize,
    in_95: usize,
}

/// 1000 grids of 10 loads and 20 speeds, constants drawn from half to twice the paper's, 1 % and 0.1 N of noise.
fn cover(carriage: bool) {
    const SEEDS: u64 = 1000;
    let mut hits = [Hits::default(); 4];
    for seed in 0..SEEDS {
        let (truth, fit) = run(seed, carriage);
        let truth = [truth.mu_coulomb, truth.mu_viscous, truth.mu_stribeck, truth.stribeck_exponent];
        for (n, hits) in hits.iter_mut().enumerate() {
            if fit.is_determined(n) {
                hits.determined += 1;
                hits.in_68 += usize::from(fit.interval(n, 0.6827).holds(truth[n]));
                hits.in_95 += usize::from(fit.interval(n, 0.95).holds(truth[n]));
            }
        }
    }
    for (name, hits) in NAMES.iter().zip(hits) {
        let share = |n: usize| 100.0 * n as f64 / hits.determined as f64;
        let (one, two) = (share(hits.in_68), share(hits.in_95));
        println!("{name:18} determined {:4} of {SEEDS}: {one:.1} %, {two:.1} %", hits.determined);
        assert!(hits.determined > 400, "{name}: too rarely determined to judge");
        assert!((one - 68.0).abs() <= 5.0, "{name}: {one} % of the 68 % intervals");
        assert!((two - 95.0).abs() <= 3.0, "{name}: {two} % of the 95 % intervals");
    }
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say_with_the_slip_speed() {
    cover(false);
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say_with_the_carriage_speed() {
    cover(true);
}
