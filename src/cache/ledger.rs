//! `frames.jsonl`: one line per frame, each chained to the line before.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::Path;

use blake3::Hash;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::bodies;
use super::error::CacheError;
use super::manifest::{self, Manifest};
use super::probes::{ProbeRecord, ProbeValues, Rows};
use super::record::FileRecord;
use super::stream::{self, STREAMS, Stream};
use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    output::{self, AtPath as _},
};

/// File name of the ledger.
pub(super) const FILE: &str = "frames.jsonl";
/// Separates the contents of a line from the 64 hex digits of its chained hash.
const CHAIN_KEY: &[u8] = b",\"chain\":\"";
const CHAIN_LEN: usize = CHAIN_KEY.len() + 64 + 2;

/// Time and step counts of a bake after a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Clock {
    /// Frame number; 0 is the start.
    pub frame: u32,
    /// Simulated time, seconds.
    pub time: f64,
    /// Substeps in this frame.
    pub substeps: u32,
    /// Substeps since the start.
    pub steps: u64,
    /// Id of the next particle to enter; present only if water enters or leaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_id: Option<u32>,
    /// State of the absorbing walls after this frame; absent if there are none.
    #[serde(default, skip_serializing_if = "is_none")]
    pub walls: AbsorberStates,
    /// Length of the substep that ended in the frame, seconds; 0 if there was none.
    #[serde(default, skip_serializing_if = "is_no_time")]
    pub substep: f64,
}

fn is_no_time(seconds: &f64) -> bool {
    *seconds == 0.0
}

fn is_none(walls: &AbsorberStates) -> bool {
    walls.iter().all(Option::is_none)
}

/// Files of a frame, by the name of their stream.
pub type Files = BTreeMap<String, FileRecord>;

/// One line of the ledger.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, expecting = "struct Entry")]
pub struct LedgerEntry {
    /// Frame number; 0 is the start.
    pub frame: u32,
    /// Number of particles in the frame's file.
    pub particles: u64,
    /// Files of every by-frame stream that the manifest announces, hence at least the particles'
    /// file. It is listed even if the manifest does not keep the frame's particles.
    pub files: Files,
    /// Rows of every by-row stream that the manifest announces; empty if there is none. Those of
    /// the bodies are made from their states when the line is read.
    #[serde(default)]
    pub rows: Rows,
    /// BLAKE3 of `manifest.json`, hex. Only the first line has it, so that a changed manifest can
    /// be told from a changed first line.
    #[serde(default)]
    pub manifest: Option<String>,
    /// Clock after this frame.
    pub clock: Clock,
    /// States of the bodies that the water moves, after this frame; empty if there are none.
    #[serde(default)]
    pub bodies: Vec<BodyState>,
    /// The solver's report of the frame. Nothing in it may differ between two bakes of the same
    /// scene, so it holds no timings.
    pub report: Value,
    /// BLAKE3 of the previous line's chained hash followed by this line's contents, hex. The first
    /// line is chained to the manifest's hash.
    pub chain: String,
}

/// A line in cache format 1, which has a separate field for each stream.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EntryOfFormat1 {
    frame: u32,
    file: String,
    bytes: u64,
    blake3: String,
    particles: u64,
    #[serde(default)]
    grids: Option<FileRecord>,
    #[serde(default)]
    probes: Option<ProbeValues>,
    #[serde(default)]
    manifest: Option<String>,
    clock: Clock,
    report: Value,
    chain: String,
}

impl From<EntryOfFormat1> for LedgerEntry {
    fn from(old: EntryOfFormat1) -> Self {
        let particles = FileRecord {
            file: old.file,
            bytes: old.bytes,
            blake3: old.blake3,
        };
        let files = [
            (stream::PARTICLES, Some(particles)),
            (stream::GRIDS, old.grids),
        ];
        let files = files.into_iter();
        let rows = old.probes.map(|rows| (stream::PROBES.to_owned(), rows));
        Self {
            frame: old.frame,
            particles: old.particles,
            files: files
                .filter_map(|(name, record)| Some((name.to_owned(), record?)))
                .collect(),
            rows: rows.into_iter().collect(),
            manifest: old.manifest,
            clock: old.clock,
            bodies: Vec::new(),
            report: old.report,
            chain: old.chain,
        }
    }
}

