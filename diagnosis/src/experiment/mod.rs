//! The next run: every one of a menu is simulated, and the one that tells most for its time is asked for.
//!
//! ```text
//! menu        the runs, what they cost and what they do to a cause
//! scene       what the recording says of stroke, speeds and conditions
//! separation  how far one explanation can follow another over both recordings
//! columns     what an explanation makes of a run that there is not
//! ```
//!
//! A run is worth the smallest separation of any two explanations, in nats; beyond what decides, more is worth no more.
//! Those that decide little are not offered. The rest of the simulation's assumptions is that of the search.

mod columns;
mod menu;
mod scene;
mod separation;

use simulation::mechanism::Id;

use crate::bench::{Candidate, Member, Source};
use crate::calibration::prior;
use crate::equivalents::text;
use crate::finding::id_of;
use crate::linear::{Symmetric, products};
use crate::nominal::Nominal;
use crate::passes::Found;
use crate::report::{Alternative, NextExperiment};
use crate::side::Side;

use columns::{Parts, of_recording, of_run};
use menu::{Entry, MENU, is_free, left_of, touches};
use scene::Scene;
use separation::{Explanation, nats};

/// Separation that settles it, nats: more is worth no more.
const DECIDES: f64 = 20.0;

/// A run that is expected to separate less is not offered, nats.
const WORTHLESS: f64 = 3.0;

/// Explanations that are held against each other.
const MOST_RIVALS: usize = 6;

/// Runs that are offered beside the first.
const ALTERNATIVES: usize = 3;

/// A run and what it is expected to tell.
struct Offer {
    entry: &'static Entry,
    nats: f64,
}

impl Offer {
    fn worth(&self) -> f64 {
        self.nats.min(DECIDES) / self.entry.minutes
    }
}

/// The run that tells the explanations of member `at` apart for the least time; `None` where none can be simulated or
/// none tells enough.
pub(crate) fn next(nominal: &Nominal, side: &Side<'_>, found: &Found<'_>, at: usize) -> Option<NextExperiment> {
    let mut rivals: Vec<&Candidate> = Vec::new();
    for candidate in &found.sets[at].candidates {
        if candidate.source.is_story() {
            return None;
        }
        if rivals.len() < MOST_RIVALS && !rivals.iter().any(|other| id_of(&other.source) == id_of(&candidate.source)) {
            rivals.push(candidate);
        }
    }
    let others: Vec<Member> =
        found.members.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, member)| member.clone()).collect();
    let parts = Parts::of(found, &others, &rivals);
    if parts.rivals.len() < 2 || !(found.noise_n > 0.0) {
        return None;
    }
    let mut precisions: Vec<f64> = prior(nominal, &found.calibrated).iter().map(|(precision, _)| *precision).collect();
    precisions.resize(parts.common, 0.0);
    let present = gram(&of_recording(found, &others, &parts));
    let complete = nominal.completed(&found.calibrated);
    let scene = Scene::of(&complete, side);
    let ids: Vec<Option<Id>> = rivals.iter().map(|candidate| named(&candidate.source)).collect();
    let mut offers: Vec<Offer> = Vec::new();
    for entry in MENU.iter().filter(|entry| touches(entry.code, &ids)) {
        // the menu rises in cost: what follows cannot be worth more than this
        if offers.iter().filter(|offer| offer.worth() >= DECIDES / entry.minutes).count() > ALTERNATIVES {
            break;
        }
        let of_run = of_run(entry, &scene, nominal, &complete, found, &parts);
        let Some(columns) = of_run else { continue };
        let mut both = present.clone();
        both.accumulate(&gram(&columns), 1.0);
        let least = least(&both, &precisions, &parts.rivals);
        if least >= WORTHLESS {
            offers.push(Offer { entry, nats: least });
        }
    }
    offers.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    let mut offers = offers.into_iter();
    let first = offers.next()?;
    let words = |entry: &Entry| said(entry.code, &rivals);
    Some(NextExperiment {
        code: first.entry.code.to_owned(),
        text: words(first.entry),
        expected_nats: Some(first.nats),
        minutes: Some(first.entry.minutes),
        alternatives: offers
            .take(ALTERNATIVES)
            .map(|offer| Alternative {
                code: offer.entry.code.to_owned(),
                text: words(offer.entry),
                expected_nats: offer.nats,
                minutes: offer.entry.minutes,
            })
            .collect(),
    })
}

/// The smallest separation of any two, either way.
fn least(gram: &Symmetric, precisions: &[f64], rivals: &[Explanation]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, truth) in rivals.iter().enumerate() {
        for (_, other) in rivals.iter().enumerate().filter(|(j, _)| *j != i) {
            least = least.min(nats(gram, precisions, truth, other));
        }
    }
    least
}

fn gram(columns: &[Vec<f32>]) -> Symmetric {
    let all: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
    let mut gram = Symmetric::zeros(all.len());
    for (n, product) in products(&all, &all).into_iter().enumerate() {
        gram.set(n / all.len(), n % all.len(), product);
    }
    gram
}

fn named(source: &Source) -> Option<Id> {
    match source {
        Source::Mechanism { definition, .. } => Some(definition.id),
        _ => None,
    }
}

/// What is to be done, and how its outcome reads where no recording says what was changed.
fn said(code: &str, rivals: &[&Candidate]) -> String {
    let factor = |candidate: &&Candidate| match named(&candidate.source) {
        Some(id) => left_of(code, id, menu::KNOWN_MASS_KG),
        None => f64::from(!is_free(code)),
    };
    let which = |of: &dyn Fn(f64) -> bool| -> String {
        let names: Vec<String> = rivals.iter().filter(|c| of(factor(c))).map(|c| id_of(&c.source)).collect();
        names.join(" or ")
    };
    let (gone, turned, more, stays) =
        (which(&|x| x == 0.0), which(&|x| x < 0.0), which(&|x| x > 1.0), which(&|x| x == 1.0));
    let mut said = text(code).to_owned();
    for (what, names) in [("gone", gone), ("of the other sign", turned), ("larger", more)] {
        if !names.is_empty() && !stays.is_empty() {
            said.push_str(&format!(
                " Hold the new recording alone against the simulation: {names} if the difference is {what}, {stays} if it \
                 is as before."
            ));
        }
    }
    said
}
