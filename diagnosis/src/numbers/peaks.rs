//! Peaks: the highest entries of a spectrum that are not on each other's flanks.

/// Indices of at most `most` highest entries above `least`, each more than `apart` from the higher ones, highest first.
pub(crate) fn peaks(spectrum: &[f64], most: usize, apart: usize, least: f64) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    for _ in 0..most {
        let is_apart = |k: &usize| found.iter().all(|other| k.abs_diff(*other) > apart);
        let best = (0..spectrum.len()).filter(is_apart).max_by(|a, b| spectrum[*a].total_cmp(&spectrum[*b]));
        found.extend(best.filter(|k| spectrum[*k] > least));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::peaks;

    #[test]
    fn flanks_and_what_is_too_low_are_no_peaks() {
        let spectrum = [0.0, 3.0, 9.0, 8.0, 1.0, 0.0, 5.0, 2.0, 0.5];
        assert_eq!(peaks(&spectrum, 3, 1, 2.0), [2, 6]);
        assert_eq!(peaks(&spectrum, 1, 1, 2.0), [2]);
        assert_eq!(peaks(&spectrum, 3, 0, 2.0), [2, 3, 6]);
        assert!(peaks(&[], 3, 1, 2.0).is_empty());
    }
}
