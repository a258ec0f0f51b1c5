//! Lock files in folders that several processes write to. A lock ends with its process.

use std::{
    fs::{File, TryLockError},
    io,
    path::Path,
};

/// Opens a lock file and creates it if it is missing.
pub fn open(file: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    options.open(file)
}

/// Converts the result of `try_lock`: whether the lock was acquired.
pub fn is_had(tried: Result<(), TryLockError>) -> io::Result<bool> {
    match tried {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Whether an open file is still the one at this path: its previous holder may have removed it.
#[cfg(unix)]
pub fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    let identity = |meta: io::Result<std::fs::Metadata>| meta.map(|m| (m.dev(), m.ino())).ok();
    identity(file.metadata()) == identity(path.metadata())
}

/// On other systems an open file cannot be removed.
#[cfg(not(unix))]
pub fn is_at(_: &File, _: &Path) -> bool {
    true
}
