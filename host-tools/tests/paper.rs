//! The computed figures of the checked specification of the paper's model (its sections A, B and C), each within half
//! a unit of its last printed digit. What cannot be reproduced stands in a list with both numbers and is tested to
//! differ, so that the list cannot rot.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

use host_tools::paper::conditioning::{conditioning, error_of_viscosity, slopes, slopes_over};
use host_tools::paper::convention::{C2, C6, CONVENTIONS, QUOTED_MINIMA, Score, conformity_of_full_film};
use host_tools::paper::{hertz, oh, one_curve, printed, slip_series};
use model_core::contact::{ContactAngle, Ellipse, Guide, HerseySpeed, ROLLING_LINE};
use model_core::exact::Exact;
use model_core::reduced::Reduced;
use model_core::reference::zhou_2023::{FRICTION, GUIDE, OIL};

/// What, got, as printed; the printed text decides the tolerance.
type Row = (String, f64, &'static str);

fn row(what: impl Into<String>, got: f64, printed: &'static str) -> Row {
    (what.into(), got, printed)
}

/// Value and half a unit of the last printed digit of `-1.34`, `2.33067e7`, `85`.
fn read(printed: &str) -> (f64, f64) {
    let value: f64 = printed.parse().expect("a number");
    let (mantissa, exponent) = printed.split_once('e').map_or((printed, 0), |(m, e)| (m, e.parse().expect("exponent")));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len() as i32);
    (value, 0.5 * 10_f64.powi(exponent - decimals))
}

fn misses((_, got, printed): &Row) -> bool {
    let (value, half) = read(printed);
    // a value that ends in 5 may have been rounded either way: one part in 1e9 for the two programs' arithmetic
    // NaN misses
    let within = (got - value).abs() <= half * (1.0 + 1e-9) + 1e-12 * value.abs();
    !within
}

fn check(rows: &[Row]) {
    let wrong: Vec<String> = rows
        .iter()
        .filter(|r| misses(r))
        .map(|(what, got, printed)| format!("{what}: got {got:.9e}, printed {printed}"))
        .collect();
    assert!(wrong.is_empty(), "{} of {} figures differ:\n{}", wrong.len(), rows.len(), wrong.join("\n"));
}

/// Stands in a table for a figure of [`NOT_REPRODUCED`].
const ELSEWHERE: &str = "see NOT_REPRODUCED";

/// What cannot be reproduced: the figure, what comes out here, as printed.
const NOT_REPRODUCED: [(&str, f64, &str); 23] = [
    // a slip of the last digits
    ("B.1 largest H, SI units, sliding speed, f 0.51", 4.446e-14, "4.5e-14"),
    ("C.1 m_v", 0.064_632_541_08, "0.0646325408"),
    ("C.1 kap, f 0.52", 9.632_193e-4, "9.63220e-4"),
    ("C.1 largest error of the slip series, f 0.51", 5.53e-6, "5.6e-6"),
    ("C.3 500 N, 6 m/min, +5 % viscosity, %", 0.804_56, "0.81"),
    ("C.3 9500 N, 0.1 m/min, +1 % speed, %", 0.024_674, "0.03"),
    // the range of the printed fit is not stated; with the inferred one the rest is 1e-6
    ("C.1 chi2, f 0.51", 9.582_036e-8, "9.582044e-8"),
    ("C.1 chi2, f 0.52", 3.985_868e-8, "3.985865e-8"),
    // the printed value is the most extreme of 1400 drawn points, this one that of the whole domain
    ("C.3 C2, smallest dlnF_p/dln(nu V)", -1.3483, "-1.34"),
    // the working points behind these are not stated; here the whole measured grid
    ("C.3 oil at 30 degC taken for 40, C6, least %", -10.44, "-10.5"),
    ("C.3 oil at 30 degC taken for 40, C6, most %", 11.82, "10.5"),
    ("C.3 oil at 20 degC taken for 40, C6, least %", -19.74, "-18.6"),
    ("C.3 oil at 20 degC taken for 40, C6, most %", 39.27, "37.6"),
    ("C.3 oil at 30 degC taken for 40, C2, least %", -9.23, "5"),
    ("C.3 oil at 30 degC taken for 40, C2, most %", 87.47, "77"),
    ("C.3 oil at 20 degC taken for 40, C2, least %", -17.66, "25"),
    ("C.3 oil at 20 degC taken for 40, C2, most %", 305.16, "267"),
    // one round number stands for 4500 and 7500 N; it fits only one of them
    ("B.2 C3, 6 m/min over the minimum at 4500 N", 22.163, "20"),
    ("B.2 C8, 6 m/min over the minimum at 7500 N", 11.558, "10"),
    // printed under F_p of the split block, but these are errors of the load per ball
    ("B.4 best case of F_p at 500 N, %", -25.85, "-26.0"),
    ("B.4 best case of F_p at 1500 N, %", -12.02, "-12.2"),
    // the angle is not stated; the printed figures belong to the unloaded 45 degrees, this to the loaded angle
    ("A.3 printed Eq. 14, gamma 45, loaded contact angle", -1.1499, "-1.013"),
    // 10.52: "10-16 %" cuts off where its table rounds
    ("0 half a newton at 500 N, least %", 10.519, "10"),
];

