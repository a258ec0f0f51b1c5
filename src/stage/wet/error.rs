//! Errors of wet surfaces.

use std::path::PathBuf;

use swell_cache::CacheError;
use swell_domain::wet::TooFine;
use swell_scene::SceneError;

use crate::{Blame, derived::DerivedError};

/// Why the wetness of solids could not be made or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WetError {
    /// Reading or writing the bake's or the stream's cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The stream cannot be made from the bake.
    #[error(transparent)]
    Derived(#[from] DerivedError),
    /// The scene in the cache.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// The scene has no solids.
    #[error("the scene has no solids that could stay wet; the walls of its domain are not solids")]
    NoSolids,
    /// A solid whose shape changes has other triangles at another time.
    #[error(
        "the triangles of solid {0} change during the shot, so that no point of its surface can be \
         followed"
    )]
    Triangles(String),
    /// A solid with too many vertices.
    #[error("solid {solid}: {source}")]
    TooFine {
        /// Name of the solid.
        solid: String,
        /// What is too many.
        source: TooFine,
    },
    /// A setting that is out of range.
    #[error("the {what} is {value}; allowed is a finite number > 0")]
    Setting {
        /// What it sets.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// There is no stream of that name.
    #[error(
        "wetness `{stream}` is named, but {} does not exist: make it first",
        directory.display()
    )]
    Missing {
        /// Name of the stream.
        stream: String,
        /// Where it would be.
        directory: PathBuf,
        /// Directory of the bake's cache.
        cache: PathBuf,
    },
    /// The stream lacks a frame, has one made from other water, or is of other solids.
    #[error("{}: {how}: make it again", directory.display())]
    Unfit {
        /// Directory of the stream.
        directory: PathBuf,
        /// What is wrong with it.
        how: String,
    },
}

impl From<&WetError> for Blame {
    fn from(error: &WetError) -> Self {
        match error {
            WetError::Cache(error) => error.into(),
            WetError::Scene(_) | WetError::Missing { .. } | WetError::Unfit { .. } => Self::Files,
            WetError::Derived(error) => error.into(),
            WetError::NoSolids
            | WetError::Triangles(_)
            | WetError::TooFine { .. }
            | WetError::Setting { .. } => Self::Input,
        }
    }
}
