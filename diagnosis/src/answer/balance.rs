//! Balance: how the squared mismatch after calibration is divided among what was found.

use std::ops::Range;

use simulation::Simulation;
use simulation::mechanism::Id;
use simulation::run::Run;

use crate::answer::aside::Aside;
use crate::answer::scores::Proof;
use crate::beside::bursts::bursts;
use crate::beside::events::Spots;
use crate::beside::transients::transients;
use crate::fit::rest::power;
use crate::noise::locks::least_of;
use crate::noise::rows::Rows;
use crate::numbers::rounding::quantum;
use crate::numbers::statistics::robust_sigma;
use crate::recording::side::Side;
use crate::search::found::Found;
use crate::search::open_set;
use crate::search::small::{LEAST_SHARE, LEAST_SHARE_OF_SMALL};

/// p-value below which a residual counts as unsteady: so small because the approximation is not trusted farther out.
const UNSTEADY: f64 = 1e-12;

/// Least share of the mismatch that an unsteady residual must have.
const UNSTEADY_SHARE: f64 = 0.15;

/// Least part of the noise's mean square that is worth a name where nothing follows it: of records of what has none (trial 34,
/// opened) the least was 0.06, and a hundredth is what the rows of a start leave.
const UNSTEADY_OF_NOISE: f64 = 0.02;

/// Mean square of what comes and goes, as a multiple of that of spots, above which the spots are a part of it: its peaks,
/// not dirt. In two recordings of a cage that jams it was 15 and 37 times; in nine of dirt (trials 31 and 32, opened, and a
/// development set) what was unsteady by [`UNSTEADY`] was at most a quarter.
const MORE_THAN_SPOTS: f64 = 3.0;

/// Quantisation step, as a multiple of the noise, from which rounding shows in the residual.
const COARSE: f64 = 0.3;

/// How the squared mismatch after calibration is divided.
pub(crate) struct Balance {
    pub(crate) noise_n: f64,
    /// RMS of the unexplained part, N.
    pub(crate) unexplained_n: f64,
    /// Shares of the squared mismatch.
    pub(crate) unexplained: f64,
    pub(crate) unsteady: Option<f64>,
    pub(crate) p_steady: f64,
    pub(crate) rounding: Option<f64>,
    pub(crate) clipped: Option<f64>,
    pub(crate) spots: Option<f64>,
    pub(crate) speed: Option<f64>,
    pub(crate) heard: Option<f64>,
    pub(crate) play: Option<f64>,
}

