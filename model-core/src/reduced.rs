//! The closed form that the block runs (physics.md C.1 and D.2), in f32 or f64.
//!
//! With s = Q^(1/3) the exact model reduces, to 2e-6, to
//!
//! ```text
//! h   = k_s H = B s (1 + χ1 s² + χ2 s⁴)    slip          B = k_x ν V
//! h   = B/s                                carriage speed
//! m   = μ/μ_c = 1 + m_v h + m_s e^-h
//! F_f = 4 Z_b μ_c Q m
//! F_p = 2 Z_b cos(α0) Q/(1 + κ s²)         κ = 0 where the contact angle is fixed
//! ```
//!
//! The inversion F_f -> F_p costs one rough cube root and two exponentials: a seed good to 25 % and two Halley
//! steps on s³m = fc. Its error stays below 5e-6 of F_p over the paper's domain in f32.

use crate::contact::{Contact, ContactAngle, Guide, HerseySpeed};
use crate::exact::slip_ratio;
use crate::friction::Friction;
use crate::num::{Real, constant};

/// Largest `x` (the one dimensionless group, about k_s H) that is accepted: two Halley steps leave 4e-8 there
/// (carriage; 4e-10 with slip). The paper's domain ends at 87 (carriage) and 16 (slip).
pub const GROUP_LIMIT: f64 = 100.0;

/// Why the law gives no number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutOfDomain {
    /// The force is not a positive, finite number (the seals alone explain it, or the sign is wrong).
    Force,
    /// Viscosity times speed is negative, not finite, or so large that the film law has left its range.
    ViscousSpeed,
    /// The load per ball would leave the contact's geometry.
    Load,
}

/// Interface of a drag law, for any number type.
///
/// Two builds: [`Reduced`] in floating point and [`fixed::Reduced`](crate::fixed::Reduced) in integers.
pub trait DragLaw {
    /// Number type of forces: N; a float, or Q31.32 in fixed point.
    type Force;
    /// Number type of ν·V: cSt·m/s; a float, or Q31.32 in fixed point.
    type ViscousSpeed;

    /// Drag force of the contacts at a preload.
    ///
    /// # Errors
    /// [`OutOfDomain`], naming the input that the law does not cover.
    fn drag_force(&self, preload: Self::Force, viscous_speed: Self::ViscousSpeed) -> Result<Self::Force, OutOfDomain>;

    /// Preload that makes this drag force, seal drag already taken off.
    ///
    /// # Errors
    /// [`OutOfDomain`], naming the input that the law does not cover.
    fn preload(&self, drag_force: Self::Force, viscous_speed: Self::ViscousSpeed) -> Result<Self::Force, OutOfDomain>;
}

/// A preload with the working point and the sensitivities that its uncertainty is computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inversion<R> {
    /// Preload F_p, N.
    pub preload_n: R,
    /// Normal load per ball Q, N.
    pub load_per_ball_n: R,
    /// k_s H, dimensionless: below 1 mixed lubrication, above 2.6 (for the paper's constants) full film.
    pub film: R,
    /// Friction coefficient μ.
    pub friction_coefficient: R,
    /// dlnF_p/dlnF_f at constant ν V.
    pub per_force: R,
    /// dlnF_p/dln(ν V) at constant F_f.
    pub per_viscous_speed: R,
}

/// Solution of the law for a drag force.
pub(crate) struct Root<R> {
    /// The dimensionless group.
    pub(crate) x: R,
    /// Q^(1/3).
    pub(crate) s: R,
    /// n = dln(s³m)/dln s, of the last but one iterate.
    slope: R,
    /// dln m/dln h, of the last but one iterate.
    elasticity: R,
}

/// The law at a load: the values that corrections to it depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local<R> {
    /// s = Q^(1/3), N^(1/3).
    pub load_root: R,
    /// m = μ/μ_c.
    pub friction: R,
    /// k = dlnF_f/dlnF_p at constant ν V.
    pub per_preload: R,
}

