//! SSIMULACRA 2 (Sneyers 2022). Needs the feature `perceptual`.

use ssimulacra2::{LinearRgb, compute_frame_ssimulacra2};

use swell_domain::feature::MissingFeature;

use super::pictures::{Encoding, Picture};

/// Checks that this build can score pictures, so that a job fails before its work begins.
///
/// # Errors
/// [`MissingFeature`] without the feature `perceptual`.
pub fn require() -> Result<(), MissingFeature> {
    Ok(())
}

/// Score of `a` against `b`; `None` if a side is shorter than 8 pixels.
pub(super) fn score(a: &Picture, b: &Picture) -> Result<Option<f64>, MissingFeature> {
    let light = |picture: &Picture| {
        let pixels = picture
            .pixels
            .iter()
            .map(|&pixel| light(pixel, picture.encoding));
        LinearRgb::new(pixels.collect(), picture.width, picture.height).ok()
    };
    let score = |(a, b)| compute_frame_ssimulacra2(a, b).ok();
    Ok(light(a).zip(light(b)).and_then(score))
}

/// Linear light over black, clamped to 0 to 1; NaN becomes black.
fn light([r, g, b, alpha]: [f32; 4], encoding: Encoding) -> [f32; 3] {
    [r, g, b].map(|value| {
        let linear = match encoding {
            Encoding::Srgb => alpha * linear_from_srgb(value),
            Encoding::Linear => value,
        };
        if linear.is_nan() {
            0.0
        } else {
            linear.clamp(0.0, 1.0)
        }
    })
}

/// Transfer function of IEC 61966-2-1.
fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// IEC 61966-2-1: half of the code value is 0.2140 of the light, and the linear segment meets
    /// the curve.
    #[test]
    fn light_is_that_of_srgb() {
        let one = |value: f32, alpha: f32| light([value, 0.0, 0.0, alpha], Encoding::Srgb)[0];
        for (code, linear) in [(0.5, 0.214_041_14), (1.0, 1.0), (0.02, 0.02 / 12.92)] {
            // Powers have an error of a few f32 roundings.
            assert!((one(code, 1.0) - linear).abs() < 4.0 * f32::EPSILON * linear);
        }
        let edge: f32 = 0.04045;
        let [below, above] = [edge, f32::from_bits(edge.to_bits() + 1)].map(linear_from_srgb);
        assert!((below - above).abs() < 1e-7, "{below} {above}");
        assert_eq!(one(0.5, 0.5), 0.5 * one(0.5, 1.0));
        assert_eq!(
            light([0.5, f32::NAN, 2.0, 0.5], Encoding::Linear),
            [0.5, 0.0, 1.0]
        );
    }
}
