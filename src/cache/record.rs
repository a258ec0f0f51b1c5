//! The record of a file in a cache: path, length, checksum. No path may lead out of the cache.

use std::path::{Component, Path};

use serde::{Deserialize, Serialize};

use super::disk;
use super::error::CacheError;
use super::frame::WrittenFile;

/// A file in a cache.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileRecord {
    /// Path relative to the cache's folder, with `/`.
    pub file: String,
    /// Length in bytes.
    pub bytes: u64,
    /// BLAKE3 of the content, hex.
    pub blake3: String,
}

impl FileRecord {
    pub(super) fn new(file: impl Into<String>, content: &[u8]) -> Self {
        Self::of_written(
            file,
            &WrittenFile {
                bytes: content.len() as u64,
                hash: blake3::hash(content),
            },
        )
    }

    pub(super) fn of_written(file: impl Into<String>, written: &WrittenFile) -> Self {
        Self {
            file: file.into(),
            bytes: written.bytes,
            blake3: written.hash.to_hex().to_string(),
        }
    }

    /// Checks the file's length and hash without loading it into memory.
    pub(super) fn check(&self, dir: &Path) -> Result<(), CacheError> {
        let path = dir.join(&self.file);
        disk::check_length_on_disk(&path, self.bytes)?;
        if disk::file_hash(&path)? != self.blake3 {
            return Err(CacheError::damaged(
                path,
                "its BLAKE3 checksum does not match",
            ));
        }
        Ok(())
    }

    /// Reads the file and checks its length and hash.
    pub(super) fn read(&self, dir: &Path) -> Result<Vec<u8>, CacheError> {
        let path = dir.join(&self.file);
        let content = disk::read_exactly(&path, self.bytes)?;
        let hash = blake3::Hasher::new().update_rayon(&content).finalize();
        if hash.to_hex().as_str() != self.blake3 {
            return Err(CacheError::damaged(
                path,
                "its BLAKE3 checksum does not match",
            ));
        }
        Ok(content)
    }
}

/// Whether a shot or a table may carry this name: letters, digits, `.`, `_`, `-`.
pub(super) fn is_file_stem(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with(['.', '-'])
        && name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b"._-".contains(&b))
}

/// Whether a path consists of plain names, so that it stays below the folder that it is joined to.
pub(super) fn is_relative(path: &str) -> bool {
    !path.contains('\\')
        && path.split('/').all(|part| !part.is_empty())
        && Path::new(path)
            .components()
            .all(|c| matches!(c, Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_of_the_cache_are_refused() {
        for good in ["city.obj", "meshes/city.obj", "wave 1.csv"] {
            assert!(is_relative(good), "{good}");
        }
        for bad in [
            "",
            "/etc/passwd",
            "../a",
            "a/../../b",
            "a//b",
            "a\\..\\b",
            "a/",
        ] {
            assert!(!is_relative(bad), "{bad}");
        }
        for good in ["wave-city", "v1.2_a"] {
            assert!(is_file_stem(good), "{good}");
        }
        for bad in ["", "..", ".a", "a/b", "a b", "-x", "a\nb"] {
            assert!(!is_file_stem(bad), "{bad}");
        }
    }
}
