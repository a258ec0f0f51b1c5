//! `export`: converts a cache to files for other programs: meshes of the water, USD shots, particle
//! tables, grids. The cache is only read, and no device is needed.
//!
//! Several processes may export shares of one range into one folder. Files that are already
//! complete, from the same cache with the same settings, are skipped.

mod asked;
mod content;
mod error;
mod expected;
mod files;
mod folder;
mod look;
mod shot;
mod usdc;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use swell_cache::{CacheError, CacheReader, refuse_inside};
use swell_domain::{
    chunk::{Chunk, share},
    frame_range::FrameRange,
    output::{AtPath as _, Draft},
    surface::Raster,
    water_mesh::VOLUME,
    whitewater::{ATTRIBUTES, WhitewaterKind},
};
use swell_scene::{Scene, look::Look};

use super::{
    baked_scene, derived::is_of, numbering::Numbering, wet::WetStream, whitewater::directory,
};

use self::{content::Content, folder::Wanted, usdc::Python};

pub use self::{
    error::ExportError,
    expected::{ExpectedExport, expected},
    usdc::UsdcError,
};
pub use swell_domain::name_pattern::{Pattern, PatternError};

/// Default number of voxels of the mesh's grid per particle spacing, the same as in the renderer.
pub const VOXELS: f64 = swell_domain::level_set::VOXELS;

/// How a USD shot represents its water.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UsdWater {
    /// As particles.
    #[default]
    Points,
    /// As a surface mesh.
    Mesh,
}

/// Files of one kind to export.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// The water's surface, as PLY, OBJ or USD depending on the extension.
    Mesh(Pattern),
    /// Particles as NPY.
    Npy(Pattern),
    /// Particles as CSV.
    Csv(Pattern),
    /// Particles as BGEO.
    Bgeo(Pattern),
    /// Level set and velocity grid as OpenVDB.
    Vdb(Pattern),
    /// Density and velocity of a whitewater stream as OpenVDB.
    Fog(Pattern),
    /// A USD shot: this root file, and one layer per frame beside it.
    Usd(PathBuf, UsdWater),
}

/// What to export.
#[derive(Clone, Debug)]
pub struct ExportRequest {
    /// Directory of the cache.
    pub cache: PathBuf,
    /// Name of a whitewater stream to export instead of the water.
    pub stream: Option<String>,
    /// Kinds of whitewater that are exported of a stream's particles; all if `None`, but as fog
    /// only spray.
    pub kinds: Option<Vec<WhitewaterKind>>,
    /// Name of a whitewater stream whose foam the vertices of meshes have.
    pub foam: Option<String>,
    /// Name of a whitewater stream that USD shots have as points beside the water.
    pub whitewater: Option<String>,
    /// Name of the stream of wetness that the solids of a USD shot get.
    pub wet: Option<String>,
    /// Files to export; at least one target.
    pub targets: Vec<Target>,
    /// Frames to export; all frames with particles if `None`.
    pub frames: Option<FrameRange>,
    /// This process's share of the frames; all if `None`.
    pub chunk: Option<Chunk>,
    /// Number that the first exported frame gets in file names and as a USD time code; the others
    /// keep their distance from it. The cache's own numbers if `None`.
    pub number_from: Option<u32>,
    /// Voxels of the mesh's grid per particle spacing.
    pub voxels: f64,
    /// Edge length of a fog's voxels, metres; one particle spacing if `None`.
    pub fog_voxel: Option<f64>,
    /// Look whose camera, materials and light a USD shot gets.
    pub look: Option<Look>,
    /// Python interpreter used to write binary USD.
    pub python: String,
    /// Whether to replace existing files, whatever made them.
    pub overwrite: bool,
    /// Whether to continue with other frames if one frame of the cache is damaged.
    pub keep_going: bool,
}

/// Progress of a running export.
#[derive(Clone, Debug)]
pub enum ExportEvent {
    /// The cache is open.
    Ready {
        /// Number of frames in this process's share.
        frames: usize,
        /// Number of files per frame.
        files: usize,
        /// Warnings for legal but suspicious values of the look's camera.
        warnings: Vec<String>,
    },
    /// Warning about a frame.
    Warning {
        /// The frame.
        frame: u32,
        /// Fraction of the particles' volume that its mesh has too little or too much.
        off: f64,
        /// The warning in words.
        text: String,
    },
    /// The files of a frame are on the disk, or another process is making them.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Number of files made by this run.
        made: usize,
        /// Bytes of these files.
        bytes: u64,
        /// Wall-clock time, seconds.
        seconds: f64,
        /// Volume inside the frame's mesh relative to the particles' volume, if a mesh was made.
        volume: Option<f64>,
    },
    /// A frame could not be exported; the export continues.
    Failed {
        /// Number of the frame.
        frame: u32,
        /// The error.
        error: Arc<ExportError>,
    },
}

