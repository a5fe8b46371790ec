//! The whole model of the paper in f64, with exact geometry (Zhou 2023, Eq. 1 to 6, 11 to 15, 20, 21).
//!
//! Runs on the desk: it calibrates, simulates and judges the [`reduced`](crate::reduced) law that the block
//! runs. Loads are normal loads per ball, Q in N; ν is the NUMBER of centistokes (or 60·η in Pa·s where
//! the carriage speed stands in the Hersey number); V is the carriage speed in m/s, its sign is ignored.
//!
//! Corrections against the printed equations (physics.md A.1): Eq. 4 without its first-order slip, Eq. 12
//! in absolute value and free of cancellation, Eq. 14 with `sin γ sin β` (so γ and γ' cancel), P of Eq. 11
//! as the maximum pressure.

use crate::contact::{Contact, ContactAngle, Guide, HerseySpeed, ROLLING_LINE};
use crate::friction::Friction;
use crate::num::constant;

/// A guide with its friction law.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    guide: Guide,
    friction: Friction,
    contact: Contact,
}

/// Everything the model says about one working point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkingPoint {
    /// Normal load per ball Q, N.
    pub load_per_ball_n: f64,
    /// Hersey number in the paper's unit.
    pub hersey: f64,
    /// Friction coefficient.
    pub friction_coefficient: f64,
    /// Contact angle β, rad.
    pub contact_angle_rad: f64,
    /// Drag force of the contacts, N.
    pub drag_force_n: f64,
    /// Preload F_p, N.
    pub preload_n: f64,
}

impl Exact {
    /// Takes a guide that passes [`Guide::check`].
    pub const fn new(guide: Guide, friction: Friction) -> Self {
        Exact { contact: Contact::of(&guide), guide, friction }
    }

    /// The guide.
    pub const fn guide(&self) -> &Guide {
        &self.guide
    }

    /// The friction law.
    pub const fn friction(&self) -> &Friction {
        &self.friction
    }

    /// The contact's load-independent factors.
    pub const fn contact(&self) -> &Contact {
        &self.contact
    }

    /// Load per ball above which the major semi-axis leaves the ball and the geometry has no meaning, N.
    pub fn load_limit_n(&self) -> f64 {
        let q = 0.5 * self.guide.ball_diameter_m / self.contact.k_a;
        q * q * q
    }

    /// Maximum contact pressure, Pa.     `P = 3Q/(2πab)`      Eq. 11
    pub fn pressure_pa(&self, q: f64) -> f64 {
        self.contact.k_p * libm::cbrt(q)
    }

    /// Speed of Eq. 12 over the carriage speed, absolute value (1 where the carriage speed is meant).
    ///
    /// `u/V = (R - sqrt(R²-c²a²))/r0`, written without cancellation; r0 is the ball radius at x' = c a.
    pub fn slip_ratio(&self, q: f64) -> f64 {
        match self.guide.hersey_speed {
            HerseySpeed::Carriage => 1.0,
            HerseySpeed::Slip => slip_ratio(&self.contact, self.guide.ball_diameter_m, libm::cbrt(q)),
        }
    }

    /// Hersey number `H = ν u/P` in the paper's unit.
    pub fn hersey(&self, q: f64, nu: f64, speed_m_s: f64) -> f64 {
        nu * speed_m_s.abs() * self.slip_ratio(q) / self.pressure_pa(q)
    }

    /// dlnH/dlnQ at constant ν and V: about +1/3 with slip, -1/3 with the carriage speed.
    pub fn hersey_load_exponent(&self, q: f64) -> f64 {
        match self.guide.hersey_speed {
            HerseySpeed::Carriage => -1.0 / 3.0,
            HerseySpeed::Slip => {
                let (r, d) = (self.contact.deformed_radius_m, self.guide.ball_diameter_m);
                let c2 = ROLLING_LINE * ROLLING_LINE;
                let a = self.contact.k_a * libm::cbrt(q);
                let a2 = a * a;
                let w = libm::sqrt(r * r - c2 * a2);
                let rim = libm::sqrt(r * r - a2);
                let s = libm::sqrt(0.25 * d * d - a2);
                let r0 = w - rim + s;
                // derivatives of ln(numerator) and ln(r0) by ln(a²)
                let numerator = 1.0 + c2 * a2 / (2.0 * w) / (r + w);
                let denominator = a2 * (-c2 / (2.0 * w) + 1.0 / (2.0 * rim) - 1.0 / (2.0 * s)) / r0;
                (2.0 / 3.0) * (numerator - denominator) - 1.0 / 3.0
            }
        }
    }

