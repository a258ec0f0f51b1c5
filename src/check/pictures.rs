//! Compares pictures of the water by each method with pictures by finer rays: colour and flicker.
//!
//! All pictures are compared as a screen shows them, through the look's view transform.

use swell_compare::pictures::{Encoding, Picture, compare};
use swell_domain::feature::MissingFeature;
use swell_render::{Image, view};
use swell_scene::look::ViewSpec;

/// Returns a picture as a screen shows it, over black.
pub fn shown(image: &Image, spec: &ViewSpec) -> Picture {
    let pixel = |&[r, g, b, _]: &[f32; 4]| {
        let [r, g, b] = view::apply(spec, [r, g, b]).map(|x| x as f32);
        [r, g, b, 1.0]
    };
    Picture {
        width: image.width as usize,
        height: image.height as usize,
        corner: [0, 0],
        pixels: image.beauty.iter().map(pixel).collect(),
        encoding: Encoding::Srgb,
    }
}

/// Returns the SSIMULACRA 2 score (Sneyers 2022) of a picture against its ground truth: 100 is
/// identical, 90 visually lossless, 70 small differences, below 30 bad. `None` if a side is shorter
/// than 8 pixels.
///
/// # Errors
/// [`MissingFeature`] without the feature `perceptual`.
pub fn score(picture: &Picture, truth: &Picture) -> Result<Option<f64>, MissingFeature> {
    Ok(compare(picture, truth)?.and_then(|diff| diff.perceptual))
}

/// Deviation of the middle one of three consecutive frames from the mean of its neighbours, per
/// channel, in fractions of white; for a static camera.
#[derive(Clone, Debug)]
pub struct Residual(Vec<f64>);

impl Residual {
    /// Computes the residual of three frames in order.
    pub fn of([before, middle, after]: [&Picture; 3]) -> Self {
        let frames = before.pixels.iter().zip(&middle.pixels).zip(&after.pixels);
        Self(
            frames
                .flat_map(|((a, b), c)| {
                    [0, 1, 2].map(|k| f64::from(b[k]) - 0.5 * (f64::from(a[k]) + f64::from(c[k])))
                })
                .collect(),
        )
    }

    /// Returns its root mean square, which includes uneven motion and flicker.
    pub fn strength(&self) -> f64 {
        rms(self.0.iter().copied())
    }

    /// Returns the root mean square of the difference to the ground truth's residual, which leaves
    /// only flicker.
    pub fn beyond(&self, truth: &Self) -> f64 {
        rms(self.0.iter().zip(&truth.0).map(|(a, b)| a - b))
    }
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|x| x * x).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a pseudo-random number in −0.5..0.5 for a pixel of a frame.
    fn random(pixel: usize, frame: usize) -> f32 {
        let mut h =
            (pixel as u32).wrapping_mul(0x9E37_79B1) ^ (frame as u32).wrapping_mul(0x85EB_CA77);
        h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
        h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
        ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0 - 0.5
    }

    /// Returns a picture of a soft ball, moved by `way` pixels to the right, with noise of the
    /// given strength that differs in every frame.
    fn frame(way: f32, noise: f32, seed: usize) -> Picture {
        let (width, height) = (96, 64);
        let pixel = |k: usize| {
            let (x, y) = ((k % width) as f32 - 40.0 - way, (k / width) as f32 - 32.0);
            let ball = 0.7 * (-(x * x + y * y) / 300.0).exp();
            [ball + 0.1 + noise * random(k, seed), ball, 0.3, 1.0]
        };
        Picture {
            width,
            height,
            corner: [0, 0],
            pixels: (0..width * height).map(pixel).collect(),
            encoding: Encoding::Srgb,
        }
    }

    /// Motion that picture and truth share does not flicker, whatever it is. Noise in one channel
    /// contributes √(3/2 · 1/12 / 3) of its strength: three frames with weights 1, ½ and ½, of a
    /// uniform distribution.
    #[test]
    fn noise_flickers_and_what_moves_does_not() {
        let of = |ways: [f32; 3], noise: f32| {
            let frames = [0, 1, 2].map(|k| frame(ways[k], noise, k));
            Residual::of([&frames[0], &frames[1], &frames[2]])
        };
        let ways = [0.0, 4.0, 5.0];
        let truth = of(ways, 0.0);
        assert!(truth.strength() > 0.005, "it moves: {}", truth.strength());
        assert_eq!(of(ways, 0.0).beyond(&truth), 0.0);
        let found = of(ways, 0.2).beyond(&truth);
        let expected = 0.2 * (1.5f64 / 12.0 / 3.0).sqrt();
        assert!((found / expected - 1.0).abs() < 0.05, "{found} {expected}");
        // Control: a ball that stops while the truth's moves on.
        let stays = of([0.0, 4.0, 4.0], 0.0).beyond(&truth);
        assert!(stays > 0.3 * truth.strength(), "{stays}");
    }

    /// A picture shifted by two pixels has a lower score, by four an even lower one.
    #[cfg(feature = "perceptual")]
    #[test]
    fn a_shifted_picture_has_a_lower_score() {
        let truth = frame(0.0, 0.1, 1);
        let scores = [0.0, 2.0, 4.0].map(|way| score(&frame(way, 0.1, 1), &truth).unwrap());
        assert_eq!(scores[0], Some(100.0));
        assert!(scores[0] > scores[1] && scores[1] > scores[2], "{scores:?}");
        assert!(scores[2].is_some());
    }
}