impl Balance {
    /// What comes and goes, and what rounding adds, is followed by no curve: both are part of the noise estimate until
    /// separated here.
    pub(crate) fn of(
        simulation: &Simulation,
        side: &Side<'_>,
        found: &Found<'_>,
        Aside { spots, speed, heard, play }: &Aside<'_>,
        proof: &Proof,
    ) -> Self {
        let rows = &found.bench.rows;
        let is_known = |id: Id| {
            simulation.mechanisms.iter().any(|added| added.id == id)
                || found
                    .members
                    .iter()
                    .zip(&found.doubts)
                    .any(|(m, doubt)| doubt.is_none() && m.candidate.source.is(id))
        };
        let (before, after) = (power(rows, &proof.own.calibrated), power(rows, &proof.own.after));
        // curves that cancel in the averages they are fitted to, and not in the rows between, leave more than there is
        let noise = (found.noise_n * found.noise_n).min(after);
        let rounding = found.coarse_step_n.filter(|_| !is_known(Id::ForceQuantisation));
        let rounding = rounding.map(|step_n| rounding_n2(step_n, noise, after));
        let steady = rounding.map_or(0.0, |(_, steady)| steady);
        let rounding = rounding.map(|(in_noise, _)| in_noise);
        let rest = open_set::rest_without_orders(&found.bench, &found.fit, &found.members);
        let groups = without_coarse(side, rows, &proof.own.after);
        let unsteady = open_set::unsteady(&rest, &groups);
        let sounds = transients(&rest, &rows.plain(&proof.own.after), &groups);
        let (p_steady, coherent) = match sounds {
            Some(sounds) if sounds.p < unsteady.p => {
                (least_of([sounds.p, unsteady.p]), sounds.power_n2.min(0.9 * noise))
            }
            _ => (unsteady.p, unsteady.share * noise),
        };
        let squares_n2 = |spots: &Spots| spots.squares_n2 / rows.len().max(1) as f64;
        let is_of_more = |spots: &Spots| found.members.is_empty() && are_peaks(unsteady.p, coherent, squares_n2(spots));
        let spots = spots.filter(|spots| !is_of_more(spots));
        // rounding error depends on the force, and so comes and goes with it
        let rounds = |run: &Run| quantum(&run.drag_force_n).is_some_and(|step| step > COARSE * found.noise_n);
        let heard = heard.filter(|_| !is_known(Id::StructuralResonance));
        // averages have next to nothing of ringing between them
        let (heard, between) = match heard {
            Some(heard) if heard.is_averaged_out => (None, Some(heard.power_n2)),
            heard => (heard.map(|heard| heard.power_n2.min(0.9 * noise)), None),
        };
        // a structure that is struck by more than is known rings on where its form has it silent
        let rings = is_known(Id::StructuralResonance) || heard.is_some() || between.is_some();
        let is_smooth = spots.is_none() && !rings && !side.runs.iter().any(rounds);
        let is_worth_it = |power: f64| power > UNSTEADY_SHARE * (before - noise + power);
        // the speed that replaces a discarded one leaves some of its noise
        let discarded_n2 = speed.map_or(0.0, |speed| speed.power_n2);
        let is_relevant = |power: f64| power.sqrt() > found.irrelevant_n && power > LEAST_SHARE * discarded_n2;
        let is_unsteady = is_smooth
            && p_steady < UNSTEADY
            && coherent > UNSTEADY_OF_NOISE * noise
            && is_relevant(coherent)
            && is_worth_it(coherent);
        // beside a named cause, the remainder of its form may stand out
        let is_bare = is_smooth && found.members.is_empty() && play.is_none();
        let bursts = if is_bare { bursts(side, &proof.own.calibrated) } else { None };
        let bursts = bursts.map(|bursts| (bursts.p, bursts.power_n2.min(0.9 * noise)));
        let (is_unsteady, p_steady, coherent) = match bursts {
            Some((p, power)) if is_relevant(power) => (true, p.min(p_steady), coherent.max(power)),
            _ => (is_unsteady, p_steady, coherent),
        };
        let is_clipped = side.limit_n.is_some() && !is_known(Id::ForceSaturation);
        let clipped = is_clipped.then(|| {
            let of = proof.own.calibrated.iter().zip(&side.clipped).filter(|(x, clipped)| **clipped && x.is_finite());
            of.map(|(x, _)| x * x).sum::<f64>() / rows.len().max(1) as f64
        });
        let in_noise = if is_unsteady { coherent } else { heard.or(rounding).unwrap_or(0.0) };
        let noise = noise - in_noise;
        let spots = spots.map(squares_n2);
        // rows not compared, and a discarded speed, still have their part in the mismatch
        let speed = speed.map(|speed| speed.power_n2);
        let play = play.map(|play| play.squares_n2 / rows.len().max(1) as f64);
        let aside: f64 = [clipped, spots, speed, play, between].into_iter().flatten().sum();
        let mismatch = (before - noise).max(1e-3 * before) + aside;
        let share = |power: f64| (power / mismatch).clamp(0.0, 1.0);
        // the form of another cause may leave a few spots; play, whose rows have no spots, leaves none
        let but_for_play = mismatch - play.unwrap_or(0.0);
        let least_of_spots = if found.members.is_empty() { LEAST_SHARE } else { LEAST_SHARE_OF_SMALL };
        let mut balance = Balance {
            noise_n: noise.sqrt(),
            unexplained_n: (after - noise - steady).max(0.0).sqrt(),
            unexplained: (share(after - noise) - share(in_noise) - share(steady)).max(0.0),
            unsteady: is_unsteady.then(|| share(in_noise)),
            p_steady: if is_unsteady { p_steady } else { 1.0 },
            rounding: rounding.map(|in_noise| share(in_noise + steady)),
            clipped: clipped.map(share),
            spots: spots.filter(|power| power / but_for_play > least_of_spots).map(share),
            speed: speed.map(share),
            heard: heard.or(between).map(share),
            play: play.map(share),
        };
        if found.members.is_empty() {
            balance.unexplained = (1.0 - balance.beside_fits()).max(0.0);
        }
        balance
    }

