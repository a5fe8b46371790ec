//! The engine: from runs to a diagnosis.
//!
//! ```text
//! prepared     runs, checked, averaged, joined and smoothed
//! learned      law and noise, learned anew wherever rows are set aside
//! refused      why runs allow no judgement
//! shifts       the search around the law, with its own parameters shifted or not
//! ```

mod learned;
mod prepared;
mod refused;
mod shifts;

use simulation::Simulation;
use simulation::run::Run;

use crate::answer;
use crate::answer::aside::Aside;
use crate::answer::play::Play;
use crate::answer::proof::Split;
use crate::answer::scores;
use crate::answer::unsure::{is_refuted_beside_play, is_unsure, refuted};
use crate::report::{DataQuality, Diagnosis, Holdout, SCHEMA, Unexplained, Verdict};

use learned::{Anew, Learned};
use prepared::Prepared;
pub use refused::Refused;

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
    /// Why there was nothing to compare; `None` where there was.
    pub refused: Option<Refused>,
}

/// Compares runs, in the order of their clocks, with a simulation. `holdout` is only scored, after the search; without
/// it a part of the runs is held out.
pub fn diagnose(runs: &[Run], holdout: &[Run], simulation: &Simulation, options: &Options) -> Outcome {
    let mut quality = DataQuality::default();
    let asked = Asked { runs, holdout, simulation, seed: options.seed };
    match attempt(&asked, &mut quality) {
        Ok(outcome) => outcome,
        Err(refused) => {
            if quality.samples == 0 {
                quality.samples = runs.iter().map(Run::len).sum();
            }
            quality.warnings.push(refused.reason().to_owned());
            Outcome { diagnosis: insufficient(quality), augmented: None, refused: Some(refused) }
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

/// What is asked: runs to search, others to score, and the simulation that both are held against.
struct Asked<'s> {
    runs: &'s [Run],
    holdout: &'s [Run],
    simulation: &'s Simulation,
    seed: u64,
}

impl Asked<'_> {
    /// Rows of these runs that are held out: none where other recordings are scored.
    fn split(&self, runs: &[Run]) -> Split {
        match self.holdout.is_empty() {
            true => Split::of(runs),
            false => Split::none(runs.iter().map(Run::len).sum()),
        }
    }
}

fn attempt(asked: &Asked<'_>, quality: &mut DataQuality) -> Result<Outcome, Refused> {
    let prepared = Prepared::of(asked, quality)?;
    let mut learned = Learned::of(&prepared, prepared.side(quality)?)?;
    let mut spots = learned.spots();
    if let Some(spots) = &spots {
        learned = learned.without(|_, training| spots.set_aside(training), Anew::Law)?;
    }
    let ringing = learned.unmask()?;
    let given = prepared.given(&ringing);
    let mut found = learned.searched(given, 0.0)?;
    let play = learned.play(&found)?;
    let seen_from_m = play.as_ref().map_or(0.0, Play::edge_m);
    if let Some(play) = &play {
        learned = learned.without(|side, training| play.set_aside(side, training), Anew::Law)?;
        found = learned.searched(given, seen_from_m)?;
    }
    if spots.is_none() {
        spots = learned.hidden_spots(&found);
        if let Some(spots) = &spots {
            let left = std::mem::take(&mut found.left);
            learned = learned.without(|_, training| spots.set_aside(training), Anew::Noise(&left))?;
            found = learned.searched(given, seen_from_m)?;
        }
    }
    let aside =
        Aside { spots: spots.as_ref(), speed: prepared.speed, heard: ringing.heard.as_ref(), play: play.as_ref() };
    let case = learned.case(given, seen_from_m);
    let mut proof = scores::score(&case, &learned.held(asked.seed), &found, &aside)?;
    // other recordings have no say in what is kept beside a play, nor in what is named
    let is_own = asked.holdout.is_empty();
    if is_unsure(&found, &aside, &proof) || is_own && is_refuted_beside_play(&found, &aside, &proof) {
        found = found.taken_back(&case, learned.law_only())?;
        proof = scores::score(&case, &learned.held(asked.seed), &found, &aside)?;
    }
    let refuted = if is_own { refuted(&found, &proof) } else { Vec::new() };
    if !refuted.is_empty() {
        found = found.without(&case, &refuted)?;
        proof = scores::score(&case, &learned.held(asked.seed), &found, &aside)?;
    }
    let (diagnosis, augmented) = answer::write(&case, &found, &aside, proof, quality)?;
    Ok(Outcome { diagnosis, augmented: Some(augmented), refused: None })
}
