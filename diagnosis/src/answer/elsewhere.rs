//! What a cause that is bound to places does on another recording, which counts its positions from elsewhere: what it
//! does at most places of the stroke.

use simulation::mechanism::Context;

use crate::numbers::linear::dot;
use crate::numbers::statistics::median;

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

    /// What these columns, each with its amplitude, do at most places, row by row of other recordings.
    pub(crate) fn force(&self, columns: &[Vec<f64>], amplitudes: &[f64], others: &[Context<'_>]) -> Vec<f64> {
        let mut usual = [0.0; CARRIERS];
        for (column, amplitude) in columns.iter().zip(amplitudes) {
            let (carrier, ratio) = self.usual(column);
            usual[carrier] += amplitude * ratio;
        }
        others.iter().flat_map(carriers).map(|carriers| dot(&carriers, &usual)).collect()
    }

    /// The carrier that a column of force is nearest to being in proportion to, place by place, and the median over all
    /// places of its proportion to that: each place counts the same, however long the carriage was there.
    ///
    /// ```text
    /// force = r(place) c    r(place) = Σ c force/Σ c² over its rows
    /// ```
    ///
    /// Not the mean: where the other recording does not reach it, a joint of a fifth of the drag is not a hundredth of it
    /// everywhere.
    fn usual(&self, column: &[f64]) -> (usize, f64) {
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
        let met = sums[best].iter().filter(|[_, own]| *own > 0.0).map(|[with, own]| with / own);
        (best, median(met.collect()).unwrap_or(0.0))
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
    fn a_peak_at_one_place_is_not_what_the_drag_is_at_most_places_however_long_the_carriage_stayed() {
        let (places, x) = places();
        let joint = |from: f64, of: f64| -> Vec<f64> {
            x.iter().zip(&places.carriers).map(|(x, c)| if *x >= from { of * c[2] } else { 0.0 }).collect()
        };
        // where half of the rows are
        assert_eq!(places.usual(&joint(0.875, 0.2)), (2, 0.0));
        // a step of the height that most of the stroke lies behind
        let (carrier, ratio) = places.usual(&joint(0.3, 0.02));
        assert!(carrier == 2 && (ratio - 0.02).abs() < 1e-12, "{carrier} {ratio}");
    }

    #[test]
    fn what_acts_alike_everywhere_is_what_it_is_at_most_places() {
        let (places, x) = places();
        for carrier in 0..CARRIERS {
            let column: Vec<f64> = places.carriers.iter().map(|carriers| 0.3 * carriers[carrier]).collect();
            let (found, ratio) = places.usual(&column);
            assert!(found == carrier && (ratio - 0.3).abs() < 1e-12, "{found} {ratio}");
        }
        // a slope over the stroke is its middle
        let (carrier, ratio) = places.usual(&x);
        assert!(carrier == 0 && (ratio - 0.5).abs() < 0.02, "{carrier} {ratio}");
    }
}
