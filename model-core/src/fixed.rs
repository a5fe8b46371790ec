//! The reduced law in integers, for cores without a floating point unit.
//!
//! The equations are those of [`reduced`], with three substitutions that narrow the ranges of the variables:
//!
//! * A load is counted by the Coulomb drag that it causes, `C = 4 Z_b μ_c Q` in N, so that `F_f = C m`.
//! * The iteration solves for a ratio near 1 that needs no force: `r = (C/F_f)^(1/3)`, `r³ m = 1` (slip), or
//!   `w = 1/r`, `w³ = m` (carriage speed).
//! * The film is counted in halvings, `h/ln 2`, so that `e^-h` is a shift and a polynomial. Loads enter it
//!   and the contact angle as `σ = (Q/Q_limit)^(2/3)`.
//!
//! ```text
//! F = F_f                 x = k' ν V F^(1/3) | k' ν V F^(-1/3)     halvings
//! r = 1/(1.15 + 0.006 x)  | w = 1.12 + 0.020 x                     seed, x in units of h
//! twice:  h = x r (1 + χ1' σ + χ2' σ²), σ = σ_F r²  | h = x w
//!         m = 1 + m_v h + m_s 2^-h
//!         G = r³ m, T = 1                           | G = w³, T = m
//!         y += y · 2 (T - G)/((n - 1) T + (n + 1) G)               Halley, y = r | w
//! F_p = P' F r³/(1 + κ' σ)                          | P' F/(w (w² + κ' σ_F))
//! ```
//!
//! That Halley step is the one of the f32 build written for the ratio G/T; it takes one quotient of 16 bits.
//!
//! | quantity | range | bits behind the point |
//! |---|---|---|
//! | force, ν V ([`Newtons`], [`ViscousSpeed`]) | below 2^31 | 32, then a 32-bit mantissa with exponent |
//! | x | 0 to 144.3 (256) | 24 |
//! | r, w | 1/4 to 1, 1 to 4 | 30 (w²: 28) |
//! | m, r³ m, w³, σ | 0 to 64 | 26 |
//! | h/ln 2 | 0 to 1024 | 54 (u64) |
//! | n m, m in the step | 0 to 2^12 | 16 |
//! | m_v, χ1', χ2' | 0 to 1 | 32 |
//! | m_s | 0 to 4 | 29 |
//!
//! No division by 64 bits, no 128-bit product, no operation that can overflow or panic: bounds stand where
//! an operation needs them, and debug builds check them. This build gives no sensitivities; the floating-point build
//! does.

mod arithmetic;
mod quantity;

pub use quantity::{Newtons, ViscousSpeed};

use crate::Error;
use crate::contact::HerseySpeed;
use crate::num::constant::cbrt;
use crate::reduced::{self, DragLaw, GROUP_LIMIT, OutOfDomain};
use arithmetic::{LN_2_Q32, Scaled, coarse_quotient, constant, difference, halving, narrow, nearest, product, sum};
use core::f64::consts::{LN_2, LOG2_E};

/// Worst relative difference between the preloads of this build and of the f32 build, both conventions, drag
/// forces from 0.05 N to the load limit, ν V from zero to [`GROUP_LIMIT`].
pub const WORST_DIFFERENCE_TO_F32: f64 = 6e-7;

/// Bits behind the point of x.
const X_BITS: u32 = 24;
/// [`GROUP_LIMIT`] in halvings.
const X_LIMIT: u32 = constant!(GROUP_LIMIT * LOG2_E, X_BITS);
/// Bits behind the point of r and w.
const RATIO_BITS: u32 = 30;
/// Bits behind the point of m and σ.
const M_BITS: u32 = 26;
/// Bits behind the point of h/ln 2: those of x times those of a ratio.
const FILM_BITS: u32 = X_BITS + RATIO_BITS;

const ONE_RATIO: u32 = 1 << RATIO_BITS;
const ONE_M: u32 = 1 << M_BITS;

