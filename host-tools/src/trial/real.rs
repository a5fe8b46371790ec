//! Real recordings beside the trial: findings of their authors against those of the diagnosis.
//!
//! The data are not part of the project and their licences differ, so the user names a folder; they are read as they
//! are, through column mappings. The right answers are those of the publications; no more is required than they state.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Serialize;

use super::score::answer::Diagnosis;
use super::{TrialError, at, commitment, json, write};
use crate::recording::{Mapping, silent, table};
use crate::report::page::Page;

/// One real recording and what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// Its source.
    pub source: &'static str,
    /// File in the folder.
    pub file: &'static str,
    /// File that is only scored.
    pub holdout: Option<&'static str>,
    /// How columns and rows are read.
    pub reading: &'static [&'static str],
    /// The simulation that it is held against.
    pub simulation: &'static str,
    /// What its authors state.
    pub stated: &'static str,
    /// Ids of which one must be named; none: nothing of that kind is asked.
    pub wanted: &'static [&'static str],
    /// Ids that must not be named.
    pub refused: &'static [&'static str],
    /// The verdict where only one is right.
    pub verdict: Option<&'static str>,
    /// Error of the published simulation, % of the force's RMS.
    pub published_pct: Option<f64>,
}

/// Simulation file of a screw drive whose friction and offset are unknown and fitted.
const FITTED: &str = "schema = \"guideblock.simulation/1\"\n\n[guide]\nlaw = \"coulomb-viscous\"\n\n[axis]\nmoved_mass_kg = 0.0\n\
                      position_reference = \"relative\"\n\n[tolerance]\nfriction = 0.03\nrelevance = 0.001\n";

/// The published symmetric model of the EMPS axis.
const EMPS: &str = "schema = \"guideblock.simulation/1\"\n\n[guide]\nlaw = \"coulomb-viscous\"\ncoulomb_n = 20.394\nviscous_n_s_m = 203.5\n\
                    offset_n = -3.165\n\n[axis]\nmoved_mass_kg = 95.109\nzero_speed_m_s = 1e-3\nposition_reference = \"relative\"\n\n\
                    [tolerance]\nfriction = 0.03\nmass = 0.02\nrelevance = 0.001\n";

/// Columns of the lead screws: 1 mm of travel a radian stands for the unknown lead, 1 N for 1 mN m. A run is called by
/// the speed it was set to, in rpm; the measured speed comes in steps of 1 rpm, whose differences are no acceleration.
/// Runs that turned back are called n10 to n200, which is no number; they are left out.
const SCREW: [&str; 4] = ["time_s=t_s", "velocity_m_s=run:1.0472e-4", "drag_force_n=torque_Nm:1e3", "segment=run"];

/// The recordings.
pub const CASES: [Case; 4] = [
    Case {
        name: "EMPS, prismatic axis",
        source: "Janot, Gautier, Brunot 2019, nonlinearbenchmark.org",
        file: "emps_train.csv",
        holdout: Some("emps_pulses.csv"),
        reading: &[],
        simulation: EMPS,
        stated: "The friction differs by direction (fatigue of the screw); a flexibility is suspected. Their symmetric \
                 model misses the force of the second file by 5.98 %.",
        wanted: &["direction-asymmetry"],
        refused: &[],
        verdict: None,
        published_pct: Some(5.982),
    },
    Case {
        name: "Lead screw, plain nut",
        source: "Mablekos-Alexiou, da Cruz, Bergeles, IEEE T-RO 37(4), 2021",
        file: "leadscrew_runs.csv",
        holdout: None,
        reading: &[
            "--column", SCREW[0], "--column", SCREW[1], "--column", SCREW[2], "--column", SCREW[3], "--where",
            "drive=1",
        ],
        simulation: FITTED,
        stated: "Friction falls with speed first: a Stribeck term is needed. Forward runs only.",
        wanted: &["stribeck"],
        refused: &[],
        verdict: None,
        published_pct: None,
    },
    Case {
        name: "Lead screw, preloaded nut",
        source: "Mablekos-Alexiou, da Cruz, Bergeles, IEEE T-RO 37(4), 2021",
        file: "leadscrew_runs.csv",
        holdout: None,
        reading: &[
            "--column", SCREW[0], "--column", SCREW[1], "--column", SCREW[2], "--column", SCREW[3], "--where",
            "drive=2",
        ],
        simulation: FITTED,
        stated: "Negative control: a Stribeck term makes speeds that were left out worse. Forward runs only.",
        wanted: &[],
        refused: &["stribeck"],
        verdict: None,
        published_pct: None,
    },
    Case {
        name: "Ball screw over 1015 h",
        source: "Xi'an Jiaotong University, XJTU ball screw degradation data set",
        file: "xjtu_wear.csv",
        holdout: None,
        reading: &[
            "--column",
            "time_s=hours:3600",
            // lead 8 mm
            "--column",
            "velocity_m_s=speed_rpm_of_next_block:1.3333e-4",
            "--column",
            "drag_force_n=friction_torque_upper:785.4",
        ],
        simulation: FITTED,
        stated: "Friction torque falls by 38 % with wear; 30 readings, speed and age go together. Too little to name a cause.",
        wanted: &[],
        refused: &[],
        verdict: Some("insufficient-data"),
        published_pct: None,
    },
];

