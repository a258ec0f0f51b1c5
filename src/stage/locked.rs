//! Lock files in folders that several processes write into. A lock dies with its process.

use std::{
    fs::{File, TryLockError},
    io,
    path::Path,
};

/// Opens a lock file, which is made where it is missing.
pub fn open(file: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    options.open(file)
}

/// Whether a lock was had, by what trying gave.
pub fn is_had(tried: Result<(), TryLockError>) -> io::Result<bool> {
    match tried {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Whether an open file is the one of this name: its last holder may have taken it away.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |meta: io::Result<std::fs::Metadata>| meta.map(|m| (m.dev(), m.ino())).ok();
    identity(file.metadata()) == identity(path.metadata())
}

/// Elsewhere an open file cannot be taken away.
#[cfg(not(unix))]
pub fn is_at(_: &File, _: &Path) -> bool {
    true
}
