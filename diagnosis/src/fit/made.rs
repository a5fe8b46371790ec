//! Candidates made before, for searches that return to the same shapes.
//!
//! Refinements beside other members start from the same grid and halve the same steps: nine of ten shapes asked for on
//! one bench were asked for before. What is kept is what would be made again, to the same bits.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use simulation::mechanism::Id;

use crate::fit::member::Candidate;
use crate::fit::source::Source;

/// Values kept at most: 128 MB.
const MOST: usize = 32 << 20;

/// Values of a candidate that is kept at most: longer recordings are searched without.
const MOST_OF_ONE: usize = MOST / 64;

/// A form of a mechanism at values of its shape, bit for bit.
type Key = (Id, usize, Vec<u64>);

/// See the module.
#[derive(Debug, Default)]
pub(crate) struct Made(Mutex<Kept>);

#[derive(Debug, Default)]
struct Kept {
    candidates: HashMap<Key, Candidate>,
    values: usize,
}

impl Made {
    /// A candidate as it was last kept.
    pub(crate) fn get(&self, source: &Source) -> Option<Candidate> {
        self.kept().candidates.get(&key(source)?).cloned()
    }

    /// Keeps a mechanism's candidate, unless it is too large. Where there is no more room, those before it go.
    pub(crate) fn keep(&self, candidate: &Candidate) {
        let values: usize = candidate.columns.iter().map(Vec::len).sum();
        let Some(key) = key(&candidate.source).filter(|_| values <= MOST_OF_ONE) else { return };
        let mut kept = self.kept();
        if kept.candidates.insert(key, candidate.clone()).is_none() {
            kept.values += values;
        }
        if kept.values > MOST {
            *kept = Kept::default();
        }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn key(source: &Source) -> Option<Key> {
    let Source::Mechanism { definition, form, shape } = source else { return None };
    Some((definition.id, *form, shape.iter().map(|value| value.to_bits()).collect()))
}
