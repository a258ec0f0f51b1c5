//! Output folders of exports: which files exist, and which process makes a file.
//!
//! Beside the files is a folder `.swell-export/`:
//!
//! ```text
//! m.0001.ply.json  record of m.0001.ply: its owner, its source and its checksum; kept
//! m.0001.ply.lock  locked by the process that makes the file
//! m.0001.ply       draft of the file until it is complete
//! ```
//!
//! A record is written before its file gets its final name, so a file without a record is not ours.
//! A file is complete if its bytes match the record. A lock ends with its process.

use std::{
    fs::{self, File},
    io::{self, Write as _},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::locked::{is_at, is_had, open};

/// Folder of records and drafts.
const ROOM: &str = ".swell-export";

/// What the files of one export have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Owner {
    /// Program and version.
    pub(super) software: String,
    /// Shot name of the cache.
    pub(super) shot: String,
    /// Chained hash of the cache's first frame, which covers its manifest.
    pub(super) cache: String,
    /// Kind and settings of the file, in words.
    pub(super) settings: String,
}

/// Record of one file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    owner: Owner,
    /// Hash of what the file was made from.
    source: String,
    bytes: u64,
    blake3: String,
}

/// Why a file cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A file or folder that cannot be read, written or locked.
    #[error("{}", file.display())]
    File {
        /// The file or folder.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The name is taken by something else.
    #[error(
        "{} is {what}; choose another name, or export it again with --overwrite",
        file.display()
    )]
    Other {
        /// The existing file.
        file: PathBuf,
        /// What it is.
        what: String,
    },
}

fn at(file: &Path) -> impl FnOnce(io::Error) -> FolderError + use<> {
    let file = file.to_owned();
    move |source| FolderError::File { file, source }
}

/// A file to be made.
#[derive(Clone, Debug)]
pub(super) struct Wanted {
    pub(super) file: PathBuf,
    pub(super) owner: Owner,
    /// Hash of what it is made from.
    pub(super) source: String,
    /// Whether a file made from another source is replaced without asking.
    pub(super) follows: bool,
}

/// The exclusive right to make a file, held until it is dropped.
#[derive(Debug)]
pub(super) struct Claim {
    lock: PathBuf,
    _file: File,
}

impl Drop for Claim {
    fn drop(&mut self) {
        // A lock file that stays behind does no harm.
        let _ = fs::remove_file(&self.lock);
    }
}

