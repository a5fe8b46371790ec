//! What the paper prints where the model differs from it: Eq. 4, Eq. 14 and Eq. 21 to the letter.
//!
//! For comparison only; nothing that measures uses these.

use model_core::contact::{Contact, Guide};
use model_core::exact::Exact;

/// The four constants of Eq. 21 as printed: two of friction (dimensionless), one slope and one decay per unit of ε.
pub const EQUATION_21: [f64; 4] = [0.00728, 2.33e7, 0.0064, 4.95e10];

/// The factor of Eq. 5 as printed; exactly it is `(3/2)^(2/3)/2`.
pub const EQUATION_5: f64 = 0.655;

/// Bracket of the rounded Eq. 21 over four: a friction coefficient. `hersey` in the paper's unit, `>= 0`.
///
/// `4μ = 0.00728 + 2.33·10⁷ ε + 0.0064 e^(-4.95·10¹⁰ ε)`, `ε = πabηu/Q = 1.5 H`      Eq. 21
pub fn coefficient_of_equation_21(hersey: f64) -> f64 {
    let [coulomb, slope, stribeck, decay] = EQUATION_21;
    let eps = 1.5 * hersey;
    (coulomb + slope * eps + stribeck * (-decay * eps).exp()) / 4.0
}

/// Contact angle by Eq. 4 as printed, rad; `q` is the load per ball, N, within the contact's geometry.
///
/// `δ = (ε Q^(2/3) - δ0) sin β`, `tan β = (s0 sin α0 + δ)/(s0 cos α0)`      Eq. 3 and 4
pub fn contact_angle_rad(guide: &Guide, q: f64) -> f64 {
    let contact = Contact::of(guide);
    let (sin0, cos0) = guide.contact_angle_rad.sin_cos();
    let approach = contact.eps * q.cbrt().powi(2) - guide.initial_interference_m;
    let mut beta = guide.contact_angle_rad;
    // a contraction: its factor is approach/s0 times a product of sines and cosines, below one half here
    for _ in 0..200 {
        beta = (contact.s0 * sin0 + approach * beta.sin()).atan2(contact.s0 * cos0);
    }
    beta
}

/// Sliding speed over carriage speed, with its sign, if the ball turns as Eq. 14 is printed.
///
/// ```text
/// u/V = 1 - (ρ0/r0) (cos γ cos γ' cos β + sin γ sin β)/(cos γ cos γ' cos β + cos γ sin γ' sin β)   Eq. 12, 14, 15
/// ```
///
/// `q` load per ball in N; `beta`, `gamma`, `gamma_dash` in rad. With `gamma = 0` and `gamma_dash = 0` it is the
/// corrected form. `model` must use the sliding speed.
pub fn slip_ratio(model: &Exact, q: f64, beta: f64, gamma: f64, gamma_dash: f64) -> f64 {
    let along = gamma.cos() * gamma_dash.cos() * beta.cos();
    let turning = along + gamma.sin() * beta.sin();
    let printed = along + gamma.cos() * gamma_dash.sin() * beta.sin();
    // ρ0/r0 = 1 + |u|/V of the corrected form
    1.0 - (1.0 + model.slip_ratio(q)) * turning / printed
}