#[test]
fn what_is_not_reproduced_still_is_not() {
    let m = model(0.51);
    let percent = |e: Option<f64>| 100.0 * e.expect("within the geometry");
    let at = |force, v| conditioning(&m, load(&m, force), 100.0, v / 60.0);
    let [_, slopes_c2] = slopes_over(&carriage(0.51), (26.0, 540.0), (20.0 * 0.0528, 400.0 * 0.0528));
    let cold = |model: &Exact, degc, scale: f64| {
        error_of_viscosity(model, scale * OIL.viscosity_cst(degc), scale * 100.0).expect("within the geometry")
    };
    let c6 = [30.0, 20.0].map(|t| cold(&m, t, 1.0));
    let c2 = [30.0, 20.0].map(|t| cold(&carriage(0.51), t, 0.0528));
    let best = QUOTED_MINIMA.map(|(force, mu, _)| {
        let q = load(&m, force);
        100.0 * (m.preload_n(q * mu / smallest_friction()) / m.preload_n(q) - 1.0)
    });
    let q_5500 = load(&m, 5500.0);
    let quarter = 45_f64.to_radians();
    let got = [
        score(3, 0.51).hersey.1,
        Reduced::of(&GUIDE, &FRICTION, 1150.0).viscous,
        Reduced::of(&with_conformity(0.52), &FRICTION, 1150.0).angle_per_load,
        slip_series::fit(&m, 1153.08_f64.powf(2.0 / 3.0)).error,
        percent(at(500.0, 6.0).map(|c| c.viscosity)),
        percent(at(9500.0, 0.1).map(|c| c.speed)),
        slip_series::fit(&m, 1153.08_f64.powf(2.0 / 3.0)).chi_2,
        slip_series::fit(&model(0.52), 1153.08_f64.powf(2.0 / 3.0)).chi_2,
        slopes_c2.0,
        100.0 * c6[0].0,
        100.0 * c6[0].1,
        100.0 * c6[1].0,
        100.0 * c6[1].1,
        100.0 * c2[0].0,
        100.0 * c2[0].1,
        100.0 * c2[1].0,
        100.0 * c2[1].1,
        1.0 + score(2, 0.51).rise[0],
        1.0 + score(7, 0.51).rise[1],
        best[0],
        best[1],
        printed::slip_ratio(&m, q_5500, m.contact_angle_rad(q_5500), quarter, 0.0),
        percent(at(500.0, 0.1).map(|c| c.offset)),
    ];
    for ((what, ours, printed), got) in NOT_REPRODUCED.into_iter().zip(got) {
        // ours to the digits above, which is all that the list claims
        assert!((got / ours - 1.0).abs() < 1e-3, "{what}: got {got}, listed {ours}");
        assert!(misses(&row(what, got, printed)), "{what}: {got} does reproduce {printed}; take it off the list");
    }
}

