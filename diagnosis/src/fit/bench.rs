//! The bench: the mismatch and everything that may explain it as whitened columns; every fit is algebra on their inner
//! products.
//!
//! A column is made once, whitened once and kept. Cross products are computed when a fit first needs them. The base
//! holds the mismatch (column 0), the tangent of the law and the columns of the causes taken up.

use std::sync::Arc;

use rayon::prelude::*;
use simulation::mechanism::Context;

use crate::fit::bend;
use crate::fit::edges::Edges;
use crate::fit::least_squares::{Fit, Left, bounded};
use crate::fit::made::Made;
use crate::fit::member::{Beside, Candidate, Gain, Member, without};
use crate::fit::source::{Source, raw_columns, weighted};
use crate::fit::told::Told;
use crate::noise::locks::{Locks, locks};
use crate::noise::rows::{Gram, Rows};
use crate::numbers::linear::{Cholesky, Symmetric, dot, products};

/// Share of the evidence that every parameter of a form must earn beyond what chance gives: a form is an idealisation,
/// and a longer one that follows the truth a little closer is no better a name.
const EARNED: f64 = 2e-3;

/// Share of a column's square that rounding and whitening leave of a column that is fully explained; the second, of a
/// column that is in the base twice.
const ROUNDING: f64 = 1e-6;
const ROUNDING_OF_SHIFT: f64 = 1e-11;

/// Weight with which a law parameter is held at an end of its range, as a multiple of its column's square.
const HOLD: f64 = 1e6;

/// Difference of a squared correlation from 1 below which two columns are one: single precision resolves no more.
const TWINS: f64 = 1e-5;

/// Columns whitened at once, and sources whose columns one thread makes.
const AT_ONCE: usize = 8;

/// Candidates multiplied at once.
const TOGETHER: usize = 128;

/// See the module.
pub(crate) struct Bench<'a> {
    pub(crate) rows: Rows,
    pub(crate) contexts: &'a [Context<'a>],
    /// Rows that are compared, all runs concatenated.
    pub(crate) compared: Vec<bool>,
    pub(crate) base: Vec<Vec<f32>>,
    products: Symmetric,
    /// Precision, and precision times mean ("pull"), of the prior of the tangent's columns.
    prior: Vec<(f64, f64)>,
    /// Prior precision of the columns of unnamed curves.
    nameless: Vec<(usize, f64)>,
    /// Least and largest step of the law's parameters, where they have a range that no tolerance keeps them in.
    room: Vec<(f64, f64)>,
    pub(crate) tangent: Vec<Vec<f64>>,
    /// Largest whitened square of a cause's force: a force larger than all that was measured and all that is missing
    /// only cancels against others. Both count, since a force that turns late is missing at every turn, with twice its
    /// size.
    pub(crate) largest: f64,
    /// Whether the zero of the positions holds for this recording only: a table over them would say nothing of the next
    /// one.
    pub(crate) is_relative: bool,
    /// Time between two rows, s.
    pub(crate) step_s: f64,
    /// Travel since the last reversal of the force from which on rows are compared, m.
    pub(crate) seen_from_m: f64,
    /// What starts and stops tell of the delay between motion and force.
    pub(crate) edges: Option<Edges>,
    told: Told,
    made: Made,
    /// Mechanisms taken up, and their columns in the base.
    taken: Vec<(Source, Vec<usize>)>,
}

