//! Shelves: cascaded first-order filters for the slow part of the noise, and their initial transient.
//!
//! At the first row of a stretch nothing is known of a noise that has been wandering before. Its state has the
//! stationary covariance, and the filter starts as the Kalman filter of the noise that the shelves whiten:
//!
//! ```text
//! ν = x - C·ŵ,   white = ν/√S,   ŵ' = A·ŵ + K·ν
//! ```
//!
//! with one state `w` per shelf. Once `S` has fallen to `D²`, this is the cascade itself, `ν = D·e`; until then the
//! cascade runs with its output times `K·D - B` added to its states. `S` and `K` follow from Chandrasekhar's recursion,
//! which has rank one for a stationary start: `P' - P = m·y·yᵀ` (Morf, Sidhu and Kailath 1974).
//!
//! Where a carriage rests, rows are missing and the noise wanders on: `ŵ' = A·ŵ`, `P' = A·P·Aᵀ + B·Bᵀ`. After the rest
//! the filter knows less, the longer the rest was, and `S` and `K` follow the Riccati recursion:
//!
//! ```text
//! S = C·P·Cᵀ + D²,   K = (A·P·Cᵀ + B·D)/S,   P' = A·P·Aᵀ + B·Bᵀ - K·S·Kᵀ
//! ```

use std::sync::Arc;

/// Most shelves: the slowest of them spans a million rows.
pub(super) const MOST_SHELVES: usize = 20;

/// Columns filtered side by side.
pub(super) const ABREAST: usize = 8;

/// Relative excess of `S` over `D²` below which the transient is over.
const BEGUN: f64 = 1e-4;

/// The same after missing rows: there are many such transients, and every row of one costs time.
const BEGUN_AGAIN: f64 = 1e-3;

/// Longest transient, rows: after that the state counts as known, however slow the noise.
const LONGEST: usize = 1 << 17;

/// `H(s) = (s + ω_z)/(s + ω_p)`, bilinear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shelf {
    b: [f64; 2],
    a: f64,
}

impl Shelf {
    /// Attenuates the power below `frequency` (as a fraction of the sampling rate) by `ratio`.
    pub(super) fn new(frequency: f64, ratio: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency;
        let quarter = ratio.sqrt().sqrt();
        let (pole, zero) = (omega * quarter, omega / quarter);
        Shelf { b: [(2.0 + zero) / (2.0 + pole), (zero - 2.0) / (2.0 + pole)], a: (pole - 2.0) / (2.0 + pole) }
    }

    /// Backwards in time: the transposed filter, away from the ends of a stretch.
    fn apply_backwards(&self, x: &mut [f64]) {
        let (mut before, mut out) = (0.0, 0.0);
        for x in x.iter_mut().rev() {
            let next = self.b[0] * *x + self.b[1] * before - self.a * out;
            before = *x;
            out = next;
            *x = next;
        }
    }

    /// Squared gain; `cos`: cosine of the angle per row.
    fn power(&self, cos: f64) -> f64 {
        let [b0, b1] = self.b;
        (b0 * b0 + b1 * b1 + 2.0 * b0 * b1 * cos) / (1.0 + self.a * self.a + 2.0 * self.a * cos)
    }
}

/// Cascaded shelves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shelves {
    shelves: Vec<Shelf>,
    /// Transient, row by row from the start of a stretch: `D/√S`, then `K·D - B` of every shelf.
    beginning: Arc<Vec<f64>>,
}

impl Shelves {
    pub(super) fn new(shelves: Vec<Shelf>) -> Self {
        let beginning = if shelves.is_empty() { Vec::new() } else { beginning(&shelves) };
        Shelves { shelves, beginning: Arc::new(beginning) }
    }

    /// Course of the shelves over consecutive stretches, each given as the number of missing rows before it (0 for the
    /// first) and its rows.
    pub(super) fn course(&self, stretches: &[(usize, usize)]) -> Course {
        let first =
            |(_, rows): &(usize, usize)| Passage { rows: *rows, across: Vec::new(), begins: self.beginning.clone() };
        if self.shelves.is_empty() || stretches.len() < 2 {
            return Course(stretches.iter().map(first).collect());
        }
        let noise = Noise::of(&self.shelves);
        let mut known = noise.covariance();
        let passage = |(at, (missing, rows)): (usize, &(usize, usize))| {
            let mut across = Vec::new();
            if at > 0 {
                let (power, wandered) = noise.unseen(*missing);
                known = sum(&moved(&power, &known), &wandered);
                across = power.concat();
            }
            let begins = Arc::new(noise.beginning(&mut known, *rows));
            Passage { rows: *rows, across, begins }
        };
        Course(stretches.iter().enumerate().map(passage).collect())
    }

