//! The computed figures of the checked specification of the paper's model (its sections A, B and C), each within half
//! a unit of its last printed digit. What cannot be reproduced stands in a list with both numbers and is tested to
//! differ, so that the list cannot rot.
#![allow(clippy::expect_used, reason = "a test fails by panicking")]

mod section_a;
mod section_b;
mod section_c;

use host_tools::paper::conditioning::{conditioning, error_of_viscosity, slopes_over};
use host_tools::paper::convention::{CONVENTIONS, QUOTED_MINIMA, Score};
use host_tools::paper::{printed, slip_series};
use model_core::contact::{Guide, HerseySpeed};
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
