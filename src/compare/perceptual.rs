//! SSIMULACRA 2 (Sneyers 2022). Needs the feature `perceptual`.

use ssimulacra2::{LinearRgb, compute_frame_ssimulacra2};

use swell_domain::feature::MissingFeature;

/// Checks that this build can score pictures, so that a job fails before its work begins.
///
/// # Errors
/// [`MissingFeature`] without the feature `perceptual`.
pub fn require() -> Result<(), MissingFeature> {
    Ok(())
}

/// Score of the linear light of image `a` against `b`; `None` if a side is shorter than 8 pixels.
pub(super) fn score(
    a: Vec<[f32; 3]>,
    b: Vec<[f32; 3]>,
    [width, height]: [usize; 2],
) -> Result<Option<f64>, MissingFeature> {
    let image = |light| LinearRgb::new(light, width, height).ok();
    let score = |(a, b)| compute_frame_ssimulacra2(a, b).ok();
    Ok(image(a).zip(image(b)).and_then(score))
}
