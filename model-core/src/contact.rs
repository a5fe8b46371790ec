//! Geometry of a ball guide and the Hertz contact of its balls (Zhou 2023, Eq. 3, 5, 9, 10, 11, 13).
//!
//! Everything that does not depend on the load is computed here once, from exact elliptic integrals, and
//! can be evaluated at compile time: no constant of the block is entered by hand.

use crate::Error;
use crate::num::constant::{cbrt, sqrt};
use crate::quantity::check;
use core::f64::consts::PI;

/// Which speed stands in the Hersey number `H = ν u / P`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum HerseySpeed {
    /// Sliding speed at the centre of the contact ellipse, Eq. 12 corrected: `H` grows with `Q^(1/3)`.
    Slip,
    /// The carriage speed itself: `H` falls with `Q^(-1/3)`.
    Carriage,
}

/// How the contact angle responds to load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum ContactAngle {
    /// Constant: a production block, preloaded by oversize balls.
    Fixed,
    /// Rises as the split test block is squeezed sideways: Eq. 4 without its small-angle slip.
    Exact,
}

/// Data of a guide: geometry, material and conventions. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Guide {
    /// Ball diameter D_b, m.
    pub ball_diameter_m: f64,
    /// Loaded balls in one of the four rows, Z_b.
    pub balls_per_row: u32,
    /// Contact angle α0 without load, rad, measured from the vertical.
    pub contact_angle_rad: f64,
    /// Rail groove radius over ball diameter, f_r.
    pub conformity_rail: f64,
    /// Slider groove radius over ball diameter, f_c.
    pub conformity_slider: f64,
    /// Young's modulus of balls and raceways, Pa.
    pub young_modulus_pa: f64,
    /// Poisson's ratio of balls and raceways.
    pub poisson_ratio: f64,
    /// Elastic approach δ0 of one ball already present without lateral load, m.
    pub initial_interference_m: f64,
    /// Speed convention of the Hersey number.
    pub hersey_speed: HerseySpeed,
    /// Whether the contact angle follows the load.
    pub contact_angle: ContactAngle,
}

impl Guide {
    /// Checks every field against [`RANGES`](crate::quantity::RANGES).
    ///
    /// # Errors
    /// The first field that is not finite or out of range, by name.
    pub fn check(&self) -> Result<(), Error> {
        check("ball_diameter_m", self.ball_diameter_m)?;
        check("balls_per_row", f64::from(self.balls_per_row))?;
        check("contact_angle_rad", self.contact_angle_rad)?;
        check("conformity", self.conformity_rail)?;
        check("conformity", self.conformity_slider)?;
        check("young_modulus_pa", self.young_modulus_pa)?;
        check("poisson_ratio", self.poisson_ratio)?;
        check("initial_interference_m", self.initial_interference_m)
    }

    /// Number of loaded balls, 4 Z_b.
    pub const fn loaded_balls(&self) -> f64 {
        4.0 * self.balls_per_row as f64
    }
}

/// Shape of the Hertz ellipse of a ball in a straight circular groove, free of size, load and material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Axis ratio κ = a/b >= 1.
    pub kappa: f64,
    /// Dimensionless major semi-axis a*.
    pub a: f64,
    /// Dimensionless minor semi-axis b*.
    pub b: f64,
    /// Dimensionless approach δ* (ξ of Eq. 5).
    pub approach: f64,
}

