//! The engine: from runs to a diagnosis.

use simulation::Simulation;
use simulation::run::Run;
use simulation::session::joined;

use crate::answer;
use crate::answer::aside::Aside;
use crate::answer::play::Play;
use crate::answer::proof::Split;
use crate::answer::scores;
use crate::beside::events;
use crate::beside::gap::gap;
use crate::beside::ringing;
use crate::beside::speed;
use crate::calibration::{Calibrated, calibrate, unbound};
use crate::fit::edges::Edges;
use crate::fit::ends::Ends;
use crate::fit::rest::power;
use crate::fit::skew::Skew;
use crate::noise::rows::Rows;
use crate::nominal::Nominal;
use crate::numbers::rounding::quantum;
use crate::numbers::statistics::rms;
use crate::recording::condense::{condensed, factor};
use crate::recording::moving::Moving;
use crate::recording::resolution::coarsest;
use crate::recording::sanity;
use crate::recording::side::Side;
use crate::report::{DataQuality, Diagnosis, Holdout, SCHEMA, Unexplained, Verdict};
use crate::search::case::{Case, Given};
use crate::search::found::Found;
use crate::search::law_alone::law_alone;
use crate::search::passes;

/// How to diagnose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Options {
    /// Seed of the bootstrap.
    pub seed: u64,
}

/// A diagnosis, and the simulation augmented by what it found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// The simulation with calibrated parameters and the causes added; `None` where there was nothing to compare.
    pub augmented: Option<Simulation>,
}

/// Compares runs, in the order of their clocks, with a simulation. `holdout` is only scored, after the search; without
/// it a part of the runs is held out.
pub fn diagnose(runs: &[Run], holdout: &[Run], simulation: &Simulation, options: &Options) -> Outcome {
    let mut quality = DataQuality::default();
    match attempt(runs, holdout, simulation, options, &mut quality) {
        Ok(outcome) => outcome,
        Err(reason) => {
            if quality.samples == 0 {
                quality.samples = runs.iter().map(Run::len).sum();
            }
            quality.warnings.push(reason);
            Outcome { diagnosis: insufficient(quality), augmented: None }
        }
    }
}

fn insufficient(quality: DataQuality) -> Diagnosis {
    Diagnosis {
        schema: SCHEMA,
        verdict: Verdict::InsufficientData,
        p_no_mismatch: 1.0,
        noise_floor_n: 0.0,
        holdout: Holdout::default(),
        regions: Vec::new(),
        mechanisms: Vec::new(),
        considered: Vec::new(),
        unexplained: Unexplained::default(),
        next_experiment: None,
        data_quality: quality,
    }
}

