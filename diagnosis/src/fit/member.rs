//! Candidates: what may explain a mismatch, as columns on the bench; members: those taken up.

use std::sync::Arc;

use crate::fit::least_squares::Fit;
use crate::fit::source::Source;
use crate::numbers::linear::Symmetric;

/// Whitened columns of a source, and their cross products with the base as far as computed.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) source: Source,
    pub(crate) columns: Arc<Vec<Vec<f32>>>,
    pub(super) bounds: Vec<(f64, f64)>,
    pub(super) own: Symmetric,
    pub(super) cross: Vec<Option<Vec<f64>>>,
}

impl Candidate {
    /// Number of parameters: amplitudes and shape.
    pub(crate) fn freedom(&self) -> usize {
        self.columns.len() + self.source.shapes()
    }

    /// Forgets the cross products with the base.
    pub(crate) fn forget(&mut self) {
        self.cross.clear();
    }
}

/// How much a candidate explains beyond a fit.
#[derive(Clone, Debug)]
pub(crate) struct Gain {
    /// Rise of the log likelihood.
    pub(crate) nats: f64,
    /// The same, less the cost of its freedom.
    pub(crate) score: f64,
    pub(crate) amplitudes: Vec<f64>,
}

/// A cause that has been taken up.
#[derive(Clone, Debug)]
pub(crate) struct Member {
    pub(crate) candidate: Candidate,
    /// Indices of its columns in the base.
    pub(crate) base: Vec<usize>,
}

impl Member {
    /// Its amplitudes in a fit, in their own units.
    pub(crate) fn amplitudes(&self, fit: &Fit) -> Vec<f64> {
        self.base.iter().map(|column| fit.value_of(*column)).collect()
    }
}

/// A member and the model without it.
pub(crate) struct Beside {
    pub(crate) others: Vec<Member>,
    /// Fit of the law and the others.
    pub(crate) fit: Fit,
    /// The member's candidate, prepared for that fit, and what it adds to it.
    pub(crate) own: Candidate,
    pub(crate) gain: Gain,
}

/// The candidates of the members.
pub(crate) fn causes(members: &[Member]) -> impl Iterator<Item = &Candidate> {
    members.iter().map(|member| &member.candidate)
}

/// All members but one.
pub(crate) fn without(members: &[Member], at: usize) -> Vec<Member> {
    members.iter().enumerate().filter(|(k, _)| *k != at).map(|(_, member)| member.clone()).collect()
}
