//! The same inversion with elementary functions of other crates, to compare the cost of our own.
//!
//! Identical algorithm (seed, two Halley steps), identical checks; only `cbrt` and `exp` differ.

use model_core::contact::HerseySpeed;
use model_core::fixed;
use model_core::reduced::{DragLaw, GROUP_LIMIT, Reduced};

/// The elementary functions under test.
pub trait Functions {
    /// Cube root of a positive number, accurate enough to start an iteration.
    fn cbrt(x: f32) -> f32;
    /// Exponential of a number that is not positive.
    fn exp(x: f32) -> f32;
}

/// `model_core::num`.
pub struct Own;
impl Functions for Own {
    #[inline(always)]
    fn cbrt(x: f32) -> f32 {
        model_core::num::rough_cbrt(x)
    }
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        model_core::num::exp(x)
    }
}

/// `libm`.
pub struct Libm;
impl Functions for Libm {
    #[inline(always)]
    fn cbrt(x: f32) -> f32 {
        libm::cbrtf(x)
    }
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        libm::expf(x)
    }
}

/// `micromath`; its cube root is `powf(1/3)`.
pub struct Micromath;
impl Functions for Micromath {
    #[inline(always)]
    fn cbrt(x: f32) -> f32 {
        micromath::F32(x).powf(micromath::F32(1.0 / 3.0)).0
    }
    #[inline(always)]
    fn exp(x: f32) -> f32 {
        micromath::F32(x).exp().0
    }
}

/// Preload of a drag force with the functions `F`, slip convention only; `None` outside the law.
#[inline(always)]
pub fn preload<F: Functions>(law: &Reduced<f32>, force_n: f32, viscous_speed: f32) -> Option<f32> {
    if law.hersey_speed != HerseySpeed::Slip || !(force_n > 1e-6 && force_n.is_finite()) {
        return None;
    }
    if !(viscous_speed >= 0.0 && viscous_speed.is_finite()) {
        return None;
    }
    let fc = force_n * law.loads_per_force;
    let s1 = F::cbrt(fc);
    let b = law.film_per_viscous_speed * viscous_speed;
    let x = b * s1;
    if x > GROUP_LIMIT as f32 {
        return None;
    }
    let mut s = s1 / (1.15 + 0.006 * x);
    for _ in 0..2 {
        let s2 = s * s;
        let (first, second) = (law.slip_1 * s2, law.slip_2 * s2 * s2);
        let h = b * s * (1.0 + (first + second));
        let stribeck = law.stribeck * F::exp(-h);
        let m = 1.0 + law.viscous * h + stribeck;
        let rise = 3.0 * m + (1.0 + 2.0 * (first + (second + second))) * (h * (law.viscous - stribeck));
        let product = s * s * s * m;
        let missing = fc - product;
        s += s * ((missing + missing) * m) / ((rise + rise) * product + (rise - m) * missing);
    }
    let q = s * s * s;
    (q <= law.load_limit_n).then(|| law.preload_per_load * q / (1.0 + law.angle_per_load * (s * s)))
}

/// [`preload`] with the core's own functions.
#[inline(never)]
pub fn preload_own(law: &Reduced<f32>, force_n: f32, viscous_speed: f32) -> Option<f32> {
    preload::<Own>(law, force_n, viscous_speed)
}

/// [`preload`] with `libm`.
#[inline(never)]
pub fn preload_libm(law: &Reduced<f32>, force_n: f32, viscous_speed: f32) -> Option<f32> {
    preload::<Libm>(law, force_n, viscous_speed)
}

/// [`preload`] with `micromath`.
#[inline(never)]
pub fn preload_micromath(law: &Reduced<f32>, force_n: f32, viscous_speed: f32) -> Option<f32> {
    preload::<Micromath>(law, force_n, viscous_speed)
}

/// The core's full inversion, with its sensitivities.
#[inline(never)]
pub fn invert_float(law: &Reduced<f32>, force_n: f32, viscous_speed: f32) -> Option<f32> {
    law.invert(force_n, viscous_speed)
        .ok()
        .map(|i| i.preload_n + i.per_force + i.per_viscous_speed + i.film + i.friction_coefficient)
}

/// The fixed-point inversion.
#[inline(never)]
pub fn invert_fixed(
    law: &fixed::Reduced,
    force: fixed::Newtons,
    viscous_speed: fixed::ViscousSpeed,
) -> Option<fixed::Newtons> {
    law.preload(force, viscous_speed).ok()
}