impl LedgerEntry {
    fn parse(line: &[u8], format_version: u32) -> serde_json::Result<Self> {
        match format_version {
            1 => serde_json::from_slice::<EntryOfFormat1>(line).map(Self::from),
            _ => serde_json::from_slice(line),
        }
    }

    /// The frame's file of a stream; `None` if the manifest does not announce the stream.
    pub fn file(&self, stream: &str) -> Option<&FileRecord> {
        self.files.get(stream)
    }

    /// The frame's files that should exist in a cache with this manifest whose newest frame is
    /// `newest`; the particles first.
    pub(super) fn files_there(
        &self,
        manifest: &Manifest,
        newest: u32,
    ) -> impl Iterator<Item = &FileRecord> {
        let has_particles = manifest.has_particles(self.frame, newest);
        let there = STREAMS
            .iter()
            .filter(move |s| has_particles || s.name != stream::PARTICLES);
        there.filter_map(|stream| self.file(stream.name))
    }

    /// The frame's files except that of the particles.
    pub fn files_beside(&self) -> impl Iterator<Item = &FileRecord> {
        let beside = STREAMS.iter().filter(|s| s.name != stream::PARTICLES);
        beside.filter_map(|stream| self.file(stream.name))
    }

    /// The frame's values in a table of a stream; `table` is its index in the manifest. Empty if
    /// there are none.
    pub fn row(&self, stream: &str, table: usize) -> &[Option<f64>] {
        let row = self.rows.get(stream).and_then(|rows| rows.get(table));
        row.map_or(&[], Vec::as_slice)
    }

    /// Why this cannot be the line of `frame` in a cache with this manifest.
    fn misfit(&self, manifest: &Manifest, frame: u32) -> Option<String> {
        if self.frame != frame || self.clock.frame != frame {
            return Some(format!("it is not frame {frame}"));
        }
        let announced = |stream: &&Stream| stream.is_by_frame() && stream.is_in(manifest);
        for stream in STREAMS.iter().filter(announced) {
            let expected = stream.frame_file(manifest, frame);
            if self.file(stream.name).map(|record| &record.file) != Some(&expected) {
                return Some(format!("its {} are not {expected}", stream.name));
            }
        }
        if self.files.len() > STREAMS.iter().filter(announced).count() {
            return Some("it names files that the manifest does not declare".to_owned());
        }
        rows_misfit(manifest, &self.rows)
    }
}

/// Why these rows cannot be part of a line in a cache with this manifest.
pub(super) fn rows_misfit(manifest: &Manifest, rows: &Rows) -> Option<String> {
    let mut expected = 0;
    for stream in &STREAMS {
        let tables = stream.tables(manifest);
        expected += usize::from(!tables.is_empty());
        let found = rows.get(stream.name).map_or(&[][..], Vec::as_slice);
        let name = stream.name;
        if found.len() != tables.len() {
            return Some(format!(
                "its {name} are not those that the manifest declares"
            ));
        }
        let misfit = |(table, values): (&ProbeRecord, &Vec<_>)| {
            let what = table.misfit(values)?;
            Some(format!("of {} in its {name}: {what}", table.name))
        };
        if let Some(misfit) = tables.iter().zip(found).find_map(misfit) {
            return Some(misfit);
        }
        let mut values = found.iter().flatten().flatten();
        if let Some(value) = values.find(|value| !value.is_finite()) {
            return Some(format!("{value} among its {}", stream.name));
        }
    }
    (rows.len() != expected).then(|| "it has rows that the manifest does not declare".to_owned())
}

