//! Dependencies point one way: mathematics <- model-core <- can-wire <- { firmware, host-tools } <- tests.

use std::collections::BTreeSet;
use std::path::Path;

/// Every workspace crate and the workspace crates it may depend on.
const LAYERS: [(&str, &[&str]); 10] = [
    ("model-core", &[]),
    ("can-wire", &["model-core"]),
    ("firmware", &["model-core", "can-wire"]),
    ("simulation", &["model-core"]),
    ("calibration", &["model-core", "simulation"]),
    ("diagnosis", &["model-core", "simulation"]),
    ("host-tools/virtual-board", &[]),
    ("host-tools", &["model-core", "can-wire", "simulation", "calibration", "diagnosis", "virtual-board"]),
    ("tests/on-target", &["model-core"]),
    (
        "tests",
        &[
            "model-core",
            "can-wire",
            "simulation",
            "calibration",
            "diagnosis",
            "host-tools",
            "virtual-board",
            "on-target",
            "firmware",
        ],
    ),
];

/// All that model-core may take from outside: mathematics, and derives that are off by default.
const MATHEMATICS: [&str; 4] = ["libm", "micromath", "serde", "serde_derive"];

fn manifest(folder: &str) -> toml::Table {
    let path = system_tests::root().join(folder).join("Cargo.toml");
    std::fs::read_to_string(&path).expect(folder).parse().expect(folder)
}

/// Names in every dependency table of a manifest, target-specific and build ones included.
fn dependencies(table: &toml::Table, out: &mut BTreeSet<String>) {
    for (key, value) in table {
        let Some(value) = value.as_table() else { continue };
        match key.as_str() {
            "dependencies" | "build-dependencies" => out.extend(value.keys().cloned()),
            "target" => value.values().filter_map(|v| v.as_table()).for_each(|t| dependencies(t, out)),
            _ => {}
        }
    }
}

#[test]
fn dependencies_point_one_way() {
    let ours: Vec<&str> =
        LAYERS.iter().map(|(folder, _)| Path::new(folder).file_name().unwrap().to_str().unwrap()).collect();
    for (folder, allowed) in LAYERS {
        let mut found = BTreeSet::new();
        dependencies(&manifest(folder), &mut found);
        for name in found.iter().filter(|n| ours.contains(&n.as_str())) {
            assert!(allowed.contains(&name.as_str()), "{folder} must not know {name}");
        }
        if folder == "model-core" {
            for name in &found {
                assert!(MATHEMATICS.contains(&name.as_str()), "model-core must not need {name}");
            }
        }
    }
}

#[test]
fn every_member_has_its_layer() {
    let workspace = manifest(".");
    let members = workspace["workspace"]["members"].as_array().unwrap();
    for member in members {
        let member = member.as_str().unwrap();
        assert!(LAYERS.iter().any(|(folder, _)| *folder == member), "{member} has no place in the layers");
    }
    assert_eq!(members.len(), LAYERS.len());
}

#[test]
fn memory_map_is_unique() {
    fn visit(folder: &Path, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            let name = entry.file_name().to_string_lossy().into_owned();
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                visit(&path, found);
            } else if name == "memory.x" {
                found.push(path.display().to_string());
            }
        }
    }
    let mut found = Vec::new();
    visit(&system_tests::root(), &mut found);
    assert_eq!(found.len(), 1, "{found:?}");
}
