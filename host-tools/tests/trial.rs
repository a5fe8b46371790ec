//! A concealed trial from end to end, and every way to tamper with it.
//!
//! Needs Python with numpy and scipy; says so and passes where there is none.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn guideblock(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guideblock"))
        .args(words)
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .output()
        .unwrap()
}

fn has_python() -> bool {
    let asked = Command::new("python3").args(["-c", "import numpy, scipy"]).output();
    let is_there = asked.is_ok_and(|answer| answer.status.success());
    if !is_there {
        eprintln!("skipped: python3 with numpy and scipy is needed");
    }
    is_there
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    folder
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn text_of(value: &serde_json::Value) -> &str {
    value.as_str().unwrap()
}

fn make(folder: &Path, made_at: &str) -> String {
    make_of(folder, made_at, "8")
}

fn make_of(folder: &Path, made_at: &str, records: &str) -> String {
    let made = guideblock(&[
        "trial",
        "make",
        "--seed",
        "11",
        "--records",
        records,
        "--salt-seed",
        "1",
        "--made-at",
        made_at,
        "--python",
        "python3",
        "--out",
        text(folder),
    ]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    String::from_utf8(made.stdout).unwrap()
}

const DIAGNOSIS: &str = concat!("python3 ", env!("CARGO_MANIFEST_DIR"), "/tests/rule_of_thumb.py");

/// Runs, and says whether a namespace could be had.
fn run(folder: &Path) {
    let ran = guideblock(&["trial", "run", text(folder), "--answers-open", "--binary", DIAGNOSIS]);
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

/// Changes a file for the time of an opening; returns what was said and the exit status.
fn opened_with(folder: &Path, file: &str, change: impl Fn(&mut Vec<u8>)) -> (Option<i32>, String) {
    let path = folder.join(file);
    let before = fs::read(&path).unwrap();
    let mut after = before.clone();
    change(&mut after);
    assert_ne!(before, after);
    fs::write(&path, after).unwrap();
    let opened = guideblock(&["trial", "open", text(folder)]);
    fs::write(&path, before).unwrap();
    (opened.status.code(), String::from_utf8(opened.stderr).unwrap())
}

#[test]
fn a_trial_is_made_run_and_opened_and_no_tampering_passes() {
    if !has_python() {
        return;
    }
    let folder = folder("trial");
    let root = make(&folder, "1000");
    assert_eq!(fs::read_to_string(folder.join("root.txt")).unwrap(), root);
    run(&folder);
    let opened = guideblock(&["trial", "open", text(&folder)]);
    assert_eq!(opened.status.code(), Some(0), "{}", String::from_utf8_lossy(&opened.stderr));
    let score: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("score.json")).unwrap()).unwrap();
    let records = score[0]["records"].as_array().unwrap();
    let blocks: std::collections::BTreeSet<_> =
        records.iter().map(|record| record["block"].as_str().unwrap()).collect();
    assert_eq!(blocks.len(), 8, "every block");
    let page = fs::read_to_string(folder.join("trial.html")).unwrap();
    assert!(page.contains(root.trim()) && !page.contains("http://localhost"));
    let wrong: Vec<_> =
        records.iter().filter(|r| !["right", "rightly-silent"].contains(&text_of(&r["outcome"]))).collect();
    assert!(!wrong.is_empty());
    for record in wrong {
        let id = text_of(&record["id"]);
        // the pages of spoiled files have no picture
        let is_drawn = page.contains(&format!("{id} over time")) || record["block"] == "damaged";
        assert!(page.contains(&format!("<td>{id}</td>")) && is_drawn, "{id}");
    }

    let flip = |bytes: &mut Vec<u8>| {
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
    };
    for (file, complaint) in [
        ("answers/r0003.truth.json", "answers/r0003.truth.json: altered after it was sealed"),
        ("answers/r0003.truth-force.npy", "altered after it was sealed"),
        ("answers/trial.json", "answers/trial.json: altered after it was sealed"),
        ("records/r0002/recording.csv", "records/r0002/recording.csv: recording altered after the root was printed"),
        ("root.txt", "altered after the root was printed"),
        ("run/r0001.json", "diagnosis altered after the run"),
    ] {
        let (status, said) = opened_with(&folder, file, flip);
        assert_eq!(status, Some(1), "{file}: {said}");
        assert!(said.contains(complaint), "{file}: {said}");
    }
    let (status, said) = opened_with(&folder, "run/run.json", |bytes| {
        let mut run: serde_json::Value = serde_json::from_slice(bytes).unwrap();
        run["started_s"] = 999.into();
        *bytes = run.to_string().into_bytes();
    });
    assert_eq!(status, Some(1));
    assert!(said.contains("diagnosis older than the envelope"), "{said}");

    let again = guideblock(&["trial", "run", text(&folder), "--binary", DIAGNOSIS]);
    assert_eq!(again.status.code(), Some(2), "a trial is run once");
}

#[test]
fn a_part_of_a_trial_that_is_not_there_is_told_with_what_to_do() {
    let folder = folder("parts");
    fs::create_dir_all(&folder).unwrap();
    let refused = |step: &str, file: &str, advice: &str| {
        let output = guideblock(&["trial", step, text(&folder)]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{step}: {said}");
        let found = format!("guideblock: {}: not found; ", folder.join(file).display());
        assert!(said.starts_with(&found) && said.contains(advice), "{step}: {said}");
    };
    refused("run", "envelope.json", "`guideblock trial make --out`");
    refused("open", "envelope.json", "`guideblock trial seal`");
    refused("seal", "records", "one folder a record, records/ID/");
    fs::create_dir_all(folder.join("records")).unwrap();
    refused("seal", "records/ID", "with recording.csv and simulation.toml");
    fs::create_dir_all(folder.join("records/one")).unwrap();
    refused("seal", "answers/one.truth.json", "every record needs its answer");
    fs::create_dir_all(folder.join("answers")).unwrap();
    let truth = r#"{"kind": "clean", "effects": [], "expected_verdict": "match"}"#;
    fs::write(folder.join("answers/one.truth.json"), truth).unwrap();
    refused("seal", "answers/trial.json", "the list of all records");
    assert_eq!(fs::read_dir(folder.join("answers")).unwrap().count(), 1, "no salt of a refused sealing");
    fs::write(folder.join("answers/trial.json"), r#"{"seed": 0, "blocks": {"one": "clean"}}"#).unwrap();
    let sealed = guideblock(&["trial", "seal", text(&folder)]);
    assert!(sealed.status.success(), "{}", String::from_utf8_lossy(&sealed.stderr));

    fs::rename(folder.join("answers"), folder.join("hidden")).unwrap();
    refused("open", "answers/trial.salt", "bring the folder `answers` back");
    fs::rename(folder.join("hidden"), folder.join("answers")).unwrap();
    refused("open", "run/run.json", "`guideblock trial run DIR` first");
    fs::remove_file(folder.join("root.txt")).unwrap();
    refused("run", "root.txt", "the root that was printed");
}

#[test]
fn the_same_seeds_give_the_same_root() {
    if !has_python() {
        return;
    }
    let (one, other) = (folder("root-one"), folder("root-other"));
    assert_eq!(make(&one, "5"), make(&other, "5"));
}

#[test]
fn a_recording_altered_before_the_run_stops_it_and_a_spy_sees_no_answer() {
    if !has_python() {
        return;
    }
    let folder = folder("spy");
    make(&folder, "1000");
    let path = folder.join("records/r0001/simulation.toml");
    let before = fs::read(&path).unwrap();
    fs::write(&path, b"# other").unwrap();
    let stopped = guideblock(&["trial", "run", text(&folder), "--binary", DIAGNOSIS]);
    assert_eq!(stopped.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&stopped.stderr).contains("recording altered after the root was printed"));
    fs::write(&path, before).unwrap();

    // a program that copies what it can see of the answers into its diagnosis
    let spy = folder.join("spy.sh");
    fs::write(
        &spy,
        format!("umount {0}/answers\numount {0}/records\ncat {0}/answers/*.truth.json {0}/records/r0002/* > diagnosis.json\nexit 0\n", folder.display()),
    )
    .unwrap();
    let ran = guideblock(&["trial", "run", text(&folder), "--binary", &format!("sh {}", spy.display())]);
    if ran.status.code() == Some(2) {
        eprintln!("no namespaces here: the run was refused, as it should be");
        assert!(String::from_utf8_lossy(&ran.stderr).contains("answers can be read"));
        return;
    }
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    for n in 1..=8 {
        assert_eq!(fs::read(folder.join(format!("run/r000{n}.json"))).unwrap(), b"", "nothing was seen");
    }
    for (name, what, status) in [("slow", "sleep 9", "time-out"), ("crash", "kill -9 $$", "crash")] {
        let program = folder.join(format!("{name}.sh"));
        fs::write(&program, what).unwrap();
        let into = folder.join(name);
        let binary = format!("sh {}", program.display());
        let words = ["trial", "run", text(&folder), "--into", text(&into), "--limit", "0.3", "--jobs", "4"];
        assert!(guideblock(&[&words[..], &["--binary", &binary]].concat()).status.success());
        let run: serde_json::Value = serde_json::from_slice(&fs::read(into.join("run.json")).unwrap()).unwrap();
        assert!(run["records"].as_object().unwrap().values().all(|ending| ending["status"] == status), "{run}");
        assert!(guideblock(&["trial", "open", text(&folder), "--run", text(&into)]).status.success());
        let score: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("score.json")).unwrap()).unwrap();
        let records = score[0]["records"].as_array().unwrap();
        assert!(records.iter().all(|record| record["outcome"] == "no-answer"), "{name} counts as wrong");
    }
}

