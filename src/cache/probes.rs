//! `probes/NAME.csv`: what probes saw, one file a probe, one row a frame.
//!
//! The values stand in the ledger, each frame's in its line; the files are written from there, so that a row is never
//! on the disk before its frame is, and a bake that goes on can write them anew.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::disk;
use super::error::{AtPath, CacheError};
use super::ledger::{Clock, Entry};
use super::manifest::is_file_stem;

/// Folder of the files.
pub(super) const FOLDER: &str = "probes";

/// Ending of the files.
pub(super) const ENDING: &str = ".csv";

/// A probe, as the manifest has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeRecord {
    /// Of its file, without ending.
    pub name: String,
    /// `elevation`, `pressure`, `energy` or `volume`.
    pub kind: String,
    /// World coordinates that it looks at, metres.
    pub at: Vec<f64>,
    /// Of a row, behind frame and time; each ends with its unit.
    pub columns: Vec<String>,
}

/// One frame's values, by probe and column; `None` where there is nothing to measure.
pub type ProbeValues = Vec<Vec<Option<f64>>>;

impl ProbeRecord {
    /// No name may lead out of the folder, and none may meet another on any file system.
    pub(super) fn check_all(records: &[Self]) -> Result<(), String> {
        for (k, record) in records.iter().enumerate() {
            if !is_file_stem(&record.name) {
                return Err(format!("probe name `{}` is no file name", record.name));
            }
            let mut before = records[..k].iter();
            if before.any(|other| other.name.eq_ignore_ascii_case(&record.name)) {
                return Err(format!("two probes are called `{}`", record.name));
            }
            let is_bad = |column: &String| column.is_empty() || column.contains([',', '"', '\n']);
            if record.columns.is_empty() || record.columns.iter().any(is_bad) {
                return Err(format!("columns of probe `{}`", record.name));
            }
        }
        Ok(())
    }

    /// All of them in words.
    pub(super) fn list(records: &[Self]) -> String {
        let words = |record: &Self| match &record.at[..] {
            [] => record.name.clone(),
            at => format!("{} ({} at {at:?})", record.name, record.kind),
        };
        match records {
            [] => "no probes".to_owned(),
            _ => records.iter().map(words).collect::<Vec<_>>().join(", "),
        }
    }

    /// Path of its file from the cache's folder, with `/`.
    pub fn file(&self) -> String {
        format!("{FOLDER}/{}{ENDING}", self.name)
    }

    /// Where its file is in the cache `dir`.
    pub(super) fn path(&self, dir: &Path) -> PathBuf {
        dir.join(self.file())
    }

    fn header(&self) -> String {
        format!("frame,time_s,{}\n", self.columns.join(","))
    }

    /// What the file holds after these frames; `index` is its own among the probes.
    pub(super) fn text(&self, index: usize, entries: &[Entry]) -> String {
        let rows = entries.iter().filter_map(|entry| {
            let values = entry.probes.as_ref()?.get(index)?;
            Some(row(entry.clock, values))
        });
        self.header() + &rows.collect::<String>()
    }
}

/// Numbers as the shortest decimals that read back as the same; nothing where there is none.
fn row(clock: Clock, values: &[Option<f64>]) -> String {
    let mut row = format!("{},{:?}", clock.frame, clock.time);
    for value in values {
        row.push(',');
        if let Some(value) = value {
            row += &format!("{value:?}");
        }
    }
    row + "\n"
}

/// Why `values` cannot stand in a line of a cache with these probes.
pub(super) fn misfit(records: &[ProbeRecord], values: Option<&ProbeValues>) -> Option<String> {
    let found = values.map(Vec::as_slice).unwrap_or_default();
    let is_shaped = found.len() == records.len()
        && found
            .iter()
            .zip(records)
            .all(|(row, record)| row.len() == record.columns.len());
    if !is_shaped || (values.is_some() && records.is_empty()) {
        return Some("its probes are not those that the manifest announces".to_owned());
    }
    let mut all = found.iter().flatten().flatten();
    all.find(|value| !value.is_finite())
        .map(|value| format!("a probe measures {value}"))
}

/// Writes every file anew from the ledger, with what belongs to no probe gone.
pub(super) fn write_all(
    dir: &Path,
    records: &[ProbeRecord],
    entries: &[Entry],
) -> Result<(), CacheError> {
    for (index, record) in records.iter().enumerate() {
        let text = record.text(index, entries);
        disk::write_whole(&record.path(dir), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// Adds a frame's row to every file.
pub(super) fn append(
    dir: &Path,
    records: &[ProbeRecord],
    clock: Clock,
    values: &ProbeValues,
) -> Result<(), CacheError> {
    for (record, values) in records.iter().zip(values) {
        let path = record.path(dir);
        let mut file = File::options().append(true).open(&path).at(&path)?;
        file.write_all(row(clock, values).as_bytes()).at(&path)?;
    }
    Ok(())
}

/// What is off in the file of a probe, against the ledger.
pub(super) fn problem(
    dir: &Path,
    index: usize,
    record: &ProbeRecord,
    entries: &[Entry],
) -> Option<String> {
    let path = record.path(dir);
    let found = match std::fs::read(&path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Some("it is missing; --resume writes it anew".to_owned());
        }
        Err(error) => return Some(format!("it cannot be read: {error}")),
        Ok(found) => found,
    };
    let expected = record.text(index, entries).into_bytes();
    if found == expected {
        return None;
    }
    let differs = found.iter().zip(&expected).position(|(a, b)| a != b);
    let same = differs.unwrap_or(found.len().min(expected.len()));
    let line = 1 + expected[..same].iter().filter(|&&b| b == b'\n').count();
    Some(format!(
        "line {line} is not what the ledger has; --resume writes it anew (a bake that runs now may be writing it)"
    ))
}
