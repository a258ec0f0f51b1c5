//! Reads a cache. Returns no data whose checksum is wrong, and never writes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::disk;
use super::error::CacheError;
use super::failed;
use super::frame;
use super::ledger::{self, Ledger, LedgerEntry};
use super::manifest::{self, Manifest};
use super::record::FileRecord;
use super::stream::{self, OF_PARTICLES};
use super::tables;
use super::vdb::{self, Grids};
use swell_domain::{keep::Compression, output::AtPath as _, particles::Particles};

/// An open cache with its manifest, ledger, scene and the scene's files, all checked. Frames are
/// checked when they are read. A bake may be running meanwhile: a line that is being written is not
/// seen.
#[derive(Debug)]
pub struct CacheReader {
    dir: PathBuf,
    manifest: Manifest,
    scene_toml: String,
    ledger: Ledger,
}

/// A fault in one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file.
    pub file: PathBuf,
    /// The fault, in words.
    pub what: String,
}

/// Result of checking every checksum.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VerifyReport {
    /// Number of baked frames in the ledger, not counting the start.
    pub frames: u32,
    /// Total length of the frames' files including the start's, as recorded in the ledger.
    pub bytes: u64,
    /// Frames with particles, including the start; empty if all frames have them.
    pub kept: Vec<u32>,
    /// Whether the cache has a `failed/` folder that is intact.
    pub failed: bool,
    /// Faults in the order of the files; empty for an intact cache.
    pub problems: Vec<Problem>,
}

impl VerifyReport {
    /// Turns the first problem into an error.
    ///
    /// # Errors
    /// [`CacheError::Damaged`].
    pub fn into_result(self) -> Result<Self, CacheError> {
        match self.problems.first() {
            None => Ok(self),
            Some(problem) => Err(CacheError::damaged(&problem.file, &problem.what)),
        }
    }
}

/// Checks every checksum of the cache in `dir`, even if the cache is too damaged to be opened.
///
/// # Errors
/// [`CacheError::NotACache`], [`CacheError::Format`], [`CacheError::Io`]; damage goes into the
/// report.
pub fn survey(dir: &Path) -> Result<VerifyReport, CacheError> {
    match CacheReader::open_without_assets(dir) {
        Ok(reader) => Ok(reader.survey()),
        Err(error @ CacheError::Damaged { .. }) => Ok(VerifyReport {
            problems: vec![Problem::of(error, dir)],
            ..VerifyReport::default()
        }),
        Err(error) => Err(error),
    }
}

impl CacheReader {
    /// Path of the ledger, relative to the cache's folder.
    pub const LEDGER: &str = ledger::FILE;

    /// Opens the cache in `dir`.
    ///
    /// # Errors
    /// [`CacheError::NotACache`], [`CacheError::Format`], [`CacheError::Io`];
    /// [`CacheError::Damaged`] for the manifest, the ledger, the scene or one of its files in
    /// `assets/`.
    pub fn open(dir: &Path) -> Result<Self, CacheError> {
        let reader = Self::open_without_assets(dir)?;
        reader.manifest.check_files(dir)?;
        Ok(reader)
    }

    /// [`Self::open`] without checking the assets.
    fn open_without_assets(dir: &Path) -> Result<Self, CacheError> {
        let (manifest, seed) = Manifest::read(dir)?;
        let ledger = Ledger::read(dir, &manifest, &seed)?;
        let record = manifest.scene_record(dir)?;
        let scene_toml = String::from_utf8(record.read(dir)?)
            .map_err(|_| CacheError::damaged(dir.join(&record.file), "it is not UTF-8"))?;
        Ok(Self {
            dir: dir.to_owned(),
            manifest,
            scene_toml,
            ledger,
        })
    }

    /// The cache's folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// The manifest: scene, program and device of the bake.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The scene as baked, with every default written out.
    pub fn scene_toml(&self) -> &str {
        &self.scene_toml
    }