    /// Filters the rows of consecutive stretches in several columns.
    pub(super) fn apply_all(&self, columns: &mut [Vec<f64>], course: &Course) {
        if self.shelves.is_empty() {
            return;
        }
        let mut rest = columns;
        while !rest.is_empty() {
            // below half of the lanes, filtering columns one by one is cheaper
            let abreast = if rest.len() > ABREAST / 2 { rest.len().min(ABREAST) } else { 1 };
            let (some, others) = rest.split_at_mut(abreast);
            if abreast == 1 {
                self.apply::<1>(some, course);
            } else {
                self.apply::<ABREAST>(some, course);
            }
            rest = others;
        }
    }

    fn apply<const N: usize>(&self, columns: &mut [Vec<f64>], course: &Course) {
        let mut rows = vec![[0.0; N]; columns.first().map_or(0, Vec::len)];
        for (k, column) in columns.iter().enumerate() {
            rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = *x);
        }
        pulp::Arch::new().dispatch(Cascade { shelves: &self.shelves, course, rows: &mut rows });
        for (k, column) in columns.iter_mut().enumerate() {
            rows.iter().zip(column).for_each(|(row, x)| *x = row[k]);
        }
    }

    /// The transposed filter, away from the ends of a stretch.
    pub(super) fn apply_backwards(&self, x: &mut [f64]) {
        for shelf in &self.shelves {
            shelf.apply_backwards(x);
        }
    }

    /// Squared gain; `cos`: cosine of the angle per row.
    pub(super) fn power(&self, cos: f64) -> f64 {
        self.shelves.iter().map(|shelf| shelf.power(cos)).product()
    }
}

/// Course of shelves over consecutive stretches.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course(Vec<Passage>);

/// One stretch of a course.
#[derive(Clone, Debug)]
struct Passage {
    rows: usize,
    /// Matrix that carries the states across the missing rows, row by row; empty for the first stretch.
    across: Vec<f64>,
    /// Transient, row by row: `D/√S`, then `K·D - B` of every shelf.
    begins: Arc<Vec<f64>>,
}

/// Cascaded shelves over rows of `N` columns, each row through all shelves: a row depends on the one before in every
/// shelf, but shelves and columns do not depend on one another.
struct Cascade<'a, const N: usize> {
    shelves: &'a [Shelf],
    course: &'a Course,
    rows: &'a mut [[f64; N]],
}

impl<const N: usize> pulp::NullaryFnOnce for Cascade<'_, N> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Cascade { shelves, course, rows } = self;
        let mut states = [(Shelf { b: [0.0; 2], a: 0.0 }, [0.0; N]); MOST_SHELVES];
        states.iter_mut().zip(shelves).for_each(|(state, shelf)| state.0 = *shelf);
        let states = &mut states[..shelves.len().min(MOST_SHELVES)];
        let through = |states: &mut [(Shelf, [f64; N])], mut signal: [f64; N]| {
            for (shelf, state) in states {
                for k in 0..N {
                    let next = shelf.b[0] * signal[k] - state[k];
                    state[k] = shelf.a * next - shelf.b[1] * signal[k];
                    signal[k] = next;
                }
            }
            signal
        };
        let mut rest = rows;
        for Passage { rows, across, begins } in &course.0 {
            let (own, others) = rest.split_at_mut((*rows).min(rest.len()));
            rest = others;
            if !across.is_empty() {
                let mut before = [[0.0; N]; MOST_SHELVES];
                before.iter_mut().zip(states.iter()).for_each(|(before, state)| *before = state.1);
                for ((_, state), powers) in states.iter_mut().zip(across.chunks_exact(shelves.len())) {
                    *state = [0.0; N];
                    for (power, before) in powers.iter().zip(&before) {
                        for k in 0..N {
                            state[k] += power * before[k];
                        }
                    }
                }
            }
            let mut begins = begins.chunks_exact(shelves.len() + 1);
            let first = begins.len().min(own.len());
            let (first, others) = own.split_at_mut(first);
            for (row, begins) in first.iter_mut().zip(&mut begins) {
                let out = through(states, *row);
                for ((_, state), correction) in states.iter_mut().zip(&begins[1..]) {
                    for k in 0..N {
                        state[k] += correction * out[k];
                    }
                }
                *row = out.map(|x| x * begins[0]);
            }
            for row in others {
                *row = through(states, *row);
            }
        }
    }
}

/// The noise that the shelves whiten: `w' = A·w + B·e`, `x = C·w + D·e`.
struct Noise {
    a: Vec<Vec<f64>>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: f64,
}