/// Constants of one guide with one friction law.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Reduced<R> {
    /// Convention of the Hersey number.
    pub hersey_speed: HerseySpeed,
    /// 1/(4 Z_b μ_c), 1/N per N.
    pub loads_per_force: R,
    /// 2 Z_b cos α0.
    pub preload_per_load: R,
    /// κ = ε/s0, N^(-2/3).
    pub angle_per_load: R,
    /// k_x: k_s k_u/k_p (slip) or k_s/k_p (carriage), per (cSt m/s).
    pub film_per_viscous_speed: R,
    /// χ1, N^(-2/3); 0 for the carriage convention.
    pub slip_1: R,
    /// χ2, N^(-4/3); 0 for the carriage convention.
    pub slip_2: R,
    /// m_v = μ_v/(k_s μ_c).
    pub viscous: R,
    /// m_s = μ_s/μ_c.
    pub stribeck: R,
    /// μ_c.
    pub mu_coulomb: R,
    /// Largest load per ball the constants hold for, N.
    pub load_limit_n: R,
}

impl Reduced<f64> {
    /// Derives the constants from a guide that passes [`Guide::check`], for loads per ball up to
    /// `load_limit_n`. Can be evaluated at compile time.
    ///
    /// χ1 and χ2 make the slip ratio exact at the two Chebyshev nodes of the load range (in Q^(2/3)). An
    /// initial interference δ0 divides out: `s0 = s_free + δ0`, so κ = ε/s_free and F_p gains s0/s_free.
    pub const fn of(guide: &Guide, friction: &Friction, load_limit_n: f64) -> Self {
        let contact = Contact::of(guide);
        let k_s = friction.stribeck_exponent;
        let (slip_1, slip_2) = match guide.hersey_speed {
            HerseySpeed::Carriage => (0.0, 0.0),
            HerseySpeed::Slip => slip_series(&contact, guide.ball_diameter_m, load_limit_n),
        };
        let half = 0.5 * guide.loaded_balls() * constant::cos(guide.contact_angle_rad);
        // s0 + ε s² - δ0 with s0 = (f_r+f_c-1) D_b + δ0, so the unloaded distance divides out
        let free = contact.s0 - guide.initial_interference_m;
        let (preload_per_load, angle_per_load) = match guide.contact_angle {
            ContactAngle::Fixed => (half, 0.0),
            ContactAngle::Exact => (half * contact.s0 / free, contact.eps / free),
        };
        Reduced {
            hersey_speed: guide.hersey_speed,
            loads_per_force: 1.0 / (guide.loaded_balls() * friction.mu_coulomb),
            preload_per_load,
            angle_per_load,
            film_per_viscous_speed: k_s * contact.k_u / contact.k_p,
            slip_1,
            slip_2,
            viscous: friction.mu_viscous / (k_s * friction.mu_coulomb),
            stribeck: friction.mu_stribeck / friction.mu_coulomb,
            mu_coulomb: friction.mu_coulomb,
            load_limit_n,
        }
    }

    /// The same constants in single precision, for the block.
    pub const fn to_f32(&self) -> Reduced<f32> {
        Reduced {
            hersey_speed: self.hersey_speed,
            loads_per_force: self.loads_per_force as f32,
            preload_per_load: self.preload_per_load as f32,
            angle_per_load: self.angle_per_load as f32,
            film_per_viscous_speed: self.film_per_viscous_speed as f32,
            slip_1: self.slip_1 as f32,
            slip_2: self.slip_2 as f32,
            viscous: self.viscous as f32,
            stribeck: self.stribeck as f32,
            mu_coulomb: self.mu_coulomb as f32,
            load_limit_n: self.load_limit_n as f32,
        }
    }
}

/// χ1, χ2 of `u/V = k_u t (1 + χ1 t + χ2 t²)`, t = Q^(2/3), exact at two Chebyshev nodes of (0, t_max).
const fn slip_series(contact: &Contact, ball_diameter_m: f64, load_limit_n: f64) -> (f64, f64) {
    let s = constant::cbrt(load_limit_n);
    // nodes (1 ± cos(π/4))/2 of the range
    let (low, high) = (0.146_446_609_406_726_24 * s * s, 0.853_553_390_593_273_8 * s * s);
    let excess_low = slip_ratio(contact, ball_diameter_m, constant::sqrt(low)) / (contact.k_u * low) - 1.0;
    let excess_high = slip_ratio(contact, ball_diameter_m, constant::sqrt(high)) / (contact.k_u * high) - 1.0;
    let slip_2 = (excess_high / high - excess_low / low) / (high - low);
    (excess_low / low - slip_2 * low, slip_2)
}

