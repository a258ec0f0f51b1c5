//! Errors of an export.

use std::{io, path::PathBuf};

use crate::{Blame, wet::WetError};
use png::EncodingError;
use swell_cache::{CacheError, IntoCache};
use swell_domain::{mesh_file::MeshError, output::FileError};
use swell_render::RenderError;
use swell_scene::{SceneError, look::LookError};

use super::UsdcError;

/// Why an export failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// No files to make.
    #[error("nothing to export: ask for a mesh, a USD shot, npy, csv, bgeo, vdb or fog")]
    Nothing,
    /// Foam on what cannot have it.
    #[error("foam: {0}")]
    Foam(String),
    /// Kinds of whitewater without a stream.
    #[error("kinds of whitewater are chosen, but no stream of it is exported")]
    Kinds,
    /// A fog's voxels are out of range.
    #[error(
        "voxels of {size} m: {} allows {least} to {most} m, a quarter of a particle spacing to \
         eight of them",
        cache.display()
    )]
    FogVoxel {
        /// The requested size, metres.
        size: f64,
        /// Least size, metres.
        least: f64,
        /// Greatest size, metres.
        most: f64,
        /// Directory of the bake's cache.
        cache: PathBuf,
    },
    /// Fog without a stream.
    #[error("fog is made of a stream of whitewater, and no stream is exported")]
    NoFog,
    /// Targets that cannot be combined.
    #[error("{0}")]
    Asked(String),
    /// Reading the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// The look is invalid.
    #[error(transparent)]
    Look(#[from] LookError),
    /// What the look draws cannot be made.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A mesh of the cache cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A texture of the look cannot be encoded.
    #[error("{}: {source}", file.display())]
    Texture {
        /// The texture.
        file: PathBuf,
        /// The cause.
        source: EncodingError,
    },
    /// A file or folder that cannot be read, written or locked.
    #[error(transparent)]
    File(#[from] FileError),
    /// The name of a file is taken by something else.
    #[error(
        "{} is {what}; choose another name, or overwrite it",
        file.display()
    )]
    Taken {
        /// The existing file.
        file: PathBuf,
        /// What it is.
        what: String,
    },
    /// Binary USD cannot be written.
    #[error(transparent)]
    Usdc(#[from] UsdcError),
    /// A whitewater stream that does not exist.
    #[error("{} does not exist: make the stream first", directory.display())]
    NoStream {
        /// Name of the stream.
        stream: String,
        /// Where it would be.
        directory: PathBuf,
        /// Directory of the bake's cache.
        cache: PathBuf,
    },
    /// A folder among the streams holds something else.
    #[error(
        "{} is no stream of whitewater, whose particles have age, kind, life and radius",
        directory.display()
    )]
    NotWhitewater {
        /// Directory of the stream.
        directory: PathBuf,
    },
    /// A frame of a stream was made from other water.
    #[error(
        "{}: frame {frame} was made from water that no longer exists: make it again",
        directory.display()
    )]
    OldStream {
        /// Directory of the stream.
        directory: PathBuf,
        /// The frame.
        frame: u32,
    },
    /// The wetness of solids cannot be used.
    #[error(transparent)]
    Wet(#[from] WetError),
    /// The output would be written into a cache.
    #[error(transparent)]
    IntoCache(#[from] IntoCache),
    /// A grid file could not be encoded.
    #[error("frame {frame} as OpenVDB: {source}")]
    Vdb {
        /// The frame.
        frame: u32,
        /// The cause.
        source: io::Error,
    },
}

impl ExportError {
    /// Whether the fault is specific to the frame, so that other frames may still succeed.
    pub(super) fn is_of_frame(&self) -> bool {
        matches!(
            self,
            Self::Cache(_) | Self::Wet(WetError::Cache(_)) | Self::Vdb { .. }
        )
    }
}

impl From<&ExportError> for Blame {
    fn from(error: &ExportError) -> Self {
        match error {
            ExportError::Wet(error) => error.into(),
            ExportError::Nothing
            | ExportError::Foam(_)
            | ExportError::Kinds
            | ExportError::FogVoxel { .. }
            | ExportError::NoFog
            | ExportError::Asked(_)
            | ExportError::Look(_)
            | ExportError::IntoCache(_)
            | ExportError::Usdc(UsdcError::Missing { .. }) => Self::Input,
            ExportError::Cache(_)
            | ExportError::Scene(_)
            | ExportError::File(_)
            | ExportError::Render(_)
            | ExportError::Mesh(_)
            | ExportError::Texture { .. }
            | ExportError::Taken { .. }
            | ExportError::Usdc(UsdcError::Failed { .. })
            | ExportError::NoStream { .. }
            | ExportError::NotWhitewater { .. }
            | ExportError::OldStream { .. }
            | ExportError::Vdb { .. } => Self::Files,
        }
    }
}
