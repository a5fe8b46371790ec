//! Elementary functions with one result everywhere.
//!
//! The on-board path must give the same bits on x86-64, in the emulators and on the chip, so its
//! transcendentals are plain f32 arithmetic: no library call whose rounding differs by platform, no
//! fused multiply-add. f64, used on the desk only, goes through `libm`. [`constant`] serves what is
//! computed at compile time.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// The numbers the reduced law is written in: f32 on the block, f64 on the desk.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// `e^x`.
    fn exp(self) -> Self;
    /// Cube root of a positive, finite, normal number, good to 3e-5 at least: to start an iteration from.
    fn rough_cbrt(self) -> Self;
    /// Neither NaN nor infinite.
    fn is_finite(self) -> bool;
}

impl Real for f32 {
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn exp(self) -> Self {
        exp(self)
    }
    #[inline(always)]
    fn rough_cbrt(self) -> Self {
        rough_cbrt(self)
    }
    #[inline(always)]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

impl Real for f64 {
    fn from_f64(x: f64) -> Self {
        x
    }
    fn exp(self) -> Self {
        libm::exp(self)
    }
    fn rough_cbrt(self) -> Self {
        libm::cbrt(self)
    }
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }
}

/// `e^x` for `-87 <= x <= 88`; beyond, the argument is clamped. Relative error at most 1.0e-7.
///
/// Cody-Waite reduction `x = n ln 2 + r`, then a polynomial in `r` (coefficients: physics.md D.4).
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let x = x.clamp(-87.0, 88.0);
    // nearest whole number by pushing it to the last bits of the mantissa: no branch, and lanes can do it side by side
    let shifted = x * core::f32::consts::LOG2_E + SHIFT;
    let nf = shifted - SHIFT;
    let r = (x - nf * 0.693_359_4) + nf * 2.121_944_4e-4;
    // e^r = 1 + r + r^2 (c2 + c3 r + c4 r^2 + c5 r^3 + c6 r^4)
    let p = 0.499_999_94 + r * (0.166_665_21 + r * (0.041_668_39 + r * (0.008_368_717 + r * 0.001_381_459_9)));
    let e = 1.0 + (r + r * r * p);
    // the whole number stands in the last bits of `shifted`; with the bias it becomes the exponent of 2^n
    e * f32::from_bits(shifted.to_bits().wrapping_add(127) << 23)
}

/// 1.5 * 2^23: added to a float below 2^22, it leaves the nearest whole number in the last bits.
const SHIFT: f32 = 12_582_912.0;

/// Cube root of a positive normal number; relative error at most 3e-5.
///
/// A third of the bit pattern is a seed good to 4 %, which Halley's step `y + y (x - y³)/(2y³ + x)` cubes. Zero,
/// negative and subnormal arguments have no meaning here.
#[inline(always)]
pub fn rough_cbrt(x: f32) -> f32 {
    let y = f32::from_bits(x.to_bits() / 3 + 709_921_077);
    let c = y * y * y;
    y + y * ((x - c) / (c + c + x))
}

/// Square root of a number that is not negative; relative error at most 1.0e-7. Negative: zero.
///
/// Newton on `1/sqrt(x)`, then one step on the root itself.
#[inline(always)]
pub fn sqrt(x: f32) -> f32 {
    if x < f32::MIN_POSITIVE {
        return 0.0;
    }
    let mut y = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    for _ in 0..3 {
        y = y * (1.5 - 0.5 * x * y * y);
    }
    let root = x * y;
    root + 0.5 * y * (x - root * root)
}

/// Natural logarithm of a positive normal number; absolute error at most 2e-7 or 2e-7 relative,
/// whichever is larger.
///
/// `x = 2^n m`, `m` in [0.707, 1.414), `ln m = 2 atanh((m-1)/(m+1))` as a series in odd powers.
#[inline(never)]
pub fn ln(x: f32) -> f32 {
    let bits = x.to_bits();
    // subtracting the pattern of sqrt(1/2) puts the mantissa into [0.707, 1.414)
    let shifted = bits.wrapping_sub(0x3f35_04f3);
    let n = (shifted as i32) >> 23;
    let m = f32::from_bits(bits.wrapping_sub((n as u32) << 23));
    let z = (m - 1.0) / (m + 1.0);
    let w = z * z;
    let series = 2.0 * z * (1.0 + w * (0.333_333_34 + w * (0.2 + w * (0.142_857_15 + w * 0.111_111_11))));
    n as f32 * core::f32::consts::LN_2 + series
}

