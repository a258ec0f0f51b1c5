//! `study`: runs what a study asks for, measures it, and writes the page.

mod comparison;
mod ledger;
pub mod stability;
mod sweep;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use crate::{
    cache::{CacheError, CacheReader},
    domain::signed_distance::SignedDistanceError,
    gpu::adapter::{self, GpuError},
    reference::ReferenceError,
    scene::{Scene, SceneError, study::Study},
    solve::SolveError,
    study::{
        measure::{Direction, Gauge},
        page::Part,
        picture::PictureError,
        raster::RasterError,
    },
};

use super::{
    Blame,
    bake::{self, BakeError},
    device::SolverError,
    render::{self, RenderJobError},
};

/// What to study, and where to.
#[derive(Clone, Debug)]
pub struct Request {
    /// Validated study.
    pub study: Study,
    /// Caches, pictures, table and page go in here.
    pub directory: PathBuf,
    /// Index or part of the name of an adapter.
    pub adapter: Option<String>,
    /// As typed, for the page.
    pub command: String,
}

/// What a study has to tell while it runs.
#[derive(Clone, Debug)]
pub enum Event {
    /// A bake begins or goes on.
    Solver(&'static str),
    /// What a user has to know of a scene of the study.
    Warning(String),
    /// A bake tells.
    Bake(Box<bake::Event>),
    /// A render tells.
    Render(render::Event),
    /// A point of a sweep.
    Point(PointEvent),
}

/// Where a sweep stands.
#[derive(Clone, Debug)]
pub struct PointEvent {
    /// From 1.
    pub number: usize,
    /// Points of the study.
    pub count: usize,
    /// Method and setting.
    pub name: String,
    /// What became of it.
    pub status: PointStatus,
}

/// What became of a point of a sweep.
#[derive(Clone, Debug)]
pub enum PointStatus {
    /// It stands there from a run before.
    Stands,
    /// It was run: milliseconds a frame or a projection, and each error that is known already, with its name.
    Done(f64, Vec<(&'static str, f64)>),
    /// Its numbers failed.
    Failed(String),
}

/// How a study ended.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Its page; `None` where a signal ended it before.
    pub page: Option<PathBuf>,
    /// What was found, in words.
    pub findings: Vec<String>,
    /// Marks that are missed and not known to be; only of a study that has marks.
    pub missed: Vec<String>,
}

/// Why a study failed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A bake.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// A render.
    #[error(transparent)]
    Render(#[from] RenderJobError),
    /// A cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file that cannot be read or written.
    #[error("{}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// A solid without inside, or too large a grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A solver, or the exact solution.
    #[error(transparent)]
    Solve(#[from] SolverError),
    /// A curve that cannot be drawn.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// A point of a sweep that its measure does not fit.
    #[error("{0}")]
    Point(String),
    /// A line of a sweep's results that cannot be read.
    #[error("{}:{line}: {what}; remove the line, and its point is run again", file.display())]
    Ledger {
        /// Which file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// What is off.
        what: String,
    },
    /// A picture that cannot stand in the page.
    #[error("{}", file.display())]
    Picture {
        /// Which.
        file: PathBuf,
        /// What is off.
        source: PictureError,
    },
}

impl From<SolveError> for StudyError {
    fn from(error: SolveError) -> Self {
        Self::Solve(error.into())
    }
}

impl From<ReferenceError> for StudyError {
    fn from(error: ReferenceError) -> Self {
        Self::Solve(error.into())
    }
}

impl From<&StudyError> for Blame {
    fn from(error: &StudyError) -> Self {
        match error {
            StudyError::Bake(error) => error.into(),
            StudyError::Render(error) => error.into(),
            StudyError::Cache(error) => error.into(),
            StudyError::Scene(error) => error.into(),
            StudyError::Solid(error) => error.into(),
            StudyError::Gpu(error) => error.into(),
            StudyError::Solve(error) => error.into(),
            StudyError::Point(_) => Self::Input,
            StudyError::File { .. }
            | StudyError::Picture { .. }
            | StudyError::Ledger { .. }
            | StudyError::Raster(_) => Self::Files,
        }
    }
}

/// Runs a study; `tell` hears of progress, and `stop` ends it after the current frame of a bake or render, or a
/// sweep within its point, which is then run anew. What stands in the directory already is gone on with.
///
/// # Errors
/// [`StudyError`].
pub fn study(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, StudyError> {
    // Also where no point needs it: a name that is none is not passed over.
    if let Some(adapter) = &request.adapter {
        adapter::check_request(adapter)?;
    }
    for warning in request.study.warnings() {
        tell(Event::Warning(warning));
    }
    match &request.study {
        Study::SolverComparison(comparison) => comparison::run(request, comparison, stop, tell),
        Study::Sweep(sweep) => sweep::run(request, sweep, stop, tell),
        Study::Stability(stability) => stability::run(request, stability, stop, tell),
    }
}

/// What was typed, and what was told of the scenes.
fn what_was_run(request: &Request) -> Vec<Part> {
    let warnings = request.study.warnings().into_iter();
    let told = warnings.map(|warning| Part::Text(format!("Warning: {warning}")));
    [Part::Code(request.command.clone())]
        .into_iter()
        .chain(told)
        .collect()
}

/// The wave runs away from the first wave maker; towards greater x where there is none.
fn direction(scene: &Scene) -> Direction {
    let along = |axis, is_forward| Direction { axis, is_forward };
    scene
        .wave_makers
        .iter()
        .find(|maker| maker.wall.axis != 1)
        .map_or(along(0, true), |maker| {
            along(maker.wall.axis, !maker.wall.is_max)
        })
}

/// One gauge for all: the coarsest lattice decides.
pub(super) fn gauge(scene: &Scene, caches: &[&CacheReader]) -> Result<Gauge, CacheError> {
    let spacings = caches.iter().map(|c| c.manifest().particle_spacing);
    let coarsest = spacings.fold(0.0, f64::max);
    // A bake that began from a frame of another knows no rest: the earliest start comes nearest.
    let first = caches.iter().min_by_key(|cache| cache.first_frame());
    let first = first.unwrap_or(&caches[0]);
    let spacing = first.manifest().particle_spacing;
    let start = first.read(first.first_frame())?;
    let gauge = Gauge::new(scene.domain, direction(scene), coarsest);
    let still = still_level(scene, &gauge, &start.position, spacing);
    Ok(gauge.with_still_level(still))
}

/// Metres above the domain's floor. Where a wave maker stands, the still level is that of the start; other water has
/// none at the start, and what it would settle to is taken. Particles are `spacing` metres apart.
fn still_level(scene: &Scene, gauge: &Gauge, start: &[[f32; 3]], spacing: f64) -> f64 {
    if scene.wave_makers.is_empty() {
        let size = scene.domain.size();
        start.len() as f64 * spacing.powi(3) / (size.x * size.z)
    } else {
        gauge.depth(start, spacing)
    }
}

fn write(file: &Path, text: impl AsRef<[u8]>) -> Result<(), StudyError> {
    fs::write(file, text).map_err(|source| StudyError::File {
        file: file.to_owned(),
        source,
    })
}

/// Rows with commas between cells, quoted where they have to be.
fn csv(rows: &[Vec<String>]) -> String {
    let quoted = |cell: &String| match cell.contains([',', '"', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let joined = rows
        .iter()
        .map(|row| row.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n");
    joined.collect()
}
