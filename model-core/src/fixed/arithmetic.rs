//! Integer arithmetic of the fixed build: products, a 32-bit mantissa with exponent, three functions.
//!
//! A format is written as its number of bits behind the binary point: a `u32` "with 30" counts 2^-30.
//! Every product is formed in 64 bits and rounded once, down. Widest product: (2^32 - 1)² < 2^64.
//!
//! [`narrow`], [`product`], [`sum`] and [`difference`] need operands whose result fits; each caller states why
//! it does, and debug builds check it. In a release build nothing here can panic.

use core::f64::consts::LN_2;

/// Nearest number with `fraction` bits behind the point; saturates, so the caller checks the range.
pub(super) const fn nearest(x: f64, fraction: u32) -> u32 {
    (x * (1u64 << fraction) as f64 + 0.5) as u32
}

/// A number known when compiling, with the given bits behind the point; an impossible scale fails to compile.
macro_rules! constant {
    ($x:expr, $fraction:expr) => {
        const {
            let scaled = $x * (1u64 << $fraction) as f64;
            assert!(scaled >= 0.0 && scaled < 4_294_967_295.0);
            $crate::fixed::arithmetic::nearest($x, $fraction)
        }
    };
}
pub(super) use constant;

/// The lower half of a number that must be below 2^32.
#[inline(always)]
pub(super) const fn narrow(wide: u64) -> u32 {
    debug_assert!(wide <= u32::MAX as u64);
    wide as u32
}

/// `a b 2^-shift`, rounded down; must be below 2^32.
#[inline(always)]
pub(super) const fn product(a: u32, b: u32, shift: u32) -> u32 {
    narrow((a as u64 * b as u64) >> shift)
}

/// `a + b`; must be below 2^32.
#[inline(always)]
pub(super) const fn sum(a: u32, b: u32) -> u32 {
    debug_assert!(a.checked_add(b).is_some());
    a.wrapping_add(b)
}

/// `a - b`; b must not exceed a.
#[inline(always)]
pub(super) const fn difference(a: u32, b: u32) -> u32 {
    debug_assert!(a >= b);
    a.wrapping_sub(b)
}

/// `a/b` as `(q, shift)`: `q 2^-shift`, rounded down, 16 significant bits, q below 2^17; b must not be zero.
///
/// For corrections that are small themselves. A zero `a` gives zero.
#[inline(always)]
pub(super) const fn coarse_quotient(a: u32, b: u32) -> (u32, u32) {
    debug_assert!(b > 0);
    let (n, d) = (a.leading_zeros(), b.leading_zeros());
    // a normalised b has this bit; setting it shows the compiler that the divisor cannot be zero
    let divisor = (b.wrapping_shl(d) >> 16) | 0x8000;
    // n <= 32 and d <= 31: within 16 - 31 + 31; a difference below zero would mean a/b >= 2^16
    (a.wrapping_shl(n) / divisor, (16 + n).saturating_sub(d))
}

/// `2^-f`, f below 1 with 32 bits behind the point; the result, in (1/2, 1], has 31. Error at most 6e-8.
///
/// Minimax polynomial of degree 5 with alternating signs, so that every step of Horner's scheme is a
/// difference of positive numbers: each coefficient exceeds f times all that follows.
pub(super) const fn halving(f: u32) -> u32 {
    const C0: u32 = constant!(0.999_999_946_6, 31);
    const C1: u32 = constant!(0.693_143_267_6, 32);
    const C2: u32 = constant!(0.240_180_017_7, 32);
    const C3: u32 = constant!(0.055_301_086_85, 32);
    const C4: u32 = constant!(0.009_212_567_356, 32);
    const C5: u32 = constant!(0.000_948_230_573_1, 32);
    let p = difference(C4, product(f, C5, 32));
    let p = difference(C3, product(f, p, 32));
    let p = difference(C2, product(f, p, 32));
    let p = difference(C1, product(f, p, 32));
    difference(C0, product(f, p, 33))
}

/// ln 2 with 32 bits behind the point.
pub(super) const LN_2_Q32: u32 = constant!(LN_2, 32);

/// A number whose range is too wide for one format: `mantissa · 2^exponent`, the mantissa's top bit set, or zero.
///
/// Exponents stay within a few hundred: those of the constants are checked, those of the inputs lie in
/// -63..=31, and at most eight are added up. The wrapping additions below therefore never wrap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scaled {
    mantissa: u32,
    exponent: i32,
}

impl Scaled {
    /// Nearest value; `x` must be positive and normal, or zero.
    pub(super) const fn of(x: f64) -> Self {
        let bits = x.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32 - 1075;
        if exponent == -1075 {
            return Scaled { mantissa: 0, exponent: 0 };
        }
        // 53 bits to 32, to nearest
        let rounded = ((bits & 0x000f_ffff_ffff_ffff) | 0x0010_0000_0000_0000) + (1 << 20);
        if rounded >> 53 == 0 {
            Scaled { mantissa: (rounded >> 21) as u32, exponent: exponent + 21 }
        } else {
            Scaled { mantissa: 1 << 31, exponent: exponent + 22 }
        }
    }

