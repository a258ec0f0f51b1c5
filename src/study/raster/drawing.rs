//! Rendering by resvg.

use std::sync::Arc;

use resvg::{tiny_skia, usvg};

use swell_domain::feature::MissingFeature;

use super::RasterError;
use crate::rgb::Rgb;

/// Pixels per unit of the drawing.
const SCALE: f32 = 2.0;

/// Checks that this build can render charts, so that a job fails before its work begins.
///
/// # Errors
/// [`MissingFeature`] without the feature `charts`.
pub fn require() -> Result<(), MissingFeature> {
    Ok(())
}

/// Renders `svg` as PNG with two pixels per unit. Text is in Ubuntu Light, with Hack for missing
/// glyphs.
///
/// # Errors
/// [`RasterError`].
pub fn png(svg: &str) -> Result<Vec<u8>, RasterError> {
    let picture = drawn(svg, SCALE)?;
    picture
        .encode_png()
        .map_err(|error| RasterError::Png(error.to_string()))
}

/// Renders `svg` as pixels, one per unit, in the same fonts; over black where it is transparent.
///
/// # Errors
/// [`RasterError`].
pub fn rgb(svg: &str) -> Result<Rgb, RasterError> {
    let picture = drawn(svg, 1.0)?;
    let pixels = picture.pixels().iter();
    Ok(Rgb {
        size: [picture.width(), picture.height()].map(|side| side as usize),
        pixels: pixels.map(|p| [p.red(), p.green(), p.blue()]).collect(),
    })
}

fn drawn(svg: &str, scale: f32) -> Result<tiny_skia::Pixmap, RasterError> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let family = fonts
        .faces()
        .next()
        .and_then(|face| face.families.first())
        .map(|(name, _)| name.clone());
    fonts.load_font_data(epaint_default_fonts::HACK_REGULAR.to_vec());
    if let Some(family) = family {
        fonts.set_sans_serif_family(family);
    }
    let options = usvg::Options {
        fontdb: Arc::new(fonts),
        ..usvg::Options::default()
    };
    let tree =
        usvg::Tree::from_str(svg, &options).map_err(|error| RasterError::Svg(error.to_string()))?;
    let size = tree
        .size()
        .to_int_size()
        .scale_by(scale)
        .ok_or_else(|| RasterError::Png("its size".into()))?;
    let mut picture = tiny_skia::Pixmap::new(size.width(), size.height())
        .ok_or_else(|| RasterError::Png(format!("{} × {}", size.width(), size.height())))?;
    let scale = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&tree, scale, &mut picture.as_mut());
    Ok(picture)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of dark pixels of a white drawing with `inside`.
    fn dark(inside: &str) -> usize {
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 200 40\" \
             font-family=\"sans-serif\" font-size=\"20\"><rect width=\"100%\" height=\"100%\" \
             fill=\"#fff\"/>{inside}</svg>"
        );
        let bytes = png(&svg).expect("a picture");
        let picture = tiny_skia::Pixmap::decode_png(&bytes).expect("a PNG");
        assert_eq!((picture.width(), picture.height()), (400, 80));
        picture.pixels().iter().filter(|p| p.red() < 128).count()
    }

    #[test]
    fn text_is_drawn() {
        // A letter 40 pixels high has strokes of about 3: some hundred dark pixels each.
        let text = dark("<text x=\"10\" y=\"28\">‖p − p64‖</text>");
        assert!(text > 300, "{text}");
        let more = dark("<text x=\"10\" y=\"28\">‖p − p64‖ mm</text>");
        assert!(more > text + 50, "{more} {text}");
        // Negative control: no text, no dark pixels.
        assert_eq!(dark("<text x=\"10\" y=\"28\"></text>"), 0);
    }

    #[test]
    fn the_same_drawing_gives_the_same_bytes() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><text \
                   y=\"8\">a</text></svg>";
        assert_eq!(png(svg).expect("a picture"), png(svg).expect("a picture"));
        assert!(matches!(png("<svg"), Err(RasterError::Svg(_))));
    }
}