    /// Content of the asset that [`CacheWriter::create`](super::CacheWriter::create) received as
    /// `name`.
    ///
    /// # Errors
    /// [`CacheError::Damaged`], also if the cache has no such asset; [`CacheError::Io`].
    pub fn asset(&self, name: &str) -> Result<Vec<u8>, CacheError> {
        let file = format!("{}/{name}", manifest::ASSETS);
        let record = self.manifest.files.iter().find(|r| r.file == file);
        record
            .ok_or_else(|| {
                CacheError::damaged(self.dir.join(&file), "the manifest has no such file")
            })?
            .read(&self.dir)
    }

    /// The ledger: one entry per frame without gaps, the start first; never empty.
    pub fn entries(&self) -> &[LedgerEntry] {
        &self.ledger.entries
    }

    /// Number of the start: 0, or the frame of another cache that the bake began from.
    pub fn first_frame(&self) -> u32 {
        self.manifest.first_frame()
    }

    /// Number of the last frame in the ledger.
    pub fn last_frame(&self) -> u32 {
        let last = self.ledger.entries.last();
        last.map_or(self.first_frame(), |entry| entry.frame)
    }

    /// The ledger entry of a frame.
    ///
    /// # Errors
    /// [`CacheError::NoFrame`].
    pub fn entry(&self, frame: u32) -> Result<&LedgerEntry, CacheError> {
        let index = frame.checked_sub(self.first_frame());
        index
            .and_then(|index| self.ledger.entries.get(usize::try_from(index).ok()?))
            .ok_or_else(|| CacheError::NoFrame {
                dir: self.dir.clone(),
                frame,
                first: self.first_frame(),
                last: self.last_frame(),
            })
    }

    /// Whether the ledger has the frame and its particles are kept.
    pub fn has_particles(&self, frame: u32) -> bool {
        self.entry(frame).is_ok() && self.manifest.has_particles(frame, self.last_frame())
    }

    /// The ledger entry of a frame whose particles are kept.
    ///
    /// # Errors
    /// [`CacheError::NoFrame`], [`CacheError::NotKept`].
    pub fn kept(&self, frame: u32) -> Result<&LedgerEntry, CacheError> {
        let entry = self.entry(frame)?;
        let has = |frame: &u32| self.has_particles(*frame);
        match self.manifest.keep {
            Some(keep) if !has(&frame) => Err(CacheError::NotKept {
                dir: self.dir.clone(),
                frame,
                keep,
                before: (self.first_frame()..frame).rfind(has).unwrap_or(frame),
                after: (frame..=self.last_frame()).find(has).unwrap_or(frame),
            }),
            _ => Ok(entry),
        }
    }

    /// Reads a frame's water after checking length and checksum: its particles, and others for
    /// the cells of [`swell_domain::deep`].
    ///
    /// # Errors
    /// Those of [`Self::kept`]; [`CacheError::Damaged`] (also for a missing file),
    /// [`CacheError::Io`].
    pub fn read(&self, frame: u32) -> Result<Particles, CacheError> {
        self.state(frame).map(Particles::filled)
    }

    /// Reads the state that a bake continues from.
    ///
    /// # Errors
    /// Those of [`Self::read`].
    pub fn state(&self, frame: u32) -> Result<Particles, CacheError> {
        let found = read_frame(&self.dir, &self.manifest, self.kept(frame)?);
        match found {
            Err(error) => match self.reopen_if_advanced(frame) {
                Some(now) => now.kept(frame).and(Err(error)),
                None => Err(error),
            },
            found => found,
        }
    }

    /// Reopens the cache if `frame` was its newest and a running bake has since removed its
    /// particles.
    fn reopen_if_advanced(&self, frame: u32) -> Option<Self> {
        let was_newest = frame == self.last_frame() && !self.manifest.keeps(frame);
        let now = was_newest.then(|| Self::open(&self.dir).ok()).flatten()?;
        (now.last_frame() > frame).then_some(now)
    }