#[test]
fn the_scale_ends_at_who_knows_everything_and_tells_who_pads_or_misplaces() {
    if !has_python() {
        return;
    }
    let folder = folder("scale");
    make_of(&folder, "1000", "32");
    // laid open for the stand-in only: a copy where the run does not hide it
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scale-answers");
    let _ = fs::remove_dir_all(&copy);
    fs::create_dir_all(&copy).unwrap();
    for entry in fs::read_dir(folder.join("answers")).unwrap() {
        let from = entry.unwrap().path();
        fs::copy(&from, copy.join(from.file_name().unwrap())).unwrap();
    }
    let stand_in = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all_knowing.py");
    for mode in ["perfect", "padded", "misplaced"] {
        let binary = format!("python3 {stand_in} {mode} {}", copy.display());
        let into = folder.join(mode);
        let words = ["trial", "run", text(&folder), "--answers-open", "--into", text(&into), "--binary", &binary];
        let ran = guideblock(&words);
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    }
    let words = ["padded", "misplaced"].map(|mode| folder.join(mode));
    let run = folder.join("perfect");
    let opened = guideblock(&[
        "trial",
        "open",
        text(&folder),
        "--run",
        text(&run),
        "--rivals",
        text(&words[0]),
        text(&words[1]),
    ]);
    assert!(opened.status.success(), "{}", String::from_utf8_lossy(&opened.stderr));
    let score: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("score.json")).unwrap()).unwrap();
    let share = |n: usize, name: &str| {
        let share = &score[n]["summary"][name];
        (share["part"].as_u64().unwrap(), share["of"].as_u64().unwrap())
    };
    let all = |n: usize, name: &str| share(n, name).0 == share(n, name).1 && share(n, name).1 > 0;
    assert!(all(0, "right") && all(0, "axes") && all(0, "flagged") && all(0, "next_runs"), "{}", score[0]["summary"]);
    assert!(all(0, "covered_90") && all(0, "covered_95"), "{}", score[0]["summary"]);
    assert_eq!((share(0, "false_alarms").0, share(0, "wrong_names").0, share(0, "misses").0), (0, 0, 0));
    let gain = score[0]["summary"]["median_gain"].as_f64().unwrap();
    assert!((gain - 1.0).abs() < 1e-3, "{gain}");
    assert_eq!(score[0]["summary"]["calibration_error"], 0.0);
    let goals = score[0]["goals"].as_array().unwrap();
    // intervals that always hold the truth are too wide, and 32 records have not every kind
    assert!(
        goals.iter().all(|goal| goal["is_met"] != false || text_of(&goal["wanted"]).starts_with("90 %")),
        "{goals:?}"
    );

    let known =
        score[1]["records"].as_array().unwrap().iter().filter(|record| {
            ["sensor", "single", "pair", "triple", "undecidable"].contains(&text_of(&record["block"]))
        });
    assert!(known.clone().count() > 8 && known.clone().all(|record| record["outcome"] == "padded"));
    assert_eq!(share(2, "axes").0, 0);
    assert_eq!((share(2, "covered_95").0, score[2]["summary"]["median_gain"].as_f64().map(f64::abs)), (0, Some(0.0)));
    let page = fs::read_to_string(folder.join("trial.html")).unwrap();
    assert!(page.contains("<td>misplaced ") && page.contains("confusion matrix"));
}

