//! Writes a cache on a separate thread, parallel to the solver.

use std::fs::File;
use std::path::Path;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::bodies;
use super::disk;
use super::error::CacheError;
use super::folder;
use super::ledger::{self, Clock, Ledger, LedgerEntry};
use super::manifest::{self, Manifest};
use super::probes::ProbeValues;
use super::reader::read_frame;
use super::record::FileRecord;
use super::sink::{Sink, Summary, WriteJob, check, check_rows, rows_of};
use super::tables;
use swell_domain::{
    output::{self, AtPath as _, Lock},
    particles::Particles,
};

/// Most frames that wait for the disk; with the one being written, three are in memory.
const DEPTH: usize = 2;

/// A file that the scene names, stored in the cache.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asset {
    /// Path below `assets/`, with `/`.
    pub name: String,
    /// Content of the file.
    pub bytes: Vec<u8>,
}

/// Writes frames one after another on its own thread. Dropped without [`CacheWriter::finish`], it
/// still writes what it was given, but errors are lost.
#[derive(Debug)]
pub struct CacheWriter {
    manifest: Manifest,
    next_frame: u32,
    waiting: Duration,
    sender: Option<SyncSender<WriteJob>>,
    thread: Option<JoinHandle<Result<Summary, CacheError>>>,
    /// Held until the thread has ended: fields are dropped after `Drop::drop`.
    _lock: Lock,
}

impl CacheWriter {
    /// Creates a cache in `dir`, which must be absent, empty, or an interrupted creation of our
    /// own.
    ///
    /// `start` becomes the first frame: 0, or the parent's frame, with the parent's `clock`.
    /// `probes` holds the start's measurements, one list per probe of the manifest.
    /// `manifest.files` and `manifest.start_particles` are filled in.
    ///
    /// # Errors
    /// [`CacheError::Exists`] and [`CacheError::Occupied`], with the directory untouched;
    /// [`CacheError::Locked`]; [`CacheError::Unfit`] before anything is written;
    /// [`CacheError::Io`].
    pub fn create(
        dir: &Path,
        manifest: Manifest,
        scene_toml: &str,
        assets: &[Asset],
        clock: Clock,
        start: &Particles,
        probes: &ProbeValues,
    ) -> Result<Self, CacheError> {
        let manifest = completed(manifest, scene_toml, assets, start)?;
        let rows = rows_of(probes.clone());
        let mut all_rows = rows.clone();
        bodies::add_rows(&manifest, &start.bodies, &mut all_rows);
        check_rows(&manifest, &all_rows)?;
        if clock.frame != manifest.first_frame() {
            let first = manifest.first_frame();
            let what = format!("a start at frame {} where {first} is first", clock.frame);
            return Err(CacheError::Unfit(what));
        }
        folder::refuse_occupied(dir)?;
        output::create_folder(dir)?;
        let lock = disk::lock(dir)?;
        // Checked again under the lock: another process may have started in between.
        folder::refuse_occupied(dir)?;
        folder::clear_unfinished(dir)?;

        let manifest_bytes = manifest.to_bytes()?;
        output::write(&dir.join(manifest::SCENE), scene_toml)?;
        for asset in assets {
            let path = dir.join(manifest::ASSETS).join(&asset.name);
            let parent = path.parent().unwrap_or(dir);
            output::create_folder(parent)?;
            output::write(&path, &asset.bytes)?;
        }
        folder::make_streams(dir, &manifest)?;
        let windows = tables::write_all(dir, &manifest, &[])?;
        output::write(&dir.join(ledger::FILE), b"")?;

        let seed = blake3::hash(&manifest_bytes);
        let mut sink = Sink {
            dir: dir.to_owned(),
            manifest: manifest.clone(),
            seed,
            chain: seed,
            ledger_bytes: 0,
            windows,
        };
        sink.write(clock, start, &rows, &Value::Null)?;
        // Last, because the manifest is what makes the directory a cache.
        output::write(&dir.join(manifest::FILE), &manifest_bytes)?;
        Self::spawn(sink, manifest, clock.frame, lock)
    }

