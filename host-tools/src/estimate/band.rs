//! Preload of one window with its standard deviation.

use std::f64::consts::FRAC_1_PI;

use model_core::reduced::{OutOfDomain, Reduced};
use model_core::sample::{Reason, Reasons};
use simulation::Simulation;
use simulation::file::Tolerance;
use simulation::guide::{GuideSet, Lubricant};

use super::{Settings, Window};

/// Load per ball that the reduced law is made for where the range of preloads has none, N.
const LOAD_LIMIT_N: f64 = 600.0;

/// A preload with its uncertainty, N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preload {
    /// Best value.
    pub value_n: f64,
    /// Standard deviation from the noise of this window's force.
    pub noise_n: f64,
    /// Standard deviation from the assumed law and seals; common to all windows.
    pub model_n: f64,
}

impl Preload {
    /// Standard deviation of everything together, N.
    pub fn sigma_n(&self) -> f64 {
        libm::hypot(self.noise_n, self.model_n)
    }

    /// The band of two standard deviations, about 95 %, N.
    pub fn band(&self) -> (f64, f64) {
        (self.value_n - 2.0 * self.sigma_n(), self.value_n + 2.0 * self.sigma_n())
    }
}

/// A window with its preload.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The window.
    pub window: Window,
    /// Viscosity of the oil, cSt; NaN where it is not known.
    pub viscosity_cst: f64,
    /// Drag of the contacts, N, positive against the motion: seals and inertia taken off.
    pub contact_force_n: f64,
    /// Standard deviation of that from noise and ripple, N.
    pub contact_sigma_n: f64,
    /// Preload; only without a reason against it.
    pub preload: Option<Preload>,
    /// Why there is none.
    pub reasons: Reasons,
}

/// The inverted law with its tolerances.
pub(super) struct Band<'a> {
    law: Reduced<f64>,
    set: &'a GuideSet,
    tolerance: Tolerance,
    mass_kg: f64,
    settings: &'a Settings,
}

impl<'a> Band<'a> {
    pub(super) fn new(set: &'a GuideSet, simulation: &Simulation, settings: &'a Settings) -> Self {
        let exact = set.exact();
        // a tenth more than the heaviest preload that is given out
        let limit = exact.load_of_preload(1.1 * settings.preload_range_n.1).unwrap_or(LOAD_LIMIT_N);
        Band {
            law: Reduced::of(exact.guide(), exact.friction(), limit),
            set,
            tolerance: simulation.tolerance,
            mass_kg: simulation.axis.moved_mass_kg.unwrap_or(0.0),
            settings,
        }
    }

    pub(super) fn needs_temperature(&self) -> bool {
        matches!(self.set.lubricant(), Lubricant::Walther(_))
    }

    pub(super) fn estimate(&self, window: Window) -> Estimate {
        let s = self.settings;
        let mut reasons = window.reasons;
        let speed = window.speed_m_s.abs();
        let viscosity_cst = match self.set.lubricant() {
            Lubricant::Constant(nu) => nu,
            Lubricant::Walther(oil) => oil.viscosity_cst(window.temperature_degc),
        };
        reasons.insert_if(viscosity_cst.is_nan(), Reason::TemperatureMissing);
        let drag = window.speed_m_s.signum() * (window.force_n - self.mass_kg * window.acceleration_m_s2);
        let contacts = drag - s.seal_coulomb_n - s.seal_viscous_n_s_m * speed;
        // as on the block: a window shorter than a ball pass sees one flank of the ripple
        let unaveraged = (FRAC_1_PI * s.ball_pass_wavelength_m / window.travel_m).min(1.0);
        let noise = libm::hypot(window.force_sigma_n, s.ball_pass_ripple * unaveraged * drag);
        let is_moving = !reasons.contains(Reason::NoMotion);
        reasons.insert_if(is_moving && drag <= 0.0, Reason::ForceAssists);
        let (from, to) = s.speed_range_m_s;
        // a speed at the border of the range is measured as a little less or more
        let is_known = speed >= from * (1.0 - 5e-3) && speed <= to * (1.0 + 5e-3);
        reasons.insert_if(is_moving && !is_known, Reason::SpeedOutOfRange);
        let mut preload = None;
        if reasons.is_empty() {
            match self.invert(contacts, noise, viscosity_cst, speed) {
                Ok(found) if (s.preload_range_n.0..=s.preload_range_n.1).contains(&found.value_n) => {
                    preload = Some(found);
                }
                Ok(_) | Err(_) => reasons.insert(Reason::LoadOutOfRange),
            }
        }
        Estimate { viscosity_cst, contact_force_n: contacts, contact_sigma_n: noise, preload, reasons, window }
    }

    fn invert(&self, contacts: f64, noise: f64, viscosity: f64, speed: f64) -> Result<Preload, OutOfDomain> {
        let at = self.law.invert(contacts, viscosity * self.set.hersey_scale() * speed)?;
        let t = &self.tolerance;
        let friction = self.set.exact().friction();
        let mu = at.friction_coefficient;
        let viscous = friction.mu_viscous / friction.stribeck_exponent * at.film;
        let shares = [friction.mu_coulomb / mu, viscous / mu, (mu - friction.mu_coulomb - viscous) / mu];
        let terms: f64 = shares.iter().map(|share| share * share).sum::<f64>() * t.friction_terms * t.friction_terms;
        let seals = self.settings.seal_sigma_n / contacts;
        let force = libm::sqrt(t.friction * t.friction + terms + seals * seals);
        let model = libm::hypot(at.per_force * force, at.per_viscous_speed * t.viscosity);
        Ok(Preload {
            value_n: at.preload_n,
            noise_n: (at.preload_n * at.per_force * noise / contacts).abs(),
            model_n: at.preload_n * model,
        })
    }
}