    /// Recomputes the grids in a frame's file from its particles; `None` if the frame has none, or
    /// if its file is not what this program makes of the particles.
    ///
    /// # Errors
    /// [`CacheError::Io`].
    pub fn grids(
        &self,
        entry: &LedgerEntry,
        particles: &Particles,
    ) -> Result<Option<Grids>, CacheError> {
        let manifest = &self.manifest;
        let (Some(asked), Some(record)) = (&manifest.grids, entry.file(stream::GRIDS)) else {
            return Ok(None);
        };
        let stamp = manifest.stamp(entry.frame, entry.clock.time);
        let grids = asked
            .grids(particles, manifest.particle_spacing)
            .moved(manifest.origin.into());
        let written = vdb::encode(&mut std::io::sink(), &stamp, &grids, asked.precision);
        let hash = written.at(&self.dir.join(&record.file))?.hash;
        Ok((hash.to_hex().as_str() == record.blake3).then_some(grids))
    }

    /// BLAKE3 of the file with a frame's particles, hex.
    ///
    /// # Errors
    /// [`CacheError::NoFrame`]; [`CacheError::Damaged`] if the entry names no particles.
    pub fn frame_hash(&self, frame: u32) -> Result<&str, CacheError> {
        let record = particles_record(&self.dir, self.entry(frame)?)?;
        Ok(&record.blake3)
    }

    /// Checks the files other than the particles: the other files of these frames, and all tables,
    /// which must match the ledger.
    ///
    /// # Errors
    /// [`CacheError::NoFrame`]; [`CacheError::Damaged`] for the first file that differs or cannot
    /// be read.
    pub fn check_beside(&self, frames: &[u32]) -> Result<(), CacheError> {
        let entries = frames.iter().map(|&frame| self.entry(frame));
        let entries: Vec<&LedgerEntry> = entries.collect::<Result<_, CacheError>>()?;
        let problems: Vec<Problem> = entries
            .into_par_iter()
            .flat_map_iter(LedgerEntry::files_beside)
            .filter_map(|record| self.problem(record))
            .collect();
        let first = problems.into_iter().next();
        let first = first.or_else(|| {
            let found = self.table_problems(self.entries()).next()?;
            // A running bake may have written rows since this cache was opened.
            match Self::open(&self.dir) {
                Ok(now) if now.entries().len() > self.entries().len() => {
                    self.table_problems(now.entries()).next()
                }
                _ => Some(found),
            }
        });
        first.map_or(Ok(()), |found| {
            Err(CacheError::damaged(found.file, found.what))
        })
    }

