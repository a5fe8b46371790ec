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

    /// Keeps a mechanism's candidate, unless it is too large. Where there is no more room, all go.
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use simulation::mechanism::definition;

    use super::*;
    use crate::numbers::linear::Symmetric;

    /// A candidate at one value of its shape; its columns are shared.
    fn at(value: f64, columns: &Arc<Vec<Vec<f32>>>) -> Candidate {
        let source = Source::Mechanism { definition: definition(Id::RunIn), form: 0, shape: vec![value] };
        Candidate {
            source,
            columns: Arc::clone(columns),
            bounds: vec![(0.0, 1.0)],
            own: Symmetric::zeros(1),
            cross: vec![Some(vec![value])],
        }
    }

    #[test]
    fn a_candidate_is_found_again_at_its_own_shape_as_long_as_there_is_room() {
        let columns = Arc::new(vec![vec![1.0; MOST_OF_ONE]]);
        let made = Made::default();
        for value in [1.0, 2.0] {
            made.keep(&at(value, &columns));
        }
        let known = made.get(&at(2.0, &columns).source).expect("it was kept");
        assert_eq!(known.cross, [Some(vec![2.0])]);
        assert!(made.get(&at(3.0, &columns).source).is_none());
        made.keep(&at(3.0, &Arc::new(vec![vec![1.0; MOST_OF_ONE + 1]])));
        assert!(made.get(&at(3.0, &columns).source).is_none(), "too large");
        // all room is taken by 64 of the largest size: one more drops all
        (4..=66).for_each(|value| made.keep(&at(f64::from(value), &columns)));
        assert!(made.get(&at(2.0, &columns).source).is_none());
    }
}
