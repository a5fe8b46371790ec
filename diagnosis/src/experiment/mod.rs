//! The next run: every run of a menu is simulated, and the most informative one for its time is asked for.
//!
//! ```text
//! menu        the runs, their cost, and what they do to a cause
//! scene       stroke, speeds and conditions of the recording
//! separation  how far one explanation can imitate another over both recordings
//! columns     columns of an explanation over a hypothetical run
//! ```
//!
//! A run is worth the smallest separation of any two explanations, in nats, up to what decides. What the recording
//! tells already does not count, nor a share by which two formulations of one cause may differ. Where no run separates
//! them all at a sensible price, it is worth its separation of the first explanation from all those that any run can
//! separate from it, or from as many as one run can. Runs that decide little are not offered.

mod columns;
mod menu;
mod scene;
mod separation;

use simulation::mechanism::Id;

use crate::calibration::prior;
use crate::fit::member::{Candidate, without};
use crate::fit::source::Source;
use crate::nominal::Nominal;
use crate::numbers::linear::Symmetric;
use crate::recording::side::Side;
use crate::report::{Alternative, NextExperiment};
use crate::search::equivalents::{NEAR, text};
use crate::search::found::Found;

use columns::{Parts, of_recording, of_run};
use menu::{Entry, MENU, is_free, left_of, touches};
use scene::Scene;
use separation::{Explanation, nats};

/// Separation that decides, nats: more is worth no more.
const DECIDES: f64 = 20.0;

/// Least expected separation of a run that is offered, nats.
const WORTHLESS: f64 = 3.0;

/// Factor by which separating all explanations may cost more than separating the first from the others.
const DEARER: f64 = 2.0;

/// Most explanations that are compared with each other.
const MOST_RIVALS: usize = 6;

/// Most runs offered beside the first.
const ALTERNATIVES: usize = 3;

/// A run, and the separation it adds to the recording's for every pair of explanations, nats: the first and each of the
/// others, the second and each after it, and so on.
struct Tried {
    entry: &'static Entry,
    pairs: Vec<f64>,
}

/// A run and its expected separation.
struct Offer {
    entry: &'static Entry,
    nats: f64,
}

impl Offer {
    /// The smallest separation of some pairs; `None` where that decides little.
    fn of(tried: &Tried, pairs: &[usize]) -> Option<Self> {
        let nats = pairs.iter().map(|pair| tried.pairs[*pair]).reduce(f64::min)?;
        (nats >= WORTHLESS).then_some(Offer { entry: tried.entry, nats })
    }

    fn worth(&self) -> f64 {
        self.nats.min(DECIDES) / self.entry.minutes
    }
}

fn by_worth(offers: &mut [Offer]) {
    offers.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
}