    /// A number with `fraction` bits behind the point.
    #[inline(always)]
    pub(super) const fn from_fixed(x: u32, fraction: u32) -> Self {
        let zeros = x.leading_zeros();
        // zero is shifted by 32, that is not at all, and stays zero
        Scaled {
            mantissa: x.wrapping_shl(zeros),
            exponent: 0i32.wrapping_sub_unsigned(zeros).wrapping_sub_unsigned(fraction),
        }
    }

    /// The upper 32 significant bits of a number with 32 bits behind the point.
    pub(super) const fn from_q32(x: u64) -> Self {
        let zeros = x.leading_zeros();
        Scaled { mantissa: (x.wrapping_shl(zeros) >> 32) as u32, exponent: 0i32.wrapping_sub_unsigned(zeros) }
    }

    /// Rounded down to `fraction` bits behind the point; none from 2^32 up.
    #[inline(always)]
    pub(super) const fn to_fixed(self, fraction: u32) -> Option<u32> {
        match self.exponent.wrapping_add_unsigned(fraction) {
            _ if self.mantissa == 0 => Some(0),
            1.. => None,
            down @ -31..=0 => Some(self.mantissa >> down.unsigned_abs()),
            _ => Some(0),
        }
    }

    /// As [`Self::to_fixed`] into 64 bits; none from 2^64 up.
    pub(super) const fn to_fixed_64(self, fraction: u32) -> Option<u64> {
        match self.exponent.wrapping_add_unsigned(fraction) {
            _ if self.mantissa == 0 => Some(0),
            33.. => None,
            up @ 0..=32 => Some((self.mantissa as u64) << up),
            down @ -31..0 => Some((self.mantissa >> down.unsigned_abs()) as u64),
            _ => Some(0),
        }
    }

    /// The product, rounded down to 32 bits: relative error at most 2^-31.
    // called a dozen times: inlined, the two directions of the law grow by 900 bytes
    #[inline(never)]
    pub(super) const fn times(self, other: Self) -> Self {
        let wide = self.mantissa as u64 * other.mantissa as u64;
        let exponent = self.exponent.wrapping_add(other.exponent);
        // two mantissas in [2^31, 2^32): their product has 63 or 64 bits
        if wide >> 63 == 1 {
            Scaled { mantissa: (wide >> 32) as u32, exponent: exponent.wrapping_add(32) }
        } else {
            Scaled { mantissa: (wide >> 31) as u32, exponent: exponent.wrapping_add(31) }
        }
    }

    /// Times a power of two.
    #[inline(always)]
    const fn shifted(self, power: i32) -> Self {
        Scaled { mantissa: self.mantissa, exponent: self.exponent.wrapping_add(power) }
    }

    /// `1/self`; must not be zero. Relative error at most 4e-9.
    ///
    /// A quotient of 16 bits is good to 5e-5, Newton's `y <- y (2 - f y)` squares that.
    #[inline(never)]
    pub(super) const fn reciprocal(self) -> Self {
        debug_assert!(self.mantissa >> 31 == 1);
        // f in [1, 2) with 31 bits; y = 1/f with 17, between 2^16 - 1 and 2^17
        let y = (u32::MAX / ((self.mantissa >> 16) | 0x8000)) as i64;
        // 1 - f y with 48 bits, below 2^-14: the product with y stays below 2^51
        let rest = (1i64 << 48).wrapping_sub(y.wrapping_mul(self.mantissa as i64));
        let result = (y << 14).wrapping_add(y.wrapping_mul(rest) >> 34);
        // f = mantissa 2^-31 and the result, at most 1 + 2^-28, has 31 bits
        Scaled::from_fixed(result as u32, 31).shifted(self.exponent.wrapping_add(31).wrapping_neg())
    }

