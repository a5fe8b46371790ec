//! The bench: the mismatch and everything that may explain it as whitened columns, and every fit as algebra on their
//! inner products.
//!
//! A column is made once, whitened once and kept. Cross products are made when a fit first needs them. The base holds
//! the mismatch (column 0), the tangent of the law and the columns of whatever has been taken up.

use simulation::mechanism::{Added, Context, Definition, Sign};

use crate::linear::{Cholesky, Symmetric, dot, dot32};
use crate::locks::{Locks, locks};
use crate::rows::{Gram, Rows};
use crate::story::Curve;

/// Where a set of columns comes from.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    /// A form of a mechanism, at values of its shape parameters.
    Mechanism { definition: &'static Definition, form: usize, shape: Vec<f64> },
    /// A parameter of the law, free of its tolerance.
    Shift { parameter: usize },
    /// A curve without a story.
    Story { curve: Curve },
}

impl Source {
    /// Whether both stand for the same cause.
    pub(crate) fn is_kin(&self, other: &Self) -> bool {
        match (self, other) {
            (Source::Mechanism { definition: a, .. }, Source::Mechanism { definition: b, .. }) => a.id == b.id,
            (Source::Shift { parameter: a }, Source::Shift { parameter: b }) => a == b,
            (Source::Story { curve: a }, Source::Story { curve: b }) => a.axis == b.axis && a.carrier == b.carrier,
            _ => false,
        }
    }

    pub(crate) fn is_story(&self) -> bool {
        matches!(self, Source::Story { .. })
    }

    /// Number of shape parameters.
    pub(crate) fn shapes(&self) -> usize {
        match self {
            Source::Mechanism { shape, .. } => shape.len(),
            _ => 0,
        }
    }

    fn signs(&self, amplitudes: usize) -> Vec<i8> {
        match self {
            Source::Mechanism { definition, form, .. } => definition.forms[*form]
                .amplitudes
                .iter()
                .map(|amplitude| match amplitude.sign {
                    Sign::Positive => 1,
                    Sign::Negative => -1,
                    Sign::Free => 0,
                })
                .collect(),
            _ => vec![0; amplitudes],
        }
    }
}

/// Whitened columns of a source, and their cross products with the base as far as they are known.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) source: Source,
    pub(crate) columns: Vec<Vec<f32>>,
    signs: Vec<i8>,
    own: Symmetric,
    cross: Vec<Option<Vec<f64>>>,
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

/// A fit of the base.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) active: Vec<usize>,
    pub(crate) values: Vec<f64>,
    /// Squared mismatch that is left, with the price of moved parameters.
    pub(crate) rss: f64,
    factor: Cholesky,
    forward: Vec<f64>,
}

impl Fit {
    pub(crate) fn variances(&self) -> Vec<f64> {
        self.factor.variances()
    }

    pub(crate) fn value_of(&self, column: usize) -> f64 {
        self.active.iter().position(|a| *a == column).map_or(0.0, |at| self.values[at])
    }
}

/// See the module.
pub(crate) struct Bench<'a> {
    pub(crate) rows: Rows,
    pub(crate) contexts: &'a [Context<'a>],
    /// Rows that are compared, of all runs laid end to end.
    pub(crate) compared: Vec<bool>,
    pub(crate) base: Vec<Vec<f32>>,
    products: Symmetric,
    /// Precision and pull of the tangent's columns.
    prior: Vec<(f64, f64)>,
    pub(crate) tangent: Vec<Vec<f64>>,
    /// Whitened square of the largest force that a cause may have: one that is larger than all that was measured only
    /// cancels against others.
    pub(crate) largest: f64,
}

