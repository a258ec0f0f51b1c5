//! Hashes and lengths of files, the writer's lock, and the free space of a disk.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use super::error::CacheError;
use swell_domain::output::{AtPath as _, FileError, Lock, names};

/// Name of the lock file, held by the one writer.
pub(super) const LOCK: &str = "lock";
/// Name of the timings file, which no hash covers.
pub(super) const TIMINGS: &str = "timings.jsonl";
/// Content of our lock file. It distinguishes our lock from anyone else's, so that `create`
/// restarts only an interrupted creation of our own.
const LOCK_TEXT: &str = "swell cache: locked while a bake writes here\n";

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

/// Takes the writer's lock. The file stays when the lock is released: it marks the folder.
///
/// # Errors
/// [`CacheError::Locked`], `Io`.
pub(super) fn lock(dir: &Path) -> Result<Lock, CacheError> {
    let lock = Lock::take(&dir.join(LOCK))?.ok_or_else(|| CacheError::Locked {
        dir: dir.to_owned(),
    })?;
    if lock.file().metadata().at(&dir.join(LOCK))?.len() == 0 {
        lock.write(LOCK_TEXT)?;
    }
    Ok(lock)
}

/// Whether `dir` has a lock file of ours. An empty one counts: the process may have been killed
/// between creating the file and writing its text.
pub(super) fn has_our_lock(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text.is_empty() || text == LOCK_TEXT.as_bytes())
}

/// Whether a bake has claimed `dir` for its cache, judged by the text of the lock file only.
pub(super) fn is_begun(dir: &Path) -> bool {
    fs::read(dir.join(LOCK)).is_ok_and(|text| text == LOCK_TEXT.as_bytes())
}

/// BLAKE3 of a file's content, hex.
///
/// # Errors
/// [`FileError`].
pub fn file_hash(path: &Path) -> Result<String, FileError> {
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
/// [`FileError`].
pub fn directory_hash(dir: &Path) -> Result<String, FileError> {
    fs::metadata(dir).at(dir)?;
    let mut hasher = blake3::Hasher::new();
    hash_below(dir, "", &mut hasher)?;
    Ok(hasher.finalize().to_hex().to_string())
}

fn hash_below(dir: &Path, prefix: &str, hasher: &mut blake3::Hasher) -> Result<(), FileError> {
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
        assert!(directory_hash(&d.join("none")).is_err());
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
}
