//! Shared code of the test programs: golden tables, built images, and the axis they are run against.

pub mod axis;
pub mod golden;
pub mod image;

use std::path::{Path, PathBuf};

/// The workspace's root folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().map(Path::to_path_buf).unwrap_or_default()
}
