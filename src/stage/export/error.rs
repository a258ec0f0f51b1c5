//! Errors of an export.

use std::{io, path::PathBuf};

use crate::Blame;
use swell_cache::CacheError;
use swell_domain::posix;
use swell_scene::{SceneError, look::LookError};

use super::{FolderError, UsdcError};

/// Why an export failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// Options that cannot be combined.
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
    /// The output folder cannot be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Binary USD cannot be written.
    #[error(transparent)]
    Usdc(#[from] UsdcError),
    /// A whitewater stream that does not exist.
    #[error(
        "{} does not exist: make it with `swell whitewater {}` (--name {stream})",
        directory.display(),
        posix::path(cache)
    )]
    NoStream {
        /// Name of the stream.
        stream: String,
        /// Where it would be.
        directory: PathBuf,
        /// Directory of the bake's cache.
        cache: PathBuf,
    },
    /// A frame of a stream was made from other water.
    #[error("{}: frame {frame} was made from water that no longer exists: make it again with \
        `swell whitewater`", directory.display())]
    OldStream {
        /// Directory of the stream.
        directory: PathBuf,
        /// The frame.
        frame: u32,
    },
    /// The output would be written into a cache.
    #[error("{} is in the cache {}: choose another name", file.display(), cache.display())]
    IntoCache {
        /// The output file.
        file: PathBuf,
        /// The cache that contains it.
        cache: PathBuf,
    },
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
        matches!(self, Self::Cache(_) | Self::Vdb { .. })
    }
}

impl From<&ExportError> for Blame {
    fn from(error: &ExportError) -> Self {
        match error {
            ExportError::Asked(_)
            | ExportError::Look(_)
            | ExportError::IntoCache { .. }
            | ExportError::Usdc(UsdcError::Missing { .. }) => Self::Input,
            ExportError::Cache(_)
            | ExportError::Scene(_)
            | ExportError::Folder(_)
            | ExportError::Usdc(UsdcError::Failed { .. })
            | ExportError::NoStream { .. }
            | ExportError::OldStream { .. }
            | ExportError::Vdb { .. } => Self::Files,
        }
    }
}
