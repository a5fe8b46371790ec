use model_core::contact::{ContactAngle, Guide, HerseySpeed};
use model_core::reference::zhou_2023;

use super::*;
use crate::curve::{self, Carrier, Curve};
use crate::guide::Lubricant;
use crate::mechanism::{Id, library};
use crate::published::{Provenance, Value};

fn read(text: &str) -> Result<Simulation, String> {
    Simulation::from_toml(&format!("schema = \"guideblock.simulation/1\"\n{text}")).map_err(|why| why.to_string())
}

fn guide(text: &str) -> GuideSet {
    match read(text).expect(text).law {
        Law::Guide(set) => set,
        other => panic!("{text}: {other:?}"),
    }
}

const FULL: &str = "[guide]\nparameters = \"zhou-2023\"\nballs_per_row = 10\nhersey = \"carriage\"\nmu_stribeck = 0\n\
     contact_angle_mode = \"fixed\"\nconformity = 0.52\n[lubricant]\nviscosity_cst = 68\n[operation]\npreload_n = 3e3\n\
     [axis]\nmoved_mass_kg = 2.5\nzero_speed_m_s = 1e-4\nposition_reference = \"relative\"\n[tolerance]\npreload = 0.1\n\
     friction = 0.2\nviscosity = 0.3\nfriction_terms = 0.01\nmass = 0.02\nrelevance = 0\n[columns]\n\
     drag_force_n = \"gtau:35.15\"\nposition_m = 'x \"mm\":1e-3:2'\n";

#[test]
fn an_empty_guide_is_the_published_set() {
    let set = guide("[guide]\n[axis]\n[tolerance]\n[columns]\n");
    assert_eq!(*set.exact().friction(), zhou_2023::FRICTION);
    let angle = zhou_2023::GUIDE.contact_angle_rad;
    assert!((set.exact().guide().contact_angle_rad - angle).abs() < 1e-15);
    assert_eq!(Guide { contact_angle_rad: angle, ..*set.exact().guide() }, zhou_2023::GUIDE);
    assert_eq!(set, GuideSet::zhou_2023());
    assert_eq!(set, guide("[operation]\npreload_n = 3000\n"));
    assert_eq!(read("[guide]").expect("legal"), Simulation::of(Law::Guide(set)));
}

#[test]
fn every_key_of_a_file_arrives() {
    let simulation = read(FULL).expect("legal");
    assert_eq!(simulation.preload_n, Some(3000.0));
    assert_eq!(
        simulation.axis,
        Axis { moved_mass_kg: Some(2.5), zero_speed_m_s: 1e-4, position_reference: PositionReference::Relative }
    );
    assert_eq!(
        simulation.tolerance,
        Tolerance { preload: 0.1, friction: 0.2, viscosity: 0.3, friction_terms: 0.01, mass: 0.02, relevance: 0.0 }
    );
    let columns: Vec<(&str, &str)> = simulation.columns.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    assert_eq!(columns, [("drag_force_n", "gtau:35.15"), ("position_m", "x \"mm\":1e-3:2")]);
    let set = guide(FULL);
    let values = set.exact().guide();
    assert_eq!((values.balls_per_row, values.hersey_speed), (10, HerseySpeed::Carriage));
    assert_eq!(
        (values.contact_angle, values.conformity_rail, values.conformity_slider),
        (ContactAngle::Fixed, 0.52, 0.52)
    );
    assert_eq!(set.exact().friction().mu_stribeck, 0.0);
    assert_eq!(set.lubricant(), Lubricant::Constant(68.0));
    assert!((set.hersey_scale() / 0.0528 - 1.0).abs() < 1e-12);
    let of = |key| set.entries().iter().find(|e| e.key == key).map(|e| e.provenance);
    assert_eq!(of("balls_per_row"), Some(Provenance::File));
    assert_eq!(of("ball_diameter_m"), Some(Provenance::Stated("table 1")));
    assert!(matches!(of("young_modulus_pa"), Some(Provenance::Assumed(_))));
    assert_eq!(of("viscosity_40_cst"), None);
}