/// Integer constants of one guide with one friction law.
///
/// Made by [`Reduced::of`] only, each rounded once, to nearest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduced {
    hersey_speed: HerseySpeed,
    /// h/ln 2 per ν V and per C^(±1/3).
    film: Scaled,
    /// σ per C^(2/3).
    load_share: Scaled,
    /// P' = 2 Z_b cos α0/(4 Z_b μ_c).
    preload_per_force: Scaled,
    /// 1/P'.
    force_per_preload: Scaled,
    /// κ' = κ Q_limit^(2/3), 31 bits behind the point.
    angle: u32,
    /// χ1' = χ1 Q_limit^(2/3), 32 bits.
    slip_1: u32,
    /// χ2' = χ2 Q_limit^(4/3), 32 bits.
    slip_2: u32,
    /// m_v ln 2, 32 bits.
    viscous: u32,
    /// m_s, 29 bits.
    stribeck: u32,
}

/// m at a film thickness, 26 bits behind the point, and h dm/dh with 16.
struct Stribeck {
    m: u32,
    response: i32,
}

impl Reduced {
    /// Derives the integers from the floating-point constants. Can be evaluated at compile time.
    ///
    /// # Errors
    /// The first constant that is not finite or has no place in its format, by its name in
    /// [`reduced::Reduced`]: `stribeck` up to 4 and `viscous` up to 1.44, in units of μ_c; at the load limit
    /// `angle_per_load` up to a relative stretch of 1, `slip_1` up to 1/4, `slip_2` up to 1/16, none
    /// negative; preload and 64 times the Coulomb drag at `load_limit_n` below 2^31 N.
    pub const fn of(law: &reduced::Reduced<f64>) -> Result<Self, Error> {
        let root_limit = cbrt(law.load_limit_n);
        let area = root_limit * root_limit;
        let coulomb = law.load_limit_n / law.loads_per_force;
        let two_31 = 2_147_483_648.0;
        let checks = [
            ("loads_per_force", law.loads_per_force, 1e-6, 1e9),
            ("preload_per_load", law.preload_per_load, 1e-6, 1e9),
            ("film_per_viscous_speed", law.film_per_viscous_speed, 1e-12, 1e12),
            ("load_limit_n", law.load_limit_n, 1e-3, 1e9),
            ("load_limit_n", law.load_limit_n * law.preload_per_load, 0.0, two_31 - 1.0),
            ("load_limit_n", 64.0 * coulomb, 0.0, two_31 - 1.0),
            ("angle_per_load", law.angle_per_load * area, 0.0, 1.0),
            ("slip_1", law.slip_1 * area, 0.0, 0.25),
            ("slip_2", law.slip_2 * area * area, 0.0, 0.0625),
            ("viscous", law.viscous, 0.0, 1.44),
            ("stribeck", law.stribeck, 0.0, 4.0),
        ];
        let mut n = 0;
        while n < checks.len() {
            let (name, value, low, high) = checks[n];
            if !value.is_finite() {
                return Err(Error::NonFinite(name));
            }
            if !(value >= low && value <= high) {
                return Err(Error::OutOfRange(name));
            }
            n += 1;
        }
        let root = cbrt(law.loads_per_force);
        let per_root = match law.hersey_speed {
            HerseySpeed::Slip => root,
            HerseySpeed::Carriage => 1.0 / root,
        };
        let root_coulomb = cbrt(coulomb);
        let preload_per_force = law.preload_per_load * law.loads_per_force;
        Ok(Reduced {
            hersey_speed: law.hersey_speed,
            film: Scaled::of(law.film_per_viscous_speed * LOG2_E * per_root),
            load_share: Scaled::of(1.0 / (root_coulomb * root_coulomb)),
            preload_per_force: Scaled::of(preload_per_force),
            force_per_preload: Scaled::of(1.0 / preload_per_force),
            angle: nearest(law.angle_per_load * area, 31),
            slip_1: nearest(law.slip_1 * area, 32),
            slip_2: nearest(law.slip_2 * area * area, 32),
            viscous: nearest(law.viscous * LN_2, 32),
            stribeck: nearest(law.stribeck, 29),
        })
    }