impl Ellipse {
    /// Solves Eq. 10 for a groove of conformity `f`, legal range in [`RANGES`](crate::quantity::RANGES).
    ///
    /// ```text
    /// F(ρ) = (1/f)/(4 - 1/f) = ((κ²+1) E - 2 K)/((κ²-1) E),   modulus² m = 1 - 1/κ²
    /// a* = (2κ²E/π)^(1/3),  b* = (2E/(πκ))^(1/3),  δ* = (2K/π)(π/(2κ²E))^(1/3)
    /// ```
    pub const fn of_groove(f: f64) -> Self {
        let difference = (1.0 / f) / (4.0 - 1.0 / f);
        // the right-hand side rises with κ: halve the interval until it has no inside
        let (mut low, mut high) = (1.0001, 1e4);
        let mut n = 0;
        while n < 80 {
            let kappa = 0.5 * (low + high);
            let (k, e) = elliptic(kappa);
            let k2 = kappa * kappa;
            if ((k2 + 1.0) * e - 2.0 * k) / ((k2 - 1.0) * e) < difference {
                low = kappa;
            } else {
                high = kappa;
            }
            n += 1;
        }
        let kappa = 0.5 * (low + high);
        let (k, e) = elliptic(kappa);
        let a = cbrt(2.0 * kappa * kappa * e / PI);
        Ellipse { kappa, a, b: cbrt(2.0 * e / (PI * kappa)), approach: 2.0 * k / (PI * a) }
    }
}

/// Complete elliptic integrals (K, E) of the modulus² `1 - 1/κ²`, by the arithmetic-geometric mean.
///
/// Abramowitz and Stegun 17.6: `K = π/(2 agm(1, 1/κ))`, `E = K (1 - Σ 2^(n-1) c_n²)`.
const fn elliptic(kappa: f64) -> (f64, f64) {
    let (mut a, mut b) = (1.0, 1.0 / kappa);
    let mut sum = 0.5 * (1.0 - b * b);
    let mut power = 1.0;
    let mut n = 0;
    while n < 7 {
        let c = 0.5 * (a - b);
        let mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
        sum += power * c * c;
        power *= 2.0;
        n += 1;
    }
    let k = PI / (2.0 * a);
    (k, k * (1.0 - sum))
}

/// The load-independent factors of one guide's contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Shape of the slider contact.
    pub ellipse: Ellipse,
    /// a = k_a Q^(1/3), major semi-axis of the slider contact, m·N^(-1/3).
    pub k_a: f64,
    /// b = k_b Q^(1/3), minor semi-axis, m·N^(-1/3).
    pub k_b: f64,
    /// P = k_p Q^(1/3), maximum pressure, Pa·N^(-1/3).
    pub k_p: f64,
    /// Elastic approach of both contacts together = eps Q^(2/3), m·N^(-2/3).
    pub eps: f64,
    /// Distance of the groove centres without load, s0, m.
    pub s0: f64,
    /// Radius of the deformed surface, Eq. 13, m.
    pub deformed_radius_m: f64,
    /// u/V = k_u Q^(2/3) to leading order (1 where the carriage speed stands in H).
    pub k_u: f64,
}

/// Where on the major axis a free ball rolls without slip, over a: the root `2 sin 10°` of c³ - 3c + 1.
///
/// Net tangential force of a Hertz contact with Coulomb slip is μQ(3c - c³ - 1) (physics.md A.3).
pub const ROLLING_LINE: f64 = 0.347_296_355_333_860_7;

