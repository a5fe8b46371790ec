//! How much of the hold-out error was removed, of what an oracle removes that knows the true force.
//!
//! `gain = (calibrated² - after²) / (calibrated² - oracle²)`. The first two errors are those the diagnosis states; the
//! oracle's is the RMS of recorded less true noise-free force over the same part, from the generator's own array.

use std::path::Path;

use super::answer::Holdout;
use super::truth::Truth;
use crate::recording::{silent, table};
use crate::trial::{TrialError, malformed, read};

/// Effects whose recorded force or motion is not the true one plus noise, so that no oracle of this kind exists.
pub const WITHOUT_ORACLE: [&str; 4] = ["force-quantisation", "force-saturation", "speed-noise", "encoder-cyclic-error"];

/// Share of the reducible squared error that was removed; `None` where nothing is reducible or nothing was stated.
pub fn gain(stated: &Holdout, oracle_n: f64) -> Option<f64> {
    let (before, after) = (stated.rmse_calibrated_n?.powi(2), stated.rmse_after_n?.powi(2));
    let floor = oracle_n * oracle_n;
    (before > 1.02 * floor).then(|| (before - after) / (before - floor))
}

/// The oracle's error over the hold-out that the diagnosis states, N; `None` where there is no such oracle.
///
/// # Errors
/// [`TrialError`] where an array of the generator cannot be read.
pub fn oracle(folder: &Path, id: &str, truth: &Truth, stated: &Holdout) -> Result<Option<f64>, TrialError> {
    if truth.kind == "damaged" || truth.effects.iter().any(|effect| WITHOUT_ORACLE.contains(&effect.id.as_str())) {
        return Ok(None);
    }
    let record = folder.join("records").join(id);
    let own = record.join("holdout.csv");
    let (files, array) = if own.is_file() {
        (vec![own.as_path().to_owned()], "truth-force-holdout.npy")
    } else {
        (truth.files().iter().map(|name| record.join(name)).collect(), "truth-force.npy")
    };
    let array = folder.join("answers").join(format!("{id}.{array}"));
    if !array.is_file() {
        return Ok(None);
    }
    let force_n = floats(&array)?;
    let (mut time_s, mut recorded_n) = (Vec::new(), Vec::new());
    for file in &files {
        let Ok((table, _)) = table::open(file, &["time_s", "drag_force_n"], &[], &[], &[], &silent) else {
            return Ok(None);
        };
        let (Some(t), Some(f)) = (table.column("time_s"), table.column("drag_force_n")) else { return Ok(None) };
        time_s.extend_from_slice(t);
        recorded_n.extend_from_slice(f);
    }
    if recorded_n.len() != force_n.len() {
        return Ok(None);
    }
    let first = time_s.first().copied().unwrap_or(0.0);
    let is_held = |t: f64| own.is_file() || stated.intervals_s.iter().any(|[from, to]| t >= *from && t <= *to);
    let errors: Vec<f64> = time_s
        .iter()
        .zip(recorded_n.iter().zip(&force_n))
        .filter(|(t, _)| is_held(**t - first))
        .map(|(_, (recorded, is))| recorded - is)
        .collect();
    let sum: f64 = errors.iter().map(|e| e * e).sum();
    Ok((!errors.is_empty()).then(|| (sum / errors.len() as f64).sqrt()))
}

/// Reads an array of 32-bit floats in NumPy's format, row by row.
///
/// # Errors
/// [`TrialError::Malformed`] where it is anything else.
pub fn floats(path: &Path) -> Result<Vec<f64>, TrialError> {
    let bytes = read(path)?;
    let body = (|| {
        let rest = bytes.strip_prefix(b"\x93NUMPY\x01")?;
        let length = usize::from(u16::from_le_bytes([*rest.get(1)?, *rest.get(2)?]));
        let header = String::from_utf8_lossy(rest.get(3..3 + length)?).replace(' ', "");
        (header.contains("'descr':'<f4'") && header.contains("'fortran_order':False")).then_some(())?;
        rest.get(3 + length..)
    })();
    let body = body.ok_or_else(|| malformed(path, "a NumPy array of little-endian 32-bit floats was expected"))?;
    Ok(body.as_chunks::<4>().0.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gain_is_the_share_of_what_an_oracle_removes() {
        let of = |after: f64| {
            gain(&Holdout { rmse_calibrated_n: Some(5.0), rmse_after_n: Some(after), ..Holdout::default() }, 3.0)
                .map(|g| (g * 1e9).round() / 1e9)
        };
        assert_eq!(of(3.0), Some(1.0));
        assert_eq!(of(5.0), Some(0.0));
        assert_eq!(of(17.0_f64.sqrt()), Some(0.5));
        assert_eq!(of(6.0), Some(-0.6875), "worse than before");
        let nothing = Holdout { rmse_calibrated_n: Some(3.01), rmse_after_n: Some(3.0), ..Holdout::default() };
        assert_eq!(gain(&nothing, 3.0), None);
        assert_eq!(gain(&Holdout::default(), 3.0), None);
    }

    #[test]
    fn the_oracle_is_held_against_the_stated_part_only() {
        let folder = std::env::temp_dir().join(format!("guideblock-oracle-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("records/r1")).unwrap();
        std::fs::create_dir_all(folder.join("answers")).unwrap();
        let rows: String = (0..10).map(|n| format!("{n}.0,{}\n", if n < 5 { 2.0 } else { 5.0 })).collect();
        std::fs::write(folder.join("records/r1/recording.csv"), format!("time_s,drag_force_n\n{rows}")).unwrap();
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 5), }";
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
        bytes.extend(header.bytes());
        (0..10).for_each(|_| bytes.extend(1.0_f32.to_le_bytes()));
        std::fs::write(folder.join("answers/r1.truth-force.npy"), &bytes).unwrap();
        let truth = Truth { files: vec!["recording.csv".into()], ..Truth::default() };
        let of = |intervals_s: Vec<[f64; 2]>| {
            oracle(&folder, "r1", &truth, &Holdout { intervals_s, ..Holdout::default() }).unwrap()
        };
        assert_eq!(of(vec![[0.0, 4.5]]), Some(1.0));
        assert_eq!(of(vec![[4.5, 9.0]]), Some(4.0));
        assert_eq!(of(vec![]), None);
        std::fs::write(folder.join("answers/r1.truth-force.npy"), b"other").unwrap();
        assert!(oracle(&folder, "r1", &truth, &Holdout::default()).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
