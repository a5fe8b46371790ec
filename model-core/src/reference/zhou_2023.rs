//! THK SHS35V as in ZHOU, WANG, FENG, OU, ZHOU: J. Mech. Eng. (CN) 2023, DOI 10.3901/JME.2023.03.208.

use crate::contact::{ContactAngle, Guide, HerseySpeed};
use crate::friction::Friction;
use crate::viscosity::Walther;

/// The four constants of Eq. 20 as printed.
pub const FRICTION: Friction =
    Friction { mu_coulomb: 0.00182, mu_viscous: 8.74e6, mu_stribeck: 0.0016, stribeck_exponent: 7.43e10 };

/// Geometry of the paper's Table 1, with what the paper leaves open set as in physics.md B.5.
///
/// Assumed, not stated by the paper: conformity 0.51 (only values up to 0.514 let the measured grid visit
/// both lubrication regimes), Young's modulus and Poisson's ratio of bearing steel, no initial
/// interference (the test block is split), the sliding speed of Eq. 12 as `u` of the Hersey number.
pub const GUIDE: Guide = Guide {
    ball_diameter_m: 6.35e-3,
    balls_per_row: 13,
    contact_angle_rad: core::f64::consts::FRAC_PI_4,
    conformity_rail: 0.51,
    conformity_slider: 0.51,
    young_modulus_pa: 206e9,
    poisson_ratio: 0.3,
    initial_interference_m: 0.0,
    hersey_speed: HerseySpeed::Slip,
    contact_angle: ContactAngle::Exact,
};

/// The same guide with the carriage speed as `u` of the Hersey number (the paper's text allows both).
///
/// The viscosity it is fed must then be the number 60·η with η in Pa·s, so that u counts in m/min.
pub const GUIDE_CARRIAGE_SPEED: Guide = Guide { hersey_speed: HerseySpeed::Carriage, ..GUIDE };

/// A production block of that guide: preloaded by oversize balls, so the contact angle stays.
pub const GUIDE_PRODUCTION: Guide = Guide { contact_angle: ContactAngle::Fixed, ..GUIDE };

/// Oil of viscosity grade 100 with 11 cSt at 100 °C (physics.md E3; the paper gives only the 100).
pub const OIL: Walther = Walther { a: 9.252_591, b: 3.586_455 };

/// Carriage speeds the paper measured, m/s (0.1 to 6 m/min).
pub const SPEED_RANGE_M_S: (f64, f64) = (0.1 / 60.0, 6.0 / 60.0);

/// Preloads the paper measured, N: 500 to 9500 N of lateral force on the split block.
pub const PRELOAD_RANGE_N: (f64, f64) = (485.0, 8000.0);
