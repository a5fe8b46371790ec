//! The files that a command writes: apart from those it reads and from each other, and each whole or not at all.

use std::io;
use std::path::Path;

use host_tools::files;

use super::Failure;

/// Files by the option or argument that names them.
#[derive(Default)]
pub(crate) struct Files<'a> {
    read: Vec<(&'static str, &'a Path)>,
    written: Vec<(&'static str, &'a Path)>,
}

impl<'a> Files<'a> {
    /// Adds files that are read.
    pub(crate) fn reads<P: AsRef<Path> + ?Sized + 'a>(
        mut self,
        option: &'static str,
        paths: impl IntoIterator<Item = &'a P>,
    ) -> Self {
        self.read.extend(paths.into_iter().map(|path| (option, path.as_ref())));
        self
    }

    /// Adds files that are written.
    pub(crate) fn writes<P: AsRef<Path> + ?Sized + 'a>(
        mut self,
        option: &'static str,
        paths: impl IntoIterator<Item = &'a P>,
    ) -> Self {
        self.written.extend(paths.into_iter().map(|path| (option, path.as_ref())));
        self
    }

    /// Refuses a command that would write over what it reads, or write one file twice. To be asked before any work.
    pub(crate) fn check(self) -> Result<(), Failure> {
        let stays = |(_, path): &(&str, &Path)| !files::is_stream(path);
        let written: Vec<_> = self.written.into_iter().filter(stays).collect();
        for (n, (option, path)) in written.iter().enumerate() {
            let is_same = |(_, other): &&(&str, &Path)| files::is_same(path, other);
            if let Some((input, _)) = self.read.iter().find(is_same) {
                let what = format!("{option} would overwrite what {input} reads; give the result another name");
                return Err(Failure::file(path, what));
            }
            if let Some((before, _)) = written[..n].iter().find(is_same) {
                let what = format!("{before} and {option} would both write it; give each a name of its own");
                return Err(Failure::file(path, what));
            }
        }
        Ok(())
    }
}

/// Writes a file that the caller named.
pub(crate) fn put(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), Failure> {
    files::put_bytes(path, bytes).map_err(|error| of(path, error))
}

/// Why a file could not be written.
pub(crate) fn of(path: &Path, error: io::Error) -> Failure {
    match error.kind() {
        io::ErrorKind::BrokenPipe => Failure::Output(error),
        io::ErrorKind::NotFound => Failure::file(path, "there is no such folder"),
        _ => Failure::io(path, error),
    }
}
