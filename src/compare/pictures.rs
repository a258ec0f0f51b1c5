//! Comparison of two images of the same size.

use std::path::{Path, PathBuf};

use serde::{Serialize, Serializer};

use super::{
    deviation::{ComparedValue, out_of_limits},
    perceptual,
};
use swell_domain::{feature::MissingFeature, statistics::percentile, tolerance::PictureLimits};

/// How the values of an image represent light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// sRGB from 0 to 1, alpha not premultiplied, as in a PNG.
    Srgb,
    /// Scene-linear, premultiplied, as in an EXR.
    Linear,
}

/// An image to compare; rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Position of its upper left pixel in the displayed image; other than [0, 0] for an EXR with
    /// overscan or of a crop.
    pub corner: [i32; 2],
    /// Red, green, blue and alpha of `width × height` pixels.
    pub pixels: Vec<[f32; 4]>,
    /// Encoding of the values.
    pub encoding: Encoding,
}

/// Measures of the difference between two images. A pixel's error is the largest |a − b| of its
/// channels, in the file's own values: 1 is 255 in a PNG, and scene-linear white in an EXR.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PictureDiff {
    /// Mean error over the pixels.
    pub mean: f64,
    /// Error that 99 % of the pixels do not exceed.
    pub p99: f64,
    /// Largest error of a pixel; infinite (null in JSON) if a value is not finite.
    pub max: f64,
    /// Column and row of the first such pixel, from the upper left; `None` if there is no error.
    pub max_at: Option<[usize; 2]>,
    /// SSIMULACRA 2 score (Sneyers 2022) of the light over black, clamped to 0 to 1: 100 no
    /// difference, 90 none visible, 70 small ones, below 30 bad. `None` if a side is shorter than
    /// 8 pixels.
    pub perceptual: Option<f64>,
    /// Whether all values are bit-identical.
    pub is_identical: bool,
}

/// A measure that exceeds its limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PictureFault {
    /// `mean`, `p99`, `max`, `perceptual`, or `bits`.
    pub measure: &'static str,
    /// Value found.
    pub value: f64,
    /// Largest value allowed; for a perceptual score, the smallest.
    pub limit: f64,
}

/// Differences between two renders.
#[derive(Clone, Debug, Serialize)]
pub struct PicturesDiff {
    /// File names that only a has.
    pub only_a: Vec<String>,
    /// File names that only b has.
    pub only_b: Vec<String>,
    /// Pairs of images, by name.
    pub pairs: Vec<PairDiff>,
}

/// Two images with the same name.
#[derive(Clone, Debug, Serialize)]
pub struct PairDiff {
    /// File name.
    pub name: String,
    /// Width and height of a and of b, pixels.
    pub sizes: [[usize; 2]; 2],
    /// Positions of the upper left pixels of a and of b in the displayed images.
    pub corners: [[i32; 2]; 2],
    /// Measures; `None` if the sizes or the corners differ.
    pub diff: Option<PictureDiff>,
    /// Measures that are out of tolerance.
    pub faults: Vec<PictureFault>,
    /// File of the difference image; when serialised, bytes that are not UTF-8 become U+FFFD.
    #[serde(serialize_with = "as_text")]
    pub image: Option<PathBuf>,
}

/// Serialises any path: serde's own implementation rejects paths that are not UTF-8.
fn as_text<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_deref()
        .map(Path::to_string_lossy)
        .serialize(serializer)
}

impl PicturesDiff {
    /// Returns whether everything is within tolerance and nothing exists on only one side.
    pub fn is_within(&self) -> bool {
        let is_within = |pair: &PairDiff| pair.diff.is_some() && pair.faults.is_empty();
        self.only_a.is_empty() && self.only_b.is_empty() && self.pairs.iter().all(is_within)
    }
}