fn attempt(
    runs: &[Run],
    holdout: &[Run],
    simulation: &Simulation,
    options: &Options,
    quality: &mut DataQuality,
) -> Result<Outcome, String> {
    if runs.is_empty() {
        return Err("no run to diagnose".to_owned());
    }
    let nominal = Nominal::new(simulation);
    for run in runs {
        if let Some(reason) = sanity::channels(run, quality) {
            return Err(reason);
        }
    }
    let split = |runs: &[Run]| match holdout.is_empty() {
        true => Split::of(runs),
        false => Split::none(runs.iter().map(Run::len).sum()),
    };
    let moved_kg = simulation.axis.moved_mass_kg.unwrap_or(0.0);
    let ends = Ends::of(runs, &split(runs).held, moved_kg);
    let edges = ends.as_ref().and_then(Edges::of);
    quality.warnings.extend(ends.as_ref().and_then(Skew::of).map(|skew| skew.said()));
    let together = factor(runs);
    let (fewer, fewer_held) = (shorter(runs, together), shorter(holdout, together));
    let runs = fewer.as_deref().unwrap_or(runs);
    let split = split(runs);
    let holdout = fewer_held.as_deref().unwrap_or(holdout);
    let recorded = Moving::as_recorded(runs);
    for (run, motion) in runs.iter().zip(&recorded.motions) {
        if let Some(reason) = sanity::moves(run, motion, quality) {
            return Err(reason);
        }
    }
    // only now, since hold-out and faults are decided on the recordings as given
    let session = joined(simulation, runs);
    let recorded = session.as_deref().map_or(recorded, Moving::as_recorded);
    let runs = &*recorded.runs;
    let speed = speed::set_aside(simulation, &nominal, &recorded);
    let (bare, bare_held);
    let (moving, holdout) = match &speed {
        Some(speed) => {
            quality.warnings.push(speed.said());
            (bare, bare_held) = (speed::without(runs), speed::without(holdout));
            (Moving::as_recorded(&bare), bare_held.as_slice())
        }
        None => (recorded, holdout),
    };
    let is_noisy = speed::is_noisy(&moving.runs);
    let moving = moving.calmed(!is_noisy);
    let runs = &*moving.runs;
    let coarsest = coarsest(&nominal, runs, &moving.motions);
    // averages have no fast acceleration, and the one derived from a noisy speed is a cause of its own
    let nominal = if is_noisy || coarsest > 1 { nominal.of_law() } else { nominal };
    let side = Side::new(simulation, &nominal, &nominal.start(), &moving, together > 1, quality)?;
    quality.count_averages(together);
    if !nominal.is_incomplete() {
        let compared = |column: &[f64]| -> Vec<f64> {
            column.iter().zip(&side.compared).filter(|(_, compared)| **compared).map(|(x, _)| *x).collect()
        };
        let simulated = side.force(&nominal, &nominal.start())?;
        sanity::scale(rms(&compared(&side.drag_n)), rms(&compared(&simulated)), quality);
    }
    if quality.used < sanity::FEWEST_ROWS {
        return Err(format!(
            "{} of {} rows can be compared; at least {} are needed: the carriage hardly moves, or the law lacks an input",
            quality.used,
            quality.samples,
            sanity::FEWEST_ROWS
        ));
    }
    let training: Vec<bool> = side.compared.iter().zip(&split.held).map(|(c, held)| *c && !held).collect();
    let mut rows = Rows::new(runs, &training, coarsest);
    if rows.len() < sanity::FEWEST_ROWS {
        return Err(format!("only {} rows are left beside those set aside", rows.len()));
    }
    let mut calibrated = calibrate(simulation, &nominal, side, &mut rows, &training)?;
    let mut training = training;
    let mut spots = events::spots(&calibrated.side, &rows, &training, &calibrated.left);
    if let Some(spots) = &spots {
        spots.set_aside(&mut training);
        rows = Rows::new(runs, &training, coarsest);
        calibrated = calibrate(simulation, &nominal, calibrated.side, &mut rows, &training)?;
    }
    let ringing = ringing::unmask(&nominal, &calibrated, &training, &mut rows)?;
    let Calibrated { values: mut law_only, mut side, mut saturation, .. } = calibrated;
    // where a recorded speed was discarded, changes of the remaining one are no acceleration to excite a resonance
    let pointed = (!is_noisy && speed.is_none()).then_some(ringing.pointed.as_slice());
    let step_n = runs.iter().filter_map(|run| quantum(&run.drag_force_n)).max_by(f64::total_cmp);
    let nominal = &nominal;
    let given = Given { simulation, nominal, ringing: pointed, edges, step_n };
    let case = Case { given, side: &side, training: &training, saturation: &saturation, seen_from_m: 0.0 };
    let mut found = searched(&case, &rows, &law_only)?;
    let mut play = Play::of(nominal, &side, &training, &found);
    if play.is_none() && !side.is_averaged && coarsest == 1 {
        let gap = gap(&side, &side.force(nominal, &law_only)?, &split.held);
        play = gap.map(|gap| Play::shown(&side, &gap, &split.held));
    }
    let seen_from_m = play.as_ref().map_or(0.0, Play::edge_m);
    if let Some(play) = &play {
        play.set_aside(&side, &mut training);
        rows = Rows::new(runs, &training, coarsest);
        Calibrated { values: law_only, side, saturation, .. } =
            calibrate(simulation, nominal, side, &mut rows, &training)?;
        let case = Case { given, side: &side, training: &training, saturation: &saturation, seen_from_m };
        found = searched(&case, &rows, &law_only)?;
    }
    if spots.is_none() && !found.members.is_empty() {
        // the causes found may have hidden spots
        let left = std::mem::take(&mut found.left);
        rows.learn(&left, saturation.kept());
        spots = events::spots(&side, &rows, &training, &left);
        match &spots {
            None => found.left = left,
            Some(spots) => {
                spots.set_aside(&mut training);
                rows = Rows::new(runs, &training, coarsest);
                rows.learn(&left, saturation.kept());
                let case = Case { given, side: &side, training: &training, saturation: &saturation, seen_from_m };
                found = searched(&case, &rows, &law_only)?;
            }
        }
    }
    let aside = Aside { spots: spots.as_ref(), speed, heard: ringing.heard.as_ref(), play: play.as_ref() };
    let proof =
        scores::score(simulation, nominal, &side, holdout, &split, coarsest, &law_only, &found, &aside, options.seed)?;
    let (diagnosis, augmented) = answer::write(simulation, nominal, &side, &training, &found, &aside, proof, quality)?;
    Ok(Outcome { diagnosis, augmented: Some(augmented) })
}