    /// m and its response to the film; an error where m reaches 64.
    fn friction(&self, film: u64) -> Result<Stribeck, OutOfDomain> {
        let halvings = (film >> FILM_BITS) as u32;
        // 2^-h in 31 bits; from 31 halvings on nothing is left
        let decay = if halvings < 32 { halving((film >> (FILM_BITS - 32)) as u32) >> halvings } else { 0 };
        // h/ln 2 < 2^10 with 22 bits
        let h = (film >> 32) as u32;
        // m_s 2^-h <= 4 with 60 bits and m_v h with 54: both below 2^64 as products of 32 bits
        let rise = self.stribeck as u64 * decay as u64;
        let viscous = self.viscous as u64 * h as u64;
        // the three parts with 34 bits, below 2^34, 2^38 and 2^44
        let m = (1u64 << 34) + (rise >> 26) + (viscous >> 20);
        if m >> 34 >= 64 {
            return Err(OutOfDomain::ViscousSpeed);
        }
        // h m_s e^-h <= 4/e with 50 bits; both terms with 16 and below 2^30
        let fall = h as u64 * product((rise >> 32) as u32, LN_2_Q32, 32) as u64;
        Ok(Stribeck { m: (m >> 8) as u32, response: (viscous >> 38) as i32 - (fall >> 34) as i32 })
    }

    /// The film factor `1 + χ1'σ + χ2'σ²` and its `1 + dln/dln s` in first order, both with 30 bits; σ <= 2.
    #[inline(always)]
    fn slip(&self, sigma: u32) -> (u32, u32) {
        // χ2'σ <= 1/8, χ1' + χ2'σ <= 3/8 with 32 bits
        let second = product(self.slip_2, sigma, M_BITS);
        let both = product(sum(self.slip_1, second), sigma, 28);
        let second = product(second, sigma, 28);
        // excess <= 3/4, 1 + 2 (3/4 + 1/4) = 3: below 4
        (sum(ONE_RATIO, both), sum(ONE_RATIO, sum(both, second) << 1))
    }

    /// `r³/(1 + κ'σ)`: preload of the slip convention in units of P' F_f.
    fn invert_slip(&self, x: u32, sigma_f: u32) -> Result<Scaled, OutOfDomain> {
        // 1.15 + 0.006 x in 1.15..1.75 with 15 bits: bit 15 is set, setting it shows that it is not zero
        let seed = sum(constant!(1.15, 15), product(x, constant!(0.006 * LN_2, 32), 41)) | 0x8000;
        let mut r = ((1 << 31) / seed) << 14;
        for _ in 0..2 {
            let square = product(r, r, RATIO_BITS);
            // a load twice past its limit bends the film no further; it is refused in the end
            let sigma = product(sigma_f, square, RATIO_BITS).min(2 * ONE_M);
            let (factor, exponent) = self.slip(sigma);
            // r · factor < 2, x < 2^8: 54 bits below 2^9
            let film = x as u64 * product(r, factor, RATIO_BITS) as u64;
            let Stribeck { m, response } = self.friction(film)?;
            let reached = product(product(square, r, RATIO_BITS), m, RATIO_BITS);
            // exponent < 4 with 16 bits, response < 2^30
            let rise = (((exponent >> 14) as i64 * response as i64) >> 16) as i32;
            // m >= 1 makes r <= 1, m < 64 makes it > 1/4
            r = halley(r, ONE_M, reached, m, rise).clamp(ONE_RATIO / 4, ONE_RATIO);
        }
        let square = product(r, r, RATIO_BITS);
        let sigma = product(sigma_f, square, RATIO_BITS);
        if sigma > ONE_M {
            return Err(OutOfDomain::Load);
        }
        // 1 + κ'σ <= 2
        let stretch = sum(ONE_RATIO, product(self.angle, sigma, 27));
        Ok(ratio(product(square, r, RATIO_BITS)).times(ratio(stretch).reciprocal()))
    }