impl Noise {
    fn of(shelves: &[Shelf]) -> Self {
        let states = shelves.len();
        let (mut a, mut b) = (vec![Vec::new(); states], vec![0.0; states]);
        // input of a shelf, seen from the last one, as a combination of every state and e
        let (mut c, mut d) = (vec![0.0; states], 1.0);
        for (at, shelf) in shelves.iter().enumerate().rev() {
            let mut out: Vec<f64> = c.iter().map(|c| c / shelf.b[0]).collect();
            out[at] += 1.0 / shelf.b[0];
            let out_d = d / shelf.b[0];
            a[at] = c.iter().zip(&out).map(|(c, out)| shelf.a * c - shelf.b[1] * out).collect();
            b[at] = shelf.a * d - shelf.b[1] * out_d;
            (c, d) = (out, out_d);
        }
        Noise { a, b, c, d }
    }

    /// `B·Bᵀ`.
    fn of_row(&self) -> Vec<Vec<f64>> {
        self.b.iter().map(|b| self.b.iter().map(|other| b * other).collect()).collect()
    }

    /// Transition matrix of the states over missing rows, and the covariance that they gain meanwhile.
    fn unseen(&self, missing: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let states = self.b.len();
        let unit = |row: usize| (0..states).map(|column| f64::from(u8::from(row == column))).collect();
        let (mut power, mut wandered) =
            ((0..states).map(unit).collect::<Vec<Vec<f64>>>(), vec![vec![0.0; states]; states]);
        let (mut doubled, mut of_doubled) = (self.a.clone(), self.of_row());
        let mut left = missing;
        while left > 0 {
            if left & 1 == 1 {
                wandered = sum(&moved(&doubled, &wandered), &of_doubled);
                power = product(&doubled, &power);
            }
            of_doubled = sum(&moved(&doubled, &of_doubled), &of_doubled);
            doubled = product(&doubled, &doubled);
            left >>= 1;
        }
        (power, wandered)
    }

    /// Transient of shelves whose state has the covariance `known`, row by row as in [`Passage`]; updates `known` to
    /// that after so many rows.
    fn beginning(&self, known: &mut [Vec<f64>], rows: usize) -> Vec<f64> {
        let Noise { a, b, c, d } = self;
        let mut begins = Vec::new();
        for _ in 0..rows {
            let seen: Vec<f64> = known.iter().map(|row| dot(row, c)).collect();
            let s = dot(c, &seen) + d * d;
            if !(s > (1.0 + BEGUN_AGAIN) * d * d) {
                known.iter_mut().for_each(|row| row.fill(0.0));
                break;
            }
            let gain: Vec<f64> = a.iter().zip(b).map(|(row, b)| (dot(row, &seen) + b * d) / s).collect();
            begins.push(d / s.sqrt());
            begins.extend(gain.iter().zip(b).map(|(gain, b)| gain * d - b));
            let on = moved(a, known);
            for (i, row) in known.iter_mut().enumerate() {
                for (j, known) in row.iter_mut().enumerate() {
                    *known = on[i][j] + b[i] * b[j] - gain[i] * s * gain[j];
                }
            }
        }
        begins
    }

    /// The stationary covariance `P = A·P·Aᵀ + B·Bᵀ`, by doubling.
    fn covariance(&self) -> Vec<Vec<f64>> {
        let mut power = self.a.clone();
        let mut covariance = self.of_row();
        for _ in 0..2 * MOST_SHELVES {
            let moved = moved(&power, &covariance);
            let mut grown = 0.0f64;
            for (row, moved) in covariance.iter_mut().zip(&moved) {
                for (x, moved) in row.iter_mut().zip(moved) {
                    *x += moved;
                    grown = grown.max(moved.abs() / x.abs().max(1e-300));
                }
            }
            if grown < 1e-12 {
                break;
            }
            power = product(&power, &power);
        }
        covariance
    }

    /// `P·Cᵀ` of the stationary covariance.
    fn stationary(&self) -> Vec<f64> {
        self.covariance().iter().map(|row| dot(row, &self.c)).collect()
    }
}

/// Transient of shelves from a stationary start: see [`Shelves::beginning`].
fn beginning(shelves: &[Shelf]) -> Vec<f64> {
    let noise = Noise::of(shelves);
    let Noise { a, b, c, d } = &noise;
    let by_a = |x: &[f64]| -> Vec<f64> { a.iter().map(|row| dot(row, x)).collect() };
    let of_start = noise.stationary();
    let mut s = dot(c, &of_start) + d * d;
    // K·S, and the change of the covariance
    let mut gain: Vec<f64> = by_a(&of_start).iter().zip(b).map(|(x, b)| x + b * d).collect();
    let (mut y, mut m) = (gain.clone(), -1.0 / s);
    let mut rows = Vec::new();
    for _ in 0..LONGEST {
        if !(s > (1.0 + BEGUN) * d * d) {
            break;
        }
        rows.push(d / s.sqrt());
        rows.extend(gain.iter().zip(b).map(|(gain, b)| gain / s * d - b));
        let seen = dot(c, &y);
        let moved = by_a(&y);
        let next_s = s + m * seen * seen;
        gain.iter_mut().zip(&moved).for_each(|(gain, moved)| *gain += m * seen * moved);
        m += m * seen * seen * m / s;
        y = moved.iter().zip(&gain).map(|(moved, gain)| moved - gain / next_s * seen).collect();
        s = next_s;
    }
    rows
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn transposed(a: &[Vec<f64>]) -> Vec<Vec<f64>> {
    (0..a.len()).map(|column| a.iter().map(|row| row[column]).collect()).collect()
}

fn sum(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a + b).collect()).collect()
}

