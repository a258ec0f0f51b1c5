//! The files of streams whose values are in the ledger, `probes/NAME.csv`: one row per sample, all
//! of it derived from the ledger.
//!
//! A row is therefore never on disk before its frame, a resumed bake rewrites the files, and a file
//! that differs from the ledger is damaged.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::ledger::{Clock, LedgerEntry};
use super::manifest::Manifest;
use super::probes::{ProbeRecord, Rows};
use super::stream::{STREAMS, Stream};
use super::window::Window;
use swell_domain::output::{self, AtPath as _, FileError};

/// One file: a table of a stream.
struct TableFile<'a> {
    stream: &'static Stream,
    /// Index among the stream's tables.
    index: usize,
    record: &'a ProbeRecord,
}

/// The files of a bake with this manifest.
fn all(manifest: &Manifest) -> impl Iterator<Item = TableFile<'_>> {
    STREAMS.iter().flat_map(move |stream| {
        let records = stream.tables(manifest).iter().enumerate();
        records.map(move |(index, record)| TableFile {
            stream,
            index,
            record,
        })
    })
}

impl TableFile<'_> {
    fn path(&self, dir: &Path) -> PathBuf {
        dir.join(self.stream.table_file(&self.record.name))
    }

    /// Content of the file after these frames, and the window that later rows look back on.
    fn text(&self, entries: &[LedgerEntry]) -> (String, Window) {
        let mut window = Window::default();
        let header = format!("frame,time_s,{}\n", self.record.file_columns().join(","));
        let rows = entries
            .iter()
            .map(|entry| self.rows(&mut window, entry.clock, &entry.rows));
        (header + &rows.collect::<String>(), window)
    }

    /// A frame's rows, one per sample. Numbers are the shortest decimals that parse back to the
    /// same value; a missing value is an empty field.
    fn rows(&self, window: &mut Window, clock: Clock, rows: &Rows) -> String {
        let values = rows
            .get(self.stream.name)
            .and_then(|all| all.get(self.index));
        let values = values.map_or(&[][..], Vec::as_slice);
        let mut text = String::new();
        for look in self.record.looks(values, clock.time) {
            text += &format!("{},{:?}", clock.frame, look.time);
            let seen = self.record.window.map(|length| window.take(length, look));
            for (column, value) in look.values.iter().enumerate() {
                let beside = seen.as_ref().map_or(&[][..], |seen| &seen[column][..]);
                for value in [*value].iter().chain(beside) {
                    text.push(',');
                    if let Some(value) = value {
                        text += &format!("{value:?}");
                    }
                }
            }
            text.push('\n');
        }
        text
    }

    /// How the file differs from the ledger.
    fn problem(&self, dir: &Path, entries: &[LedgerEntry]) -> Option<String> {
        let found = match std::fs::read(self.path(dir)) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Some("it is missing; a resumed bake rewrites it".to_owned());
            }
            Err(error) => return Some(format!("it cannot be read: {error}")),
            Ok(found) => found,
        };
        let expected = self.text(entries).0.into_bytes();
        if found == expected {
            return None;
        }
        let differs = found.iter().zip(&expected).position(|(a, b)| a != b);
        let same = differs.unwrap_or(found.len().min(expected.len()));
        let line = 1 + expected[..same].iter().filter(|&&b| b == b'\n').count();
        Some(format!(
            "line {line} differs from the ledger; a resumed bake rewrites the file (a running \
             bake may still be writing it)"
        ))
    }
}

/// Rewrites every file from the ledger. Returns the windows that later rows look back on, by table.
pub(super) fn write_all(
    dir: &Path,
    manifest: &Manifest,
    entries: &[LedgerEntry],
) -> Result<Vec<Window>, FileError> {
    let write = |table: TableFile<'_>| {
        let (text, window) = table.text(entries);
        output::write(&table.path(dir), text)?;
        Ok(window)
    };
    all(manifest).map(write).collect()
}

/// Appends a frame's rows to every file; `windows` are those of [`write_all`], updated.
pub(super) fn append(
    dir: &Path,
    manifest: &Manifest,
    windows: &mut [Window],
    clock: Clock,
    rows: &Rows,
) -> Result<(), FileError> {
    all(manifest).zip(windows).try_for_each(|(table, window)| {
        let path = table.path(dir);
        let mut file = File::options().append(true).open(&path).at(&path)?;
        let text = table.rows(window, clock, rows);
        file.write_all(text.as_bytes()).at(&path)
    })
}

/// Files that do not match these lines of the ledger, and what is wrong with each.
pub(super) fn problems(
    dir: &Path,
    manifest: &Manifest,
    entries: &[LedgerEntry],
) -> impl Iterator<Item = (PathBuf, String)> {
    all(manifest).filter_map(move |table| Some((table.path(dir), table.problem(dir, entries)?)))
}