impl Contact {
    /// Derives the factors; the guide must pass [`Guide::check`], otherwise they mean nothing.
    pub const fn of(guide: &Guide) -> Self {
        let d = guide.ball_diameter_m;
        let (f_r, f_c) = (guide.conformity_rail, guide.conformity_slider);
        let rail = Ellipse::of_groove(f_r);
        let slider = Ellipse::of_groove(f_c);
        // ball and raceway of one material
        let compliance = 2.0 * (1.0 - guide.poisson_ratio * guide.poisson_ratio) / guide.young_modulus_pa;
        // Σρ = (4f - 1)/(f D_b)
        let curvature_r = (4.0 * f_r - 1.0) / (f_r * d);
        let curvature_c = (4.0 * f_c - 1.0) / (f_c * d);
        // Eq. 9: a = a* (3 Q E''/(2 Σρ))^(1/3)
        let scale = cbrt(1.5 * compliance / curvature_c);
        let k_a = slider.a * scale;
        let k_b = slider.b * scale;
        // Eq. 5: δ = ((3/2)^(2/3)/2) δ* E''^(2/3) Σρ^(1/3) Q^(2/3), rail and slider; the paper rounds the factor to
        // 0.655
        let c2 = cbrt(compliance) * cbrt(compliance);
        let eps = 0.5 * cbrt(2.25) * c2 * (rail.approach * cbrt(curvature_r) + slider.approach * cbrt(curvature_c));
        // Eq. 13: R = 2 f_c D_b/(2 f_c + 1)
        let radius = 2.0 * f_c * d / (2.0 * f_c + 1.0);
        let k_u = match guide.hersey_speed {
            // u/V = c²a²/(R D_b) to leading order
            HerseySpeed::Slip => ROLLING_LINE * ROLLING_LINE * k_a * k_a / (radius * d),
            HerseySpeed::Carriage => 1.0,
        };
        Contact {
            ellipse: slider,
            k_a,
            k_b,
            // Eq. 11: P = 3Q/(2πab), the MAXIMUM pressure although the paper calls it average
            k_p: 1.5 / (PI * k_a * k_b),
            eps,
            s0: (f_r + f_c - 1.0) * d + guide.initial_interference_m,
            deformed_radius_m: radius,
            k_u,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::zhou_2023::GUIDE;

    /// physics.md A.5: conformity, kappa, a*, b*, xi, k_a, k_b, k_P, eps_H.
    const TABLE_A5: [[f64; 9]; 7] = [
        [0.505, 18.29343, 5.98378, 0.32710, 0.45698, 2.074415e-4, 1.133968e-5, 2.02976e8, 1.74692e-7],
        [0.510, 12.21469, 4.57987, 0.37495, 0.54125, 1.582664e-4, 1.295705e-5, 2.32834e8, 2.07568e-7],
        [0.515, 9.63167, 3.91628, 0.40660, 0.59472, 1.349162e-4, 1.400756e-5, 2.52647e8, 2.28780e-7],
        [0.520, 8.13632, 3.50605, 0.43091, 0.63408, 1.204207e-4, 1.480040e-5, 2.67896e8, 2.44658e-7],
        [0.525, 7.13961, 3.21929, 0.45091, 0.66516, 1.102484e-4, 1.544180e-5, 2.80460e8, 2.57400e-7],
        [0.530, 6.41854, 3.00398, 0.46802, 0.69073, 1.025823e-4, 1.598218e-5, 2.91228e8, 2.68056e-7],
        [0.540, 5.43139, 2.69662, 0.49649, 0.73100, 9.158453e-5, 1.686208e-5, 3.09178e8, 2.85242e-7],
    ];

    #[test]
    fn hertz_coefficients_of_the_checked_table() {
        for row in TABLE_A5 {
            let guide = Guide { conformity_rail: row[0], conformity_slider: row[0], ..GUIDE };
            let c = Contact::of(&guide);
            let got =
                [row[0], c.ellipse.kappa, c.ellipse.a, c.ellipse.b, c.ellipse.approach, c.k_a, c.k_b, c.k_p, c.eps];
            for (g, w) in got.iter().zip(row) {
                assert!((g / w - 1.0).abs() < 2e-5, "f = {}: {g} against {w}", row[0]);
            }
        }
    }

    #[test]
    fn rolling_line_is_the_force_free_root() {
        let c = ROLLING_LINE;
        assert!((c * c * c - 3.0 * c + 1.0).abs() < 1e-15);
        assert!((c - 2.0 * libm::sin(core::f64::consts::PI / 18.0)).abs() < 1e-16);
    }

    #[test]
    fn circular_limit_of_the_elliptic_integrals() {
        let (k, e) = elliptic(1.0);
        assert!((k - PI / 2.0).abs() < 1e-15 && (e - PI / 2.0).abs() < 1e-15);
    }

    #[test]
    fn refuses_a_groove_tighter_than_the_ball() {
        let guide = Guide { conformity_rail: 0.49, ..GUIDE };
        assert_eq!(guide.check(), Err(Error::OutOfRange("conformity")));
    }
}
