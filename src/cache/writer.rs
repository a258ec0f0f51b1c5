//! Writing a cache, on a thread of its own beside the solver.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use blake3::Hash;
use serde_json::{Value, json};

use super::disk;
use super::error::{AtPath, CacheError};
use super::frame::{self, Stamp};
use super::ledger::{self, Clock, Contents, Entry, Ledger};
use super::manifest::{self, FileRecord, Manifest};
use super::probes::{self, ProbeValues};
use super::reader::read_frame;
use super::vdb;
use crate::domain::particles::Particles;

/// Folder of the frame files.
const FRAMES: &str = "frames";
/// Folder of the grid files.
const GRIDS: &str = "grids";
/// Frames that wait for the disk at most; with the one being written, three are in memory.
const DEPTH: usize = 2;

/// A file that the scene names, to be kept with the frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asset {
    /// Path below `assets/`, with `/`.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// What one writer did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Frames written by this writer.
    pub frames: u32,
    /// Last frame in the ledger.
    pub last_frame: u32,
    /// Length of the frames and grids that this writer wrote.
    pub bytes: u64,
    /// Time that the writer's thread was at work.
    pub writing: Duration,
    /// Time that the solver stood still because the disk was behind.
    pub waiting: Duration,
}

/// Writes frames one after the other, beside its caller. Dropped without [`CacheWriter::finish`], it
/// still writes what it was given, but no one hears of errors.
#[derive(Debug)]
pub struct CacheWriter {
    manifest: Manifest,
    next_frame: u32,
    waiting: Duration,
    sender: Option<SyncSender<Job>>,
    thread: Option<JoinHandle<Result<Summary, CacheError>>>,
    /// Held until the thread has ended: fields are dropped after `Drop::drop`.
    _lock: File,
}

#[derive(Debug)]
struct Job {
    clock: Clock,
    particles: Particles,
    probes: ProbeValues,
    report: Value,
    timings: Value,
}

impl CacheWriter {
    /// Starts a cache in `dir`, which must be absent, empty, or a creation of ours that was cut
    /// short. `start` becomes the first frame: 0, or that of the manifest's parent, with `clock` as it stood there. Of it the
    /// probes say `probes`: one list a probe of the manifest. `manifest.files` and `manifest.start_particles` are filled in.
    ///
    /// # Errors
    /// [`CacheError::Exists`] and [`CacheError::Occupied`], with the directory untouched;
    /// [`CacheError::Locked`]; [`CacheError::Unfit`] before anything is written; [`CacheError::Io`].
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
        check_probes(&manifest, probes)?;
        if clock.frame != manifest.first_frame() {
            let first = manifest.first_frame();
            let what = format!("a start at frame {} where {first} is first", clock.frame);
            return Err(CacheError::Unfit(what));
        }
        refuse_occupied(dir)?;
        disk::create_directory(dir)?;
        let lock = disk::lock(dir)?;
        // Once more under the lock: another process may have begun in between.
        refuse_occupied(dir)?;
        clear_unfinished(dir)?;

        let manifest_bytes = manifest.to_bytes()?;
        write_bytes(&dir.join(manifest::SCENE), scene_toml.as_bytes())?;
        for asset in assets {
            let path = dir.join(manifest::ASSETS).join(&asset.name);
            let parent = path.parent().unwrap_or(dir);
            disk::create_directory(parent)?;
            write_bytes(&path, &asset.bytes)?;
        }
        disk::create_directory(&dir.join(FRAMES))?;
        if manifest.grids.is_some() {
            disk::create_directory(&dir.join(GRIDS))?;
        }
        if !manifest.probes.is_empty() {
            disk::create_directory(&dir.join(probes::FOLDER))?;
            probes::write_all(dir, &manifest.probes, &[])?;
        }
        write_bytes(&dir.join(ledger::FILE), b"")?;