/// Result of an export.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ExportOutcome {
    /// Number of files made by this run.
    pub made: usize,
    /// Bytes of these files.
    pub bytes: u64,
    /// Number of files that existed already.
    pub standing: usize,
    /// Number of files that other processes were making.
    pub elsewhere: usize,
    /// Frames that could not be exported.
    pub failed: Vec<u32>,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Exports the requested frames. `tell` receives progress events, and setting `stop` ends the
/// export after the current frame.
///
/// # Errors
/// [`ExportError`]. Existing files of another origin and frames missing from the cache are reported
/// before anything is written; a damaged frame only when it is read.
pub fn export(
    request: &ExportRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(ExportEvent),
) -> Result<ExportOutcome, ExportError> {
    let job = ExportJob::new(request)?;
    let share = share(&job.frames, request.chunk).to_vec();
    let shots = job.shots()?;
    job.check_all(&share, &shots)?;
    tell(ExportEvent::Ready {
        frames: share.len(),
        files: request.targets.len(),
        warnings: job.lints(),
    });
    let mut outcome = ExportOutcome::default();
    for (wanted, bytes) in shots {
        job.make(&wanted, &mut outcome, || Ok(bytes))?;
    }
    'frames: for frame in share {
        if stop.load(Ordering::Relaxed) {
            outcome.interrupted = true;
            break;
        }
        let begun = Instant::now();
        let before = (outcome.made, outcome.bytes);
        let content = Content::new(&job, frame);
        for (target, wanted) in job.files(frame)? {
            match job.make(&wanted, &mut outcome, || job.bytes(target, &content)) {
                Err(error) if request.keep_going && error.is_of_frame() => {
                    outcome.failed.push(frame);
                    let error = Arc::new(error);
                    tell(ExportEvent::Failed { frame, error });
                    continue 'frames;
                }
                made => made?,
            }
        }
        let volume = content.volume();
        if let Some(held) = volume
            && let Some(warning) = warning(held)
        {
            tell(ExportEvent::Warning {
                frame,
                off: (held - 1.0).abs(),
                text: warning,
            });
        }
        tell(ExportEvent::Frame {
            frame,
            made: outcome.made - before.0,
            bytes: outcome.bytes - before.1,
            seconds: begun.elapsed().as_secs_f64(),
            volume,
        });
    }
    Ok(outcome)
}

/// Warning for a mesh whose volume could not be matched to the particles'.
fn warning(volume: f64) -> Option<String> {
    let is_off = (volume - 1.0).abs() > VOLUME;
    is_off.then(|| {
        format!(
            "the mesh holds {:.1} % of the particles' volume, and no value of the field near \
             its own has more of it",
            100.0 * volume
        )
    })
}

/// A running export.
struct ExportJob<'a> {
    request: &'a ExportRequest,
    cache: CacheReader,
    /// The whitewater stream to export instead of the water.
    stream: Option<CacheReader>,
    /// The whitewater stream whose foam is on meshes.
    foam: Option<CacheReader>,
    /// The whitewater stream beside the water in USD shots.
    whitewater: Option<CacheReader>,
    /// The wetness of the solids, and the name of its stream.
    wet: Option<(WetStream, &'a str)>,
    scene: Scene,
    /// All requested frames, of every process.
    frames: Vec<u32>,
    numbering: Numbering,
    /// Present if a file name asks for binary USD.
    python: Option<Python>,
    software: String,
}

impl<'a> ExportJob<'a> {
    fn new(request: &'a ExportRequest) -> Result<Self, ExportError> {
        asked::check(request)?;
        let cache = CacheReader::open(&request.cache)?;
        if let Some(of) = cache.manifest().stream_of() {
            return Err(ExportError::Asked(format!(
                "{} is a stream of {of}: export the cache that it was made from, and name this \
                 stream of it",
                request.cache.display()
            )));
        }
        let open = |name: &Option<String>| {
            let name = name.as_deref();
            name.map(|name| open_stream(request, name)).transpose()
        };
        let (stream, foam) = (open(&request.stream)?, open(&request.foam)?);
        let whitewater = open(&request.whitewater)?;
        let source = stream.as_ref().unwrap_or(&cache);
        let frames = super::frames_of(source, request.frames.as_ref());
        for &frame in &frames {
            source.kept(frame)?;
            for stream in stream.iter().chain(&foam).chain(&whitewater) {
                stream.kept(frame)?;
                if !is_of(stream.entry(frame)?, &cache) {
                    return Err(ExportError::OldStream {
                        directory: stream.dir().to_owned(),
                        frame,
                    });
                }
            }
        }
        let scene = baked_scene(&cache, &request.cache)?;
        check_fog_voxel(request, scene.particle_spacing())?;
        let wet = match &request.wet {
            Some(name) => {
                let stream = WetStream::open(&request.cache, name, (&cache, &scene), &frames)?;
                Some((stream, &**name))
            }
            None => None,
        };
        let needs_python = |target: &Target| match target {
            Target::Mesh(files) => files.ending() == "usdc",
            Target::Usd(file, _) => is_binary(file),
            _ => false,
        };
        let python = match request.targets.iter().any(needs_python) {
            true => Some(Python::with_usd(&request.python)?),
            false => None,
        };
        Ok(Self {
            request,
            cache,
            stream,
            foam,
            whitewater,
            wet,
            scene,
            numbering: Numbering::new(&frames, request.number_from),
            frames,
            python,
            software: format!("{} {}", swell_domain::PROGRAM, swell_domain::VERSION),
        })
    }

