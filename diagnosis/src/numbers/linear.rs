//! Least squares on a few dozen columns: the normal equations, scaled to unit diagonal and solved by Cholesky.

use rayon::prelude::*;

/// A symmetric matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Symmetric {
    size: usize,
    entries: Vec<f64>,
}

impl Symmetric {
    pub(crate) fn zeros(size: usize) -> Self {
        Symmetric { size, entries: vec![0.0; size * size] }
    }

    /// Inner products of columns with one another.
    pub(crate) fn gram(columns: &[&[f32]]) -> Self {
        Symmetric { size: columns.len(), entries: products(columns, columns) }
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    pub(crate) fn get(&self, i: usize, j: usize) -> f64 {
        self.entries[i * self.size + j]
    }

    pub(crate) fn set(&mut self, i: usize, j: usize, x: f64) {
        self.entries[i * self.size + j] = x;
        self.entries[j * self.size + i] = x;
    }

    /// Adds to an entry and its mirror image.
    pub(crate) fn add(&mut self, i: usize, j: usize, x: f64) {
        let sum = self.get(i, j) + x;
        self.set(i, j, sum);
    }

    /// `self += factor · other`.
    pub(crate) fn accumulate(&mut self, other: &Self, factor: f64) {
        for (own, more) in self.entries.iter_mut().zip(&other.entries) {
            *own += factor * more;
        }
    }

    /// Rows and columns of `which`, in that order.
    pub(crate) fn part(&self, which: &[usize]) -> Self {
        let mut part = Symmetric::zeros(which.len());
        for (i, from) in which.iter().enumerate() {
            for (j, to) in which.iter().enumerate() {
                part.entries[i * which.len() + j] = self.get(*from, *to);
            }
        }
        part
    }
}

/// Lower triangle `L` with `S A S = L Lᵀ`, `S` the scale that makes the diagonal 1.
///
/// A column that the previous ones explain to within rounding gets an infinite pivot, so that its coefficient is 0.
#[derive(Clone, Debug)]
pub(crate) struct Cholesky {
    size: usize,
    lower: Vec<f64>,
    scale: Vec<f64>,
}

/// Least share of a column's square that the previous ones must leave for it to count as independent.
const INDEPENDENT: f64 = 1e-9;

impl Cholesky {
    pub(crate) fn of(a: &Symmetric) -> Self {
        let n = a.size;
        let scale: Vec<f64> = (0..n).map(|i| if a.get(i, i) > 0.0 { 1.0 / a.get(i, i).sqrt() } else { 0.0 }).collect();
        let mut lower = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let mut sum = a.get(i, j) * scale[i] * scale[j];
                for k in 0..j {
                    sum -= lower[i * n + k] * lower[j * n + k];
                }
                lower[i * n + j] = if i == j {
                    if sum > INDEPENDENT { sum.sqrt() } else { f64::INFINITY }
                } else {
                    sum / lower[j * n + j]
                };
            }
        }
        Cholesky { size: n, lower, scale }
    }

    /// `L⁻¹ S b`.
    pub(crate) fn forward(&self, b: &[f64]) -> Vec<f64> {
        let n = self.size;
        let mut x = vec![0.0; n];
        for i in 0..n {
            let mut sum = b[i] * self.scale[i];
            for k in 0..i {
                sum -= self.lower[i * n + k] * x[k];
            }
            x[i] = sum / self.lower[i * n + i];
        }
        x
    }

    /// `A⁻¹ b`.
    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        self.backward(self.forward(b))
    }

    /// `S L⁻ᵀ x`.
    pub(crate) fn backward(&self, mut x: Vec<f64>) -> Vec<f64> {
        let n = self.size;
        for i in (0..n).rev() {
            let mut sum = x[i];
            for k in i + 1..n {
                sum -= self.lower[k * n + i] * x[k];
            }
            x[i] = sum / self.lower[i * n + i];
        }
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
        x
    }

    /// Diagonal of `A⁻¹`: variances of the coefficients where the noise has variance 1.
    pub(crate) fn variances(&self) -> Vec<f64> {
        (0..self.size)
            .map(|i| {
                let mut unit = vec![0.0; self.size];
                unit[i] = 1.0;
                let variance = self.solve(&unit)[i];
                if variance > 0.0 { variance } else { f64::INFINITY }
            })
            .collect()
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Projects a column off others: removes what they imitate of it.
pub(crate) fn remove(column: &mut [f32], others: &[&[f32]]) {
    let along = products(others, &[&*column]);
    for (other, x) in others.iter().zip(Cholesky::of(&Symmetric::gram(others)).solve(&along)) {
        column.iter_mut().zip(*other).for_each(|(column, other)| *column -= x as f32 * other);
    }
}

/// Rows summed in single precision: few enough for rounding not to matter, and for a few columns to stay in the fastest
/// cache.
const PIECE: usize = 512;

/// Columns that stay in the cache while others pass by.
const FEW: usize = 12;

/// Multiplications from which a second thread is worth it.
const WORTH_A_THREAD: usize = 1 << 20;

/// Inner products of every column with every other, column by column, on all processors with the widest registers
/// available: sixteen partial sums in a fixed order, so that every processor gives the same bits, whichever columns are
/// multiplied together.
pub(crate) fn products(columns: &[&[f32]], others: &[&[f32]]) -> Vec<f64> {
    let mut sums = vec![0.0; columns.len() * others.len()];
    let share = if columns.len() * others.len() * rows(columns, others) < WORTH_A_THREAD { columns.len() } else { FEW };
    sums.par_chunks_mut((share * others.len()).max(1))
        .zip(columns.par_chunks(share.max(1)))
        .for_each(|(sums, columns)| pulp::Arch::new().dispatch(Products { columns, others, sums }));
    sums
}

fn rows(columns: &[&[f32]], others: &[&[f32]]) -> usize {
    columns.iter().chain(others).map(|column| column.len()).min().unwrap_or(0)
}

struct Products<'a> {
    columns: &'a [&'a [f32]],
    others: &'a [&'a [f32]],
    sums: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Products<'_> {
    type Output = ();

    // a separate function would be compiled for the oldest processor
    #[inline(always)]
    fn call(self) {
        let Products { columns, others, sums } = self;
        let rows = rows(columns, others);
        for start in (0..rows).step_by(PIECE) {
            let piece = start..rows.min(start + PIECE);
            // a few of the others stay in the cache while every column passes by
            for (first, few) in (0..).step_by(FEW).zip(others.chunks(FEW)) {
                for (a, sums) in columns.iter().zip(sums.chunks_mut(others.len())) {
                    let a = &a[piece.clone()];
                    let (fours, rest) = few.as_chunks::<4>();
                    let (sums_of_fours, sums_of_rest) = sums[first..first + few.len()].split_at_mut(4 * fours.len());
                    for (four, sums) in fours.iter().zip(sums_of_fours.as_chunks_mut::<4>().0) {
                        partial_sums(a, four.map(|b| &b[piece.clone()]), sums);
                    }
                    for (b, sum) in rest.iter().zip(sums_of_rest) {
                        partial_sums(a, [&b[piece.clone()]], std::array::from_mut(sum));
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn partial_sums<const N: usize>(a: &[f32], b: [&[f32]; N], totals: &mut [f64; N]) {
    let mut sums = [[0.0f32; 16]; N];
    let (whole_a, rest_a) = a.as_chunks::<16>();
    let whole_b = b.map(|b| b.as_chunks::<16>().0);
    for (n, a) in whole_a.iter().enumerate() {
        for (sums, b) in sums.iter_mut().zip(&whole_b) {
            for k in 0..16 {
                sums[k] += a[k] * b[n][k];
            }
        }
    }
    for ((total, sums), b) in totals.iter_mut().zip(&sums).zip(&b) {
        *total += sums.iter().map(|s| f64::from(*s)).sum::<f64>();
        let rest_b = b.as_chunks::<16>().1;
        *total += rest_a.iter().zip(rest_b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_equations_are_solved_and_a_repeated_column_gets_nothing() {
        let columns = [vec![1.0, 2.0, 3.0, 4.0], vec![1.0, 1.0, 1.0, 1.0], vec![2.0, 4.0, 6.0, 8.0]];
        let y = [3.0, 5.0, 7.0, 9.0];
        let mut a = Symmetric::zeros(3);
        for i in 0..3 {
            for j in 0..=i {
                a.set(i, j, dot(&columns[i], &columns[j]));
            }
        }
        let b: Vec<f64> = columns.iter().map(|c| dot(c, &y)).collect();
        let x = Cholesky::of(&a).solve(&b);
        assert!((x[0] - 2.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12 && x[2] == 0.0, "{x:?}");
    }

    #[test]
    fn a_long_product_is_that_of_doubles() {
        let a: Vec<f32> = (0..5000).map(|n| (n as f32 * 0.37).sin()).collect();
        let b: Vec<f32> = (0..5000).map(|n| (n as f32 * 0.11).cos() + 0.3).collect();
        let exact: f64 = a.iter().zip(&b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
        let got = products(&[&a], &[&b])[0];
        assert!((got - exact).abs() < 1e-4, "{got} {exact}");
    }
}
