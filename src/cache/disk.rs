//! Atomic file writes, the writer's lock, and the hash of a whole directory.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::error::{AtPath, CacheError};

/// Name of the lock file, held by the one writer.
pub(super) const LOCK: &str = "lock";
/// Name of the timings file, which no hash covers.
pub(super) const TIMINGS: &str = "timings.jsonl";
/// Content of our lock file. It distinguishes our lock from anyone else's, so that `create`
/// restarts only an interrupted creation of our own.
const LOCK_TEXT: &[u8] = b"swell cache: locked while a bake writes here\n";
/// Extension of a file that is still being written.
pub(super) const TEMPORARY: &str = "tmp";

/// Appends `.tmp` to `path`. The temporary file is in the same folder, so the rename stays on one
/// file system.
pub(super) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(TEMPORARY);
    name.into()
}

/// Free bytes that the user may still write at `path`, which need not exist yet; `None` where the
/// system does not report them.
pub fn free_bytes(path: &Path) -> Option<u64> {
    let whole = std::path::absolute(path).ok()?;
    let there = whole.ancestors().find(|folder| folder.exists())?;
    free_at(there)
}

#[cfg(unix)]
fn free_at(folder: &Path) -> Option<u64> {
    let told = rustix::fs::statvfs(folder).ok()?;
    told.f_bavail.checked_mul(told.f_frsize)
}

#[cfg(not(unix))]
fn free_at(_: &Path) -> Option<u64> {
    None
}

/// Writes `path` through a temporary file: flushes the content to the disk before the rename, and
/// the directory entry after it.
///
/// # Errors
/// `Io`. If the content cannot be written, the temporary file is removed and `path` is unchanged.
pub(super) fn write_whole<T>(
    path: &Path,
    fill: impl FnOnce(&mut File) -> io::Result<T>,
) -> Result<T, CacheError> {
    let partial = temporary(path);
    let create = || {
        let mut file = File::create(&partial)?;
        let filled = fill(&mut file)?;
        file.sync_all()?;
        Ok(filled)
    };
    let filled = create().at(&partial).inspect_err(|_| {
        // The first error is the one to report; a file left here is cleared on resume.
        let _ = fs::remove_file(&partial);
    })?;
    fs::rename(&partial, path).at(path)?;
    sync_parent(path)?;
    Ok(filled)
}

/// [`write_whole`] for content that is already in memory.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), CacheError> {
    write_whole(path, |file| file.write_all(bytes))
}

/// Removes a file if it exists.
pub(super) fn remove(path: &Path) -> Result<(), CacheError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other.at(path),
    }
}

/// Flushes the directory that holds `path`; without it a rename may not survive a power cut.
fn sync_parent(path: &Path) -> Result<(), CacheError> {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => sync_directory(Path::new(".")),
        Some(parent) => sync_directory(parent),
        None => Ok(()),
    }
}

/// Flushes the entries of a directory to the disk.
pub(super) fn sync_directory(dir: &Path) -> Result<(), CacheError> {
    // Windows cannot open a directory as a file; NTFS journals the rename itself.
    if cfg!(unix) {
        File::open(dir).and_then(|d| d.sync_all()).at(dir)?;
    }
    Ok(())
}

/// Creates a directory and its ancestors, and flushes its entry in the parent.
pub(super) fn create_directory(dir: &Path) -> Result<(), CacheError> {
    fs::create_dir_all(dir).at(dir)?;
    sync_parent(dir)
}

/// The writer's lock, held until it is dropped.
#[derive(Debug)]
pub(super) struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing the file is not enough: a process that another thread is spawning holds a copy of
        // the handle until it calls exec, and would keep the lock for that moment.
        let _ = self.0.unlock();
    }
}

/// Takes the writer's lock. The file stays when the lock is released: removing it would allow two
/// writers to lock two files of the same name.
///
/// # Errors
/// [`CacheError::Locked`], `Io`.
pub(super) fn lock(dir: &Path) -> Result<Lock, CacheError> {
    let path = dir.join(LOCK);
    let mut file = File::options()
        .read(true)
        .append(true)
        .create(true)
        .open(&path)
        .at(&path)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(CacheError::Locked {
                dir: dir.to_owned(),
            });
        }
        Err(TryLockError::Error(source)) => return Err(CacheError::Io { path, source }),
    }
    if file.metadata().at(&path)?.len() == 0 {
        file.write_all(LOCK_TEXT).at(&path)?;
    }
    Ok(Lock(file))
}

/// Whether `dir` has a lock file of ours. An empty one counts: the process may have been killed
/// between creating the file and writing its text.
pub(super) fn has_our_lock(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text.is_empty() || text == LOCK_TEXT)
}

/// Whether a bake has claimed `dir` for its cache, judged by the text of the lock file only.
pub(super) fn is_begun(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text == LOCK_TEXT)
}

/// Names of the entries of `dir`, sorted.
pub(super) fn names(dir: &Path) -> Result<Vec<String>, CacheError> {
    let mut names = Vec::new();
    for entry in fs::read_dir(dir).at(dir)? {
        names.push(entry.at(dir)?.file_name().to_string_lossy().into_owned());
    }
    names.sort_unstable();
    Ok(names)
}

