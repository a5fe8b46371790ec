//! Locks: two tests of whether an effect is real. They must agree, because each alone gave false alarms under coloured
//! noise.
//!
//! *Split likelihood ratio* (universal inference, Wasserman, Ramdas and Balakrishnan 2020): the effect's size is fitted
//! on three folds of interleaved blocks. On the fourth fold, projected off the rival's columns, `y` are the `n`
//! residuals and `z` is the effect at that size. Both hypotheses leave the variance unknown, because what is still
//! missing adds to the noise:
//!
//! ```text
//! e = (1 - |z|²/|y|²) (|y|²/|y - z|²)^(n/2)
//! ```
//!
//! Under the null hypothesis `y/|y|` is uniform on the sphere, and `(1 - |x|²)/|u - x|^n` is Poisson's kernel, whose
//! mean over the sphere is 1. The mean over folds is an e-value, too: it exceeds 1/α with a probability of at most α.
//!
//! *Score by blocks*: the mean slope of the likelihood per block, along the direction fitted on the other folds,
//! against its scatter between blocks. It needs no noise model at all: errors of the whitening show in the scatter.

use crate::noise::rows::{FOLDS, Gram};
use crate::numbers::linear::{Cholesky, Symmetric, dot};

/// Number of entries from which an effect counts as a table whose entries are shrunk.
const SHRINKING: usize = 6;

/// Results of the two tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Locks {
    /// Natural logarithm of the e-value.
    pub(crate) ln_e: f64,
    /// p-value of the score.
    pub(crate) p: f64,
}

/// Tests whether the last columns of `gram` add to the first ones. Column 0 is the mismatch, columns `1..known` are the
/// rival's (null hypothesis), the rest is the effect. `prior`: precision, and precision times mean, of every column
/// from 1 on.
pub(crate) fn locks(gram: &Gram, known: usize, prior: &[(f64, f64)]) -> Locks {
    let size = gram.rows.len();
    let columns = gram.total.size();
    let all: Vec<usize> = (1..columns).collect();
    let rival: Vec<usize> = (1..known).collect();
    let effect: Vec<usize> = (known..columns).collect();
    let folds: Vec<Symmetric> = (0..FOLDS)
        .map(|fold| {
            let mut sum = Symmetric::zeros(columns);
            for (_, block) in gram.blocks.iter().enumerate().filter(|(b, _)| fold_of(*b) == fold) {
                sum.accumulate(block, 1.0);
            }
            sum
        })
        .collect();
    let under_null = fit(&gram.total, &rival, prior);
    let a = penalised(&gram.total, &rival, prior);
    let factor = Cholesky::of(&a);
    let (mut ln_es, mut scores, mut information) = (Vec::new(), vec![0.0; size], vec![0.0; size]);
    for (fold, test) in folds.iter().enumerate() {
        let mut train = gram.total.clone();
        train.accumulate(test, -1.0);
        let found = fit(&train, &all, &shrinking(&train, known, prior, &fit(&train, &all, prior)));
        let direction = &found[known - 1..];
        let freedom = rival.len() as f64;
        let held = (gram_rows(gram, |b| fold_of(b) == fold) - freedom).max(1.0);
        let none = vec![0.0; direction.len()];
        let null = beside(test, &rival, &effect, &none, prior).max(1e-12);
        let here = beside(test, &rival, &effect, direction, prior).max(1e-12);
        let own = own_size(test, &rival, &effect, direction, prior);
        ln_es.push((1.0 - own / null).max(0.0).ln() + 0.5 * held * (null / here).ln());
        // direction of the effect from the other folds, and what the rival imitates of it
        let along: Vec<f64> =
            rival.iter().map(|i| effect.iter().zip(direction).map(|(e, d)| gram.total.get(*i, *e) * d).sum()).collect();
        let imitated = factor.solve(&along);
        for b in (0..size).filter(|b| fold_of(*b) == fold) {
            let block = &gram.blocks[b];
            let against = |with: &dyn Fn(usize) -> f64| {
                effect.iter().zip(direction).map(|(e, d)| with(*e) * d).sum::<f64>()
                    - rival.iter().zip(&imitated).map(|(i, g)| with(*i) * g).sum::<f64>()
            };
            scores[b] = against(&|c| {
                block.get(0, c) - rival.iter().zip(&under_null).map(|(i, x)| block.get(*i, c) * x).sum::<f64>()
            });
            let weight = against(&|c| {
                effect.iter().zip(direction).map(|(e, d)| block.get(*e, c) * d).sum::<f64>()
                    - rival.iter().zip(&imitated).map(|(i, g)| block.get(*i, c) * g).sum::<f64>()
            });
            information[b] = weight.max(0.0);
        }
    }
    Locks { ln_e: ln_mean_exp(&ln_es), p: score_p(&scores, &information) }
}

