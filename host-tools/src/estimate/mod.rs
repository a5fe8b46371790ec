//! Preload over a whole recording, window by window, with its band.
//!
//! ```text
//! run -> windows: steady motion? mean force and its noise -> seals and inertia off -> reduced law -> preload ± sigma
//!                                                         -> speeds -> one preload for all of them (staircase)
//! ```
//!
//! Reasons against a window have the block's own names, [`Reason`]. Beside the noise the band includes the simulation's
//! `[tolerance]` of the law:
//!
//! ```text
//! (σ_p/F_p)² = S_F²((σ_F² + σ_seal²)/F² + σ_μ² + Σ (share of the term)² σ_term²) + S_ν² σ_ν²
//! ```
//!
//! S are the elasticities of the inverted law. The first term is different in every window; all others are common to
//! the whole recording and no longer recording makes them smaller.

mod band;
mod basis;
mod page;
mod staircase;
mod summary;
mod windows;

pub use band::{Estimate, Preload};
pub use basis::Basis;
pub use page::page;
pub use staircase::{speeds, staircase};
pub use summary::{Place, Summary};
pub use windows::{Window, window_s, windows};

use model_core::params::Params;
use model_core::reference::zhou_2023::{PRELOAD_RANGE_N, SPEED_RANGE_M_S};
use model_core::sample::Reason;
use simulation::Simulation;
use simulation::file::Law;
use simulation::run::Run;

/// How a recording is cut and what is known beside the simulation. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Length of a window, s, above 0; longer where it would hold too few rows, see [`window_s`].
    pub every_s: f64,
    /// Constant drag of the seals, N.
    pub seal_coulomb_n: f64,
    /// Drag of the seals that grows with speed, N s/m.
    pub seal_viscous_n_s_m: f64,
    /// Standard deviation of the seals' drag, N.
    pub seal_sigma_n: f64,
    /// Amplitude of the ball-pass ripple over the drag force.
    pub ball_pass_ripple: f64,
    /// Carriage travel per ball entering the loaded zone, m.
    pub ball_pass_wavelength_m: f64,
    /// Travel after a reversal or a start before the drag force is fully developed, m.
    pub presliding_guard_m: f64,
    /// Lowest and highest speed that the law was measured at, m/s.
    pub speed_range_m_s: (f64, f64),
    /// Lowest and highest preload that the law was measured at, N.
    pub preload_range_n: (f64, f64),
}

impl Default for Settings {
    fn default() -> Self {
        let block = Params::ZHOU_2023;
        Settings {
            every_s: 0.25,
            seal_coulomb_n: 0.0,
            seal_viscous_n_s_m: 0.0,
            seal_sigma_n: 0.0,
            ball_pass_ripple: f64::from(block.uncertainty.ball_pass_ripple),
            ball_pass_wavelength_m: f64::from(block.ball_pass_wavelength_m),
            presliding_guard_m: f64::from(block.presliding_guard_m),
            speed_range_m_s: SPEED_RANGE_M_S,
            preload_range_n: PRELOAD_RANGE_N,
        }
    }
}

/// Why a simulation gives no preload at all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unable {
    /// Its law knows no preload.
    #[error("the simulation describes no ball guide; give one with [guide] parameters = \"zhou-2023\"")]
    NoGuide,
    /// The oil's viscosity falls with temperature and the run has none.
    #[error(
        "the recording has no column temperature_block_degc, which the oil's viscosity needs; give lubricant.viscosity_cst \
         or --viscosity for an oil at one temperature"
    )]
    NoTemperature,
}

/// Estimates the preload of every window.
///
/// # Errors
/// [`Unable`]: the simulation has no guide, or the oil needs a temperature that was not recorded.
pub fn estimate(run: &Run, simulation: &Simulation, settings: &Settings) -> Result<Vec<Estimate>, Unable> {
    let Law::Guide(set) = &simulation.law else { return Err(Unable::NoGuide) };
    let band = band::Band::new(set, simulation, settings);
    if band.needs_temperature() && run.temperature_block_degc.is_none() {
        return Err(Unable::NoTemperature);
    }
    let windows = windows(run, settings, simulation.axis.zero_speed_m_s);
    Ok(windows.into_iter().map(|window| band.estimate(window)).collect())
}

/// Whether a window shows steady motion whose force may be used, whatever preload it gives.
pub(crate) fn is_steady(estimate: &Estimate) -> bool {
    estimate.reasons.iter().all(|reason| reason == Reason::LoadOutOfRange)
}