/// Diagnosis of one recording.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Its name.
    pub name: &'static str,
    /// Exit status; `crash` without one.
    pub status: String,
    /// The verdict.
    pub verdict: String,
    /// What was named, sets joined by `or`.
    pub named: Vec<String>,
    /// Whether all that the authors state was met.
    pub is_right: bool,
    /// Errors on the hold-out, % of its force's RMS: as given or calibrated, and after the search.
    pub error_pct: Option<(f64, f64)>,
    /// Error of the published simulation, %.
    pub published_pct: Option<f64>,
    /// Hash of the recording.
    pub recording: String,
}

/// Diagnoses every recording that is in `data`; those that are not there are left out.
///
/// # Errors
/// [`TrialError::Tool`] where the program cannot be started, [`TrialError::File`] where nothing can be written.
pub fn run(program: &str, data: &Path, out: &Path) -> Result<Vec<Answer>, TrialError> {
    fs::create_dir_all(out).map_err(at(out))?;
    let mut answers = Vec::new();
    for (n, case) in CASES.iter().enumerate() {
        let file = data.join(case.file);
        if file.is_file() {
            answers.push(one(program, case, data, &out.join(format!("real-{}", n + 1)))?);
        }
    }
    Ok(answers)
}

fn one(program: &str, case: &Case, data: &Path, stem: &Path) -> Result<Answer, TrialError> {
    let (simulation, diagnosis) = (stem.with_extension("toml"), stem.with_extension("json"));
    write(&simulation, case.simulation)?;
    if diagnosis.exists() {
        fs::remove_file(&diagnosis).map_err(at(&diagnosis))?;
    }
    let mut command = Command::new(program);
    command.arg("diagnose").arg(data.join(case.file)).args(case.reading);
    command.arg("--simulation").arg(&simulation).arg("--json").arg(&diagnosis);
    if let Some(holdout) = case.holdout {
        command.arg("--holdout").arg(data.join(holdout));
    }
    let ended = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    let ended = ended.map_err(|why| TrialError::Tool(format!("{program}: {why}")))?;
    let said: Option<Diagnosis> = json(&diagnosis).ok().and_then(|value| serde_json::from_value(value).ok());
    // a file that cannot be used at all may end without a report
    let refused = || Diagnosis { verdict: "insufficient-data".to_owned(), ..Diagnosis::default() };
    let said = said.or_else(|| (ended.code() == Some(3)).then(refused)).unwrap_or_default();
    let size_n = force_rms(case, data);
    let errors = said.holdout.as_ref().and_then(|h| Some((h.rmse_calibrated_n?, h.rmse_after_n?)));
    Ok(Answer {
        name: case.name,
        status: ended.code().map_or_else(|| "crash".to_owned(), |code| format!("exit {code}")),
        is_right: is_right(case, &said),
        named: said
            .mechanisms
            .iter()
            .map(|entry| std::iter::once(&entry.id).chain(&entry.equivalents).cloned().collect::<Vec<_>>().join(" or "))
            .collect(),
        error_pct: errors.zip(size_n).map(|((before, after), size)| (100.0 * before / size, 100.0 * after / size)),
        published_pct: case.published_pct,
        recording: commitment::hash_file(&data.join(case.file))?,
        verdict: said.verdict,
    })
}

fn is_right(case: &Case, said: &Diagnosis) -> bool {
    let names = |id: &str| said.mechanisms.iter().any(|entry| entry.set().contains(id));
    !said.verdict.is_empty()
        && case.verdict.is_none_or(|wanted| wanted == said.verdict)
        && (case.wanted.is_empty() || case.wanted.iter().any(|id| names(id)))
        && !case.refused.iter().any(|id| names(id))
}