    /// Contact angle β under load, rad.
    ///
    /// `cos β = s0 cos α0/(s0 + ε Q^(2/3) - δ0)`      Eq. 3 and the exact form of Eq. 4
    pub fn contact_angle_rad(&self, q: f64) -> f64 {
        libm::acos(self.cos_contact_angle(q))
    }

    fn cos_contact_angle(&self, q: f64) -> f64 {
        let cos0 = libm::cos(self.guide.contact_angle_rad);
        match self.guide.contact_angle {
            ContactAngle::Fixed => cos0,
            ContactAngle::Exact => {
                let c = &self.contact;
                let cube = libm::cbrt(q);
                c.s0 * cos0 / (c.s0 + c.eps * cube * cube - self.guide.initial_interference_m)
            }
        }
    }

    /// Preload of a load per ball, N.      `F_p = 2 Z_b Q cos β`      Eq. 1
    pub fn preload_n(&self, q: f64) -> f64 {
        0.5 * self.guide.loaded_balls() * q * self.cos_contact_angle(q)
    }

    /// Lateral force on the split block, N.      `F_H = 2 Z_b Q sin β`      Eq. 2
    pub fn lateral_force_n(&self, q: f64) -> f64 {
        let cos = self.cos_contact_angle(q);
        0.5 * self.guide.loaded_balls() * q * libm::sqrt(1.0 - cos * cos)
    }

    /// Drag force of the contacts, N, positive against the motion.      `F_f = 4 Z_b Q μ(H)`      Eq. 6, 21
    pub fn drag_force_n(&self, q: f64, nu: f64, speed_m_s: f64) -> f64 {
        self.guide.loaded_balls() * q * self.friction.coefficient(self.hersey(q, nu, speed_m_s))
    }

    /// Load per ball of a preload, N; `None` unless the preload is positive and within the geometry.
    ///
    /// Newton in ln Q; dlnF_p/dlnQ lies between 1/3 and 1, so it converges from anywhere.
    pub fn load_of_preload(&self, preload_n: f64) -> Option<f64> {
        if !(preload_n.is_finite() && preload_n > 0.0) {
            return None;
        }
        let mut q = 2.0 * preload_n / (self.guide.loaded_balls() * libm::cos(self.guide.contact_angle_rad));
        for _ in 0..60 {
            let excess = libm::log(self.preload_n(q) / preload_n);
            let step = excess / self.preload_load_exponent(q);
            q *= libm::exp(-step);
            if step.abs() < 1e-15 {
                break;
            }
        }
        (q < self.load_limit_n()).then_some(q)
    }

