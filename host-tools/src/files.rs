//! Files as they are written: whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Why a file cannot be read or written, in the same words everywhere.
pub fn why(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::IsADirectory => "this is a folder, not a file".to_owned(),
        io::ErrorKind::PermissionDenied => "the system does not permit it".to_owned(),
        _ => error.to_string(),
    }
}

/// Whether a name is that of a stream, of which nothing is lost when it is written: `-`, a device, a pipe.
pub fn is_stream(path: &Path) -> bool {
    // what a shell opened for this process has the name of a link, possibly to a regular file
    let of_shell = ["/dev/stdin", "/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];
    path == Path::new("-")
        || of_shell.iter().any(|name| path.starts_with(name))
        || fs::metadata(path).is_ok_and(|meta| !meta.is_file() && !meta.is_dir())
}

/// Whether two names are those of one file, be it there or not yet.
pub fn is_same(a: &Path, b: &Path) -> bool {
    resolved(a) == resolved(b) || are_linked(a, b)
}

/// The one name of a file that has several: without links, `.` and `..`.
fn resolved(path: &Path) -> PathBuf {
    let of_parent = || {
        let parent = path.parent().filter(|parent| *parent != Path::new("")).unwrap_or(Path::new("."));
        Some(fs::canonicalize(parent).ok()?.join(path.file_name()?))
    };
    fs::canonicalize(path).ok().or_else(of_parent).unwrap_or_else(|| path.to_owned())
}

/// Whether two names in a folder stand for the same bytes.
#[cfg(unix)]
fn are_linked(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    matches!((fs::metadata(a), fs::metadata(b)), (Ok(a), Ok(b)) if (a.dev(), a.ino()) == (b.dev(), b.ino()))
}

#[cfg(not(unix))]
fn are_linked(_a: &Path, _b: &Path) -> bool {
    false
}

/// Writes a file: beside its place first, so that a full disk or a failure halfway leaves what was there before.
///
/// # Errors
/// Those of the system and of `content`.
pub fn put(path: &Path, content: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    if is_stream(path) {
        return content(&mut File::create(path)?);
    }
    // a link stays one: what it leads to is replaced
    let target = resolved(path);
    let before = match OpenOptions::new().write(true).open(&target) {
        Ok(file) => Some(file.metadata()?.permissions()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(error),
    };
    let beside = beside(&target);
    let mut file = match OpenOptions::new().write(true).create_new(true).open(&beside) {
        Ok(file) => file,
        // a folder that takes no new file may hold one that can be written
        Err(_) => return content(&mut File::create(&target)?),
    };
    let written = before
        .map_or(Ok(()), |permissions| file.set_permissions(permissions))
        .and_then(|()| content(&mut file))
        .and_then(|()| fs::rename(&beside, &target));
    if written.is_err() {
        let _ = fs::remove_file(&beside);
    }
    written
}

/// [`put`] of bytes that are there.
///
/// # Errors
/// Those of the system.
pub fn put_bytes(path: &Path, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |file| file.write_all(bytes.as_ref()))
}

/// Name of the file that becomes another one once it is complete.
fn beside(target: &Path) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy();
    // names may be 255 bytes long
    let name: String = name.chars().take(50).collect();
    target.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("guideblock-files-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("writable");
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("there");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("there").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_halfway_leaves_what_was_there() {
        let folder = folder("halfway");
        let path = folder.join("a.csv");
        put_bytes(&path, "before").expect("writable");
        let failed = put(&path, |file| {
            file.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert_eq!(failed.map_err(|error| error.to_string()), Err("disk full".to_owned()));
        assert_eq!(fs::read_to_string(&path).expect("there"), "before");
        put_bytes(&path, "after").expect("writable");
        assert_eq!(
            (fs::read_to_string(&path).expect("there").as_str(), names(&folder)),
            ("after", vec!["a.csv".into()])
        );
        fs::remove_dir_all(folder).expect("ours");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = folder("links");
        let (path, link) = (folder.join("a.csv"), folder.join("link.csv"));
        fs::write(&path, "before").expect("writable");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).expect("ours");
        std::os::unix::fs::symlink("a.csv", &link).expect("writable");
        put_bytes(&link, "after").expect("writable");
        assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
        assert_eq!(fs::read_to_string(&path).expect("there"), "after");
        assert_eq!(fs::metadata(&path).expect("there").permissions().mode() & 0o777, 0o640);
        put_bytes(Path::new("/dev/null"), "nothing").expect("takes all");
        fs::remove_dir_all(folder).expect("ours");
    }

    #[test]
    fn names_of_one_file_are_known() {
        let folder = folder("names");
        let (a, new) = (folder.join("a.csv"), folder.join("new.csv"));
        fs::write(&a, "1").expect("writable");
        fs::create_dir(folder.join("sub")).expect("writable");
        assert!(is_same(&a, &folder.join("sub/../a.csv")));
        assert!(is_same(&new, &folder.join("./sub/../new.csv")), "not there yet");
        assert!(is_same(Path::new("new.csv"), Path::new("./new.csv")));
        assert!(!is_same(&a, &new));
        fs::hard_link(&a, folder.join("b.csv")).expect("writable");
        assert_eq!(is_same(&a, &folder.join("b.csv")), cfg!(unix));
        fs::remove_dir_all(folder).expect("ours");
    }
}
