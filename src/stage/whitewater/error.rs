//! Errors of making a whitewater stream.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::{mesh_file::MeshError, signed_distance::SignedDistanceError};
use swell_gpu::adapter::GpuError;
use swell_scene::SceneError;

use crate::{Blame, derived::DerivedError, device::SolverError};

/// Why whitewater could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WhitewaterError {
    /// Reading or writing the bake's or the stream's cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The stream cannot be made from the bake.
    #[error(transparent)]
    Derived(#[from] DerivedError),
    /// The scene in the cache, or the stream's own settings.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// A solid without an inside, or too large a distance grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The mesh of a kill volume cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The device cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A whitewater pass failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The bake that a stream was made from is missing or has changed.
    #[error(
        "{} was made from a bake in {}, which no longer exists or has changed: frame {frame}",
        stream.display(),
        cache.display()
    )]
    NoBake {
        /// Directory of the stream.
        stream: PathBuf,
        /// Where the bake should be.
        cache: PathBuf,
        /// Frame of the stream.
        frame: u32,
    },
    /// The domain moves.
    #[error(
        "the domain in {} moves, which spray in the air would not feel: whitewater is made of \
         domains at rest",
        cache.display()
    )]
    Moves {
        /// Directory of the bake.
        cache: PathBuf,
    },
    /// More particles than the settings allow.
    #[error(
        "frame {frame} has {count} whitewater particles, and max_particles is {allowed}: raise it, \
         or lower emission.trapped_air_rate and emission.wave_crest_rate; the frames before it are \
         kept"
    )]
    TooMany {
        /// The frame.
        frame: u32,
        /// Number of whitewater particles it would have.
        count: usize,
        /// `max_particles` of the settings.
        allowed: u32,
    },
}

impl From<&WhitewaterError> for Blame {
    fn from(error: &WhitewaterError) -> Self {
        match error {
            WhitewaterError::Cache(error) => error.into(),
            WhitewaterError::Scene(_)
            | WhitewaterError::Mesh(_)
            | WhitewaterError::NoBake { .. } => Self::Files,
            WhitewaterError::Derived(error) => error.into(),
            WhitewaterError::Solid(error) => error.into(),
            WhitewaterError::Gpu(error) => error.into(),
            WhitewaterError::Solver(error) => error.into(),
            WhitewaterError::TooMany { .. } => Self::Numbers,
            WhitewaterError::Moves { .. } => Self::Input,
        }
    }
}
