//! 8-bit PNG with the view transform applied.

use std::{fs::File, io::BufReader, path::Path};

use rayon::prelude::*;

use super::super::RenderError;
use super::super::view::Display;
use super::{Attributes, Image, write_whole};
use swell_scene::look::ViewSpec;

/// Writes an 8-bit PNG of the display window, encoded as sRGB; it has an alpha channel, not
/// premultiplied, unless the picture is opaque.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be written, [`RenderError::Format`] if the picture
/// cannot be encoded.
pub fn write_png(path: &Path, image: &Image, view: &ViewSpec) -> Result<(), RenderError> {
    write(path, image, view, None)
}

/// Like [`write_png`], with the attributes as text chunks.
///
/// # Errors
/// As for [`write_png`].
pub fn write_png_with_attributes(
    path: &Path,
    image: &Image,
    view: &ViewSpec,
    attributes: &Attributes,
) -> Result<(), RenderError> {
    write(path, image, view, Some(attributes))
}

/// Pixels per parallel task of encoding.
const ROW: usize = 1024;

fn write(
    path: &Path,
    image: &Image,
    view: &ViewSpec,
    attributes: Option<&Attributes>,
) -> Result<(), RenderError> {
    let fault = |error: png::EncodingError| RenderError::Format {
        file: path.to_owned(),
        message: error.to_string(),
    };
    let shown = image.shown();
    let opaque = shown.iter().all(|pixel| pixel[3] >= 1.0 - 1e-6);
    let depth = if opaque { 3 } else { 4 };
    let display = Display::of(view);
    let mut pixels = vec![0; depth * shown.len()];
    let places = pixels.par_chunks_mut(depth * ROW);
    (places.zip(shown.par_chunks(ROW))).for_each(|(places, shown)| {
        for (place, &[r, g, b, a]) in places.chunks_exact_mut(depth).zip(shown) {
            let clear = if a > 0.0 { 1.0 / a } else { 0.0 };
            let [r, g, b] = display.bytes([r * clear, g * clear, b * clear]);
            let alpha = (f64::from(a).clamp(0.0, 1.0) * 255.0).round() as u8;
            place.copy_from_slice(&[r, g, b, alpha][..depth]);
        }
    });
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.display[0], image.display[1]);
    encoder.set_color(if opaque {
        png::ColorType::Rgb
    } else {
        png::ColorType::Rgba
    });
    encoder.set_depth(png::BitDepth::Eight);
    // Fast mode takes less time than the default and makes smaller files of rendered frames.
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    if let Some(attributes) = attributes {
        let frame = attributes.frame.to_string();
        let texts = attributes
            .texts()
            .into_iter()
            .chain([("frame", frame.as_str())]);
        for (name, value) in texts {
            encoder
                .add_itxt_chunk(name.to_owned(), value.to_owned())
                .map_err(fault)?;
        }
    }
    let mut writer = encoder.write_header().map_err(fault)?;
    writer.write_image_data(&pixels).map_err(fault)?;
    writer.finish().map_err(fault)?;
    write_whole(path, &bytes)
}

/// Reads the attributes of a PNG as far as it has them. Decodes the whole file, so that a truncated
/// one is an error.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be opened, [`RenderError::Format`] if it is not a
/// complete PNG.
pub fn read_png_attributes(path: &Path) -> Result<Attributes, RenderError> {
    let (mut reader, attributes) = open(path)?;
    let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
    reader
        .next_frame(&mut pixels)
        .map_err(|error| undecoded(path, &error))?;
    Ok(attributes)
}

/// Reads the attributes from a PNG's header only.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be opened, [`RenderError::Format`] if its header is
/// invalid.
pub(super) fn read_png_header(path: &Path) -> Result<Attributes, RenderError> {
    open(path).map(|(_, attributes)| attributes)
}

/// Reads width and height, the channels by their EXR names, and the bits per channel from a PNG's
/// header. The pixels of a palette count as RGB.
///
/// # Errors
/// As for `read_png_header`.
pub fn png_header(path: &Path) -> Result<([usize; 2], &'static [&'static str], u8), RenderError> {
    let (reader, _) = open(path)?;
    let info = reader.info();
    let channels: &[&str] = match info.color_type {
        png::ColorType::Grayscale => &["Y"],
        png::ColorType::GrayscaleAlpha => &["Y", "A"],
        png::ColorType::Rgb | png::ColorType::Indexed => &["R", "G", "B"],
        png::ColorType::Rgba => &["R", "G", "B", "A"],
    };
    let size = [info.width as usize, info.height as usize];
    Ok((size, channels, info.bit_depth as u8))
}

fn open(path: &Path) -> Result<(png::Reader<BufReader<File>>, Attributes), RenderError> {
    let file = File::open(path).map_err(|source| RenderError::Write {
        file: path.to_owned(),
        source,
    })?;
    let reader = png::Decoder::new(BufReader::new(file))
        .read_info()
        .map_err(|error| undecoded(path, &error))?;
    let mut attributes = Attributes::default();
    for chunk in &reader.info().utf8_text {
        let value = chunk.get_text().map_err(|error| undecoded(path, &error))?;
        if chunk.keyword == "frame" {
            attributes.frame = value.parse().unwrap_or(0);
        } else {
            attributes.set(&chunk.keyword, value);
        }
    }
    Ok((reader, attributes))
}

fn undecoded(path: &Path, error: &png::DecodingError) -> RenderError {
    RenderError::Format {
        file: path.to_owned(),
        message: error.to_string(),
    }
}