    /// `1/(w (w² + κ'σ_F))`: preload of the carriage-speed convention in units of P' F_f.
    fn invert_carriage(&self, x: u32, sigma_f: u32) -> Result<Scaled, OutOfDomain> {
        // 1.12 + 0.020 x <= 3.12
        let mut w = sum(constant!(1.12, RATIO_BITS), product(x, constant!(0.020 * LN_2, 32), 26));
        for _ in 0..2 {
            // w < 4: w² with 28 bits, w³ with 26
            let reached = product(product(w, w, 32), w, 32);
            let film = x as u64 * w as u64;
            let Stribeck { m, response } = self.friction(film)?;
            // 1 <= m < 64 bounds w³
            w = halley(w, m, reached, m, response.wrapping_neg()).max(ONE_RATIO);
        }
        let square = product(w, w, 32);
        if sigma_f > square >> 2 {
            return Err(OutOfDomain::Load);
        }
        // κ'σ_F <= w² < 16: the sum is below 32, with 27 bits
        let stretch = sum(square >> 1, product(self.angle, sigma_f, 30));
        Ok(ratio(w).times(Scaled::from_fixed(stretch, 27)).reciprocal())
    }
}

/// A number with as many bits behind the point as r and w.
#[inline(always)]
fn ratio(x: u32) -> Scaled {
    Scaled::from_fixed(x, RATIO_BITS)
}

/// Halley's step for `reached(y) = target`, both with 26 bits: `y + y · 2 (T - G)/((n - 1) T + (n + 1) G)`.
///
/// `rise` is `(n - 3) m` with 16 bits. n lies between 1.7 and 4.8 for every law that [`Reduced::of`] lets pass,
/// and is held at 1.5 or more for the sake of a first iterate far outside.
fn halley(y: u32, target: u32, reached: u32, m: u32, rise: i32) -> u32 {
    // numerator and denominator times m; 1 <= m < 2^6 with 16 bits
    let m = m >> 10;
    let twice = m << 1;
    // (n - 1) m and (n + 1) m, n <= 6: below 2^9
    let less = rise.saturating_add_unsigned(twice).max((m >> 1) as i32) as u32;
    let more = sum(less, twice);
    // T and G stay below 2^6: the sum, from 1/2 to 2^15, has 16 bits
    let denominator = sum(product(less, target, M_BITS), product(more, reached, M_BITS));
    let (q, shift) = coarse_quotient(m, denominator);
    // y · gap < 2^8 has 56 bits; 32 of them times q < 2^17 stay below 2^57; 30 remain, doubled
    let step = |gap: u32| narrow((((y as u64 * gap as u64) >> 24) * q as u64) >> (shift + 1));
    if target >= reached {
        y.saturating_add(step(difference(target, reached)))
    } else {
        y.saturating_sub(step(difference(reached, target)))
    }
}

/// A positive input within its format.
fn accepted(bits: i64, from: i64) -> Option<Scaled> {
    (bits >= from && bits < i64::MAX).then(|| Scaled::from_q32(bits as u64))
}

/// Forces up to 1e-6 N, 4295 codes, are refused, as in the floating-point build.
const LEAST_FORCE: i64 = 4296;

impl DragLaw for Reduced {
    type Force = Newtons;
    type ViscousSpeed = ViscousSpeed;

