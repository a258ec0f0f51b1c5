//! Pictures embedded in a page: reduced in size, and encoded as text.

use base64::{Engine, engine::general_purpose::STANDARD};
use png::{BitDepth, ColorType};

/// Widest picture in a page, pixels; a wider one is reduced by an integer factor.
const MAX_WIDTH: u32 = 640;

/// Why a picture cannot be embedded in a page.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// It is not a PNG, or a truncated one.
    #[error(transparent)]
    Decode(#[from] png::DecodingError),
    /// The reduced picture cannot be encoded.
    #[error(transparent)]
    Encode(#[from] png::EncodingError),
    /// It does not have the format that our renderer writes.
    #[error("it is not an 8-bit RGB or RGBA picture")]
    Kind,
}

/// Encodes a PNG as a `data:` URI for an `<img>`, reduced to at most 640 pixels of width.
///
/// # Errors
/// [`PictureError`].
pub fn data_uri(png_bytes: &[u8]) -> Result<String, PictureError> {
    let reduced = reduced(png_bytes)?;
    let bytes = reduced.as_deref().unwrap_or(png_bytes);
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(bytes)))
}

/// The reduced picture; `None` if it is small enough already.
fn reduced(png_bytes: &[u8]) -> Result<Option<Vec<u8>>, PictureError> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png_bytes)).read_info()?;
    let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
    let info = reader.next_frame(&mut pixels)?;
    let channels = match (info.color_type, info.bit_depth) {
        (ColorType::Rgb, BitDepth::Eight) => 3,
        (ColorType::Rgba, BitDepth::Eight) => 4,
        _ => return Err(PictureError::Kind),
    };
    let factor = info.width.div_ceil(MAX_WIDTH) as usize;
    let size = [info.width as usize / factor, info.height as usize / factor];
    if factor == 1 || size.contains(&0) {
        return Ok(None);
    }
    let stride = info.width as usize * channels;
    let mean = |x: usize, y: usize, channel: usize| {
        let at = |k: usize| {
            let (dx, dy) = (k % factor, k / factor);
            let place = (y * factor + dy) * stride + (x * factor + dx) * channels + channel;
            u32::from(pixels[place])
        };
        let count = factor * factor;
        ((0..count).map(at).sum::<u32>() as f64 / count as f64).round() as u8
    };
    let small: Vec<u8> = (0..size[0] * size[1] * channels)
        .map(|k| {
            let pixel = k / channels;
            mean(pixel % size[0], pixel / size[0], k % channels)
        })
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0] as u32, size[1] as u32);
    encoder.set_color(info.color_type);
    encoder.set_depth(BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&small)?;
    writer.finish()?;
    Ok(Some(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(ColorType::Rgb);
        let pixels: Vec<u8> = (0..width * height)
            .flat_map(|k| [(k % width % 2 * 200) as u8, 7, (k / width) as u8])
            .collect();
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&pixels).unwrap();
        writer.finish().unwrap();
        bytes
    }

    #[test]
    fn wide_pictures_are_averaged_and_narrow_ones_left() {
        assert_eq!(reduced(&picture(640, 3)).unwrap(), None);
        let small = reduced(&picture(1281, 7)).unwrap().expect("reduced");
        let mut reader = png::Decoder::new(std::io::Cursor::new(&small))
            .read_info()
            .unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (427, 2));
        // The mean of columns 0, 200, 0 and rows 0, 1, 2.
        assert_eq!(pixels[..3], [67, 7, 1]);
        assert!(data_uri(b"no picture").is_err());
        // The signature of a PNG.
        let uri = data_uri(&picture(2, 2)).unwrap();
        assert!(
            uri.starts_with("data:image/png;base64,iVBORw0KGgo"),
            "{uri}"
        );
    }
}
