//! Renders an SVG chart as PNG with built-in fonts, so that every machine draws the same. Needs the
//! feature `charts`.

use swell_domain::feature::MissingFeature;

#[cfg(feature = "charts")]
mod drawing;
#[cfg(feature = "charts")]
pub use drawing::{png, require, rgb};
#[cfg(not(feature = "charts"))]
mod missing;
#[cfg(not(feature = "charts"))]
pub use missing::{png, require, rgb};

/// Why an SVG could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterError {
    /// The feature `charts` is off.
    #[error(transparent)]
    MissingFeature(#[from] MissingFeature),
    /// It is not valid SVG.
    #[error("the drawing: {0}")]
    Svg(String),
    /// It is too large, or its bytes could not be written.
    #[error("the drawing's picture: {0}")]
    Png(String),
}
