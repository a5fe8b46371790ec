//! The time over which force and motion are compared.

use simulation::motion::Motion;
use simulation::run::Run;

use crate::nominal::Nominal;

/// Averages that a recording must be left with.
const FEWEST: usize = 1000;

/// Rows that are averaged to one. A force follows a step of the acceleration at once; the acceleration that the
/// parabola through `2m + 1` positions tells is 2 % short at a period of `32 m` rows and nothing above. Averages of
/// `8 m` rows compare both where both are right, as far as enough of them are left.
pub(crate) fn coarsest(nominal: &Nominal, runs: &[Run], motions: &[Motion]) -> usize {
    let derived = runs.iter().all(|run| run.acceleration_m_s2.is_none() && run.velocity_m_s.is_none());
    if !derived || !nominal.accelerates_mass() {
        return 1;
    }
    let most = runs.iter().map(Run::len).sum::<usize>() / FEWEST;
    (8 * motions.iter().map(|motion| motion.acceleration_reach).max().unwrap_or(0)).min(most).max(1)
}
