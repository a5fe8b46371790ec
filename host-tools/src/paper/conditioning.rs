//! How errors of force, viscosity and speed become errors of the preload.

use model_core::exact::Exact;

use super::convention::{LATERAL_N, SPEEDS_M_MIN};

/// Effects of small errors on the preload at one working point, each as a ratio less one.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Conditioning {
    /// Drag force there, N.
    pub drag_n: f64,
    /// Preload there, N.
    pub preload_n: f64,
    /// Drag force read 1 % too high.
    pub force: f64,
    /// Viscosity taken 5 % too high.
    pub viscosity: f64,
    /// Speed read 1 % too high.
    pub speed: f64,
    /// Half a newton added to the drag force.
    pub offset: f64,
    /// Twenty newtons of seal drag not taken off.
    pub seals: f64,
}

/// Inverts Eq. 21 with each error in turn: load per ball `q` in N, viscosity number, speed in m/s.
///
/// `None` where one of the disturbed forces belongs to no load within the geometry.
pub fn conditioning(model: &Exact, q: f64, nu: f64, speed_m_s: f64) -> Option<Conditioning> {
    let there = model.at_load(q, nu, speed_m_s);
    let (drag, preload) = (there.drag_force_n, there.preload_n);
    let error = |force, nu, speed| model.working_point(force, nu, speed).map(|found| found.preload_n / preload - 1.0);
    Some(Conditioning {
        drag_n: drag,
        preload_n: preload,
        force: error(1.01 * drag, nu, speed_m_s)?,
        viscosity: error(drag, 1.05 * nu, speed_m_s)?,
        speed: error(drag, nu, 1.01 * speed_m_s)?,
        offset: error(drag + 0.5, nu, speed_m_s)?,
        seals: error(drag + 20.0, nu, speed_m_s)?,
    })
}

/// Smallest and largest error of the preload on the measured grid, a ratio less one, if the oil has the viscosity
/// number `truly` and is taken to have `taken`. `None` where a load or a drag force is beyond the geometry.
pub fn error_of_viscosity(model: &Exact, truly: f64, taken: f64) -> Option<(f64, f64)> {
    let mut range = (f64::INFINITY, f64::NEG_INFINITY);
    for lateral in LATERAL_N {
        let q = model.load_of_lateral_force(lateral)?;
        for speed in SPEEDS_M_MIN.map(|v| v / 60.0) {
            let found = model.working_point(model.drag_force_n(q, truly, speed), taken, speed)?;
            let error = found.preload_n / model.preload_n(q) - 1.0;
            range = (range.0.min(error), range.1.max(error));
        }
    }
    Some(range)
}

/// The slopes (dlnF_p/dlnF_f, dlnF_p/dln(νV)) at a load per ball in N, a viscosity number and a speed in m/s.
///
/// `S_F = t/(1 + q E_μ)`, `S_n = -S_F E_μ` with `E_μ = dlnμ/dlnH`, `q = dlnH/dlnQ` and `t = dlnF_p/dlnQ`.
pub fn slopes(model: &Exact, q: f64, nu: f64, speed_m_s: f64) -> (f64, f64) {
    let hersey = model.hersey(q, nu, speed_m_s);
    let friction = model.friction();
    let of_friction = hersey * friction.slope(hersey) / friction.coefficient(hersey);
    // both logarithmic derivatives by a central difference; its error is a few 1e-10
    let d = 1e-5;
    let of_preload =
        (model.preload_n(q * (1.0 + d)) / model.preload_n(q * (1.0 - d))).ln() / ((1.0 + d) / (1.0 - d)).ln();
    let per_force = of_preload / (1.0 + model.hersey_load_exponent(q) * of_friction);
    (per_force, -per_force * of_friction)
}

/// Smallest and largest of both slopes over a box of loads per ball (N) and the speeds 0.1 to 6 m/min.
pub fn slopes_over(model: &Exact, loads: (f64, f64), viscosity_numbers: (f64, f64)) -> [(f64, f64); 2] {
    const STEPS: u32 = 80;
    let between = |(low, high): (f64, f64), n: u32| low * (high / low).powf(f64::from(n) / f64::from(STEPS));
    let mut range = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    let steps = if viscosity_numbers.0 == viscosity_numbers.1 { 0 } else { STEPS };
    for k in 0..=steps {
        let nu = between(viscosity_numbers, k);
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let (force, viscous) = slopes(model, between(loads, i), nu, between((0.1, 6.0), j) / 60.0);
                for (range, value) in range.iter_mut().zip([force, viscous]) {
                    *range = (range.0.min(value), range.1.max(value));
                }
            }
        }
    }
    range
}