/// RMS of the force that the hold-out errors refer to, where it is a file of its own.
fn force_rms(case: &Case, data: &Path) -> Option<f64> {
    let mappings: Vec<Mapping> = Vec::new();
    let (table, _) = table::open(&data.join(case.holdout?), &["drag_force_n"], &[], &mappings, &[], &silent).ok()?;
    let force = table.column("drag_force_n")?;
    Some((force.iter().map(|f| f * f).sum::<f64>() / force.len().max(1) as f64).sqrt())
}

/// The page.
pub fn page(program: &str, hash: &str, answers: &[Answer]) -> String {
    let mut page = Page::new("Real recordings");
    let right = answers.iter().filter(|answer| answer.is_right).count();
    page.lead(&format!("{right} of {} recordings answered as their authors state.", answers.len()));
    page.prose(
        "Measured by others, published with what they found. Nothing is hidden here, so this proves less than the concealed \
         trial; it shows that the same program reads foreign machines. Read as published, through column mappings. Names \
         that the authors say nothing about are not judged; errors are those of the rows that the program compares.",
    );
    page.table(
        &["what", "value"],
        &[
            vec!["program".to_owned(), program.rsplit('/').next().unwrap_or(program).to_owned()],
            vec!["BLAKE3 of it".to_owned(), hash.to_owned()],
        ],
    );
    let by_name: BTreeMap<&str, &Case> = CASES.iter().map(|case| (case.name, case)).collect();
    for answer in answers {
        page.heading(answer.name);
        let mut rows = Vec::new();
        if let Some(case) = by_name.get(answer.name) {
            let asked = match (case.wanted, case.refused, case.verdict) {
                ([], [], Some(verdict)) => verdict.to_owned(),
                ([], refused, _) => format!("not {}", refused.join(", not ")),
                (wanted, ..) => wanted.join(" or "),
            };
            rows.push(vec!["source".to_owned(), case.source.to_owned()]);
            rows.push(vec!["stated by its authors".to_owned(), case.stated.to_owned()]);
            rows.push(vec!["right answer".to_owned(), asked]);
        }
        let names = if answer.named.is_empty() { "nothing named".to_owned() } else { answer.named.join(", ") };
        rows.push(vec!["answer".to_owned(), format!("{}: {names} ({})", answer.verdict, answer.status)]);
        rows.push(vec!["as stated".to_owned(), if answer.is_right { "yes" } else { "NO" }.to_owned()]);
        if let Some((before, after)) = answer.error_pct {
            rows.push(vec![
                "error on the second file (% of its force)".to_owned(),
                format!(
                    "published {}, calibrated {before:.2}, with what was found {after:.2}",
                    answer.published_pct.map_or_else(|| "-".to_owned(), |p| format!("{p:.2}"))
                ),
            ]);
        }
        rows.push(vec!["BLAKE3 of the recording".to_owned(), answer.recording.clone()]);
        page.table(&["what", "value"], &rows);
    }
    page.finish()
}

/// The folder of the recordings that `GUIDEBLOCK_DATA` names.
pub fn data_folder() -> Option<PathBuf> {
    std::env::var_os("GUIDEBLOCK_DATA").map(PathBuf::from)
}

#[cfg(test)]
mod tests {
    use super::super::score::answer::Named;
    use super::*;

    #[test]
    fn an_answer_is_held_against_what_the_authors_state() {
        let said = |verdict: &str, ids: &[&str]| Diagnosis {
            verdict: verdict.into(),
            mechanisms: ids.iter().map(|id| Named { id: (*id).into(), ..Named::default() }).collect(),
            ..Diagnosis::default()
        };
        let [emps, plain, preloaded, wear] = &CASES;
        for (case, answer, expected) in [
            (emps, said("explained", &["viscous-drag", "direction-asymmetry"]), true),
            (emps, said("explained", &["inertia"]), false),
            (plain, said("match", &[]), false),
            (preloaded, said("match", &[]), true),
            (preloaded, said("explained", &["stribeck"]), false),
            (wear, said("insufficient-data", &[]), true),
            (wear, said("explained", &["preload-loss"]), false),
            // nothing readable was said
            (preloaded, Diagnosis::default(), false),
        ] {
            assert_eq!(is_right(case, &answer), expected, "{} {answer:?}", case.name);
        }
    }

    #[test]
    fn absent_recordings_are_left_out() {
        let out = std::env::temp_dir().join(format!("guideblock-real-{}", std::process::id()));
        assert!(run("no-such-program", &out.join("none"), &out).unwrap().is_empty());
        fs::remove_dir_all(&out).unwrap();
    }
}