/// A [`LedgerEntry`] without its chain: what the chained hash covers.
#[derive(Serialize)]
pub(super) struct Contents<'a> {
    pub(super) frame: u32,
    pub(super) particles: u64,
    pub(super) files: &'a Files,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) rows: Option<&'a Rows>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) manifest: Option<&'a str>,
    pub(super) clock: Clock,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub(super) bodies: &'a [BodyState],
    pub(super) report: &'a Value,
}

impl Contents<'_> {
    /// The line with its line end, and the chained hash that the next line needs.
    pub(super) fn to_line(&self, previous: &Hash) -> Result<(Vec<u8>, Hash), CacheError> {
        if !self.clock.time.is_finite() {
            return Err(CacheError::Unfit(format!(
                "frame {} at {} s",
                self.frame, self.clock.time
            )));
        }
        let mut line = serde_json::to_vec(self)
            .map_err(|error| CacheError::Unfit(format!("step report: {error}")))?;
        let chain = chained(previous, &line);
        line.pop();
        line.extend_from_slice(CHAIN_KEY);
        line.extend_from_slice(chain.to_hex().as_bytes());
        line.extend_from_slice(b"\"}\n");
        Ok((line, chain))
    }
}

/// A parse error without the line number, which is always 1.
fn in_line(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rsplit_once(" at line 1 column ") {
        Some((what, column)) => format!("column {column}: {what}"),
        None => text,
    }
}

fn chained(previous: &Hash, contents: &[u8]) -> Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(previous.as_bytes());
    hasher.update(contents);
    hasher.finalize()
}

/// The ledger as found on disk: its whole lines, each checked.
#[derive(Debug)]
pub(super) struct Ledger {
    /// Entries in order, the start first; never empty.
    pub(super) entries: Vec<LedgerEntry>,
    /// Chained hash of the last whole line.
    pub(super) chain: Hash,
    /// Total length of the whole lines, bytes.
    pub(super) whole_bytes: u64,
    /// Byte offset of the end of each entry's line.
    pub(super) ends: Vec<u64>,
    /// Bytes after the last line end: a line torn by a crash, or one being written right now.
    pub(super) torn_bytes: u64,
}

