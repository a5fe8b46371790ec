//! Forces and viscosity times speed with the binary point in the type.
//!
//! Both are 64 bits with 32 of them behind the point, one register pair of a 32-bit core. Narrower formats
//! do not serve both speed conventions: at 3 N of drag half a quantum of Q16.16 is 2.5e-6, half the error
//! budget, and where the carriage speed stands in the Hersey number half a quantum of Q11.20 moves the
//! preload by 2.4e-5. Here every f32 from 2 mN (2e-3 cSt·m/s) up converts without any rounding.

/// Declares one Q31.32 type.
macro_rules! q32 {
    ($(#[$documentation:meta])* $name:ident) => {
        $(#[$documentation])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $name(i64);

        impl $name {
            /// Largest code; also what a conversion gives that does not fit. No law accepts it.
            pub const MAX: Self = Self(i64::MAX);

            /// The value `bits · 2^-32`.
            pub const fn from_bits(bits: i64) -> Self {
                Self(bits)
            }

            /// The value times 2^32.
            pub const fn to_bits(self) -> i64 {
                self.0
            }

            /// Drops what lies below the quantum of 2^-32. From 2^31 up the result is [`Self::MAX`], down from
            /// -2^31 and for NaN the most negative code: a law refuses all three.
            pub const fn from_f32(value: f32) -> Self {
                // the cast truncates and saturates; NaN would become zero, a legal value
                if value.is_nan() { Self(i64::MIN) } else { Self((value * 4_294_967_296.0) as i64) }
            }

            /// As [`Self::from_f32`].
            pub const fn from_f64(value: f64) -> Self {
                if value.is_nan() { Self(i64::MIN) } else { Self((value * 4_294_967_296.0) as i64) }
            }

            /// Nearest f32.
            pub const fn to_f32(self) -> f32 {
                self.0 as f32 / 4_294_967_296.0
            }

            /// Nearest f64; exact below 2^21.
            pub const fn to_f64(self) -> f64 {
                self.0 as f64 / 4_294_967_296.0
            }
        }
    };
}

q32! {
    /// A force, N, as Q31.32: up to 2.1e9 N in steps of 2.3e-10 N.
    Newtons
}

q32! {
    /// Kinematic viscosity times speed, cSt·m/s, as Q31.32: up to 2.1e9 in steps of 2.3e-10.
    ///
    /// Signed so that a negative input stays one and is refused.
    ViscousSpeed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_f32_the_block_meets_survives() {
        for bits in (0.002_f32.to_bits()..2.0e9_f32.to_bits()).step_by(997) {
            let x = f32::from_bits(bits);
            assert_eq!(Newtons::from_f32(x).to_f32(), x);
            assert_eq!(Newtons::from_f32(-x).to_f32(), -x);
            assert_eq!(ViscousSpeed::from_f64(f64::from(x)), ViscousSpeed::from_f32(x));
        }
    }

    #[test]
    fn what_does_not_fit_saturates() {
        assert_eq!(Newtons::from_f32(2_147_483_648.0), Newtons::MAX);
        assert_eq!(Newtons::from_f32(f32::INFINITY), Newtons::MAX);
        assert_eq!(Newtons::from_f64(1e300), Newtons::MAX);
        for refused in [f64::NAN, f64::NEG_INFINITY, -1e300] {
            assert_eq!(Newtons::from_f64(refused).to_bits(), i64::MIN);
            assert_eq!(ViscousSpeed::from_f32(refused as f32).to_bits(), i64::MIN);
        }
        assert_eq!(Newtons::from_f64(2.3e-10).to_bits(), 0);
    }
}
