//! Bridges: straight lines across missing rows.

use std::ops::Range;

/// Ranges of missing rows.
pub(crate) fn gaps(is_told: &[bool]) -> Vec<Range<usize>> {
    let mut gaps: Vec<Range<usize>> = Vec::new();
    for n in (0..is_told.len()).filter(|n| !is_told[*n]) {
        match gaps.last_mut() {
            Some(gap) if gap.end == n => gap.end += 1,
            _ => gaps.push(n..n + 1),
        }
    }
    gaps
}

/// Puts a straight line across a gap of a column; at an end of the column the only neighbour is continued, and without
/// any neighbour the value is 0.
pub(crate) fn bridge(x: &mut [f64], gap: &Range<usize>) {
    let before = gap.start.checked_sub(1).map(|n| x[n]);
    let behind = x.get(gap.end).copied();
    let from = before.or(behind).unwrap_or(0.0);
    let rise = (behind.unwrap_or(from) - from) / (gap.len() + 1) as f64;
    for (k, x) in x[gap.clone()].iter_mut().enumerate() {
        *x = from + rise * (k + 1) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_lead_across_gaps_and_ends_last() {
        let told = [false, true, false, false, true, false];
        let mut x = [9.0, 1.0, 9.0, 9.0, 4.0, 9.0];
        for gap in gaps(&told) {
            bridge(&mut x, &gap);
        }
        assert_eq!(x, [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        let mut none = [9.0; 2];
        bridge(&mut none, &(0..2));
        assert_eq!(none, [0.0; 2]);
    }
}
