//! Tables over the position: shapes that no physics prescribes, piecewise linear between the ends of the stroke.

use super::Free;
use super::context::Context;
use super::definition::{Amplitude, Columns};

/// Entries of the finest table: the bolts of a rail are 80 mm apart, and a stroke is about a metre.
pub(super) const FINE: usize = 48;

/// Entries of a table for slow bends.
pub(super) const COARSE: usize = 16;

/// Names of entries, from the lower end of the stroke to the upper one.
const NAMES: [&str; FINE] = [
    "at_00", "at_01", "at_02", "at_03", "at_04", "at_05", "at_06", "at_07", "at_08", "at_09", "at_10", "at_11",
    "at_12", "at_13", "at_14", "at_15", "at_16", "at_17", "at_18", "at_19", "at_20", "at_21", "at_22", "at_23",
    "at_24", "at_25", "at_26", "at_27", "at_28", "at_29", "at_30", "at_31", "at_32", "at_33", "at_34", "at_35",
    "at_36", "at_37", "at_38", "at_39", "at_40", "at_41", "at_42", "at_43", "at_44", "at_45", "at_46", "at_47",
];

/// The entries of a table as amplitudes.
pub(super) const fn entries<const N: usize>(unit: &'static str, typical: f64) -> [Amplitude; N] {
    let mut entries = [Amplitude { name: "", unit, sign: Free, typical, least: 0.0, most: f64::INFINITY }; N];
    let mut n = 0;
    while n < N {
        entries[n].name = NAMES[n];
        n += 1;
    }
    entries
}

/// One column per entry: `force` times the entry's share at the position of each row. Beyond the ends the last entry is
/// held. `None` without a position or a stroke.
pub(super) fn over_stroke(context: &Context<'_>, force: &[f64], entries: usize, ends: &[f64]) -> Option<Columns> {
    let [from, to] = *ends else { return None };
    if !context.motion.has_position
        || to.partial_cmp(&from) != Some(std::cmp::Ordering::Greater)
        || !force.iter().any(|x| *x != 0.0)
    {
        return None;
    }
    let mut columns = vec![vec![0.0; context.len()]; entries];
    let last = entries.checked_sub(1).filter(|last| *last > 0)?;
    for (n, (x, force)) in context.motion.position_m.iter().zip(force).enumerate() {
        let at = ((x - from) / (to - from) * last as f64).clamp(0.0, last as f64);
        let left = (at as usize).min(last - 1);
        let share = at - left as f64;
        columns[left][n] = (1.0 - share) * force;
        columns[left + 1][n] = share * force;
    }
    Some(columns)
}