/// `A·P·Aᵀ`.
fn moved(a: &[Vec<f64>], p: &[Vec<f64>]) -> Vec<Vec<f64>> {
    product(a, &transposed(&product(a, p)))
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let columns = transposed(b);
    a.iter().map(|row| columns.iter().map(|column| dot(row, column)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Covariance at a lag of the noise that shelves whiten.
    fn covariance(noise: &Noise, lag: usize) -> f64 {
        let mut of_start = noise.stationary();
        if lag == 0 {
            return dot(&noise.c, &of_start) + noise.d * noise.d;
        }
        of_start = noise.a.iter().zip(&noise.b).map(|(row, b)| dot(row, &of_start) + b * noise.d).collect();
        for _ in 1..lag {
            of_start = noise.a.iter().map(|row| dot(row, &of_start)).collect();
        }
        dot(&noise.c, &of_start)
    }

    #[test]
    fn what_comes_out_is_white_from_the_first_row_on() {
        let shelves = vec![Shelf::new(0.05, 3.0), Shelf::new(0.01, 8.0), Shelf::new(0.003, 4.0)];
        let noise = Noise::of(&shelves);
        let rows = 300;
        let lags: Vec<f64> = (0..rows).map(|lag| covariance(&noise, lag)).collect();
        // row k of the filter's matrix T, from its response to a unit impulse at every row: T·Σ·Tᵀ = 1
        let filter = Shelves::new(shelves);
        let mut columns: Vec<Vec<f64>> =
            (0..rows).map(|at| (0..rows).map(|n| f64::from(u8::from(n == at))).collect()).collect();
        filter.apply_all(&mut columns, &filter.course(&[(0, rows)]));
        let row = |k: usize| -> Vec<f64> { columns.iter().map(|column| column[k]).collect() };
        let between = |a: &[f64], b: &[f64]| -> f64 {
            let one =
                |(i, x): (usize, &f64)| x * b.iter().enumerate().map(|(j, y)| y * lags[i.abs_diff(j)]).sum::<f64>();
            a.iter().enumerate().map(one).sum()
        };
        for (k, l) in [(0, 0), (1, 1), (0, 1), (3, 250), (40, 40), (40, 41), (299, 299), (100, 299)] {
            let expected = f64::from(u8::from(k == l));
            let found = between(&row(k), &row(l));
            assert!((found - expected).abs() < 2e-4, "{k} {l}: {found}");
        }
    }

    #[test]
    fn what_comes_out_is_white_behind_rows_that_are_missing() {
        let shelves = vec![Shelf::new(0.05, 3.0), Shelf::new(0.01, 8.0), Shelf::new(0.003, 4.0)];
        let noise = Noise::of(&shelves);
        let filter = Shelves::new(shelves);
        let (first, missing, rows) = (60, 25, 180);
        // sampling time of each row
        let at: Vec<usize> = (0..rows).map(|n| if n < first { n } else { n + missing }).collect();
        let lags: Vec<f64> = (0..rows + missing).map(|lag| covariance(&noise, lag)).collect();
        let mut columns: Vec<Vec<f64>> =
            (0..rows).map(|at| (0..rows).map(|n| f64::from(u8::from(n == at))).collect()).collect();
        filter.apply_all(&mut columns, &filter.course(&[(0, first), (missing, rows - first)]));
        let between = |k: usize, l: usize| -> f64 {
            let one =
                |i: usize| columns[i][k] * (0..rows).map(|j| columns[j][l] * lags[at[i].abs_diff(at[j])]).sum::<f64>();
            (0..rows).map(one).sum()
        };
        for (k, l) in [(59, 59), (60, 60), (59, 60), (61, 61), (40, 70), (90, 90), (90, 91), (179, 179), (60, 179)] {
            let found = between(k, l);
            assert!((found - f64::from(u8::from(k == l))).abs() < 2e-3, "{k} {l}: {found}");
        }
    }

    #[test]
    fn a_beginning_ends() {
        for shelves in [vec![Shelf::new(0.25, 1.05)], vec![Shelf::new(1e-5, 50.0), Shelf::new(0.1, 1.5)]] {
            let rows = Shelves::new(shelves.clone()).beginning.len() / (shelves.len() + 1);
            assert!((1..LONGEST).contains(&rows), "{rows}");
        }
    }
}
