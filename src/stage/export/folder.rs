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
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::ExportError;
use swell_cache::file_hash;
use swell_domain::output::{self, AtPath as _, Draft, FileError, Lock};

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
    /// Chained hash of the first frame of the cache or the stream, which covers its manifest; then,
    /// after a space each, those of the streams that the file is made from besides.
    pub(super) cache: String,
    /// Kind and settings of the file, in words.
    pub(super) settings: String,
}

impl Owner {
    /// The cache or the stream itself.
    fn first(&self) -> &str {
        self.cache.split(' ').next().unwrap_or_default()
    }
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

    /// A draft of a file beside this one; it has that file's own extension.
    pub(super) fn draft(&self, file: &Path) -> Draft {
        Draft::within(&self.folder().join(ROOM), file)
    }

    fn record(&self) -> Option<Record> {
        serde_json::from_slice(&fs::read(self.beside(".json")).ok()?).ok()
    }

    /// Refuses an existing file of another origin.
    ///
    /// # Errors
    /// [`ExportError::Taken`]; [`ExportError::File`] if the name is a directory.
    pub(super) fn check(&self) -> Result<(), ExportError> {
        let other = |what: &str| {
            Err(ExportError::Taken {
                file: self.file.clone(),
                what: what.to_owned(),
            })
        };
        if !self.file.exists() {
            return Ok(());
        }
        if self.file.is_dir() {
            return Err(FileError::new(&self.file, io::ErrorKind::IsADirectory).into());
        }
        let Some(Record { owner, source, .. }) = self.record() else {
            return other("not from an export");
        };
        let rows = [
            (owner.shot == self.owner.shot, "of another shot"),
            (
                owner.first() == self.owner.first(),
                "of another cache or stream",
            ),
            (
                owner.cache == self.owner.cache,
                "made with another stream beside the water",
            ),
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
                && file_hash(&self.file).is_ok_and(|hash| hash == record.blake3)
        };
        self.record().is_some_and(is_whole)
    }

    /// Claims the file for this process; `None` while another process has it.
    ///
    /// # Errors
    /// [`FileError`].
    pub(super) fn claim(&self) -> Result<Option<Lock>, FileError> {
        Ok(Lock::take(&self.beside(".lock"))?.map(Lock::temporary))
    }

    /// Writes the record of a complete draft and gives the draft its name. Returns its length,
    /// bytes.
    ///
    /// # Errors
    /// [`FileError`].
    pub(super) fn publish(&self, mut draft: Draft) -> Result<u64, FileError> {
        let found = fs::metadata(draft.path()).at(draft.path())?;
        let record = Record {
            owner: self.owner.clone(),
            source: self.source.clone(),
            bytes: found.len(),
            blake3: file_hash(draft.path())?,
        };
        let name = self.beside(".json");
        let text = serde_json::to_string_pretty(&record).map_err(io::Error::from);
        output::write(&name, text.at(&name)? + "\n")?;
        draft.publish()
    }
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
        let draft = one.draft(&one.file);
        fs::write(draft.path(), b"half").unwrap();
        assert!(!one.file.exists(), "a draft has no name yet");
        one.publish(draft).unwrap();
        drop(claim);
        assert!(one.is_complete() && one.check().is_ok());
        assert!(one.claim().unwrap().is_some());
        // Other bytes: may be replaced, because the record is ours.
        fs::write(&one.file, b"hurt").unwrap();
        assert!(!one.is_complete() && one.check().is_ok());
        let other = wanted(dir.path(), "frame 2");
        assert!(matches!(other.check(), Err(ExportError::Taken { .. })));
        let follows = Wanted {
            follows: true,
            ..other
        };
        assert!(follows.check().is_ok() && !follows.is_complete());
        for (cache, words) in [
            ("d", "of another cache or stream"),
            ("c foam", "made with another stream beside the water"),
        ] {
            let mut other = wanted(dir.path(), "frame 1");
            other.owner.cache = cache.to_owned();
            let Err(ExportError::Taken { what, .. }) = other.check() else {
                panic!("{cache}");
            };
            assert_eq!(what, words);
        }
    }

    #[test]
    fn what_is_not_ours_is_left() {
        let dir = tempfile::tempdir().unwrap();
        let one = wanted(dir.path(), "frame 1");
        fs::write(&one.file, b"mine").unwrap();
        assert!(matches!(one.check(), Err(ExportError::Taken { .. })));
    }
}