/// Shrinkage prior for the entries of a table: zero mean, with the mean square of the fitted entries as variance, each
/// weighted by how well the rows determine it. An entry that hardly any row determines stays near 0 and does not
/// predict where it acts.
fn shrinking(train: &Symmetric, known: usize, prior: &[(f64, f64)], found: &[f64]) -> Vec<(f64, f64)> {
    let entries = known - 1..found.len();
    let mut shrinking = prior.to_vec();
    if entries.len() < SHRINKING {
        return shrinking;
    }
    let told = |entry: usize| train.get(entry + 1, entry + 1);
    let square: f64 = entries.clone().map(|entry| told(entry) * found[entry] * found[entry]).sum();
    let all: f64 = entries.clone().map(told).sum();
    if square > 0.0 {
        entries.for_each(|entry| shrinking[entry].0 += all / square);
    }
    shrinking
}

/// Fold of a block: blocks are dealt in turn, and every round begins one fold later, so that no fold is in step with a
/// periodic motion.
fn fold_of(block: usize) -> usize {
    (block + block / FOLDS) % FOLDS
}

/// Number of rows of some of the blocks.
fn gram_rows(gram: &Gram, of: impl Fn(usize) -> bool) -> f64 {
    gram.rows.iter().enumerate().filter(|(b, _)| of(*b)).map(|(_, rows)| *rows as f64).sum()
}

fn penalised(gram: &Symmetric, which: &[usize], prior: &[(f64, f64)]) -> Symmetric {
    let mut a = gram.part(which);
    for (k, column) in which.iter().enumerate() {
        a.add(k, k, prior[column - 1].0);
    }
    a
}

fn fit(gram: &Symmetric, which: &[usize], prior: &[(f64, f64)]) -> Vec<f64> {
    let b: Vec<f64> = which.iter().map(|i| gram.get(0, *i) + prior[i - 1].1).collect();
    Cholesky::of(&penalised(gram, which, prior)).solve(&b)
}

/// Squared norm of an effect, less what the rival imitates.
fn own_size(gram: &Symmetric, rival: &[usize], effect: &[usize], size: &[f64], prior: &[(f64, f64)]) -> f64 {
    let with = |i: usize| effect.iter().zip(size).map(|(e, d)| gram.get(i, *e) * d).sum::<f64>();
    let b: Vec<f64> = rival.iter().map(|i| with(*i)).collect();
    let forward = Cholesky::of(&penalised(gram, rival, prior)).forward(&b);
    effect.iter().zip(size).map(|(e, d)| d * with(*e)).sum::<f64>() - dot(&forward, &forward)
}

/// Residual square of an effect of a given size, with the prior's penalty, at the rival's best fit.
fn beside(gram: &Symmetric, rival: &[usize], effect: &[usize], size: &[f64], prior: &[(f64, f64)]) -> f64 {
    let with = |i: usize| effect.iter().zip(size).map(|(e, d)| gram.get(i, *e) * d).sum::<f64>();
    let b: Vec<f64> = rival.iter().map(|i| gram.get(0, *i) - with(*i) + prior[i - 1].1).collect();
    let forward = Cholesky::of(&penalised(gram, rival, prior)).forward(&b);
    let quadratic: f64 = effect.iter().zip(size).map(|(e, d)| d * with(*e)).sum();
    let pulled: f64 = rival
        .iter()
        .map(|i| prior[i - 1])
        .map(|(precision, pull)| if precision > 0.0 { pull * pull / precision } else { 0.0 })
        .sum();
    gram.get(0, 0) - 2.0 * with(0) + quadratic + pulled - dot(&forward, &forward)
}

fn ln_mean_exp(x: &[f64]) -> f64 {
    let largest = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !largest.is_finite() {
        return f64::NEG_INFINITY;
    }
    largest + (x.iter().map(|x| (x - largest).exp()).sum::<f64>() / x.len() as f64).ln()
}

/// p-value of Student's t of the mean score; the degrees of freedom are those of the effective number of informing
/// blocks.
fn score_p(scores: &[f64], information: &[f64]) -> f64 {
    let count = scores.iter().zip(information).filter(|(_, i)| **i > 0.0).count() as f64;
    let total: f64 = scores.iter().sum();
    let squares: f64 = information.iter().map(|i| i * i).sum();
    let informing = information.iter().sum::<f64>();
    if count < 3.0 || !(squares > 0.0) {
        return 1.0;
    }
    let effective = informing * informing / squares;
    // the score that a block of this much information should show: blocks of unequal information add no scatter
    let slope = total / informing;
    let scatter: f64 = scores.iter().zip(information).map(|(s, i)| (s - slope * i) * (s - slope * i)).sum();
    let variance = scatter * count / (count - 1.0);
    let freedom = (effective - 1.0).max(1.0);
    if !(variance > 0.0) {
        return if total > 0.0 { 0.0 } else { 1.0 };
    }
    student_upper(total / variance.sqrt(), freedom)
}