impl Ledger {
    /// Reads and checks the ledger of the cache in `dir`.
    pub(super) fn read(dir: &Path, manifest: &Manifest, seed: &Hash) -> Result<Self, CacheError> {
        let path = dir.join(FILE);
        let bytes = match fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Err(CacheError::damaged(path, "it is missing"));
            }
            other => other.at(&path)?,
        };
        let mut ledger = Self {
            entries: Vec::new(),
            chain: *seed,
            whole_bytes: 0,
            ends: Vec::new(),
            torn_bytes: 0,
        };
        for piece in bytes.split_inclusive(|&b| b == b'\n') {
            let Some(line) = piece.strip_suffix(b"\n") else {
                ledger.torn_bytes = piece.len() as u64;
                break;
            };
            ledger.take(dir, manifest, line)?;
            ledger.whole_bytes += piece.len() as u64;
            ledger.ends.push(ledger.whole_bytes);
        }
        if ledger.entries.is_empty() {
            return Err(CacheError::damaged(path, "it has no complete line"));
        }
        Ok(ledger)
    }

    /// Drops the entries after the newest frame whose particles exist, provided that the manifest
    /// does not keep theirs: a bake resumed from there gives the same lines again.
    pub(super) fn back_to_particles(&mut self, dir: &Path, manifest: &Manifest) {
        while let [.., before, last] = &self.entries[..] {
            let record = last.file(stream::PARTICLES);
            let is_there = record.is_some_and(|record| dir.join(&record.file).exists());
            let Ok(chain) = Hash::from_hex(&before.chain) else {
                return;
            };
            if is_there || manifest.keeps(last.frame) {
                return;
            }
            self.chain = chain;
            self.entries.pop();
            self.ends.pop();
            self.whole_bytes = self.ends.last().copied().unwrap_or(0);
        }
    }

    fn take(&mut self, dir: &Path, manifest: &Manifest, line: &[u8]) -> Result<(), CacheError> {
        let number = self.entries.len() + 1;
        let damaged =
            |what: &str| CacheError::damaged(dir.join(FILE), format!("line {number}: {what}"));
        let mut entry = LedgerEntry::parse(line, manifest.format_version)
            .map_err(|error| damaged(&in_line(&error)))?;
        let (contents, tail) = line.split_at(line.len().saturating_sub(CHAIN_LEN));
        if !tail.starts_with(CHAIN_KEY) {
            return Err(damaged("it does not end with its chained hash"));
        }
        let contents = [contents, b"}"].concat();
        let mut previous = self.chain;
        if number == 1 {
            // Chained to the manifest hash that the line itself records. If that chain is valid,
            // the line is intact, and a different manifest hash means that the manifest changed.
            previous = entry
                .manifest
                .as_ref()
                .and_then(|hex| Hash::from_hex(hex).ok())
                .ok_or_else(|| damaged("it does not name the manifest's hash"))?;
        }
        let chain = chained(&previous, &contents);
        if chain.to_hex().as_str() != entry.chain {
            return Err(damaged("its chained hash does not match"));
        }
        if previous != self.chain {
            return Err(CacheError::damaged(
                dir.join(manifest::FILE),
                "its BLAKE3 checksum differs from the one in the ledger",
            ));
        }
        let frame = u32::try_from(number - 1)
            .ok()
            .and_then(|index| index.checked_add(manifest.first_frame()))
            .ok_or_else(|| damaged("too many frames"))?;
        if bodies::add_rows(manifest, &entry.bodies, &mut entry.rows) {
            return Err(damaged("it has rows of bodies beside their states"));
        }
        if let Some(misfit) = entry.misfit(manifest, frame) {
            return Err(damaged(&misfit));
        }
        self.chain = chain;
        self.entries.push(entry);
        Ok(())
    }
}

/// Appends a line and waits until it is on the disk. `length` is the expected length of the ledger
/// so far; checking it each time detects a ledger that was removed or modified during the bake.
pub(super) fn append(path: &Path, length: u64, line: &[u8]) -> Result<(), CacheError> {
    let file = File::options().write(true).open(path).at(path)?;
    let found = file.metadata().at(path)?.len();
    if found != length {
        return Err(CacheError::damaged(
            path,
            format!(
                "it has {found} bytes, but this bake wrote {length}: another program writes to it"
            ),
        ));
    }
    Ok(output::append(&file, line).at(path)?)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn line(time: f64, report: &Value) -> Result<Vec<u8>, CacheError> {
        let contents = Contents {
            frame: 1,
            particles: 1,
            files: &Files::new(),
            rows: None,
            manifest: None,
            clock: Clock {
                time,
                ..Clock::default()
            },
            bodies: &[],
            report,
        };
        contents.to_line(&blake3::hash(b"")).map(|(line, _)| line)
    }

    proptest! {
        /// serde_json parses floats exactly only with its feature `float_roundtrip`; without it a
        /// resumed bake would start from another clock.
        #[test]
        fn the_clock_comes_back_to_the_last_bit(bits in any::<u64>()) {
            let time = f64::from_bits(bits);
            match line(time, &Value::Null) {
                Err(_) => prop_assert!(!time.is_finite()),
                Ok(line) => {
                    let entry: LedgerEntry = serde_json::from_slice(&line).unwrap();
                    prop_assert_eq!(entry.clock.time.to_bits(), bits);
                }
            }
        }
    }

    #[test]
    fn a_line_is_one_line_whatever_the_report_says() {
        let report = serde_json::json!({ "note": "a\nb\",\"chain\":\"x", "list": [1, null] });
        let line = line(0.5, &report).unwrap();
        assert_eq!(line.iter().filter(|&&b| b == b'\n').count(), 1);
        let entry: LedgerEntry = serde_json::from_slice(&line).unwrap();
        assert_eq!(entry.report, report);
    }
}
