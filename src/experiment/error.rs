//! Errors of studies.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::{output::FileError, signed_distance::SignedDistanceError};
use swell_gpu::adapter::GpuError;
use swell_reference::ReferenceError;
use swell_scene::SceneError;
use swell_solve::SolveError;
use swell_stage::{Blame, bake::BakeError, device::SolverError, render::RenderJobError};
use swell_study::{picture::PictureError, raster::RasterError};

/// Reason why a study failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A signal ended the study; the same command resumes it.
    #[error("ended by a signal")]
    Stopped,
    /// A bake failed.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// A render failed.
    #[error(transparent)]
    Render(#[from] RenderJobError),
    /// A cache cannot be read.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A solid has no interior, or its distance grid would be too large.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A solver or the exact solution failed.
    #[error(transparent)]
    Solve(#[from] SolverError),
    /// A chart cannot be rasterised.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// A point cannot be measured as the study asks.
    #[error("{0}")]
    Point(String),
    /// A line of the results is invalid.
    #[error("{}:{line}: {what}; remove the line (all of them where another version wrote the \
             file), and its point is run again", file.display())]
    Ledger {
        /// Path of the ledger.
        file: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// Description of the problem.
        what: String,
    },
    /// The study cannot be divided into shares.
    #[error("a study of kind {0} has no shares: its points share one cache; run all of it")]
    NoShares(&'static str),
    /// The folder contains results of another study.
    #[error(
        "{} holds results of the study {found}, not of {name}; left untouched: choose another \
         folder",
        directory.display()
    )]
    OtherStudy {
        /// Path of the folder.
        directory: PathBuf,
        /// Study to which the folder belongs.
        found: String,
        /// Study that was to be run.
        name: String,
    },
    /// The folder contains files of something else than a study.
    #[error("{} contains files that do not belong to a study; choose another folder", .0.display())]
    Occupied(PathBuf),
    /// The scene to write exists, and tuning did not make it.
    #[error("{} exists and is not a tuned scene; choose another file", .0.display())]
    NotTuned(PathBuf),
    /// A picture cannot be embedded in the page.
    #[error("{}", file.display())]
    Picture {
        /// Path of the picture.
        file: PathBuf,
        /// Description of the problem.
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
            StudyError::Point(_)
            | StudyError::NoShares(_)
            | StudyError::Raster(RasterError::MissingFeature(_)) => Self::Input,
            StudyError::Stopped
            | StudyError::OtherStudy { .. }
            | StudyError::Occupied(_)
            | StudyError::NotTuned(_)
            | StudyError::File(_)
            | StudyError::Picture { .. }
            | StudyError::Ledger { .. }
            | StudyError::Raster(_) => Self::Files,
        }
    }
}

impl StudyError {
    /// Returns the message where only the point is at fault, through its scene or its numbers, so
    /// that the study can continue without it.
    ///
    /// # Errors
    /// The error itself, where it would affect every point.
    pub(super) fn of_the_point(self) -> Result<String, Self> {
        match Blame::from(&self) {
            Blame::Numbers | Blame::Input => Ok(self.to_string()),
            Blame::Device | Blame::Files => Err(self),
        }
    }
}
