//! What goes wrong with a view.

use std::{io, path::PathBuf};

use crate::Blame;
use swell_cache::CacheError;
use swell_render::RenderError;
use swell_scene::SceneError;
use swell_study::raster::RasterError;

/// Why there is nothing to look at.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// What was asked for does not go together, or is not there to be seen.
    #[error("{0}")]
    Asked(String),
    /// There is nothing of this name.
    #[error("{} is not there", .0.display())]
    Missing(PathBuf),
    /// A picture.
    #[error(transparent)]
    Picture(#[from] RenderError),
    /// A cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in a cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// A study that has no page.
    #[error("{} is not there: {what}", page.display())]
    Unfinished {
        /// Where it would be.
        page: PathBuf,
        /// Why it is not, and what makes it.
        what: String,
    },
    /// The contact sheet.
    #[error(transparent)]
    Sheet(#[from] RasterError),
    /// A file or folder that cannot be read or written.
    #[error("{}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// The system's words.
        source: io::Error,
    },
    /// A picture or movie could not be encoded.
    #[error("{}", file.display())]
    Encode {
        /// Which.
        file: PathBuf,
        /// Why.
        source: png::EncodingError,
    },
    /// The output would go into a cache.
    #[error("{} is in the cache {}: choose another name", file.display(), cache.display())]
    IntoCache {
        /// The file or folder.
        file: PathBuf,
        /// The cache.
        cache: PathBuf,
    },
    /// A movie that another program has to encode, which is not there.
    #[error(
        "{} needs {program}, which cannot be run ({source}): install it, name it with --ffmpeg, or write a movie that ends in .apng",
        movie.display()
    )]
    NoEncoder {
        /// The movie.
        movie: PathBuf,
        /// As it was called.
        program: String,
        /// The system's words.
        source: io::Error,
    },
    /// That program gave up.
    #[error("{program} could not write {}: {said}", movie.display())]
    Encoder {
        /// The movie.
        movie: PathBuf,
        /// As it was called.
        program: String,
        /// What it said, on one line.
        said: String,
    },
}

impl ViewError {
    pub(super) fn at<P: Into<PathBuf>>(file: P) -> impl FnOnce(io::Error) -> Self {
        let file = file.into();
        move |source| Self::File { file, source }
    }
}

impl From<&ViewError> for Blame {
    fn from(error: &ViewError) -> Self {
        match error {
            ViewError::Asked(_) | ViewError::IntoCache { .. } | ViewError::NoEncoder { .. } => {
                Self::Input
            }
            ViewError::Missing(_)
            | ViewError::Picture(_)
            | ViewError::Cache(_)
            | ViewError::Scene(_)
            | ViewError::Unfinished { .. }
            | ViewError::Sheet(_)
            | ViewError::File { .. }
            | ViewError::Encode { .. }
            | ViewError::Encoder { .. } => Self::Files,
        }
    }
}