/// Probability that Student's t exceeds `t`.
pub(crate) fn student_upper(t: f64, freedom: f64) -> f64 {
    let tail = 0.5 * incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + t * t));
    if t > 0.0 { tail } else { 1.0 - tail }
}

/// Regularised incomplete beta function: continued fraction of Lentz.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return x.clamp(0.0, 1.0);
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp() / a;
    let tiny = 1e-300;
    let guard = |x: f64| if x.abs() < tiny { tiny } else { x };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..300 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        d = 1.0 / guard(1.0 + even * d);
        c = guard(1.0 + even / c);
        fraction *= d * c;
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        d = 1.0 / guard(1.0 + odd * d);
        c = guard(1.0 + odd / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    front * fraction
}

/// p-value of the smallest of some p-values (Bonferroni).
pub(crate) fn least_of(p: impl IntoIterator<Item = f64>) -> f64 {
    let (least, count) = p.into_iter().fold((1.0, 0.0), |(least, count): (f64, f64), p| (least.min(p), count + 1.0));
    (least * count).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn students_tail() {
        for (t, freedom, p) in [(2.015, 5.0, 0.05), (63.657, 1.0, 0.005), (-1.0, 9.0, 0.828_281), (3.365, 5.0, 0.01)] {
            assert!((student_upper(t, freedom) / p - 1.0).abs() < 2e-4, "{t} {freedom}: {}", student_upper(t, freedom));
        }
    }

    fn columns(effect: f64, seed: u64) -> Vec<Vec<f32>> {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        let rows = 4000;
        let z: Vec<f64> = (0..rows).map(|n| (n as f64 * 0.7).sin()).collect();
        let one = vec![1.0; rows];
        let y: Vec<f32> =
            z.iter().map(|z| ((0..12).map(|_| uniform()).sum::<f64>() - 6.0 + effect * z + 0.3) as f32).collect();
        let single = |x: &[f64]| x.iter().map(|x| *x as f32).collect();
        vec![y, single(&one), single(&z)]
    }

    /// A profile with a place of its own for every fold: the other folds hardly determine what is there.
    #[test]
    fn a_table_is_known_by_the_places_that_are_passed_again() {
        let blocks: Vec<_> = (0..40).map(|b| b * 100..b * 100 + 100).collect();
        let noise = columns(0.0, 9).remove(0);
        let at = |entry: usize, block: usize, n: usize| match entry {
            0..8 => f32::from(u8::from(n % 8 == entry)),
            _ if fold_of(block) == entry - 8 => f32::from(u8::from(n.is_multiple_of(3))),
            _ => 1e-4,
        };
        let table: Vec<Vec<f32>> = (0..12).map(|entry| (0..4000).map(|n| at(entry, n / 100, n)).collect()).collect();
        let height = |entry: usize| 0.3 * (1.7 * entry as f32).sin();
        let rest: Vec<f32> = (0..4000)
            .map(|n| noise[n] + table.iter().enumerate().map(|(e, x)| height(e) * x[n]).sum::<f32>())
            .collect();
        let one = vec![1.0; 4000];
        let all: Vec<&[f32]> =
            [rest.as_slice(), one.as_slice()].into_iter().chain(table.iter().map(Vec::as_slice)).collect();
        let locks = locks(&Gram::of(&all, &blocks), 2, &[(0.0, 0.0); 13]);
        assert!(locks.p < 1e-4 && locks.ln_e > 8.0, "{locks:?}");
    }

    #[test]
    fn both_locks_open_for_an_effect_and_hold_without() {
        let blocks: Vec<_> = (0..40).map(|b| b * 100..b * 100 + 100).collect();
        let mut alarms = 0;
        for seed in 0..200 {
            let own = columns(0.0, 77 + 13 * seed);
            let gram = Gram::of(&own.iter().map(Vec::as_slice).collect::<Vec<_>>(), &blocks);
            let locks = locks(&gram, 2, &[(0.0, 0.0); 2]);
            alarms += usize::from(locks.p < 0.05);
            assert!(locks.ln_e < 5.3, "{locks:?}");
        }
        assert!(alarms < 25, "{alarms} of 200 below 0.05");
        let own = columns(0.15, 5);
        let gram = Gram::of(&own.iter().map(Vec::as_slice).collect::<Vec<_>>(), &blocks);
        let open = locks(&gram, 2, &[(0.0, 0.0); 2]);
        assert!(open.ln_e > 5.0 && open.p < 1e-4, "{open:?}");
    }
}
