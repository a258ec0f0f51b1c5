//! Why a render fails.

use std::path::PathBuf;

use super::{FolderError, StreamError};
use crate::{Blame, wet::WetError};
use swell_cache::{CacheError, IntoCache};
use swell_domain::{mesh_file::MeshError, signed_distance::SignedDistanceError};
use swell_gpu::adapter::GpuError;
use swell_render::RenderError;
use swell_scene::{SceneError, look::LookError};

/// Why a render failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderJobError {
    /// Nothing was compared, which must not count as a success.
    #[error("nothing was compared: no water is seen in these frames")]
    NoWater,
    /// Reading the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// A solid of the scene to plan for has no inside, or its distance grid is too large.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The look, or something that it names, is invalid.
    #[error(transparent)]
    Look(#[from] LookError),
    /// The device cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The file of a solid's mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The renderer failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The output folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Flicker was asked for of a frame without a neighbour on either side.
    #[error(
        "flicker compares a frame with the frames before and after it, and frame {0} lacks one of \
         them"
    )]
    NoNeighbours(u32),
    /// A preview is of one frame.
    #[error("a preview shows one frame, and {0} are asked for")]
    NotOneFrame(usize),
    /// The folder of a preview cannot be written.
    #[error(transparent)]
    Output(swell_domain::output::FileError),
    /// The given cache is itself a stream, not a bake.
    #[error("{} is a stream of {of}: render the cache that it was made from, with a look that \
             names the stream", directory.display())]
    IsStream {
        /// The given cache.
        directory: PathBuf,
        /// What it holds.
        of: &'static str,
    },
    /// The whitewater stream that the look draws cannot be used.
    #[error(transparent)]
    Whitewater(#[from] StreamError),
    /// The wetness of solids that the look draws cannot be used.
    #[error(transparent)]
    Wet(#[from] WetError),
    /// The output would be written into a cache.
    #[error(transparent)]
    IntoCache(#[from] IntoCache),
    /// Pictures are scored, and the feature `perceptual` is off.
    #[error(transparent)]
    MissingFeature(#[from] swell_domain::feature::MissingFeature),
}

impl RenderJobError {
    /// Whether the fault is specific to the frame, so that other frames may still succeed.
    pub(super) fn is_of_frame(&self) -> bool {
        matches!(
            self,
            Self::Cache(_)
                | Self::Whitewater(StreamError::Cache(_))
                | Self::Wet(WetError::Cache(_))
                | Self::Render(RenderError::NotFinite { .. })
        )
    }
}

impl From<&RenderJobError> for Blame {
    fn from(error: &RenderJobError) -> Self {
        match error {
            RenderJobError::Cache(error) => error.into(),
            RenderJobError::Scene(_) | RenderJobError::Folder(_) => Self::Files,
            RenderJobError::Solid(error) => error.into(),
            RenderJobError::Look(error) => error.into(),
            RenderJobError::Wet(error) => error.into(),
            RenderJobError::Gpu(error) => error.into(),
            RenderJobError::Render(RenderError::Gpu(error)) => error.into(),
            RenderJobError::Render(
                RenderError::Panorama(_)
                | RenderError::Scene(_)
                | RenderError::Material { .. }
                | RenderError::UnderWater { .. },
            )
            | RenderJobError::NoWater
            | RenderJobError::NotOneFrame(_)
            | RenderJobError::IsStream { .. }
            | RenderJobError::IntoCache(_)
            | RenderJobError::MissingFeature(_) => Self::Input,
            RenderJobError::Whitewater(_)
            | RenderJobError::Output(_)
            | RenderJobError::Mesh(_)
            | RenderJobError::NoNeighbours(_)
            | RenderJobError::Render(
                RenderError::NotFinite { .. }
                | RenderError::Ended { .. }
                | RenderError::Write { .. }
                | RenderError::Format { .. },
            ) => Self::Files,
        }
    }
}
