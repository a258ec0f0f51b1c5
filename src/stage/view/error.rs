//! Errors of a view.

use std::{io, path::PathBuf};

use crate::Blame;
use swell_cache::{CacheError, IntoCache};
use swell_domain::output::FileError;
use swell_render::RenderError;
use swell_scene::SceneError;
use swell_study::raster::RasterError;

/// Why a view failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// Nothing to make of the frames.
    #[error("nothing to make: ask for a sheet, a movie or a player")]
    Nothing,
    /// A file, or a folder with a page or pictures, that no view made and that would be replaced.
    #[error("{} was not made by a view: choose another folder", .0.display())]
    Foreign(PathBuf),
    /// A request that does not fit what is viewed, or nothing to show.
    #[error("{0}")]
    Asked(String),
    /// A path that does not exist.
    #[error("{} does not exist", .0.display())]
    Missing(PathBuf),
    /// Reading a picture failed.
    #[error(transparent)]
    Picture(#[from] RenderError),
    /// Reading a cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in a cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// A study that has no page yet.
    #[error("{} does not exist: {what}", page.display())]
    Unfinished {
        /// Path of the missing page.
        page: PathBuf,
        /// Why it is missing, and how to make it.
        what: String,
    },
    /// The contact sheet could not be drawn.
    #[error(transparent)]
    Sheet(#[from] RasterError),
    /// A file or folder that cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A picture or movie that could not be encoded.
    #[error("{}", file.display())]
    Encode {
        /// The file.
        file: PathBuf,
        /// The cause.
        source: png::EncodingError,
    },
    /// The output would be written into a cache.
    #[error(transparent)]
    IntoCache(#[from] IntoCache),
    /// The external encoder that a movie needs cannot be run.
    #[error(
        "{} needs {program}, which cannot be run ({source}): install it, name another encoder, or \
         write a movie that ends in .apng",
        movie.display()
    )]
    NoEncoder {
        /// The movie.
        movie: PathBuf,
        /// The program as it was called.
        program: String,
        /// The system's error.
        source: io::Error,
    },
    /// The external encoder failed.
    #[error("{program} could not write {}: {said}", movie.display())]
    Encoder {
        /// The movie.
        movie: PathBuf,
        /// The program as it was called.
        program: String,
        /// Its error output on one line.
        said: String,
    },
}

impl From<&ViewError> for Blame {
    fn from(error: &ViewError) -> Self {
        match error {
            ViewError::Nothing
            | ViewError::Foreign(_)
            | ViewError::Asked(_)
            | ViewError::IntoCache(_)
            | ViewError::NoEncoder { .. }
            | ViewError::Sheet(RasterError::MissingFeature(_)) => Self::Input,
            ViewError::Missing(_)
            | ViewError::Picture(_)
            | ViewError::Cache(_)
            | ViewError::Scene(_)
            | ViewError::Unfinished { .. }
            | ViewError::Sheet(_)
            | ViewError::File(_)
            | ViewError::Encode { .. }
            | ViewError::Encoder { .. } => Self::Files,
        }
    }
}