impl Wanted {
    fn folder(&self) -> PathBuf {
        match self.file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        }
    }

    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.file.file_name().unwrap_or_default().to_owned();
        name.push(ending);
        self.folder().join(ROOM).join(name)
    }

    /// Path of the draft; it has the file's own extension.
    pub(super) fn draft(&self) -> PathBuf {
        self.beside("")
    }

    fn record(&self) -> Option<Record> {
        serde_json::from_slice(&fs::read(self.beside(".json")).ok()?).ok()
    }

    /// Refuses an existing file of another origin.
    ///
    /// # Errors
    /// [`FolderError::Other`]; [`FolderError::File`] if the name is a directory.
    pub(super) fn check(&self) -> Result<(), FolderError> {
        let other = |what: &str| {
            Err(FolderError::Other {
                file: self.file.clone(),
                what: what.to_owned(),
            })
        };
        if !self.file.exists() {
            return Ok(());
        }
        if self.file.is_dir() {
            return Err(at(&self.file)(io::ErrorKind::IsADirectory.into()));
        }
        let Some(Record { owner, source, .. }) = self.record() else {
            return other("not from an export");
        };
        let rows = [
            (owner.shot == self.owner.shot, "of another shot"),
            (owner.cache == self.owner.cache, "of another cache"),
            (
                owner.settings == self.owner.settings,
                "exported in another way",
            ),
            (
                owner.software == self.owner.software,
                "of another version of the program",
            ),
            (source == self.source || self.follows, "of another frame"),
        ];
        match rows.into_iter().find(|row| !row.0) {
            Some((_, what)) => other(what),
            None => Ok(()),
        }
    }

    /// Whether the file exists and is complete.
    pub(super) fn is_complete(&self) -> bool {
        let is_whole = |record: Record| {
            let is_ours = record.owner == self.owner && record.source == self.source;
            let length = fs::metadata(&self.file).map(|found| found.len());
            is_ours
                && length.is_ok_and(|length| length == record.bytes)
                && hash(&self.file).is_ok_and(|hash| hash == record.blake3)
        };
        self.record().is_some_and(is_whole)
    }

    /// Claims the file for this process; `None` while another process has it.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn claim(&self) -> Result<Option<Claim>, FolderError> {
        let room = self.folder().join(ROOM);
        fs::create_dir_all(&room).map_err(at(&room))?;
        let lock = self.beside(".lock");
        loop {
            let file = open(&lock).map_err(at(&lock))?;
            if !is_had(file.try_lock()).map_err(at(&lock))? {
                return Ok(None);
            }
            // The previous holder may have removed the lock file in between.
            if is_at(&file, &lock) {
                return Ok(Some(Claim { lock, _file: file }));
            }
        }
    }

    /// Writes bytes to the draft.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn write(&self, bytes: &[u8]) -> Result<(), FolderError> {
        let draft = self.draft();
        fs::write(&draft, bytes).map_err(at(&draft))
    }

    /// Writes the record of a complete draft and renames the draft. Returns its length in bytes.
    ///
    /// # Errors
    /// [`FolderError::File`].
    pub(super) fn publish(&self) -> Result<u64, FolderError> {
        let draft = self.draft();
        let bytes = File::open(&draft)
            .and_then(|file| {
                file.sync_all()?;
                Ok(file.metadata()?.len())
            })
            .map_err(at(&draft))?;
        let record = Record {
            owner: self.owner.clone(),
            source: self.source.clone(),
            bytes,
            blake3: hash(&draft).map_err(at(&draft))?,
        };
        let name = self.beside(".json");
        let partial = self.beside(".json.part");
        let write = || {
            let mut file = File::create(&partial)?;
            file.write_all(serde_json::to_string_pretty(&record)?.as_bytes())?;
            file.write_all(b"\n")?;
            file.sync_all()?;
            fs::rename(&partial, &name)
        };
        write().map_err(at(&name))?;
        fs::rename(&draft, &self.file).map_err(at(&self.file))?;
        Ok(bytes)
    }
}

/// BLAKE3 of a file's content, hex.
fn hash(file: &Path) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(file)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(folder: &Path, source: &str) -> Wanted {
        Wanted {
            file: folder.join("m.0001.ply"),
            owner: Owner {
                software: "swell 0".to_owned(),
                shot: "small".to_owned(),
                cache: "c".to_owned(),
                settings: "mesh".to_owned(),
            },
            source: source.to_owned(),
            follows: false,
        }
    }

    #[test]
    fn a_file_stands_while_its_bytes_and_its_source_do() {
        let dir = tempfile::tempdir().unwrap();
        let one = wanted(dir.path(), "frame 1");
        assert!(!one.is_complete() && one.check().is_ok());
        let claim = one.claim().unwrap().unwrap();
        assert!(one.claim().unwrap().is_none(), "one process at a time");
        one.write(b"half").unwrap();
        assert!(!one.file.exists(), "a draft has no name yet");
        one.publish().unwrap();
        drop(claim);
        assert!(one.is_complete() && one.check().is_ok());
        assert!(one.claim().unwrap().is_some());
        // Other bytes: may be replaced, because the record is ours.
        fs::write(&one.file, b"hurt").unwrap();
        assert!(!one.is_complete() && one.check().is_ok());
        let other = wanted(dir.path(), "frame 2");
        assert!(matches!(other.check(), Err(FolderError::Other { .. })));
        let follows = Wanted {
            follows: true,
            ..other
        };
        assert!(follows.check().is_ok() && !follows.is_complete());
    }

    #[test]
    fn what_is_not_ours_is_left() {
        let dir = tempfile::tempdir().unwrap();
        let one = wanted(dir.path(), "frame 1");
        fs::write(&one.file, b"mine").unwrap();
        assert!(matches!(one.check(), Err(FolderError::Other { .. })));
    }
}
