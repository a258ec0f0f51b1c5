//! Why a stream of whitewater cannot be made.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::signed_distance::SignedDistanceError;
use swell_gpu::adapter::GpuError;
use swell_scene::SceneError;

use crate::{Blame, device::SolverError};

/// Why whitewater could not be made.
#[derive(Debug, thiserror::Error)]
pub enum WhitewaterError {
    /// The bake's cache, or the stream's.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache, or the stream's own settings.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// Its solids.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The passes.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// A stream of whitewater is no water.
    #[error("{} is a stream of whitewater; give the cache that it was made from", .0.display())]
    IsWhitewater(PathBuf),
    /// A stream without the bake that it was made from.
    #[error("{} was made from a bake in {}, which is not there or another now: frame {frame}", stream.display(), cache.display())]
    NoBake {
        /// Of the stream.
        stream: PathBuf,
        /// Where the bake should be.
        cache: PathBuf,
        /// Of the stream.
        frame: u32,
    },
    /// The bake does not go so far.
    #[error("frame {asked} was asked for, and the bake has frames {first} to {last}")]
    NoFrame {
        /// The frame.
        asked: u32,
        /// First of the bake.
        first: u32,
        /// Last of the bake.
        last: u32,
    },
    /// The stream that stands there was made otherwise.
    #[error(
        "{} was made {how}; choose another --name, or --overwrite it",
        directory.display()
    )]
    Other {
        /// Of the stream.
        directory: PathBuf,
        /// What differs, in words.
        how: &'static str,
    },
    /// More than the settings allow.
    #[error(
        "frame {frame} has {count} whitewater particles, and max_particles is {allowed}: raise it, or lower \
         emission.trapped_air_rate and emission.wave_crest_rate; the frames before it stand"
    )]
    TooMany {
        /// The frame.
        frame: u32,
        /// So many.
        count: usize,
        /// `max_particles`.
        allowed: u32,
    },
    /// A stream cannot be removed.
    #[error("cannot remove {}: {source}", directory.display())]
    Remove {
        /// Of the stream.
        directory: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

impl From<&WhitewaterError> for Blame {
    fn from(error: &WhitewaterError) -> Self {
        match error {
            WhitewaterError::Cache(error) => error.into(),
            WhitewaterError::Scene(_)
            | WhitewaterError::NoBake { .. }
            | WhitewaterError::Other { .. }
            | WhitewaterError::Remove { .. } => Self::Files,
            WhitewaterError::Solid(error) => error.into(),
            WhitewaterError::Gpu(error) => error.into(),
            WhitewaterError::Solver(error) => error.into(),
            WhitewaterError::IsWhitewater(_) | WhitewaterError::NoFrame { .. } => Self::Input,
            WhitewaterError::TooMany { .. } => Self::Numbers,
        }
    }
}
