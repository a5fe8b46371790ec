//! Single working points: preload of a drag force, drag force of a preload, and the sensitivities of both.

use model_core::quantity;
use model_core::reference::zhou_2023::{PRELOAD_RANGE_N, SPEED_RANGE_M_S};
use serde::Serialize;
use simulation::guide::{GuideSet, Lubricant};

/// What is known of the oil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Oil {
    /// Kinematic viscosity, cSt.
    Viscosity(f64),
    /// Temperature, °C; the viscosity follows from the guide set's oil.
    Temperature(f64),
    /// Nothing: works only with a guide set of constant viscosity.
    Unsaid,
}

/// What is known of the motion beside the force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Carriage speed, m/s; its sign is ignored.
    pub speed_m_s: f64,
    /// Oil.
    pub oil: Oil,
    /// Drag of the seals at that speed, N.
    pub seal_drag_n: f64,
}

/// Side of the Stribeck curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// Below the Hersey number of least friction.
    Mixed,
    /// At or above it.
    FullFilm,
}

impl Regime {
    /// Name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Regime::Mixed => "mixed",
            Regime::FullFilm => "full-film",
        }
    }
}

/// A working point with every intermediate quantity. SI units; field names are the keys of the JSON form.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// Preload F_p.
    pub preload_n: f64,
    /// Drag force of the block, seals included.
    pub force_n: f64,
    /// Drag force of the contacts alone.
    pub contact_force_n: f64,
    /// Drag force of the seals.
    pub seal_drag_n: f64,
    /// Carriage speed, absolute value.
    pub speed_m_s: f64,
    /// Viscosity of the oil.
    pub viscosity_cst: f64,
    /// Normal load per ball Q.
    pub load_per_ball_n: f64,
    /// Major semi-axis of the contact ellipse.
    pub semi_axis_a_m: f64,
    /// Minor semi-axis.
    pub semi_axis_b_m: f64,
    /// Maximum contact pressure.
    pub max_pressure_pa: f64,
    /// u over the carriage speed; 1 where the carriage speed stands in the Hersey number.
    pub slip_ratio: f64,
    /// Speed u of the Hersey number.
    pub hersey_speed_m_s: f64,
    /// Hersey number in the paper's unit.
    pub hersey_number: f64,
    /// k_s H, dimensionless.
    pub stribeck_number: f64,
    /// Lubrication regime.
    pub regime: Regime,
    /// Friction coefficient μ.
    pub friction_coefficient: f64,
    /// Contact angle under load.
    pub contact_angle_deg: f64,
    /// Lateral force F_H on the split block.
    pub lateral_force_n: f64,
    /// dlnF_p/dlnF at constant viscosity, speed and seal drag.
    pub dlnpreload_dlnforce: f64,
    /// dlnF_p/dlnν at constant force; the same for the speed where the seal drag stays.
    pub dlnpreload_dlnviscosity: f64,
    /// dlnF/dlnF_p at constant viscosity and speed.
    pub dlnforce_dlnpreload: f64,
    /// dlnF/dlnν at constant preload; the same for the speed.
    pub dlnforce_dlnviscosity: f64,
}

/// A quantity of an [`Answer`] with its unit, for tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Name, the field's.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// Unit; empty without one.
    pub unit: &'static str,
    /// Symbol and equation.
    pub meaning: &'static str,
}

