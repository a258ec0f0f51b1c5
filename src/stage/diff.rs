//! `diff`: compares two caches, a cache and a baseline, or two renders: where they differ, and by
//! how much.

mod against_baseline;
mod caches;
mod deep;
mod pictures;
mod streams;

use std::{
    fs,
    path::{Path, PathBuf},
};
use swell_files::recorded_scene;

use serde::Serialize;

use super::{Blame, gauge::of_caches};
use swell_cache::{CacheError, CacheReader, Manifest};
use swell_compare::baseline::Baseline;
use swell_domain::{
    aggregates::Aggregates,
    feature::MissingFeature,
    frame_range::FrameRange,
    output::{AtPath as _, FileError},
    particles::Particles,
    solver::StepReport,
    tolerance::{PictureLimits, Tolerance},
};
use swell_files::physics_difference;
use swell_render::RenderError;
use swell_scene::{Scene, SceneError};
use swell_study::measure::Gauge;

pub use against_baseline::{WrittenBaseline, write_baseline};
pub use swell_compare::{
    baseline::{BaselineDiff, BaselineFault, Basis, FramePair},
    caches::CacheDiff,
    frames::{AggregatePeak, Fault, FieldDiff, FrameDiff, Parting, aggregate_peaks},
    pictures::{PairDiff, PicturesDiff},
    streams::{Difference, GridDiff, StreamDiff},
};

/// What to compare with what.
#[derive(Clone, Debug)]
pub struct DiffRequest {
    /// A cache, a folder of pictures, or a picture.
    pub a: PathBuf,
    /// The reference: the same kind of thing, or a baseline.
    pub b: PathBuf,
    /// Frames to compare; all if `None`.
    pub frames: Option<FrameRange>,
    /// Tolerances; if `None`, every bit must be equal, or between devices the aggregates must be
    /// within the limits of a new baseline.
    pub tolerance: Option<Tolerance>,
    /// Where to write difference images; none if `None`.
    pub images: Option<Images>,
    /// Whether to ignore a baseline's hashes, as if it did not know the adapter.
    pub ignores_hashes: bool,
}

/// Difference images to write.
#[derive(Clone, Debug)]
pub struct Images {
    /// A PNG for two pictures, a folder for two folders.
    pub path: PathBuf,
    /// Factor that differences are multiplied by.
    pub gain: f64,
}

/// Result of a comparison.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum DiffOutcome {
    /// Two caches.
    Caches(CacheDiff),
    /// A cache and a baseline.
    Baseline(BaselineDiff),
    /// Two renders.
    Pictures(PicturesDiff),
}

impl DiffOutcome {
    /// Whether nothing is out of tolerance and nothing is missing on one side.
    pub fn is_within(&self) -> bool {
        match self {
            Self::Caches(diff) => diff.is_within(),
            Self::Baseline(diff) => diff.is_within(),
            Self::Pictures(diff) => diff.is_within(),
        }
    }
}

/// Why two things could not be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiffError {
    /// Reading a cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in a cache or in a baseline.
    #[error("the scene of {}: {source}", file.display())]
    Scene {
        /// The cache or the baseline.
        file: PathBuf,
        /// What is wrong with it.
        source: SceneError,
    },
    /// Reading or writing a picture failed.
    #[error(transparent)]
    Picture(#[from] RenderError),
    /// A file or folder that cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file that is not a valid baseline.
    #[error("{} is not a baseline: {what}", file.display())]
    Baseline {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// A folder without anything to compare.
    #[error(
        "{} contains neither a cache (no manifest.json) nor a PNG or EXR picture",
        .0.display()
    )]
    Empty(PathBuf),
    /// Difference images of something else than renders.
    #[error("difference images are of two renders; these are caches")]
    NoImages,
    /// Hashes to ignore where there are none.
    #[error("hashes can be ignored for a cache and a baseline: nothing else has hashes")]
    NoHashes,
    /// A tolerance beside those of a baseline.
    #[error("a tolerance is for two caches or two renders; a baseline states its own tolerances")]
    OwnTolerances,
    /// A request that does not fit what is compared.
    #[error("{0}")]
    Usage(String),
    /// Pictures are compared, and the feature `perceptual` is off.
    #[error(transparent)]
    MissingFeature(#[from] MissingFeature),
}

impl DiffError {
    fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }
}

impl From<&DiffError> for Blame {
    fn from(error: &DiffError) -> Self {
        match error {
            DiffError::NoImages
            | DiffError::NoHashes
            | DiffError::OwnTolerances
            | DiffError::Usage(_)
            | DiffError::MissingFeature(_) => Self::Input,
            DiffError::Cache(_)
            | DiffError::Scene { .. }
            | DiffError::Picture(_)
            | DiffError::File(_)
            | DiffError::Baseline { .. }
            | DiffError::Empty(_) => Self::Files,
        }
    }
}