impl<R: Real> Reduced<R> {
    /// k_s H at s = Q^(1/3), and dln h/dln s.
    #[inline(always)]
    fn film(&self, speed: HerseySpeed, s: R, b: R) -> (R, R) {
        let c = R::from_f64;
        match speed {
            HerseySpeed::Slip => {
                let s2 = s * s;
                let first = self.slip_1 * s2;
                let second = self.slip_2 * s2 * s2;
                (b * s * (c(1.0) + (first + second)), c(1.0) + c(2.0) * (first + (second + second)))
            }
            HerseySpeed::Carriage => (b / s, c(-1.0)),
        }
    }

    /// Solves `s³ m(s) = fc` for s = Q^(1/3). Without a branch on data, so that many can be solved side by side;
    /// `speed` is handed over so that a loop can be built for each convention.
    #[inline(always)]
    pub(crate) fn root(&self, speed: HerseySpeed, fc: R, b: R) -> Root<R> {
        let c = R::from_f64;
        let one = c(1.0);
        let s1 = fc.rough_cbrt();
        let (x, seed) = match speed {
            HerseySpeed::Slip => {
                let x = b * s1;
                (x, c(1.15) + c(0.006) * x)
            }
            HerseySpeed::Carriage => {
                let x = b / s1;
                (x, c(1.12) + c(0.020) * x)
            }
        };
        let mut s = s1 / seed;
        let (mut m, mut rise_of_m, mut rise_of_product) = (one, c(0.0), c(0.0));
        for _ in 0..2 {
            let (h, film_exponent) = self.film(speed, s, b);
            let stribeck = self.stribeck * (-h).exp();
            m = one + self.viscous * h + stribeck;
            // dm/dln h
            rise_of_m = h * (self.viscous - stribeck);
            // m n
            rise_of_product = c(3.0) * m + film_exponent * rise_of_m;
            let product = s * s * s * m;
            let missing = fc - product;
            // Halley's step with d = missing/product and n, multiplied out: one division
            let twice = missing + missing;
            s = s + s * (twice * m) / ((rise_of_product + rise_of_product) * product + (rise_of_product - m) * missing);
        }
        Root { x, s, slope: rise_of_product / m, elasticity: rise_of_m / m }
    }

    /// The law at a load per ball above 0, N, and ν·abs(V), cSt·m/s; more exact than [`invert`](Self::invert).
    ///
    /// ```text
    /// m = 1 + m_v h + m_s e^-h,   k = (3 + (dln h/dln s)·dln m/dln h)/(3 - 2κs²/(1 + κs²)),   s = Q^(1/3)
    /// ```
    pub fn local(&self, load_per_ball_n: R, viscous_speed: R) -> Local<R> {
        let c = R::from_f64;
        let s = load_per_ball_n.rough_cbrt();
        // one Newton step reduces the seed's error of 3e-5 to 1e-9
        let s = s - (s * s * s - load_per_ball_n) / (c(3.0) * s * s);
        let (h, film_exponent) = self.film(self.hersey_speed, s, self.film_per_viscous_speed * viscous_speed);
        // the inversion's exponent leaves out the series in its denominator: enough for an iteration, not here
        let film_exponent = match self.hersey_speed {
            HerseySpeed::Slip => {
                let series = c(1.0) + s * s * (self.slip_1 + self.slip_2 * (s * s));
                c(1.0) + (film_exponent - c(1.0)) / series
            }
            HerseySpeed::Carriage => film_exponent,
        };
        let stribeck = self.stribeck * (-h).exp();
        let m = c(1.0) + self.viscous * h + stribeck;
        let film = film_exponent * h * (self.viscous - stribeck) / m;
        let angle = self.angle_per_load * (s * s);
        let per_preload = (c(3.0) + film) / (c(3.0) - (angle + angle) / (c(1.0) + angle));
        Local { load_root: s, friction: m, per_preload }
    }

    /// m = μ/μ_c at the cube root of a load per ball, N^(1/3), and ν·abs(V), cSt·m/s.
    #[inline]
    pub fn friction(&self, load_root: R, viscous_speed: R) -> R {
        let (h, _) = self.film(self.hersey_speed, load_root, self.film_per_viscous_speed * viscous_speed);
        R::from_f64(1.0) + self.viscous * h + self.stribeck * (-h).exp()
    }