impl Answer {
    /// Every quantity but the regime, in the order in which they follow from each other.
    pub fn quantities(&self) -> [Quantity; 21] {
        let of = |name, value, unit, meaning| Quantity { name, value, unit, meaning };
        [
            of("preload_n", self.preload_n, "N", "F_p, eq. 1"),
            of("force_n", self.force_n, "N", "drag force, seals included"),
            of("contact_force_n", self.contact_force_n, "N", "F_f of the contacts, eq. 6 and 21"),
            of("seal_drag_n", self.seal_drag_n, "N", "drag force of the seals"),
            of("speed_m_s", self.speed_m_s, "m/s", "V of the carriage"),
            of("viscosity_cst", self.viscosity_cst, "cSt", "kinematic viscosity of the oil"),
            of("load_per_ball_n", self.load_per_ball_n, "N", "Q"),
            of("contact_angle_deg", self.contact_angle_deg, "deg", "beta under load, eq. 3 and 4"),
            of("lateral_force_n", self.lateral_force_n, "N", "F_H on a split block, eq. 2"),
            of("semi_axis_a_m", self.semi_axis_a_m, "m", "a of the contact ellipse, eq. 9"),
            of("semi_axis_b_m", self.semi_axis_b_m, "m", "b of the contact ellipse, eq. 9"),
            of("max_pressure_pa", self.max_pressure_pa, "Pa", "P, the maximum, eq. 11"),
            of("slip_ratio", self.slip_ratio, "", "u/V, eq. 12"),
            of("hersey_speed_m_s", self.hersey_speed_m_s, "m/s", "u"),
            of("hersey_number", self.hersey_number, "cSt m/(s Pa)", "H = nu u/P"),
            of("stribeck_number", self.stribeck_number, "", "k_s H"),
            of("friction_coefficient", self.friction_coefficient, "", "mu, eq. 20"),
            of("dlnpreload_dlnforce", self.dlnpreload_dlnforce, "%/%", "preload per force"),
            of("dlnpreload_dlnviscosity", self.dlnpreload_dlnviscosity, "%/%", "preload per viscosity, or speed"),
            of("dlnforce_dlnpreload", self.dlnforce_dlnpreload, "%/%", "force per preload"),
            of("dlnforce_dlnviscosity", self.dlnforce_dlnviscosity, "%/%", "force per viscosity, or speed"),
        ]
    }
}

/// Refusal of an input that the law does not cover. The text names it and the range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct Refusal {
    /// Which input, as columns spell it.
    pub input: &'static str,
    /// What is wrong with it.
    pub what: String,
}

fn refuse<T>(input: &'static str, what: String) -> Result<T, Refusal> {
    Err(Refusal { input, what })
}

/// Preload of a drag force in N, positive against the motion, seals included.
///
/// # Errors
/// [`Refusal`]: an input outside its legal range, a force that the seals alone explain or that is beyond the geometry.
pub fn preload(set: &GuideSet, force_n: f64, motion: Motion) -> Result<Answer, Refusal> {
    let known = Known::of(set, motion)?;
    let contacts = force_n - known.seal_n;
    if !(force_n.is_finite() && contacts > 0.0) {
        let least = known.seal_n;
        return refuse("force_n", format!("force_n must be above the seal drag of {least} N, not {force_n}"));
    }
    let exact = set.exact();
    let point = exact.working_point(contacts, known.number, known.speed);
    // the result of Newton's iteration is checked: its drag force must be the given one
    match point.filter(|p| (p.drag_force_n / contacts - 1.0).abs() < 1e-11) {
        Some(point) => known.answer(set, point.load_per_ball_n, force_n, contacts),
        None => {
            let limit = known.seal_n + exact.drag_force_n(0.999 * exact.load_limit_n(), known.number, known.speed);
            refuse(
                "force_n",
                format!(
                    "force_n must lie between {} and {limit:.1} N at this speed and viscosity, not {force_n}: beyond, \
                     the contact ellipse leaves the ball",
                    known.seal_n
                ),
            )
        }
    }
}

/// Drag force of a preload in N, seals included.
///
/// # Errors
/// [`Refusal`]: an input outside its legal range, or a preload beyond the geometry.
pub fn drag(set: &GuideSet, preload_n: f64, motion: Motion) -> Result<Answer, Refusal> {
    let known = Known::of(set, motion)?;
    let exact = set.exact();
    match exact.load_of_preload(preload_n).filter(|q| (exact.preload_n(*q) / preload_n - 1.0).abs() < 1e-11) {
        Some(q) => {
            let contacts = exact.drag_force_n(q, known.number, known.speed);
            known.answer(set, q, contacts + known.seal_n, contacts)
        }
        None => {
            let limit = exact.preload_n(exact.load_limit_n());
            refuse(
                "preload_n",
                format!(
                    "preload_n must be above 0 and below {limit:.0} N, not {preload_n}: beyond, the contact ellipse \
                     leaves the ball"
                ),
            )
        }
    }
}