/// What a path refers to.
enum Subject {
    Cache(Box<CacheReader>),
    Baseline(Box<Baseline>),
    Folder,
    Picture,
}

impl Subject {
    fn of(path: &Path) -> Result<Self, DiffError> {
        let is_folder = fs::metadata(path).at(path)?.is_dir();
        if is_folder && swell_cache::exists(path) {
            return Ok(Self::Cache(Box::new(CacheReader::open(path)?)));
        }
        if is_folder && pictures::in_folder(path, None)?.is_empty() {
            return Err(DiffError::Empty(path.to_owned()));
        }
        if is_folder {
            return Ok(Self::Folder);
        }
        if pictures::is_picture(path) {
            return Ok(Self::Picture);
        }
        if path.extension().is_some_and(|ending| ending == "json") {
            let baseline = against_baseline::read(path)?;
            return Ok(Self::Baseline(Box::new(baseline)));
        }
        Err(DiffError::usage(format!(
            "{} is not a cache folder, a baseline (.json) or a picture (.png, .exr)",
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

/// Compares what the request names; writes nothing but difference images.
///
/// # Errors
/// [`DiffError`]; a difference is not an error.
pub fn diff(request: &DiffRequest) -> Result<DiffOutcome, DiffError> {
    let (a, b) = (Subject::of(&request.a)?, Subject::of(&request.b)?);
    let is_render = matches!(a, Subject::Folder | Subject::Picture);
    let is_baseline = matches!(b, Subject::Baseline(_));
    let tolerance = request.tolerance.as_ref();
    let misfits = [
        (request.images.is_some() && !is_render, DiffError::NoImages),
        (request.ignores_hashes && !is_baseline, DiffError::NoHashes),
        (
            is_render && tolerance.is_some_and(|t| t.pictures == PictureLimits::default()),
            DiffError::usage("the tolerance file has no [pictures]"),
        ),
        (
            matches!(a, Subject::Cache(_)) && is_baseline && tolerance.is_some(),
            DiffError::OwnTolerances,
        ),
    ];
    if let Some((_, misfit)) = misfits.into_iter().find(|(is_off, _)| *is_off) {
        return Err(misfit);
    }
    Ok(match (a, b) {
        (Subject::Cache(a), Subject::Cache(b)) => {
            DiffOutcome::Caches(caches::compare([&a, &b], request)?)
        }
        (Subject::Cache(a), Subject::Baseline(b)) => {
            DiffOutcome::Baseline(against_baseline::compare(&a, &b, request)?)
        }
        (Subject::Folder, Subject::Folder) => {
            DiffOutcome::Pictures(pictures::compare_folders(request)?)
        }
        (Subject::Picture, Subject::Picture) => {
            DiffOutcome::Pictures(pictures::compare_files(request)?)
        }
        (a, b) => {
            return Err(DiffError::usage(format!(
                "{} is {}, and {} is {}; two caches, a cache and then a baseline, two folders of \
                 pictures or two pictures can be compared",
                request.a.display(),
                a.kind(),
                request.b.display(),
                b.kind()
            )));
        }
    })
}

/// The first key in which `new` differs from the scene of `file`.
fn physics(file: &Path, old: &str, new: &str) -> Result<Option<String>, DiffError> {
    physics_difference(old, new).map_err(|source| DiffError::Scene {
        file: file.to_owned(),
        source,
    })
}

/// The cache's own copy of its scene.
fn scene_of(cache: &CacheReader) -> Result<Scene, DiffError> {
    let file = cache.dir().join("scene.toml");
    recorded_scene(cache.scene_toml(), &file, cache.dir()).map_err(|source| DiffError::Scene {
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

/// The adapter and driver for which hashes are valid: another driver may round differently.
fn adapter_of(manifest: &Manifest) -> String {
    format!(
        "{} ({}, {})",
        manifest.device, manifest.driver, manifest.backend
    )
}

/// Aggregates of a frame's particles, with the density error from the frame's report.
fn aggregates(
    cache: &CacheReader,
    scene: &Scene,
    gauge: &Gauge,
    frame: u32,
    particles: &Particles,
) -> Result<Aggregates, CacheError> {
    let manifest = cache.manifest();
    let report = cache.entry(frame)?.report.clone();
    let report: Option<StepReport> = serde_json::from_value(report).ok();
    let (spacing, density) = (manifest.particle_spacing, manifest.rest_density);
    Ok(Aggregates {
        density_error: report.map(|report| report.density_error_mean),
        ..gauge.aggregates(particles, spacing, density, scene.water.gravity)
    })
}
