//! What a cause that is bound to places does on another recording, which counts its positions from elsewhere: its mean,
//! beside which the law was fitted.

use simulation::mechanism::Context;

use crate::numbers::linear::dot;

/// Cells of equal length that the stroke is cut into.
const CELLS: usize = 64;

/// What a force may be in proportion to at one place: a constant, the direction, and the law's force with its sign and
/// without.
const CARRIERS: usize = 4;

/// Cells of the taught stroke, and what is known of every row.
pub(crate) struct Places {
    cells: Vec<Option<usize>>,
    carriers: Vec<[f64; CARRIERS]>,
}

impl Places {
    /// Places of the compared rows.
    pub(crate) fn of(contexts: &[Context<'_>], compared: &[bool]) -> Self {
        let at: Vec<f64> = contexts.iter().flat_map(|context| context.motion.position_m.iter().copied()).collect();
        let taught = || at.iter().zip(compared).filter(|(_, compared)| **compared).map(|(x, _)| *x);
        let (start, end) = taught().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let cell =
            |x: f64| ((CELLS as f64 * (x - start) / (end - start).max(f64::MIN_POSITIVE)) as usize).min(CELLS - 1);
        Places {
            cells: at.iter().zip(compared).map(|(x, compared)| compared.then(|| cell(*x))).collect(),
            carriers: contexts.iter().flat_map(carriers).collect(),
        }
    }

    /// What these columns, each with its amplitude, do on average, row by row of other recordings.
    pub(crate) fn force(&self, columns: &[Vec<f64>], amplitudes: &[f64], others: &[Context<'_>]) -> Vec<f64> {
        let mean = self.mean(columns, amplitudes);
        others.iter().flat_map(carriers).map(|carriers| dot(&carriers, &mean)).collect()
    }

    /// The mean over all rows of what the columns together are in proportion to: each to one carrier, since where the
    /// carriage stayed at one place with another drag, several would make up for one another.
    fn mean(&self, columns: &[Vec<f64>], amplitudes: &[f64]) -> [f64; CARRIERS] {
        let mut mean = [0.0; CARRIERS];
        for (column, amplitude) in columns.iter().zip(amplitudes) {
            let (carrier, ratio) = self.ratio(column);
            mean[carrier] += amplitude * ratio;
        }
        mean
    }

    /// The carrier that a column of force is nearest to being in proportion to, place by place, and its mean proportion to
    /// that.
    ///
    /// ```text
    /// at a place: force = r c, r = Σ c force/Σ c² over its rows    mean: the same over all rows
    /// ```
    fn ratio(&self, column: &[f64]) -> (usize, f64) {
        let mut sums = [[[0.0; 2]; CELLS]; CARRIERS];
        for ((force, carriers), cell) in column.iter().zip(&self.carriers).zip(&self.cells) {
            let Some(cell) = cell else { continue };
            for (carrier, sums) in carriers.iter().zip(&mut sums) {
                sums[*cell][0] += carrier * force;
                sums[*cell][1] += carrier * carrier;
            }
        }
        let explained = |sums: &[[f64; 2]]| {
            let of = |[with, own]: &[f64; 2]| if *own > 0.0 { with * with / own } else { 0.0 };
            sums.iter().map(of).sum::<f64>()
        };
        // the first of equals: what does nothing is a constant of nothing
        let best =
            (0..CARRIERS).rev().max_by(|a, b| explained(&sums[*a]).total_cmp(&explained(&sums[*b]))).unwrap_or(0);
        let [with, own] = sums[best].iter().fold([0.0; 2], |[with, own], cell| [with + cell[0], own + cell[1]]);
        (best, if own > 0.0 { with / own } else { 0.0 })
    }
}

/// What a force may be in proportion to, row by row.
fn carriers(context: &Context<'_>) -> impl Iterator<Item = [f64; CARRIERS]> {
    context.direction.iter().zip(&context.steady.force_n).map(|(direction, force)| {
        let force = if force.is_finite() { *force } else { 0.0 };
        [1.0, *direction, force, direction * force]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 rows along a stroke, and 400 more that stay at a place with five times the drag.
    fn places() -> (Places, Vec<f64>) {
        let x: Vec<f64> = (0..800).map(|n| if n < 400 { f64::from(n) / 400.0 } else { 0.9 }).collect();
        let carrier = |n: usize| {
            let direction = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
            let drag = if n < 400 { 10.0 } else { 50.0 } + (n % 7) as f64;
            [1.0, direction, direction * drag, drag]
        };
        let cells = x.iter().map(|x| Some(((CELLS as f64 * x) as usize).min(CELLS - 1))).collect();
        (Places { cells, carriers: (0..800).map(carrier).collect() }, x)
    }

    #[test]
    fn a_peak_of_the_drag_at_one_place_is_nothing_that_acts_whatever_the_drag() {
        let (places, x) = places();
        let peak: Vec<f64> =
            x.iter().zip(&places.carriers).map(|(x, c)| if *x >= 0.875 { 0.2 * c[2] } else { 0.0 }).collect();
        let mean = places.mean(&[peak], &[1.0]);
        assert!(mean[2] > 0.0 && [mean[0], mean[1], mean[3]] == [0.0; 3], "{mean:?}");
    }

    #[test]
    fn what_acts_alike_everywhere_is_its_own_mean() {
        let (places, x) = places();
        for carrier in 0..CARRIERS {
            let column: Vec<f64> = places.carriers.iter().map(|carriers| carriers[carrier]).collect();
            let mut expected = [0.0; CARRIERS];
            expected[carrier] = 0.3;
            let mean = places.mean(&[column], &[0.3]);
            assert!(mean.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{mean:?}");
        }
        // the heights of a curve over the stroke, each felt at few places, are a constant together
        let knots = 9;
        let hat = |knot: usize| -> Vec<f64> {
            x.iter().map(|x| (1.0 - (x * (knots - 1) as f64 - knot as f64).abs()).max(0.0)).collect()
        };
        let columns: Vec<Vec<f64>> = (0..knots).map(hat).collect();
        let mean = places.mean(&columns, &vec![2.0; knots]);
        assert!((mean[0] - 2.0).abs() < 1e-12 && mean[1..] == [0.0; 3], "{mean:?}");
    }
}
