//! Resolution: the averaging time over which force and motion are compared.

use simulation::motion::Motion;
use simulation::run::Run;

use crate::noise::third_differences;
use crate::nominal::Nominal;
use crate::numbers::statistics::robust_sigma;

/// Fewest averages that a recording must be left with.
const FEWEST: usize = 1000;

/// Least error of an unresolved acceleration, as a multiple of its usual error; it must exceed the noise as well.
const OUTSTANDING: f64 = 5.0;

/// Share of a run's moving rows below which corners are kept: a few are averaged away with the rest, or covered by the fast
/// part of the acceleration.
const OFTEN: f64 = 0.03;

/// Largest such share beside a column of simulated force.
const MOST_OF_COLUMN: f64 = 0.15;

/// Number of rows averaged to one. A force follows a step of the acceleration at once; the acceleration derived from a
/// parabola through `2m + 1` positions is 2 % too small at a period of `32 m` rows, and less above. Averages of `8 m`
/// rows compare both where both are right, as far as enough of them are left. Where the acceleration is smooth but for
/// corners, and those are excluded ([`unresolved`]), rows are not averaged.
pub(crate) fn coarsest(nominal: &Nominal, runs: &[Run], motions: &[Motion]) -> usize {
    let derived = runs.iter().all(|run| run.acceleration_m_s2.is_none() && run.velocity_m_s.is_none());
    if !derived || !nominal.accelerates_mass() {
        return 1;
    }
    if runs.iter().zip(motions).any(|(run, motion)| unresolved(nominal, run, motion).contains(&true)) {
        return 1;
    }
    let most = runs.iter().map(Run::len).sum::<usize>() / FEWEST;
    (8 * motions.iter().map(|motion| motion.acceleration_reach).max().unwrap_or(0)).min(most).max(1)
}

/// Rows whose derived acceleration is not that of the carriage: within the window of a corner of the speed, which a
/// parabola rounds. An error that is the same everywhere is no corner, and one below the noise of the force does no
/// harm. None for a column of simulated force where there would be many: it includes its inertia, which is exact as
/// long as its friction is not far off.
pub(crate) fn unresolved(nominal: &Nominal, run: &Run, motion: &Motion) -> Vec<bool> {
    let moved_kg = nominal.moved_kg(run, motion);
    if run.acceleration_m_s2.is_some() || !(moved_kg > 0.0) {
        return vec![false; run.len()];
    }
    let error_n = rounded_off_n(run, motion, moved_kg);
    let usual_n = robust_sigma(&error_n);
    let noise_n = robust_sigma(&third_differences(&run.drag_force_n));
    let found: Vec<bool> =
        error_n.iter().map(|error_n| *error_n > noise_n && *error_n > OUTSTANDING * usual_n).collect();
    let share =
        found.iter().filter(|unresolved| **unresolved).count() as f64 / nominal.moving_rows(motion).max(1) as f64;
    let too_many = nominal.holds_its_inertia() && share > MOST_OF_COLUMN;
    if share < OFTEN || too_many { vec![false; run.len()] } else { found }
}

/// Error of the inertial force from a derived acceleration, N, as the maximum over all rows whose windows overlap: for
/// a quartic, the second derivative of a parabola through `2m + 1` rows errs by about `a'' (m Δt)²/5`, and so does the
/// slope of a parabola through a cubic velocity.
fn rounded_off_n(run: &Run, motion: &Motion, moved_kg: f64) -> Vec<f64> {
    let (m, a) = (motion.reach, &motion.acceleration_m_s2);
    let (mut own, mut around) = (vec![0.0; run.len()], vec![0.0; run.len()]);
    for part in &run.parts {
        for n in part.rows.start + m..part.rows.end.saturating_sub(m) {
            let error_n = moved_kg * (a[n + m] - 2.0 * a[n] + a[n - m]).abs() / 5.0;
            own[n] = if error_n.is_finite() { error_n } else { 0.0 };
        }
        for n in part.rows.clone() {
            let (from, to) = (n.saturating_sub(m).max(part.rows.start), (n + m + 1).min(part.rows.end));
            around[n] = own[from..to].iter().copied().fold(0.0, f64::max);
        }
    }
    around
}