    /// Warnings about the look's camera over the frames of all processes.
    fn lints(&self) -> Vec<String> {
        let ends = self
            .frames
            .first()
            .copied()
            .zip(self.frames.last().copied());
        let look = self.request.look.as_ref().zip(ends);
        let rate = self.scene.shot.frames_per_second;
        look.map_or(Vec::new(), |(look, (first, last))| {
            look.lint_camera([first, last], rate)
        })
    }

    /// The cache that is exported: the water, or the stream that replaces it.
    fn source(&self) -> &CacheReader {
        self.stream.as_ref().unwrap_or(&self.cache)
    }

    /// Path of a frame's layer beside a shot; all layers use the same number of digits.
    fn layer(&self, shot: &Path, frame: u32) -> PathBuf {
        let last = self.numbering.of(self.cache.last_frame());
        let digits = last.to_string().len().max(4);
        let number = self.numbering.of(frame);
        beside(shot, &format!("{number:0digits$}"))
    }

    /// The files of a frame, each with its target.
    fn files(&self, frame: u32) -> Result<Vec<(&'a Target, Wanted)>, CacheError> {
        let targets = self.request.targets.iter();
        let of = |target| Ok((target, self.wanted(target, frame)?));
        targets.map(of).collect()
    }

    /// Refuses existing files of another origin.
    fn check_all(&self, share: &[u32], shots: &[(Wanted, Vec<u8>)]) -> Result<(), ExportError> {
        for &frame in share {
            for (_, wanted) in self.files(frame)? {
                self.check(&wanted)?;
            }
        }
        let mut shots = shots.iter();
        shots.try_for_each(|(wanted, _)| self.check(wanted))
    }

    fn check(&self, wanted: &Wanted) -> Result<(), ExportError> {
        refuse_inside(&wanted.file, "name")?;
        match self.request.overwrite {
            true => Ok(()),
            false => wanted.check(),
        }
    }

    /// Makes a file unless it exists already or another process is making it.
    fn make(
        &self,
        wanted: &Wanted,
        outcome: &mut ExportOutcome,
        bytes: impl FnOnce() -> Result<Vec<u8>, ExportError>,
    ) -> Result<(), ExportError> {
        let stands = || !self.request.overwrite && wanted.is_complete();
        if stands() {
            outcome.standing += 1;
            return Ok(());
        }
        let Some(_claim) = wanted.claim()? else {
            outcome.elsewhere += 1;
            return Ok(());
        };
        if stands() {
            outcome.standing += 1;
            return Ok(());
        }
        let write = |draft: &Draft, bytes| fs::write(draft.path(), bytes).at(draft.path());
        let (bytes, draft) = (bytes()?, wanted.draft(&wanted.file));
        match &self.python {
            Some(python) if is_binary(&wanted.file) => {
                let text = wanted.draft(&wanted.file.with_extension("part.usda"));
                write(&text, bytes)?;
                python.convert(text.path(), draft.path())?;
            }
            _ => write(&draft, bytes)?,
        }
        outcome.bytes += wanted.publish(draft)?;
        outcome.made += 1;
        Ok(())
    }
}

/// `shot.0001.usda` for `shot.usda`.
fn beside(shot: &Path, part: &str) -> PathBuf {
    let ending = shot.extension().unwrap_or_default().to_string_lossy();
    shot.with_extension(format!("{part}.{ending}"))
}

fn is_binary(file: &Path) -> bool {
    file.extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("usdc"))
}

fn open_stream(request: &ExportRequest, stream: &str) -> Result<CacheReader, ExportError> {
    let directory = directory(&request.cache, stream);
    if !swell_cache::exists(&directory) {
        return Err(ExportError::NoStream {
            stream: stream.to_owned(),
            directory,
            cache: request.cache.clone(),
        });
    }
    let stream = CacheReader::open(&directory)?;
    let manifest = stream.manifest();
    match manifest.is_whitewater() && manifest.attributes == ATTRIBUTES {
        true => Ok(stream),
        false => Err(ExportError::NotWhitewater { directory }),
    }
}

/// Refuses voxels that no bake's grids could have either.
fn check_fog_voxel(request: &ExportRequest, spacing: f64) -> Result<(), ExportError> {
    let [least, most] =
        [Raster::VOXEL_RATIO.start(), Raster::VOXEL_RATIO.end()].map(|ratio| ratio * spacing);
    match request.fog_voxel {
        Some(size) if !(least..=most).contains(&size) => Err(ExportError::FogVoxel {
            size,
            least,
            most,
            cache: request.cache.clone(),
        }),
        _ => Ok(()),
    }
}
