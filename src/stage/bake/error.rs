//! Why a bake failed, and what is to blame.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::{budget::Breach, signed_distance::SignedDistanceError};
use swell_gpu::adapter::GpuError;
use swell_scene::SceneError;

use crate::{
    Blame,
    branch::BranchError,
    device::SolverError,
    replay::{Failure, ReplayError},
};

/// Why a bake failed.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The scene or one of its meshes is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A solid without an inside, or too large a distance grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// More particles than the budget allows, known before the bake.
    #[error("budget.particles is {limit}: {}", more_than(*.frame, *.count))]
    Particles {
        /// Limit of the budget.
        limit: f64,
        /// First frame that exceeds it; 0 for the start.
        frame: u32,
        /// Number of particles after that frame.
        count: usize,
    },
    /// The device cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The solver failed.
    #[error(transparent)]
    Solve(#[from] SolverError),
    /// Reading or writing the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The bake in the cache has other physics.
    #[error(
        "{directory} was baked from another scene: {difference}; choose another folder",
        directory = .directory.display()
    )]
    OtherPhysics {
        /// Directory of the cache.
        directory: PathBuf,
        /// Key that differs, and both values.
        difference: String,
    },
    /// The bake cannot begin from the requested frame.
    #[error(transparent)]
    Branch(#[from] BranchError),
    /// Frames that a bake cannot compute.
    #[error("frames {0}")]
    Frames(String),
    /// A branch that begins at or after its last frame.
    #[error("{asked}: nothing is left to bake after frame {frame}; raise shot.frames")]
    NothingLeft {
        /// The part of the request that asks for it.
        asked: String,
        /// The frame to begin from.
        frame: u32,
    },
    /// A budget was exceeded; the state that the frame began with is kept.
    #[error(
        "{failure}; the last good frame is kept, and the inputs of this one are in {}",
        failed.display()
    )]
    Budget {
        /// The exceeded budget, and where in the frame.
        failure: Box<Failure>,
        /// Folder with the inputs of the frame.
        failed: PathBuf,
    },
    /// The inputs of the failed frame could not be kept, or the frame could not be recomputed.
    #[error("{breach}; keeping its inputs failed")]
    NotKept {
        /// The exceeded budget.
        breach: Box<Breach>,
        /// Why the inputs could not be kept.
        source: Box<ReplayError>,
    },
    /// A mesh file changed or disappeared between loading and caching.
    #[error("{file}: {what}", file = .file.display())]
    Asset {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

impl From<&BakeError> for Blame {
    fn from(error: &BakeError) -> Self {
        match error {
            BakeError::Scene(error) => error.into(),
            BakeError::Solid(error) => error.into(),
            BakeError::Gpu(error) => error.into(),
            BakeError::Solve(error) => error.into(),
            BakeError::Cache(error) | BakeError::Branch(BranchError::Cache(error)) => error.into(),
            BakeError::Branch(BranchError::Scene { .. }) => Self::Files,
            BakeError::Branch(_) => Self::Input,
            BakeError::OtherPhysics { .. } => Self::Files,
            BakeError::Budget { .. } | BakeError::NotKept { .. } => Self::Numbers,
            BakeError::Particles { .. }
            | BakeError::Frames(_)
            | BakeError::NothingLeft { .. }
            | BakeError::Asset { .. } => Self::Input,
        }
    }
}

/// The count and when it is reached, in words.
fn more_than(frame: u32, count: usize) -> String {
    match frame {
        0 => format!("the start has {count} particles"),
        _ => format!(
            "with what emitters bring there are {count} particles or more after frame {frame}"
        ),
    }
}
