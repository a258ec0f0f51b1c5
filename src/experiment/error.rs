//! Why a study fails.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::signed_distance::SignedDistanceError;
use swell_gpu::adapter::GpuError;
use swell_reference::ReferenceError;
use swell_scene::SceneError;
use swell_solve::SolveError;
use swell_stage::{Blame, bake::BakeError, device::SolverError, render::RenderJobError};
use swell_study::{picture::PictureError, raster::RasterError};

/// Why a study failed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A signal ended it; the same command resumes it.
    #[error("ended by a signal")]
    Stopped,
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
    /// A point that its measure does not fit.
    #[error("{0}")]
    Point(String),
    /// A line of the results that cannot be read.
    #[error("{}:{line}: {what}; remove the line (all of them where another version wrote the file), and its point is run again", file.display())]
    Ledger {
        /// Which file.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// What is off.
        what: String,
    },
    /// A share of a study that has none.
    #[error(
        "a study of kind {0} has no shares: its points stand on one cache; run it without --chunk"
    )]
    NoShares(&'static str),
    /// Results of another study stand in the folder.
    #[error(
        "{} holds results of the study {found}, not of {name}; left untouched: choose another -o",
        directory.display()
    )]
    OtherStudy {
        /// The folder.
        directory: PathBuf,
        /// The study that it belongs to.
        found: String,
        /// The study that is run.
        name: String,
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
            StudyError::Point(_) | StudyError::NoShares(_) => Self::Input,
            StudyError::Stopped
            | StudyError::OtherStudy { .. }
            | StudyError::File { .. }
            | StudyError::Picture { .. }
            | StudyError::Ledger { .. }
            | StudyError::Raster(_) => Self::Files,
        }
    }
}

impl StudyError {
    /// Its words, where the point alone is at fault: its scene or its numbers. The study then goes on without it.
    ///
    /// # Errors
    /// The error itself, where it would meet every point.
    pub(super) fn of_the_point(self) -> Result<String, Self> {
        match Blame::from(&self) {
            Blame::Numbers | Blame::Input => Ok(self.to_string()),
            Blame::Device | Blame::Files => Err(self),
        }
    }
}