        let seed = blake3::hash(&manifest_bytes);
        let mut sink = Sink {
            dir: dir.to_owned(),
            manifest: manifest.clone(),
            seed,
            chain: seed,
            ledger_bytes: 0,
        };
        sink.write(clock, start, probes, &Value::Null)?;
        // Last, because it is what makes the directory a cache.
        write_bytes(&dir.join(manifest::FILE), &manifest_bytes)?;
        Self::spawn(sink, manifest, clock.frame, lock)
    }

    /// Goes on with the cache in `dir` after its last frame, which is handed back with its line. What
    /// a crash left behind (half a line, temporary files, frames without a line) is cleared, once all
    /// else is found sound.
    ///
    /// # Errors
    /// [`CacheError::NotACache`]; [`CacheError::Format`]; [`CacheError::OtherScene`] for the first
    /// field of the manifest that differs from `given` (`files` and `start_particles` are not
    /// compared); [`CacheError::Locked`]; [`CacheError::Damaged`], with the cache untouched, for the
    /// manifest, scene, assets, ledger, the last frame, or an earlier frame that is missing or of another
    /// length; [`CacheError::Io`].
    pub fn resume(dir: &Path, given: &Manifest) -> Result<(Self, Entry, Particles), CacheError> {
        let (manifest, seed) = Manifest::read(dir)?;
        manifest.expect(dir, given)?;
        let lock = disk::lock(dir)?;
        let Ledger {
            mut entries,
            chain,
            whole_bytes,
            torn_bytes,
        } = Ledger::read(dir, &manifest, &seed)?;
        manifest.scene_record(dir)?;
        manifest.check_files(dir)?;
        for record in entries.iter().flat_map(Entry::files) {
            disk::check_length_on_disk(&dir.join(&record.file), record.bytes)?;
        }
        let Some(last) = entries.pop() else {
            return Err(CacheError::damaged(dir.join(ledger::FILE), "it is empty"));
        };
        let particles = read_frame(dir, &manifest, &last)?;
        if let Some(grids) = &last.grids {
            grids.read(dir)?;
        }

        if torn_bytes > 0 {
            let path = dir.join(ledger::FILE);
            let file = File::options().write(true).open(&path).at(&path)?;
            file.set_len(whole_bytes)
                .and_then(|()| file.sync_all())
                .at(&path)?;
        }
        clear_leftovers(&dir.join(FRAMES), last.frame, |f| {
            frame::file_name(&manifest.shot, f)
        })?;
        if manifest.grids.is_some() {
            clear_leftovers(&dir.join(GRIDS), last.frame, |f| {
                vdb::file_name(&manifest.shot, f)
            })?;
        }
        if !manifest.probes.is_empty() {
            let folder = dir.join(probes::FOLDER);
            disk::create_directory(&folder)?;
            clear_leftovers(&folder, last.frame, |_| String::new())?;
            entries.push(last.clone());
            probes::write_all(dir, &manifest.probes, &entries)?;
        }
        let sink = Sink {
            dir: dir.to_owned(),
            manifest: manifest.clone(),
            seed,
            chain,
            ledger_bytes: whole_bytes,
        };
        let writer = Self::spawn(sink, manifest, last.frame, lock)?;
        Ok((writer, last, particles))
    }

    fn spawn(
        sink: Sink,
        manifest: Manifest,
        last_frame: u32,
        lock: File,
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

    /// The manifest as it stands on disk.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Hands over the frame that follows the last one. Waits only where the disk is more than two
    /// frames behind. `probes` has one list a probe of the manifest. `report` goes into the ledger and must be the same in every bake of the scene;
    /// `timings` goes beside it, or nowhere where it is null.
    ///
    /// # Errors
    /// [`CacheError::Unfit`] for a frame out of turn; the error of an earlier frame, once;
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
        let sent = sender.send(Job {
            clock,
            particles,
            probes,
            report,
            timings,
        });
        self.waiting += begin.elapsed();
        if sent.is_err() {
            // The thread hangs up at an error alone.
            return self.stop().and(Err(CacheError::Stopped));
        }
        self.next_frame += 1;
        Ok(())
    }

    /// Waits until all frames are on the disk and in the ledger.
    ///
    /// # Errors
    /// The error of an earlier frame; [`CacheError::Stopped`] where [`CacheWriter::submit`] gave it
    /// already.
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
            // A drop cannot report; `finish` does.
            let _ = thread.join();
        }
    }
}