impl<'a> Bench<'a> {
    /// `mismatch` and `tangent` over the rows of all runs; `prior` of the tangent.
    pub(crate) fn new(
        rows: Rows,
        contexts: &'a [Context<'a>],
        compared: Vec<bool>,
        mismatch: &[f64],
        tangent: Vec<Vec<f64>>,
        prior: Vec<(f64, f64)>,
    ) -> Self {
        let mut bench = Bench {
            rows,
            contexts,
            compared,
            base: Vec::new(),
            products: Symmetric::zeros(0),
            prior,
            tangent: Vec::new(),
            largest: f64::INFINITY,
        };
        let white = bench.rows.white(mismatch);
        bench.push(white);
        for column in &tangent {
            let white = bench.rows.white(column);
            bench.push(white);
        }
        bench.tangent = tangent;
        bench
    }

    /// Adds a whitened column to the base.
    fn push(&mut self, column: Vec<f32>) -> usize {
        let index = self.base.len();
        let mut grown = Symmetric::zeros(index + 1);
        for i in 0..index {
            for j in 0..=i {
                grown.set(i, j, self.products.get(i, j));
            }
        }
        for (i, other) in self.base.iter().enumerate() {
            grown.set(i, index, dot32(other, &column));
        }
        grown.set(index, index, dot32(&column, &column));
        self.products = grown;
        self.base.push(column);
        index
    }

    /// The law's own columns.
    pub(crate) fn law(&self) -> Vec<usize> {
        (1..=self.prior.len()).collect()
    }

    fn prior_of(&self, column: usize) -> (f64, f64) {
        self.prior.get(column - 1).copied().unwrap_or((0.0, 0.0))
    }

    pub(crate) fn fit(&self, active: &[usize]) -> Fit {
        let mut a = self.products.part(active);
        let mut b: Vec<f64> = active.iter().map(|i| self.products.get(0, *i)).collect();
        for (k, column) in active.iter().enumerate() {
            let (precision, pull) = self.prior_of(*column);
            a.add(k, k, precision);
            b[k] += pull;
        }
        let factor = Cholesky::of(&a);
        let forward = factor.forward(&b);
        let constant: f64 = active
            .iter()
            .map(|column| self.prior_of(*column))
            .map(|(precision, pull)| if precision > 0.0 { pull * pull / precision } else { 0.0 })
            .sum();
        Fit {
            active: active.to_vec(),
            values: factor.solve(&b),
            rss: self.products.get(0, 0) + constant - dot(&forward, &forward),
            factor,
            forward,
        }
    }

    /// What a fit leaves, whitened.
    pub(crate) fn rest(&self, fit: &Fit) -> Vec<f32> {
        let mut rest = self.base[0].clone();
        for (column, value) in fit.active.iter().zip(&fit.values) {
            for (rest, x) in rest.iter_mut().zip(&self.base[*column]) {
                *rest -= *value as f32 * x;
            }
        }
        rest
    }

    /// Columns that are active with these members.
    pub(crate) fn active(&self, members: &[Member]) -> Vec<usize> {
        let mut active = self.law();
        active.extend(members.iter().flat_map(|member| member.base.iter().copied()));
        active
    }

    /// Columns of a source over the rows of all runs; `None` where no run shows it.
    pub(crate) fn raw(&self, source: &Source) -> Option<Vec<Vec<f64>>> {
        if let Source::Shift { parameter } = source {
            return Some(vec![self.tangent[*parameter].clone()]);
        }
        raw_columns(source, self.contexts)
    }

    /// Whitens a source.
    pub(crate) fn candidate(&self, source: Source) -> Option<Candidate> {
        let columns: Vec<Vec<f32>> = match &source {
            Source::Shift { parameter } => vec![self.base[parameter + 1].clone()],
            _ => self.raw(&source)?.iter().map(|column| self.rows.white(column)).collect(),
        };
        let mut own = Symmetric::zeros(columns.len());
        for i in 0..columns.len() {
            for j in 0..=i {
                own.set(i, j, dot32(&columns[i], &columns[j]));
            }
        }
        if (0..columns.len()).all(|i| !(own.get(i, i) > 1e-12))
            || (0..columns.len()).any(|i| !own.get(i, i).is_finite())
        {
            return None;
        }
        let signs = source.signs(columns.len());
        Some(Candidate { source, columns, signs, own, cross: Vec::new() })
    }

    /// Makes the cross products with these columns of the base.
    pub(crate) fn prepare(&self, candidate: &mut Candidate, active: &[usize]) {
        candidate.cross.resize(self.base.len(), None);
        for column in active.iter().copied().chain([0]) {
            if candidate.cross[column].is_none() {
                let products = candidate.columns.iter().map(|z| dot32(&self.base[column], z)).collect();
                candidate.cross[column] = Some(products);
            }
        }
    }

    /// What the candidate adds to a fit, for which it must be prepared.
    pub(crate) fn gain(&self, candidate: &Candidate, fit: &Fit) -> Gain {
        let count = candidate.columns.len();
        let cross = |column: usize, k: usize| {
            candidate.cross.get(column).and_then(Option::as_ref).map_or(0.0, |products| products[k])
        };
        let mut left = Symmetric::zeros(count);
        let (mut right, mut imitated) = (vec![0.0; count], Vec::with_capacity(count));
        for k in 0..count {
            let along: Vec<f64> = fit.active.iter().map(|column| cross(*column, k)).collect();
            let forward = fit.factor.forward(&along);
            right[k] = cross(0, k) - dot(&forward, &fit.forward);
            imitated.push(forward);
        }
        for i in 0..count {
            for j in 0..=i {
                let mut rest = candidate.own.get(i, j) - dot(&imitated[i], &imitated[j]);
                // what the model explains to within rounding explains nothing itself
                if i == j && rest < 1e-6 * candidate.own.get(i, i) {
                    rest = 0.0;
                }
                left.set(i, j, rest);
            }
        }
        let (nats, amplitudes) = signed(&left, &right, &candidate.signs);
        let own: f64 = (0..count)
            .map(|i| amplitudes[i] * (0..count).map(|j| candidate.own.get(i, j) * amplitudes[j]).sum::<f64>())
            .sum();
        if own > self.largest {
            return Gain { nats: 0.0, score: f64::NEG_INFINITY, amplitudes: vec![0.0; count] };
        }
        let used = amplitudes.iter().filter(|x| **x != 0.0).count().max(1);
        let freedom = used + candidate.source.shapes();
        Gain { nats, score: nats - 0.5 * freedom as f64 * self.ln_rows(), amplitudes }
    }

    pub(crate) fn ln_rows(&self) -> f64 {
        (self.rows.len().max(2) as f64).ln()
    }

    /// Takes a candidate up.
    pub(crate) fn take(&mut self, candidate: Candidate) -> Member {
        let base = candidate.columns.iter().map(|column| self.push(column.clone())).collect();
        Member { candidate, base }
    }

    /// Both tests of a candidate against the members.
    pub(crate) fn locks(&self, candidate: &Candidate, gain: &Gain, members: &[Member]) -> Locks {
        let active = self.active(members);
        let mut columns: Vec<&[f32]> = vec![&self.base[0]];
        columns.extend(active.iter().map(|column| self.base[*column].as_slice()));
        let known = columns.len();
        columns.extend(
            candidate
                .columns
                .iter()
                .zip(&gain.amplitudes)
                .filter(|(_, x)| **x != 0.0)
                .map(|(column, _)| column.as_slice()),
        );
        // three standard deviations are free: an effect must show beside parameters that use them up
        let free = |(precision, pull)| (precision / 9.0, pull / 9.0);
        let mut prior: Vec<(f64, f64)> = active.iter().map(|column| free(self.prior_of(*column))).collect();
        prior.resize(columns.len() - 1, (0.0, 0.0));
        locks(&Gram::of(&columns, &self.rows.blocks), known, &prior)
    }
}

