//! `diff`: two caches, a cache and a baseline, or two renders: where they part, and by how much.

mod against_baseline;
mod pictures;
mod streams;

use std::{
    fs,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use serde::Serialize;

use super::{Blame, gauge::of_caches};
use crate::{
    cache::{self, CacheError, CacheReader, Manifest},
    compare::{baseline::Baseline, frames},
    domain::{
        aggregates::Aggregates,
        frame_range::FrameRange,
        particles::Particles,
        probe::energies,
        solver::StepReport,
        tolerance::{PictureLimits, Tolerance},
    },
    render::RenderError,
    scene::{Scene, SceneError, physics_difference},
    study::measure::Gauge,
};

pub use crate::compare::{
    baseline::{BaselineFault, Basis},
    frames::{AggregatePeak, Fault, FieldDiff, FrameDiff, Parting, aggregate_peaks},
    streams::{Difference, GridDiff, StreamDiff},
};
pub use against_baseline::{BaselineDiff, FramePair, Written, ranges, write_baseline};
pub use pictures::{PairDiff, PicturesDiff};

/// What to compare with what.
#[derive(Clone, Debug)]
pub struct Request {
    /// A cache, a folder of pictures, or a picture.
    pub a: PathBuf,
    /// The reference: the same kind of thing, or a baseline.
    pub b: PathBuf,
    /// Frames to compare; all where `None`.
    pub frames: Option<FrameRange>,
    /// Equal in every bit where `None`.
    pub tolerance: Option<Tolerance>,
    /// Where difference images go.
    pub images: Option<Images>,
    /// Whether a baseline is to judge as if it did not know the adapter.
    pub ignores_hashes: bool,
}

/// Difference images.
#[derive(Clone, Debug)]
pub struct Images {
    /// A PNG for two pictures, a folder for two folders.
    pub path: PathBuf,
    /// What differences are multiplied by.
    pub gain: f64,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outcome {
    /// Two caches.
    Caches(CacheDiff),
    /// A cache and a baseline.
    Baseline(BaselineDiff),
    /// Two renders.
    Pictures(PicturesDiff),
}

/// What differs between two caches.
#[derive(Clone, Debug, Serialize)]
pub struct CacheDiff {
    /// What baked each, and on what.
    pub bakes: [String; 2],
    /// The first key of the scenes that differs, with b's value and then a's.
    pub physics: Option<String>,
    /// Frames that a alone has, of those that were asked for.
    pub only_a: Vec<u32>,
    /// Frames that b alone has.
    pub only_b: Vec<u32>,
    /// Frames of both.
    pub frames: Vec<FrameDiff>,
    /// Streams that a alone has: `grids`, `grid NAME`, `probe NAME`.
    pub streams_only_a: Vec<String>,
    /// Streams that b alone has.
    pub streams_only_b: Vec<String>,
    /// What differs beside the particles, by frame.
    pub streams: Vec<StreamDiff>,
    /// Whether those count: without a tolerance they do, and with one nothing in it names them.
    pub streams_judged: bool,
}

impl CacheDiff {
    fn is_within(&self) -> bool {
        let same_streams = self.streams.is_empty()
            && self.streams_only_a.is_empty()
            && self.streams_only_b.is_empty();
        self.only_a.is_empty()
            && self.only_b.is_empty()
            && self.frames.iter().all(|frame| frame.faults.is_empty())
            && (same_streams || !self.streams_judged)
    }
}

impl Outcome {
    /// Whether nothing is out of tolerance and nothing is missing on one side.
    pub fn is_within(&self) -> bool {
        match self {
            Self::Caches(diff) => diff.is_within(),
            Self::Baseline(diff) => diff.faults.is_empty() && diff.only_baseline.is_empty(),
            Self::Pictures(diff) => diff.is_within(),
        }
    }
}

/// Why two things could not be compared.
#[derive(Debug, thiserror::Error)]
pub enum DiffError {
    /// A cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in a cache, or in a baseline.
    #[error("the scene of {}: {source}", file.display())]
    Scene {
        /// The cache or the baseline.
        file: PathBuf,
        /// What is off with it.
        source: SceneError,
    },
    /// A picture.
    #[error(transparent)]
    Picture(#[from] RenderError),
    /// A file or folder that cannot be read or written.
    #[error("{}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// A baseline that is none.
    #[error("{} is no baseline: {what}", file.display())]
    Baseline {
        /// Which.
        file: PathBuf,
        /// What is off.
        what: String,
    },
    /// A folder without anything to compare.
    #[error("{} holds no cache (no manifest.json) and no PNG or EXR picture", .0.display())]
    Empty(PathBuf),
    /// Arguments that do not go together.
    #[error("{0}")]
    Usage(String),
}

impl From<&DiffError> for Blame {
    fn from(error: &DiffError) -> Self {
        match error {
            DiffError::Usage(_) => Self::Input,
            DiffError::Cache(_)
            | DiffError::Scene { .. }
            | DiffError::Picture(_)
            | DiffError::File { .. }
            | DiffError::Baseline { .. }
            | DiffError::Empty(_) => Self::Files,
        }
    }
}

/// What a path leads to.
enum Subject {
    Cache(Box<CacheReader>),
    Baseline(Box<Baseline>),
    Folder,
    Picture,
}

impl Subject {
    fn of(path: &Path) -> Result<Self, DiffError> {
        let meta = fs::metadata(path).map_err(|source| DiffError::File {
            file: path.to_owned(),
            source,
        })?;
        if meta.is_dir() {
            if cache::exists(path) {
                return Ok(Self::Cache(Box::new(CacheReader::open(path)?)));
            }
            if pictures::in_folder(path, None)?.is_empty() {
                return Err(DiffError::Empty(path.to_owned()));
            }
            return Ok(Self::Folder);
        }
        if pictures::is_picture(path) {
            return Ok(Self::Picture);
        }
        if path
            .extension()
            .is_some_and(|extension| extension == "json")
        {
            let baseline = against_baseline::read(path)?;
            return Ok(Self::Baseline(Box::new(baseline)));
        }
        Err(DiffError::Usage(format!(
            "{} is no cache folder, baseline (.json) or picture (.png, .exr)",
            path.display()
        )))
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Cache(_) => "a cache",
            Self::Baseline(_) => "a baseline",
            Self::Folder => "a folder of pictures",
            Self::Picture => "a picture",
        }
    }
}

/// Compares what is asked for; nothing but difference images is written.
///
/// # Errors
/// [`DiffError`]; what differs is none.
pub fn diff(request: &Request) -> Result<Outcome, DiffError> {
    let subjects = (Subject::of(&request.a)?, Subject::of(&request.b)?);
    if request.images.is_some() && !matches!(subjects.0, Subject::Folder | Subject::Picture) {
        let message = "--output takes difference images, of two renders; these are caches";
        return Err(DiffError::Usage(message.to_owned()));
    }
    if request.ignores_hashes && !matches!(subjects.1, Subject::Baseline(_)) {
        let message = "--ignore-hashes is for a cache and a baseline: nothing else has hashes";
        return Err(DiffError::Usage(message.to_owned()));
    }
    if let (Some(tolerance), Subject::Folder | Subject::Picture) = (&request.tolerance, &subjects.0)
        && tolerance.pictures == PictureLimits::default()
    {
        let message = "the tolerance file has no [pictures]";
        return Err(DiffError::Usage(message.to_owned()));
    }
    match subjects {
        (Subject::Cache(a), Subject::Cache(b)) => Ok(Outcome::Caches(caches(&a, &b, request)?)),
        (Subject::Cache(a), Subject::Baseline(b)) => {
            if request.tolerance.is_some() {
                let message = "--tolerance is for two caches or two renders; a baseline states its own tolerances";
                return Err(DiffError::Usage(message.to_owned()));
            }
            let frames = request.frames.as_ref();
            let ignores_hashes = request.ignores_hashes;
            let found = against_baseline::compare(&a, &b, &request.b, frames, ignores_hashes)?;
            Ok(Outcome::Baseline(found))
        }
        (Subject::Folder, Subject::Folder) => {
            Ok(Outcome::Pictures(pictures::compare_folders(request)?))
        }
        (Subject::Picture, Subject::Picture) => {
            Ok(Outcome::Pictures(pictures::compare_files(request)?))
        }
        (a, b) => Err(DiffError::Usage(format!(
            "{} is {}, and {} is {}; two caches, a cache and then a baseline, two folders of pictures or two pictures \
             can be compared",
            request.a.display(),
            a.kind(),
            request.b.display(),
            b.kind()
        ))),
    }
}

/// A tolerance that judges nothing here would pass anything.
fn check_tolerance(tolerance: &Tolerance, caches: [&CacheReader; 2]) -> Result<(), DiffError> {
    if tolerance.fields.is_empty() && tolerance.aggregates.is_empty() {
        let message = "the tolerance file has [pictures] alone; two caches need [position], [velocity], \
            [attributes.NAME] or [aggregates]";
        return Err(DiffError::Usage(message.to_owned()));
    }
    let mut known = vec!["position", "velocity"];
    known.extend(
        caches
            .iter()
            .flat_map(|c| c.manifest().attributes.iter().map(String::as_str)),
    );
    match tolerance
        .fields
        .keys()
        .find(|name| !known.contains(&name.as_str()))
    {
        Some(name) => Err(DiffError::Usage(format!(
            "the tolerance file limits {name}, which neither cache has; they have {}",
            known.join(", ")
        ))),
        None => Ok(()),
    }
}

fn caches(a: &CacheReader, b: &CacheReader, request: &Request) -> Result<CacheDiff, DiffError> {
    if let Some(tolerance) = &request.tolerance {
        check_tolerance(tolerance, [a, b])?;
    }
    let all =
        |cache: &CacheReader| -> Vec<u32> { (cache.first_frame()..=cache.last_frame()).collect() };
    let [in_a, in_b] = [a, b].map(all);
    let (chosen, only_a, only_b) = match &request.frames {
        Some(frames) => (frames.iter().collect(), Vec::new(), Vec::new()),
        None => {
            let pick = |x: &[u32], y: &[u32], is_in: bool| -> Vec<u32> {
                let frames = x.iter().copied();
                frames.filter(|frame| y.contains(frame) == is_in).collect()
            };
            let only = |x: &[u32], y: &[u32]| pick(x, y, false);
            (
                pick(&in_a, &in_b, true),
                only(&in_a, &in_b),
                only(&in_b, &in_a),
            )
        }
    };
    let chosen: Vec<u32> = chosen;
    for cache in [a, b] {
        cache.check_beside(&chosen)?;
    }
    let gauge = of_caches(&scene_of(b)?, &[b, a])?;
    let (gravity_a, gravity_b) = (scene_of(a)?.water.gravity, scene_of(b)?.water.gravity);
    let frame = |&frame: &u32| {
        let [from, to] = [a, b].map(|cache| cache.manifest().origin.into());
        let (of_a, of_b) = (a.read(frame)?, b.read(frame)?);
        let beside = streams::of_frame([a, b], frame, [&of_a, &of_b])?;
        let of_a = of_a.about(from, to);
        let aggregates = [
            aggregates(a, &gauge, gravity_a, frame, &of_a)?,
            aggregates(b, &gauge, gravity_b, frame, &of_b)?,
        ];
        let tolerance = request.tolerance.as_ref();
        let found = frames::compare(frame, [&of_a, &of_b], aggregates, tolerance);
        Ok((found, beside))
    };
    let found: Vec<(FrameDiff, Vec<StreamDiff>)> = chosen
        .par_iter()
        .map(frame)
        .collect::<Result<_, CacheError>>()?;
    let (frames, beside): (_, Vec<_>) = found.into_iter().unzip();
    Ok(CacheDiff {
        bakes: [a, b].map(|cache| bake_of(cache.manifest())),
        physics: physics(b.dir(), b.scene_toml(), a.scene_toml())?,
        only_a,
        only_b,
        frames,
        streams_only_a: streams::lone(a, b),
        streams_only_b: streams::lone(b, a),
        streams: beside.into_iter().flatten().collect(),
        streams_judged: request.tolerance.is_none(),
    })
}

/// The first key by which `new` differs from the scene of `file`.
fn physics(file: &Path, old: &str, new: &str) -> Result<Option<String>, DiffError> {
    physics_difference(old, new).map_err(|source| DiffError::Scene {
        file: file.to_owned(),
        source,
    })
}

/// The cache's own copy of its scene.
fn scene_of(cache: &CacheReader) -> Result<Scene, DiffError> {
    let file = cache.dir().join("scene.toml");
    Scene::parse(cache.scene_toml(), &file, cache.dir(), &[]).map_err(|source| DiffError::Scene {
        file: cache.dir().to_owned(),
        source,
    })
}

fn bake_of(manifest: &Manifest) -> String {
    format!(
        "{} {} by {} {} on {}",
        manifest.shot,
        manifest.solver,
        manifest.program,
        manifest.program_version,
        adapter_of(manifest)
    )
}

/// What hashes hold for: another driver may round otherwise.
fn adapter_of(manifest: &Manifest) -> String {
    format!(
        "{} ({}, {})",
        manifest.device, manifest.driver, manifest.backend
    )
}

fn aggregates(
    cache: &CacheReader,
    gauge: &Gauge,
    gravity: glam::DVec3,
    frame: u32,
    particles: &Particles,
) -> Result<Aggregates, CacheError> {
    let manifest = cache.manifest();
    let spacing = manifest.particle_spacing;
    let mass = manifest.rest_density * spacing.powi(3);
    let (kinetic, potential) = energies(particles, mass, gravity, gauge.corner());
    let measures = gauge.measure(&particles.position, spacing);
    let report = cache.entry(frame)?.report.clone();
    let report: Option<StepReport> = serde_json::from_value(report).ok();
    Ok(Aggregates {
        kinetic_energy: kinetic,
        potential_energy: potential,
        volume: measures.volume,
        crest_height: measures.crest_height,
        front: measures.front,
        splash_height: measures.splash_height,
        airborne: measures.airborne,
        density_error: report.map(|report| report.density_error_mean),
    })
}