impl<'a> Bench<'a> {
    /// `mismatch` and `tangent`: one entry per row of all runs; `prior`: of the tangent.
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
            nameless: Vec::new(),
            room: Vec::new(),
            tangent: Vec::new(),
            largest: f64::INFINITY,
            is_relative: false,
            seen_from_m: 0.0,
            edges: None,
            step_s: contexts.iter().map(|c| c.run.step_s()).find(|step| *step > 0.0).unwrap_or(1.0),
            told: Told::of(contexts),
            made: Made::default(),
            taken: Vec::new(),
        };
        let raw: Vec<&[f64]> = std::iter::once(mismatch).chain(tangent.iter().map(Vec::as_slice)).collect();
        bench.push(bench.rows.white_all(&raw));
        bench.tangent = tangent;
        bench
    }

    /// The same, with limits to the steps of the law's parameters.
    pub(crate) fn within(mut self, room: Vec<(f64, f64)>) -> Self {
        if room.iter().any(|(least, most)| least.is_finite() || most.is_finite()) {
            self.room = room;
        }
        self
    }

    /// Adds whitened columns to the base; returns their indices.
    fn push(&mut self, columns: Vec<Vec<f32>>) -> Vec<usize> {
        let first = self.base.len();
        self.base.extend(columns);
        let all: Vec<&[f32]> = self.base.iter().map(Vec::as_slice).collect();
        let mut grown = Symmetric::zeros(all.len());
        for i in 0..first {
            for j in 0..=i {
                grown.set(i, j, self.products.get(i, j));
            }
        }
        for (n, product) in products(&all[first..], &all).into_iter().enumerate() {
            grown.set(first + n / all.len(), n % all.len(), product);
        }
        self.products = grown;
        (first..self.base.len()).collect()
    }

    /// The law's own columns.
    pub(crate) fn law(&self) -> Vec<usize> {
        (1..=self.prior.len()).collect()
    }

    fn prior_of(&self, column: usize) -> (f64, f64) {
        let of_law = self.prior.get(column - 1).copied();
        of_law
            .or_else(|| self.nameless.iter().find(|(of, _)| *of == column).map(|(_, precision)| (*precision, 0.0)))
            .unwrap_or((0.0, 0.0))
    }

    pub(crate) fn fit(&self, active: &[usize]) -> Fit {
        self.fit_holding(active, Vec::new())
    }

    /// The same, with some of the law's parameters held at a step.
    fn fit_holding(&self, active: &[usize], held: Vec<(usize, f64)>) -> Fit {
        let prior_of = |column: usize| match held.iter().find(|(of, _)| *of == column) {
            Some((_, step)) => {
                let precision = HOLD * self.products.get(column, column);
                (precision, precision * step)
            }
            None => self.prior_of(column),
        };
        let mut a = self.products.part(active);
        let mut b: Vec<f64> = active.iter().map(|i| self.products.get(0, *i)).collect();
        for (k, column) in active.iter().enumerate() {
            let (precision, pull) = prior_of(*column);
            a.add(k, k, precision);
            b[k] += pull;
        }
        let factor = Cholesky::of(&a);
        let forward = factor.forward(&b);
        let constant: f64 = active
            .iter()
            .map(|column| prior_of(*column))
            .map(|(precision, pull)| if precision > 0.0 { pull * pull / precision } else { 0.0 })
            .sum();
        Fit {
            active: active.to_vec(),
            values: factor.solve(&b),
            rss: self.products.get(0, 0) + constant - dot(&forward, &forward),
            factor,
            forward,
            held,
        }
    }

    /// The law parameter (not yet held) that steps farthest beyond its room, in units of its column, and the end of its
    /// room.
    fn beyond_room(&self, held: &[(usize, f64)], steps: impl Iterator<Item = (usize, f64)>) -> Option<(usize, f64)> {
        steps
            .filter(|(column, _)| held.iter().all(|(of, _)| of != column))
            .filter_map(|(column, step)| {
                let (least, most) = *self.room.get(column - 1)?;
                let end = step.clamp(least, most);
                let beyond = (step - end).abs() * self.products.get(column, column).sqrt();
                (beyond > 0.0).then_some((beyond, (column, end)))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, end)| end)
    }

    /// Steps of the law's parameters that fit best where some are held at a given step.
    pub(crate) fn step_beside(&self, held: &[Option<f64>]) -> Vec<f64> {
        let free: Vec<usize> = self.law().into_iter().filter(|column| held[column - 1].is_none()).collect();
        let mut a = self.products.part(&free);
        let mut b = Vec::with_capacity(free.len());
        for (k, column) in free.iter().enumerate() {
            let (precision, pull) = self.prior_of(*column);
            a.add(k, k, precision);
            let of_held: f64 = held
                .iter()
                .enumerate()
                .filter_map(|(at, step)| step.map(|step| step * self.products.get(at + 1, *column)))
                .sum();
            b.push(self.products.get(0, *column) + pull - of_held);
        }
        let mut steps: Vec<f64> = held.iter().map(|step| step.unwrap_or(0.0)).collect();
        for (column, step) in free.iter().zip(Cholesky::of(&a).solve(&b)) {
            steps[column - 1] = step;
        }
        steps
    }

    /// Fits the law and the members together, every amplitude with a sign possible for its cause and every law
    /// parameter within its room. Amplitudes of the wrong sign are left out, the worst first.
    pub(crate) fn fit_members(&self, members: &[Member]) -> Fit {
        self.fit_signed(self.active(members), members)
    }

    /// The same with one law parameter held at a step.
    pub(crate) fn fit_holding_one(&self, members: &[Member], parameter: usize, step: f64) -> Fit {
        self.fit_holding(&self.active(members), vec![(parameter + 1, step)])
    }

    fn fit_signed(&self, mut active: Vec<usize>, members: &[Member]) -> Fit {
        let mut held = Vec::new();
        loop {
            let fit = self.fit_holding(&active, held.clone());
            if let Some(end) = self.beyond_room(&held, fit.active.iter().copied().zip(fit.values.iter().copied())) {
                held.push(end);
                continue;
            }
            let against = |column: usize, (least, most): (f64, f64)| {
                let x = fit.value_of(column);
                let wrong = match (least >= 0.0, most <= 0.0) {
                    (true, true) => x.abs(),
                    (true, false) => -x,
                    (false, true) => x,
                    (false, false) => 0.0,
                };
                (wrong * self.products.get(column, column).sqrt(), column)
            };
            let worst = members
                .iter()
                .flat_map(|member| member.base.iter().zip(&member.candidate.bounds))
                .filter(|(column, _)| active.contains(column))
                .map(|(column, bounds)| against(*column, *bounds))
                .filter(|(wrong, _)| *wrong > 0.0)
                .max_by(|a, b| a.0.total_cmp(&b.0));
            match worst {
                Some((_, column)) => active.retain(|other| *other != column),
                None => return fit,
            }
        }
    }

    /// Fits the members alone: the law stays where it is.
    pub(crate) fn fit_beside_law(&self, members: &[Member]) -> Fit {
        let of_members: Vec<usize> = members.iter().flat_map(|member| member.base.iter().copied()).collect();
        self.fit_signed(of_members, members)
    }

    /// Whitened residual of a fit.
    pub(crate) fn rest(&self, fit: &Fit) -> Vec<f32> {
        let mut rest = self.base[0].clone();
        for (column, value) in fit.active.iter().zip(&fit.values) {
            for (rest, x) in rest.iter_mut().zip(&self.base[*column]) {
                *rest -= *value as f32 * x;
            }
        }
        rest
    }

    /// Columns of the law and of these members.
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

    /// Force of a source with these amplitudes over the rows of all runs, N; empty where no run shows it.
    pub(crate) fn force(&self, source: &Source, amplitudes: &[f64]) -> Vec<f64> {
        weighted(&self.raw(source).unwrap_or_default(), amplitudes)
    }

    /// Whether the runs can show every length of a source, play hides none of them, and starts and stops do not speak
    /// against it.
    fn is_told(&self, source: &Source) -> bool {
        !self.edges.is_some_and(|edges| !edges.allow(source)) && self.told.is_told(source, self.seen_from_m)
    }

    /// Whether starts and stops alone are evidence for a source.
    pub(crate) fn is_spoken_for(&self, source: &Source) -> bool {
        self.edges.is_some_and(|edges| edges.speak_for(source))
    }

    /// Whitens a source; `None` where no run shows it.
    pub(crate) fn candidate(&self, source: Source) -> Option<Candidate> {
        self.candidates([source]).pop()
    }

    /// Whitens many sources, on all processors; those that no run shows are left out.
    pub(crate) fn candidates(&self, sources: impl IntoIterator<Item = Source>) -> Vec<Candidate> {
        let told: Vec<Source> = sources.into_iter().filter(|source| self.is_told(source)).collect();
        told.par_chunks(AT_ONCE).flat_map_iter(|few| self.candidates_of(few)).collect()
    }

    fn candidates_of(&self, sources: &[Source]) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        let mut waiting: Vec<(Source, Vec<Vec<f64>>)> = Vec::new();
        for source in sources {
            if let Source::Shift { parameter } = source {
                candidates.extend(self.of_white(source.clone(), vec![self.base[parameter + 1].clone()]));
                continue;
            }
            let Some(raw) = self.raw(source) else { continue };
            waiting.push((source.clone(), raw));
            if waiting.iter().map(|(_, raw)| raw.len()).sum::<usize>() >= AT_ONCE {
                self.whiten(&mut waiting, &mut candidates);
            }
        }
        self.whiten(&mut waiting, &mut candidates);
        candidates
    }

    fn whiten(&self, waiting: &mut Vec<(Source, Vec<Vec<f64>>)>, candidates: &mut Vec<Candidate>) {
        let raw: Vec<&[f64]> = waiting.iter().flat_map(|(_, raw)| raw).map(Vec::as_slice).collect();
        let mut white = self.rows.white_all(&raw).into_iter();
        for (source, raw) in waiting.drain(..) {
            candidates.extend(self.of_white(source, white.by_ref().take(raw.len()).collect()));
        }
    }

    fn of_white(&self, source: Source, columns: Vec<Vec<f32>>) -> Option<Candidate> {
        let own = Symmetric::gram(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
        if (0..columns.len()).all(|i| !(own.get(i, i) > 1e-12))
            || (0..columns.len()).any(|i| !own.get(i, i).is_finite())
        {
            return None;
        }
        // two amplitudes for one column: a zero that follows a constant temperature is no more than a zero
        if let [_, _] = columns.as_slice()
            && own.get(0, 1) * own.get(0, 1) > (1.0 - TWINS) * own.get(0, 0) * own.get(1, 1)
        {
            return None;
        }
        let mut bounds = source.bounds(columns.len());
        self.told.bind(&source, &mut bounds);
        if let Some(edges) = &self.edges {
            edges.bind(&source, &mut bounds);
        }
        Some(Candidate { source, columns: Arc::new(columns), bounds, own, cross: Vec::new() })
    }

    /// A candidate prepared for a fit of these columns of the base; `None` where no run shows it.
    pub(crate) fn prepared(&self, source: Source, active: &[usize]) -> Option<Candidate> {
        let mut candidate = match self.made.get(&source) {
            Some(known) => known,
            None => self.candidate(source)?,
        };
        self.prepare(&mut candidate, active);
        self.made.keep(&candidate);
        Some(candidate)
    }

    /// Computes the missing cross products with these columns of the base.
    pub(crate) fn prepare(&self, candidate: &mut Candidate, active: &[usize]) {
        self.prepare_all(std::slice::from_mut(candidate), active);
    }

    /// The same for many: candidates that lack the same columns share one pass through memory.
    pub(crate) fn prepare_all(&self, candidates: &mut [Candidate], active: &[usize]) {
        let lacking = |candidate: &Candidate| -> Vec<usize> {
            let known = |column: usize| candidate.cross.get(column).is_some_and(Option::is_some);
            std::iter::once(0).chain(active.iter().copied()).filter(|column| !known(*column)).collect()
        };
        for together in candidates.chunk_by_mut(|a, b| lacking(a) == lacking(b)) {
            let missing = together.first().map(&lacking).unwrap_or_default();
            let others: Vec<&[f32]> = missing.iter().map(|column| self.base[*column].as_slice()).collect();
            if missing.is_empty() {
                continue;
            }
            for few in together.chunks_mut(TOGETHER) {
                let columns: Vec<&[f32]> = few.iter().flat_map(|c| c.columns.iter()).map(Vec::as_slice).collect();
                let all = products(&columns, &others);
                let mut of_each = all.chunks(missing.len());
                for candidate in few {
                    candidate.cross.resize(self.base.len(), None);
                    let own: Vec<&[f64]> = of_each.by_ref().take(candidate.columns.len()).collect();
                    for (at, column) in missing.iter().enumerate() {
                        candidate.cross[*column] = Some(own.iter().map(|products| products[at]).collect());
                    }
                }
            }
        }
    }

    /// What a fit leaves of a candidate's inner products among themselves and with the mismatch; it must be prepared
    /// for the fit.
    fn left(&self, candidate: &Candidate, fit: &Fit) -> Left {
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
        // a shift is a column of the law itself: only its tolerance is left of it
        let rounding = if candidate.source.is_shift() { ROUNDING_OF_SHIFT } else { ROUNDING };
        for i in 0..count {
            for j in 0..=i {
                let mut rest = candidate.own.get(i, j) - dot(&imitated[i], &imitated[j]);
                // what the model explains to within rounding explains nothing itself
                if i == j && rest < rounding * candidate.own.get(i, i) {
                    rest = 0.0;
                }
                left.set(i, j, rest);
            }
        }
        Left { products: left, with_mismatch: right, imitated }
    }

    /// Inverse variance of a candidate's only amplitude beside a fit, for which it must be prepared.
    pub(crate) fn precision(&self, candidate: &Candidate, fit: &Fit) -> f64 {
        self.left(candidate, fit).products.get(0, 0)
    }

    /// Gain of the candidate beyond a fit, for which it must be prepared.
    pub(crate) fn gain(&self, candidate: &Candidate, fit: &Fit) -> Gain {
        let count = candidate.columns.len();
        let left = self.left(candidate, fit);
        let (mut nats, mut amplitudes) = bounded(&left.products, &left.with_mismatch, &candidate.bounds);
        if !self.room.is_empty()
            && let Some(end) = self.beyond_room(&fit.held, left.beside(fit, &amplitudes))
        {
            // the law would have to leave its range: it stays at the end
            let held = self.fit_holding(&fit.active, fit.held.iter().copied().chain([end]).collect());
            let there = self.gain(candidate, &held);
            nats = (there.nats - 0.5 * (held.rss - fit.rss)).max(0.0);
            amplitudes = there.amplitudes;
        }
        let own: f64 = (0..count)
            .map(|i| amplitudes[i] * (0..count).map(|j| candidate.own.get(i, j) * amplitudes[j]).sum::<f64>())
            .sum();
        if own > self.largest || bend::is_level(&candidate.source, &amplitudes, self.told.rail_m) {
            return Gain { nats: 0.0, score: f64::NEG_INFINITY, amplitudes: vec![0.0; count] };
        }
        let used = amplitudes.iter().filter(|x| **x != 0.0).count().max(1);
        let freedom = used + candidate.source.shapes();
        Gain { nats, score: nats - freedom as f64 * self.price(nats), amplitudes }
    }

    /// Cost of a parameter that takes part in explaining `nats` nats.
    pub(crate) fn price(&self, nats: f64) -> f64 {
        0.5 * self.ln_rows() + EARNED * nats
    }

    pub(crate) fn ln_rows(&self) -> f64 {
        (self.rows.len().max(2) as f64).ln()
    }

    /// Takes up a candidate.
    ///
    /// The sum of the columns of an unnamed curve is bounded by the mismatch; otherwise two such curves that cancel
    /// where they were fitted would be far off elsewhere.
    pub(crate) fn take(&mut self, candidate: Candidate) -> Member {
        if let Some((_, base)) = self.taken.iter().find(|(source, _)| source.is_same(&candidate.source)) {
            return Member { base: base.clone(), candidate };
        }
        let base = self.push(candidate.columns.to_vec());
        if matches!(candidate.source, Source::Mechanism { .. }) {
            self.taken.push((candidate.source.clone(), base.clone()));
        }
        if matches!(candidate.source, Source::Story { .. }) {
            let missing = self.fit(&self.law()).rss / base.len() as f64;
            let precision = |column: &usize| (*column, self.products.get(*column, *column) / missing);
            let precisions: Vec<(usize, f64)> = base.iter().map(precision).collect();
            self.nameless.extend(precisions);
        }
        Member { candidate, base }
    }

    /// What a member adds beside the others.
    pub(crate) fn beside(&self, members: &[Member], at: usize) -> Beside {
        let others = without(members, at);
        let fit = self.fit_members(&others);
        let mut own = members[at].candidate.clone();
        self.prepare(&mut own, &fit.active);
        let gain = self.gain(&own, &fit);
        Beside { others, fit, own, gain }
    }

    /// Both tests of a candidate against the members.
    pub(crate) fn locks(&self, candidate: &Candidate, gain: &Gain, members: &[Member]) -> Locks {
        self.locks_beside(candidate, gain, members, &[])
    }

    /// The same beside the leavings of members' forms: columns with amplitudes of the order of 1.
    pub(crate) fn locks_beside(
        &self,
        candidate: &Candidate,
        gain: &Gain,
        members: &[Member],
        leavings: &[Vec<f32>],
    ) -> Locks {
        let active = self.active(members);
        let mut columns: Vec<&[f32]> = vec![&self.base[0]];
        columns.extend(active.iter().map(|column| self.base[*column].as_slice()));
        columns.extend(leavings.iter().map(Vec::as_slice));
        let known = columns.len();
        columns.extend(
            candidate
                .columns
                .iter()
                .zip(&gain.amplitudes)
                .filter(|(_, x)| **x != 0.0)
                .map(|(column, _)| column.as_slice()),
        );
        // a tolerance of three standard deviations is free: an effect must show beside parameters that use it up
        let free = |(precision, pull)| (precision / 9.0, pull / 9.0);
        let mut prior: Vec<(f64, f64)> = active.iter().map(|column| free(self.prior_of(*column))).collect();
        prior.resize(prior.len() + leavings.len(), (1.0, 0.0));
        prior.resize(columns.len() - 1, (0.0, 0.0));
        locks(&Gram::of(&columns, &self.rows.blocks), known, &prior)
    }
}
