//! Levels: measured speeds or loads that were meant to be equal.

/// Relative difference below which two values belong together. A rig's speeds and loads are set to a few percent, and
/// its steps are wider.
const APART: f64 = 0.05;

/// Level of every value, and the mean of each level in rising order.
pub fn levels(values: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let (mut of, mut means) = (vec![0; values.len()], Vec::new());
    let mut from = 0;
    while from < order.len() {
        let mut to = from + 1;
        // relative to the lowest of the level: a ladder of small steps is not one level
        let lowest = values[order[from]];
        while to < order.len() && values[order[to]] - lowest <= APART * values[order[to]].abs() {
            to += 1;
        }
        for n in &order[from..to] {
            of[*n] = means.len();
        }
        means.push(order[from..to].iter().map(|n| values[*n]).sum::<f64>() / (to - from) as f64);
        from = to;
    }
    (of, means)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_close_is_one_level() {
        let (of, means) = levels(&[20.9, 0.217, 10.5, 0.224, 20.8, 0.0, 10.4]);
        assert_eq!(of, [3, 1, 2, 1, 3, 0, 2]);
        assert_eq!(means.len(), 4);
        assert!((means[1] - 0.2205).abs() < 1e-12);
    }
}
