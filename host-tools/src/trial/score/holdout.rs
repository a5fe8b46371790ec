//! Hold-out error removed, relative to that removed by an oracle that knows the form and every constant.
//!
//! ```text
//! gain = (calibrated² - after²) / (calibrated² - oracle²)
//! ```
//!
//! The first two errors are those the diagnosis states. The oracle's is that of the recorded force, its RMS distance from
//! the true noise-free force over the same part, from the generator's own array, where the carriage moves (at rest no law
//! has a force, and a diagnosis no error), and beside it that of the recorded acceleration: an oracle too computes the
//! force from the recorded motion.

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

/// Speed below which the generator's carriage is at rest, m/s, and half the time over which it is taken, s.
const AT_REST_M_S: f64 = 3e-5;
const BESIDE_S: f64 = 0.02;

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
    if !array.is_file() || (stated.intervals_of.is_empty() && files.len() > 1) {
        return Ok(None);
    }
    let mut force_n = floats(&array)?.into_iter();
    let mut errors = Vec::new();
    for (at, file) in files.iter().enumerate() {
        let wanted = ["time_s", "drag_force_n", "position_m"];
        let Ok((table, _)) = table::open(file, &wanted, &[], &[], &[], &silent) else { return Ok(None) };
        let [Some(t), Some(f), Some(x)] = wanted.map(|name| table.column(name)) else { return Ok(None) };
        let first = t.first().copied().unwrap_or(0.0);
        let moves = moves(t, x);
        for (n, (t, recorded)) in t.iter().zip(f).enumerate() {
            let Some(is) = force_n.next() else { return Ok(None) };
            if moves[n] && (own.is_file() || is_held(stated, at, t - first)) {
                errors.push(recorded - is);
            }
        }
    }
    let sum: f64 = errors.iter().map(|e| e * e).sum();
    let of_force_n = (!errors.is_empty() && force_n.next().is_none()).then(|| (sum / errors.len() as f64).sqrt());
    Ok(of_force_n.map(|n| n.hypot(truth.acceleration_noise_n)))
}

/// Whether a time of a recording, s from its first row, is in an interval that is stated of it.
fn is_held(stated: &Holdout, recording: usize, t: f64) -> bool {
    let of = stated.intervals_of.iter().copied().chain(std::iter::repeat(0));
    stated.intervals_s.iter().zip(of).any(|([from, to], of)| of == recording && t >= *from && t <= *to)
}

/// Where the carriage moves.
fn moves(time_s: &[f64], position_m: &[f64]) -> Vec<bool> {
    let (mut from, mut to) = (0, 0);
    let mut moves = Vec::with_capacity(time_s.len());
    for t in time_s {
        while t - time_s[from] > BESIDE_S {
            from += 1;
        }
        while to + 1 < time_s.len() && time_s[to + 1] - t <= BESIDE_S {
            to += 1;
        }
        let way_m = (position_m[to.max(from)] - position_m[from]).abs();
        moves.push(way_m > AT_REST_M_S * (time_s[to.max(from)] - time_s[from]));
    }
    moves
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
    fn the_oracle_is_held_against_what_moves_in_the_stated_part_only() {
        let folder = std::env::temp_dir().join(format!("guideblock-oracle-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("records/r1")).unwrap();
        std::fs::create_dir_all(folder.join("answers")).unwrap();
        // two recordings of ten rows; at rest in the last three of each, where the force is far off
        let rows = |error: f64| -> String {
            let row = |n: i32| {
                format!("{:.2},{},{}\n", 0.01 * f64::from(n), 1.0 + if n < 7 { error } else { 99.0 }, n.min(6))
            };
            (0..12).map(row).collect()
        };
        for (name, error) in [("recording.csv", 1.0), ("recording-2.csv", 4.0)] {
            let text = format!("time_s,drag_force_n,position_m\n{}", rows(error));
            std::fs::write(folder.join("records/r1").join(name), text).unwrap();
        }
        let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 12), }";
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
        bytes.extend(header.bytes());
        (0..24).for_each(|_| bytes.extend(1.0_f32.to_le_bytes()));
        std::fs::write(folder.join("answers/r1.truth-force.npy"), &bytes).unwrap();
        let truth = Truth { files: vec!["recording.csv".into(), "recording-2.csv".into()], ..Truth::default() };
        let of = |intervals_s: Vec<[f64; 2]>, intervals_of: Vec<usize>| {
            oracle(&folder, "r1", &truth, &Holdout { intervals_s, intervals_of, ..Holdout::default() }).unwrap()
        };
        let near = |error: Option<f64>, wanted: f64| error.is_some_and(|error| (error - wanted).abs() < 1e-12);
        assert!(near(of(vec![[0.0, 0.045]], vec![0]), 1.0) && near(of(vec![[0.0, 0.045]], vec![1]), 4.0));
        // as many rows of either: sqrt((1 + 16)/2)
        assert!(near(of(vec![[0.0, 0.045], [0.0, 0.045]], vec![0, 1]), 8.5f64.sqrt()));
        let shaken = Truth { acceleration_noise_n: 0.75, ..truth.clone() };
        let stated = Holdout { intervals_s: vec![[0.0, 0.045]], intervals_of: vec![0], ..Holdout::default() };
        assert!(
            near(oracle(&folder, "r1", &shaken, &stated).unwrap(), 1.25),
            "the noise of the acceleration beside it"
        );
        assert_eq!(of(vec![[0.0, 0.045]], vec![]), None, "of which of two recordings?");
        assert_eq!(of(vec![], vec![]), None);
        assert_eq!(of(vec![[0.095, 0.12]], vec![0]), None, "at rest");
        std::fs::write(folder.join("answers/r1.truth-force.npy"), b"other").unwrap();
        assert!(oracle(&folder, "r1", &truth, &stated).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
