//! SSIMULACRA 2, which needs the feature `perceptual`: off in this build.

use swell_domain::feature::MissingFeature;

/// Fails, because this build cannot score pictures.
///
/// # Errors
/// [`MissingFeature`].
pub fn require() -> Result<(), MissingFeature> {
    Err(MissingFeature {
        feature: "perceptual",
        what: "the SSIMULACRA 2 score of a picture",
    })
}

pub(super) fn score(
    _a: Vec<[f32; 3]>,
    _b: Vec<[f32; 3]>,
    _size: [usize; 2],
) -> Result<Option<f64>, MissingFeature> {
    require().map(|()| None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_the_feature_an_error_names_it() {
        let error = require().unwrap_err();
        assert!(
            error.to_string().contains("feature `perceptual`"),
            "{error}"
        );
    }
}
