//! The files of streams with a row a frame, `probes/NAME.csv`: all that they hold stands in the ledger.
//!
//! So a row is never on the disk before its frame is, a bake that goes on writes the files anew, and a file that says
//! something else is damaged.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::disk;
use super::error::{AtPath, CacheError};
use super::ledger::{Clock, Entry, Rows};
use super::manifest::Manifest;
use super::probes::ProbeRecord;
use super::stream::{STREAMS, Stream};

/// One file: a table of a stream.
struct Table<'a> {
    stream: &'static Stream,
    /// Among the stream's tables.
    index: usize,
    record: &'a ProbeRecord,
}

/// The files of a bake with this manifest.
fn all(manifest: &Manifest) -> impl Iterator<Item = Table<'_>> {
    STREAMS.iter().flat_map(move |stream| {
        let records = stream.tables(manifest).iter().enumerate();
        records.map(move |(index, record)| Table {
            stream,
            index,
            record,
        })
    })
}

impl Table<'_> {
    fn path(&self, dir: &Path) -> PathBuf {
        dir.join(self.stream.table_file(&self.record.name))
    }

    /// Text of the file after these frames.
    fn text(&self, entries: &[Entry]) -> String {
        let header = format!("frame,time_s,{}\n", self.record.columns.join(","));
        let rows = entries
            .iter()
            .map(|entry| self.row(entry.clock, &entry.rows));
        header + &rows.collect::<String>()
    }

    /// Numbers as the shortest decimals that read back as the same; nothing where there is none.
    fn row(&self, clock: Clock, rows: &Rows) -> String {
        let values = rows
            .get(self.stream.name)
            .and_then(|all| all.get(self.index));
        let mut row = format!("{},{:?}", clock.frame, clock.time);
        for value in values.into_iter().flatten() {
            row.push(',');
            if let Some(value) = value {
                row += &format!("{value:?}");
            }
        }
        row + "\n"
    }

    /// Fault of the file, against the ledger.
    fn problem(&self, dir: &Path, entries: &[Entry]) -> Option<String> {
        let found = match std::fs::read(self.path(dir)) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Some("it is missing; --resume writes it anew".to_owned());
            }
            Err(error) => return Some(format!("it cannot be read: {error}")),
            Ok(found) => found,
        };
        let expected = self.text(entries).into_bytes();
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
}

/// Writes every file anew from the ledger.
pub(super) fn write_all(
    dir: &Path,
    manifest: &Manifest,
    entries: &[Entry],
) -> Result<(), CacheError> {
    all(manifest).try_for_each(|table| {
        let text = table.text(entries);
        disk::write_bytes(&table.path(dir), text.as_bytes())
    })
}

/// Adds a frame's row to every file.
pub(super) fn append(
    dir: &Path,
    manifest: &Manifest,
    clock: Clock,
    rows: &Rows,
) -> Result<(), CacheError> {
    all(manifest).try_for_each(|table| {
        let path = table.path(dir);
        let mut file = File::options().append(true).open(&path).at(&path)?;
        file.write_all(table.row(clock, rows).as_bytes()).at(&path)
    })
}

/// Files that are not what these lines of the ledger say, and what is off in each.
pub(super) fn problems(
    dir: &Path,
    manifest: &Manifest,
    entries: &[Entry],
) -> impl Iterator<Item = (PathBuf, String)> {
    all(manifest).filter_map(move |table| Some((table.path(dir), table.problem(dir, entries)?)))
}