    /// `self^(-1/3)`; must not be zero. Relative error at most 3e-8.
    ///
    /// ```text
    /// self = f 2^(3k + rest),  f in [1, 2),  rest in 0..=2
    /// y = 1.3882 - f (0.4833 - 0.0934 f)                 f^(-1/3) to 1.8e-3, minimax
    /// δ = 1 - f y³                                       |δ| < 5.4e-3
    /// f^(-1/3) = y (1 - δ)^(-1/3) ≈ y (1 + δ/3 + 2δ²/9)  next term 14δ³/81
    /// ```
    pub(super) const fn inverse_cbrt(self) -> Self {
        const A: u32 = constant!(1.388_156_867, 31);
        const B: u32 = constant!(0.483_322_481, 32);
        const C: u32 = constant!(0.093_397_911_6, 32);
        const THIRD: i64 = constant!(1.0 / 3.0, 31) as i64;
        const TWO_NINTHS: i64 = constant!(2.0 / 9.0, 31) as i64;
        debug_assert!(self.mantissa >> 31 == 1);
        let f = self.mantissa;
        // f C <= 0.19 < B; y in (0.79, 1.002), 31 bits
        let y = difference(A, product(f, difference(B, product(f, C, 31)), 32));
        let cube = product(product(y, y, 31), y, 31);
        // f y³ with 62 bits behind the point lies within 5.4e-3 of 1; δ with 31 is below 2^24
        let delta = (1i64 << 62).wrapping_sub((f as u64 * cube as u64) as i64) >> 31;
        let growth = delta.wrapping_mul(THIRD.wrapping_add(delta.wrapping_mul(TWO_NINTHS) >> 31)) >> 31;
        let root = (y as i64).wrapping_add((y as i64).wrapping_mul(growth) >> 31) as u32;
        let power = self.exponent.wrapping_add(31);
        // 2^(-rest/3); for rest = 0 the largest number below 1
        let part = match power.rem_euclid(3) {
            0 => u32::MAX,
            1 => constant!(0.793_700_525_984_099_7, 32),
            _ => constant!(0.629_960_524_947_436_6, 32),
        };
        Scaled::from_fixed(product(root, part, 32), 31).shifted(power.div_euclid(3).wrapping_neg())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(x: Scaled) -> f64 {
        f64::from(x.mantissa) * libm::exp2(f64::from(x.exponent))
    }

    /// Positive numbers over 40 decades that share no pattern with powers of two.
    fn numbers() -> impl Iterator<Item = f64> {
        (0..40_000).map(|n| libm::pow(10.0, f64::from(n) / 1000.0 - 20.0))
    }

    #[test]
    fn functions_keep_their_stated_error() {
        for f in (0..=u32::MAX).step_by(9973).chain([u32::MAX]) {
            let want = libm::exp2(-f64::from(f) / 4_294_967_296.0);
            assert!((f64::from(halving(f)) / 2_147_483_648.0 - want).abs() < 6e-8, "{f}");
        }
        for x in numbers() {
            let s = Scaled::of(x);
            assert!((value(s) / x - 1.0).abs() < 2.4e-10, "{x}");
            assert!((value(s.reciprocal()) * x - 1.0).abs() < 4e-9, "1/{x}");
            assert!((value(s.inverse_cbrt()) * libm::cbrt(x) - 1.0).abs() < 3e-8, "cbrt {x}");
        }
        // mantissas next to the borders of an octave
        for mantissa in [1 << 31, (1 << 31) + 1, u32::MAX - 1, u32::MAX] {
            for exponent in -4..4 {
                let s = Scaled { mantissa, exponent };
                assert!((value(s.reciprocal()) * value(s) - 1.0).abs() < 4e-9);
                assert!((value(s.inverse_cbrt()) * libm::cbrt(value(s)) - 1.0).abs() < 3e-8);
            }
        }
    }

    #[test]
    fn products_round_down() {
        assert_eq!(product(3, 3, 1), 4);
        assert_eq!(product(u32::MAX, u32::MAX, 32), u32::MAX - 1);
        for (a, b) in numbers().zip(numbers().skip(7)) {
            let exact = value(Scaled::of(a)) * value(Scaled::of(b));
            let got = value(Scaled::of(a).times(Scaled::of(b)));
            assert!(got <= exact * (1.0 + 1e-15) && got > exact * (1.0 - 5e-10));
        }
        assert_eq!(Scaled::of(0.0).times(Scaled::of(3.0)).to_fixed(20), Some(0));
    }

    #[test]
    fn coarse_quotients_keep_sixteen_bits() {
        for a in [0, 1, 77, 65_535, 1 << 20, (1 << 22) - 1, u32::MAX] {
            for b in [1 << 15, 98_765, (3 << 20) + 1, u32::MAX] {
                let (q, shift) = coarse_quotient(a, b);
                let got = f64::from(q) * libm::exp2(-f64::from(shift));
                let want = f64::from(a) / f64::from(b);
                assert!(q < 1 << 17 && (got - want).abs() <= 7e-5 * want, "{a}/{b}: {got}");
            }
        }
    }

    #[test]
    fn conversions_find_the_point() {
        assert_eq!(Scaled::from_q32(3 << 32).to_fixed(4), Some(48));
        assert_eq!(Scaled::from_q32(3 << 32), Scaled::from_fixed(48, 4));
        assert_eq!(Scaled::from_q32(0).to_fixed(30), Some(0));
        assert_eq!(Scaled::from_q32(u64::MAX).to_fixed_64(32), Some(u64::MAX - 0xffff_ffff));
        assert_eq!(Scaled::from_q32(u64::MAX).to_fixed_64(33), None);
        assert_eq!(Scaled::from_q32(u64::MAX).to_fixed(0), Some(u32::MAX));
        assert_eq!(Scaled::from_q32(u64::MAX).to_fixed(1), None);
        assert_eq!(Scaled::from_fixed(1, 40).to_fixed(39), Some(0));
        assert_eq!(Scaled::from_fixed(1, 300).to_fixed_64(32), Some(0));
    }
}