    /// Resumes the cache in `dir` after its last frame, which is returned with its ledger entry.
    ///
    /// If the particles of the last frame are gone and need not be kept, the bake resumes after the
    /// newest frame that has particles, and the later lines are cut. What a crash left (half a
    /// line, temporary files, frames without a line) is cleared once everything else has been
    /// checked.
    ///
    /// # Errors
    /// - [`CacheError::NotACache`], [`CacheError::Format`], [`CacheError::OldFormat`],
    ///   [`CacheError::Locked`], [`CacheError::Io`].
    /// - [`CacheError::OtherParent`], [`CacheError::OtherProbes`], and [`CacheError::OtherScene`]
    ///   for the first field of the manifest that differs from `given` (`files` and
    ///   `start_particles` are not compared).
    /// - [`CacheError::Damaged`], with the cache untouched, for the manifest, scene, assets,
    ///   ledger, the last frame, or an earlier frame that is missing or of another length.
    pub fn resume(
        dir: &Path,
        given: &Manifest,
    ) -> Result<(Self, LedgerEntry, Particles), CacheError> {
        let (manifest, seed) = Manifest::read(dir)?;
        manifest.expect(dir, given)?;
        let lock = disk::lock(dir)?;
        let mut ledger = Ledger::read(dir, &manifest, &seed)?;
        let found_bytes = ledger.whole_bytes + ledger.torn_bytes;
        ledger.back_to_particles(dir, &manifest);
        let Ledger {
            mut entries,
            chain,
            whole_bytes,
            ..
        } = ledger;
        manifest.scene_record(dir)?;
        manifest.check_files(dir)?;
        let newest = entries.last().map_or(0, |entry| entry.frame);
        for entry in &entries {
            for record in entry.files_there(&manifest, newest) {
                disk::check_length_on_disk(&dir.join(&record.file), record.bytes)?;
            }
        }
        let Some(last) = entries.pop() else {
            return Err(CacheError::damaged(dir.join(ledger::FILE), "it is empty"));
        };
        let particles = read_frame(dir, &manifest, &last)?;
        last.files_beside()
            .try_for_each(|record| record.check(dir))?;

        if whole_bytes < found_bytes {
            let path = dir.join(ledger::FILE);
            let file = File::options().write(true).open(&path).at(&path)?;
            file.set_len(whole_bytes)
                .and_then(|()| file.sync_all())
                .at(&path)?;
        }
        // A folder of tables may be missing: all its content is rewritten.
        folder::make_streams(dir, &manifest)?;
        folder::clear_leftovers(dir, &manifest, last.frame)?;
        entries.push(last.clone());
        let windows = tables::write_all(dir, &manifest, &entries)?;
        let sink = Sink {
            dir: dir.to_owned(),
            manifest: manifest.clone(),
            seed,
            chain,
            ledger_bytes: whole_bytes,
            windows,
        };
        let writer = Self::spawn(sink, manifest, last.frame, lock)?;
        Ok((writer, last, particles))
    }

    fn spawn(
        sink: Sink,
        manifest: Manifest,
        last_frame: u32,
        lock: Lock,
    ) -> Result<Self, CacheError> {
        let (sender, jobs) = sync_channel(DEPTH);
        let dir = sink.dir.clone();
        let thread = std::thread::Builder::new()
            .name("cache-writer".to_owned())
            .spawn(move || sink.run(&jobs, last_frame))
            .at(&dir)?;
        Ok(Self {
            manifest,
            next_frame: last_frame + 1,
            waiting: Duration::ZERO,
            sender: Some(sender),
            thread: Some(thread),
            _lock: lock,
        })
    }

    /// The manifest as stored on disk.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Queues the next frame for writing. Blocks only if the disk is more than two frames behind.
    ///
    /// `probes` holds one list per probe of the manifest. `report` goes into the ledger and must be
    /// the same in every bake of the scene; `timings` goes to a separate file, or nowhere if it is
    /// null.
    ///
    /// # Errors
    /// [`CacheError::Unfit`] for a frame out of order; the error of an earlier frame, once;
    /// [`CacheError::Stopped`] after that.
    pub fn submit(
        &mut self,
        clock: Clock,
        particles: Particles,
        probes: ProbeValues,
        report: Value,
        timings: Value,
    ) -> Result<(), CacheError> {
        if clock.frame != self.next_frame {
            return Err(CacheError::Unfit(format!(
                "frame {} where {} follows",
                clock.frame, self.next_frame
            )));
        }
        let Some(sender) = &self.sender else {
            return Err(CacheError::Stopped);
        };
        let begin = Instant::now();
        let sent = sender.send(WriteJob {
            clock,
            particles,
            rows: rows_of(probes),
            report,
            timings,
        });
        self.waiting += begin.elapsed();
        if sent.is_err() {
            // The thread hangs up only on an error.
            return self.stop().and(Err(CacheError::Stopped));
        }
        self.next_frame += 1;
        Ok(())
    }

    /// Waits until all frames are on the disk and in the ledger.
    ///
    /// # Errors
    /// The error of an earlier frame; [`CacheError::Stopped`] if [`CacheWriter::submit`] has
    /// already returned it.
    pub fn finish(mut self) -> Result<Summary, CacheError> {
        let waiting = self.waiting;
        self.stop().map(|summary| Summary { waiting, ..summary })
    }

    fn stop(&mut self) -> Result<Summary, CacheError> {
        self.sender = None;
        match self.thread.take().map(JoinHandle::join) {
            None => Err(CacheError::Stopped),
            Some(Ok(result)) => result,
            Some(Err(panic)) => std::panic::resume_unwind(panic),
        }
    }
}

impl Drop for CacheWriter {
    fn drop(&mut self) {
        self.sender = None;
        if let Some(thread) = self.thread.take() {
            // A drop cannot report an error; `finish` does.
            let _ = thread.join();
        }
    }
}

/// The manifest with the fields that only the writer knows, fully checked.
fn completed(
    mut manifest: Manifest,
    scene_toml: &str,
    assets: &[Asset],
    start: &Particles,
) -> Result<Manifest, CacheError> {
    manifest.attributes.sort_unstable();
    manifest.start_particles = start.len() as u64;
    manifest.files = vec![FileRecord::new(manifest::SCENE, scene_toml.as_bytes())];
    for asset in assets {
        let file = format!("{}/{}", manifest::ASSETS, asset.name);
        manifest.files.push(FileRecord::new(file, &asset.bytes));
    }
    if manifest.format_version != Manifest::FORMAT_VERSION {
        return Err(CacheError::Unfit(format!(
            "format version {}",
            manifest.format_version
        )));
    }
    manifest.check().map_err(CacheError::Unfit)?;
    check(&manifest, start)?;
    Ok(manifest)
}