/// Largest share of the squared mismatch beyond its tolerance that a law with shifted parameters may leave: a quarter
/// of the power is half of the amplitude, and a law that follows less than half of the mismatch does not follow it.
const MOST_LEFT: f64 = 0.25;

/// The same for a law that cannot be the whole explanation whatever its parameters: no search starts there.
const FAR_TOO_MUCH: f64 = 2.0 * MOST_LEFT;

/// Searches around the law with its parameters where calibration left them.
fn searched<'s>(case: &Case<'s>, rows: &Rows, law_only: &[f64]) -> Result<Found<'s>, String> {
    let start = unbound(case.given.nominal, case.side, rows, case.training, law_only)?;
    let mut kept = None;
    if start == law_only {
        return passes::run(case, rows.clone(), law_only, law_only, &mut kept);
    }
    // shifted parameters are accepted only if nothing else is needed; otherwise they have imitated a missing cause
    let of_law_n2 = |values: &[f64]| Ok::<f64, String>(power(rows, &case.side.residual(case.given.nominal, values)?));
    let within_n2 = of_law_n2(law_only)?;
    let leaves =
        |share: f64, left_n2: f64, noise_n: f64| left_n2 - noise_n.powi(2) >= share * (within_n2 - noise_n.powi(2));
    let is_it = |found: &Found<'_>| Ok::<bool, String>(!leaves(MOST_LEFT, found.left_n(case)?.powi(2), found.noise_n));
    if !leaves(FAR_TOO_MUCH, of_law_n2(&start)?, case.noise_n(rows, &start)?) {
        let found = passes::run(case, rows.clone(), &start, law_only, &mut kept)?;
        if found.is_shift_only() && is_it(&found)? {
            if found.members.len() == 1 {
                return Ok(found);
            }
            let alone = law_alone(case, rows, &start, law_only, &mut kept)?;
            return Ok(alone.unwrap_or(found));
        }
    }
    let within = passes::run(case, rows.clone(), law_only, law_only, &mut kept)?;
    if !within.members.is_empty() && !within.is_shift_only() {
        return Ok(within);
    }
    match law_alone(case, rows, &start, law_only, &mut kept)? {
        Some(alone) if is_it(&alone)? => Ok(alone),
        _ => Ok(within),
    }
}

/// Averages of so many rows each; `None` where rows stay as they are.
fn shorter(runs: &[Run], together: usize) -> Option<Vec<Run>> {
    (together > 1).then(|| runs.iter().map(|run| condensed(run, together)).collect())
}