#[test]
fn real_recordings_are_skipped_where_they_are_not() {
    let folder = folder("real");
    let words = [
        "trial",
        "real",
        "--binary",
        env!("CARGO_BIN_EXE_guideblock"),
        "--data",
        text(&folder),
        "--out",
        text(&folder),
    ];
    let skipped = guideblock(&words);
    assert_eq!(skipped.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&skipped.stderr).contains("skipped: none of the recordings"));
    assert!(!folder.join("real.html").exists());
}

/// The answer that the bench protocol shows for copying is one that the opening reads.
#[test]
fn the_example_of_the_bench_protocol_is_an_answer() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/bench-protocol.md");
    let page = fs::read_to_string(page).unwrap();
    let example = page.split("```json\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let truth: host_tools::trial::score::truth::Truth = serde_json::from_str(example).unwrap();
    assert_eq!((truth.expected_verdict.as_str(), truth.effects[0].id.as_str()), ("explained", "force-offset"));
    assert_eq!(truth.effects[0].number("offset_n"), Some(-4.9));
}

#[test]
fn an_envelope_filled_by_hand_is_sealed_and_scored() {
    if !has_python() {
        return;
    }
    let folder = folder("by-hand");
    fs::create_dir_all(folder.join("answers")).unwrap();
    // 40 N against the motion: the rule of thumb calls it seal-drag; 10 N: nothing
    let rows = |force: f64| -> String {
        (0..400)
            .map(|n| {
                let sign = if n % 100 < 50 { 1.0 } else { -1.0 };
                format!("{:.2},{:.4},{:.3}\n", 0.01 * f64::from(n), 0.1 * sign, sign * force + 0.01 * f64::from(n % 7))
            })
            .collect()
    };
    for (id, force, effects, verdict) in [
        ("card-1", 40.0, r#"[{"id": "seal-drag", "ideal_z": 100, "strength_alone_pct": 5}]"#, "explained"),
        ("card-2", 10.0, "[]", "match"),
        ("card-3", 10.0, r#"[{"id": "inertia", "ideal_z": 100, "strength_alone_pct": 2}]"#, "explained"),
    ] {
        let record = folder.join("records").join(id);
        fs::create_dir_all(&record).unwrap();
        fs::write(record.join("recording.csv"), format!("time_s,velocity_m_s,drag_force_n\n{}", rows(force))).unwrap();
        fs::write(
            record.join("simulation.toml"),
            "schema = \"guideblock.simulation/1\"\n[lubricant]\nviscosity_cst = 100.0\n[operation]\npreload_n = 1000.0\n",
        )
        .unwrap();
        let truth = format!(r#"{{"kind": "single", "effects": {effects}, "expected_verdict": "{verdict}"}}"#);
        if id != "card-3" {
            fs::write(folder.join(format!("answers/{id}.truth.json")), truth).unwrap();
        } else {
            let refused = guideblock(&["trial", "seal", text(&folder)]);
            assert!(String::from_utf8_lossy(&refused.stderr).contains("card-3.truth.json: not found; every record"));
            // what the opening could not read is refused while it can still be mended
            fs::write(folder.join(format!("answers/{id}.truth.json")), r#"{"card": "mass", "kg": 0.2}"#).unwrap();
            let refused = guideblock(&["trial", "seal", text(&folder)]);
            let said = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(3), "{said}");
            assert!(said.contains("card-3.truth.json: missing field `kind`"), "{said}");
            assert!(!folder.join("answers/card-1.salt").exists() && !folder.join("root.txt").exists());
            fs::write(folder.join(format!("answers/{id}.truth.json")), truth).unwrap();
        }
    }
    let blocks = r#"{"seed": 0, "blocks": {"card-1": "single", "card-2": "clean", "card-3": "single"}}"#;
    fs::write(folder.join("answers/trial.json"), blocks.replace("card-3", "card-4")).unwrap();
    let refused = guideblock(&["trial", "seal", text(&folder)]);
    assert!(String::from_utf8_lossy(&refused.stderr).contains("trial.json: no block of record card-3"));
    fs::write(folder.join("answers/trial.json"), blocks).unwrap();
    let sealed = guideblock(&["trial", "seal", text(&folder)]);
    assert!(sealed.status.success(), "{}", String::from_utf8_lossy(&sealed.stderr));
    assert_eq!(fs::read(folder.join("root.txt")).unwrap(), sealed.stdout);
    assert_eq!(guideblock(&["trial", "seal", text(&folder)]).status.code(), Some(2), "once");
    run(&folder);
    let opened = guideblock(&["trial", "open", text(&folder)]);
    assert!(opened.status.success(), "{}", String::from_utf8_lossy(&opened.stderr));
    let score: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("score.json")).unwrap()).unwrap();
    let outcomes: Vec<&str> =
        score[0]["records"].as_array().unwrap().iter().map(|record| text_of(&record["outcome"])).collect();
    assert_eq!(outcomes, ["right", "right", "missed"]);
    assert!(fs::read_to_string(folder.join("trial.html")).unwrap().contains("card-3 over time"));
}
