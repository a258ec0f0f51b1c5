//! The writing end of a cache, on its own thread: a frame's files, then its ledger line, then its
//! rows.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use blake3::Hash;
use serde_json::{Value, json};

use super::bodies;
use super::disk;
use super::error::CacheError;
use super::frame;
use super::ledger::{self, Clock, Contents, Files};
use super::manifest::Manifest;
use super::probes::{ProbeValues, Rows};
use super::record::FileRecord;
use super::stream::{self, Layout, OF_PARTICLES, Stream};
use super::tables;
use super::window::Window;
use swell_domain::{
    output::{self, AtPath as _, FileError},
    particles::Particles,
};

/// Counts of what one writer did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Summary {
    /// Frames written by this writer.
    pub frames: u32,
    /// Last frame in the ledger.
    pub last_frame: u32,
    /// Bytes of the frames and grids that this writer wrote.
    pub bytes: u64,
    /// Time that the writer's thread was busy.
    pub writing: Duration,
    /// Time that the solver waited because the disk was behind.
    pub waiting: Duration,
}

/// The state of the writer's thread.
pub(super) struct Sink {
    pub(super) dir: PathBuf,
    pub(super) manifest: Manifest,
    /// Hash of the manifest, which the first line is chained to.
    pub(super) seed: Hash,
    /// Chained hash of the last line.
    pub(super) chain: Hash,
    pub(super) ledger_bytes: u64,
    /// Sliding windows of the tables, in their order.
    pub(super) windows: Vec<Window>,
}

/// A frame to be written.
#[derive(Debug)]
pub(super) struct WriteJob {
    pub(super) clock: Clock,
    pub(super) particles: Particles,
    pub(super) rows: Rows,
    pub(super) report: Value,
    pub(super) timings: Value,
}

impl Sink {
    pub(super) fn run(
        mut self,
        jobs: &Receiver<WriteJob>,
        last_frame: u32,
    ) -> Result<Summary, CacheError> {
        let mut summary = Summary {
            last_frame,
            ..Summary::default()
        };
        while let Ok(job) = jobs.recv() {
            let begin = Instant::now();
            summary.bytes += self.write(job.clock, &job.particles, &job.rows, &job.report)?;
            self.note_timings(job.clock.frame, &job.timings)?;
            summary.frames += 1;
            summary.last_frame = job.clock.frame;
            summary.writing += begin.elapsed();
        }
        Ok(summary)
    }

    /// Writes a frame's files, then its line, then its rows. Returns the total length of the files.
    pub(super) fn write(
        &mut self,
        clock: Clock,
        particles: &Particles,
        rows: &Rows,
        report: &Value,
    ) -> Result<u64, CacheError> {
        let manifest = &self.manifest;
        check(manifest, particles)?;
        let mut all_rows = rows.clone();
        bodies::add_rows(manifest, &particles.bodies, &mut all_rows);
        check_rows(manifest, &all_rows)?;
        let stamp = manifest.stamp(clock.frame, clock.time);
        let mut files = Files::new();
        for stream in Stream::all(manifest) {
            if let Layout::FileAFrame(encode) = stream.layout {
                let file = stream.frame_file(manifest, clock.frame);
                let written = output::write_with(&self.dir.join(&file), |out| {
                    encode(out, manifest, &stamp, particles)
                })?;
                files.insert(
                    stream.name.to_owned(),
                    FileRecord::of_written(file, &written),
                );
            }
        }
        let seed = self.seed.to_hex();
        let contents = Contents {
            frame: clock.frame,
            particles: particles.len() as u64,
            files: &files,
            rows: (!rows.is_empty()).then_some(rows),
            manifest: (clock.frame == manifest.first_frame()).then_some(seed.as_str()),
            clock,
            bodies: &particles.bodies,
            report,
        };
        let (line, chain) = contents.to_line(&self.chain)?;
        ledger::append(&self.dir.join(ledger::FILE), self.ledger_bytes, &line)?;
        self.ledger_bytes += line.len() as u64;
        self.chain = chain;
        tables::append(
            &self.dir,
            &self.manifest,
            &mut self.windows,
            clock,
            &all_rows,
        )?;
        self.let_go_before(clock.frame)?;
        Ok(files.values().map(|record| record.bytes).sum())
    }

    /// Removes the particles of the frame before `newest` unless they are kept: a bake now resumes
    /// from `newest`.
    fn let_go_before(&self, newest: u32) -> Result<(), FileError> {
        let manifest = &self.manifest;
        match newest.checked_sub(1) {
            Some(before) if !manifest.keeps(before) => {
                let file = OF_PARTICLES.frame_file(manifest, before);
                output::remove_file(&self.dir.join(file))
            }
            _ => Ok(()),
        }
    }

    fn note_timings(&self, frame: u32, timings: &Value) -> Result<(), FileError> {
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

pub(super) fn check(manifest: &Manifest, particles: &Particles) -> Result<(), CacheError> {
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

pub(super) fn check_rows(manifest: &Manifest, rows: &Rows) -> Result<(), CacheError> {
    ledger::rows_misfit(manifest, rows).map_or(Ok(()), |what| Err(CacheError::Unfit(what)))
}

/// Rows of the probes, as the ledger stores them.
pub(super) fn rows_of(probes: ProbeValues) -> Rows {
    let rows = (stream::PROBES.to_owned(), probes);
    Rows::from_iter((!rows.1.is_empty()).then_some(rows))
}