fn with_conformity(f: f64) -> Guide {
    Guide { conformity_rail: f, conformity_slider: f, ..GUIDE }
}

fn model(f: f64) -> Exact {
    Exact::new(with_conformity(f), FRICTION)
}

fn carriage(f: f64) -> Exact {
    Exact::new(Guide { hersey_speed: HerseySpeed::Carriage, ..with_conformity(f) }, FRICTION)
}

fn load(model: &Exact, lateral_n: f64) -> f64 {
    model.load_of_lateral_force(lateral_n).expect("within the geometry")
}

fn smallest_friction() -> f64 {
    FRICTION.coefficient(FRICTION.hersey_of_minimum())
}

fn score(convention: usize, f: f64) -> Score {
    CONVENTIONS[convention].score(f).expect("within the geometry")
}

#[test]
fn a_1_and_a_2_constants_of_equations_5_20_and_21() {
    let [_, slope, _, decay] = printed::EQUATION_21;
    let worst = |top: f64| {
        (0..200_000)
            .map(|n| 1e-15 * (top / 1e-15_f64).powf(f64::from(n) / 199_999.0))
            .map(|h| (printed::coefficient_of_equation_21(h) / FRICTION.coefficient(h) - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let lowest = FRICTION.hersey_of_minimum();
    check(&[
        row("4 mu_c", 4.0 * FRICTION.mu_coulomb, "0.00728"),
        row("8/3 mu_v", 8.0 / 3.0 * FRICTION.mu_viscous, "2.33067e7"),
        row("8/3 mu_v, section 0", 8.0 / 3.0 * FRICTION.mu_viscous, "2.3307e7"),
        row("4 mu_s", 4.0 * FRICTION.mu_stribeck, "0.0064"),
        row("2/3 k_s", FRICTION.stribeck_exponent / 1.5, "4.95333e10"),
        row("2/3 k_s, section 0", FRICTION.stribeck_exponent / 1.5, "4.9533e10"),
        row("2.33e7 too small, %", 100.0 * (slope / (8.0 / 3.0 * FRICTION.mu_viscous) - 1.0), "-0.029"),
        row("4.95e10 too small, %", 100.0 * (decay / (FRICTION.stribeck_exponent / 1.5) - 1.0), "-0.067"),
        row("Eq. 21 against Eq. 20 below k_s H = 5", worst(5.0 / FRICTION.stribeck_exponent), "1.4e-4"),
        row("Eq. 21 against Eq. 20 below H = 1e-8", worst(1e-8), "2.8e-4"),
        row("factor of Eq. 5", 0.5 * 2.25_f64.cbrt(), "0.65519"),
        row("smallest mu", smallest_friction(), "0.0022447"),
        row("its H", lowest, "3.5131e-11"),
        row("its k_s H", FRICTION.stribeck_exponent * lowest, "2.6102"),
        row("k_s H = 1 at", 1.0 / FRICTION.stribeck_exponent, "1.346e-11"),
        row("mu(0)", FRICTION.coefficient(0.0), "0.00342"),
        row("500 N minimum below Eq. 20, %", 100.0 * (1.0 - 0.00166 / smallest_friction()), "26.0"),
        row("1500 N minimum below Eq. 20, %", 100.0 * (1.0 - 0.00197 / smallest_friction()), "12.2"),
        row("film thickness 1/mu_v, um", 1e6 / FRICTION.mu_viscous, "0.114"),
        row("the same read as C6, nm", 1e9 * 0.088 / 100.0 / FRICTION.mu_viscous, "0.1"),
        row("viscosity factor of C6, thousands", 100.0 / 0.088 / 1e3, "1"),
    ]);
}

#[test]
fn a_3_rolling_line_and_equation_14_as_printed() {
    let m = model(0.51);
    let q = load(&m, 5500.0);
    // the figures belong to the unloaded contact angle
    let slip =
        |gamma: f64, dash: f64| printed::slip_ratio(&m, q, 45_f64.to_radians(), gamma.to_radians(), dash.to_radians());
    check(&[
        row("c", ROLLING_LINE, "0.347296355"),
        row("gamma 0", slip(0.0, 0.0), "-0.00644"),
        row("gamma 45, gamma' 0", slip(45.0, 0.0), "-1.013"),
        row("gamma 45, gamma' 5", slip(45.0, 5.0), "-0.854"),
        row("gamma 30", slip(30.0, 0.0), "-0.588"),
        row("gamma 10", slip(10.0, 0.0), "-0.184"),
        row("corrected, %", 100.0 * m.slip_ratio(q), "0.6"),
    ]);
    // gamma and gamma' cancel from the corrected form, and zero sliding is zero of the Coulomb balance
    assert!((3.0 * ROLLING_LINE - ROLLING_LINE.powi(3) - 1.0).abs() < 1e-15);
}

#[test]
fn a_4_contact_angle() {
    let table: [(f64, [[&'static str; 4]; 3]); 3] = [
        (0.51, [["45.82", "45.42", "0.7", "1.5"], ["47.26", "46.20", "2.0", "4.2"], ["50.13", "47.94", "4.5", "10.3"]]),
        (0.52, [["45.49", "45.25", "0.4", "0.9"], ["46.37", "45.71", "1.2", "2.5"], ["48.19", "46.74", "2.8", "6.1"]]),
        (0.53, [["45.36", "45.18", "0.3", "0.6"], ["46.01", "45.52", "0.9", "1.8"], ["47.38", "46.27", "2.1", "4.4"]]),
    ];
    let mut rows = Vec::new();
    for (f, lines) in table {
        for (q, want) in [27.0, 130.0, 500.0].into_iter().zip(lines) {
            let m = model(f);
            let (exact, letter) = (m.contact_angle_rad(q), printed::contact_angle_rad(m.guide(), q));
            let got = [
                exact.to_degrees(),
                letter.to_degrees(),
                100.0 * (letter.cos() / exact.cos() - 1.0),
                100.0 * (45_f64.to_radians().cos() / exact.cos() - 1.0),
            ];
            for (n, (got, want)) in got.into_iter().zip(want).enumerate() {
                rows.push(row(format!("f {f}, Q {q}, column {n}"), got, want));
            }
        }
    }
    check(&rows);
}

#[test]
fn a_5_hertz_coefficients() {
    let names = ["F", "kappa", "a*", "b*", "xi", "k_a", "k_b", "k_P", "eps_H", "s0/um", "k_sH coefficient"];
    let table: [(f64, [&'static str; 11]); 7] = [
        (
            0.505,
            [
                "0.98039",
                "18.29343",
                "5.98378",
                "0.32710",
                "0.45698",
                "2.074415e-4",
                "1.133968e-5",
                "2.02976e8",
                "1.74692e-7",
                "63.5",
                "0.093770",
            ],
        ),
        (
            0.510,
            [
                "0.96154",
                "12.21469",
                "4.57987",
                "0.37495",
                "0.54125",
                "1.582664e-4",
                "1.295705e-5",
                "2.32834e8",
                "2.07568e-7",
                "127.0",
                "0.0473504",
            ],
        ),
        (
            0.515,
            [
                "0.94340",
                "9.63167",
                "3.91628",
                "0.40660",
                "0.59472",
                "1.349162e-4",
                "1.400756e-5",
                "2.52647e8",
                "2.28780e-7",
                "190.5",
                "0.031558",
            ],
        ),
        (
            0.520,
            [
                "0.92593",
                "8.13632",
                "3.50605",
                "0.43091",
                "0.63408",
                "1.204207e-4",
                "1.480040e-5",
                "2.67896e8",
                "2.44658e-7",
                "254.0",
                "0.023598",
            ],
        ),
        (
            0.525,
            [
                "0.90909",
                "7.13961",
                "3.21929",
                "0.45091",
                "0.66516",
                "1.102484e-4",
                "1.544180e-5",
                "2.80460e8",
                "2.57400e-7",
                "317.5",
                "0.018805",
            ],
        ),
        (
            0.530,
            [
                "0.89286",
                "6.41854",
                "3.00398",
                "0.46802",
                "0.69073",
                "1.025823e-4",
                "1.598218e-5",
                "2.91228e8",
                "2.68056e-7",
                "381.0",
                "0.015607",
            ],
        ),
        (
            0.540,
            [
                "0.86207",
                "5.43139",
                "2.69662",
                "0.49649",
                "0.73100",
                "9.158453e-5",
                "1.686208e-5",
                "3.09178e8",
                "2.85242e-7",
                "508.0",
                "0.011612",
            ],
        ),
    ];
    let mut rows = Vec::new();
    for (f, want) in table {
        let m = model(f);
        let c = m.contact();
        let e = Ellipse::of_groove(f);
        let got = [
            (1.0 / f) / (4.0 - 1.0 / f),
            e.kappa,
            e.a,
            e.b,
            e.approach,
            c.k_a,
            c.k_b,
            c.k_p,
            c.eps,
            1e6 * c.s0,
            FRICTION.stribeck_exponent * c.k_u / c.k_p,
        ];
        for ((name, got), want) in names.into_iter().zip(got).zip(want) {
            rows.push(row(format!("f {f}: {name}"), got, want));
        }
    }
    for (f, want) in [(0.51, ["2.1", "-1.0", "-2.0", "1.1"]), (0.52, ["0.6", "-0.3", "-0.7", "0.35"])] {
        for (n, (got, want)) in hertz::error_of_fits(f).into_iter().zip(want).enumerate() {
            rows.push(row(format!("Brewe-Hamrock, f {f}, column {n}, %"), 100.0 * got, want));
        }
    }
    check(&rows);
    assert!(hertz::error_of_fits(0.53).iter().all(|e| e.abs() < 0.0012), "all below 0.12 % at f = 0.53");
}

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

#[test]
fn c_1_reduced_form() {
    let five_one = Reduced::of(&GUIDE, &FRICTION, 1150.0);
    // The block's own series is exact at two loads; the printed one is the best up to a load that is not stated.
    // 1153.08 N is inferred: it brings out both chi1, and both chi2 to 1e-6.
    let [best_51, best_52] = [0.51, 0.52].map(|f| slip_series::fit(&model(f), 1153.08_f64.powf(2.0 / 3.0)));
    let contact = *model(0.51).contact();
    check(&[
        row("KX", five_one.film_per_viscous_speed, "0.0473504098"),
        row("m_s", five_one.stribeck, "0.8791208791"),
        row("4 Z_b mu_c", 52.0 * FRICTION.mu_coulomb, "0.09464"),
        row("its inverse", five_one.loads_per_force, "10.56635672"),
        row("kap, f 0.51", contact.eps / contact.s0, "1.634391e-3"),
        row("chi1, f 0.51", best_51.chi_1, "2.334997e-4"),
        row("chi1, f 0.52", best_52.chi_1, "1.404872e-4"),
        row("slip ratio, f 0.52", best_52.error, "1.6e-6"),
    ]);
}

#[test]
fn c_2_uniqueness() {
    let slope_of_friction = |x: f64| {
        let h = x / FRICTION.stribeck_exponent;
        h * FRICTION.slope(h) / FRICTION.coefficient(h)
    };
    let (at, steepest) = (1..100_000)
        .map(|n| 1e-4 * f64::from(n))
        .map(|x| (x, slope_of_friction(x)))
        .fold((0.0, 0.0), |best, next| if next.1 < best.1 { next } else { best });
    let m = model(0.51);
    check(&[
        row("steepest fall of mu", steepest, "-0.18668"),
        row("its k_sH", at, "0.959"),
        row("smallest dlnF_f/dlnQ, slip", 1.0 + steepest / 3.0, "0.9378"),
        row("largest dlnF_f/dlnQ, carriage", 1.0 - steepest / 3.0, "1.0622"),
        row("section 0: smallest, slip", 1.0 + steepest / 3.0, "0.938"),
        row("section 0: largest, carriage", 1.0 - steepest / 3.0, "1.062"),
        row("geometry ends at Q", m.load_limit_n().floor(), "8073"),
        row("q at the smallest measured load", m.hersey_load_exponent(26.0), "0.3347"),
        row("q at 500 N a ball", m.hersey_load_exponent(500.0), "0.3435"),
    ]);
    assert!((slope_of_friction(1e9) - 1.0).abs() < 1e-6, "mu goes with H for large H");
    // the preload's exponent stays above one third up to the end of the geometry
    for q in [1.0, 100.0, 8000.0] {
        let (per_force, _) = slopes(&m, q, 0.0, 0.05);
        assert!(per_force > 1.0 / 3.0 && per_force < 1.0, "{q}: {per_force}");
    }
}

#[test]
fn c_3_conditioning() {
    let m = model(0.51);
    let mut rows = Vec::new();
    let ranges: [(f64, [&'static str; 4]); 3] = [
        (30.0, ["0.940", "1.039", "0.003", "0.191"]),
        (100.0, ["0.896", "1.057", "-0.122", "0.197"]),
        (330.0, ["0.813", "1.057", "-0.365", "0.197"]),
    ];
    for (nu, want) in ranges {
        // the box of loads per ball that the printed digits belong to
        let [force, viscous] = slopes_over(&m, (26.0, 500.0), (nu, nu));
        for (n, (got, want)) in [force.0, force.1, viscous.0, viscous.1].into_iter().zip(want).enumerate() {
            rows.push(row(format!("C6, nu {nu}, column {n}"), got, want));
        }
    }
    // the vectors' domain: 26 to 540 N a ball, 20 to 400 cSt
    let [force, viscous] = slopes_over(&carriage(0.51), (26.0, 540.0), (20.0 * 0.0528, 400.0 * 0.0528));
    rows.extend([
        row("C2 smallest S_F", force.0, "0.88"),
        row("C2 largest S_F", force.1, "1.44"),
        row("C2 largest S_n", viscous.1, "0.17"),
    ]);
    // lateral force, speed; then F_f, F_p, and the five errors in %
    let table: [(f64, f64, [&'static str; 7]); 6] = [
        (500.0, 0.1, ["4.72", "486", "0.99", "0.05", "0.01", "10.5", "413"]),
        (500.0, 6.0, ["3.31", "486", "1.05", ELSEWHERE, "0.17", "15.8", "615"]),
        (1500.0, 2.0, ["11.18", "1416", "1.04", "0.90", "0.18", "4.7", "189"]),
        (4500.0, 2.0, ["30.60", "4018", "1.03", "0.94", "0.19", "1.7", "67"]),
        (9500.0, 0.1, ["82.62", "7975", "0.95", "0.12", ELSEWHERE, "0.57", "23"]),
        (9500.0, 6.0, ["57.03", "7975", "0.90", "-0.61", "-0.12", "0.79", "31"]),
    ];
    for (force, speed, want) in table {
        let c = conditioning(&m, load(&m, force), 100.0, speed / 60.0).expect("within the geometry");
        let got = [c.force, c.viscosity, c.speed, c.offset, c.seals].map(|e| 100.0 * e);
        let got = [c.drag_n, c.preload_n].into_iter().chain(got);
        for (n, (got, want)) in got.zip(want).enumerate().filter(|(_, (_, want))| *want != ELSEWHERE) {
            rows.push(row(format!("{force} N, {speed} m/min, column {n}"), got, want));
        }
    }
    // what the summary says of 0.1, 2 and 6 m/min
    let over = |model: &Exact, force: f64, nu: f64| {
        [0.1, 2.0, 6.0].map(|v| conditioning(model, load(model, force), nu, v / 60.0).expect("within the geometry"))
    };
    let (light, heavy) = (over(&m, 500.0, 100.0), over(&m, 9500.0, 100.0));
    let largest = |values: [f64; 3]| 100.0 * values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let smallest = |values: [f64; 3]| 100.0 * values.into_iter().fold(f64::INFINITY, f64::min);
    rows.extend([
        row("0.5 N at 500 N, most %", largest(light.map(|c| c.offset)), "16"),
        row("seals at 500 N, least %", smallest(light.map(|c| c.seals)), "413"),
        row("seals at 500 N, most %", largest(light.map(|c| c.seals)), "615"),
        row("seals at 9500 N, least %", smallest(heavy.map(|c| c.seals)), "23"),
        row("seals at 9500 N, most %", largest(heavy.map(|c| c.seals)), "33"),
        row("C2: 5 % viscosity, by the slope", 5.0 * -viscous.0, "6.7"),
        row("C2: 1 % speed, by the slope", -viscous.0, "1.3"),
    ]);
    check(&rows);
}

#[test]
fn c_4_oh() {
    let m = model(0.51);
    let drag = oh::drag(&m, load(&m, 9500.0), 0.088, 0.1 / 60.0);
    check(&[
        row("I(c)", oh::slip_moment(ROLLING_LINE), "0.161142"),
        row("Heathcote's factor", 0.5 * oh::slip_moment(ROLLING_LINE), "0.0806"),
        row("sliding at 9500 N", drag.sliding_n, "91"),
        row("total at 9500 N", drag.total_n(), "95"),
    ]);
}

#[test]
fn c_5_compact_table() {
    let m = model(0.51);
    let load_part: [(f64, [&'static str; 5]); 4] = [
        (500.0, ["26.81496", "45.82098", "0.696903", "0.001332126", "485.8727"]),
        (1500.0, ["79.33165", "46.65462", "1.00045", "0.002751465", "1415.773"]),
        (4500.0, ["232.0232", "48.24048", "1.430728", "0.005652951", "4017.747"]),
        (9500.0, ["477.0602", "49.98791", "1.8193", "0.009191716", "7974.862"]),
    ];
    let mut rows = Vec::new();
    for (force, want) in load_part {
        let q = load(&m, force);
        let got = [q, m.contact_angle_rad(q).to_degrees(), m.pressure_pa(q) / 1e9, m.slip_ratio(q), m.preload_n(q)];
        for (n, (got, want)) in got.into_iter().zip(want).enumerate() {
            rows.push(row(format!("{force} N, column {n}"), got, want));
        }
    }
    let friction: [(f64, f64, [&'static str; 3]); 13] = [
        (500.0, 0.1, ["0.02367067", "0.003385356", "4.720465"]),
        (500.0, 0.6, ["0.142024", "0.003224867", "4.496683"]),
        (500.0, 2.0, ["0.4734135", "0.002872284", "4.005049"]),
        (500.0, 6.0, ["1.42024", "0.002373714", "3.309854"]),
        (1500.0, 0.1, ["0.03405697", "0.003370432", "13.90386"]),
        (1500.0, 0.6, ["0.2043418", "0.003148331", "12.98764"]),
        (1500.0, 6.0, ["2.043418", "0.002267706", "9.354844"]),
        (4500.0, 0.1, ["0.0489278", "0.003349355", "40.41065"]),
        (4500.0, 2.0, ["0.978556", "0.002536474", "30.60308"]),
        (4500.0, 6.0, ["2.935668", "0.002250279", "27.15007"]),
        (9500.0, 0.1, ["0.06256477", "0.003330323", "82.61576"]),
        (9500.0, 2.0, ["1.251295", "0.002425006", "60.15743"]),
        (9500.0, 6.0, ["3.753886", "0.002299057", "57.033"]),
    ];
    for (force, speed, want) in friction {
        let there = m.at_load(load(&m, force), 100.0, speed / 60.0);
        let got = [FRICTION.stribeck_exponent * there.hersey, there.friction_coefficient, there.drag_force_n];
        for (n, (got, want)) in got.into_iter().zip(want).enumerate() {
            rows.push(row(format!("{force} N, {speed} m/min, column {n}"), got, want));
        }
    }
    check(&rows);
}