    /// `F_f = C m`, with C from `C = (F_p/P')(1 + κ'σ)`: `u³ + k u = 1`, `u = ((F_p/P')/C)^(1/3)`, by Newton.
    ///
    /// Unlike the floating-point build this one ends where the film reaches 1024 halvings or m reaches 64.
    fn drag_force(&self, preload: Newtons, viscous_speed: ViscousSpeed) -> Result<Newtons, OutOfDomain> {
        const THIRD: u32 = constant!(1.0 / 3.0, 32);
        let preload = accepted(preload.to_bits(), LEAST_FORCE).ok_or(OutOfDomain::Force)?;
        let viscous = accepted(viscous_speed.to_bits(), 0).ok_or(OutOfDomain::ViscousSpeed)?;
        let least = preload.times(self.force_per_preload);
        let per_root = least.inverse_cbrt();
        let area = least.times(per_root);
        let share_of_limit = area.times(self.load_share);
        let sigma = share_of_limit.to_fixed(M_BITS).ok_or(OutOfDomain::Load)?;
        if sigma > ONE_M {
            return Err(OutOfDomain::Load);
        }
        // k = κ'σ <= 1; seed u = 1 - k/3 + k³/81, within 4e-3 of the root, which lies in 0.68..1
        let k = product(self.angle, sigma, 27);
        let third = product(k, THIRD, 32);
        let cube = product(product(third, third, RATIO_BITS), third, RATIO_BITS);
        let mut u = sum(difference(ONE_RATIO, third), product(cube, THIRD, 32));
        for _ in 0..2 {
            // u <- (2u³ + 1)/(3u² + k), both at most 3
            let square = product(u, u, RATIO_BITS);
            let above = sum(product(square, u, RATIO_BITS - 1), ONE_RATIO);
            let below = sum(product(square, 3, 0), k);
            u = ratio(above).times(ratio(below).reciprocal()).to_fixed(RATIO_BITS).unwrap_or(ONE_RATIO).min(ONE_RATIO);
        }
        let u = ratio(u);
        let stretch = u.reciprocal();
        let sigma = share_of_limit.times(stretch).times(stretch);
        let sigma = match sigma.to_fixed(M_BITS) {
            Some(sigma) if sigma <= ONE_M => sigma,
            _ => return Err(OutOfDomain::Load),
        };
        let film = self.film.times(viscous);
        let film = match self.hersey_speed {
            HerseySpeed::Slip => film.times(area).times(per_root).times(stretch).times(ratio(self.slip(sigma).0)),
            HerseySpeed::Carriage => film.times(per_root).times(u),
        };
        let film = film.to_fixed_64(FILM_BITS).ok_or(OutOfDomain::ViscousSpeed)?;
        let m = Scaled::from_fixed(self.friction(film)?.m, M_BITS);
        newtons(least.times(stretch).times(stretch).times(stretch).times(m))
    }

    fn preload(&self, drag_force: Newtons, viscous_speed: ViscousSpeed) -> Result<Newtons, OutOfDomain> {
        let force = accepted(drag_force.to_bits(), LEAST_FORCE).ok_or(OutOfDomain::Force)?;
        let viscous = accepted(viscous_speed.to_bits(), 0).ok_or(OutOfDomain::ViscousSpeed)?;
        let per_root = force.inverse_cbrt();
        let area = force.times(per_root);
        let size = match self.hersey_speed {
            HerseySpeed::Slip => area.times(per_root),
            HerseySpeed::Carriage => per_root,
        };
        let x = match self.film.times(viscous).times(size).to_fixed(X_BITS) {
            Some(x) if x <= X_LIMIT => x,
            _ => return Err(OutOfDomain::ViscousSpeed),
        };
        // σ_F = 64 means 512 times the largest load, which no m below 64 brings back into range
        let sigma_f = area.times(self.load_share).to_fixed(M_BITS).ok_or(OutOfDomain::Load)?;
        let share_of_force = match self.hersey_speed {
            HerseySpeed::Slip => self.invert_slip(x, sigma_f),
            HerseySpeed::Carriage => self.invert_carriage(x, sigma_f),
        }?;
        newtons(force.times(self.preload_per_force).times(share_of_force))
    }
}

/// Back to the format; [`Reduced::of`] has made sure that what the law accepts fits.
fn newtons(force: Scaled) -> Result<Newtons, OutOfDomain> {
    match force.to_fixed_64(32) {
        Some(bits) if bits < i64::MAX as u64 => Ok(Newtons::from_bits(bits as i64)),
        _ => Err(OutOfDomain::Load),
    }
}

#[cfg(test)]
mod tests;