/// Compares two images; b is the reference. `None` if sizes, corners or encodings differ.
///
/// # Errors
/// [`MissingFeature`] without the feature `perceptual`.
pub fn compare(a: &Picture, b: &Picture) -> Result<Option<PictureDiff>, MissingFeature> {
    let of = |it: &Picture| (it.width, it.height, it.corner, it.encoding);
    if of(a) != of(b) {
        return Ok(None);
    }
    let errors = errors(a, b);
    let (mut max, mut max_at) = (0.0, None);
    for (index, &error) in errors.iter().enumerate() {
        if error > max {
            (max, max_at) = (error, Some([index % a.width, index / a.width]));
        }
    }
    let bits = |picture: &Picture| -> Vec<[u32; 4]> {
        let pixels = picture.pixels.iter();
        pixels.map(|pixel| pixel.map(f32::to_bits)).collect()
    };
    let light_of = |picture: &Picture| {
        let pixels = picture.pixels.iter();
        pixels
            .map(|&pixel| light(pixel, picture.encoding))
            .collect()
    };
    Ok(Some(PictureDiff {
        mean: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
        p99: percentile(errors, 0.99).unwrap_or(0.0),
        max,
        max_at,
        perceptual: perceptual::score(light_of(a), light_of(b), [a.width, a.height])?,
        is_identical: bits(a) == bits(b),
    }))
}

impl PictureDiff {
    /// Returns the measures that exceed the limits; without limits, all bits must be equal.
    pub fn faults(&self, limits: Option<&PictureLimits>) -> Vec<PictureFault> {
        let Some(limits) = limits else {
            let fault = PictureFault {
                measure: "bits",
                value: self.max,
                limit: 0.0,
            };
            return if self.is_identical {
                Vec::new()
            } else {
                vec![fault]
            };
        };
        let errors = [
            ("mean", self.mean, limits.mean),
            ("p99", self.p99, limits.p99),
            ("max", self.max, limits.max),
        ];
        let fault = |(measure, value, limit)| PictureFault {
            measure,
            value,
            limit,
        };
        let mut faults: Vec<_> = out_of_limits(errors).map(fault).collect();
        // An image too small for a score counts as the worst one.
        let score = self.perceptual.unwrap_or(f64::NEG_INFINITY);
        if let Some(limit) = limits.perceptual.filter(|&limit| score < limit) {
            faults.push(PictureFault {
                measure: "perceptual",
                value: score,
                limit,
            });
        }
        faults
    }
}