    /// Tables that do not match these lines of the ledger.
    fn table_problems<'a>(
        &'a self,
        entries: &'a [LedgerEntry],
    ) -> impl Iterator<Item = Problem> + 'a {
        let problems = tables::problems(&self.dir, &self.manifest, entries);
        problems.map(|(file, what)| Problem { file, what })
    }

    /// Wall-clock seconds that each frame took to bake, where known. No checksum covers
    /// `timings.jsonl`; incomplete lines are skipped.
    ///
    /// # Errors
    /// [`CacheError::Io`].
    pub fn seconds(&self) -> Result<BTreeMap<u32, f64>, CacheError> {
        let path = self.dir.join(disk::TIMINGS);
        let text = match std::fs::read_to_string(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            other => other.at(&path)?,
        };
        let seconds = |line: &str| {
            let value: serde_json::Value = serde_json::from_str(line).ok()?;
            let frame = u32::try_from(value["frame"].as_u64()?).ok()?;
            Some((frame, value["timings"]["seconds"].as_f64()?))
        };
        Ok(text.lines().filter_map(seconds).collect())
    }

    /// Checks every checksum: scene, assets and each frame's files; the tables, which must match
    /// the ledger; and `failed/`, if a bake failed. The manifest and the ledger's chain were
    /// checked on opening. A file that cannot be read is reported as a problem too.
    pub fn survey(&self) -> VerifyReport {
        let entries = self.entries();
        let mut problems: Vec<Problem> = self
            .manifest
            .files
            .iter()
            .filter_map(|record| self.problem(record))
            .collect();
        if self.ledger.torn_bytes > 0 {
            problems.push(Problem {
                file: self.dir.join(ledger::FILE),
                what: format!(
                    "its last line is truncated after frame {}; a resumed bake removes it (a \
                     running bake may still be writing it)",
                    self.last_frame()
                ),
            });
        }
        let newest = self.last_frame();
        let there = |entry| LedgerEntry::files_there(entry, &self.manifest, newest);
        let mut frames: Vec<Problem> = entries
            .par_iter()
            .flat_map_iter(there)
            .filter_map(|record| self.problem(record))
            .collect();
        if !frames.is_empty() && self.reopen_if_advanced(newest).is_some() {
            let file = OF_PARTICLES.frame_file(&self.manifest, newest);
            frames.retain(|problem| problem.file != self.dir.join(&file));
        }
        problems.extend(frames);
        problems.extend(self.table_problems(entries));
        let failed = self.dir.join(failed::FAILED);
        let has_failed = failed.exists();
        let of_failed = has_failed.then(|| failed::read(&failed).err()).flatten();
        let failed = has_failed && of_failed.is_none();
        problems.extend(of_failed.map(|error| Problem::of(error, &self.dir)));
        VerifyReport {
            frames: self.last_frame() - self.first_frame(),
            bytes: entries.iter().flat_map(there).map(|f| f.bytes).sum(),
            kept: match self.manifest.keep {
                Some(_) => (self.first_frame()..=newest)
                    .filter(|&frame| self.has_particles(frame))
                    .collect(),
                None => Vec::new(),
            },
            failed,
            problems,
        }
    }

    /// Checks every checksum: the report of an intact cache, or the first problem as an error.
    ///
    /// # Errors
    /// [`CacheError::Damaged`].
    pub fn verify(&self) -> Result<VerifyReport, CacheError> {
        self.survey().into_result()
    }

    fn problem(&self, record: &FileRecord) -> Option<Problem> {
        let error = record.check(&self.dir).err()?;
        Some(Problem::of(error, &self.dir.join(&record.file)))
    }
}

impl Problem {
    /// Builds the problem from an error; `file` is used if the error names no file.
    fn of(error: CacheError, file: &Path) -> Self {
        let (file, what) = match error {
            CacheError::Damaged { file, what } => (file, what),
            CacheError::Io(error) => (error.path, format!("it cannot be read: {}", error.source)),
            other => (file.to_owned(), other.to_string()),
        };
        Self { file, what }
    }
}

/// The record of a frame's particles, which every entry has: the ledger's reader checks it.
fn particles_record<'a>(dir: &Path, entry: &'a LedgerEntry) -> Result<&'a FileRecord, CacheError> {
    let no_particles = || {
        let what = format!("frame {} has no particles", entry.frame);
        CacheError::damaged(dir.join(ledger::FILE), what)
    };
    entry.file(stream::PARTICLES).ok_or_else(no_particles)
}

/// Reads and checks the frame of a ledger entry.
pub(super) fn read_frame(
    dir: &Path,
    manifest: &Manifest,
    entry: &LedgerEntry,
) -> Result<Particles, CacheError> {
    let record = particles_record(dir, entry)?;
    let path = dir.join(&record.file);
    let bytes = record.read(dir)?;
    let mut particles = match manifest.compression {
        Some(Compression::Zstd) => frame::planes::decode(&bytes, &path)?,
        None => frame::decode(&bytes, &path)?,
    };
    particles.walls = entry.clock.walls;
    particles.bodies.clone_from(&entry.bodies);
    particles.substep = entry.clock.substep;
    if particles.len() as u64 != entry.particles {
        return Err(CacheError::damaged(
            path,
            format!(
                "it has {} particles, but the ledger lists {}",
                particles.len(),
                entry.particles
            ),
        ));
    }
    if !particles.attributes.keys().eq(&manifest.attributes) {
        return Err(CacheError::damaged(
            path,
            "its attributes differ from those in the manifest",
        ));
    }
    Ok(particles)
}