/// Inputs that are outside what the paper measured, in words; empty when there are none.
pub fn outside_measured(answer: &Answer) -> Vec<String> {
    [("speed_m_s", answer.speed_m_s, SPEED_RANGE_M_S, "m/s"), ("preload_n", answer.preload_n, PRELOAD_RANGE_N, "N")]
        .into_iter()
        .filter(|(_, x, (from, to), _)| !(from..=to).contains(&x))
        .map(|(name, x, (from, to), unit)| format!("{name} {x:.6} is outside the measured {from:.6} to {to:.6} {unit}"))
        .collect()
}

/// The inputs that both directions share, checked.
struct Known {
    speed: f64,
    viscosity_cst: f64,
    /// Viscosity number of the law.
    number: f64,
    seal_n: f64,
}

impl Known {
    fn of(set: &GuideSet, motion: Motion) -> Result<Self, Refusal> {
        let check = |input: &'static str, x: f64| match quantity::check(input, x) {
            Ok(()) => Ok(x),
            Err(why) => refuse(input, format!("{why}, not {x}")),
        };
        let speed = check("speed_m_s", motion.speed_m_s.abs())?;
        if speed == 0.0 {
            let what = "speed_m_s must be above 0: the law holds for steady motion, at rest friction is not determined";
            return refuse("speed_m_s", what.to_owned());
        }
        let seal_n = check("seal_drag_n", motion.seal_drag_n)?;
        let viscosity_cst = match (motion.oil, set.lubricant()) {
            (Oil::Viscosity(nu), _) => check("viscosity_cst", nu)?,
            (Oil::Temperature(t), Lubricant::Walther(walther)) => {
                let nu = walther.viscosity_cst(check("temperature_degc", t)?);
                quantity::check("viscosity_cst", nu).or_else(|why| {
                    refuse("temperature_degc", format!("temperature_degc {t}: the oil has {nu:.3} cSt there; {why}"))
                })?;
                nu
            }
            (Oil::Temperature(t), Lubricant::Constant(nu)) => {
                check("temperature_degc", t)?;
                nu
            }
            (Oil::Unsaid, Lubricant::Constant(nu)) => nu,
            (Oil::Unsaid, Lubricant::Walther(_)) => {
                return refuse("viscosity_cst", "neither viscosity_cst nor temperature_degc is given".to_owned());
            }
        };
        Ok(Known { speed, viscosity_cst, number: viscosity_cst * set.hersey_scale(), seal_n })
    }

    fn answer(&self, set: &GuideSet, q: f64, force_n: f64, contacts: f64) -> Result<Answer, Refusal> {
        let (exact, friction) = (set.exact(), set.exact().friction());
        let point = exact.at_load(q, self.number, self.speed);
        let (h, mu) = (point.hersey, point.friction_coefficient);
        // elasticities: of μ by H, of the contacts' drag by Q, of the preload by Q
        let of_mu = h * friction.slope(h) / mu;
        let of_drag = 1.0 + exact.hersey_load_exponent(q) * of_mu;
        let of_preload = exact.preload_load_exponent(q);
        if !(of_drag > 0.0 && of_preload > 0.0) {
            return refuse("force_n", "at this working point several preloads make the same drag force".to_owned());
        }
        let cube = libm::cbrt(q);
        let slip_ratio = exact.slip_ratio(q);
        // share of the contacts in the whole force, seals included
        let share = contacts / force_n;
        let minimum = friction.hersey_of_minimum();
        let is_mixed = friction.mu_stribeck > 0.0 && h < minimum;
        Ok(Answer {
            preload_n: point.preload_n,
            force_n,
            contact_force_n: contacts,
            seal_drag_n: self.seal_n,
            speed_m_s: self.speed,
            viscosity_cst: self.viscosity_cst,
            load_per_ball_n: q,
            semi_axis_a_m: exact.contact().k_a * cube,
            semi_axis_b_m: exact.contact().k_b * cube,
            max_pressure_pa: exact.pressure_pa(q),
            slip_ratio,
            hersey_speed_m_s: slip_ratio * self.speed,
            hersey_number: h,
            stribeck_number: friction.stribeck_exponent * h,
            regime: if is_mixed { Regime::Mixed } else { Regime::FullFilm },
            friction_coefficient: mu,
            contact_angle_deg: point.contact_angle_rad.to_degrees(),
            lateral_force_n: exact.lateral_force_n(q),
            dlnpreload_dlnforce: of_preload / of_drag / share,
            dlnpreload_dlnviscosity: -of_preload / of_drag * of_mu,
            dlnforce_dlnpreload: of_drag / of_preload * share,
            dlnforce_dlnviscosity: of_mu * share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nu: f64, speed_m_s: f64, seal_drag_n: f64) -> Motion {
        Motion { speed_m_s, oil: Oil::Viscosity(nu), seal_drag_n }
    }

    #[test]
    fn sensitivities_are_the_derivatives_seals_included() {
        let set = GuideSet::zhou_2023();
        let d = 1e-5;
        for (nu, v) in [(20.0, 0.005), (100.0, 0.05), (700.0, 0.1)] {
            let answer = preload(&set, 30.0, at(nu, v, 5.0)).expect("covered");
            let of = |force: f64, nu: f64| libm::log(preload(&set, force, at(nu, v, 5.0)).expect("covered").preload_n);
            let by_force = (of(30.0 * (1.0 + d), nu) - of(30.0 * (1.0 - d), nu)) / (2.0 * d);
            let by_nu = (of(30.0, nu * (1.0 + d)) - of(30.0, nu * (1.0 - d))) / (2.0 * d);
            assert!((by_force - answer.dlnpreload_dlnforce).abs() < 1e-7, "{by_force} {answer:?}");
            assert!((by_nu - answer.dlnpreload_dlnviscosity).abs() < 1e-7, "{by_nu} {answer:?}");
            let back = drag(&set, answer.preload_n, at(nu, v, 5.0)).expect("covered");
            assert!((back.force_n / 30.0 - 1.0).abs() < 1e-12);
            let of = |preload: f64, nu: f64| libm::log(drag(&set, preload, at(nu, v, 5.0)).expect("covered").force_n);
            let p = answer.preload_n;
            let by_preload = (of(p * (1.0 + d), nu) - of(p * (1.0 - d), nu)) / (2.0 * d);
            let by_nu = (of(p, nu * (1.0 + d)) - of(p, nu * (1.0 - d))) / (2.0 * d);
            assert!((by_preload - back.dlnforce_dlnpreload).abs() < 1e-7);
            assert!((by_nu - back.dlnforce_dlnviscosity).abs() < 1e-7);
        }
    }

    #[test]
    fn refusals_name_the_input() {
        let set = GuideSet::zhou_2023();
        let input = |force, motion| preload(&set, force, motion).expect_err("refused").input;
        assert_eq!(input(5.0, at(100.0, 0.05, 5.0)), "force_n");
        assert_eq!(input(f64::NAN, at(100.0, 0.05, 0.0)), "force_n");
        assert_eq!(input(1e6, at(100.0, 0.05, 0.0)), "force_n");
        assert_eq!(input(5.0, at(0.0, 0.05, 0.0)), "viscosity_cst");
        assert_eq!(input(5.0, at(100.0, 21.0, 0.0)), "speed_m_s");
        assert_eq!(input(5.0, at(100.0, 0.0, 0.0)), "speed_m_s");
        assert_eq!(input(5.0, at(100.0, 0.05, -1.0)), "seal_drag_n");
        let cold = Motion { speed_m_s: 0.05, oil: Oil::Temperature(-40.0), seal_drag_n: 0.0 };
        assert_eq!(input(5.0, cold), "temperature_degc");
        assert_eq!(input(5.0, Motion { oil: Oil::Unsaid, ..cold }), "viscosity_cst");
        assert_eq!(drag(&set, 1e9, at(100.0, 0.05, 0.0)).expect_err("refused").input, "preload_n");
        assert_eq!(drag(&set, 0.0, at(100.0, 0.05, 0.0)).expect_err("refused").input, "preload_n");
    }
}