/// The run that separates the explanations of member `at` at the least time; `None` where none can be simulated or none
/// separates them enough.
pub(crate) fn next(nominal: &Nominal, side: &Side<'_>, found: &Found<'_>, at: usize) -> Option<NextExperiment> {
    let mut rivals: Vec<&Candidate> = Vec::new();
    for candidate in &found.sets[at].candidates {
        if candidate.source.is_story() {
            return None;
        }
        if rivals.len() < MOST_RIVALS && !rivals.iter().any(|other| other.source.id() == candidate.source.id()) {
            rivals.push(candidate);
        }
    }
    let others = without(&found.members, at);
    let parts = Parts::of(found, &others, &rivals);
    if parts.rivals.len() < 2 || !(found.noise_n > 0.0) {
        return None;
    }
    let mut precisions: Vec<f64> = prior(nominal, &found.calibrated).iter().map(|(precision, _)| *precision).collect();
    precisions.resize(parts.common, 0.0);
    let present = gram(&of_recording(found, &others, &parts));
    let complete = nominal.completed(&found.calibrated);
    let scene = Scene::of(&complete, side);
    let ids: Vec<Option<Id>> = parts.sources().map(named).collect();
    let count = parts.rivals.len();
    let already = parted(&present, &precisions, &parts.rivals, 0.0);
    let all: Vec<usize> = (0..count * (count - 1) / 2).collect();
    let (mut tried, mut offers): (Vec<Tried>, Vec<Offer>) = (Vec::new(), Vec::new());
    for entry in MENU.iter().filter(|entry| touches(entry.code, &ids)) {
        // the menu rises in cost: what follows cannot be worth more than this
        if offers.iter().filter(|offer| offer.worth() >= DECIDES / entry.minutes).count() > ALTERNATIVES {
            break;
        }
        let Some(columns) = of_run(entry, &scene, nominal, &complete, found, &parts) else { continue };
        let mut both = present.clone();
        both.accumulate(&gram(&columns), 1.0);
        let pairs = parted(&both, &precisions, &parts.rivals, NEAR)
            .iter()
            .zip(&already)
            .map(|(both, one)| both - one)
            .collect();
        let run = Tried { entry, pairs };
        offers.extend(Offer::of(&run, &all));
        tried.push(run);
    }
    by_worth(&mut offers);
    // the first against those that any run separates from it
    let mut with_first: Vec<usize> = (0..count - 1).collect();
    with_first.retain(|pair| tried.iter().any(|run| run.pairs[*pair] >= WORTHLESS));
    if offers.is_empty() && !tried.iter().any(|run| Offer::of(run, &with_first).is_some()) {
        with_first = most_told(&tried, &with_first);
    }
    let mut of_first: Vec<Offer> = tried.iter().filter_map(|run| Offer::of(run, &with_first)).collect();
    by_worth(&mut of_first);
    let worth = |offers: &[Offer]| offers.first().map_or(0.0, Offer::worth);
    let mut told: Vec<usize> = (0..count).collect();
    if worth(&of_first) > DEARER * worth(&offers) {
        offers = of_first;
        told = std::iter::once(0).chain(with_first.iter().map(|pair| pair + 1)).collect();
    }
    let kept: Vec<&Source> = parts.sources().collect();
    let mut offers = offers.into_iter();
    let first = offers.next()?;
    Some(NextExperiment {
        code: first.entry.code.to_owned(),
        text: said(first.entry.code, &kept),
        expected_nats: Some(first.nats),
        minutes: Some(first.entry.minutes),
        alternatives: offers
            .take(ALTERNATIVES)
            .map(|offer| Alternative {
                code: offer.entry.code.to_owned(),
                text: said(offer.entry.code, &kept),
                expected_nats: offer.nats,
                minutes: offer.entry.minutes,
            })
            .collect(),
        told: told.iter().map(|at| kept[*at].id().to_owned()).collect(),
    })
}

/// The largest set of these pairs that one run separates; of several such runs that of the most worth.
fn most_told(tried: &[Tried], pairs: &[usize]) -> Vec<usize> {
    let told =
        |run: &Tried| -> Vec<usize> { pairs.iter().copied().filter(|pair| run.pairs[*pair] >= WORTHLESS).collect() };
    let worth = |run: &Tried, pairs: &[usize]| Offer::of(run, pairs).map_or(0.0, |offer| offer.worth());
    let best = |best: (Vec<usize>, f64), new: (Vec<usize>, f64)| {
        if (new.0.len(), new.1) > (best.0.len(), best.1) { new } else { best }
    };
    let all = tried.iter().map(|run| (told(run), run)).map(|(pairs, run)| (pairs.clone(), worth(run, &pairs)));
    all.reduce(best).map_or_else(Vec::new, |(pairs, _)| pairs)
}

/// Separation of every pair, the smaller of both directions, less a share `near` of all that the true one explains.
fn parted(gram: &Symmetric, precisions: &[f64], rivals: &[Explanation], near: f64) -> Vec<f64> {
    let none = Explanation { columns: 0..0, slopes: 0..0, amplitudes: Vec::new() };
    let of = |truth: &Explanation, other: &Explanation| nats(gram, precisions, truth, other);
    let spare: Vec<f64> = rivals.iter().map(|truth| near * of(truth, &none)).collect();
    let mut pairs = Vec::new();
    for (i, a) in rivals.iter().enumerate() {
        for (j, b) in rivals.iter().enumerate().skip(i + 1) {
            pairs.push((of(a, b) - spare[i]).min(of(b, a) - spare[j]));
        }
    }
    pairs
}