#[test]
fn every_number_of_the_published_set_can_be_overridden() {
    let set = GuideSet::zhou_2023();
    for e in set.entries() {
        let Value::Number(x) = e.value else { continue };
        if e.key == "initial_interference_m" {
            assert!(set.with_number(e.key, x).is_err());
            continue;
        }
        let step = if e.key == "balls_per_row" { 1.0 } else { 0.01 * x };
        let changed = set.with_number(e.key, x + step).expect(e.key);
        let text = Simulation::of(Law::Guide(changed.clone())).to_toml();
        if e.section == "guide" {
            assert!(text.contains(&format!("\n{} = ", e.key)), "{text}");
            assert_eq!(Simulation::from_toml(&text).expect(&text).law, Law::Guide(changed));
        }
    }
    assert_eq!(set.with_number("viscosity_cst", 68.0).expect("legal").lubricant(), Lubricant::Constant(68.0));
    assert!(set.with_number("conformity", 0.4).expect_err("range").starts_with("conformity must lie between"));
    assert!(set.with_number("hersey", 1.0).is_err());
}

#[test]
fn what_is_written_reads_back_as_the_same() {
    for text in [
        FULL,
        "",
        "[guide]",
        "[lubricant]\nviscosity_40_cst = 68\nviscosity_100_cst = 8.5",
        "[guide]\nlaw = \"coulomb-viscous\"",
        "[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20.3\nviscous_n_s_m = -1e-7\noffset_n = -3\n[axis]\nmoved_mass_kg = 95.1",
        "[tolerance]\nfriction = 0.1",
        "[columns]\n\"a b\" = 'c\\\"\u{e9}:1'",
    ] {
        let simulation = read(text).expect(text);
        let written = simulation.to_toml();
        assert_eq!(Simulation::from_toml(&written).expect(&written), simulation, "{written}");
        assert_eq!(Simulation::from_toml(&written).expect(&written).to_toml(), written);
    }
    assert!(
        read(FULL).expect("legal").to_toml().contains("# young_modulus_pa = 206000000000.0   # ASSUMED: bearing steel")
    );
}

#[test]
fn without_a_guide_the_run_brings_its_own_simulation() {
    assert_eq!(read("").expect("legal").law, Law::COLUMN);
    assert_eq!(read("[tolerance]\nfriction = 0.1").expect("legal").law, Law::COLUMN);
    let off = read("[simulated_force]\nfriction = 0.9\ninertia = 1.02\nviscosity = 1.25").expect("legal");
    assert_eq!(off.law, Law::Column { friction: 0.9, inertia: 1.02, preload: 1.0, viscosity: 1.25 });
    assert_eq!(Simulation::from_toml(&off.to_toml()).expect("it reads back").law, off.law);
    let why = read("[simulated_force]\nviscosity = 1.25\n[operation]\npreload_n = 3000").expect_err("two laws");
    assert!(why.to_string().contains("means nothing beside a law of its own"), "{why}");
    assert_eq!(
        read("[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 3").expect("legal").law,
        Law::CoulombViscous { coulomb_n: Some(3.0), viscous_n_s_m: None, offset_n: None }
    );
    let of = |text: &str| GuideSet::from_toml(text).expect_err(text).to_string();
    assert!(of("schema = \"guideblock.simulation/1\"").contains("describes no guide"));
    assert!(
        of("schema = \"guideblock.simulation/1\"\n[guide]\nlaw = \"coulomb-viscous\"").contains("it has no preload")
    );
    assert_eq!(of("[guide]"), "line 1, column 1: expected schema = \"guideblock.simulation/1\" as first key");
    assert_eq!(of("schema = 3"), "line 1, column 10: expected schema = \"guideblock.simulation/1\"");
}