/// Sine and cosine of a number of turns; absolute error at most 3e-7 beside what rounding left of the argument.
///
/// Whole and quarter turns are taken off exactly, then Taylor's series over an eighth of a turn to either side.
#[inline(never)]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    // beyond 2^20 turns a float holds no phase worth having
    if !(turns > -1_048_576.0 && turns < 1_048_576.0) {
        return (0.0, 1.0);
    }
    let quarters = turns * 4.0 + SHIFT;
    let nearest = quarters - SHIFT;
    let a = (turns - 0.25 * nearest) * core::f32::consts::TAU;
    let w = a * a;
    let sin = a + a * w * (-0.166_666_67 + w * (0.008_333_333 + w * (-0.000_198_412_7 + w * 2.755_732e-6)));
    let cos = 1.0 + w * (-0.5 + w * (0.041_666_668 + w * (-0.001_388_888_9 + w * 2.480_158_7e-5)));
    match quarters.to_bits() & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// f64 functions that the compiler can evaluate, for constants derived from a parameter set.
pub mod constant {
    /// Square root of a number that is not negative, to the last bit or the one before it.
    pub const fn sqrt(x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        // halving the exponent gives a seed within a factor 1.5
        let mut y = f64::from_bits((x.to_bits() >> 1) + (1023u64 << 51));
        let mut n = 0;
        while n < 6 {
            y = 0.5 * (y + x / y);
            n += 1;
        }
        y
    }

    /// Cube root of a positive number, to the last bit or the one before it.
    pub const fn cbrt(x: f64) -> f64 {
        let mut y = f64::from_bits(x.to_bits() / 3 + (2 * (1023u64 << 52)) / 3);
        let mut n = 0;
        while n < 5 {
            let c = y * y * y;
            y = y * (c + 2.0 * x) / (2.0 * c + x);
            n += 1;
        }
        y
    }

    /// Cosine for angles between 0 and pi, by its series.
    pub const fn cos(x: f64) -> f64 {
        let mut term = 1.0;
        let mut sum = 1.0;
        let mut n = 1;
        while n < 20 {
            term *= -x * x / ((2 * n - 1) as f64 * (2 * n) as f64);
            sum += term;
            n += 1;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_of_turns() {
        let mut worst = 0.0f64;
        for n in -40_000..40_000 {
            let turns = n as f32 * 1.234_567e-3;
            let angle = f64::from(turns).rem_euclid(1.0) * core::f64::consts::TAU;
            let (s, c) = sin_cos_turns(turns);
            worst = worst.max((f64::from(s) - libm::sin(angle)).abs()).max((f64::from(c) - libm::cos(angle)).abs());
        }
        assert!(worst < 3e-7, "{worst}");
        assert_eq!(sin_cos_turns(f32::NAN), (0.0, 1.0));
        assert_eq!(sin_cos_turns(1e9), (0.0, 1.0));
    }

    /// Worst relative error of `f` against `g` over every `stride`-th f32 between `lo` and `hi`.
    fn worst(lo: f32, hi: f32, stride: usize, f: fn(f32) -> f32, g: fn(f64) -> f64) -> f64 {
        (lo.to_bits()..hi.to_bits())
            .step_by(stride)
            .map(f32::from_bits)
            .map(|x| (f64::from(f(x)) / g(f64::from(x)) - 1.0).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn f32_functions_keep_their_stated_error() {
        assert!(worst(1e-30, 1e30, 997, rough_cbrt, libm::cbrt) < 3e-5);
        assert!(worst(1e-30, 1e30, 997, sqrt, libm::sqrt) < 1.0e-7);
        assert!(worst(1e-9, 80.0, 499, exp, libm::exp) < 1.0e-7);
        assert!(worst(1e-9, 80.0, 499, |x| exp(-x), |x| libm::exp(-x)) < 1.0e-7);
        for x in (1e-20_f32.to_bits()..1e20_f32.to_bits()).step_by(499).map(f32::from_bits) {
            let want = libm::log(f64::from(x));
            assert!((f64::from(ln(x)) - want).abs() < 2e-7 * want.abs().max(1.0), "ln {x}");
        }
    }

    #[test]
    fn borders_do_not_surprise() {
        assert_eq!(sqrt(0.0), 0.0);
        assert_eq!(sqrt(-1.0), 0.0);
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(f32::NEG_INFINITY), exp(-87.0));
        assert_eq!(ln(1.0), 0.0);
    }

    #[test]
    fn compile_time_functions_agree_with_libm() {
        for n in 1..4000 {
            let x = libm::pow(10.0, f64::from(n) / 100.0 - 20.0);
            assert!((constant::sqrt(x) / libm::sqrt(x) - 1.0).abs() < 4e-16, "sqrt {x}");
            assert!((constant::cbrt(x) / libm::cbrt(x) - 1.0).abs() < 7e-16, "cbrt {x}");
        }
        for n in 0..314 {
            let x = f64::from(n) / 100.0;
            assert!((constant::cos(x) - libm::cos(x)).abs() < 1e-15, "cos {x}");
        }
    }
}
