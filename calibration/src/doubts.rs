//! Doubts: what strokes at known load cannot determine, in words.
//!
//! Some follow from the uncertainties of the fit, others from which loads, temperatures and directions were measured: a
//! constant seal drag and μ_c Q are indistinguishable at one load, whatever the noise.

use crate::cell::Cell;
use crate::fit::{FrictionFit, NAMES};
use crate::levels::levels;

/// Correlation from which two constants are reported together.
const TOGETHER: f64 = 0.9;

/// One thing that the strokes leave undetermined.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Doubt {
    /// Short name for programs.
    pub code: &'static str,
    /// What it is and what would settle it.
    pub text: String,
}

/// Everything that is left undetermined.
pub fn doubts(cells: &[Cell], fit: &FrictionFit) -> Vec<Doubt> {
    let mut all = Vec::new();
    let mut say = |code, text: String| all.push(Doubt { code, text });
    for (n, name) in NAMES.iter().enumerate().filter(|(n, _)| !fit.is_determined(*n)) {
        let advice = match n {
            1 => "measure at higher speeds: the viscous term shows on the rising branch",
            2 | 3 => "measure at lower speeds: the mixed branch ends where the Stribeck term has fallen",
            _ => "measure at more loads and speeds",
        };
        let part = 100.0 * fit.sigma(n) / fit.constant(n).abs();
        say(
            "constant-open",
            format!("{name} is not determined: its standard deviation is {part:.0} % of it; {advice}"),
        );
    }
    let mut together = Vec::new();
    for (b, second) in NAMES.iter().enumerate() {
        for (a, first) in NAMES.iter().enumerate().take(b) {
            let r = fit.covariance[(a, b)] / (fit.sigma(a) * fit.sigma(b));
            if r.abs() > TOGETHER {
                together.push(format!("{first} with {second} ({r:+.3})"));
            }
        }
    }
    if !together.is_empty() {
        let text = format!(
            "these constants change together, each of them is known worse than the curve that they make (correlations): {}",
            together.join(", ")
        );
        say("constants-together", text);
    }
    let loaded: Vec<f64> = cells.iter().map(|c| c.load_per_ball_n).filter(|q| *q > 0.0).collect();
    let loads = levels(&loaded).1.len();
    let seals_known = fit.seal_drag_n.is_some();
    if loads < 2 {
        let text = "all strokes have one load: a constant drag of the seals, mu_coulomb, rolling hysteresis and slip in \
                    the contact (Heathcote) are one and the same number, and the two conventions of the Hersey number \
                    fit alike; measure at a second load or with the seals off";
        say("one-load", text.to_owned());
    } else {
        let text = "rolling hysteresis and slip in the contact (Heathcote) grow with the load nearly as mu_coulomb does: \
                    what is called mu_coulomb holds all three";
        say("hysteresis-in-mu-coulomb", text.to_owned());
    }
    if !seals_known {
        let text = "no stroke without seals or without load: what drag the seals have is in mu_coulomb (constant part) \
                    and mu_viscous (part that grows with speed); measure the unloaded block or one without seals";
        say("seals", text.to_owned());
    }
    let viscosities: Vec<f64> = cells.iter().map(|c| c.viscosity_cst).collect();
    if levels(&viscosities).1.len() < 2 {
        let text = "all strokes have one temperature: a viscous drag of the seals and churning of the oil cannot be told \
                    apart, and how the drag follows the oil's viscosity rests on the law; measure at a second temperature";
        say("one-temperature", text.to_owned());
    }
    let directions = |d: f64| cells.iter().any(|c| c.direction == d);
    if directions(1.0) != directions(-1.0) {
        let text = "all strokes go in one direction: an offset of the force sensor is in mu_coulomb; measure both ways";
        say("one-direction", text.to_owned());
    }
    let text = "from friction alone only products are known: viscosity times speed times the geometry of the contact in \
                the Hersey number; gain of the force sensor times friction coefficient times number of loaded balls";
    say("products", text.to_owned());
    all
}