#[test]
fn mistakes_have_line_column_and_what_would_be_right() {
    let keys = "parameters, law, ball_diameter_m, balls_per_row, contact_angle_deg, conformity, young_modulus_pa, \
                poisson_ratio, mu_coulomb, mu_viscous, mu_stribeck, stribeck_exponent, hersey, contact_angle_mode, hersey_scale";
    for (text, message) in [
        (
            "[lubricant]\nviscosity = 3",
            "line 3, column 1: there is no key lubricant.viscosity; there are: viscosity_cst, viscosity_40_cst, viscosity_100_cst",
        ),
        ("[guide]\nmu = 3", &format!("line 3, column 1: there is no key guide.mu; there are: {keys}")),
        (
            "[oil]",
            "line 2, column 2: there is no section oil; there are: schema, guide, lubricant, operation, axis, tolerance, columns, simulated_force, mechanism, curve",
        ),
        ("guide = 3", "line 2, column 9: guide must be a table"),
        ("[guide]\nhersey = \"both\"", "line 3, column 10: guide.hersey must be one of: \"slip\", \"carriage\""),
        ("[guide]\nparameters = \"x\"", "line 3, column 14: guide.parameters must be one of: \"zhou-2023\""),
        ("[guide]\nconformity = \"x\"", "line 3, column 14: guide.conformity must be a number, not the text \"x\""),
        (
            "[guide]\nconformity = 0.5",
            "line 3, column 14: guide.conformity must lie between 0.501 and 0.6 (groove radius over ball diameter), not 0.5",
        ),
        ("[guide]\npoisson_ratio = nan", "line 3, column 17: guide.poisson_ratio must lie between 0 and 0.49, not NaN"),
        ("[guide]\nballs_per_row = 9.5", "line 3, column 17: guide.balls_per_row must be a whole number, not 9.5"),
        (
            "[guide]\ncontact_angle_deg = 0.785",
            "line 3, column 21: guide.contact_angle_deg must lie between 5.73 and 80.21 deg, not 0.785",
        ),
        (
            "[lubricant]\nviscosity_40_cst = 9",
            "line 3, column 1: lubricant.viscosity_40_cst and viscosity_100_cst belong together; give both",
        ),
        (
            "[lubricant]\nviscosity_40_cst = 9\nviscosity_100_cst = 10",
            "line 4, column 1: lubricant.viscosity_100_cst must lie below viscosity_40_cst",
        ),
        (
            "[lubricant]\nviscosity_40_cst = 9\nviscosity_100_cst = 3\nviscosity_cst = 3",
            "line 4, column 1: give either lubricant.viscosity_cst or viscosity_40_cst with viscosity_100_cst, not both",
        ),
        (
            "[guide]\nlaw = \"stribeck\"",
            "line 3, column 7: guide.law must be \"coulomb-viscous\"; leave it out for a ball guide",
        ),
        (
            "[guide]\nlaw = \"coulomb-viscous\"\nconformity = 0.51",
            "line 4, column 1: there is no key guide.conformity; there are: law, coulomb_n, viscous_n_s_m, offset_n",
        ),
        (
            "[guide]\nlaw = \"coulomb-viscous\"\n[lubricant]\nviscosity_cst = 3",
            "line 4, column 2: [lubricant] means nothing to law = \"coulomb-viscous\"",
        ),
        (
            "[operation]\npreload_n = -1",
            "line 3, column 13: operation.preload_n must lie between 0 and 1000000 N, not -1",
        ),
        ("[operation]\npreload = 1", "line 3, column 1: there is no key operation.preload; there are: preload_n"),
        (
            "[axis]\nzero_speed_m_s = inf",
            "line 3, column 18: axis.zero_speed_m_s must lie between 0 and 1 m/s, not inf",
        ),
        (
            "[axis]\nposition_reference = 1",
            "line 3, column 22: axis.position_reference must be one of: \"absolute\", \"relative\"",
        ),
        ("[tolerance]\nfriction = -0.1", "line 3, column 12: tolerance.friction must lie between 0 and 10, not -0.1"),
        (
            "[tolerance]\nload = 1",
            "line 3, column 1: there is no key tolerance.load; there are: preload, friction, viscosity, friction_terms, mass, relevance",
        ),
        (
            "mechanism = 3",
            "line 2, column 13: mechanisms stand in entries that start with [[mechanism]], in two brackets",
        ),
        ("[[mechanism]]\nform = \"minimal\"", "line 2, column 1: a mechanism needs an id, such as id = \"seal-drag\""),
        (
            "[[mechanism]]\nid = \"seal-drag\"\nform = \"big\"",
            "line 4, column 8: seal-drag has no form \"big\"; it has: \"minimal\", \"lip\"",
        ),
        (
            "[[mechanism]]\nid = \"seal-drag\"\nmass_kg = 3",
            "line 4, column 1: seal-drag of form \"minimal\" has no mass_kg; it has: drag_n",
        ),
        ("[[mechanism]]\nid = \"seal-drag\"", "line 3, column 1: seal-drag of form \"minimal\" needs drag_n in N"),
        (
            "[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 1e13",
            "line 4, column 10: mechanism.drag_n must be 0 or above, and at most 1e12 N, not 10000000000000",
        ),
        (
            "[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 2\n[[mechanism]]\nid = \"seal-drag\"\ndrag_n = 2.0",
            "line 5, column 1: seal-drag stands there twice with the same numbers; leave one entry of it",
        ),
        (
            "[[mechanism]]\nid = \"seal-drag\"\ndrag_n = -1",
            "line 4, column 10: mechanism.drag_n must be 0 or above, and at most 1e12 N, not -1",
        ),
        (
            "[[mechanism]]\nid = \"run-in\"\nlength_m = 0\ndrag_n = 1",
            "line 4, column 12: mechanism.length_m must be above 0 and at most 1e12 m, not 0",
        ),
        ("[columns]\ndrag_force_n = 3", "line 3, column 16: columns.drag_force_n must be a text in quotes, not 3"),
        ("curve = 3", "line 2, column 9: curves stand in entries that start with [[curve]], in two brackets"),
        ("curve = [3]", "line 2, column 10: a curve must be a table with axis, carrier, at and height"),
        ("[[curve]]\ncarrier = \"odd\"", "line 2, column 1: a curve needs axis, such as axis = \"velocity\""),
        (
            "[[curve]]\naxis = \"colour\"",
            "line 3, column 8: curve.axis must be one of: \"direction\", \"velocity\", \"load\", \"preload\", \"position\", \
             \"time\", \"travel\", \"temperature\", \"temperature-difference\", \"acceleration\", \"reversal-distance\", \
             \"dwell\", \"clock\", \"time-since-turn\"",
        ),
        (
            "[[curve]]\naxis = \"time\"\ncarrier = 1",
            "line 4, column 11: curve.carrier must be one of: \"even\", \"odd\", \"drag\"",
        ),
        (
            "[[curve]]\nshape = 1",
            "line 3, column 1: there is no key curve.shape; there are: axis, carrier, period_s, at, height",
        ),
    ] {
        assert_eq!(read(text).expect_err(text), message);
    }
    assert!(
        read("[[mechanism]]\nid = \"rust\"")
            .expect_err("id")
            .starts_with("line 3, column 6: there is no mechanism \"rust\"; there are: seal-drag, viscous-drag, ")
    );
    assert!(read("[guide]\nmu_stribeck = 0.4\nmu_coulomb = 1e-5").expect_err("ambiguous").contains("several preloads"));
    assert!(read("[guide").expect_err("syntax").starts_with("line 2, column 7: "), "{:?}", read("[guide"));
}