    /// Inverts the law: preload, working point and sensitivities of a drag force.
    ///
    /// ```text
    /// fc = F_f/(4 Z_b μ_c),  s1 = fc^(1/3),  b = k_x ν V,  x = b s1 | b/s1
    /// s  = s1/(1.15 + 0.006 x) | s1/(1.12 + 0.020 x)                             seed
    /// twice:  d = fc/(s³m) - 1,  n = dln(s³m)/dln s,  s += s·2d/(2n + (n-1) d)   Halley
    /// ```
    ///
    /// `force_n`: drag without seals, N, > 0. `viscous_speed`: ν·abs(V), cSt·m/s, >= 0. The preload is good
    /// to 5e-6 (f32, paper's domain); the sensitivities come from the last but one iterate, good to 1e-3.
    ///
    /// # Errors
    /// [`OutOfDomain`] instead of a number outside the law.
    #[inline(always)]
    pub fn invert(&self, force_n: R, viscous_speed: R) -> Result<Inversion<R>, OutOfDomain> {
        let c = R::from_f64;
        let one = c(1.0);
        // the cube root of a subnormal has no seed; a force below 1e-6 N is no measurement
        if !(force_n > c(1e-6) && force_n.is_finite()) {
            return Err(OutOfDomain::Force);
        }
        if !(viscous_speed >= c(0.0) && viscous_speed.is_finite()) {
            return Err(OutOfDomain::ViscousSpeed);
        }
        let fc = force_n * self.loads_per_force;
        let Root { x, s, slope, elasticity } =
            self.root(self.hersey_speed, fc, self.film_per_viscous_speed * viscous_speed);
        if x > c(GROUP_LIMIT) {
            return Err(OutOfDomain::ViscousSpeed);
        }
        let q = s * s * s;
        if q > self.load_limit_n {
            return Err(OutOfDomain::Load);
        }
        let angle = self.angle_per_load * (s * s);
        let stretch = one + angle;
        // dlnF_p/dlnF_f = (dlnF_p/dlnQ)(dlnQ/dlnF_f) = (1 - (2/3) κs²/(1+κs²)) · 3/n
        let per_force = (c(3.0) - (angle + angle) / stretch) / slope;
        Ok(Inversion {
            preload_n: self.preload_per_load * q / stretch,
            load_per_ball_n: q,
            film: self.film(self.hersey_speed, s, self.film_per_viscous_speed * viscous_speed).0,
            friction_coefficient: self.mu_coulomb * (fc / q),
            per_force,
            per_viscous_speed: -(per_force * elasticity),
        })
    }
}

impl<R: Real> DragLaw for Reduced<R> {
    type Force = R;
    type ViscousSpeed = R;

    /// `F_f = 4 Z_b μ_c Q m`, with Q from `Q = (F_p/2 Z_b cos α0)(1 + κ Q^(2/3))` by Newton in s.
    fn drag_force(&self, preload: R, viscous_speed: R) -> Result<R, OutOfDomain> {
        let c = R::from_f64;
        if !(preload > c(1e-6) && preload.is_finite()) {
            return Err(OutOfDomain::Force);
        }
        if !(viscous_speed >= c(0.0) && viscous_speed.is_finite()) {
            return Err(OutOfDomain::ViscousSpeed);
        }
        let y = preload / self.preload_per_load;
        let ky = y * self.angle_per_load;
        let mut s = y.rough_cbrt();
        for _ in 0..4 {
            let s2 = s * s;
            s = s - (s2 * s - y - ky * s2) / (c(3.0) * s2 - (ky + ky) * s);
        }
        let q = s * s * s;
        if q > self.load_limit_n {
            return Err(OutOfDomain::Load);
        }
        let (h, _) = self.film(self.hersey_speed, s, self.film_per_viscous_speed * viscous_speed);
        Ok(q * (c(1.0) + self.viscous * h + self.stribeck * (-h).exp()) / self.loads_per_force)
    }

