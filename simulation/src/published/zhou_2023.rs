//! THK SHS35V after Zhou, Wang, Feng, Ou and Zhou 2023.
//!
//! The set has `contact_angle_mode = "exact"`: the paper's rig is a split block whose contact angle rises with the
//! load. In a production block, preloaded by oversize balls, it is `"fixed"`.

use model_core::reference::zhou_2023::{FRICTION, GUIDE};

use super::Provenance::{Assumed, Stated};
use super::{Entry, Provenance, Published, Value};

/// The set.
pub(super) const SET: Published = Published {
    name: "zhou-2023",
    source: "Zhou, Wang, Feng, Ou, Zhou: Journal of Mechanical Engineering (CN) 2023, DOI 10.3901/JME.2023.03.208",
    entries,
};

fn entries() -> Vec<Entry> {
    let steel = "bearing steel";
    vec![
        number("ball_diameter_m", GUIDE.ball_diameter_m, Stated("table 1")),
        number("balls_per_row", f64::from(GUIDE.balls_per_row), Stated("table 1")),
        number("contact_angle_deg", GUIDE.contact_angle_rad.to_degrees(), Stated("table 1")),
        number(
            "conformity",
            GUIDE.conformity_rail,
            Assumed("only values up to 0.514 let the measured grid visit both lubrication regimes"),
        ),
        number("young_modulus_pa", GUIDE.young_modulus_pa, Assumed(steel)),
        number("poisson_ratio", GUIDE.poisson_ratio, Assumed(steel)),
        number("initial_interference_m", GUIDE.initial_interference_m, Assumed("the test block is split")),
        number("mu_coulomb", FRICTION.mu_coulomb, Stated("eq. 20")),
        number("mu_viscous", FRICTION.mu_viscous, Stated("eq. 20")),
        number("mu_stribeck", FRICTION.mu_stribeck, Stated("eq. 20")),
        number("stribeck_exponent", FRICTION.stribeck_exponent, Stated("eq. 20")),
        name("hersey", "slip", Assumed("the sliding speed of eq. 12; the text also allows the carriage speed")),
        name("contact_angle_mode", "exact", Stated("eq. 3 and 4: its split block; a production block is \"fixed\"")),
        number("hersey_scale", 1.0, Assumed("the viscosity in H counts in cSt")),
        oil("viscosity_40_cst", 100.0, Assumed("the paper says 100; taken as the viscosity grade, at 40 °C")),
        oil("viscosity_100_cst", 11.0, Assumed("usual for an oil of viscosity grade 100")),
    ]
}

const fn number(key: &'static str, x: f64, provenance: Provenance) -> Entry {
    Entry { section: "guide", key, value: Value::Number(x), provenance }
}

const fn name(key: &'static str, x: &'static str, provenance: Provenance) -> Entry {
    Entry { section: "guide", key, value: Value::Name(x), provenance }
}

const fn oil(key: &'static str, x: f64, provenance: Provenance) -> Entry {
    Entry { section: "lubricant", key, value: Value::Number(x), provenance }
}
