//! Section B: the measured grid and the readings of the Hersey number; what no reading brings together.

use host_tools::paper::convention::{C2, C6, CONVENTIONS, QUOTED_MINIMA, Score, conformity_of_full_film};
use host_tools::paper::{oh, one_curve};
use model_core::contact::{ContactAngle, Guide};
use model_core::exact::Exact;
use model_core::reference::zhou_2023::{FRICTION, GUIDE, OIL};

use super::{ELSEWHERE, check, load, model, row, score, smallest_friction};

#[test]
fn b_1_ranges_over_the_measured_grid() {
    let mut rows = Vec::new();
    let table: [(f64, [&'static str; 8]); 3] = [
        (0.51, ["26.8", "477", "0.697", "1.819", "1.33e-3", "9.19e-3", "2.2e-6", "9.2e-4"]),
        (0.52, ["27.0", "490", "0.803", "2.113", "7.7e-4", "5.3e-3", "1.3e-6", "5.3e-4"]),
        (0.53, ["27.0", "497", "0.874", "2.306", "5.5e-4", "3.9e-3", "9.2e-7", "3.9e-4"]),
    ];
    for (f, want) in table {
        let m = model(f);
        let (low, high) = (load(&m, 500.0), load(&m, 9500.0));
        let (slip_low, slip_high) = (m.slip_ratio(low), m.slip_ratio(high));
        let got = [
            low,
            high,
            m.pressure_pa(low) / 1e9,
            m.pressure_pa(high) / 1e9,
            slip_low,
            slip_high,
            slip_low * 0.1 / 60.0,
            slip_high * 6.0 / 60.0,
        ];
        for (n, (got, want)) in got.into_iter().zip(want).enumerate() {
            rows.push(row(format!("B.1, f {f}, column {n}"), got, want));
        }
    }
    // C1, C2, C4, C6
    type Extremes = (usize, &'static str, &'static str);
    let hersey: [(f64, [Extremes; 4]); 2] = [
        (
            0.51,
            [
                (0, "8.1e-14", "1.26e-11"),
                (1, "4.8e-12", "7.6e-10"),
                (3, "2.8e-16", ELSEWHERE),
                (5, "3.2e-13", "5.05e-11"),
            ],
        ),
        (
            0.52,
            [
                (0, "6.9e-14", "1.10e-11"),
                (1, "4.2e-12", "6.6e-10"),
                (3, "1.4e-16", "2.2e-14"),
                (5, "1.6e-13", "2.53e-11"),
            ],
        ),
    ];
    for (f, lines) in hersey {
        for (c, low, high) in lines {
            let s = score(c, f);
            rows.push(row(format!("H of {}, f {f}, smallest", CONVENTIONS[c].name), s.hersey.0, low));
            if high != ELSEWHERE {
                rows.push(row(format!("H of {}, f {f}, largest", CONVENTIONS[c].name), s.hersey.1, high));
            }
        }
    }
    rows.push(row("100 cSt in Pa s", 100e-6 * host_tools::paper::convention::OIL_DENSITY_KG_M3, "0.088"));
    rows.push(row("VG 100 at 20 degC", OIL.viscosity_cst(20.0), "344"));
    rows.push(row("VG 100 at 25 degC", OIL.viscosity_cst(25.0), "244"));
    check(&rows);
}

#[test]
fn b_2_scores_of_the_readings() {
    let scores: Vec<Score> = (0..8).map(|c| score(c, 0.51)).collect();
    let mut rows = Vec::new();
    let columns: [[&'static str; 5]; 8] = [
        // k_sH smallest, largest; 8500 N spread, %; largest drag, N; spread of Table 2
        ["0.006", "0.94", "14", "85", "1.16"],
        ["0.36", "56", "75", "108", "1.67"],
        ["6.8", "1.07e3", "249", "1237", "20"],
        ["2e-5", "0.0033", "0", "85", "1.00"],
        ["0.001", "0.20", "8", "85", "1.08"],
        ["0.024", "3.75", "41", "83", "1.46"],
        ["0.021", "3.3", "41", "83", "1.48"],
        ["1.4", "225", "228", "702", "12"],
    ];
    for ((c, s), want) in CONVENTIONS.iter().zip(&scores).zip(columns) {
        let got = [s.exponent.0, s.exponent.1, 100.0 * s.spread_8500, s.drag_n.1, s.spread_of_table_2];
        for (n, (got, want)) in got.into_iter().zip(want).enumerate() {
            rows.push(row(format!("{} column {n}", c.name), got, want));
        }
    }
    let minima: [(usize, f64, [&'static str; 4]); 9] = [
        (0, 0.51, ["6.0", "6.0", "6.0", "6.0"]),
        (1, 0.51, ["0.3", "0.4", "0.6", "0.7"]),
        (2, 0.51, ["0.1", "0.1", "0.1", "0.1"]),
        (3, 0.51, ["6.0", "6.0", "6.0", "6.0"]),
        (4, 0.51, ["6.0", "6.0", "6.0", "6.0"]),
        (5, 0.51, ["6.0", "6.0", "5.5", "4.5"]),
        (6, 0.51, ["6.0", "6.0", "6.0", "5.0"]),
        (7, 0.51, ["0.2", "0.1", "0.1", "0.1"]),
        (5, 0.52, ["6.0", "6.0", "6.0", "6.0"]),
    ];
    for (c, f, want) in minima {
        for (n, (got, want)) in score(c, f).speed_of_minimum.into_iter().zip(want).enumerate() {
            rows.push(row(format!("{} speed of minimum {n}, f {f}", CONVENTIONS[c].name), got, want));
        }
    }
    let of_52 = score(C2, 0.52);
    rows.push(row("C2, 500 N, f 0.52: minimum at", of_52.speed_of_minimum[0], "0.3"));
    rows.push(row("C2, 1500 N, f 0.52: minimum at", of_52.speed_of_minimum[1], "0.5"));
    rows.extend([
        row("C1 rise at 4500 N, %", 100.0 * scores[0].rise[0], "0"),
        row("C2 rise at 4500 N, %", 100.0 * scores[1].rise[0], "125"),
        row("C2 rise at 7500 N, %", 100.0 * scores[1].rise[1], "103"),
        row("C3 at 7500 N, times", 1.0 + scores[2].rise[1], "20"),
        row("C4 rise, %", 100.0 * scores[3].rise[1], "0"),
        row("C5 rise, %", 100.0 * scores[4].rise[1], "0"),
        row("C6 rise at 4500 N, %", 100.0 * scores[5].rise[0], "0"),
        row("C6 rise at 7500 N, %", 100.0 * scores[5].rise[1], "1"),
        row("C7 rise, %", 100.0 * scores[6].rise[1], "0"),
        row("C8 at 4500 N, times", 1.0 + scores[7].rise[0], "10"),
        row("C2 mixed, %", 100.0 * (1.0 - scores[1].full_film), "26"),
        row("C2 full film, %", 100.0 * scores[1].full_film, "74"),
        row("C6 full film, %", 100.0 * scores[5].full_film, "10"),
        row("C6 full film, f 0.52, %", 100.0 * score(C6, 0.52).full_film, "0"),
        row("C6 smallest k_sH, f 0.52", score(C6, 0.52).exponent.0, "0.012"),
        row("C6 largest k_sH, f 0.52", score(C6, 0.52).exponent.1, "1.88"),
        row("C6 visits full film below f", conformity_of_full_film(), "0.5144"),
        row("500 N falls, C1, %", 100.0 * scores[0].fall_500, "33"),
        row("500 N falls, C2, %", 100.0 * scores[1].fall_500, "14"),
        row("500 N falls, C6, %", 100.0 * scores[5].fall_500, "43"),
        row("Fig. 5a, C6 at 0.1 m/min, %", 100.0 * scores[5].fall_with_load[0], "1.7"),
        row("allowed by Table 2", 1.19 / 0.81, "1.47"),
    ]);
    check(&rows);
    // which readings visit both regimes
    let both: Vec<bool> = scores.iter().map(|s| s.full_film > 0.0 && s.full_film < 1.0).collect();
    assert_eq!(both, [false, true, false, false, false, true, true, true]);
    assert_eq!(scores[0].full_film, 0.0, "C1 has no full film");
    assert_eq!(scores[2].full_film, 1.0, "C3 has no mixed lubrication");
    // Fig. 5a: C1 rises with the load; C2's dependence is strongest at 6 m/min
    assert!(scores[0].fall_with_load[0] < 0.0);
    assert!(scores[1].fall_with_load[1].abs() > scores[1].fall_with_load[0].abs());
}

#[test]
fn b_3_no_single_curve() {
    let power = |ratio| one_curve::power_of_load(&FRICTION, 0.6, ratio);
    let (speed, rise) = one_curve::minimum_and_rise(&FRICTION, 0.6, -1.0 / 3.0, 4500.0);
    check(&[
        row("k_sH at 6 m/min, 500 N", 10.0 * FRICTION.stribeck_exponent * FRICTION.hersey_of_minimum(), "26"),
        row("flat within 15 % up to k_sH", one_curve::flattest(&FRICTION, 1.15), "0.37"),
        row("power, flat within 15 %", power(1.15), "-1.50"),
        row("power, flat within 25 %", power(1.25), "-1.30"),
        row("power, within a factor 1.46", power(1.46), "-0.26"),
        row("4500 N, p = -1/3: minimum at, m/min", speed, "1.25"),
        row("4500 N, p = -1/3: rise, %", 100.0 * rise, "47"),
    ]);
}

#[test]
fn b_3_no_power_of_the_load_meets_both() {
    // minima within 0.4 to 0.9 m/min at 500 and 1500 N, and 8500 N flat within 15 %, for p from -1 to 2/3
    let lowest = FRICTION.stribeck_exponent * FRICTION.hersey_of_minimum();
    let meets = |p: f64, speed: f64| {
        let of_1500 = speed * 3.0_f64.powf(-p);
        let fastest = lowest * 6.0 / speed * 17.0_f64.powf(p);
        (0.4..=0.9).contains(&of_1500) && one_curve::spread(&FRICTION, fastest) <= 1.15
    };
    let powers = || (0..=200).map(|n| -1.0 + f64::from(n) / 120.0);
    let speeds = || (0..=100).map(|n| 0.4 + 0.005 * f64::from(n));
    assert!(!powers().any(|p| speeds().any(|v| meets(p, v))));
    // each of the two alone can be met
    assert!(powers().any(|p| speeds().any(|v| (0.4..=0.9).contains(&(v * 3.0_f64.powf(-p))))));
    assert!(one_curve::spread(&FRICTION, 0.3) <= 1.15);
}

#[test]
fn b_5_clearance_classes_make_plausible_preloads() {
    // half of the radial interference c falls to the upper rows, half to the lower: approach (c/2) cos 45 deg per ball
    let m = Exact::new(Guide { contact_angle: ContactAngle::Fixed, ..GUIDE }, FRICTION);
    let percent_of_rated = |micrometres: f64| {
        let approach = 0.5e-6 * micrometres * GUIDE.contact_angle_rad.cos();
        100.0 * m.preload_n((approach / m.contact().eps).powf(1.5)) / 62_300.0
    };
    check(&[
        row("C1, 11 um", percent_of_rated(11.0), "2.4"),
        row("C1 and C0, 19 um", percent_of_rated(19.0), "5.4"),
        row("C0, 29 um", percent_of_rated(29.0), "10.2"),
        row("ball pitch, mm", 93.0 / 13.0, "7.15"),
    ]);
}

#[test]
fn b_4_internal_mismatch() {
    let m = model(0.51);
    let drag = QUOTED_MINIMA.map(|(force, mu, _)| 52.0 * load(&m, force) * mu);
    let mut rows = vec![row("drag at 500 N", drag[0], "2.31"), row("drag at 1500 N", drag[1], "8.13")];
    for (c, want) in [(0, ["-48.8", "-40.0"]), (1, ["-35.7", "-15.3"]), (5, ["-48.8", "-37.6"])] {
        for (n, (got, want)) in score(c, 0.51).error_of_quoted.into_iter().zip(want).enumerate() {
            rows.push(row(format!("{} error {n}, %", CONVENTIONS[c].name), 100.0 * got.expect("a load"), want));
        }
    }
    // the best case at a constant contact angle, where F_p goes with Q
    let fixed = Exact::new(Guide { contact_angle: ContactAngle::Fixed, ..GUIDE }, FRICTION);
    for ((force, mu, _), want) in QUOTED_MINIMA.into_iter().zip(["-26.0", "-12.2"]) {
        let q = load(&fixed, force);
        let best = fixed.preload_n(q * mu / smallest_friction()) / fixed.preload_n(q) - 1.0;
        rows.push(row(format!("best case at {force} N, %"), 100.0 * best, want));
    }
    for (drag, wants) in [(25.0, ["46", "10", "-5"]), (5.0, ["171", "114", "67"])] {
        for (speed, want) in [0.1, 2.0, 6.0].into_iter().zip(wants) {
            let got = oh::disagreement(&m, drag, 0.088, 100.0, speed / 60.0).expect("a load");
            rows.push(row(format!("OH at {drag} N, {speed} m/min, %"), 100.0 * got, want));
        }
    }
    check(&rows);
}
