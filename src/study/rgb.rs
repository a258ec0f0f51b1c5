//! Pictures with 8 bits per channel, as a screen shows them.

use png::{BitDepth, ColorType, EncodingError};

/// A picture without alpha, sRGB-encoded; rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgb {
    /// Columns and rows, each at least 1.
    pub size: [usize; 2],
    /// Red, green, blue; `size[0] × size[1]` pixels.
    pub pixels: Vec<[u8; 3]>,
}

impl Rgb {
    /// A picture filled with one colour.
    pub fn filled(size: [usize; 2], colour: [u8; 3]) -> Self {
        Self {
            size,
            pixels: vec![colour; size[0] * size[1]],
        }
    }

    /// Scales `size` down to at most `width` columns, keeping the aspect ratio.
    pub fn within(size: [usize; 2], width: usize) -> [usize; 2] {
        let [columns, rows] = size;
        if columns <= width {
            return size;
        }
        let scaled = (rows as f64 * width as f64 / columns as f64).round() as usize;
        [width, scaled.max(1)]
    }

    /// The picture in another size: each pixel is the area-weighted mean of the encoded values that
    /// it covers, as browsers do it.
    #[must_use]
    pub fn resized(&self, size: [usize; 2]) -> Self {
        if size == self.size {
            return self.clone();
        }
        let [columns, rows] = self.size;
        let (across, down) = (covers(columns, size[0]), covers(rows, size[1]));
        let mut narrow = vec![[0.0f32; 3]; size[0] * rows];
        for (row, line) in narrow.chunks_exact_mut(size[0]).enumerate() {
            let source = &self.pixels[row * columns..][..columns];
            for (pixel, cover) in line.iter_mut().zip(&across) {
                *pixel = cover.mean(|at| source[at].map(f32::from));
            }
        }
        let pixel = |k: usize| {
            let (row, column) = (k / size[0], k % size[0]);
            let mean = down[row].mean(|at| narrow[at * size[0] + column]);
            mean.map(|x| x.round() as u8)
        };
        Self {
            size,
            pixels: (0..size[0] * size[1]).map(pixel).collect(),
        }
    }

    /// Copies another picture in with its upper left corner at `[column, row]`, clipped to this
    /// picture.
    pub fn paste(&mut self, other: &Self, [left, top]: [usize; 2]) {
        let [columns, rows] = self.size;
        let width = other.size[0].min(columns.saturating_sub(left));
        for row in 0..other.size[1].min(rows.saturating_sub(top)) {
            let from = &other.pixels[row * other.size[0]..][..width];
            self.pixels[(top + row) * columns + left..][..width].copy_from_slice(from);
        }
    }

    /// This picture with another one to its right; black fills the rest if their heights differ.
    #[must_use]
    pub fn beside(&self, other: &Self) -> Self {
        let size = [
            self.size[0] + other.size[0],
            self.size[1].max(other.size[1]),
        ];
        let mut both = Self::filled(size, [0; 3]);
        both.paste(self, [0, 0]);
        both.paste(other, [self.size[0], 0]);
        both
    }

    /// Encodes the picture as PNG, tagged as sRGB and with the name of the program.
    ///
    /// # Errors
    /// A side longer than PNG allows.
    pub fn to_png(&self, software: &str) -> Result<Vec<u8>, EncodingError> {
        let [width, height] = self.size.map(|side| side as u32);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.add_text_chunk("Software".to_owned(), software.to_owned())?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// Source pixels that one new pixel covers: the index of the first, and weights that add up to 1.
struct Cover {
    first: usize,
    weights: Vec<f32>,
}

impl Cover {
    fn mean(&self, at: impl Fn(usize) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (k, weight) in self.weights.iter().enumerate() {
            let value = at(self.first + k);
            for (total, part) in sum.iter_mut().zip(value) {
                *total += weight * part;
            }
        }
        sum
    }
}

/// The source pixels that each of `to` pixels covers, of `from` along one axis.
fn covers(from: usize, to: usize) -> Vec<Cover> {
    let step = from as f64 / to as f64;
    let cover = |k: usize| {
        let (begin, end) = (k as f64 * step, ((k + 1) as f64 * step).min(from as f64));
        let first = (begin.floor() as usize).min(from - 1);
        let last = (end.ceil() as usize).clamp(first + 1, from);
        let part = |at: usize| (end.min((at + 1) as f64) - begin.max(at as f64)).max(0.0);
        let whole: f64 = (first..last).map(part).sum();
        Cover {
            first,
            weights: (first..last).map(|at| (part(at) / whole) as f32).collect(),
        }
    };
    (0..to).map(cover).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp(size: [usize; 2]) -> Rgb {
        let pixel = |k: usize| [(k % size[0] * 40) as u8, (k / size[0] * 20) as u8, 7];
        Rgb {
            size,
            pixels: (0..size[0] * size[1]).map(pixel).collect(),
        }
    }

    #[test]
    fn a_smaller_picture_is_the_mean_of_what_it_covers() {
        // Halves: columns 0 and 1 have the mean 20, 2 and 3 have 100; rows 0 and 1 have 10.
        let half = ramp([4, 2]).resized([2, 1]);
        assert_eq!(half.pixels, [[20, 10, 7], [100, 10, 7]]);
        // Thirds of four: the first covers column 0 and a third of column 1: 40 · (1/3) / (4/3) =
        // 10.
        let third = ramp([4, 1]).resized([3, 1]);
        assert_eq!(
            third.pixels.iter().map(|p| p[0]).collect::<Vec<_>>(),
            [10, 60, 110]
        );
        // Enlarging repeats pixels, and the same size gives the same picture.
        assert_eq!(
            ramp([2, 1]).resized([4, 1]).pixels[..3],
            [[0, 0, 7], [0, 0, 7], [40, 0, 7]]
        );
        assert_eq!(ramp([5, 3]).resized([5, 3]), ramp([5, 3]));
        assert_eq!(Rgb::within([1920, 1080], 1280), [1280, 720]);
        assert_eq!(Rgb::within([320, 180], 1280), [320, 180]);
        assert_eq!(Rgb::within([4000, 1], 100), [100, 1]);
    }

    #[test]
    fn pictures_stand_where_they_are_put_and_are_cut_at_the_edge() {
        let mut all = Rgb::filled([4, 3], [1; 3]);
        all.paste(&ramp([3, 3]), [2, 1]);
        assert_eq!(all.pixels[4..8], [[1; 3], [1; 3], [0, 0, 7], [40, 0, 7]]);
        assert_eq!(all.pixels[..4], [[1; 3]; 4]);
        let both = ramp([2, 2]).beside(&ramp([1, 2]));
        assert_eq!(both.size, [3, 2]);
        assert_eq!(both.pixels[2..5], [[0, 0, 7], [0, 20, 7], [40, 20, 7]]);
    }

    #[test]
    fn a_png_holds_the_same_pixels() {
        let picture = ramp([5, 3]);
        let bytes = picture.to_png("a test").unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
            .read_info()
            .unwrap();
        let mut read = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut read).unwrap();
        assert_eq!(read, picture.pixels.as_flattened());
        assert_eq!(reader.info().uncompressed_latin1_text[0].text, "a test");
    }
}
