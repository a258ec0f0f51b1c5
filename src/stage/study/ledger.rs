//! `results.jsonl`: one line a finished point.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};

use serde::{Serialize, de::DeserializeOwned};

use super::StudyError;

/// What a line holds.
pub(super) trait Line: Serialize + DeserializeOwned {
    /// Of all that it depends on.
    fn hash(&self) -> &str;
}

/// The file, open for more lines.
pub(super) struct Ledger<R> {
    path: PathBuf,
    file: File,
    records: BTreeMap<String, R>,
}

impl<R: Line> Ledger<R> {
    /// Opens the directory's results, or begins them; a torn last line is cut off. A directory that holds anything but
    /// a study's results is refused, and so is one that another process writes to.
    pub(super) fn open(directory: &Path) -> Result<Self, StudyError> {
        let path = directory.join("results.jsonl");
        let fault = |source| StudyError::File {
            file: path.clone(),
            source,
        };
        fs::create_dir_all(directory).map_err(fault)?;
        let is_used = fs::read_dir(directory).map_err(fault)?.next().is_some();
        if is_used && !path.exists() {
            return Err(StudyError::File {
                file: directory.to_owned(),
                source: std::io::Error::other("it holds what is no study's: choose another -o"),
            });
        }
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(fault(error)),
        };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut records = BTreeMap::new();
        for (index, line) in text[..whole].lines().enumerate() {
            let record: R = serde_json::from_str(line).map_err(|error| StudyError::Ledger {
                file: path.clone(),
                line: index + 1,
                what: error.to_string(),
            })?;
            records.insert(record.hash().to_owned(), record);
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(fault)?;
        let busy = |_| std::io::Error::other("another study writes here");
        file.try_lock().map_err(busy).map_err(fault)?;
        file.set_len(whole as u64).map_err(fault)?;
        Ok(Self {
            file,
            records,
            path,
        })
    }

    pub(super) fn find(&self, hash: &str) -> Option<&R> {
        self.records.get(hash)
    }

    /// Adds a line; it is on the disk when this returns.
    pub(super) fn append(&mut self, record: &R) -> Result<(), StudyError> {
        // Finite numbers, strings and lists alone: nothing that JSON cannot hold.
        let line = serde_json::to_string(record).map_err(std::io::Error::other);
        let written = line.and_then(|line| {
            self.file.write_all(format!("{line}\n").as_bytes())?;
            self.file.sync_data()
        });
        written.map_err(|source| StudyError::File {
            file: self.path.clone(),
            source,
        })
    }
}