    /// Load per ball of a lateral force on the split block, N; `None` unless the force is positive and its load
    /// lies within the geometry.
    ///
    /// `F_H = 2 Z_b Q sin β` (Eq. 2) rises with Q, so halving the interval of all loads finds it.
    pub fn load_of_lateral_force(&self, force_n: f64) -> Option<f64> {
        let (mut low, mut high) = (0.0, self.load_limit_n());
        if !(force_n > 0.0 && force_n < self.lateral_force_n(high)) {
            return None;
        }
        // a hundred halvings leave no double between the ends
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if self.lateral_force_n(middle) < force_n {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(high)
    }

    /// dlnF_p/dlnQ: 1 with a fixed contact angle, 1/3 to 1 where it follows the load.
    pub fn preload_load_exponent(&self, q: f64) -> f64 {
        match self.guide.contact_angle {
            ContactAngle::Fixed => 1.0,
            ContactAngle::Exact => {
                let cube = libm::cbrt(q);
                let approach = self.contact.eps * cube * cube;
                1.0 - (2.0 / 3.0) * approach / (self.contact.s0 + approach - self.guide.initial_interference_m)
            }
        }
    }

    /// Inverts Eq. 21: the working point that makes this drag force (seal drag already taken off).
    ///
    /// Newton in ln Q on `ln Q + ln μ(H(Q)) = ln(F_f/4Z_b)`. The slope lies between 2/3 and 4/3 for every
    /// input (physics.md C.2), so the answer is unique. `None` unless the force is positive and finite, the
    /// viscosity and speed are not negative, and the load stays within the geometry.
    pub fn working_point(&self, drag_force_n: f64, nu: f64, speed_m_s: f64) -> Option<WorkingPoint> {
        let usable =
            drag_force_n.is_finite() && drag_force_n > 0.0 && nu.is_finite() && nu >= 0.0 && speed_m_s.is_finite();
        if !usable {
            return None;
        }
        let limit = self.load_limit_n();
        let target = libm::log(drag_force_n / self.guide.loaded_balls());
        // a mid-range friction coefficient starts within a factor two for mixed lubrication
        let mut ln_q = (target - libm::log(1.5 * self.friction.mu_coulomb)).min(libm::log(0.99 * limit));
        for _ in 0..60 {
            let q = libm::exp(ln_q);
            let h = self.hersey(q, nu, speed_m_s);
            let mu = self.friction.coefficient(h);
            let slope = 1.0 + self.hersey_load_exponent(q) * h * self.friction.slope(h) / mu;
            let step = (ln_q + libm::log(mu) - target) / slope;
            ln_q = (ln_q - step).min(libm::log(0.999_999 * limit));
            if step.abs() < 1e-15 {
                break;
            }
        }
        let q = libm::exp(ln_q);
        if q >= 0.999_998 * limit {
            return None;
        }
        Some(self.at_load(q, nu, speed_m_s))
    }

    /// The working point of a load per ball.
    pub fn at_load(&self, q: f64, nu: f64, speed_m_s: f64) -> WorkingPoint {
        let hersey = self.hersey(q, nu, speed_m_s);
        WorkingPoint {
            load_per_ball_n: q,
            hersey,
            friction_coefficient: self.friction.coefficient(hersey),
            contact_angle_rad: self.contact_angle_rad(q),
            drag_force_n: self.drag_force_n(q, nu, speed_m_s),
            preload_n: self.preload_n(q),
        }
    }
}

/// The slip ratio of Eq. 12 as a function of Q^(1/3); `const`, because the reduced law is fitted to it.
pub(crate) const fn slip_ratio(contact: &Contact, ball_diameter_m: f64, cube_root_q: f64) -> f64 {
    let c2 = ROLLING_LINE * ROLLING_LINE;
    let r = contact.deformed_radius_m;
    let a = contact.k_a * cube_root_q;
    let a2 = a * a;
    let w = constant::sqrt(r * r - c2 * a2);
    let rim = constant::sqrt(r * r - a2);
    let s = constant::sqrt(0.25 * ball_diameter_m * ball_diameter_m - a2);
    let r0 = w - rim + s;
    c2 * a2 / (r + w) / r0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED, GUIDE_PRODUCTION};

    #[test]
    fn every_drag_has_one_preload() {
        for guide in [GUIDE, GUIDE_CARRIAGE_SPEED, GUIDE_PRODUCTION] {
            let model = Exact::new(guide, FRICTION);
            for (n, q) in [1.0, 26.0, 160.0, 540.0, 1100.0].into_iter().enumerate() {
                for nu in [0.0, 5.0, 100.0, 1000.0] {
                    let v = [0.0, 1e-3, 0.05, 3.0][n % 4];
                    let there = model.at_load(q, nu, v);
                    let back = model.working_point(there.drag_force_n, nu, -v).expect("inside");
                    assert!((back.load_per_ball_n / q - 1.0).abs() < 1e-13);
                    let q2 = model.load_of_preload(there.preload_n).expect("inside");
                    assert!((q2 / q - 1.0).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn load_exponent_is_the_derivative() {
        for guide in [GUIDE, GUIDE_CARRIAGE_SPEED] {
            let model = Exact::new(guide, FRICTION);
            for q in [2.0, 50.0, 500.0] {
                let d = 1e-5;
                let h = |q: f64| libm::log(model.hersey(q, 100.0, 0.05));
                let numeric = (h(q * (1.0 + d)) - h(q * (1.0 - d))) / (2.0 * d);
                assert!((numeric - model.hersey_load_exponent(q)).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn every_lateral_force_has_one_load() {
        for guide in [GUIDE, GUIDE_PRODUCTION] {
            let model = Exact::new(guide, FRICTION);
            for q in [1e-3, 1.0, 26.0, 540.0, 7000.0] {
                let back = model.load_of_lateral_force(model.lateral_force_n(q)).expect("inside");
                assert!((back / q - 1.0).abs() < 1e-14, "{q}: {back}");
            }
            for force in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e7] {
                assert_eq!(model.load_of_lateral_force(force), None, "{force}");
            }
        }
    }

    #[test]
    fn nothing_is_invented_outside_the_geometry() {
        let model = Exact::new(GUIDE, FRICTION);
        for force in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e6] {
            assert_eq!(model.working_point(force, 100.0, 0.05), None, "{force}");
        }
        assert_eq!(model.load_of_preload(1e9), None);
    }
}
