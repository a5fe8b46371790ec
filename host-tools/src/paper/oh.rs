//! The rival drag model that the paper compares itself with: OH et al. 2019, Eq. 22.
//!
//! ```text
//! F_f = [3 μ_h b/(2 R_h) + 8 μ_l (3c - c³ - 1)] Z_b Q + η V · 4πab Z_b/h_c
//! ```
//!
//! The paper gives neither c nor R_h nor h_c. Assumed here: R_h is the deformed radius R of Eq. 13; h_c the central
//! film of Hamrock and Dowson at the mean surface speed V/2; c from the moment balance of a free ball. The printed
//! sum counts the whole travel of the carriage at both contacts, although a ball rolls half of it on each.

use std::f64::consts::PI;

use model_core::contact::ROLLING_LINE;
use model_core::exact::Exact;

/// Loss factor of elastic hysteresis μ_h, as the paper takes it.
pub const HYSTERESIS: f64 = 0.01;

/// Coefficient of sliding friction μ_l, as the paper takes it.
pub const SLIDING: f64 = 0.15;

/// Pressure coefficient of viscosity of a mineral oil, 1/Pa; assumed.
const PRESSURE_VISCOSITY: f64 = 2.0e-8;

/// The three parts of the drag force, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drag {
    /// Elastic hysteresis.
    pub hysteresis_n: f64,
    /// Sliding within the contact ellipse (Heathcote).
    pub sliding_n: f64,
    /// Shear of the oil film.
    pub viscous_n: f64,
}

impl Drag {
    /// The whole drag force, N.
    pub fn total_n(&self) -> f64 {
        self.hysteresis_n + self.sliding_n + self.viscous_n
    }
}

/// Moment of Coulomb slip about the rolling lines, for lines at `c` of the major semi-axis, 0 to 1.
///
/// `I(c) = (3/4) ∫₋₁¹ (1 - s²)|s² - c²| ds`
pub fn slip_moment(c: f64) -> f64 {
    let integral = |s: f64| s.powi(3) / 3.0 - s.powi(5) / 5.0 - c * c * (s - s.powi(3) / 3.0);
    1.5 * ((integral(1.0) - integral(c)) - integral(c))
}

/// `|3c - c³ - 1|` of a free ball under a load per ball in N, from its moment balance: `a² I/(2 R r0)`.
fn unbalanced_slip(model: &Exact, q: f64) -> f64 {
    let contact = model.contact();
    let (r, half) = (contact.deformed_radius_m, 0.5 * model.guide().ball_diameter_m);
    let a2 = (contact.k_a * q.cbrt()).powi(2);
    let r0 = (r * r - ROLLING_LINE.powi(2) * a2).sqrt() - (r * r - a2).sqrt() + (half * half - a2).sqrt();
    a2 * slip_moment(ROLLING_LINE) / (2.0 * r * r0)
}

/// Central film thickness, m; `eta` in Pa·s, speed of the carriage in m/s, `q` in N.
///
/// `h_c = 2.69 R_x U^0.67 G^0.53 W^-0.067 (1 - 0.61 e^(-0.73 κ))`      Hamrock and Dowson 1977
pub fn central_film_m(model: &Exact, q: f64, eta: f64, speed_m_s: f64) -> f64 {
    let guide = model.guide();
    let modulus = guide.young_modulus_pa / (1.0 - guide.poisson_ratio * guide.poisson_ratio);
    let r_x = 0.5 * guide.ball_diameter_m;
    let u = eta * 0.5 * speed_m_s / (modulus * r_x);
    let g = PRESSURE_VISCOSITY * modulus;
    let w = q / (modulus * r_x * r_x);
    let side = 1.0 - 0.61 * (-0.73 * model.contact().ellipse.kappa).exp();
    2.69 * r_x * u.powf(0.67) * g.powf(0.53) * w.powf(-0.067) * side
}

/// Drag force of Eq. 22 at a load per ball in N, a viscosity in Pa·s and a carriage speed in m/s above zero.
pub fn drag(model: &Exact, q: f64, eta: f64, speed_m_s: f64) -> Drag {
    let (contact, balls) = (model.contact(), f64::from(model.guide().balls_per_row));
    let cube = q.cbrt();
    let (a, b) = (contact.k_a * cube, contact.k_b * cube);
    Drag {
        hysteresis_n: 3.0 * HYSTERESIS * b / (2.0 * contact.deformed_radius_m) * balls * q,
        sliding_n: 8.0 * SLIDING * unbalanced_slip(model, q) * balls * q,
        viscous_n: eta * speed_m_s * 4.0 * PI * a * b * balls / central_film_m(model, q, eta, speed_m_s),
    }
}

/// Load per ball that makes a drag force in N; `None` if none within the geometry does.
pub fn load_of_drag(model: &Exact, drag_n: f64, eta: f64, speed_m_s: f64) -> Option<f64> {
    // every part rises with the load
    let (mut low, mut high) = (1e-6, 0.999 * model.load_limit_n());
    let is_below = |q| drag(model, q, eta, speed_m_s).total_n() < drag_n;
    if !is_below(low) || is_below(high) {
        return None;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if is_below(middle) { low = middle } else { high = middle }
    }
    Some(high)
}

/// Preload by Eq. 22 over preload by Eq. 21, less one, at one drag force in N.
///
/// `eta` in Pa·s for Eq. 22, `nu` the number that stands in Eq. 21, speed in m/s. `None` where either has no answer.
pub fn disagreement(model: &Exact, drag_n: f64, eta: f64, nu: f64, speed_m_s: f64) -> Option<f64> {
    let rival = model.preload_n(load_of_drag(model, drag_n, eta, speed_m_s)?);
    Some(rival / model.working_point(drag_n, nu, speed_m_s)?.preload_n - 1.0)
}