fn gram(columns: &[Vec<f32>]) -> Symmetric {
    Symmetric::gram(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

fn named(source: &Source) -> Option<Id> {
    match source {
        Source::Mechanism { definition, .. } => Some(definition.id),
        _ => None,
    }
}

/// Instruction, and how to read the outcome where no recording says what was changed.
fn said(code: &str, rivals: &[&Source]) -> String {
    let factor = |source: &Source| match named(source) {
        Some(id) => left_of(code, id, menu::KNOWN_MASS_KG),
        None => f64::from(!is_free(code)),
    };
    let which = |of: &dyn Fn(f64) -> bool| -> String {
        let names: Vec<String> = rivals.iter().filter(|s| of(factor(s))).map(|s| s.id().to_owned()).collect();
        names.join(" or ")
    };
    let (gone, turned, more, stays) =
        (which(&|x| x == 0.0), which(&|x| x < 0.0), which(&|x| x > 1.0), which(&|x| x == 1.0));
    let mut said = text(code).to_owned();
    if is_free(code) {
        if !gone.is_empty() && !stays.is_empty() {
            said.push_str(&format!(
                " If the sensor then reads what it should: {gone}; if it is as far off as before: {stays}."
            ));
        }
        return said;
    }
    for (what, names) in [("is gone", gone), ("changes its sign", turned), ("grows", more)] {
        if !names.is_empty() && !stays.is_empty() {
            said.push_str(&format!(
                " Hold the new recording alone against the simulation: if the difference {what}: {names}; if it is as before: \
                 {stays}."
            ));
        }
    }
    said
}

#[cfg(test)]
mod tests {

    use crate::recording::moving::Moving;
    use simulation::Simulation;
    use simulation::mechanism::Added;
    use simulation::profile::{Conditions, Order, Staircase};
    use simulation::run::{Part, Run};
    use simulation::sensor::Noise;

    use super::*;
    use crate::calibration::{Calibrated, calibrate};
    use crate::noise::rows::Rows;
    use crate::report::DataQuality;
    use crate::search::case::{Case, Given};
    use crate::search::passes;

    /// The cheapest dozen runs of 30 s at 200 Hz, all at one preload.
    fn dozen(simulation: &Simulation) -> Vec<Run> {
        let speeds_m_s = vec![0.01, 0.02, 0.03, 0.05, 0.08];
        let staircase = Staircase { speeds_m_s, order: Order::Both, ..Staircase::default() };
        let conditions = Conditions { preload_n: Some(3000.0), ..Conditions::default() };
        let course = staircase.course(200.0, &conditions).expect("legal");
        let force = simulation.force(&course.run, &course.motion).expect("complete");
        let rows = 0..6000;
        let cut = |column: &Vec<f64>| column[rows.clone()].to_vec();
        let of = |seed| {
            let mut noise = Noise::new(seed, 0);
            Run {
                time_s: cut(&course.run.time_s),
                drag_force_n: cut(&force).iter().map(|force| force + 0.3 * noise.gaussian()).collect(),
                position_m: course.run.position_m.as_ref().map(cut),
                velocity_m_s: course.run.velocity_m_s.as_ref().map(cut),
                preload_n: course.run.preload_n.as_ref().map(cut),
                parts: vec![Part { rows: rows.clone(), ..course.run.parts[0].clone() }],
                ..Run::default()
            }
        };
        (0..12).map(of).collect()
    }

    #[test]
    fn a_dozen_runs_at_one_preload_are_advised_on() {
        let text = "schema = \"guideblock.simulation/1\"\n[guide]\nparameters = \"zhou-2023\"\n[lubricant]\n\
                    viscosity_cst = 100.0\n[operation]\npreload_n = 3000.0\n";
        let simulation = Simulation::from_toml(text).expect("sound");
        let seal = Added { id: Id::SealDrag, form: 0, shape: Vec::new(), amplitudes: vec![3.0] };
        let runs = dozen(&Simulation { mechanisms: vec![seal], ..simulation.clone() });
        let nominal = Nominal::new(&simulation);
        let moving = Moving::as_recorded(&runs);
        let side = Side::new(&simulation, &nominal, &nominal.start(), &moving, false, &mut DataQuality::default())
            .expect("complete");
        let training = side.compared.clone();
        let mut rows = Rows::new(&runs, &training, 1);
        let calibrated = calibrate(&simulation, &nominal, side, &mut rows, &training).expect("sound");
        let given = Given {
            simulation: &simulation,
            nominal: &nominal,
            ringing: Some(&[]),
            heard_n2: 0.0,
            discarded_n2: 0.0,
            edges: None,
            step_n: None,
        };
        let Calibrated { values, side, saturation, .. } = &calibrated;
        let case = Case { given, side, training: &training, saturation, seen_from_m: 0.0 };
        let found = passes::run(&case, rows, values, values, &mut None).expect("ends");
        assert_eq!(found.members.len(), 1);
        assert!(next(&nominal, side, &found, 0).is_some());
    }
}