    #[inline(always)]
    fn preload(&self, drag_force: R, viscous_speed: R) -> Result<R, OutOfDomain> {
        self.invert(drag_force, viscous_speed).map(|i| i.preload_n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::Exact;
    use crate::reference::zhou_2023::{FRICTION, GUIDE, GUIDE_CARRIAGE_SPEED, GUIDE_PRODUCTION};

    const SLIP: Reduced<f64> = Reduced::of(&GUIDE, &FRICTION, 600.0);

    #[test]
    fn constants_of_the_checked_specification() {
        // physics.md C.1, as printed there
        for (got, want, tolerance) in [
            (SLIP.film_per_viscous_speed, 0.047_350_409_8, 1e-8),
            (SLIP.viscous, 0.064_632_540_8, 1e-8),
            (SLIP.stribeck, 0.879_120_879_1, 1e-9),
            (SLIP.loads_per_force, 10.566_356_72, 1e-9),
            (SLIP.angle_per_load, 1.634_391e-3, 1e-6),
            // fitted there over another load range
            (SLIP.slip_1, 2.334_997e-4, 5e-3),
            (SLIP.slip_2, 9.582_044e-8, 0.15),
        ] {
            assert!((got / want - 1.0).abs() < tolerance, "{got} against {want}");
        }
    }

    #[test]
    fn follows_the_exact_model_and_its_sensitivities() {
        for guide in [GUIDE, GUIDE_CARRIAGE_SPEED, GUIDE_PRODUCTION, Guide { initial_interference_m: 4e-6, ..GUIDE }] {
            let exact = Exact::new(guide, FRICTION);
            let law = Reduced::of(&guide, &FRICTION, 600.0);
            let scale = if guide.hersey_speed == HerseySpeed::Slip { 1.0 } else { 0.0528 };
            for q in [26.0, 90.0, 300.0, 540.0] {
                for (nu, v) in [(20.0, 0.1 / 60.0), (100.0, 0.01), (100.0, 0.1), (400.0, 0.1)] {
                    let at = exact.at_load(q, nu * scale, v);
                    let got = law.invert(at.drag_force_n, nu * scale * v).expect("inside");
                    assert!((got.preload_n / at.preload_n - 1.0).abs() < 4e-6);
                    assert!((got.friction_coefficient / at.friction_coefficient - 1.0).abs() < 4e-6);
                    let forth = law.drag_force(got.preload_n, nu * scale * v).expect("inside");
                    assert!((forth / at.drag_force_n - 1.0).abs() < 1e-7);
                    let bump = |f: f64, n: f64| {
                        libm::log(law.preload(at.drag_force_n * f, nu * scale * v * n).expect("inside"))
                    };
                    let d = 1e-4;
                    let per_force = (bump(1.0 + d, 1.0) - bump(1.0 - d, 1.0)) / (2.0 * d);
                    let per_nu = (bump(1.0, 1.0 + d) - bump(1.0, 1.0 - d)) / (2.0 * d);
                    let local = law.local(got.load_per_ball_n, nu * scale * v);
                    // the inversion computes its coefficient from the force, so it holds the error that two iterations
                    // leave
                    assert!((local.friction * law.mu_coulomb / got.friction_coefficient - 1.0).abs() < 1.2e-5);
                    let drag = |f: f64| libm::log(law.drag_force(got.preload_n * f, nu * scale * v).expect("inside"));
                    let per_preload = (drag(1.0 + d) - drag(1.0 - d)) / (2.0 * d);
                    assert!((local.per_preload / per_preload - 1.0).abs() < 1e-8, "{local:?} {per_preload}");
                    assert!((got.per_force - per_force).abs() < 1e-3);
                    assert!((got.per_viscous_speed - per_nu).abs() < 1e-3);
                }
            }
        }
    }

    #[test]
    fn says_which_input_leaves_the_domain() {
        let law = SLIP.to_f32();
        for force in [0.0, -3.0, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE] {
            assert_eq!(law.preload(force, 5.0), Err(OutOfDomain::Force));
        }
        for viscous in [-1.0, f32::NAN, f32::INFINITY, 1e5] {
            assert_eq!(law.preload(20.0, viscous), Err(OutOfDomain::ViscousSpeed));
        }
        assert_eq!(law.preload(300.0, 5.0), Err(OutOfDomain::Load));
        assert_eq!(law.drag_force(20_000.0, 5.0), Err(OutOfDomain::Load));
        assert!(law.preload(20.0, 0.0).is_ok());
    }
}
