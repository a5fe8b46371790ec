//! One preload for all speeds of a recording.

use calibration::staircase::{self, Seals, Staircase, Step, Unfit};
use simulation::Simulation;
use simulation::file::Law;

use super::{Estimate, is_steady};

/// Speeds that differ by less than this part count as one.
const SAME_SPEED: f64 = 0.02;

/// Smallest standard deviation of a step, relative to its drag: a simulation has no noise, but no average is that
/// exact.
const LEAST_NOISE: f64 = 1e-4;

/// Puts the steady windows of every speed together, both directions alike.
pub fn speeds(estimates: &[Estimate]) -> Vec<Step> {
    let mut steady: Vec<&Estimate> = estimates.iter().filter(|e| is_steady(e)).collect();
    steady.sort_by(|a, b| a.window.speed_m_s.abs().total_cmp(&b.window.speed_m_s.abs()));
    let is_same = |a: &&Estimate, b: &&Estimate| {
        b.window.speed_m_s.abs() - a.window.speed_m_s.abs() <= SAME_SPEED * a.window.speed_m_s.abs()
    };
    steady.chunk_by(is_same).map(step).collect()
}

fn step(windows: &[&Estimate]) -> Step {
    let n = windows.len() as f64;
    let mean = |of: &dyn Fn(&Estimate) -> f64| windows.iter().map(|e| of(e)).sum::<f64>() / n;
    let drag_n = mean(&|e| e.contact_force_n);
    let noise = libm::sqrt(mean(&|e| e.contact_sigma_n * e.contact_sigma_n) / n);
    let scatter = mean(&|e| (e.contact_force_n - drag_n) * (e.contact_force_n - drag_n)) / (n - 1.0).max(1.0);
    // differences between places and directions count through the scatter only
    let sigma_n = noise.max(libm::sqrt(scatter)).max(LEAST_NOISE * drag_n.abs());
    Step { speed_m_s: mean(&|e| e.window.speed_m_s.abs()), viscosity_cst: mean(&|e| e.viscosity_cst), drag_n, sigma_n }
}

/// Fits one preload, and the constant drag of the seals where asked, to all speeds.
///
/// # Errors
/// [`Unfit`]; [`Unfit::NoPreload`] also for a simulation without a guide.
pub fn staircase(estimates: &[Estimate], simulation: &Simulation, fits_seals: bool) -> Result<Staircase, Unfit> {
    let Law::Guide(set) = &simulation.law else { return Err(Unfit::NoPreload) };
    // known seals have been taken off the force already
    let seals = if fits_seals { Seals::Fitted } else { Seals::Known(0.0) };
    staircase::fit(set, &speeds(estimates), seals)
}