/// BLAKE3 of a file's content, hex.
pub(super) fn file_hash(path: &Path) -> Result<String, CacheError> {
    let mut hasher = blake3::Hasher::new();
    File::open(path)
        .and_then(|file| hasher.update_reader(file).map(|_| ()))
        .at(path)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// BLAKE3 over the names and contents of all files below `dir`, hex: equal hashes mean that nothing
/// changed. Skips `lock` and `timings.jsonl` of the top folder and does not follow links.
///
/// # Errors
/// [`CacheError::Io`].
pub fn directory_hash(dir: &Path) -> Result<String, CacheError> {
    let mut hasher = blake3::Hasher::new();
    hash_below(dir, "", &mut hasher)?;
    Ok(hasher.finalize().to_hex().to_string())
}

fn hash_below(dir: &Path, prefix: &str, hasher: &mut blake3::Hasher) -> Result<(), CacheError> {
    for name in names(dir)? {
        if prefix.is_empty() && (name == LOCK || name == TIMINGS) {
            continue;
        }
        let path = dir.join(&name);
        let relative = format!("{prefix}{name}");
        let kind = fs::symlink_metadata(&path).at(&path)?.file_type();
        let tag = if kind.is_dir() {
            b'd'
        } else if kind.is_symlink() {
            b'l'
        } else {
            b'f'
        };
        // Lengths come before contents, so that no two trees give the same byte stream.
        hasher.update(&[tag]);
        hasher.update(&(relative.len() as u64).to_le_bytes());
        hasher.update(relative.as_bytes());
        if kind.is_dir() {
            hash_below(&path, &format!("{relative}/"), hasher)?;
        } else {
            let hash = if kind.is_symlink() {
                let target = fs::read_link(&path).at(&path)?;
                blake3::hash(target.as_os_str().as_encoded_bytes())
                    .to_hex()
                    .to_string()
            } else {
                file_hash(&path)?
            };
            hasher.update(hash.as_bytes());
        }
    }
    Ok(())
}

/// Reads a file of exactly `bytes` bytes. Compares the length before it allocates anything.
pub(super) fn read_exactly(path: &Path, bytes: u64) -> Result<Vec<u8>, CacheError> {
    let mut file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(CacheError::damaged(path, "it is missing"));
        }
        other => other.at(path)?,
    };
    let found = file.metadata().at(path)?.len();
    check_length(path, bytes, found)?;
    let mut content = Vec::with_capacity(usize::try_from(found).unwrap_or(0));
    file.read_to_end(&mut content).at(path)?;
    check_length(path, bytes, content.len() as u64)?;
    Ok(content)
}

/// Checks that a file exists and has the recorded length.
pub(super) fn check_length_on_disk(path: &Path, expected: u64) -> Result<(), CacheError> {
    match path.metadata() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            Err(CacheError::damaged(path, "it is missing"))
        }
        other => check_length(path, expected, other.at(path)?.len()),
    }
}

fn check_length(path: &Path, expected: u64, found: u64) -> Result<(), CacheError> {
    if found == expected {
        return Ok(());
    }
    Err(CacheError::damaged(
        path,
        format!("it has {found} bytes instead of {expected}"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directory_hash_sees_names_bytes_and_folders_but_no_timings() {
        let dir = tempfile::tempdir().unwrap();
        let d = dir.path();
        fs::write(d.join("a"), "1").unwrap();
        fs::create_dir(d.join("sub")).unwrap();
        fs::write(d.join("sub/b"), "2").unwrap();
        let hash = || directory_hash(d).unwrap();
        let first = hash();
        fs::write(d.join(TIMINGS), "3").unwrap();
        fs::write(d.join(LOCK), "3").unwrap();
        assert_eq!(hash(), first);
        fs::write(d.join("sub").join(LOCK), "3").unwrap();
        assert_ne!(hash(), first, "only the top folder's lock is left out");
        fs::remove_file(d.join("sub").join(LOCK)).unwrap();
        assert_eq!(hash(), first);
        fs::rename(d.join("a"), d.join("c")).unwrap();
        assert_ne!(hash(), first);
        fs::rename(d.join("c"), d.join("a")).unwrap();
        fs::write(d.join("a"), "2").unwrap();
        assert_ne!(hash(), first);
        fs::write(d.join("a"), "1").unwrap();
        fs::create_dir(d.join("empty")).unwrap();
        assert_ne!(hash(), first);
    }

    /// Simulates the copy of the handle that a process being spawned by another thread holds.
    #[test]
    fn a_copy_of_the_lock_file_does_not_keep_the_lock() {
        let dir = tempfile::tempdir().unwrap();
        let held = lock(dir.path()).unwrap();
        let copy = held.0.try_clone().unwrap();
        assert!(matches!(lock(dir.path()), Err(CacheError::Locked { .. })));
        drop(held);
        lock(dir.path()).unwrap();
        drop(copy);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_temporary_one() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("file");
        write_whole(&path, |file| file.write_all(b"old")).unwrap();
        let error = write_whole(&path, |file| {
            file.write_all(b"ne")?;
            Err::<(), _>(io::Error::other("torn"))
        });
        assert!(matches!(error, Err(CacheError::Io { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(dir.path()).unwrap(), ["file"]);
    }
}
