//! The folders are the layers of the design: each uses only those below it in the list of the crate's first page.
#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

/// The layers of the list, highest first.
fn layers(first_page: &str) -> Vec<String> {
    let list = first_page.split("```").nth(1).expect("a list").lines();
    list.filter_map(|line| line.strip_prefix("//! ")?.split_whitespace().next().map(str::to_owned)).collect()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("sources").map(|entry| entry.expect("an entry").path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

#[test]
fn no_folder_uses_one_above_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let layers = layers(&fs::read_to_string(src.join("lib.rs")).expect("the first page"));
    let layer = |name: &str| layers.iter().position(|layer| layer == name);
    let mut uses = 0;
    for path in files(&src) {
        let own = path.strip_prefix(&src).expect("within").components().next().expect("a name");
        let own = own.as_os_str().to_string_lossy().trim_end_matches(".rs").to_owned();
        if own == "lib" {
            continue;
        }
        let at = layer(&own).unwrap_or_else(|| panic!("{own} is not in the list"));
        let text = fs::read_to_string(&path).expect("source");
        for used in text.split("crate::").skip(1) {
            let used: String = used.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect();
            let below = layer(&used).unwrap_or_else(|| panic!("{}: {used} is not in the list", path.display()));
            assert!(below >= at, "{} uses {used}, which stands above {own}", path.display());
            uses += 1;
        }
    }
    assert!(uses > 100 && layers.len() > 10, "{uses} uses, {layers:?}");
}
