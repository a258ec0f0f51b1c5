//! Decoding of picture files, including those of other programs, and a writer for plain 8-bit
//! pictures.

use std::path::Path;

use exr::prelude::read_first_rgba_layer_from_file;
use png::{BitDepth, ColorType, Transformations};

use super::super::RenderError;

/// Width, height, and the red, green, blue and alpha values of each pixel; rows begin at the top.
pub type Pixels = (usize, usize, Vec<[f32; 4]>);

fn fault(path: &Path, message: impl ToString) -> RenderError {
    RenderError::Format {
        file: path.to_owned(),
        message: message.to_string(),
    }
}

/// Reads the pixels of a PNG of any colour type, from 0 to 1 in the file's own encoding. Grey fills
/// all three colour channels; alpha is 1 where the file has none.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be opened, [`RenderError::Format`] if it is not a
/// complete PNG.
pub fn read_png(path: &Path) -> Result<Pixels, RenderError> {
    let file = std::fs::File::open(path).map_err(|source| RenderError::Write {
        file: path.to_owned(),
        source,
    })?;
    let mut decoder = png::Decoder::new(std::io::BufReader::new(file));
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| fault(path, error))?;
    let size = reader
        .output_buffer_size()
        .ok_or_else(|| fault(path, "too large"))?;
    let mut bytes = vec![0; size];
    let info = reader
        .next_frame(&mut bytes)
        .map_err(|error| fault(path, error))?;
    let channels = match info.color_type {
        ColorType::Grayscale => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
        ColorType::Indexed => return Err(fault(path, "its palette cannot be expanded")),
    };
    let bytes = &bytes[..info.buffer_size()];
    let values: Vec<f32> = match info.bit_depth {
        BitDepth::Sixteen => {
            let pairs = bytes.chunks_exact(2);
            pairs
                .map(|pair| f32::from(u16::from_be_bytes([pair[0], pair[1]])) / 65535.0)
                .collect()
        }
        _ => bytes.iter().map(|&byte| f32::from(byte) / 255.0).collect(),
    };
    let pixel = |values: &[f32]| match *values {
        [grey] => [grey, grey, grey, 1.0],
        [grey, alpha] => [grey, grey, grey, alpha],
        [r, g, b] => [r, g, b, 1.0],
        _ => [values[0], values[1], values[2], values[3]],
    };
    let pixels = values.chunks_exact(channels).map(pixel).collect();
    Ok((info.width as usize, info.height as usize, pixels))
}

/// Reads `R G B` and `A` (1 where missing) from the first layer of an EXR that has them, over the
/// whole data window. Returns the pixels and the position of the data window in the display window.
///
/// # Errors
/// [`RenderError::Format`] if the file cannot be opened, is not a complete EXR or has no such
/// layer.
pub fn read_exr(path: &Path) -> Result<(Pixels, [i32; 2]), RenderError> {
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| (size.0, vec![[0.0; 4]; size.area()]),
        |(width, pixels): &mut (usize, Vec<[f32; 4]>), at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.1 * *width + at.0] = [r, g, b, a];
        },
    )
    .map_err(|error| fault(path, error))?;
    let layer = image.layer_data;
    let (size, begins) = (layer.size, layer.attributes.layer_position);
    let shown = image.attributes.display_window.position;
    let pixels = (size.0, size.1, layer.channel_data.pixels.1);
    Ok((pixels, [begins.0 - shown.0, begins.1 - shown.1]))
}

/// Writes an 8-bit RGB PNG without a colour space, with `comment` as a text chunk.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be written, [`RenderError::Format`] if the pixels
/// cannot be encoded.
pub fn write_rgb_png(
    path: &Path,
    size: [usize; 2],
    pixels: &[[u8; 3]],
    comment: &str,
) -> Result<(), RenderError> {
    let [width, height] = size.map(|side| side as u32);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder
        .add_itxt_chunk("Comment".to_owned(), comment.to_owned())
        .map_err(|error| fault(path, error))?;
    let mut writer = encoder.write_header().map_err(|error| fault(path, error))?;
    writer
        .write_image_data(pixels.as_flattened())
        .map_err(|error| fault(path, error))?;
    writer.finish().map_err(|error| fault(path, error))?;
    super::write_whole(path, &bytes)
}