/// |a − b| of each pixel's worst channel.
fn errors(a: &Picture, b: &Picture) -> Vec<f64> {
    let worst = |(a, b): (&[f32; 4], &[f32; 4])| {
        let channels = a.iter().zip(b).map(|(&a, &b)| a.error(b));
        channels.fold(0.0, f64::max)
    };
    a.pixels.iter().zip(&b.pixels).map(worst).collect()
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

/// Returns |a − b| of red, green and blue times `gain` in 8 bits per channel, 255 where it is 1 or
/// more or not finite. If only alpha differs, its difference goes into all three.
pub fn difference_image(a: &Picture, b: &Picture, gain: f64) -> Vec<[u8; 3]> {
    let byte = |error: f64| (gain * error * 255.0).clamp(0.0, 255.0).round() as u8;
    let pixel = |(a, b): (&[f32; 4], &[f32; 4])| {
        let errors: [f64; 4] = std::array::from_fn(|k| a[k].error(b[k]));
        let [r, g, b, alpha] = errors;
        if r.max(g).max(b) == 0.0 {
            [byte(alpha); 3]
        } else {
            [r, g, b].map(byte)
        }
    };
    a.pixels.iter().zip(&b.pixels).map(pixel).collect()
}

#[cfg(all(test, feature = "perceptual"))]
mod tests {
    use super::*;

    fn compare(a: &Picture, b: &Picture) -> Option<PictureDiff> {
        super::compare(a, b).expect("the feature is on")
    }

    /// A shaded ball on a gradient.
    fn picture(encoding: Encoding) -> Picture {
        let (width, height) = (64, 48);
        let pixel = |k: usize| {
            let (x, y) = ((k % width) as f32 - 32.0, (k / width) as f32 - 24.0);
            let ball = (1.0 - (x * x + y * y) / 300.0).max(0.0).sqrt();
            [ball, 0.5 * ball + 0.2, (k / width) as f32 / 64.0, 1.0]
        };
        Picture {
            width,
            height,
            corner: [0, 0],
            pixels: (0..width * height).map(pixel).collect(),
            encoding,
        }
    }

    #[test]
    fn the_same_picture_has_no_difference_and_the_top_score() {
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let picture = picture(encoding);
            let found = compare(&picture, &picture).expect("alike");
            assert_eq!((found.mean, found.p99, found.max), (0.0, 0.0, 0.0));
            assert_eq!((found.max_at, found.is_identical), (None, true));
            assert_eq!(found.perceptual, Some(100.0));
            assert!(found.faults(None).is_empty());
        }
    }

    #[test]
    fn one_pixel_and_a_veil() {
        let b = picture(Encoding::Srgb);
        let mut a = b.clone();
        a.pixels[5 * 64 + 9][1] += 0.25;
        let one = compare(&a, &b).expect("alike");
        // The sum was rounded to f32 once.
        assert!((one.max - 0.25).abs() < f64::from(f32::EPSILON));
        assert_eq!((one.max_at, one.p99), (Some([9, 5]), 0.0));
        assert!((one.mean - one.max / (64.0 * 48.0)).abs() < 1e-15);
        assert_eq!(one.faults(None)[0].measure, "bits");

        // The stronger the noise, the worse the score.
        let noise = |strength: f32| {
            let mut a = b.clone();
            for (k, pixel) in a.pixels.iter_mut().enumerate() {
                pixel[0] += if (k * 7919) % 13 < 6 {
                    strength
                } else {
                    -strength
                };
            }
            compare(&a, &b).expect("alike")
        };
        let scores = [0.03, 0.06, 0.12].map(|strength| noise(strength).perceptual);
        assert!(Some(100.0) > scores[0] && scores[0] > scores[1] && scores[1] > scores[2]);
        assert!(scores[2].is_some() && one.perceptual < Some(100.0));
        let noise = noise(0.06);
        let limits = PictureLimits {
            mean: Some(0.05),
            p99: Some(0.1),
            max: Some(0.07),
            perceptual: scores[1].map(|score| score + 0.5),
        };
        let faults = noise.faults(Some(&limits));
        let measures: Vec<_> = faults.iter().map(|fault| fault.measure).collect();
        assert_eq!(measures, ["mean", "perceptual"]);
    }

    #[test]
    fn other_sizes_and_encodings_do_not_compare() {
        let picture = picture(Encoding::Srgb);
        let cut = Picture {
            height: 47,
            pixels: picture.pixels[..64 * 47].to_vec(),
            ..picture.clone()
        };
        assert_eq!(compare(&cut, &picture), None);
        let aside = Picture {
            corner: [1, 0],
            ..picture.clone()
        };
        assert_eq!(compare(&aside, &picture), None);
        assert!(compare(&picture, &picture).is_some(), "the control");
        let linear = self::picture(Encoding::Linear);
        assert_eq!(compare(&linear, &picture), None);
    }

    #[test]
    fn a_nan_is_the_worst_pixel_and_white_in_the_difference() {
        let b = picture(Encoding::Linear);
        let mut a = b.clone();
        a.pixels[3][2] = f32::NAN;
        a.pixels[4][3] = 0.5;
        a.pixels[5][0] += 0.125;
        let found = compare(&a, &b).expect("alike");
        assert_eq!((found.max, found.max_at), (f64::INFINITY, Some([3, 0])));
        let image = difference_image(&a, &b, 1.0);
        assert_eq!(image[3], [0, 0, 255]);
        assert_eq!(image[4], [128; 3]);
        assert_eq!(image[5], [32, 0, 0]);
        assert_eq!(image[6], [0; 3]);
        assert_eq!(difference_image(&a, &b, 4.0)[5], [128, 0, 0]);
    }

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

    #[test]
    fn a_tiny_picture_has_no_score_and_fails_a_limit_on_it() {
        let tiny = Picture {
            width: 2,
            height: 2,
            corner: [0, 0],
            pixels: vec![[0.5, 0.5, 0.5, 1.0]; 4],
            encoding: Encoding::Srgb,
        };
        let found = compare(&tiny, &tiny).expect("alike");
        assert_eq!(found.perceptual, None);
        assert!(found.faults(None).is_empty());
        let limits = PictureLimits {
            perceptual: Some(0.0),
            ..PictureLimits::default()
        };
        assert_eq!(found.faults(Some(&limits)).len(), 1);
    }
}