#[test]
fn mechanisms_of_every_form_are_written_and_read_back_byte_by_byte() {
    let mut simulation = read(FULL).expect("legal");
    for definition in library() {
        for (index, form) in definition.forms.iter().enumerate() {
            simulation.mechanisms.push(Added {
                id: definition.id,
                form: index,
                shape: form.shape.iter().map(|p| p.from + (p.to - p.from) / 3.0).collect(),
                amplitudes: form.amplitudes.iter().map(|a| a.typical * 1.1).collect(),
            });
        }
    }
    let written = simulation.to_toml();
    let back = Simulation::from_toml(&written).expect("legal");
    assert_eq!(back, simulation);
    assert_eq!(back.to_toml(), written);
    // without a name the form is the first one
    let short = read("[[mechanism]]\nid = \"inertia\"\nmass_kg = 3").expect("legal");
    assert_eq!(short.mechanisms, [Added { id: Id::Inertia, form: 0, shape: vec![], amplitudes: vec![3.0] }]);
}

/// An entry along an axis with these lines.
fn along(axis: &str, more: &str) -> String {
    format!("[[curve]]\naxis = \"{axis}\"\ncarrier = \"odd\"\n{more}")
}

#[test]
fn mistakes_in_the_numbers_of_a_curve_have_line_and_column() {
    for (axis, more, message) in [
        ("time", "height = [1]", "line 2, column 1: a curve needs at, such as at = [0.01, 0.1, 0.5]"),
        ("time", "at = [0, 1]", "line 2, column 1: a curve needs height, such as height = [0.0, 0.4, 1.3]"),
        ("time", "at = 3\nheight = [1]", "line 5, column 6: curve.at must be a list of numbers"),
        ("time", "at = [0, \"x\"]\nheight = [1]", "line 5, column 10: curve.at must be a number, not the text \"x\""),
        ("time", "at = [0]\nheight = [1]", "line 5, column 6: curve.at must have two numbers or more"),
        (
            "time",
            "at = [0, 2, 2]\nheight = [1]",
            "line 5, column 6: the numbers of curve.at must rise, each above the one before",
        ),
        (
            "velocity",
            "at = [-0.1, 0.1]\nheight = [1, 2]",
            "line 5, column 7: curve.at must lie between 0e0 and 1e12 m/s, not -0.1",
        ),
        (
            "time",
            "at = [0, inf]\nheight = [1, 2]",
            "line 5, column 10: curve.at must lie between -1e12 and 1e12 s, not inf",
        ),
        (
            "time",
            "at = [0, 1]\nheight = [1, nan]",
            "line 6, column 14: curve.height must lie between -1e12 and 1e12 N, not NaN",
        ),
        (
            "time",
            "at = [0, 1]\nheight = [1]",
            "line 6, column 10: curve.height must have one number for each of curve.at: 2, not 1",
        ),
        (
            "clock",
            "at = [0, 1]\nheight = [1, 2]",
            "line 2, column 1: a curve along a clock needs period_s in s, such as period_s = 5.0",
        ),
        (
            "clock",
            "period_s = 1\nat = [0, 1]\nheight = [1, 2]",
            "line 5, column 12: curve.period_s must be above the last number of curve.at and at most 1e12 s, not 1",
        ),
        (
            "clock",
            "period_s = 3\nat = [1, 2]\nheight = [1, 2]",
            "line 6, column 6: curve.at of a clock must start at 0",
        ),
        (
            "time",
            "period_s = 3\nat = [1, 2]\nheight = [1, 2]",
            "line 5, column 1: curve.period_s is for axis = \"clock\" alone",
        ),
    ] {
        assert_eq!(read(&along(axis, more)).expect_err(more), message, "{more}");
    }
}

