//! Whether both [locks](crate::noise::locks) open for a cause, and the p-value of what opened them.

use crate::fit::source::Source;
use crate::noise::locks::Locks;

/// Accepted probability of a false name, over all causes together.
const ALPHA: f64 = 0.01;

/// Logarithm of the largest e-value seen of noise: coloured noise that was taken for white.
const SEEN_OF_NOISE: f64 = 37.0;

/// Logarithm of an e-value that no noise reaches, however wrong the whitening, and the p-value that suffices beside it.
const BEYOND_NOISE: f64 = 120.0;
const BESIDE_IT: f64 = 0.25;

/// The p-value that suffices beside such an e-value for a table over places.
const BESIDE_IT_IN_EVERY_PASS: f64 = 0.02;

/// The first lock (e-value) spends three quarters of the evidence on folds that it does not test. Where the logarithm
/// of the second lock (score by blocks) exceeds [`MORE`] times its level, the first need only exceed its level divided
/// by [`LESS`].
const LESS: f64 = 2.0;
pub(crate) const MORE: f64 = 1.5;

/// What is asked of the second lock.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Asked {
    /// For effects that may act in a few blocks only (the fast run, the one warm-up), which scatter between blocks and
    /// might never open it: its level falls as the e-value grows.
    FewBlocks,
    /// For curves, which follow anything: some clean recordings have one, carried by few blocks, with an ln e of 60.
    /// And for causes tied to places, which are passed again and again.
    AllBlocks,
    /// For a table over places, which likewise follows anything, and is passed again and again.
    EveryPass,
}

impl Asked {
    pub(crate) fn of(source: &Source) -> Self {
        match source {
            _ if source.is_phase_bound() && source.is_table() => Asked::EveryPass,
            _ if source.is_story() || source.is_phase_bound() => Asked::AllBlocks,
            _ => Asked::FewBlocks,
        }
    }
}

/// Whether both locks open.
pub(crate) fn is_open(asked: Asked, locks: &Locks, kinds: usize, points: usize) -> bool {
    let level = level(kinds);
    let ln_e = locks.ln_e - (points.max(1) as f64).ln();
    (ln_e > level && -locks.p.ln() > enough(asked, ln_e, level))
        || (LESS * ln_e > level && -locks.p.ln() > MORE * level)
}

/// Level of the second lock beside an e-value, as a logarithm.
fn enough(asked: Asked, ln_e: f64, level: f64) -> f64 {
    let (way, beside_it) = match asked {
        Asked::FewBlocks => (((ln_e - SEEN_OF_NOISE) / (BEYOND_NOISE - SEEN_OF_NOISE)).clamp(0.0, 1.0), BESIDE_IT),
        Asked::AllBlocks => (f64::from(u8::from(ln_e > BEYOND_NOISE)), BESIDE_IT),
        Asked::EveryPass => (f64::from(u8::from(ln_e > BEYOND_NOISE)), BESIDE_IT_IN_EVERY_PASS),
    };
    level + way * (-beside_it.ln() - level)
}

/// Level of both locks, as a logarithm: evidence needed for one of `kinds` causes.
pub(crate) fn level(kinds: usize) -> f64 {
    (kinds.max(1) as f64 / ALPHA).ln()
}

/// p-value of the combination that opened the locks, as the best of `kinds` causes at `points` grid points.
pub(crate) fn p_of(asked: Asked, locks: &Locks, kinds: usize, points: usize) -> f64 {
    let level = level(kinds);
    let kinds = kinds.max(1) as f64;
    let ln_e = locks.ln_e - (points.max(1) as f64).ln();
    let by_e = (kinds.ln() - ln_e).exp().min(1.0);
    if ln_e > BEYOND_NOISE {
        return by_e;
    }
    let by_blocks = (kinds.ln() - LESS * ln_e).exp().max(kinds * locks.p.powf(1.0 / MORE));
    by_e.max(kinds * locks.p.powf(level / enough(asked, ln_e, level))).min(by_blocks).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_lock_opens_alone_and_what_opens_both_has_a_p_value_below_alpha() {
        let opens = |ln_e: f64, p: f64| is_open(Asked::FewBlocks, &Locks { ln_e, p }, 35, 1);
        assert!(opens(8.2, 2.8e-4) && !opens(8.2, 3e-4) && !opens(8.1, 2.8e-4));
        assert!(opens(4.1, 4e-6) && !opens(4.0, 1e-12) && !opens(4.1, 6e-6));
        assert!(!opens(37.0, 3e-4) && opens(79.0, 7.9e-3) && !opens(79.0, 9e-3));
        assert!(!is_open(Asked::AllBlocks, &Locks { ln_e: 79.0, p: 3e-4 }, 35, 1));
        assert!(opens(121.0, 0.2) && !opens(121.0, 0.3) && !opens(110.0, 0.2));
        let of = |asked, p| is_open(asked, &Locks { ln_e: 150.0, p }, 35, 1);
        assert!(of(Asked::AllBlocks, 0.1) && !of(Asked::EveryPass, 0.1) && of(Asked::EveryPass, 0.01));
        for points in [1, 150] {
            // on to where no noise reaches
            for at in 0..15_000 {
                let locks = Locks { ln_e: 0.5 * f64::from(at % 300), p: (-0.5 * f64::from(at / 300)).exp() };
                for asked in [Asked::FewBlocks, Asked::AllBlocks, Asked::EveryPass] {
                    if is_open(asked, &locks, 35, points) {
                        let p = p_of(asked, &locks, 35, points);
                        assert!(p <= 1.0001 * ALPHA, "{locks:?}: {p}");
                    }
                }
            }
        }
    }
}
