//! The functions of the module without the feature `charts`: each fails.

use swell_domain::feature::MissingFeature;

use super::RasterError;
use crate::rgb::Rgb;

const MISSING: MissingFeature = MissingFeature {
    feature: "charts",
    what: "a chart or contact sheet as PNG",
};

/// Fails, because this build cannot render charts.
///
/// # Errors
/// [`MissingFeature`].
pub fn require() -> Result<(), MissingFeature> {
    Err(MISSING)
}

/// Fails, because this build cannot render charts.
///
/// # Errors
/// [`RasterError::MissingFeature`].
pub fn png(_svg: &str) -> Result<Vec<u8>, RasterError> {
    Err(MISSING.into())
}

/// Fails, because this build cannot render charts.
///
/// # Errors
/// [`RasterError::MissingFeature`].
pub fn rgb(_svg: &str) -> Result<Rgb, RasterError> {
    Err(MISSING.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_feature_an_error_names_it() {
        for error in [png("<svg/>").unwrap_err(), rgb("<svg/>").unwrap_err()] {
            assert!(error.to_string().contains("feature `charts`"), "{error}");
        }
    }
}