/// The writing end, on its thread.
struct Sink {
    dir: PathBuf,
    manifest: Manifest,
    /// The manifest's hash.
    seed: Hash,
    /// Of the last line.
    chain: Hash,
    ledger_bytes: u64,
}

impl Sink {
    fn run(mut self, jobs: &Receiver<Job>, last_frame: u32) -> Result<Summary, CacheError> {
        let mut summary = Summary {
            last_frame,
            ..Summary::default()
        };
        while let Ok(job) = jobs.recv() {
            let begin = Instant::now();
            summary.bytes += self.write(job.clock, &job.particles, &job.probes, &job.report)?;
            self.note_timings(job.clock.frame, &job.timings)?;
            summary.frames += 1;
            summary.last_frame = job.clock.frame;
            summary.writing += begin.elapsed();
        }
        Ok(summary)
    }

    /// Writes a frame and its grids, then its line, then its rows; gives the length of the first two.
    fn write(
        &mut self,
        clock: Clock,
        particles: &Particles,
        probes: &ProbeValues,
        report: &Value,
    ) -> Result<u64, CacheError> {
        let manifest = &self.manifest;
        check(manifest, particles)?;
        check_probes(manifest, probes)?;
        let file = frame::file_name(&manifest.shot, clock.frame);
        let stamp = Stamp {
            program: &manifest.program,
            program_version: &manifest.program_version,
            shot: &manifest.shot,
            frame: clock.frame,
            time: clock.time,
            origin: manifest.origin.into(),
        };
        let written = disk::write_whole(&self.dir.join(&file), |out| {
            frame::encode(out, &stamp, particles)
        })?;
        let grids = match &manifest.grids {
            None => None,
            Some(asked) => {
                let grids = asked
                    .grids(particles, manifest.particle_spacing)
                    .moved(manifest.origin.into());
                let file = vdb::file_name(&manifest.shot, clock.frame);
                let written = disk::write_whole(&self.dir.join(&file), |out| {
                    vdb::encode(out, &stamp, &grids, asked.precision)
                })?;
                Some(FileRecord {
                    file,
                    bytes: written.bytes,
                    blake3: written.hash.to_hex().to_string(),
                })
            }
        };
        let seed = self.seed.to_hex();
        let contents = Contents {
            frame: clock.frame,
            file: &file,
            bytes: written.bytes,
            blake3: &written.hash.to_hex(),
            particles: particles.len() as u64,
            grids: grids.as_ref(),
            probes: (!probes.is_empty()).then_some(probes),
            manifest: (clock.frame == manifest.first_frame()).then_some(seed.as_str()),
            clock,
            report,
        };
        let (line, chain) = contents.to_line(&self.chain)?;
        ledger::append(&self.dir.join(ledger::FILE), self.ledger_bytes, &line)?;
        self.ledger_bytes += line.len() as u64;
        self.chain = chain;
        probes::append(&self.dir, &self.manifest.probes, clock, probes)?;
        Ok(written.bytes + grids.map_or(0, |record| record.bytes))
    }

    fn note_timings(&self, frame: u32, timings: &Value) -> Result<(), CacheError> {
        if timings.is_null() {
            return Ok(());
        }
        let path = self.dir.join(disk::TIMINGS);
        let line = format!("{}\n", json!({ "frame": frame, "timings": timings }));
        File::options()
            .append(true)
            .create(true)
            .open(&path)
            .and_then(|mut file| file.write_all(line.as_bytes()))
            .at(&path)
    }
}

fn check(manifest: &Manifest, particles: &Particles) -> Result<(), CacheError> {
    frame::check(particles)?;
    if !particles.attributes.keys().eq(&manifest.attributes) {
        let given: Vec<_> = particles.attributes.keys().collect();
        return Err(CacheError::Unfit(format!(
            "particles carry {given:?}, and the manifest declares {:?}",
            manifest.attributes
        )));
    }
    Ok(())
}

