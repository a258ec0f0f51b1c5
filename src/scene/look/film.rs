//! The part of the film that the image shows if their aspect ratios differ.
//!
//! The names are those of Maya's film fit. USD's `aspectRatioConformPolicy` has the same four
//! policies; Houdini's cameras always use the width. As there, the image is centred on the film.

use super::{FitSpec, Look};

/// Fit of an image to films of any aspect ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Framing {
    fit: FitSpec,
    /// Width and height of the image, pixels.
    image: [f64; 2],
}

impl Framing {
    /// Creates the framing of an image with this width and height in pixels.
    pub fn new(fit: FitSpec, image: [u32; 2]) -> Self {
        Self {
            fit,
            image: image.map(f64::from),
        }
    }

    /// Returns width over height of the image.
    pub(super) fn shape(&self) -> f64 {
        self.image[0] / self.image[1]
    }

    /// Returns the width and height of the image on a film of the given size, in its unit.
    pub fn shown(&self, [width, height]: [f64; 2]) -> [f64; 2] {
        let [columns, rows] = self.image;
        let is_film_wider = width * rows > height * columns;
        let is_by_width = match self.fit {
            FitSpec::Width => true,
            FitSpec::Height => false,
            FitSpec::Fill => !is_film_wider,
            FitSpec::Overscan => is_film_wider,
        };
        match is_by_width {
            true => [width, width * rows / columns],
            false => [height * columns / rows, height],
        }
    }
}

impl Look {
    /// Returns the width and height of the image on the look's film, mm.
    pub fn film_mm(&self) -> [f64; 2] {
        let framing = self.framing(FitSpec::Width);
        framing.shown(self.spec.camera.film_back_mm)
    }

    /// Returns the framing for a camera file. Without `camera.fit`, film and image have the same
    /// aspect ratio and the file's vertical field of view decides.
    pub fn framing_of_file(&self) -> Framing {
        self.framing(FitSpec::Height)
    }

    /// Converts a focal length from mm to pixels of the image.
    pub fn focal_px(&self, focal_length_mm: f64) -> f64 {
        focal_length_mm / self.film_mm()[0] * f64::from(self.spec.image.width)
    }

    fn framing(&self, left_out: FitSpec) -> Framing {
        let image = &self.spec.image;
        let fit = self.spec.camera.fit.unwrap_or(left_out);
        Framing::new(fit, [image.width, image.height])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Film of 36 × 24 mm, and film twice as wide as high, under a 16:9 image, compared with the
    /// table in `docs/look.md`.
    #[test]
    fn an_image_lies_on_film_as_the_fit_says() {
        let near = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        let narrow = [36.0, 24.0];
        let wide = [36.0, 18.0];
        for (fit, on_narrow, on_wide) in [
            (FitSpec::Width, [36.0, 20.25], [36.0, 20.25]),
            (FitSpec::Height, [128.0 / 3.0, 24.0], [32.0, 18.0]),
            (FitSpec::Fill, [36.0, 20.25], [32.0, 18.0]),
            (FitSpec::Overscan, [128.0 / 3.0, 24.0], [36.0, 20.25]),
        ] {
            let framing = Framing::new(fit, [1920, 1080]);
            for (film, expected) in [(narrow, on_narrow), (wide, on_wide)] {
                let found = framing.shown(film);
                assert!(near(found, expected), "{fit:?} {film:?}: {found:?}");
                // The image is within the film or covers it; both only if the aspect
                // ratios are equal.
                let is_within = found[0] <= film[0] + 1e-12 && found[1] <= film[1] + 1e-12;
                let holds = found[0] >= film[0] - 1e-12 && found[1] >= film[1] - 1e-12;
                assert!(fit != FitSpec::Fill || (is_within && !holds), "{film:?}");
                assert!(
                    fit != FitSpec::Overscan || (holds && !is_within),
                    "{film:?}"
                );
            }
        }
    }
}