#[test]
fn curves_of_every_axis_and_carrier_are_written_and_read_back_byte_by_byte() {
    let mut simulation = read(FULL).expect("legal");
    for axis in curve::Axis::ALL {
        for carrier in Carrier::ALL {
            let [least, most] = axis.ends().map(|end| end.clamp(-7.0, 7.0));
            let knots: Vec<f64> = (0..=4).map(|k| least + (most - least) * f64::from(k) / 4.0).collect();
            let heights = vec![0.1, 0.2 / 3.0, -1e-7, 1e9, 0.1];
            simulation.curves.push(AddedCurve { curve: Curve { axis, carrier, knots }, heights });
        }
    }
    let written = simulation.to_toml();
    let back = Simulation::from_toml(&written).expect("legal");
    assert_eq!(back, simulation);
    assert_eq!(back.to_toml(), written);
    let clock = read(&along("clock", "period_s = 4\nat = [0, 1]\nheight = [2, 3]")).expect("legal");
    assert_eq!(clock.curves[0].curve.knots, [0.0, 1.0, 4.0]);
    assert_eq!(clock.curves[0].heights, [2.0, 3.0, 2.0]);
    let written = clock.to_toml();
    let end = "\n[[curve]]   # a force that nobody has a name for, against the motion\naxis = \"clock\"\ncarrier = \"odd\"\n\
               period_s = 4.0\nat = [0.0, 1.0]   # s\nheight = [2.0, 3.0]   # N\n";
    assert!(written.ends_with(end), "{written}");
    // what cannot be read back is not written
    simulation.curves.iter_mut().for_each(|added| added.heights.truncate(2));
    assert!(!simulation.to_toml().contains("[[curve]]"));
}
