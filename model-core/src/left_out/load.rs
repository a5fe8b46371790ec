//! A load that moves the two halves of the preloaded contacts apart.
//!
//! ```text
//! W/p  = (1+t)^1.5 - (1-t)^1.5 = Σ 2·binom(1.5, n) tⁿ, n odd: 3t - t³/8 - 3t⁵/128 - ...
//! load = part·(((1+t)^e + (1-t)^e)/2 - 1) = part·Σ binom(e, 2n) t²ⁿ    e = 1.5·k
//! ρ   += preload_per_load·W/p
//! ```
//!
//! Source: `docs/mechanisms.md`, `external-load`. The chip has no sensor for the load: it is told, for each direction.
//! The series are cut after t⁸, which up to W/p = 1.4 (t = 0.49) is good to 1e-5 of the drag; more load is refused.

use crate::Error;
use crate::quantity::check_f32;

/// Largest load over the lowest preload that the series hold for.
pub const LARGEST_RATIO: f32 = 1.4;

/// A known load on the block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde_derive::Serialize, serde_derive::Deserialize))]
pub struct ExternalLoad {
    /// Load, N, signed: while moving towards larger positions, towards smaller ones.
    pub load_n: [f32; 2],
    /// Part of the equation's rise that acts.
    pub part: f32,
    /// Relative preload per W/p, where the two halves are not alike.
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

    /// Rise of the drag over the drag without load; `k` = dlnD/dlnp.
    pub fn rise(&self, ratio: f32, k: f32) -> f32 {
        let t = spread(ratio.abs());
        let t2 = t * t;
        // binom(e, 2n) one from the other
        let e = 1.5 * k;
        let b2 = e * (e - 1.0) * 0.5;
        let b4 = b2 * (e - 2.0) * (e - 3.0) * (1.0 / 12.0);
        let b6 = b4 * (e - 4.0) * (e - 5.0) * (1.0 / 30.0);
        let b8 = b6 * (e - 6.0) * (e - 7.0) * (1.0 / 56.0);
        self.part * t2 * (b2 + t2 * (b4 + t2 * (b6 + t2 * b8)))
    }
}

/// t of `r = 3t - t³/8 - 3t⁵/128 - ...`: Newton's step twice, from t = r/3.
fn spread(ratio: f32) -> f32 {
    // 2·binom(1.5, 1), 3, 5, 7, 9
    const C: [f32; 5] = [3.0, -0.125, -0.023_437_5, -0.008_789_062, -0.004_364_01];
    let mut t = ratio * (1.0 / 3.0);
    for _ in 0..2 {
        let t2 = t * t;
        let value = t * (C[0] + t2 * (C[1] + t2 * (C[2] + t2 * (C[3] + t2 * C[4]))));
        let slope = C[0] + t2 * (3.0 * C[1] + t2 * (5.0 * C[2] + t2 * (7.0 * C[3] + t2 * 9.0 * C[4])));
        t -= (value - ratio) / slope;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The equation itself, t by bisection.
    fn exact(ratio: f64, exponent: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let t: f64 = 0.5 * (low + high);
            if libm::pow(1.0 + t, 1.5) - libm::pow(1.0 - t, 1.5) < ratio { low = t } else { high = t }
        }
        0.5 * (libm::pow(1.0 + low, exponent) + libm::pow(1.0 - low, exponent)) - 1.0
    }

    #[test]
    fn series_hold_up_to_the_stated_ratio() {
        let load = ExternalLoad { load_n: [1400.0, -700.0], part: 1.0, preload_per_load: 0.0 };
        let mut worst = 0.0f64;
        for step in 0..=140 {
            for k in [0.6, 0.9, 1.0, 1.2, 1.4f32] {
                let ratio = load.ratio(1.0, 1000.0) * step as f32 / 140.0;
                let want = exact(f64::from(ratio), 1.5 * f64::from(k));
                worst = worst.max((f64::from(load.rise(ratio, k)) - want).abs() / (1.0 + want));
            }
        }
        assert!(worst < 1e-5, "{worst}");
        assert_eq!(load.rise(load.ratio(-1.0, 1000.0), 1.1), load.rise(0.7, 1.1));
    }
}
