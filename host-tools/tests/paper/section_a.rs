//! Section A: constants, the rolling line, the contact angle, Hertz's coefficients.

use host_tools::paper::{hertz, printed};
use model_core::contact::{Ellipse, ROLLING_LINE};
use model_core::reference::zhou_2023::FRICTION;

use super::{check, load, model, row, smallest_friction};

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
