//! The core against the golden vectors of `golden/reference.py` (40-digit arithmetic, 17 digits printed).
//!
//! The README states these very numbers.

use model_core::exact::Exact;
use model_core::friction::Friction;
use model_core::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED};
use model_core::{fixed, reduced::Reduced};
use on_target::{CARRIAGE, CARRIAGE_LAW, SLIP, SLIP_LAW};
use system_tests::golden::golden;

/// Tolerance of the exact geometry in f64, relative.
const EXACT: f64 = 1e-12;
/// Tolerance of the reduced law in f32 and in fixed point over the paper's domain, relative error of the preload.
const REDUCED: f64 = 5e-6;

fn close(got: f64, want: f64, tolerance: f64, what: &str) {
    assert!((got - want).abs() <= tolerance * want.abs(), "{what}: {got:e} against {want:e}");
}

#[test]
fn equation_20_and_the_rounded_equation_21() {
    let table = golden("eq20.csv");
    // Eq. 21 as printed, divided by 4: its constants are those of Eq. 20 rounded, and eps = 1.5 H
    let printed = Friction {
        mu_coulomb: 0.00728 / 4.0,
        mu_viscous: 2.33e7 / 4.0,
        mu_stribeck: 0.0064 / 4.0,
        stribeck_exponent: 4.95e10,
    };
    for (n, h) in table["H_paper"].iter().enumerate() {
        close(FRICTION.coefficient(*h), table["mu"][n], 1e-15, "mu");
        close(
            printed.coefficient(table["eps_eq21"][n]),
            table["mu_from_eq21_rounded_coeffs"][n],
            1e-14,
            "mu of Eq. 21",
        );
    }
}

#[test]
fn exact_geometry_forward() {
    for (name, guide) in [("forward_slip.csv", GUIDE), ("forward_carriage.csv", GUIDE_CARRIAGE_SPEED)] {
        let model = Exact::new(guide, FRICTION);
        let t = golden(name);
        for (n, q) in t["Q_N"].iter().copied().enumerate() {
            let (nu, v) = (t["nu_cSt"][n], t["V_mps"][n]);
            let c = model.contact();
            let cube = q.cbrt();
            for (got, column) in [
                (c.k_a * cube, "a_m"),
                (c.k_b * cube, "b_m"),
                (model.pressure_pa(q), "P_Pa"),
                (v * model.slip_ratio(q), "u_mps"),
                (model.hersey(q, nu, v), "H_paper"),
                (model.at_load(q, nu, v).friction_coefficient, "mu"),
                (model.drag_force_n(q, nu, v), "F_f_N"),
                (model.contact_angle_rad(q), "beta_rad"),
                (model.preload_n(q), "F_p_N"),
                (model.lateral_force_n(q), "F_H_N"),
            ] {
                close(got, t[column][n], EXACT, column);
            }
        }
    }
}

#[test]
fn exact_geometry_inverse() {
    for (name, guide) in [("inverse_slip.csv", GUIDE), ("inverse_carriage.csv", GUIDE_CARRIAGE_SPEED)] {
        let model = Exact::new(guide, FRICTION);
        let t = golden(name);
        for (n, force) in t["F_f_N"].iter().enumerate() {
            let at = model.working_point(*force, t["nu_cSt"][n], t["V_mps"][n]).expect("inside the geometry");
            close(at.load_per_ball_n, t["Q_N"][n], EXACT, "Q");
            close(at.hersey, t["H_paper"][n], EXACT, "H");
            close(at.friction_coefficient, t["mu"][n], EXACT, "mu");
            close(at.preload_n, t["F_p_N"][n], EXACT, "F_p");
        }
    }
}

#[test]
fn sensitivities_of_the_reduced_law() {
    for (name, law) in [("inverse_slip.csv", SLIP_LAW), ("inverse_carriage.csv", CARRIAGE_LAW)] {
        let t = golden(name);
        for n in (0..t["F_f_N"].len()).filter(|n| t["in_paper_domain"][*n] == 1.0) {
            let got = law.invert(t["F_f_N"][n], t["nu_cSt"][n] * t["V_mps"][n]).expect("inside");
            assert!((got.per_force - t["dlnFp_dlnFf"][n]).abs() < 1e-3);
            assert!((got.per_viscous_speed - t["dlnFp_dlnnu"][n]).abs() < 1e-3);
        }
    }
}

#[test]
fn reduced_law_in_f32_and_in_fixed_point() {
    for (name, table, law) in [("slip", SLIP, SLIP_LAW), ("carriage", CARRIAGE, CARRIAGE_LAW)] {
        let (float, _) = on_target::float(table, &law.to_f32());
        let (integer, _) = on_target::integer(table, &fixed::Reduced::of(&law).expect("constants that fit"));
        println!("{name}: worst relative error of the preload: f32 {float:.2e}, fixed point {integer:.2e}");
        assert!(float <= REDUCED && integer <= REDUCED, "{name}: f32 {float:e}, fixed {integer:e}");
    }
}

#[test]
fn tables_hold_the_whole_paper_domain() {
    for (name, table, rows) in [("inverse_slip.csv", SLIP, 7000), ("inverse_carriage.csv", CARRIAGE, 1400)] {
        let inside = golden(name)["in_paper_domain"].iter().filter(|x| **x == 1.0).count();
        assert_eq!((inside, on_target::points(table).count()), (rows, rows));
    }
}

#[test]
fn rivals_run_the_same_algorithm() {
    // with the core's own functions the rival code must give the core's bits, or its cost says nothing about the core
    let law: Reduced<f32> = SLIP_LAW.to_f32();
    let mut worst = [0.0f64; 3];
    for p in on_target::points(SLIP) {
        let core = law.invert(p.drag_force_n, p.viscous_speed).expect("inside").preload_n;
        let got = [
            on_target::rivals::preload_own(&law, p.drag_force_n, p.viscous_speed),
            on_target::rivals::preload_libm(&law, p.drag_force_n, p.viscous_speed),
            on_target::rivals::preload_micromath(&law, p.drag_force_n, p.viscous_speed),
        ];
        assert_eq!(got[0].map(f32::to_bits), Some(core.to_bits()));
        for (w, g) in worst.iter_mut().zip(got) {
            *w = w.max(on_target::relative(f64::from(g.expect("inside")), p.preload_n));
        }
    }
    println!(
        "worst relative error of the preload: own {:.2e}, libm {:.2e}, micromath {:.2e}",
        worst[0], worst[1], worst[2]
    );
    assert!(worst[1] <= REDUCED && worst[2] <= 1e-3);
}
