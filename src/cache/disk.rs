//! Files that are either whole or not there, and the hash of a whole directory.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::error::{AtPath, CacheError};

/// The one writer's lock file.
pub(super) const LOCK: &str = "lock";
/// Seconds, which belong to no hash.
pub(super) const TIMINGS: &str = "timings.jsonl";
/// Tells our lock file from someone else's, so that only a creation of ours that was cut short is
/// ever begun anew.
const LOCK_TEXT: &[u8] = b"swell cache: locked while a bake writes here\n";
/// Ends the name of a file that is still being written.
pub(super) const TEMPORARY: &str = "tmp";

/// `path` with `.tmp` behind it: the same folder, so that the rename stays on one file system.
pub(super) fn temporary(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(TEMPORARY);
    name.into()
}

/// Bytes that a user may still write where `path` is or will be; `None` where the system does not tell.
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

/// Writes `path` through a temporary file: flushed to the disk before it takes its name, and the name
/// flushed too.
///
/// # Errors
/// `Io`; the temporary file is removed, and `path` is as it was.
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

/// [`write_whole`] of what is there already.
pub(super) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), CacheError> {
    write_whole(path, |file| file.write_all(bytes))
}

/// Removes a file, where there is one.
pub(super) fn remove(path: &Path) -> Result<(), CacheError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other.at(path),
    }
}

/// Flushes the directory that holds `path`, without which a rename may not outlive a power cut.
fn sync_parent(path: &Path) -> Result<(), CacheError> {
    match path.parent() {
        Some(parent) if parent.as_os_str().is_empty() => sync_directory(Path::new(".")),
        Some(parent) => sync_directory(parent),
        None => Ok(()),
    }
}

/// Flushes the names in a directory.
pub(super) fn sync_directory(dir: &Path) -> Result<(), CacheError> {
    // Windows opens no directory as a file; NTFS journals the rename itself.
    if cfg!(unix) {
        File::open(dir).and_then(|d| d.sync_all()).at(dir)?;
    }
    Ok(())
}

/// Makes a directory that outlives a power cut, with those above it.
pub(super) fn create_directory(dir: &Path) -> Result<(), CacheError> {
    fs::create_dir_all(dir).at(dir)?;
    sync_parent(dir)
}

/// The writer's lock, held until it is dropped.
#[derive(Debug)]
pub(super) struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing the file is not enough: a process that another thread just starts has a copy of it until it runs its
        // own program, and would hold the lock for that moment.
        let _ = self.0.unlock();
    }
}

/// Takes the writer's lock. The file stays behind when the lock goes: removing it would let two
/// writers hold locks on two files of one name.
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

/// Whether `dir` has a lock file of ours. An empty one counts: a kill may fall between its creation
/// and its text.
pub(super) fn has_our_lock(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text.is_empty() || text == LOCK_TEXT)
}

/// Whether a bake has taken `dir` for its cache, by the lock's text alone.
pub(super) fn is_begun(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text == LOCK_TEXT)
}

/// Names in `dir`, sorted.
pub(super) fn names(dir: &Path) -> Result<Vec<String>, CacheError> {
    let mut names = Vec::new();
    for entry in fs::read_dir(dir).at(dir)? {
        names.push(entry.at(dir)?.file_name().to_string_lossy().into_owned());
    }
    names.sort_unstable();
    Ok(names)
}

/// BLAKE3 of a file's bytes, hex.
pub(super) fn file_hash(path: &Path) -> Result<String, CacheError> {
    let mut hasher = blake3::Hasher::new();
    File::open(path)
        .and_then(|file| hasher.update_reader(file).map(|_| ()))
        .at(path)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// BLAKE3 over the names and bytes of all files below `dir`, hex: equal before and after means
/// untouched. The top folder's `lock` and `timings.jsonl` are left out; links are not followed.
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
        // Lengths before contents, so that no two trees give the same stream.
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

/// Reads a file of exactly `bytes` bytes; the length is compared before anything is allocated.
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

/// Whether a file is there with the length that was written.
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
        format!("{found} bytes, and {expected} were written"),
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

    /// As a process has it that another thread is starting.
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