    /// Share of everything found without a fit.
    fn beside_fits(&self) -> f64 {
        let Balance { unsteady, rounding, clipped, spots, speed, heard, play, .. } = self;
        [unsteady, rounding, clipped, spots, speed, heard, play].into_iter().copied().flatten().sum()
    }

    /// Share of the fitted causes.
    pub(crate) fn explained(&self) -> f64 {
        (1.0 - self.unexplained - self.beside_fits()).max(0.0)
    }
}

/// Whether spots of this mean square, N², are the peaks of something of a larger one that comes and goes.
fn are_peaks(p_steady: f64, coherent_n2: f64, spots_n2: f64) -> bool {
    p_steady < UNSTEADY && coherent_n2 > MORE_THAN_SPOTS * spots_n2
}

/// Squared error of rounding to a step, N²: what of it counts as noise, and the rest of what is left `after` all that was
/// found. Where a part stays on one step, the error is the same throughout and no noise.
///
/// ```text
/// step²/12 = in the noise (at most nine tenths of that) + steady
/// ```
fn rounding_n2(step_n: f64, noise_n2: f64, after_n2: f64) -> (f64, f64) {
    let all_n2 = step_n * step_n / 12.0;
    let most_n2 = 0.9 * noise_n2;
    (all_n2.min(most_n2), (all_n2 - most_n2).clamp(0.0, (after_n2 - noise_n2).max(0.0)))
}

/// Parts of the profile whose noise dithers the force over the channel's steps. In others the force stays on one step
/// for as long as the law does, and the rounding error comes and goes.
fn without_coarse(side: &Side<'_>, rows: &Rows, left: &[f64]) -> Vec<Range<usize>> {
    let step_n = side.runs.iter().filter_map(|run| quantum(&run.drag_force_n)).fold(0.0, f64::max);
    let left = rows.plain(left);
    rows.groups.iter().filter(|group| robust_sigma(&left[(*group).clone()]) > step_n).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_are_peaks_of_what_comes_and_goes_where_that_is_sure_and_larger() {
        // two cages that jam; dirt of a loud recording; dirt alone
        assert!(are_peaks(2e-74, 0.0487, 0.0013) && are_peaks(1e-74, 0.137, 0.0090));
        assert!(!are_peaks(3e-9, 0.263, 0.0311) && !are_peaks(1e-13, 0.0054, 0.0757));
    }

    #[test]
    fn rounding_beyond_the_noise_is_steady_and_no_more_than_is_left() {
        // noise carries the force over its steps
        let (in_noise, steady) = rounding_n2(0.3, 0.09, 0.1);
        assert!((in_noise - 0.0075).abs() < 1e-12 && steady == 0.0);
        // ten times the noise: all that is left is rounding
        let (in_noise, steady) = rounding_n2(3.0, 0.09, 0.75);
        assert!((in_noise - 0.081).abs() < 1e-12 && (steady - 0.66).abs() < 1e-12, "{in_noise} {steady}");
        assert_eq!(rounding_n2(3.0, 0.09, 0.05).1, 0.0);
    }
}