fn check_probes(manifest: &Manifest, values: &ProbeValues) -> Result<(), CacheError> {
    let values = (!values.is_empty()).then_some(values);
    probes::misfit(&manifest.probes, values).map_or(Ok(()), |what| Err(CacheError::Unfit(what)))
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), CacheError> {
    disk::write_whole(path, |file| file.write_all(bytes))
}

/// The manifest with what only the writer knows, all of it checked.
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

/// Refuses a directory with anything in it but a creation of ours that was cut short: our lock, no
/// manifest, and one frame at most.
fn refuse_occupied(dir: &Path) -> Result<(), CacheError> {
    if super::exists(dir) {
        return Err(CacheError::Exists {
            dir: dir.to_owned(),
        });
    }
    let occupied = |found: String| {
        Err(CacheError::Occupied {
            dir: dir.to_owned(),
            found,
        })
    };
    let names = match dir.metadata() {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        other if other.as_ref().is_ok_and(|m| !m.is_dir()) => {
            return occupied("it is a file".to_owned());
        }
        other => other.at(dir).and_then(|_| disk::names(dir))?,
    };
    let Some(first) = names.first() else {
        return Ok(());
    };
    if !disk::has_our_lock(dir) {
        return occupied(first.clone());
    }
    let ours = [
        disk::LOCK,
        manifest::SCENE,
        manifest::ASSETS,
        FRAMES,
        GRIDS,
        probes::FOLDER,
        ledger::FILE,
        manifest::FILE,
    ];
    if let Some(other) = names.iter().find(|name| !ours.contains(&plain(name))) {
        return occupied(other.clone());
    }
    for (folder, ending, is_one) in [
        (FRAMES, ".ply", true),
        (GRIDS, ".vdb", true),
        (probes::FOLDER, probes::ENDING, false),
    ] {
        let path = dir.join(folder);
        let names = if path.is_dir() {
            disk::names(&path)?
        } else {
            Vec::new()
        };
        let first = names.first().map(|name| plain(name).to_owned());
        let is_ours = |name: &String| {
            let name = plain(name);
            name.ends_with(ending) && (!is_one || first.as_deref() == Some(name))
        };
        if let Some(other) = names.iter().find(|name| !is_ours(name)) {
            return occupied(format!("{folder}/{other}, but no {}", manifest::FILE));
        }
    }
    Ok(())
}

/// A name without the ending of a temporary file.
fn plain(name: &str) -> &str {
    name.strip_suffix(disk::TEMPORARY)
        .and_then(|name| name.strip_suffix('.'))
        .unwrap_or(name)
}

/// Empties what [`refuse_occupied`] let pass, the lock apart.
fn clear_unfinished(dir: &Path) -> Result<(), CacheError> {
    for name in disk::names(dir)? {
        let path = dir.join(&name);
        if [manifest::ASSETS, FRAMES, GRIDS, probes::FOLDER].contains(&name.as_str()) {
            fs::remove_dir_all(&path).at(&path)?;
        } else if name != disk::LOCK {
            fs::remove_file(&path).at(&path)?;
        }
    }
    Ok(())
}

/// Removes from a folder temporary files, and files behind frame `last` as `file_name` names them: they
/// were renamed, but a crash came before their line.
fn clear_leftovers(
    folder: &Path,
    last: u32,
    file_name: impl Fn(u32) -> String,
) -> Result<(), CacheError> {
    for name in disk::names(folder)? {
        let is_frame_behind = name
            .rsplit_once('.')
            .and_then(|(stem, _)| stem.rsplit_once('.'))
            .and_then(|(_, digits)| digits.parse::<u32>().ok())
            .is_some_and(|frame| frame > last && file_name(frame).ends_with(&format!("/{name}")));
        if is_frame_behind || plain(&name).len() < name.len() {
            let path = folder.join(&name);
            fs::remove_file(&path).at(&path)?;
        }
    }
    disk::sync_directory(folder)
}