/// Columns of a mechanism or a curve over the rows of these runs, laid end to end.
pub(crate) fn raw_columns(source: &Source, contexts: &[Context<'_>]) -> Option<Vec<Vec<f64>>> {
    let count = match source {
        Source::Mechanism { definition, form, .. } => definition.forms[*form].amplitudes.len(),
        Source::Shift { .. } => return None,
        Source::Story { curve } => curve.columns(contexts.first()?).len(),
    };
    let mut columns = vec![Vec::new(); count];
    let mut shown = false;
    for context in contexts {
        let own = match source {
            Source::Mechanism { definition, form, shape } => (definition.forms[*form].columns)(context, shape),
            Source::Story { curve } => Some(curve.columns(context)),
            Source::Shift { .. } => None,
        };
        shown |= own.is_some();
        let rows = context.run.len();
        for (k, column) in columns.iter_mut().enumerate() {
            match own.as_ref().and_then(|own| own.get(k)) {
                Some(own) if own.len() == rows => {
                    column.extend(own.iter().map(|x| if x.is_finite() { *x } else { 0.0 }))
                }
                _ => column.resize(column.len() + rows, 0.0),
            }
        }
    }
    shown.then_some(columns)
}

/// Least squares under signs: what pulls the wrong way is left out, the worst first.
fn signed(left: &Symmetric, right: &[f64], signs: &[i8]) -> (f64, Vec<f64>) {
    let mut which: Vec<usize> = (0..right.len()).filter(|k| left.get(*k, *k) > 0.0).collect();
    loop {
        let b: Vec<f64> = which.iter().map(|k| right[*k]).collect();
        let factor = Cholesky::of(&left.part(&which));
        let x = factor.solve(&b);
        let against = |at: usize| x[at] * f64::from(signs.get(which[at]).copied().unwrap_or(0));
        let worst = (0..which.len()).filter(|at| against(*at) < 0.0).min_by(|a, b| against(*a).total_cmp(&against(*b)));
        match worst {
            Some(at) => {
                which.remove(at);
            }
            None => {
                let mut amplitudes = vec![0.0; right.len()];
                for (k, x) in which.iter().zip(&x) {
                    amplitudes[*k] = *x;
                }
                return (0.5 * dot(&b, &x).max(0.0), amplitudes);
            }
        }
    }
}

/// An entry of an augmented simulation.
pub(crate) fn added(source: &Source, amplitudes: &[f64]) -> Option<Added> {
    match source {
        Source::Mechanism { definition, form, shape } => {
            Some(Added { id: definition.id, form: *form, shape: shape.clone(), amplitudes: amplitudes.to_vec() })
        }
        _ => None,
    }
}
