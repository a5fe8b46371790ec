//! An external load W, which loads one half of the contacts (preload p) and relieves the other.
//!
//! ```text
//! W/p  = (1+t)^1.5 - (1-t)^1.5
//! load = part·(r₊m(r₊) + r₋m(r₋) - 2m(1))/2m(1)    r± = (1±t)^1.5, m(r) = μ/μ_c at r times the load per ball, r^(1/3) = √(1±t)
//! ρ   += preload_per_load·W/p
//! ```
//!
//! Source: `docs/mechanisms.md`, `external-load`. The chip has no sensor for the load: it is a parameter, one value per
//! direction. t is a polynomial in W/p that holds up to W/p = 1.4 (t = 0.49); more load is refused.

use crate::Error;
use crate::quantity::check_f32;

/// Largest ratio of load to lowest preload for which the polynomial holds.
pub const LARGEST_RATIO: f32 = 1.4;

/// A known load on the block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct ExternalLoad {
    /// Load, N, signed: while moving towards larger positions, towards smaller ones.
    pub load_n: [f32; 2],
    /// Share of the equation's rise that acts.
    pub part: f32,
    /// Change of the relative preload per W/p, where the two halves are not alike.
    pub preload_per_load: f32,
}

impl ExternalLoad {
    /// None.
    pub const NONE: ExternalLoad = ExternalLoad { load_n: [0.0; 2], part: 0.0, preload_per_load: 0.0 };

    pub(super) fn acts(&self) -> bool {
        self.load_n != [0.0; 2] && (self.part != 0.0 || self.preload_per_load != 0.0)
    }

    pub(super) fn check(&self, least_preload_n: f32) -> Result<(), Error> {
        check_f32("load_part", self.part)?;
        check_f32("left_out_part", self.preload_per_load)?;
        for load in self.load_n {
            check_f32("external_load_n", load)?;
            if self.acts() && load.abs() > LARGEST_RATIO * least_preload_n {
                return Err(Error::OutOfRange("external_load_n"));
            }
        }
        Ok(())
    }

    /// W/p, signed, for a direction of motion.
    pub fn ratio(&self, sign: f32, preload_n: f32) -> f32 {
        let [forward, backward] = self.load_n;
        (if sign < 0.0 { backward } else { forward }) / preload_n
    }

    /// Rise of the drag over the drag without load, both halves of the contacts on the law at their own loads.
    ///
    /// `friction(x)`: μ/μ_c at x times the cube root of the load per ball; `here`: μ/μ_c at the load itself.
    pub fn rise(&self, ratio: f32, here: f32, friction: impl Fn(f32) -> f32) -> f32 {
        let t = spread(ratio.abs());
        let roots = roots(t);
        let half = |deflection: f32, root: f32| deflection * root * friction(root);
        self.part * (0.5 * (half(1.0 + t, roots[0]) + half(1.0 - t, roots[1])) / here - 1.0)
    }
}

/// t of `r = (1+t)^1.5 - (1-t)^1.5` within 1e-8 up to [`LARGEST_RATIO`].
///
/// ```text
/// t = x + x³/24 + x⁵/77 + ...    x = r/3; minimax coefficients
/// ```
fn spread(ratio: f32) -> f32 {
    const C: [f32; 4] = [0.041_666_6, 0.013_030_92, 0.006_179_71, 0.005_398_07];
    let x = ratio * (1.0 / 3.0);
    let u = x * x;
    x + x * u * (C[0] + u * (C[1] + u * (C[2] + u * C[3])))
}

/// `√(1+t)` and `√(1-t)` within 2e-7 up to t = 0.492, from a common even and odd part with minimax coefficients.
fn roots(t: f32) -> [f32; 2] {
    let u = t * t;
    let even = 1.0 + u * (-0.125 + u * (-0.039_112_79 + u * (-0.019_515_36 + u * -0.019_084_1)));
    let odd = t * (0.5 + u * (0.062_495_37 + u * (0.027_491_83 + u * (0.014_490_61 + u * 0.017_789_01))));
    [even + odd, even - odd]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// μ/μ_c of Eq. 20 at a multiple of the load; `film`: k_s H at the load itself.
    fn friction(load: f64, film: f64) -> f64 {
        let film = film * libm::cbrt(load);
        1.0 + 0.065 * film + 0.88 * libm::exp(-film)
    }

    /// The equation itself, t by bisection.
    fn exact(ratio: f64, film: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let t: f64 = 0.5 * (low + high);
            if libm::pow(1.0 + t, 1.5) - libm::pow(1.0 - t, 1.5) < ratio { low = t } else { high = t }
        }
        let half = |deflection: f64| {
            let load = libm::pow(deflection, 1.5);
            load * friction(load, film)
        };
        0.5 * (half(1.0 + low) + half(1.0 - low)) / friction(1.0, film) - 1.0
    }

    #[test]
    fn the_polynomial_holds_up_to_the_stated_ratio() {
        let load = ExternalLoad { load_n: [1400.0, -700.0], part: 1.0, preload_per_load: 0.0 };
        let rise = |ratio: f32, film: f64| {
            let at_root = |root: f32| friction(libm::pow(f64::from(root), 3.0), film) as f32;
            load.rise(ratio, friction(1.0, film) as f32, at_root)
        };
        let mut worst = 0.0f64;
        for step in 0..=140 {
            for film in [0.0, 0.3, 1.0, 3.0, 8.0] {
                let ratio = load.ratio(1.0, 1000.0) * step as f32 / 140.0;
                let want = exact(f64::from(ratio), film);
                worst = worst.max((f64::from(rise(ratio, film)) - want).abs() / (1.0 + want));
            }
        }
        assert!(worst < 1e-5, "{worst}");
        assert_eq!(rise(load.ratio(-1.0, 1000.0), 1.1), rise(0.7, 1.1));
    }
}
