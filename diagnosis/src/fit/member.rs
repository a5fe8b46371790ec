//! What may explain a mismatch as the bench has it, and what has been taken up.

use crate::fit::least_squares::Fit;
use crate::fit::source::Source;
use crate::numbers::linear::Symmetric;

/// Whitened columns of a source, and their cross products with the base as far as they are known.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) source: Source,
    pub(crate) columns: Vec<Vec<f32>>,
    pub(super) bounds: Vec<(f64, f64)>,
    pub(super) own: Symmetric,
    pub(super) cross: Vec<Option<Vec<f64>>>,
}

impl Candidate {
    /// Numbers that it has.
    pub(crate) fn freedom(&self) -> usize {
        self.columns.len() + self.source.shapes()
    }

    /// Forgets what was known about it and a base.
    pub(crate) fn forget(&mut self) {
        self.cross.clear();
    }
}

/// How much a candidate explains beyond a model.
#[derive(Clone, Debug)]
pub(crate) struct Gain {
    /// Rise of the logarithm of the likelihood.
    pub(crate) nats: f64,
    /// The same, less what its freedom costs.
    pub(crate) score: f64,
    pub(crate) amplitudes: Vec<f64>,
}

/// A cause that has been taken up.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) candidate: Candidate,
    /// Its columns in the base.
    pub(crate) base: Vec<usize>,
}

impl Member {
    /// Its amplitudes in a fit, in their own units.
    pub(crate) fn amplitudes(&self, fit: &Fit) -> Vec<f64> {
        self.base.iter().map(|column| fit.value_of(*column)).collect()
    }
}

/// A member in the place that the others leave it.
pub(crate) struct Beside {
    pub(crate) others: Vec<Member>,
    /// Of the law and the others.
    pub(crate) fit: Fit,
    /// The member's own, prepared for that fit, and what it adds to it.
    pub(crate) own: Candidate,
    pub(crate) gain: Gain,
}

/// What acts.
pub(crate) fn causes(members: &[Member]) -> impl Iterator<Item = &Candidate> {
    members.iter().map(|member| &member.candidate)
}

/// All members but one.
pub(crate) fn without(members: &[Member], at: usize) -> Vec<Member> {
    members.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, member)| member.clone()).collect()
}
