//! The friction coefficient of a ball contact as a function of the Hersey number (Zhou 2023, Eq. 19 and 20).
//!
//! ```text
//! μ(H) = μ_c + μ_v H + μ_s e^(-k_s H)
//! ```
//!
//! `H = ν u / P` is not dimensionless in the paper: ν is the NUMBER of centistokes, u in m/s (the sliding
//! speed in the contact, or the carriage speed), P the MAXIMUM contact pressure in Pa. `μ_v` and `k_s`
//! carry the inverse unit. Which speed belongs in u is a property of the parameter set, see
//! [`HerseySpeed`](crate::contact::HerseySpeed).

/// The four constants of Eq. 20.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct Friction {
    /// μ_c, Coulomb part; dimensionless.
    pub mu_coulomb: f64,
    /// μ_v, slope of the full-film part; per unit of H.
    pub mu_viscous: f64,
    /// μ_s, rise towards standstill; dimensionless.
    pub mu_stribeck: f64,
    /// k_s, decay of that rise; per unit of H.
    pub stribeck_exponent: f64,
}

impl Friction {
    /// Friction coefficient at a Hersey number of the paper's unit (see the module page), `H >= 0`.
    ///
    /// `μ(H) = μ_c + μ_v H + μ_s e^(-k_s H)`      Zhou 2023, Eq. 20
    pub fn coefficient(&self, hersey: f64) -> f64 {
        self.mu_coulomb + self.mu_viscous * hersey + self.mu_stribeck * libm::exp(-self.stribeck_exponent * hersey)
    }

    /// dμ/dH, per unit of H.
    pub fn slope(&self, hersey: f64) -> f64 {
        self.mu_viscous - self.mu_stribeck * self.stribeck_exponent * libm::exp(-self.stribeck_exponent * hersey)
    }

    /// The Hersey number of the smallest friction coefficient: `ln(μ_s k_s/μ_v)/k_s`.
    ///
    /// Infinite without a viscous part, negative where the viscous part rises from the start.
    pub fn hersey_of_minimum(&self) -> f64 {
        libm::log(self.mu_stribeck * self.stribeck_exponent / self.mu_viscous) / self.stribeck_exponent
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::zhou_2023::FRICTION;

    #[test]
    fn minimum_of_equation_20() {
        // physics.md 0, row 5: 0.0022447 at H = 3.5131e-11, k_s H = 2.6102
        let h = FRICTION.hersey_of_minimum();
        assert!((h / 3.5131e-11 - 1.0).abs() < 1e-4);
        assert!((FRICTION.stribeck_exponent * h - 2.6102).abs() < 1e-4);
        assert!((FRICTION.coefficient(h) - 0.002_244_7).abs() < 5e-8);
        assert!(FRICTION.slope(h).abs() < 1e-3 * FRICTION.mu_viscous);
    }

    #[test]
    fn slope_is_the_derivative() {
        for h in [1e-13, 1e-12, 1e-11, 3e-11, 1e-10] {
            let d = h * 1e-5;
            let numeric = (FRICTION.coefficient(h + d) - FRICTION.coefficient(h - d)) / (2.0 * d);
            assert!((numeric / FRICTION.slope(h) - 1.0).abs() < 1e-6, "{h}");
        }
    }
}
